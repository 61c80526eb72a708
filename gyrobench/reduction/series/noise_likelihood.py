"""Likelihood of the variances of white, flicker, random-walk and quantization noise in a rate record.

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
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft, special

Array = NDArray[np.float64]
LOW = 16  # first ordinates of each parity whose correlations by flicker are kept
SHORTEST = 40  # samples of a stretch that is used
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
class _Ordinates:
    """Ordinates of one parity of one stretch: the first LOW singly, then sums over bins.

    basis (4, b); products (6, b): sums over a bin of cc, cu, cr, uu, ur, rr, of the ordinates c, of the error of the
    angles at the ends u and of a unit ramp r; columns (LOW, 3): c, u, r; flicker (LOW, LOW): covariance for unit B.
    """

    basis: Array
    count: Array
    products: Array
    columns: Array
    flicker: Array


def _ordinates(rate: Array) -> list[_Ordinates]:
    n = rate.size
    c = fft.dct(rate - rate.mean(), norm="ortho")
    edges = list(range(1, int(2.0 / WIDTH)))
    while edges[-1] < n:
        edges.append(max(edges[-1] + 2, round(edges[-1] * (1.0 + WIDTH))))
    out = []
    for parity in (1, 0):
        k = np.arange(2 - parity, n, 2)
        start = np.unique(np.searchsorted(k, edges))
        start = start[start < k.size]
        x = c[k]
        count = np.diff(np.append(start, k.size)).astype(float)
        total, square = np.add.reduceat(x, start), np.add.reduceat(x * x, start)
        first, last = k[start], k[np.append(start[1:], k.size) - 1]
        middle = np.where(first == last, first, np.sqrt((first - 1.0) * (last + 1.0)))
        half = np.pi * middle / (2 * n)
        u = math.sqrt(2.0 / n) * np.cos(half)
        r = -u / (2.0 * np.sin(half) ** 2) if parity else np.zeros_like(u)
        basis = _basis(middle, n)
        size = np.sqrt(basis[1, :LOW])
        flicker = _flicker()[1][1 - parity :: 2, 1 - parity :: 2][:LOW, :LOW] * np.outer(size, size)
        products = np.array([square, total * u, total * r, count * u * u, count * u * r, count * r * r])
        out.append(_Ordinates(basis, count, products, np.array([total, u, r])[:, :LOW].T, flicker))
    return out


class Likelihood:
    """-2 log of the restricted likelihood of v = (N^2/tau0, B^2, K^2 tau0, (Q/tau0)^2), the ramp eliminated."""

    def __init__(self, stretches: list[Array]) -> None:
        parts = [part for x in stretches for part in _ordinates(x)]
        self.basis = np.concatenate([p.basis for p in parts], axis=1)
        self.count = np.concatenate([p.count for p in parts])
        self.square = np.concatenate([p.products[0] for p in parts])
        self._columns = np.array([p.columns for p in parts])  # (g, LOW, 3)
        terms = np.zeros((len(parts), 4, LOW, LOW))  # covariance of the first ordinates, g parities of stretches
        terms[:, :, np.arange(LOW), np.arange(LOW)] = [p.basis[:, :LOW] for p in parts]
        terms[:, 1] = [p.flicker for p in parts]
        self._terms = terms
        self._high = np.concatenate([p.basis[:, LOW:] for p in parts], axis=1)
        self._counts = np.concatenate([p.count[LOW:] for p in parts])
        products = np.concatenate([p.products[:, LOW:] for p in parts], axis=1)
        self._sums = np.concatenate([products, (products[:, None] * self._high).reshape(24, -1)])
        self._starts = np.cumsum([0] + [p.count.size - LOW for p in parts])[:-1]

    def _forms(self, v: Array) -> tuple[float, Array, Array, Array]:
        """Return log determinant, its derivative (4,), the forms x' A^-1 y (6, g) and their derivatives (6, 4, g).

        A: covariance without the angles at the ends; x, y as in :class:`_Ordinates`.products.
        """
        weight = 1.0 / np.maximum(v @ self._high, FLOOR)
        cov = np.tensordot(v, self._terms, (0, 1))
        cov[:, np.arange(LOW), np.arange(LOW)] += FLOOR
        inverse = np.linalg.inv(cov)
        solved = inverse @ self._columns
        value = float(np.linalg.slogdet(cov)[1].sum() - self._counts @ np.log(weight))
        slope = np.einsum("gab,gjba->j", inverse, self._terms) + self._high @ (self._counts * weight)
        powers = np.concatenate([self._sums[:6] * weight, self._sums[6:] * weight**2])
        high = np.add.reduceat(powers, self._starts, axis=1)
        low = np.swapaxes(self._columns, 1, 2) @ solved
        change = np.swapaxes(solved, 1, 2)[:, None] @ (self._terms @ solved[:, None])
        i, j = np.triu_indices(3)
        forms = high[:6] + low[:, i, j].T
        changes = -(high[6:].reshape(6, 4, -1) + change[:, :, i, j].transpose(2, 1, 0))
        return value, slope, forms, changes

    def ramp(self, v: Array) -> tuple[float, float]:
        """Return the ramp per sample and its standard deviation, for given v."""
        _, _, (_, cu, cr, uu, ur, rr), _ = self._forms(v)
        shrink = 2.0 * v[3] / (1.0 + 2.0 * v[3] * uu)
        info = float(np.sum(rr - shrink * ur**2))
        return float(np.sum(cr - shrink * cu * ur)) / info, 1.0 / math.sqrt(info)

    def __call__(self, v: Array) -> tuple[float, Array]:
        """Return the value and its derivative (4,)."""
        value, slope, (cc, cu, cr, uu, ur, rr), changes = self._forms(v)
        s = 2.0 * v[3]
        left = 1.0 / (1.0 + s * uu)
        shrink = s * left
        info, score = float(np.sum(rr - shrink * ur**2)), float(np.sum(cr - shrink * cu * ur))
        value += float(np.sum(cc - shrink * cu**2 - np.log(left))) - score**2 / info + math.log(info)
        by_info, by_score = (score / info) ** 2 + 1.0 / info, -2.0 * score / info
        one = np.ones_like(cc)
        gradient = np.array([
            one,
            -2.0 * shrink * cu - by_score * shrink * ur,
            by_score * one,
            shrink + shrink**2 * (cu**2 + by_info * ur**2 + by_score * cu * ur),
            -2.0 * by_info * shrink * ur - by_score * shrink * cu,
            by_info * one,
        ])  # fmt: skip
        slope = slope + np.einsum("pg,pjg->j", gradient, changes)
        slope[3] += 2.0 * float(np.sum(uu * left - left**2 * (cu**2 + by_info * ur**2 + by_score * cu * ur)))
        return value, slope

    def information(self, v: Array) -> Array:
        """Return the expected information (4, 4) of v, of ordinates taken as uncorrelated."""
        scaled = self.basis / np.maximum(v @ self.basis, FLOOR)
        out: Array = 0.5 * (scaled * self.count) @ scaled.T
        return out

    def start(self) -> Array:
        """Return v of which every component alone is half of what the powers of neighbouring bins allow."""
        first = np.arange(0, self.count.size, 8)
        level = np.add.reduceat(self.square, first) / np.add.reduceat(self.count * self.basis, first, axis=1)
        out: Array = 0.5 * level.min(axis=1)
        return out
