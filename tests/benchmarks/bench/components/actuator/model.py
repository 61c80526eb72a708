from gyrobench.component import Component, Input, Output, Parameter, State


class Actuator(Component):
    """First-order lag: tau x' = u - x."""

    tau = Parameter(0.02, "s", "time constant", above=0.0)
    u = Input(0.0, "1", "command")
    force = Output("1", "force")
    x = State(0.0, "1", "force")

    def flow(self):
        self.der.x = (self.u - self.x) / self.tau

    def outputs(self):
        self.force = self.x
