from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Output, Parameter, State, sampled
from gyrobench.component.math import index, log


class Raiser(Component):
    """Fails on demand, in its equations or with a fault that is none of the part's refusals."""

    table = Parameter([1.0, 2.0, 3.0], "1", "table")
    u = Input(0.0, "1", "1 log of -1, 2 index outside, 3 growth without bound, 4 a fault, 5 stores inf, 6 shows it")
    x = State(1.0, "1", "state")
    big = Discrete(1.0, "1", "grows")
    memory = Discrete([0.0] * 65, "1", "a memory: so large that it is not looked at")
    y = Output("1", "output")

    def flow(self) -> None:
        self.der.x = -self.x

    @sampled(every=1)
    def tick(self) -> None:
        if self.u == 1.0:
            self.big = log(-self.x)
        if self.u == 2.0:
            self.big = self.table[index(self.u + 1.0)]
        if self.u == 3.0:
            self.big = self.big * 1e300
        if self.u == 5.0:
            self.memory[64] = self.big * 1e308 * 10.0
        if self.u == 4.0:
            self.big = self.fault(self.x)

    def fault(self, x):
        return x

    def outputs(self) -> None:
        self.y = self.big + self.x
        if self.u == 6.0:
            self.y = self.memory[64]
