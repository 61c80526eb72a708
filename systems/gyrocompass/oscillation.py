"""Fit of a decaying oscillation about a settled value to a sampled signal with white noise and with drift.

    y = settled [+ trend] + modes(t; poles) a + n,        Cov n = s2 (I + q G G')

White noise is that of the reading.  Drift is white noise that the oscillation itself filters: G holds its responses to
an impulse of rate (drift in azimuth) or of acceleration (in tilt), whichever is likelier.  q by restricted likelihood,
poles and the linear parameters by generalized least squares, in turn; values and u are then averages of the linearized
fits over q and both kinds of drift, weighted by their likelihood, each with its 95 % of Student's t divided by 1.96.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import linalg, optimize, special

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.loops.estimator_metrics import whiteness

LEAST = 30  # samples
ROUNDS = 3  # of noise and of poles in turn
BENT = 0.05  # uncertainty of the settled value by a trend, of its change over the samples
OFF = -30.0  # ln q that is none
RANGE = np.arange(-3.0, 25.0)  # ln q that are tried, of the mean variance of a sample


@dataclass(frozen=True)
class Oscillation:
    """Estimates with standard uncertainties.

    decay, omega: damping ratio times frequency and undamped frequency, rad/s; third: decay rate of a third mode.
    settled: in the unit of the signal, at the middle of the samples.  left: largest oscillation from the last one on.
    """

    decay: float
    omega: float
    third: float
    settled: float
    left: float
    noise: float  # standard deviation of the white noise of a sample
    wander: float  # standard deviation of the signal about the oscillation by drift
    covariance: Array  # of (decay, omega[, third], settled)
    whiteness: float  # p of Ljung and Box

    @property
    def damping_ratio(self) -> tuple[float, float]:
        ratio = self.decay / self.omega
        return ratio, self._u([1.0 / self.omega, -ratio / self.omega])

    @property
    def period(self) -> tuple[float, float]:
        """Return the period without damping, 2 pi/omega."""
        return 2.0 * math.pi / self.omega, self._u([0.0, -2.0 * math.pi / self.omega**2])

    @property
    def damped_period(self) -> tuple[float, float]:
        """Return the period of the damped oscillation; nan where it only creeps."""
        w2 = self.omega**2 - self.decay**2
        if w2 <= 0.0:
            return math.nan, math.nan
        period = 2.0 * math.pi / math.sqrt(w2)
        return period, self._u([period * self.decay / w2, -period * self.omega / w2])

    @property
    def u_settled(self) -> float:
        return math.sqrt(max(float(self.covariance[-1, -1]), 0.0))

    def _u(self, gradient: list[float]) -> float:
        g = np.array(gradient)
        return math.sqrt(max(float(g @ self.covariance[: g.size, : g.size] @ g), 0.0))


def modes(poles: Array, t: Array) -> Array:
    """Return the responses (n, 2 or 3) of the oscillation to a start at 1 and to a start with rate 1, and the third."""
    w2 = poles[1] ** 2 - poles[0] ** 2
    w = math.sqrt(abs(w2))
    x = np.maximum(w * t, 1e-12)
    c, s = (np.cos(x), np.sin(x)) if w2 >= 0.0 else (np.cosh(np.minimum(x, 300.0)), np.sinh(np.minimum(x, 300.0)))
    s = t * s / x  # sin(w t)/w, also where w vanishes
    fall = np.exp(-poles[0] * t)
    return np.column_stack([fall * (c + poles[0] * s), fall * s, *(np.exp(-p * t) for p in poles[2:])])


def fit(
    t: Array, y: Array, poles: Array, *, trend: bool = False, known: tuple[Array, Array] | None = None
) -> Oscillation | None:
    """Return the oscillation in evenly sampled y (t in s); None for too few samples.

    poles: first guess of (decay, omega[, third]).  trend: the settled value moves linearly.  known: mean and standard
    uncertainty of the poles from elsewhere, where the signal itself may hold no oscillation.
    """
    if y.size < LEAST:
        return None
    n, order, since = y.size, poles.size, t - t[0]
    steady = np.column_stack([np.ones(n), *([(t - t.mean()) / (t[-1] - t[0])] if trend else [])])
    root: Array = np.eye(n)  # lower Cholesky factor of the covariance over s2

    def design(theta: Array) -> Array:
        return np.column_stack([steady, modes(theta * poles, since)])

    def solved(theta: Array) -> tuple[Array, Array, Array]:
        """Return linear parameters, whitened residuals and whitened columns."""
        both = linalg.solve_triangular(root, np.column_stack([design(theta), y]), lower=True)
        beta = np.linalg.lstsq(both[:, :-1], both[:, -1], rcond=None)[0]
        return beta, both[:, -1] - both[:, :-1] @ beta, both[:, :-1]

    def residual(theta: Array) -> Array:
        e = solved(theta)[1]
        return e if known is None else np.append(e, spread * (theta * poles - known[0]) / known[1])

    theta = np.ones(order)
    for turn in range(ROUNDS):
        e = solved(theta)[1]
        spread = math.sqrt(float(e @ e) / (n - order - 3))  # of the white noise
        theta = optimize.least_squares(residual, theta, x_scale="jac").x
        if turn < ROUNDS - 1:
            covered = _noise(y, design(theta), _drifts(theta * poles, since))
            root = np.asarray(linalg.cholesky(covered, lower=True))
    beta, e, _ = solved(theta)
    slopes = []
    for k in range(order):
        d = np.zeros(order)
        d[k] = 1e-5
        slopes.append((design(theta + d) - design(theta - d)) @ beta / 2e-5)
    J, left = np.column_stack([*slopes, design(theta)]), y - design(theta) @ beta
    prior = np.zeros((0, J.shape[1] + 1))
    if known is not None:
        prior = np.zeros((order, J.shape[1] + 1))
        prior[range(order), range(order)] = spread * poles / known[1]
        prior[:, -1] = spread * (known[0] - theta * poles) / known[1]
    step, covariance, s, wander = _averaged(J, left, prior, _drifts(theta * poles, since))
    pick, units = [*range(order), order], np.append(poles, 1.0)
    own = (theta + step[:order]) * poles
    later = since[-1] + np.linspace(0.0, 2.0 * math.pi / abs(float(own[1])), 100)
    transient = np.abs(modes(own, later) @ beta[steady.shape[1] :]).max()
    if trend:  # it is not quite straight
        covariance[order, order] += (BENT * beta[1]) ** 2
    white = whiteness(e - e.mean())[2] if e.size > 40 else 1.0
    return Oscillation(
        float(own[0]), abs(float(own[1])), float(own[2]) if order == 3 else math.nan, float(beta[0] + step[order]),
        float(transient), s, wander, covariance[np.ix_(pick, pick)] * np.outer(units, units), white,
    )  # fmt: skip


def _drifts(poles: Array, since: Array) -> list[Array]:
    """Return the covariances of drift in azimuth and in tilt, from white noise of unit variance of their mean size."""
    start, rate = modes(poles[:2], since).T
    found = []
    for response in (start, rate):
        G = linalg.toeplitz(response, np.zeros(since.size))
        K = G @ G.T
        found.append(K / (np.trace(K) / since.size))
    return found


def _likelihood(both: Array, var: Array) -> float:
    """Return the restricted likelihood (negative logarithm) of columns and, last, the signal."""
    n, p = both.shape[0], both.shape[1] - 1
    logs = np.log(np.maximum(np.abs(np.diag(np.linalg.qr(both / np.sqrt(var)[:, None], mode="r"))), 1e-300))
    return float(0.5 * np.sum(np.log(var)) + np.sum(logs[:-1]) + (n - p) * logs[-1])


def _noise(y: Array, columns: Array, drifts: list[Array]) -> Array:
    """Return the covariance over s2 with the drift, and as much of it, that is likeliest."""
    found: list[tuple[float, float, Array]] = []
    for K in drifts:
        size, axes = np.linalg.eigh(K)
        both = axes.T @ np.column_stack([columns, y])
        found += [(_likelihood(both, 1.0 + math.exp(x) * np.maximum(size, 0.0)), x, K) for x in (OFF, *RANGE)]
    _, x, K = min(found, key=lambda f: f[0])
    return np.asarray(np.eye(y.size) + math.exp(x) * K)


def _averaged(J: Array, left: Array, prior: Array, drifts: list[Array]) -> tuple[Array, Array, float, float]:
    """Return step, covariance, white noise and wander of the linearized fit, averaged over drifts by likelihood."""
    p = J.shape[1]
    values: list[tuple[float, Array, Array, float, float]] = []
    for K in drifts:
        size, axes = np.linalg.eigh(K)
        both = np.vstack([axes.T @ np.column_stack([J, left]), prior])
        for x in (OFF, *RANGE):
            var = np.append(1.0 + math.exp(x) * np.maximum(size, 0.0), np.ones(len(prior)))
            white = both / np.sqrt(var)[:, None]
            u, d, vt = np.linalg.svd(white[:, :-1] / np.linalg.norm(white[:, :-1], axis=0), full_matrices=False)
            inverse = (vt.T / np.maximum(d, 1e-12 * d[0])) / np.linalg.norm(white[:, :-1], axis=0)[:, None]
            step = inverse @ (u.T @ white[:, -1])
            rest, dof = white[:, -1] - white[:, :-1] @ step, left.size + len(prior) - p
            s2 = float(rest @ rest) / dof
            widened = (float(special.stdtrit(dof, 0.975)) / NORMAL) ** 2
            values.append((_likelihood(both, var), step, widened * s2 * inverse @ inverse.T, s2, math.exp(x) * s2))
    least = min(v[0] for v in values)
    weights = np.exp([least - v[0] for v in values])
    weights /= weights.sum()
    mean = np.asarray(sum(w * v[1] for w, v in zip(weights, values, strict=True)))
    covariance = sum(w * (v[2] + np.outer(v[1] - mean, v[1] - mean)) for w, v in zip(weights, values, strict=True))
    white, drift = (float(sum(w * v[k] for w, v in zip(weights, values, strict=True))) for k in (3, 4))
    return mean, np.asarray(covariance), math.sqrt(white), math.sqrt(drift)
