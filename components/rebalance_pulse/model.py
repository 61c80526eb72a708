from __future__ import annotations

from gyrobench.component import Discrete, Parameter, sampled
from gyrobench.component.blocks.rebalance import PulseRebalance
from gyrobench.component.math import Number, fabs, floor, maximum, where


class RebalancePulse(PulseRebalance):
    """Torque rebalance by pulses on demand: a pulse of fixed charge only when one is needed.  [REBAL-PULSE]

    The demand is summed up at each clock, a += demand/I; where |a| reaches 1 a pulse of that sign fills the clock and
    a loses 1.  A demand of 0 makes no pulse, one of I a pulse in every clock.  The sum over the clocks of a
    communication step, whose demand is held, is in closed form

        a' = a + L demand/I,   n = whole part of a' towards 0,   a = a' - n        (L clocks, pulses of one sign)
        n > 0: n_plus += n     n < 0: n_minus += |n|             i_read = I n/L

    A pulse is longer by dT than the clock, and its current is I + dI_plus or -(I + dI_minus).  The mean current of a
    positive reading i_read is (1 + e+) i_read, of a negative one (1 + e-) i_read,

        1 + e+ = (1 + dI_plus/I)(1 + f_q dT)             1 + e- = (1 + dI_minus/I)(1 + f_q dT)

    so unequal currents make no bias but a scale factor that depends on the sign; the resolution over T is one pulse,
    k I/(f_q T), and the current rests while the float does.

    Not modelled: places of the pulses within a communication step (i is its mean; a step of one clock has them),
    pulses that run together and lose an edge.
    """

    version = "1.0.0"

    f_q = Parameter(1e5, "Hz", "frequency of the data clock, one pulse at most in each", above=0.0)
    dT = Parameter(0.0, "s", "error of the length of a pulse")

    a = Discrete(0.0, "1", "sum of the demand since the last pulse")

    def start(self) -> None:
        self.refuse(fabs(self.dT * self.f_q) > 0.1, "dT = {dT} s must be at most a tenth of the clock, 1/f_q")
        self.a = 0.0

    def pulses(self, asked: Number) -> Number:
        """Return the pulses of a step, with their sign."""
        total = self.a + self.length * asked / self.I
        return where(total < 0.0, -floor(-total), floor(total))

    @sampled(every=1)
    def tick(self) -> None:
        if self.length > 0.0:
            self.require_same_step()
            n = self.pulses(self.asked)
            self.a = self.a + self.length * self.asked / self.I - n
            self.plus = self.plus + maximum(n, 0.0)
            self.minus = self.minus + maximum(-n, 0.0)
            self.counted = self.I * n / self.length
        else:
            self.measure_step()
        self.amplify()

    def outputs(self) -> None:
        self.i = 0.0
        if self.length > 0.0:
            n = self.pulses(self.demand())
            size = self.I + (self.dI_plus if n > 0.0 else self.dI_minus)
            self.i = size * (1.0 + self.f_q * self.dT) * n / self.length
