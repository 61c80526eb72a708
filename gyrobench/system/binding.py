"""Fits an FMU into a socket: which of its variables is which connector, in which unit.

An FMU whose variables have the socket's names and SI units needs no mapping.  Another one comes with a
mapping file (TOML): one table for each connector whose name or unit differs,

    [u]                        # connector of the socket
    name = "pickoff_mV"        # the FMU's variable; an array: names = ["wx", "wy", "wz"]
    unit = "mV"                # optional where the FMU declares a unit that can be understood
    factor = -1                # optional: connector = factor * variable + offset, in SI; the unit is converted first
    offset = "20mV"            # optional: a number in SI, or a text with its unit
    feedthrough = false        # an output: it follows no input within a step.  An input: no output follows it so
    delay = 1                  # its wires carry the value of the previous communication step

    [saturated]
    constant = 0               # an output that the FMU does not have.  With a name, an input: the FMU keeps this value;
                               # without one: the FMU has no such input and behaves as if it had this value

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
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from gyrobench import units
from gyrobench.errors import GyrobenchError
from gyrobench.system.connectors import QUANTITIES
from gyrobench.system.fmu_variables import Variable, variables
from gyrobench.system.mapping_proposal import propose
from gyrobench.system.sockets import Connector, Socket, element_names
from gyrobench.system.values import InvalidValueError, flatten, parse_number

NUMBERS = ("Real", "Integer", "Boolean")
KEYS_SHOWN = ("name or names", "unit", "factor", "offset", "constant", "feedthrough", "delay")
KEYS = {"name", "names", *KEYS_SHOWN[1:]}


class SocketMismatchError(GyrobenchError):
    """An FMU does not fit its socket; ``problems`` is the list of single findings, ``proposal`` lines of a mapping."""

    def __init__(self, head: str, problems: list[str], proposal: Sequence[str] = ()) -> None:
        self.problems, self.proposal = problems, list(proposal)
        lines = ["mapping lines that may fit (check units, signs and axes):", *(f"    {x}" for x in proposal)]
        super().__init__("\n".join([head, *(f"  - {p}" for p in problems), *(lines if proposal else [])]))


@dataclass(frozen=True)
class Bound:
    """One scalar variable of an FMU; connector value (SI) = ``gain`` * variable value + ``offset``.

    constant: the value of an output that the FMU does not have; ``reference`` is then -1.
    """

    element: str  # "omega[1]"
    variable: str
    reference: int
    kind: str  # "Real" | "Integer" | "Boolean" | "String"
    gain: float = 1.0
    unit: str = ""
    type: str = "Real"  # as the FMU declares it: that of the calls that get and set it
    index: int = 0  # place in an array
    size: int = 0  # elements of the array, 0: a scalar
    offset: float = 0.0
    constant: float | None = None

    def si(self, value: Any) -> Any:
        """Return a value of the variable as the connector's."""
        if self.kind != "Real" or (self.gain == 1.0 and self.offset == 0.0):
            return value
        return value * self.gain + self.offset if self.offset else value * self.gain

    def own(self, value: Any) -> Any:
        """Return a value of the connector as the variable's."""
        if self.kind != "Real" or (self.gain == 1.0 and self.offset == 0.0):
            return value
        return (value - self.offset) / self.gain


@dataclass
class Binding:
    """All connectors of one FMU in its slot."""

    slot: str
    socket: Socket
    variables: dict[str, Variable]  # all that the FMU has
    inputs: dict[str, Bound] = field(default_factory=dict)  # by element name
    outputs: dict[str, Bound] = field(default_factory=dict)
    parameters: dict[str, Bound] = field(default_factory=dict)
    constants: dict[str, Any] = field(default_factory=dict)  # values that the mapping file states, SI
    absent: list[str] = field(default_factory=list)  # optional connectors the FMU does not have
    held: dict[str, list[tuple[Bound, Any]]] = field(default_factory=dict)  # inputs at a constant: name -> SI values
    no_feedthrough: set[str] = field(default_factory=set)  # variables without it, by the mapping file
    delayed: set[str] = field(default_factory=set)  # elements whose wires carry the value of the previous step
    warnings: list[str] = field(default_factory=list)


def _bound(element: str, v: Variable, gain: float, unit: str, offset: float = 0.0) -> Bound:
    return Bound(element, v.name, v.reference, v.kind, gain, unit, v.type, v.index, v.size, offset)


