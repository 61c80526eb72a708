"""Connectors of a socket, with causality, unit, shape and meaning."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from gyrobench.component.declarations import element_names

Shape = tuple[int, ...]
#: what a signal in V or A may stand for; an FMU declares it by the attribute quantity of a variable
QUANTITIES = {"angle": "an angle", "rate": "an angular rate"}


@dataclass(frozen=True)
class Connector:
    """One variable (or array of variables) of a socket."""

    name: str
    causality: str  # "input" | "output", seen from the part in the slot
    unit: str  # "" = any: neither checked nor converted
    meaning: str
    shape: Shape = ()
    optional: bool = False
    whole: bool = False  # integer valued: an Integer or Boolean variable fits as well as a Real one
    quantity: str = ""  # one of QUANTITIES: what the signal stands for, where its unit does not say
    limit: bool = False  # a flag: 1 while a limit (of a signal, of a motion) is reached

    @property
    def elements(self) -> list[str]:
        return element_names(self.name, self.shape)


@dataclass(frozen=True)
class Socket:
    """A named set of connectors."""

    name: str
    meaning: str
    connectors: tuple[Connector, ...]

    def standing_for(self, quantities: Mapping[str, str]) -> Socket:
        """Return the socket with the quantities of connectors: {"u": "angle"}."""
        changed = (replace(c, quantity=quantities.get(c.name, c.quantity)) for c in self.connectors)
        return replace(self, connectors=tuple(changed))

    def connector(self, name: str) -> Connector | None:
        """The connector called ``name`` (without index), or None."""
        return next((c for c in self.connectors if c.name == name), None)


def inp(name: str, unit: str, meaning: str, *shape: int, optional: bool = False, whole: bool = False) -> Connector:
    """An input of the part in the slot."""
    return Connector(name, "input", unit, meaning, shape, optional, whole)


def out(name: str, unit: str, meaning: str, *shape: int, optional: bool = False, whole: bool = False) -> Connector:
    """An output of the part in the slot."""
    return Connector(name, "output", unit, meaning, shape, optional, whole)


def limit_flag(name: str, meaning: str) -> Connector:
    """An optional output that is 1 while a limit is reached; meaning: "1 while ..."."""
    return Connector(name, "output", "1", meaning, optional=True, whole=True, limit=True)


#: what temperature and magnetic field do to a gyro
EXPOSED = (
    inp("temperature", "K", "mean temperature above that of the coefficients", optional=True),
    inp("B", "T", "magnetic field along the axes of the case", 3, optional=True),
    inp("dB", "T", "differences of the magnetic field over the gyro, axes of the case", 3, optional=True),
)
#: departures of the electrical supplies of a gyro from their nominal values, as the supply gives them
SUPPLIES = (
    out("wheel_frequency", "1", "frequency of the wheel supply, relative departure"),
    out("wheel_voltage", "1", "voltage of the wheel supply, relative departure", optional=True),
    out("wheel_phase", "rad", "asymmetry of the phases of the wheel supply", optional=True),
    out("pickoff_excitation", "1", "excitation current of the pickoff, relative departure", optional=True),
    out("torquer_excitation", "1", "excitation of torquer or suspension, relative departure", optional=True),
)
#: what a gyro takes of them
SUPPLIED = tuple(replace(c, causality="input", optional=True) for c in SUPPLIES)
