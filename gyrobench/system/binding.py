"""Fits an FMU into a socket: which of its variables is which connector, in which unit.

An FMU whose variables have the socket's names and SI units needs no mapping.  Another one comes with a
mapping file (TOML): one table for each connector whose name or unit differs,

    [u]                        # connector of the socket
    name = "pickoff_mV"        # the FMU's variable; an array: names = ["wx", "wy", "wz"]
    unit = "mV"                # optional where the FMU declares a unit that can be understood
    factor = -1                # optional: connector = factor * variable (after the unit conversion)

    [parameters.step]          # parameters that the system sets, in the same way
    name = "dt"
    unit = "ms"

    [parameters.k]             # a value that the FMU has but does not offer as a parameter: designs follow it
    value = 17.2
    unit = "deg/h/mA"

A misfit is refused before anything runs, with every missing or wrong connector and what would fit.
"""

from __future__ import annotations

import difflib
import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any

from gyrobench import units
from gyrobench.errors import GyrobenchError
from gyrobench.system.connectors import QUANTITIES
from gyrobench.system.sockets import Connector, Socket, element_names
from gyrobench.system.values import flatten

FMI_TYPES = {"Real": "Real", "Integer": "Integer", "Enumeration": "Integer", "Boolean": "Boolean"}


class SocketMismatchError(GyrobenchError):
    """An FMU does not fit its socket; ``problems`` is the list of single findings."""

    def __init__(self, head: str, problems: list[str]) -> None:
        self.problems = problems
        super().__init__("\n".join([head, *(f"  - {p}" for p in problems)]))


@dataclass(frozen=True)
class Bound:
    """One scalar variable of an FMU; connector value (SI) = ``gain`` * variable value."""

    element: str  # "omega[1]"
    variable: str
    reference: int
    kind: str  # "Real" | "Integer" | "Boolean"
    gain: float = 1.0
    unit: str = ""


@dataclass
class Binding:
    """All connectors of one FMU in its slot."""

    slot: str
    socket: Socket
    inputs: dict[str, Bound] = field(default_factory=dict)  # by element name
    outputs: dict[str, Bound] = field(default_factory=dict)
    parameters: dict[str, Bound] = field(default_factory=dict)
    constants: dict[str, Any] = field(default_factory=dict)  # values that the mapping file states, SI
    absent: list[str] = field(default_factory=list)  # optional connectors the FMU does not have
    warnings: list[str] = field(default_factory=list)


