"""Stationarity: runs of block statistics, up-and-down runs, trend, unit root.

    block_runs(x, m)    runs of block means and of block variances about their mean    [DRIFT-STATS-RUNS]
    up_down_runs(y)     runs of the signs of successive differences                    [DRIFT-STATS-TREND]
    trend(x, dt)        slope with an interval
    unit_root(x)        augmented Dickey-Fuller and KPSS tests

The two counts of runs test the **independence** of block statistics, not stationarity: a stationary Gauss-Markov
process slower than a block fails (too few runs), a differenced white one, too (too many).  Up-and-down runs are blind
to slow trends.  Trends are decided by :func:`trend`, whose slope has an interval under estimated white and
Gauss-Markov noise.  statsmodels counts runs in its sandbox only, and gives no number of them.
[Xia 2008, eq. 3.1.1..3.1.5 with EX7, EX8]
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import special

from gyrobench.reduction.estimation import noise_mixture_fit
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.series.checks import SeriesError, block_means, checked, checked_step
from gyrobench.reduction.series.gauss_markov import gauss_markov

LEAST_BLOCKS = 21  # the normal law of a number of runs needs more than 20 symbols
LEAST_OBSERVATIONS = 25  # of up-and-down runs
SLOWEST = 0.25  # of the record: upper end of the correlation time up to which an interval of a slope is relied on
TREND_BLOCKS = 200  # means a slope is fitted to
UNIT_ROOT_BLOCKS = 1000


@dataclass(frozen=True)
class RunsTest:
    """Number of runs against that of independent values."""

    statistic: str
    runs: int
    z: float  # less those expected, over their standard deviation; negative: slow variation, positive: alternation
    p: float  # two-sided

    @property
    def independent(self) -> bool:
        """Return whether independence is accepted at 5 %."""
        return abs(self.z) < NORMAL


def runs_test(above: NDArray[np.bool_], statistic: str = "values") -> RunsTest:
    """Test the runs of a two-valued sequence (n,).

    E r = 2 n1 n2/n + 1,  Var r = 2 n1 n2 (2 n1 n2 - n)/(n^2 (n - 1)).  A run is a stretch of equal symbols: one more
    than there are changes.  Raises SeriesError for 20 symbols or fewer and where all are equal.
    """
    above = np.asarray(above, dtype=bool)
    n, n1 = above.size, int(np.count_nonzero(above))
    n2 = n - n1
    if n < LEAST_BLOCKS:
        raise SeriesError(f"runs of {statistic}: {n} symbols; more than 20 are needed, take shorter blocks")
    if n1 == 0 or n2 == 0:
        raise SeriesError(f"runs of {statistic}: all symbols are equal; there is nothing to count")
    product = 2.0 * n1 * n2
    return _tested(statistic, above, product / n + 1.0, math.sqrt(product * (product - n) / (n * n * (n - 1.0))))


def _tested(statistic: str, symbols: NDArray[Any], expected: float, sd: float) -> RunsTest:
    runs = 1 + int(np.count_nonzero(symbols[1:] != symbols[:-1]))
    z = (runs - expected) / sd
    return RunsTest(statistic, runs, z, float(2.0 * special.ndtr(-abs(z))))


def block_runs(x: Any, block: int) -> tuple[RunsTest, RunsTest]:
    """Return the runs tests of the means and of the variances of blocks of ``block`` samples about their own mean."""
    if block < 2:
        raise SeriesError(f"block of {block} samples: at least 2 are needed for a variance")
    x = checked(x, LEAST_BLOCKS * block)
    parts = x[: x.size // block * block].reshape(-1, block)
    means, variances = parts.mean(axis=1), parts.var(axis=1, ddof=1)
    return (runs_test(means >= means.mean(), "block means"),
            runs_test(variances >= variances.mean(), "block variances"))  # fmt: skip


def up_down_runs(y: Any) -> RunsTest:
    """Test the runs up and down of observations (N,): E r = (2 N - 1)/3, Var r = (16 N - 29)/90; ties are dropped.

    N is the number of observations, one more than there are signs.  Blind to slow trends: see :func:`trend`.
    """
    y = checked(y, 2, "up-and-down runs")
    signs = np.sign(np.diff(y))
    signs = signs[signs != 0.0]
    n = signs.size + 1
    if n < LEAST_OBSERVATIONS:
        raise SeriesError(f"up-and-down runs: {n} observations without ties; at least {LEAST_OBSERVATIONS} are needed")
    return _tested("up and down", signs, (2.0 * n - 1.0) / 3.0, math.sqrt((16.0 * n - 29.0) / 90.0))


@dataclass(frozen=True)
class Trend:
    """Slope of a series, unit per second."""

    slope: float
    u: float
    low: float  # 95 % interval under estimated white and Gauss-Markov noise
    high: float
    p: float  # two-sided probability of no slope
    bounded: bool  # the correlation time of the noise about the slope is bounded; over a random walk no interval covers

    @property
    def significant(self) -> bool:
        """Return whether the slope differs from zero at 5 %; never where the noise may be a random walk."""
        return self.bounded and not self.low <= 0.0 <= self.high


def trend(x: Any, dt: float) -> Trend:
    """Fit a constant and a slope to at most 200 block means of ``x`` sampled every ``dt`` s.

    The noise of the means is estimated from them (:mod:`gyrobench.reduction.estimation.noise_mixture_fit`).  A random
    walk is not in its population: over one, an apparent slope is the walk itself, ``bounded`` is False and no slope is
    significant.
    """
    x, dt = checked(x, LEAST_BLOCKS), checked_step(dt)
    m = max(1, x.size // TREND_BLOCKS)
    y = block_means(x, m)
    start = m * dt * np.arange(y.size)
    span = m * dt * y.size
    middle = (start + m * dt / 2.0 - span / 2.0) / span  # -1/2..1/2
    scale = float(np.std(y)) or 1.0
    columns = np.column_stack([np.ones(y.size), middle])
    fit = noise_mixture_fit.fit(columns, (y - y.mean()) / scale, ("level", "slope"), start, start + m * dt)
    unit = scale / span
    slope, u, half = (float(v[1]) * unit for v in (fit.beta, fit.u, fit.half_width))
    about = gauss_markov((y - columns @ fit.beta[:2] * scale - y.mean()), m * dt)
    bounded = about.high < SLOWEST * span or not about.determined
    return Trend(slope, u, slope - half, slope + half, float(fit.p[1]), bounded)


@dataclass(frozen=True)
class UnitRoot:
    """Two tests with opposite null hypotheses, of at most 1000 block means.

    Dickey and Fuller's finds no unit root in a random walk under strong white noise, where there is one; the bound of
    the correlation time (:mod:`~gyrobench.reduction.series.gauss_markov`) decides better there.
    """

    adf: float
    p_adf: float  # small: no unit root
    kpss: float
    p_kpss: float  # small: not stationary about a level; tabulated between 0.01 and 0.1

    @property
    def reading(self) -> str:
        """Return the finding of both together, at 5 %."""
        rooted, moving = self.p_adf >= 0.05, self.p_kpss < 0.05
        if rooted and moving:
            return "random walk or slower: not stationary"
        if rooted or moving:
            return "undecided: slow variation that this record does not tell from a random walk"
        return "stationary about a level"


def unit_root(x: Any) -> UnitRoot:
    """Return augmented Dickey-Fuller (lags by BIC, at most 20) and KPSS (automatic bandwidth) of the level."""
    from statsmodels.tsa.stattools import adfuller, kpss

    y = block_means(x := checked(x, 50), max(1, x.size // UNIT_ROOT_BLOCKS))
    with warnings.catch_warnings():
        # p outside the table of KPSS (the bound is returned), and announcements of what the library will return
        warnings.simplefilter("ignore")
        unit, level = adfuller(y, maxlag=min(20, y.size // 4), autolag="BIC"), kpss(y, nlags="auto")
    return UnitRoot(float(unit[0]), float(unit[1]), float(level[0]), float(level[1]))
