from __future__ import annotations

from gyrobench.component import Discrete, Parameter, sampled
from gyrobench.component.blocks.matrix_model import (
    NO_COVARIANCE,
    NO_GAIN,
    NO_MATRIX,
    NO_READING,
    SMALL,
    UNIT,
    M,
    MatrixModel,
    corner,
    decays,
    padded,
    propagated,
    propagated_states,
    smallest_pivot,
    tall,
    whitening,
)
from gyrobench.component.math import Vector, dot, vector


def crossed(F: Vector, P: Vector, H: Vector, W: Vector, C: Vector) -> Vector:
    """Return F P H' + W C'."""
    return vector(F @ P @ H.T + W @ C.T)


def seen(H: Vector, P: Vector, C: Vector, W: Vector) -> Vector:
    """Return H P H' + C W C'."""
    return vector(propagated(H, P) + propagated(C, W))


def updated(L: Vector, P: Vector, rest: Vector, W: Vector, K: Vector, noise: Vector) -> Vector:
    """Return L P L' + rest W rest' + K noise K'."""
    return vector(propagated(L, P) + propagated(rest, W) + propagated(K, noise))


class EstimatorColoured(MatrixModel):
    """Kalman filter of a linear model whose readings carry coloured noise, without states for it.  [EST-KF-COLOURED]

        x+ = A x + w,   cov w = W        z = C x + v        v+ = psi v + nu,   cov nu = V

    psi decays and v is stationary, of covariance P_v = psi P_v psi' + V.  The first reading is taken with the noise
    P_v, every further one through the difference to the one before, whose noise is white, with k periods from it (k = 1
    unless readings are missing) and F = A^k, psi_k = psi^k, W_k and V_k summed over these periods:

        zeta = z - psi_k z_before = H x_before + C w_k + nu_k,   H = C F - psi_k C
        S    = H P H' + C W_k C' + V_k,   K = (F P H' + W_k C') S^-1,   y = zeta - H x
        x    = F x + K y,   P = (F - K H) P (F - K H)' + (1 - K C) W_k (1 - K C)' + K V_k K'

    which are eq. 6-94 to 6-97 of Hu 1981 (corrected) in one step: the filtered estimate, the same as that of the state
    with v in it.  One missing reading (valid, valid_2 or valid_3 = 0) makes the instant one without reading: x and P
    are those of the last reading, the outputs their prediction.  nis = y' S^-1 y, on average nis_dof.

    With psi C = C A (equal time constants of state and noise) H is 0: readings then correct what enters the state after
    the first of them, and no longer the error of the start.

    Not modelled: matrices that change, a white noise of the readings beside the coloured one (give it a state and take
    estimator_lti).
    Source: EST-KF-COLOURED; Hu 1981, eq. 6-84..6-100.
    """

    version = "1.0.0"

    psi = Parameter([[0.9, 0, 0], [0, 0, 0], [0, 0, 0]], "1", "transition of the noise of the readings")
    V = Parameter([[5.129e-7, 0, 0], [0, 0, 0], [0, 0, 0]], "1", "covariance of what drives it in a period")

    begun = Discrete(0.0, "1", "1 once there was a reading")
    before = Discrete(NO_READING, "1", "the last reading")
    P_v = Discrete(NO_COVARIANCE, "1", "stationary covariance of the noise")
    F = Discrete(UNIT, "1", "transition from the last reading to the next instant")
    W_k = Discrete(NO_MATRIX, "1", "covariance of what drives the state between them")
    psi_k = Discrete(NO_COVARIANCE, "1", "transition of the noise between them")
    V_k = Discrete(NO_COVARIANCE, "1", "covariance of what drives it between them")

    def start(self) -> None:
        beyond = 0.0
        psi = vector(NO_MATRIX)
        V = vector(UNIT)
        R = vector(UNIT)
        driven = self.C @ self.W @ self.C.T + self.V
        for i in range(M):
            for j in range(M):
                psi[i][j] = self.psi[i][j]
                if i < self.m and j < self.m:
                    V[i][j] = self.V[i][j]
                    R[i][j] = driven[i][j]
                elif self.V[i][j] != 0.0 or self.psi[i][j] != 0.0:
                    beyond = 1.0
        self.refuse(beyond > 0.5, "V or psi has numbers beyond m = {m} readings: set them to 0")
        self.refuse(smallest_pivot(V) < -1e-9, "V is not a covariance: symmetric, no negative eigenvalue")
        singular = 1.0 if smallest_pivot(R) < 1e-12 else 0.0
        for i in range(M):
            if R[i][i] <= 0.0:
                singular = 1.0
        self.refuse(
            singular > 0.5,
            "C W C' + V must be positive definite: what is new in each reading must not be known from the others",
        )
        self.refuse(
            decays(psi) < 0.5,
            "psi must have its eigenvalues within the unit circle: the noise of the readings is stationary",
        )
        P_v = vector(self.V)
        power = vector(self.psi)
        for _k in range(32):
            P_v = P_v + power @ P_v @ power.T
            power = power @ power
        self.P_v = vector(P_v)
        self.begun = 0.0
        self.since()

    def since(self) -> None:
        """One period from the last reading to the next instant."""
        self.F = vector(self.A)
        self.W_k = vector(self.W)
        self.psi_k = vector(self.psi)
        self.V_k = vector(self.V)

    @sampled(every=1)
    def tick(self) -> None:
        if self.reading > 0.5:
            there = self.valid > 0.5 and (self.m < 2.0 or self.valid_2 > 0.5) and (self.m < 3.0 or self.valid_3 > 0.5)
            self.used = self.m if there else 0.0
            self.ys = vector(NO_READING)
            self.y = 0.0
            self.e = 0.0
            if there:
                z = vector([self.z, self.z_2, self.z_3])
                H = self.C @ self.F
                P = vector(self.P)
                noise = vector(self.P_v)
                W = vector(NO_MATRIX)
                F = vector(UNIT)
                if self.begun > 0.5:
                    z = z - self.psi_k @ self.before
                    H = H - self.psi_k @ self.C
                    noise = vector(self.V_k)
                    W = vector(self.W_k)
                    F = vector(self.F)
                else:  # the prediction to the first reading, then C x and the whole noise
                    self.x = self.F @ self.x
                    P = self.F @ self.P @ self.F.T + self.W_k
                    H = vector(self.C)
                y = z - H @ self.x
                small = self.n <= SMALL
                S = vector(noise)
                D = vector(NO_GAIN)
                if small:
                    S = seen(corner(H), corner(P), corner(self.C), corner(W)) + S
                    D = tall(crossed(corner(F), corner(P), corner(H), corner(W), corner(self.C)))
                else:
                    S = seen(H, P, self.C, W) + S
                    D = crossed(F, P, H, W, self.C)
                for i in range(M):
                    if i >= self.m:  # a row of zeros, with a noise that is independent of all others
                        y[i] = 0.0
                        S[i][i] = 1.0
                G = whitening(S)
                self.refuse(
                    G[0][0] == 0.0,
                    "two readings have the same innovation to rounding (1e-12): P0 is too large against their noise",
                )
                e = G @ y
                K = D @ G.T @ G
                L = F - K @ H
                rest = vector(UNIT) - K @ self.C
                if small:
                    P = padded(updated(corner(L), corner(P), corner(rest), corner(W), corner(K), noise))
                else:
                    P = updated(L, P, rest, W, K, noise)
                self.x = F @ self.x + K @ y
                self.P = (P + P.T) * 0.5
                self.before = vector([self.z, self.z_2, self.z_3])
                self.begun = 1.0
                self.since()
                self.ys = vector(y)
                self.y = y[0]
                self.e = dot(e, e)
                self.show(self.x, self.P)
            else:
                self.show(self.F @ self.x, propagated_states(self.F, self.P, self.n) + self.W_k)
                self.F = self.A @ self.F  # one period more to the next instant
                self.W_k = propagated_states(self.A, self.W_k, self.n) + self.W
                self.psi_k = self.psi @ self.psi_k
                self.V_k = self.psi @ self.V_k @ self.psi.T + self.V
