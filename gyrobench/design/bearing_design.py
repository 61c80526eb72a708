"""Design of an aerostatic bearing as a result: figures, page, values for the part bearing_air.  [BEARING-AIR]"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

from gyrobench.bench import UsageError, suggest_names
from gyrobench.design.aerostatic import AerostaticBearing, BearingError
from gyrobench.system.values import InvalidValueError, parse_number

UNITS = {
    "diameter": "m",
    "length": "m",
    "land": "m",
    "gap": "m",
    "orifices": "1",
    "orifice": "m",
    "supply": "Pa",
    "ambient": "Pa",
    "density": "kg/m3",
    "viscosity": "Pa.s",
    "discharge": "1",
}
#: parameter of the part bearing_air -> field of the design
OF_PART = {"air_viscosity": "viscosity", "air_diameter": "diameter", "air_length": "length", "air_gap": "gap"}
FULL = 0.9  # eccentricity up to which a load is carried: beyond, the surfaces' roundness takes the rest of the gap


@dataclass(frozen=True)
class BearingDesign:
    """A bearing with its load; ``print`` shows it as a text.  SI."""

    bearing: AerostaticBearing
    load: float  # N, radial; 0: none
    eccentricity: float  # of this load

    @property
    def viscous(self) -> float:
        """Return the viscous torque of the journal per rate, N.m.s/rad: mu pi D3 L / (4 h sqrt(1 - eps2))."""
        b = self.bearing
        wide = 4.0 * b.gap * math.sqrt(1.0 - self.eccentricity**2)
        return b.viscosity * math.pi * b.diameter**3 * b.length / wide

    def as_dict(self) -> dict[str, Any]:
        """Return everything as numbers, SI."""
        b = self.bearing
        best = b.stiffest()
        return {
            "schema": "gyrobench.bearing/1",
            "bearing": {f.name: getattr(b, f.name) for f in fields(b)},
            "load": self.load,
            "eccentricity": self.eccentricity,
            "pressure_ratio": b.pressure_ratio(b.gap),
            "stiffness": b.stiffness(),
            "tilt_stiffness": b.tilt_stiffness(),
            "greatest_load": b.load(FULL),
            "stiffest_gap": best.gap,
            "greatest_stiffness": best.stiffness(),
            "viscous": self.viscous,
            "warnings": b.warnings(),
        }

    def toml(self) -> str:
        """Return the values of the part bearing_air in the slot bearing, as a file for --set @FILE."""
        lines = ["# aerostatic bearing, designed; thrust faces and vortex torque as the part has them", "[bearing]"]
        lines += [f'{n} = "{getattr(self.bearing, f):.9g}{UNITS[f]}"' for n, f in OF_PART.items()]
        return "\n".join([*lines, f"air_eccentricity = {self.eccentricity:.9g}"]) + "\n"

    def __str__(self) -> str:
        return "\n".join([f"{n}  {v}" for n, v in rows(self)] + [f"warning: {w}" for w in self.bearing.warnings()])


def rows(d: BearingDesign) -> list[tuple[str, str]]:
    """Return what a reader wants to know, as texts."""
    found = d.as_dict()
    kgf, arcsec = 9.80665, math.pi / 648000.0
    return [
        ("gap", f"{d.bearing.gap * 1e6:.3g} µm"),
        ("pressure behind the orifices, centred", f"{found['pressure_ratio']:.3f} of the supply"),
        ("stiffness", f"{found['stiffness'] * 1e-6:.4g} N/µm ({found['stiffness'] / kgf * 1e-6:.4g} kgf/µm)"),
        ("stiffness against tilt", f"{found['tilt_stiffness'] * arcsec:.4g} N·m/″ "
         f"({found['tilt_stiffness'] / kgf * arcsec:.4g} kgf·m/″)"),
        (f"load at an eccentricity of {FULL:g}", f"{found['greatest_load']:.0f} N"),
        ("stiffest gap of this bearing", f"{found['stiffest_gap'] * 1e6:.3g} µm, "
         f"{found['greatest_stiffness'] * 1e-6:.4g} N/µm"),
        ("eccentricity under the load", f"{d.eccentricity:.4g} at {d.load:.4g} N"),
        ("viscous torque of the journal", f"{d.viscous:.4g} N·m·s/rad"),
    ]  # fmt: skip


def design_bearing(values: Mapping[str, Any], stiffness: Any = None, load: Any = 0.0) -> BearingDesign:
    """Return the bearing of ``values`` (names of AerostaticBearing, with units), with the gap of a wanted stiffness.

    stiffness: N/m, or a text with its unit; load: radial, N.  Raises UsageError, and BearingError for a bearing that
    cannot work, cannot have the stiffness or does not carry the load.
    """
    if unknown := [n for n in values if n not in UNITS]:
        raise UsageError(f"--set {unknown[0]}: unknown; {suggest_names(unknown[0], UNITS)}")
    try:
        given: dict[str, Any] = {n: parse_number(n, v, UNITS[n]) for n, v in values.items()}
        wanted = None if stiffness is None else parse_number("stiffness", stiffness, "N/m")
        force = parse_number("load", load, "N")
    except InvalidValueError as error:
        raise UsageError(str(error)) from None
    if "orifices" in given:
        if given["orifices"] != int(given["orifices"]):
            raise UsageError(f"orifices = {given['orifices']:g}: must be an integer")
        given["orifices"] = int(given["orifices"])
    if wanted is not None and "gap" in given:
        raise UsageError("--stiffness finds the gap: leave --set gap=... out")
    bearing = replace(AerostaticBearing(), **given)
    if wanted is not None:
        bearing = bearing.with_stiffness(wanted)
    return BearingDesign(bearing, force, _eccentricity(bearing, force))


def _eccentricity(bearing: AerostaticBearing, load: float) -> float:
    """Return the eccentricity of a load; the load rises with it as far as FULL, or the bearing is refused."""
    from scipy.optimize import brentq

    if not load >= 0.0:
        raise BearingError(f"bearing: load = {load:g} N: must be >= 0")
    if load == 0.0:
        return 0.0
    if not load < bearing.load(FULL):
        raise BearingError(
            f"bearing: load = {load:g} N: at an eccentricity of {FULL:g} the bearing carries {bearing.load(FULL):.4g} N"
        )
    return float(brentq(lambda e: bearing.load(e) - load, 0.0, FULL, xtol=1e-12))
