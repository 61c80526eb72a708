"""Errata of smoothing and of coloured measurement noise (Hu 1981, eq. 6-32..6-100).

The oracle is one dense estimate of all unknowns (start and disturbances) from all measurements, or the Kalman filter of
the state augmented by the noise; it shares no equation with the recursions.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.linalg

inv = np.linalg.inv


class Problem:
    """A random linear system of n = 3 states, s = 2 disturbances of mean Wbar, m = 2 measurements, N = 25 steps."""

    n, s, m, N = 3, 2, 2, 25

    def __init__(self) -> None:
        rng, n, s, m, N = np.random.default_rng(42), self.n, self.s, self.m, self.N
        self.Phi = [0.9 * np.eye(n) + 0.2 * rng.normal(size=(n, n)) for _ in range(N)]
        self.G = [rng.normal(size=(n, s)) for _ in range(N)]
        self.H = [rng.normal(size=(m, n)) for _ in range(N + 1)]

        def covariance(k: int) -> Any:
            B = rng.normal(size=(k, k))
            return B @ B.T + 0.3 * np.eye(k)

        self.Q, self.R = [covariance(s) for _ in range(N)], [covariance(m) for _ in range(N + 1)]
        self.W, self.P0, self.x0 = [rng.normal(size=s) for _ in range(N)], covariance(n), rng.normal(size=n)
        x = self.x0 + np.linalg.cholesky(self.P0) @ rng.normal(size=n)
        self.Z: list[Any] = [None]
        for i in range(N):
            x = self.Phi[i] @ x + self.G[i] @ (self.W[i] + np.linalg.cholesky(self.Q[i]) @ rng.normal(size=s))
            self.Z.append(self.H[i + 1] @ x + np.linalg.cholesky(self.R[i + 1]) @ rng.normal(size=m))

    def batch(self, steps: int) -> tuple[list[Any], list[Any], list[Any]]:
        """Smoothed states x_0 .. x_steps, their covariances, and the disturbances, from Z_1 .. Z_steps."""
        n, s = self.n, self.s
        C = scipy.linalg.block_diag(self.P0, *self.Q[:steps])
        mean = np.concatenate([self.x0, *self.W[:steps]])
        T = [np.eye(n, n + s * steps)]
        for i in range(steps):
            T.append(self.Phi[i] @ T[-1])
            T[-1][:, n + s * i : n + s * (i + 1)] += self.G[i]
        H = np.vstack([self.H[i] @ T[i] for i in range(1, steps + 1)])
        K = C @ H.T @ inv(H @ C @ H.T + scipy.linalg.block_diag(*self.R[1 : steps + 1]))
        u, P = mean + K @ (np.concatenate(self.Z[1 : steps + 1]) - H @ mean), C - K @ H @ C
        return [t @ u for t in T], [t @ P @ t.T for t in T], [u[n + s * i : n + s * (i + 1)] for i in range(steps)]

    def filtered(self) -> tuple[list[Any], list[Any], list[Any], list[Any]]:
        """xhat, p after, xbar, M before the measurement: 6-48..6-55 with xbar (ER43), Wbar (ER45), M (ER44)."""
        x, p, xbar, M = [self.x0], [self.P0], [None], [None]
        for i in range(self.N):
            xbar.append(self.Phi[i] @ x[i] + self.G[i] @ self.W[i])
            M.append(self.Phi[i] @ p[i] @ self.Phi[i].T + self.G[i] @ self.Q[i] @ self.G[i].T)
            H, R = self.H[i + 1], self.R[i + 1]
            p.append(M[-1] - M[-1] @ H.T @ inv(H @ M[-1] @ H.T + R) @ H @ M[-1])
            x.append(xbar[-1] + p[-1] @ H.T @ inv(R) @ (self.Z[i + 1] - H @ xbar[-1]))
        return x, p, xbar, M


@pytest.fixture(scope="module")
def problem() -> Problem:
    return Problem()


def test_filter_and_its_error(problem: Problem) -> None:
    """ER44: M inside the inverse of 6-55.  ER41: the error is (xbar - x) + K(z - H xbar)."""
    x, p, xbar, M = problem.filtered()
    states, covariances, _ = problem.batch(problem.N)
    assert x[-1] == pytest.approx(states[-1], abs=1e-8) and p[-1] == pytest.approx(covariances[-1], abs=1e-9)
    H, R = problem.H[1], problem.R[1]
    assert not np.allclose(M[1] - M[1] @ H.T @ inv(H @ H.T + R) @ H @ M[1], p[1])
    truth, noise, K = np.array([0.3, -0.2, 0.9]), np.array([0.1, -0.4]), p[1] @ H.T @ inv(R)
    z = H @ truth + noise
    error = xbar[1] + K @ (z - H @ xbar[1]) - truth
    assert error == pytest.approx((np.eye(3) - K @ H) @ (xbar[1] - truth) + K @ noise)
    assert not np.allclose(error, (truth - xbar[1]) + K @ (z - H @ xbar[1]))


def test_one_step(problem: Problem) -> None:
    """ER46: Q0 Gamma0' in 6-64; ER42: R_1 and xbar_1 in 6-46."""
    x, p, xbar, _ = problem.filtered()
    states, _, disturbances = problem.batch(1)
    H, R = problem.H[1], problem.R[1]
    assert xbar[1] + p[1] @ H.T @ inv(R) @ (problem.Z[1] - H @ xbar[1]) == pytest.approx(states[1])
    residual = H.T @ inv(R) @ (problem.Z[1] - H @ x[1])
    assert x[0] + p[0] @ problem.Phi[0].T @ residual == pytest.approx(states[0])
    assert problem.W[0] + problem.Q[0] @ problem.G[0].T @ residual == pytest.approx(disturbances[0])


