"""A table that shakes a gyro about its input or output axis: socket, options and checks of its tests."""

from __future__ import annotations

import numpy as np

from gyrobench.reduction.setup.sources import READING_GAIN, READING_LAG
from gyrobench.system.connectors import Socket, inp, out
from gyrobench.system.families.option_groups import type_b
from gyrobench.system.system import Option, System

TABLE = Socket(
    "VibratingTable",
    "table that follows an angular vibration about its axis: motion in, rates and forces on its face out",
    (
        inp("motion_angle", "rad", "angle asked for, the third about its axis", 3),
        inp("motion_rate", "rad/s", "its rate", 3),
        inp("motion_acceleration", "rad/s2", "its acceleration", 3, optional=True),
        inp("f_local", "m/s2", "specific force at the site, ENU", 3),
        inp("omega_local", "rad/s", "Earth rate at the site, ENU", 3),
        out("omega", "rad/s", "inertial rate, face axes", 3),
        out("alpha", "rad/s2", "its derivative, face axes", 3, optional=True),
        out("f", "m/s2", "specific force, face axes", 3),
        out("rate_read", "rad/s", "table rate as read"),
    ),
)
#: what moves it
SHAKEN = """
    site -> table: f=f_local omega=omega_local
    exciter -> table: motion_angle motion_rate motion_acceleration
"""
FREQUENCIES = {
    "lowest": Option("1Hz", "Hz", "lowest frequency", 1e-3),
    "highest": Option("200Hz", "Hz", "highest frequency", 1e-2),
    "points": Option(25, int, "frequencies, in equal ratios", 8, 90),
}
TIMES = {
    "periods": Option(20, int, "periods measured at each frequency, at least", 10, 100_000),
    "dwell": Option(1.0, "s", "time measured at each frequency, at least", 1e-3),
    "settle": Option(0.5, "s", "time in which the vibration sets in", 1e-3),
}
STATED = type_b(READING_GAIN, READING_LAG, "time")
MOUNT = type_b(mount="standard uncertainty of the input axis against the table axis, about each axis across it")


class ShakenTest(System):
    """A test at one frequency after another; its options hold :data:`FREQUENCIES`."""

    assumed = ("table.base", "table.face", "gyro.mount", "table.read_gain?", "table.read_lag?")
    done = "exciter.done"

    def frequencies(self) -> list[float]:
        """Return the frequencies of the plan, Hz."""
        found: list[float] = np.geomspace(self["lowest"], self["highest"], self["points"]).tolist()
        return found

    def check(self) -> list[str]:
        problems, highest = super().check(), self["highest"]
        if not self["lowest"] < highest:
            problems.append(f"lowest = {self['lowest']:g} Hz: must be below highest = {highest:g} Hz")
        if highest * self.step > 0.05:
            problems.append(f"highest = {highest:g} Hz: a period needs 20 communication steps of {self.step:g} s")
        return problems
