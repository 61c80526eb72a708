from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Output, Parameter, sampled
from gyrobench.component.math import cos, fabs, floor, maximum, minimum, sign, sin, sqrt

IDENTITY = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]


class TableRate(Component):
    """Turntable with one driven axis, kinematic: hold, index and rate.  [TABLE-RATE, TABLE-POSITION]

    The table follows its command without error.  From the moment a command (mode, target) changes, the motion
    is a chain of five segments of constant acceleration, each in closed form from its own start,

        x = x_k + v_k (t - t_k) + a_k (t - t_k)2 / 2,     v = v_k + a_k (t - t_k)

      mode 0 hold    brake to rest, stay
      mode 1 index   brake to rest, then trapezoid (acceleration, index_rate) to the angle `target`, stay
      mode 2 rate    accelerate to the rate `target`, keep it

    so that days at constant rate add no error.  Ripple (n cycles per turn, relative amplitude r) and true angle:

        angle = x + (r / n) sin n x     rate = v (1 + r cos n x)     acc = a (1 + r cos n x) - r n v2 sin n x

    angle_read = angle + a_1 sin(angle + p_1) + a_2 sin(2 angle + p_2), rounded to the quantum.  With B = tilted base
    (rows: table axes in ENU at angle 0, the axis is the third), Rz = passive rotation by the angle,
    w = Rz B omega_local:

        f     = face Rz B f_local
        omega = face (w + (0, 0, rate))
        alpha = face (w_y rate, -w_x rate, acc)       the whole derivative of omega, so d(omega)/dt = alpha

    tilt[1], tilt[2] turn the base about its first and then its new second axis, B = R2 R1 base.

    Not modelled: servo error and bandwidth, axis wobble, bearing torque, acceleration of the mounted
    instrument (it stands on the axis), time of a change of mount.
    Source: Hu 1981, sections 5.4 (two-2), 5.5 (two-1), 6.1; frames: CONV-FRAMES.
    """

    version = "1.0.0"

    base = Parameter(IDENTITY, "1", "rows: table axes in ENU at angle 0; the third is the axis")
    tilt = Parameter([0.0, 0.0], "rad", "axis tilt about the first and second table axis", min=-0.1, max=0.1)
    angle0 = Parameter(0.0, "rad", "angle at the start")
    acceleration = Parameter(0.1, "rad/s2", "acceleration of every move", above=0.0)
    index_rate = Parameter(0.1, "rad/s", "rate of an index move", above=0.0)
    rate_max = Parameter(10.0, "rad/s", "largest rate that may be asked for", above=0.0)
    ripple = Parameter(0.0, "1", "rate ripple, relative amplitude r", min=-0.1, max=0.1)
    ripple_cycles = Parameter(36, int, "ripple cycles per turn n", min=1, max=100000)
    encoder_amplitude = Parameter([0.0, 0.0], "rad", "encoder error of orders 1 and 2")
    encoder_phase = Parameter([0.0, 0.0], "rad", "their phases at angle 0")
    quantum = Parameter(0.0, "rad", "quantum of angle_read; 0: none", min=0.0)

    f_local = Input([0.0, 0.0, 9.80665], "m/s2", "specific force at the site, ENU")
    omega_local = Input([0.0, 0.0, 0.0], "rad/s", "Earth rate at the site, ENU")
    mode = Input(0.0, "1", "0 hold, 1 index, 2 rate")
    target = Input(0.0, "1", "angle in rad (index) or rate in rad/s (rate)")
    face = Input(IDENTITY, "1", "mount: rows are the gyro axes in table axes")

    angle = Output("rad", "table angle, cumulative")
    rate = Output("rad/s", "table rate relative to its base")
    angle_read = Output("rad", "table angle as the encoder reads it")
    omega = Output("rad/s", "inertial rate, face axes", shape=(3,))
    alpha = Output("rad/s2", "derivative of the inertial rate, face axes", shape=(3,))
    f = Output("m/s2", "specific force, face axes", shape=(3,))
    in_position = Output("1", "1 when the target angle or rate is reached")

    tilted = Discrete(IDENTITY, "1", "base with tilt")
    x = Discrete(0.0, "rad", "commanded angle")
    v = Discrete(0.0, "rad/s", "commanded rate")
    a = Discrete(0.0, "rad/s2", "commanded acceleration")
    arrived = Discrete(0.0, "1", "the last segment is reached")
    t_last = Discrete(0.0, "s", "time of x, v, a")
    mode_last = Discrete(0.0, "1", "mode of the motion planned")
    target_last = Discrete(0.0, "1", "target of the motion planned")
    t_s = Discrete([0.0, 0.0, 0.0, 0.0, 0.0], "s", "start of each segment")
    x_s = Discrete([0.0, 0.0, 0.0, 0.0, 0.0], "rad", "angle there")
    v_s = Discrete([0.0, 0.0, 0.0, 0.0, 0.0], "rad/s", "rate there")
    a_s = Discrete([0.0, 0.0, 0.0, 0.0, 0.0], "rad/s2", "acceleration in each segment")

    def start(self) -> None:
        for i in range(3):
            for j in range(3):
                dot = 0.0 if i != j else -1.0
                for k in range(3):
                    dot = dot + self.base[i][k] * self.base[j][k]
                self.refuse(
                    fabs(dot) > 1e-9,
                    "base is no rotation: its rows must be unit vectors at right angles, to 1e-9",
                )
        det = self.base[0][0] * (self.base[1][1] * self.base[2][2] - self.base[1][2] * self.base[2][1])
        det = det - self.base[0][1] * (self.base[1][0] * self.base[2][2] - self.base[1][2] * self.base[2][0])
        det = det + self.base[0][2] * (self.base[1][0] * self.base[2][1] - self.base[1][1] * self.base[2][0])
        self.refuse(det < 0.0, "base is left-handed (determinant -1): reverse one row")
        c1 = cos(self.tilt[0])
        s1 = sin(self.tilt[0])
        c2 = cos(self.tilt[1])
        s2 = sin(self.tilt[1])
        for k in range(3):
            first = self.base[0][k]
            second = c1 * self.base[1][k] + s1 * self.base[2][k]
            third = c1 * self.base[2][k] - s1 * self.base[1][k]
            self.tilted[0][k] = c2 * first - s2 * third
            self.tilted[1][k] = second
            self.tilted[2][k] = s2 * first + c2 * third
        self.x = self.angle0
        self.v = 0.0
        self.a = 0.0
        self.arrived = 0.0
        self.t_last = self.t
        self.mode_last = 0.0
        self.target_last = 0.0
        for k in range(5):
            self.t_s[k] = self.t
            self.x_s[k] = self.angle0
            self.v_s[k] = 0.0
            self.a_s[k] = 0.0

    @sampled(every=1)
    def tick(self) -> None:
        if self.mode != self.mode_last or self.target != self.target_last:
            self.refuse(
                not (self.mode == 0.0 or self.mode == 1.0 or self.mode == 2.0),
                "mode = {mode} must be 0 hold, 1 index or 2 rate",
            )
            self.refuse(
                self.mode == 2.0 and fabs(self.target) > self.rate_max,
                "rate {target} rad/s exceeds rate_max = {rate_max} rad/s",
            )
            goal = self.target if self.mode == 2.0 else 0.0  # the rate that segment 0 leads to
            t = self.t_last + fabs(goal - self.v) / self.acceleration
            x = self.x + 0.5 * (self.v + goal) * (t - self.t_last)
            self.t_s[0] = self.t_last
            self.x_s[0] = self.x
            self.v_s[0] = self.v
            self.a_s[0] = sign(goal - self.v) * self.acceleration
            for k in range(1, 5):
                self.t_s[k] = t
                self.x_s[k] = x
                self.v_s[k] = goal
                self.a_s[k] = 0.0
            if self.mode == 1.0 and self.target != x:
                way = fabs(self.target - x)
                s = sign(self.target - x)
                peak = minimum(self.index_rate, sqrt(way * self.acceleration))
                ramp = peak / self.acceleration
                cruise = maximum(way - peak * ramp, 0.0) / peak
                self.a_s[1] = s * self.acceleration
                self.t_s[2] = t + ramp
                self.x_s[2] = x + s * (0.5 * peak * ramp)
                self.v_s[2] = s * peak
                self.t_s[3] = self.t_s[2] + cruise
                self.x_s[3] = self.x_s[2] + s * peak * cruise
                self.v_s[3] = s * peak
                self.a_s[3] = -s * self.acceleration
                self.t_s[4] = self.t_s[3] + ramp
                self.x_s[4] = self.target
            self.mode_last = self.mode
            self.target_last = self.target
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

    def outputs(self) -> None:
        angle = self.x
        rate = self.v
        acc = self.a
        if self.ripple != 0.0:
            n = self.ripple_cycles
            rs = self.ripple * sin(n * self.x)
            rc = self.ripple * cos(n * self.x)
            angle = self.x + rs / n
            rate = self.v * (1.0 + rc)
            acc = self.a * (1.0 + rc) - n * self.v * self.v * rs
        read = angle
        for k in range(2):
            if self.encoder_amplitude[k] != 0.0:
                read = read + self.encoder_amplitude[k] * sin((k + 1) * angle + self.encoder_phase[k])
        if self.quantum > 0.0:
            read = self.quantum * floor(read / self.quantum + 0.5)
        c = cos(angle)
        s = sin(angle)
        e = [0.0, 0.0, 0.0]  # Earth rate and specific force in base axes, at angle 0
        g = [0.0, 0.0, 0.0]
        for i in range(3):
            row = self.tilted[i][0] * self.omega_local[0] + self.tilted[i][1] * self.omega_local[1]
            e[i] = row + self.tilted[i][2] * self.omega_local[2]
            row = self.tilted[i][0] * self.f_local[0] + self.tilted[i][1] * self.f_local[1]
            g[i] = row + self.tilted[i][2] * self.f_local[2]
        wx = c * e[0] + s * e[1]
        wy = c * e[1] - s * e[0]
        wz = e[2] + rate
        fx = c * g[0] + s * g[1]
        fy = c * g[1] - s * g[0]
        for i in range(3):
            self.omega[i] = self.face[i][0] * wx + self.face[i][1] * wy + self.face[i][2] * wz
            self.alpha[i] = (self.face[i][0] * wy - self.face[i][1] * wx) * rate + self.face[i][2] * acc
            self.f[i] = self.face[i][0] * fx + self.face[i][1] * fy + self.face[i][2] * g[2]
        self.angle = angle
        self.rate = rate
        self.angle_read = read
        self.in_position = self.arrived
