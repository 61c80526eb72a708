from __future__ import annotations

from gyrobench.component import Component, Input, Output, Parameter, sampled
from gyrobench.component.blocks.command import SampleClock
from gyrobench.component.blocks.control import InPosition, SampledController


class ControllerSampled(Component):
    """Sampled controller of a table axis: counts in, torque demand out.  [CTRL-SAMPLED]

    Once every `period` the law of :class:`SampledController` runs on the difference of two cumulative counts; the
    demand is held (zero order) and acts after `delay`.  enable = 0 opens the loop and clears the history, preset = 1
    begins with the present error.  in_position is 1 once the error has stayed within the window.

    Not modelled: word length of the processor beyond the counts.
    Source: Hu 1981, eq. 6-10..6-19 with ET22; softer poles, delay and feedforward: own design.
    """

    version = "1.1.0"

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    period = Parameter(5e-3, "s", "sampling period T, a multiple of the communication step", min=1e-3, max=1e-2)

    count_command = Input(0.0, "1", "cumulative command count")
    count = Input(0.0, "1", "cumulative count of the angle reader")
    acc_command = Input(0.0, "rad/s2", "reference acceleration over the coming period")
    enable = Input(1.0, "1", "1 closes the loop")
    preset = Input(0.0, "1", "1 sets the history to the present error and no torque")

    demand = Output("N.m", "demanded torque")
    e = Output("rad", "error at the last sample: command minus reading")
    in_position = Output("1", "1 while the error has stayed within the window")
    saturated = Output("1", "1 while the demanded torque is limited")

    clock = SampleClock(period="period")
    law = SampledController(period="period")
    near = InPosition()

    @sampled(every=1)
    def tick(self) -> None:
        self.clock.tick()
        self.law.wait()
        if self.enable == 0.0:
            self.law.hold()
        elif self.clock_due == 1.0:
            if self.preset == 1.0:
                self.law.preset(self.count_command - self.count)
            self.law.sample(self.count_command - self.count, self.acc_command)
            self.near.judge(self.law_e, self.period)

    def outputs(self) -> None:
        self.demand = self.law_demand
        self.e = self.law_e
        self.in_position = self.near_inside
        self.saturated = self.law_saturated
