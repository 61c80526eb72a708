"""Margins that are wanted of a measured loop, and whether it has them: pass, fail, inconclusive.

"phase margin=40deg", "gain margin=6dB", "disk margin>0.5", "delay margin=2ms", "peak S<6dB", "peak T<3dB".  A margin
passes where its whole 95 % interval does, fails where none of it does.  Where the loop depends on its amplitude nothing
passes: the margins are those of one amplitude.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from gyrobench.bench import UsageError, suggest_names
from gyrobench.identification.loop_margins import Margin
from gyrobench.reduction.loops.wanted_measure import FACTOR, wanted_measure

#: name -> unit, whether more is better
MEASURES = {
    "phase margin": ("rad", True), "gain margin": (FACTOR, True), "gain-reduction margin": (FACTOR, False),
    "delay margin": ("s", True), "disk margin": ("1", True), "peak S": (FACTOR, False), "peak T": (FACTOR, False),
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
        shown = Margin(self.name, 0.0, 0.0, 0.0, 0.0, MEASURES[self.name][0] or "factor").shown(self.limit)
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
    found = [wanted_measure(text, _kind, ", ".join(MEASURES)) for text in texts]
    return [WantedMargin(name, limit, least) for name, limit, _, least in found]


def _kind(text: str, name: str) -> tuple[str, bool]:
    if name not in MEASURES:
        raise UsageError(f"--want {text}: no measure '{name}'; {suggest_names(name, list(MEASURES))}")
    return MEASURES[name]
