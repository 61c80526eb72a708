from __future__ import annotations

from gyrobench.component import Component, Input, Output, Parameter, State

ZERO = [[0.0] * 4 for _ in range(4)]


class Linear(Component):
    """x' = A x + B u, y = C x + D u."""

    A = Parameter(ZERO, "1/s", "dynamics")
    B = Parameter([[0.0] * 2 for _ in range(4)], "1/s", "inputs")
    C = Parameter([[0.0] * 4 for _ in range(2)], "1", "outputs")
    D = Parameter([[0.0] * 2 for _ in range(2)], "1", "feedthrough")
    u = Input([0.0, 0.0], "1", "inputs")
    x = State([0.0, 0.0, 0.0, 0.0], "1", "state")
    y = Output("1", "outputs", shape=(2,))

    def flow(self) -> None:
        for i in range(4):
            s = 0.0
            for j in range(4):
                s = s + self.A[i][j] * self.x[j]
            for j in range(2):
                s = s + self.B[i][j] * self.u[j]
            self.der.x[i] = s

    def outputs(self) -> None:
        for i in range(2):
            self.y[i] = self.D[i][0] * self.u[0] + self.D[i][1] * self.u[1]
            for j in range(4):
                self.y[i] = self.y[i] + self.C[i][j] * self.x[j]
