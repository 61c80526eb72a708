from __future__ import annotations

from gyrobench.component import Component, Input, Output, Parameter, sampled
from gyrobench.component.blocks.command import ARCSEC
from gyrobench.component.blocks.control import InPosition, LeadLagBank, TachoLoop
from gyrobench.component.math import Number, clip

COUNTS, TACHO = 0.0, 1.0


class ControllerAnalog(Component):
    """Analogue controller of a table axis: networks on the count error, or a rate loop on the tachometer.

    [TABLE-SERVO, TABLE-RATE, TABLE-TACHO]

        loop 0  e = (count_command - count) quantum        demand of :class:`LeadLagBank`, limited to +-M_max
        loop 1  e = rate_command - tacho                   demand of :class:`TachoLoop`, limited to +-M_max

    The error is used as it arrives, at each communication step.  preset = 1, and each closing of the loop (enable from
    0 to 1), set the networks to what they settle at for the present error.

    Not modelled: bandwidth, offset and noise of the amplifiers, resolution of the converter.
    Source: Hu 1981, sections 5.4, 5.5; networks and gains: own design.
    """

    version = "1.0.0"

    loop = Parameter(0, int, "0: count error through the networks, 1: rate loop on the tachometer", min=0, max=1)
    quantum = Parameter(0.18 * ARCSEC, "rad", "angle of one count (0.18 arcsec)", above=0.0)
    M_max = Parameter(9.80665, "N.m", "largest torque that is demanded (1 kg.m)", above=0.0)

    count_command = Input(0.0, "1", "cumulative command count")
    count = Input(0.0, "1", "cumulative count of the angle reader")
    rate_command = Input(0.0, "rad/s", "reference rate")
    tacho = Input(0.0, "rad/s", "table rate as the tachometer measures it")
    enable = Input(1.0, "1", "1 closes the loop")
    preset = Input(0.0, "1", "1 sets the networks to what they settle at for the present error")

    demand = Output("N.m", "demanded torque")
    e = Output("rad", "error: command minus reading")
    in_position = Output("1", "1 while the error has stayed within the window")
    saturated = Output("1", "1 while the demanded torque is limited")

    bank = LeadLagBank(M_max="M_max")
    rate = TachoLoop(M_max="M_max")
    near = InPosition()

    def error(self) -> Number:
        return (self.count_command - self.count) * self.quantum

    def flow(self) -> None:
        self.der.bank_net = self.bank.slope(self.error())
        self.der.rate_q = 0.0
        if self.loop == TACHO and self.enable == 1.0:
            self.der.rate_q = self.rate.slope(self.rate_command - self.tacho)

    @sampled(every=1)
    def tick(self) -> None:
        if self.loop == TACHO:
            self.rate.check(self.rate_command)
        if self.enable == 0.0 or self.preset == 1.0:
            self.bank.preset(self.error())
            self.rate_q = 0.0
        self.near.judge(self.error(), self.h)

    def outputs(self) -> None:
        wanted = self.bank.unlimited(self.error())
        if self.loop == TACHO:
            wanted = self.rate.unlimited(self.rate_command - self.tacho)
        if self.enable == 0.0:
            wanted = 0.0
        self.demand = clip(wanted, -self.M_max, self.M_max)
        self.saturated = 1.0 if self.demand != wanted else 0.0
        self.e = self.error()
        self.in_position = self.near_inside
