"""A lag and a lead network with an integral, limited: what controllers of stabilizer and tracking loops share."""

from __future__ import annotations

from gyrobench.component.component import Component
from gyrobench.component.composition import sampled
from gyrobench.component.declarations import Discrete, Input, Output, Parameter, State
from gyrobench.component.math import Number, clip, maximum


class LeadLag(Component):
    """Common part: v = -G(s) (u + test - K_u command) with its limit and an integral that waits at it.

    G = K (1 + tau1 s)(1 + tau2 s) / ((1 + T1 s)(1 + T2 s)) (1 + integral / s)

    With T2 below the step a change of e comes tau2/T2 times as large at the beginning of a step and has decayed at its
    end: where the integral waits for that, `saturated` is 1 although no v at an end is limited.
    """

    K = Parameter(2.0, "1", "gain at rest, voltage per voltage; 0: the loop is open", min=0.0)
    tau1 = Parameter(0.2, "s", "lag: time constant of the numerator", min=0.0)
    T1 = Parameter(2.0, "s", "lag: time constant of the denominator", above=0.0)
    tau2 = Parameter(0.03, "s", "lead: time constant of the numerator", min=0.0)
    T2 = Parameter(0.003, "s", "lead: time constant of the denominator", above=0.0)
    integral = Parameter(0.0, "1/s", "corner of the integral part; 0: none", min=0.0)
    K_u = Parameter(0.0, "V.s/rad", "gyro signal per rate, for the rate command; 0: no command", min=0.0)
    v_max = Parameter(27.0, "V", "largest voltage", above=0.0)

    u = Input(0.0, "V", "gyro signal")
    test = Input(0.0, "V", "test signal added to it")
    command = Input(0.0, "rad/s", "rate commanded to the platform")

    v = Output("V", "voltage of the torque motor")
    e = Output("V", "the signal inside the loop, u + test")
    saturated = Output("1", "1 while the voltage is limited, or in the last step the integral has waited")

    lag = State(0.0, "V", "state of the lag network")
    lead = State(0.0, "V", "state of the lead network")
    sum = State(0.0, "V", "integral part")

    began = Discrete([0.0, 0.0, 0.0], "V", "lag, lead and sum at the beginning of the internal step to come")
    waited = Discrete(0.0, "1", "1: the integral has waited in the last communication step")

    def start(self) -> None:
        self.keep()
        self.waited = 0.0

    def keep(self) -> None:
        self.began[0] = self.lag
        self.began[1] = self.lead
        self.began[2] = self.sum

    def error(self) -> Number:
        return self.u + self.test - self.K_u * self.command

    def after_lag(self) -> Number:
        return self.lag + self.tau1 / self.T1 * (self.error() - self.lag)

    def after_lead(self) -> Number:
        return self.lead + self.tau2 / self.T2 * (self.after_lag() - self.lead)

    def unlimited(self) -> Number:
        return -self.K * (self.after_lead() + self.sum)

    def flow(self) -> None:
        self.der.lag = (self.error() - self.lag) / self.T1
        self.der.lead = (self.after_lag() - self.lead) / self.T2
        y = self.after_lead()
        unlimited = -self.K * (y + self.sum)
        self.der.sum = self.integral * y
        if self.waits(unlimited, y) > 0.5:
            self.der.sum = 0.0
        if self.integral == 0.0:
            self.der.sum = -self.sum  # stays 0, and leaves no pole at 0 in the linearization

    def waits(self, unlimited: Number, y: Number) -> Number:
        """Return 1 where the voltage is limited and y pushes it further."""
        return 1.0 if (unlimited > self.v_max and y < 0.0) or (unlimited < -self.v_max and y > 0.0) else 0.0

    @sampled(every=1)
    def watch(self) -> None:
        """Note whether the integral has waited in the step: what `flow` saw at its beginning is gone at its end."""
        if self.integral > 0.0:
            if self.t < self.step_start + 1.5 * self.h:
                self.waited = 0.0  # the first internal step of the communication step
            lagged = self.began[0] + self.tau1 / self.T1 * (self.error() - self.began[0])
            y = self.began[1] + self.tau2 / self.T2 * (lagged - self.began[1])
            self.waited = maximum(self.waited, self.waits(-self.K * (y + self.began[2]), y))
            self.keep()

    def outputs(self) -> None:
        self.e = self.u + self.test
        unlimited = self.unlimited()
        self.v = clip(unlimited, -self.v_max, self.v_max)
        self.saturated = 1.0 if self.v != unlimited or self.waited > 0.5 else 0.0
