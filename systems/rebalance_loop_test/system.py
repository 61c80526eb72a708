"""Test of a rebalance loop: known rates along the input axis, the reading of the current against them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from gyrobench import drift, frames, units
from gyrobench.reduction.drift.small_rates import SMALL
from gyrobench.system.families.option_groups import CORRECTIONS, NUISANCES, SITE, TORQUER, type_b
from gyrobench.system.families.rebalance_test import RebalanceTest
from gyrobench.system.families.table_test import FACE, ON_TABLE, TableTest, sampled
from gyrobench.system.part_values import PartValues
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.system import Option, Slot, Windows
from gyrobench.units import DPH

from . import sources
from .measured import MEASURED

FLOAT = "float"  # the sampler of the float angle


class RebalanceLoopTest(RebalanceTest):
    """The gyro stands on a level table with its input axis up, at rest and turning at a row of rates in both senses,
    there and back.  Bias, scale factor and linearity of the loop follow from its readings, the resolution and the
    limit cycle from those at rest, the threshold, on request, from small rates.

    [TEST-REBAL-LOOP; Hu 1981, section 5.5, eq. 5-62..5-76]
    """

    title = "Rebalance loop test"
    spec = ("TEST-REBAL-LOOP", "REBAL-ANALOG", "REBAL-PWM", "REBAL-PULSE")
    slots = {
        **RebalanceTest.with_parts(table="table_rate", gyro="floated_gyro", rebalance="rebalance_pwm"),
        FLOAT: Slot("Sampler", "sampler"),
    }
    wires = RebalanceTest.wires + sampled(FLOAT) + f"gyro -> {FLOAT}: b=x\n"
    open = (f"{FLOAT}.flag",)
    options = (
        SITE
        | {
            "range": Option("0.95deg/s", "rad/s", "largest rate"),
            "rates": Option("0.05 0.2 0.4 0.6 0.8 1", str, "rates as parts of the largest, each in both senses"),
            "gate": Option(1.0, "s", "length of a reading", 0.0),
            "rest": Option(30, int, "readings at rest, at the beginning and at the end", 6, 100000),
            "readings": Option(10, int, "readings at each rate, twice", 1, 100000),
            "small": Option("", str, "small rates for the threshold, deg/h, both senses each, as 0.01 0.1 1"),
            "settle": Option(3.0, "s", "wait before the readings, after each change of rate", 0.0),
        }
        | TORQUER
        | NUISANCES
        | CORRECTIONS
        | type_b(
            sources, "mount", "wobble", "angle1", "angle2", "scale_factor", "current", "time",
            axis="standard uncertainty of the table axis against the vertical",
        )
    )  # fmt: skip
    measured_data = MEASURED
    assumed = TableTest.assumed  # errors of the pulses are what the test finds
    windows = Windows.of(ripple=f"{FLOAT}.std")
    channels = ("table.angle", *RebalanceTest.channels)
    channel_period = 0.1

    def rates(self) -> list[float]:
        """Return the rates as parts of the largest; raises ValueError for what is not a list of numbers."""
        return [float(x) for x in self["rates"].replace(",", " ").split()]

    def small_rates(self) -> list[float]:
        """Return the small rates, rad/s; raises ValueError for what is not a list of numbers."""
        return [float(x) * DPH for x in self["small"].replace(",", " ").split()]

    def plan(self) -> Plan:
        """At rest, each rate in both senses, the same in reverse order, the small rates likewise, at rest: a trend in
        time is not taken for one in the rate.  The table takes the Earth rate off the small ones.
        """
        try:
            rates, small = self.rates(), self.small_rates()
        except ValueError:
            return Plan()  # check() says why
        gate, settle, n = self["gate"], self["settle"], self["readings"]
        rest = Phase("at rest", "hold", FACE, settle=settle, dwell=self["rest"] * gate, window=gate)
        there = []
        for rate in (sense * part * self["range"] for part in rates for sense in (1.0, -1.0)):
            way, label = abs(rate) * gate, f"{math.degrees(rate):+.6g} °/s".replace("-", "−")
            there.append(Phase(label, "rate", FACE, rate, settle=settle, travel=n * way, window=way))
        slow = []
        for r, sense in ((r, s) for r in small for s in (1.0, -1.0)):
            rate = sense * r - frames.EARTH_RATE * math.sin(self["latitude"])
            label = f"{sense * r / DPH:+.6g} °/h felt".replace("-", "−")
            way = abs(rate) * gate
            slow.append(Phase(label, "rate", FACE, rate, settle=settle, travel=n * way, window=way))
        return Plan([rest, *there, *reversed(there), *slow, *reversed(slow), rest], {FACE: ON_TABLE})

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        return {**super().parameters(parts), **{f"gyro.{name}?": 0.0 for name in drift.NAMES}}  # the float alone

    def check(self) -> list[str]:
        try:
            rates = self.rates()
        except ValueError:
            return [f"rates = {self['rates']}: numbers are expected, parts of the largest rate, such as 0.1 0.5 1"]
        try:
            small = self.small_rates()
        except ValueError:
            return [f"small = {self['small']}: numbers in deg/h are expected, such as 0.01 0.1 1"]
        limit = SMALL * self["range"]
        problems = [f"small: {r / DPH:g} deg/h: must be above 0 and below {limit / DPH:.3g} deg/h, {SMALL:g} of the "
                    "largest rate" for r in small if not 0.0 < r < limit]  # fmt: skip
        if small and min(rates, default=1.0) <= SMALL:
            problems.append(f"rates: beside small rates at least {SMALL:g} of the largest")
        if sorted(set(small)) != small:
            problems.append(f"small = {self['small']}: the rates must rise, each once")
        problems += [f"rates: {r:g} is not above 0 and up to 1, the largest rate" for r in rates if not 0.0 < r <= 1.0]
        if len(set(rates)) < 3 or len(set(rates)) < len(rates):
            problems.append(f"rates = {self['rates']}: at least three different ones are needed for the linearity")
        problems += [f"{name} = 0: must be > 0" for name in ("gate", "range") if not self[name] > 0.0]
        return problems + super().check()

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        problems = super().check_parameters(parameters)
        gate, saw = self["gate"], parameters.get("rebalance.f_s")
        if saw and abs(gate * saw - round(gate * saw)) > 1e-6:
            problems.append(f"gate = {gate:g} s must be whole saws of the rebalance, {1.0 / saw:g} s")
        whole = round(gate / self.step) * self.step
        if abs(whole - gate) > 1e-6 * gate:
            problems.append(f"gate = {gate:g} s must be whole communication steps, {self.step:g} s")
        current = parameters.get("rebalance.I") or parameters.get("rebalance.i_max")
        if current and "gyro.k" in parameters:
            earth = abs(frames.EARTH_RATE * math.sin(self["latitude"]))
            full = parameters["gyro.k"] * current
            if self["range"] + earth >= full:
                problems.append(
                    f"range = {units.format_quantity(self['range'], 'rad/s')}: the rebalance reaches "
                    f"{units.format_quantity(full, 'rad/s')}, at which the float would run away"
                )
        names = ("gyro.K_sg", "gyro.k", "gyro.H", "gyro.C", "gyro.J", "rebalance.K_p")
        known = [parameters.get(n) for n in names]
        if None not in known:
            K_sg, k, H, C, J, K_p = (float(x) for x in known)  # type: ignore[arg-type]
            damped = H * k * K_sg * K_p * J / C**2 if C > 0.0 else math.inf  # tau K_v
            if damped > 1.0:
                problems.append(
                    f"rebalance.K_p = {K_p:g} A/V: τ K_v = {damped:.3g}; above 1 the loop needs a compensator: lower "
                    "rebalance.K_p"
                )
        return problems
