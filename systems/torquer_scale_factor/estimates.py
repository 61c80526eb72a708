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
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.estimation.quantity import Quantity

from .precession import Precession

DPH, KU, UNIT = units.factor("deg/h"), units.factor("deg/h/mA"), "°/h/mA"
Number = tuple[float, float, float]  # value, standard uncertainty of type A, degrees of freedom


@dataclass(frozen=True)
class TorquerEstimates:
    """What is estimated, SI.  numbers: of QUANTITIES, in their order.  worst_at: the current of the largest departure.
    beta: K_1, K_3 of the cubic law; fitted (n,): it at the currents; scatter: about it; test: F of K_3 and its p.  gain
    (5, n): of K, K_LS, K_1, K_3 and the worst departure in the K_n; cofactor (n, n): of the K_n.  reported: all as one
    fit.
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
    mean = float(K_n.mean())
    s_mean, dof_mean = _scatter_beside_mean(K_n, w, line)
    pooled = math.sqrt((offset.s**2 * (n - 1) + (line.s * full) ** 2 * (n - 1)) / (2 * (n - 1)))
    k = int(np.argmax(np.abs(K_n - mean)))
    F = ((line.s**2 * (n - 1)) - (cubic.s**2 * (n - 2))) / cubic.s**2 if cubic.s > 0.0 else 0.0
    p = float(special.fdtrc(1, n - 2, max(F, 0.0))) if cubic.s > 0.0 else None
    numbers: tuple[Number, ...] = (
        (mean, s_mean * math.sqrt(float(np.sum(1.0 / w))) / n, dof_mean),
        (float(line.beta[0]), float(line.u[0]), n - 1),
        (float(cubic.beta[0]), float(cubic.u[0]), n - 2),
        (float(cubic.beta[1] / cubic.beta[0]), float(cubic.u[1] / abs(cubic.beta[0])), n - 2),
        (float((K_n[k] - mean) / mean), line.s / math.sqrt(float(w[k])) / mean, n - 1),
        (float(offset.beta[0]), pooled / math.sqrt(float(np.sum(w / (i / full) ** 2))), 2 * (n - 1)),
    )
    gain = _gain(n, k, line.gain, cubic.gain)
    return TorquerEstimates(numbers, k, cubic.beta, cubic.fitted, cubic.s, (F, p), gain, np.diag(1.0 / w))


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
    return fit.s, fit.dof
