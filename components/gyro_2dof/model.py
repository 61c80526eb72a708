from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Noise, Output, Parameter, Rotation, State, sampled
from gyrobench.component.blocks.gyro import DEG_H, PER_G, ChannelDrift, GaussMarkov, torquer_rate
from gyrobench.component.blocks.random_drift import Flicker, Quantization, RateRandomWalk
from gyrobench.component.math import Number, Vector, clip, cos, fabs, pi, sin, vector
from gyrobench.component.set_up import GYRO_MOUNT, turned


class Gyro2dof(Component):
    """Free two-degree-of-freedom gyro with two pickoffs and two torquers.  [GYRO-DYN-2DOF, GYRO-STATIC-2DOF]

    Axes x, y, z are outer gimbal axis, inner gimbal axis, spin (H along +z), those of the mount: v_gyro = mount v_case.
    psi = angles of the rotor axis against the case, small; each torquer precesses the rotor about the OTHER axis:

        psi_x' = -omega_x + omega_z psi_y + omega_dx + k_y i_y (1 + k2_y i_y + k3_y i_y2)
        psi_y' = -omega_y - omega_z psi_x + omega_dy + k_x i_x (1 + k2_x i_x + k3_x i_x2)
        u_x = -K_sg_x (psi_x - null_x) + noise,  u_y = -K_sg_y (psi_y - null_y) + noise,  limited to +-u_max

    Wiring rule: the torquer that nulls u_x acts about y and is fed by i_y, that of u_y is fed by i_x.  u is the angle
    of the case against the rotor (K psi of GYRO-DYN-2DOF with its sign turned), so that a rebalance or a servo of
    positive gain closes the loop, as with floated_gyro.  In its steady state psi = 0 and, exactly,

        k_y i_y (1 + ...) = omega_x - omega_dx,     k_x i_x (1 + ...) = omega_y - omega_dy             [MEAS-REBALANCE]

    Drift of channel c = x, y in precession sign, (X, Y, Z) = -f/g0 along x, y, z, g0 = 9.80665 m/s2   [2-29..2-46]

        omega_dc = Dc_0 + Dc_x X + Dc_y Y + Dc_z Z + Dc_xx X2 + Dc_yy Y2 + Dc_zz Z2 + Dc_xy X Y + Dc_yz Y Z + Dc_xz X Z
                   + turn-on constant + Gauss-Markov + white
                   + flicker + random walk + ramp t + quantization                              [DRIFT-RANDOM-ALLAN]

    Dx_x = -m l_z/H is of the torque about the inner axis, Dy_y of that about the outer axis: it contains the outer
    gimbal, so the two differ (u_zy and u_zx of Hu 1981).  `terms_x`, `terms_y` say which model is meant; a coefficient
    outside it must be 0.  x channel: 8 = 0, x, z, xx, zz, xy, yz, xz; 9 = 8 + y; 10 = 9 + yy.  y channel: the same with
    x and y exchanged.  Gauss-Markov and noise as in floated_gyro, each channel its own.

    Springs of a flexure, or the gas of a bearing, precess a rotor that stands off its null      [GYRO-POSITION]

        psi_x' = ... + K_q psi_y - K_phi psi_x        psi_y' = ... - K_q psi_x - K_phi psi_y

    Ageing, temperature and translation of the float, T = age + time, as in floated_gyro (dT_j: temperature difference
    between the ends along j, v_j: velocity of the float against the case)          [GYRO-COEFF-TIME-TEMP, 2-39..2-42]

        Dc_0 (1 + p0 T) + Dc_vx v_x + Dc_vy v_y + Dc_vz v_z     for Dc_0,      Dc_j (1 + pj T) + th_j     for Dc_j with
        x channel: th_x = +Dx_Tx dT_z,  th_y = -Dx_Ty dT_y,  th_z = -Dx_Tz dT_x
        y channel: th_y = +Dy_Ty dT_z,  th_x = -Dy_Tx dT_x,  th_z = -Dy_Tz dT_y

    The y channel is the x channel with (I, O, S) = (y, -x, z): along -x both X and dT_x change sign.

    Surroundings add Dc_T T_m + Dc_B . B + Dc_dB . dB to omega_dc, and k_c becomes k_c (1 + k_T_c T_m); T_m (input
    `temperature`): mean temperature above that of the coefficients, B, dB: magnetic field and its differences over the
    gyro along x, y, z                                                                              [ENV-DISTURBANCE]

    Supplies off their nominal values: wheel frequency f, voltage v, phases p (rad), excitation of pickoffs e and of
    torquers a.  H -> H (1 + f), while torques stay, so that all these rates are divided by (1 + f); k_c -> k_c (1 + k_E
    a), K_sg_c -> K_sg_c (1 + e), and in the coefficients of a channel, j its own axis,              [GYRO-SUPPLY]

        Dc_0 + Dc_pickoff ((1 + e)2 - 1) + Dc_torquer ((1 + a)2 - 1)
        Dc_j + Dc_voltage v + Dc_phase p,   Dc_z + Dc_voltage_z v + Dc_phase_z p

    Nutation, with J_x, J_y > 0 (0 and 0: none, the rotor precesses without lag).  p, q: inertial rates of rotor axis:

        J_x p' = -H q - C_x (p - omega_x) + T_x + M_x,     T_x = +H (omega_dy + k_x i_x (1 + ...))
        J_y q' = +H p - C_y (q - omega_y) + T_y + M_y,     T_y = -H (omega_dx + k_y i_y (1 + ...))
        psi_x' = p - omega_x + omega_z psi_y,              psi_y' = q - omega_y - omega_z psi_x

    undamped frequency H / sqrt(J_x J_y).  p and q are inertial: no torque comes from an acceleration of the case.
    Within a communication step the case turns with omega + alpha_b (t - end of the step), alpha_b = 0: omega held.
    M_x, M_y are torques from outside on outer and inner gimbal (without nutation they precess: M_x / H, -M_y / H).

    Gimbals at full size, full = 1: a platform on the outer gimbal (power gyro, J_x with the load) [STAB-POWER-2DOF].
    alpha = psi_x and beta = psi_y are then the angles of the gimbals, p the inertial rate of the outer one about x,
    q that of the inner one about y, w = omega turned by alpha about x (the rate of the outer gimbal's y and z axes):

        J_x p' = -H q cos(beta) - C_x alpha' + T_x + M_x                  alpha' = p - omega_x
        J_y q' = +H (p cos(beta) - w_z sin(beta)) - C_y beta' + T_y + M_y  beta' = q - w_y

    M_react = torque of the gyro on its mount, case axes: dampers and torquers about x and y, and the constraint
    H q sin(beta) about the z axis of the outer gimbal.  The run ends where |beta| reaches `stop`.

    Not modelled: small angles with full = 0; springs that differ between the axes; with full = 1 change of J_x with
    beta, inertia about z, coupling of the base's acceleration through the inertias; torquer axis error, the share of
    omega_z in the angular momentum, how the float comes to move (v_float), vibration, hysteresis, warm-up.
    Source: Hu 1981, ch. 2 and 3 (wiring rule of 3.6), eq. 5-68; the dynamics are our own minimal model (GYRO-DYN-2DOF);
    the power gyro GSP ch. 5, section 5.1.1, eq. 5-7, 5-8.
    """

    version = "1.7.0"
    nonlinear = "full"
    integrator = "midpoint"

    K_sg_x = Parameter(10.0, "V/rad", "gain of the x pickoff", above=0.0)
    K_sg_y = Parameter(10.0, "V/rad", "gain of the y pickoff", above=0.0)
    u_max = Parameter(0.1, "V", "saturation of the pickoffs", above=0.0)
    null_x = Parameter(0.0, "rad", "angle of the rotor about x at which the x pickoff reads 0")
    null_y = Parameter(0.0, "rad", "angle of the rotor about y at which the y pickoff reads 0")
    K_q = Parameter(0.0, "1/s", "quadrature stiffness: drift about one axis by the angle about the other")
    K_phi = Parameter(0.0, "1/s", "in-phase stiffness: drift about an axis by the angle about it", min=0.0)
    k_x = Parameter(17.227e3 * DEG_H, "rad/s/A", "scale factor of the torquer about x (17.227 deg/h/mA)", above=0.0)
    k_y = Parameter(17.180e3 * DEG_H, "rad/s/A", "scale factor of the torquer about y (17.180 deg/h/mA)", above=0.0)
    k2_x = Parameter(0.0, "1/A", "nonlinearity of the torquer about x, relative, even in the rate")
    k3_x = Parameter(0.0, "1/A2", "nonlinearity of the torquer about x, relative, odd in the rate")
    k2_y = Parameter(0.0, "1/A", "nonlinearity of the torquer about y, relative, even in the rate")
    k3_y = Parameter(0.0, "1/A2", "nonlinearity of the torquer about y, relative, odd in the rate")
    k_T_x = Parameter(0.0, "1/K", "scale factor of the torquer about x per kelvin of mean temperature, relative")
    k_T_y = Parameter(0.0, "1/K", "scale factor of the torquer about y per kelvin of mean temperature, relative")
    k_E = Parameter(0.0, "1", "share of the excitation in the torquers' constants; 0: permanent magnets, 1: microsyns")
    simulates = (turned("mount", GYRO_MOUNT),)
    mount = Rotation("rows: gyro axes x, y, z in case axes")

    H = Parameter(0.2, "N.m.s", "spin angular momentum", above=0.0)
    J_x = Parameter(0.0, "kg.m2", "inertia of rotor and both gimbals about x; 0: no nutation", min=0.0)
    J_y = Parameter(0.0, "kg.m2", "inertia of rotor and inner gimbal about y; 0: no nutation", min=0.0)
    C_x = Parameter(0.0, "N.m.s/rad", "damping about x, rotor against case (with nutation)", min=0.0)
    C_y = Parameter(0.0, "N.m.s/rad", "damping about y, rotor against case (with nutation)", min=0.0)

    full = Parameter(False, bool, "gimbal angles: 0 small, 1 at full size (with nutation)")
    stop = Parameter(0.0, "rad", "stop of the inner gimbal: the run ends there (0: none)", min=0.0)

    age = Parameter(0.0, "s", "age at time 0", min=0.0)
    terms_x = Parameter(9, int, "terms of the x channel: 8, 9 or 10")
    Dx = ChannelDrift(
        "x",
        "zyx",
        fixed=(-0.3, "constant drift (-0.3 deg/h)"),
        x=(-0.9, "per g0 along x, mass unbalance along z (-0.9 deg/h/g)"),
        y=(0.1, "per g0 along y, empirical (0.1 deg/h/g)"),
        z=(-0.7, "per g0 along z, mass unbalance along x (-0.7 deg/h/g)"),
        xx=(-0.05, "per g0 squared along x (-0.05 deg/h/g2)"),
        yy=(0.0, "per g0 squared along y, empirical"),
        zz=(0.04, "per g0 squared along z (0.04 deg/h/g2)"),
        xy=(-0.03, "per g0 squared, x and y (-0.03 deg/h/g2)"),
        yz=(-0.02, "per g0 squared, y and z (-0.02 deg/h/g2)"),
        xz=(-0.15, "per g0 squared, anisoelasticity (-0.15 deg/h/g2)"),
    )

    terms_y = Parameter(9, int, "terms of the y channel: 8, 9 or 10")
    Dy = ChannelDrift(
        "y",
        "xzy",
        fixed=(0.4, "constant drift (0.4 deg/h)"),
        x=(-0.08, "per g0 along x, empirical (-0.08 deg/h/g)"),
        y=(-1.0, "per g0 along y, unbalance with outer gimbal (-1 deg/h/g)"),
        z=(0.8, "per g0 along z, mass unbalance along y (0.8 deg/h/g)"),
        xx=(0.0, "per g0 squared along x, empirical"),
        yy=(-0.03, "per g0 squared along y (-0.03 deg/h/g2)"),
        zz=(0.03, "per g0 squared along z (0.03 deg/h/g2)"),
        xy=(-0.05, "per g0 squared, x and y (-0.05 deg/h/g2)"),
        yz=(-0.12, "per g0 squared, anisoelasticity (-0.12 deg/h/g2)"),
        xz=(-0.02, "per g0 squared, x and z (-0.02 deg/h/g2)"),
    )

    turn_on_x = Noise(0.0, "rad/s", "rms of the turn-on drift of the x channel, one value a run", per="start")
    turn_on_y = Noise(0.0, "rad/s", "rms of the turn-on drift of the y channel, one value a run", per="start")
    markov_x = GaussMarkov(0.002 * DEG_H, "rad/s", "Gauss-Markov drift, x channel", "0.002 deg/h", tau="markov_tau")
    markov_y = GaussMarkov(0.002 * DEG_H, "rad/s", "Gauss-Markov drift, y channel", "0.002 deg/h", tau="markov_tau")
    markov_tau = Parameter(300.0, "s", "correlation time of the Gauss-Markov drifts", above=0.0)
    white_x = Noise(0.0178 * DEG_H, "rad/s/sqrt(Hz)", "white drift density, x channel (0.0178 deg/h/sqrt(Hz))")
    white_y = Noise(0.0178 * DEG_H, "rad/s/sqrt(Hz)", "white drift density, y channel (0.0178 deg/h/sqrt(Hz))")
    pickoff_x = Noise(5e-8, "V/sqrt(Hz)", "noise density of the x pickoff")
    pickoff_y = Noise(5e-8, "V/sqrt(Hz)", "noise density of the y pickoff")
    flicker_x = Flicker("rad/s", "drift, x channel", tau="flicker_tau")
    flicker_y = Flicker("rad/s", "drift, y channel", tau="flicker_tau")
    flicker_tau = Parameter(1e5, "s", "longest correlation time of the flicker drifts", above=0.0)
    walk_x = RateRandomWalk("rad/s", "rad/s2/sqrt(Hz)", "drift, x channel")
    walk_y = RateRandomWalk("rad/s", "rad/s2/sqrt(Hz)", "drift, y channel")
    quantization_x = Quantization("x channel", tau="quantization_tau")
    quantization_y = Quantization("y channel", tau="quantization_tau")
    quantization_tau = Parameter(0.1, "s", "correlation time of the angle noises", above=0.0)
    ramp_x = Parameter(0.0, "rad/s2", "ramp of the drift, x channel, coefficient R")
    ramp_y = Parameter(0.0, "rad/s2", "ramp of the drift, y channel, coefficient R")
    wanders = Discrete(0.0, "1", "1 where one of these is given")

    omega = Input([0.0, 0.0, 0.0], "rad/s", "inertial rate, case axes")
    f = Input([0.0, 0.0, 0.0], "m/s2", "specific force a - G, case axes")
    alpha_b = Input([0.0, 0.0, 0.0], "rad/s2", "derivative of omega, case axes (0: omega is held over a step)")
    i_x = Input(0.0, "A", "current of the torquer about x (nulls u_y)")
    i_y = Input(0.0, "A", "current of the torquer about y (nulls u_x)")
    M_x = Input(0.0, "N.m", "torque from outside on the outer gimbal about x")
    M_y = Input(0.0, "N.m", "torque from outside on the inner gimbal about y")
    dT = Input([0.0, 0.0, 0.0], "K", "temperature differences along x, y, z")
    v_float = Input([0.0, 0.0, 0.0], "m/s", "velocity of the float against the case, along x, y, z")
    temperature = Input(0.0, "K", "mean temperature above that of the coefficients")
    B = Input([0.0, 0.0, 0.0], "T", "magnetic field, case axes")
    dB = Input([0.0, 0.0, 0.0], "T", "differences of the magnetic field over the gyro, case axes")
    wheel_frequency = Input(0.0, "1", "frequency of the wheel supply, relative departure")
    wheel_voltage = Input(0.0, "1", "voltage of the wheel supply, relative departure")
    wheel_phase = Input(0.0, "rad", "asymmetry of the phases of the wheel supply")
    pickoff_excitation = Input(0.0, "1", "excitation current of the pickoffs, relative departure")
    torquer_excitation = Input(0.0, "1", "excitation of the torquers, relative departure")

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

    per_h = Discrete(0.0, "1/(N.m.s)", "1 / H")
    supplied = Discrete(0.0, "rad/s", "0 where the supplies add no drift")

    def start(self) -> None:
        n = self.terms_x
        self.refuse(
            not (n == 8.0 or n == 9.0 or n == 10.0),
            "terms_x = {terms_x} is not a static model of a channel: it must be 8, 9 or 10",
        )
        self.refuse(n < 9.0 and self.Dx_y != 0.0, "Dx_y must be 0 with terms_x = {terms_x} (from 9 on)")
        self.refuse(n < 10.0 and self.Dx_yy != 0.0, "Dx_yy must be 0 with terms_x = {terms_x} (from 10 on)")
        n = self.terms_y
        self.refuse(
            not (n == 8.0 or n == 9.0 or n == 10.0),
            "terms_y = {terms_y} is not a static model of a channel: it must be 8, 9 or 10",
        )
        self.refuse(n < 9.0 and self.Dy_x != 0.0, "Dy_x must be 0 with terms_y = {terms_y} (from 9 on)")
        self.refuse(n < 10.0 and self.Dy_xx != 0.0, "Dy_xx must be 0 with terms_y = {terms_y} (from 10 on)")
        self.refuse(
            (self.J_x > 0.0) != (self.J_y > 0.0), "J_x = {J_x} and J_y = {J_y} kg.m2: give both (nutation) or neither"
        )
        self.refuse(
            self.J_x == 0.0 and (self.C_x > 0.0 or self.C_y > 0.0),
            "C_x and C_y must be 0 without nutation (J_x = J_y = 0)",
        )
        self.refuse(
            self.full and self.J_x == 0.0, "full = 1 (gimbals at full size) needs nutation: J_x and J_y above 0 kg.m2"
        )
        springs = self.K_q != 0.0 or self.K_phi > 0.0
        self.refuse(self.full and springs, "K_q and K_phi are of small angles: they must be 0 with full = 1")
        self.refuse(self.stop >= 0.5 * pi, "stop = {stop} rad: the inner gimbal must stop before pi/2 (gimbal lock)")
        self.per_h = 1.0 / self.H
        self.supplied = self.Dx.sensitivity() + self.Dy.sensitivity()
        self.wanders = 0.0
        if self.flicker_x > 0.0 or self.walk_x > 0.0 or self.quantization_x > 0.0 or self.ramp_x != 0.0:
            self.wanders = 1.0
        if self.flicker_y > 0.0 or self.walk_y > 0.0 or self.quantization_y > 0.0 or self.ramp_y != 0.0:
            self.wanders = 1.0

    def speed(self) -> Number:
        """Return the speed of the wheel over its nominal one."""
        return 1.0 + self.wheel_frequency

    def drift_rates(self) -> Vector:
        g = PER_G * (self.mount @ self.f)
        age = self.age + self.t
        for_x = vector([self.dT[2], -self.dT[1], -self.dT[0]])
        for_y = vector([-self.dT[0], self.dT[2], -self.dT[1]])
        x = self.Dx.rate(g, age, for_x, self.v_float)
        y = self.Dy.rate(g, age, for_y, self.v_float)
        if self.Dx_exposed > 0.0 or self.Dy_exposed > 0.0:
            field = self.mount @ self.B
            difference = self.mount @ self.dB
            x = x + self.Dx.surroundings(self.temperature, field, difference)
            y = y + self.Dy.surroundings(self.temperature, field, difference)
        if self.supplied > 0.0:
            wheel = vector([self.wheel_voltage, self.wheel_phase])
            excitation = vector([self.pickoff_excitation, self.torquer_excitation])
            x = x + self.Dx.supplies(g[0], g[2], wheel, excitation)
            y = y + self.Dy.supplies(g[1], g[2], wheel, excitation)
        x = x + self.noise.turn_on_x + self.markov_x_value + self.noise.white_x
        y = y + self.noise.turn_on_y + self.markov_y_value + self.noise.white_y
        if self.wanders > 0.0:
            x = x + self.flicker_x_value + self.walk_x_value + self.quantization_x_rate + self.ramp_x * self.t
            y = y + self.flicker_y_value + self.walk_y_value + self.quantization_y_rate + self.ramp_y * self.t
        return vector([x / self.speed(), y / self.speed()])

    def precession(self, drift: Vector) -> Vector:
        """Return the rates of the rotor under drift, torquers (each acts about the other axis) and springs."""
        T = self.temperature
        excited = (1.0 + self.k_E * self.torquer_excitation) / self.speed()
        about_x = drift[0] + excited * torquer_rate(self.k_y * (1.0 + self.k_T_y * T), self.k2_y, self.k3_y, self.i_y)
        about_y = drift[1] + excited * torquer_rate(self.k_x * (1.0 + self.k_T_x * T), self.k2_x, self.k3_x, self.i_x)
        if self.K_q != 0.0 or self.K_phi > 0.0:
            K_q = self.K_q / self.speed()
            K_phi = self.K_phi / self.speed()
            about_x = about_x + K_q * self.psi_y - K_phi * self.psi_x
            about_y = about_y - K_q * self.psi_x - K_phi * self.psi_y
        return vector([about_x, about_y])

    def flow(self) -> None:
        w = self.mount @ (self.omega + (self.t - self.step_end) * self.alpha_b)  # omega is that of the step's end
        rate = self.precession(self.drift_rates())
        momentum = self.H * self.speed()
        rate_x = rate[0]
        rate_y = rate[1]
        self.der.p = 0.0
        self.der.q = 0.0
        if self.full:
            c = cos(self.psi_y)
            w_y = w[1] * cos(self.psi_x) + w[2] * sin(self.psi_x)
            w_z = w[2] * cos(self.psi_x) - w[1] * sin(self.psi_x)
            outer = momentum * (rate_y - self.q * c) - self.C_x * (self.p - w[0])
            inner = momentum * (self.p * c - w_z * sin(self.psi_y) - rate_x) - self.C_y * (self.q - w_y)
            self.der.p = (outer + self.M_x) / self.J_x
            self.der.q = (inner + self.M_y) / self.J_y
            self.der.psi_x = self.p - w[0]
            self.der.psi_y = self.q - w_y
        else:
            if self.J_x > 0.0:
                self.der.p = (momentum * (rate_y - self.q) - self.C_x * (self.p - w[0]) + self.M_x) / self.J_x
                self.der.q = (momentum * (self.p - rate_x) - self.C_y * (self.q - w[1]) + self.M_y) / self.J_y
                rate_x = self.p
                rate_y = self.q
            else:
                rate_x = rate_x - self.per_h * self.M_y / self.speed()
                rate_y = rate_y + self.per_h * self.M_x / self.speed()
            self.der.psi_x = rate_x - w[0] + w[2] * self.psi_y
            self.der.psi_y = rate_y - w[1] - w[2] * self.psi_x

    @sampled(every=1)
    def tick(self) -> None:
        if self.full or self.stop > 0.0:
            limit = self.stop if self.stop > 0.0 else 0.5 * pi
            self.refuse(fabs(self.psi_y) >= limit, "the inner gimbal has reached its stop: beta = {psi_y} rad")

    def outputs(self) -> None:
        w = self.mount @ self.omega
        drift = self.drift_rates()
        self.drift_x = drift[0]
        self.drift_y = drift[1]
        unlimited_x = -self.K_sg_x * (1.0 + self.pickoff_excitation) * (self.psi_x - self.null_x) + self.noise.pickoff_x
        unlimited_y = -self.K_sg_y * (1.0 + self.pickoff_excitation) * (self.psi_y - self.null_y) + self.noise.pickoff_y
        self.u_x = clip(unlimited_x, -self.u_max, self.u_max)
        self.u_y = clip(unlimited_y, -self.u_max, self.u_max)
        self.saturated = 1.0 if self.u_x != unlimited_x or self.u_y != unlimited_y else 0.0
        self.alpha = self.psi_x
        self.beta = self.psi_y
        rate = self.precession(drift)
        momentum = self.H * self.speed()
        q = self.q if self.J_x > 0.0 else rate[1] + self.per_h * self.M_x / self.speed()
        c = 1.0
        s = self.psi_x
        tilt = self.psi_y
        turn = w[1]  # rate of the outer gimbal about y
        if self.full:
            c = cos(self.psi_x)
            s = sin(self.psi_x)
            tilt = sin(self.psi_y)
            turn = c * w[1] + s * w[2]
        # axes of the outer gimbal: bearing x, bearing y of the inner gimbal, constraint about z
        m_x = -momentum * rate[1]
        m_y = momentum * rate[0]
        m_z = momentum * q * tilt
        if self.J_x > 0.0:
            m_x = m_x + self.C_x * (self.p - w[0])
            m_y = m_y + self.C_y * (q - turn)
        side = c * m_y - s * m_z
        m_z = s * m_y + c * m_z
        self.M_react = self.mount[0] * m_x + self.mount[1] * side + self.mount[2] * m_z
