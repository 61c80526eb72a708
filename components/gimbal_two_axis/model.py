from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Output, Parameter, State, sampled
from gyrobench.component.blocks.gimbal import body_torque, ordered, ordered_matrix, rigid_matrix
from gyrobench.component.blocks.platform import (
    NONE,
    X,
    Y,
    Z,
    about_x,
    about_z,
    contact_moved,
    contact_torque,
    gimbal_x,
    gimbal_z,
    left,
    motor_current,
    moved_base,
    with_unbalance,
)
from gyrobench.component.math import Number, Vector, atan2, cos, fabs, pi, sin, sqrt, vector

PAIR = [0.0, 0.0]
DEG = pi / 180.0


def inner(form: Number, x: Vector) -> Number:
    """Return what belongs to the inner joint, of pitch and yaw."""
    return x[0] if form == 0.0 else x[1]


def outer(form: Number, x: Vector) -> Number:
    """Return what belongs to the outer joint, of pitch and yaw."""
    return x[1] if form == 0.0 else x[0]


def placed(form: Number, of_inner: Number, of_outer: Number) -> Vector:
    """Return of pitch and yaw what belongs to the inner and to the outer joint."""
    return vector([of_inner if form == 0.0 else of_outer, of_outer if form == 0.0 else of_inner])


