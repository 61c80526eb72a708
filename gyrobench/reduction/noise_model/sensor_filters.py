"""Filters of a sensor: |H|^2, |H(0)| = 1, at the frequencies of a grid; parameters p are logarithms.

A name is one filter, or "mean4+first" of two in a row:
"none"; "first" order z = e^(-1/tau); "second" order, natural frequency and damping; "average" over w samples,
"mean4" over 4 of them, "bartlett4" twice; "first*", "mean4*": of slow noise too, which passes what white noise from the
same place passes;
digital low-passes, of slow noise too: "butterworth" of any order and a "cascade" of equal ones of first order (of means
over two samples, too), with zeros at half the sampling rate (bilinear transform), "recursive" of two poles alone;
"shape", |H|^2 = exp(sum of c_j (cos j omega - 1)), which is any smooth roll-off (cepstrum).
[DRIFT-NOISE-MODEL; own derivation]
"""

from __future__ import annotations

import functools
import math
import string
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.series.noise_spectra import folded

DIGITAL = ("butterworth", "cascade", "recursive")  # slow noise passes them too: they hold back what it has above them
MEANS = {"mean": 1, "bartlett": 2}  # over a whole number of samples, with zeros: how often
ALL = "*"  # at the end of the name of a filter that slow noise passes too
NEARLY_ZERO = 1e-4  # of a cell of a spectrum, where a mean has 0/0
BIN = ((5.0 / 18.0, -math.sqrt(0.6)), (4.0 / 9.0, 0.0), (5.0 / 18.0, math.sqrt(0.6)))  # Gauss-Legendre: exact to x^5
LEAST_PASSED = 1e12  # of the power, what a digital low-pass holds back at most


class Grid:
    """Frequencies (b,) at which spectra are wanted, with what all terms need of them.

    half_width of bins (b,), samples (b,) of the stretch they are of: infinite for the spectrum itself.
    """

    def __init__(
        self, omega: Array, means: bool = False, half_width: Array | None = None, samples: Array | float = math.inf
    ) -> None:
        self.omega, self.means, self.samples = omega, means, samples
        self.half_width = np.zeros_like(omega) if half_width is None else half_width
        self._kept: dict[tuple[str, int, int], Array] = {}

    def kept(self, name: str, count: int, times: int, made: Callable[[int, Grid, int], Array]) -> Array:
        """Return what is made (b,) of a mean over ``count`` samples taken so often; it has no other parameter, and is
        made once.
        """
        key = name, count, times
        if key not in self._kept:
            self._kept[key] = made(count, self, times)
        return self._kept[key]

    @functools.cached_property
    def cos(self) -> Array:
        return np.cos(self.omega)

    @functools.cached_property
    def sine(self) -> Array:
        """4 sin^2(omega/2)."""
        return 4.0 * np.sin(0.5 * self.omega) ** 2

    @functools.cached_property
    def tangent(self) -> Array:
        """tan(omega/2)."""
        return np.tan(0.5 * np.minimum(self.omega, math.pi - NEARLY_ZERO))

    @functools.cached_property
    def flicker(self) -> Array:
        return folded(self.omega / (2.0 * math.pi))

    @functools.cached_property
    def walk(self) -> Array:
        return 1.0 / self.sine - (1.0 / 6.0 if self.means else 0.0)


def poisson(z: Any, cos: Array) -> Any:
    """P(z) = sum of z^|h| cos(h omega) over all h; z (..., 1), real or complex, cos (b,)."""
    return (1.0 - z * z) / (1.0 - 2.0 * z * cos + z * z)


def second_poles(p: Array) -> tuple[Any, Any, Any]:
    """Return z1, z2 and the share a: covariance Re(a z1^h + (1 - a) z2^h) of a second-order low-pass, p: log omega_n,
    log zeta.
    """
    w, zeta = np.exp(np.clip(p[..., 0:1], -8.0, 5.0)), np.exp(np.clip(p[..., 1:2], -5.0, 5.0))
    root = np.sqrt((zeta * zeta - 1.0 + 1e-9).astype(complex))
    s1, s2 = -w * (zeta - root), -w * (zeta + root)
    share = s2 / (s2 - s1)  # of the covariance, from that of white noise through 1/((s - s1)(s - s2))
    return np.exp(s1), np.exp(s2), share


def _first(p: Array, grid: Grid) -> Array:
    z = np.exp(-np.exp(-p[..., 0:1]))
    out: Array = ((1.0 - z) ** 2) / (1.0 - 2.0 * z * grid.cos + z * z)
    return out


def _second(p: Array, grid: Grid) -> Array:
    z1, z2, share = second_poles(p)
    at_zero = share * poisson(z1, np.ones(1)) + (1.0 - share) * poisson(z2, np.ones(1))
    out: Array = np.real(share * poisson(z1, grid.cos) + (1.0 - share) * poisson(z2, grid.cos)) / np.real(at_zero)
    return out


def _fejer(k: int, grid: Grid, times: int) -> Array:
    """Return sin^2(k omega/2)/(k sin^2(omega/2)), or its square, of bins by Gauss's rule: about zeros a parabola."""
    rows = BIN if grid.half_width.any() else ((1.0, 0.0),)
    halves = [(share, 0.5 * (grid.omega + at * grid.half_width)) for share, at in rows]
    return np.asarray(sum(share * ((np.sin(k * half) / np.sin(half)) ** 2 / k) ** times for share, half in halves))


