"""Where and how a record of the two-channel tumble was taken, and its design matrix."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from gyrobench import drift
from gyrobench.arrays import Array
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.drift import window_regressors
from gyrobench.reduction.drift.pulses import Pulses
from gyrobench.reduction.setup import run_metadata, setups
from gyrobench.result import Specification

from . import geometry

OTHER = {"x": "y", "y": "x"}  # the torquer that measures a channel stands about the other axis


@dataclass(frozen=True, kw_only=True)
class TwoChannelSetup(setups.TumbleSetup):
    """k: scale factors of the torquers about x and y, rad/s/A.  model: simple or nine.  fold: Dx_yy and Dy_xx may be
    there and are folded into others.  tilt: those of the measuring axes towards the spin axis.
    quantum: resolution of each current reading.  pulses: of pulse-width rebalances, by the torquer's axis.
    """

    k: Mapping[str, float]
    model: str = "nine"
    quantum: Mapping[str, float] = field(default_factory=dict)
    pulses: Mapping[str, Pulses | None] = field(default_factory=dict)
    u_pulse: float = 0.0
    u_switching: float = 0.0

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
    """Return the setup a run.json describes: options, plan and the parameters of the parts (slot.name, SI).

    Scale factors: options ``k_x``, ``k_y``, else the gyro's parameters.  Truth only where the gyro has coefficients.
    """
    model = str(run.options.get("model", "nine"))
    return TwoChannelSetup.of_plan(
        run,
        specification,
        geometry.faces(model, run_metadata.Site.of(run).latitude),
        k={
            a: run_metadata.number(run, f"k_{a}", f"gyro.k_{a}", f"scale factor of the torquer about {a}") for a in "xy"
        },
        model=model,
        truth=run_metadata.truth_of(run, (n for c in "xy" for n in drift.NAMES_2DOF[c])),
        quantum={a: float(run.parameters.get(f"rebalance_{a}.resolution", 0.0)) for a in "xy"},
        pulses={a: Pulses.of(run, f"rebalance_{a}") for a in "xy"},
    )
