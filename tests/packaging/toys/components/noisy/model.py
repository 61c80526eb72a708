from __future__ import annotations

from gyrobench.component import Component, Noise, Output, Parameter


class Noisy(Component):
    """Noise and nothing else."""

    step = Parameter(1.0, "s", "largest internal step", above=0.0)
    first = Noise(0.2, "V/sqrt(Hz)", "white")
    second = Noise(0.2, "V/sqrt(Hz)", "white")
    each = Noise(0.5, "V", "one a step", per="step")
    once = Noise(0.5, "V", "one a run", per="start")
    three = Noise(0.5, "V/sqrt(Hz)", "three independent ones", samples=3)
    a = Output("V", "first")
    b = Output("V", "second")
    c = Output("V", "each")
    d = Output("V", "once")

    e = Output("V", "of three", shape=(3,))

    def outputs(self) -> None:
        self.a = self.noise.first
        self.b = self.noise.second
        self.c = self.noise.each
        self.d = self.noise.once
        self.e = self.noise.three
