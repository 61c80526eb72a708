"""Autoregressive models by Burg's method, with intervals, and by Yule-Walker.

    x_t - m = sum_i phi_i (x_{t-i} - m) + w_t          (phi: statsmodels, and everywhere in the bench)
    x_t - m + sum_i a_i (x_{t-i} - m) = w_t,  a = -phi (MATLAB's arburg and aryule, spectrum.arburg)

A list of a used as phi is another model, often an explosive one.  Burg minimizes the forward and backward errors from
p + 1 on; Yule-Walker takes the biased autocovariances, which shrinks sharp resonances in short records (60 samples,
poles at 0.97: six times Burg's error).  Both are those of statsmodels, which gives no intervals of them.

Intervals: Burg's estimator is biased by about (order + 3)/n towards faster decay, and its variance exceeds the
large-sample sigma^2 Gamma^-1/n by terms in 1/n^2.  Both are found by simulation of the fitted model (30 to 500 records,
fixed seed).  The interval holds the values whose own 1.96 u reaches the estimate less its bias.  It covers where the
record is longer than some 20 correlation times; the result says if not.
[DRIFT-AR-YW, DRIFT-AR-BURG, RED-ARMA; Xia 2008, eq. 3.4.11, 3.4.12 with EX13, EX14; Hu 1981, eq. 4-102..4-112]
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import linalg, signal

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.series.checks import SeriesError, checked, checked_order

RECORDS, FEWEST, LENGTH = 500, 30, 2000  # of the simulation of bias and variance
NEGLIGIBLE = 0.01  # bias over u that needs no simulation
ENOUGH_TIMES = 20.0  # correlation times in a record


def spectral_radius(phi: Array) -> float:
    """Return the largest modulus of the G_i in 1 - sum phi_i B^i = prod(1 - G_i B); stationary below 1."""
    return float(np.abs(np.roots(np.concatenate([[1.0], -np.asarray(phi)]))).max(initial=0.0))


@dataclass(frozen=True)
class Autoregression:
    """One fitted model; arrays over the coefficients 1..p."""

    phi: Array  # Burg's estimate, as statsmodels returns it
    bias: Array  # estimated
    u: Array  # standard uncertainty of phi - bias
    low: Array  # 95 % interval, about phi - bias
    high: Array
    variance: float  # of w, unit^2
    mean: float
    times: float  # length of the record over the correlation time, samples over -1/ln(radius)

    @property
    def long_enough(self) -> bool:
        """Return whether the intervals may be relied on."""
        return self.times >= ENOUGH_TIMES

    def residual(self, x: Any) -> Array:
        """Return w_t of a record, from its value p + 1 on."""
        y = np.asarray(x, dtype=float) - self.mean
        return np.asarray(signal.lfilter(np.concatenate([[1.0], -self.phi]), [1.0], y)[self.phi.size :])


def fit_ar(x: Any, order: int) -> Autoregression:
    """Fit a model of ``order`` to ``x`` (n,), mean removed, by Burg's method.

    Raises SeriesError for order < 1, order >= n/3, a constant or non-finite series, and a fit that is not stationary.
    """
    from statsmodels.regression.linear_model import burg

    x = checked(x)
    n, mean = x.size, float(x.mean())
    checked_order(order, n)
    phi, variance = burg(x - mean, order=order, demean=False)
    _check_stationary(phi, "burg")
    bias, extra = np.zeros(order), np.zeros(order)
    if (order + 3.0) / n > NEGLIGIBLE * _standard(phi, n).min():
        simulated = _higher_order(phi, n)
        if spectral_radius(phi - simulated[0]) < 1.0:
            bias, extra = simulated
    centre = phi - bias
    radius = spectral_radius(centre)
    times = n * -float(np.log(radius)) if radius > 0.0 else float(n)
    low, high = _interval(centre, n, extra)
    return Autoregression(phi, bias, _standard(centre, n, extra), low, high, float(variance), mean, times)


def yule_walker(x: Any, order: int) -> Array:
    """Return phi (order,) of ``x`` (n,), mean removed, by Yule-Walker; raises SeriesError as :func:`fit_ar`."""
    from statsmodels.regression import linear_model

    x = checked(x)
    checked_order(order, x.size)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # announcements of what the library will return
        phi, _ = linear_model.yule_walker(x - x.mean(), order, "mle", demean=False)
    _check_stationary(phi, "yule-walker")
    return np.asarray(phi)


def _check_stationary(phi: Array, method: str) -> None:
    radius = spectral_radius(phi)
    if not radius < 1.0:
        raise SeriesError(
            f"autoregression of order {phi.size} by {method}: spectral radius {radius:.6f}; difference first"
        )


def covariance_of(phi: Array, n: int) -> Array:
    """Return sigma^2 Gamma^-1/n, the large-sample covariance of the coefficients fitted to n values.

    Gamma^-1 sigma^2 = A A' - B B' with the triangular Toeplitz matrices of (1, -phi_1, ..) and (phi_p, .., phi_1) signs
    apart: no autocovariance is needed.
    """
    a = np.concatenate([[1.0], -phi])
    lower = linalg.toeplitz(a[:-1], np.zeros(phi.size))
    other = linalg.toeplitz(a[:0:-1], np.zeros(phi.size))
    return np.asarray((lower @ lower.T - other @ other.T) / n)


def _standard(phi: Array, n: int, extra: Array | float = 0.0) -> Array:
    return np.asarray(np.sqrt(np.maximum(np.diag(covariance_of(phi, n)) + extra, 1e-300)))


def _interval(phi: Array, n: int, extra: Array) -> tuple[Array, Array]:
    """Return the values of each coefficient that 1.96 of the u that they themselves imply would reach ``phi`` from.

    The other coefficients move with it as their covariance has it.  u at the estimate would be too small where the
    estimate is too near the circle, and too large at the other end.
    """
    covariance = covariance_of(phi, n)
    ends = np.zeros((2, phi.size))
    for k in range(phi.size):
        along = covariance[k] / covariance[k, k]
        for row, side in enumerate((-1.0, 1.0)):
            half = NORMAL * float(np.sqrt(covariance[k, k]))
            for _ in range(20):
                there = phi + side * half * along
                if spectral_radius(there) >= 1.0:
                    half *= 0.7
                    continue
                before, half = half, 0.5 * (half + NORMAL * float(_standard(there, n, extra)[k]))
                if abs(half - before) < 1e-3 * half:
                    break
            ends[row, k] = phi[k] + side * half
    return ends[0], ends[1]


def _higher_order(phi: Array, n: int) -> tuple[Array, Array]:
    """Return what n values add to the large-sample law: the bias (as 1/n) and a part of the variance (as 1/n^2).

    From simulated records, shorter where n is large and scaled, and fewer there: both matter less against u.  The error
    of first order, Gamma^-1 sum_t y_{t-i} w_t/m, has a known law: it is taken off each record, which leaves bias
    and variance with a tenth of the scatter.
    """
    radius, p = spectral_radius(phi), phi.size
    slow = int(min(40.0 / max(-np.log(max(radius, 1e-9)), 1e-9), 50.0 * LENGTH))
    m = min(n, max(LENGTH, slow))
    rng = np.random.default_rng(0)
    records = max(FEWEST, min(RECORDS, RECORDS * 1000 // n))
    rows = max(1, min(records, 2_000_000 // m))
    a, C, done = np.concatenate([[1.0], -phi]), covariance_of(phi, m), 0
    start = np.linalg.cholesky(np.linalg.inv(covariance_of(phi, 1)))  # p values of the stationary process
    errors, first = [], []
    while done < records:
        past = rng.standard_normal((min(rows, records - done), p)) @ start.T
        memory = np.stack([past[:, k:] @ phi[k:][::-1] for k in range(p)], axis=1)
        w = rng.standard_normal((len(past), m))
        y = np.concatenate([past, signal.lfilter([1.0], a, w, axis=1, zi=memory)[0]], axis=1)
        before = [y[:, p - i : -i] for i in range(1, p + 1)]
        first.append(np.stack([np.einsum("ij,ij->i", b, w) for b in before], axis=1) @ C)
        y = y[:, p:] - y[:, p:].mean(axis=1, keepdims=True)
        errors.append(_burg_rows(y, p) - phi)
        done += len(w)
    error, linear = np.concatenate(errors), np.concatenate(first)
    bias: Array = (error - linear).mean(axis=0) * (m / n)
    extra: Array = np.maximum(error.var(axis=0) - linear.var(axis=0), 0.0) * (m / n) ** 2
    return bias, extra


def _burg_rows(y: Array, order: int) -> Array:
    """Return Burg's coefficients phi (rows, order) of each row; statsmodels' burg takes one series."""
    forward, backward = y[:, 1:].copy(), y[:, :-1].copy()
    phi = np.zeros((len(y), 0))
    for _ in range(order):
        k = 2.0 * np.einsum("ij,ij->i", forward, backward)
        k /= np.einsum("ij,ij->i", forward, forward) + np.einsum("ij,ij->i", backward, backward)
        phi = np.column_stack([phi - k[:, None] * phi[:, ::-1], k])
        forward, backward = (forward - k[:, None] * backward)[:, 1:], (backward - k[:, None] * forward)[:, :-1]
    return phi
