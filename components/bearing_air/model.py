from __future__ import annotations

from gyrobench.component import Component, Input, Output
from gyrobench.component.blocks.loads import WIDE, AirBearing


class BearingAir(Component):
    """Torque of an air bearing on the axis of a table: block AirBearing.  [BEARING-AIR]

        M = torque + M_2 - (journal + thrust faces) rate + U g cos(elevation) sin(angle - unbalance_angle)

    Source: Hu 1981, eq. 5-31..5-34, 5-36, 5-37 with ET7, ET8.
    """

    version = "1.1.0"

    air = AirBearing()

    angle = Input(0.0, "rad", "table angle")
    rate = Input(0.0, "rad/s", "table rate relative to its base")
    torque = Input(0.0, "N.m", "torque to be added")

    M = Output("N.m", "torque on the table")
    wide_gap = Output("1", "1 where a gap is above 0.1 mm: rather given in another unit")

    def outputs(self) -> None:
        self.M = self.torque + self.air.torque(self.rate, self.angle)
        self.wide_gap = 1.0 if self.air_gap > WIDE or self.air_thrust_gap > WIDE else 0.0