def load_mapping(file: Path | None) -> dict[str, Any]:
    """Reads a mapping file; None gives the empty mapping.  Raises SocketMismatchError when it is not readable."""
    if file is None:
        return {}
    try:
        return tomllib.loads(Path(file).read_text("utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise SocketMismatchError(f"mapping file {file}", [str(error)]) from None


class _Fitter:
    def __init__(self, slot: str, socket: Socket, description: Any, mapping: Mapping[str, Any]) -> None:
        self.binding = Binding(slot, socket)
        self.socket, self.mapping = socket, mapping
        self.variables = {v.name: v for v in description.modelVariables}
        self.units = {u.name: u for u in description.unitDefinitions}
        self.problems: list[str] = []

    # ------------------------------------------------------------------------------ units
    def understood(self, name: str) -> tuple[tuple[Fraction, ...], float, float] | None:
        """Exponents, factor and offset of a unit name of the FMU; None when it cannot be understood."""
        definition = self.units.get(name)
        if definition is not None and definition.baseUnit is not None:
            b = definition.baseUnit
            exponents = tuple(Fraction(int(getattr(b, s) or 0)) for s in units.BASE)
            return exponents, float(b.factor), float(b.offset)
        try:
            u = units.unit(name)
        except units.UnitError:
            return None
        return u.exponents, u.factor, u.offset

    def gain(self, element: str, wanted: str, variable: Any, entry: Mapping[str, Any]) -> tuple[float, str] | None:
        """(gain, unit name) of one variable, or None after noting a problem."""
        factor = float(entry.get("factor", 1.0))
        if not math.isfinite(factor) or factor == 0.0:
            self.problems.append(f"{element}: factor {factor} in the mapping: must be finite and not 0")
            return None
        declared = variable.unit or (variable.declaredType.unit if variable.declaredType is not None else None)
        name = str(entry.get("unit") or declared or "")
        if not wanted:
            return factor, name
        target = units.unit(wanted)
        if not name:
            if wanted != "1" and FMI_TYPES.get(variable.type) == "Real":
                self.binding.warnings.append(f"{element}: variable {variable.name} declares no unit; taken as {wanted}")
            return factor, wanted
        fits = ", ".join(units.fitting(wanted)[:6])
        known = self.understood(name)
        if known is None:
            self.problems.append(f"{element}: unit '{name}' of {variable.name} is not known and has no BaseUnit; "
                                 f'give unit = "..." in the mapping ({fits})')  # fmt: skip
            return None
        exponents, scale, offset = known
        if exponents != target.exponents:
            if exponents[:-1] != target.exponents[:-1] or "Hz" in name:
                self.problems.append(f"{element}: wrong unit: {variable.name} is in {name}, the socket needs {wanted} "
                                     f"or another unit of that dimension ({fits})")  # fmt: skip
                return None
            self.binding.warnings.append(
                f"{element}: {variable.name} is in {name}, which has no rad; taken as {wanted}"
            )
        if offset or target.offset:
            self.problems.append(f"{element}: unit {name} has an offset and cannot be connected by a factor")
            return None
        return factor * (scale / target.factor), name

    # ------------------------------------------------------------------------------ names
    def entry(self, name: str, element: str, index: int, mapping: Mapping[str, Any]) -> tuple[str, Mapping[str, Any]]:
        """Variable name and mapping entry of one element."""
        entry = mapping.get(element, mapping.get(name, {}))
        if isinstance(entry, str):
            entry = {"name": entry}
        if not isinstance(entry, Mapping) or not set(entry) <= {"name", "names", "unit", "factor"}:
            self.problems.append(f"{element}: mapping entry must be a table with name or names, unit, factor")
            return element, {}
        if "names" in entry:
            names = entry["names"]
            if index >= len(names):
                self.problems.append(f"{element}: the mapping lists only {len(names)} names for {name}")
                return element, entry
            return str(names[index]), entry
        if "name" in entry:
            suffix = "" if element in mapping else element[len(name) :]
            return str(entry["name"]) + suffix, entry
        return element, entry

    def would_fit(self, name: str, connector: Connector) -> str:
        """Which free variables of the FMU could be meant."""
        used = {b.variable for b in (*self.binding.inputs.values(), *self.binding.outputs.values())}
        free = {n: v for n, v in self.variables.items() if v.causality == connector.causality and n not in used}
        hints = []
        near = difflib.get_close_matches(name, free, n=3, cutoff=0.5)
        if near:
            hints.append(f"nearest names: {', '.join(near)}")
        if connector.unit:
            target = units.unit(connector.unit).exponents
            same = []
            for n, v in free.items():
                known = self.understood(v.unit) if v.unit else None
                if known and known[0] == target:
                    same.append(f"{n} [{v.unit}]")
            if same:
                hints.append(f"{connector.causality}s of the same dimension: {', '.join(same[:6])}")
        if not hints:
            hints.append(f"its {connector.causality}s are: {', '.join(list(free)[:8]) or 'none'}")
        return "; ".join(hints)

    def fit_connector(self, c: Connector) -> None:
        mapped = c.name in self.mapping or any(e in self.mapping for e in c.elements)
        names = [self.entry(c.name, e, k, self.mapping) for k, e in enumerate(c.elements)]
        if c.optional and not mapped and not any(n in self.variables for n, _ in names):
            self.binding.absent.append(c.name)
            return
        for element, (name, entry) in zip(c.elements, names, strict=True):
            variable = self.variables.get(name)
            what = f"{c.causality}, {c.unit or 'any unit'}: {c.meaning}"
            if variable is None:
                self.problems.append(f"{element}: missing ({what}); no variable '{name}'; {self.would_fit(name, c)}")
                continue
            if variable.causality != c.causality:
                was = f"{name} is {variable.causality}, must be {c.causality}"
                self.problems.append(f"{element}: wrong causality: {was}; {self.would_fit(name, c)}")
                continue
            kind = FMI_TYPES.get(variable.type, "")
            allowed = ("Real", "Integer", "Boolean") if c.whole else ("Real",)
            if kind not in allowed or variable.dimensions:
                shape = " array" if variable.dimensions else ""
                self.problems.append(
                    f"{element}: wrong type: {name} is {variable.type}{shape}, must be {' or '.join(allowed)}"
                )
                continue
            given = str(variable.quantity or getattr(variable.declaredType, "quantity", None) or "").lower()
            if c.quantity and given in QUANTITIES and given != c.quantity:
                self.problems.append(
                    f"{element}: wrong quantity: {name} is for {QUANTITIES[given]}, here the {c.meaning} stands for "
                    f"{QUANTITIES[c.quantity]}"
                )
                continue
            found = self.gain(element, c.unit, variable, entry)
            if found is not None:
                ports = self.binding.inputs if c.causality == "input" else self.binding.outputs
                ports[element] = Bound(element, name, int(variable.valueReference), kind, *found)

    def fit_extras(self) -> None:
        """Inputs and outputs beyond the socket, under their own names and in SI."""
        used = {b.variable for b in (*self.binding.inputs.values(), *self.binding.outputs.values())}
        for name, v in self.variables.items():
            kind = FMI_TYPES.get(v.type)
            if v.causality in ("input", "output") and kind and name not in used and not v.dimensions:
                known = self.understood(v.unit) if v.unit else None
                gain = known[1] if known and not known[2] else 1.0
                ports = self.binding.inputs if v.causality == "input" else self.binding.outputs
                ports.setdefault(name, Bound(name, name, int(v.valueReference), kind, gain, v.unit or ""))

    def fit_constant(self, name: str, entry: Mapping[str, Any]) -> None:
        """Note a value that the mapping file states, a number or nested lists of numbers."""
        known = self.understood(str(entry.get("unit", "1")))
        values = flatten(name, entry["value"])
        if known is None or known[2]:
            self.problems.append(f"parameters.{name}: unit '{entry['unit']}' has no factor to SI")
        elif not all(isinstance(x, int | float) and math.isfinite(x) for x in values.values()):
            self.problems.append(f"parameters.{name}: value {entry['value']}: must be a number or a list of numbers")
        else:
            self.binding.constants.update({e: x * known[1] for e, x in values.items()})

    def fit_parameters(self) -> None:
        given = self.mapping.get("parameters", {})
        mapped = set()
        for ours, entry in given.items():
            if isinstance(entry, str):
                entry = {"name": entry}
            if "value" in entry:
                self.fit_constant(ours, entry)
                continue
            theirs = entry.get("names") or [entry.get("name", ours)]
            elements = element_names(ours, (len(theirs),)) if "names" in entry else [ours]
            for element, name in zip(elements, theirs, strict=True):
                v = self.variables.get(name)
                if v is None or v.causality != "parameter":
                    free = [n for n, x in self.variables.items() if x.causality == "parameter"]
                    near = difflib.get_close_matches(name, free, n=3) or free[:6]
                    self.problems.append(f"parameters.{ours}: no parameter '{name}'; nearest: {', '.join(near)}")
                    continue
                unit = entry.get("unit") or v.unit or ""
                known = self.understood(unit) if unit else (None, 1.0, 0.0)
                if known is None or known[2]:
                    self.problems.append(f"parameters.{ours}: unit '{unit}' has no factor to SI")
                    continue
                gain = float(entry.get("factor", 1.0)) * known[1]
                self.binding.parameters[element] = Bound(
                    element, name, int(v.valueReference), FMI_TYPES[v.type], gain, unit
                )
                mapped.add(name)
        for name, v in self.variables.items():
            if v.causality == "parameter" and name not in mapped and v.type in (*FMI_TYPES, "String"):
                known = self.understood(v.unit) if v.unit else None
                gain = known[1] if known and not known[2] else 1.0
                kind = FMI_TYPES.get(v.type, "String")
                self.binding.parameters.setdefault(
                    name, Bound(name, name, int(v.valueReference), kind, gain, v.unit or "")
                )


def fit(socket: Socket, description: Any, mapping: Mapping[str, Any] | None = None, slot: str = "") -> Binding:
    """Binds the variables of an FMU (FMPy model description) to the connectors of ``socket``.

    Raises :class:`SocketMismatchError` naming every missing or wrong connector and what would fit.  Parameters
    and further inputs and outputs of the FMU are bound under their own names, converted to SI by their
    declared units.
    """
    fitter = _Fitter(slot or socket.name, socket, description, mapping or {})
    for key in fitter.mapping:
        name = key.split("[")[0]
        if name != "parameters" and socket.connector(name) is None:
            near = difflib.get_close_matches(name, [c.name for c in socket.connectors], n=3, cutoff=0.4)
            hint = ", ".join(near) or ", ".join(c.name for c in socket.connectors)
            fitter.problems.append(f"mapping entry [{key}]: socket {socket.name} has no such connector; meant: {hint}?")
    for connector in socket.connectors:
        fitter.fit_connector(connector)
    fitter.fit_extras()
    fitter.fit_parameters()
    if fitter.problems:
        where = f"slot {slot}: " if slot else ""
        raise SocketMismatchError(
            f"{where}FMU '{description.modelName}' does not fit socket {socket.name}", fitter.problems
        )
    return fitter.binding
