from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Output, Parameter, State, sampled
from gyrobench.component.math import Number, clip, maximum


class StabilizerLeadLag(Component):
    """Stabilizer loop: lag and lead network with amplifier, gyro signal in, motor voltage out.  [STAB-FLOATED-2DOF]

        e = u + test                    v = -G(s) (e - K_u command), limited to +-v_max
        G = K (1 + tau1 s)(1 + tau2 s) / ((1 + T1 s)(1 + T2 s)) (1 + integral / s)

    The lag (tau1 < T1) keeps the gain at rest and takes it back by tau1/T1 above; the lead (tau2 > T2) lifts the phase
    about the crossover.  The printed order is T1 > tau1 > tau2 > T2; `unordered` is 1 where it does not hold.  With a
    finite T1 the error at rest is not zero (as GSP ch. 5 says) but M / (K_m K_x K): that takes integral > 0.  With
    tau1 = T1 and tau2 = T2 what is left is K (1 + integral / s).  While v is limited and e pushes further, the integral
    waits (no wind-up).  With T2 below the step a change of e comes tau2/T2 times as large at the beginning of a step
    and has decayed at its end: where the integral waits for that, `saturated` is 1 although no v at an end is limited.

    K_u is for a rate signal (rate gyro, or gyro in rebalance); one whose signal is an angle is turned by its torquer.

    Not modelled: bandwidth, offset and noise of the amplifier.
    Source: GSP ch. 5, eq. 5-25, 5-26; STAB-FLOATED-2DOF; integral: F of PLATFORM-1AXIS.
    """

    version = "1.1.0"

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
    unordered = Output("1", "1 where T1 > tau1 > tau2 > T2 does not hold")

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
        unlimited = -self.K * (self.after_lead() + self.sum)
        self.v = clip(unlimited, -self.v_max, self.v_max)
        self.saturated = 1.0 if self.v != unlimited or self.waited > 0.5 else 0.0
        self.unordered = 0.0 if self.tau1 < self.T1 and self.tau2 < self.tau1 and self.tau2 > self.T2 else 1.0
