"""The plant of a stabilizer loop by its physical parameters: inertia, friction, motor, a mode, a delay.

    torque to rate     A(s) = 1/(J s + viscous) + (mode_share/J) s/(s2 + 2 mode_damping w s + w2),   w = 2 pi mode_f
    input in N.m       G = A
    input in A         G = k_t A
    input in V         G = k_t A / (L s + R + k_t k_e A)
    output in rad/s    G,  in rad  G/s                    P = +-G e^(-s delay)
    held               input held over a sample h: each r/(s - p) of G becomes r (e^(p h) - 1)/p / (z - e^(p h))

The names are those of ``platform_single_axis``.  Not modelled: dry friction (its describing function is part of
`viscous` at the amplitude of the record), more than one mode, the reducer.
Source: PLATFORM-1AXIS, Astrom 1997, 2.3 (held input).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gyrobench import units
from gyrobench.arrays import Array
from gyrobench.record.frequency_response import Complex

#: name -> unit, meaning
PARAMETERS: dict[str, tuple[str, str]] = {
    "J": ("kg.m2", "inertia of the platform about its axis"),
    "viscous": ("N.m.s/rad", "viscous friction"),
    "k_t": ("N.m/A", "torque constant of the motor"),
    "k_e": ("V.s/rad", "back EMF constant of the motor"),
    "R": ("Ohm", "resistance of the motor"),
    "L": ("Ohm.s", "inductance of the motor"),
    "delay": ("s", "delay between input and output"),
    "mode_f": ("Hz", "frequency of the bending mode"),
    "mode_damping": ("1", "its damping ratio"),
    "mode_share": ("1", "J over its modal mass, negative behind the node"),
}
MODE = ("mode_f", "mode_damping", "mode_share")
OF_PLATFORM = ("J", "viscous", "k_t", "k_e", "R", "L")  # that a part of the bench has
SIGNED = ("mode_share", "delay", "viscous", "k_e", "L")  # the noise may make these negative
NEEDED = {"N.m": (), "A": ("k_t",), "V": ("k_t", "k_e", "R", "L")}
OUTPUTS = {"rad/s": 0, "rad": 1}
LARGEST = 50.0  # of an exponent
SMALL = 1e-9  # rad/s: two equal poles are told apart by so much


@dataclass(frozen=True)
class PlantModel:
    """input: "N.m", "A" or "V"; integrations: of the rate in the output; held: step of a held input, s, else 0."""

    input: str
    integrations: int
    held: float = 0.0
    sign: float = 1.0

    def response(self, values: Mapping[str, float], f: Array) -> Complex:
        """Return P at frequencies, Hz; values, SI: of PARAMETERS, without a mode that is not there."""
        num, den = self._rational(values)
        s = 2j * np.pi * f
        g = self._held(num, den, np.exp(s * self.held)) if self.held else np.polyval(num, s) / np.polyval(den, s)
        return np.asarray(self.sign * g * np.exp(-s * values.get("delay", 0.0)))

    def _rational(self, v: Mapping[str, float]) -> tuple[Array, Array]:
        num, den = np.array([1.0]), np.array([v["J"], v["viscous"]])
        if "mode_f" in v:
            w = 2.0 * np.pi * v["mode_f"]
            mode = np.array([1.0, 2.0 * v["mode_damping"] * w, w * w])
            num = np.polyadd(mode, v["mode_share"] / v["J"] * np.polymul([1.0, 0.0], den))
            den = np.polymul(den, mode)
        if self.input != "N.m":
            num = v["k_t"] * num
        if self.input == "V":
            den = np.polyadd(np.polymul([v["L"], v["R"]], den), v["k_e"] * num)
        for _ in range(self.integrations):
            den = np.polymul(den, [1.0, SMALL])
        return num, den

    def _held(self, num: Array, den: Array, z: Complex) -> Complex:
        poles = np.roots(den)
        poles = np.where(np.abs(poles) < SMALL, -SMALL, poles)
        residues = np.polyval(num, poles) / np.polyval(np.polyder(den), poles)
        turned = poles * self.held
        turned = np.where(turned.real > LARGEST, LARGEST, turned)  # on the way of a search alone
        return np.asarray(np.sum(residues * np.expm1(turned) / poles / (z[:, None] - np.exp(turned)), axis=1))


def unit_of(text: str, among: tuple[str, ...]) -> str:
    """Return which of several units a unit has the dimension of; "" for none."""
    return next((u for u in among if units.same_dimension(text, u)), "")
