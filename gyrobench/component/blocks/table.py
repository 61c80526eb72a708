"""Common parts of turntables: motion in segments, the tilted base, rate and specific force on the face."""

from __future__ import annotations

from gyrobench.component.component import Component
from gyrobench.component.composition import Block
from gyrobench.component.declarations import Discrete, Input, Output, Parameter
from gyrobench.component.math import Number, cos, fabs, maximum, minimum, sign, sin, sqrt, vector
from gyrobench.component.rotation import IDENTITY, Rotation

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
