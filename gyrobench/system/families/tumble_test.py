"""Tumble tests on a table whose axis lies along the pole: dwells and turns, in two mounts."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import Any, ClassVar

from gyrobench import frames
from gyrobench.arrays import Array
from gyrobench.system.configurable import Option
from gyrobench.system.families.table_test import TableTest
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.system import System

TURN = 2.0 * math.pi


class TumbleTest(TableTest):
    """The table turns at ten times Earth rate, against the Earth and perhaps with it; in dwells it stands.

    To be joined with the family of the instrument: class Tumble(TumbleTest, RebalanceTest).  The mounts ("mount 1",
    "mount 2") and those of the dwells ("static 3", "static 4"; none without dwells) are given by faces().
    """

    tumble: ClassVar[dict[str, Option]] = {
        "rate": Option("10 ERU", "rad/s", "size of the table rate"),
        "turns": Option(1, int, "turns in each mount and sense", 1, 20),
        "both_senses": Option(False, bool, "each mount is turned against the Earth and with it"),
        "windows": Option(72, int, "averaging windows a turn", 6, 720),
        "dwell": Option(1200.0, "s", "length of each of the two dwells"),
        "settle": Option(10.0, "s", "wait before averaging, after each move", 0.0),
    }

    @abstractmethod
    def faces(self) -> dict[str, Any]:
        """Return the mounts: gyro axes (rows) in the table axes at angle 0."""

    def base(self) -> Array:
        return frames.polar_base(self["latitude"])

    def plan(self) -> Plan:
        """Dwell, tumble, dwell, tumble; a dwell brings the table back to a whole turn."""
        rate, turns, n, faces = abs(self["rate"]), self["turns"], self["windows"], self.faces()
        at_rest = {"mode": "index", "settle": self["settle"], "dwell": self["dwell"]}
        at_rest["window"] = self["dwell"] / max(1, round(self["dwell"] / (TURN / rate / n))) if rate > 0.0 else 1.0
        turning = {"mode": "rate", "settle": self["settle"], "travel": TURN * turns, "window": TURN / n}
        phases: list[Phase] = []
        angle = 0.0
        for mount, rest in (("mount 1", "static 3"), ("mount 2", "static 4")):
            if rest in faces:
                phases.append(Phase(label=rest, face=rest, target=angle, **at_rest))
            phases.append(Phase(label=f"{mount}, against the Earth", face=mount, target=-rate, **turning))
            if self["both_senses"]:
                phases.append(Phase(label=f"{mount}, with the Earth", face=mount, target=rate, **turning))
            else:
                angle -= TURN * turns
        return Plan(phases, faces)

    def check(self) -> list[str]:
        problems = super().check()
        if not self["rate"] > 0.0:
            problems.append(
                "rate = 0: the table does not turn, so no coefficient can be separated; Hu 1981 turns at 10 ERU"
            )
        return problems


def attitudes(system: System) -> dict[str, str]:
    """Return what a phase of a laboratory's record may be called, with the mode of the table in it."""
    assert isinstance(system, TumbleTest)
    return {face: "rate" if face.startswith("mount") else "hold" for face in system.faces()}
