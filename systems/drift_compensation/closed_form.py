"""Expected errors of a compensated gyro: the covariance of table and filter together, propagated from reading to
reading.  [COMP-RANDOM-DRIFT; Hu 1981, eq. 6-24..6-31]"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from gyrobench.arrays import Array


@dataclass(frozen=True)
class CompensatedDrift:
    """Drift (rms rad/s, tau s, white rad/s/sqrt(Hz)), lag of the table (s), standard deviation of a reading (rad).

    gain: of the torquer, 1 where its scale factor is the one that the filter believes.
    """

    rms: float
    tau: float
    lag: float
    sigma: float
    white: float = 0.0
    gain: float = 1.0

    def sampled(self, h: float) -> tuple[Array, Array, Array]:
        """Return Phi, Q and B of drift, alpha, theta over a step h: Van Loan's exponential, u held."""
        F = np.array([[-1.0 / self.tau, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0 / self.lag, -1.0 / self.lag]])
        L = np.diag([2.0 * self.rms**2 / self.tau, self.white**2, 0.0])
        n = max(1, int(np.ceil(h / self.lag)))  # exp(-F h) of a fast lag would overflow: steps of one lag at most
        block = np.block([[-F, L], [np.zeros((3, 3)), F.T]])
        exponential = expm(block * (h / n))
        part = exponential[3:, 3:].T
        part_Q = part @ exponential[:3, 3:]
        column = np.array([[0.0], [-self.gain], [0.0]])
        part_B = expm(np.block([[F, column], [np.zeros((1, 4))]]) * (h / n))[:3, 3]
        Phi, Q, B = np.eye(3), np.zeros((3, 3)), np.zeros(3)
        for _ in range(n):
            Q, B, Phi = part @ Q @ part.T + part_Q, part @ B + part_B, part @ Phi
        return Phi, 0.5 * (Q + Q.T), B


@dataclass(frozen=True)
class ExpectedErrors:
    """Standard deviations after each reading (n,): drift less its estimate, drift less u, table angle, table angle
    without compensation; ``stated``: of the estimated drift, as the filter has it."""

    error: Array
    rate: Array
    angle: Array
    free: Array
    stated: Array


def expected(true: CompensatedDrift, believed: CompensatedDrift, h: float, n: int, T_c: float) -> ExpectedErrors:
    """Return what n readings, h s apart, lead to; T_c = 0: the rate alone is compensated.  u is not limited."""
    Phi, Q, B = true.sampled(h)
    Phi_b, Q_b, B_b = believed.sampled(h)
    law = np.array([1.0, 1.0 / T_c if T_c > 0.0 else 0.0, 0.0])
    H = np.array([0.0, 0.0, 1.0])
    joint = np.zeros((6, 6))  # of (x, estimate)
    joint[0, 0] = true.rms**2
    P = np.zeros((3, 3))
    P[0, 0] = believed.rms**2
    free = joint[:3, :3].copy()
    rows = []
    move = np.block([[Phi, np.outer(B, law)], [np.zeros((3, 3)), Phi_b + np.outer(B_b, law)]])
    for _ in range(n):
        P = Phi_b @ P @ Phi_b.T + Q_b
        K = P @ H / (H @ P @ H + believed.sigma**2)
        A = np.eye(3) - np.outer(K, H)
        P = A @ P @ A.T + believed.sigma**2 * np.outer(K, K)
        joint = move @ joint @ move.T
        joint[:3, :3] += Q
        update = np.block([[np.eye(3), np.zeros((3, 3))], [np.outer(K, H), A]])
        joint = update @ joint @ update.T
        joint[3:, 3:] += true.sigma**2 * np.outer(K, K)
        free = Phi @ free @ Phi.T + Q
        error, rate = np.zeros(6), np.zeros(6)
        error[0], error[3] = 1.0, -1.0
        rate[0], rate[3:] = 1.0, -law
        rows.append([error @ joint @ error, rate @ joint @ rate, joint[2, 2], free[2, 2], P[0, 0]])
    return ExpectedErrors(*np.sqrt(np.maximum(np.array(rows), 0.0)).T)