class GimbalTwoAxis(Component):
    """Inertially stabilized gimbal of two axes, yaw-pitch or pitch-yaw, whose line of sight is y.  [GIMBAL-2AXIS]

    Drives, joint angles and torques: (1) pitch about x, (2) yaw about z; form says which joint is outside.  3 is the
    outer axis, 1 the inner one, q their angles; bodies A (outer) and B (inner) with full inertia matrices about the
    point where the axes cross; b, by Newton and Euler with q'' = 0, I alpha + omega x I omega + u x f:

        (M11 + J1) q1'' + M13 q3'' = tau1 - b1 - J1 alpha_A1        M11 = B11, M13 = sin q1 B12 + cos q1 B13
        (M33 + J3) q3'' + M13 q1'' = tau3 - b3 - J3 alpha_b3        M33 = A33 + e B e,  e = (0, sin q1, cos q1)
        tau = k_t i + M_load - viscous p' - contact - cogging sin(order p) - cable (p - cable_rest),   p = q

    An axis with bending > 0: its motor J, at p, turns the body by k (p - q) + c (p' - q'); tau acts at the motor, and
    without the spring both turn together.  Motors: i = (v - k_e p') / R, |v| <= v_max, |i| <= i_max.

    omega: of the inner gimbal, what a gyro there measures; omega of the line of sight about the outer axis is
    cos q1 times the outer gimbal's, so its loop needs 1 / cos q1; keyhole is 1 where |q1| > keyhole_angle.
    los: angles of the line of sight against a fixed direction, that of the start: s' = s x omega, los = (pitch, yaw).

    omega_b, alpha_b, f_b are those of the end of the communication step, as in platform_three_axis.

    Not modelled: end stops, inductance, translation of the axes against each other, tilt of the axes, bending across
    the joints, more than one mode an axis, optics.
    Source: Masten 2008; Hilkert 2008; equations of our own (GIMBAL-2AXIS).
    """

    version = "1.0.0"
    integrator = "rk4"
    rk4_substeps = 1

    form = Parameter(0, int, "0 yaw-pitch (yaw outside), 1 pitch-yaw (pitch outside)", min=0, max=1)
    I_outer = Parameter(
        [[0.03, 0.0, 0.0], [0.0, 0.03, 0.0], [0.0, 0.0, 0.03]],
        "kg.m2",
        "inertia matrix of the outer gimbal, its own axes",
    )
    I_inner = Parameter(
        [[0.045, 0.0, 0.0], [0.0, 0.03, 0.0], [0.0, 0.0, 0.045]],
        "kg.m2",
        "inertia matrix of the inner gimbal, its own axes",
    )
    unbalance = Parameter([NONE, NONE], "kg.m", "mass times offset of outer, inner gimbal: rows")
    J_motor = Parameter([0.005, 0.005], "kg.m2", "motors and what turns with them: pitch, yaw", min=0.0)
    bending = Parameter(PAIR, "Hz", "mode of each motor against its body, the other joint held; 0: rigid", min=0.0)
    bending_damping = Parameter([0.02, 0.02], "1", "damping ratio of these modes", min=0.0, max=1.0)
    viscous = Parameter([0.01, 0.01], "N.m.s/rad", "viscous friction", min=0.0)
    friction = Parameter(PAIR, "N.m", "Coulomb friction", min=0.0)
    stiction = Parameter(PAIR, "N.m", "break-away torque; 0: that of friction", min=0.0)
    presliding = Parameter(2e-4, "rad", "joint angle at break-away", above=0.0)
    cogging = Parameter(PAIR, "N.m", "amplitude of the cogging torque", min=0.0)
    cogging_order = Parameter([36.0, 36.0], "1", "periods of it in a turn", min=0.0)
    cable = Parameter(PAIR, "N.m/rad", "stiffness of the cables over the joint", min=0.0)
    cable_rest = Parameter(PAIR, "rad", "joint angle at which they are free of torque")
    k_t = Parameter([0.4, 0.4], "N.m/A", "motors: torque constants", above=0.0)
    k_e = Parameter(PAIR, "V.s/rad", "motors: back EMF constants; 0: current amplifiers", min=0.0)
    R = Parameter([1.0, 1.0], "Ohm", "motors: resistances (of a current amplifier: volts for an ampere)", above=0.0)
    v_max = Parameter([24.0, 24.0], "V", "largest voltages", above=0.0)
    i_max = Parameter([10.0, 10.0], "A", "largest currents", above=0.0)
    keyhole_angle = Parameter(75.0 * DEG, "rad", "inner angle beyond which `keyhole` is 1", above=0.0, max=pi / 2.0)
    theta_0 = Parameter(PAIR, "rad", "joint angles at the start")

    v = Input(PAIR, "V", "motor voltages")
    M_load = Input(PAIR, "N.m", "disturbance torques at the motors")
    omega_b = Input(NONE, "rad/s", "inertial rate of the base, base axes")
    alpha_b = Input(NONE, "rad/s2", "its derivative")
    f_b = Input([0.0, 0.0, 9.80665], "m/s2", "specific force where the axes cross, base axes")

    theta = Output("rad", "joint angles at the motors, as an encoder reads them", shape=(2,))
    theta_dot = Output("rad/s", "their rates", shape=(2,))
    omega = Output("rad/s", "inertial rate of the inner gimbal, its axes", shape=(3,))
    alpha = Output("rad/s2", "its derivative at the end of the step", shape=(3,))
    f = Output("m/s2", "specific force, axes of the inner gimbal", shape=(3,))
    los = Output(
        "rad", "line of sight against its direction at the start, about x and z of the inner gimbal", shape=(2,)
    )
    i_motor = Output("A", "motor currents", shape=(2,))
    keyhole = Output("1", "1 beyond keyhole_angle")
    saturated = Output("1", "1 while a voltage or a current is at its limit")

    q = State(PAIR, "rad", "joint angles of the bodies")
    dq = State(PAIR, "rad/s", "their rates")
    p = State(PAIR, "rad", "joint angles of the motors")
    dp = State(PAIR, "rad/s", "their rates")
    star = State([0.0, 1.0, 0.0], "1", "the fixed direction, axes of the inner gimbal")

    A = Discrete([NONE, NONE, NONE], "kg.m2", "I_outer in the axes of the joints")
    B = Discrete([NONE, NONE, NONE], "kg.m2", "I_inner in these axes")
    u = Discrete([NONE, NONE], "kg.m", "unbalance in these axes")
    stiff = Discrete(PAIR, "N.m/rad", "stiffness of the modes")
    soft = Discrete(PAIR, "N.m.s/rad", "their damping")
    spring = Discrete(PAIR, "N.m/rad", "stiffness of the contacts")
    rub = Discrete(PAIR, "N.m.s/rad", "their damping")
    reach = Discrete(PAIR, "rad", "way at Coulomb friction")
    anchor = Discrete(PAIR, "rad", "where a contact is free of torque")
    slipping = Discrete(PAIR, "1", "0 sticking, else the sense of slip")
    heavy = Discrete(0.0, "1", "1: there is unbalance")
    cos_keyhole = Discrete(0.0, "1", "cosine of keyhole_angle")
    rate_before = Discrete(NONE, "rad/s", "omega_b at the end of the communication step before")
    rise_before = Discrete(NONE, "rad/s2", "alpha_b then")
    f_before = Discrete(NONE, "m/s2", "f_b then")

    def start(self) -> None:
        self.refuse(
            not rigid_matrix(self.I_outer),
            "I_outer is not of a rigid body: symmetric, positive definite, no moment above the sum of the others",
        )
        self.refuse(
            not rigid_matrix(self.I_inner),
            "I_inner is not of a rigid body: symmetric, positive definite, no moment above the sum of the others",
        )
        self.A = ordered_matrix(self.form, self.I_outer)
        self.B = ordered_matrix(self.form, self.I_inner)
        self.heavy = 0.0
        self.cos_keyhole = cos(self.keyhole_angle)
        for n in range(2):
            self.u[n] = ordered(self.form, self.unbalance[n])
            for k in range(3):
                self.heavy = 1.0 if self.unbalance[n][k] != 0.0 else self.heavy
        for k in range(2):
            # the least inertia that a torque on this axis finds
            load = self.B[X][X] if k == self.form else self.A[Z][Z] + self.B[Z][Z]
            least = load + self.J_motor[k]
            self.stiff[k] = 0.0
            if self.bending[k] > 0.0:
                self.refuse(self.J_motor[k] == 0.0, "an axis with bending > 0 needs J_motor > 0")
                w = 2.0 * pi * self.bending[k]
                self.refuse(w * self.step > 0.3, "step = {step} s is too long for bending: 0.048 / bending at most")
                both = self.J_motor[k] * load / least
                self.stiff[k] = w * w * both
                self.soft[k] = 2.0 * self.bending_damping[k] * w * both
                least = self.J_motor[k]
            short = self.stiction[k] > 0.0 and self.stiction[k] < self.friction[k]
            self.refuse(short, "stiction of an axis must be 0 or at least its friction")
            most = self.friction[k] if self.friction[k] > self.stiction[k] else self.stiction[k]
            self.spring[k] = most / self.presliding
            self.rub[k] = sqrt(self.spring[k] * least)
            hard = self.spring[k] + self.cogging[k] * self.cogging_order[k] + self.cable[k] + self.stiff[k]
            self.refuse(
                self.step * self.step * hard > 0.25 * least,
                "step = {step} s is too long for presliding = {presliding} rad, cogging or cable: shorten it",
            )
            self.reach[k] = self.friction[k] / self.spring[k] if most > 0.0 else 0.0
            self.q[k] = self.theta_0[k]
            self.p[k] = self.theta_0[k]
            self.anchor[k] = self.theta_0[k]
        self.hand_over()

    def hand_over(self) -> None:
        self.rate_before = self.omega_b
        self.rise_before = self.alpha_b
        self.f_before = self.f_b

    def driven(self) -> Vector:
        """Return the torques at the motors: pitch, yaw."""
        t = [0.0, 0.0]
        for k in range(2):
            emf = self.k_e[k] * self.dp[k]
            amps = motor_current(0.0, self.i_max[k], self.v[k], self.v_max[k], emf, self.R[k], 0.0)
            t[k] = self.k_t[k] * amps + self.M_load[k] - self.viscous[k] * self.dp[k]
            t[k] = t[k] - self.cable[k] * (self.p[k] - self.cable_rest[k])
            if self.cogging[k] > 0.0:
                t[k] = t[k] - self.cogging[k] * sin(self.cogging_order[k] * self.p[k])
            if self.spring[k] > 0.0:
                deflection = self.p[k] - self.anchor[k]
                t[k] = t[k] - contact_torque(
                    self.spring[k], self.rub[k], self.presliding, self.reach[k],
                    deflection, self.dp[k], self.slipping[k],
                )  # fmt: skip
        return vector(t)

    def flow(self) -> None:
        self.der.q = self.dq
        self.der.p = self.dp
        t = self.driven()
        # 1: of the inner joint, 3: of the outer one
        dq1 = inner(self.form, self.dq)
        dq3 = outer(self.form, self.dq)
        q1 = inner(self.form, self.q)
        q3 = outer(self.form, self.q)
        c3 = cos(q3)
        s3 = sin(q3)
        c1 = cos(q1)
        s1 = sin(q1)
        wb = vector(self.omega_b)
        ab = vector(self.alpha_b)
        y = left(self.t, self.step_start, self.step_end)
        if y > 0.0:
            step = self.step_end - self.step_start
            for k in range(3):
                m = moved_base(y, step, self.rate_before[k], self.rise_before[k], self.omega_b[k], self.alpha_b[k])
                wb[k] = m[0]
                ab[k] = m[1]
        ab = ordered(self.form, ab)
        # rates (row 0) and, with q'' = 0, accelerations (row 1) of both gimbals, then the torques they need
        a = gimbal_z(c3, s3, dq3, 0.0, ordered(self.form, wb), ab)
        b = gimbal_x(c1, s1, dq1, 0.0, a[0], a[1])
        nb = body_torque(self.B, b[1], b[0])
        na = body_torque(self.A, a[1], a[0])
        if self.heavy == 1.0:
            fa = about_z(c3, s3, ordered(self.form, self.f_b - y * (self.f_b - self.f_before)))
            na = with_unbalance(na, self.u[0], fa)
            nb = with_unbalance(nb, self.u[1], about_x(c1, s1, fa))
        dp1 = inner(self.form, self.dp)
        J1 = inner(self.form, self.J_motor)
        J3 = outer(self.form, self.J_motor)
        b3 = na[Z] + s1 * nb[Y] + c1 * nb[Z] - J1 * (a[0][X] + dp1) * a[0][Y]
        m11 = self.B[X][X]
        m13 = s1 * self.B[X][Y] + c1 * self.B[X][Z]
        m33 = self.A[Z][Z] + s1 * s1 * self.B[Y][Y] + 2.0 * s1 * c1 * self.B[Y][Z] + c1 * c1 * self.B[Z][Z]
        t1 = inner(self.form, t)
        t3 = outer(self.form, t)
        k1 = inner(self.form, self.stiff)
        k3 = outer(self.form, self.stiff)
        ddp1 = 0.0
        ddp3 = 0.0
        if k1 > 0.0:
            spring = k1 * (inner(self.form, self.p) - q1) + inner(self.form, self.soft) * (dp1 - dq1)
            ddp1 = (t1 - spring) / J1 - a[1][X]
            t1 = spring
        else:
            t1 = t1 - J1 * a[1][X]
            m11 = m11 + J1
        if k3 > 0.0:
            dp3 = outer(self.form, self.dp)
            spring = k3 * (outer(self.form, self.p) - q3) + outer(self.form, self.soft) * (dp3 - dq3)
            ddp3 = (t3 - spring) / J3 - ab[Z]
            t3 = spring
        else:
            t3 = t3 - J3 * ab[Z]
            m33 = m33 + J3
        t1 = t1 - nb[X]
        t3 = t3 - b3
        det = m11 * m33 - m13 * m13
        ddq1 = (m33 * t1 - m13 * t3) / det
        ddq3 = (m11 * t3 - m13 * t1) / det
        self.der.dq = placed(self.form, ddq1, ddq3)
        self.der.dp = placed(self.form, ddp1 if k1 > 0.0 else ddq1, ddp3 if k3 > 0.0 else ddq3)
        w = ordered(self.form, b[0])
        self.der.star[X] = self.star[Y] * w[Z] - self.star[Z] * w[Y]
        self.der.star[Y] = self.star[Z] * w[X] - self.star[X] * w[Z]
        self.der.star[Z] = self.star[X] * w[Y] - self.star[Y] * w[X]

    @sampled(every=1)
    def tick(self) -> None:
        for k in range(2):
            if self.spring[k] > 0.0:
                moved = contact_moved(
                    self.spring[k], self.rub[k], self.presliding, self.reach[k],
                    self.p[k], self.dp[k], self.anchor[k], self.slipping[k],
                )  # fmt: skip
                self.anchor[k] = moved[0]
                self.slipping[k] = moved[1]
        if self.t >= self.step_end:
            self.hand_over()

    def outputs(self) -> None:
        self.theta = self.p
        self.theta_dot = self.dp
        self.saturated = 0.0
        for k in range(2):
            emf = self.k_e[k] * self.dp[k]
            amps = motor_current(0.0, self.i_max[k], self.v[k], self.v_max[k], emf, self.R[k], 0.0)
            self.i_motor[k] = amps
            if fabs(self.v[k]) > self.v_max[k] or fabs(amps) >= self.i_max[k]:
                self.saturated = 1.0
        q1 = inner(self.form, self.q)
        q3 = outer(self.form, self.q)
        c3 = cos(q3)
        s3 = sin(q3)
        c1 = cos(q1)
        s1 = sin(q1)
        self.keyhole = 1.0 if c1 < self.cos_keyhole else 0.0
        wb = ordered(self.form, self.omega_b)
        ddq3 = outer(self.form, self.der.dq)
        a = gimbal_z(c3, s3, outer(self.form, self.dq), ddq3, wb, ordered(self.form, self.alpha_b))
        b = gimbal_x(c1, s1, inner(self.form, self.dq), inner(self.form, self.der.dq), a[0], a[1])
        self.omega = ordered(self.form, b[0])
        self.alpha = ordered(self.form, b[1])
        self.f = ordered(self.form, about_x(c1, s1, about_z(c3, s3, ordered(self.form, self.f_b))))
        self.los[0] = atan2(-self.star[Z], self.star[Y])
        self.los[1] = atan2(self.star[X], self.star[Y])
