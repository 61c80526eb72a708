"""Terms of the noise of a sampled rate: power spectrum and Allan variance of each, exact with aliasing.

Unit time is the sampling interval T, omega = 2 pi f T; a spectrum S is two-sided, its mean over |omega| < pi is the
variance of a sample.  A covariance A z^|h| has S = A P(z), P = (1 - z^2)/(1 - 2 z cos omega + z^2), complex z too.

    term             S(omega)                                        parameters (logarithms)
    white            N^2 |H|^2, H of the sensor's filter, H(0) = 1    N^2, those of the filter
    readout          white noise that the filter does not see        its level
    quantization     Q^2 4 sin^2(omega/2)                             Q^2
    gauss_markov     sigma^2 P(e^(-1/tau))                            sigma^2, tau
    flicker          B^2/omega, means over T                          B^2
    walk             K^2/(4 sin^2(omega/2))                           K^2
    resonance        sigma^2 sin^2(omega/2)/sin^2(omega0/2) Re((1 - i/(omega0 tau)) P(e^(-1/tau + i omega0))): the
                     angle of a damped oscillator that noise drives   sigma^2, tau, omega0
    band             covariance sigma^2 e^(-h^2/2 tau^2) cos omega0 h  sigma^2, tau, omega0: a resonance that wanders

Filters: gyrobench.reduction.noise_model.sensor_filters.
N^2 is the level of the sampled noise towards frequency 0, with what is folded.  Samples are instants, or means over T
(``means``:  Gauss-Markov drift and random walk; faster terms are those of the samples as they are).
[DRIFT-NOISE-MODEL; own derivation]
"""

from __future__ import annotations

import math
import string
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import special

from gyrobench.arrays import Array
from gyrobench.reduction.noise_model.sensor_filters import (
    ALL,
    MEANS,
    NEARLY_ZERO,
    Grid,
    average_parts,
    covariance_of_mean,
    filter_of,
    poisson,
    samples_of,
    second_poles,
)

PEAKS = ("resonance", "band")
SLOW = ("gauss_markov", "flicker", "walk")
SIZES = {"gauss_markov": 2, "resonance": 3, "band": 3}  # parameters, one of other terms
FLICKER = 2.0 * math.log(2.0) / math.pi  # Allan variance over B^2
LAGS = 4096  # of the covariance of a filter "shape"
FASTEST = 1e-300  # pole
RISES = 512  # frequencies, over which the angle noise of a filter that rises is summed


def markov_parts(tau: Array, means: bool) -> tuple[Array, Array, Array]:
    """Return z, amplitude and nugget: covariance of a Gauss-Markov process of unit variance amplitude z^|h| - nugget at
    h = 0, of instants or of means over unit time.
    """
    r = 1.0 / tau
    z = np.exp(-r)
    if not means:
        return z, np.ones_like(z), np.zeros_like(z)
    small = r < 1e-3
    safe = np.where(small, 1.0, np.minimum(r, 500.0))
    amplitude = np.where(small, 1.0 + r * r / 12.0, (2.0 * np.cosh(safe) - 2.0) / safe**2)
    nugget = np.where(small, r / 3.0, (2.0 * np.sinh(safe) - 2.0 * safe) / safe**2)
    return z, amplitude, nugget


