"""Where and how a tumble was recorded: what the reduction must know beside the windows."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gyrobench import drift, frames
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction import run_metadata
from gyrobench.result import Specification

Array = NDArray[np.float64]
SIZES = (
    "u_axis", "u_mount", "u_wobble", "u_angle1", "u_angle2", "u_scale_factor", "u_nonlinearity", "u_current",
)  # fmt: skip


@dataclass(frozen=True)
class TumbleSetup:
    """Where and how the record was taken; SI throughout, matrices with rows = axes.

    k: torquer scale factor, rad/s/A.  base: table axes in (E, N, U) at angle 0.  faces: phase -> gyro axes I, O, S in
    table axes.  modes: phase -> "rate" or "dwell" (None: by the direction of the output axis).  truth: simulated
    coefficients, rad/s per g0^n.  fold: D_OO may be there and is folded into others.  tilt: the small angle of the
    input axis towards the output axis is estimated too (D_O then rests on the dwells).  specification: name -> limits
    in surface units.  u_*: standard uncertainties of type B; u_nonlinearity: relative, at the largest current of the
    record; quantum: resolution of the current reading.  polarity: "project" k i = omega_IA - omega_d, or "book"
    k i = omega_d - omega_IA.
    """

    latitude: float
    gravity: float
    k: float
    faces: Mapping[int, Array]
    earth_rate: float = frames.EARTH_RATE
    base: Array = field(default_factory=lambda: np.empty((0, 0)))  # empty: table axis on the pole
    labels: Mapping[int, str] = field(default_factory=dict)
    modes: Mapping[int, str] | None = None
    truth: Mapping[str, float] | None = None
    terms: int = 9
    fold: bool = False
    tilt: bool = False
    specification: Specification | None = None
    u_axis: float = 0.0
    u_mount: float = 0.0
    u_wobble: float = 0.0
    u_angle1: float = 0.0
    u_angle2: float = 0.0
    u_scale_factor: float = 0.0
    u_nonlinearity: float = 0.0
    u_current: float = 0.0
    quantum: float = 0.0
    polarity: str = "project"
    instrument: str = ""

    def __post_init__(self) -> None:
        if np.size(self.base) == 0 and math.isfinite(self.latitude) and abs(self.latitude) <= math.pi / 2:
            object.__setattr__(self, "base", frames.polar_base(self.latitude))

    def label(self, phase: int) -> str:
        return self.labels.get(phase, f"phase {phase}")

    def turns(self, phase: int) -> bool:
        """True where the table turns: by ``modes``, or where the output axis is nearer to its axis than to the
        vertical.
        """
        if self.modes is not None and phase in self.modes:
            return self.modes[phase] == "rate"
        output = np.asarray(self.faces[phase])[1]
        return bool(abs(output[2]) >= abs(output @ (np.asarray(self.base) @ frames.U)))


def setup_of(run: RunDocument, specification: Specification | None = None) -> TumbleSetup:
    """The setup a run.json describes: options, plan and the parameters of the parts (slot.name, SI).

    Scale factor: option ``k``, else the gyro's parameter ``k``.  Truth only where the gyro part has the coefficients.
    """
    options, parameters = dict(run.options), dict(run.parameters)
    site = run_metadata.Site.of(run)
    ideal = frames.tumble_faces(site.latitude)
    plan = run_metadata.phases(run, ideal)
    return TumbleSetup(
        latitude=site.latitude,
        gravity=site.gravity,
        k=run_metadata.number(run, "k", "gyro.k", "torquer scale factor"),
        faces={p: ideal[row.face] for p, row in plan.items()},
        earth_rate=site.earth_rate,
        labels={p: row.label for p, row in plan.items()},
        modes={p: "rate" if row.mode == "rate" else "dwell" for p, row in plan.items()},
        truth=run_metadata.truth_of(run, drift.NAMES),
        terms=int(options.get("terms", 9)),
        fold=bool(options.get("fold", False)),
        tilt=bool(options.get("tilt", False)),
        specification=specification,
        quantum=float(parameters.get("rebalance.resolution", 0.0)),
        polarity=run.polarity or "project",
        instrument=run.instrument,
        **run_metadata.sizes(run.options, SIZES),
    )
