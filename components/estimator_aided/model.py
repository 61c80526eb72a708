from __future__ import annotations

from gyrobench.component import Discrete, Input, Output, Parameter, sampled
from gyrobench.component.blocks.estimator import KalmanEstimator
from gyrobench.component.blocks.gyro import DEG_H
from gyrobench.component.math import Number, Vector, dot, pi, vector

STATE = [0.0] * 4
SQUARE = [STATE] * 4


class EstimatorAided(KalmanEstimator):
    """Kalman filter of a rate and of its gyro's drift, which an angle reference shows.  [EST-KF-AIDED, EST-KF-GEN]

        v' = s,   s' = white of density q        rate, as estimator_kalman_rate has it
        b' = white of density walk               drift of the gyro
        theta' = k v                             angle since the reference reads, rad
        z = v + b + noise of variance R          every Ts
        angle = theta + noise of sigma_angle2    in the steps in which angle_new is 1

        estimate = v + theta/(k T_c)             while it is aided; v else

    v, b and the estimate are in the unit of z, k is the rate of one of it.  In a loop that holds the estimate at zero
    the angle is taken back in T_c and the drift is taken off.  Without a reference rate and drift cannot be told apart:
    the gain of b is 0 then, its variance counts all the same, and the filter is estimator_kalman_rate.  P is in Joseph
    form, which holds for any gain.

    The first reading of the angle starts theta at it.  Without one for longer than `patience` the filter is aided no
    more: theta is dropped, b stays.  valid = 0: z is missing.  nis is that of z, nis_angle that of the angle.

    Not modelled: motion of the reference itself, delay of its readings, drift other than a random walk.
    Source: EST-KF-AR (a bias state needs a reference); model: own.
    """

    version = "1.0.0"

    q = Parameter(0.5, "1/s3", "density of the white noise that drives the slope, (unit of z)2/s3", min=0.0)
    walk = Parameter(0.0, "1/s", "density of the white noise that drives the drift, (unit of z)2/s", min=0.0)
    R = Parameter(2.699449e-6, "1", "variance of the noise of one reading, (unit of z)2", above=0.0)
    k = Parameter(17.2e3 * DEG_H, "rad/s", "rate of one unit of z (17.2 deg/h/mA in amperes)", above=0.0)
    drift = Parameter(1e-4, "1", "standard deviation of the drift at the start, unit of z", min=0.0)
    sigma_angle = Parameter(pi / 648000.0, "rad", "standard deviation of a reading of the angle (1 arcsec)", above=0.0)
    T_c = Parameter(1.0, "s", "time in which the angle is taken back; 0: not at all", min=0.0)
    patience = Parameter(10.0, "s", "time without a reading of the angle after which it is given up", above=0.0)
    P0 = Parameter(1.0, "1", "variance of the value at the start, (unit of z)2", min=0.0)
    P0_slope = Parameter(1.0, "1/s2", "variance of the slope at the start, (unit of z)2/s2", min=0.0)

    angle = Input(0.0, "rad", "angle of the reference")
    angle_new = Input(0.0, "1", "1 in the step in which it is read")

    b = Output("1", "estimated drift, unit of z")
    b_variance = Output("1", "its variance, (unit of z)2")
    theta = Output("rad", "estimated angle; 0 while it is not aided")
    aided = Output("1", "1 while the reference is used")
    nis_angle = Output("1", "innovation squared over its variance of the last reading of the angle")
    latency = Output("s", "delay of the estimate")

    x = Discrete(STATE, "1", "value, slope, drift, angle")
    P = Discrete(SQUARE, "1", "their covariance")
    waiting = Discrete(0.0, "1", "1: a reading of the angle has come since the last reading of z")
    seen = Discrete(0.0, "rad", "that reading")
    since = Discrete(0.0, "s", "time since the last reading of the angle")
    uses = Discrete(0.0, "1", "1 while aided")
    ea = Discrete(0.0, "1", "nis of the last reading of the angle")

    def start(self) -> None:
        self.x = vector(STATE)
        self.P = vector(SQUARE)
        self.P[0][0] = self.P0
        self.P[1][1] = self.P0_slope
        self.P[2][2] = self.drift * self.drift

    def predict(self) -> None:
        T = self.Ts
        k = self.k * self.uses
        F = vector(
            [[1.0, T, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [k * T, k * T * T / 2.0, 0.0, self.uses]]
        )
        a = self.q * T * T * T / 3.0
        c = self.q * T * T / 2.0
        d = k * self.q * T * T * T * T / 8.0
        f = k * self.q * T * T * T / 6.0
        g = k * k * self.q * T * T * T * T * T / 20.0
        Q = vector([[a, c, 0.0, d], [c, self.q * T, 0.0, f], [0.0, 0.0, self.walk * T, 0.0], [d, f, 0.0, g]])
        self.x = F @ self.x
        self.P = F @ self.P @ F.T + Q

    def take(self, row: Vector, y: Number, R: Number) -> None:
        """Take a reading with the innovation y = reading - row . x."""
        g = self.P @ row
        S = dot(row, g) + R
        K = g / S
        K[2] = K[2] * self.uses
        self.x = self.x + K * y
        L = vector(SQUARE)
        for i in range(4):
            for j in range(4):
                L[i][j] = (1.0 if i == j else 0.0) - K[i] * row[j]
        self.P = L @ self.P @ L.T
        for i in range(4):
            for j in range(4):
                self.P[i][j] = self.P[i][j] + K[i] * K[j] * R
        self.P = 0.5 * (self.P + self.P.T)

    @sampled(every=1)
    def tick(self) -> None:
        if self.angle_new > 0.5:
            self.waiting = 1.0
            self.seen = self.angle
        if self.reading > 0.5:
            self.since = self.since + self.Ts
            if self.since > self.patience * (1.0 + 1e-9):
                self.uses = 0.0
            self.predict()
            self.y = 0.0
            self.e = 0.0
            if self.valid > 0.5:
                self.y = self.z - self.x[0] - self.x[2]
                self.e = self.y * self.y / (self.P[0][0] + 2.0 * self.P[0][2] + self.P[2][2] + self.R)
                self.take(vector([1.0, 0.0, 1.0, 0.0]), self.y, self.R)
            if self.waiting > 0.5:
                R = self.sigma_angle * self.sigma_angle
                if self.uses > 0.5:
                    off = self.seen - self.x[3]
                    self.ea = off * off / (self.P[3][3] + R)
                    self.take(vector([0.0, 0.0, 0.0, 1.0]), off, R)
                else:  # the row of theta is 0: predict() has dropped it
                    self.uses = 1.0
                    self.x[3] = self.seen
                    self.P[3][3] = R
                self.waiting = 0.0
                self.since = 0.0

    def outputs(self) -> None:
        self.b = self.x[2]
        self.b_variance = self.P[2][2]
        self.theta = self.x[3] * self.uses
        self.aided = self.uses
        self.nis_angle = self.ea
        self.variance = self.P[0][0]
        self.latency = 0.0
        self.estimate = self.x[0]
        if self.T_c > 0.0:
            self.estimate = self.x[0] + self.uses * self.x[3] / (self.k * self.T_c)
