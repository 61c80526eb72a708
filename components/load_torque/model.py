from __future__ import annotations

from gyrobench.component import Component, Input, Noise, Output, Parameter, sampled
from gyrobench.component.math import pi, sin

ZEROS = [0.0, 0.0, 0.0]


class LoadTorque(Component):
    """Disturbance torques about the motor axes of a platform.  [STAB-POWER-2DOF, PLATFORM-1AXIS]

        M = torque + constant + amplitude sin(2 pi frequency t + phase) + white noise         for each axis, A order

    `torque` comes from the exciter, which makes the steps and sines of the plan.

    Not modelled: friction and unbalance, which depend on the platform's motion and attitude and are parts of it.
    Source: our own; M_xf of STAB-POWER-2DOF, M_dist of PLATFORM-1AXIS.
    """

    version = "1.0.0"

    step = Parameter(1e9, "s", "largest internal step: one sample for each communication step", above=0.0)
    constant = Parameter(ZEROS, "N.m", "constant torque")
    amplitude = Parameter(ZEROS, "N.m", "amplitude of the sine")
    frequency = Parameter([1.0, 1.0, 1.0], "Hz", "frequency of the sine", min=0.0)
    phase = Parameter(ZEROS, "rad", "phase of the sine at t = 0")
    white_x = Noise(0.0, "N.m/sqrt(Hz)", "density of the random torque, x_f")
    white_y = Noise(0.0, "N.m/sqrt(Hz)", "density of the random torque, y_r")
    white_z = Noise(0.0, "N.m/sqrt(Hz)", "density of the random torque, z_a")

    torque = Input(ZEROS, "N.m", "torque to be added")

    M = Output("N.m", "disturbance torque", shape=(3,))

    @sampled(every=1)
    def tick(self) -> None:
        pass

    def outputs(self) -> None:
        for k in range(3):
            self.M[k] = self.torque[k] + self.constant[k]
            if self.amplitude[k] != 0.0:
                wave = self.amplitude[k] * sin(2.0 * pi * self.frequency[k] * self.t + self.phase[k])
                self.M[k] = self.M[k] + wave
        self.M[0] = self.M[0] + self.noise.white_x
        self.M[1] = self.M[1] + self.noise.white_y
        self.M[2] = self.M[2] + self.noise.white_z
