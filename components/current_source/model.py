from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Noise, Output, Parameter, sampled
from gyrobench.component.math import clip

SERVO = 3.0  # mode of the table in which the gyro holds it


class CurrentSource(Component):
    """Constant current through the torquer of a gyro that holds a servo table.  [TEST-TORQUER]

        i' = +-slew until i = command        mode 3 (servo); the command is what the sequencer sends as target
        command = 0                          any other mode
        i_read = i (1 + error) + noise       what the ammeter shows

    The current changes at the rate `slew`, not at once: a jump would throw the table out of the range of its motor.
    One internal step is one communication step; i is that at its end.

    Not modelled: bandwidth of the source, heating of the torquer, load dependence.
    Source: Hu 1981, appendix 1 of chapter 3, eq. A3-1..A3-6; the slew rate is our own.
    """

    version = "1.0.0"

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    slew = Parameter(0.1, "A/s", "rate of change of the current", above=0.0)
    i_max = Parameter(0.12, "A", "largest current that may be commanded", above=0.0)
    error = Parameter(0.0, "1", "relative error of the ammeter", min=-0.1, max=0.1)
    meter = Noise(1e-8, "A/sqrt(Hz)", "noise density of the ammeter")

    command = Input(0.0, "A", "current wanted in servo mode")
    mode = Input(0.0, "1", "mode of the table: 3 servo")

    i = Output("A", "current")
    i_read = Output("A", "current as the ammeter shows it")

    level = Discrete(0.0, "A", "current")

    @sampled(every=1)
    def tick(self) -> None:
        wanted = self.command if self.mode == SERVO else 0.0
        self.refuse(wanted > self.i_max or wanted < -self.i_max, "command {command} A is beyond i_max = {i_max} A")
        most = self.slew * self.h
        self.level = self.level + clip(wanted - self.level, -most, most)

    def outputs(self) -> None:
        self.i = self.level
        self.i_read = self.level * (1.0 + self.error) + self.noise.meter
