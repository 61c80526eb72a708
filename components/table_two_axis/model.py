from __future__ import annotations

from gyrobench.component import IDENTITY, Component, Discrete, Input, Output, Parameter, Rotation, sampled
from gyrobench.component.blocks.table import SegmentMotion
from gyrobench.component.math import Number, cos, fabs, floor, index, sin, vector


class TableTwoAxis(Component):
    """Turntable with an outer axis X and an inner axis Y, kinematic: each holds, goes to an angle or turns at a rate.

    Each axis moves as that of table_rate: from a change of its command on, five segments of constant acceleration in
    closed form (0 hold: brake and stay; 1 index: to an angle; 2 rate).  Attitude of the plate, R passive rotations:

        v_face = face A base v_local
        A = Ry(y) Wy(y) Rz(squareness) Rx(x) Wx(x)                  [SERVO2-A, where there are no errors]

      base    rows: the axes X (outer), Y (inner at x = 0), Z in ENU at angles 0
      W       wobble of an axis: its two cross rotations amplitude cos(n q + phase), amplitude sin(n q + phase)

    so A = [[cy, sx sy, -cx sy], [0, cx, sx], [sy, -cy sx, cx cy]] without errors; the plate turned by +x right-handed
    about the outer axis, then by +y about the inner.  Rate and acceleration follow elementary rotation by elementary
    rotation (angle q about axis e) from those of the base:

        w <- R w + q' e        alpha <- R alpha - q' e x (R w) + q'' e        f <- R f

    omega is the exact derivative of the attitude and alpha that of omega, wobble included.  Each axis reads

        q_read = q + a_1 sin(q + p_1) + a_2 sin(2 q + p_2), rounded to the quantum

    Not modelled: servo error and bandwidth, bearing torque, sag under load, encoder errors of other orders,
    acceleration of the mounted instrument (it stands where the axes meet), time of a change of mount.
    Source: Hu 1981, eq. 3-47, 3-94..3-99, section 5.4; frames: CONV-FRAMES, TUM2AX-GEOM, SERVO2-A.
    """

    version = "1.0.0"

    base = Rotation("rows: outer axis X, inner axis Y at x = 0, and Z in ENU at angles 0")
    angle0 = Parameter([0.0, 0.0], "rad", "outer and inner angle at the start")
    acceleration = Parameter([0.1, 0.1], "rad/s2", "acceleration of every move", above=0.0)
    index_rate = Parameter([0.1, 0.1], "rad/s", "rate of an index move", above=0.0)
    rate_max = Parameter([10.0, 10.0], "rad/s", "largest rate that may be commanded", above=0.0)
    limits_y = Parameter([-1e9, 1e9], "rad", "lowest and highest inner angle")
    squareness = Parameter(0.0, "rad", "inner axis turned about Z out of the right angle", min=-0.1, max=0.1)
    wobble = Parameter([0.0, 0.0], "rad", "wobble amplitude of the outer and the inner axis", min=0.0, max=0.1)
    wobble_order = Parameter([2, 2], int, "its cycles per turn", min=1, max=1000)
    wobble_phase = Parameter([0.0, 0.0], "rad", "its phase at angle 0")
    encoder_amplitude = Parameter([[0.0, 0.0], [0.0, 0.0]], "rad", "encoder error; rows: axes, columns: orders 1 and 2")
    encoder_phase = Parameter([[0.0, 0.0], [0.0, 0.0]], "rad", "their phases at angle 0")
    quantum = Parameter(0.0, "rad", "quantum of both readings; 0: none", min=0.0)

    f_local = Input([0.0, 0.0, 9.80665], "m/s2", "specific force at the site, ENU")
    omega_local = Input([0.0, 0.0, 0.0], "rad/s", "Earth rate at the site, ENU")
    mode_x = Input(0.0, "1", "outer axis: 0 hold, 1 index, 2 rate")
    target_x = Input(0.0, "1", "outer axis: angle in rad (index) or rate in rad/s (rate)")
    mode_y = Input(0.0, "1", "inner axis: 0 hold, 1 index, 2 rate")
    target_y = Input(0.0, "1", "inner axis: angle in rad (index) or rate in rad/s (rate)")
    face = Input(IDENTITY, "1", "mount: rows are the gyro axes in plate axes")

    angle_x = Output("rad", "outer angle, cumulative")
    angle_y = Output("rad", "inner angle, cumulative")
    rate_x = Output("rad/s", "outer rate")
    rate_y = Output("rad/s", "inner rate")
    angle_x_read = Output("rad", "outer angle as its encoder reads it")
    angle_y_read = Output("rad", "inner angle as its encoder reads it")
    omega = Output("rad/s", "inertial rate, face axes", shape=(3,))
    alpha = Output("rad/s2", "derivative of the inertial rate, face axes", shape=(3,))
    f = Output("m/s2", "specific force, face axes", shape=(3,))
    in_position = Output("1", "1 when both targets are reached")

    outer = SegmentMotion()
    inner = SegmentMotion()
    asked = Discrete(0.0, "1", "mode, target or angle under check")
    axis = Discrete(0.0, "1", "axis under check: 1 outer, 2 inner")

    def start(self) -> None:
        self.refuse(self.limits_y[0] >= self.limits_y[1], "limits_y: the lower must be below the upper")
        self.refuse(
            self.angle0[1] < self.limits_y[0] or self.angle0[1] > self.limits_y[1],
            "angle0[2] is outside limits_y",
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
        # elementary rotations from the base to the plate: axis (0 X, 1 Y, 2 Z), angle and its derivatives
        about = [1.0, 2.0, 0.0, 2.0, 2.0, 0.0, 1.0]
        q = [0.0, 0.0, self.outer.x, self.squareness, 0.0, 0.0, self.inner.x]
        dq = [0.0, 0.0, self.outer.v, 0.0, 0.0, 0.0, self.inner.v]
        ddq = [0.0, 0.0, self.outer.a, 0.0, 0.0, 0.0, self.inner.a]
        for n in range(2):
            if self.wobble[n] > 0.0:
                order = self.wobble_order[n]
                c = self.wobble[n] * cos(order * q[4 * n + 2] + self.wobble_phase[n])
                s = self.wobble[n] * sin(order * q[4 * n + 2] + self.wobble_phase[n])
                spin = order * dq[4 * n + 2]
                turn = order * ddq[4 * n + 2]
                q[4 * n] = c
                q[4 * n + 1] = s
                dq[4 * n] = -s * spin
                dq[4 * n + 1] = c * spin
                ddq[4 * n] = -s * turn - c * spin * spin
                ddq[4 * n + 1] = c * turn - s * spin * spin
        w = self.base @ self.omega_local
        p = vector([0.0, 0.0, 0.0])  # derivative of w
        g = self.base @ self.f_local
        for k in range(7):
            if q[k] != 0.0 or dq[k] != 0.0 or ddq[k] != 0.0:
                e = about[k]
                j = e + 1.0 if e < 2.0 else 0.0  # the two axes that turn
                m = j + 1.0 if j < 2.0 else 0.0
                c = cos(q[k])
                s = sin(q[k])
                first = c * w[index(j)] + s * w[index(m)]
                second = c * w[index(m)] - s * w[index(j)]
                w[index(j)] = first
                w[index(m)] = second
                w[index(e)] = w[index(e)] + dq[k]
                row = c * p[index(j)] + s * p[index(m)] + dq[k] * second
                p[index(m)] = c * p[index(m)] - s * p[index(j)] - dq[k] * first
                p[index(j)] = row
                p[index(e)] = p[index(e)] + ddq[k]
                row = c * g[index(j)] + s * g[index(m)]
                g[index(m)] = c * g[index(m)] - s * g[index(j)]
                g[index(j)] = row
        self.omega = self.face @ w
        self.alpha = self.face @ p
        self.f = self.face @ g
        self.angle_x = self.outer.x
        self.angle_y = self.inner.x
        self.rate_x = self.outer.v
        self.rate_y = self.inner.v
        self.angle_x_read = self.indicated(0.0, self.outer.x)
        self.angle_y_read = self.indicated(1.0, self.inner.x)
        self.in_position = self.outer.arrived * self.inner.arrived
