"""Tumble tests on a table whose axis lies along the pole: dwells and turns or stops, in two mounts."""

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

    With the options ``intermittent`` it rests at equally spaced angles in place of turning.  [Hu 1981, 3.2.4-1, 5.4]

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
    intermittent: ClassVar[dict[str, Option]] = {
        "stops": Option(0, int, "angles of a turn at which the table rests, 12 to 72; 0: it turns continuously", 0, 72),
        "stop_dwell": Option(300.0, "s", "averaging time at each stop, in round(windows/stops) windows"),
    }

    @abstractmethod
    def faces(self) -> dict[str, Any]:
        """Return the mounts: gyro axes (rows) in the table axes at angle 0."""

    def base(self) -> Array:
        return frames.polar_base(self["latitude"])

    def plan(self) -> Plan:
        """Dwell, tumble, dwell, tumble; a dwell brings the table back to a whole turn."""
        turns, faces = self["turns"], self.faces()
        at_rest = {"mode": "index", "settle": self["settle"], "dwell": self["dwell"]}
        at_rest["window"] = self["dwell"] / max(1, round(self["dwell"] / self._window()))
        phases: list[Phase] = []
        angle = 0.0
        for mount, rest in (("mount 1", "static 3"), ("mount 2", "static 4")):
            if rest in faces:
                phases.append(Phase(label=rest, face=rest, target=angle, **at_rest))
            phases.append(self._tumbling(mount, -1.0, angle))
            if self["both_senses"]:
                phases.append(self._tumbling(mount, 1.0, angle))
            else:
                angle -= TURN * turns
        return Plan(phases, faces)

    @property
    def stops(self) -> int:
        """Number of angles of a turn at which the table rests; 0: it turns."""
        return int(self.values.get("stops", 0))

    def _window(self) -> float:
        """Return the time of a window of a turn or of a stop, s."""
        if self.stops:
            return float(self["stop_dwell"]) / max(1, round(int(self["windows"]) / self.stops))
        rate = abs(self["rate"])
        return float(TURN / rate / self["windows"]) if rate > 0.0 else 1.0

    def _tumbling(self, mount: str, sense: float, angle: float) -> Phase:
        """Return the turns of a mount, or its stops from ``angle`` against the Earth and with it back to ``angle``."""
        label = f"{mount}, {'with' if sense > 0.0 else 'against'} the Earth"
        settle, way = self["settle"], TURN * self["turns"]
        if not self.stops:
            target, window = sense * abs(self["rate"]), TURN / self["windows"]
            return Phase(label, "rate", mount, target, settle=settle, travel=way, window=window)
        step = TURN / self.stops
        first = angle if sense < 0.0 else angle - way + step
        return Phase(
            f"{label}, {self.stops} stops a turn", "step", mount, first, settle=settle, dwell=self["stop_dwell"],
            travel=way - step, window=self._window(), step=sense * step,
        )  # fmt: skip

    def check(self) -> list[str]:
        problems = super().check()
        if self.stops:
            return problems + self._stop_problems()
        if not self["rate"] > 0.0:
            problems.append(
                "rate = 0: the table does not turn, so no coefficient can be separated; Hu 1981 turns at 10 ERU"
            )
        return problems

    def _stop_problems(self) -> list[str]:
        problems = []
        if self.stops < 12:
            problems.append(f"stops = {self.stops}: 12 to 72 stops a turn are possible, or 0: the table turns")
        if not self["stop_dwell"] > 0.0:
            problems.append("stop_dwell = 0: nothing is averaged at the stops")
        return problems


def attitudes(system: System) -> dict[str, str]:
    """Return what a phase of a laboratory's record may be called, with the mode of the table in it."""
    assert isinstance(system, TumbleTest)
    tumbling = "step" if system.stops else "rate"
    return {face: tumbling if face.startswith("mount") else "hold" for face in system.faces()}
