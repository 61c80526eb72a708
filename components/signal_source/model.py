from __future__ import annotations

from gyrobench.component import Component, Discrete, Noise, Output, Parameter, sampled
from gyrobench.component.math import exp, index, pi, sin, sqrt


class SignalSource(Component):
    """A gyro signal whose true value is known: a sine, random drift and reading noise.  [DRIFT-RANDOM-CLASSES]

        signal_k = offset + amplitude sin(2 pi frequency t_k + phase)
        x_k = phi_1 x_{k-1} + ... + phi_p x_{k-p} + w_k                              autoregressive
        r_k = r_{k-1} + walk_k                                                       random walk
        m_k = a m_{k-1} + sqrt(1 - a2) markov_k,   a = exp(-h / markov_tau)          Gauss-Markov
        drift_k = x_k (integrated = 1: x_1 + ... + x_k) + r_k + m_k
        truth = signal + drift,   z = truth + white_k  (times change_factor from change_time on)

    One sample each communication step h, at its end.  The sizes w, walk, markov and white are standard deviations of a
    sample, not densities: the series does not depend on h in seconds, as drift records are given by their samples.
    All processes begin at 0.  An ARIMA(p, 1, 0) is p coefficients and integrated = 1.

    phi is that of the line above (statsmodels); arburg returns a = -phi.  It may be explosive: that is the model's
    matter, and the run ends when a value is no longer finite.

    Not modelled: quantization, filter and jitter of an acquisition channel.
    Source: DRIFT-RANDOM-CLASSES, DRIFT-ARIMA310; Xia 2008, section 2.2.2.3, eq. 3.4.18.
    """

    version = "1.0.0"

    step = Parameter(1e9, "s", "largest internal step: one sample for each communication step", above=0.0)
    offset = Parameter(0.0, "1", "constant")
    amplitude = Parameter(0.0, "1", "amplitude of the sine")
    frequency = Parameter(1.0, "Hz", "its frequency", min=0.0)
    phase = Parameter(0.0, "rad", "its phase at t = 0")
    p = Parameter(0, int, "order of the autoregressive drift; 0: none", min=0, max=5)
    phi = Parameter([-0.7466, -0.5044, -0.2538, 0.0, 0.0], "1", "its coefficients, x_k = sum phi_i x_{k-i} + w_k")
    integrated = Parameter(0, int, "1: the drift is the sum of that process", min=0, max=1)
    w = Noise(0.0, "1", "standard deviation of w", per="step")
    walk = Noise(0.0, "1", "standard deviation of an increment of the random walk", per="step")
    markov = Noise(0.0, "1", "standard deviation of the Gauss-Markov drift", per="step")
    markov_tau = Parameter(100.0, "s", "its correlation time", above=0.0)
    white = Noise(1.643e-3, "1", "standard deviation of the noise of a reading", per="step")
    change_time = Parameter(1e9, "s", "time from which the noise of a reading is larger")
    change_factor = Parameter(1.0, "1", "so many times", min=0.0)

    z = Output("1", "reading")
    truth = Output("1", "what an estimator should find: signal and drift")
    signal = Output("1", "the sine and the constant")
    drift = Output("1", "the random drift")

    x = Discrete([0.0, 0.0, 0.0, 0.0, 0.0], "1", "last values of the autoregressive process")
    total = Discrete(0.0, "1", "their sum")
    r = Discrete(0.0, "1", "random walk")
    m = Discrete(0.0, "1", "Gauss-Markov drift")

    @sampled(every=1)
    def tick(self) -> None:
        new = self.noise.w
        for i in range(index(self.p)):
            new = new + self.phi[i] * self.x[i]
        for i in range(4):
            self.x[4 - i] = self.x[3 - i]
        self.x[0] = new
        self.total = self.total + new
        self.r = self.r + self.noise.walk
        a = exp(-self.h / self.markov_tau)
        self.m = a * self.m + sqrt(1.0 - a * a) * self.noise.markov

    def outputs(self) -> None:
        self.signal = self.offset + self.amplitude * sin(2.0 * pi * self.frequency * self.t + self.phase)
        self.drift = (self.total if self.integrated == 1.0 else self.x[0]) + self.r + self.m
        self.truth = self.signal + self.drift
        larger = self.change_factor if self.t >= self.change_time else 1.0
        self.z = self.truth + larger * self.noise.white
