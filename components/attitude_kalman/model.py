from __future__ import annotations

from gyrobench.component import Discrete, Output, sampled
from gyrobench.component.blocks.angle import wrapped
from gyrobench.component.blocks.attitude import ZEROS, AttitudeEstimator, SensorNoise, matrix_of, quaternion_of
from gyrobench.component.math import Number, cos, exp, index, sin, sqrt, vector


class AttitudeKalman(AttitudeEstimator):
    """Linear Kalman filter of attitude and gyro biases for small angles, two states for each axis.  [EST-ATTITUDE]

        angle' = omega - b - n,   b' = -b/tau + w          z = angle + v

        F = [[1, -h], [0, e]],   e = exp(-h/tau)
        Q = [[gyro2 h + s h3/3, -s h2/2], [-s h2/2, s h]],   s = 2 bias2/tau
        z: pitch and roll that the specific force shows while it is usable, var v = acc2/(h gravity2); the heading as
        read, var v = heading2

    Pitch, roll and heading are taken for rotations about x, y and z: right to first order in pitch and roll.  Earth
    rate is taken off in the estimated axes.

    Not modelled: pitch and roll beyond small angles (see attitude_mekf), acceleration of the vehicle.
    Source: EST-ATTITUDE; standard Kalman filter, own model.
    """

    version = "1.0.0"

    noise_of = SensorNoise()

    covariance = Output("1", "of the rotation (x, y, z) in rad and the biases in rad/s", shape=(6, 6))
    nis = Output("1", "squared innovations over their variances, sum over the readings of the step")
    used = Output("1", "readings used in the step")

    a = Discrete(ZEROS, "rad", "pitch, roll, heading")
    P = Discrete([ZEROS, ZEROS, ZEROS], "1", "of each axis: variance of angle, variance of bias, their covariance")
    e = Discrete(0.0, "1", "sum of squared innovations over their variances")
    n = Discrete(0.0, "1", "readings used")

    def correct(self, k: Number, y: Number, R: Number) -> None:
        """Take the innovation y of the angle k, variance of the reading R."""
        S = self.P[index(k)][0] + R
        angle = self.P[index(k)][0] / S
        drift = self.P[index(k)][2] / S
        self.a[index(k)] = self.a[index(k)] + angle * y
        self.b[index(k)] = self.b[index(k)] + drift * y
        self.P[index(k)][1] = self.P[index(k)][1] - drift * self.P[index(k)][2]
        self.P[index(k)][2] = self.P[index(k)][2] - drift * self.P[index(k)][0]
        self.P[index(k)][0] = self.P[index(k)][0] - angle * self.P[index(k)][0]
        self.e = self.e + y * y / S
        self.n = self.n + 1.0

    @sampled(every=1)
    def tick(self) -> None:
        self.e = 0.0
        self.n = 0.0
        tilt = self.noise_of.acc * self.noise_of.acc / (self.h * self.gravity * self.gravity)
        turn = self.noise_of.heading * self.noise_of.heading
        if self.going < 1.5:
            self.a = self.aligned
            for j in range(3):
                self.P[j][0] = tilt
                self.P[j][1] = self.noise_of.bias * self.noise_of.bias
                self.P[j][2] = 0.0
            self.P[2][0] = turn if self.heading_new > 0.5 else self.noise_of.start * self.noise_of.start
        else:
            earth = matrix_of(quaternion_of(self.a)) @ self.earth()
            keep = exp(-self.h / self.noise_of.tau)
            s = 2.0 * self.noise_of.bias * self.noise_of.bias / self.noise_of.tau
            h = self.h
            for j in range(3):
                self.a[j] = self.a[j] + h * (self.omega[j] - self.b[j] - earth[j])
                self.b[j] = keep * self.b[j]
                angle = self.P[j][0] - 2.0 * h * self.P[j][2] + h * h * self.P[j][1]
                both = keep * (self.P[j][2] - h * self.P[j][1])
                self.P[j][0] = angle + self.noise_of.gyro * self.noise_of.gyro * h + s * h * h * h / 3.0
                self.P[j][2] = both - 0.5 * s * h * h
                self.P[j][1] = keep * keep * self.P[j][1] + s * h
            if self.usable > 0.5:
                shown = self.level(sqrt(self.f @ self.f))
                self.correct(0.0, wrapped(shown[0] - self.a[0]), tilt)
                self.correct(1.0, wrapped(shown[1] - self.a[1]), tilt)
            if self.heading_new > 0.5:
                self.correct(2.0, wrapped(self.heading - self.a[2]), turn)

    def outputs(self) -> None:
        self.angle = vector([wrapped(self.a[0]), wrapped(self.a[1]), wrapped(self.a[2])])
        # rotation about x, y, z by errors of pitch, roll, heading: columns of T
        sp = sin(self.a[0])
        cp = cos(self.a[0])
        sr = sin(self.a[1])
        cr = cos(self.a[1])
        T = [[cr, 0.0, -sr * cp], [0.0, 1.0, sp], [sr, 0.0, cr * cp]]
        for i in range(3):
            for j in range(3):
                total = 0.0
                for k in range(3):
                    total = total + T[i][k] * self.P[k][0] * T[j][k]
                self.covariance[i][j] = total
                self.covariance[i][j + 3] = T[i][j] * self.P[j][2]
                self.covariance[j + 3][i] = T[i][j] * self.P[j][2]
                self.covariance[i + 3][j + 3] = self.P[i][1] if i == j else 0.0
        self.nis = self.e
        self.used = self.n
