"""Other columns of a drift record - temperatures, harmonics over an angle - and which of them the rate follows.

Block means of the rate are fitted by all columns; white noise, flicker, random walk and Gauss-Markov drift are
estimated with them, the level of every stretch without a gap is free (gyrobench.reduction.series.column_regression).
Then the least significant column leaves and the others are fitted again, until each of the rest has a probability of a
true zero below ALPHA over the number of columns; cosine and sine of a harmonic leave or stay together.  Of two columns
that tell the same one stays, where both at once would look insignificant.  Selection makes p and u of what is kept too
small: the interval with all columns is stated beside them; it holds whatever is kept.
[RED-STEPWISE, RED-ORTHO, RED-HARMONIC; Hu 1981, eq. 4-12..4-22, 4-92..4-101]

Not modelled: lag of the rate behind a column; a slope that changes with time; columns with errors of their own.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from gyrobench.arrays import Array
from gyrobench.record.drift_columns import harmonic_names
from gyrobench.reduction.estimation.regression import RegressionError
from gyrobench.reduction.series.checks import SeriesError
from gyrobench.reduction.series.column_regression import (
    SeriesFit,
    SeriesRegression,
    backward,
    joint_test,
    orthonormal,
)
from gyrobench.reduction.setup.window_checks import ReductionError

ALPHA = 0.05
BLOCKS, MOST_BLOCKS = 200, 4000  # means that are fitted; more where a column moves within them
LEFT = 0.9  # part of the rms of a column that its means keep
SHORTEST = 8  # means of a stretch


@dataclass(frozen=True)
class Regression:
    """Slope of the rate over another column, SI: of the fit of what is kept, or with all columns where it is not."""

    name: str
    unit: str
    slope: float
    u: float
    full: tuple[float, float]  # 95 % interval with all columns
    p: float  # of a true zero, when it left or in the end; of a harmonic: of cosine and sine together
    share: float  # of the sum of squares of the means, after the columns above it
    kept: bool


def regress(rate: Array, others: Mapping[str, Array], unit_of: Mapping[str, str]) -> tuple[Regression, ...]:
    """Return the slopes of an evenly sampled rate (n,), NaN in gaps, over the other columns.

    Raises ReductionError for columns that are combinations of others, and too few samples for them.
    """
    names = [n for n, v in others.items() if np.count_nonzero(np.isfinite(v)) > 0.5 * v.size and np.nanstd(v) > 0.0]
    if not names:
        return ()
    m = block_length([others[n] for n in names], rate.size)
    y, *x = (block_means_of(v, m) for v in (rate, *(others[n] for n in names)))
    X = np.column_stack(x)
    edges = np.flatnonzero(np.diff(np.isfinite(y) & np.isfinite(X).all(axis=1), prepend=False, append=False))
    stretches = [slice(a, b) for a, b in edges.reshape(-1, 2).tolist() if b - a >= SHORTEST]
    try:
        series = SeriesRegression([(X[s], y[s]) for s in stretches], names)
        # less the level of each stretch, as in the regression
        centred = [np.concatenate([v[s] - v[s].mean(axis=0) for s in stretches]) for v in (X, y)]
        Q, _ = orthonormal(centred[0], names)
    except (SeriesError, RegressionError) as error:
        raise ReductionError([f"other columns of the record: {error}"]) from None
    share = (Q.T @ centred[1]) ** 2 / float(centred[1] @ centred[1] or 1.0)
    groups = grouped(names)
    full, fit, removed = backward(names, groups, ALPHA / len(groups), series.fit, _test)
    p = {n: r.p for r in removed for n in r.names} | {
        n: _test(fit, g)[1] for g in groups if g[0] in fit.names for n in g
    }
    out = []
    for k, n in enumerate(names):
        of = fit if n in fit.names else full
        at, beta, half = of.names.index(n), float(full.beta[k]), float(full.half_width[k])
        out.append(Regression(n, unit_of.get(n, "1"), float(of.beta[at]), float(of.u[at]), (beta - half, beta + half),
                              p[n], float(share[k]), n in fit.names))  # fmt: skip
    return tuple(out)


def grouped(names: Sequence[str]) -> list[tuple[str, ...]]:
    """Return the columns that leave or stay together."""
    left, out = list(names), list[tuple[str, ...]]()
    every = harmonic_names(len(names))
    pair = dict(zip(every[::2], every[1::2], strict=True))
    while left:
        first = left.pop(0)
        other = pair.get(first, "")
        out.append((first, other) if other in left else (first,))
        left = [n for n in left if n != other]
    return out


def _test(fit: SeriesFit, names: tuple[str, ...]) -> tuple[float, float]:
    k = [fit.names.index(n) for n in names]
    if len(k) == 1:
        return float(abs(fit.beta[k[0]]) / fit.u[k[0]]), float(fit.p[k[0]])
    return joint_test(fit.beta[k], fit.covariance[np.ix_(k, k)], fit.dof)


def block_length(columns: Sequence[Array], n: int) -> int:
    """Return the samples of a mean: n/BLOCKS, or fewer, down to n/MOST_BLOCKS, where means wash a column out."""
    blocks = BLOCKS
    while True:
        m = max(1, math.ceil(n / blocks))
        left = min(float(np.nanstd(block_means_of(v, m)) / np.nanstd(v)) for v in columns)
        if left >= LEFT or m == 1 or blocks >= MOST_BLOCKS:
            return m
        blocks = min(2 * blocks, MOST_BLOCKS)


def block_means_of(x: Array, m: int) -> Array:
    parts = x[: x.size // m * m].reshape(-1, m)
    there = np.isfinite(parts)
    count = there.sum(axis=1)
    sums = np.where(there, parts, 0.0).sum(axis=1)
    return np.where(2 * count >= m, sums / np.maximum(count, 1), np.nan)
