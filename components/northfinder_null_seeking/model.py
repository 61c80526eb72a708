from __future__ import annotations

from gyrobench.component import Discrete, Input, Output, Parameter, sampled
from gyrobench.component.blocks.north import ILL, VALID, NorthFinder
from gyrobench.component.math import asin, atan2, clip, cos, fabs, floor, index, pi, sin, sqrt


class NorthfinderNullSeeking(NorthFinder):
    """Heading from pairs of positions 180 deg apart that are turned until both rates are the same.  [NORTH-NULL]

        c = (w_1 - w_2) / (2 A),   turn+ = turn - side asin c,   command = target + turn,   A = W cos(latitude)

        psi_k = turn_k + side (90 deg - asin c_k),   sigma = N / (A sqrt(T)),   T: time of the pairs from the second on

    At the null the axis y points east or west, not north: psi = turn + side 90 deg, side = +-1 the sign of the rough
    heading.  There a heading does most to c, and an error of A, by the latitude or the scale factor, is of second
    order: turn closes in by 1 - A_true/A a pair.  The first pair seeks alone; psi is the mean of the others, by their
    time.  Positions come in pairs of phases; the input `target` is what the plan asks of the head.
    status 2: one pair only, or |c| > 0.1 in the last one.

    Refused: latitude within 5 deg of a pole.
    Not modelled: tilt of the head, drift of the bias from one position of a pair to the other, errors of the angle.
    Source: GSP ch. 5, text after eq. 5-48, corrected (EG26).
    """

    version = "1.0.0"

    rough = Parameter(0.5 * pi, "rad", "rough heading, whose sign is taken", min=-pi, max=pi)

    target = Input(0.0, "rad", "angle that the plan asks of the head")
    command = Output("rad", "angle that the head is to take")

    side = Discrete(1.0, "1", "sign of the rough heading")
    turn = Discrete(0.0, "rad", "angle by which the positions are turned")
    rates = Discrete([0.0, 0.0], "rad", "integral of the rate in each position of the pair")
    dwell = Discrete([0.0, 0.0], "s", "time in each position of the pair")
    seen_phase = Discrete(0.0, "1", "phase of the last sample")
    was = Discrete(0.0, "1", "gate of the step before")
    pairs = Discrete(0.0, "1", "pairs that are done")
    pointing = Discrete([0.0, 0.0], "s", "sum of time times sine and cosine of psi of the pairs from the second on")
    both = Discrete([0.0, 0.0], "s", "time of these pairs in each position")
    c_last = Discrete(0.0, "1", "c of the last pair")

    def start(self) -> None:
        self.side = 1.0 if self.rough >= 0.0 else -1.0
        self.turn = 0.0

    @sampled(every=1)
    def seek(self) -> None:
        """Turn the positions where a pair has ended."""
        even = self.seen_phase - 2.0 * floor(0.5 * self.seen_phase) < 0.5
        if self.was > 0.5 and self.gate == 0.0 and even:
            self.close()
        self.was = self.gate

    def close(self) -> None:
        """Take the pair that has been read."""
        if self.dwell[0] > 0.0 and self.dwell[1] > 0.0:
            first = self.rates[0] / self.dwell[0]
            second = self.rates[1] / self.dwell[1]
            self.c_last = 0.5 * (first - second) / self.north
            off = self.side * asin(clip(self.c_last, -1.0, 1.0))
            self.offset = 0.5 * (first + second)
            if self.pairs > 0.5:
                psi = self.turn + self.side * 0.5 * pi - off
                weight = self.dwell[0] + self.dwell[1]
                self.pointing[0] = self.pointing[0] + weight * sin(psi)
                self.pointing[1] = self.pointing[1] + weight * cos(psi)
                for k in range(2):
                    self.both[k] = self.both[k] + self.dwell[k]
            self.turn = self.turn - off
            self.pairs = self.pairs + 1.0
            for k in range(2):
                self.rates[k] = 0.0
                self.dwell[k] = 0.0

    def take(self) -> None:
        self.seen_phase = self.phase
        k = 0.0 if cos(self.angle - self.turn) > 0.0 else 1.0
        self.rates[index(k)] = self.rates[index(k)] + self.h * self.rate[1]
        self.dwell[index(k)] = self.dwell[index(k)] + self.h

    def solve(self) -> None:
        if self.finished > 0.5:
            self.close()  # the last pair ends with the plan
        self.state = ILL
        if self.both[0] > 0.0 and self.both[1] > 0.0:
            self.psi = atan2(self.pointing[0], self.pointing[1])
            self.seen = self.north
            self.sd = 0.5 * self.density * sqrt(1.0 / self.both[0] + 1.0 / self.both[1]) / self.north
            if fabs(self.c_last) < 0.1:
                self.state = VALID

    def outputs(self) -> None:
        self.command = self.target + self.turn
