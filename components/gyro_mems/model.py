from __future__ import annotations

from gyrobench.component import Discrete, Noise, Parameter, sampled
from gyrobench.component.blocks.rate_gyro import DEG, FilteredRateGyro
from gyrobench.component.math import Vector, clip, sqrt, vector


class GyroMems(FilteredRateGyro):
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

    way = Discrete([0.0, 0.0], "1", "-1 ... 1: how far through the hysteresis")
    before = Discrete([0.0, 0.0], "rad/s", "rate of the step before")

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
        self.filter_rates(self.sensed() + self.noise.white)

    @sampled(every=1)
    def tick(self) -> None:
        for j in range(2):
            now = vector(self.axes[j]) @ (self.mount @ self.omega)
            self.way[j] = clip(self.way[j] + 2.0 * (now - self.before[j]) / self.hysteresis_width, -1.0, 1.0)
            self.before[j] = now
        self.read_out()

    def outputs(self) -> None:
        self.density = self.white
