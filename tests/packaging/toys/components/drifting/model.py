from __future__ import annotations

from gyrobench.component import Component, Output, Parameter
from gyrobench.component.blocks.random_drift import Flicker, Quantization, RateRandomWalk


class Drifting(Component):
    """The blocks of random drift and nothing else."""

    step = Parameter(1e9, "s", "largest internal step", above=0.0)
    flicker = Flicker("rad/s", "drift")
    walk = RateRandomWalk("rad/s", "rad/s2/sqrt(Hz)", "drift")
    quantization = Quantization("drift")
    a = Output("rad/s", "flicker")
    b = Output("rad/s", "walk")
    c = Output("rad/s", "quantization")

    def outputs(self) -> None:
        self.a = self.flicker_value
        self.b = self.walk_value
        self.c = self.quantization_rate
