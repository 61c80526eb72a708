from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Output, Parameter
from gyrobench.component.math import cos, fabs, pi, sin, where


class DecouplerT2(Component):
    """Turns gyro signals of the platform axes into signals of the motor axes.  [DECOUPLE-T2, RESOLVER-AZ]

    With the azimuth angle a, the pitch angle f and the roll angle r (A order: pitch, roll, azimuth)

        u_A = T2 u,   T2 = [[ca, -sa, 0], [sa / cf, ca / cf, 0], [0, 0, 1]] = inverse of T1     mount 0, roll outside
        T2 = [[ca / cr, -sa / cr, 0], [sa, ca, 0], [0, 0, 1]]                                  mount 1, pitch outside

    form 0: these.  form 1, as a resolver on the azimuth axis with its errors: ca, sa become

        k cos(a + offset),    k (1 + imbalance) sin(a + offset + quadrature)

    An offset costs as much phase margin as it has degrees and a crosstalk of its sine.  The secant is that of the
    middle angle up to theta_f_max; nearer to 90 deg its size is held, `saturated` is 1.  Beyond 90 deg it is negative.

    T2 decouples where the three channels are alike: drives normalized by the inertia of their axes, |f| < 90 deg.

    Not modelled: carrier of the resolver, its noise and lag, errors of the angle that feeds the secant.
    Source: Xia 2008, eq. 5.1.8-5.1.12; (5.1.12) is printed with cos and sin exchanged (RESOLVER-AZ).
    """

    version = "1.0.0"

    form = Parameter(0, int, "0: ideal T2, 1: azimuth resolver with its errors", min=0, max=1)
    mount = Parameter(0, int, "outer gimbal, 0: roll (secant of pitch), 1: pitch (secant of roll)", min=0, max=1)
    theta_f_max = Parameter(pi / 3.0, "rad", "middle angle to which the secant grows", min=0.0, below=pi / 2.0 - 1e-3)
    k = Parameter(1.0, "1", "resolver: transformation ratio", above=0.0)
    offset = Parameter(0.0, "rad", "resolver: error of its zero")
    imbalance = Parameter(0.0, "1", "resolver: transformation ratio of sine against cosine, relative", above=-1.0)
    quadrature = Parameter(0.0, "rad", "resolver: sine winding off the right angle", above=-pi / 2.0, below=pi / 2.0)

    u = Input([0.0, 0.0, 0.0], "V", "signals along the platform axes")
    theta = Input([0.0, 0.0, 0.0], "rad", "joint angles, A order")

    u_axes = Output("V", "signals about the motor axes, A order", shape=(3,))
    saturated = Output("1", "1 while the secant is held at its limit")

    least = Discrete(0.5, "1", "cosine of theta_f_max")

    def start(self) -> None:
        self.least = cos(self.theta_f_max)

    def outputs(self) -> None:
        a = self.theta[2]
        ca = cos(a)
        sa = sin(a)
        if self.form == 1.0:
            ca = self.k * cos(a + self.offset)
            sa = self.k * (1.0 + self.imbalance) * sin(a + self.offset + self.quadrature)
        x = ca * self.u[0] - sa * self.u[1]
        y = sa * self.u[0] + ca * self.u[1]
        middle = self.theta[0] if self.mount == 0.0 else self.theta[1]
        c = cos(middle)
        over = fabs(c) < self.least
        if over:
            c = where(c < 0.0, -self.least, self.least)
        self.u_axes[0] = x if self.mount == 0.0 else x / c
        self.u_axes[1] = y / c if self.mount == 0.0 else y
        self.u_axes[2] = self.u[2]
        self.saturated = 1.0 if over else 0.0
