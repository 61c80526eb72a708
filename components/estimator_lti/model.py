from __future__ import annotations

from gyrobench.component import Parameter, sampled
from gyrobench.component.blocks.matrix_model import (
    NO_STATE,
    SMALL,
    UNIT,
    M,
    MatrixModel,
    corner,
    padded,
    propagated,
    propagated_states,
    smallest_pivot,
    whitening,
)
from gyrobench.component.math import dot, vector


class EstimatorLti(MatrixModel):
    """Kalman filter of any linear model with constant matrices: up to six states, up to three readings.  [EST-KF-GEN]

        x+ = A x + w,   cov w = W        z = C x + v,   cov v = V

    At each sampling instant

        x- = A x,   P- = A P A' + W
        y  = z - C x-,   S = C P- C' + V,   K = P- C' S^-1
        x  = x- + K y,   P = (1 - K C) P- (1 - K C)' + K V K'      (Joseph form, made symmetric)

    A reading that is missing (valid, valid_2, valid_3 = 0) leaves its rows out of C and V: the others count as they
    are, and with none of them the first line is all.  nis = y' S^-1 y, on average nis_dof, their number.

    Three axes: three readings of one model (A, W block by block), or three instances with one reading each; the
    same unless the axes or their readings are correlated.

    Not modelled: matrices that change, a known input (take it off the readings), correlation of w and v.
    Source: EST-KF-GEN; Xia 2008, eq. 4.2.1-4.2.18.
    """

    version = "1.0.0"

    V = Parameter([[2.699449e-6, 0, 0], [0, 0, 0], [0, 0, 0]], "1", "covariance of the noise of the readings")

    def start(self) -> None:
        beyond = 0.0
        singular = 0.0
        V = vector(UNIT)
        for i in range(M):
            for j in range(M):
                if i < self.m and j < self.m:
                    V[i][j] = self.V[i][j]
                elif self.V[i][j] != 0.0:
                    beyond = 1.0
            if V[i][i] <= 0.0:
                singular = 1.0
        self.refuse(beyond > 0.5, "V has numbers beyond m = {m} readings: set them to 0")
        self.refuse(
            singular > 0.5 or smallest_pivot(V) < 1e-12,
            "V must be symmetric and positive definite: every reading has noise of its own",
        )

    @sampled(every=1)
    def tick(self) -> None:
        if self.reading > 0.5:
            x = self.A @ self.x
            P = propagated_states(self.A, self.P, self.n) + self.W
            z = vector([self.z, self.z_2, self.z_3])
            there = vector([self.valid, self.valid_2, self.valid_3])
            C = vector(self.C)
            V = vector(self.V)
            y = vector([0.0, 0.0, 0.0])
            self.used = 0.0
            for i in range(M):
                if i < self.m and there[i] > 0.5:
                    self.used = self.used + 1.0
                    y[i] = z[i] - dot(C[i], x)
                else:  # a row of zeros, with a noise that is independent of all others
                    C[i] = vector(NO_STATE)
                    for j in range(M):
                        V[i][j] = 0.0
                        V[j][i] = 0.0
                    V[i][i] = 1.0
            G = whitening(C @ P @ C.T + V)
            self.refuse(
                G[0][0] == 0.0,
                "two readings have the same innovation to rounding (1e-12): P0 is too large against their noise",
            )
            e = G @ y
            K = P @ C.T @ G.T @ G
            rest = vector(UNIT) - K @ C
            if self.n <= SMALL:
                P = padded(propagated(corner(rest), corner(P)) + propagated(corner(K), V))
            else:
                P = propagated(rest, P) + propagated(K, V)
            self.x = x + K @ y
            self.P = (P + P.T) * 0.5
            self.ys = vector(y)
            self.y = y[0]
            self.e = dot(e, e)
            self.show(self.x, self.P)
