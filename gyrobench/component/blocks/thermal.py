"""Errors of three instruments that follow their temperature: polynomials, hysteresis, rate of change.  [IMU-THERMAL]"""

from __future__ import annotations

from gyrobench.component.component import Component
from gyrobench.component.composition import Block, sampled
from gyrobench.component.declarations import Discrete, Input, Parameter
from gyrobench.component.math import Number, Vector, clip, vector

NONE = [0.0, 0.0, 0.0]


class ThermalErrors(Block):
    """Bias and scale factor of three instruments, T above the temperature of the coefficients, T' its rate, z a play:

    bias  += bias_T T + bias_T2 T2 + bias_T3 T3 + hysteresis z + ramp T',      scale += scale_T T + scale_T2 T2
    """

    bias_T = Parameter(NONE, "1/K", "bias per kelvin")
    bias_T2 = Parameter(NONE, "1/K2", "bias per kelvin squared")
    bias_T3 = Parameter(NONE, "1/K3", "bias per kelvin cubed")
    hysteresis = Parameter(NONE, "1", "bias of a temperature that rose, less the mean of both ways")
    ramp = Parameter(NONE, "s/K", "bias per kelvin a second")
    scale_T = Parameter(NONE, "1/K", "scale factors per kelvin, relative")
    scale_T2 = Parameter(NONE, "1/K2", "scale factors per kelvin squared, relative")

    def __init__(self, unit: str, per_rate: str, what: str) -> None:
        """unit of the bias, unit of the bias per kelvin a second; what: "gyros"."""
        super().__init__(
            bias_T=Parameter(NONE, f"{unit}/K", f"{what}: bias per kelvin"),
            bias_T2=Parameter(NONE, f"{unit}/K2", f"{what}: bias per kelvin squared"),
            bias_T3=Parameter(NONE, f"{unit}/K3", f"{what}: bias per kelvin cubed"),
            hysteresis=Parameter(NONE, unit, f"{what}: bias of a temperature that rose, less the mean of both ways"),
            ramp=Parameter(NONE, per_rate, f"{what}: bias per kelvin a second"),
            scale_T=Parameter(NONE, "1/K", f"{what}: scale factors per kelvin, relative"),
            scale_T2=Parameter(NONE, "1/K2", f"{what}: scale factors per kelvin squared, relative"),
        )

    def bias_at(self, T: Number, z: Number, slope: Number) -> Vector:
        """Return the bias of the three instruments."""
        cubic = T * (self.bias_T + T * (self.bias_T2 + T * self.bias_T3))
        return vector(cubic + z * self.hysteresis + slope * self.ramp)

    def scale_at(self, T: Number) -> Vector:
        """Return the relative change of the three scale factors."""
        return vector(T * (self.scale_T + T * self.scale_T2))

    def error_at(self, v: Vector, T: Number, z: Number, slope: Number) -> Vector:
        """Return what is read too much of the inputs v of the three instruments."""
        out = self.bias_at(T, z, slope)
        grown = self.scale_at(T)
        for j in range(3):
            out[j] = out[j] + grown[j] * v[j]
        return vector(out)


class TemperatureHistory(Component):
    """Temperature of an instrument, how far it is through its hysteresis, and its rate of change.

    z+ = z + 2 dT/hysteresis_width within -1 ... 1;   T' = dT/h, of the internal step that ends; both 0 at the start.
    """

    hysteresis_width = Parameter(10.0, "K", "temperature change that goes through the hysteresis", above=0.0)
    temperature = Input(0.0, "K", "temperature above that of the coefficients")
    way = Discrete(0.0, "1", "-1 ... 1: how far through the hysteresis")
    slope = Discrete(0.0, "K/s", "rate of change of the temperature")
    before = Discrete(0.0, "K", "temperature of the step before")

    def start(self) -> None:
        self.before = self.temperature

    @sampled(every=1)
    def tick(self) -> None:
        change = self.temperature - self.before
        self.way = clip(self.way + 2.0 * change / self.hysteresis_width, -1.0, 1.0)
        self.slope = change / self.h
        self.before = self.temperature
