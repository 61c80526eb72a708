from gyrobench.component import Component, Input, Output, Parameter, State


class Plant(Component):
    """Damped second-order plant: x'' + 2 z w x' + w^2 x = w^2 force."""

    w = Parameter(10.0, "rad/s", "natural frequency", above=0.0)
    z = Parameter(0.5, "1", "damping ratio", min=0.0)
    force = Input(0.0, "1", "force")
    position = Output("1", "position")
    x = State(0.0, "1", "position")
    v = State(0.0, "1/s", "velocity")

    def flow(self):
        self.der.x = self.v
        self.der.v = self.w * self.w * (self.force - self.x) - 2.0 * self.z * self.w * self.v

    def outputs(self):
        self.position = self.x
