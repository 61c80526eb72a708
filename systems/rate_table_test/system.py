"""Rate table test of a rate gyro: scale factor and its errors from rates in steps up to full scale, threshold."""

from __future__ import annotations

import math
from typing import Any

from gyrobench.system.families.option_groups import CORRECTIONS, NUISANCES, SITE, type_b
from gyrobench.system.families.rate_reading import RATE_GYRO, RATE_NOISES
from gyrobench.system.families.table_test import FACE, ON_TABLE, TableTest, on_table
from gyrobench.system.part_values import PartValues
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.system import Option, Slot
from gyrobench.units import DEG

from .measured import MEASURED
from .steps import earth_rate, sweep

NOT_TURNING = 1e-12  # rad/s


class RateTableTest(TableTest):
    """A table with a vertical axis turns a rate gyro at rates in steps, up and down through both senses, several times;
    small rates follow for the threshold.

    [TEST-RATE-GYRO; IEEE 952, IEEE 647, IEEE 1431: scale factor tests]
    """

    title = "Rate table test of a rate gyro"
    spec = ("TEST-RATE-GYRO", "GYRO-MEMS", "GYRO-FOG", "GYRO-LOCK-IN")
    reduction = "reduction"
    slots = on_table(table=Slot("Table", "table_rate"), gyro=Slot("RateGyro", "gyro_mems"))
    wires = TableTest.wires + RATE_GYRO
    options = (
        SITE
        | {
            "full_scale": Option("100deg/s", "rad/s", "largest rate, in both senses", 1e-6),
            "steps": Option(5, int, "steps from zero to full scale", 2, 20),
            "cycles": Option(3, int, "cycles 0, +, 0, -, 0: their scale factors show the repeatability", 1, 20),
            "dwell": Option(10.0, "s", "time at each rate", 0.1),
            "windows": Option(2, int, "averaging windows at each rate", 1, 100),
            "settle": Option(1.0, "s", "wait after each change of rate", 0.0),
            "small": Option("", str, "small rates for the threshold, deg/s, both senses each, as 0.01 0.02 0.05"),
        }
        | NUISANCES
        | CORRECTIONS
        | type_b(
            "latitude",
            "time",
            "angle1",
            "angle2",
            axis="standard uncertainty of the vertical table axis, about each horizontal axis",
            mount="standard uncertainty of the input axis against the table axis, about each axis across it",
        )
    )
    noises = RATE_NOISES
    measured_data = MEASURED
    channels = ("gyro.rate[1]", "table.rate")
    channel_period = 0.5

    def small_rates(self) -> list[float]:
        """Return the small rates, rad/s; raises ValueError for what is no list of numbers."""
        return [float(x) * DEG for x in str(self["small"]).replace(",", " ").split()]

    def rates(self) -> list[float]:
        """Return the table rates of the plan in their order, rad/s: the sweep, then the small rates of the gyro, whose
        part of the Earth rate the table takes off, there and back: what drifts is no response.
        """
        earth = earth_rate(self.values)
        small = [sense * r - earth for r in self.small_rates() for sense in (1.0, -1.0)]
        return [*sweep(self["full_scale"], self["steps"], self["cycles"]), *small, *reversed(small)]

    def plan(self) -> Plan:
        try:
            rates = self.rates()
        except ValueError:
            return Plan()  # check() says why
        dwell, n = self["dwell"], self["windows"]
        phases = []
        for rate in rates:
            label = f"{rate / DEG:+.6g} deg/s".replace("-", "−")
            if abs(rate) < NOT_TURNING:
                rest = Phase("at rest", "hold", FACE, settle=self["settle"], dwell=dwell, window=dwell / n)
                phases.append(rest)
                continue
            way = abs(rate) * dwell
            phases.append(Phase(label, "rate", FACE, rate, self["settle"], travel=way, window=way / n))
        return Plan(phases, {FACE: ON_TABLE})

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        full = self["full_scale"]
        moved = {"table.rate_max?": max(10.0, 1.1 * full), "table.acceleration?": max(0.1, full)}
        return {**super().parameters(parts), **moved}

    def check(self) -> list[str]:
        problems = super().check()
        try:
            small = self.small_rates()
        except ValueError:
            return [*problems, f"small = {self['small']}: numbers in deg/s are expected, such as 0.01 0.02 0.05"]
        limit = self["full_scale"] / self["steps"]
        problems += [f"small: {r / DEG:g} deg/s: above zero, and below the first step of the sweep, {limit / DEG:g} "
                     "deg/s" for r in small if not 0.0 < r < limit]  # fmt: skip
        if sorted(set(small)) != small:
            problems.append(f"small = {self['small']}: the rates must rise, each once")
        if not math.isfinite(self["full_scale"]):
            problems.append("full_scale must be finite")
        return problems
