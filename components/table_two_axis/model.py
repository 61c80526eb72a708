from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Output, Parameter, sampled
from gyrobench.component.math import cos, fabs, floor, index, maximum, minimum, sign, sin, sqrt

IDENTITY = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]


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

    omega is the exact derivative of the attitude and alpha that of omega, wobble included.

    Not modelled: servo error and bandwidth, bearing torque, sag under load, encoder errors other than the quantum,
    acceleration of the mounted instrument (it stands where the axes meet), time of a change of mount.
    Source: Hu 1981, eq. 3-47, 3-94..3-99, section 5.4; frames: CONV-FRAMES, TUM2AX-GEOM, SERVO2-A.
    """

    version = "1.0.0"

    base = Parameter(IDENTITY, "1", "rows: outer axis X, inner axis Y at x = 0, and Z in ENU at angles 0")
    angle0 = Parameter([0.0, 0.0], "rad", "outer and inner angle at the start")
    acceleration = Parameter([0.1, 0.1], "rad/s2", "acceleration of every move", above=0.0)
    index_rate = Parameter([0.1, 0.1], "rad/s", "rate of an index move", above=0.0)
    rate_max = Parameter([10.0, 10.0], "rad/s", "largest rate that may be asked for", above=0.0)
    limits_y = Parameter([-1e9, 1e9], "rad", "lowest and highest inner angle")
    squareness = Parameter(0.0, "rad", "inner axis turned about Z out of the right angle", min=-0.1, max=0.1)
    wobble = Parameter([0.0, 0.0], "rad", "wobble amplitude of the outer and the inner axis", min=0.0, max=0.1)
    wobble_order = Parameter([2, 2], int, "its cycles per turn", min=1, max=1000)
    wobble_phase = Parameter([0.0, 0.0], "rad", "its phase at angle 0")
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
    angle_x_read = Output("rad", "outer angle rounded to the quantum")
    angle_y_read = Output("rad", "inner angle rounded to the quantum")
    omega = Output("rad/s", "inertial rate, face axes", shape=(3,))
    alpha = Output("rad/s2", "derivative of the inertial rate, face axes", shape=(3,))
    f = Output("m/s2", "specific force, face axes", shape=(3,))
    in_position = Output("1", "1 when both targets are reached")

    x = Discrete([0.0, 0.0], "rad", "angle of each axis")
    v = Discrete([0.0, 0.0], "rad/s", "its rate")
    a = Discrete([0.0, 0.0], "rad/s2", "its acceleration")
    arrived = Discrete([0.0, 0.0], "1", "its last segment is reached")
    t_last = Discrete(0.0, "s", "time of x, v, a")
    mode_last = Discrete([0.0, 0.0], "1", "mode of the motion planned")
    target_last = Discrete([0.0, 0.0], "1", "target of the motion planned")
    asked = Discrete(0.0, "1", "mode or target under check")
    axis = Discrete(0.0, "1", "axis under check: 1 outer, 2 inner")
    t_s = Discrete([[0.0] * 5] * 2, "s", "start of each segment")
    x_s = Discrete([[0.0] * 5] * 2, "rad", "angle there")
    v_s = Discrete([[0.0] * 5] * 2, "rad/s", "rate there")
    a_s = Discrete([[0.0] * 5] * 2, "rad/s2", "acceleration in each segment")

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
        self.refuse(self.limits_y[0] >= self.limits_y[1], "limits_y: the lower must be below the upper")
        self.refuse(
            self.angle0[1] < self.limits_y[0] or self.angle0[1] > self.limits_y[1],
            "angle0[2] is outside limits_y",
        )
        self.t_last = self.t
        for n in range(2):
            self.x[n] = self.angle0[n]
            self.v[n] = 0.0
            self.a[n] = 0.0
            self.arrived[n] = 0.0
            self.mode_last[n] = 0.0
            self.target_last[n] = 0.0
            for k in range(5):
                self.t_s[n][k] = self.t
                self.x_s[n][k] = self.angle0[n]
                self.v_s[n][k] = 0.0
                self.a_s[n][k] = 0.0

    @sampled(every=1)
    def tick(self) -> None:
        modes = [self.mode_x, self.mode_y]
        targets = [self.target_x, self.target_y]
        for n in range(2):
            mode = modes[n]
            target = targets[n]
            if mode != self.mode_last[n] or target != self.target_last[n]:
                self.axis = n + 1.0
                self.asked = mode
                self.refuse(
                    not (mode == 0.0 or mode == 1.0 or mode == 2.0),
                    "axis {axis} (1 outer, 2 inner): mode = {asked} must be 0 hold, 1 index or 2 rate",
                )
                self.asked = target
                self.refuse(
                    mode == 2.0 and fabs(target) > self.rate_max[n],
                    "axis {axis} (1 outer, 2 inner): rate {asked} rad/s exceeds its rate_max",
                )
                self.refuse(
                    mode == 1.0 and n == 1 and (target < self.limits_y[0] or target > self.limits_y[1]),
                    "inner axis: target {asked} rad is outside limits_y",
                )
                limit = self.acceleration[n]
                goal = target if mode == 2.0 else 0.0  # the rate that segment 0 leads to
                t = self.t_last + fabs(goal - self.v[n]) / limit
                x = self.x[n] + 0.5 * (self.v[n] + goal) * (t - self.t_last)
                self.t_s[n][0] = self.t_last
                self.x_s[n][0] = self.x[n]
                self.v_s[n][0] = self.v[n]
                self.a_s[n][0] = sign(goal - self.v[n]) * limit
                for k in range(1, 5):
                    self.t_s[n][k] = t
                    self.x_s[n][k] = x
                    self.v_s[n][k] = goal
                    self.a_s[n][k] = 0.0
                if mode == 1.0 and target != x:
                    way = fabs(target - x)
                    s = sign(target - x)
                    peak = minimum(self.index_rate[n], sqrt(way * limit))
                    ramp = peak / limit
                    cruise = maximum(way - peak * ramp, 0.0) / peak
                    self.a_s[n][1] = s * limit
                    self.t_s[n][2] = t + ramp
                    self.x_s[n][2] = x + s * (0.5 * peak * ramp)
                    self.v_s[n][2] = s * peak
                    self.t_s[n][3] = self.t_s[n][2] + cruise
                    self.x_s[n][3] = self.x_s[n][2] + s * peak * cruise
                    self.v_s[n][3] = s * peak
                    self.a_s[n][3] = -s * limit
                    self.t_s[n][4] = self.t_s[n][3] + ramp
                    self.x_s[n][4] = target
                self.mode_last[n] = mode
                self.target_last[n] = target
            past = self.t - self.t_s[n][4]
            self.arrived[n] = 1.0
            if past >= 0.0:
                self.a[n] = 0.0
                self.v[n] = self.v_s[n][4]
                self.x[n] = self.x_s[n][4] + self.v[n] * past
            else:
                self.arrived[n] = 0.0
                for k in range(4):
                    if self.t >= self.t_s[n][k]:
                        dt = self.t - self.t_s[n][k]
                        self.a[n] = self.a_s[n][k]
                        self.v[n] = self.v_s[n][k] + self.a[n] * dt
                        self.x[n] = self.x_s[n][k] + self.v_s[n][k] * dt + 0.5 * self.a[n] * dt * dt
        self.asked = self.x[1]
        self.refuse(
            self.x[1] < self.limits_y[0] or self.x[1] > self.limits_y[1],
            "inner axis: {asked} rad is beyond limits_y, it has run against its stop",
        )
        self.t_last = self.t

    def rounded(self, angle):
        return self.quantum * floor(angle / self.quantum + 0.5) if self.quantum > 0.0 else angle

    def outputs(self) -> None:
        # elementary rotations from the base to the plate: axis (0 X, 1 Y, 2 Z), angle and its derivatives
        about = [1.0, 2.0, 0.0, 2.0, 2.0, 0.0, 1.0]
        q = [0.0, 0.0, self.x[0], self.squareness, 0.0, 0.0, self.x[1]]
        dq = [0.0, 0.0, self.v[0], 0.0, 0.0, 0.0, self.v[1]]
        ddq = [0.0, 0.0, self.a[0], 0.0, 0.0, 0.0, self.a[1]]
        for n in range(2):
            if self.wobble[n] > 0.0:
                order = self.wobble_order[n]
                c = self.wobble[n] * cos(order * self.x[n] + self.wobble_phase[n])
                s = self.wobble[n] * sin(order * self.x[n] + self.wobble_phase[n])
                spin = order * self.v[n]
                turn = order * self.a[n]
                q[4 * n] = c
                q[4 * n + 1] = s
                dq[4 * n] = -s * spin
                dq[4 * n + 1] = c * spin
                ddq[4 * n] = -s * turn - c * spin * spin
                ddq[4 * n + 1] = c * turn - s * spin * spin
        w = [0.0, 0.0, 0.0]
        p = [0.0, 0.0, 0.0]  # derivative of w
        g = [0.0, 0.0, 0.0]
        for i in range(3):
            row = self.base[i][0] * self.omega_local[0] + self.base[i][1] * self.omega_local[1]
            w[i] = row + self.base[i][2] * self.omega_local[2]
            row = self.base[i][0] * self.f_local[0] + self.base[i][1] * self.f_local[1]
            g[i] = row + self.base[i][2] * self.f_local[2]
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
        for i in range(3):
            self.omega[i] = self.face[i][0] * w[0] + self.face[i][1] * w[1] + self.face[i][2] * w[2]
            self.alpha[i] = self.face[i][0] * p[0] + self.face[i][1] * p[1] + self.face[i][2] * p[2]
            self.f[i] = self.face[i][0] * g[0] + self.face[i][1] * g[1] + self.face[i][2] * g[2]
        self.angle_x = self.x[0]
        self.angle_y = self.x[1]
        self.rate_x = self.v[0]
        self.rate_y = self.v[1]
        self.angle_x_read = self.rounded(self.x[0])
        self.angle_y_read = self.rounded(self.x[1])
        self.in_position = self.arrived[0] * self.arrived[1]
