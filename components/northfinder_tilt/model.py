from __future__ import annotations

from gyrobench.component import sampled
from gyrobench.component.blocks.north import RotatingFinder
from gyrobench.component.math import Number, fabs, sqrt


class NorthfinderTilt(RotatingFinder):
    """Heading from a gyro and an accelerometer on a turning head that is not level.  [NORTH-TILT]

    The gyro axis y points up by theta, sin theta = f_y / g, and sees the vertical Earth rate:

        w_y = A cos(heading of y) cos theta + W sin(latitude) sin theta + bias
        w_c = (w_y - W sin(latitude) f_y / g) / sqrt(1 - (f_y / g)2)

    w_c goes into the least squares of northfinder_continuous.  Without it a tilt about north turns the heading by tilt
    times tan(latitude).  A bias of the accelerometer is the same at all angles and goes into the constant.

    Refused: latitude within 5 deg of a pole; |f_y| >= g.
    Not modelled: terms of second order in the tilt t, which turn the heading by up to 3/8 t2 (0.13' at 10 mrad); scale
    factor and misalignment of the accelerometer, acceleration of the base other than zero mean.
    Source: GSP ch. 5, eq. 5-57..5-62, corrected: sign of the vertical term, specific force.
    """

    version = "1.1.0"

    def sample(self) -> Number:
        s = self.f[1] / self.gravity
        return (self.rate[1] - self.up * s) / sqrt(1.0 - s * s)

    @sampled(every=1)
    def steep(self) -> None:
        self.refuse(
            self.gate > 0.0 and fabs(self.f[1]) >= self.gravity,
            "f[2] reaches gravity, {gravity} m/s2: the axis y stands upright, or the unit is wrong",
        )
