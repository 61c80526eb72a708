from __future__ import annotations

from gyrobench.component import Discrete, Noise, Output, Parameter, State, sampled
from gyrobench.component.blocks.mems import butterworth, sample_number, word
from gyrobench.component.blocks.rate_gyro import RateGyro
from gyrobench.component.math import Vector, clip, pi, sqrt, vector

DEG = pi / 180.0


class GyroMems(RateGyro):
    """Two-axis rate gyro as a data sheet describes it: noise, bias instability, filter, range, word.  [GYRO-MEMS]

        s_j = scaled rate along row j of axes + cubic w3 + hysteresis z + drift_j + white,  z: a play within -1 ... 1
        y'' = wn2 (s - y) - sqrt(2) wn y',   wn = 2 pi bandwidth                              Butterworth, second order
        rate = y within +-range_max, sampled every `period`, in steps of `resolution`

    white: two-sided density N, the angle random walk; a data sheet's noise density is one-sided, N sqrt(2).
    Refused: axes that are not unit vectors within 10 %.
    Not modelled: the resonator (drive, quadrature, mode split), delay beyond the filter, vibration rectification.
    Source: IEEE 2700; IEEE 1431; own behavioural form.
    """

    version = "1.0.0"
    white_noise = "white"

    axes = Parameter([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], "1", "rows: sensitive axes in gyro axes (misalignment)")
    cubic = Parameter(0.0, "s2/rad2", "nonlinearity: relative change of the scale factor per rate squared")
    hysteresis = Parameter(0.0, "rad/s", "reading of a rate that rose, less the mean of both ways", min=0.0)
    hysteresis_width = Parameter(DEG, "rad/s", "rate change that goes through the hysteresis (1 deg/s)", above=0.0)
    white = Noise(0.035 * DEG, "rad/s/sqrt(Hz)", "white noise density N (0.05 deg/s/sqrt(Hz) one-sided)", samples=2)
    bandwidth = Parameter(50.0, "Hz", "frequency at which the filter has 3 dB", above=0.0)
    range_max = Parameter(300.0 * DEG, "rad/s", "largest rate (300 deg/s); 0: no limit", min=0.0)
    period = Parameter(0.0, "s", "time between two output samples; 0: every step", min=0.0)
    resolution = Parameter(0.0, "rad/s", "step of the output word; 0: none", min=0.0)

    density = Output("rad/s/sqrt(Hz)", "density N of the white noise (angle random walk)")

    y = State([0.0, 0.0], "rad/s", "filtered rate")
    v = State([0.0, 0.0], "rad/s2", "its derivative")
    way = Discrete([0.0, 0.0], "1", "-1 ... 1: how far through the hysteresis")
    before = Discrete([0.0, 0.0], "rad/s", "rate of the step before")
    number = Discrete(-1.0, "1", "number of the output sample")

    def start(self) -> None:
        for j in range(2):
            size = sqrt(vector(self.axes[j]) @ self.axes[j])
            self.refuse(size < 0.9 or size > 1.1, "axes: each row must be a unit vector within 10 %")
        for j in range(2):
            self.before[j] = vector(self.axes[j]) @ (self.mount @ self.omega)
        self.y = self.sensed()

    def sensed(self) -> Vector:
        """Return the rates of both axes without white noise."""
        w = self.mount @ self.omega
        leaning = vector([vector(self.axes[0]) @ w, vector(self.axes[1]) @ w])
        out = self.scaled(leaning, self.temperature) + self.drift_rates(self.temperature)
        for j in range(2):
            out[j] = out[j] + self.cubic * leaning[j] * leaning[j] * leaning[j] + self.hysteresis * self.way[j]
        return vector(out)

    def flow(self) -> None:
        s = self.sensed() + self.noise.white
        for j in range(2):
            self.der.y[j] = self.v[j]
            self.der.v[j] = butterworth(s[j], self.y[j], self.v[j], self.bandwidth)

    @sampled(every=1)
    def tick(self) -> None:
        for j in range(2):
            now = vector(self.axes[j]) @ (self.mount @ self.omega)
            self.way[j] = clip(self.way[j] + 2.0 * (now - self.before[j]) / self.hysteresis_width, -1.0, 1.0)
            self.before[j] = now
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

    def outputs(self) -> None:
        self.density = self.white
