"""Margins that are wanted of a measured loop, and whether it has them: pass, fail, inconclusive.

"phase margin=40deg", "gain margin=6dB", "disk margin>0.5", "delay margin=2ms", "peak S<6dB", "peak T<3dB".  A margin
passes where its whole 95 % interval does, fails where none of it does.  Where the loop depends on its amplitude nothing
passes: the margins are those of one amplitude.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

from gyrobench import units
from gyrobench.bench import UsageError, suggest_names
from gyrobench.identification.loop_margins import Margin

#: name -> unit, whether more is better
MEASURES = {
    "phase margin": ("rad", True), "gain margin": ("factor", True), "gain-reduction margin": ("factor", False),
    "delay margin": ("s", True), "disk margin": ("1", True), "peak S": ("factor", False), "peak T": ("factor", False),
    "crossover": ("Hz", True),
}  # fmt: skip
PASS, FAIL, OPEN = "pass", "fail", "inconclusive"


@dataclass(frozen=True)
class WantedMargin:
    """A measure and its limit, SI; least: at least so much."""

    name: str
    limit: float
    least: bool

    def verdict(self, margins: Sequence[Margin], dependent: str) -> MarginVerdict:
        """Return the verdict; dependent: why the margins hold at one amplitude only, else ""."""
        m = next((m for m in margins if m.name == self.name), None)
        if m is None:
            return MarginVerdict(self, OPEN, "not measured")
        safe, risky = (m.low, m.high) if self.least else (-m.high, -m.low)
        limit = self.limit if self.least else -self.limit
        if risky < limit:
            return MarginVerdict(self, FAIL, "")
        if safe < limit:
            return MarginVerdict(self, OPEN, "the limit is within the interval")
        return MarginVerdict(self, OPEN, dependent) if dependent else MarginVerdict(self, PASS, "")

    def __str__(self) -> str:
        shown = Margin(self.name, 0.0, 0.0, 0.0, 0.0, MEASURES[self.name][0]).shown(self.limit)
        return f"{self.name} {'at least' if self.least else 'at most'} {shown}"


@dataclass(frozen=True)
class MarginVerdict:
    """Verdict of a wanted margin, and why it is open."""

    wanted: WantedMargin
    verdict: str
    why: str

    def __str__(self) -> str:
        return f"{self.wanted}: {self.verdict}" + (f" ({self.why})" if self.why else "")


def parse_wanted(texts: Sequence[str]) -> list[WantedMargin]:
    """Return what is wanted.  Raises UsageError."""
    return [_wanted(text) for text in texts]


def _wanted(text: str) -> WantedMargin:
    found = re.fullmatch(r"\s*([^<>=]+?)\s*(<=|>=|<|>|=)\s*(.+?)\s*", text)
    if not found:
        raise UsageError(f'--want {text}: write MEASURE=VALUE, for example "phase margin=40deg"; there are: {_names()}')
    name, sign, value = " ".join(found[1].split()), found[2], found[3]
    if name not in MEASURES:
        raise UsageError(f"--want {text}: no measure '{name}'; {suggest_names(name, list(MEASURES))}")
    unit, least = MEASURES[name]
    if sign[0] in "<>" and (sign[0] == ">") is not least:
        raise UsageError(
            f"--want {text}: of {name} {'more' if least else 'less'} is better; write {'>' if least else '<'} or ="
        )
    try:
        if unit == "factor":
            bare = units.parse_quantity(value.removesuffix("dB").strip(), "1")
            number = 10.0 ** (bare / 20.0) if value.endswith("dB") else bare
        else:
            number = units.parse_quantity(value, unit)
    except units.UnitError as error:
        raise UsageError(f"--want {text}: {error}" + ("; a factor, or dB" if unit == "factor" else "")) from None
    if not (math.isfinite(number) and number > 0.0):
        raise UsageError(f"--want {text}: must be above 0")
    return WantedMargin(name, number, least)


def _names() -> str:
    return ", ".join(MEASURES)
