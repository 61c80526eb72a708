from __future__ import annotations

from gyrobench.component import Block, Component, Discrete, Input, Noise, Output, Parameter, Rotation, sampled
from gyrobench.component.blocks.gyro import DEG_H, GaussMarkov
from gyrobench.component.blocks.rate_errors import ALONG_Y, ALONG_Z, RateErrors
from gyrobench.component.math import floor, pi, vector

ZEROS = [0.0, 0.0, 0.0]
ARCSEC = pi / 648000.0


class AxisNoise(Block):
    """Random errors of one axis: gyro bias (Gauss-Markov), accelerometer bias (one a run), white noise of both."""

    bias = GaussMarkov(5.0 * DEG_H, "rad/s", "gyro bias", "5 deg/h", tau="bias_tau")
    gyro = Noise(0.05 / 60.0 * pi / 180.0, "rad/s/sqrt(Hz)", "white noise density of the rate (0.05 deg/sqrt(h))")
    acc_bias = Noise(0.0, "m/s2", "rms of the accelerometer bias", per="start")
    acc = Noise(1e-3, "m/s2/sqrt(Hz)", "white noise density of the specific force")


class InertialUnit(Component):
    """Three gyros, three accelerometers and a heading reference on a vehicle, in quick form: the errors, not the loops.

        indicated = omega - omega_d(f) + delta(omega, alpha) + bias + white          for each of the gyros x, y, z
        f_read    = f + acc_bias + white,       heading = true one + noise, in the first step and every heading_period

    omega_d and delta are the static and dynamic errors of each gyro (block RateErrors), bias a Gauss-Markov process.
    Rates are means over the communication step: the trapezoid of the rate at its ends.

    Not modelled: float and rebalance loop of the gyros (see floated_gyro), scale factor, misalignment, lever arms,
    quantization, a heading reference that is disturbed.
    Source: GYRO-STATIC-ERR, GYRO-DYNAMIC-ERR, DRIFT-RANDOM-CLASSES; own quick form.
    """

    version = "1.0.0"

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    bias_tau = Parameter(3600.0, "s", "correlation time of the gyro biases", above=0.0)
    mount_x = Rotation("rows: axes I, O, S of the gyro x in vehicle axes")
    mount_y = Rotation("rows: axes I, O, S of the gyro y in vehicle axes", ALONG_Y)
    mount_z = Rotation("rows: axes I, O, S of the gyro z in vehicle axes", ALONG_Z)
    x = RateErrors()
    y = RateErrors()
    z = RateErrors()
    noise_x = AxisNoise()
    noise_y = AxisNoise()
    noise_z = AxisNoise()
    heading_noise = Noise(0.2 * pi / 180.0, "rad", "standard deviation of a heading reading (0.2 deg)", per="step")
    heading_period = Parameter(1.0, "s", "time between two heading readings; 0: none", min=0.0)

    omega = Input(ZEROS, "rad/s", "inertial rate, vehicle axes")
    alpha = Input(ZEROS, "rad/s2", "angular acceleration, vehicle axes")
    f = Input([0.0, 0.0, 9.80665], "m/s2", "specific force a - G, vehicle axes")
    angle = Input(ZEROS, "rad", "pitch, roll, heading")

    indicated = Output("rad/s", "rates that the gyros x, y, z indicate", shape=(3,))
    f_read = Output("m/s2", "specific force that the accelerometers read, vehicle axes", shape=(3,))
    heading = Output("rad", "heading as read last")
    heading_new = Output("1", "1 in the step in which the heading is read")
    static = Output("rad/s", "static drift in the indicated rates, -omega_d", shape=(3,))
    dynamic = Output("rad/s", "errors by angular motion in the indicated rates, delta", shape=(3,))
    bias = Output("rad/s", "biases of the gyros", shape=(3,))

    last = Discrete(ZEROS, "rad/s", "rate at the end of the step before")
    begun = Discrete(0.0, "1", "1 once there was a step before")
    mean = Discrete(ZEROS, "rad/s", "mean rate over the step")
    drift = Discrete(ZEROS, "rad/s", "static drift, omega_d")
    delta = Discrete(ZEROS, "rad/s", "errors by angular motion")
    turned = Discrete(0.0, "rad", "heading as read last")
    fresh = Discrete(0.0, "1", "1 in the step in which the heading is read")

    @sampled(every=1)
    def tick(self) -> None:
        omega = vector(self.omega)
        self.mean = 0.5 * (omega + self.last) if self.begun > 0.5 else omega
        self.last = omega
        self.delta[0] = self.x.dynamic(self.mount_x @ omega, self.mount_x @ self.alpha)
        self.delta[1] = self.y.dynamic(self.mount_y @ omega, self.mount_y @ self.alpha)
        self.delta[2] = self.z.dynamic(self.mount_z @ omega, self.mount_z @ self.alpha)
        self.drift[0] = self.x.static(self.mount_x @ self.f)
        self.drift[1] = self.y.static(self.mount_y @ self.f)
        self.drift[2] = self.z.static(self.mount_z @ self.f)
        self.fresh = 0.0
        if self.heading_period > 0.0:
            now = floor(self.t / self.heading_period + 1e-6)
            if self.begun < 0.5 or now > floor((self.t - self.h) / self.heading_period + 1e-6):
                self.fresh = 1.0
                self.turned = self.angle[2] + self.noise.heading_noise
        self.begun = 1.0

    def outputs(self) -> None:
        self.bias = vector([self.noise_x_bias_value, self.noise_y_bias_value, self.noise_z_bias_value])
        self.static = -vector(self.drift)
        self.dynamic = self.delta
        white = vector([self.noise.noise_x_gyro, self.noise.noise_y_gyro, self.noise.noise_z_gyro])
        self.indicated = self.mean - self.drift + self.delta + self.bias + white
        offset = vector([self.noise.noise_x_acc_bias, self.noise.noise_y_acc_bias, self.noise.noise_z_acc_bias])
        shaking = vector([self.noise.noise_x_acc, self.noise.noise_y_acc, self.noise.noise_z_acc])
        self.f_read = vector(self.f) + offset + shaking
        self.heading = self.turned
        self.heading_new = self.fresh
