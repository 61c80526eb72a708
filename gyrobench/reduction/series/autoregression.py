"""Autoregressive models by Burg's method and by Yule-Walker, with intervals, and the two conventions of sign.

    x_t - m = sum_i phi_i (x_{t-i} - m) + w_t          (phi: statsmodels, and everywhere in the bench)
    x_t - m + sum_i a_i (x_{t-i} - m) = w_t,  a = -phi (MATLAB's arburg and aryule, spectrum.arburg)

A list of a used as phi is another model, often an explosive one: :func:`from_coefficients` wants the convention named.
:func:`modes` reads a model as decay times and frequencies.
Burg minimizes the forward and backward errors from p + 1 on; Yule-Walker takes the biased autocovariances, which
shrinks sharp resonances in short records (60 samples, poles at 0.97: six times Burg's error).

Intervals: both estimators are biased by about (order + 3)/n towards faster decay, and their variance exceeds the
large-sample sigma^2 Gamma^-1/n by terms in 1/n^2.  Both are found by simulation of the fitted model (30 to 500 records,
fixed seed).  The interval holds the values whose own 1.96 u reaches the estimate less its bias.  It covers where the
record is longer than some 20 correlation times; the result says if not.
[DRIFT-AR-YW, DRIFT-AR-BURG, RED-ARMA; Xia 2008, eq. 3.4.11, 3.4.12 with EX13, EX14; Hu 1981, eq. 4-102..4-112]
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy import linalg, signal

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.series.checks import SeriesError, checked, checked_step

Method = Literal["burg", "yule-walker"]
RECORDS, FEWEST, LENGTH = 500, 30, 2000  # of the simulation of bias and variance
NEGLIGIBLE = 0.01  # bias over u that needs no simulation
EQUAL = 1e-6  # distance of two roots that count as one
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
class Mode:
    """One root G of the model: psi_j = sum K G^j, decay time ``tau`` s, ``frequency`` Hz (0: without turning)."""

    tau: float
    frequency: float
    weight: complex  # K


def modes(phi: Sequence[float], dt: float) -> tuple[Mode, ...]:
    """Return the modes of an autoregression, slowest first; of a conjugate pair the one of positive frequency.

    K_i = 1/prod_{j != i}(1 - G_j/G_i) holds for distinct roots only.  Raises SeriesError for equal ones, for a zero
    root (last coefficient 0) and for a model that is not stationary.
    """
    dt, G = checked_step(dt), np.roots(np.concatenate([[1.0], -np.asarray(phi, dtype=float)]))
    if np.abs(G).max(initial=0.0) >= 1.0 or np.abs(G).min(initial=1.0) == 0.0 or G.size != len(phi):
        raise SeriesError("modes: the roots must lie inside the circle, none at zero")
    apart = np.abs(G[:, None] - G) + 2.0 * np.eye(G.size)
    if apart.min() < EQUAL:
        raise SeriesError("modes: two roots are equal; the partial fractions hold for distinct roots only")
    ratio = 1.0 - G / G[:, None] + np.eye(G.size)
    out = [
        Mode(float(-dt / np.log(abs(g))), float(np.angle(g) / (2.0 * np.pi * dt)), complex(1.0 / np.prod(row)))
        for g, row in zip(G, ratio, strict=True)
        if g.imag >= 0.0
    ]
    return tuple(sorted(out, key=lambda mode: -mode.tau))


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
    def modes(self) -> tuple[Mode, ...]:
        return modes(tuple(self.phi), self.dt)

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
    bias, extra = np.zeros(order), np.zeros(order)
    if (order + 3.0) / n > NEGLIGIBLE * _standard(phi, n).min():
        found = _higher_order(phi, n, method)
        if spectral_radius(phi - found[0]) < 1.0:
            bias, extra = found
    centre = phi - bias
    largest = spectral_radius(centre)
    times = n * -np.log(largest) if largest > 0.0 else float(n)
    u = _standard(centre, n, extra)
    return Autoregression(
        method, phi, bias, u, *_interval(centre, n, extra), variance, mean, n, dt, radius, float(times)
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


def _standard(phi: Array, n: int, extra: Array | float = 0.0) -> Array:
    out: Array = np.sqrt(np.maximum(np.diag(covariance_of(phi, n)) + extra, 1e-300))
    return out


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


def _higher_order(phi: Array, n: int, method: Method) -> tuple[Array, Array]:
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
        errors.append((_burg_rows(y, p) if method == "burg" else _yule_walker_rows(y, p)) - phi)
        done += len(w)
    error, linear = np.concatenate(errors), np.concatenate(first)
    bias: Array = (error - linear).mean(axis=0) * (m / n)
    extra: Array = np.maximum(error.var(axis=0) - linear.var(axis=0), 0.0) * (m / n) ** 2
    return bias, extra


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
