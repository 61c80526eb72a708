"""Bandwidth of a rate gyro: amplitude and phase against frequency on a table with angular vibration."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gyrobench.system.connectors import Socket, inp, out
from gyrobench.system.families.option_groups import SITE
from gyrobench.system.families.rate_reading import RATE_NOISES
from gyrobench.system.families.table_test import ON_TABLE
from gyrobench.system.loop_plan import LoopPhase, LoopPlan
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import Option, Slot, System
from gyrobench.units import DEG

from .measured import MEASURED

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
        out("f", "m/s2", "specific force, face axes", 3),
        out("rate_read", "rad/s", "table rate as read"),
    ),
)
WAY = 0.5  # rad, largest angle of the table


class GyroBandwidth(System):
    """A vibrating table shakes a rate gyro about its input axis at one frequency after another; gain and phase of what
    it indicates, against the rate of the table, give its bandwidth, delay and equivalent order.

    [TEST-BANDWIDTH; IEEE 1431, IEEE 952, IEEE 647: frequency response]
    """

    title = "Bandwidth of a rate gyro"
    spec = ("TEST-BANDWIDTH", "GYRO-VIBRATORY", "GYRO-MEMS")
    reduction = "reduction"
    slots = {
        "site": Slot("Site", "site"),
        "exciter": Slot("Excitation", "exciter"),
        "table": Slot(TABLE, "rate_table_vibrating"),
        "gyro": Slot("RateGyro", "gyro_vibratory"),
    }
    wires = """
        site -> table: f=f_local omega=omega_local
        exciter -> table: motion_angle motion_rate motion_acceleration
        table -> gyro: omega f
    """
    options = SITE | {
        "lowest": Option("1Hz", "Hz", "lowest frequency", 1e-3),
        "highest": Option("200Hz", "Hz", "highest frequency", 1e-2),
        "points": Option(25, int, "frequencies, in equal ratios", 8, 90),
        "rate": Option("10deg/s", "rad/s", "amplitude of the table rate", 1e-9),
        "periods": Option(20, int, "periods measured at each frequency, at least", 10, 100_000),
        "dwell": Option(1.0, "s", "time measured at each frequency, at least", 1e-3),
        "settle": Option(0.5, "s", "time in which the vibration sets in", 1e-3),
        "u_gain": Option(0.0, "1", "relative standard uncertainty of the reading of the table rate", 0.0),
        "u_lag": Option(0.0, "s", "standard uncertainty of the time by which that reading is late", 0.0),
        "u_time": Option(0.0, "1", "relative standard uncertainty of the time base", 0.0),
        "u_mount": Option(0.0, "rad", "standard uncertainty of the input axis against the table axis, about each axis "
                          "across it", 0.0),
    }  # fmt: skip
    assumed = ("table.base", "table.face", "gyro.mount", "table.read_gain?", "table.read_lag?")
    noises = ("table.reading", "gyro.pickoff", *RATE_NOISES)
    done = "exciter.done"
    step = 1e-4
    channels = ("exciter.phase", "exciter.gate", "table.rate_read", "gyro.rate[1]", "gyro.saturated")
    shown = ("table.rate_read", "gyro.rate")
    measured_data = MEASURED

    @property
    def channel_period(self) -> float:  # type: ignore[override]
        """At least twelve samples a period, whole steps apart."""
        return float(max(1, math.floor(1.0 / (12.0 * self["highest"] * self.step) + 1e-9)) * self.step)

    def frequencies(self) -> list[float]:
        """Return the frequencies of the plan, Hz."""
        found: list[float] = np.geomspace(self["lowest"], self["highest"], self["points"]).tolist()
        return found

    def plan(self) -> LoopPlan:
        phases = []
        for f in self.frequencies():
            dwell = math.ceil(max(self["periods"], self["dwell"] * f) - 1e-9) / f
            angle = self["rate"] / (2.0 * math.pi * f)
            phases.append(LoopPhase(f"{f:.4g} Hz", "motion", "sine", 3, angle, f, self["settle"], dwell))
        return LoopPlan(phases)

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        return {**self.plan().parameters(), **self.owned(), "table.base": np.eye(3), "table.face": np.array(ON_TABLE)}

    def check(self) -> list[str]:
        problems = []
        if not self["lowest"] < self["highest"]:
            problems.append(f"lowest = {self['lowest']:g} Hz: must be below highest = {self['highest']:g} Hz")
        if self["highest"] * self.step > 0.05:
            problems.append(
                f"highest = {self['highest']:g} Hz: a period needs 20 communication steps of {self.step:g} s"
            )
        way = self["rate"] / (2.0 * math.pi * self["lowest"])
        if way > WAY:
            problems.append(
                f"rate = {self['rate'] / DEG:g} deg/s at {self['lowest']:g} Hz turns the table by {way / DEG:.3g} deg; "
                f"at most {WAY / DEG:.3g} deg are allowed: a smaller rate or a larger lowest"
            )
        return problems
