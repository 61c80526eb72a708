"""Where and how a record of the two-channel tumble was taken."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from gyrobench import drift
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.drift.pulses import Pulses
from gyrobench.reduction.setup import run_metadata, setups

from . import geometry

OTHER = {"x": "y", "y": "x"}  # the torquer that measures a channel stands about the other axis


@dataclass(frozen=True, kw_only=True)
class TwoChannelSetup(setups.TurningSetup):
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


def setup_of(run: RunDocument) -> TwoChannelSetup:
    """Return the setup a run.json describes: options, plan and the parameters of the parts (slot.name, SI).

    Scale factors: options ``k_x``, ``k_y``, else the gyro's parameters.  Truth only where the gyro has coefficients.
    """
    model = str(run.options.get("model", "nine"))
    return TwoChannelSetup.of_plan(
        run,
        geometry.faces(model, run_metadata.Site.of(run).latitude),
        k={
            a: run_metadata.number(run, f"k_{a}", f"gyro.k_{a}", f"scale factor of the torquer about {a}") for a in "xy"
        },
        model=model,
        truth=run_metadata.truth_of(run, (n for c in "xy" for n in drift.NAMES_2DOF[c])),
        quantum={a: float(run.parameters.get(f"rebalance_{a}.resolution", 0.0)) for a in "xy"},
        pulses={a: Pulses.of(run, f"rebalance_{a}") for a in "xy"},
    )
