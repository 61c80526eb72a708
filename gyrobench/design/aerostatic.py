"""Design of an aerostatic journal bearing: load, stiffness, and the gap for a wanted stiffness.  [BEARING-AIR]

    W     = sum over the orifices  p_d b [(L - 2 l) + 4/3 l (1 - q3)/(1 - q2)] cos a        q = p_a / p_d, b = pi D / n
    (B2 - s2)/(s psi(B)) = 12 mu n l Phi A / (pi R h3 sqrt(p_a rho_a))        B = p_d / p_0, s = p_a / p_0
    psi(B) = sqrt(2 g/(g - 1) (B^(2/g) - B^((g + 1)/g)))        choked below B = (2/(g + 1))^(g/(g - 1)), g = 1.4

Two rows of n orifices at a land l from either end of the length L; h = gap (1 - eps cos a) at the orifice angle a.

Not modelled: flow round the circumference, moments of the thrust bearing, pneumatic hammer.
Source: Hu 1981, eq. 5-22..5-30 with ET9, ET23.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from gyrobench.errors import GyrobenchError

GAMMA = 1.4
CRITICAL = (2.0 / (GAMMA + 1.0)) ** (GAMMA / (GAMMA - 1.0))
SMALL = 1e-3  # eccentricity at which the stiffness is taken
WIDE = 1e-4  # m
RANGE = (math.log(1e-6), math.log(WIDE))  # of the gaps that are looked at


class BearingError(GyrobenchError):
    """A bearing that cannot work, or cannot have the wanted stiffness."""


def flow_function(ratio: float) -> float:
    """Return psi, the flow through an orifice by the pressure ratio across it; constant where it is choked."""
    b = max(ratio, CRITICAL)
    return math.sqrt(2.0 * GAMMA / (GAMMA - 1.0) * (b ** (2.0 / GAMMA) - b ** ((GAMMA + 1.0) / GAMMA)))


@dataclass(frozen=True)
class AerostaticBearing:
    """A journal bearing; lengths in m, pressures in Pa (absolute).  Raises BearingError where it cannot work."""

    diameter: float = 0.25
    length: float = 0.25
    land: float = 0.0625  # l, from a row of orifices to the end
    gap: float = 2e-5  # radial, centred
    orifices: int = 24  # of each row
    orifice: float = 2e-4  # diameter
    supply: float = 6e5  # p_0
    ambient: float = 1.013e5  # p_a
    density: float = 1.184  # kg/m3 at p_a
    viscosity: float = 1.837e-5  # Pa.s
    discharge: float = 0.8  # Phi

    def __post_init__(self) -> None:
        for name in ("diameter", "length", "land", "gap", "orifice", "ambient", "density", "viscosity", "discharge"):
            if not getattr(self, name) > 0.0:
                raise BearingError(f"bearing: {name} = {getattr(self, name):g}: must be > 0")
        if not self.supply > self.ambient:
            raise BearingError(
                f"bearing: supply pressure {self.supply:g} Pa: must be above the ambient pressure {self.ambient:g} Pa "
                "(both absolute)"
            )
        if not 2.0 * self.land < self.length:
            raise BearingError(f"bearing: land = {self.land:g} m: two of them must fit into length = {self.length:g} m")
        if self.orifices < 3:
            raise BearingError(f"bearing: orifices = {self.orifices}: a row needs at least 3")

    def warnings(self) -> list[str]:
        """Return what is possible but unlikely: a gap given in another unit."""
        if self.gap > WIDE:
            return [f"a gap of {self.gap * 1e6:g} um is wide for an air bearing (10 to 25 um): is it given in m?"]
        return []

    def pressure_ratio(self, gap: float) -> float:
        """Return B = p_d / p_0 behind an orifice at a local gap."""
        from scipy.optimize import brentq

        s = self.ambient / self.supply
        area = 0.25 * math.pi * self.orifice**2
        xi = 12.0 * self.viscosity * self.orifices * self.land * self.discharge * area
        xi /= math.pi * 0.5 * self.diameter * gap**3 * math.sqrt(self.ambient * self.density)

        def balance(b: float) -> float:
            return (b * b - s * s) / s - xi * flow_function(b)

        return float(brentq(balance, s, 1.0, xtol=1e-14))

    def load(self, eccentricity: float) -> float:
        """Return the force (N) that brings the shaft back, for an eccentricity in [0, 1)."""
        if not 0.0 <= eccentricity < 1.0:
            raise BearingError(f"bearing: eccentricity = {eccentricity:g}: must be at least 0 and below 1")
        total, pitch = 0.0, math.pi * self.diameter / self.orifices
        for a in 2.0 * math.pi * np.arange(self.orifices) / self.orifices:
            b = self.pressure_ratio(self.gap * (1.0 - eccentricity * math.cos(a)))
            q = self.ambient / (b * self.supply)
            end = 4.0 / 3.0 * self.land * (1.0 + q + q * q) / (1.0 + q)
            total += b * self.supply * pitch * (self.length - 2.0 * self.land + end) * math.cos(a)
        return total

    def stiffness(self) -> float:
        """Return dW/de of the centred shaft, N/m."""
        return self.load(SMALL) / (SMALL * self.gap)

    def tilt_stiffness(self) -> float:
        """Return dM/dphi, N.m/rad: two rows, each half the bearing, a quarter of the length from the middle."""
        return self.stiffness() * self.length**2 / 16.0

    def stiffest(self) -> AerostaticBearing:
        """Return this bearing with the gap of the greatest stiffness: with the gap it rises to a maximum and falls."""
        from scipy.optimize import minimize_scalar

        def softness(log_gap: float) -> float:
            return -replace(self, gap=math.exp(log_gap)).stiffness()

        best = minimize_scalar(softness, bounds=RANGE, method="bounded", options={"xatol": 1e-6})
        return replace(self, gap=math.exp(best.x))

    def with_stiffness(self, wanted: float) -> AerostaticBearing:
        """Return this bearing with the wider of the two gaps that have the wanted stiffness (N/m)."""
        from scipy.optimize import brentq

        def at(log_gap: float) -> float:
            return replace(self, gap=math.exp(log_gap)).stiffness()

        best, high = self.stiffest(), RANGE[1]
        if not at(high) < wanted <= best.stiffness():
            raise BearingError(
                f"bearing: stiffness = {wanted:g} N/m: gaps up to {WIDE * 1e6:g} um have {at(high):.3g} to "
                f"{best.stiffness():.3g} N/m (at {best.gap * 1e6:.3g} um)"
            )
        return replace(self, gap=math.exp(brentq(lambda x: at(x) - wanted, math.log(best.gap), high, xtol=1e-9)))
