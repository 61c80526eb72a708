from __future__ import annotations

from gyrobench.component import IDENTITY, Discrete, Input, Output, Parameter, sampled
from gyrobench.component.blocks.axis_body import AxisBody
from gyrobench.component.blocks.table import AxisTable
from gyrobench.component.math import Number, cos, sin


class TableBody(AxisTable):
    """Moving part of a table with one axis: torques in, motion out.  [TABLE-SERVO, FRICTION-PRESLIDING]

        J w' = torque + M_load + rumble - viscous (w - e) - cable (x - cable_zero) - (unbalance x f)_z + friction

    w inertial rate about the axis, e that of the base, x the angle against the base.  Equations of the axis: block
    AxisBody; of tilt, rates and forces on the face: AxisTable.

    Not modelled: wobble, motion of the axis in its bearing, alpha of a base that accelerates, centripetal acceleration
    (the instrument stands on the axis).
    Source: Hu 1981, eq. 5-7, 5-8, 5-36.
    """

    version = "1.0.0"

    axis = AxisBody()
    angle0 = Parameter(0.0, "rad", "angle at the start")
    rate0 = Parameter(0.0, "rad/s", "rate against the base at the start")

    face = Input(IDENTITY, "1", "mount: rows are the gyro axes in table axes")
    torque = Input(0.0, "N.m", "motor torque")
    M_load = Input(0.0, "N.m", "further torque on the table")

    rate_motor = Output("rad/s", "rate of the motor against the base")
    friction = Output("N.m", "friction torque on the table")

    pull = Discrete(0.0, "N.m", "torque of the unbalance at the middle of the next step")

    def start(self) -> None:
        self.axis.rest(self.angle0, self.rate0, self.earth())
        self.pull = self.unbalanced(self.angle0)

    def earth(self) -> Number:
        """Return the inertial rate of the base along the axis."""
        return self.tilted[2] @ self.omega_local

    def unbalanced(self, x: Number) -> Number:
        if self.axis_unbalance[0] == 0.0 and self.axis_unbalance[1] == 0.0:
            return 0.0
        return self.axis.unbalanced(cos(x), sin(x), self.tilted @ self.f_local)

    def flow(self) -> None:
        self.axis.turn(self.torque, self.M_load + self.pull, self.earth())

    @sampled(every=1)
    def tick(self) -> None:
        self.axis.settle(self.torque, self.M_load + self.unbalanced(self.axis_x), self.earth())
        self.pull = self.unbalanced(self.axis_x + 0.5 * self.h * self.axis_v)

    def outputs(self) -> None:
        rate = self.axis_w - self.earth()
        self.feel(cos(self.axis_x), sin(self.axis_x), self.axis_w, rate, self.axis_acc_mean)
        self.angle = self.axis_x
        self.angle_read = self.axis_x
        self.rate = rate
        self.rate_motor = rate + self.axis_twist_rate
        self.friction = self.axis_friction_ahead
