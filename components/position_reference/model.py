from __future__ import annotations

from gyrobench.component import IDENTITY, Component, Input, Noise, Output, Parameter
from gyrobench.component.math import atan2, fabs, floor, index, pi

TURN = 2.0 * pi


class PositionReference(Component):
    """Optical polygon with autocollimator, and a level with two axes, on the plate of a table.  [TABLE-POSITION]

    Both are mounted at the azimuth b of `face` (a rotation about the table axis) and can be turned against the plate.
    With a the table angle, N faces, k = nearest whole number of N (a + b) / one turn:

        deviation = a + b - k turn / N - errors[k modulo N] + zero + noise          lost beyond +-reach

    Level, small angles, L = (l_x, l_y) as a complex number l_x + j l_y, f in table axes:

        tilt of the plate on the table     P = (f_x + j f_y) / f_z + plate[1] + j plate[2]
        reading                            L = P e^(-j b) + level_zero[1] + j level_zero[2] + noise

    Not modelled: flatness of the faces, pyramidal error, tilt of the autocollimator, lag of the level.
    Source: method of the trade (polygon in several mounts); Hu 1981, section 5.4 (accuracy in position, wobble).
    """

    version = "1.0.0"

    faces = Parameter(12, int, "faces of the polygon", min=2, max=72)
    errors = Parameter([0.0] * 72, "rad", "error of each face, in the sense of the table angle")
    zero = Parameter(0.0, "rad", "zero of the autocollimator")
    reach = Parameter(pi / 2160.0, "rad", "largest reading of the autocollimator (5 arcmin)", above=0.0)
    plate = Parameter([0.0, 0.0], "rad", "tilt of the plate against the axis, as the level reads it in table axes")
    level_zero = Parameter([0.0, 0.0], "rad", "zeros of the level")
    optical = Noise(2.4e-7, "rad/sqrt(Hz)", "noise density of the autocollimator (0.05 arcsec/sqrt(Hz))")
    level_x_noise = Noise(2.4e-7, "rad/sqrt(Hz)", "noise density of the level, x (0.05 arcsec/sqrt(Hz))")
    level_y_noise = Noise(2.4e-7, "rad/sqrt(Hz)", "noise density of the level, y")
    step = Parameter(1e9, "s", "largest internal step: one reading for each communication step", above=0.0)

    angle = Input(0.0, "rad", "table angle")
    f = Input([0.0, 0.0, 9.80665], "m/s2", "specific force, table axes")
    face = Input(IDENTITY, "1", "mount: rows are the axes of polygon and level in table axes")

    deviation = Output("rad", "reading of the autocollimator")
    level_x = Output("rad", "reading of the level, x")
    level_y = Output("rad", "reading of the level, y")
    lost = Output("1", "1 while the face is beyond the reach of the autocollimator")

    def outputs(self) -> None:
        b = atan2(self.face[0][1], self.face[0][0])
        pitch = TURN / self.faces
        k = floor((self.angle + b) / pitch + 0.5)
        number = k - self.faces * floor(k / self.faces)
        deviation = self.angle + b - k * pitch - self.errors[index(number)] + self.zero
        self.lost = 1.0 if fabs(deviation) > self.reach else 0.0
        self.deviation = deviation + self.noise.optical
        px = self.f[0] / self.f[2] + self.plate[0]
        py = self.f[1] / self.f[2] + self.plate[1]
        c = self.face[0][0]
        s = self.face[0][1]
        self.level_x = c * px + s * py + self.level_zero[0] + self.noise.level_x_noise
        self.level_y = c * py - s * px + self.level_zero[1] + self.noise.level_y_noise
