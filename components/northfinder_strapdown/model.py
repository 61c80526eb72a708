from __future__ import annotations

from gyrobench.component import Discrete, Output
from gyrobench.component.blocks.north import ILL, VALID, NorthFinder
from gyrobench.component.math import asin, atan2, clip, cos, fabs, index, pi, sin, sqrt

TWO = [0.0, 0.0]
STEEP = 85.0 * pi / 180.0


class NorthfinderStrapdown(NorthFinder):
    """Heading, pitch and roll from two gyros and two accelerometers at rest in any attitude.  [NORTH-STRAPDOWN]

    theta (pitch) up, gamma (roll) right side down, with the means of the rates and forces along x and y:

        sin theta = f_y / g,   sin gamma = -f_x / (g cos theta)
        psi = atan2(-(w_x cos theta - w_y sin gamma sin theta + w_U sin gamma), (w_y - w_U sin theta) cos gamma)

    with w_U = W sin(latitude); sigma is that of psi as a function of w_x and w_y, N / (A sqrt(T)) for a level head.
    Taken in two positions, table angles 0 and 180 deg, half the differences stand for the means: biases of gyros
    and accelerometers cancel, if the head turns about its z axis. bias: of the gyro along y, with two positions.

    Refused: latitude within 5 deg of a pole.  Ill-conditioned: |theta| or |gamma| above 85 deg, or |sin| above 1.
    Not modelled: misalignments and scale factors of the instruments, noise of the accelerometers in sigma.
    Source: GSP ch. 5, eq. 5-63..5-65, corrected: vertical component w_U in eq. 5-65, atan2.
    """

    version = "1.0.0"

    pitch = Output("rad", "pitch theta at table angle 0, up positive")
    roll = Output("rad", "roll gamma at table angle 0, right side down positive")

    dwell = Discrete(TWO, "s", "time at 0 and at 180 deg")
    turn_x = Discrete(TWO, "rad", "integral of the rate along x")
    turn_y = Discrete(TWO, "rad", "integral of the rate along y")
    push_x = Discrete(TWO, "m/s", "integral of the force along x")
    push_y = Discrete(TWO, "m/s", "integral of the force along y")
    theta = Discrete(0.0, "rad", "pitch")
    gamma = Discrete(0.0, "rad", "roll")

    def take(self) -> None:
        k = 0.0 if cos(self.angle) > 0.0 else 1.0
        self.dwell[index(k)] = self.dwell[index(k)] + self.h
        self.turn_x[index(k)] = self.turn_x[index(k)] + self.h * self.rate[0]
        self.turn_y[index(k)] = self.turn_y[index(k)] + self.h * self.rate[1]
        self.push_x[index(k)] = self.push_x[index(k)] + self.h * self.f[0]
        self.push_y[index(k)] = self.push_y[index(k)] + self.h * self.f[1]

    def solve(self) -> None:
        self.state = ILL
        if self.dwell[0] > 0.0:
            wx = self.turn_x[0] / self.dwell[0]
            wy = self.turn_y[0] / self.dwell[0]
            fx = self.push_x[0] / self.dwell[0]
            fy = self.push_y[0] / self.dwell[0]
            mean = 1.0 / self.dwell[0]  # variance of a rate over N2
            self.offset = 0.0
            if self.dwell[1] > 0.0:
                other = self.turn_y[1] / self.dwell[1]
                self.offset = 0.5 * (wy + other)
                wx = 0.5 * (wx - self.turn_x[1] / self.dwell[1])
                wy = 0.5 * (wy - other)
                fx = 0.5 * (fx - self.push_x[1] / self.dwell[1])
                fy = 0.5 * (fy - self.push_y[1] / self.dwell[1])
                mean = 0.25 * (mean + 1.0 / self.dwell[1])
            self.theta = asin(clip(fy / self.gravity, -1.0, 1.0))
            st = sin(self.theta)
            ct = cos(self.theta)
            right = -fx / self.gravity
            if fabs(self.theta) < STEEP and fabs(right) < ct:
                self.gamma = asin(right / ct)
                sg = sin(self.gamma)
                east = -(wx * ct - wy * sg * st + self.up * sg)
                north = (wy - self.up * st) * cos(self.gamma)
                self.psi = atan2(east, north)
                # both are A cos(theta) cos(gamma) times sin psi, cos psi
                square = east * east + north * north
                self.seen = sqrt(square) / (ct * cos(self.gamma))
                by_x = north * ct
                by_y = north * sg * st - east * cos(self.gamma)
                if square > 0.0:
                    self.sd = self.density * sqrt(mean * (by_x * by_x + by_y * by_y)) / square
                    if fabs(self.gamma) < STEEP:
                        self.state = VALID

    def outputs(self) -> None:
        self.pitch = self.theta
        self.roll = self.gamma
