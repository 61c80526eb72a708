from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Output, Parameter, sampled
from gyrobench.component.blocks.drive import DcMotor


class MotorDc(Component):
    """DC torque motor of a table with its current loop, cogging and torque ripple: block DcMotor.  [MOTOR-DC]

        L i' = U - R i - K_e rate        M = K_t i (1 + ripple sin(n_r x + phase_r)) + cogging sin(n_c x + phase_c)

    The angle x is the integral of the rate from angle0.

    Source: own design; torque: Hu 1981, section 5.4.
    """

    version = "1.0.0"

    motor = DcMotor()
    angle0 = Parameter(0.0, "rad", "angle of the shaft at the start")

    demand = Input(0.0, "N.m", "demanded torque")
    rate = Input(0.0, "rad/s", "rate of the shaft relative to the base")

    torque = Output("N.m", "motor torque on the shaft")
    voltage = Output("V", "voltage of the motor")
    current = Output("A", "current of the motor")
    saturated = Output("1", "1 while current demand or voltage is at its limit")

    x = Discrete(0.0, "rad", "angle of the shaft")

    def start(self) -> None:
        self.x = self.angle0

    @sampled(every=1)
    def tick(self) -> None:
        self.x = self.x + self.h * self.rate
        self.motor.advance(self.demand, self.rate, self.x)

    def outputs(self) -> None:
        self.torque = self.motor_M
        self.voltage = self.motor_U
        self.current = self.motor_i
        self.saturated = self.motor_limited