@dataclass(frozen=True)
class NoiseTerm:
    """One term of a model; ``name`` as above, of white noise "white" with its ``filter``.

    The first parameter is the logarithm of the variance-like size, in which the spectrum is linear.
    """

    name: str
    filter: str = "none"

    @property
    def size(self) -> int:
        """Return the number of parameters."""
        return 1 + filter_of(self.filter)[1] if self.name == "white" else SIZES.get(self.name, 1)

    @property
    def rises(self) -> bool:
        """Return whether the spectrum rises from frequency 0 on, so that single angles have errors."""
        return (
            self.name == "quantization"
            or self.name in PEAKS
            or (self.name == "white" and any(rising in self.filter for rising in ("second", "recursive", "shape")))
        )

    def unit(self, p: Array, grid: Grid) -> Array:
        """Return the spectrum (..., b) for a unit first parameter; p (..., size - 1) are the others."""
        if self.name == "white":
            return filter_of(self.filter)[0](p, grid)
        if self.name == "gauss_markov":
            z, amplitude, nugget = markov_parts(np.exp(p[..., 0:1]), grid.means)
            out: Array = amplitude * poisson(z, grid.cos) - nugget
            return out
        if self.name == "resonance":
            return _resonance(p, grid)
        if self.name == "band":
            return _band(p, grid)
        if self.name == "readout":
            return np.ones((*p.shape[:-1], grid.omega.size))
        fixed = {"quantization": grid.sine, "flicker": grid.flicker, "walk": grid.walk}[self.name]
        return np.broadcast_to(fixed, (*p.shape[:-1], fixed.size))

    def spectrum(self, p: Array, grid: Grid) -> Array:
        """Return S (..., b) for parameters p (..., size)."""
        return np.exp(p[..., 0:1]) * self.unit(p[..., 1:], grid)

    def angle(self, p: Array) -> Array:
        """Return the variance (...) of the errors of single angles: of what rises from frequency 0 on, (S - S(0))/
        (4 sin^2(omega/2)).  Of a stretch the first and the last one stay in the sum of its samples.
        """
        v = np.exp(p[..., 0])
        if self.name == "quantization":
            return np.asarray(v)
        if self.name in PEAKS:
            return np.asarray(v / (4.0 * np.sin(0.5 * np.exp(p[..., 2])) ** 2))
        if self.rises:  # of the filter
            grid = Grid(math.pi * (np.arange(RISES) + 0.5) / RISES)
            return np.asarray(v * np.mean(np.maximum(self.unit(p[..., 1:], grid) - 1.0, 0.0) / grid.sine, axis=-1))
        return np.zeros_like(v)

    def allan(self, p: Array, m: Array, means: bool = False) -> Array:
        """Return the Allan variance (..., k) of means over m (k,) samples, m whole numbers."""
        v = np.exp(p[..., 0:1])
        if self.name == "white":
            return v * _allan_white(self.filter.removesuffix(ALL), p[..., 1:], m)
        if self.name == "readout":
            return v / m
        if self.name == "quantization":
            return v * 3.0 / m**2
        if self.name == "flicker":
            return v * FLICKER * np.ones_like(m)
        if self.name == "walk":
            return v * m / 3.0 * (1.0 if means else 1.0 + 0.5 / m**2)
        if self.name == "gauss_markov":
            z, amplitude, nugget = markov_parts(np.exp(p[..., 1:2]), means)
            return np.asarray(v * (amplitude * _allan_pole(z, m) - nugget / m))
        if self.name == "band":
            longest = math.ceil(8.0 * math.exp(float(np.max(p[..., 1])))) + 2.0
            lag = np.arange(min(longest, 2.0 * float(np.max(m)) + 1.0))
            gamma = np.exp(-0.5 * (lag * np.exp(-p[..., 1:2])) ** 2) * np.cos(lag * np.exp(p[..., 2:3]))
            return v * _allan_covariance(gamma, m)
        decay, centre = np.exp(-p[..., 1:2]), np.exp(p[..., 2:3])
        once, twice = (np.exp(-k * m * decay) * (np.cos(k * m * centre) + decay / centre * np.sin(k * m * centre))
                       for k in (1.0, 2.0))  # fmt: skip
        return np.asarray(v / (4.0 * np.sin(0.5 * centre) ** 2) * (3.0 - 4.0 * once + twice) / m**2)


def _resonance(p: Array, grid: Grid) -> Array:
    """Spectrum of the angle of a damped oscillator, covariance r^h (cos omega0 h + sin omega0 h/(omega0 tau)), times
    that of a difference, 1 at the centre.

    Its mean over each bin by the antiderivatives 2 arctan((1 + r)/(1 - r) tan(x/2)) of sum r^|h| cos hx and
    log(1 - 2 r cos x + r^2) of 2 sum_(h > 0) r^h sin hx, x = omega +- omega0.
    """
    decay, centre = np.exp(-p[..., 0:1]), np.exp(p[..., 1:2])
    r, h = np.exp(-decay), np.maximum(grid.half_width, 1e-9)
    out: Array = np.zeros(np.broadcast_shapes(centre.shape, grid.omega.shape))
    for sign in (-1.0, 1.0):
        x = np.remainder(grid.omega + sign * centre + np.pi, 2.0 * np.pi) - np.pi
        ends = [np.clip(x + s * h, -3.14159, 3.14159) for s in (1.0, -1.0)]
        even = [2.0 * np.arctan((1.0 + r) / (1.0 - r) * np.tan(0.5 * y)) for y in ends]
        odd = [np.log((1.0 - r) ** 2 + 4.0 * r * np.sin(0.5 * y) ** 2) for y in ends]
        out += 0.5 * (even[0] - even[1] + sign * decay / centre * (odd[0] - odd[1])) / (2.0 * h)
    return grid.sine / (4.0 * np.sin(0.5 * centre) ** 2) * np.maximum(out, 0.0)


