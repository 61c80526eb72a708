"""Other columns of a drift record - temperatures, harmonics over an angle - and which of them the rate follows.

Block means of the rate are fitted by all columns; white noise, flicker, random walk and Gauss-Markov drift are
estimated with them, the level of every stretch without a gap is free (gyrobench.reduction.series.column_regression).
Then the least significant column leaves and the others are fitted again, until each of the rest has a probability of a
true zero below ALPHA over the number of columns; cosine and sine of a harmonic leave or stay together.  Of two columns
that tell the same one stays, where both at once would look insignificant.  Selection makes p and u of what is kept too
small: the interval with all columns is stated beside them; it holds whatever is kept.
[RED-STEPWISE, RED-ORTHO, RED-HARMONIC; Hu 1981, eq. 4-12..4-22, 4-92..4-101]

Beside a temperature stands its rate of change.

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
from gyrobench.reduction.series.column_regression import SeriesFit, SeriesRegression, backward, joint_test, orthonormal
from gyrobench.reduction.setup.window_checks import ReductionError

ALPHA = 0.05
BLOCKS, MOST_BLOCKS = 200, 4000  # means that are fitted; more where a column moves within them
LEFT = 0.9  # part of the rms of a column that its means keep
SHORTEST = 8  # means of a stretch
ALIKE = 0.98  # correlation of a temperature and its rate of change from which on they are one


@dataclass(frozen=True)
class RegressionSlope:
    """Slope of the rate over another column, SI: of the fit of what is kept, or with all columns where it is not."""

    name: str
    unit: str
    slope: float
    u: float
    full: tuple[float, float]  # 95 % interval with all columns
    p: float  # of a true zero, when it left or in the end; of a harmonic: of cosine and sine together
    share: tuple[float, float, float]  # of the variance of the samples, with its 95 % interval
    kept: bool


def regress(rate: Array, others: Mapping[str, Array], unit_of: Mapping[str, str]) -> tuple[RegressionSlope, ...]:
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
        orthonormal(np.concatenate([X[s] - X[s].mean(axis=0) for s in stretches]), names)  # refuses combinations
    except (SeriesError, RegressionError) as error:
        raise ReductionError([f"other columns of the record: {error}"]) from None
    groups = grouped(names)
    full, fit, removed = backward(names, groups, ALPHA / len(groups), series.fit, _test)
    p = {n: r.p for r in removed for n in r.names} | {
        n: _test(fit, g)[1] for g in groups if g[0] in fit.names for n in g
    }
    out = []
    for k, n in enumerate(names):
        of = fit if n in fit.names else full
        at, beta, half = of.names.index(n), float(full.beta[k]), float(full.half_width[k])
        ends = beta - half, beta + half
        slope, u = float(of.beta[at]), float(of.u[at])
        share = share_of(slope, ends, others[n], rate)
        out.append(RegressionSlope(n, unit_of.get(n, "1"), slope, u, ends, p[n], share, n in fit.names))
    return tuple(out)


def share_of(slope: float, ends: tuple[float, float], column: Array, rate: Array) -> tuple[float, float, float]:
    """Return the share of the variance of a rate (n,) that slope times a column (n,) makes, with its interval.

    A sum of squares that a fit takes away holds what the slow noise of the rate happens to share with the column; the
    slope under that noise, and its interval, do not.  Where the interval of the slope holds 0, that of the share does.
    """
    there = np.isfinite(column) & np.isfinite(rate)
    ratio = float(np.var(column[there])) / (float(np.var(rate[there])) or 1.0)
    low = 0.0 if ends[0] * ends[1] <= 0.0 else min(ends[0] ** 2, ends[1] ** 2) * ratio
    return slope**2 * ratio, min(low, 1.0), min(max(ends[0] ** 2, ends[1] ** 2) * ratio, 1.0)


def with_rates_of_change(
    others: Mapping[str, Array], unit_of: Mapping[str, str], step: float
) -> tuple[dict[str, Array], dict[str, str], list[str]]:
    """Return the columns with the rate of change beside each temperature, their units, and sentences on what lacks one.

    The rate of change, K/h, is that of means over 1/BLOCKS of the record, between the neighbours of each: faster
    changes are the thermometer's.  One that follows its temperature cannot be told from it and is left out.
    """
    out, units, left = dict(others), dict(unit_of), list[str]()
    for name in [n for n in others if unit_of.get(n) == "K"]:
        x = others[name]
        m = max(1, math.ceil(x.size / BLOCKS))
        means = block_means_of(x, m)
        middle = m * (np.arange(means.size) + 0.5) - 0.5
        there = np.isfinite(means)
        if np.count_nonzero(there) < 2 * SHORTEST or np.nanstd(means) == 0.0:
            continue
        slope = np.gradient(means[there], middle[there] * step / 3600.0)
        if float(np.std(slope)) < 1e-6 * float(np.max(np.abs(slope))):
            continue  # the level of the channel
        likeness = float(np.corrcoef(means[there], slope)[0, 1])
        if abs(likeness) > ALIKE:
            left.append(
                f"The rate of change of {name} follows {name} itself (correlation "
                f"{f'{likeness:.3f}'.replace('-', '−')}): what each of them does to the channel cannot be told apart."
            )
            continue
        grid = np.interp(np.arange(x.size), middle[there], slope)
        changed = f"d({name})/dt"
        out[changed], units[changed] = np.where(np.isfinite(x), grid, np.nan), "K/h"
    return out, units, left


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
