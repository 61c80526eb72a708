"""Where and how a tumble was recorded: what the reduction must know beside the windows."""

from __future__ import annotations

from dataclasses import dataclass

from gyrobench import frames
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.drift.drift_terms import OneLoopSetup
from gyrobench.reduction.setup import run_metadata, setups


@dataclass(frozen=True, kw_only=True)
class TumbleSetup(setups.TurningSetup, OneLoopSetup):
    """terms: of the model.

    tilt: the small angle of the input axis towards the output axis (where it is estimated D_O rests on the dwells).
    """

    terms: int = 9


def setup_of(run: RunDocument) -> TumbleSetup:
    """Return the setup a run.json describes: options, plan and the parameters of the parts (slot.name, SI).

    Scale factor: option ``k``, else the gyro's parameter ``k``.  Truth only where the gyro part has the coefficients.
    """
    faces = frames.tumble_faces(run_metadata.Site.of(run).latitude)
    return TumbleSetup.of_plan(run, faces, terms=int(run.options.get("terms", 9)))
