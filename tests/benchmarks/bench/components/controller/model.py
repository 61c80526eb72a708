from gyrobench.component import Component, Input, Output, Parameter, State


class Controller(Component):
    """PI controller: u = K_p e + K_i integral of e, e = reference - y."""

    K_p = Parameter(2.0, "1", "proportional gain")
    K_i = Parameter(5.0, "1/s", "integral gain")
    reference = Parameter(1.0, "1", "set point")
    y = Input(0.0, "1", "measured value")
    u = Output("1", "command")
    q = State(0.0, "s", "integral of the error")

    def flow(self):
        self.der.q = self.reference - self.y

    def outputs(self):
        self.u = self.K_p * (self.reference - self.y) + self.K_i * self.q
