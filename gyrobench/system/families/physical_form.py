"""Drift of a simulated gyro by its masses and compliances: the option ``physical`` of the drift tests.

    --set "physical=m=0.25kg, l_S=0.36um, l_I=0.2um, K_SS=3nm/N, K_II=1nm/N"

sets the coefficients that these quantities determine (:mod:`gyrobench.drift`, GYRO-STATIC-8); the others keep their
values.  The true values in the report are the coefficients that follow.
"""

from __future__ import annotations

import re

from gyrobench import drift, units
from gyrobench.system.configurable import InvalidConfigurationError, Option
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import System

PHYSICAL_FORM = {
    "physical": Option("", str, "mass, mass centre and compliances (m=0.25kg, l_S=0.3um ...) that set the drift")
}
_UNITS = {"m": "kg", "outer": "kg.m", "M": "N.m", "l": "m", "K": "m/N"}


def parse_physical(text: str) -> dict[str, float]:
    """Return the quantities of an option value, SI.  Raises ValueError with what is wrong."""
    found: dict[str, float] = {}
    for entry in re.split(r"[,;]", text):
        name, sign, value = (part.strip() for part in entry.partition("="))
        unit = _UNITS.get(name if name in ("m", "outer") else name.partition("_")[0])
        if not sign or unit is None or name in found:
            twice = " stands twice" if name in found else ""
            raise ValueError(f"'{entry.strip()}'{twice}: entries are m=0.25kg, l_S=0.3um, K_SI=1nm/N, M_O=1e-7N.m ...")
        found[name] = units.parse_quantity(value, unit)
    if "m" not in found:
        raise ValueError("m, the mass of the float, is missing (m=0.25kg)")
    return found


def physical_drift(system: System, parts: PartValues) -> dict[str, float]:
    """Return "gyro.D_I" -> rad/s ... of the option ``physical``.  Raises InvalidConfigurationError."""
    text = system.values.get("physical", "")
    if not text:
        return {}
    socket = system.slots["gyro"].socket
    H = float(parts["gyro.H"])
    try:
        given = parse_physical(text)
        m, outer = given.pop("m"), given.pop("outer", None)
        if (socket if isinstance(socket, str) else socket.name) != "TwoAxisGyro":
            if outer is not None:
                raise ValueError("outer is the outer gimbal of a two-degree-of-freedom gyro; this gyro has none")
            found = drift.from_physical(H, m, given)
        else:
            found = drift.from_physical_2dof(H, m, given, outer or 0.0)
    except ValueError as error:
        raise InvalidConfigurationError(system.name, [f"physical: {error}"]) from None
    out = {f"gyro.{name}": value for name, value in found.items()}
    twice = [name for name, value in out.items() if parts.given(name, value) != value]
    if twice:
        both = f"{', '.join(twice)}: set, and by the option physical too; set one"
        raise InvalidConfigurationError(system.name, [both])
    return out
