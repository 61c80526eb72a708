from __future__ import annotations

from gyrobench.component import Discrete, Output, Parameter, sampled
from gyrobench.component.blocks.estimator import SampledEstimator


class EstimatorAlphaBetaGamma(SampledEstimator):
    """Tracking filter of fixed gains for value, slope and curvature of a signal.

        x- = x + T v + T2 a / 2,   v- = v + T a,   a- = a          T = Ts, T2 = T T
        y  = z - x-
        x  = x- + alpha y,   v = v- + (beta / T) y,   a = a- + (gamma / (2 T2)) y

    gamma = 0 with a = 0 is the alpha-beta filter.  Stable, and otherwise refused, for

        0 < alpha < 2,   0 < beta < 4 - 2 alpha,   0 <= gamma < 4 alpha beta / (2 - alpha)      (beta = gamma = 0 too)

    The default gains are those of the critically damped filter (three poles at theta = 0.95, fading memory)

        alpha = 1 - theta3,   beta = 1.5 (1 - theta)2 (1 + theta),   gamma = 2 (1 - theta)3

    It follows a parabola without error, so its latency is 0 for slow signals; at higher frequencies it overshoots.
    The first reading starts it (x = z, v = a = 0).  A reading with valid = 0 is left out: it predicts only.

    Not modelled: gains that change with time (see estimator_kalman_rate), limits of the states.
    Source: Benedict 1962; stability: Tenne 2002.  Comparison filter of BENCH-DYN-SINE.
    """

    version = "1.0.0"

    alpha = Parameter(0.142625, "1", "gain of the value")
    beta = Parameter(0.0073125, "1", "gain of the slope")
    gamma = Parameter(0.00025, "1", "gain of the curvature")

    innovation = Output("1", "reading less its prediction; 0 where the reading is missing")
    latency = Output("s", "delay of the estimate")

    begun = Discrete(0.0, "1", "1 once a reading was there")
    x = Discrete(0.0, "1", "value")
    v = Discrete(0.0, "1/s", "slope")
    a = Discrete(0.0, "1/s2", "curvature")
    y = Discrete(0.0, "1", "last innovation")

    def start(self) -> None:
        self.refuse(not 0.0 < self.alpha < 2.0, "alpha = {alpha} must be between 0 and 2: the filter is unstable")
        plain = self.beta == 0.0 and self.gamma == 0.0
        self.refuse(
            not plain and not 0.0 < self.beta < 4.0 - 2.0 * self.alpha,
            "beta = {beta} must be between 0 and 4 - 2 alpha: the filter is unstable",
        )
        self.refuse(
            self.gamma != 0.0 and not 0.0 < self.gamma < 4.0 * self.alpha * self.beta / (2.0 - self.alpha),
            "gamma = {gamma} must be at least 0 and below 4 alpha beta / (2 - alpha): the filter is unstable",
        )

    @sampled(every=1)
    def tick(self) -> None:
        if self.reading > 0.5:
            if self.begun == 0.0:
                if self.valid > 0.5:
                    self.begun = 1.0
                    self.x = self.z
            else:
                self.x = self.x + self.Ts * (self.v + 0.5 * self.Ts * self.a)
                self.v = self.v + self.Ts * self.a
                self.y = 0.0
                if self.valid > 0.5:
                    self.y = self.z - self.x
                    self.x = self.x + self.alpha * self.y
                    self.v = self.v + self.beta / self.Ts * self.y
                    self.a = self.a + 0.5 * self.gamma / (self.Ts * self.Ts) * self.y

    def outputs(self) -> None:
        self.estimate = self.x
        self.innovation = self.y
        self.latency = 0.0
