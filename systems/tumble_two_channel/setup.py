"""Where and how a record of the two-channel tumble was taken, and its design matrix."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gyrobench import drift, frames
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction import run_metadata
from gyrobench.reduction.drift import window_regressors
from gyrobench.result import Specification

from . import geometry

Array = NDArray[np.float64]
SIZES = ("u_axis", "u_mount", "u_angle1", "u_angle2", "u_scale_factor", "u_nonlinearity", "u_current")
OTHER = {"x": "y", "y": "x"}  # the torquer that measures a channel stands about the other axis


@dataclass(frozen=True)
class TwoChannelSetup:
    """Where and how the record was taken; SI throughout, matrices with rows = axes.

    k: scale factors of the torquers about x and y, rad/s/A.  faces: phase -> gyro axes x, y, z in table axes.  model:
    simple or nine.  modes: phase -> "rate" or "dwell".  truth: simulated coefficients, rad/s per g0^n.  fold: Dx_yy and
    Dy_xx may be there and are folded into others.  tilt: the tilts of the measuring axes towards the spin axis are
    estimated.  u_*: standard uncertainties of type B (u_nonlinearity: relative, at the largest current).  quantum:
    resolution of each current reading.  polarity: "project" k i = omega_IA - omega_d, "book" k i = omega_d - omega_IA.
    """

    latitude: float
    gravity: float
    k: Mapping[str, float]
    faces: Mapping[int, Array]
    modes: Mapping[int, str]
    model: str = "nine"
    earth_rate: float = frames.EARTH_RATE
    base: Array = field(default_factory=lambda: np.empty((0, 0)))  # empty: table axis on the pole
    labels: Mapping[int, str] = field(default_factory=dict)
    truth: Mapping[str, float] | None = None
    fold: bool = False
    tilt: bool = False
    specification: Specification | None = None
    u_axis: float = 0.0
    u_mount: float = 0.0
    u_angle1: float = 0.0
    u_angle2: float = 0.0
    u_scale_factor: float = 0.0
    u_nonlinearity: float = 0.0
    u_current: float = 0.0
    quantum: Mapping[str, float] = field(default_factory=dict)
    polarity: str = "project"
    instrument: str = ""

    def __post_init__(self) -> None:
        if np.size(self.base) == 0 and math.isfinite(self.latitude) and abs(self.latitude) <= math.pi / 2:
            object.__setattr__(self, "base", frames.polar_base(self.latitude))

    def label(self, phase: int) -> str:
        return self.labels.get(phase, f"phase {phase}")

    def turns(self, phase: int) -> bool:
        return self.modes[phase] == "rate"

    def names(self, channel: str) -> tuple[str, ...]:
        """The unknowns of a channel."""
        return (*geometry.terms(self.model, channel), *((geometry.TILT[channel],) if self.tilt else ()))


def design(s: TwoChannelSetup, channel: str, turning: window_regressors.Turning, base: Array | None = None) -> Array:
    """Window means (n, p) of the regressors; the column of a tilt is minus the rate along z, rad/s."""
    base = s.base if base is None else base
    X = window_regressors.regressors(turning, base, s.gravity, geometry.terms(s.model, channel))
    if not s.tilt:
        return X
    return np.column_stack([X, -window_regressors.axis_rate(turning, base, s.latitude, s.earth_rate, 2)])


def setup_of(run: RunDocument, specification: Specification | None = None) -> TwoChannelSetup:
    """The setup a run.json describes: options, plan and the parameters of the parts (slot.name, SI).

    Scale factors: options ``k_x``, ``k_y``, else the gyro's parameters.  Truth only where the gyro has coefficients.
    """
    options, parameters = run.options, run.parameters
    site, model = run_metadata.Site.of(run), str(options.get("model", "nine"))
    ideal = geometry.faces(model, site.latitude)
    plan = run_metadata.phases(run, ideal)
    return TwoChannelSetup(
        latitude=site.latitude,
        gravity=site.gravity,
        k={
            a: run_metadata.number(run, f"k_{a}", f"gyro.k_{a}", f"scale factor of the torquer about {a}") for a in "xy"
        },
        faces={p: ideal[row.face] for p, row in plan.items()},
        modes={p: "rate" if row.mode == "rate" else "dwell" for p, row in plan.items()},
        model=model,
        earth_rate=site.earth_rate,
        labels={p: row.label for p, row in plan.items()},
        truth=run_metadata.truth_of(run, (n for c in "xy" for n in drift.NAMES_2DOF[c])),
        fold=bool(options.get("fold", False)),
        tilt=bool(options.get("tilt", False)),
        specification=specification,
        quantum={a: float(parameters.get(f"rebalance_{a}.resolution", 0.0)) for a in "xy"},
        polarity=run.polarity or "project",
        instrument=run.instrument,
        **run_metadata.sizes(run.options, SIZES),
    )
