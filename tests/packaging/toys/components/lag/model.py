from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Noise, Output, Parameter, State, sampled
from gyrobench.component.math import atan2, clip, cos, exp, fabs, index, sin, sqrt, tanh

GAIN = 2.5


class Lag(Component):
    """Everything a part can have: arrays, noise of each kind, types, helpers, ticks, refusals."""

    version = "1.2.3"

    tau = Parameter(2e-3, "s", "time constant", above=0.0)
    mix = Parameter([[1.0, 0.5], [0.0, 1.0]], "1", "mixing matrix")
    limit = Parameter(50.0, "1", "limit", min=0.0, max=100.0)
    part_of = Parameter(0.5, "1", "less than one", below=1.0)
    k = Parameter(2, int, "which column", min=1, max=2)
    on = Parameter(True, bool, "noise on")
    wrong = Parameter(0.0, "1", "more than 1 is refused")
    late = Parameter(1e9, "s", "refused after this time")

    white = Noise(0.1, "1/sqrt(Hz)", "white")
    each = Noise(0.3, "1", "one a step", per="step")
    once = Noise(0.3, "1", "one a run", per="start")

    u = Input([0.0, 0.0], "1", "inputs")

    x = State(0.1, "1", "scalar state")
    v = State([0.0, 0.0], "1", "array of states")

    q = Discrete(0.0, "1", "remembers")
    turns = Discrete(0.0, "1", "ticks so far")

    y = Output("1", "outputs", shape=(2,))
    direct = Output("1", "follows u[1] without delay")
    count = Output(int, "ticks")
    high = Output(bool, "x above 0.5")

    def gain(self, a, b):
        if a > b:
            return a * b
        return sin(a) + cos(b) * GAIN

    def start(self) -> None:
        self.q = self.noise.once
        self.turns = 0.0
        self.refuse(self.wrong > 1.0, "wrong = {wrong} is above 1 (100 %)")

    def flow(self) -> None:
        m = [0.0, 0.0]
        for i in range(2):
            for j in range(2):
                m[i] += self.mix[i][j] * self.u[j]
        self.der.x = self.v[0] + m[1] / 2
        push = self.noise.white if self.on else 0.0
        pull = -2.0 * self.v[0] / self.tau + self.gain(self.x, self.v[1])
        self.der.v[0] = (m[0] - self.x + push) / (self.tau * self.tau) + pull
        bend = clip(self.x, -1, 1) + atan2(self.x, 2.0 + self.v[1]) + tanh(self.v[0]) + exp(-fabs(self.x))
        self.der.v[1] = -self.v[1] * (1 if self.x > 0 else 2) + bend

    @sampled(every=2)
    def tick(self) -> None:
        self.turns = self.turns + 1.0
        self.q = 0.9 * self.q + self.noise.each
        self.refuse(self.t > self.late, "after {late} s")

    def outputs(self) -> None:
        self.y[0] = self.x + self.noise.white + self.q
        self.y[1] = sqrt(1.0 + self.x * self.x) + self.mix[0][index(self.k) - 1]
        self.direct = 3.0 * self.u[0] - self.x
        self.count = self.turns
        self.high = self.x > 0.5
