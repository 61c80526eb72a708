from __future__ import annotations

from gyrobench.component import Block, Component, Discrete, Input, Noise, Output, Parameter, Rotation, State, sampled
from gyrobench.component.blocks.mems import butterworth, sample_number, word
from gyrobench.component.blocks.random_drift import Flicker, RateRandomWalk
from gyrobench.component.math import Vector, fabs, sign, sqrt, vector
from gyrobench.component.set_up import turned

G0 = 9.80665  # m/s2
UG = 1e-6 * G0
NONE = [0.0, 0.0, 0.0]
UNIT = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]


class AxisDrift(Block):
    """Random drift of the bias of one axis: flicker, and random walk."""

    flicker = Flicker("m/s2", "bias", tau="flicker_tau")
    walk = RateRandomWalk("m/s2", "m/s3/sqrt(Hz)", "bias")


class AccelerometerMems(Component):
    """Three accelerometers as a data sheet describes them: noise, bias instability, filter, range, word.  [ACCEL-MEMS]

        a   = axes mount f                                             rows of axes: sensitive axes
        s_j = (1 + scale_j + scale_T T) a_j + square a_j2 + cubic a_j3 + drift_j + white
        drift_j = bias_j + bias_T_j T + turn-on bias + flicker + random walk
        y'' = wn2 (s - y) - sqrt(2) wn y',   wn = 2 pi bandwidth                              Butterworth, second order
        f_read = y within +-range_max, sampled every `period`, in steps of `resolution`

    square: the vibration rectification, bias per mean square of the specific force; at rest it adds square a_j2.
    white: two-sided density N, the velocity random walk; a data sheet's noise density is one-sided, N sqrt(2).
    T: temperature above that of the coefficients.
    Refused: axes that are not unit vectors within 10 %.
    Not modelled: resonance of the proof mass, delay beyond the filter, lever arms between the axes (see fixture),
    hysteresis with temperature and its rate (see imu), saturation before the filter.
    Source: IEEE 1293 (terms); IEEE 2700; own behavioural form.
    """

    version = "1.0.0"

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    simulates = (turned("mount", ("accelerometer.mount.1", "accelerometer.mount.2", "accelerometer.mount.3")),)
    mount = Rotation("rows: accelerometer axes x, y, z in head axes")
    axes = Parameter(UNIT, "1", "rows: sensitive axes in accelerometer axes (misalignment)")
    scale = Parameter(NONE, "1", "relative errors of the scale factors", min=-0.1, max=0.1)
    scale_T = Parameter(0.0, "1/K", "change of the scale factor with temperature, relative")
    square = Parameter(0.0, "s2/m", "vibration rectification: bias per square of the specific force")
    cubic = Parameter(0.0, "s4/m2", "nonlinearity: relative change of the scale factor per square of the force")
    bias = Parameter(NONE, "m/s2", "bias of each axis")
    bias_T = Parameter(NONE, "m/s2/K", "change of the bias with temperature")
    turn_on = Noise(0.0, "m/s2", "rms of the turn-on bias, one value a run", per="start", samples=3)
    flicker_tau = Parameter(1e5, "s", "longest correlation time of the flicker", above=0.0)
    x = AxisDrift()
    y = AxisDrift()
    z = AxisDrift()
    white = Noise(70.0 * UG, "m/s2/sqrt(Hz)", "white noise density N (100 ug/sqrt(Hz) one-sided)", samples=3)
    bandwidth = Parameter(50.0, "Hz", "frequency at which the filter has 3 dB", above=0.0)
    range_max = Parameter(8.0 * G0, "m/s2", "largest specific force (8 g); 0: no limit", min=0.0)
    period = Parameter(0.0, "s", "time between two output samples; 0: every step", min=0.0)
    resolution = Parameter(0.0, "m/s2", "step of the output word; 0: none", min=0.0)

    f = Input([0.0, 0.0, G0], "m/s2", "specific force a - G, head axes")
    temperature = Input(0.0, "K", "mean temperature above that of the coefficients")

    f_read = Output("m/s2", "measured specific force along x, y, z", shape=(3,))
    density = Output("m/s2/sqrt(Hz)", "density N of the white noise (velocity random walk)")
    saturated = Output("1", "1 while a specific force is beyond the range")

    filtered = State(NONE, "m/s2", "filtered specific force")
    slope = State(NONE, "m/s3", "its derivative")
    measured = Discrete(NONE, "m/s2", "measured specific force")
    beyond = Discrete(0.0, "1", "1 while a specific force is beyond the range")
    number = Discrete(-1.0, "1", "number of the output sample")

    def start(self) -> None:
        for j in range(3):
            size = sqrt(vector(self.axes[j]) @ self.axes[j])
            self.refuse(size < 0.9 or size > 1.1, "axes: each row must be a unit vector within 10 %")
        self.filtered = self.sensed()

    def sensed(self) -> Vector:
        """Return the specific forces of the axes without white noise."""
        a = self.axes @ (self.mount @ self.f)
        x = self.x_flicker_value + self.x_walk_value
        y = self.y_flicker_value + self.y_walk_value
        z = self.z_flicker_value + self.z_walk_value
        out = self.bias + self.temperature * self.bias_T + self.noise.turn_on + vector([x, y, z])
        for j in range(3):
            grown = 1.0 + self.scale[j] + self.scale_T * self.temperature
            out[j] = out[j] + (grown + (self.square + self.cubic * a[j]) * a[j]) * a[j]
        return vector(out)

    def flow(self) -> None:
        s = self.sensed() + self.noise.white
        for j in range(3):
            self.der.filtered[j] = self.slope[j]
            self.der.slope[j] = butterworth(s[j], self.filtered[j], self.slope[j], self.bandwidth)

    @sampled(every=1)
    def tick(self) -> None:
        due = 1.0
        if self.period > 0.0:
            count = sample_number(self.t, self.period)
            due = 1.0 if count > self.number else 0.0
            self.number = count
        if due > 0.5:
            self.measured = self.filtered
            self.beyond = 0.0
            for j in range(3):
                if self.range_max > 0.0 and fabs(self.measured[j]) > self.range_max:
                    self.beyond = 1.0
                    self.measured[j] = sign(self.measured[j]) * self.range_max
                if self.resolution > 0.0:
                    self.measured[j] = word(self.measured[j], self.resolution)

    def outputs(self) -> None:
        self.f_read = self.measured
        self.density = self.white
        self.saturated = self.beyond
