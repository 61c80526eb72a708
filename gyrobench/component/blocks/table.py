"""Common parts of turntables: motion in segments, the tilted base, rate and specific force on the face."""

from __future__ import annotations

from gyrobench.component.component import Component
from gyrobench.component.composition import Block
from gyrobench.component.declarations import Discrete, Input, Output, Parameter
from gyrobench.component.math import Number, Vector, cos, fabs, index, maximum, minimum, sign, sin, sqrt, vector
from gyrobench.component.rotation import IDENTITY, Rotation
from gyrobench.component.set_up import each

FIVE = [0.0, 0.0, 0.0, 0.0, 0.0]


class SegmentMotion(Block):
    """Motion of one axis: five segments of constant acceleration, each in closed form from its own start.

        x = x_k + v_k (t - t_k) + a_k (t - t_k)2 / 2,     v = v_k + a_k (t - t_k)

    mode 0 hold: brake to rest; 1 index: brake, then a trapezoid to the angle `target`; 2 rate: accelerate to the rate
    `target`.  Days at constant rate add no error.  [TABLE-RATE, TABLE-POSITION]
    """

    x = Discrete(0.0, "rad", "commanded angle")
    v = Discrete(0.0, "rad/s", "commanded rate")
    a = Discrete(0.0, "rad/s2", "commanded acceleration")
    arrived = Discrete(0.0, "1", "the last segment is reached")
    t_last = Discrete(0.0, "s", "time of x, v, a")
    mode_last = Discrete(0.0, "1", "mode of the motion planned")
    target_last = Discrete(0.0, "1", "target of the motion planned")
    t_s = Discrete(FIVE, "s", "start of each segment")
    x_s = Discrete(FIVE, "rad", "angle there")
    v_s = Discrete(FIVE, "rad/s", "rate there")
    a_s = Discrete(FIVE, "rad/s2", "acceleration in each segment")

    def rest(self, x: Number) -> None:
        """Set the axis to rest at the angle x, from now on."""
        self.x = x
        self.v = 0.0
        self.a = 0.0
        self.arrived = 0.0
        self.t_last = self.t
        self.mode_last = 0.0
        self.target_last = 0.0
        for k in range(5):
            self.t_s[k] = self.t
            self.x_s[k] = x
            self.v_s[k] = 0.0
            self.a_s[k] = 0.0

    def commanded(self, mode: Number, target: Number) -> Number:
        """Return 1 where the command is not the one that is planned."""
        return 1.0 if mode != self.mode_last or target != self.target_last else 0.0

    def plan(self, mode: Number, target: Number, acceleration: Number, index_rate: Number) -> None:
        """Plan the segments of a new command, from where the axis was at the end of the last step."""
        goal = target if mode == 2.0 else 0.0  # the rate that segment 0 leads to
        t = self.t_last + fabs(goal - self.v) / acceleration
        x = self.x + 0.5 * (self.v + goal) * (t - self.t_last)
        self.t_s[0] = self.t_last
        self.x_s[0] = self.x
        self.v_s[0] = self.v
        self.a_s[0] = sign(goal - self.v) * acceleration
        for k in range(1, 5):
            self.t_s[k] = t
            self.x_s[k] = x
            self.v_s[k] = goal
            self.a_s[k] = 0.0
        distance = fabs(target - x)
        if mode == 1.0 and distance * acceleration > 0.0:  # an angle that died away may be 1e-320
            s = sign(target - x)
            peak = minimum(index_rate, sqrt(distance * acceleration))
            ramp = peak / acceleration
            cruise = maximum(distance - peak * ramp, 0.0) / peak
            self.a_s[1] = s * acceleration
            self.t_s[2] = t + ramp
            self.x_s[2] = x + s * (0.5 * peak * ramp)
            self.v_s[2] = s * peak
            self.t_s[3] = self.t_s[2] + cruise
            self.x_s[3] = self.x_s[2] + s * peak * cruise
            self.v_s[3] = s * peak
            self.a_s[3] = -s * acceleration
            self.t_s[4] = self.t_s[3] + ramp
            self.x_s[4] = target
        self.mode_last = mode
        self.target_last = target

    def advance(self) -> None:
        """Compute angle, rate and acceleration at the present instant."""
        past = self.t - self.t_s[4]
        self.arrived = 1.0
        if past >= 0.0:
            self.a = 0.0
            self.v = self.v_s[4]
            self.x = self.x_s[4] + self.v * past
        else:
            self.arrived = 0.0
            for k in range(4):
                if self.t >= self.t_s[k]:
                    dt = self.t - self.t_s[k]
                    self.a = self.a_s[k]
                    self.v = self.v_s[k] + self.a * dt
                    self.x = self.x_s[k] + self.v_s[k] * dt + 0.5 * self.a * dt * dt
        self.t_last = self.t


