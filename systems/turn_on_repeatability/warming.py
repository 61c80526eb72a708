"""Exponentials of a warm-up: how many, their time constants, the time until it is over."""

from __future__ import annotations

import math
import operator
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy import interpolate, linalg, optimize

from gyrobench.arrays import Array

GRID, STARTS = 13, 4  # time constants tried, and refined
GONE = 30.0  # time constants before the first reading, of which nothing is left
APART = 1e-4  # of columns of length 1: the least singular value of those that are
BASIS, STEP = 32, 0.03  # of ln tau: points whose exponentials span all others, step of the splines


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

    def left(self, t: float) -> float:
        """Return the bias at a time less that in the end, rad/s."""
        return float(np.exp(-t / self.tau) @ self.size)

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
            return abs(self.left(x)) - limit

        return float(optimize.brentq(at, t[k], t[k + 1]))

    def slopes(self, t: float) -> Array:
        """Return the derivatives (2q,) of the time t at which it passes a limit, by sizes and by ln tau."""
        left = np.exp(-t / self.tau)
        rate = float(left @ (self.size / self.tau))
        return np.concatenate([left, self.size * left * t / self.tau]) / rate

    def time_constant(self, longest: float) -> float:
        """Return the time after which 1/e of the beginning is left, for good: tau of one exponential, s."""
        return self.time_until(abs(float(np.sum(self.size))) / math.e, longest)


def means(since: Array, length: Array, tau: Array) -> Array:
    """Return (n, q) means of exp(-t/tau) over readings of this length about the times since."""
    half = 0.5 * length[:, None] / tau
    out: Array = np.exp(-since[:, None] / tau) * np.where(half > 1e-6, np.sinh(half) / np.maximum(half, 1e-6), 1.0)
    return out


class Curves:
    """Exponentials of each kind beside the columns X (n, p), by ln tau: coordinates in a basis that all share.

    All exponentials of a record lie in a space of some ten dimensions, and their coordinates there are smooth in
    ln tau: splines of them serve searches and draws of thousands.  y (d,): coordinates of the data; rest: sum of
    squares of what no exponential reaches; low, high: limits of ln tau; level, levels: mean of the coefficients of X
    in the data and, by kind and ln tau, in an exponential, its variance at unit noise.
    """

    def __init__(self, y: Array, X: Array, since: Array, length: Array, kinds: Sequence[Kind]) -> None:
        self.low = math.log(max(0.3 * float(np.min(length)), float(np.min(since)) / GONE))
        self.high = math.log(2.0 * float(np.max(since)))
        self.first = max(self.low, math.log(float(np.min(since + 0.5 * length))))  # e-folds in the first reading
        Q, R = np.linalg.qr(X)
        mean = Q @ np.linalg.solve(R.T, np.full(X.shape[1], 1.0 / X.shape[1]))

        def beside(A: Array) -> Array:
            out: Array = A - Q @ (Q.T @ A)
            return out

        def columns(log_tau: Array) -> list[Array]:
            every = means(since, length, np.exp(log_tau))
            return [kind.factor[:, None] * every for kind in kinds if kind.most]

        self.of = [k for k, kind in enumerate(kinds) if kind.most]
        coarse = np.linspace(self.low, self.high, BASIS)
        every = [c / np.maximum(np.linalg.norm(c, axis=0), 1e-300) for c in map(beside, columns(coarse))] or [
            np.zeros((y.size, 1))
        ]
        U, R, _ = linalg.qr(np.column_stack(every), mode="economic", pivoting=True, check_finite=False)
        own = np.abs(np.diag(R))
        U = U[:, own > 1e-11 * max(float(own[0]), 1e-300)]
        fine = np.linspace(self.low, self.high, max(round((self.high - self.low) / STEP), BASIS))
        whole = dict(zip(self.of, columns(fine), strict=True))
        self.splines = {k: interpolate.CubicSpline(fine, beside(c).T @ U) for k, c in whole.items()}
        self.levels = {k: interpolate.CubicSpline(fine, mean @ c) for k, c in whole.items()}
        self.level, self.level_variance = float(mean @ y), float(mean @ mean)
        left = beside(y)
        self.y = U.T @ left
        self.rest = float(np.sum((left - U @ self.y) ** 2))

    def at(self, log_tau: Array, of: Sequence[int], order: int = 0) -> Array:
        """Return (..., d, q) columns at ln tau (..., q) of the kinds of, or their derivatives."""
        log_tau = np.clip(log_tau, self.low, self.high)
        return np.stack([self.splines[k](log_tau[..., j], order) for j, k in enumerate(of)], axis=-1)


@dataclass(frozen=True)
class Found:
    """Time constants (q,), rising, of each kind, of the least criterion; the curves they were sought among."""

    tau: list[Array]
    curves: Curves


def fitted(y: Array, X: Array, since: Array, length: Array, kinds: Sequence[Kind]) -> Found:
    """Return the exponentials beside the columns X (n, p), as many as the Bayesian criterion finds.

    One after another is added where it betters the criterion most, and all are refined together; the residuals are
    taken as white.
    """
    curves = Curves(y, X, since, length, kinds)
    unit = math.sqrt((curves.rest + float(np.sum(curves.y**2))) / y.size) or 1.0  # the search stops at absolute limits
    low, high = curves.low, curves.high

    def left(log_tau: Array, of: Sequence[int]) -> Array:
        out: Array = curves.y / unit
        if of:
            A = curves.at(log_tau, of)
            out = out - A @ np.linalg.lstsq(A, out, rcond=None)[0]
        return out

    def slopes(log_tau: Array, of: Sequence[int]) -> Array:
        """Return the slopes of what is left but for those of the sizes.  [Kaufman 1975]"""
        A, D = curves.at(log_tau, of), curves.at(log_tau, of, 1)
        found, *_ = np.linalg.lstsq(A, np.column_stack([curves.y, D]), rcond=None)
        out: Array = -(D - A @ found[:, 1:]) * found[:, 0] / unit
        return out

    def criterion(log_tau: Array, of: Sequence[int]) -> float:
        squares = max(float(np.sum(left(log_tau, of) ** 2)) + curves.rest / unit**2, 1e-300)
        return y.size * math.log(squares / y.size) + 2.0 * len(of) * math.log(y.size)

    def apart(log_tau: Array, of: Sequence[int]) -> bool:
        """Whether sizes and time constants can be told from each other: no two in one, none within a reading."""
        J = np.column_stack([curves.at(log_tau, of), curves.at(log_tau, of, 1)])
        s = np.linalg.svd(J / np.maximum(np.linalg.norm(J, axis=0), 1e-300), compute_uv=False)
        return J.shape[0] >= J.shape[1] and bool(s[-1] > APART * s[0])

    grid = np.linspace(low, high, GRID)
    at, of = np.zeros(0), list[int]()
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
                    optimize.least_squares(left, starts[j], slopes, x_scale=0.3, max_nfev=80, args=(more,)).x
                    for j in order
                ]
                refined = [x for x in refined if apart(x, more)] or (refined if kind.exact else [])
                if refined:
                    found = refined[int(np.argmin([criterion(s, more) for s in refined]))]
                    tried.append((-math.inf if kind.exact else criterion(found, more), found, k))
        if not tried:
            break
        value, found, k = min(tried, key=operator.itemgetter(0))
        if value >= least:
            break
        at, of = np.clip(found, low, high), [*of, k]
        least = criterion(at, of)
    return Found(
        [np.exp(np.sort([x for x, o in zip(at, of, strict=True) if o == k])) for k in range(len(kinds))], curves
    )
