"""Position sensitivity of a flexure or gas-bearing gyro: drift by the angle at which its loops hold the rotor."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gyrobench import drift
from gyrobench.attitudes import attitude_problems, parse
from gyrobench.system.connectors import Socket, inp, out
from gyrobench.system.families.option_groups import ATTITUDE, CORRECTIONS, NUISANCES, SITE, type_b
from gyrobench.system.families.physical_form import PHYSICAL_FORM
from gyrobench.system.families.rebalance_test import TwoChannelTest
from gyrobench.system.families.table_test import TABLE, sampled
from gyrobench.system.part_values import PartValues
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.system import Option, Slot, Windows

from . import sources
from .measured import MEASURED

FACE = "service attitude"
OFFSET = Socket(
    "PickoffOffset",
    "voltage added to a pickoff",
    (
        inp("u", "V", "pickoff voltage"),
        inp("angle", "", "angle at which the rotor is to be held, rad"),
        inp("mode", "1", "mode of the table", whole=True),
        out("u_out", "V", "pickoff voltage with the offset"),
    ),
)
#: 1/s: of the gyro, unless others are given
SPRINGS = {"K_q": 0.01, "K_phi": 0.002}
#: offsets of a cycle, in units of the option: about x, about y
CYCLE = ((0, 0), (1, 0), (-1, 0), (0, 0), (0, 1), (0, -1))
#: the pickoff about x is nulled by the loop that feeds the torquer about y
WIRES = f"""
    {TABLE}
    table -> gyro: omega f
    gyro -> offset_x: u_x=u
    gyro -> offset_y: u_y=u
    sequencer -> offset_x: target=angle mode
    sequencer -> offset_y: target_y=angle mode
    offset_y -> rebalance_x: u_out=u
    offset_x -> rebalance_y: u_out=u
    offset_x.u_out -> rebalance_x.u_cross
    offset_y.u_out -> rebalance_y.u_cross
    rebalance_x -> gyro: i=i_x
    rebalance_y -> gyro: i=i_y
    rebalance_x -> sampler_x: i_read=x saturated=flag
    rebalance_y -> sampler_y: i_read=x saturated=flag
    gyro -> angle_x: u_x=x saturated=flag
    gyro -> angle_y: u_y=x saturated=flag
    {sampled("sampler_x")}
    {sampled("sampler_y")}
    {sampled("angle_x")}
    {sampled("angle_y")}
"""


class PositionSensitivity(TwoChannelTest):
    """The gyro is at rest in its service attitude, both channels in rebalance.  A voltage added to one pickoff after
    the other makes the loops hold the rotor off its null; the currents against the angles give the quadrature and the
    in-phase stiffness of each channel, and so the null offset and the loop gain that keep them harmless.

    [TEST-POSITION, GYRO-POSITION; Hu 1981, eq. 5-67, 5-68]
    """

    title = "Position sensitivity test"
    spec = ("TEST-POSITION", "GYRO-POSITION", "GYRO-DYN-2DOF", "GYRO-STATIC-2DOF", "LOOP-REBALANCE")
    slots = {
        **TwoChannelTest.with_parts(
            table="table_rate", gyro="gyro_2dof", rebalance_x="rebalance_analog", rebalance_y="rebalance_analog"
        ),
        **{f"offset_{a}": Slot(OFFSET, "pickoff_offset") for a in "xy"},
        **{f"angle_{a}": Slot("Sampler", "sampler") for a in "xy"},
    }
    wires = WIRES
    options = (
        SITE
        | PHYSICAL_FORM
        | ATTITUDE
        | {
            "offset": Option("60arcsec", "rad", "angle off null, about each axis in both senses", 0.0),
            "cycles": Option(4, int, "times the six offsets are gone through", 2, 16),
            "dwell": Option(60.0, "s", "time of the readings at each offset", 1e-3),
            "readings": Option(2, int, "readings at each offset", 1, 100),
            "settle": Option(3.0, "s", "wait before them", 0.1),
            "accuracy": Option("0.01deg/h", "rad/s", "drift that matters: a tenth of it is left to the springs", 0.0),
        }
        | {
            f"k_{a}": Option(0.0, "rad/s/A", f"scale factor of the torquer about {a}; 0: that of the gyro", 0.0)
            for a in "xy"
        }
        | {f"K_sg_{a}": Option(0.0, "V/rad", f"gain of the {a} pickoff; 0: that of the gyro", 0.0) for a in "xy"}
        | NUISANCES
        | CORRECTIONS
        | type_b(sources, "attitude", "scale_factor", "current")
    )
    measured_data = MEASURED
    windows = Windows.of(
        "sampler_x", "t_start t_end angle_start angle_end n flagged", flagged_y="sampler_y.flagged",
        **{f"{n}_{a}": f"sampler_{a}.{n}" for n in ("mean", "std") for a in "xy"},
        **{f"u_{a}": f"angle_{a}.mean" for a in "xy"},
    )  # fmt: skip
    channel_period = 1.0

    def plan(self) -> Plan:
        """Return the offsets of every cycle, with the angles as targets of a table at rest."""
        try:
            face = parse(self["attitude"], self["latitude"])
        except ValueError:
            return Plan()  # check() says why
        times = {"settle": self["settle"], "dwell": self["dwell"], "window": self["dwell"] / self["readings"]}
        size = self["offset"]
        phases = [
            Phase(_label(x, y), "hold", FACE, target=x * size, target_y=y * size, **times)
            for x, y in CYCLE * self["cycles"]
        ]
        return Plan(phases, {FACE: face})

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        told = {f"offset_{a}.K_sg?": parts[f"gyro.K_sg_{a}"] for a in "xy" if f"gyro.K_sg_{a}" in parts}
        springs = {f"gyro.{n}?": value for n, value in SPRINGS.items()}
        return {**super().parameters(parts), **springs, **told}

    def check(self) -> list[str]:
        problems = attitude_problems(self["attitude"], self["latitude"]) + super().check()
        problems += [f"{n} = 0: must be > 0" for n in ("offset", "accuracy") if not self[n] > 0.0]
        return problems

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        problems = super().check_parameters(parameters) + drift.fold_problems(parameters, "gyro.")
        for a in "xy":
            known = [parameters.get(f"gyro.{n}") for n in ("u_max", f"K_sg_{a}")]
            if None not in known and self["offset"] > 0.5 * float(known[0]) / float(known[1]):  # type: ignore[arg-type]
                limit = float(known[0]) / float(known[1])  # type: ignore[arg-type]
                problems.append(
                    f"offset = {self['offset']:.3g} rad: the {a} pickoff reaches {limit:.3g} rad; half of it is allowed"
                )
        return problems


def _label(x: int, y: int) -> str:
    """Return how the rotor stands: "null", "+ about x"."""
    if not (x or y):
        return "null"
    return f"{'+' if x + y > 0 else '−'} about {'x' if x else 'y'}"
