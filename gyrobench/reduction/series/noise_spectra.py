"""Flicker noise in means over unit time: spectrum, and covariance of the first ordinates of a cosine transform.

Averaging and aliasing are exact.  [DRIFT-COEFFICIENTS; own derivation]
"""

from __future__ import annotations

import functools

import numpy as np
from scipy import fft, special

from gyrobench.arrays import Array


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
