"""How large each source of a mean square may be, all others as they are: a budget read the other way.  [LOS-JITTER]

    J²(k) = c_0 + c_1 k + c_2 k² + ...        k times the amplitude of one source; c_0 = R of all others without it
    J(k) <= J_w for all k up to the smallest positive root of J²(k) = J_w², where c_0 <= J_w²

An independent source has c_1 = 0: k² = (J_w² − R)/A.  One that goes with others has c_1 = 2 C, their covariance.  Where
c_0 > J_w², no smaller source suffices.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from gyrobench.reduction.estimation.sentences import plain
from gyrobench.result import Coefficient, SetBy, Table, VarianceShare

TINY = 1e-9  # of the square: less is rounding
MOST = 100.0  # times as it is: more is not stated
COLUMNS = ["source", "factor", "quantity", "now", "at most", "unit"]
CAPTION = (
    "What each source may be at most with all others as they are, by the linear model of the budget. Factor: on its "
    "amplitude; at most: what that makes of the quantity that sets it."
)
MUCH = f"more than {MOST:g} times as much"
BEYOND = "beyond what the linear model holds for"


def crossings(square: Sequence[float], wanted: float) -> list[float]:
    """Return the factors on the amplitude of a source at which a mean square is that of what is wanted, rising.

    square: of :class:`VarianceShare`.
    """
    roots = np.roots([*square[:0:-1], square[0] - wanted**2])
    return sorted(roots.real[(np.abs(roots.imag) <= 1e-9 * np.abs(roots)) & (roots.real > 0.0)].tolist())


def largest_factor(square: Sequence[float], wanted: float) -> float | None:
    """Return the factor on the amplitude of a source up to which a mean square stays below that of what is wanted.

    None: without the source it is more already; inf: whatever the source.
    """
    return None if square[0] > wanted**2 else next(iter(crossings(square, wanted)), math.inf)


def allowances(shares: Sequence[VarianceShare], judged: Sequence[Coefficient]) -> list[Table]:
    """Return a table for each coefficient with shares and an upper limit."""
    found = []
    for c in judged:
        high = c.limit[1] if c.limit else None
        own = [s for s in shares if s.of == c.name and sum(map(abs, s.square[1:])) > TINY * abs(sum(s.square))]
        if high is not None and own:
            rows = [row for s in own for row in _rows(s, high, c.unit)]
            title = f"Allowance of each source for {c.name} of {high:g} {c.unit}"
            found.append(Table(f"budget.allowance:{c.name}", title, CAPTION, COLUMNS, rows))
    return found


def at_most(s: SetBy, k: float | None, without: str, cancels: bool = False) -> float | str:
    """Return what a quantity may be at most, or why that is not stated.

    without: what is left without the source, as text; cancels: with some of it, less is left.
    """
    if k is None:
        return f"{'cancels others' if cancels else 'none suffices'}: {without} without it"
    if k > MOST:
        return MUCH
    value, (low, high) = s.now * k**s.power, s.holds
    return BEYOND if (low is not None and value < low) or (high is not None and value > high) else value


def _rows(share: VarianceShare, wanted: float, unit: str) -> list[list[object]]:
    """Return a row for each quantity that sets a source."""
    k = largest_factor(share.square, wanted)
    without = f"{plain(math.sqrt(max(share.square[0], 0.0)), 3)} {unit}"
    most = [at_most(s, k, without, bool(crossings(share.square, wanted))) for s in share.set_by]
    factor = None if all(isinstance(x, str) for x in most) else k
    return [[share.source, factor, s.name, s.now, x, s.unit] for s, x in zip(share.set_by, most, strict=True)]
