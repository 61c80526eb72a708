from __future__ import annotations

from gyrobench.component import IDENTITY, Input, Output, Parameter, sampled
from gyrobench.component.blocks.axis_body import BodyTable


class TableBody(BodyTable):
    """Moving part of a table with one axis: torques in, motion out.  [TABLE-SERVO, FRICTION-PRESLIDING]

        J w' = torque + M_load + rumble - viscous (w - e) - cable (x - cable_zero) - (unbalance x f)_z + friction

    w inertial rate about the axis, e that of the base, x the angle against the base.  Equations of the axis: block
    AxisBody; of tilt, rates and forces on the face: AxisTable.

    Not modelled: wobble, motion of the axis in its bearing, alpha of a base that accelerates, centripetal acceleration
    (the instrument stands on the axis).
    Source: Hu 1981, eq. 5-7, 5-8, 5-36.
    """

    version = "1.0.0"

    rate0 = Parameter(0.0, "rad/s", "rate against the base at the start")

    face = Input(IDENTITY, "1", "mount: rows are the gyro axes in table axes")
    torque = Input(0.0, "N.m", "motor torque")
    M_load = Input(0.0, "N.m", "further torque on the table")

    rate_motor = Output("rad/s", "rate of the motor against the base")
    friction = Output("N.m", "friction torque on the table")

    def start(self) -> None:
        self.axis.rest(self.angle0, self.rate0, self.earth())

    def flow(self) -> None:
        self.turn(self.torque, self.M_load)

    @sampled(every=1)
    def tick(self) -> None:
        self.settle(self.torque, self.M_load)

    def outputs(self) -> None:
        self.angle_read = self.axis_x
        self.rate_motor = self.rate + self.axis_twist_rate
        self.friction = self.axis_friction_ahead
