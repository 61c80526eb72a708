from __future__ import annotations

from gyrobench.component import Discrete, Parameter, sampled
from gyrobench.component.blocks.rebalance import PulseRebalance
from gyrobench.component.math import Number, clip, fabs, floor, maximum, minimum


class RebalancePwm(PulseRebalance):
    """Binary pulse-width torque rebalance of a floated gyro.  [REBAL-PWM; Hu 1981, eq. 5-69..5-76]

    A saw rises from -I to I in T_s = 1/f_s, N = f_q/f_s clocks.  The current is positive from the start of a saw until
    the saw reaches the demand, moved to the next clock, and negative until the saw ends:

        n = N (1 + demand/I)/2, rounded up,  d = 2 n/N - 1          n_plus += n,  n_minus += N - n
        edge at n/f_q + dT,  dT = dT[1] + dT[2] d + dT[3] d2        no edge, and no dT, where n is 0 or N
        i_read = I (n+ - n-)/N of the last saw = I d

    To first order in its errors the mean current is I d + I_0 + dK d with                  [5-74..5-76 with ET18]

        I_0 = (dI_plus - dI_minus)/2 + 2 I dT[1]/T_s
        dK = (dI_plus + dI_minus)/2 + 2 I (dT[2] + dT[3] d)/T_s

    A communication step is either whole saws, all alike, by the demand at its beginning, and i is their mean; or it is
    a fraction of a saw in whole clocks: then the saw meets the newest demand in each step, its first edge counts, i is
    the mean of the pulse over the step, and the float moves within the saw.  The mean is exact in both; an edge that dT
    takes out of the step in which it falls is made good in the next one.  Other steps are refused.

    Not modelled: jitter of clock and saw, offset of the comparator (the amplifier's integral takes it), more than one
    edge in a saw.
    """

    version = "1.0.0"

    f_s = Parameter(1e3, "Hz", "frequency of the saw", above=0.0)
    dT = Parameter([0.0, 0.0, 0.0], "s", "switching-time error: constant, times d, times d squared")

    clocks = Discrete(0.0, "1", "clocks in a saw")
    clock = Discrete(0.0, "1", "clocks since the start of the saw")
    edge = Discrete(-1.0, "1", "clock of the edge in the saw; -1: it is still to come")
    net = Discrete(0.0, "1", "positive less negative clocks in the saw")

    def start(self) -> None:
        self.clocks = floor(self.f_q / self.f_s + 0.5)
        self.refuse(
            fabs(self.f_q / self.f_s - self.clocks) > 1e-6
            or self.clocks < 2.0
            or 2.0 * floor(0.5 * self.clocks) != self.clocks,
            "f_q = {f_q} Hz must be an even multiple of f_s = {f_s} Hz",
        )
        self.refuse(
            (fabs(self.dT[0]) + fabs(self.dT[1]) + fabs(self.dT[2])) * self.f_s > 0.1,
            "dT: switching-time errors must not add up to more than a tenth of the saw, 1/f_s; f_s = {f_s} Hz",
        )
        self.clock = 0.0
        self.edge = -1.0
        self.net = 0.0

    def reached(self, asked: Number) -> Number:
        """Return the clock at which the saw reaches a demand."""
        return clip(-floor(-0.5 * self.clocks * (1.0 + asked / self.I)), 0.0, self.clocks)

    def switched(self, n: Number) -> Number:
        """Return the time within the saw at which the current changes its sign, for an edge at clock n."""
        on = n / self.f_q
        if n > 0.0 and n < self.clocks:
            d = 2.0 * n / self.clocks - 1.0
            on = clip(on + self.dT[0] + d * (self.dT[1] + d * self.dT[2]), 0.0, self.clocks / self.f_q)
        return on

    def mean_current(self, asked: Number) -> Number:
        """Return the mean of the current over a communication step that begins now."""
        span = minimum(self.length, self.clocks) / self.f_q
        if self.length >= self.clocks:
            on = self.switched(self.reached(asked))
        else:
            begin = self.clock / self.f_q
            n = maximum(self.reached(asked), self.clock)
            if self.edge >= 0.0:
                on = clip(self.switched(self.edge) - begin, 0.0, span)
            elif n < self.clock + self.length:
                on = minimum(self.switched(n) - begin, span)
            else:
                on = span
        return ((self.I + self.dI_plus) * on - (self.I + self.dI_minus) * (span - on)) / span

    @sampled(every=1)
    def tick(self) -> None:
        if self.length > 0.0:
            self.require_same_step()
            self.count()
        else:
            self.measure_step()
            saws = floor(self.length / self.clocks + 0.5)
            parts = floor(self.clocks / self.length + 0.5)
            self.refuse(
                saws * self.clocks != self.length and parts * self.length != self.clocks,
                "the communication step, {coupling} s, must be whole saws, 1/f_s, or go into one a whole number of "
                "times; f_s = {f_s} Hz",
            )
        self.amplify()

    def count(self) -> None:
        """Count the clocks of the step that ends."""
        n = self.reached(self.asked)
        if self.length >= self.clocks:
            saws = self.length / self.clocks
            self.plus = self.plus + saws * n
            self.minus = self.minus + saws * (self.clocks - n)
            self.counted = self.I * (2.0 * n - self.clocks) / self.clocks
        else:
            n = maximum(n, self.clock)
            if self.edge < 0.0 and n < self.clock + self.length:
                self.edge = n
            on = self.length
            if self.edge >= 0.0:
                on = clip(self.edge - self.clock, 0.0, self.length)
            self.plus = self.plus + on
            self.minus = self.minus + (self.length - on)
            self.net = self.net + (2.0 * on - self.length)
            self.clock = self.clock + self.length
            if self.clock >= self.clocks:
                self.counted = self.I * self.net / self.clocks
                self.clock = 0.0
                self.edge = -1.0
                self.net = 0.0

    def outputs(self) -> None:
        self.i = 0.0
        if self.length > 0.0:
            self.i = self.mean_current(self.demand())
