"""Likelihood of the variances of white, flicker, random-walk and quantization noise in a rate record.

The likelihood is that of the ordinates of the cosine transform of each stretch, see :mod:`noise_spectra`: the first
ones singly, the others in bins.  The ramp, a mean of the odd ones, is eliminated as in restricted maximum likelihood.
[DRIFT-COEFFICIENTS; own derivation]
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import fft, optimize, special

from gyrobench.arrays import Array
from gyrobench.reduction.series import noise_spectra
from gyrobench.reduction.series.long_record import Condensed

LOW = 16  # first ordinates of each parity whose correlations by flicker are kept
BAND = 1.5  # frequencies of a band of the check
FLOOR = 1e-14  # of a variance, where that of the first differences of the record is 1


@dataclass(frozen=True)
class _Ordinates:
    """Ordinates of one parity of one stretch: the first LOW singly, then sums over bins.

    basis (4, b); products (6, b): sums over a bin of cc, cu, cr, uu, ur, rr, of the ordinates c, of the error of the
    angles at the ends u and of a unit ramp r; columns (LOW, 3): c, u, r; flicker (LOW, LOW): covariance for unit B;
    frequency (b,), per sample; largest (2, b): square of an ordinate of the bin, and its frequency.
    """

    basis: Array
    count: Array
    products: Array
    columns: Array
    flicker: Array
    frequency: Array
    largest: Array


def _ordinates(rate: Array, block: int) -> list[_Ordinates]:
    """Both parities of a stretch of means over ``block`` samples, odd ordinates first."""
    n = rate.size
    c = fft.dct(rate - rate.mean(), norm="ortho")
    edges = list(range(1, int(2.0 / noise_spectra.WIDTH)))
    while edges[-1] < n:
        edges.append(max(edges[-1] + 2, round(edges[-1] * (1.0 + noise_spectra.WIDTH))))
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
        # in the units of single samples
        basis = noise_spectra.basis(middle, n) * np.array([[1.0 / block], [1.0], [block], [block**-2.0]])
        u, r = u / block, r * block
        size = np.sqrt(basis[1, :LOW])
        flicker = noise_spectra.flicker()[1][1 - parity :: 2, 1 - parity :: 2][:LOW, :LOW] * np.outer(size, size)
        products = np.array([square, total * u, total * r, count * u * u, count * u * r, count * r * r])
        largest = np.maximum.reduceat(x * x, start)
        at = np.flatnonzero(x * x == np.repeat(largest, count.astype(int)))
        at = at[np.searchsorted(at, start)]  # the first of equal ones
        tops = np.array([largest, k[at] / (2.0 * n * block)])
        columns = np.array([total, u, r])[:, :LOW].T
        out.append(_Ordinates(basis, count, products, columns, flicker, middle / (2 * n * block), tops))
    return out


class Likelihood:
    """-2 log of the restricted likelihood of v = (N^2/tau0, B^2, K^2 tau0, (Q/tau0)^2), the ramp eliminated."""

    def __init__(self, record: Condensed) -> None:
        parts = [part for x in record.stretches for part in _ordinates(x, record.block)]
        self._columns = np.array([p.columns for p in parts])  # (g, LOW, 3)
        terms = np.zeros((len(parts), 4, LOW, LOW))  # covariance of the first ordinates, g parities of stretches
        terms[:, :, np.arange(LOW), np.arange(LOW)] = [p.basis[:, :LOW] for p in parts]
        terms[:, 1] = [p.flicker for p in parts]
        self._terms = terms
        basis, count = [p.basis for p in parts], [p.count for p in parts]
        products = [p.products for p in parts]
        starts = np.cumsum([0] + [c.size - LOW for c in count])[: len(parts)]
        high = [slice(LOW, None)] * len(parts)
        fast = record.fast[:, record.fast[0] > 0.0]
        if fast.size:  # one more group, without the parts of u and r
            basis.append(fast[2:6] / fast[0])
            count.append(fast[0])
            products.append(np.concatenate([fast[1:2], np.zeros((5, fast.shape[1]))]))
            high.append(slice(None))
            starts = np.append(starts, sum(c.size - LOW for c in count[:-1]))
        self.basis, self.count = np.concatenate(basis, axis=1), np.concatenate(count)
        self.products = np.concatenate(products, axis=1)
        self.frequency = np.concatenate([p.frequency for p in parts])
        self.largest = np.concatenate([p.largest for p in parts], axis=1)
        self.frequency = np.append(self.frequency, fast[6] / fast[0])
        self._high = np.concatenate([b[:, s] for b, s in zip(basis, high, strict=True)], axis=1)
        self._counts = np.concatenate([c[s] for c, s in zip(count, high, strict=True)])
        sums = np.concatenate([p[:, s] for p, s in zip(products, high, strict=True)], axis=1)
        self._sums = np.concatenate([sums, (sums[:, None] * self._high).reshape(24, -1)])
        self._starts, self._sizes = starts, [c.size for c in count]

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
        forms, changes = high[:6], -high[6:].reshape(6, 4, -1)
        forms[:, : len(low)] += low[:, i, j].T
        changes[:, :, : len(low)] -= change[:, :, i, j].transpose(2, 1, 0)
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
        return np.asarray(0.5 * (scaled * self.count) @ scaled.T)

    def check(self, v: Array) -> tuple[float, Array, float, float]:
        """Return p of so large a departure of the spectrum, its band, p of so large an ordinate (a line), its place.

        Powers over those of the model, in bands of a factor BAND, are chi-squared over their number of ordinates; their
        normal scores (Wilson and Hilferty) squared and summed up are chi-squared over the bands less the terms fitted.
        Band (3,): lower and upper frequency per sample, power over the model's, where it departs most.  Line: the
        largest single ordinate over the model, and its frequency per sample.
        """
        ramp, model = self.ramp(v)[0], np.maximum(v @ self.basis, FLOOR)
        _, _, (_, cu, _, uu, ur, _), _ = self._forms(v)
        ends = np.repeat(2.0 * v[3] * (cu - ramp * ur) / (1.0 + 2.0 * v[3] * uu), self._sizes)
        cc, cu, cr, uu, ur, rr = self.products
        power = (cc - 2.0 * (ramp * cr + ends * cu - ramp * ends * ur) + ramp**2 * rr + ends**2 * uu) / model
        band = np.floor(np.log(self.frequency / self.frequency.min()) / math.log(BAND)).astype(int)
        number, total = np.bincount(band, self.count), np.bincount(band, power)
        used = number >= 4
        number, ratio = number[used], total[used] / number[used]
        score = (np.cbrt(ratio) - 1.0 + 2.0 / (9.0 * number)) / np.sqrt(2.0 / (9.0 * number))
        p = float(special.chdtrc(max(number.size - np.count_nonzero(v), 1), score @ score))
        worst = int(np.argmax(np.abs(score)))
        edge = self.frequency.min() * BAND ** (np.flatnonzero(used)[worst] + np.arange(2.0))
        # a single ordinate is measured against what the angles at the ends and the ramp may add, too
        single = model + (2.0 * v[3] * uu + ramp**2 * rr) / self.count
        tops = self.largest[0] / single[: self.largest.shape[1]]
        top = int(np.argmax(tops))
        line = -math.expm1(self.count[: tops.size].sum() * math.log1p(-special.erfc(math.sqrt(0.5 * tops[top]))))
        return p, np.append(edge, ratio[worst]), line, float(self.largest[1, top])

    def start(self) -> Array:
        """Return v of the least relative squares of the powers of eight neighbouring bins each."""
        first = np.arange(0, self.count.size, 8)
        level = np.add.reduceat(self.products[0], first)
        level = np.maximum(level, 1e-12 * level.max())
        share = np.add.reduceat(self.count * self.basis, first, axis=1) / level
        weight = np.sqrt(np.minimum(np.add.reduceat(self.count, first), 1e4))
        v, _ = optimize.nnls((share * weight).T, weight)
        return np.asarray(np.maximum(v, 0.01 / share.max(axis=1)))
