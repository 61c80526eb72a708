from __future__ import annotations

from gyrobench.component import Component, Input, Output


class DecouplerNone(Component):
    """Passes the gyro signals of the platform axes on to the motors: no decoupling.  [DECOUPLE-T2]

        u_axes = u

    Around pitch 0 the loop of x and y loses a degree of phase margin with each degree of azimuth.

    Not modelled: nothing.
    Source: Xia 2008, section 5.1.2 (the platform without T2).
    """

    version = "1.0.0"

    u = Input([0.0, 0.0, 0.0], "V", "signals along the platform axes")
    theta = Input([0.0, 0.0, 0.0], "rad", "joint angles, A order; not used")

    u_axes = Output("V", "signals to the motors, A order", shape=(3,))
    saturated = Output("1", "0")

    def outputs(self) -> None:
        for k in range(3):
            self.u_axes[k] = self.u[k]
        self.saturated = 0.0