class AxisTable(Component):
    """Common part of the tables with one axis: base with tilt, and the rates and forces on the face.

    With B = tilted base (rows: table axes in ENU at angle 0, the axis is the third), Rz the passive rotation by the
    table angle, w = Rz B omega_local:

        f     = face Rz B f_local
        omega = face (w + (0, 0, rate))
        alpha = face (w_y rate, -w_x rate, acc)       the total derivative of omega, so d(omega)/dt = alpha

    tilt[1], tilt[2] turn the base about its first and then its new second axis, B = R2 R1 base.  The parts declare the
    input `face` (rows: the gyro axes in table axes).
    """

    simulates = (
        each(
            "tilt",
            ("table.axis.pole.east", "table.axis.vertical.east", "table.axis.servo.y", "axis.square"),
            ("table.axis.pole.normal", "table.axis.vertical.north", "table.axis.level.pole", "table.axis.servo.z"),
        ),
    )

    base = Rotation("rows: table axes in ENU at angle 0; the third is the axis")
    tilt = Parameter([0.0, 0.0], "rad", "axis tilt about the first and second table axis", min=-0.1, max=0.1)

    f_local = Input([0.0, 0.0, 9.80665], "m/s2", "specific force at the site, ENU")
    omega_local = Input([0.0, 0.0, 0.0], "rad/s", "Earth rate at the site, ENU")

    angle = Output("rad", "table angle, cumulative")
    rate = Output("rad/s", "table rate relative to its base")
    angle_read = Output("rad", "table angle as the encoder reads it")
    omega = Output("rad/s", "inertial rate, face axes", shape=(3,))
    alpha = Output("rad/s2", "derivative of the inertial rate, face axes", shape=(3,))
    f = Output("m/s2", "specific force, face axes", shape=(3,))

    tilted = Discrete(IDENTITY, "1", "base with tilt")

    def start(self) -> None:
        c1 = cos(self.tilt[0])
        s1 = sin(self.tilt[0])
        c2 = cos(self.tilt[1])
        s2 = sin(self.tilt[1])
        second = c1 * self.base[1] + s1 * self.base[2]
        third = c1 * self.base[2] - s1 * self.base[1]
        self.tilted = vector([c2 * self.base[0] - s2 * third, second, s2 * self.base[0] + c2 * third])

    def feel(self, c: Number, s: Number, spin: Number, rate: Number, acc: Number) -> None:
        """Write omega, alpha and f on the face: c, s of the angle, spin the inertial rate along the axis."""
        e = self.tilted @ self.omega_local  # along the axes of the base, at angle 0
        g = self.tilted @ self.f_local
        wx = c * e[0] + s * e[1]
        wy = c * e[1] - s * e[0]
        self.omega = self.face @ vector([wx, wy, spin])
        for i in range(3):
            self.alpha[i] = (self.face[i][0] * wy - self.face[i][1] * wx) * rate + self.face[i][2] * acc
        self.f = self.face @ vector([c * g[0] + s * g[1], c * g[1] - s * g[0], g[2]])


class TwoAxisTable(Component):
    """Common part of the tables with two axes: attitude, rates and forces on the plate, wobble and squareness.

    Attitude of the plate at the angles x, y of the outer and the inner axis, R passive rotations:

        v_face = face A base v_local
        A = Ry(y) Wy(y) Rz(squareness) Rx(x) Wx(x)                  [SERVO2-A, where there are no errors]

      base    rows: the axes X (outer), Y (inner at x = 0), Z in ENU at angles 0
      W       wobble of an axis: its two cross rotations amplitude cos(n q + phase), amplitude sin(n q + phase)

    so A = [[cy, sx sy, -cx sy], [0, cx, sx], [sy, -cy sx, cx cy]] without errors; the plate turned by +x right-handed
    about the outer axis, then by +y about the inner.  Rate and acceleration follow elementary rotation by elementary
    rotation (angle q about axis e) from those of the base:

        w <- R w + q' e        alpha <- R alpha - q' e x (R w) + q'' e        f <- R f

    omega is the exact derivative of the attitude and alpha that of omega, wobble included.  The parts declare the input
    `face` (rows: the gyro axes in plate axes).
    """

    simulates = (each("squareness", ("table.square",)),)

    base = Rotation("rows: outer axis X, inner axis Y at x = 0, and Z in ENU at angles 0")
    squareness = Parameter(0.0, "rad", "inner axis turned about Z out of the right angle", min=-0.1, max=0.1)
    wobble = Parameter([0.0, 0.0], "rad", "wobble amplitude of the outer and the inner axis", min=0.0, max=0.1)
    wobble_order = Parameter([2, 2], int, "its cycles per turn", min=1, max=1000)
    wobble_phase = Parameter([0.0, 0.0], "rad", "its phase at angle 0")

    f_local = Input([0.0, 0.0, 9.80665], "m/s2", "specific force at the site, ENU")
    omega_local = Input([0.0, 0.0, 0.0], "rad/s", "Earth rate at the site, ENU")

    angle_x = Output("rad", "outer angle, cumulative")
    angle_y = Output("rad", "inner angle, cumulative")
    rate_x = Output("rad/s", "outer rate")
    rate_y = Output("rad/s", "inner rate")
    angle_x_read = Output("rad", "outer angle as its encoder reads it")
    angle_y_read = Output("rad", "inner angle as its encoder reads it")
    omega = Output("rad/s", "inertial rate, face axes", shape=(3,))
    alpha = Output("rad/s2", "derivative of the inertial rate, face axes", shape=(3,))
    f = Output("m/s2", "specific force, face axes", shape=(3,))

    def place(self, x: Vector, v: Vector, a: Vector) -> None:
        """Write angles, rates, and what the face feels; x, v, a: angle, rate, acceleration of outer and inner axis."""
        # elementary rotations from the base to the plate: axis (0 X, 1 Y, 2 Z), angle and its derivatives
        about = [1.0, 2.0, 0.0, 2.0, 2.0, 0.0, 1.0]
        q = [0.0, 0.0, x[0], self.squareness, 0.0, 0.0, x[1]]
        dq = [0.0, 0.0, v[0], 0.0, 0.0, 0.0, v[1]]
        ddq = [0.0, 0.0, a[0], 0.0, 0.0, 0.0, a[1]]
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
        self.angle_x = x[0]
        self.angle_y = x[1]
        self.rate_x = v[0]
        self.rate_y = v[1]
