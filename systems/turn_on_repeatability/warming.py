"""Exponentials of a warm-up: how many, their time constants, the time until it is over."""

from __future__ import annotations

import math
import operator
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy import optimize

from gyrobench.arrays import Array

GRID, STARTS = 13, 4  # time constants tried, and refined


@dataclass(frozen=True)
class Kind:
    """Exponentials of one kind: factor (n,) that stands before them, number at most or, with ``exact``, itself."""

    factor: Array
    most: int
    exact: bool = False


@dataclass(frozen=True)
class Warming:
    """A(q,) exp(-t/tau(q,)), rad/s and s: the bias less that in the end."""

    size: Array
    tau: Array

    def time_until(self, limit: float, longest: float) -> float:
        """Return the time after which it stays within +-limit, s; 0 where it always is, inf beyond longest."""
        if not self.size.size:
            return 0.0
        t = np.concatenate([[0.0], np.geomspace(1e-3 * float(self.tau.min()), longest, 2000)])
        off = np.abs(np.exp(-t[:, None] / self.tau) @ self.size) - limit
        last = np.flatnonzero(off > 0.0)
        if not last.size:
            return 0.0
        k = int(last[-1])
        if k == t.size - 1:
            return math.inf

        def at(x: float) -> float:
            return abs(float(np.exp(-x / self.tau) @ self.size)) - limit

        return float(optimize.brentq(at, t[k], t[k + 1]))


def means(since: Array, length: Array, tau: Array) -> Array:
    """Return (n, q) means of exp(-t/tau) over readings of this length about the times since."""
    half = 0.5 * length[:, None] / tau
    out: Array = np.exp(-since[:, None] / tau) * np.where(half > 1e-6, np.sinh(half) / np.maximum(half, 1e-6), 1.0)
    return out


@dataclass(frozen=True)
class Found:
    """Time constants (q,), rising, of each kind, of the least criterion; those of one exponential more of the first
    kind, beside the others, and its probability against them; none where it is not sought.
    """

    tau: list[Array]
    more: list[Array] | None = None
    probability: float = 0.0


def fitted(y: Array, X: Array, since: Array, length: Array, kinds: Sequence[Kind]) -> Found:
    """Return the exponentials beside the columns X (n, p), as many as the Bayesian criterion finds.

    One after another is added where it betters the criterion most, and all are refined together; the residuals are
    taken as white.
    """
    y = y / (float(np.std(y)) or 1.0)  # the search stops at absolute limits
    low, high = math.log(0.3 * float(np.min(length))), math.log(2.0 * float(np.max(since)))

    def left(log_tau: Array, of: Sequence[int]) -> Array:
        columns = means(since, length, np.exp(np.clip(log_tau, low, high)))
        columns = columns * np.array([kinds[k].factor for k in of]).T if of else columns
        A = np.column_stack([X, columns])
        out: Array = y - A @ np.linalg.lstsq(A, y, rcond=None)[0]
        return out

    def criterion(log_tau: Array, of: Sequence[int]) -> float:
        squares = max(float(np.sum(left(log_tau, of) ** 2)), 1e-300)
        return y.size * math.log(squares / y.size) + 2.0 * len(of) * math.log(y.size)

    grid = np.linspace(low, high, GRID)
    at, of = np.zeros(0), list[int]()

    def of_kinds(log_tau: Array, of: Sequence[int]) -> list[Array]:
        own = np.clip(log_tau, low, high)
        return [np.exp(np.sort(own[[j for j, o in enumerate(of) if o == k]])) for k in range(len(kinds))]

    least = criterion(at, of)
    while True:
        tried: list[tuple[float, Array, int]] = []
        for k, kind in enumerate(kinds):
            if of.count(k) < kind.most:
                more = [*of, k]
                own = [j for j, o in enumerate(more) if o == k]
                starts: list[Array] = []
                for places in combinations(grid, len(own)):  # those of its kind anew, the others as they are
                    start = np.append(at, 0.0)
                    start[own] = places
                    starts.append(start)
                order = np.argsort([criterion(s, more) for s in starts])[:STARTS]
                refined = [
                    optimize.least_squares(left, starts[j], x_scale=0.3, max_nfev=80, args=(more,)).x for j in order
                ]
                found = refined[int(np.argmin([criterion(s, more) for s in refined]))]
                tried.append((-math.inf if kind.exact else criterion(found, more), found, k))
        if not tried:
            return Found(of_kinds(at, of))
        value, found, k = min(tried, key=operator.itemgetter(0))
        if value >= least:
            break
        at, of = np.clip(found, low, high), [*of, k]
        least = criterion(at, of)
    value, found, k = tried[0]
    if k:
        return Found(of_kinds(at, of))
    return Found(of_kinds(at, of), of_kinds(found, [*of, 0]), 1.0 / (1.0 + math.exp(min(0.5 * (value - least), 700.0))))
