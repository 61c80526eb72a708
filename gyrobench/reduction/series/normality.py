"""Skewness and kurtosis with standard errors that hold for correlated series.

g1, g2: unbiased skewness and excess kurtosis (scipy).  For n independent normal values

    SE(g1)^2 = 6 n (n-1)/((n-2)(n+1)(n+3)),   SE(g2)^2 = 24 n (n-1)^2/((n-3)(n-2)(n+3)(n+5)),

for a correlated Gaussian series with autocorrelation rho both grow: factors F3 = sum rho_k^3 and F4 = sum rho_k^4 over
all lags, positive and negative (Lobato 2004), which the tests of scipy and statsmodels do not know.  A mean kurtosis of
B blocks has SE/sqrt B, not the error of one block.   [DRIFT-NORMALITY; Xia 2008, eq. 3.4.6..3.4.8 with EX12]
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import special, stats

from gyrobench.arrays import Array
from gyrobench.reduction.series.checks import block_means, checked
from gyrobench.reduction.series.correlation import autocovariance

LEAST_EFFECTIVE = 30.0  # independent values below which nothing is decided
BLOCK = 200  # samples; heavy tails of the record without heavy tails in blocks are a noise level that varies
BLOCKS, SHORT = 20_000, 2  # block means for long lags; blocks of lags that the record itself gives


@dataclass(frozen=True)
class Normality:
    """Statistics of one record; z = g/SE."""

    skewness: float
    se_skewness: float  # corrected for correlation
    kurtosis: float  # excess
    se_kurtosis: float
    effective: tuple[float, float]  # n/F3, n/F4: independent values with the same errors
    jarque_bera: float  # z1^2 + z2^2 with the corrected errors
    p: float  # of it, chi-squared of 2; NaN where the record is too short
    block: int
    block_kurtosis: float  # mean over blocks
    se_block_kurtosis: float

    @property
    def z(self) -> tuple[float, float]:
        return self.skewness / self.se_skewness, self.kurtosis / self.se_kurtosis

    @property
    def z_block(self) -> float:
        return self.block_kurtosis / self.se_block_kurtosis

    @property
    def decided(self) -> bool:
        return min(self.effective) >= LEAST_EFFECTIVE


def standard_errors(n: int) -> tuple[float, float]:
    """Return SE(g1), SE(g2) of n independent normal values; n >= 4."""
    skew = 6.0 * n * (n - 1.0) / ((n - 2.0) * (n + 1.0) * (n + 3.0))
    kurtosis = 24.0 * n * (n - 1.0) ** 2 / ((n - 3.0) * (n - 2.0) * (n + 3.0) * (n + 5.0))
    return math.sqrt(skew), math.sqrt(kurtosis)


def normality(x: Any) -> Normality:
    """Test a record (n,); trend and lines must be removed before.  Raises SeriesError for fewer than two blocks."""
    x = checked(x, 2 * BLOCK)
    n = x.size
    g1, g2 = float(stats.skew(x, bias=False)), float(stats.kurtosis(x, bias=False))
    se1, se2 = standard_errors(n)
    f3, f4 = _factors(x)
    effective = (n / f3, n / f4)
    jb = (g1 / se1) ** 2 / f3 + (g2 / se2) ** 2 / f4
    p = float(special.chdtrc(2, jb)) if min(effective) >= LEAST_EFFECTIVE else math.nan
    of_blocks = _block_kurtosis(x)
    return Normality(g1, se1 * math.sqrt(f3), g2, se2 * math.sqrt(f4), effective, jb, p, BLOCK, *of_blocks)


def _block_kurtosis(x: Array) -> tuple[float, float]:
    """Return the mean kurtosis of blocks and its standard error, which is larger where the noise level varies."""
    parts = x[: x.size // BLOCK * BLOCK].reshape(-1, BLOCK)
    each = stats.kurtosis(parts[np.ptp(parts, axis=1) > 0.0], axis=1, bias=False)
    scatter = float(np.std(each, ddof=1)) if each.size > 1 else 0.0
    mean = float(np.mean(each)) if each.size else math.nan
    return mean, max(standard_errors(BLOCK)[1], scatter) / math.sqrt(max(each.size, 1))


def _factors(x: Array) -> tuple[float, float]:
    """Return F3, F4: short lags of the record itself, longer ones of block means, each standing for its block.

    Values within chance (2/sqrt n) are left out: noise of the estimate does not add up to correlation.
    """
    n = x.size
    m = -(-n // BLOCKS)
    short = min(SHORT * m if m > 1 else n // 2, n // 2)
    r = autocovariance(x, short)
    rho = np.where(np.abs(r[1:]) > 2.0 / math.sqrt(n) * r[0], r[1:] / r[0], 0.0)
    sums = [1.0 + 2.0 * float(np.sum(rho**k)) for k in (3, 4)]
    if m > 1:
        y = block_means(x, m)
        slow = autocovariance(y, y.size // 2)
        far = np.where(np.abs(slow) > 2.0 / math.sqrt(y.size) * slow[0], slow / r[0], 0.0)[SHORT:]
        far[0] *= 0.5  # half its block lies within the short lags
        sums = [s + 2.0 * m * float(np.sum(far**k)) for s, k in zip(sums, (3, 4), strict=True)]
    return max(sums[0], 0.1), sums[1]
