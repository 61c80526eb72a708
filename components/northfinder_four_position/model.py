from __future__ import annotations

from gyrobench.component import Discrete
from gyrobench.component.blocks.north import FOUR, ILL, VALID, NorthFinder
from gyrobench.component.math import atan2, floor, index, pi, sqrt


class NorthfinderFourPosition(NorthFinder):
    """Heading from the mean rates of a gyro at four positions of a level head, 90 deg apart.  [NORTH-4POS]

    With w_k at 0, 90, 180, 270 deg clockwise (table angles 0, -90 ...):

        psi = atan2(w_4 - w_2, w_1 - w_3),   A = hypot(w_4 - w_2, w_1 - w_3) / 2,   bias = (w_1 + w_2 + w_3 + w_4) / 4

        var psi = N2 ((1/T_2 + 1/T_4) cos2 psi + (1/T_1 + 1/T_3) sin2 psi) / (4 A2)

    No latitude is needed; it checks A.  Taken in the order 1-2-3-4-4-3-2-1 a linear drift of the bias cancels.

    Refused: latitude within 5 deg of a pole.  Ill-conditioned: a position is missing.
    Not modelled: tilt of the head, errors of the angle: a position is the nearest quarter of a turn.
    Source: GSP ch. 5, eq. 5-49..5-51, corrected: the weighted mean of two arc functions is this atan2.
    """

    version = "1.0.0"

    turn = Discrete(FOUR, "rad", "integral of the rate in each position")
    dwell = Discrete(FOUR, "s", "time in each position")

    def take(self) -> None:
        quarter = floor(-self.angle / (0.5 * pi) + 0.5)
        k = quarter - 4.0 * floor(quarter / 4.0)
        self.turn[index(k)] = self.turn[index(k)] + self.h * self.rate[1]
        self.dwell[index(k)] = self.dwell[index(k)] + self.h

    def solve(self) -> None:
        self.state = ILL
        if self.dwell[0] > 0.0 and self.dwell[1] > 0.0 and self.dwell[2] > 0.0 and self.dwell[3] > 0.0:
            w = [0.0, 0.0, 0.0, 0.0]
            for k in range(4):
                w[k] = self.turn[k] / self.dwell[k]
            c = 0.5 * (w[0] - w[2])
            b = 0.5 * (w[3] - w[1])
            square = c * c + b * b
            self.psi = atan2(b, c)
            self.seen = sqrt(square)
            self.offset = 0.25 * (w[0] + w[1] + w[2] + w[3])
            even = 1.0 / self.dwell[0] + 1.0 / self.dwell[2]
            odd = 1.0 / self.dwell[1] + 1.0 / self.dwell[3]
            if square > 0.0:  # readings in steps may be alike in all positions
                self.sd = 0.5 * self.density * sqrt(odd * c * c + even * b * b) / square
                self.state = VALID
