"""Vertical and level servo tests of a floated gyro: the gyro holds a table with its axis vertical or level."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from gyrobench.attitudes import LEVEL, SERVO_ATTITUDES, VERTICAL
from gyrobench.system.families.option_groups import CORRECTIONS, NUISANCES
from gyrobench.system.families.servo_test import Hold, ServoTest
from gyrobench.system.system import Option

from .measured import MEASURED

DRIFTED = math.radians(0.1)  # a drift that turns a level table by less than this in half a dwell moves no start
THREE = "x down; x up; x east, z down"
SIX = "x down; x up; x east, y up; x east, y down; x east, z up; x east, z down"
#: words for sets of attitudes
SETS = {
    "three": THREE,
    "six": SIX,
    "vertical": "; ".join(VERTICAL),
    "level": "; ".join(LEVEL),
    "all": "; ".join((*VERTICAL, *LEVEL)),
}


class ServoVerticalLevel(ServoTest):
    """The gyro holds the table with the input axis down or up (class 1) or level (class 2); the table rate less the
    Earth's is the drift, and attitudes compared give its coefficients: R, U_z, U_x by the three-term route.

    [TEST-SERVO-VERT, TEST-SERVO-LEVEL; Hu 1981, eq. 3-60..3-83]
    """

    title = "Vertical and level servo test"
    spec = ("TEST-SERVO-VERT", "TEST-SERVO-LEVEL", "TEST-COMPOSITE", "LOOP-TABLE-SERVO", "GYRO-DYN-1", "GYRO-STATIC-9")
    reduction = "reduction"
    slots = ServoTest.with_parts(stand="fixture", table="table_servo", gyro="floated_gyro", cage="cage")
    axis_parts: ClassVar[Mapping[str, str]] = {"gyro": "gyro_2dof", "lock": "rebalance_two_axis"}
    options = (
        ServoTest.options
        | CORRECTIONS
        | NUISANCES
        | {
            "attitudes": Option("six", str, "three, six, vertical, level, all, or names separated by semicolons"),
            "cycles": Option(2, int, "times the attitudes are gone through", 1, 12),
            "dwell": Option(600.0, "s", "time in each attitude", 1e-3),
            "windows": Option(10, int, "windows in each dwell", 1, 200),
        }
    )
    measured_data = MEASURED

    def attitudes(self) -> list[str]:
        """Return those of one cycle, in their order."""
        text = SETS.get(self["attitudes"], self["attitudes"])
        return [name.strip() for name in text.split(";") if name.strip()]

    def holds(self) -> list[Hold]:
        """Return the holds.  Each level dwell begins so that what the Earth turns the table is half before and half
        after angle 0; what the drift turns it too, where that is more than DRIFTED.
        """
        from .refusals import LIMIT

        holds = []
        common = {"settle": self["settle"], "dwell": self["dwell"], "window": self["dwell"] / self["windows"]}
        for name in self.attitudes() * self["cycles"]:
            start = 0.0
            if name in LEVEL:
                half = self["settle"] + self["dwell"] / 2.0
                start = self.earth(name) * half
                drifted = float(self.expected().rates(name)[0][0]) * half
                if abs(drifted) > DRIFTED or abs(start) + 2.0 * abs(drifted) > LIMIT:
                    start -= drifted
            holds.append(Hold(name, start=start, **common))
        return [h for h in holds if h.attitude in SERVO_ATTITUDES]

    def earth(self, name: str) -> float:
        """Return the Earth rate along the input axis, rad/s."""
        return float(self.expected().rates(name)[1][0])

    def check(self) -> list[str]:
        from .refusals import option_problems

        names = self.attitudes()
        known = {n: self.earth(n) for n in names if n in LEVEL}
        return option_problems(names, known, self["settle"] + self["dwell"]) + super().check()

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        from .refusals import option_problems

        names = [n for n in self.attitudes() if n in LEVEL]
        rates = {n: float(self.expected().table_rate(n)[0]) for n in names}
        problems = option_problems(names, rates, self["settle"] + self["dwell"], "the Earth and the drift turn")
        return super().check_parameters(parameters) + (problems if names else [])

    def warnings(self) -> list[str]:
        from gyrobench.reduction.drift.channels import words

        from .refusals import unseen

        return [words(text, self.channel) for text in unseen(self.attitudes())]
