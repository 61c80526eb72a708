from __future__ import annotations

from gyrobench.component import Discrete, Input, Output, Parameter, sampled
from gyrobench.component.blocks.compensation import SQUARE, ZEROS, SampledModel
from gyrobench.component.blocks.estimator import KalmanEstimator
from gyrobench.component.blocks.gyro import DEG_H
from gyrobench.component.math import clip, fabs, pi, vector

ARCSEC = pi / 648000.0


class DriftCompensator(KalmanEstimator):
    """Kalman filter of a gyro's random drift that cancels it by a current through the torquer.  [COMP-RANDOM-DRIFT]

    The gyro holds a table; the table's angle is read every Ts.  States M (drift), alpha (angle commanded by the gyro),
    theta (angle of the table), input u (rate by the torquer, held over Ts):

        M' = -M/tau + w     alpha' = M - u + n     theta' = (alpha - theta)/lag          z = theta + v, var v = sigma2
        x- = Phi x + B u,   P- = Phi P Phi' + Q,   y = z - theta-,   S = P-_33 + sigma2,   K = P-[:, 3]/S
        x  = x- + K y,      P  = (I - K H) P- (I - K H)' + K sigma2 K'
        u  = M + alpha/T_c, limited to +-u_max;     i = -u/k          (k i = omega_IA - omega_d)

    w is white with the density that gives M the variance rms2, n white drift.  The prediction uses the u that the
    torquer got, limited.  T_c = 0 leaves the term in alpha out: then the rate is compensated, and the angle goes on
    wandering by the errors of the estimate.

    restart = 1 begins anew: the table is at zero.  valid = 0 marks a missing reading: prediction only, u goes on.

    alpha and M are observable from theta for every lag > 0 (H, H F, H F F have rank 3).

    Not modelled: an error of k (the filter believes its u), drift other than Gauss-Markov and white noise, a constant
    drift: a large one is trimmed by hand before.
    Source: COMP-RANDOM-DRIFT; Hu 1981, eq. 6-24..6-31, corrected.
    """

    version = "1.0.0"

    Ts = Parameter(10.0, "s", "sampling period, a whole multiple of the communication step", above=0.0)
    tau = Parameter(3600.0, "s", "correlation time of the drift", above=0.0)
    rms = Parameter(0.01 * DEG_H, "rad/s", "rms of the drift (0.01 deg/h)", above=0.0)
    white = Parameter(0.0, "rad/s/sqrt(Hz)", "white drift density", min=0.0)
    lag = Parameter(1.0, "s", "time constant of the table servo", above=0.0)
    sigma = Parameter(0.2 * ARCSEC, "rad", "standard deviation of an angle reading (0.2 arcsec)", above=0.0)
    T_c = Parameter(300.0, "s", "time in which the angle is taken back; 0: not at all", min=0.0)
    u_max = Parameter(1.0 * DEG_H, "rad/s", "largest rate by the torquer (1 deg/h)", above=0.0)
    k = Parameter(17.2e3 * DEG_H, "rad/s/A", "torquer scale factor (17.2 deg/h/mA)", above=0.0)
    known_from = Parameter(1e9, "s", "length of the record from which tau and rms were estimated", above=0.0)

    z = Input(0.0, "rad", "table angle as read")
    restart = Input(0.0, "1", "1: the table is at zero, begin anew")

    estimate = Output("rad/s", "estimated drift")
    variance = Output("rad2/s2", "its variance, as the filter has it")
    innovation = Output("rad", "reading less its prediction; 0 where the reading is missing")
    alpha = Output("rad", "estimated angle commanded by the gyro")
    theta = Output("rad", "estimated table angle")
    covariance = Output("1", "covariance of drift, alpha, theta in units of rms, sigma, sigma", shape=(3, 3))
    u = Output("rad/s", "rate by the torquer, as commanded")
    i = Output("A", "torquer current")
    saturated = Output("1", "1 while the torquer is at its limit")

    model = SampledModel()
    made_for = Discrete(0.0, "s", "sampling period that the model was made for")
    x = Discrete(ZEROS, "1", "drift, alpha, theta in units of rms, sigma, sigma")
    P = Discrete(SQUARE, "1", "their covariance")
    rate = Discrete(0.0, "rad/s", "rate by the torquer")
    limited = Discrete(0.0, "1", "1 while the torquer is at its limit")

    def start(self) -> None:
        self.refuse(
            self.Ts > self.tau / 3.0,
            "Ts = {Ts} s is longer than a third of tau = {tau} s: the drift has changed before it is compensated; "
            "read more often",
        )
        self.refuse(
            self.T_c > 0.0 and self.T_c < 5.0 * self.Ts,
            "T_c = {T_c} s is shorter than 5 Ts, Ts = {Ts} s: the angle cannot be taken back so fast; 0: not at all",
        )
        self.refuse(
            self.known_from < 20.0 * self.tau,
            "tau = {tau} s from a record of {known_from} s (known_from): at least 20 tau are needed",
        )
        self.begin()

    def begin(self) -> None:
        """Set the states to what is known of a table at zero: the drift has its rms."""
        self.x = vector(ZEROS)
        self.P = vector(SQUARE)
        self.P[0][0] = 1.0
        self.rate = 0.0
        self.limited = 0.0

    @sampled(every=1)
    def tick(self) -> None:
        if self.restart > 0.5:
            self.begin()
            self.y = 0.0
            self.e = 0.0
        elif self.reading > 0.5:
            if self.made_for != self.Ts:
                # states in units of rms, sigma, sigma: numbers near 1
                c = self.rms / self.sigma
                F = vector([[-1.0 / self.tau, 0.0, 0.0], [c, 0.0, 0.0], [0.0, 1.0 / self.lag, -1.0 / self.lag]])
                n = self.white / self.sigma
                L = vector([[2.0 / self.tau, 0.0, 0.0], [0.0, n * n, 0.0], [0.0, 0.0, 0.0]])
                self.model.make(F, L, vector([0.0, -1.0 / self.sigma, 0.0]), self.Ts)
                self.made_for = self.Ts
            self.x = self.model.Phi @ self.x + self.model.B * self.rate
            self.P = self.model.Phi @ self.P @ self.model.Phi.T + self.model.Q
            self.y = 0.0
            self.e = 0.0
            if self.valid > 0.5:
                innovation = self.z / self.sigma - self.x[2]
                variance = self.P[2][2] + 1.0
                self.y = innovation * self.sigma
                self.e = innovation * innovation / variance
                gain = vector([self.P[0][2], self.P[1][2], self.P[2][2]]) / variance
                self.x = self.x + gain * innovation
                A = vector([[1.0, 0.0, -gain[0]], [0.0, 1.0, -gain[1]], [0.0, 0.0, 1.0 - gain[2]]])
                self.P = A @ self.P @ A.T
                for m in range(3):
                    for j in range(3):
                        self.P[m][j] = self.P[m][j] + gain[m] * gain[j]
            self.P = 0.5 * (self.P + self.P.T)
            wanted = self.rms * self.x[0]
            if self.T_c > 0.0:
                wanted = wanted + self.sigma * self.x[1] / self.T_c
            self.rate = clip(wanted, -self.u_max, self.u_max)
            self.limited = 1.0 if fabs(wanted) > self.u_max else 0.0

    def outputs(self) -> None:
        self.estimate = self.rms * self.x[0]
        self.alpha = self.sigma * self.x[1]
        self.theta = self.sigma * self.x[2]
        self.variance = self.rms * self.rms * self.P[0][0]
        self.covariance = self.P
        self.u = self.rate
        self.i = -self.rate / self.k
        self.saturated = self.limited
