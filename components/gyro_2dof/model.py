from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Noise, Output, Parameter, State, sampled
from gyrobench.component.math import clip, cos, exp, fabs, pi, sin, sqrt

DEG_H = pi / 180.0 / 3600.0  # 1 deg/h in rad/s
IDENTITY = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]


class Gyro2dof(Component):
    """Free two-degree-of-freedom gyro with two pickoffs and two torquers.  [GYRO-DYN-2DOF, GYRO-STATIC-2DOF]

    Axes x, y, z are outer gimbal axis, inner gimbal axis, spin (H along +z), those of the mount: v_gyro = mount v_case.
    psi = angles of the rotor axis against the case, small; each torquer precesses the rotor about the OTHER axis:

        psi_x' = -omega_x + omega_z psi_y + omega_dx + k_y i_y (1 + k2_y i_y + k3_y i_y2)
        psi_y' = -omega_y - omega_z psi_x + omega_dy + k_x i_x (1 + k2_x i_x + k3_x i_x2)
        u_x = -K_sg_x psi_x + noise,  u_y = -K_sg_y psi_y + noise,  limited to +-u_max

    Wiring rule: the torquer that nulls u_x acts about y and is fed by i_y, that of u_y is fed by i_x.  u is the angle
    of the case against the rotor (K psi of GYRO-DYN-2DOF with its sign turned), so that a rebalance or a servo of
    positive gain closes the loop, as with floated_gyro.  In its steady state psi = 0 and, exactly,

        k_y i_y (1 + ...) = omega_x - omega_dx,     k_x i_x (1 + ...) = omega_y - omega_dy             [MEAS-REBALANCE]

    Drift of channel c = x, y in precession sign, (X, Y, Z) = -f/g0 along x, y, z, g0 = 9.80665 m/s2   [2-29..2-46]

        omega_dc = Dc_0 + Dc_x X + Dc_y Y + Dc_z Z + Dc_xx X2 + Dc_yy Y2 + Dc_zz Z2 + Dc_xy X Y + Dc_yz Y Z + Dc_xz X Z
                   + turn-on constant + Gauss-Markov + white

    Dx_x = -m l_z/H is of the torque about the inner axis, Dy_y of that about the outer axis: it contains the outer
    gimbal, so the two differ (u_zy and u_zx of Hu 1981).  `terms_x`, `terms_y` say which model is meant; a coefficient
    outside it must be 0.  x channel: 8 = 0, x, z, xx, zz, xy, yz, xz; 9 = 8 + y; 10 = 9 + yy.  y channel: the same with
    x and y exchanged.  Gauss-Markov and noise as in floated_gyro, each channel its own.

    Nutation, with J_x, J_y > 0 (0 and 0: none, the rotor precesses at once).  p, q = inertial rates of the rotor axis:

        J_x p' = -H q - C_x (p - omega_x) + T_x + M_x,     T_x = +H (omega_dy + k_x i_x (1 + ...))
        J_y q' = +H p - C_y (q - omega_y) + T_y + M_y,     T_y = -H (omega_dx + k_y i_y (1 + ...))
        psi_x' = p - omega_x + omega_z psi_y,              psi_y' = q - omega_y - omega_z psi_x

    undamped frequency H / sqrt(J_x J_y).  p and q are inertial: an angular acceleration of the case is no input.
    M_x, M_y are torques from outside on outer and inner gimbal (without nutation they precess: M_x / H, -M_y / H).

    Gimbals at full size, full = 1: a platform on the outer gimbal (power gyro, J_x with the load) [STAB-POWER-2DOF].
    alpha = psi_x and beta = psi_y are then the angles of the gimbals, p the inertial rate of the outer one about x,
    q that of the inner one about y, w = omega turned by alpha about x (the rate of the outer gimbal's y and z axes):

        J_x p' = -H q cos(beta) - C_x alpha' + T_x + M_x                  alpha' = p - omega_x
        J_y q' = +H (p cos(beta) - w_z sin(beta)) - C_y beta' + T_y + M_y  beta' = q - w_y

    M_react = torque of the gyro on its mount, case axes: dampers and torquers about x and y, and the constraint
    H q sin(beta) about the z axis of the outer gimbal.  The run ends where |beta| reaches `stop`.

    Not modelled: small angles with full = 0; with full = 1 change of J_x with beta, inertia about z, coupling of the
    base's acceleration through the inertias; torquer axis error, the share of omega_z in the angular momentum, ageing
    and temperature, vibration, hysteresis, warm-up.
    Source: Hu 1981, ch. 2 and 3 (wiring rule of 3.6); the dynamics are our own minimal model (GYRO-DYN-2DOF);
    the power gyro GSP ch. 5, section 5.1.1, eq. 5-7, 5-8.
    """

    version = "1.1.0"
    nonlinear = "full"

    K_sg_x = Parameter(10.0, "V/rad", "gain of the x pickoff", above=0.0)
    K_sg_y = Parameter(10.0, "V/rad", "gain of the y pickoff", above=0.0)
    u_max = Parameter(0.1, "V", "saturation of the pickoffs", above=0.0)
    k_x = Parameter(17.227e3 * DEG_H, "rad/s/A", "scale factor of the torquer about x (17.227 deg/h/mA)", above=0.0)
    k_y = Parameter(17.180e3 * DEG_H, "rad/s/A", "scale factor of the torquer about y (17.180 deg/h/mA)", above=0.0)
    k2_x = Parameter(0.0, "1/A", "nonlinearity of the torquer about x, relative, even in the rate")
    k3_x = Parameter(0.0, "1/A2", "nonlinearity of the torquer about x, relative, odd in the rate")
    k2_y = Parameter(0.0, "1/A", "nonlinearity of the torquer about y, relative, even in the rate")
    k3_y = Parameter(0.0, "1/A2", "nonlinearity of the torquer about y, relative, odd in the rate")
    mount = Parameter(IDENTITY, "1", "rows: gyro axes x, y, z in case axes")

    H = Parameter(0.2, "N.m.s", "spin angular momentum", above=0.0)
    J_x = Parameter(0.0, "kg.m2", "inertia of rotor and both gimbals about x; 0: no nutation", min=0.0)
    J_y = Parameter(0.0, "kg.m2", "inertia of rotor and inner gimbal about y; 0: no nutation", min=0.0)
    C_x = Parameter(0.0, "N.m.s/rad", "damping about x, rotor against case (with nutation)", min=0.0)
    C_y = Parameter(0.0, "N.m.s/rad", "damping about y, rotor against case (with nutation)", min=0.0)

    full = Parameter(False, bool, "gimbal angles: 0 small, 1 at full size (with nutation)")
    stop = Parameter(0.0, "rad", "stop of the inner gimbal: the run ends there (0: none)", min=0.0)

    terms_x = Parameter(9, int, "terms of the x channel: 8, 9 or 10")
    Dx_0 = Parameter(-0.3 * DEG_H, "rad/s", "x channel, constant drift (-0.3 deg/h)")
    Dx_x = Parameter(-0.9 * DEG_H, "rad/s", "x channel, per g0 along x, mass unbalance along z (-0.9 deg/h/g)")
    Dx_y = Parameter(0.1 * DEG_H, "rad/s", "x channel, per g0 along y, empirical (0.1 deg/h/g)")
    Dx_z = Parameter(-0.7 * DEG_H, "rad/s", "x channel, per g0 along z, mass unbalance along x (-0.7 deg/h/g)")
    Dx_xx = Parameter(-0.05 * DEG_H, "rad/s", "x channel, per g0 squared along x (-0.05 deg/h/g2)")
    Dx_yy = Parameter(0.0, "rad/s", "x channel, per g0 squared along y, empirical")
    Dx_zz = Parameter(0.04 * DEG_H, "rad/s", "x channel, per g0 squared along z (0.04 deg/h/g2)")
    Dx_xy = Parameter(-0.03 * DEG_H, "rad/s", "x channel, per g0 squared, x and y (-0.03 deg/h/g2)")
    Dx_yz = Parameter(-0.02 * DEG_H, "rad/s", "x channel, per g0 squared, y and z (-0.02 deg/h/g2)")
    Dx_xz = Parameter(-0.15 * DEG_H, "rad/s", "x channel, per g0 squared, anisoelasticity (-0.15 deg/h/g2)")

    terms_y = Parameter(9, int, "terms of the y channel: 8, 9 or 10")
    Dy_0 = Parameter(0.4 * DEG_H, "rad/s", "y channel, constant drift (0.4 deg/h)")
    Dy_x = Parameter(-0.08 * DEG_H, "rad/s", "y channel, per g0 along x, empirical (-0.08 deg/h/g)")
    Dy_y = Parameter(-1.0 * DEG_H, "rad/s", "y channel, per g0 along y, unbalance with outer gimbal (-1 deg/h/g)")
    Dy_z = Parameter(0.8 * DEG_H, "rad/s", "y channel, per g0 along z, mass unbalance along y (0.8 deg/h/g)")
    Dy_xx = Parameter(0.0, "rad/s", "y channel, per g0 squared along x, empirical")
    Dy_yy = Parameter(-0.03 * DEG_H, "rad/s", "y channel, per g0 squared along y (-0.03 deg/h/g2)")
    Dy_zz = Parameter(0.03 * DEG_H, "rad/s", "y channel, per g0 squared along z (0.03 deg/h/g2)")
    Dy_xy = Parameter(-0.05 * DEG_H, "rad/s", "y channel, per g0 squared, x and y (-0.05 deg/h/g2)")
    Dy_yz = Parameter(-0.12 * DEG_H, "rad/s", "y channel, per g0 squared, anisoelasticity (-0.12 deg/h/g2)")
    Dy_xz = Parameter(-0.02 * DEG_H, "rad/s", "y channel, per g0 squared, x and z (-0.02 deg/h/g2)")

    turn_on_x = Noise(0.0, "rad/s", "rms of the turn-on drift of the x channel, one value a run", per="start")
    turn_on_y = Noise(0.0, "rad/s", "rms of the turn-on drift of the y channel, one value a run", per="start")
    markov_x = Noise(0.002 * DEG_H, "rad/s", "rms of the Gauss-Markov drift, x channel (0.002 deg/h)", per="step")
    markov_y = Noise(0.002 * DEG_H, "rad/s", "rms of the Gauss-Markov drift, y channel (0.002 deg/h)", per="step")
    markov_tau = Parameter(300.0, "s", "correlation time of the Gauss-Markov drifts", above=0.0)
    white_x = Noise(0.0178 * DEG_H, "rad/s/sqrt(Hz)", "white drift density, x channel (0.0178 deg/h/sqrt(Hz))")
    white_y = Noise(0.0178 * DEG_H, "rad/s/sqrt(Hz)", "white drift density, y channel (0.0178 deg/h/sqrt(Hz))")
    pickoff_x = Noise(5e-8, "V/sqrt(Hz)", "noise density of the x pickoff")
    pickoff_y = Noise(5e-8, "V/sqrt(Hz)", "noise density of the y pickoff")

    omega = Input([0.0, 0.0, 0.0], "rad/s", "inertial rate, case axes")
    f = Input([0.0, 0.0, 0.0], "m/s2", "specific force a - G, case axes")
    i_x = Input(0.0, "A", "current of the torquer about x (nulls u_y)")
    i_y = Input(0.0, "A", "current of the torquer about y (nulls u_x)")
    M_x = Input(0.0, "N.m", "torque from outside on the outer gimbal about x")
    M_y = Input(0.0, "N.m", "torque from outside on the inner gimbal about y")

    u_x = Output("V", "x pickoff: case against rotor about x")
    u_y = Output("V", "y pickoff: case against rotor about y")
    drift_x = Output("rad/s", "drift rate omega_dx, precession sign")
    drift_y = Output("rad/s", "drift rate omega_dy, precession sign")
    saturated = Output("1", "1 while a pickoff is saturated")
    alpha = Output("rad", "angle of the outer gimbal, psi_x")
    beta = Output("rad", "angle of the inner gimbal, psi_y")
    M_react = Output("N.m", "torque of the gyro on its mount, case axes", shape=(3,))

    psi_x = State(0.0, "rad", "angle of the rotor axis against the case about x")
    psi_y = State(0.0, "rad", "angle of the rotor axis against the case about y")
    p = State(0.0, "rad/s", "inertial rate of the rotor axis about x (with nutation)")
    q = State(0.0, "rad/s", "inertial rate of the rotor axis about y (with nutation)")

    wander_x = Discrete(0.0, "rad/s", "Gauss-Markov drift, x channel")
    wander_y = Discrete(0.0, "rad/s", "Gauss-Markov drift, y channel")
    decay = Discrete(0.0, "1", "decay in one internal step")
    fresh = Discrete(0.0, "1", "size of the innovation")
    h_last = Discrete(0.0, "s", "internal step they were made for")
    per_g = Discrete(0.0, "s2/m", "-1 / g0")
    per_h = Discrete(0.0, "1/(N.m.s)", "1 / H")

    def start(self) -> None:
        n = self.terms_x
        self.refuse(
            not (n == 8.0 or n == 9.0 or n == 10.0),
            "terms_x = {terms_x} is no static model of a channel: it must be 8, 9 or 10",
        )
        self.refuse(n < 9.0 and self.Dx_y != 0.0, "Dx_y must be 0 with terms_x = {terms_x} (from 9 on)")
        self.refuse(n < 10.0 and self.Dx_yy != 0.0, "Dx_yy must be 0 with terms_x = {terms_x} (from 10 on)")
        n = self.terms_y
        self.refuse(
            not (n == 8.0 or n == 9.0 or n == 10.0),
            "terms_y = {terms_y} is no static model of a channel: it must be 8, 9 or 10",
        )
        self.refuse(n < 9.0 and self.Dy_x != 0.0, "Dy_x must be 0 with terms_y = {terms_y} (from 9 on)")
        self.refuse(n < 10.0 and self.Dy_xx != 0.0, "Dy_xx must be 0 with terms_y = {terms_y} (from 10 on)")
        self.refuse(
            (self.J_x > 0.0) != (self.J_y > 0.0),
            "J_x = {J_x} and J_y = {J_y} kg.m2: give both (nutation) or neither",
        )
        self.refuse(
            self.J_x == 0.0 and (self.C_x > 0.0 or self.C_y > 0.0),
            "C_x and C_y must be 0 without nutation (J_x = J_y = 0)",
        )
        self.refuse(
            self.full and self.J_x == 0.0,
            "full = 1 (gimbals at full size) needs nutation: J_x and J_y above 0 kg.m2",
        )
        self.refuse(self.stop >= 0.5 * pi, "stop = {stop} rad: the inner gimbal must stop before pi/2 (gimbal lock)")
        for i in range(3):
            for j in range(3):
                dot = 0.0 if i != j else -1.0
                for m in range(3):
                    dot = dot + self.mount[i][m] * self.mount[j][m]
                self.refuse(
                    fabs(dot) > 1e-9,
                    "mount is no rotation: its rows must be unit vectors at right angles, to 1e-9",
                )
        det = self.mount[0][0] * (self.mount[1][1] * self.mount[2][2] - self.mount[1][2] * self.mount[2][1])
        det = det - self.mount[0][1] * (self.mount[1][0] * self.mount[2][2] - self.mount[1][2] * self.mount[2][0])
        det = det + self.mount[0][2] * (self.mount[1][0] * self.mount[2][1] - self.mount[1][1] * self.mount[2][0])
        self.refuse(det < 0.0, "mount is left-handed (determinant -1): reverse one row")
        self.per_g = -1.0 / 9.80665
        self.per_h = 1.0 / self.H
        self.wander_x = self.noise.markov_x
        self.wander_y = self.noise.markov_y
        self.h_last = 0.0

    def static_x(self, x, y, z):
        along_x = self.Dx_x + self.Dx_xx * x + self.Dx_xy * y + self.Dx_xz * z
        along_y = self.Dx_y + self.Dx_yy * y + self.Dx_yz * z
        along_z = self.Dx_z + self.Dx_zz * z
        return self.Dx_0 + along_x * x + along_y * y + along_z * z

    def static_y(self, x, y, z):
        along_x = self.Dy_x + self.Dy_xx * x + self.Dy_xy * y + self.Dy_xz * z
        along_y = self.Dy_y + self.Dy_yy * y + self.Dy_yz * z
        along_z = self.Dy_z + self.Dy_zz * z
        return self.Dy_0 + along_x * x + along_y * y + along_z * z

    def flow(self) -> None:
        w = [0.0, 0.0, 0.0]
        g = [0.0, 0.0, 0.0]
        for j in range(3):
            row = self.mount[j][0] * self.omega[0] + self.mount[j][1] * self.omega[1]
            w[j] = row + self.mount[j][2] * self.omega[2]
            row = self.mount[j][0] * self.f[0] + self.mount[j][1] * self.f[1]
            g[j] = self.per_g * (row + self.mount[j][2] * self.f[2])
        drift_x = self.static_x(g[0], g[1], g[2]) + self.noise.turn_on_x + self.wander_x + self.noise.white_x
        drift_y = self.static_y(g[0], g[1], g[2]) + self.noise.turn_on_y + self.wander_y + self.noise.white_y
        rate_x = drift_x + self.k_y * self.i_y * (1.0 + self.k2_y * self.i_y + self.k3_y * self.i_y * self.i_y)
        rate_y = drift_y + self.k_x * self.i_x * (1.0 + self.k2_x * self.i_x + self.k3_x * self.i_x * self.i_x)
        self.der.p = 0.0
        self.der.q = 0.0
        if self.full:
            c = cos(self.psi_y)
            w_y = w[1] * cos(self.psi_x) + w[2] * sin(self.psi_x)
            w_z = w[2] * cos(self.psi_x) - w[1] * sin(self.psi_x)
            outer = self.H * (rate_y - self.q * c) - self.C_x * (self.p - w[0])
            inner = self.H * (self.p * c - w_z * sin(self.psi_y) - rate_x) - self.C_y * (self.q - w_y)
            self.der.p = (outer + self.M_x) / self.J_x
            self.der.q = (inner + self.M_y) / self.J_y
            self.der.psi_x = self.p - w[0]
            self.der.psi_y = self.q - w_y
        else:
            if self.J_x > 0.0:
                self.der.p = (self.H * (rate_y - self.q) - self.C_x * (self.p - w[0]) + self.M_x) / self.J_x
                self.der.q = (self.H * (self.p - rate_x) - self.C_y * (self.q - w[1]) + self.M_y) / self.J_y
                rate_x = self.p
                rate_y = self.q
            else:
                rate_x = rate_x - self.per_h * self.M_y
                rate_y = rate_y + self.per_h * self.M_x
            self.der.psi_x = rate_x - w[0] + w[2] * self.psi_y
            self.der.psi_y = rate_y - w[1] - w[2] * self.psi_x

    @sampled(every=1)
    def tick(self) -> None:
        if self.h != self.h_last:
            self.decay = exp(-self.h / self.markov_tau)
            self.fresh = sqrt(1.0 - self.decay * self.decay)
            self.h_last = self.h
        self.wander_x = self.decay * self.wander_x + self.fresh * self.noise.markov_x
        self.wander_y = self.decay * self.wander_y + self.fresh * self.noise.markov_y
        if self.full or self.stop > 0.0:
            limit = self.stop if self.stop > 0.0 else 0.5 * pi
            self.refuse(fabs(self.psi_y) >= limit, "the inner gimbal has reached its stop: beta = {psi_y} rad")

    def outputs(self) -> None:
        w = [0.0, 0.0, 0.0]
        g = [0.0, 0.0, 0.0]
        for j in range(3):
            row = self.mount[j][0] * self.omega[0] + self.mount[j][1] * self.omega[1]
            w[j] = row + self.mount[j][2] * self.omega[2]
            row = self.mount[j][0] * self.f[0] + self.mount[j][1] * self.f[1]
            g[j] = self.per_g * (row + self.mount[j][2] * self.f[2])
        self.drift_x = self.static_x(g[0], g[1], g[2]) + self.noise.turn_on_x + self.wander_x + self.noise.white_x
        self.drift_y = self.static_y(g[0], g[1], g[2]) + self.noise.turn_on_y + self.wander_y + self.noise.white_y
        wish_x = -self.K_sg_x * self.psi_x + self.noise.pickoff_x
        wish_y = -self.K_sg_y * self.psi_y + self.noise.pickoff_y
        self.u_x = clip(wish_x, -self.u_max, self.u_max)
        self.u_y = clip(wish_y, -self.u_max, self.u_max)
        self.saturated = 1.0 if self.u_x != wish_x or self.u_y != wish_y else 0.0
        self.alpha = self.psi_x
        self.beta = self.psi_y
        rate_x = self.drift_x + self.k_y * self.i_y * (1.0 + self.k2_y * self.i_y + self.k3_y * self.i_y * self.i_y)
        rate_y = self.drift_y + self.k_x * self.i_x * (1.0 + self.k2_x * self.i_x + self.k3_x * self.i_x * self.i_x)
        q = self.q if self.J_x > 0.0 else rate_y + self.per_h * self.M_x
        c = 1.0
        s = self.psi_x
        tilt = self.psi_y
        rate = w[1]  # of the outer gimbal about y
        if self.full:
            c = cos(self.psi_x)
            s = sin(self.psi_x)
            tilt = sin(self.psi_y)
            rate = c * w[1] + s * w[2]
        # axes of the outer gimbal: bearing x, bearing y of the inner gimbal, constraint about z
        m_x = -self.H * rate_y
        m_y = self.H * rate_x
        m_z = self.H * q * tilt
        if self.J_x > 0.0:
            m_x = m_x + self.C_x * (self.p - w[0])
            m_y = m_y + self.C_y * (q - rate)
        side = c * m_y - s * m_z
        m_z = s * m_y + c * m_z
        for j in range(3):
            self.M_react[j] = self.mount[0][j] * m_x + self.mount[1][j] * side + self.mount[2][j] * m_z