class _Fitter:
    def __init__(self, slot: str, socket: Socket, description: Any, mapping: Mapping[str, Any]) -> None:
        self.variables = variables(description)
        self.binding = Binding(slot, socket, self.variables)
        self.socket, self.mapping = socket, mapping
        self.units = {u.name: u for u in description.unitDefinitions}
        self.known: dict[str, tuple[tuple[Fraction, ...], float, float] | None] = {}  # units, as far as asked for
        self.problems: list[str] = []

    # ------------------------------------------------------------------------------ units
    def understood(self, name: str) -> tuple[tuple[Fraction, ...], float, float] | None:
        """Exponents, factor and offset of a unit name of the FMU; None when it cannot be understood."""
        if name not in self.known:
            self.known[name] = self._read_unit(name)
        return self.known[name]

    def _read_unit(self, name: str) -> tuple[tuple[Fraction, ...], float, float] | None:
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

    def gain(
        self, element: str, wanted: str, variable: Variable, entry: Mapping[str, Any]
    ) -> tuple[float, str, float] | None:
        """(gain, unit name, offset) of one variable, or None after noting a problem."""
        factor = self.number(element, "factor", entry, "1", 1.0)
        offset = self.number(element, "offset", entry, wanted, 0.0)
        if factor is None or offset is None:
            return None
        if factor == 0.0:
            self.problems.append(f"{element}: factor {factor} in the mapping: must be finite and not 0")
            return None
        name = str(entry.get("unit") or variable.unit)
        if not wanted:
            return factor, name, offset
        target = units.unit(wanted)
        if not name:
            if wanted != "1" and variable.kind == "Real":
                self.binding.warnings.append(f"{element}: variable {variable.name} declares no unit; taken as {wanted}")
            return factor, wanted, offset
        fits = ", ".join(units.fitting(wanted)[:6])
        known = self.understood(name)
        if known is None:
            self.problems.append(f"{element}: unit '{name}' of {variable.name} is not known and has no BaseUnit; "
                                 f'give unit = "..." in the mapping ({fits})')  # fmt: skip
            return None
        exponents, scale, zero = known
        if exponents != target.exponents:
            if exponents[:-1] != target.exponents[:-1] or "Hz" in name:
                self.problems.append(f"{element}: wrong unit: {variable.name} is in {name}, the socket needs {wanted} "
                                     f"or another unit of that dimension ({fits})")  # fmt: skip
                return None
            self.binding.warnings.append(
                f"{element}: {variable.name} is in {name}, which has no rad; taken as {wanted}"
            )
        gain = scale / target.factor
        return factor * gain, name, factor * (zero / target.factor) + offset

    def number(self, element: str, key: str, entry: Mapping[str, Any], unit: str, default: float) -> float | None:
        """Return a number of a mapping entry in SI, or None after noting a problem."""
        try:
            return parse_number(f"{key}", entry.get(key, default), unit or "1")
        except (InvalidValueError, TypeError) as error:
            self.problems.append(f"{element}: in the mapping: {error}")
            return None

    # ------------------------------------------------------------------------------ names
    def entry(self, name: str, element: str, index: int, mapping: Mapping[str, Any]) -> tuple[str, Mapping[str, Any]]:
        """Variable name and mapping entry of one element."""
        entry = mapping.get(element, mapping.get(name, {}))
        if isinstance(entry, str):
            entry = {"name": entry}
        if not isinstance(entry, Mapping) or not set(entry) <= KEYS:
            self.problems.append(f"{element}: mapping entry must be a table with {', '.join(KEYS_SHOWN)}")
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
        """Return the free variables of the FMU that could be meant."""
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
        if any("constant" in entry for _, entry in names):
            self.fit_constant_connector(c, names)
            return
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
            allowed = NUMBERS if c.whole else ("Real",)
            if variable.kind not in allowed:
                self.problems.append(
                    f"{element}: wrong type: {name} is {variable.type}, must be {' or '.join(allowed)}"
                )
                continue
            given = variable.quantity.lower()
            if c.quantity and given in QUANTITIES and given != c.quantity:
                self.problems.append(
                    f"{element}: wrong quantity: {name} is for {QUANTITIES[given]}, here the {c.meaning} stands for "
                    f"{QUANTITIES[c.quantity]}"
                )
                continue
            found = self.gain(element, c.unit, variable, entry)
            if found is not None:
                ports = self.binding.inputs if c.causality == "input" else self.binding.outputs
                ports[element] = _bound(element, variable, *found)
                self.fit_timing(element, name, entry)

    def fit_timing(self, element: str, variable: str, entry: Mapping[str, Any]) -> None:
        """Note feedthrough and delay of a mapping entry."""
        if "feedthrough" in entry:
            if entry["feedthrough"] is not False:
                self.problems.append(
                    f"{element}: feedthrough = {entry['feedthrough']} in the mapping: false is the only value; without "
                    "it the dependencies hold that the FMU declares"
                )
            self.binding.no_feedthrough.add(variable)
        if "delay" in entry:
            if entry["delay"] != 1 or isinstance(entry["delay"], bool):
                self.problems.append(
                    f"{element}: delay = {entry['delay']} in the mapping: 1 is the only value, one communication step"
                )
            self.binding.delayed.add(element)

    def fit_constant_connector(self, c: Connector, names: list[tuple[str, Mapping[str, Any]]]) -> None:
        """Note a connector with a constant: an output that the FMU lacks, an input at a fixed value or lacking."""
        held: list[tuple[Bound, Any]] = []
        for k, (element, (name, entry)) in enumerate(zip(c.elements, names, strict=True)):
            if set(entry) & {"feedthrough", "delay", "factor", "offset"} or "constant" not in entry:
                self.problems.append(f"{element}: a constant in the mapping goes with name and unit only")
                return
            given = list(flatten("", entry["constant"]).values())
            if len(given) not in (1, len(c.elements)):
                self.problems.append(f"{element}: {len(given)} constants in the mapping for {len(c.elements)} elements")
                return
            one = {"constant": given[0] if len(given) == 1 else given[k]}
            unit = entry.get("unit")
            if unit is not None and not isinstance(one["constant"], str):
                one["constant"] = f"{one['constant']!r}{unit}"
            value = self.number(element, "constant", one, c.unit, 0.0)
            if value is None:
                return
            variable = self.variables.get(name) if set(entry) & {"name", "names"} else None
            if c.causality == "output":
                if variable is not None:
                    self.problems.append(f"{element}: either constant or the FMU's output {name}, not both")
                self.binding.outputs[element] = Bound(element, "", -1, "Real", unit=c.unit, constant=value)
            elif variable is not None:
                own = {key: v for key, v in entry.items() if key == "unit"} if c.unit else {}
                found = self.gain(element, c.unit, variable, own)
                if variable.causality != "input" or variable.kind not in NUMBERS:
                    self.problems.append(f"{element}: {name} is {variable.causality}, must be input")
                elif found is not None:
                    kind = {"Integer": int, "Boolean": bool}.get(variable.kind, float)
                    held.append((_bound(element, variable, *found), kind(value)))
            elif set(entry) & {"name", "names"}:
                self.problems.append(f"{element}: missing: no variable '{name}'; {self.would_fit(name, c)}")
        if c.causality == "input":
            self.binding.held[c.name] = held

    def fit_extras(self) -> None:
        """Inputs and outputs beyond the socket, under their own names and in SI."""
        used = {b.variable for b in (*self.binding.inputs.values(), *self.binding.outputs.values())}
        used |= {b.variable for held in self.binding.held.values() for b, _ in held}
        for name, v in self.variables.items():
            if v.causality in ("input", "output") and v.kind in NUMBERS and name not in used:
                ports = self.binding.inputs if v.causality == "input" else self.binding.outputs
                ports.setdefault(name, _bound(name, v, self.own_gain(v), v.unit))

    def own_gain(self, v: Variable) -> float:
        """Factor to SI by the declared unit of a variable."""
        known = self.understood(v.unit) if v.unit else None
        return known[1] if known and not known[2] else 1.0

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
                unit = entry.get("unit") or v.unit
                known = self.understood(unit) if unit else (None, 1.0, 0.0)
                if known is None or known[2]:
                    self.problems.append(f"parameters.{ours}: unit '{unit}' has no factor to SI")
                    continue
                gain = float(entry.get("factor", 1.0)) * known[1]
                self.binding.parameters[element] = _bound(element, v, gain, unit)
                mapped.add(name)
        for name, v in self.variables.items():
            if v.causality == "parameter" and name not in mapped and v.kind:
                self.binding.parameters.setdefault(name, _bound(name, v, self.own_gain(v), v.unit))


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
        lines = [x for p in propose(socket, description, fitter.mapping) if p.found for x in p.lines]
        head = f"{where}FMU '{description.modelName}' does not fit socket {socket.name}"
        raise SocketMismatchError(head, fitter.problems, lines)
    return fitter.binding
