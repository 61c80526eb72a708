from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Noise, Output, Parameter, sampled
from gyrobench.component.blocks.gyro import DEG_H
from gyrobench.component.math import exp, fabs, vector


class TurnOnErrors(Component):
    """Bias of a rate gyro from one turn-on to the next, from day to day, and while it warms up.  [TEST-TURN-ON]

        rate_out = rate (1 + scale_warm exp(-t/scale_tau)) + b_day + b_on
                   + warm_1 exp(-t/tau_1) + warm_2 exp(-t/tau_2)                       t: time since it was switched on

    It is switched on anew whenever the number of the running phase changes: b_on is drawn then, b_day where the day
    has changed, too, both normal with the rms between_turn_ons and between_days.
    Not modelled: biases that depend on how long it was off, or on the temperature (see surroundings), a time between
    power and the first reading.
    Source: IEEE 952 (bias repeatability, warm-up time); own form.
    """

    version = "1.0.0"

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    between_turn_ons = Noise(0.3 * DEG_H, "rad/s", "rms of the bias from turn-on to turn-on (0.3 deg/h)", per="step")
    between_days = Noise(0.2 * DEG_H, "rad/s", "rms of the bias from day to day (0.2 deg/h)", per="step")
    warm_1 = Parameter(3.0 * DEG_H, "rad/s", "bias at the turn-on, less that in the end (3 deg/h)")
    tau_1 = Parameter(120.0, "s", "its time constant", above=0.0)
    warm_2 = Parameter(0.0, "rad/s", "second, slower part of it")
    tau_2 = Parameter(600.0, "s", "its time constant", above=0.0)
    scale_warm = Parameter(0.0, "1", "scale factor at the turn-on, less that in the end, relative")
    scale_tau = Parameter(120.0, "s", "its time constant", above=0.0)

    rate = Input([0.0, 0.0], "rad/s", "rate that the gyro measures")
    phase = Input(1.0, "1", "running phase: another one is another turn-on")
    day = Input(1.0, "1", "day of the turn-on")

    rate_out = Output("rad/s", "rate along x as it is read")
    since = Output("s", "time since it was switched on")

    turned = Discrete(-1.0, "1", "phase of the turn-on; -1: none yet")
    on_day = Discrete(-1.0, "1", "day of it")
    b_on = Discrete(0.0, "rad/s", "bias of the turn-on")
    b_day = Discrete(0.0, "rad/s", "bias of the day")
    t_on = Discrete(0.0, "s", "time of the turn-on")

    @sampled(every=1)
    def tick(self) -> None:
        if fabs(self.phase - self.turned) > 0.5:
            self.turned = self.phase
            self.b_on = self.noise.between_turn_ons
            self.t_on = self.t
            if fabs(self.day - self.on_day) > 0.5:
                self.on_day = self.day
                self.b_day = self.noise.between_days

    def outputs(self) -> None:
        t = self.t - self.t_on
        grown = 1.0 + self.scale_warm * exp(-t / self.scale_tau)
        warm = self.warm_1 * exp(-t / self.tau_1) + self.warm_2 * exp(-t / self.tau_2)
        self.rate_out = vector(self.rate)[0] * grown + self.b_day + self.b_on + warm
        self.since = t