def test_fixed_interval(problem: Problem) -> None:
    """ER50: Q, not its inverse, in 6-79.  ER51: lambda_i in 6-80.  ER52: lambda_N = 0 starts 6-81; covariances."""
    x, p, xbar, M = problem.filtered()
    states, covariances, disturbances = problem.batch(problem.N)
    H, R, Phi, G, Q = problem.H, problem.R, problem.Phi, problem.G, problem.Q
    lam, Lam, printed = np.zeros(3), np.zeros((3, 3)), 0.0
    for i in range(problem.N - 1, -1, -1):
        j = i + 1
        A, forward = np.eye(3) - p[j] @ H[j].T @ inv(R[j]) @ H[j], Phi[j] if j < problem.N else np.zeros((3, 3))
        before = lam
        lam = A.T @ (forward.T @ lam - H[j].T @ inv(R[j]) @ (problem.Z[j] - H[j] @ xbar[j]))
        gain = H[j].T @ inv(H[j] @ M[j] @ H[j].T + R[j]) @ H[j]
        Lam = A.T @ forward.T @ Lam @ forward @ A + gain
        assert x[i] - p[i] @ Phi[i].T @ lam == pytest.approx(states[i], abs=1e-8)
        assert p[i] - p[i] @ Phi[i].T @ Lam @ Phi[i] @ p[i] == pytest.approx(covariances[i], abs=1e-8)
        assert problem.W[i] - Q[i] @ G[i].T @ lam == pytest.approx(disturbances[i], abs=1e-8)
        printed = max(printed, np.abs(problem.W[i] - inv(Q[i]) @ G[i].T @ lam - disturbances[i]).max())
        residual = H[j].T @ inv(R[j]) @ (problem.Z[j] - H[j] @ states[j])
        assert residual == pytest.approx(forward.T @ before - lam, abs=1e-7)
    assert printed > 1.0


