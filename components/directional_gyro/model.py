from __future__ import annotations

from gyrobench.component import Component, Input, Noise, Output, Parameter, State, sampled
from gyrobench.component.math import atan2, cos, floor, pi, sin


class DirectionalGyro(Component):
    """Free gyro with two gimbals that keeps a direction in azimuth.  [GYRO-MAGNETIC-COMPASS]

        a' = -omega . up + drift + disturbance + white + rate     a: heading of the case against the rotor axis
        psi = atan2(cos r sin a - sin r sin p cos a, cos p cos a)

    Headings and rates clockwise.  Axes x right, y forward, z up; angle = (pitch p, roll r, heading counter-clockwise)
    as of a base; up = (-sin r cos p, sin p, cos r cos p) in case axes.  The rotor axis is kept level; psi is read at
    the outer gimbal, whose axis stands upright in the case, so that a bank or a pitch shows a false heading between the
    quarters: tan psi = cos r tan a at p = 0 (gimballing error).  `rate` precesses the rotor axis: slaving, or a
    correction for the latitude.

    As omega is inertial, the Earth's rate is in a: a free gyro at rest drifts by -w sin(latitude).

    Not modelled: gimbal lock, error of the levelling, friction, transport rate (it is not in the omega of the bench's
    motions): put it into `drift`.
    Source: GSP ch. 5, section 5.3.2, fig. 5-19 (no equations); own derivation.
    """

    version = "1.0.0"

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    drift = Parameter(0.0, "rad/s", "drift in azimuth, clockwise")
    start_error = Parameter(0.0, "rad", "heading shown less true heading at the start")
    gimballing = Parameter(1, int, "1: read at the gimbal; 0: without gimballing error", min=0, max=1)
    white = Noise(0.0, "rad/s/sqrt(Hz)", "density of the random drift")

    omega = Input([0.0, 0.0, 0.0], "rad/s", "inertial rate of the case, case axes")
    angle = Input([0.0, 0.0, 0.0], "rad", "pitch, roll, heading counter-clockwise of the case")
    rate = Input(0.0, "rad/s", "precession asked for, clockwise")
    disturbance = Input(0.0, "rad/s", "drift to be added, clockwise")

    psi = Output("rad", "heading shown, clockwise, -pi to pi")
    azimuth = Output("rad", "the same without gimballing error, not wrapped")

    a = State(0.0, "rad", "heading against the rotor axis")

    def start(self) -> None:
        self.a = -self.angle[2] + self.start_error

    def flow(self) -> None:
        p = self.angle[0]
        r = self.angle[1]
        about_up = -sin(r) * cos(p) * self.omega[0] + sin(p) * self.omega[1] + cos(r) * cos(p) * self.omega[2]
        self.der.a = -about_up + self.drift + self.disturbance + self.rate + self.noise.white

    @sampled(every=1)
    def tick(self) -> None:
        pass

    def outputs(self) -> None:
        self.azimuth = self.a
        p = self.angle[0]
        r = self.angle[1]
        self.psi = self.a - 2.0 * pi * floor(self.a / (2.0 * pi) + 0.5)
        if self.gimballing > 0.5:
            self.psi = atan2(cos(r) * sin(self.a) - sin(r) * sin(p) * cos(self.a), cos(p) * cos(self.a))
