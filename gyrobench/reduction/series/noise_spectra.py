"""Variances of the ordinates of a cosine transform for white, flicker, random-walk and quantization noise.

The cosine transform (DCT of type 2) of a stretch of n samples, without its mean, has ordinates k = 1 .. n-1 that are
uncorrelated for N and K, for Q but for the errors of the first and last angle, which are kept as two effects of their
own, and nearly for B (correlations up to 0.12 among the first, kept for k <= 2 LOW).  Variances per sample of

    N^2/tau0     1
    B^2          c_k sin^2(pi nu) [zeta(3, nu) + zeta(3, 1 - nu)]/(2 pi^3)
    K^2 tau0     (2 + cos phi)/(12 sin^2(phi/2))
    (Q/tau0)^2   4 sin^2(phi/2)

with phi = pi k/n, nu = k/2n: averaging over tau0 and aliasing are exact.  c_k = 1 - 2/(pi^2 k), the first ones from the
covariance of flicker.  R is a mean of the odd ordinates, eliminated as in restricted maximum likelihood.
[DRIFT-COEFFICIENTS; own derivation]
"""

from __future__ import annotations

import functools

import numpy as np
from scipy import fft, special

from gyrobench.arrays import Array

WIDTH = 0.02  # of a bin of ordinates, of the logarithm of k


@functools.cache
def flicker(n: int = 1024, low: int = 64) -> tuple[Array, Array]:
    """Variance over that of the folded spectrum and correlation matrix of the first ordinates of flicker, k = 1 .. low.

    From the generalized covariance of means over unit time, -(second difference of t^2 log t)/(2 pi).  They do not
    depend on n (to 1e-4 from n = 1024 on).
    """
    t = np.arange(n + 1.0)
    g = t * t * np.log(np.maximum(t, 1.0))
    gram = np.concatenate([[2.0 * g[1] - 2.0 * g[0]], g[2:] - 2.0 * g[1:-1] + g[:-2]]) / (-2.0 * np.pi)
    index = np.arange(n)
    cov = fft.dctn(gram[np.abs(index[:, None] - index)], norm="ortho")[1 : low + 1, 1 : low + 1]
    variance = np.diag(cov)
    return variance / folded(np.arange(1.0, low + 1.0) / (2 * n)), cov / np.sqrt(np.outer(variance, variance))


def folded(nu: Array) -> Array:
    """Spectrum of means of flicker of S = 1/(2 pi f) over unit time, sampled at unit time, at 0 < nu <= 1/2."""
    return np.asarray(
        np.sin(np.pi * nu) ** 2 / (2.0 * np.pi**3) * (special.zeta(3.0, nu) + special.zeta(3.0, 1.0 - nu))
    )


def basis(k: Array, n: int) -> Array:
    """Variances (4, len(k)) of ordinates k for unit N^2/tau0, B^2, K^2 tau0, (Q/tau0)^2."""
    ratio = flicker()[0]
    whole = np.minimum(k, ratio.size).astype(int)
    share = np.where(k <= ratio.size, ratio[whole - 1], 1.0 - 2.0 / np.pi**2 / k)
    sine = 4.0 * np.sin(np.pi * k / (2 * n)) ** 2
    return np.array([np.ones_like(k), share * folded(k / (2 * n)), (1.0 - sine / 6.0) / sine, sine])


class FastPowers:
    """Powers of ordinates above a frequency (per sample), of stretches of any length, summed up in bins of frequency.

    Rows of ``sums``: number of ordinates, their squares, variances (4) and frequency, each times the number.
    """

    def __init__(self, lowest: float) -> None:
        self.edges = np.minimum(lowest * np.exp(WIDTH * np.arange(2 + int(np.log(0.5 / lowest) / WIDTH))), 0.5)
        self.sums = np.zeros((7, self.edges.size - 1))

    def add(self, rate: Array) -> None:
        """Add a stretch (n,), less its line of least squares, which would leak."""
        n = rate.size
        t = np.arange(n) - 0.5 * (n - 1)
        c = fft.dct(rate - t * (float(t @ rate) / float(t @ t)), norm="ortho")
        k = np.unique(np.ceil(2 * n * self.edges).astype(int))
        k = k[k < n]
        last = np.append(k[1:], n) - 1
        count, middle = (last - k + 1.0), np.sqrt((k - 0.5) * (last + 0.5))
        variance = basis(middle, n)
        variance[3] += 4.0 / n * np.cos(np.pi * middle / (2 * n)) ** 2  # of the angles at the ends
        rows = [count, np.add.reduceat(c * c, k), *(count * variance), count * middle / (2 * n)]
        place = np.clip(np.searchsorted(self.edges, middle / (2 * n)) - 1, 0, self.sums.shape[1] - 1)
        for total, new in zip(self.sums, rows, strict=True):
            total += np.bincount(place, new, total.size)
