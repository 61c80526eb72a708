"""Where and how a tumble was recorded: what the reduction must know beside the windows."""

from __future__ import annotations

from dataclasses import dataclass

from gyrobench import drift, frames
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.drift.pulses import Pulses
from gyrobench.reduction.setup import run_metadata, setups


@dataclass(frozen=True, kw_only=True)
class TumbleSetup(setups.TurningSetup):
    """k: torquer scale factor, rad/s/A.  terms: of the model.  quantum: resolution of the current reading.

    tilt: the small angle of the input axis towards the output axis (where it is estimated D_O rests on the dwells).
    pulses: those of a pulse-width rebalance, where the current was counted.
    """

    k: float
    terms: int = 9
    quantum: float = 0.0
    pulses: Pulses | None = None
    u_pulse: float = 0.0
    u_switching: float = 0.0


def setup_of(run: RunDocument) -> TumbleSetup:
    """Return the setup a run.json describes: options, plan and the parameters of the parts (slot.name, SI).

    Scale factor: option ``k``, else the gyro's parameter ``k``.  Truth only where the gyro part has the coefficients.
    """
    return TumbleSetup.of_plan(
        run,
        frames.tumble_faces(run_metadata.Site.of(run).latitude),
        k=run_metadata.number(run, "k", "gyro.k", "torquer scale factor"),
        truth=run_metadata.truth_of(run, drift.NAMES),
        terms=int(run.options.get("terms", 9)),
        quantum=float(run.parameters.get("rebalance.resolution", 0.0)),
        pulses=Pulses.of(run),
    )
