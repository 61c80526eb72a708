from __future__ import annotations

from gyrobench.component import Discrete, Parameter
from gyrobench.component.blocks.north import ILL, VALID, WRONG, NorthFinder
from gyrobench.component.math import asin, clip, cos, fabs, index, pi, sin, sqrt


class NorthfinderTwoPosition(NorthFinder):
    """Heading from the mean rates of a gyro at two positions of a level head, 180 deg apart.  [NORTH-2POS]

        c = (w_1 - w_2) / (2 A),   psi = +-arccos c,   A = W cos(latitude),   bias = (w_1 + w_2) / 2

        sigma = N sqrt(1/T_1 + 1/T_2) / (2 A |sin psi|)

    The latitude must be known, and a rough heading, whose sign is taken; near north and south (|psi| < 30 deg or > 150
    deg) a small error of c is a large one of psi: status 2.  |c| > 1 by more than 5 sigma of c: status 3, else psi is 0
    or 180 deg and the status 2.  The horizontal rate is not measured; that of the latitude is put out.

    Refused: latitude within 5 deg of a pole.
    Not modelled: tilt of the head, errors of the angle: a position is the nearest half turn.
    Source: GSP ch. 5, eq. 5-45..5-48.
    """

    version = "1.0.0"

    rough = Parameter(0.5 * pi, "rad", "rough heading, whose sign is taken", min=-pi, max=pi)

    turn = Discrete([0.0, 0.0], "rad", "integral of the rate in each position")
    dwell = Discrete([0.0, 0.0], "s", "time in each position")

    def take(self) -> None:
        k = 0.0 if cos(self.angle) > 0.0 else 1.0
        self.turn[index(k)] = self.turn[index(k)] + self.h * self.rate[1]
        self.dwell[index(k)] = self.dwell[index(k)] + self.h

    def solve(self) -> None:
        self.state = ILL
        if self.dwell[0] > 0.0 and self.dwell[1] > 0.0:
            first = self.turn[0] / self.dwell[0]
            second = self.turn[1] / self.dwell[1]
            c = 0.5 * (first - second) / self.north
            sd = 0.5 * self.density * sqrt(1.0 / self.dwell[0] + 1.0 / self.dwell[1]) / self.north
            size = 0.5 * pi - asin(clip(c, -1.0, 1.0))
            self.psi = size if self.rough >= 0.0 else -size
            self.seen = self.north
            self.offset = 0.5 * (first + second)
            s = sin(size)
            self.sd = sd / (s if s > sd else sd)
            if fabs(c) > 1.0 + 5.0 * sd:
                self.state = WRONG
            elif s > 0.5:
                self.state = VALID
