from __future__ import annotations

from gyrobench.component import Component, Input, Noise, Output, Parameter, Rotation
from gyrobench.component.blocks.gyro import DEG_H, GaussMarkov
from gyrobench.component.set_up import GYRO_MOUNT, each, turned


class GyroRate(Component):
    """Two-axis rate gyro with its loop closed inside, quick form: rates along x and y of the head.  [NORTH-COMMON]

        rate_j = (1 + scale_j) (mount omega)_j + bias_j + ramp_j t + curve_j t2 + Gauss-Markov + white

    White noise of the density N leaves the standard deviation N / sqrt(T) in a mean over T (angle random walk, 1
    deg/sqrt(h) = 60 deg/h/sqrt(Hz)).

    Not modelled: dynamics of the loop, g-sensitivity, quantization, cross-coupling other than by the mount; the bench's
    gyros with their rebalance loops have them.
    Source: GSP ch. 5, section 5.3.2 (gyro of a north finder); DRIFT-RANDOM-CLASSES.
    """

    version = "1.1.0"

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    scale = Parameter([0.0, 0.0], "1", "relative errors of the scale factors", min=-0.1, max=0.1)
    simulates = (each("bias", ("gyro.bias.x",), ("gyro.bias.y",)), turned("mount", GYRO_MOUNT))
    bias = Parameter([0.1 * DEG_H, 0.1 * DEG_H], "rad/s", "bias of each axis (0.1 deg/h)")
    ramp = Parameter([0.0, 0.0], "rad/s2", "linear drift of the bias")
    curve = Parameter([0.0, 0.0], "rad/s3", "quadratic drift of the bias")
    mount = Rotation("rows: gyro axes x, y, z in head axes")
    markov_x = GaussMarkov(0.0, "rad/s", "Gauss-Markov drift along x")
    markov_y = GaussMarkov(0.0, "rad/s", "Gauss-Markov drift along y")
    white_x = Noise(0.3 * DEG_H, "rad/s/sqrt(Hz)", "white noise along x (0.005 deg/sqrt(h))")
    white_y = Noise(0.3 * DEG_H, "rad/s/sqrt(Hz)", "white noise along y (0.005 deg/sqrt(h))")
    turn_on_x = Noise(0.0, "rad/s", "rms of the turn-on bias along x, one value a run", per="start")
    turn_on_y = Noise(0.0, "rad/s", "rms of the turn-on bias along y, one value a run", per="start")

    omega = Input([0.0, 0.0, 0.0], "rad/s", "inertial rate, head axes")

    rate = Output("rad/s", "measured rate along x and y", shape=(2,))

    def outputs(self) -> None:
        w = self.mount @ self.omega
        random_x = self.noise.turn_on_x + self.markov_x_value + self.noise.white_x
        random_y = self.noise.turn_on_y + self.markov_y_value + self.noise.white_y
        drift_x = self.t * (self.ramp[0] + self.t * self.curve[0])
        drift_y = self.t * (self.ramp[1] + self.t * self.curve[1])
        self.rate[0] = (1.0 + self.scale[0]) * w[0] + self.bias[0] + drift_x + random_x
        self.rate[1] = (1.0 + self.scale[1]) * w[1] + self.bias[1] + drift_y + random_y
