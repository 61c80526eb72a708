"""Rows of the program -> time line, what each self-test found against its limits, why a start was broken off.

Self-tests: mean of the repeats with its t interval; times: sampling of the program.  A start that was broken off has
failed: the figure ``start`` counts its faults, of which none is allowed.  What it did not reach has no value
and no limit.
[TEST-START-UP]
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import special

from gyrobench.reduction.loops.loop_toolkit import ARCSEC, Account, Array, MeasureReduction, ReductionError, told, trace
from gyrobench.result import Limit, Reason, Table

STEPS = (
    "heater on", "wheel on", "reference", "pickoff null", "excitation on", "torquer", "loop closed", "loop step",
    "table angle", "test", "loop opened, caged", "wheel braked", "all off",
)  # fmt: skip
REASONS = (
    "temperature not reached", "wheel not synchronous", "reference outside its limits",
    "pickoff null outside its limits", "pickoff beyond its range", "torquer polarity", "torquer scale factor",
    "loop hunting", "loop not captured",
    "loop does not answer a step", "table angle wrong", "wheel does not run down",
)  # fmt: skip
HEAT, WHEEL, CLOSE, TEST, BRAKE = 1, 2, 7, 10, 12
#: steps that end within a time: name, meaning, option with the limit
TIMES = {
    HEAT: ("t heat", "time until temperature is reached", "t_heat"),
    WHEEL: ("t wheel", "time until the wheel is synchronous", "t_wheel"),
    CLOSE: ("t close", "time until the float is captured", "t_close"),
    BRAKE: ("t brake", "time until the wheel is at rest", "t_brake"),
}
UNITS = {3: ("V", 1.0), 4: ("mV", 1e-3), 5: ("mV", 1e-3), 6: ("1", 1.0), 8: ("1", 1.0), 9: ("″", ARCSEC),
         10: ("mA", 1e-3)}  # fmt: skip


@dataclass(frozen=True)
class SelfTest:
    """A self-test: its step, its figure, and its limits in SI."""

    step: int
    name: str
    meaning: str
    low: float
    high: float
    truth: float | None = None


class Reduction(MeasureReduction):
    """Start, self-tests, test and shutdown as the program wrote them down."""

    def measure(self) -> Account:
        w = {n: np.asarray(v, dtype=float) for n, v in self.record.windows.items()}
        if not w.get("step", np.zeros(0)).size:
            raise ReductionError(["the program has not ended a step"])
        self.rows, p = w, self.run.parameters
        reason = int(w["reason"].max())
        self.why = REASONS[reason - 1] if reason else ""
        at = int(w["step"][np.argmax(w["reason"] > 0.0)]) if reason else 0
        none = f"not reached: {self.why}, in step {at}" if reason else "the program did not get there"
        meaning = "faults by which the program broke the start off"
        if reason:
            text = f"The start failed in step {at}: {self.why}. The program has broken it off there."
            self.found.reasons.append(Reason("start.broken", text, severity="error"))
            meaning = f"faults by which the program broke the start off: {self.why}, in step {at}"
        if reason or int(w["step"].max()) == len(STEPS):
            self.found.measure("start", meaning, "1", float(reason > 0), limit=(None, 0.0))
        for step, (name, meaning, option) in TIMES.items():
            limit = float(self.run.options[option])
            took = self._took(step, limit)
            u = float(self.run.step) / math.sqrt(12.0)
            asked = self._asked((None, limit), took is not None)
            self.found.measure(name, meaning, "s", took, u, limit=asked, closed=expected(p).get(step),
                               no_value="" if took is not None else none)  # fmt: skip
        for test in self._tests(p):
            self._self_test(test, none)
        self._draw()
        return Account(
            method="Program of a gyro test; each self-test by the mean of its repeats",
            sources=["TEST-START-UP; Hu 1981, section 6.1 (items 4, 6)"],
            equation="",
            conventions=[
                "Intervals of self-tests: t distribution of the repeats. Times count from the begin of the step to its "
                "end, with the time for which the condition had to hold.",
                "The program judges the mean of the repeats; the verdict judges the interval.",
            ],
            tables=[self._line()],
        )

    def _tests(self, p: Any) -> list[SelfTest]:
        """Return the self-tests with the limits of the program."""
        tolerance, answer = float(p["program.scale_tolerance"]), float(p["program.step_tolerance"])
        null, angle = float(p["program.null_most"]), float(p["program.angle_most"])
        scale = None
        if all(n in p for n in ("gyro.k", "gyro.K_sg", "gyro.H", "gyro.C")):
            scale = p["gyro.K_sg"] * p["gyro.H"] * p["gyro.k"] / p["gyro.C"] / p["program.gain"]
            scale *= p.get("stand.polarity", 1.0)
        low, high = float(p["program.reference_low"]), float(p["program.reference_high"])
        return [
            SelfTest(3, "reference", "voltage of the reference", low, high, p.get("stand.V_ref")),
            SelfTest(4, "null", "pickoff without excitation", -null, null, p.get("stand.offset")),
            SelfTest(6, "torquer", "torquer scale factor over that of the data sheet, with its sign",
                     1.0 - tolerance, 1.0 + tolerance, scale),
            SelfTest(8, "loop", "answer of the rebalance loop to a step of current", 1.0 - answer, 1.0 + answer),
            SelfTest(9, "angle", "table angle as read, less its target", -angle, angle),
        ]  # fmt: skip

    def _asked(self, limit: Limit, reached: bool) -> Limit | None:
        """Return the limit of a figure; none of one that a start which was broken off did not reach."""
        return limit if reached or not self.why else None

    def _of(self, step: int) -> Array:
        """Return the values of a step's rows."""
        return np.asarray(self.rows["value"][self.rows["step"] == step], dtype=float)

    def _took(self, step: int, limit: float) -> float | None:
        """Return how long a step took, s; None where it was broken off before its limit."""
        mine = (self.rows["step"] == step) & (self.rows["last"] > 0.0)
        if not mine.any():
            return None
        k = int(np.argmax(mine))
        took = float(self.rows["ended"][k] - self.rows["begun"][k])
        return took if took >= limit or step > TEST or self.rows["reason"][k] == 0.0 else None

    def _self_test(self, test: SelfTest, none: str) -> None:
        unit, scale = UNITS[test.step]
        values = self._of(test.step) / scale
        limit = (test.low / scale, test.high / scale)
        if values.size < int(self.run.parameters["program.repeats"]):
            self.found.measure(test.name, test.meaning, unit, None, limit=self._asked(limit, False), no_value=none)
            return
        mean, u = float(values.mean()), float(values.std(ddof=1) / math.sqrt(values.size))
        if test.step == 9:  # all readings may be rounded alike
            u = math.hypot(u, float(self.run.parameters.get("table.quantum", 0.0)) / scale / math.sqrt(12.0))
        half = float(special.stdtrit(values.size - 1, 0.975)) * u
        truth = None if test.truth is None else float(test.truth) / scale
        self.found.measure(test.name, test.meaning, unit, mean, u, limit=limit, interval=(mean - half, mean + half),
                           dof=values.size - 1, truth=truth)  # fmt: skip

    def _line(self) -> Table:
        """Return the time line: every step that was entered, its time against its limit, what it found."""
        rows: list[list[Any]] = []
        for step, name in enumerate(STEPS, 1):
            mine = self.rows["step"] == step
            if not mine.any():
                rows.append([name, None, None, None, "", None, "not entered"])
                continue
            begun, ended = float(self.rows["begun"][mine].min()), float(self.rows["ended"][mine].max())
            allowed = float(self.run.options[TIMES[step][2]]) if step in TIMES else None
            unit, scale = UNITS.get(step, ("", 1.0))
            value = float(self._of(step).mean()) / scale if unit else None
            broken = bool((self.rows["reason"][mine] > 0.0).any()) and not bool(
                (self.rows["reason"][self.rows["ended"] <= begun] > 0.0).any()
            )
            rows.append([name, begun, ended - begun, allowed, value, unit, self.why if broken else "done"])
        head = ["phase", "begin / s", "took / s", "allowed / s", "found", "unit", "outcome"]
        caption = "The steps in their order; found: mean of the repeats, of the test its mean current."
        return Table("line", "Time line", caption, head, rows)

    def _draw(self) -> None:
        """Draw temperature, wheel, pickoff and current over the steps."""
        c = self.record.channels
        lines = (
            ("heater.temperature", "temperature", "K", 1.0),
            ("stand.wheel_speed", "speed of the wheel", "rad/s", 1.0),
            ("program.state", "step of the program", "1", 1.0),
        )
        for name, what, unit, scale in lines:
            if name in c and c["time"].size > 1:
                text = f"{what[:1].upper()}{what[1:]}."
                self.found.responses.append(trace(f"start, {what}", text, c["time"], c[name] / scale, what, unit))

    def summary(self) -> list[str]:
        if self.why:
            return [f"The start failed: {self.why}."]
        return told(
            self.found.coefficients,
            "Start, self-tests, test and shutdown were gone through; nothing was found wrong.",
            "Temperature was reached after {t heat}, the wheel was synchronous after {t wheel}.",
            "Torquer scale factor over that of the data sheet: {torquer}.",
        )


def expected(p: Any) -> dict[int, float]:
    """Return the times in closed form of the wheel's run-up and run-down, s; {} for other parts.  [TEST-START-UP]"""
    names = ("stand.J_w", "stand.D", "stand.M", "stand.n_s", "stand.M_b", "stand.supply", "program.hold")
    if any(n not in p for n in names):
        return {}
    J, D, M, n_s, M_b, supply, hold = (float(p[n]) for n in names)
    drag, found = D * n_s, {}
    if M * supply**2 > drag:
        found[WHEEL] = -J / D * math.log(1.0 - drag / (M * supply**2)) + hold
    if M_b > 0.0:
        rest = float(p["program.speed_rest"])
        found[BRAKE] = J / D * math.log((D * n_s + M_b) / (D * rest + M_b))
    return found
