"""The result of identification: responses, margins, nonlinearity, remarks; as text and as JSON."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gyrobench import units
from gyrobench.arrays import Array
from gyrobench.identification.distortion import Distortion
from gyrobench.identification.loop_curve import LoopCurve
from gyrobench.identification.loop_margins import Margin
from gyrobench.identification.loop_record import LoopRecord
from gyrobench.identification.plant_fit import PlantFit, shown_values
from gyrobench.identification.ratios import MeasuredResponse
from gyrobench.identification.wanted_margins import MarginVerdict
from gyrobench.report.plain_text import align_columns


@dataclass(frozen=True)
class LoopIdentification:
    """Responses L, S, T and P (plant, output over input, SI) of a loop, each with u; its margins; remarks.

    periods: how many were used, each of ``period``, s; 0, 0 for an excitation without.
    excited_output: amplitude of the output at each frequency, SI.  fit: physical parameters of the plant, if asked for.
    dependent: why margins are those of one amplitude, else "".  verdicts: of margins that were wanted.
    """

    record: LoopRecord = field(repr=False)
    periods: int
    period: float
    responses: Mapping[str, MeasuredResponse] = field(repr=False)
    margins: list[Margin]
    distortions: list[Distortion]
    curve: LoopCurve = field(repr=False)
    notes: list[str]
    excited_output: Array = field(repr=False)
    dependent: str = ""
    fit: PlantFit | None = None
    verdicts: list[MarginVerdict] = field(default_factory=list)
    seconds: float = 0.0

    def __getitem__(self, name: str) -> Margin:
        """Return a margin by its name.  Raises KeyError."""
        for m in self.margins:
            if m.name == name:
                return m
        raise KeyError(f"{name}; there are: {', '.join(m.name for m in self.margins) or 'none'}")

    @property
    def f(self) -> Array:
        """Return the frequencies, Hz."""
        return self.responses["S"].f

    @property
    def linear(self) -> bool | None:
        """Return whether no distortion is seen; None where the excitation cannot show it."""
        return not any(d.significant for d in self.distortions) if self.distortions else None

    @property
    def method(self) -> str:
        """Return what was measured how, in a sentence without its end."""
        f = self.f
        span = f"from {f[0]:.4g} to {f[-1]:.4g} Hz"
        if self.period:
            left = self.record.length - self.periods * self.period
            after = f" after {left:.4g} s" if left > 0.5 * self.record.step else ""
            return f"{self.periods} periods of {self.period:.4g} s{after}, {f.size} lines {span}"
        return f"{self.record.length:.4g} s, {f.size} bands of frequency {span}"

    @property
    def plant_unit(self) -> tuple[str, float]:
        """Return the unit of the plant's response, and SI over it."""
        column = "input" if "input" in self.record.shown else "controller"
        above, below = self.record.shown["output"], self.record.shown[column]
        of = units.display(above) if above != "1" else "1"
        text = f"{of}/({units.display(below)})" if below != "1" else of
        return text, units.unit(below).factor / units.unit(above).factor

    def as_dict(self) -> dict[str, Any]:
        """Return plain JSON values, SI."""
        return {
            "file": self.record.name,
            "excitation": self.record.at,
            "method": "periodic" if self.period else "broadband",
            "period": self.period,
            "periods": self.periods,
            "step": self.record.step,
            "linear": self.linear,
            "margins": [
                {"name": m.name, "value": m.value, "interval": [m.low, m.high], "f": m.f, "unit": m.unit}
                for m in self.margins
            ],
            "responses": {n: _points(self.responses[n]) for n in ("L", "S", "T", "P")},
            "distortion": [
                {"kind": d.kind, "lines": d.count, "level": d.level, "noise": d.floor, "p": d.p, "signal": d.signal}
                for d in self.distortions
            ],
            "wanted": [
                {"name": v.wanted.name, "limit": v.wanted.limit, "verdict": v.verdict, "why": v.why}
                for v in self.verdicts
            ],
            "plant": self.fit.as_dict() if self.fit else None,
            "notes": list(self.notes),
            "seconds": self.seconds,
        }

    def text(self) -> str:
        """Return all of it as a text."""
        lines = [f"{self.record.name}: {self.method}; excitation at the {self.record.at}", ""]
        rows = [
            [m.name, m.shown(m.value), f"{m.shown(m.low)} to {m.shown(m.high)}", f"at {m.f:.4g} Hz"]
            for m in self.margins
        ]
        lines += align_columns([["", "", "95 %", ""], *rows], {0, 1, 2, 3}, "  ") if rows else []
        lines += ["", *(f"  {v}" for v in self.verdicts)] if self.verdicts else []
        if self.fit:
            lines += ["", "plant:", *align_columns([["", "", "95 %"], *shown_values(self.fit)], {0, 1, 2}, "  ")]
            lines += [f"  {self.fit.sentence}"]
        if self.linear:
            levels = " and ".join(
                f"{20.0 * math.log10(max(d.floor, 1e-9)):.3g} dB ({d.kind})" for d in self.distortions
            )
            lines += ["", f"no nonlinearity above the noise, which is {levels} of the excited lines".replace("-", "−")]
        lines += ["", *(f"note: {n}" for n in self.notes)] if self.notes else []
        return "\n".join(lines)


def _points(g: MeasuredResponse) -> dict[str, list[float | None]]:
    low, high = g.gain()
    return {
        "f": g.f.tolist(),
        "re": _finite(g.value.real), "im": _finite(g.value.imag), "u": _finite(g.u),
        "gain_low": _finite(low), "gain_high": _finite(high),
    }  # fmt: skip


def _finite(x: Array) -> list[float | None]:
    return [float(v) if np.isfinite(v) else None for v in x]
