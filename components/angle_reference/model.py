from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Noise, Output, Parameter, sampled
from gyrobench.component.math import floor, pi


class AngleReference(Component):
    """Angle reference that aids a platform: its angle, read now and then, with noise.  [EST-KF-AIDED]

        off = theta - theta_0
        angle = off + noise, new = 1      in the steps that end at 0, 1, 2 ... times `period` after the phase began
        angle as it was, new = 0          in the steps between

    while the input `phase` is its phase, phase_read; outside of it all are 0.  With phase_read = 0 it reads always.
    theta_0 is the angle with which the phase begins: the direction that the platform has to keep.  A star tracker, or
    an autocollimator on the ground.

    Not modelled: delay of the reading, a range, quantization.
    Source: own design.
    """

    version = "1.0.0"

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    period = Parameter(1.0, "s", "time between two readings", above=0.0)
    phase_read = Parameter(0, int, "phase in which it reads; 0: always", min=0)
    reading = Noise(pi / 648000.0, "rad", "standard deviation of a reading (1 arcsec)", per="step")

    theta = Input(0.0, "rad", "angle of the platform")
    phase = Input(0.0, "1", "number of the running phase, from 1")

    angle = Output("rad", "last reading, from the angle with which the phase began")
    new = Output("1", "1 in the step in which the angle is read")
    off = Output("rad", "the same without noise, in every step")

    inside = Discrete(0.0, "1", "1 in the phase")
    begin = Discrete(0.0, "s", "when the phase began")
    zero = Discrete(0.0, "rad", "angle then")
    count = Discrete(0.0, "1", "readings in the phase so far")
    last = Discrete(0.0, "rad", "last reading")
    fresh = Discrete(0.0, "1", "1 in the step of a reading")
    now = Discrete(0.0, "rad", "angle less the one at the beginning")

    @sampled(every=1)
    def tick(self) -> None:
        self.fresh = 0.0
        if self.phase_read < 0.5 or self.phase == self.phase_read:
            if self.inside < 0.5:
                self.inside = 1.0
                self.begin = self.t
                self.zero = self.theta
                self.count = 0.0
            self.now = self.theta - self.zero
            due = floor((self.t - self.begin) / self.period + 1e-9) + 1.0
            if due > self.count:
                self.count = due
                self.last = self.now + self.noise.reading
                self.fresh = 1.0
        else:
            self.inside = 0.0
            self.now = 0.0
            self.last = 0.0

    def outputs(self) -> None:
        self.angle = self.last
        self.new = self.fresh
        self.off = self.now
