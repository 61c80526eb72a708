from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Noise, Output, Parameter, State, sampled
from gyrobench.component.math import clip, cos, exp, fabs, pi, sin, sqrt

DEG_H = pi / 180.0 / 3600.0  # 1 deg/h in rad/s
IDENTITY = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]


class CompliantGyro(Component):
    """Floated gyro with elastic rotor bearing and gimbal: third-order dynamics.  [GYRO-DYN-3, GYRO-STATIC-10]

    Axes I, O, S are those of the mount, v_gyro = mount v_case.  The rotor axis turns by x against the case about I and
    by y against the float about O, held there by the stiffnesses K_I and K_O; b = float angle, r its rate:

        H x' = K_O y - H (w_I cos b - w_S sin b)              H y' = -K_I x - H (r + w_O)
        b' = r,   J r' = -C r + K_O y - H (omega_d + k i (1 + k2 i + k3 i2)) - J alpha_O
        u = K_sg b + noise, limited to +-u_max                                     [GYRO-DYN-3; Hu 1981, eq. 2-57..2-67]

    In the rotor angles of GYRO-DYN-3, a, beta and case angles theta: x = a - theta_I, y = beta - b - theta_O.
    As transfer functions, with tau = J/C + H2/(K_I C) and D(s) = H2 J/(K_I K_O C) s3 + H2/(K_I K_O) s2 + tau s + 1:

        b / theta_I = (H/C) / D         b / theta_O = -[H2 J/(K_I K_O C) s3 + tau s] / D
        b / M = (1 + H2 s2/(K_I K_O)) / (C s D),   M = torque on the float

    K_I, K_O -> infinity is floated_gyro.  Same ports, same steady state: k i (1 + k2 i + k3 i2) = omega_IA - omega_d.
    Drift rate omega_d in precession sign as there, (X, Y, Z) = -f/g0 along I, O, S, g0 = 9.80665 m/s2:

        omega_d = D_F + D_I X + D_O Y + D_S Z + D_II X2 + D_OO Y2 + D_SS Z2 + D_IO X Y + D_OS Y Z + D_IS X Z
                  + turn-on constant + Gauss-Markov + white

    All ten terms may be given; there is no choice of `terms`, no ageing and no temperature (use floated_gyro).

    Not modelled: transverse inertia of the rotor (nutation; 1e-6 kg.m2 changes the response at 10 Hz by less than
    1e-3), drift torque on the rotor instead of the float, damping in the bearing, and what floated_gyro leaves out.
    Source: Hu 1981, ch. 2, eq. 2-57..2-67.
    """

    version = "1.0.0"

    H = Parameter(0.2, "N.m.s", "spin angular momentum", above=0.0)
    J = Parameter(2e-4, "kg.m2", "float inertia about the output axis", above=0.0)
    C = Parameter(0.2, "N.m.s/rad", "float damping", above=0.0)
    K_I = Parameter(400.0, "N.m/rad", "stiffness of rotor bearing and gimbal about I", above=0.0)
    K_O = Parameter(2000.0, "N.m/rad", "stiffness of rotor bearing and gimbal about O", above=0.0)
    K_sg = Parameter(10.0, "V/rad", "pickoff gain", above=0.0)
    u_max = Parameter(0.1, "V", "pickoff saturation", above=0.0)
    k = Parameter(17.2e3 * DEG_H, "rad/s/A", "torquer scale factor (17.2 deg/h/mA)", above=0.0)
    k2 = Parameter(0.0, "1/A", "torquer nonlinearity, relative, even in the rate")
    k3 = Parameter(0.0, "1/A2", "torquer nonlinearity, relative, odd in the rate")
    mount = Parameter(IDENTITY, "1", "rows: gyro axes I, O, S in case axes")

    D_F = Parameter(-0.3 * DEG_H, "rad/s", "constant drift (-0.3 deg/h)")
    D_I = Parameter(-0.9 * DEG_H, "rad/s", "drift per g0 along I, mass unbalance along S (-0.9 deg/h/g)")
    D_O = Parameter(0.1 * DEG_H, "rad/s", "drift per g0 along O, empirical (0.1 deg/h/g)")
    D_S = Parameter(-0.7 * DEG_H, "rad/s", "drift per g0 along S, mass unbalance along I (-0.7 deg/h/g)")
    D_II = Parameter(-0.05 * DEG_H, "rad/s", "drift per g0 squared along I (-0.05 deg/h/g2)")
    D_OO = Parameter(0.0, "rad/s", "drift per g0 squared along O, empirical")
    D_SS = Parameter(0.04 * DEG_H, "rad/s", "drift per g0 squared along S (0.04 deg/h/g2)")
    D_IO = Parameter(-0.03 * DEG_H, "rad/s", "drift per g0 squared, I and O (-0.03 deg/h/g2)")
    D_OS = Parameter(-0.02 * DEG_H, "rad/s", "drift per g0 squared, O and S (-0.02 deg/h/g2)")
    D_IS = Parameter(-0.15 * DEG_H, "rad/s", "drift per g0 squared, I and S, anisoelasticity (-0.15 deg/h/g2)")

    turn_on = Noise(0.0, "rad/s", "rms of the turn-on drift, one value a run", per="start")
    markov = Noise(0.002 * DEG_H, "rad/s", "rms of the Gauss-Markov drift (0.002 deg/h)", per="step")
    markov_tau = Parameter(300.0, "s", "correlation time of the Gauss-Markov drift", above=0.0)
    white = Noise(0.0178 * DEG_H, "rad/s/sqrt(Hz)", "white drift density (0.0178 deg/h/sqrt(Hz))")
    pickoff = Noise(5e-8, "V/sqrt(Hz)", "pickoff noise density")

    omega = Input([0.0, 0.0, 0.0], "rad/s", "inertial rate, case axes")
    alpha = Input([0.0, 0.0, 0.0], "rad/s2", "angular acceleration, case axes")
    f = Input([0.0, 0.0, 0.0], "m/s2", "specific force a - G, case axes")
    i = Input(0.0, "A", "torquer current")

    u = Output("V", "pickoff voltage")
    drift = Output("rad/s", "drift rate omega_d, precession sign")
    b = Output("rad", "float angle")
    saturated = Output("1", "1 while the pickoff is saturated")

    float_angle = State(0.0, "rad", "float angle b about O relative to the case")
    float_rate = State(0.0, "rad/s", "its rate r")
    rotor_I = State(0.0, "rad", "rotor axis against the case about I, x")
    rotor_O = State(0.0, "rad", "rotor axis against the float about O, y")

    wander = Discrete(0.0, "rad/s", "Gauss-Markov drift")
    decay = Discrete(0.0, "1", "its decay in one internal step")
    fresh = Discrete(0.0, "1", "size of its innovation")
    h_last = Discrete(0.0, "s", "internal step they were made for")
    per_g = Discrete(0.0, "s2/m", "-1 / g0")

    def start(self) -> None:
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
        self.wander = self.noise.markov
        self.h_last = 0.0

    def static_drift(self, x, y, z):
        along_i = self.D_I + self.D_II * x + self.D_IO * y + self.D_IS * z
        along_o = self.D_O + self.D_OO * y + self.D_OS * z
        along_s = self.D_S + self.D_SS * z
        return self.D_F + along_i * x + along_o * y + along_s * z

    def flow(self) -> None:
        w = [0.0, 0.0, 0.0]
        g = [0.0, 0.0, 0.0]
        for j in range(3):
            row = self.mount[j][0] * self.omega[0] + self.mount[j][1] * self.omega[1]
            w[j] = row + self.mount[j][2] * self.omega[2]
            row = self.mount[j][0] * self.f[0] + self.mount[j][1] * self.f[1]
            g[j] = self.per_g * (row + self.mount[j][2] * self.f[2])
        turn = self.mount[1][0] * self.alpha[0] + self.mount[1][1] * self.alpha[1]
        turn = turn + self.mount[1][2] * self.alpha[2]
        drift = self.static_drift(g[0], g[1], g[2]) + self.noise.turn_on + self.wander + self.noise.white
        pull = self.k * self.i * (1.0 + self.k2 * self.i + self.k3 * self.i * self.i)
        sensed = w[0] * cos(self.float_angle) - w[2] * sin(self.float_angle)
        spring = self.K_O * self.rotor_O  # torque of the rotor on the float
        self.der.rotor_I = spring / self.H - sensed
        self.der.rotor_O = -self.K_I / self.H * self.rotor_I - self.float_rate - w[1]
        self.der.float_angle = self.float_rate
        torque = spring - self.H * (drift + pull) - self.C * self.float_rate
        self.der.float_rate = torque / self.J - turn

    @sampled(every=1)
    def tick(self) -> None:
        if self.h != self.h_last:
            self.decay = exp(-self.h / self.markov_tau)
            self.fresh = sqrt(1.0 - self.decay * self.decay)
            self.h_last = self.h
        self.wander = self.decay * self.wander + self.fresh * self.noise.markov

    def outputs(self) -> None:
        g = [0.0, 0.0, 0.0]
        for j in range(3):
            row = self.mount[j][0] * self.f[0] + self.mount[j][1] * self.f[1]
            g[j] = self.per_g * (row + self.mount[j][2] * self.f[2])
        known = self.static_drift(g[0], g[1], g[2]) + self.noise.turn_on
        self.drift = known + self.wander + self.noise.white
        self.b = self.float_angle
        wish = self.K_sg * self.float_angle + self.noise.pickoff
        self.u = clip(wish, -self.u_max, self.u_max)
        self.saturated = 1.0 if self.u != wish else 0.0
