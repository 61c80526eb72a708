from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Noise, Output, Parameter, sampled
from gyrobench.component.math import Number, floor, pi, sin


class ReadingChannel(Component):
    """Channel between a meter and an estimator that disturbs the reading: noise, a line, gaps, wild readings.

        y = z + white noise + line sin(2 pi line_frequency t) + wild readings,    valid = 1
        in a gap: y = the last value before it,                                   valid = 0

    Each disturbance is there while the input `phase` is its phase; phase 0: in none.  A gap of gap_length begins at
    every multiple of gap_period; a wild reading, one communication step long, is off by +wild_size and -wild_size in
    turn, at every multiple of wild_period, and valid as any other: that it is wild, the estimator must find out.

    The reading passes within the step (direct feedthrough).  Of no physical origin: a known disturbance to compare
    estimators by.  Not modelled: delay, quantization, gaps and wild readings at random times.
    Source: our own; missing and wild readings as BENCH-DYN-SINE leaves them out.
    """

    version = "1.0.0"

    step = Parameter(1e9, "s", "largest internal step: one sample for each communication step", above=0.0)
    white = Noise(0.0, "1/sqrt(Hz)", "density of the noise, (unit of z)/sqrt(Hz)")
    noise_phase = Parameter(0, int, "phase in which the noise is there; 0: none", min=0)
    line = Parameter(0.0, "1", "amplitude of the line, unit of z", min=0.0)
    line_frequency = Parameter(50.0, "Hz", "its frequency", above=0.0)
    line_phase = Parameter(0, int, "phase in which the line is there; 0: none", min=0)
    gap_period = Parameter(1.0, "s", "time from gap to gap", above=0.0)
    gap_length = Parameter(0.0, "s", "length of a gap", min=0.0)
    gap_phase = Parameter(0, int, "phase in which there are gaps; 0: none", min=0)
    wild_period = Parameter(1.0, "s", "time from one wild reading to the next", above=0.0)
    wild_size = Parameter(0.0, "1", "by how much a wild reading is off, unit of z")
    wild_phase = Parameter(0, int, "phase in which there are wild readings; 0: none", min=0)

    z = Input(0.0, "1", "reading")
    phase = Input(0.0, "1", "number of the running phase, from 1")

    y = Output("1", "reading as it arrives, unit of z")
    valid = Output("1", "0: this reading is missing")

    last = Discrete(0.0, "1", "last value that arrived")
    count = Discrete(0.0, "1", "wild readings that are due so far")
    off = Discrete(0.0, "1", "by how much this reading is wild")

    def start(self) -> None:
        self.refuse(
            self.gap_length >= self.gap_period, "gap_length = {gap_length} s must be below gap_period = {gap_period} s"
        )

    def during(self, phase: Number) -> Number:
        """Return 1 while this phase runs, 0 for phase 0."""
        return 1.0 if phase > 0.5 and self.phase == phase else 0.0

    def missing(self) -> Number:
        """Return 1 in a gap."""
        # 1e-9 of a period to spare: rounding of t moves neither end of a gap by a step
        into = self.t / self.gap_period - floor(self.t / self.gap_period + 1e-9)
        return self.during(self.gap_phase) if into < self.gap_length / self.gap_period - 1e-9 else 0.0

    def disturbed(self) -> Number:
        noise = self.during(self.noise_phase) * self.noise.white
        wave = self.during(self.line_phase) * self.line * sin(2.0 * pi * self.line_frequency * self.t)
        return self.z + noise + wave + self.off

    @sampled(every=1)
    def tick(self) -> None:
        due = floor(self.t / self.wild_period + 1e-9)
        self.off = 0.0
        if due > self.count and self.during(self.wild_phase) > 0.5:
            self.off = self.wild_size if due - 2.0 * floor(0.5 * due) > 0.5 else -self.wild_size
        self.count = due
        if self.missing() < 0.5:
            self.last = self.disturbed()

    def outputs(self) -> None:
        gone = self.missing()
        self.valid = 1.0 - gone
        self.y = self.last if gone > 0.5 else self.disturbed()
