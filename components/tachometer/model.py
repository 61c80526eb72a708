from __future__ import annotations

from gyrobench.component import Component, Input, Output
from gyrobench.component.blocks.drive import TachometerReading


class Tachometer(Component):
    """Tachometer of a table axis: block TachometerReading.  [TACHOMETER]

        reading = rate (1 + scale_error) (1 + ripple sin(cycles x + phase))

    Source: own design.
    """

    version = "1.0.0"

    tacho = TachometerReading()

    angle = Input(0.0, "rad", "table angle")
    rate = Input(0.0, "rad/s", "table rate relative to its base")

    reading = Output("rad/s", "table rate as the tachometer measures it")

    def outputs(self) -> None:
        self.reading = self.tacho.read(self.rate, self.angle)
