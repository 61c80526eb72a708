"""What the scale factors of the currents make together: mean, least squares, cubic torquer, linearity, drift.

From a table (one row for each current) by weighted least squares, with the scatter of the K_n about a constant or the
cubic law as their noise, t of as many degrees of freedom as are left; from the windows of a run by generalized least
squares with the covariance of the fit to the windows (precession.py).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import special

from gyrobench import units
from gyrobench.arrays import Array
from gyrobench.reduction.estimation import regression
from gyrobench.reduction.estimation.findings import CONTRADICTED, Findings
from gyrobench.reduction.estimation.quantity import Quantity

from .precession import Precession

DPH, KU, UNIT = units.factor("deg/h"), units.factor("deg/h/mA"), "°/h/mA"
ENOUGH = 5  # rows, to tell a step between angle ranges from noise
Number = tuple[float, float, float]  # value, standard uncertainty of type A, degrees of freedom


@dataclass(frozen=True)
class TorquerEstimates:
    """What is estimated, SI.  numbers: of QUANTITIES, in their order.  worst_at: the current of the largest departure.
    beta: K_1, K_3 of the cubic law; fitted (n,): it at the currents; scatter: about it; test: F of K_3 and its p.  gain
    (5, n): of K, K_LS, K_1, K_3 and the worst departure in the K_n; cofactor (n, n): of the K_n.  reported: all as one
    fit.  step: between the angle ranges of a table; of_step: what it leaves open of each number, as standard
    uncertainty.
    """

    numbers: tuple[Number, ...]
    worst_at: int
    beta: Array
    fitted: Array
    scatter: float
    test: tuple[float, float | None]
    gain: Array
    cofactor: Array
    reported: Findings | None = None
    step: RangeStep | None = None
    of_step: tuple[float, ...] = (0.0,) * 6


@dataclass(frozen=True)
class RangeStep:
    """What the K_n of the shortest range have more than those of the longest, beyond a cubic torquer, SI, and the p of
    its t.
    """

    size: float
    p: float

    @property
    def seen(self) -> bool:
        """True where it is more than noise: what the ranges differ by is then in u."""
        return self.p < CONTRADICTED


QUANTITIES = [
    *(Quantity(n, "", UNIT, KU) for n in ("K", "K_LS", "K_1")),
    *(Quantity(n, "", "%", 0.01) for n in ("K_3/K_1", "linearity")),
    Quantity("drift", "", "°/h", DPH),
]


def of_table(i: Array, K_n: Array, half: Array, theta: Array) -> TorquerEstimates:
    """Return the estimates of a table: i (n,) A; K_n rad/s/A; half: half differences of the senses, rad/s; theta: angle
    ranges, which weigh with their square.
    """
    n, w = i.size, (theta / theta.max()) ** 2
    one, full = np.ones((n, 1)), float(i.max())
    curve = np.column_stack([one, (i / full) ** 2])
    line = regression.least_squares(one, K_n, ("K",), w)
    cubic = regression.least_squares(curve, K_n, ("K_1", "K_3"), w)
    offset = regression.least_squares(one, half, ("drift",), w / (i / full) ** 2)
    mean, beta = float(K_n.mean()), cubic.beta
    s_mean, dof_mean = _scatter_beside_mean(K_n, w, line)
    pooled = math.sqrt((offset.s**2 * (n - 1) + (line.s * full) ** 2 * (n - 1)) / (2 * (n - 1)))
    k = int(np.argmax(np.abs(K_n - mean)))
    F = ((line.s**2 * (n - 1)) - (cubic.s**2 * (n - 2))) / cubic.s**2 if cubic.s > 0.0 else 0.0
    p = float(special.fdtrc(1, n - 2, max(F, 0.0))) if cubic.s > 0.0 else None
    numbers: tuple[Number, ...] = (
        (mean, s_mean * math.sqrt(float(np.sum(1.0 / w))) / n, dof_mean),
        (float(line.beta[0]), float(line.u[0]), n - 1),
        (float(beta[0]), float(cubic.u[0]), n - 2),
        (float(beta[1] / beta[0]), float(cubic.u[1] / abs(beta[0])), n - 2),
        (float((K_n[k] - mean) / mean), line.s / math.sqrt(float(w[k])) / mean, n - 1),
        (float(offset.beta[0]), pooled / math.sqrt(float(np.sum(w / (i / full) ** 2))), 2 * (n - 1)),
    )
    gain = _gain(n, k, line.gain, cubic.gain)
    step = range_step(i, K_n, w)
    e = abs(step.size) if step and step.seen else 0.0
    short = _shortness(
        w
    )  # which of the ranges is right is open: half the step, its bound as 1.96 standard uncertainties
    drift = float(abs(offset.gain[0] @ (short * i)))
    of_step = (e / 2.0, e / 2.0, e / 2.0, e * float(abs(gain[3] @ short)) / abs(beta[0]), e / 2.0 / mean, e * drift)
    return TorquerEstimates(
        numbers, k, beta, cubic.fitted, cubic.s, (F, p), gain, np.diag(1.0 / w), step=step, of_step=of_step
    )


def range_step(i: Array, K_n: Array, w: Array) -> RangeStep | None:
    """Return the step of the K_n between the angle ranges, w (n,) their squares over the largest; None where all are
    alike, or fewer than ENOUGH rows.

    It is the direction in which the plain mean differs from the weighted one: nothing else than this holds a gain that
    changes with the range (of a meter, of the angle marks) against the noise of the rest.
    """
    if np.ptp(w) < 1e-9 or i.size < ENOUGH:
        return None
    columns = np.column_stack([np.ones_like(w), (i / i.max()) ** 2, _shortness(w)])
    try:
        fit = regression.least_squares(columns, K_n, ("K_1", "K_3", "step"), w)
    except regression.RegressionError:
        return None
    size, u = float(fit.beta[2]), float(fit.u[2])
    return RangeStep(size, 2.0 * float(special.stdtr(fit.dof, -abs(size) / u)) if u > 0.0 else 1.0)


def _shortness(w: Array) -> Array:
    """Return 1 for the shortest range and 0 for the longest, between them as the variance of the marks is."""
    return np.asarray((1.0 / w - 1.0 / w.max()) / max(1.0 / w.min() - 1.0 / w.max(), 1e-300))


def of_windows(i: Array, found: Precession) -> TorquerEstimates:
    """Return the estimates of a fit to all windows of a run; i (n,): its currents, A."""
    K, n, full = found.K, i.size, float(i.max())
    one, curve = np.ones((n, 1)), np.column_stack([np.ones(n), (i / full) ** 2])
    line, cubic = found.weights(one, slice(0, n)), found.weights(curve, slice(0, n))
    steady = found.weights(one, slice(n, 2 * n))[0]
    mean, beta = float(K.mean()), cubic @ K
    k = int(np.argmax(np.abs(K - mean)))
    gain = _gain(n, k, line, cubic)

    def of(value: float, row: Array) -> Number:
        return value, *found.u(row)

    def reported(b: Array) -> Array:
        at, constant = b[:n], b[n : 2 * n]
        K_1, K_3 = cubic @ at
        middle = float(np.mean(at))
        return np.array(
            [middle, float(line[0] @ at), K_1, K_3 / K_1, float(at[k]) / middle - 1.0, float(steady @ constant)]
        )

    ratio = float(beta[1] / beta[0])
    u_3, dof_3 = found.u(cubic[1])
    p = 2.0 * float(special.stdtr(min(dof_3, 1e9), -abs(float(beta[1])) / u_3)) if u_3 > 1e-12 * mean else None
    F, scatter = float((beta[1] / u_3) ** 2) if u_3 > 0.0 else 0.0, float(np.sum((K - curve @ beta) ** 2))
    numbers: tuple[Number, ...] = (
        of(mean, gain[0]),
        of(float(line[0] @ K), line[0]),
        of(float(beta[0]), cubic[0]),
        of(ratio, (cubic[1] - ratio * cubic[0]) / beta[0]),
        of(float(K[k]) / mean - 1.0, gain[4] / mean),
        (float(steady @ found.drift), *found.u(of_drift=steady)),
    )
    fit = found.fit.derive(QUANTITIES, reported) if found.fit else None
    cofactor = found.est.covariance[:n, :n]
    return TorquerEstimates(numbers, k, beta, curve @ beta, math.sqrt(scatter / (n - 2)), (F, p), gain, cofactor, fit)


def _gain(n: int, k: int, line: Array, cubic: Array) -> Array:
    worst = np.full(n, -1.0 / n)
    worst[k] += 1.0
    return np.vstack([np.full(n, 1.0 / n), line, cubic[0], cubic[1], worst])


def _scatter_beside_mean(K_n: Array, w: Array, line: regression.Fit) -> tuple[float, int]:
    """Return the standard deviation of unit weight, with its degrees of freedom, from what neither weighted nor plain
    mean takes up, so that the t of the plain mean is a t.
    """
    if np.ptp(w) < 1e-9:
        return line.s, line.dof
    fit = regression.least_squares(np.column_stack([np.ones_like(w), 1.0 / w]), K_n, ("K", "1/w"), w)
    return (fit.s if w.size >= ENOUGH else max(fit.s, line.s)), fit.dof