def average_parts(p: Array) -> tuple[Array, Array, Array]:
    """Return m = floor(w) and the shares of the triangles over m and m + 1 in max(0, 1 - |h|/w), h whole, p: log w."""
    w = np.maximum(np.exp(p[..., 0:1]), 1.0)
    m = np.floor(w)
    upper = (m + 1.0) * (1.0 - m / w)
    return m, 1.0 - upper, upper


def _average(p: Array, grid: Grid) -> Array:
    """Mean of white noise over w samples, w any real number from 1 on: covariance max(0, 1 - |h|/w)."""
    m, lower, upper = average_parts(p)
    whole, place = np.unique(m, return_inverse=True)
    two = [np.array([grid.kept("fejer", int(k) + more, 1, _fejer) for k in whole]) for more in (0, 1)]
    below, above = (rows[place].reshape(*m.shape[:-1], -1) for rows in two)
    out: Array = (lower * below + upper * above) / (lower * m + upper * (m + 1.0))
    return out


def _mean(count: int, grid: Grid, times: int) -> Array:
    """Mean of white noise over ``count`` samples; its zeros hold what a stretch of n samples leaks there."""
    gamma = covariance_of_mean(count, times)[1:, None]
    h = np.arange(1.0, gamma.size + 1.0)[:, None]
    wave = h * np.cos(h * grid.omega) + np.sin(h * grid.omega) / np.sin(np.minimum(grid.omega, math.pi - 1e-7))
    leak = -2.0 * np.sum(gamma * wave, axis=0) / grid.samples
    out: Array = _fejer(count, grid, times) / count**times + np.maximum(leak, 0.0)
    return out


def covariance_of_mean(count: int, times: int) -> Array:
    """Return the covariance at lags from 0 on of white noise, N = 1, of which means over samples are taken."""
    kernel = functools.reduce(np.convolve, [np.full(count, 1.0 / count)] * times)
    return np.correlate(kernel, kernel, "full")[kernel.size - 1 :]


def _butterworth(p: Array, grid: Grid) -> Array:
    """1/(1 + (tan(omega/2)/t)^(2 n)), p: log t, log n."""
    x = 2.0 * np.exp(p[..., 1:2]) * (np.log(grid.tangent) - p[..., 0:1])
    return np.asarray(1.0 / (1.0 + np.exp(np.minimum(x, math.log(LEAST_PASSED)))))


def _cascade(p: Array, grid: Grid) -> Array:
    """(1 + (tan(omega/2)/t)^2)^-k, p: log t, log k."""
    x = np.exp(p[..., 1:2]) * np.log1p((grid.tangent * np.exp(-p[..., 0:1])) ** 2)
    return np.asarray(np.exp(-np.minimum(x, math.log(LEAST_PASSED))))


def _recursive(p: Array, grid: Grid) -> Array:
    """Product of (1 - z)^2/(1 - 2 z cos omega + z^2) over both poles z of a low-pass of second order."""
    z1, z2, _ = second_poles(p)
    out: Array = np.real(np.prod([(1.0 - z) ** 2 / (1.0 - 2.0 * z * grid.cos + z * z) for z in (z1, z2)], axis=0))
    return out


def _shape(p: Array, grid: Grid) -> Array:
    waves = np.array([np.cos((j + 1) * grid.omega) - 1.0 for j in range(p.shape[-1])])
    out: Array = np.exp(np.clip(p @ waves, -40.0, 40.0))
    return out


FILTERS: Mapping[str, tuple[Callable[[Array, Grid], Array], int]] = {
    "none": (lambda p, grid: np.ones(np.shape(p[..., :1])[:-1] + grid.omega.shape), 0),
    "first": (_first, 1),
    "second": (_second, 2),
    "average": (_average, 1),
    "butterworth": (_butterworth, 2),
    "cascade": (_cascade, 2),
    "recursive": (_recursive, 2),
}


def samples_of(name: str) -> int:
    """Return the samples that a filter of MEANS is over."""
    return int(name.strip(string.ascii_lowercase + ALL))


def passes_slow(name: str) -> bool:
    """Return whether slow noise passes a filter too."""
    return name in DIGITAL or name.endswith(ALL)


@functools.cache
def filter_of(name: str) -> tuple[Callable[[Array, Grid], Array], int]:
    """Return |H|^2 (.., p) -> (.., b) and the number of parameters of a filter; "shape3" has three, "mean4" none.

    Of two in a row, "mean4+first", the parameters of the first one come first.
    """
    name = name.removesuffix(ALL)
    if "+" in name:
        (one, count), (two, more) = (filter_of(part) for part in name.split("+"))
        return (lambda p, grid: one(p[..., :count], grid) * two(p[..., count:], grid)), count + more
    if name.startswith(tuple(MEANS)):
        of = samples_of(name), MEANS[name.rstrip(string.digits)]
        return lambda p, grid: np.broadcast_to(grid.kept("mean", *of, _mean), (*p.shape[:-1], grid.omega.size)), 0
    return (_shape, int(name[5:])) if name.startswith("shape") else FILTERS[name]
