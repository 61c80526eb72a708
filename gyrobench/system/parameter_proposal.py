"""The table [parameters] of a first mapping: which parameter of an FMU is which of the part that the test is made with.

A design asks for some by name (``parts["gyro.k"]``), an option of the system stands for others: these are proposed or,
as comments, left to be filled in.  Others of the part, whose values a report compares with what the test finds, are
proposed where names and units speak for them.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from gyrobench import units
from gyrobench.component.component import Component
from gyrobench.errors import GyrobenchError
from gyrobench.system.connectors import Connector
from gyrobench.system.fmu_variables import Variable, variables
from gyrobench.system.mapping_proposal import ENOUGH, SAME_DIMENSION, likeness
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import System


@dataclass(frozen=True)
class WantedParameter:
    """A parameter of the part that a slot is made with.  needed: the design asks for it, or an option has its name."""

    connector: Connector
    start: float
    part: str
    needed: bool


class _Asked(PartValues):
    """Values of the parts that the system is made with; keeps the names that were asked for."""

    def __init__(self, system: System) -> None:
        super().__init__(system)
        self.names: set[str] = set()

    def __contains__(self, name: str) -> bool:
        return False  # what a design takes only where it is there is not needed

    def __getitem__(self, name: str) -> Any:
        self.names.add(name)
        return super().__getitem__(name)

    def get(self, name: str, default: Any) -> Any:
        self.names.add(name)
        return super().get(name, default)


def wanted_parameters(system: System, slot: str, part: type[Component]) -> list[WantedParameter]:
    """Return the real scalar parameters of the part that a slot is made with, those that the design asks for first."""
    asked = _Asked(system)
    try:
        system.parameters(asked)
        for factor in system.factors.values():
            if callable(factor):
                factor(asked)
    except GyrobenchError:
        pass  # a design that cannot be made of the default values: what it asked for until then
    found = [
        WantedParameter(
            Connector(s.name, "parameter", s.decl.unit, s.decl.doc),
            s.start,
            system.all_slots()[slot].part,
            f"{slot}.{s.name}" in asked.names or s.name in system.options,
        )
        for s in part.layout
        if s.section == "parameter" and s.decl.type is float and not s.decl.shape
    ]
    return sorted(found, key=lambda w: not w.needed)


def _line(w: WantedParameter, v: Variable) -> str:
    wanted = w.connector.unit
    fields, said = [f'name = "{v.name}"'], [w.connector.meaning]
    if v.unit:
        said.append(f"in {v.unit}, as the FMU declares")
    elif wanted not in ("", "1"):
        fields.append(f'unit = "{wanted}"')
        others = [u for u in units.fitting(wanted)[1:] if u != wanted]
        said.append(", ".join(["the FMU declares no unit: check it", *others[:3]]))
    return f"{w.connector.name} = {{ {', '.join(fields)} }}  # {'; '.join(said)}"


def parameter_lines(description: Any, wanted: Sequence[WantedParameter]) -> list[str]:
    """Return the lines of [parameters]; none where nothing is proposed or needed.

    Where the FMU has a parameter of the wanted name, that is the one, and it stands for no other.  A unit per
    acceleration fits no coefficient, which is per g0 to a power that only its name tells.
    """
    declared = {u.name: u for u in description.unitDefinitions}
    own = {n: v for n, v in variables(description).items() if v.causality == "parameter"}
    lacking = [w for w in wanted if w.connector.name not in own]
    names = {w.connector.name for w in wanted}
    free = [v for n, v in own.items() if v.kind == "Real" and not v.size and n not in names]
    offers = [
        ((w.needed, likeness(w.connector, [v], declared), -order), w, v)
        for (order, w), v in itertools.product(enumerate(lacking), free)
        if w.connector.unit != "1" or v.unit in ("", "1")  # an angle is no ratio
        if w.needed or _speaks_of(v.name, w.connector.name, names)
    ]
    taken: dict[str, Variable] = {}
    for (_, score, _), w, v in sorted(offers, key=lambda o: o[0], reverse=True):
        enough = ENOUGH if w.needed else ENOUGH + (SAME_DIMENSION if v.unit else 1.0)
        if score >= enough and w.connector.name not in taken and v not in taken.values():
            taken[w.connector.name] = v
    lines = [_line(w, taken[w.connector.name]) for w in lacking if w.connector.name in taken]
    lines += [_left_open(w) for w in lacking if w.needed and w.connector.name not in taken]
    return ["[parameters]", *lines] if lines else []


def _speaks_of(variable: str, name: str, names: set[str]) -> bool:
    """Return whether a variable may be a parameter that says something of another one, as k_T does of k: only with the
    suffix in its name; a k_torquer is k.
    """
    other, _, suffix = name.partition("_")
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", variable).lower().split("_")
    return not suffix or other not in names or suffix.lower() in words


def _left_open(w: WantedParameter) -> str:
    unit = f', unit = "{w.connector.unit}"' if w.connector.unit not in ("", "1") else ""
    return (
        f"# {w.connector.name} = {{ value = {w.start!r}{unit} }}  # {w.connector.meaning}: the test needs it; "
        f'name = "..." of the FMU, or its value ({w.start:g} is that of {w.part})'
    )
