"""Order of candidates by one measure, with the probability that each step of the order is real.

Candidates are compared pair by pair.  Where both were run with the same seeds, noise that is common to both cancels in
the differences d_s of a seed: mean d, u = s / sqrt(n), Student's t with n - 1 degrees of freedom.  Otherwise u is that
of two independent values.  The p-values of all pairs are adjusted together (S. Holm, Scand. J. Stat. 6 (1979) 65), so
that of candidates that are equal a false rank appears in at most 5 % of the comparisons.

A candidate begins a new rank where it can be told from the first of the rank before it; else it shares that rank.  Not
said: that every candidate of a rank can be told from every one of the next.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
from scipy import special

from gyrobench.reduction.estimation.uncertainty import NORMAL

ROUNDING = 1e-12  # relative
LEVEL = 0.05  # largest chance of a false rank among equal candidates


@dataclass(frozen=True)
class RankedValue:
    """Value of a measure with its standard uncertainty (None: not known) and coverage factor of 95 %.

    draws: seed -> value in the run with it; {} for a single run.
    """

    value: float
    u: float | None
    k: float = NORMAL
    draws: Mapping[int, float] = field(default_factory=dict)


@dataclass(frozen=True)
class RankedPlace:
    """index: which candidate.  place: from 1, shared by candidates that cannot be told apart.

    probability: that it is truly behind the first of its rank, for the first of a rank behind that of the rank before;
    None for the first of all, and where an uncertainty is not known.
    """

    index: int
    place: int
    probability: float | None


@dataclass(frozen=True)
class Difference:
    """b - a, its standard uncertainty and coverage factor, and the two-sided p of no difference; None: not known."""

    value: float
    u: float | None
    k: float | None
    p: float | None


def difference(a: RankedValue, b: RankedValue) -> Difference:
    """Return b - a: from the seeds that both have where these are two or more, else as of independent values."""
    common = sorted(set(a.draws) & set(b.draws))
    if len(common) >= 2:
        d = np.array([b.draws[s] - a.draws[s] for s in common])
        n = d.size
        value, u = float(d.mean()), float(d.std(ddof=1)) / math.sqrt(n)
        if np.all(np.abs(d) <= ROUNDING * max(abs(a.value), abs(b.value))):
            value = u = 0.0  # the same number, computed in another order
        k = float(special.stdtrit(n - 1, 0.975))
        return Difference(value, u, k, _two_sided(value, u, n - 1))
    value = b.value - a.value
    if a.u is None or b.u is None:
        return Difference(value, None, None, None)
    u, k = math.hypot(a.u, b.u), max(a.k, b.k)
    return Difference(value, u, k, _two_sided(value, u * k / NORMAL, math.inf))


def _two_sided(value: float, u: float, dof: float) -> float:
    """Return the p of no difference by Student's t."""
    if u == 0.0:
        return 1.0 if value == 0.0 else 0.0
    z = abs(value) / u
    return 2.0 * float(special.stdtr(dof, -z) if math.isfinite(dof) else special.ndtr(-z))


def adjusted(p: Sequence[float]) -> list[float]:
    """Return the p-values adjusted for their number by Holm's step-down."""
    found, largest = [1.0] * len(p), 0.0
    for rank, k in enumerate(sorted(range(len(p)), key=lambda i: p[i])):
        largest = max(largest, min(1.0, (len(p) - rank) * p[k]))
        found[k] = largest
    return found


def rank(candidates: Sequence[RankedValue]) -> list[RankedPlace]:
    """Return the candidates in their order, the smallest value first."""
    pairs = {(i, j): difference(candidates[i], candidates[j]) for i, j in combinations(range(len(candidates)), 2)}
    known = {pair: d.p for pair, d in pairs.items() if d.p is not None}
    p = dict(zip(known, adjusted(list(known.values())), strict=True))
    order = sorted(range(len(candidates)), key=lambda i: (candidates[i].value, i))
    places: list[RankedPlace] = []
    leader, place = order[0], 1
    for count, i in enumerate(order, 1):
        if count == 1:
            places.append(RankedPlace(i, 1, None))
            continue
        chance = p.get((min(i, leader), max(i, leader)))
        told = candidates[i].value > candidates[leader].value if chance is None else chance < LEVEL
        if told:
            leader, place = i, count
        places.append(RankedPlace(i, place, None if chance is None else 1.0 - 0.5 * chance))
    return places
