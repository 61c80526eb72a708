"""Turntable with one axis as it is built: command counts, encoder, sampled controller, motor, moving part."""

from __future__ import annotations

from gyrobench.component.blocks.angle import IncrementalEncoder
from gyrobench.component.blocks.axis_body import BodyTable
from gyrobench.component.blocks.command import ARCSEC, RATE_MAX, CountCommand, SampleClock
from gyrobench.component.blocks.control import InPosition, SampledController
from gyrobench.component.blocks.drive import SquareLawMotor
from gyrobench.component.composition import sampled
from gyrobench.component.declarations import Input, Output, Parameter
from gyrobench.component.math import Number
from gyrobench.component.rotation import IDENTITY
from gyrobench.component.set_up import SCALE, SCALE_PHASE, harmonic


class BuiltTable(BodyTable):
    """Common part of the tables with one axis and a sampled controller.  [CTRL-SAMPLED]

    Every `period` the part's `sample` takes the error in counts to the controller (SampledController), whose demand
    the motor (SquareLawMotor) gives to the moving part (AxisBody) until the next sample.  A part gives

        sample()   takes a sample; `follow` is that of the count loop: command count less encoder count
        load()     further torque on the table, N.m
    """

    simulates = (harmonic(SCALE, SCALE_PHASE, ("angle.once", "angle.twice")),)

    step = Parameter(1e-4, "s", "largest internal step", above=0.0)
    period = Parameter(5e-3, "s", "sampling period of command and controller", min=1e-3, max=1e-2)
    quantum = Parameter(0.18 * ARCSEC, "rad", "angle of one count (0.18 arcsec)", above=0.0)
    acceleration = Parameter(1.0, "rad/s2", "acceleration of every move", above=0.0)
    index_rate = Parameter(0.1, "rad/s", "rate of an index move", above=0.0)
    rate_max = Parameter(RATE_MAX, "rad/s", "largest rate that may be commanded (1999.9 ERU)", above=0.0)

    clock = SampleClock(period="period")
    command = CountCommand(
        period="period", quantum="quantum", acceleration="acceleration", index_rate="index_rate", rate_max="rate_max"
    )
    law = SampledController(period="period", quantum="quantum")
    near = InPosition()
    motor = SquareLawMotor()
    scale = IncrementalEncoder(quantum="quantum")

    mode = Input(0.0, "1", "0 hold, 1 index, 2 rate")
    target = Input(0.0, "1", "angle in rad (index) or rate in rad/s (rate)")
    face = Input(IDENTITY, "1", "mount: rows are the gyro axes in table axes")

    in_position = Output("1", "1 when the target angle or rate is reached")
    e = Output("rad", "error at the last sample: command minus reading")
    saturated = Output("1", "1 while the demanded torque is limited")

    def start(self) -> None:
        self.command.rest(self.angle0)
        self.axis.rest(self.angle0, 0.0, self.earth())
        self.scale.latch(self.angle0)

    def load(self) -> Number:
        return 0.0

    def sample(self) -> None:
        self.follow()

    def follow(self) -> None:
        """Take a sample of the count loop."""
        self.command.advance(self.mode, self.target, self.command_way, self.index_rate)
        self.law.sample(self.command_count - self.scale_count, self.command.acc())

    def flow(self) -> None:
        self.turn(self.motor_M_mean, self.load())

    @sampled(every=1)
    def tick(self) -> None:
        self.settle(self.motor_M, self.load())
        self.clock.tick()
        if self.clock_due == 1.0 or self.t > self.step_end - 0.5 * self.h:  # nobody sees the counts in between
            self.scale.latch(self.axis_x)
        self.law.wait()
        if self.clock_due == 1.0:
            self.sample()
            self.near.judge(self.law_e, self.period)
        self.motor.advance(self.law_demand, self.axis_v)

    def outputs(self) -> None:
        self.angle_read = self.scale_count * self.quantum
        self.in_position = self.command_arrived * self.near_inside
        self.e = self.law_e
        self.saturated = self.law_saturated
