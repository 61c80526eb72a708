"""Smoothed spectrum of a stretch, and products with its precision, diagonal in the cosine transform.

[DRIFT-NOISE-MODEL; own derivation]
"""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy import fft, linalg, ndimage

from gyrobench.arrays import Array

# ordinates to either side of a smoothed one: of the frequency and a power of it, which make its bias at the zero of a
# filter fall with the length of the record as its scatter does
SMOOTH, POWER = 0.0945, 0.75
FEW = 400  # samples whose products are those of a matrix
ITERATIONS, EXACT = 60, 1e-3  # of the conjugate gradients
FIRST, LEAST = 8, 0.1  # ordinates whose spectrum is not less than a part of that after them
NARROW, ABOVE = 5, 4.0  # ordinates of a narrow mean, and how much it exceeds the smooth spectrum where it is taken


@functools.lru_cache(maxsize=1)
def _means_about(n: int) -> tuple[NDArray[np.int32], NDArray[np.int32], Array]:
    """Return, of the means about each of the ordinates 1 .. n - 1, the ordinate before the first one, the last one, and
    their number.
    """
    k = np.arange(1, n)
    half = np.maximum(6, (SMOOTH * k**POWER).astype(int))
    # one-sided at the ends would be biased by the slope: as far on the one side as on the other
    near = np.minimum(half, np.minimum(k - 1, n - 1 - k))
    near = np.maximum(near, np.minimum(2, np.minimum(k - 1, n - 1 - k)))
    return (k - near - 1).astype(np.int32), (k + near).astype(np.int32), 2.0 * near + 1.0


def smooth_spectrum(power: Array) -> Array:
    """Return a smoothed spectrum (n,) of powers (n,) of ordinates; that of the mean, k = 0, is very large."""
    n = power.size
    total = np.concatenate([[0.0], np.cumsum(power[1:])])
    before, last, count = _means_about(n)
    broad = (total[last] - total[before]) / count
    fine = ndimage.uniform_filter1d(power[1:], NARROW, mode="reflect")
    out = np.empty(n)
    out[1:] = np.where((fine > ABOVE * broad) & (np.arange(1, n) > 30), fine, broad)
    out[1:] = np.maximum(out[1:], 1e-12 * float(np.mean(power[1:])))
    # nothing holds a mean of few ordinates up when completion and spectrum follow one another
    out[1:FIRST] = np.maximum(out[1:FIRST], LEAST * out[min(FIRST, n - 1)])
    out[0] = 100.0 * n * float(np.max(out[1:]))
    return out


def even_across(S: Array, places: Array) -> Array:
    """Return a smoothed spectrum S (n,) without what a line at each of the places (k,) adds to it: its logarithm is
    straight across the ordinates that it is smoothed over.
    """
    S, n = S.copy(), S.size
    for at in np.rint(places).astype(int).tolist():
        half = max(6, int(SMOOTH * at**POWER)) + NARROW
        low, high = max(at - half, 1), min(at + half, n - 1)
        S[low : high + 1] = np.exp(np.interp(np.arange(low, high + 1), [low, high], np.log(S[[low, high]])))
    return S


def ordinates(x: Array) -> Array:
    """Return those of the cosine transform of a series (n,)."""
    out: Array = fft.dct(x, norm="ortho")
    return out


class Precision:
    """Products with the precision P of a spectrum S (n,)."""

    def __init__(self, S: Array) -> None:
        self.S = S

    def __call__(self, x: Array) -> Array:
        return self.of(ordinates(x))

    def of(self, X: Array) -> Array:
        """Return the product with the series of ordinates X (n,)."""
        out: Array = fft.idct(X / self.S, norm="ortho")
        return out

    @functools.cached_property
    def diagonal(self) -> float:
        return float(np.mean(1.0 / self.S))

    @functools.cached_property
    def _correlation(self) -> Array:
        """Return the series (n + 1,) of the inverse of the spectrum at lags 0 to n; beyond n it comes back."""
        inverse = 1.0 / self.S
        out: Array = fft.dct(np.append(inverse, inverse[-1]), type=1, norm="forward")
        return out

    def _among(self, at: NDArray[np.int64]) -> Callable[[Array], Array]:
        """Return what gives P_mm d (m,) of d (m,), for samples m at ``at``.

        The cosines of two samples i, j multiply to those of i - j and i + j + 1: of FEW samples the elements are read
        off the series of 1/S.  Its ordinate n is in both with opposite signs.
        """
        if at.size > FEW:
            full = np.zeros(self.S.size)

            def through(d: Array) -> Array:
                full[at] = d
                return self(full)[at]

            return through
        p = self._correlation
        together = np.add.outer(at, at) + 1
        elements = p[np.abs(np.subtract.outer(at, at))] + p[np.minimum(together, 2 * self.S.size - together)]
        return lambda d: elements @ d

    def solver(self, at: NDArray[np.int64]) -> Callable[[Array], Array]:
        """Return what gives P_mm^-1 r (m,) of r (m,), for samples m at ``at``: conjugate gradients that start from the
        blocks of P of each gap alone.

        Without them 60 steps leave a tenth of the low frequencies out where a filter holds the noise 10^4 below.
        """
        begin = np.flatnonzero(np.diff(at, prepend=-2) > 1)
        lengths = np.diff(begin, append=at.size)
        gaps = [(n, begin[lengths == n, None] + np.arange(n)) for n in np.unique(lengths).tolist()]
        # far from the ends P is a Toeplitz matrix, and the factor of a gap is the first part of that of a longer one
        p = self._correlation
        factor = linalg.cholesky(linalg.toeplitz(p[: gaps[-1][0]]), lower=True)
        apply = self._among(at)

        def alone(r: Array) -> Array:
            z = np.empty_like(r)
            for n, rows in gaps:
                z[rows] = linalg.cho_solve((factor[:n, :n], True), r[rows].T, check_finite=False).T
            return z

        def solve(right: Array) -> Array:
            x, r = np.zeros_like(right), right.copy()
            d = z = alone(r)
            rz = float(r @ z)
            stop = EXACT**2 * rz
            for _ in range(ITERATIONS):
                if rz <= stop:
                    break
                q = apply(d)
                step = rz / float(d @ q)
                x += step * d
                r -= step * q
                z = alone(r)
                rz, old = float(r @ z), rz
                d = z + rz / old * d
            return x

        return solve
