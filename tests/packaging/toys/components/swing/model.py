from __future__ import annotations

from gyrobench.component import Component, Input, Output, Parameter, State
from gyrobench.component.math import sin


class Swing(Component):
    """Driven pendulum, integrated by RK4 with one substep, so that its order can be measured."""

    integrator = "rk4"
    rk4_substeps = 1

    step = Parameter(1.0, "s", "largest internal step", above=0.0)
    w = Parameter(3.0, "rad/s", "small-angle frequency")
    u = Input(0.0, "rad/s2", "drive")
    angle = State(1.0, "rad", "angle")
    rate = State(0.0, "rad/s", "rate")
    y = Output("rad", "angle")

    def flow(self) -> None:
        self.der.angle = self.rate
        self.der.rate = self.u - self.w * self.w * sin(self.angle) + sin(5.0 * self.t)

    def outputs(self) -> None:
        self.y = self.angle
