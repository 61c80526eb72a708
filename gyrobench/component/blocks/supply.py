"""Electrical supplies of a gyro: how far they are off their nominal values, and what that does to the gyro."""

from __future__ import annotations

from gyrobench.component.blocks.gyro import SdfGyro
from gyrobench.component.composition import Block
from gyrobench.component.declarations import Discrete, Input, Parameter
from gyrobench.component.math import Number, Vector, vector


class Departure(Block):
    """Departure of one output of a supply from its nominal value, without what is random.  [GYRO-SUPPLY]

    offset + ramp t + step (from a time on) + swing sin(...)
    """

    offset = Parameter(0.0, "1", "departure at t = 0")
    ramp = Parameter(0.0, "1/s", "its drift")
    step = Parameter(0.0, "1", "its step")
    swing = Parameter(0.0, "1", "amplitude of its ripple")

    def __init__(self, what: str, unit: str = "1") -> None:
        super().__init__(
            offset=Parameter(0.0, unit, f"{what}, departure at t = 0"),
            ramp=Parameter(0.0, "rad/s" if unit == "rad" else "1/s", f"{what}, drift"),
            step=Parameter(0.0, unit, f"{what}, step"),
            swing=Parameter(0.0, unit, f"{what}, amplitude of the ripple"),
        )

    def now(self, t: Number, stepped: Number, wave: Number) -> Number:
        """Return the departure; stepped: 1 after the step, wave: sine of the ripple."""
        return self.offset + self.ramp * t + self.step * stepped + self.swing * wave


class SuppliedGyro(SdfGyro):
    """Single-degree-of-freedom gyro whose supplies may be off their nominal values.  [GYRO-SUPPLY]

    f, v, p: wheel supply, frequency and voltage (relative), asymmetry of the phases (rad); e, a: excitation current of
    the pickoff and of the torquer or magnetic suspension (relative).

        H -> H (1 + f)                     torques stay, so omega_d and k i -> omega_d/(1 + f), k i/(1 + f)
        D_F -> D_F + D_pickoff ((1 + e)2 - 1) + D_torquer ((1 + a)2 - 1)                    [Hu 1981, eq. 2-39]
        D_I -> D_I + D_UI v + D_PI p       D_S -> D_S + D_US v + D_PS p                     [Hu 1981, eq. 2-40]
        k -> k (1 + k_E a)                 K_sg -> K_sg (1 + e)
    """

    D_pickoff = Parameter(0.0, "rad/s", "part of D_F that the reaction torque of the pickoff makes")
    D_torquer = Parameter(0.0, "rad/s", "part of D_F that the reaction torque of torquer or suspension makes")
    D_UI = Parameter(0.0, "rad/s", "D_I per relative change of the wheel voltage")
    D_US = Parameter(0.0, "rad/s", "D_S per relative change of the wheel voltage")
    D_PI = Parameter(0.0, "rad/s", "D_I per radian of asymmetry of the wheel's phases")
    D_PS = Parameter(0.0, "rad/s", "D_S per radian of asymmetry of the wheel's phases")
    k_E = Parameter(0.0, "1", "share of the excitation in the torquer's constant; 0: permanent magnet, 1: microsyn")

    wheel_frequency = Input(0.0, "1", "frequency of the wheel supply, relative departure")
    wheel_voltage = Input(0.0, "1", "voltage of the wheel supply, relative departure")
    wheel_phase = Input(0.0, "rad", "asymmetry of the phases of the wheel supply")
    pickoff_excitation = Input(0.0, "1", "excitation current of the pickoff, relative departure")
    torquer_excitation = Input(0.0, "1", "excitation of torquer or suspension, relative departure")

    sensitive = Discrete(0.0, "1", "1 where a drift by the supplies is given")

    def start(self) -> None:
        self.sensitive = 0.0
        if self.D_pickoff != 0.0 or self.D_torquer != 0.0 or self.D_UI != 0.0 or self.D_US != 0.0:
            self.sensitive = 1.0
        if self.D_PI != 0.0 or self.D_PS != 0.0:
            self.sensitive = 1.0

    def speed(self) -> Number:
        """Return the speed of the wheel over its nominal one."""
        return 1.0 + self.wheel_frequency

    def by_supplies(self, x: Vector) -> Number:
        """Return the drift rate that the supplies add, (X, Y, Z) = x."""
        reaction = self.D_pickoff * self.pickoff_excitation * (2.0 + self.pickoff_excitation)
        reaction = reaction + self.D_torquer * self.torquer_excitation * (2.0 + self.torquer_excitation)
        along_i = self.D_UI * self.wheel_voltage + self.D_PI * self.wheel_phase
        along_s = self.D_US * self.wheel_voltage + self.D_PS * self.wheel_phase
        return reaction + vector([along_i, 0.0, along_s]) @ x

    def static_drift(self, x: Vector) -> Number:
        drift = super().static_drift(x)
        if self.sensitive > 0.0:
            drift = drift + self.by_supplies(x)
        return drift

    def gain(self) -> Number:
        return super().gain() * (1.0 + self.pickoff_excitation)

    def drift_rate(self) -> Number:
        return super().drift_rate() / self.speed()

    def precession(self) -> Number:
        return super().precession() * (1.0 + self.k_E * self.torquer_excitation) / self.speed()
