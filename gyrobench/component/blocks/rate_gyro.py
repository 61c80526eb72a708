"""Rate gyros: mount, scale factor, bias and its drift, lock-in, counting of angle increments, which they share."""

from __future__ import annotations

from typing import ClassVar

from gyrobench.component.blocks.mems import butterworth, sample_number, word
from gyrobench.component.blocks.random_drift import Flicker, RateRandomWalk
from gyrobench.component.component import Component
from gyrobench.component.composition import Block
from gyrobench.component.declarations import Discrete, Input, Noise, Output, Parameter, State
from gyrobench.component.math import Number, Vector, fabs, floor, pi, sign, sqrt, vector
from gyrobench.component.rotation import Rotation
from gyrobench.component.set_up import GYRO_MOUNT, each, turned

DEG = pi / 180.0


def locked(rate: Number, band: Number) -> Number:
    """Return the mean rate of a ring that locks within +-band: 0 there, sign(rate) sqrt(rate2 - band2) outside.

    psi' = k (rate - band sin psi), averaged over a period of psi.  [GYRO-LOCK-IN; Aronowitz 1999]
    """
    free = rate * rate - band * band
    return sign(rate) * sqrt(free) if free > 0.0 else 0.0


class AngleCounter(Block):
    """Increments of an angle in whole counts; what is less than a count is kept for the next step, no angle is lost.

    A mean over T errs by the difference of two remainders, each uniform over a count, over T: Q = size / sqrt(12).
    """

    size = Parameter(0.0, "rad", "angle of a count; 0: none", min=0.0)
    rate = Discrete([0.0, 0.0], "rad/s", "rates, of a part that shares them")
    remainder = Discrete([0.0, 0.0], "rad", "angle not yet counted")

    def count(self) -> None:
        """Replace the rates by those of the counts of this internal step."""
        if self.size > 0.0:
            for j in range(2):
                angle = self.remainder[j] + self.rate[j] * self.h
                counts = floor(angle / self.size + 0.5)
                self.remainder[j] = angle - counts * self.size
                self.rate[j] = counts * self.size / self.h


