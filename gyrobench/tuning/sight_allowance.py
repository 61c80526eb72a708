"""Allowances of the sources of a wanted jitter with the tuned controller, in the worst case of the spread."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any

from gyrobench.record.frequency_response import Complex
from gyrobench.reduction.estimation.allowance import MOST, MUCH, TINY, at_most, largest_factor
from gyrobench.reduction.loops.sight_quantities import TIMES
from gyrobench.report.numbers import write_number
from gyrobench.result import SetBy
from gyrobench.system.values import with_elements
from gyrobench.tuning.sight_jitter import SightWays
from gyrobench.tuning.wishes import Wish

MICRO = 1e-6
PEAK = 3.0  # of a random voltage over its rms
COLUMNS = ("source", "jitter", "factor", "quantity", "now", "at most")


@dataclass(frozen=True)
class AllowedSource:
    """A source and a quantity that sets it: jitter, µrad, factor and what it may be at most, worst case of a spread.

    factor: None where no smaller source suffices.  most: a number in the quantity's unit, or why there is none.  clips:
    its peaks meet the limit of the voltage then.
    """

    source: str
    jitter: float
    factor: float | None
    set_by: SetBy
    most: float | str
    clips: bool = False

    @property
    def row(self) -> list[str]:
        """Return the cells of :data:`COLUMNS` as text."""
        s, unit = self.set_by, f" {self.set_by.unit}" if self.set_by.unit != "1" else ""
        most = (
            self.most
            if isinstance(self.most, str)
            else f"{write_number(self.most, significant=3).text}{unit}{', cut' if self.clips else ''}"
        )
        factor = "" if self.factor is None or self.factor > MOST else f"{self.factor:.3g}"
        now = "as it is" if s.unit == TIMES else f"{s.now:.3g}{unit}"
        return [self.source, f"{self.jitter:.3g} µrad", factor, s.name, now, most]


def allowed(
    wish: Wish, ways: Sequence[SightWays], G: Complex, points: Sequence[Mapping[str, float]],
    nominal: Mapping[str, Any], limit: float, set_by: Callable[[str, Mapping[str, Any]], list[SetBy]],
) -> tuple[AllowedSource, ...]:  # fmt: skip
    """Return the sources with what they may be, each with all others as they are.

    ways: at the points of the spread, nominal first; limit: of the voltage; set_by: source and parameters -> quantities
    that set it.  One that the spread itself has is judged by its value at each point.
    """
    parameters = [with_elements(nominal, values) for values in points]
    each = [{n: (j / MICRO) ** 2 for n, j in w.sources(G).items()} for w in ways]
    found = []
    for source in (
        n for n in dict.fromkeys(chain(*each)) if any(of.get(n, 0.0) > TINY * sum(of.values()) for of in each)
    ):
        squares = [[sum(of.values()) - of.get(source, 0.0), 0.0, of.get(source, 0.0)] for of in each]
        factors = [largest_factor(square, wish.value / MICRO) for square in squares]
        without = math.sqrt(max(0.0, *(square[0] for square in squares)))
        known = [k for k in factors if k is not None]
        factor = min(known) if len(known) == len(factors) else None
        clips = any(
            PEAK * math.hypot(w.voltage(G), math.sqrt(max(k * k - 1.0, 0.0)) * w.voltage(G, source)) > limit
            for w, k in zip(ways, known, strict=False) if math.isfinite(k)
        )  # fmt: skip
        quantities = [set_by(source, p) for p in parameters]
        for own in zip(*quantities, strict=True):
            # much at one point is no limit at another
            limited = [(s, k) for s, k in zip(own, factors, strict=True) if k is None or k <= MOST]
            most = [at_most(s, k, f"{without:.3g} µrad") for s, k in limited]
            said = [x for x in most if isinstance(x, str)]
            least = said[0] if said else min((x for x in most if not isinstance(x, str)), default=MUCH)
            found.append(AllowedSource(source, math.sqrt(max(s[2] for s in squares)), factor, own[0], least, clips))
    return tuple(found)
