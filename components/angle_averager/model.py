from __future__ import annotations

from gyrobench.component import Discrete, Input, Output, Parameter, sampled
from gyrobench.component.blocks.angle import wrapped
from gyrobench.component.blocks.estimator import SampledEstimator
from gyrobench.component.math import TWO_PI, Number, fabs, floor, index, pi, sqrt

ARCSEC = pi / 648000.0
LENGTH = 361  # values of the table at most, both ends of the cycle
BUFFER = 64  # readings that are kept
RECURSIVE, CENTRED = 0.0, 1.0


class AngleAverager(SampledEstimator):
    """Mean of angle readings on the circle, their known error taken off by a table.  [EST-ANGLE-AVG]

        y = theta + Delta(theta) + e, var e = sigma2             z = y - Delta(y), then `refine` times z <- y - Delta(z)

        mode 0, n readings, then anew:    K_k = p_k/(p_k + sigma2),   p_k+1 = p_k sigma2/(p_k + sigma2)
                                          mean <- mean + K_k wrap(z - mean)   modulo 2 pi
        mode 1, at each reading:          mean of n/2 readings before and n/2 after the one n/2 readings ago

    p_k is the variance BEFORE reading k, the first one k = 0: p_0 = sigma_0^2; without a prior (sigma_0 = 0) the first
    reading is the first mean and K_k = 1/(k + 1), the arithmetic mean.  wrap(x) = ((x + pi) mod 2 pi) - pi.

    Delta: values at equal steps over a cycle of 2 pi/cycles, the last one at its end and equal to the first; between
    them the cubic through four neighbours.  cycles = 1: a table of the turn; 360: of each electrical cycle.

    The mean of readings of a moving table belongs to the mean time of its readings, t_mean; ten readings k-5 ... k+4
    taken for the instant k are off by half a period of the motion, the last ten by 4.5 periods.  In mode 1, without the
    reading in the middle, the mean belongs to that reading and is right at constant rate.

    Not modelled: errors that Delta leaves, the same in each reading of a table at rest: they do not average.
    Source: EST-ANGLE-AVG; Hu 1981, eq. 6-20..6-23.
    """

    version = "1.0.0"

    mode = Parameter(0, int, "0 recursive over n readings, 1 centred on a reading", min=0, max=1)
    n = Parameter(10, int, "readings of a mean; even in mode 1", min=1)
    sigma = Parameter(2.0 * ARCSEC, "rad", "standard deviation of a reading (2 arcsec)", above=0.0)
    prior = Parameter(0.0, "rad", "angle expected before the first reading")
    sigma_0 = Parameter(0.0, "rad", "standard deviation of the prior; 0: no prior", min=0.0)
    points = Parameter(0, int, "intervals of the table in a cycle; 0: no table", min=0, max=LENGTH - 1)
    cycles = Parameter(1, int, "cycles of the table in a turn", min=1)
    table = Parameter([0.0] * LENGTH, "rad", "reading less angle at the steps of a cycle, points + 1 values")
    refine = Parameter(1, int, "further steps of the correction", min=0, max=3)

    z = Input(0.0, "rad", "angle reading")

    estimate = Output("rad", "mean angle, 0 to 2 pi")
    t_mean = Output("s", "instant that the mean belongs to")
    sd = Output("rad", "standard deviation of the mean, of white reading noise")
    spread = Output("rad", "standard deviation of the readings about their mean")
    count = Output("1", "means completed")
    corrected = Output("rad", "last reading less its error")
    latency = Output("s", "delay of the mean")

    mean = Discrete(0.0, "rad", "running mean")
    plain = Discrete(0.0, "rad", "arithmetic mean of the readings")
    squares = Discrete(0.0, "rad2", "sum of squares about it")
    p = Discrete(0.0, "rad2", "variance of the running mean")
    k = Discrete(0.0, "1", "readings in the running mean")
    time = Discrete(0.0, "s", "mean instant of the readings")
    last = Discrete([0.0] * BUFFER, "rad", "last readings")
    done = Discrete(0.0, "1", "means completed")
    z_true = Discrete(0.0, "rad", "last reading less its error")
    found = Discrete([0.0, 0.0, 0.0, 0.0], "1", "last mean, its instant, standard deviation, spread")

    def start(self) -> None:
        half = floor(0.5 * self.n)
        self.refuse(self.mode == CENTRED and self.n != 2.0 * half, "n = {n} in mode 1: must be even")
        self.refuse(self.mode == CENTRED and self.n > BUFFER - 2.0, "n = {n} in mode 1: 62 readings at most")
        self.refuse(
            self.points > 0.0 and self.points < 4.0, "points = {points}: a table needs 4 intervals or more; 0: no table"
        )
        self.refuse(
            self.points > 0.0 and fabs(self.table[index(self.points)] - self.table[0]) > 1e-3 * self.sigma,
            "the table is not closed: its value at the end of the cycle (number points + 1, points = {points}) must be "
            "the first one",
        )
        self.p = self.sigma_0 * self.sigma_0
        self.mean = self.prior

    def error(self, angle: Number) -> Number:
        """Return Delta at an angle: cubic through the four values about it."""
        if self.points < 0.5:
            return 0.0
        x = angle * self.cycles / TWO_PI
        x = (x - floor(x)) * self.points
        i = floor(x)
        u = x - i
        m = self.points
        a = self.table[index(i - 1.0 + (m if i < 0.5 else 0.0))]
        b = self.table[index(i - (m if i > m - 0.5 else 0.0))]
        c = self.table[index(i + 1.0 - (m if i > m - 1.5 else 0.0))]
        d = self.table[index(i + 2.0 - (m if i > m - 2.5 else 0.0))]
        left = -u * (u - 1.0) * (u - 2.0) / 6.0 * a + 0.5 * (u + 1.0) * (u - 1.0) * (u - 2.0) * b
        return left - 0.5 * (u + 1.0) * u * (u - 2.0) * c + (u + 1.0) * u * (u - 1.0) / 6.0 * d

    def recursive(self) -> None:
        """Take the corrected reading into the running mean; after n of them it is complete."""
        first = self.k < 0.5
        gain = self.p / (self.p + self.sigma * self.sigma)
        if self.sigma_0 == 0.0:
            gain = 1.0 / (self.k + 1.0)
            if first:
                self.mean = self.z_true
        off = wrapped(self.z_true - self.mean)
        self.refuse(
            fabs(off) > 0.5 * pi,
            "reading {z_true} rad is more than 90 deg away from the mean of those before, {mean} rad: the window of n "
            "= {n} readings is too wide for the motion of the table, or the reading jumped",
        )
        self.mean = self.mean + gain * off
        self.p = self.p * self.sigma * self.sigma / (self.p + self.sigma * self.sigma)
        if self.sigma_0 == 0.0:
            self.p = self.sigma * self.sigma / (self.k + 1.0)
        if first:
            self.plain = self.z_true
            self.squares = 0.0
            self.time = 0.0
        away = wrapped(self.z_true - self.plain)
        self.plain = self.plain + away / (self.k + 1.0)
        self.squares = self.squares + away * away * self.k / (self.k + 1.0)
        self.time = self.time + (self.t - self.time) / (self.k + 1.0)
        self.k = self.k + 1.0
        self.found[0] = self.mean
        self.found[1] = self.time
        self.found[2] = sqrt(self.p)
        self.found[3] = sqrt(self.squares / (self.k - 1.0)) if self.k > 1.5 else 0.0
        if self.k > self.n - 0.5:
            self.done = self.done + 1.0
            self.k = 0.0
            self.p = self.sigma_0 * self.sigma_0
            self.mean = self.prior

    def centred(self) -> None:
        """Keep the corrected reading; with n + 1 of them, the mean about the one in the middle without it."""
        for j in range(BUFFER - 1):
            self.last[BUFFER - 1 - j] = self.last[BUFFER - 2 - j]
        self.last[0] = self.z_true
        self.k = self.k + 1.0
        if self.k > self.n + 0.5:
            half = 0.5 * self.n
            middle = self.last[index(half)]
            total = 0.0
            squares = 0.0
            widest = 0.0
            for j in range(BUFFER):
                if j < self.n + 0.5 and j != half:
                    off = wrapped(self.last[j] - middle)
                    total = total + off
                    squares = squares + off * off
                    widest = fabs(off) if fabs(off) > widest else widest
            self.mean = middle
            self.refuse(
                widest > 0.5 * pi,
                "a reading is more than 90 deg away from {mean} rad, in the middle of the window: n = {n} readings "
                "are too wide for the motion of the table, or a reading jumped",
            )
            off = total / self.n
            self.found[0] = middle + off
            self.found[1] = self.t - half * self.Ts
            self.found[2] = self.sigma / sqrt(self.n)
            self.found[3] = sqrt((squares - self.n * off * off) / (self.n - 1.0))
            self.done = self.done + 1.0

    @sampled(every=1)
    def tick(self) -> None:
        if self.reading > 0.5 and self.valid < 0.5 and self.mode == CENTRED:
            self.k = 0.0  # a window with a gap is not centred
        if self.reading > 0.5 and self.valid > 0.5:
            self.z_true = self.z - self.error(self.z)
            for j in range(3):
                if j < self.refine:
                    self.z_true = self.z - self.error(self.z_true)
            if self.mode == RECURSIVE:
                self.recursive()
            else:
                self.centred()

    def outputs(self) -> None:
        self.estimate = self.found[0] - TWO_PI * floor(self.found[0] / TWO_PI)
        self.t_mean = self.found[1]
        self.sd = self.found[2]
        self.spread = self.found[3]
        self.count = self.done
        self.corrected = self.z_true
        self.latency = 0.5 * self.n * self.Ts if self.mode == CENTRED else 0.5 * (self.n - 1.0) * self.Ts
