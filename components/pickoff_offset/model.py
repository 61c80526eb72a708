from __future__ import annotations

from gyrobench.component import Component, Input, Output, Parameter

HOLD = 0.0  # mode of the table at rest


class PickoffOffset(Component):
    """Adds a voltage to a pickoff, so that the loop behind it holds the rotor off its null.  [TEST-POSITION]

        u_out = u + K_sg angle       mode 0 (hold); the angle is what the sequencer sends as target
        u_out = u                    any other mode

    A loop that nulls u_out holds u = -K_sg angle, with u = -K_sg psi a rotor at psi = angle.  The voltage passes within
    the step (direct feedthrough) and jumps with the angle.

    Not modelled: drift and noise of the voltage (they are drift of the null), bandwidth.
    Source: own; Hu 1981, section 5.5, eq. 5-68, has the drift that it shows.
    """

    version = "1.0.0"

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    K_sg = Parameter(10.0, "V/rad", "gain of the pickoff, by which the angle becomes a voltage", above=0.0)

    u = Input(0.0, "V", "pickoff voltage")
    angle = Input(0.0, "rad", "angle at which the rotor is to be held")
    mode = Input(0.0, "1", "mode of the table: 0 hold")

    u_out = Output("V", "pickoff voltage with the offset")

    def outputs(self) -> None:
        wanted = self.angle if self.mode == HOLD else 0.0
        self.u_out = self.u + self.K_sg * wanted
