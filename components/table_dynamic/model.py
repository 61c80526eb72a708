from __future__ import annotations

from gyrobench.component import IDENTITY, Input, Output, Parameter, sampled
from gyrobench.component.blocks.angle import IncrementalEncoder
from gyrobench.component.blocks.axis_body import BodyTable
from gyrobench.component.blocks.command import ARCSEC, RATE_MAX, CountCommand, SampleClock
from gyrobench.component.blocks.control import InPosition, SampledController
from gyrobench.component.blocks.drive import SquareLawMotor


class TableDynamic(BodyTable):
    """Turntable with one axis as it is built: counts, sampled controller, motor, moving part.  [CTRL-SAMPLED]

    Every `period` the command count goes on (CountCommand), the encoder is read (IncrementalEncoder), and the
    controller demands a torque from their difference (SampledController), which the motor gives to the moving part
    until the next sample (SquareLawMotor, AxisBody):

        J w' = M + M_load + pull - viscous (w - e) + friction ...        x' = w - e

    w inertial rate about the axis, e that of the base, pull of the unbalance.  It fits where table_rate does; beside
    the command it shows what a real table does: lag, jitter of the counts, response to friction and unbalance, errors
    of the scale.  angle_read is the encoder's count times the quantum.

    Not modelled: wobble, motion of the axis in its bearing, carrier and heating of the motor, acceleration of the
    mounted instrument (it stands on the axis), time of a change of mount.
    Source: Hu 1981, sections 5.4 (two-2), 5.5, 6.1; each block names its equations.
    """

    version = "1.0.0"

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
    M_load = Input(0.0, "N.m", "further torque on the table")

    in_position = Output("1", "1 when the target angle or rate is reached")
    e = Output("rad", "error at the last sample: command minus reading")
    torque = Output("N.m", "motor torque")
    saturated = Output("1", "1 while the demanded torque is limited")

    def start(self) -> None:
        self.command.rest(self.angle0)
        self.axis.rest(self.angle0, 0.0, self.earth())
        self.scale.latch(self.angle0)

    def flow(self) -> None:
        self.turn(self.motor_M_mean, self.M_load)

    @sampled(every=1)
    def tick(self) -> None:
        self.settle(self.motor_M, self.M_load)
        self.clock.tick()
        if self.clock_due == 1.0 or self.t > self.step_end - 0.5 * self.h:  # nobody sees the counts in between
            self.scale.latch(self.axis_x)
        self.law.wait()
        if self.clock_due == 1.0:
            self.command.advance(self.mode, self.target, self.command_way, self.index_rate)
            self.law.sample(self.command_count - self.scale_count, self.command.acc())
            self.near.judge(self.law_e, self.period)
        self.motor.advance(self.law_demand, self.axis_v)

    def outputs(self) -> None:
        self.angle_read = self.scale_count * self.quantum
        self.in_position = self.command_arrived * self.near_inside
        self.e = self.law_e
        self.torque = self.motor_M
        self.saturated = self.law_saturated
