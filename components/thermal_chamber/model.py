from __future__ import annotations

from gyrobench.component import Component, Discrete, Output, Parameter, sampled
from gyrobench.component.math import Number, exp, fabs, sign

NONE = [0.0, 0.0, 0.0]
SEGMENTS = 16
ALIKE = 1e-6  # relative difference of the time constants below which they are one


class ThermalChamber(Component):
    """Chamber that runs a program of ramps and soaks; the instrument follows its air.  [IMU-THERMAL]

        p(t)   from start_at to targets[1] at ramps[1], held there for soaks[1], on to targets[2] ..., held at the end
        lag A' = p - A                       the air
        tau T' = A - T                       the instrument
        dT_j   = share_j (A - T)             differences between the ends of the instrument along its axes

    From step to step in closed form for a program that is linear there: neither step nor length matters but in the
    steps in which a ramp begins or ends.  All temperatures above that of the coefficients.

    Refused: a segment that changes the temperature with a ramp of 0.
    Not modelled: overshoot of the chamber's controller, humidity, several time constants, vibration of the fan.
    Source: own derivation.
    """

    version = "1.0.0"

    start_at = Parameter(0.0, "K", "temperature of program, air and instrument at the start")
    segments = Parameter(4, int, "number of segments, each a ramp and a soak", min=1, max=SEGMENTS)
    targets = Parameter([40.0, -40.0, -40.0, 0.0] + [0.0] * 12, "K", "temperature at the end of each ramp")
    ramps = Parameter([1.0 / 60.0] * SEGMENTS, "K/s", "rate of each ramp (1 K/min)", min=0.0)
    soaks = Parameter([600.0] * SEGMENTS, "s", "time for which it is held after each ramp", min=0.0)
    lag = Parameter(60.0, "s", "time constant of the air against the program", above=0.0)
    tau = Parameter(300.0, "s", "time constant of the instrument against the air", above=0.0)
    share = Parameter(NONE, "1", "temperature differences per kelvin between air and instrument")

    temperature = Output("K", "mean temperature of the instrument above that of its coefficients")
    room = Output("K", "temperature of the air above that of the coefficients")
    dT = Output("K", "temperature differences along the instrument's axes", shape=(3,))
    program = Output("K", "temperature that the program asks for")
    finished = Output("1", "1 when the program is at its end")

    air = Discrete(0.0, "K", "temperature of the air")
    inside = Discrete(0.0, "K", "temperature of the instrument")
    asked = Discrete(0.0, "K", "temperature of the program")
    ended = Discrete(0.0, "1", "1 at the end of the program")

    def start(self) -> None:
        at = self.start_at
        for k in range(SEGMENTS):
            if k < self.segments:
                self.refuse(self.targets[k] != at and self.ramps[k] == 0.0, "ramps: a segment that changes needs one")
                at = self.targets[k]
        self.air = self.start_at
        self.inside = self.start_at
        self.asked = self.start_at

    def asked_at(self, t: Number) -> Number:
        """Return the temperature of the program at the time t."""
        at = self.start_at
        found = self.start_at
        left = t
        for k in range(SEGMENTS):
            if k < self.segments and left >= 0.0:
                rise = self.targets[k] - at
                time = fabs(rise) / self.ramps[k] if rise != 0.0 else 0.0
                found = at + sign(rise) * self.ramps[k] * left if left < time else self.targets[k]
                left = left - time - self.soaks[k]
                at = self.targets[k]
        return found

    def length(self) -> Number:
        """Return the time of the whole program, s."""
        at = self.start_at
        total = 0.0
        for k in range(SEGMENTS):
            if k < self.segments:
                rise = self.targets[k] - at
                time = fabs(rise) / self.ramps[k] if rise != 0.0 else 0.0
                total = total + time + self.soaks[k]
                at = self.targets[k]
        return total

    @sampled(every=1)
    def tick(self) -> None:
        h = self.h
        before = self.asked
        now = self.asked_at(self.t)
        s = (now - before) / h
        a = self.air - before + s * self.lag
        e = exp(-h / self.lag)
        d = exp(-h / self.tau)
        if fabs(self.lag - self.tau) > ALIKE * self.tau:
            part = a * self.lag / (self.lag - self.tau)
            b = self.inside - before + s * (self.lag + self.tau) - part
            self.inside = now - s * (self.lag + self.tau) + part * e + b * d
        else:
            b = self.inside - before + s * (self.lag + self.tau)
            self.inside = now - s * (self.lag + self.tau) + (b + a * h / self.tau) * d
        self.air = now - s * self.lag + a * e
        self.asked = now
        self.ended = 1.0 if self.t >= self.length() else 0.0

    def outputs(self) -> None:
        self.temperature = self.inside
        self.room = self.air
        self.program = self.asked
        self.finished = self.ended
        for j in range(3):
            self.dT[j] = self.share[j] * (self.air - self.inside)
