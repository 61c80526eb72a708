from __future__ import annotations

from gyrobench.component import Component, Input, Noise, Output, Parameter, State
from gyrobench.component.math import vector


class PlatformPowerGyros(Component):
    """Platform about two axes with a power gyro for each, the second turned by 90 deg about z.  [STAB-POWER-TWO-AXIS]

        J_x a_x'' + C_x (a_x' - w_b1) + H b_1' = M_1 - C_y c_2' + S_2        c_1 = b_1 - a_y
        J_x a_y'' + C_x (a_y' - w_b2) + H b_2' = M_2 + C_y c_1' - S_1        c_2 = b_2 + a_x
        J_y b_k'' + C_y c_k' - H w_k = S_k - H d_k                           w = (a_x', a_y')

    a: platform, inertial; b: precession of the gyros, inertial, of gyro 1 about +y, of gyro 2 about -x; c: against the
    platform, what a pickoff sees, u_k = k_u c_k.  S servo torques, d drift with white noise.  Rotors along z, their
    cases are part of the platform.  With theta = a_x + i a_y, beta = b_1 + i b_2 it is one axis, c = beta + i theta.

    Not modelled: large angles (H cos c), stops of the gyros, rotation about z, rotors of opposite sense.
    Source: GSP ch. 5, eq. 5-7, 5-8 for each axis; a second gyro for a second axis: end of section 5.1.1; coupling: own
    derivation.
    """

    version = "1.0.0"

    H = Parameter(10.0, "N.m.s", "spin angular momentum of either gyro", above=0.0)
    J_x = Parameter(0.5, "kg.m2", "inertia of platform and gyros about either axis", above=0.0)
    J_y = Parameter(0.02, "kg.m2", "inertia of rotor and inner gimbal about the precession axis", above=0.0)
    C_x = Parameter(10.0, "N.m.s/rad", "damping of the platform against the base", min=0.0)
    C_y = Parameter(2.0, "N.m.s/rad", "damping of the precession against the platform", min=0.0)
    k_u = Parameter(10.0, "V/rad", "potentiometer: voltage per precession angle", above=0.0)
    drift = Parameter([0.0, 0.0], "rad/s", "drift rate of the platform about x and y by the gyros")
    white = Noise(8.62968352e-08, "rad/s/sqrt(Hz)", "white drift density of either (0.0178 deg/h/sqrt(Hz))", samples=2)

    M = Input([0.0, 0.0], "N.m", "torques on the platform about x and y: motors and load")
    S = Input([0.0, 0.0], "N.m", "servo torques on the precession axes")
    omega_b = Input([0.0, 0.0, 0.0], "rad/s", "inertial rate of the base")

    u = Output("V", "potentiometer voltages", shape=(2,))
    attitude = Output("rad", "inertial angle of the platform about x and y", shape=(2,))
    omega = Output("rad/s", "inertial rate of the platform about x and y", shape=(2,))
    precession = Output("rad", "angles of the gyros against the platform", shape=(2,))

    a = State([0.0, 0.0], "rad", "platform")
    w = State([0.0, 0.0], "rad/s", "its rate")
    b = State([0.0, 0.0], "rad", "precession, inertial")
    r = State([0.0, 0.0], "rad/s", "its rate")

    def flow(self) -> None:
        c1 = self.r[0] - self.w[1]
        c2 = self.r[1] + self.w[0]
        x = self.M[0] - self.C_x * (self.w[0] - self.omega_b[0]) - self.H * self.r[0] - self.C_y * c2 + self.S[1]
        y = self.M[1] - self.C_x * (self.w[1] - self.omega_b[1]) - self.H * self.r[1] + self.C_y * c1 - self.S[0]
        d1 = self.drift[0] + self.noise.white[0]
        d2 = self.drift[1] + self.noise.white[1]
        self.der.a = vector(self.w)
        self.der.b = vector(self.r)
        self.der.w = vector([x / self.J_x, y / self.J_x])
        one = self.H * (self.w[0] - d1) - self.C_y * c1 + self.S[0]
        two = self.H * (self.w[1] - d2) - self.C_y * c2 + self.S[1]
        self.der.r = vector([one / self.J_y, two / self.J_y])

    def outputs(self) -> None:
        c1 = self.b[0] - self.a[1]
        c2 = self.b[1] + self.a[0]
        self.precession = vector([c1, c2])
        self.u = vector([self.k_u * c1, self.k_u * c2])
        self.attitude = vector(self.a)
        self.omega = vector(self.w)
