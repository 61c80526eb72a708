from __future__ import annotations

from gyrobench.component import Component, Input, Output, Parameter
from gyrobench.component.math import clip

SERVO = 3.0  # mode of the table in which the gyro holds it


class Cage(Component):
    """Electrical caging: the torquer holds the float near its zero while the gyro does not hold the table.

        i = K_p u limited to +-i_max        while mode is not 3 (servo)
        i = command - K_a angle             in mode 3: 0, the torquer is idle, or what keeps a level table level

    With u = K_sg b and the precession -k i of the torquer, b' = (H / C) (omega_IA - omega_d - k i): the float follows
    with the rate (H / C) K_sg k K_p, 100 1/s with the default sizes, and stands off by (omega_IA - omega_d) over it.
    In servo mode the table turns with omega_d + k i less the Earth's rate: with k i = that rate - k K_a angle it comes
    to rest at the angle omega_d/(k K_a), with the time constant 1/(k K_a).  [SERVO-LEVELLED]
    A gyro that is not caged while its table is moved keeps the angle, and servo mode turns the table back by it.

    Not modelled: float stops, the switching transient of a real torquer.
    Source: Hu 1981, ch. 3, section 3 (torquer idle while the table is held, or compensating); caging is our own.
    """

    version = "1.2.0"

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    K_p = Parameter(120.0, "A/V", "gain", min=0.0)
    i_max = Parameter(0.1, "A", "current limit", above=0.0)
    K_a = Parameter(0.0, "A/rad", "gain from the table angle in servo mode: the table is kept at angle 0", min=0.0)

    u = Input(0.0, "V", "pickoff voltage")
    mode = Input(0.0, "1", "mode of the table: 3 servo, caged in any other")

    command = Input(0.0, "A", "current wanted in servo mode")
    angle = Input(0.0, "rad", "table angle as read")

    i = Output("A", "torquer current")
    saturated = Output("1", "1 while the current is limited")

    def outputs(self) -> None:
        unlimited = self.command - self.K_a * self.angle if self.mode == SERVO else self.K_p * self.u
        self.i = clip(unlimited, -self.i_max, self.i_max)
        self.saturated = 1.0 if self.i != unlimited else 0.0
