"""Residuals as a time series: autocorrelation, whiteness tests, Allan deviation, spectrum.

Residuals come as stretches: runs of windows of equal length without a gap.  Nothing is computed across a gap.
[RED-ACF; Hu 1981, eq. 4-23..4-63, 3-91..3-93; IEEE 952 for the Allan deviation]
"""

from __future__ import annotations

import functools
import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy import special

from gyrobench.arrays import Array
from gyrobench.reduction.estimation import asked
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.series.deviations import deviations
from gyrobench.result import AllanDeviation, AllanSlope, Autocorrelation, PowerSpectrum

DRAWS = 500  # of white noise, for the distribution of Q
LARGE = 2000  # values beyond which a fit does not change it


def stretches(t0: Array, t1: Array, x: Array, tolerance: float = 0.01) -> list[tuple[float, Array]]:
    """(window length, values) of every run of equally long windows that follow one another, gaps <= tolerance."""
    length = t1 - t0
    scale = tolerance * float(np.median(length))
    new = (np.abs(t0[1:] - t1[:-1]) > scale) | (np.abs(np.diff(length)) > scale)
    edges = [0, *(np.flatnonzero(new) + 1).tolist(), x.size]
    total = np.add.reduceat(length, edges[:-1]).tolist()
    return [(s / (b - a), x[a:b]) for s, (a, b) in zip(total, pairwise(edges), strict=True)]


def autocorrelation(parts: list[Array], lags: int) -> Autocorrelation:
    """Autocorrelation about zero (residuals have no mean left), lag 0..lags in windows, with the 95 % white bound.

    Biased low by the coefficients that were fitted; that is normal.  Pairs across gaps are left out.
    """
    power = sum(float(p @ p) for p in parts)
    count = sum(p.size for p in parts)
    rho, bound = [], []
    for k in range(lags + 1):
        pairs = sum(max(p.size - k, 0) for p in parts)
        product = sum(float(p[k:] @ p[: p.size - k]) for p in parts if p.size > k)
        rho.append(product / power * (count / pairs) if pairs and power > 0 else 0.0)
        bound.append(NORMAL / math.sqrt(pairs) if pairs else 0.0)
    return Autocorrelation([float(k) for k in range(lags + 1)], rho, bound)


def ljung_box(acf: Autocorrelation, n: int, lags: int) -> tuple[float, float]:
    """Q and its chi-squared probability over ``lags``, of values to which nothing was fitted.

    Q = (n + 2)/n sum m_k rho_k^2 with m_k pairs at lag k (taken from the bound), rho_k from :func:`autocorrelation`;
    without gaps it is n (n + 2) sum r_k^2/(n - k) of the biased r_k.
    """
    terms = zip(acf.rho[1 : lags + 1], acf.bound[1 : lags + 1], strict=True)
    q = (n + 2) / n * sum((r * NORMAL / b) ** 2 for r, b in terms if b > 0.0)
    return q, float(special.chdtrc(lags, q))


def fitted_noise(fitted: Array) -> Array | None:
    """Return draws (DRAWS, n) of white noise less what the columns (n, p) of a fit take of it; None for many values,
    which a fit leaves as they are.

    A fit leaves residuals that are correlated even if the noise is not, and tests made for white noise reject them:
    with nine coefficients and 68 windows the chi-squared probability of Ljung and Box is below 0.001 in 2.5 % of the
    records.
    """
    if len(fitted) > LARGE:
        return None
    basis, size, _ = np.linalg.svd(fitted, full_matrices=False)
    basis = basis[:, size > 1e-9 * size[0]]
    z = _draws(len(fitted))
    return np.asarray(z - (z @ basis) @ basis.T)


@functools.lru_cache(maxsize=2)  # a fit asks twice, and the next one is mostly of a record as long
def _draws(n: int) -> Array:
    """White noise (DRAWS, n), the same at every call; read only."""
    z = np.random.default_rng(0).standard_normal((DRAWS, n))
    z.flags.writeable = False
    return z


def ljung_box_of_fit(parts: list[Array], lags: int, null: Array | None) -> tuple[float, float]:
    """Q of the residuals of a linear fit in stretches, and the probability of a larger one if the noise is white.

    null: of :func:`fitted_noise`.  log Q is taken as normal with the mean and variance of these draws: p < 0.001 comes
    in 0.0001 to 0.0012 of the records.
    """
    x = np.concatenate(parts)
    group = np.repeat(np.arange(len(parts)), [p.size for p in parts])
    q = float(_portmanteau(x, group, lags))
    if null is None:
        return q, float(special.chdtrc(lags, q))
    log = np.log(np.maximum(_portmanteau(null, group, lags), 1e-300))
    return q, float(special.ndtr((log.mean() - math.log(max(q, 1e-300))) / max(float(log.std()), 1e-300)))


def _portmanteau(x: Array, group: NDArray[np.int_], lags: int) -> Array:
    """Return Q (as of :func:`ljung_box`) of rows x (..., n); pairs across groups are left out."""
    n = x.shape[-1]
    power = np.maximum(np.einsum("...i,...i", x, x), 1e-300)
    q = np.zeros(x.shape[:-1])
    for k in range(1, min(lags, n - 1) + 1):
        pair = group[k:] == group[:-k]
        if pairs := int(np.count_nonzero(pair)):
            later = x[..., k:] if pairs == pair.size else x[..., k:] * pair
            q += (np.einsum("...i,...i", later, x[..., :-k]) / power * n) ** 2 / pairs
    return np.asarray((n + 2) / n * q)


