"""Rate test of a table: rate error, tracking error and ripple from 0.01 to 1999.9 Earth rates."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from gyrobench.system.families.option_groups import SITE, type_b
from gyrobench.system.families.table_test import FACE, ON_TABLE, sampled
from gyrobench.system.part_values import PartValues
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.system import Option, Slot, System, Windows
from gyrobench.system.values import InvalidValueError
from gyrobench.units import ARCSEC

from . import sources
from .axis_as_data import SampledLoopError, plant_of
from .closed_form import SampledLoop
from .measured import MEASURED

ERU = 7.2921159e-5  # rad/s
RATES = "0.01 0.1 1 10 100 999.99 1999.9"  # ERU
NOMINAL = 0.18 * ARCSEC  # rad, count for which the times of the plan are made


class TableRateTest(System):
    """A table under a counting servo turns at each rate in both senses; readouts of its angle reader give the rate.

    [TABLE-RATE, READOUT-RATE, CTRL-SAMPLED; Hu 1981, sections 5.4, 5.5, 6.1]
    """

    title = "Rate test of a table"
    spec = ("TABLE-RATE", "READOUT-RATE", "CTRL-SAMPLED", "TABLE-TACHO")
    measured_data = MEASURED
    slots = {
        "site": Slot("Site", "site"),
        "sequencer": Slot("Sequencer", "sequencer"),
        "command": Slot("TableCommand", "table_command"),
        "body": Slot("TableBody", "table_body"),
        "reader": Slot("AngleReader", "inductosyn"),
        "controller": Slot("TableController", "controller_sampled"),
        "drive": Slot("Drive", "motor_square_law"),
        "gate": Slot("RateReadout", "rate_gate"),
        "inverse": Slot("RateReadout", "inverse_rate"),
        "sampler": Slot("Sampler", "sampler"),
        "jitter": Slot("Sampler", "sampler"),
    }
    wires = (
        """
        site -> body: f=f_local omega=omega_local
        sequencer -> command: mode target
        sequencer -> body: face
        command -> controller: count=count_command angle=angle_command rate=rate_command acc=acc_command
        body -> reader: angle rate
        reader -> controller: count angle_read
        body.rate -> controller.tacho
        controller -> drive: demand
        body -> drive: rate
        drive -> body: torque
        reader -> gate: count t_read
        reader -> inverse: count t_read
        reader.angle_read -> sequencer.angle
        command.arrived -> sequencer.in_position
        controller.e -> sampler.x
        controller.saturated -> sampler.flag
        body.rate -> jitter.x
        """
        + sampled(angle="reader: angle_read")
        + sampled("jitter", angle="reader: angle_read")
    )
    open = ("body.M_load",)
    options = SITE | {
        "rates": Option(RATES, str, "rates in ERU, each in both senses"),
        "dwell": Option(60.0, "s", "time at each rate", 1.0),
        "least": Option(300, int, "counts at each rate at least: slow rates take longer", 10, 10_000_000),
        "pole": Option(0.5, "1", "closed-loop poles of a sampled controller; 0: deadbeat", 0.0, 0.99),
        "feedforward": Option(1.0, "1", "share of the inertia that is fed forward; 0: none", 0.0, 2.0),
        "settle": Option(2.0, "s", "wait after each change of rate", 0.0),
        "windows": Option(10, int, "windows at each rate", 2, 1000),
        **type_b(sources),
        "plant": Option("", str, "angle per torque of the real axis: 'num | den | delay' or a table of its response"),
        "quantum": Option(0.0, "rad", "angle of a count, of measured data; 0: of the reader", 0.0),
    }
    windows = Windows.of(
        "sampler", jitter="jitter.std", angle_true="body.angle", gate="gate.rate", gate_valid="gate.valid",
        gate_start="gate.t_start", inverse="inverse.rate", inverse_valid="inverse.valid",
        inverse_start="inverse.t_start",
    )  # fmt: skip
    done = "sequencer.done"
    channels = ("command.rate", "controller.e", "controller.demand", "drive.torque", "body.rate", "body.angle")
    bodies = """
        table: base body.base, x body.tilt[1], y body.tilt[2], z body.angle
        instrument: table, faces sequencer
    """

    def rates(self) -> list[float]:
        """Return the rates in rad/s, both senses of each."""
        try:
            rates = [float(x) for x in str(self["rates"]).split()]
            if not all(0.0 < abs(x) < math.inf for x in rates):
                raise ValueError
            return [sense * x * ERU for x in rates for sense in (1.0, -1.0)]
        except ValueError:
            text = f"rates = {self['rates']!r}: numbers in ERU, not 0, with spaces between, as in '{RATES}'"
            raise InvalidValueError(text) from None

    def time_at(self, rate: float) -> float:
        """Return the time at a rate, s: the dwell, or that of the least number of counts."""
        return float(max(self["dwell"], self["least"] * NOMINAL / abs(rate)))

    def plan(self) -> Plan:
        phases = []
        for rate in self.rates():
            travel = abs(rate) * self.time_at(rate)
            phases.append(
                Phase(f"{rate / ERU:+.6g} ERU", "rate", FACE, rate, self["settle"], travel=travel,
                      window=travel / self["windows"])
            )  # fmt: skip
        return Plan(phases, {FACE: ON_TABLE})

    @property
    def channel_period(self) -> float:  # type: ignore[override]
        """A sample of the controller, or for long runs what leaves 300 000 rows."""
        period: float = 5e-3
        return max(period, math.ceil(self.plan().duration() / 3e5 / self.step) * self.step)

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        quantum = parts["reader.quantum"]
        follow = {f"{n}.quantum?": quantum for n in ("gate", "inverse", "controller")}
        return {
            **self.plan().parameters(),
            **self.owned(),
            **follow,
            "command.reference_quantum?": quantum,
            "controller.law_quantum?": quantum,
            "controller.law_p?": self["pole"],
            "controller.law_J_ff?": self["feedforward"] * parts["body.axis_J"],
            "controller.law_J?": parts["body.axis_J"],
            "controller.bank_J?": parts["body.axis_J"],
            "command.J?": parts["body.axis_J"],
        }

    def check(self) -> list[str]:
        rates = self.rates()
        wrong = [f"{r / ERU:g}" for r in rates[::2] if not 0.0099 * ERU < r < 1999.91 * ERU]
        found = [f"rates = {', '.join(wrong)}: a rate must be 0.01 to 1999.9 ERU"] if wrong else []
        if not rates or len(rates) > 98:
            found.append(f"{len(rates)} phases: 1 to 49 rates are possible")
        try:
            plant_of(str(self["plant"]))
        except SampledLoopError as problem:
            found.append(str(problem))
        return found

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        """Unstable loops, rates that the command cannot set, rates below the range of a tachometer loop."""
        step = float(parameters.get("command.reference_rate_step", 0.0))
        latitude = float(parameters.get("command.reference_latitude", 0.0))
        exact = (abs(ERU * math.sin(latitude)), ERU * math.cos(latitude))
        odd = [
            f"{r / ERU:g}"
            for r in self.rates()[::2]
            if step > 0.0 and abs(r / step - round(r / step)) > 1e-6 and min(abs(r - x) for x in exact) > 1e-9 * ERU
        ]
        if odd:
            return [
                f"rates = {', '.join(odd)}: the command sets steps of {step / ERU:.4g} ERU and would round them; give "
                "multiples of it, or command.reference_rate_step = 0"
            ]
        loop = SampledLoop.of(parameters, self.step)
        if loop is not None and loop.radius() >= 1.0:
            return [
                f"the loop is unstable: largest pole {loop.radius():.3g} per period with pole = {loop.p:g}, drive lag "
                f"{loop.lag:g} s, K_v = {loop.K_v:g} 1/s of the reader; give a larger pole or faster parts"
            ]
        slow = min(self.rates()[::2], default=1.0)
        least = parameters.get("controller.rate_rate_least")
        if parameters.get("controller.loop") == 1.0 and least is not None and slow < least:
            return [
                f"rates: {slow / ERU:g} ERU is below the range of the tachometer loop, {least / ERU:.4g} ERU; use the "
                "count loop (controller.loop = 0)"
            ]
        return []
