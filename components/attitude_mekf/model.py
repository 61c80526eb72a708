from __future__ import annotations

from gyrobench.component import Discrete, Output, sampled
from gyrobench.component.blocks.angle import wrapped
from gyrobench.component.blocks.attitude import (
    AttitudeEstimator,
    SensorNoise,
    angles_of,
    matrix_of,
    quaternion_of,
    turned,
)
from gyrobench.component.math import Number, Vector, cos, cross, exp, sin, vector

NONE = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
UNIT = [
    [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [0.0, 1.0, 0.0, 0.0, 0.0, 0.0],
    [0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
    [0.0, 0.0, 0.0, 1.0, 0.0, 0.0],
    [0.0, 0.0, 0.0, 0.0, 1.0, 0.0],
    [0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
]


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
    x = Discrete(NONE, "1", "error of rotation (rad, ENU) and biases (rad/s) that is not yet in q and b")
    P = Discrete([NONE, NONE, NONE, NONE, NONE, NONE], "1", "its covariance")
    e = Discrete(0.0, "1", "sum of squared innovations over their variances")
    n = Discrete(0.0, "1", "readings used")

    def correct(self, H: Vector, y: Number, R: Number) -> None:
        """Take a reading whose residual is y = H x + v, var v = R."""
        g = self.P @ H
        S = H @ g + R
        y_left = y - H @ self.x
        self.x = self.x + g * (y_left / S)
        for i in range(6):
            for j in range(6):
                self.P[i][j] = self.P[i][j] - g[i] * g[j] / S
        self.e = self.e + y_left * y_left / S
        self.n = self.n + 1.0

    def predict(self) -> None:
        """Turn q by the rates of the step and carry the covariance along."""
        before = matrix_of(self.q)
        h = self.h
        self.q = turned(self.q, (vector(self.omega) - self.b - before @ self.earth()) * h)
        keep = exp(-h / self.noise_of.tau)
        self.b = keep * self.b
        C = 0.5 * (before + matrix_of(self.q))  # of the middle of the step
        s = 2.0 * self.noise_of.bias * self.noise_of.bias / self.noise_of.tau
        F = vector(UNIT)
        for j in range(3):
            axis = vector([0.0, 0.0, 0.0])
            axis[j] = 1.0
            column = cross(axis, self.earth()) * h  # -(omega_earth x axis) h
            for i in range(3):
                F[i][j] = F[i][j] + column[i]
                F[i][j + 3] = -h * C[j][i]
            F[j + 3][j + 3] = keep
        self.P = F @ self.P @ F.T
        for i in range(3):
            for j in range(3):
                self.P[i][j + 3] = self.P[i][j + 3] - 0.5 * s * h * h * C[j][i]
                self.P[j + 3][i] = self.P[j + 3][i] - 0.5 * s * h * h * C[j][i]
            self.P[i][i] = self.P[i][i] + self.noise_of.gyro * self.noise_of.gyro * h + s * h * h * h / 3.0
            self.P[i + 3][i + 3] = self.P[i + 3][i + 3] + s * h

    def align(self) -> None:
        """Set attitude and covariance to the first readings."""
        self.q = quaternion_of(self.aligned)
        sigma = self.noise_of.heading if self.heading_new > 0.5 else self.noise_of.start
        for i in range(6):
            for j in range(6):
                self.P[i][j] = 0.0
        for i in range(3):
            self.P[i][i] = self.noise_of.acc * self.noise_of.acc / (self.h * self.gravity * self.gravity)
            self.P[i + 3][i + 3] = self.noise_of.bias * self.noise_of.bias
        self.P[2][2] = sigma * sigma

    @sampled(every=1)
    def tick(self) -> None:
        self.e = 0.0
        self.n = 0.0
        if self.going < 1.5:
            self.align()
        else:
            self.predict()
            self.x = vector(NONE)
            C = matrix_of(self.q)
            if self.usable > 0.5:
                R = self.noise_of.acc * self.noise_of.acc / self.h
                level = C.T @ self.f
                self.correct(vector([0.0, -self.gravity, 0.0, 0.0, 0.0, 0.0]), level[0], R)
                self.correct(vector([self.gravity, 0.0, 0.0, 0.0, 0.0, 0.0]), level[1], R)
                self.correct(vector(NONE), level[2] - self.gravity, R)
            angle = angles_of(C)
            if self.heading_new > 0.5 and cos(angle[0]) > 0.1:
                row = (C[2] * cos(angle[1]) - C[0] * sin(angle[1])) / cos(angle[0])
                H = vector(NONE)
                for i in range(3):
                    H[i] = row[i]
                self.correct(H, wrapped(self.heading - angle[2]), self.noise_of.heading * self.noise_of.heading)
            self.q = turned(self.q, C @ self.x[0:3])
            self.b = self.b + self.x[3:6]

    def outputs(self) -> None:
        C = matrix_of(self.q)
        self.angle = angles_of(C)
        T = vector(UNIT)
        for i in range(3):
            for j in range(3):
                T[i][j] = C[i][j]
        self.covariance = T @ self.P @ T.T
        self.nis = self.e
        self.used = self.n