def runs_test(x: Array, null: Array | None = None) -> tuple[float, float]:
    """Wald-Wolfowitz runs about the median: z, and the probability of so few runs; few are the sign of slow drift.

    One-sided: changes of sign that are too many are no sign of a trend or a step.  null: of :func:`fitted_noise`, gives
    mean and variance of their number; without it those of independent values.
    """
    sign = x[x != np.median(x)] > np.median(x)
    n1, n2 = int(sign.sum()), int((~sign).sum())
    if min(n1, n2) < 2:
        return 0.0, 1.0
    runs = 1 + int(np.sum(sign[1:] != sign[:-1]))
    n = n1 + n2
    mean = 2.0 * n1 * n2 / n + 1.0
    variance = (mean - 1.0) * (mean - 2.0) / (n - 1.0)
    if null is not None:
        above = null > np.median(null, axis=1, keepdims=True)
        each = 1 + np.sum(above[:, 1:] != above[:, :-1], axis=1)
        mean, variance = float(each.mean()), float(each.var())
    if variance <= 0.0:  # as many stated errors as data: residuals of the fit that can only be these
        return 0.0, 1.0
    z = (runs - mean) / math.sqrt(variance)
    return z, float(special.ndtr(z))


def variance_ratio(x: Array, rows: NDArray[np.bool_], null: Array | None) -> tuple[float, float]:
    """Return the mean square of some of the values over that of the others, and the probability of so large a one.

    null: of :func:`fitted_noise`; the logarithm is taken as normal with the mean and variance of these draws, which of
    few rows says less than F does.  1.0, 1.0 where all values or none are among them.
    """
    few, many = int(np.count_nonzero(rows)), int(np.count_nonzero(~rows))
    if not few or not many or null is None:
        return 1.0, 1.0

    def log(v: Array) -> Array:
        square = v * v
        ratio = np.mean(square[..., rows], axis=-1) / np.maximum(np.mean(square[..., ~rows], axis=-1), 1e-300)
        return np.asarray(np.log(np.maximum(ratio, 1e-300)))

    drawn, own = log(null), float(log(x))
    return math.exp(own), float(special.ndtr((drawn.mean() - own) / max(float(drawn.std()), 1e-300)))


def normality(x: Array) -> tuple[float, float]:
    """Shapiro-Wilk statistic and the probability of one so small (up to 5000 values), for heavy tails or skewness.

    Lighter tails than normal, as of readings in coarse steps, narrow no interval: 1 for values that are not skew.
    """
    from scipy import stats  # half a second, which what looks at no residuals need not wait for

    x = x[:5000]
    w, p = stats.shapiro(x)
    d = x - x.mean()
    d /= max(float(np.abs(d).max()), 1e-300)  # of data without noise these are any size
    m2, m3, m4 = (float(np.mean(d**k)) for k in (2, 3, 4))  # central moments: kurtosis m4/m2^2 - 3, skewness m3/m2^1.5
    light = m4 < 3.0 * m2**2 and abs(m3) < 2.0 * math.sqrt(6.0 / x.size) * m2**1.5
    return float(w), 1.0 if light else float(p)


def allan(parts: list[tuple[float, Array]], minimum: int = 9) -> AllanDeviation | None:
    """Overlapping Allan deviation of rate means, pooled over stretches of the most frequent window length.

    tau [s] up to a third of the longest stretch, dev, lo, hi (95 %, unit of the data), see
    :mod:`gyrobench.reduction.series.deviations`; slopes: local log-log slopes.  None when no stretch has ``minimum``
    windows, and where the residuals alone are asked for (asked).
    """
    chosen, window = _alike(parts, minimum)
    if not chosen:
        return None
    found = deviations(chosen, window)["allan"]
    long = found.tau <= window * (max(p.size for p in chosen) // 3)
    use = long & (found.deviation > 0.0)
    tau, dev, low, high = (x[use].tolist() for x in (found.tau, found.deviation, found.low, found.high))
    slopes = [
        AllanSlope(a, b, math.log(y / x) / math.log(b / a))
        for a, b, x, y in zip(tau, tau[1:], dev, dev[1:], strict=False)
    ]
    return AllanDeviation(tau, dev, low, high, slopes)


def spectrum(parts: list[tuple[float, Array]], minimum: int = 16) -> PowerSpectrum | None:
    """One-sided power spectral density (Welch, Hann), averaged over the stretches of the most frequent window length.

    f [Hz], S [unit of the data squared per Hz].  The averaging windows act as a filter sinc^2(f T), not divided out.
    None as the Allan deviation.
    """
    from scipy import signal

    chosen, window = _alike(parts, minimum)
    if not chosen:
        return None
    n = min(p.size for p in chosen)
    both = [signal.welch(p, 1.0 / window, nperseg=n, detrend=False) for p in chosen]
    mean = np.mean([s for _, s in both], axis=0)
    return PowerSpectrum(both[0][0][1:].tolist(), mean[1:].tolist())


def _alike(parts: list[tuple[float, Array]], minimum: int) -> tuple[list[Array], float]:
    long = [(w, p) for w, p in parts if p.size >= minimum]
    if not long or not asked.whole():
        return [], 0.0
    window = max(long, key=lambda item: item[1].size)[0]
    return [p for w, p in long if abs(w - window) <= 0.02 * window], window
