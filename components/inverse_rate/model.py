from __future__ import annotations

from gyrobench.component import Discrete, Output, Parameter, sampled
from gyrobench.component.blocks.angle import RateReadout, nearest
from gyrobench.component.math import Number, fabs, floor, pi


class InverseRate(RateReadout):
    """Rate by the time of exact intervals of 1 deg, 0.0001 to 999.9999 s.  [READOUT-RATE]

    Marks stand at the counts k N, N = interval / quantum.  Where the counts pass one between two readings, the instant
    is interpolated between their stamps and rounded down to the clock's LSB; then

        time = t_k - t_(k-1)        rate = +- interval / time

    Several marks between two readings give their mean interval.  A reversal starts anew at the mark that is passed
    again.  Downwards a mark stands lower by `hysteresis`, so that noise of the counts at a mark is not a reversal.  An
    interval longer than the display is an overflow: no rate is shown, that of the last interval neither.
    At less than a count for a reading the instant is known to a reading step.

    Not modelled: errors of the marks other than those of the counts.
    Source: Hu 1981, section 5.4 (three-3).
    """

    version = "1.0.0"

    interval = Parameter(pi / 180.0, "rad", "angle between two marks (1 deg)", above=0.0)
    lsb = Parameter(1e-4, "s", "resolution of the time", above=0.0)
    time_max = Parameter(999.9999, "s", "longest time that the display shows", above=0.0)

    hysteresis = Parameter(10.0, "1", "counts by which a mark stands lower downwards", min=0.0)

    duration = Output("s", "time of the last interval; 0: none")

    N = Discrete(1.0, "1", "counts of an interval")
    place = Discrete(0.0, "1", "number of the interval that the last reading lies in")
    mark = Discrete(0.0, "1", "mark passed last")
    sense = Discrete(0.0, "1", "direction in which; 0: none yet")
    t_mark = Discrete(0.0, "s", "when, by the clock")

    def start(self) -> None:
        self.N = nearest(self.interval / self.quantum)
        self.refuse(
            fabs(self.interval / self.quantum - self.N) > 1e-6 or self.N < 1.0,
            "interval = {interval} rad must be a whole number of counts of quantum = {quantum} rad",
        )
        self.refuse(self.hysteresis >= self.N, "hysteresis = {hysteresis} counts must be below those of an interval")

    def passed(self, mark: Number, up: Number) -> Number:
        """Return when the counts passed a mark, upwards (1) or downwards (-1), between the last two readings."""
        level = mark * self.N if up > 0.0 else mark * self.N - self.hysteresis
        part = (level - self.count_last) / (self.count - self.count_last)
        t = (self.t_last + part * (self.t_read - self.t_last)) * (1.0 + self.clock)
        return self.lsb * floor(t / self.lsb + 1e-9)

    @sampled(every=1)
    def tick(self) -> None:
        above = floor(self.count / self.N)
        below = floor((self.count + self.hysteresis) / self.N)
        if self.started == 0.0:
            self.place = above
        if above > self.place or below < self.place:
            up = 1.0 if above > self.place else -1.0
            first = self.place + 1.0 if up > 0.0 else self.place  # marks passed: from first to last
            last = above if up > 0.0 else below + 1.0
            self.place = above if up > 0.0 else below
            t = self.passed(last, up)
            known = self.sense == up and first == self.mark + up
            before = self.mark if known else first
            t_before = self.t_mark if known else self.passed(first, up)
            if last != before and t > t_before:
                intervals = (last - before) * up
                self.r_time = (t - t_before) / intervals
                self.r_angle = up * self.interval
                self.r_number = self.r_number + 1.0
                self.r_start = t_before
                self.r_end = t
                self.over = 1.0 if self.r_time > self.time_max else 0.0
            self.mark = last
            self.sense = up
            self.t_mark = t
        if self.sense != 0.0 and self.t_read * (1.0 + self.clock) - self.t_mark > self.time_max:
            self.over = 1.0
        self.note()

    def outputs(self) -> None:
        self.duration = self.r_time if self.valid == 1.0 else 0.0
