"""Wishes for a loop, as a person writes them: "phase margin=40deg", "bandwidth>20Hz", "S at 1Hz<-40dB".

Inside all are SI: rad, s, Hz; ratios of amplitudes as factors (6dB = 1.995).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from gyrobench.bench import UsageError, suggest_names
from gyrobench.reduction.loops.wanted_measure import FACTOR, positive, wanted_measure

#: measure -> unit, least (True) or most (False) wanted, meaning
MEASURES: dict[str, tuple[str, bool, str]] = {
    "phase margin": ("rad", True, "phase that a gain crossover lies away from −180°, the smallest"),
    "gain margin": (FACTOR, True, "factor up or down that brings the loop to its limit, the smaller one"),
    "delay margin": ("s", True, "further delay that brings the loop to its limit"),
    "disk margin": ("1", True, "1 / largest |S - 1/2|: gain and phase together"),
    "bandwidth": (
        "Hz",
        True,
        "up to it |S| is below that of an integrator that crosses there: −3 dB, and 20 dB a decade down",
    ),
    "peak S": (FACTOR, False, "largest |S|, S = 1/(1 + L)"),
    "peak T": (FACTOR, False, "largest |T|, T = L/(1 + L)"),
    "jitter": ("rad", False, "rms of the line of sight, of a system that states what moves it"),
}
JITTER = "jitter"
#: measures of which one at least keeps a loop from its limit of stability
MARGINS = ("phase margin", "gain margin", "delay margin", "disk margin", "peak S", "peak T")
IMPLIED = "peak S<6dB"  # where none of them is wanted
AT = "S at "  # "S at 1Hz": |S| at a frequency, at most


@dataclass(frozen=True)
class Wish:
    """One wish: ``value`` of a measure, SI, at least (``least``) or at most.

    f: Hz, of "S at", and where a jitter begins; else 0.
    """

    name: str
    value: float
    unit: str
    least: bool
    f: float = 0.0

    def ratio(self, got: float) -> float:
        """Return how far a value fulfils the wish: 1 just so, more is better."""
        return got / self.value if self.least else self.value / max(got, 1e-300)

    def printed(self, value: float) -> tuple[float, str]:
        """Return a value of this measure as it is printed, and the unit behind it."""
        match self.unit:
            case "rad" if self.name == JITTER:
                return 1e6 * value, " µrad"
            case "rad":
                return math.degrees(value), "°"
            case "":
                return 20.0 * math.log10(max(value, 1e-15)), " dB"
            case "s":
                return 1e3 * value, " ms"
            case "Hz":
                return value, " Hz"
        return value, ""

    def shown(self, value: float, U: float = 0.0) -> str:
        """Return a value of this measure as text with its unit; U: its expanded uncertainty, which says how finely."""
        if math.isinf(value):
            return "unlimited"
        number, unit = self.printed(value)
        wide = abs(self.printed(value + U)[0] - number)
        if not wide > 0.0:
            return f"{number:.{4 if self.unit == 'Hz' else 3}g}{unit}"
        decimals = max(0, 1 - math.floor(math.log10(wide)))
        return f"{number:.{decimals}f}{unit} ± {wide:.{decimals}f}{unit}"

    def __str__(self) -> str:
        return f"{self.name} {'at least' if self.least else 'at most'} {self.shown(self.value)}"


def parse_wishes(texts: Sequence[str]) -> list[Wish]:
    """Return the wishes; raises UsageError."""
    if not texts:
        raise UsageError(f'nothing is wanted; say for example --want "phase margin=40deg"; there are: {_known()}')
    wishes = [_wish(text) for text in texts]
    for k, w in enumerate(wishes):
        if w.name in [other.name for other in wishes[:k]]:
            raise UsageError(f"--want {w.name}: given twice")
    if not any(w.name in ("bandwidth", JITTER) or w.f for w in wishes):
        raise UsageError(
            "margins are largest in a loop that does nothing: want what the loop is for, too, "
            '--want "bandwidth>20Hz" or --want "S at 1Hz<-40dB"'
        )
    return wishes


def with_margin(wishes: Sequence[Wish]) -> tuple[list[Wish], list[str]]:
    """Return the wishes with a margin among them, and the note where it was not wanted in words."""
    if any(w.name in MARGINS for w in wishes):
        return list(wishes), []
    return [*wishes, _wish(IMPLIED)], [
        f'no margin is wanted, and without one the loop may stand at its limit of stability: "{IMPLIED}" was taken'
    ]


def _known() -> str:
    return f"{', '.join(MEASURES)}, S at FREQUENCY"


def _kind(text: str, name: str) -> tuple[str, bool]:
    """Return the unit of a measure and whether more is better.  Raises UsageError."""
    if name.startswith(AT):
        return FACTOR, False
    if name not in MEASURES:
        raise UsageError(f"--want {text}: no measure '{name}'; {suggest_names(name, [*MEASURES, 'S at 1Hz'])}")
    return MEASURES[name][:2]


def _wish(text: str) -> Wish:
    name, number, unit, least = wanted_measure(text, _kind, _known())
    f = positive(text, name.removeprefix(AT), "Hz") if name.startswith(AT) else 0.0
    if name in ("gain margin", "peak S") and number <= 1.0:
        raise UsageError(f"--want {text}: must be above 0 dB, a factor above 1")
    if name == "phase margin" and number >= math.pi:
        raise UsageError(f"--want {text}: must be below 180deg; a number without unit is in rad")
    if name == "disk margin" and number >= 2.0:
        raise UsageError(f"--want {text}: is below 2 in every loop")
    return Wish(name, number, unit, least, f)
