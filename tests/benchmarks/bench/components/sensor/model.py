from gyrobench.component import Component, Input, Output, Parameter, State


class Sensor(Component):
    """First-order lag: tau s' = x - s."""

    tau = Parameter(0.005, "s", "time constant", above=0.0)
    x = Input(0.0, "1", "position")
    y = Output("1", "reading")
    s = State(0.0, "1", "reading")

    def flow(self):
        self.der.s = (self.x - self.s) / self.tau

    def outputs(self):
        self.y = self.s
