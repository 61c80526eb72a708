from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Output, Parameter, State, sampled
from gyrobench.component.blocks.platform import about_x, contact_moved, contact_torque, left, motor_current, motor_slope
from gyrobench.component.math import Number, clip, cos, fabs, sin, sqrt, vector


class PlatformSingleAxis(Component):
    """Platform on one axis with its torque motor, stabilized about x.  [PLATFORM-1AXIS, SERVO-3LOOP, STAB-POWER-2DOF]

    w inertial rate about x, theta joint angle, n reducer ratio, S = w - omega_b1 the rate against the base:

        p' = n k_t i + M_load + M_gyro + M_bearing + M_unbalance
        w  = (p - h_gyro + n (n - 1) J_motor omega_b1) / (J + n2 J_motor)    theta' = S      attitude' = w
        L i' = v - R i - k_e n S                  |v| <= v_max, |i| <= i_max;   L = 0: i without lag

    p is the momentum of platform, motor and gyro, so that a gyro wired by h_gyro = H sin b couples without delay in p;
    a gyro wired by M_gyro acts as a torque.  +v turns the platform towards +x.  Unbalance -(u x f)_x, u = mass times
    offset.

    Bearing: viscous friction and an elastic contact that slips (Prandtl element): the contact torque is the spring
    stiction / presliding times the angle from an anchor, with damping 0.5; beyond stiction the anchor is dragged along
    with the Coulomb torque `friction` until the motion reverses.  At rest nothing creeps; the torque is limited
    whatever the rate, and nothing in it is faster than sqrt(stiction / presliding / J).

    Not modelled: backlash and elasticity of the reducer, Stribeck curve, cogging, iron losses, end stops, motion of the
    platform against its bearing about y and z.  Within a communication step the rate of the base is
    omega_b + alpha_b (t - end of the step).
    Source: Xia 2008, section 4.1; GSP ch. 5, eq. 5-7, 5-24; defaults of PLATFORM-1AXIS.
    """

    version = "1.1.0"
    integrator = "rk4"
    rk4_substeps = 1

    J = Parameter(2.0, "kg.m2", "inertia of the platform about its axis", above=0.0)
    unbalance = Parameter([0.0, 0.0], "kg.m", "mass times offset of its centre along platform y and z")
    viscous = Parameter(0.05, "N.m.s/rad", "viscous friction", min=0.0)
    friction = Parameter(0.0, "N.m", "Coulomb friction", min=0.0)
    stiction = Parameter(0.0, "N.m", "break-away torque; 0: that of friction", min=0.0)
    presliding = Parameter(5e-5, "rad", "angle against the base at break-away", above=0.0)

    k_t = Parameter(1.0, "N.m/A", "motor: torque constant", above=0.0)
    k_e = Parameter(1.0, "V.s/rad", "motor: back EMF constant", min=0.0)
    R = Parameter(2.0, "Ohm", "motor: resistance", above=0.0)
    L = Parameter(4e-3, "Ohm.s", "motor: inductance (1 H = 1 Ohm.s); 0: current without lag", min=0.0)
    v_max = Parameter(48.0, "V", "largest voltage", above=0.0)
    i_max = Parameter(24.0, "A", "largest current", above=0.0)
    ratio = Parameter(1.0, "1", "reducer: turns of the motor for one of the platform, same sense", above=0.0)
    J_motor = Parameter(0.0, "kg.m2", "inertia of rotor and reducer on the motor shaft", min=0.0)

    theta_0 = Parameter(0.0, "rad", "joint angle at the start")
    theta_dot_0 = Parameter(0.0, "rad/s", "joint rate at the start")

    v = Input(0.0, "V", "motor voltage")
    M_load = Input(0.0, "N.m", "disturbance torque on the platform")
    M_gyro = Input(0.0, "N.m", "torque of the gyro on the platform, without that of h_gyro")
    h_gyro = Input(0.0, "N.m.s", "momentum of the gyro along the axis")
    omega_b = Input([0.0, 0.0, 0.0], "rad/s", "inertial rate of the base, base axes")
    alpha_b = Input([0.0, 0.0, 0.0], "rad/s2", "its derivative")
    f_b = Input([0.0, 0.0, 9.80665], "m/s2", "specific force, base axes")

    theta = Output("rad", "joint angle")
    theta_dot = Output("rad/s", "joint rate")
    omega = Output("rad/s", "inertial rate of the platform, platform axes", shape=(3,))
    alpha = Output("rad/s2", "its derivative at the end of the step, without that of h_gyro", shape=(3,))
    f = Output("m/s2", "specific force, platform axes", shape=(3,))
    attitude = Output("rad", "integral of omega[1]")
    i_motor = Output("A", "motor current at the end of the step")
    M_motor = Output("N.m", "motor torque on the platform")
    saturated = Output("1", "1 while voltage or current is at its limit")

    angle = State(0.0, "rad", "joint angle")
    p = State(0.0, "N.m.s", "momentum of platform and gyro about the axis")
    turned = State(0.0, "rad", "integral of the inertial rate")
    i = State(0.0, "A", "motor current")

    inertia = Discrete(1.0, "kg.m2", "J and the reflected J_motor")
    flowed = Discrete(0.0, "A", "current at the end of the step, for L = 0")
    spring = Discrete(0.0, "N.m/rad", "stiffness of the contact")
    rub = Discrete(0.0, "N.m.s/rad", "its damping")
    reach = Discrete(0.0, "rad", "way at Coulomb friction")
    anchor = Discrete(0.0, "rad", "where the contact is free of torque")
    slipping = Discrete(0.0, "1", "0 sticking, else the sense of slip")
    heavy = Discrete(0.0, "1", "1: there is unbalance")
    geared = Discrete(0.0, "kg.m2", "n (n - 1) J_motor")
    f_before = Discrete([0.0, 0.0, 0.0], "m/s2", "f_b at the end of the communication step before")

    def start(self) -> None:
        short = self.stiction > 0.0 and self.stiction < self.friction
        self.refuse(short, "stiction = {stiction} N.m must be 0 or at least friction = {friction} N.m")
        self.refuse(
            self.L > 0.0 and self.step * self.R > self.L,
            "step = {step} s must be <= L / R of the motor, L = {L} Ohm.s, R = {R} Ohm: shorten it, or take L = 0",
        )
        self.inertia = self.J + self.ratio * self.ratio * self.J_motor
        most = self.friction if self.friction > self.stiction else self.stiction
        self.spring = most / self.presliding
        self.rub = sqrt(self.spring * self.inertia)
        self.refuse(
            self.step * self.step * self.spring > 0.25 * self.inertia,
            "step = {step} s must be <= 0.5 sqrt(J presliding / stiction), presliding = {presliding} rad: shorten it",
        )
        if most > 0.0:
            self.reach = self.friction / self.spring
        self.heavy = 1.0 if self.unbalance[0] != 0.0 or self.unbalance[1] != 0.0 else 0.0
        self.angle = self.theta_0
        self.anchor = self.theta_0
        self.geared = self.ratio * (self.ratio - 1.0) * self.J_motor
        self.p = self.inertia * (self.omega_b[0] + self.theta_dot_0) - self.geared * self.omega_b[0] + self.h_gyro
        self.f_before = self.f_b

    def rate(self, base: Number) -> Number:
        return (self.p - self.h_gyro + self.geared * base) / self.inertia

    def current(self, slip: Number) -> Number:
        emf = self.k_e * self.ratio * slip
        return motor_current(self.i, self.i_max, self.v, self.v_max, emf, self.R, self.L)

    def bearing(self, slip: Number) -> Number:
        drag = self.viscous * slip
        if self.spring > 0.0:
            deflection = self.angle - self.anchor
            drag = drag + contact_torque(
                self.spring, self.rub, self.presliding, self.reach, deflection, slip, self.slipping
            )
        return -drag

    def unbalanced(self) -> Number:
        if self.heavy == 0.0:
            return 0.0
        f_b = self.f_b - left(self.t, self.step_start, self.step_end) * (self.f_b - self.f_before)
        f = about_x(cos(self.angle), sin(self.angle), f_b)
        return self.unbalance[1] * f[1] - self.unbalance[0] * f[2]

    def flow(self) -> None:
        base = self.omega_b[0] + (self.t - self.step_end) * self.alpha_b[0]
        w = self.rate(base)
        slip = w - base
        m = self.ratio * self.k_t * self.current(slip) + self.M_load + self.M_gyro
        self.der.p = m + self.bearing(slip) + self.unbalanced()
        self.der.angle = slip
        self.der.turned = w
        emf = self.k_e * self.ratio * slip
        self.der.i = motor_slope(self.i, self.i_max, self.v, self.v_max, emf, self.R, self.L)

    @sampled(every=1)
    def tick(self) -> None:
        self.i = clip(self.i, -self.i_max, self.i_max)
        if self.L == 0.0:
            self.flowed = self.current(self.rate(self.omega_b[0]) - self.omega_b[0])
        if self.spring > 0.0:
            slip = self.rate(self.omega_b[0]) - self.omega_b[0]
            moved = contact_moved(
                self.spring, self.rub, self.presliding, self.reach, self.angle, slip, self.anchor, self.slipping
            )
            self.anchor = moved[0]
            self.slipping = moved[1]
        if self.t >= self.step_end:
            self.f_before = self.f_b

    def outputs(self) -> None:
        w = self.rate(self.omega_b[0])
        slip = w - self.omega_b[0]
        c = cos(self.angle)
        s = sin(self.angle)
        self.theta = self.angle
        self.theta_dot = slip
        turned = about_x(c, s, self.omega_b)
        self.omega = vector([w, turned[1], turned[2]])
        self.alpha[0] = (self.der.p + self.geared * self.alpha_b[0]) / self.inertia
        self.alpha[1] = c * self.alpha_b[1] + s * self.alpha_b[2] + slip * turned[2]
        self.alpha[2] = c * self.alpha_b[2] - s * self.alpha_b[1] - slip * turned[1]
        self.f = about_x(c, s, self.f_b)
        self.attitude = self.turned
        amps = self.i if self.L > 0.0 else self.flowed  # not of the present v: a current loop could not be ordered
        self.i_motor = amps
        self.M_motor = self.ratio * self.k_t * amps
        self.saturated = 1.0 if fabs(self.v) >= self.v_max or fabs(amps) >= self.i_max else 0.0
