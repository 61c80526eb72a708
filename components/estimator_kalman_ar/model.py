from __future__ import annotations

from gyrobench.component import Discrete, Output, Parameter, sampled
from gyrobench.component.blocks.estimator import ZERO, KalmanEstimator, stationary
from gyrobench.component.math import index


class EstimatorKalmanAr(KalmanEstimator):
    """Kalman filter for a drift that is an autoregressive process of order p, p = 1 ... 5.  [EST-KF-GEN, EST-KF-AR]

        x_t = phi_1 x_{t-1} + ... + phi_p x_{t-p} + w_t,   var w = Q        z_t = x_t + v_t,   var v = R

    Companion form: state (x_t ... x_{t-p+1}), first row of F is phi, H = [1 0 ... 0].  At each reading

        x- = F x,   P- = F P F' + Q e1 e1'
        y  = z - H x-,   S = H P- H' + R,   K = P- H' / S
        x  = x- + K y,   P = (I - K H) P- (I - K H)' + K R K'      (Joseph form, made symmetric)

    and with valid = 0 only the first line: the reading is missing.  nis = y2/S; variance = P_11 of the estimate.

    **Sign.**  phi is the one of statsmodels.  MATLAB's arburg and spectrum.arburg return a = -phi, which is what table
    3.4.2 of Xia 2008 prints: put in as it stands it is not stationary and is refused, with this reason.

    What Xia 2008 did and this part does not: the model of the DIFFERENCED series fed with readings that are not
    differenced; R set to the innovation variance, which holds the reading noise already; the model of a drift put over
    a turning platform, where it scales the rate (gain 0.39 at 1 Hz).  For a rate take estimator_kalman_rate.

    Not modelled: a mean other than 0, moving-average terms, parameters that change.
    Source: EST-KF-GEN, EST-KF-AR; Xia 2008, eq. 4.2.1-4.2.18, 3.4.18.
    """

    version = "1.0.0"

    p = Parameter(3, int, "order of the model", min=1, max=5)
    phi = Parameter([-0.7466, -0.5044, -0.2538, 0.0, 0.0], "1", "coefficients of x_t = sum phi_i x_{t-i} + w_t")
    Q = Parameter(3.3697e-6, "1", "variance of w, (unit of z)2", min=0.0)
    R = Parameter(3.3697e-6, "1", "variance of the noise of one reading, (unit of z)2", above=0.0)
    P0 = Parameter(1e-4, "1", "variance of each state at the start, (unit of z)2", min=0.0)

    latency = Output("s", "delay of the estimate")

    x = Discrete(ZERO, "1", "state")
    P = Discrete([ZERO, ZERO, ZERO, ZERO, ZERO], "1", "covariance of the state")

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
            "random walk take estimator_kalman_rate",
        )
        for i in range(5):
            self.x[i] = 0.0
            for j in range(5):
                self.P[i][j] = 0.0
            if i < self.p:
                self.P[i][i] = self.P0

    @sampled(every=1)
    def tick(self) -> None:
        if self.reading > 0.5:
            # x- = F x; the product F P, then F P F': rows and columns move down by one, the first is new
            new = 0.0
            c = [0.0, 0.0, 0.0, 0.0, 0.0]  # first row of F P
            for i in range(index(self.p)):
                new = new + self.phi[i] * self.x[i]
                for j in range(index(self.p)):
                    c[j] = c[j] + self.phi[i] * self.P[i][j]
            first = self.Q  # P-_11
            for j in range(index(self.p)):
                first = first + c[j] * self.phi[j]
            for m in range(4):
                self.x[4 - m] = self.x[3 - m] if 4.0 - m < self.p else 0.0
                for n in range(4):
                    self.P[4 - m][4 - n] = self.P[3 - m][3 - n] if 4.0 - m < self.p and 4.0 - n < self.p else 0.0
            self.x[0] = new
            self.P[0][0] = first
            for j in range(4):
                self.P[0][j + 1] = c[j] if j + 1.0 < self.p else 0.0
                self.P[j + 1][0] = self.P[0][j + 1]
            self.y = 0.0
            self.e = 0.0
            if self.valid > 0.5:
                self.y = self.z - self.x[0]
                variance = self.P[0][0] + self.R
                self.e = self.y * self.y / variance
                g = [0.0, 0.0, 0.0, 0.0, 0.0]  # K
                r = [0.0, 0.0, 0.0, 0.0, 0.0]  # H P-
                for i in range(index(self.p)):
                    g[i] = self.P[i][0] / variance
                    r[i] = self.P[0][i]
                    self.x[i] = self.x[i] + g[i] * self.y
                for i in range(index(self.p)):  # M = (I - K H) P-
                    for j in range(index(self.p)):
                        self.P[i][j] = self.P[i][j] - g[i] * r[j]
                for i in range(index(self.p)):
                    r[i] = self.P[i][0]
                for i in range(index(self.p)):  # M (I - K H)' + K R K'
                    for j in range(index(self.p)):
                        self.P[i][j] = self.P[i][j] - r[i] * g[j] + g[i] * self.R * g[j]
                for i in range(index(self.p)):
                    for j in range(i):
                        self.P[i][j] = 0.5 * (self.P[i][j] + self.P[j][i])
                        self.P[j][i] = self.P[i][j]

    def outputs(self) -> None:
        self.estimate = self.x[0]
        self.variance = self.P[0][0]
        self.latency = 0.0