def _band(p: Array, grid: Grid) -> Array:
    """Mean over each bin of a normal density about both centres, with what is folded."""
    tau, centre = np.exp(p[..., 0:1]), np.exp(p[..., 1:2])
    h = np.maximum(grid.half_width, 1e-9)
    out: Array = np.zeros(np.broadcast_shapes(centre.shape, grid.omega.shape))
    for shift in (-centre, centre, 2.0 * np.pi - centre, centre - 2.0 * np.pi):
        x = grid.omega + shift
        out += special.ndtr(tau * (x + h)) - special.ndtr(tau * (x - h))
    return 0.5 * 2.0 * np.pi * out / (2.0 * h)


def _allan_pole(z: Any, m: Array) -> Any:
    """Allan variance of covariance z^|h| for means over m samples."""
    log_z = np.log(np.where(np.abs(z) < FASTEST, FASTEST, z))  # white, like 0
    power = np.exp(m * log_z)
    q = -np.expm1(log_z)  # 1 - z
    # variance of a mean, and covariance of neighbouring ones
    variance = ((1.0 + z) / q - 2.0 * z * (1.0 - power) / (m * q * q)) / m
    both = z * (1.0 - power) ** 2 / (m * q) ** 2
    exact = variance - both
    # of a slow process the difference of the two is that of neighbouring levels: |log z| m (2/3)
    x = -m * log_z
    series = 2.0 * x / 3.0 * (1.0 + 0.5 / m**2) - 0.5 * x * x
    return np.where(np.abs(x) < 1e-5, series, exact)


def _allan_white(name: str, p: Array, m: Array) -> Array:
    if name == "none":
        return 1.0 / m * np.ones((*p.shape[:-1], 1))
    if name == "first":
        z = np.exp(-np.exp(-p[..., 0:1]))
        return np.asarray((1.0 - z) / (1.0 + z) * _allan_pole(z, m))
    if name == "second":
        z1, z2, share = second_poles(p)
        level = np.real(share * (1.0 + z1) / (1.0 - z1) + (1.0 - share) * (1.0 + z2) / (1.0 - z2))
        return np.asarray(np.real(share * _allan_pole(z1, m) + (1.0 - share) * _allan_pole(z2, m)) / level)
    if name.startswith(tuple(MEANS)) and "+" not in name:
        gamma = np.append(covariance_of_mean(samples_of(name), MEANS[name.rstrip(string.digits)]), 0.0)
        return _allan_covariance(np.broadcast_to(gamma, (*p.shape[:-1], gamma.size)), m)
    if name == "average":
        k, lower, upper = average_parts(p)
        lag = np.arange(min(float(np.max(k)) + 2.0, 2.0 * float(np.max(m)) + 1.0))  # a longer mean is not asked for
        gamma = lower * np.maximum(1.0 - lag / k, 0.0) + upper * np.maximum(1.0 - lag / (k + 1.0), 0.0)
        gamma = gamma / (lower * k + upper * (k + 1.0))
    else:
        return allan_of_spectrum(filter_of(name)[0](p, covariance_grid()), m)
    return _allan_covariance(gamma, m)


def covariance_grid(means: bool = False) -> Grid:
    """Return the frequencies whose spectrum gives the covariance at LAGS/2 lags."""
    return Grid(np.pi * np.maximum(np.arange(LAGS + 1), NEARLY_ZERO) / LAGS, means)


def allan_of_spectrum(S: Array, m: Array) -> Array:
    """Return the Allan variance (..., k) of noise of short memory, of its spectrum at :func:`covariance_grid`."""
    return _allan_covariance(np.fft.irfft(S, axis=-1)[..., : LAGS // 2], m)


def _allan_covariance(gamma: Array, m: Array) -> Array:
    """Allan variance of a covariance (..., lags) that is 0 beyond them, for means over m (k,) samples."""
    lag = np.arange(float(gamma.shape[-1]))
    first = np.cumsum(gamma, axis=-1)  # of gamma_0 .. gamma_h
    moment = np.cumsum(lag * gamma, axis=-1)

    def total(k: Array) -> Array:
        """Variance of the sum of k samples."""
        last = np.minimum(k.astype(int) - 1, lag.size - 1)
        return k * (2.0 * first[..., last] - gamma[..., 0:1]) - 2.0 * moment[..., last]

    out: Array = (4.0 * total(m) - total(2.0 * m)) / (2.0 * m * m)
    return out
