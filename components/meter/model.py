from __future__ import annotations

from gyrobench.component import Component, Input, Noise, Output, Parameter


class Meter(Component):
    """Reading of a voltmeter or an ammeter.  [MOTOR-TEST]

        reading = x (1 + scale_error) + zero + noise        every internal step has its own noise

    Signals are without unit: the wires carry volts or amperes, and noise and zero are in the same unit.

    Not modelled: bandwidth, resolution, range.
    Source: own design.
    """

    version = "1.0.0"

    step = Parameter(1e9, "s", "largest internal step: one reading for each communication step", above=0.0)
    scale_error = Parameter(0.0, "1", "relative error of the reading", min=-0.1, max=0.1)
    zero = Parameter(0.0, "1", "reading at 0, in the unit of the signal")
    noise_rms = Noise(0.0, "1", "standard deviation of a reading, in the unit of the signal", per="step")

    x = Input(0.0, "1", "signal")

    reading = Output("1", "signal as it is read")

    def outputs(self) -> None:
        self.reading = self.x * (1.0 + self.scale_error) + self.zero + self.noise.noise_rms
