from __future__ import annotations

from gyrobench.component import IDENTITY, Discrete, Input, Output, Parameter, sampled
from gyrobench.component.blocks.table import SegmentMotion, TwoAxisTable
from gyrobench.component.math import Number, fabs, floor, index, sin, vector
from gyrobench.component.set_up import harmonic


class TableTwoAxis(TwoAxisTable):
    """Turntable with an outer axis X and an inner axis Y, kinematic: each holds, goes to an angle or turns at a rate.

    Each axis moves as that of table_rate: from a change of its command on, five segments of constant acceleration in
    closed form (0 hold: brake and stay; 1 index: to an angle; 2 rate).  Attitude, rates and forces on the plate: block
    TwoAxisTable.  Each axis reads

        q_read = q + a_1 sin(q + p_1) + a_2 sin(2 q + p_2), rounded to the quantum

    Not modelled: servo error and bandwidth, bearing torque, sag under load, encoder errors of other orders,
    acceleration of the mounted instrument (it stands where the axes meet), time of a change of mount.
    Source: Hu 1981, eq. 3-47, 3-94..3-99, section 5.4; frames: CONV-FRAMES, TUM2AX-GEOM, SERVO2-A.
    """

    version = "1.0.0"

    angle0 = Parameter([0.0, 0.0], "rad", "outer and inner angle at the start")
    acceleration = Parameter([0.1, 0.1], "rad/s2", "acceleration of every move", above=0.0)
    index_rate = Parameter([0.1, 0.1], "rad/s", "rate of an index move", above=0.0)
    rate_max = Parameter([10.0, 10.0], "rad/s", "largest rate that may be commanded", above=0.0)
    limits_y = Parameter([-1e9, 1e9], "rad", "lowest and highest inner angle")
    simulates = tuple(
        harmonic(("encoder_amplitude",), ("encoder_phase",), (f"{axis}.angle.once", f"{axis}.angle.twice"), row)
        for row, axis in enumerate(("outer", "inner"))
    )
    encoder_amplitude = Parameter([[0.0, 0.0], [0.0, 0.0]], "rad", "encoder error; rows: axes, columns: orders 1 and 2")
    encoder_phase = Parameter([[0.0, 0.0], [0.0, 0.0]], "rad", "their phases at angle 0")
    quantum = Parameter(0.0, "rad", "quantum of both readings; 0: none", min=0.0)

    mode_x = Input(0.0, "1", "outer axis: 0 hold, 1 index, 2 rate")
    target_x = Input(0.0, "1", "outer axis: angle in rad (index) or rate in rad/s (rate)")
    mode_y = Input(0.0, "1", "inner axis: 0 hold, 1 index, 2 rate")
    target_y = Input(0.0, "1", "inner axis: angle in rad (index) or rate in rad/s (rate)")
    face = Input(IDENTITY, "1", "mount: rows are the gyro axes in plate axes")

    in_position = Output("1", "1 when both targets are reached")

    outer = SegmentMotion()
    inner = SegmentMotion()
    asked = Discrete(0.0, "1", "mode, target or angle under check")
    axis = Discrete(0.0, "1", "axis under check: 1 outer, 2 inner")

    def start(self) -> None:
        self.refuse(self.limits_y[0] >= self.limits_y[1], "limits_y: the lower must be below the upper")
        self.refuse(
            self.angle0[1] < self.limits_y[0] or self.angle0[1] > self.limits_y[1], "angle0[2] is outside limits_y"
        )
        self.outer.rest(self.angle0[0])
        self.inner.rest(self.angle0[1])

    def check(self, axis: Number, mode: Number, target: Number, rate_max: Number) -> None:
        """Refuse a command that the axis cannot follow."""
        self.axis = axis
        self.asked = mode
        self.refuse(
            not (mode == 0.0 or mode == 1.0 or mode == 2.0),
            "axis {axis} (1 outer, 2 inner): mode = {asked} must be 0 hold, 1 index or 2 rate",
        )
        self.asked = target
        self.refuse(
            mode == 2.0 and fabs(target) > rate_max,
            "axis {axis} (1 outer, 2 inner): rate {asked} rad/s exceeds its rate_max",
        )
        self.refuse(
            mode == 1.0 and axis == 2.0 and (target < self.limits_y[0] or target > self.limits_y[1]),
            "inner axis: target {asked} rad is outside limits_y",
        )

    @sampled(every=1)
    def tick(self) -> None:
        if self.outer.commanded(self.mode_x, self.target_x):
            self.check(1.0, self.mode_x, self.target_x, self.rate_max[0])
            self.outer.plan(self.mode_x, self.target_x, self.acceleration[0], self.index_rate[0])
        if self.inner.commanded(self.mode_y, self.target_y):
            self.check(2.0, self.mode_y, self.target_y, self.rate_max[1])
            self.inner.plan(self.mode_y, self.target_y, self.acceleration[1], self.index_rate[1])
        self.outer.advance()
        self.inner.advance()
        self.asked = self.inner.x
        self.refuse(
            self.inner.x < self.limits_y[0] or self.inner.x > self.limits_y[1],
            "inner axis: {asked} rad is beyond limits_y, it has run against its stop",
        )

    def indicated(self, axis: Number, angle: Number) -> Number:
        """Return the angle as the encoder of the axis (0 outer, 1 inner) reads it."""
        seen = angle
        for k in range(2):
            size = self.encoder_amplitude[index(axis)][k]
            if size != 0.0:
                seen = seen + size * sin((k + 1) * angle + self.encoder_phase[index(axis)][k])
        return self.quantum * floor(seen / self.quantum + 0.5) if self.quantum > 0.0 else seen

    def outputs(self) -> None:
        self.place(
            vector([self.outer.x, self.inner.x]),
            vector([self.outer.v, self.inner.v]),
            vector([self.outer.a, self.inner.a]),
        )
        self.angle_x_read = self.indicated(0.0, self.outer.x)
        self.angle_y_read = self.indicated(1.0, self.inner.x)
        self.in_position = self.outer.arrived * self.inner.arrived
