"""Bandwidth of a rate gyro: amplitude and phase against frequency on a table with angular vibration."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gyrobench.system.families import vibrating_table
from gyrobench.system.families.option_groups import SITE
from gyrobench.system.families.rate_reading import RATE_NOISES
from gyrobench.system.families.table_test import ON_TABLE
from gyrobench.system.loop_plan import LoopPhase, LoopPlan
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import Option, Slot
from gyrobench.units import DEG

from .measured import MEASURED

WAY = 0.5  # rad, largest angle of the table


class GyroBandwidth(vibrating_table.ShakenTest):
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
        "table": Slot(vibrating_table.TABLE, "rate_table_vibrating"),
        "gyro": Slot("RateGyro", "gyro_vibratory"),
    }
    wires = vibrating_table.SHAKEN + "table -> gyro: omega f"
    options = (
        SITE
        | vibrating_table.FREQUENCIES
        | {"rate": Option("10deg/s", "rad/s", "amplitude of the table rate", 1e-9)}
        | vibrating_table.TIMES
        | vibrating_table.STATED
        | vibrating_table.MOUNT
    )
    noises = ("table.reading", "gyro.pickoff", *RATE_NOISES)
    sampled_gyro = True
    step = 1e-4
    channels = ("exciter.phase", "exciter.gate", "table.rate_read", "gyro.rate[1]", "gyro.saturated")
    shown = ("table.rate_read", "gyro.rate")
    measured_data = MEASURED

    @property
    def channel_period(self) -> float:  # type: ignore[override]
        """At least twelve samples a period, whole steps apart."""
        return float(max(1, math.floor(1.0 / (12.0 * self["highest"] * self.step) + 1e-9)) * self.step)

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
        problems = super().check()
        way = self["rate"] / (2.0 * math.pi * self["lowest"])
        if way > WAY:
            problems.append(
                f"rate = {self['rate'] / DEG:g} deg/s at {self['lowest']:g} Hz turns the table by {way / DEG:.3g} deg; "
                f"at most {WAY / DEG:.3g} deg are allowed: a smaller rate or a larger lowest"
            )
        return problems
