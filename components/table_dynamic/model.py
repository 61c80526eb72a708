from __future__ import annotations

from gyrobench.component import Input, Output
from gyrobench.component.blocks.built_table import BuiltTable
from gyrobench.component.math import Number


class TableDynamic(BuiltTable):
    """Turntable with one axis as it is built: counts, sampled controller, motor, moving part.  [CTRL-SAMPLED]

    Every `period` the command count goes on (CountCommand), the encoder is read (IncrementalEncoder), and the
    controller demands a torque from their difference (SampledController), which the motor gives to the moving part
    until the next sample (SquareLawMotor, AxisBody):

        J w' = M + M_load + pull - viscous (w - e) + friction ...        x' = w - e

    w inertial rate about the axis, e that of the base, pull of the unbalance.  It fits where table_rate does; beside
    the command it shows what a real table does: lag, jitter of the counts, response to friction and unbalance, errors
    of the scale.  angle_read is the encoder's count times the quantum.

    Not modelled: wobble, motion of the axis in its bearing, carrier and heating of the motor, acceleration of the
    mounted instrument (it stands on the axis), time of a change of mount.
    Source: Hu 1981, sections 5.4 (two-2), 5.5, 6.1; each block names its equations.
    """

    version = "1.1.0"

    M_load = Input(0.0, "N.m", "further torque on the table")

    torque = Output("N.m", "motor torque")

    def load(self) -> Number:
        return self.M_load

    def outputs(self) -> None:
        self.torque = self.motor_M
