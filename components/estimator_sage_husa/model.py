from __future__ import annotations

from gyrobench.component import Discrete, Output, Parameter, sampled
from gyrobench.component.blocks.estimator import ZERO, KalmanEstimator, stationary
from gyrobench.component.math import index, maximum

PRIOR = 1.0  # form


class EstimatorSageHusa(KalmanEstimator):
    """Kalman filter that estimates the variance R of its readings (Sage and Husa, simplified).  [EST-SAGE-HUSA]

    Model: p = 0 that of estimator_kalman_rate, state (value, slope) with the density q; p = 1 ... 5 that of
    estimator_kalman_ar, x_t = phi_1 x_{t-1} + ... + w_t with var w = Q.  Corrected recursion, k = 0, 1, 2 ...:

        d  = (1 - b) / (1 - b^(k+1))                    (1 at first, 1 - b in the end)
        x- = F x,   P- = F P F' + G Q G'
        y  = z - H x-,   K = P- H' / (H P- H' + R),   x = x- + K y,   P in Joseph form
        form 1:  R <- (1 - d) R + d (y2 - H P- H')      unbiased, but can be negative: noisy
        form 2:  R <- (1 - d) R + d (e2 + H P H'),   e = z - H x      positive, less noisy, some per cent low
        R <- max(R, R_min R0)

    R_hat is R, clip_count counts how often the last line acted.  b is the forgetting factor: 1/(1 - b) readings are
    remembered.  With valid = 0 it predicts only; neither R nor k moves.

    As printed in Xia 2008, eq. 4.2.19, it fails: d = (1 - b)(1 - b^(k+1)) keeps R0 for some 1/(1 - b) readings;
    H P H' with P after the update in form 1 makes R 9 % (R = 4 Q) to 59 % (R = Q) too large; K (y - H x-) subtracts
    the prediction twice and destroys a real signal.

    Q is not adapted: Q and R are not both estimable from the innovations.  Where R is constant and known, the plain
    filter is never worse.

    Not modelled: adaptation of Q, of a mean, more than one reading at a time.
    Source: EST-SAGE-HUSA; Xia 2008, eq. 4.2.19 (corrected).
    """

    version = "1.0.0"

    p = Parameter(0, int, "model: 0 value and slope, 1 to 5 autoregressive of this order", min=0, max=5)
    q = Parameter(2.0, "1/s3", "p = 0: density of the white noise that drives the slope, (unit of z)2/s3", min=0.0)
    walk = Parameter(0.0, "1/s", "p = 0: density of the white noise that drives the value, (unit of z)2/s", min=0.0)
    phi = Parameter([-0.7466, -0.5044, -0.2538, 0.0, 0.0], "1", "p > 0: coefficients of x_t = sum phi_i x_{t-i} + w_t")
    Q = Parameter(3.3697e-6, "1", "p > 0: variance of w, (unit of z)2", min=0.0)
    R0 = Parameter(2.699449e-6, "1", "variance of a reading at the start, (unit of z)2", above=0.0)
    b = Parameter(0.99, "1", "forgetting factor", above=0.0, below=1.0)
    form = Parameter(2, int, "1 from the innovation, 2 from the residual", min=1, max=2)
    R_min = Parameter(1e-3, "1", "smallest R, as a fraction of R0", above=0.0, max=1.0)
    P0 = Parameter(1.0, "1", "variance of value or states at the start, (unit of z)2", min=0.0)
    P0_slope = Parameter(1.0, "1/s2", "p = 0: variance of the slope at the start, (unit of z)2/s2", min=0.0)

    R_hat = Output("1", "estimated variance of a reading, (unit of z)2")
    clip_count = Output("1", "how often R was held at its smallest value")
    latency = Output("s", "delay of the estimate")

    n = Discrete(2.0, "1", "number of states")
    F = Discrete([ZERO, ZERO, ZERO, ZERO, ZERO], "1", "transition matrix")
    G = Discrete([ZERO, ZERO, ZERO, ZERO, ZERO], "1", "G Q G'")
    x = Discrete(ZERO, "1", "state")
    P = Discrete([ZERO, ZERO, ZERO, ZERO, ZERO], "1", "covariance of the state")
    R = Discrete(0.0, "1", "estimated variance of a reading")
    power = Discrete(1.0, "1", "b^(k+1)")
    clips = Discrete(0.0, "1", "how often R was held")

    def start(self) -> None:
        as_given = stationary(self.phi, self.p, 1.0)
        self.refuse(
            as_given < 0.5 and stationary(self.phi, self.p, -1.0) > 0.5,
            "phi is not stationary, but with its signs turned it is: arburg (MATLAB, spectrum) returns a = -phi, phi "
            "here is that of x_t = sum phi_i x_(t-i) + w_t: give phi = -a",
        )
        self.refuse(
            as_given < 0.5,
            "phi is not stationary: the roots of its polynomial (p = {p}) must lie within the unit circle; for a "
            "random walk take p = 0 with walk",
        )
        self.n = self.p if self.p > 0.0 else 2.0
        for i in range(5):
            self.x[i] = 0.0
            for j in range(5):
                self.F[i][j] = 0.0
                self.G[i][j] = 0.0
                self.P[i][j] = 0.0
        if self.p > 0.0:
            for i in range(index(self.p)):
                self.F[0][i] = self.phi[i]
                self.P[i][i] = self.P0
            for i in range(4):
                if i + 1.0 < self.p:
                    self.F[i + 1][i] = 1.0
            self.G[0][0] = self.Q
        else:
            T = self.Ts
            self.F[0][0] = 1.0
            self.F[0][1] = T
            self.F[1][1] = 1.0
            self.G[0][0] = self.q * T * T * T / 3.0 + self.walk * T
            self.G[0][1] = 0.5 * self.q * T * T
            self.G[1][0] = self.G[0][1]
            self.G[1][1] = self.q * T
            self.P[0][0] = self.P0
            self.P[1][1] = self.P0_slope
        self.R = self.R0
        self.power = 1.0
        self.clips = 0.0

    @sampled(every=1)
    def tick(self) -> None:
        if self.reading > 0.5:
            x = [0.0, 0.0, 0.0, 0.0, 0.0]
            M = [
                [0.0, 0.0, 0.0, 0.0, 0.0],
                [0.0, 0.0, 0.0, 0.0, 0.0],
                [0.0, 0.0, 0.0, 0.0, 0.0],
                [0.0, 0.0, 0.0, 0.0, 0.0],
                [0.0, 0.0, 0.0, 0.0, 0.0],
            ]
            for i in range(index(self.n)):  # x- = F x, M = F P
                for k in range(index(self.n)):
                    x[i] = x[i] + self.F[i][k] * self.x[k]
                    for j in range(index(self.n)):
                        M[i][j] = M[i][j] + self.F[i][k] * self.P[k][j]
            for i in range(index(self.n)):  # P- = M F' + G Q G'
                self.x[i] = x[i]
                for j in range(index(self.n)):
                    self.P[i][j] = self.G[i][j]
                    for k in range(index(self.n)):
                        self.P[i][j] = self.P[i][j] + M[i][k] * self.F[j][k]
            self.y = 0.0
            self.e = 0.0
            if self.valid > 0.5:
                before = self.P[0][0]  # H P- H'
                self.y = self.z - self.x[0]
                variance = before + self.R
                self.e = self.y * self.y / variance
                g = [0.0, 0.0, 0.0, 0.0, 0.0]  # K
                for i in range(index(self.n)):
                    g[i] = self.P[i][0] / variance
                    self.x[i] = self.x[i] + g[i] * self.y
                for i in range(index(self.n)):  # M = (I - K H) P-
                    for j in range(index(self.n)):
                        M[i][j] = self.P[i][j] - g[i] * self.P[0][j]
                for i in range(index(self.n)):  # P = M (I - K H)' + K R K'
                    for j in range(index(self.n)):
                        self.P[i][j] = M[i][j] - M[i][0] * g[j] + g[i] * self.R * g[j]
                for i in range(index(self.n)):
                    for j in range(i):
                        self.P[i][j] = 0.5 * (self.P[i][j] + self.P[j][i])
                        self.P[j][i] = self.P[i][j]
                self.power = self.power * self.b
                d = (1.0 - self.b) / (1.0 - self.power)
                residual = self.z - self.x[0]
                R_sample = residual * residual + self.P[0][0]
                if self.form == PRIOR:
                    R_sample = self.y * self.y - before
                self.R = (1.0 - d) * self.R + d * R_sample
                held = maximum(self.R, self.R_min * self.R0)
                if held > self.R:
                    self.clips = self.clips + 1.0
                self.R = held

    def outputs(self) -> None:
        self.estimate = self.x[0]
        self.variance = self.P[0][0]
        self.R_hat = self.R
        self.clip_count = self.clips
        self.latency = 0.0
