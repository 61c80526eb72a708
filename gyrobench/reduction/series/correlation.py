"""Autocorrelation and partial autocorrelation of a series.

    r(p) = (1/N) sum_{j < N-p} (x_j - m)(x_{j+p} - m),  rho = r/r(0);   white bounds +-1.96/sqrt N

Removing the mean biases r(p) low: E r(p) = (1 - p/N)(lambda_p - var m) nearly; in slow drift that is far more than
the bound (phi = 0.95, N = 500, p = 20: 0.27 for 0.36) and is normal.  Trend and lines must be removed before; gaps need
a call for each stretch.   [RED-ACF, DRIFT-ACF-PACF; Hu 1981, eq. 4-23..4-63 with ER11, ER21; Xia 2008, eq. 3.4.9,
3.4.10]
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import signal

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.series.checks import SeriesError, checked, checked_step

BLOCK = 1 << 18  # values transformed at a time: memory is bounded, the sum is that of the whole record


@dataclass(frozen=True)
class Correlation:
    """Arrays over lags 0..p."""

    lag: Array  # s
    rho: Array
    partial: Array
    bound: float  # 95 %, of white noise


def autocovariance(x: Any, lags: int) -> Array:
    """Return r(0..lags), mean removed, divisor N.  Raises SeriesError for lags >= N.

    statsmodels' acovf transforms the whole record at once, or sums lag by lag.
    """
    x = checked(x, 4)
    if not 1 <= lags < x.size:
        raise SeriesError(f"{lags} lags of {x.size} values: 1 to {x.size - 1} are possible")
    y = x - x.mean()
    total: Array = np.zeros(lags + 1)
    piece = max(BLOCK, 4 * lags)
    for start in range(0, y.size, piece):
        part = y[start : start + piece]
        ahead = np.zeros(part.size + lags)
        ahead[: min(ahead.size, y.size - start)] = y[start : start + ahead.size]
        total += signal.correlate(ahead, part, mode="valid", method="fft")
    total /= y.size
    return total


def correlation(x: Any, dt: float, lags: int) -> Correlation:
    """Return autocorrelation and partial autocorrelation (Durbin-Levinson on r) of ``x`` sampled every ``dt`` s."""
    from statsmodels.tsa.stattools import levinson_durbin

    dt = checked_step(dt)
    r = autocovariance(x, lags)
    partial: Array = np.asarray(levinson_durbin(r, nlags=lags, isacov=True)[2], dtype=float)
    partial[0] = 1.0
    return Correlation(dt * np.arange(lags + 1.0), r / r[0], partial, NORMAL / math.sqrt(len(x)))
