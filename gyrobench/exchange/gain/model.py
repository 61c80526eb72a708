"""Factor and offset of a wire as a part: one folder as those of ``components/``, which only exports use."""

from __future__ import annotations

from gyrobench.component import Component, Input, Output, Parameter


class Gain(Component):
    """Factor and offset of a connection between two FMUs: y = factor u + offset.

    Without a state: y follows u within the step.  The units are those of the two variables that it lies between; its
    own say "1".
    """

    factor = Parameter(1.0, "1", "unit of y per unit of u")
    offset = Parameter(0.0, "1", "value of y at u = 0")
    u = Input(0.0, "1", "value of the source, in its unit")
    y = Output("1", "value for the target, in its unit")

    def outputs(self) -> None:
        self.y = self.factor * self.u + self.offset
