"""Noise of averaged data: white rate noise plus a Gauss-Markov process, seen through averaging windows.

Data are means over windows [t0_i, t1_i] with gaps between them.  The noise is

    e_i = (1/T_i) integral of ( w(t) + x(t) ) dt,   dx = -x/tau dt + sigma sqrt(2/tau) dW,   w white of density N,

x stationary and running on through the gaps.  With r = T/tau, a = (1 - exp(-r))/r, v = 2 (r - 1 + exp(-r))/r^2:

    var e_i = N^2/T_i + sigma^2 v_i,    cov(e_i, e_j) = sigma^2 a_i a_j exp(-gap/tau)   (gap: end of i to start of j)

exactly, whatever the window lengths.  A constant (turn-on bias) is no noise here: it belongs to the constant term.

Data that are differences of readings, (angle_i - angle_{i-1}) / T_i, also carry the errors n of the readings, white and
shared by neighbours: var += 2 s^2 / T^2, cov of neighbours -= s^2 / (T_i T_{i+1})  [RED-RATE: lag-1 correlation -1/2].
Not modelled: flicker noise, random walk, quanta that are no white error.  [RED-GLS; own derivation, proved by tests]
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def mean_gain(r: Array) -> Array:
    """a(r): the window mean expected from the process value at the start of the window."""
    out: Array = -np.expm1(-r) / r
    return out


def mean_variance(r: Array) -> Array:
    """v(r): variance of a window mean over that of the process, r = T/tau (series below 1e-3)."""
    r = np.asarray(r, dtype=float)
    big = np.maximum(r, 1e-3)
    out: Array = np.where(r < 1e-3, 1.0 - r / 3.0 + r * r / 12.0, 2.0 * (big + np.expm1(-big)) / big**2)
    return out


def process_covariance(t0: Array, t1: Array, tau: float) -> Array:
    """Covariance (n, n) of window means of a unit Gauss-Markov process with correlation time ``tau`` (s)."""
    length = t1 - t0
    a = mean_gain(length / tau)
    gap = t0[None, :] - t1[:, None]
    upper = np.triu(np.outer(a, a) * np.exp(-np.maximum(gap, 0.0) / tau), 1)
    out: Array = upper + upper.T + np.diag(mean_variance(length / tau))
    return out


@dataclass(frozen=True)
class NoiseGrid:
    """Candidate noise models: correlation time, correlated share of the variance of a window, prior weight.

    share = sigma^2 v / (N^2/T + sigma^2 v) for a window of the typical length; reading: what reading errors make of
    its whole variance.
    """

    tau: Array  # s, (G,)
    share: Array  # (G,)
    prior: Array  # (G,), sums to 1
    reading: Array  # (G,)


#: The population of instrument noise that intervals are made for; candidates are a quadrature over it,
#: sample_instrument() samples it.  One in four instruments has white noise alone, one in four Gauss-Markov drift
#: alone, two have both.
FAMILIES = (0.25, 0.25, 0.5)
#: Correlation time, log-uniform: from SHORTEST windows to LONGEST of the record (of slower drift a record holds no
#: more than a constant and a trend).
SHORTEST, LONGEST = 0.3, 0.5
#: Of both: variance of the Gauss-Markov part of a window over that of the white part, log-uniform: from a density at
#: zero frequency FAINTEST times the white one (less changes no mean) to STRONGEST (more is as without white noise).
FAINTEST, STRONGEST = 0.3, 100.0
#: Where data are differences of readings: how often reading errors are negligible, else their variance over that of
#: the rest of a window, log-uniform.
NO_READING, READING = 0.25, (0.05, 100.0)
TAUS, ODDS, READINGS = 9, 6, 4  # cells of the quadrature; more change no coverage


def _taus(t0: Array, t1: Array) -> tuple[float, float, float]:
    """Typical window, shortest and longest correlation time, s."""
    window, record = float(np.median(t1 - t0)), float(t1[-1] - t0[0])
    return window, SHORTEST * window, max(LONGEST * record, 3.0 * window)


def _least_odds(window: float, tau: Array) -> Array:
    out: Array = FAINTEST * mean_variance(window / tau) * window / (2.0 * tau)
    return out


def _middles(low: Array | float, high: float, n: int) -> Array:
    """n middles (n,) or (n, k) of equal steps of the logarithm."""
    step = (np.arange(n) + 0.5) / n
    out: Array = np.exp(np.log(low) + np.multiply.outer(step, np.log(high / np.asarray(low))))
    return out


def noise_grid(t0: Array, t1: Array, readings: bool = False) -> NoiseGrid:
    """Return the grid of candidate models for windows [t0, t1] (s); readings: of differences of readings."""
    window, shortest, longest = _taus(t0, t1)
    tau = _middles(shortest, longest, TAUS)
    odds = _middles(_least_odds(window, tau), STRONGEST, ODDS).ravel()
    every = np.concatenate([[window], tau, np.tile(tau, ODDS)])
    share = np.concatenate([[0.0], np.ones(TAUS), odds / (1.0 + odds)])
    prior = np.repeat(np.array(FAMILIES) / (1, TAUS, TAUS * ODDS), (1, TAUS, TAUS * ODDS))
    if not readings:
        return NoiseGrid(every, share, prior, np.zeros_like(every))
    part = _middles(*READING, READINGS)
    size = np.concatenate([[0.0], part / (1.0 + part)])
    weight = np.concatenate([[NO_READING], np.full(READINGS, (1.0 - NO_READING) / READINGS)])
    n = size.size
    return NoiseGrid(np.tile(every, n), np.tile(share, n), np.outer(weight, prior).ravel(), np.repeat(size, every.size))


def sample_instrument(
    rng: np.random.Generator, t0: Array, t1: Array, readings: bool = False
) -> tuple[float, float, float]:
    """tau (s), share and reading of one instrument of the population, as :class:`NoiseGrid` has them."""

    def log_uniform(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    window, shortest, longest = _taus(t0, t1)
    family = rng.choice(3, p=FAMILIES)
    tau, share, reading = log_uniform(shortest, longest), float(family > 0), 0.0
    if family == 2:
        odds = log_uniform(float(_least_odds(window, np.array(tau))), STRONGEST)
        share = odds / (1.0 + odds)
    if readings and rng.random() >= NO_READING:
        part = log_uniform(*READING)
        reading = part / (1.0 + part)
    return tau, share, reading


def whiten(
    t0: Array, t1: Array, columns: Array, tau: Array, share: Array, reading: Array | None = None
) -> tuple[Array, Array]:
    """``columns`` (n, c) made white for each of G models: (n, G, c), and log determinant of the covariance (G,).

    The covariance is scaled so that a window of the median length has variance 1.  Innovations of the process, O(n).
    """
    if reading is not None and np.any(reading > 0.0):
        return _whiten_readings(t0, t1, columns, tau, share, reading)
    n, c = columns.shape
    length = (t1 - t0)[:, None]
    window = float(np.median(length))
    size = share / mean_variance(window / tau)
    r = length / tau
    phi, a, v = np.exp(-r), mean_gain(r), mean_variance(r)
    noise = np.maximum(v - a * a, 0.0) * size + (1.0 - share) * window / length  # of the mean, start given
    cross, drive = a * (1.0 - phi) * size, (1.0 - phi * phi) * size
    pause = np.exp(-np.maximum(t0[1:] - t1[:-1], 0.0)[:, None] / tau)
    p = np.array(size)  # variance of the process at the start of the window, given what came before
    m = np.zeros((tau.size, c))  # its mean, per column
    out, variance = np.empty((n, tau.size, c)), np.empty((n, tau.size))
    for i in range(n):
        ai, fi = a[i], phi[i]
        s = ai * ai * p + noise[i]
        e = columns[i] - ai[:, None] * m
        variance[i] = s
        out[i] = e
        k = (fi * ai * p + cross[i]) / s
        m = fi[:, None] * m + k[:, None] * e
        p = fi * fi * p + drive[i] - k * k * s
        if i < n - 1:
            g = pause[i]
            m *= g[:, None]
            p = g * g * p + (1.0 - g * g) * size
    out /= np.sqrt(variance)[:, :, None]
    return out, np.log(variance).sum(axis=0)


def _whiten_readings(
    t0: Array, t1: Array, columns: Array, tau: Array, share: Array, reading: Array
) -> tuple[Array, Array]:
    """:func:`whiten` with reading errors: the state is the process x and the error n of the window's first reading."""
    n, c = columns.shape
    length = (t1 - t0)[:, None]
    window = float(np.median(length))
    without_reading = 1.0 - reading
    size = without_reading * share / mean_variance(window / tau)
    q = reading * window**2 / 2.0  # variance of one reading error
    r = length / tau
    phi, a, v = np.exp(-r), mean_gain(r), mean_variance(r)
    noise = np.maximum(v - a * a, 0.0) * size + without_reading * (1.0 - share) * window / length + q / length**2
    cross, drive = a * (1.0 - phi) * size, (1.0 - phi * phi) * size
    gap = np.append(t0[1:] - t1[:-1], 0.0)
    pause = np.exp(-np.maximum(gap, 0.0)[:, None] / tau)
    px, pn, both = np.array(size), np.array(q), np.zeros_like(q)
    x, first = np.zeros((tau.size, c)), np.zeros((tau.size, c))
    out, variance = np.empty((n, tau.size, c)), np.empty((n, tau.size))
    for i in range(n):
        ai, fi, ti = a[i], phi[i], float(length[i, 0])
        s = ai * ai * px - 2.0 * ai * both / ti + pn / ti**2 + noise[i]
        e = columns[i] - ai[:, None] * x + first / ti
        variance[i], out[i] = s, e
        kx, kn = (fi * (ai * px - both / ti) + cross[i]) / s, q / ti / s
        x = fi[:, None] * x + kx[:, None] * e
        first = kn[:, None] * e
        px, pn, both = fi * fi * px + drive[i] - kx * kx * s, q - kn * kn * s, -kx * kn * s
        g = pause[i]
        x, px, both = g[:, None] * x, g * g * px + (1.0 - g * g) * size, g * both
        if gap[i] > 1e-6 * window:  # a reading of its own
            first, pn, both = np.zeros_like(first), np.array(q), np.zeros_like(both)
    out /= np.sqrt(variance)[:, :, None]
    return out, np.log(variance).sum(axis=0)
