"""Means of a unit Gauss-Markov process over windows (equations: noise), and steps of a quadrature."""

from __future__ import annotations

import numpy as np

from gyrobench.arrays import Array


def mean_gain(r: Array) -> Array:
    """a(r): the window mean expected from the process value at the start of the window."""
    return np.asarray(-np.expm1(-r) / r)


def mean_variance(r: Array) -> Array:
    """v(r): variance of a window mean over that of the process, r = T/tau (series below 1e-3)."""
    r = np.asarray(r, dtype=float)
    big = np.maximum(r, 1e-3)
    return np.asarray(np.where(r < 1e-3, 1.0 - r / 3.0 + r * r / 12.0, 2.0 * (big + np.expm1(-big)) / big**2))


def process_covariance(t0: Array, t1: Array, tau: float) -> Array:
    """Covariance (n, n) of window means of a unit Gauss-Markov process with correlation time ``tau`` (s)."""
    length = t1 - t0
    a = mean_gain(length / tau)
    gap = t0[None, :] - t1[:, None]
    upper = np.triu(np.outer(a, a) * np.exp(-np.maximum(gap, 0.0) / tau), 1)
    return np.asarray(upper + upper.T + np.diag(mean_variance(length / tau)))


def middles(low: Array | float, high: Array | float, n: int) -> Array:
    """Return n middles (n,) or (n, k) of equal steps of the logarithm."""
    step = (np.arange(n) + 0.5) / n
    return np.asarray(np.exp(np.log(low) + np.multiply.outer(step, np.log(np.asarray(high) / low))))
