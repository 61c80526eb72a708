"""Autoregressive models by Burg's method and by Yule-Walker, with intervals, and the two conventions of sign.

    x_t - m = sum_i phi_i (x_{t-i} - m) + w_t          (phi: statsmodels, and everywhere in the bench)
    x_t - m + sum_i a_i (x_{t-i} - m) = w_t,  a = -phi (MATLAB's arburg and aryule, spectrum.arburg)

A list of a used as phi is another model, often an explosive one: :func:`from_coefficients` wants the convention named.
Burg minimizes the forward and backward errors from p + 1 on; Yule-Walker takes the biased autocovariances, which
shrinks sharp resonances in short records (60 samples, poles at 0.97: six times Burg's error).

Intervals: both estimators are biased by about (order + 3)/n towards slower decay being missed.  The bias is found by
simulation of the fitted model (300 records, fixed seed) and taken off before phi_c -+ 1.96 u, u^2 from
sigma^2 Gamma^-1/n at phi_c.  They cover where the record is longer than some 20 correlation times; the result says if
not.
[DRIFT-AR-YW, DRIFT-AR-BURG, RED-ARMA; Xia 2008, eq. 3.4.11, 3.4.12 with EX13, EX14; Hu 1981, eq. 4-102..4-112]
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy import linalg, signal

from gyrobench.reduction.series.checks import NORMAL, Array, SeriesError, checked, checked_step

Method = Literal["burg", "yule-walker"]
RECORDS, LENGTH = 300, 2000  # of the simulation of the bias
NEGLIGIBLE = 0.01  # bias over u that needs no simulation
ENOUGH_TIMES = 20.0  # correlation times in a record


def spectral_radius(phi: Array) -> float:
    """Return the largest modulus of the G_i in 1 - sum phi_i B^i = prod(1 - G_i B); stationary below 1."""
    return float(np.abs(np.roots(np.concatenate([[1.0], -np.asarray(phi)]))).max(initial=0.0))


def from_coefficients(values: Sequence[float], convention: Literal["phi", "a"]) -> Array:
    """Return phi from listed coefficients of the named ``convention``; refuses a model that is not stationary."""
    if convention not in ("phi", "a"):
        raise SeriesError(f"convention '{convention}': 'phi' (statsmodels) or 'a' (arburg, a = -phi) must be named")
    phi = np.asarray(values, dtype=float) * (1.0 if convention == "phi" else -1.0)
    radius = spectral_radius(phi)
    if radius >= 1.0:
        other = "a" if convention == "phi" else "phi"
        turned = spectral_radius(-phi)
        hint = f"; as '{other}' it is {turned:.3f}: probably the list is in that convention" if turned < 1.0 else ""
        raise SeriesError(
            f"autoregressive coefficients as '{convention}': spectral radius {radius:.3f}, not below 1{hint}"
        )
    return phi


@dataclass(frozen=True)
class Autoregression:
    """One fitted model; arrays over the coefficients 1..p."""

    method: str
    phi: Array  # estimate of the method, as statsmodels returns it
    bias: Array  # estimated
    u: Array  # standard uncertainty of phi - bias
    low: Array  # 95 % interval, about phi - bias
    high: Array
    variance: float  # of w, unit^2
    mean: float
    n: int
    dt: float
    radius: float
    times: float  # record over correlation time -dt/ln(radius)

    @property
    def a(self) -> Array:
        """The same model in arburg's convention."""
        out: Array = -self.phi
        return out

    @property
    def long_enough(self) -> bool:
        """Whether the intervals may be relied on."""
        return self.times >= ENOUGH_TIMES

    def residual(self, x: Any) -> Array:
        """Return w_t of a record, from its value p + 1 on."""
        y = np.asarray(x, dtype=float) - self.mean
        out: Array = signal.lfilter(np.concatenate([[1.0], -self.phi]), [1.0], y)[self.phi.size :]
        return out

    def density(self, frequency: Array) -> Array:
        """Return the one-sided density at frequencies (Hz), unit^2/Hz."""
        k = np.arange(1, self.phi.size + 1)
        turn = np.exp(-2j * np.pi * np.multiply.outer(np.asarray(frequency) * self.dt, k))
        out: Array = 2.0 * self.dt * self.variance / np.abs(1.0 - turn @ self.phi) ** 2
        return out


