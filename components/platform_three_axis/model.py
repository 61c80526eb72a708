from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Output, Parameter, State, sampled
from gyrobench.component.blocks.platform import (
    AZ,
    NONE,
    PITCH,
    ROLL,
    X,
    Y,
    Z,
    about_x,
    about_y,
    about_z,
    contact_moved,
    contact_torque,
    euler_torque,
    gimbal_x,
    gimbal_y,
    gimbal_z,
    left,
    motor_current,
    motor_slope,
    moved_base,
    rigid,
    turned_on,
    with_unbalance,
)
from gyrobench.component.math import Vector, clip, cos, fabs, minimum, pi, sin, sqrt, vector

ONES = [1.0, 1.0, 1.0]


class PlatformThreeAxis(Component):
    """Stabilized platform with three gimbals: roll outside, pitch, azimuth inside.  [PLATFORM-3AXIS-DYN, -KIN]

    Drives, joint angles q and torques come in A order: (1) x_f pitch, (2) y_r roll, (3) z_a azimuth.  Passive rotations
    from the base, C_b^a = R3(azimuth) R1(pitch) R2(roll); rigid bodies with diagonal inertias about the common centre:

        M(q) q'' + b(q, q', omega_b, alpha_b) = k_t i + M_load + M_bearing + M_stop + (M_gyro and unbalance on the axes)
        L i' = v - R i - k_e q'          |v| <= v_max, |i| <= i_max; an axis with L = 0: i without lag

    b by Newton-Euler: n = I alpha + omega x I omega of each body with q'' = 0, passed outwards; M by the same
    recursion, azimuth eliminated (q_a'' = t_a / I_az + sin(pitch) q_r''), then two equations.  Unbalance: n + u x f,
    u = mass times offset of a body in its own axes.  Rates of the platform [PLATFORM-3AXIS-KIN]:
    omega = T1 omega_A + T3 omega_b.

    omega_b, alpha_b are those of the end of the communication step; within it both follow Hermite's cubic through them
    and those of the step before.

    Bearings as in platform_single_axis: viscous friction and a contact that sticks, elastic to break-away.  The pitch
    gimbal stops at +-pitch_stop on a spring with damping 0.5; `lock` is 1 beyond lock_angle, where sec(pitch) is large.
    A pitch of 90 deg is refused.

    Not modelled: elastic gimbals and shafts, products of inertia, rotors of geared motors (direct drive: their inertia
    belongs to the gimbals), stops of roll and azimuth.
    Source: Xia 2008, section 5.1, eq. 5.1.1-5.1.7; the dynamics are our own model (PLATFORM-3AXIS-DYN).
    """

    version = "1.2.0"
    integrator = "rk4"
    rk4_substeps = 1

    I_r = Parameter([0.8, 0.9, 0.7], "kg.m2", "inertia of the roll gimbal about its axes x, y, z", above=0.0)
    I_f = Parameter([0.4, 0.6, 0.5], "kg.m2", "inertia of the pitch gimbal", above=0.0)
    I_a = Parameter([0.6, 0.5, 0.7], "kg.m2", "inertia of the inner element", above=0.0)
    unbalance = Parameter([NONE, NONE, NONE], "kg.m", "mass times offset of roll, pitch gimbal, inner element: rows")
    viscous = Parameter([0.05, 0.05, 0.05], "N.m.s/rad", "viscous friction, A order", min=0.0)
    friction = Parameter(NONE, "N.m", "Coulomb friction, A order", min=0.0)
    stiction = Parameter(NONE, "N.m", "break-away torque, A order; 0: that of friction", min=0.0)
    presliding = Parameter(5e-5, "rad", "joint angle at break-away", above=0.0)
    pitch_stop = Parameter(85.0 * pi / 180.0, "rad", "stop of the pitch gimbal", above=0.0, max=pi / 2.0 - 1e-3)
    stop_stiffness = Parameter(2e4, "N.m/rad", "its stiffness", above=0.0)
    lock_angle = Parameter(80.0 * pi / 180.0, "rad", "pitch beyond which `lock` is 1", above=0.0, max=pi / 2.0)

    k_t = Parameter(ONES, "N.m/A", "motors: torque constants, A order", above=0.0)
    k_e = Parameter(ONES, "V.s/rad", "motors: back EMF constants, A order", min=0.0)
    R = Parameter([2.0, 2.0, 2.0], "Ohm", "motors: resistances, A order", above=0.0)
    L = Parameter(
        [4e-3, 4e-3, 4e-3], "Ohm.s", "motors: inductances, A order (1 H = 1 Ohm.s); 0: current without lag", min=0.0
    )
    v_max = Parameter([48.0, 48.0, 48.0], "V", "largest voltages, A order", above=0.0)
    i_max = Parameter([24.0, 24.0, 24.0], "A", "largest currents, A order", above=0.0)

    theta_0 = Parameter(NONE, "rad", "joint angles at the start, A order")
    theta_dot_0 = Parameter(NONE, "rad/s", "joint rates at the start, A order")

    v = Input(NONE, "V", "motor voltages, A order")
    M_load = Input(NONE, "N.m", "disturbance torques about the motor axes, A order")
    M_gyro = Input(NONE, "N.m", "torque of the gyros on the inner element, platform axes")
    omega_b = Input(NONE, "rad/s", "inertial rate of the base, base axes")
    alpha_b = Input(NONE, "rad/s2", "its derivative")
    f_b = Input([0.0, 0.0, 9.80665], "m/s2", "specific force, base axes")

    theta = Output("rad", "joint angles, A order", shape=(3,))
    theta_dot = Output("rad/s", "joint rates, A order", shape=(3,))
    omega = Output("rad/s", "inertial rate of the inner element, platform axes", shape=(3,))
    alpha = Output("rad/s2", "its derivative at the end of the step", shape=(3,))
    f = Output("m/s2", "specific force, platform axes", shape=(3,))
    attitude = Output("rad", "integral of omega", shape=(3,))
    i_motor = Output("A", "motor currents at the end of the step, A order", shape=(3,))
    lock = Output("1", "1 beyond lock_angle")
    saturated = Output("1", "1 while a voltage or a current is at its limit")
    at_stop = Output("1", "1 while the pitch gimbal is at its stop")

    q = State(NONE, "rad", "joint angles, A order")
    dq = State(NONE, "rad/s", "joint rates, A order")
    turned = State(NONE, "rad", "integral of the inertial rate, platform axes")
    i = State(NONE, "A", "motor currents, A order")

    flowed = Discrete(NONE, "A", "motor currents without inductance, at the end of the step")
    spring = Discrete(NONE, "N.m/rad", "stiffness of the contacts")
    rub = Discrete(NONE, "N.m.s/rad", "their damping")
    reach = Discrete(NONE, "rad", "way at Coulomb friction")
    anchor = Discrete(NONE, "rad", "where a contact is free of torque")
    slipping = Discrete(NONE, "1", "0 sticking, else the sense of slip")
    rough = Discrete(0.0, "1", "1: there is Coulomb friction")
    heavy = Discrete(0.0, "1", "1: there is unbalance")
    bump = Discrete(0.0, "N.m.s/rad", "damping of the pitch stop")
    pitch = Discrete(0.0, "rad", "pitch, for messages")
    q_kept = Discrete(NONE, "rad", "joint angles at the end of the step before")
    c_kept = Discrete(ONES, "1", "their cosines")
    s_kept = Discrete(NONE, "1", "their sines")
    rate_before = Discrete(NONE, "rad/s", "omega_b at the end of the communication step before")
    rise_before = Discrete(NONE, "rad/s2", "alpha_b then")
    f_before = Discrete(NONE, "m/s2", "f_b then")

    def start(self) -> None:
        self.refuse(not rigid(self.I_r), "I_r is not of a rigid body: no moment may exceed the sum of the others")
        self.refuse(not rigid(self.I_f), "I_f is not of a rigid body: no moment may exceed the sum of the others")
        self.refuse(not rigid(self.I_a), "I_a is not of a rigid body: no moment may exceed the sum of the others")
        least = [0.0, 0.0, 0.0]
        inner = minimum(self.I_a[X], self.I_a[Y])
        least[PITCH] = self.I_f[X] + inner
        least[ROLL] = self.I_r[Y] + minimum(self.I_f[Y] + inner, self.I_f[Z])
        least[AZ] = self.I_a[Z]
        self.rough = 0.0
        self.heavy = 0.0
        for k in range(3):
            short = self.stiction[k] > 0.0 and self.stiction[k] < self.friction[k]
            self.refuse(short, "stiction of an axis must be 0 or at least its friction")
            late = self.L[k] > 0.0 and self.step * self.R[k] > self.L[k]
            self.refuse(late, "step = {step} s must be <= L / R of each motor: shorten it, or take L = 0 for that axis")
            most = self.friction[k] if self.friction[k] > self.stiction[k] else self.stiction[k]
            self.spring[k] = most / self.presliding
            self.rub[k] = sqrt(self.spring[k] * least[k])
            stiff = self.step * self.step * self.spring[k] > 0.25 * least[k]
            self.refuse(stiff, "step = {step} s is too long for presliding = {presliding} rad: shorten it")
            self.reach[k] = self.friction[k] / self.spring[k] if most > 0.0 else 0.0
            self.rough = 1.0 if most > 0.0 else self.rough
            for n in range(3):
                self.heavy = 1.0 if self.unbalance[k][n] != 0.0 else self.heavy
            self.q[k] = self.theta_0[k]
            self.anchor[k] = self.theta_0[k]
            self.dq[k] = self.theta_dot_0[k]
        hard = self.step * self.step * self.stop_stiffness > least[PITCH]
        self.refuse(hard, "step = {step} s is too long for stop_stiffness = {stop_stiffness} N.m/rad: shorten it")
        self.bump = sqrt(self.stop_stiffness * least[PITCH])
        self.pitch = self.theta_0[PITCH]
        beyond = fabs(self.pitch) > self.pitch_stop
        self.refuse(beyond, "theta_0[1] = {pitch} rad must be within the pitch stop, +-{pitch_stop} rad")
        self.hand_over()
        self.keep_angles()

    def keep_angles(self) -> None:
        self.q_kept = self.q
        for k in range(3):
            self.c_kept[k] = cos(self.q[k])
            self.s_kept[k] = sin(self.q[k])

    def joints(self) -> Vector:
        """Return cosine and sine of each joint angle, A order."""
        found = [[0.0, 0.0], [0.0, 0.0], [0.0, 0.0]]
        for k in range(3):
            near = turned_on(self.c_kept[k], self.s_kept[k], self.q[k] - self.q_kept[k])
            found[k][0] = near[0]
            found[k][1] = near[1]
        return vector(found)

    def hand_over(self) -> None:
        self.rate_before = self.omega_b
        self.rise_before = self.alpha_b
        self.f_before = self.f_b

    def flow(self) -> None:
        self.der.q = self.dq
        t = [0.0, 0.0, 0.0]
        for k in range(3):
            emf = self.k_e[k] * self.dq[k]
            amps = motor_current(self.i[k], self.i_max[k], self.v[k], self.v_max[k], emf, self.R[k], self.L[k])
            t[k] = self.k_t[k] * amps + self.M_load[k] - self.viscous[k] * self.dq[k]
            self.der.i[k] = motor_slope(self.i[k], self.i_max[k], self.v[k], self.v_max[k], emf, self.R[k], self.L[k])
            if self.rough == 1.0:
                deflection = self.q[k] - self.anchor[k]
                t[k] = t[k] - contact_torque(
                    self.spring[k],
                    self.rub[k],
                    self.presliding,
                    self.reach[k],
                    deflection,
                    self.dq[k],
                    self.slipping[k],
                )
        over = self.q[PITCH] - clip(self.q[PITCH], -self.pitch_stop, self.pitch_stop)
        if over != 0.0:
            push = self.stop_stiffness * over + self.bump * self.dq[PITCH]
            t[PITCH] = t[PITCH] - (push if push * over > 0.0 else 0.0)  # the stop pushes back, it does not pull

        turn = self.joints()
        cr = turn[ROLL][0]
        sr = turn[ROLL][1]
        cf = turn[PITCH][0]
        sf = turn[PITCH][1]
        ca = turn[AZ][0]
        sa = turn[AZ][1]
        wb = vector(self.omega_b)
        ab = vector(self.alpha_b)
        y = left(self.t, self.step_start, self.step_end)
        if y > 0.0:
            step = self.step_end - self.step_start
            for k in range(3):
                m = moved_base(y, step, self.rate_before[k], self.rise_before[k], self.omega_b[k], self.alpha_b[k])
                wb[k] = m[0]
                ab[k] = m[1]
        # rates (row 0) and, with q'' = 0, accelerations (row 1) of roll gimbal, pitch gimbal, inner element
        r = gimbal_y(cr, sr, self.dq[ROLL], 0.0, wb, ab)
        g = gimbal_x(cf, sf, self.dq[PITCH], 0.0, r[0], r[1])
        p = gimbal_z(ca, sa, self.dq[AZ], 0.0, g[0], g[1])
        # torques each body needs, passed outwards
        n = euler_torque(self.I_a, p[1], p[0]) - self.M_gyro
        nf = euler_torque(self.I_f, g[1], g[0])
        nr = euler_torque(self.I_r, r[1], r[0])
        if self.heavy == 1.0:
            fr = about_y(cr, sr, self.f_b - y * (self.f_b - self.f_before))
            ff = about_x(cf, sf, fr)
            n = with_unbalance(n, self.unbalance[2], about_z(ca, sa, ff))
            nf = with_unbalance(nf, self.unbalance[1], ff)
            nr = with_unbalance(nr, self.unbalance[0], fr)
        nf[X] = nf[X] + ca * n[X] - sa * n[Y]
        nf[Y] = nf[Y] + sa * n[X] + ca * n[Y]
        nf[Z] = nf[Z] + n[Z]
        nr[Y] = nr[Y] + cf * nf[Y] - sf * nf[Z]
        tp = t[PITCH] - nf[X]
        ta = t[AZ] - n[Z]
        tr = t[ROLL] - nr[Y] + sf * ta
        # M: pitch, roll without what the azimuth takes up, and between the two
        mp = self.I_f[X] + ca * ca * self.I_a[X] + sa * sa * self.I_a[Y]
        mr = self.I_r[Y] + cf * cf * (self.I_f[Y] + sa * sa * self.I_a[X] + ca * ca * self.I_a[Y])
        mr = mr + sf * sf * self.I_f[Z]
        mpr = cf * sa * ca * (self.I_a[X] - self.I_a[Y])
        det = mp * mr - mpr * mpr
        ddr = (mp * tr - mpr * tp) / det
        self.der.dq[PITCH] = (mr * tp - mpr * tr) / det
        self.der.dq[ROLL] = ddr
        self.der.dq[AZ] = ta / self.I_a[Z] + sf * ddr
        self.der.turned = p[0]

    @sampled(every=1)
    def tick(self) -> None:
        self.pitch = self.q[PITCH]
        through = fabs(self.pitch) >= pi / 2.0 - 1e-3
        self.refuse(through, "pitch = {pitch} rad, through its stop at {pitch_stop} rad: it must stay below 1.5698 rad")
        for k in range(3):
            self.i[k] = clip(self.i[k], -self.i_max[k], self.i_max[k])
            if self.L[k] == 0.0:
                emf = self.k_e[k] * self.dq[k]
                self.flowed[k] = motor_current(0.0, self.i_max[k], self.v[k], self.v_max[k], emf, self.R[k], 0.0)
            if self.spring[k] > 0.0:
                moved = contact_moved(
                    self.spring[k], self.rub[k], self.presliding, self.reach[k],
                    self.q[k], self.dq[k], self.anchor[k], self.slipping[k],
                )  # fmt: skip
                self.anchor[k] = moved[0]
                self.slipping[k] = moved[1]
        self.keep_angles()
        if self.t >= self.step_end:
            self.hand_over()

    def outputs(self) -> None:
        self.theta = self.q
        self.theta_dot = self.dq
        self.attitude = self.turned
        self.saturated = 0.0
        for k in range(3):
            emf = self.k_e[k] * self.dq[k]
            amps = motor_current(self.i[k], self.i_max[k], self.v[k], self.v_max[k], emf, self.R[k], self.L[k])
            # not of the present v: a current loop could not be ordered
            self.i_motor[k] = self.i[k] if self.L[k] > 0.0 else self.flowed[k]
            if fabs(self.v[k]) >= self.v_max[k] or fabs(amps) >= self.i_max[k]:
                self.saturated = 1.0
        self.lock = 1.0 if fabs(self.q[PITCH]) > self.lock_angle else 0.0
        self.at_stop = 1.0 if fabs(self.q[PITCH]) > self.pitch_stop else 0.0
        turn = self.joints()
        cr = turn[ROLL][0]
        sr = turn[ROLL][1]
        cf = turn[PITCH][0]
        sf = turn[PITCH][1]
        ca = turn[AZ][0]
        sa = turn[AZ][1]
        r = gimbal_y(cr, sr, self.dq[ROLL], self.der.dq[ROLL], self.omega_b, self.alpha_b)
        g = gimbal_x(cf, sf, self.dq[PITCH], self.der.dq[PITCH], r[0], r[1])
        p = gimbal_z(ca, sa, self.dq[AZ], self.der.dq[AZ], g[0], g[1])
        self.omega = p[0]
        self.alpha = p[1]
        self.f = about_z(ca, sa, about_x(cf, sf, about_y(cr, sr, self.f_b)))
