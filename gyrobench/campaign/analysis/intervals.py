"""Intervals of a share and of a population: Clopper-Pearson bounds, tolerance intervals."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, special, stats

from gyrobench.arrays import Array

CONTENT = 0.95  # share of the population inside a tolerance interval
CONFIDENCE = 0.95
NORMALITY = 0.05  # p of the Shapiro-Wilk test below which the normal interval is not used


def clopper_pearson(hits: float, runs: float, level: float = 0.95) -> tuple[float, float]:
    """Return the exact bounds of a share that was met ``hits`` times in ``runs``; (0, 1) for no run at all.

    Numbers that are not whole are those of runs that count less, see :func:`effective_runs`.
    """
    tail = 0.5 * (1.0 - level)
    low = float(stats.beta.ppf(tail, hits, runs - hits + 1)) if hits > 0 else 0.0
    high = float(stats.beta.ppf(1.0 - tail, hits + 1, runs - hits)) if hits < runs else 1.0
    return low, high


def effective_runs(hit: NDArray[np.bool_], cluster: NDArray[np.intp]) -> float:
    """Return how many independent runs are worth as much as these, of which those of one cluster share their noise.

    E. Korn and B. Graubard, Survey Methodology 24 (1998) 193: the variance of the share between clusters over that of
    independent runs, and few clusters widen as Student's t does.
    """
    n, sizes = len(hit), np.bincount(cluster)
    sizes = sizes[sizes > 0]
    c = len(sizes)
    if c < 2:
        return 1.0
    share = float(hit.mean())
    if share in (0.0, 1.0):
        return float(c)  # nothing is known of how alike the runs of a cluster are
    off = np.bincount(cluster, hit - share)
    variance = c / (c - 1) * float(off @ off) / n**2
    design = max(1.0, variance / (share * (1.0 - share) / n))
    return max(1.0, n / design * float(stats.t.ppf(0.975, n - 1) / stats.t.ppf(0.975, c - 1)) ** 2)


@dataclass(frozen=True)
class ToleranceInterval:
    """Interval that holds at least ``content`` of the population with ``confidence``; None: too few values.

    kind: "normal" or "distribution-free".  p_normal: of the Shapiro-Wilk test; None below eight values.
    """

    low: float | None
    high: float | None
    kind: str
    n: int
    p_normal: float | None
    content: float = CONTENT
    confidence: float = CONFIDENCE


@cache
def normal_factor(n: int, content: float = CONTENT, confidence: float = CONFIDENCE) -> float:
    """Return the exact k of the two-sided interval mean ± k s of n normal values.

    With z = the error of the mean in units of sigma and r(z) the half-width around it that holds ``content``, k solves
    E_z[P(chi2_(n-1) > (n-1) r(z)² / k²)] = confidence  (ISO 16269, part 6).
    """
    nodes, weights = np.polynomial.hermite_e.hermegauss(60)
    shift = np.abs(nodes) / np.sqrt(n)
    half = np.array([_half_width(z, content) for z in shift])
    dof = n - 1

    def excess(k: float) -> float:
        return float(weights @ special.chdtrc(dof, dof * half**2 / k**2)) / float(weights.sum()) - confidence

    # the chi-square of one or two degrees of freedom makes k large
    return float(optimize.brentq(excess, 0.1, 1e4, xtol=1e-10))


def _half_width(shift: float, content: float) -> float:
    """Return r where a normal of mean ``shift`` has ``content`` inside ± r."""
    return float(
        optimize.brentq(lambda r: special.ndtr(r - shift) - special.ndtr(-r - shift) - content, 0.0, shift + 40.0)
    )


def order_trim(n: int, content: float = CONTENT, confidence: float = CONFIDENCE) -> int:
    """Return how many of the n values may lie outside, below and above together; -1 where n is too small.

    The interval from the r-th smallest to the s-th largest value holds ``content`` with the probability
    P(Binomial(n, content) <= n - r - s), whatever the distribution.
    """
    outside = np.arange(2, n + 1)  # r + s: at least the smallest and the largest value are the ends
    enough = outside[stats.binom.cdf(n - outside, n, content) >= confidence]
    return int(enough[-1]) - 2 if len(enough) else -1


def tolerance_interval(
    values: Array, content: float = CONTENT, confidence: float = CONFIDENCE, kind: str | None = None
) -> ToleranceInterval:
    """Return the two-sided tolerance interval: normal where the Shapiro-Wilk test does not object.

    Else distribution-free, from order statistics; 95 % with 95 % confidence take 93 values.  kind: one of the two,
    without a test.  The confidence, counted with 100 values, 2000 times each: 0.95 of normal and exponential, 0.96 of
    uniform, 0.94 of lognormal (sigma 0.2) populations, but 0.84 of Student's t with 5 degrees of freedom, whose tails
    the test often misses.
    """
    x = np.sort(np.asarray(values, float))
    x = x[np.isfinite(x)]
    n = len(x)
    if n < 3:
        return ToleranceInterval(None, None, kind or "normal", n, None, content, confidence)
    p = None if n < 8 or x[0] == x[-1] else float(stats.shapiro(x[:: max(1, n // 5000)]).pvalue)
    chosen = kind or ("normal" if p is None or p >= NORMALITY else "distribution-free")
    if chosen == "normal":
        half = normal_factor(n, content, confidence) * float(x.std(ddof=1))
        mean = float(x.mean())
        return ToleranceInterval(mean - half, mean + half, chosen, n, p, content, confidence)
    outside = order_trim(n, content, confidence)
    if outside < 0:
        return ToleranceInterval(None, None, chosen, n, p, content, confidence)
    low, high = float(x[outside // 2]), float(x[n - 1 - (outside - outside // 2)])
    return ToleranceInterval(low, high, chosen, n, p, content, confidence)
