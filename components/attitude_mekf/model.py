from __future__ import annotations

from gyrobench.component import Discrete, Output, sampled
from gyrobench.component.blocks.angle import wrapped
from gyrobench.component.blocks.attitude import (
    ZEROS,
    AttitudeEstimator,
    SensorNoise,
    angles_of,
    matrix_of,
    quaternion_of,
    turned,
)
from gyrobench.component.math import Number, Vector, cos, cross, exp, sin, vector

SQUARE = [ZEROS, ZEROS, ZEROS]
UNIT = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]


class AttitudeMekf(AttitudeEstimator):
    """Multiplicative extended Kalman filter: quaternion, rotation error and gyro biases, any attitude.  [EST-ATTITUDE]

        q <- q turned by r h,  r = omega - b - C omega_earth,   b <- e b,   e = exp(-h/tau)
        C_true = C (1 - [d x]),  d in east, north, up:    d' = -omega_earth x d - C'(db + n),    db' = -db/tau + w

        z = f:        C' z - gravity up = gravity up x d + v,                  var v = acc2/h of each axis
        z = heading: z - heading = ((-sin(roll) a_1 + cos(roll) a_3)/cos(pitch)) d + v,  a_i rows of C, var v = heading2

    The error is held in local axes: there the rotation about the vertical, which the specific force does not show, is
    the same direction at every estimate, so that readings of the specific force tell nothing of the heading.  Readings
    are taken one after the other (three of the specific force while it is usable, one of the heading); after each step
    d goes into q, db into b.

    Not modelled: acceleration of the vehicle (it is taken for gravity below the gate); heading near a pitch of 90 deg:
    not used where |cos(pitch)| < 0.1.
    Source: EST-ATTITUDE; Markley 2014, chapter 6.
    """

    version = "1.0.0"

    noise_of = SensorNoise()

    covariance = Output("1", "of the rotation (x, y, z) in rad and the biases in rad/s", shape=(6, 6))
    nis = Output("1", "squared innovations over their variances, sum over the readings of the step")
    used = Output("1", "readings used in the step")

    q = Discrete([1.0, 0.0, 0.0, 0.0], "1", "rotation from vehicle to ENU axes")
    d = Discrete(ZEROS, "rad", "rotation error that is not yet in q, ENU")
    db = Discrete(ZEROS, "rad/s", "error of the biases that is not yet in b")
    P = Discrete(SQUARE, "1", "covariance of d")
    X = Discrete(SQUARE, "1", "covariance of d (rows) with db")
    B = Discrete(SQUARE, "1", "covariance of db")
    e = Discrete(0.0, "1", "sum of squared innovations over their variances")
    n = Discrete(0.0, "1", "readings used")

    def correct(self, row: Vector, y: Number, R: Number) -> None:
        """Take a reading whose residual is y = row . d + v, var v = R."""
        g = self.P @ row
        gb = self.X.T @ row
        S = row @ g + R
        left = y - row @ self.d
        self.d = self.d + g * (left / S)
        self.db = self.db + gb * (left / S)
        for i in range(3):
            for j in range(3):
                self.P[i][j] = self.P[i][j] - g[i] * g[j] / S
                self.X[i][j] = self.X[i][j] - g[i] * gb[j] / S
                self.B[i][j] = self.B[i][j] - gb[i] * gb[j] / S
        self.e = self.e + left * left / S
        self.n = self.n + 1.0

    def predict(self) -> None:
        """Turn q by the rates of the step and carry the covariance along: d+ = F d + G db, db+ = keep db."""
        before = matrix_of(self.q)
        h = self.h
        self.q = turned(self.q, (vector(self.omega) - self.b - before @ self.earth()) * h)
        keep = exp(-h / self.noise_of.tau)
        self.b = keep * self.b
        G = (before + matrix_of(self.q)).T * (-0.5 * h)  # C of the middle of the step
        s = 2.0 * self.noise_of.bias * self.noise_of.bias / self.noise_of.tau
        unit = vector(UNIT)
        F = vector(UNIT)
        for j in range(3):
            column = cross(unit[j], self.earth()) * h  # -(omega_earth x axis) h
            for i in range(3):
                F[i][j] = F[i][j] + column[i]
        both = F @ self.X @ G.T
        self.P = F @ self.P @ F.T + both + both.T + G @ self.B @ G.T
        self.X = keep * (F @ self.X + G @ self.B) + (0.5 * s * h) * G
        self.B = keep * keep * self.B
        for i in range(3):
            self.P[i][i] = self.P[i][i] + self.noise_of.gyro * self.noise_of.gyro * h + s * h * h * h / 3.0
            self.B[i][i] = self.B[i][i] + s * h
        self.P = 0.5 * (self.P + self.P.T)
        self.B = 0.5 * (self.B + self.B.T)

    def align(self) -> None:
        """Set attitude and covariance to the first readings."""
        self.q = quaternion_of(self.aligned)
        sigma = self.noise_of.heading if self.heading_new > 0.5 else self.noise_of.start
        tilt = self.noise_of.acc * self.noise_of.acc / (self.h * self.gravity * self.gravity)
        self.P = vector(UNIT) * tilt
        self.P[2][2] = sigma * sigma
        self.B = vector(UNIT) * (self.noise_of.bias * self.noise_of.bias)

    @sampled(every=1)
    def tick(self) -> None:
        self.e = 0.0
        self.n = 0.0
        if self.going < 1.5:
            self.align()
        else:
            self.predict()
            self.d = vector(ZEROS)
            self.db = vector(ZEROS)
            C = matrix_of(self.q)
            if self.usable > 0.5:
                R = self.noise_of.acc * self.noise_of.acc / self.h
                level = C.T @ self.f
                self.correct(vector([0.0, -self.gravity, 0.0]), level[0], R)
                self.correct(vector([self.gravity, 0.0, 0.0]), level[1], R)
                up = level[2] - self.gravity  # tells nothing of the attitude
                self.e = self.e + up * up / R
                self.n = self.n + 1.0
            angle = angles_of(C)
            if self.heading_new > 0.5 and cos(angle[0]) > 0.1:
                row = (C[2] * cos(angle[1]) - C[0] * sin(angle[1])) / cos(angle[0])
                self.correct(row, wrapped(self.heading - angle[2]), self.noise_of.heading * self.noise_of.heading)
            self.q = turned(self.q, C @ self.d)
            self.b = self.b + self.db

    def outputs(self) -> None:
        C = matrix_of(self.q)
        self.angle = angles_of(C)
        rotation = C @ self.P @ C.T
        both = C @ self.X
        for i in range(3):
            for j in range(3):
                self.covariance[i][j] = rotation[i][j]
                self.covariance[i][j + 3] = both[i][j]
                self.covariance[j + 3][i] = both[i][j]
                self.covariance[i + 3][j + 3] = self.B[i][j]
        self.nis = self.e
        self.used = self.n
