"""Scale factor of a gyro's pickoff: the table steps through small angles while the float is free."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from gyrobench import frames
from gyrobench.arrays import Array
from gyrobench.system.families.option_groups import CORRECTIONS, SITE, type_b
from gyrobench.system.families.servo_channel import CHANNEL, ChannelTest
from gyrobench.system.families.table_test import FACE, OpenLoopTest
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.system import Option

from . import sources
from .measured import MEASURED
from .refusals import drift_problems, points_problems, range_problems

TABLE = {"acceleration": 0.1, "index_rate": 0.1}  # of the table, if it does not say (rad/s2, rad/s)


class PickoffScaleFactor(ChannelTest, OpenLoopTest):
    """The gyro is open loop with its input axis along the table axis, at right angles to the pole.  The table steps
    quickly through angles within the range of the pickoff; the slope of its voltage is the scale factor.

    Of a two-degree-of-freedom gyro a rebalance loop locks the other axis.

    [TEST-PICKOFF; Hu 1981, appendix 1 of chapter 3]
    """

    title = "Pickoff scale factor"
    spec = ("TEST-PICKOFF", "GYRO-DYN-1")
    slots = OpenLoopTest.with_parts(table="table_rate", gyro="floated_gyro")
    axis_parts: ClassVar[Mapping[str, str]] = {"gyro": "gyro_2dof", "lock": "rebalance_two_axis"}
    options = (
        SITE
        | CORRECTIONS
        | CHANNEL
        | {
            "range": Option("20arcmin", "rad", "the table goes from -range to +range", 0.0),
            "points": Option(11, int, "angles", 2, 49),
            "both_ways": Option(True, bool, "back over the same angles, which tells the drift from the slope"),
            "settle": Option(0.03, "s", "wait before averaging, at each angle", 0.0),
            "dwell": Option(0.1, "s", "time averaged at each angle"),
            "drift": Option("2deg/h", "rad/s", "largest drift to be expected of the gyro", 0.0),
            "gain": Option(
                0.0, "1", "angle of the float per angle of the case, H/C; 0: from the gyro's parameters", 0.0
            ),
        }
        | type_b(
            sources, "voltage", "angle1", "angle2",
            axis="standard uncertainty of the right angle between table axis and pole",
            mount="standard uncertainty of the input axis against the table axis",
        )
    )  # fmt: skip
    step = 1e-4  # s: the rate of a move of 0.2 s reaches the gyro as held values, wrong by acceleration step2/4 at most
    measured_data = MEASURED
    channels = ("table.angle", "gyro.u", "gyro.drift")
    channel_period = 0.01

    def base(self) -> Array:
        """Return axes of which the first sees no Earth rate, nor does the spin axis, so that the float's angle lets
        none in.
        """
        return frames.equatorial_base(self["latitude"])

    def angles(self) -> list[float]:
        """Return the angles in their order, rad; back over the same ones with both_ways."""
        there: list[float] = np.linspace(-self["range"], self["range"], self["points"]).tolist()
        return there + there[-2::-1] if self["both_ways"] else there

    def plan(self) -> Plan:
        phases = [
            Phase(label=f"{math.degrees(a) * 60.0:.4g}′", mode="index", face=FACE, target=a, settle=self["settle"],
                  dwell=self["dwell"], window=self["dwell"])
            for a in self.angles()
        ]  # fmt: skip
        return Plan(phases, {FACE: self.face})

    def duration(self, acceleration: float = TABLE["acceleration"], index_rate: float = TABLE["index_rate"]) -> float:
        """Return the time from the first reading to the last with the ways between them, s."""
        step = 2.0 * self["range"] / max(self["points"] - 1, 1)
        peak = min(index_rate, math.sqrt(step * acceleration))
        move = peak / acceleration + step / peak if peak > 0.0 else 0.0
        n = len(self.angles())
        return float(n * (self["settle"] + self["dwell"]) + (n - 1) * move)

    def check(self) -> list[str]:
        problems = points_problems(self["points"]) + super().check()
        if not self["range"] > 0.0:
            problems.append("range = 0: the table does not move")
        if self.channel and (self["gain"] or self["u_gain"]):
            problems.append("gain, u_gain: of a floated gyro; the rotor of this one keeps its direction, its gain is 1")
        return problems

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        problems = super().check_parameters(parameters)
        problems += frames.equatorial_problems(parameters.get("table.base", self.base()), self["latitude"])
        moves = {k: float(parameters.get(f"table.{k}", v)) for k, v in TABLE.items()}
        problems += drift_problems(self["drift"], self.duration(**moves), 2.0 * self["range"])
        names = ("u_max", f"K_sg_{self.channel}") if self.channel else ("u_max", "K_sg", "H", "C")
        known = [parameters.get(f"gyro.{n}") for n in names]
        if None not in known:
            u_max, k_sg, h, c = (*(float(v) for v in known), 1.0, 1.0)[:4]  # type: ignore[arg-type]
            problems += range_problems(self["range"], u_max / (k_sg * h / c))
        return problems
