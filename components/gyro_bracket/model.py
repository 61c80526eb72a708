from __future__ import annotations

from gyrobench.component import Component, Input, Output, Parameter, State
from gyrobench.component.math import pi, vector


class GyroBracket(Component):
    """Elastic bracket that holds a gyro on a platform: the gyro turns about x with a bending mode.

        q' = r - w                        q: angle of the gyro against the platform, r: its inertial rate
        r' = -2 zeta wn (r - w) - wn2 q   w: rate of the platform, wn = 2 pi frequency

    so that  r/w = (2 zeta wn s + wn2)/(s2 + 2 zeta wn s + wn2):  1 for a slow platform, 1/(2 zeta) high at the mode.
    About y and z the bracket is rigid.  As the gyro closes the loop of the platform, the peak is one of the open loop.

    Not modelled: the torque of the mode on the platform (the gyro is light against it), more than one mode, what the
    bent mount does to the specific force.
    Source: our own; base excitation of one degree of freedom.
    """

    version = "1.0.0"

    frequency = Parameter(120.0, "Hz", "natural frequency of the mode", above=0.0)
    damping = Parameter(0.05, "1", "damping ratio", above=0.0)

    omega = Input([0.0, 0.0, 0.0], "rad/s", "inertial rate of the platform, platform axes")

    omega_gyro = Output("rad/s", "inertial rate of the gyro's mount, platform axes", shape=(3,))
    q = Output("rad", "angle of the bracket")

    bent = State(0.0, "rad", "angle of the bracket")
    r = State(0.0, "rad/s", "rate of the mount about x")

    def start(self) -> None:
        self.r = self.omega[0]
        self.bent = 0.0

    def flow(self) -> None:
        wn = 2.0 * pi * self.frequency
        self.der.bent = self.r - self.omega[0]
        self.der.r = -2.0 * self.damping * wn * (self.r - self.omega[0]) - wn * wn * self.bent

    def outputs(self) -> None:
        self.q = self.bent
        self.omega_gyro = vector([self.r, self.omega[1], self.omega[2]])
