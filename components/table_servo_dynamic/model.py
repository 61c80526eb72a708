from __future__ import annotations

from gyrobench.component import Discrete, Input, Output, Parameter
from gyrobench.component.blocks.built_table import BuiltTable
from gyrobench.component.blocks.control import SampledController
from gyrobench.component.math import Number, fabs, floor

SERVO = 3.0  # mode in which the gyro holds the table


class TableServoDynamic(BuiltTable):
    """Turntable as it is built that a gyro holds still by the sampled controller.  [CTRL-SAMPLED, LOOP-TABLE-SERVO]

    Modes 0 hold, 1 index, 2 rate are those of table_dynamic.  In mode 3 the pickoff voltage u of a gyro with its input
    axis along the table axis takes the place of the counts: it is read every `period` as a count of table angle, and
    the same law drives it to null,

        x_k = -quantum round(polarity u_k / (S quantum))        S = K_g H_g / C_g, V per rad of the table
        u_k = b u_k-1 + (2 J / T2)(g x_k - a x_k-1)             K_T = (2 J / T2)(g - a) / (1 - b)

    so that the table turns inertially with the drift of the gyro, and a torque M holds it M / K_T from there.  The
    float must be near null when mode 3 begins (cage); its lag J_g / C_g and that of the motor take effect as a delay:
    mode 3 refuses poles p that do not bear it (0.5 by default).  After it the command goes on from the reading.

    Not modelled: what table_dynamic leaves out; noise and filter of the pickoff's converter, torque of the float on the
    table (a damping of H_g2 / C_g, 0.2 N.m.s/rad where J / T is 512), capture from a large offset.
    Source: Hu 1981, eq. 3-54, 3-55, 6-10..6-19, sections 5.4 (two-2), 5.5, 6.1; the law on the pickoff: own design.
    """

    version = "1.1.0"

    law = SampledController(period="period", quantum="quantum", p=0.5)

    polarity = Parameter(1, int, "1: input axis along the table axis; -1: against it", min=-1, max=1)
    H_g = Parameter(0.2, "N.m.s", "gyro: spin angular momentum", above=0.0)
    J_g = Parameter(2e-4, "kg.m2", "gyro: float inertia", above=0.0)
    C_g = Parameter(0.2, "N.m.s/rad", "gyro: float damping", above=0.0)
    K_g = Parameter(10.0, "V/rad", "gyro: pickoff gain", above=0.0)

    mode = Input(0.0, "1", "0 hold, 1 index, 2 rate, 3 servo")
    u = Input(0.0, "V", "pickoff voltage of the gyro")
    torque = Input(0.0, "N.m", "disturbance torque on the table")

    motor_torque = Output("N.m", "motor torque")

    servo = Discrete(0.0, "1", "1 while the gyro holds the table")
    per_volt = Discrete(0.0, "1/V", "counts of table angle per volt")

    def start(self) -> None:
        self.refuse(self.polarity == 0.0, "polarity must be 1 or -1")
        self.per_volt = self.polarity * self.C_g / (self.K_g * self.H_g * self.quantum)
        self.servo = 0.0

    def load(self) -> Number:
        return self.torque

    def sample(self) -> None:
        if self.mode == SERVO:
            counts = -floor(self.u * self.per_volt + 0.5)
            self.refuse(
                fabs(counts) * self.quantum > self.law_error_max,
                "the pickoff is more than law_error_max = {law_error_max} rad of table angle from null: cage the float "
                "before mode 3 begins",
            )
            if self.servo == 0.0:
                self.servo = 1.0
                lag = self.law_delay + self.motor_lag + self.J_g / self.C_g
                self.refuse(
                    lag > self.period or self.law.stable(lag / self.period) == 0.0,
                    "the servo loop is unstable at law_p = {law_p}: the lags of gyro (J_g / C_g) and motor are too "
                    "long for the period = {period} s; take a larger law_p or a longer period",
                )
                self.command.rest(self.scale_count * self.quantum)
                self.law.preset(counts)
            self.law.sample(counts, 0.0)
        else:
            if self.servo == 1.0:
                self.servo = 0.0
                self.command.rest(self.scale_count * self.quantum)
                self.law.preset(0.0)
            self.follow()

    def outputs(self) -> None:
        self.motor_torque = self.motor_M
