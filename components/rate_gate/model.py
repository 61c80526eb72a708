from __future__ import annotations

from gyrobench.component import Discrete, Parameter, sampled
from gyrobench.component.blocks.angle import RateReadout


class RateGate(RateReadout):
    """Rate by counting over gates of 0.1, 1, 10, 100 or 1000 s.  [READOUT-RATE]

    Gate k of duration T opens with the first reading stamped at or after t_1 + (k - 1) T, t_1 the first stamp, and
    closes where the next one opens:

        rate = quantum (n_end - n_start) / ((t_end - t_start) (1 + clock))

    The error of a count at each end is a rate error quantum / T at most, that of the time base -clock rate
    (|d rate| <= |d angle / T| + |angle dT / T^2|; the sign of the first is +, ET4).  More counts than the display has
    digits for are an overflow, and no rate is shown until a gate with fewer.

    Not modelled: dead time between gates, jitter of the gate.
    Source: Hu 1981, section 5.4 (three-2), eq. 5-2..5-6 with ET4.
    """

    version = "1.0.0"

    gate = Parameter(10.0, "s", "duration T of a gate: 0.1, 1, 10, 100 or 1000 s", above=0.0)
    count_max = Parameter(99999999.0, "1", "largest number of counts that the display shows", above=0.0)

    t_first = Discrete(0.0, "s", "stamp of the first reading")
    gates = Discrete(0.0, "1", "gates opened since then")
    count_start = Discrete(0.0, "1", "count at the start of the running gate")
    start_time = Discrete(0.0, "s", "its stamp")

    def start(self) -> None:
        g = self.gate
        known = g == 0.1 or g == 1.0 or g == 10.0 or g == 100.0 or g == 1000.0
        self.refuse(not known, "gate = {gate} s must be 0.1, 1, 10, 100 or 1000 s")

    @sampled(every=1)
    def tick(self) -> None:
        if self.started == 0.0:
            self.t_first = self.t_read
            self.gates = 1.0
            self.count_start = self.count
            self.start_time = self.t_read
        elif self.t_read >= self.t_first + self.gates * self.gate - 1e-9:
            counts = self.count - self.count_start
            self.over = 1.0 if counts > self.count_max or counts < -self.count_max else 0.0
            self.r_angle = self.quantum * counts
            self.r_time = (self.t_read - self.start_time) * (1.0 + self.clock)
            self.r_start = self.start_time
            self.r_end = self.t_read
            self.r_number = self.r_number + 1.0
            self.gates = self.gates + 1.0
            self.count_start = self.count
            self.start_time = self.t_read
        self.note()
