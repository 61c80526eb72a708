"""Common parts of estimators: sampling clock, outputs of Kalman filters, the test of an autoregressive model."""

from __future__ import annotations

from gyrobench.component.component import Component
from gyrobench.component.composition import sampled
from gyrobench.component.declarations import Discrete, Input, Output, Parameter
from gyrobench.component.math import Number, Vector, exp, fabs, floor, index, pi, sqrt

ZERO = [0.0, 0.0, 0.0, 0.0, 0.0]


class SampledEstimator(Component):
    """One reading z every Ts, at the ends of the communication steps k Ts, k = 1, 2 ... from the start.

    `reading` is 1 in the step in which one is due; the parts take it in a sampled method of their own, which runs after
    the clock.  valid = 0 marks a reading that is missing.
    """

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    Ts = Parameter(1e-3, "s", "sampling period, a whole multiple of the communication step", above=0.0)

    z = Input(0.0, "1", "reading")
    valid = Input(1.0, "1", "0: this reading is missing")

    estimate = Output("1", "estimate, unit of z")

    coupling = Discrete(0.0, "s", "communication step that `every` holds for")
    every = Discrete(1.0, "1", "communication steps in a sampling period")
    due = Discrete(1.0, "1", "communication steps until the next reading")
    reading = Discrete(0.0, "1", "1 in the step in which a reading is due")

    @sampled(every=1)
    def clock(self) -> None:
        if fabs(self.h - self.coupling) > 1e-9 * self.h:
            self.coupling = self.h
            self.every = floor(self.Ts / self.h + 0.5)
            self.due = self.every
            self.refuse(
                self.every < 0.5 or fabs(self.every * self.h - self.Ts) > 1e-6 * self.Ts,
                "Ts = {Ts} s must be a whole multiple of the communication step, {coupling} s",
            )
        self.due = self.due - 1.0
        self.reading = 0.0
        if self.due < 0.5:
            self.due = self.every
            self.reading = 1.0


class KalmanEstimator(SampledEstimator):
    """Outputs of a Kalman filter besides its estimate."""

    variance = Output("1", "variance of the estimate, as the filter has it")
    innovation = Output("1", "reading less its prediction; 0 where the reading is missing")
    nis = Output("1", "innovation squared over its variance; 0 where the reading is missing")

    y = Discrete(0.0, "1", "last innovation")
    e = Discrete(0.0, "1", "last innovation squared over its variance")

    def outputs(self) -> None:
        self.innovation = self.y
        self.nis = self.e


class RateFilter(KalmanEstimator):
    """Kalman filter of a rate that wanders, its prediction and its update: value and slope, or a level alone."""

    q = Parameter(0.5, "1/s3", "density of the white noise that drives the slope, (unit of z)2/s3", min=0.0)
    walk = Parameter(0.0, "1/s", "density of the white noise that drives the value, (unit of z)2/s", min=0.0)
    R = Parameter(2.699449e-6, "1", "variance of the noise of one reading, (unit of z)2", above=0.0)
    P0 = Parameter(1.0, "1", "variance of the value at the start, (unit of z)2", min=0.0)
    P0_slope = Parameter(1.0, "1/s2", "variance of the slope at the start, (unit of z)2/s2", min=0.0)

    x = Discrete(0.0, "1", "value")
    v = Discrete(0.0, "1/s", "slope")
    P_xx = Discrete(0.0, "1", "variance of the value")
    P_xv = Discrete(0.0, "1/s", "covariance of value and slope")
    P_vv = Discrete(0.0, "1/s2", "variance of the slope")

    def start(self) -> None:
        self.x = 0.0
        self.v = 0.0
        self.P_xx = self.P0
        self.P_xv = 0.0
        self.P_vv = self.P0_slope

    def predict(self) -> None:
        T = self.Ts
        self.x = self.x + T * self.v
        self.P_xx = self.P_xx + T * (2.0 * self.P_xv + T * self.P_vv) + self.q * T * T * T / 3.0 + self.walk * T
        self.P_xv = self.P_xv + T * self.P_vv + 0.5 * self.q * T * T
        self.P_vv = self.P_vv + self.q * T
        self.y = 0.0
        self.e = 0.0

    def judge(self) -> None:
        """Set innovation and nis of a reading."""
        self.y = self.z - self.x
        self.e = self.y * self.y / (self.P_xx + self.R)

    def update(self, R: Number) -> None:
        """Take the reading, with R for the variance of its noise."""
        variance = self.P_xx + R
        k = self.P_xx / variance
        g = self.P_xv / variance
        self.x = self.x + k * self.y
        self.v = self.v + g * self.y
        a = 1.0 - k
        xx = self.P_xx
        xv = self.P_xv
        self.P_xx = a * a * xx + k * k * R
        self.P_xv = a * (xv - g * xx) + k * g * R
        self.P_vv = self.P_vv - 2.0 * g * xv + g * g * xx + g * g * R

    def outputs(self) -> None:
        self.estimate = self.x
        self.variance = self.P_xx


def stationary(phi: Vector, p: Number, sense: Number) -> Number:
    """Return 1 where x_t = sense (phi_1 x_{t-1} + ... + phi_p x_{t-p}) + w_t is stationary, else 0.

    Levinson downwards: stationary if and only if every reflection coefficient is within -1 and 1.
    """
    f = [0.0, 0.0, 0.0, 0.0, 0.0]
    g = [0.0, 0.0, 0.0, 0.0, 0.0]
    for i in range(5):
        f[i] = sense * phi[i] if i < p else 0.0
    inside = 1.0
    for m in range(5):
        last = 4.0 - m  # place of the last coefficient
        k = f[4 - m]
        if fabs(k) >= 1.0:
            inside = 0.0
        if inside > 0.5:
            for i in range(5):
                g[i] = f[i]
            for i in range(5):
                if i < last:
                    f[i] = (g[i] + k * g[index(last - 1.0 - i)]) / (1.0 - k * k)
    return inside


def chi_square_gate(p: Number) -> Number:
    """Return the bound below which a chi-square variable of one degree of freedom lies with the probability p.

    The bound of its root t by halving: p = erf(t/sqrt 2) = sqrt(2/pi) e^(-t2/2) (t + t3/3 + t5/15 + t7/105 ...).
    """
    low = 0.0
    high = 7.0
    for _k in range(60):
        t = 0.5 * (low + high)
        term = t
        total = t
        for i in range(100):
            term = term * t * t / (2.0 * i + 3.0)
            total = total + term
        if sqrt(2.0 / pi) * exp(-0.5 * t * t) * total < p:
            low = t
        else:
            high = t
    return low * low
