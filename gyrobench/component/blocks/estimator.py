"""Common parts of estimators: sampling clock, outputs of Kalman filters, the test of an autoregressive model."""

from __future__ import annotations

from gyrobench.component.component import Component
from gyrobench.component.composition import sampled
from gyrobench.component.declarations import Discrete, Input, Output, Parameter
from gyrobench.component.math import Number, Vector, fabs, floor, index

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
