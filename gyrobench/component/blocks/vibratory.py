"""Coriolis vibratory gyros: the two modes of a resonator and what their envelope and their carrier form share."""

from __future__ import annotations

from typing import ClassVar

from gyrobench.component.blocks.rate_gyro import FilteredRateGyro
from gyrobench.component.declarations import Discrete, Noise, Output, Parameter
from gyrobench.component.math import Number, Vector, cos, pi, sin, sqrt, vector


class VibratoryGyro(FilteredRateGyro):
    """Common part of vibrating rate gyros: two resonators of one make, for x and y.  [GYRO-VIBRATORY]

    p = 1/tau - i delta,   1/tau = w_y / (2 Q),   delta = w_y - w_x,   r = 2 w_x / (w_y + w_x)    T: temperature
    w_x = 2 pi frequency (1 + frequency_T T),   w_y = w_x + 2 pi (split + split_T T),   Q (1 + Q_T T)
    W = scaled rate + drift + g2 f2 + damping_difference / (1 + Q_T T) sin(2 damping_axis) / (2 coupling)
    W_q = quadrature + quadrature_T T
    """

    white_noise: ClassVar[str] = "white"
    without_own_noise: ClassVar[dict[str, float]] = {"pickoff": 0.0}

    closed = Parameter(1.0, "1", "1 force rebalance, 0 open loop", min=0.0, max=1.0)
    frequency = Parameter(15e3, "Hz", "frequency of the drive mode", above=0.0)
    frequency_T = Parameter(-3e-5, "1/K", "change of the frequencies with temperature, relative", min=-1e-3, max=1e-3)
    split = Parameter(100.0, "Hz", "frequency of the sense mode less that of the drive mode")
    split_T = Parameter(0.0, "Hz/K", "change of the split with temperature")
    Q = Parameter(1e4, "1", "quality factor of the sense mode", min=10.0)
    Q_T = Parameter(0.0, "1/K", "change of the quality factors with temperature, relative", min=-5e-3, max=5e-3)
    coupling = Parameter(0.8, "1", "Coriolis coupling of the modes (modal angular gain)", above=0.0, max=1.0)
    damping_difference = Parameter(0.0, "1/s", "difference of 1/tau of the axes of damping", min=0.0)
    damping_axis = Parameter([0.0, 0.0], "rad", "angle of the axis of larger damping from the drive mode, of x and y")
    quadrature = Parameter([0.0, 0.0], "rad/s", "quadrature of x and y, as a rate")
    quadrature_T = Parameter([0.0, 0.0], "rad/s/K", "change of the quadrature with temperature")
    phase_error = Parameter([0.0, 0.0], "rad", "phase error of the demodulator of x and y", min=-1.0, max=1.0)
    phase_T = Parameter(0.0, "rad/K", "change of the phase error with temperature")
    g2 = Parameter([[0.0] * 3] * 2, "rad.s3/m2", "rows: change of each bias with the square of the force along x, y, z")
    loop = Parameter(100.0, "Hz", "force rebalance: frequency at which the loop has 3 dB", above=0.0)
    white = Noise(1e-4, "rad/s/sqrt(Hz)", "noise of the force, as a rate: density N, of each phase", samples=4)
    pickoff = Noise(0.0, "rad/sqrt(Hz)", "noise of the pick-off, over twice the drive motion", samples=4)

    residual = Output("rad/s", "force rebalance: quadrature that is held, of x and y; open loop: 0", shape=(2,))

    gain = Discrete(0.0, "1/s", "gain of the rebalance loop")
    reach_0 = Discrete(1.0, "1", "r at the temperature of the coefficients")
    rate_0 = Discrete(0.0, "1/s", "decay rate of the sense mode at the temperature of the coefficients")
    delta_0 = Discrete(0.0, "rad/s", "delta at the temperature of the coefficients")
    T_seen = Discrete(0.0, "K", "temperature of the values below")
    drive = Discrete(0.0, "rad/s", "angular frequency of the drive mode")
    decay = Discrete(0.0, "1/s", "decay rate of the sense mode")
    delta = Discrete(0.0, "rad/s", "detuning of the sense mode")
    reach = Discrete(1.0, "1", "r: effect of a force at the drive frequency, over that at the sense mode's")
    damping = Discrete([0.0, 0.0], "rad/s", "rate that the axes of damping make")
    c = Discrete([1.0, 1.0], "1", "cosine of the phase error")
    s = Discrete([0.0, 0.0], "1", "sine of the phase error")

    def start(self) -> None:
        self.refuse(
            self.split < -0.5 * self.frequency or self.split > self.frequency,
            "split = {split} Hz: the sense mode must be between half and twice the drive mode of {frequency} Hz",
        )
        self.tune(0.0)
        self.reach_0 = self.reach
        self.gain = 2.0 * pi * self.loop / self.reach
        self.rate_0 = self.decay
        self.delta_0 = self.delta
        self.tune(self.temperature)

    def tune(self, T: Number) -> None:
        """Take the modes, the damping and the phase error at a temperature."""
        self.T_seen = T
        self.drive = 2.0 * pi * self.frequency * (1.0 + self.frequency_T * T)
        sense = self.drive + 2.0 * pi * (self.split + self.split_T * T)
        quality = 1.0 + self.Q_T * T
        self.refuse(quality <= 0.1, "the quality factors are less than a tenth at this temperature: Q_T = {Q_T} 1/K")
        self.decay = 0.5 * sense / (self.Q * quality)
        self.delta = sense - self.drive
        self.reach = 2.0 * self.drive / (sense + self.drive)
        for j in range(2):
            largest = 0.5 * self.damping_difference / (self.coupling * quality)
            self.damping[j] = largest * sin(2.0 * self.damping_axis[j])
            phi = self.phase_error[j] + self.phase_T * T
            self.c[j] = cos(phi)
            self.s[j] = sin(phi)

    def in_phase(self) -> Vector:
        """Return the rates in phase with Coriolis' force, without white noise."""
        f = self.mount @ self.f
        squares = vector([f[0] * f[0], f[1] * f[1], f[2] * f[2]])
        out = self.scaled(self.mount @ self.omega, self.temperature) + self.drift_rates(self.temperature)
        for j in range(2):
            out[j] = out[j] + self.damping[j] + vector(self.g2[j]) @ squares
        return vector(out)

    def at_right_angles(self) -> Vector:
        """Return the rates at right angles to Coriolis' force in phase, without white noise."""
        return vector(vector(self.quadrature) + self.temperature * vector(self.quadrature_T))

    def outputs(self) -> None:
        both = (self.rate_0 * self.rate_0 + self.delta_0 * self.delta_0) / (self.reach_0 * self.reach_0)
        self.density = sqrt(self.white * self.white + both * self.pickoff * self.pickoff)
