"""Open-loop drift test: the case is turned by hand so that the pickoff stays about its null."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from gyrobench import frames
from gyrobench.arrays import Array
from gyrobench.attitudes import attitude_problems, parse
from gyrobench.system.families.option_groups import ATTITUDE, CORRECTIONS, NUISANCES, SITE, type_b
from gyrobench.system.families.physical_form import PHYSICAL_FORM
from gyrobench.system.families.table_test import FACE, ON_TABLE, OpenLoopTest
from gyrobench.system.part_values import PartValues
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.system import Option

from . import refusals, sources
from .measured import MEASURED

ACCELERATION, RATE = 1e-3, 0.01  # rad/s2, rad/s: a gentle hand; the float sees the rate in steps, off by some a h^2


def move_time(way: float) -> float:
    """Return the time (s) of a move with trapezoidal rate."""
    way = abs(way)
    return 2.0 * math.sqrt(way / ACCELERATION) if way < RATE**2 / ACCELERATION else way / RATE + RATE / ACCELERATION


class OpenLoopDrift(OpenLoopTest):
    """No loop is closed: the table turns about the gyro's input axis in small steps, a little over and a little under
    the null of the pickoff in turn; the inertial angle of the null against time is the drift.

    [TEST-OPEN; Hu 1981, ch. 3 par. 1]
    """

    title = "Open-loop drift test"
    spec = ("TEST-OPEN", "GYRO-DYN-1", "GYRO-STATIC-9")
    slots = OpenLoopTest.with_parts(table="table_rate", gyro="floated_gyro")
    options = (
        SITE
        | PHYSICAL_FORM
        | ATTITUDE
        | {
            "pairs": Option(29, int, "steps over and under the null, two a pair, and one more", 4, 49),
            "wait": Option(60.0, "s", "time the float drifts after each step before it is read", 1.0),
            "dwell": Option(1.0, "s", "time of a reading", 0.0),
            "bracket": Option("1arcmin", "rad", "half the angle between a step over and a step under the null"),
            "follow": Option(0.0, "rad/s", "rate against inertial space at which the hand follows: the drift expected"),
            "float_gain": Option(0.0, "1", "H/C of the float; 0: from the parameters of the gyro, else 1", 0.0),
        }
        | NUISANCES
        | CORRECTIONS
        | type_b("attitude", "latitude", "angle1", "angle2", sources)
    )
    measured_data = MEASURED
    channels = ("gyro.u", "gyro.drift", "table.angle")
    channel_period = 1.0

    def base(self) -> Array:
        axes: Array = parse(self["attitude"], self["latitude"])[[1, 2, 0]]
        return axes

    def plan(self) -> Plan:
        """Return 2 pairs + 1 steps; the table axis is the input axis, so the mount only names the axes."""
        try:
            C = parse(self["attitude"], self["latitude"])
        except ValueError:
            return Plan()  # check() says why
        earth = float(C[0] @ frames.earth_rate_local(self["latitude"]))
        timing = {"settle": self["wait"], "dwell": self["dwell"], "window": self["dwell"]}
        phases: list[Phase] = []
        time, at = 0.0, 0.0
        for j in range(2 * self["pairs"] + 1):
            side, sign = ("over", 1.0) if j % 2 == 0 else ("under", -1.0)
            move = 0.0
            for _ in range(3):  # the sky goes on while the table moves
                ahead = time + move + self["wait"] + self["dwell"]
                target = (self["follow"] - earth) * ahead + sign * self["bracket"]
                move = move_time(target - at)
            time, at = ahead, target
            phases.append(Phase(label=f"reading {j + 1}, {side}", mode="index", face=FACE, target=target, **timing))
        return Plan(phases, {FACE: ON_TABLE})

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        return {**super().parameters(parts), "table.acceleration": ACCELERATION, "table.index_rate": RATE}

    def check(self) -> list[str]:
        problems = attitude_problems(self["attitude"], self["latitude"]) + super().check()
        if not self["dwell"] > 4.0 * self.step:
            problems.append(f"dwell = {self['dwell']:g} s: a reading needs more than four steps of {self.step:g} s")
        if not self["bracket"] > 0.0:
            problems.append("bracket = 0: the gain of the pickoff is found from the steps over and under its null")
        return problems

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        return super().check_parameters(parameters) + refusals.pickoff_range(self["bracket"], parameters)