class RateGyro(Component):
    """Common part of rate gyros with the axes x and y: mount, scale factor, drift, ports.  [DRIFT-RANDOM-ALLAN]

        w = mount omega                                                   T: temperature above that of the coefficients
        scaled_j = (1 + scale_j + scale_T T + sign(w_j) asymmetry / 2) w_j
        drift_j  = bias_j + bias_T_j T + magnetic_j B + g_j f + turn-on bias + flicker + random walk

    The measured rate is that of the internal step that ends; the drift is in the sign of the rate (an indicated rate).
    """

    #: for data sheets: the parameter that is the white noise, and the values with which the part computes none itself
    white_noise: ClassVar[str] = ""
    without_own_noise: ClassVar[dict[str, float]] = {}

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    scale = Parameter([0.0, 0.0], "1", "relative errors of the scale factors", min=-0.1, max=0.1)
    scale_T = Parameter(0.0, "1/K", "change of the scale factor with temperature, relative")
    asymmetry = Parameter(0.0, "1", "scale factor of positive less that of negative rates, relative", min=-0.1, max=0.1)
    simulates = (each("bias", ("gyro.bias.x",), ("gyro.bias.y",)), turned("mount", GYRO_MOUNT))
    bias = Parameter([0.0, 0.0], "rad/s", "bias of each axis")
    bias_T = Parameter([0.0, 0.0], "rad/s/K", "change of the bias with temperature")
    magnetic = Parameter([[0.0] * 3] * 2, "rad/s/T", "rows: change of each bias with the field along x, y, z")
    g = Parameter([[0.0] * 3] * 2, "rad.s/m", "rows: change of each bias with the specific force along x, y, z")
    mount = Rotation("rows: gyro axes x, y, z in head axes")
    turn_on = Noise(0.0, "rad/s", "rms of the turn-on bias, one value a run", per="start", samples=2)
    flicker_x = Flicker("rad/s", "drift, x axis", tau="flicker_tau")
    flicker_y = Flicker("rad/s", "drift, y axis", tau="flicker_tau")
    flicker_tau = Parameter(1e5, "s", "longest correlation time of the flicker", above=0.0)
    walk_x = RateRandomWalk("rad/s", "rad/s2/sqrt(Hz)", "drift, x axis")
    walk_y = RateRandomWalk("rad/s", "rad/s2/sqrt(Hz)", "drift, y axis")

    omega = Input([0.0, 0.0, 0.0], "rad/s", "inertial rate, head axes")
    f = Input([0.0, 0.0, 0.0], "m/s2", "specific force a - G, head axes")
    temperature = Input(0.0, "K", "mean temperature above that of the coefficients")
    B = Input([0.0, 0.0, 0.0], "T", "magnetic field, head axes")

    rate = Output("rad/s", "measured rate along x and y", shape=(2,))
    saturated = Output("1", "1 while a rate is beyond the range")

    measured = Discrete([0.0, 0.0], "rad/s", "measured rate")
    beyond = Discrete(0.0, "1", "1 while a rate is beyond the range")

    def scaled(self, w: Vector, T: Number) -> Vector:
        """Return the rates along x and y by the scale factors, w: along the axes of the gyro."""
        out = vector([w[0], w[1]])
        for j in range(2):
            out[j] = (1.0 + self.scale[j] + self.scale_T * T + 0.5 * sign(w[j]) * self.asymmetry) * w[j]
        return vector(out)

    def drift_rates(self, T: Number) -> Vector:
        """Return the drift of both axes."""
        field = self.mount @ self.B
        force = self.mount @ self.f
        wander = vector([self.flicker_x_value + self.walk_x_value, self.flicker_y_value + self.walk_y_value])
        out = vector([0.0, 0.0])
        for j in range(2):
            out[j] = self.bias[j] + self.bias_T[j] * T + vector(self.magnetic[j]) @ field
            out[j] = out[j] + vector(self.g[j]) @ force + self.noise.turn_on[j] + wander[j]
        return vector(out)

    def limit(self, range_max: Number) -> None:
        """Hold the measured rates within +-range_max (0: no limit), and note whether one was beyond."""
        self.beyond = 0.0
        for j in range(2):
            if range_max > 0.0 and fabs(self.measured[j]) > range_max:
                self.beyond = 1.0
                self.measured[j] = sign(self.measured[j]) * range_max

    def outputs(self) -> None:
        self.rate = self.measured
        self.saturated = self.beyond


class FilteredRateGyro(RateGyro):
    """Common part of rate gyros with an output filter, a range, an output rate and a word.  [GYRO-MEMS]

    y'' = wn2 (s - y) - sqrt(2) wn y',   wn = 2 pi bandwidth                              Butterworth, second order
    rate = y within +-range_max, sampled every `period`, in steps of `resolution`
    """

    unrounded: ClassVar[dict[str, float]] = {"resolution": 0.0}
    sampling_parameter = "period"

    bandwidth = Parameter(50.0, "Hz", "frequency at which the filter has 3 dB", above=0.0)
    range_max = Parameter(300.0 * DEG, "rad/s", "largest rate (300 deg/s); 0: no limit", min=0.0)
    period = Parameter(0.0, "s", "time between two output samples; 0: every step", min=0.0)
    resolution = Parameter(0.0, "rad/s", "step of the output word; 0: none", min=0.0)

    density = Output("rad/s/sqrt(Hz)", "density N of the white noise (angle random walk)")

    y = State([0.0, 0.0], "rad/s", "filtered rate")
    v = State([0.0, 0.0], "rad/s2", "its derivative")
    number = Discrete(-1.0, "1", "number of the output sample")

    def filter_rates(self, s: Vector) -> None:
        """Write the derivatives of the filter that is fed with s, rad/s."""
        for j in range(2):
            self.der.y[j] = self.v[j]
            self.der.v[j] = butterworth(s[j], self.y[j], self.v[j], self.bandwidth)

    def read_out(self) -> None:
        """Take the filtered rates as measured if a sample is due."""
        due = 1.0
        if self.period > 0.0:
            count = sample_number(self.t, self.period)
            due = 1.0 if count > self.number else 0.0
            self.number = count
        if due > 0.5:
            self.measured = self.y
            self.limit(self.range_max)
            if self.resolution > 0.0:
                for j in range(2):
                    self.measured[j] = word(self.measured[j], self.resolution)
