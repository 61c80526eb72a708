"""Likelihood of the variances of white, flicker, random-walk and quantization noise in a rate record.

The cosine transform (DCT of type 2) of a stretch of n samples, without its mean, has uncorrelated ordinates k = 1 .. n-1
for N and K, for Q but for the errors of the first and last angle, which are kept as two effects of their own, and nearly
for B (correlations up to 0.12 among the first, kept for k <= LOW).  Variances per sample, phi = pi k/n, nu = k/2n, of

    N^2/tau0     1
    B^2          c_k sin^2(pi nu) [zeta(3, nu) + zeta(3, 1 - nu)]/(2 pi^3)
    K^2 tau0     (2 + cos phi)/(12 sin^2(phi/2))
    (Q/tau0)^2   4 sin^2(phi/2)

so averaging over tau0 and aliasing are exact.  c_k = 1 - 2/(pi^2 k), the first ones from the covariance of flicker.  R
is a mean of the odd ordinates, eliminated as in restricted maximum likelihood.  [DRIFT-COEFFICIENTS; own derivation]
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft, optimize, special

Array = NDArray[np.float64]
LOW = 32  # ordinates whose correlations by flicker are kept
WIDTH = 0.02  # of a bin of ordinates, of the logarithm of k
FLOOR = 1e-14  # of a variance, where that of the first differences of the record is 1


@functools.cache
def _flicker() -> tuple[Array, Array]:
    """Variance over that of the folded spectrum and correlation matrix of the first ordinates of flicker, k = 1 .. 64.

    From the generalized covariance of means over unit time, -(second difference of t^2 log t)/(2 pi).  They do not
    depend on n (to 1e-4 from n = 1024 on).
    """
    n, low = 1024, 64
    t = np.arange(n + 1.0)
    g = t * t * np.log(np.maximum(t, 1.0))
    gram = np.concatenate([[2.0 * g[1] - 2.0 * g[0]], g[2:] - 2.0 * g[1:-1] + g[:-2]]) / (-2.0 * np.pi)
    index = np.arange(n)
    cov = fft.dctn(gram[np.abs(index[:, None] - index)], norm="ortho")[1 : low + 1, 1 : low + 1]
    variance = np.diag(cov)
    return variance / _folded(np.arange(1.0, low + 1.0) / (2 * n)), cov / np.sqrt(np.outer(variance, variance))


def _folded(nu: Array) -> Array:
    """Spectrum of means of flicker of S = 1/(2 pi f) over unit time, sampled at unit time, at 0 < nu <= 1/2."""
    out: Array = np.sin(np.pi * nu) ** 2 / (2.0 * np.pi**3) * (special.zeta(3.0, nu) + special.zeta(3.0, 1.0 - nu))
    return out


def _basis(k: Array, n: int) -> Array:
    """Variances (4, len(k)) of ordinates k for unit N^2/tau0, B^2, K^2 tau0, (Q/tau0)^2."""
    ratio = _flicker()[0]
    whole = np.minimum(k, ratio.size).astype(int)
    share = np.where(k <= ratio.size, ratio[whole - 1], 1.0 - 2.0 / np.pi**2 / k)
    sine = 4.0 * np.sin(np.pi * k / (2 * n)) ** 2
    return np.array([np.ones_like(k), share * _folded(k / (2 * n)), (1.0 - sine / 6.0) / sine, sine])


@dataclass(frozen=True)
class _Stretch:
    """Binned ordinates of one parity of one stretch: the first ones singly, then sums over bins.

    basis (4, b), count, sum and sum of squares (b,); u: of the error of the angles at the ends; r: of a unit ramp.
    """

    low: int
    basis: Array
    count: Array
    total: Array
    square: Array
    u: Array
    r: Array
    correlation: Array  # (low, low), of flicker


def _bins(rate: Array) -> list[_Stretch]:
    n = rate.size
    c = fft.dct(rate - rate.mean(), norm="ortho")
    edges = [*range(1, int(2.0 / WIDTH))]
    while edges[-1] < n:
        edges.append(max(edges[-1] + 2, round(edges[-1] * (1.0 + WIDTH))))
    edges = [e for e in edges if e < n] + [n]
    out = []
    for parity in (0, 1):
        k = np.arange(2 - parity, n, 2)
        if not k.size:
            continue
        start = np.unique(np.searchsorted(k, edges[:-1]))
        start = start[start < k.size]
        x = c[k]
        count = np.diff(np.append(start, k.size)).astype(float)
        total, square = np.add.reduceat(x, start), np.add.reduceat(x * x, start)
        first, last = k[start], k[np.append(start[1:], k.size) - 1]
        middle = np.where(first == last, first, np.sqrt((first - 1.0) * (last + 1.0)))
        half = np.pi * middle / (2 * n)
        u = math.sqrt(2.0 / n) * np.cos(half)
        r = -u / (2.0 * np.sin(half) ** 2) if parity else np.zeros_like(u)
        low = min(LOW // 2, int(np.count_nonzero(first == last)))
        correlation = _flicker()[1][1 - parity :: 2, 1 - parity :: 2][:low, :low]
        out.append(_Stretch(low, _basis(middle, n), count, total, square, u, r, correlation))
    return out


class Likelihood:
    """-2 log of the restricted likelihood of v = (N^2/tau0, B^2, K^2 tau0, (Q/tau0)^2), the ramp eliminated."""

    def __init__(self, stretches: list[Array]) -> None:
        self.parts = [b for x in stretches for b in _bins(x)]
        self.basis = np.concatenate([p.basis for p in self.parts], axis=1)
        self.count = np.concatenate([p.count for p in self.parts])
        self.square = np.concatenate([p.square for p in self.parts])

    def ramp(self, v: Array) -> tuple[float, float, float]:
        """Return -2 log likelihood without the ramp, information of the ramp and its score, ramp per sample."""
        value = info = score = 0.0
        for p in self.parts:
            spectrum = np.maximum(v @ p.basis, FLOOR)
            weight = 1.0 / spectrum[p.low :]
            count, total, u, r = p.count[p.low :], p.total[p.low :], p.u[p.low :], p.r[p.low :]
            columns = np.array([np.zeros_like(u), u, r])
            g = (columns * (weight * count)) @ columns.T
            g[0] = [p.square[p.low :] @ weight, (weight * total) @ u, (weight * total) @ r]
            value += float(count @ np.log(spectrum[p.low :]))
            if p.low:
                flicker = np.sqrt(v[1] * p.basis[1, : p.low])
                cov = p.correlation * np.outer(flicker, flicker)
                cov[np.diag_indices(p.low)] = spectrum[: p.low]
                root = np.linalg.cholesky(cov)
                white = np.linalg.solve(root, np.array([p.total, p.u, p.r])[:, : p.low].T)
                g += np.triu(white.T @ white)
                value += 2.0 * float(np.log(np.diag(root)).sum())
            shrink = 2.0 * v[3] / (1.0 + 2.0 * v[3] * g[1, 1])
            value += g[0, 0] - shrink * g[0, 1] ** 2 + math.log1p(2.0 * v[3] * g[1, 1])
            info += g[2, 2] - shrink * g[1, 2] ** 2
            score += g[0, 2] - shrink * g[0, 1] * g[1, 2]
        return value, info, score

    def __call__(self, v: Array) -> float:
        value, info, score = self.ramp(v)
        return value - score * score / info + math.log(info)

    def information(self, v: Array) -> Array:
        """Expected information (4, 4) of v, of ordinates taken as uncorrelated."""
        scaled = self.basis / np.maximum(v @ self.basis, FLOOR)
        out: Array = 0.5 * (scaled * self.count) @ scaled.T
        return out

    def start(self) -> Array:
        """Return v by repeated weighted non-negative least squares, the maximum for uncorrelated ordinates."""
        mean, weight = self.square / self.count, np.sqrt(self.count)
        level = mean
        v = np.zeros(4)
        for _ in range(30):
            size = weight / level
            new, _ = optimize.nnls((self.basis * size).T, mean * size)
            done = np.all(np.abs(new - v) <= 1e-3 * new)
            v = new
            level = np.maximum(v @ self.basis, 1e-9 * mean.mean())
            if done:
                break
        return v
