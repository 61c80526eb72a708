from __future__ import annotations

from gyrobench.component import Component, Input, Output, sampled
from gyrobench.component.blocks.loads import SlipRings


class SlipringFollower(Component):
    """Slip rings of a table on a shaft that follows it, or on its axis: block SlipRings.  [SLIPRING-FOLLOWER]

        J_s y'' = (K_s + k_w) eps + K_d eps' + friction(y')        eps = x - y        M = torque - k_w eps

    Within a communication step the table goes on from `angle`, its angle at the beginning, with `rate`.

    Source: Hu 1981, section 5.4, eq. 5-35.
    """

    version = "1.0.0"

    ring = SlipRings()

    angle = Input(0.0, "rad", "table angle")
    rate = Input(0.0, "rad/s", "table rate relative to its base")
    torque = Input(0.0, "N.m", "torque to be added")

    M = Output("N.m", "torque on the table")
    eps = Output("rad", "table ahead of the ring shaft")
    stiff_leads = Output("1", "1 where K_s < 9 k_w: the follower passes on more than a tenth of the friction")

    def start(self) -> None:
        self.ring.rest(self.angle, self.rate)

    def flow(self) -> None:
        self.ring.follow(self.angle + self.rate * (self.t + 0.5 * self.h - self.step_start), self.rate)

    @sampled(every=1)
    def tick(self) -> None:
        self.ring.settle(self.angle + self.rate * (self.t - self.step_start), self.rate)

    def outputs(self) -> None:
        self.M = self.torque + self.ring_M
        self.eps = self.ring_eps
        self.stiff_leads = 1.0 if self.ring_follower == 1.0 and self.ring_K_s < 9.0 * self.ring_k_w else 0.0