class Coloured:
    """n = 3, m = 2, measurement noise v' = psi v + nu; the filter of 6-84..6-100 and the augmented one beside it."""

    def __init__(self) -> None:
        rng = np.random.default_rng(43)
        self.Phi, self.G = 0.8 * np.eye(3) + 0.15 * rng.normal(size=(3, 3)), rng.normal(size=(3, 2))
        self.H, self.Q = rng.normal(size=(2, 3)), np.diag([0.5, 0.3])
        self.psi, self.Qs = np.array([[0.7, 0.1], [0.0, 0.5]]), np.array([[0.4, 0.1], [0.1, 0.3]])
        self.Pv = scipy.linalg.solve_discrete_lyapunov(self.psi, self.Qs)
        self.x0, self.P0 = rng.normal(size=3), 2.0 * np.eye(3)
        x, v = self.x0 + np.sqrt(2.0) * rng.normal(size=3), np.linalg.cholesky(self.Pv) @ rng.normal(size=2)
        self.Z = [self.H @ x + v]
        for _ in range(30):
            x = self.Phi @ x + self.G @ np.sqrt(self.Q) @ rng.normal(size=2)
            v = self.psi @ v + np.linalg.cholesky(self.Qs) @ rng.normal(size=2)
            self.Z.append(self.H @ x + v)

    def filtered(self, printed: bool = False) -> tuple[list[Any], list[Any]]:
        """xbar_i and xhat_i; printed: 6-95 with xbar in place of xhat in the bracket."""
        G, H, Q, Phi = self.G, self.H, self.Q, self.Phi
        star = H @ Phi - self.psi @ H
        R = H @ G @ Q @ G.T @ H.T + self.Qs
        D = G @ Q @ G.T @ H.T @ inv(R)  # ER54: Gamma S R^-1
        K = self.P0 @ H.T @ inv(H @ self.P0 @ H.T + self.Pv)
        xbar, M = self.x0 + K @ (self.Z[0] - H @ self.x0), self.P0 - K @ H @ self.P0
        bars, hats = [xbar], []
        for i in range(30):
            zeta = self.Z[i + 1] - self.psi @ self.Z[i]
            p = M - M @ star.T @ inv(star @ M @ star.T + R) @ star @ M  # ER56: H*' on the right
            hats.append(xbar + p @ star.T @ inv(R) @ (zeta - star @ xbar))
            xbar = Phi @ hats[-1] + D @ (zeta - star @ (xbar if printed else hats[-1]))
            M = (Phi - D @ star) @ p @ (Phi - D @ star).T + G @ Q @ G.T - D @ R @ D.T
            bars.append(xbar)
        return bars, hats

    def augmented(self) -> tuple[list[Any], list[Any]]:
        """Filtered and one-step smoothed states of (x, v), the readings without white noise."""
        F, H = scipy.linalg.block_diag(self.Phi, self.psi), np.c_[self.H, np.eye(2)]
        Q, x = scipy.linalg.block_diag(self.G @ self.Q @ self.G.T, self.Qs), np.r_[self.x0, 0.0, 0.0]
        P, filtered, smoothed = scipy.linalg.block_diag(self.P0, self.Pv), [], []
        for i, z in enumerate(self.Z):
            if i:
                earlier, C = x, P @ F.T
                x, P = F @ x, F @ P @ F.T + Q
                ahead, C = x, C @ inv(P)
            K = P @ H.T @ inv(H @ P @ H.T)
            x, P = x + K @ (z - H @ x), P - K @ H @ P
            P = (P + P.T) / 2
            if i:
                smoothed.append(earlier + C @ (x - ahead))
            filtered.append(x)
        return filtered, smoothed


def test_coloured_noise() -> None:
    """ER53: nu is white.  ER55: xhat in the bracket of 6-95.  ER57: xhat is the smoothed one, xbar the filter's output.

    ER58: vhat_i = Z_i - H xhat_i.
    """
    c = Coloured()
    filtered, smoothed = c.augmented()
    bars, hats = c.filtered()
    for i in range(30):
        assert bars[i + 1] == pytest.approx(filtered[i + 1][:3], abs=1e-9)
        assert hats[i] == pytest.approx(smoothed[i][:3], abs=1e-9)
        assert c.Z[i] - c.H @ hats[i] == pytest.approx(smoothed[i][3:], abs=1e-9)
    assert max(np.abs(a - b[:3]).max() for a, b in zip(c.filtered(printed=True)[0], filtered, strict=True)) > 1e-2
    assert max(np.abs(a - b[:3]).max() for a, b in zip(hats, filtered[:-1], strict=True)) > 1e-2
