"""How far parts may be from nominal: "platform.J=±30%", "platform.J=0.7..1.3kg.m2"; the points that stand for it."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gyrobench import units
from gyrobench.bench import UsageError

MOST = 6  # parameters: 2^6 corners
INNER = 8  # points inside
WHOLE = 1e-9  # of a number of steps


@dataclass(frozen=True)
class Range:
    """A parameter "slot.parameter" of a part, SI, from ``low`` to ``high``.

    step: of a time whose ends and nominal value are whole communication steps, s: so are the points between.
    """

    name: str
    low: float
    high: float
    unit: str
    step: float = 0.0

    def at(self, share: float) -> float:
        value = self.low + share * (self.high - self.low)
        return round(value / self.step) * self.step if self.step else value

    def in_steps(self, nominal: float, step: float) -> Range:
        """Return the range of a delay or a period as one of whole communication steps; any other one as it is."""
        steps = [x / step for x in (nominal, self.low, self.high)]
        whole = self.unit == "s" and all(abs(n - round(n)) < WHOLE * max(n, 1.0) for n in steps)
        return replace(self, step=step) if whole else self


Point = dict[str, float]  # "slot.parameter" -> SI


def parse_spread(texts: Sequence[str], known: Callable[[str], tuple[float, str]]) -> list[Range]:
    """Return the ranges.  known: "slot.parameter" -> nominal value and unit, SI, or raises UsageError."""
    if len(texts) > MOST:
        raise UsageError(f"--over: {len(texts)} parameters; {MOST} are the most")
    found: list[Range] = []
    for text in texts:
        name, sign, value = (x.strip() for x in text.partition("="))
        if not (sign and name and value):
            raise UsageError(f"--over {text}: write PART.PARAM=±30% or PART.PARAM=LOW..HIGH with unit")
        nominal, unit = known(name)
        if name in [r.name for r in found]:
            raise UsageError(f"--over {name}: given twice")
        found.append(Range(name, *_ends(text, value, nominal, unit), unit))
    return found


def _ends(text: str, value: str, nominal: float, unit: str) -> tuple[float, float]:
    around = re.fullmatch(r"(?:±|\+-|\+/-)\s*(.+)", value)
    try:
        if around and around[1].endswith("%"):
            if nominal == 0.0:
                raise UsageError(f"--over {text}: the nominal value is 0; give LOW..HIGH")
            half = abs(nominal) * units.parse_quantity(around[1], "1")
        elif around:
            half = units.parse_quantity(around[1], unit)
        else:
            low, dots, high = (x.strip() for x in value.partition(".."))
            if not dots:
                raise UsageError(f"--over {text}: write ±30% or LOW..HIGH")
            tail = re.fullmatch(r"[-+0-9.eE]+\s*(.*)", high)
            if tail and re.fullmatch(r"[-+0-9.eE]+", low):
                low += tail[1]  # 38..46Hz
            ends = units.parse_quantity(low, unit), units.parse_quantity(high, unit)
            if not ends[0] < ends[1]:
                raise UsageError(f"--over {text}: the first value must be the smaller one")
            return ends
    except units.UnitError as error:
        raise UsageError(f"--over {text}: {error}") from None
    if not half > 0.0:
        raise UsageError(f"--over {text}: the spread must be > 0")
    return nominal - half, nominal + half


def points(ranges: Sequence[Range]) -> list[Point]:
    """Return nominal ({}), the corners, and points inside (Sobol, the same ones each time)."""
    found: list[Point] = [{}]
    if not ranges:
        return found
    from scipy.stats import qmc

    shares = [*itertools.product((0.0, 1.0), repeat=len(ranges))]
    inner = qmc.Sobol(len(ranges), scramble=False).random(INNER)[1:]
    return found + [
        {r.name: r.at(float(x)) for r, x in zip(ranges, share, strict=True)} for share in (*shares, *np.asarray(inner))
    ]
