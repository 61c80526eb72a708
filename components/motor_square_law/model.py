from __future__ import annotations

from gyrobench.component import Component, Input, Output, sampled
from gyrobench.component.blocks.drive import SquareLawMotor


class MotorSquareLaw(Component):
    """AC torque motor of a table with its amplifier and root shaper: block SquareLawMotor.  [MOTOR-SQUARELAW]

        M = K V |V|        V = U - K_e rate        lag U' = U_d - U        U_d = sgn(d) sqrt(|d| / K) + offset

    Source: Hu 1981, eq. 5-1 with ET1.
    """

    version = "1.0.0"

    motor = SquareLawMotor()

    demand = Input(0.0, "N.m", "demanded torque")
    rate = Input(0.0, "rad/s", "rate of the shaft relative to the base")

    torque = Output("N.m", "motor torque on the shaft")
    voltage = Output("V", "voltage of the motor")
    saturated = Output("1", "1 while the voltage is at its limit")

    @sampled(every=1)
    def tick(self) -> None:
        self.motor.advance(self.demand, self.rate)

    def outputs(self) -> None:
        self.torque = self.motor_M
        self.voltage = self.motor_U
        self.saturated = self.motor_limited
