"""Torque rebalance: analogue amplifier with its meter; pulses of constant current with errors and counters."""

from __future__ import annotations

from typing import ClassVar

from gyrobench.component.component import Component
from gyrobench.component.composition import sampled
from gyrobench.component.declarations import Discrete, Input, Noise, Output, Parameter, State
from gyrobench.component.math import Number, clip, fabs, floor


class AnalogRebalance(Component):
    """Common part of analogue rebalances: PI amplifier with current limit, current as an integrating meter reads it.

    i is what flows from now on, i_flowed what flowed during the step that ends now: that is what an integrating meter
    reads, and what balanced the gyro up to now.  Read so, the exchange of u and i once a step does not shift the
    reading against the table angle (read as i it is one step early).  [LOOP-REBALANCE, REBAL-ANALOG]
    """

    unrounded: ClassVar[dict[str, float]] = {"resolution": 0.0}

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    K_p = Parameter(119.92139898087, "A/V", "proportional gain", min=0.0)
    K_i = Parameter(1199.2139898087, "A/(V.s)", "integral gain", min=0.0)
    i_max = Parameter(0.05, "A", "current limit", above=0.0)
    resolution = Parameter(0.0, "A", "resolution of the measured current; 0: none", min=0.0)
    meter = Noise(1e-7, "A/sqrt(Hz)", "noise density of the current measurement")

    u = Input(0.0, "V", "pickoff voltage")

    i = Output("A", "torquer current")
    i_read = Output("A", "torquer current as measured")
    saturated = Output("1", "1 while the current is limited")

    q = State(0.0, "V.s", "integral of the pickoff voltage")

    present = Discrete(0.0, "A", "current from now on")
    flowed = Discrete(0.0, "A", "current during the last step")

    def demand(self) -> Number:
        return self.K_p * self.u + self.K_i * self.q

    def start(self) -> None:
        self.present = clip(self.demand(), -self.i_max, self.i_max)
        self.flowed = self.present

    def flow(self) -> None:
        unlimited = self.demand()
        self.der.q = self.u
        if (unlimited > self.i_max and self.u > 0.0) or (unlimited < -self.i_max and self.u < 0.0):
            self.der.q = 0.0

    @sampled(every=1)
    def tick(self) -> None:
        self.flowed = self.present
        self.present = clip(self.demand(), -self.i_max, self.i_max)

    def outputs(self) -> None:
        unlimited = self.demand()
        self.i = clip(unlimited, -self.i_max, self.i_max)
        read = self.flowed + self.noise.meter
        if self.resolution > 0.0:
            read = self.resolution * floor(read / self.resolution + 0.5)
        self.i_read = read
        self.saturated = 1.0 if self.i != unlimited else 0.0


class PulseRebalance(Component):
    """Common part of pulse rebalances: PI amplifier, current of the pulses with its errors, counters, ports.

        demand = K_p u + K_i q limited to +-I,  q' = u;  q' = 0 while it is limited and u pushes further (no wind-up)
        positive current I + dI_plus, negative current -(I + dI_minus)
        n_plus, n_minus: clocks (of f_q) of positive and of negative current since the start

    A part decides the clocks of a communication step, whole ones, by the demand at its beginning, and gives the mean of
    the current of that step, exactly: charge over time.  The length of the step is taken from the one before, so that
    nothing flows and nothing is counted in the first one.

    Not modelled: rise and fall of the current (their difference is a switching-time error), noise and drift of the
    current source, heating of the torquer.  [REBAL-PWM; Hu 1981, section 5.5, eq. 5-69..5-76 with ET17, ET18]
    """

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    K_p = Parameter(119.92139898087, "A/V", "proportional gain", min=0.0)
    K_i = Parameter(1199.2139898087, "A/(V.s)", "integral gain", min=0.0)
    I = Parameter(3.6 / 17.2, "A", "current of a pulse (1 deg/s at 17.2 deg/h/mA)", above=0.0)  # noqa: E741
    dI_plus = Parameter(0.0, "A", "error of the positive current")
    dI_minus = Parameter(0.0, "A", "error of the negative current, positive where it is too large")
    f_q = Parameter(1e6, "Hz", "frequency of the data clock", above=0.0)

    u = Input(0.0, "V", "pickoff voltage")

    i = Output("A", "torquer current, mean over the coming communication step")
    i_read = Output("A", "torquer current by the counts")
    saturated = Output("1", "1 while the current is limited")
    n_plus = Output("1", "clocks of positive current since the start")
    n_minus = Output("1", "clocks of negative current since the start")

    q = Discrete(0.0, "V.s", "integral of the pickoff voltage")
    asked = Discrete(0.0, "A", "demand of the step that is running")
    length = Discrete(0.0, "1", "clocks in a communication step; 0: not known yet")
    coupling = Discrete(0.0, "s", "communication step that `length` holds for")
    plus = Discrete(0.0, "1", "clocks of positive current")
    minus = Discrete(0.0, "1", "clocks of negative current")
    counted = Discrete(0.0, "A", "current by the counts")

    def start(self) -> None:
        self.length = 0.0
        self.coupling = 0.0
        self.refuse(
            self.dI_plus <= -self.I or self.dI_minus <= -self.I,
            "dI_plus = {dI_plus} A, dI_minus = {dI_minus} A: each must be above -I = -{I} A, a pulse keeps its sign",
        )

    def demand(self) -> Number:
        return clip(self.K_p * self.u + self.K_i * self.q, -self.I, self.I)

    def require_same_step(self) -> None:
        self.refuse(
            fabs(self.h - self.coupling) > 1e-9 * self.h, "the communication step must not change; it was {coupling} s"
        )

    def measure_step(self) -> None:
        """Measure the communication step in clocks."""
        self.coupling = self.h
        self.length = floor(self.h * self.f_q + 0.5)
        self.refuse(
            self.length < 0.5 or fabs(self.h * self.f_q - self.length) > 1e-6,
            "the communication step, {coupling} s, must be whole periods of the data clock, f_q = {f_q} Hz",
        )

    def amplify(self) -> None:
        """Advance the amplifier over the step that ends: the demand of the next one."""
        unlimited = self.K_p * self.u + self.K_i * self.q
        if not ((unlimited > self.I and self.u > 0.0) or (unlimited < -self.I and self.u < 0.0)):
            self.q = self.q + self.h * self.u
        self.asked = self.demand()

    def outputs(self) -> None:
        self.i_read = self.counted
        self.saturated = 1.0 if fabs(self.K_p * self.u + self.K_i * self.q) > self.I else 0.0
        self.n_plus = self.plus
        self.n_minus = self.minus
