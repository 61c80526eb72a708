from __future__ import annotations

from gyrobench.component import Component, Input, Output, Parameter, sampled
from gyrobench.component.blocks.command import ERU, CountCommand, SampleClock


class TableCommand(Component):
    """Command of a table axis: synchronous rate and position as cumulative counts.  [TABLE-RATE, TABLE-POSITION]

    Mode and target go to :class:`CountCommand` once every `period`: 0 hold, 1 index to the angle `target`, 2 turn at
    the rate `target`, which is rounded to steps of 0.01 ERU.  A command acts one period after the sample that reads it.
    The acceleration is limited so that a deadbeat loop does not saturate the motor at a change of rate:
    acceleration <= M_max / (2.5 J).

    Not modelled: jitter and drift of the external time base.
    Source: Hu 1981, sections 5.4 (two-2), 6.1; acceleration limit: own design.
    """

    version = "1.0.0"

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    period = Parameter(5e-3, "s", "period of the count, a multiple of the communication step", min=1e-5, max=1.0)
    angle0 = Parameter(0.0, "rad", "reference angle at the start")
    J = Parameter(2.56, "kg.m2", "table inertia, for the acceleration limit", above=0.0)
    M_max = Parameter(9.80665, "N.m", "largest torque of the motor (1 kg.m), for the acceleration limit", above=0.0)

    mode = Input(0.0, "1", "0 hold, 1 index to the target angle, 2 turn at the target rate")
    target = Input(0.0, "1", "angle (rad) or rate (rad/s), by mode")
    way = Input(0.0, "1", "way of an index move: 1 shorter, 2 upwards, 3 downwards; 0: reference_way")
    move_rate = Input(0.0, "rad/s", "largest rate of an index move; 0: reference_index_rate")

    count = Output("1", "cumulative command count")
    angle = Output("rad", "reference angle, exact")
    rate = Output("rad/s", "reference rate")
    acc = Output("rad/s2", "reference acceleration over the coming period")
    arrived = Output("1", "1 when the reference has reached its target")

    clock = SampleClock(period="period")
    reference = CountCommand(
        period="period", rate_step=Parameter(0.01 * ERU, "rad/s", "step of the rate (0.01 ERU); 0: none", min=0.0)
    )

    def start(self) -> None:
        self.refuse(
            self.reference_acceleration > self.M_max / (2.5 * self.J) * (1.0 + 1e-12),
            "reference_acceleration = {reference_acceleration} rad/s2 saturates the motor at a change of rate: at most "
            "M_max / (2.5 J) with M_max = {M_max} N.m, J = {J} kg.m2",
        )
        self.reference.rest(self.angle0)

    @sampled(every=1)
    def tick(self) -> None:
        self.clock.tick()
        if self.clock_due == 1.0:
            unknown = not (self.way == 0.0 or self.way == 1.0 or self.way == 2.0 or self.way == 3.0)
            self.refuse(unknown, "way = {way} must be 0, 1 shorter, 2 upwards or 3 downwards")
            self.refuse(
                self.move_rate < 0.0 or self.move_rate > self.reference_rate_max,
                "move_rate = {move_rate} rad/s must be 0 to reference_rate_max = {reference_rate_max} rad/s",
            )
            way = self.way if self.way > 0.0 else self.reference_way
            rate = self.move_rate if self.move_rate > 0.0 else self.reference_index_rate
            self.reference.advance(self.mode, self.target, way, rate)

    def outputs(self) -> None:
        f = self.clock_waited * self.h / self.period  # share of the period that is over
        self.count = self.reference.count_after(f)
        self.angle = self.reference.angle_after(f)
        self.rate = self.reference.rate_after(f)
        self.acc = self.reference.acc()
        taken = self.mode == self.reference_mode_last and self.target == self.reference_target_last
        self.arrived = self.reference_arrived if taken else 0.0  # a command that is still to be read is not reached
