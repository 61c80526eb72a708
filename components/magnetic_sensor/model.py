from __future__ import annotations

from gyrobench.component import Component, Input, Noise, Output, Parameter, State, sampled
from gyrobench.component.math import Vector, atan2, cos, cross, sin, sqrt, vector

LEAST = 5e-6  # T, horizontal field that still gives a direction


class MagneticSensor(Component):
    """Flux valve: magnetic heading from the Earth's field in the plane of a pendulum.  [GYRO-MAGNETIC-COMPASS]

        B_ENU = B_h (sin D, cos D, -tan I)       B = S C B_ENU + b       C: ENU to case axes, S soft iron, b hard iron
        tau n' = f/|f| - n                       n: normal of the sensor's plane; pendulous = 0: case axis z
        x' = y x n, x' = x'/|x'|, y' = n x x'    y: case axis forward
        psi_m = atan2(-B . x', B . y') + disturbance + white

    Axes x right, y forward, z up; angle = (pitch, roll, heading counter-clockwise); psi_m is clockwise from magnetic
    north.  The pendulum follows the specific force: in a turn the plane tilts and takes up the vertical field, an error
    of up to tan I times the tilt (northerly turning error).  D, the declination, is the field's own; who wants a true
    heading must add it.

    Not modelled: saturation and hysteresis of the cores, change of the field with place, swing of the pendulum.
    Source: GSP ch. 5, section 5.3.2, fig. 5-19 (no equations); own derivation.
    """

    version = "1.0.0"

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    field = Parameter(3e-5, "T", "horizontal field of the Earth", above=0.0)
    inclination = Parameter(1.0472, "rad", "inclination of the field, down (60 deg)", min=-1.5533, max=1.5533)
    declination = Parameter(0.0, "rad", "declination, clockwise", min=-3.1416, max=3.1416)
    hard = Parameter([0.0, 0.0, 0.0], "T", "hard iron, case axes")
    soft = Parameter([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], "1", "soft iron, case axes")
    pendulous = Parameter(1, int, "1: hangs as a pendulum; 0: fixed in the case", min=0, max=1)
    tau = Parameter(1.0, "s", "time constant of the pendulum", above=0.0)
    white = Noise(0.0, "rad/sqrt(Hz)", "density of the noise of the heading")

    angle = Input([0.0, 0.0, 0.0], "rad", "pitch, roll, heading counter-clockwise of the case")
    f = Input([0.0, 0.0, 9.80665], "m/s2", "specific force, case axes")
    disturbance = Input(0.0, "rad", "error of the heading by a disturbed field")

    psi = Output("rad", "magnetic heading, clockwise, -pi to pi")

    n = State([0.0, 0.0, 1.0], "1", "direction of the pendulum, case axes")

    def start(self) -> None:
        self.refuse(self.field < LEAST, "field = {field} T: below 5e-6 T horizontal there is no direction to be had")
        self.n = self.plumb()

    def plumb(self) -> Vector:
        """Return the direction of the specific force, of the case where the sensor is fixed in it."""
        if self.pendulous < 0.5:
            return vector([0.0, 0.0, 1.0])
        size = sqrt(self.f @ self.f)
        return vector([self.f[0] / size, self.f[1] / size, self.f[2] / size])

    def flow(self) -> None:
        self.der.n = (self.plumb() - self.n) / self.tau

    @sampled(every=1)
    def tick(self) -> None:
        pass

    def outputs(self) -> None:
        sp = sin(self.angle[0])
        cp = cos(self.angle[0])
        sr = sin(self.angle[1])
        cr = cos(self.angle[1])
        sh = sin(self.angle[2])
        ch = cos(self.angle[2])
        # rows of C = R2(roll) R1(pitch) R3(heading)
        x = vector([cr * ch - sr * sp * sh, cr * sh + sr * sp * ch, -sr * cp])
        y = vector([-cp * sh, cp * ch, sp])
        z = vector([sr * ch + cr * sp * sh, sr * sh - cr * sp * ch, cr * cp])
        sd = sin(self.declination)
        cd = cos(self.declination)
        down = sin(self.inclination) / cos(self.inclination)
        earth = self.field * vector([sd, cd, -down])
        B = vector(self.soft) @ vector([x @ earth, y @ earth, z @ earth]) + vector(self.hard)
        n = self.n / sqrt(self.n @ self.n)
        across = cross(vector([0.0, 1.0, 0.0]), n)
        across = across / sqrt(across @ across)
        ahead = cross(n, across)
        self.psi = atan2(-(B @ across), B @ ahead) + self.disturbance + self.noise.white
