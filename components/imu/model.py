from __future__ import annotations

from gyrobench.component import Block, Input, Noise, Output, Parameter, Rotation
from gyrobench.component.blocks.gyro import DEG_H, GaussMarkov
from gyrobench.component.blocks.thermal import TemperatureHistory, ThermalErrors
from gyrobench.component.math import pi, vector
from gyrobench.component.set_up import GYRO_MOUNT, turned

G0 = 9.80665  # m/s2
NONE = [0.0, 0.0, 0.0]


class ImuAxisNoise(Block):
    """Random errors of one axis: white noise and a Gauss-Markov bias, of its gyro and of its accelerometer."""

    gyro_bias = GaussMarkov(0.0, "rad/s", "bias of the gyro", tau="gyro_bias_tau")
    gyro = Noise(0.01 / 60.0 * pi / 180.0, "rad/s/sqrt(Hz)", "white noise of the rate (0.01 deg/sqrt(h))")
    acc_bias = GaussMarkov(0.0, "m/s2", "bias of the accelerometer", tau="acc_bias_tau")
    acc = Noise(50e-6 * G0, "m/s2/sqrt(Hz)", "white noise of the specific force (50 ug/sqrt(Hz))")


class Imu(TemperatureHistory):
    """Three gyros and three accelerometers as one instrument, quick form: bias, scale factor, misalignment, noise.

        rate   = (1 + gyro_scale + diag sg(T)) M omega + gyro_bias + bg(T) + g_sensitivity (M f)/g0 + noise
        f_read = (1 + acc_scale + diag sa(T)) M f + acc_bias + ba(T) + noise           Gauss-Markov and white

    M (mount): axes of the case in the axes of the inputs.  Row i of a matrix belongs to the instrument i: its diagonal
    element is the relative error of the scale factor, the two others are the sines by which its input axis leans
    towards the other axes of the case.  Nothing makes a matrix symmetric or triangular.  b(T), s(T): of the
    temperature, its way through a hysteresis and its rate (block ThermalErrors); none unless set.

    Not modelled: nonlinearity, asymmetry, dynamics, quantization, lever arms between the accelerometers, misalignments
    and g-sensitivity that follow the temperature, g-squared sensitivity (see floated_gyro, accelerometer_pendulous,
    fixture, accelerometer_mems).
    Source: IEEE 1559 (terms); Tedaldi 2014 (model of a triad); own quick form.
    """

    version = "1.0.0"
    simulates = (turned("mount", GYRO_MOUNT),)

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    mount = Rotation("rows: axes x, y, z of the case in the axes of the inputs")
    gyro_bias = Parameter([10.0 * DEG_H, -6.0 * DEG_H, 3.0 * DEG_H], "rad/s", "bias of each gyro (10, -6, 3 deg/h)")
    gyro_scale = Parameter(
        [[2e-4, 3e-4, -1e-4], [-2e-4, -3e-4, 1.5e-4], [1e-4, 2.5e-4, 1e-4]], "1",
        "gyros: scale factor errors (diagonal) and misalignments", min=-0.2, max=0.2,
    )  # fmt: skip
    g_sensitivity = Parameter(
        [[2.0 * DEG_H, 0.0, -1.0 * DEG_H], [0.5 * DEG_H, -1.5 * DEG_H, 0.0], [0.0, 1.0 * DEG_H, 0.8 * DEG_H]], "rad/s",
        "rate of each gyro per g0 of specific force along x, y, z",
    )  # fmt: skip
    acc_bias = Parameter([1e-3 * G0, -5e-4 * G0, 8e-4 * G0], "m/s2", "bias of each accelerometer (1, -0.5, 0.8 mg)")
    acc_scale = Parameter(
        [[3e-4, 2e-4, -3e-4], [-1e-4, -2e-4, 2.5e-4], [1.5e-4, -2e-4, 5e-4]], "1",
        "accelerometers: scale factor errors (diagonal) and misalignments", min=-0.2, max=0.2,
    )  # fmt: skip
    gyro_bias_tau = Parameter(300.0, "s", "correlation time of the gyro biases", above=0.0)
    acc_bias_tau = Parameter(300.0, "s", "correlation time of the accelerometer biases", above=0.0)
    gyro = ThermalErrors("rad/s", "rad/K", "gyros")
    acc = ThermalErrors("m/s2", "m/s/K", "accelerometers")
    x = ImuAxisNoise()
    y = ImuAxisNoise()
    z = ImuAxisNoise()

    omega = Input(NONE, "rad/s", "inertial rate")
    f = Input([0.0, 0.0, G0], "m/s2", "specific force a - G")

    rate = Output("rad/s", "rates that the gyros x, y, z read", shape=(3,))
    f_read = Output("m/s2", "specific force that the accelerometers x, y, z read", shape=(3,))

    def outputs(self) -> None:
        omega = self.mount @ self.omega
        f = self.mount @ self.f
        T = self.temperature
        own = self.gyro.error_at(omega, T, self.way, self.slope)
        drift = vector([self.x_gyro_bias_value, self.y_gyro_bias_value, self.z_gyro_bias_value])
        white = vector([self.noise.x_gyro, self.noise.y_gyro, self.noise.z_gyro])
        self.rate = (
            omega + self.gyro_scale @ omega + self.gyro_bias + self.g_sensitivity @ f * (1.0 / G0) + drift + white + own
        )
        drift = vector([self.x_acc_bias_value, self.y_acc_bias_value, self.z_acc_bias_value])
        white = vector([self.noise.x_acc, self.noise.y_acc, self.noise.z_acc])
        own = self.acc.error_at(f, T, self.way, self.slope)
        self.f_read = f + self.acc_scale @ f + self.acc_bias + drift + white + own
