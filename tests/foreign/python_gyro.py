"""The gyro of vendor_gyro.c as a vendor makes it with pythonfmu: no units, no dependencies, one scalar a variable."""

import math

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

DEG_H = math.pi / 180.0 / 3600.0


class PythonGyro(Fmi2Slave):
    author = "vendor"
    description = "RIG-7 in Python"

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.w_x = self.w_y = self.w_z = 0.0
        self.acc_x = self.acc_y = self.acc_z = 0.0
        self.current = self.pickoff = 0.0
        self.k_torquer = 20.0
        self.angle = self.rate = 0.0
        for name in ("w_x", "w_y", "w_z", "acc_x", "acc_y", "acc_z", "current"):
            self.register_variable(Real(name, causality=Fmi2Causality.input))
        self.register_variable(Real("pickoff", causality=Fmi2Causality.output))
        fixed = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}
        self.register_variable(Real("k_torquer", **fixed))

    def do_step(self, current_time, step_size):
        tau = 0.8e-3
        target = DEG_H * (self.w_x - self.w_z * self.angle - self.k_torquer * self.current)
        decay = math.exp(-step_size / tau)
        self.angle += target * step_size + (self.rate - target) * tau * (1.0 - decay)
        self.rate = target + (self.rate - target) * decay
        self.pickoff = 10000.0 * self.angle
        return True