def fit_ar(x: Any, dt: float, order: int, method: Method = "burg") -> Autoregression:
    """Fit a model of ``order`` to ``x`` (n,), mean removed.

    Raises SeriesError for order < 1, order >= n/3, a constant or non-finite series, and a fit that is not stationary.
    """
    x, dt = checked(x), checked_step(dt)
    n = x.size
    if order < 1 or 3 * order >= n:
        raise SeriesError(f"autoregression of order {order} on {n} values: 1 to {max((n - 1) // 3, 0)} are possible")
    if method not in ("burg", "yule-walker"):
        raise SeriesError(f"method '{method}': 'burg' or 'yule-walker'")
    mean = float(x.mean())
    phi, variance = _estimate(x - mean, order, method)
    radius = spectral_radius(phi)
    if not radius < 1.0:
        raise SeriesError(
            f"autoregression of order {order} by {method}: spectral radius {radius:.6f}; difference first"
        )
    u = _standard(phi, n)
    bias = np.zeros(order)
    if (order + 3.0) / n > NEGLIGIBLE * u.min():
        bias = _bias(phi, n, method)
        shrink = phi - bias
        if spectral_radius(shrink) < 1.0:
            u = _standard(shrink, n)
        else:
            bias = np.zeros(order)
    centre = phi - bias
    largest = spectral_radius(centre)
    times = n * -np.log(largest) if largest > 0.0 else float(n)
    return Autoregression(
        method, phi, bias, u, centre - NORMAL * u, centre + NORMAL * u, variance, mean, n, dt, radius, float(times)
    )


def _estimate(y: Array, order: int, method: Method) -> tuple[Array, float]:
    from statsmodels.regression import linear_model

    if method == "burg":
        phi, variance = linear_model.burg(y, order=order, demean=False)
        return np.asarray(phi), float(variance)
    from gyrobench.reduction.series.correlation import autocovariance

    r = autocovariance(y, order)
    phi = linalg.solve_toeplitz(r[:-1], r[1:])
    return phi, float(r[0] - phi @ r[1:])


def covariance_of(phi: Array, n: int) -> Array:
    """Return sigma^2 Gamma^-1/n, the large-sample covariance of the coefficients fitted to n values.

    Gamma^-1 sigma^2 = A A' - B B' with the triangular Toeplitz matrices of (1, -phi_1, ..) and (phi_p, .., phi_1) signs
    apart: no autocovariance is needed.
    """
    a = np.concatenate([[1.0], -phi])
    lower = linalg.toeplitz(a[:-1], np.zeros(phi.size))
    other = linalg.toeplitz(a[:0:-1], np.zeros(phi.size))
    out: Array = (lower @ lower.T - other @ other.T) / n
    return out


def _standard(phi: Array, n: int) -> Array:
    out: Array = np.sqrt(np.maximum(np.diag(covariance_of(phi, n)), 1e-300))
    return out


def _bias(phi: Array, n: int, method: Method) -> Array:
    """Return the bias at n values: of RECORDS simulated ones, shorter where n is large and scaled (it goes as 1/n)."""
    radius = spectral_radius(phi)
    slow = int(min(40.0 / max(-np.log(max(radius, 1e-9)), 1e-9), 50.0 * LENGTH))
    m = min(n, max(LENGTH, slow))
    rng = np.random.default_rng(0)
    transient = min(slow, 5 * LENGTH)
    a, total = np.concatenate([[1.0], -phi]), np.zeros(phi.size)
    rows = max(1, min(RECORDS, 4_000_000 // (m + transient)))
    done = 0
    while done < RECORDS:
        w = rng.standard_normal((min(rows, RECORDS - done), m + transient))
        y = signal.lfilter([1.0], a, w, axis=1)[:, transient:]
        total -= _linear_part(y, w[:, transient:], phi)
        y -= y.mean(axis=1, keepdims=True)
        total += (_burg_rows(y, phi.size) if method == "burg" else _yule_walker_rows(y, phi.size)).sum(axis=0)
        done += len(w)
    out: Array = (total / RECORDS - phi) * (m / n)
    return out


def _linear_part(y: Array, w: Array, phi: Array) -> Array:
    """Return the sum over rows of Gamma^-1 sum_t y_{t-i} w_t/m: the error of first order, of mean zero.

    Taken off before averaging it leaves the bias with a tenth of the scatter.
    """
    p, m = phi.size, y.shape[1]
    gradient = np.array([np.einsum("ij,ij->", y[:, p - i : m - i], w[:, p:]) for i in range(1, p + 1)])
    out: Array = covariance_of(phi, m) @ gradient
    return out


def _burg_rows(y: Array, order: int) -> Array:
    """Burg's coefficients phi (rows, order) of each row, as statsmodels has them of one."""
    forward, backward = y[:, 1:].copy(), y[:, :-1].copy()
    phi = np.zeros((len(y), 0))
    for _ in range(order):
        k = 2.0 * np.einsum("ij,ij->i", forward, backward)
        k /= np.einsum("ij,ij->i", forward, forward) + np.einsum("ij,ij->i", backward, backward)
        phi = np.column_stack([phi - k[:, None] * phi[:, ::-1], k])
        forward, backward = (forward - k[:, None] * backward)[:, 1:], (backward - k[:, None] * forward)[:, :-1]
    return phi


def _yule_walker_rows(y: Array, order: int) -> Array:
    n = y.shape[1]
    r = np.stack([np.einsum("ij,ij->i", y[:, k:], y[:, : n - k]) for k in range(order + 1)], axis=1)
    return np.array([linalg.solve_toeplitz(row[:-1], row[1:]) for row in r])
