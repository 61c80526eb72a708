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
class Cells:
    """Candidate noise models: correlation time, correlated share of the variance of a window, prior weight.

    share = sigma^2 v / (N^2/T + sigma^2 v) for a window of the typical length; reading: what reading errors make of
    its whole variance.
    """

    tau: Array  # s, (G,)
    share: Array  # (G,)
    prior: Array  # (G,), sums to 1
    reading: Array  # (G,)


#: Prior weights of the three families white / Gauss-Markov / both.  Correlation times run from 0.3 windows (1 window
#: for both) to LONGEST times the root of the length of the record, in windows, with a density proportional to
#: tau**slope per unit of log tau.  A short record leans to long times, because its regressors swallow much of the
#: slow noise: the slopes fall by TILT for each doubling of the 82 windows they are given for.  Chosen by Monte Carlo
#: (tests/reduction/coverage.py) so that 95 % intervals of a nine-term tumble cover whatever the noise is.
FAMILIES = (0.5, 0.2, 0.3)
LONGEST = 2.2
SLOPES = (0.2, 0.6)
TILT = (0.2, 0.4)
#: Shares of reading errors where data are differences of readings, with their prior weights.
READING = ((0.0, 0.25), (0.1, 0.15), (0.3, 0.15), (0.6, 0.15), (0.85, 0.15), (0.97, 0.15))


def cells(t0: Array, t1: Array, readings: bool = False) -> Cells:
    """The grid of candidate models for windows [t0, t1] (s); readings: of differences of readings."""
    window, record = float(np.median(t1 - t0)), float(t1[-1] - t0[0])
    longest = max(LONGEST * np.sqrt(record / window), 3.0) * window
    doublings = min(max(float(np.log2(t0.size / 82.0)), 0.0), 2.5)
    slopes = [a - b * doublings for a, b in zip(SLOPES, TILT, strict=True)]
    tau_p = np.geomspace(0.3 * window, longest, 12)
    tau_b = np.repeat(np.geomspace(window, longest, 10), 7)
    v = mean_variance(window / tau_b)
    # odds of the correlated part: from a density at zero frequency 0.3 of the white one up to 60 : 1 in variance
    low, high = np.log(0.3 * v * window / (2.0 * tau_b)), np.log(60.0)
    odds = np.exp(low + np.tile(np.linspace(0.0, 1.0, 7), 10) * (high - low))
    tau = np.concatenate([[window], tau_p, tau_b])
    share = np.concatenate([[0.0], np.ones(12), odds / (1.0 + odds)])
    prior = np.concatenate([[1.0], _weights(tau_p, slopes[0]), _weights(tau_b, slopes[1])])
    prior = prior * np.repeat(FAMILIES, (1, 12, 70))
    if not readings:
        return Cells(tau, share, prior, np.zeros_like(tau))
    size, weight = np.array(READING).T
    return Cells(
        np.tile(tau, size.size), np.tile(share, size.size), np.outer(weight, prior).ravel(), np.repeat(size, tau.size)
    )


def _weights(tau: Array, slope: float) -> Array:
    out: Array = tau**slope / np.sum(tau**slope)
    return out


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
    rest = 1.0 - reading
    size = rest * share / mean_variance(window / tau)
    q = reading * window**2 / 2.0  # variance of one reading error
    r = length / tau
    phi, a, v = np.exp(-r), mean_gain(r), mean_variance(r)
    noise = np.maximum(v - a * a, 0.0) * size + rest * (1.0 - share) * window / length + q / length**2
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
