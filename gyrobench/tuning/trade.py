"""Trade of two wishes: what one gives up for the other, the worst case of each over the spread.

The two are wanted more and less, q and 1/q times what was asked for, and the search goes on from one q to the next; of
what comes the points stay that no other beats in both.  Of all other wishes no more than the wanted is kept: what they
have beyond it goes to the two.  Each point is the best that was found: a local search, linear models.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gyrobench.arrays import Array
from gyrobench.bench import UsageError, suggest_names
from gyrobench.tuning.controller_search import TuningProblem, polished, simplex_from
from gyrobench.tuning.wishes import Wish

WIDE = 3.0  # factor by which each of the two is wanted more and less
SIDE = 4  # points on either side of what was asked for
WORK = 50  # evaluations of a simplex
ROUNDS = 4  # of a point: the two are wanted by as much more as the round before had of everything
LOST = -1.0  # ln ratio of a point that has not been found


@dataclass(frozen=True)
class TradePoint:
    """Worst case of the two wishes, SI, and whether the other wishes are fulfilled with it."""

    first: float
    second: float
    others: bool


@dataclass(frozen=True)
class Trade:
    """Two wishes and the points between them, by the first."""

    wishes: tuple[Wish, Wish]
    points: tuple[TradePoint, ...]


def traded(names: Sequence[str], wishes: Sequence[Wish]) -> tuple[int, int] | None:
    """Return the places of two wishes that are named; None for no names.  Raises UsageError."""
    if not names:
        return None
    known = [w.name for w in wishes]
    for name in names:
        if name not in known:
            raise UsageError(f"--pareto {name}: is not among what is wanted; {suggest_names(name, known)}")
    if len(names) != 2 or names[0] == names[1]:
        raise UsageError('--pareto: name two wishes, such as --pareto "phase margin" --pareto bandwidth')
    return known.index(names[0]), known.index(names[1])


def trade(problem: TuningProblem, x: Array, places: tuple[int, int]) -> Trade:
    """Return the trade of two wishes about the best controller, its decades x."""
    i, j = places
    found = [_point(problem, x, places)]
    for sense in (1.0, -1.0):
        near = x
        for q in WIDE ** (sense * np.arange(SIDE + 1) / SIDE):
            near = _between(problem, near, places, q)
            found.append(_point(problem, near, places))
    a, b = problem.wishes[i], problem.wishes[j]
    kept = [
        p for p in found
        if not any(
            a.ratio(o.first) >= a.ratio(p.first) and b.ratio(o.second) >= b.ratio(p.second) and o != p for o in found
        )
    ]  # fmt: skip
    unique = {(p.first, p.second): p for p in kept}
    return Trade((a, b), tuple(sorted(unique.values(), key=lambda p: p.first)))


def _between(problem: TuningProblem, x: Array, places: tuple[int, int], q: float) -> Array:
    """Return the best controller near x for q : 1/q of the two wishes, with all others fulfilled."""
    i, j = places
    reserve = 1.0
    for _ in range(ROUNDS):
        wishes = list(problem.wishes)
        wishes[i], wishes[j] = _times(wishes[i], q * reserve), _times(wishes[j], reserve / q)
        asked = replace(problem, wishes=wishes, evaluations=0)
        x = polished(asked, simplex_from(asked, x, 0.06, WORK), 10)
        problem.evaluations += asked.evaluations
        worst = asked.worst(x)
        if worst < LOST:
            break
        reserve *= math.exp(worst)
    return x


def _times(wish: Wish, q: float) -> Wish:
    return replace(wish, value=wish.value * q if wish.least else wish.value / q)


def _point(problem: TuningProblem, x: Array, places: tuple[int, int]) -> TradePoint:
    worst = np.exp(problem.ratios(x).min(axis=0))
    values = [w.value * r if w.least else w.value / r for w, r in zip(problem.wishes, worst, strict=True)]
    others = bool(np.all(np.delete(worst, places) >= 1.0 - 1e-6))
    return TradePoint(float(values[places[0]]), float(values[places[1]]), others)
