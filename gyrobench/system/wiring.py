"""Wires of a system resolved to scalar connections between the variables of its FMUs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from gyrobench import units
from gyrobench.system.binding import Binding, Bound, fit
from gyrobench.system.execution_order import AlgebraicLoopError, Cut, ExecutionOrder, Link, execution_order
from gyrobench.system.fmu_variables import feedthrough, read_description
from gyrobench.system.mapping_files import load_mapping
from gyrobench.system.part_values import PartValues
from gyrobench.system.sockets import socket
from gyrobench.system.system import System
from gyrobench.system.wire_text import WiringError, parse_wires


@dataclass(frozen=True)
class Connection:
    """One scalar connection: target variable = gain * source variable + offset.

    delayed: it carries the value of the previous communication step, by a mapping file.
    """

    source: str  # slot
    output: Bound
    target: str  # slot
    input: Bound
    gain: float
    wire: str
    offset: float = 0.0
    delayed: bool = False


@dataclass
class Assembly:
    """A system with an FMU in every slot, bound, wired and ordered."""

    system: System
    paths: dict[str, Path]
    descriptions: dict[str, Any]
    bindings: dict[str, Binding]
    connections: list[Connection]
    order: ExecutionOrder
    notes: list[str] = field(default_factory=list)
    keeps: set[str] = field(default_factory=set)  # slots with controllers of the user's own: the system sets no value

    def output(self, name: str) -> tuple[str, Bound]:
        """Slot and variable of "slot.output"; raises WiringError naming what the slot has."""
        slot, _, element = name.partition(".")
        if slot not in self.bindings:
            raise WiringError(self.system.name, [f"{name}: no slot '{slot}'; slots: {', '.join(self.bindings)}"])
        outputs = self.bindings[slot].outputs
        if element not in outputs:
            raise WiringError(self.system.name, [f"{name}: {slot} has no such output; outputs: {', '.join(outputs)}"])
        return slot, outputs[element]


def _gain(factor: float, out: Bound, inp: Bound) -> float:
    """Return the gain between the variables of a wire with this factor, SI to SI."""
    return factor if out.gain == inp.gain else factor * out.gain / inp.gain


def _offset(factor: float, out: Bound, inp: Bound, added: float) -> float:
    """Return the offset between the variables of a wire with this factor and this offset, SI to SI."""
    return (factor * out.offset + added - inp.offset) / inp.gain if out.offset or inp.offset or added else 0.0


def follow_factors(assembly: Assembly, system: System, parts: PartValues) -> None:
    """Set the gains of the wires whose factor follows the parts."""
    following = {wire: float(f(parts)) for wire, f in system.factors.items() if callable(f)}
    for k, c in enumerate(assembly.connections):
        if c.wire in following:
            ends = (following[c.wire], c.output, c.input)
            assembly.connections[k] = replace(
                c, gain=_gain(*ends), offset=_offset(*ends, system.offsets.get(c.wire, 0.0))
            )


def _elements(ports: Mapping[str, Bound], name: str) -> dict[str, Bound]:
    """Elements of a connector by their index text ("" for a scalar or a single element)."""
    if name in ports:
        return {"": ports[name]}
    return {e[len(name) :]: b for e, b in ports.items() if e.startswith(name + "[")}


class _Layer:
    def __init__(self, system: System, bindings: Mapping[str, Binding], usual: set[str]) -> None:
        self.system, self.bindings = system, bindings
        self.usual = usual  # slots that hold the part of the system itself
        self.problems: list[str] = []
        self.notes: list[str] = []
        self.connections: list[Connection] = []
        self.taken: dict[tuple[str, str], str] = {}

    def end(self, wire: str, slot: str, name: str, causality: str) -> dict[str, Bound] | None:
        """The elements at one end of a wire; None when the wire cannot be laid (noted)."""
        if slot not in self.bindings:
            self.problems.append(f"{wire}: no slot '{slot}'; slots: {', '.join(self.bindings)}")
            return None
        binding = self.bindings[slot]
        ports = binding.inputs if causality == "input" else binding.outputs
        found = _elements(ports, name)
        if found:
            return found
        if name.split("[")[0] in binding.held:
            self.notes.append(f"{wire}: {slot}.{name} is constant by the mapping file; not connected")
        elif name.split("[")[0] in binding.absent:
            if slot not in self.usual:  # the part the system is made with: its author knows
                self.notes.append(f"{wire}: {slot} has no '{name}' (optional); not connected")
        else:
            names = dict.fromkeys(e.split("[")[0] for e in ports)
            self.problems.append(f"{wire}: {slot} has no {causality} '{name}'; {causality}s: {', '.join(names)}")
        return None

    def dimension(self, slot: str, name: str) -> str:
        connector = self.bindings[slot].socket.connector(name.split("[")[0])
        return connector.unit if connector is not None else ""

    def lay(self, a: str, x: str, b: str, y: str) -> None:
        wire = f"{a}.{x} -> {b}.{y}"
        outputs, inputs = self.end(wire, a, x, "output"), self.end(wire, b, y, "input")
        if outputs is None or inputs is None:
            return
        if set(outputs) != set(inputs):
            self.problems.append(f"{wire}: {len(outputs)} elements meet {len(inputs)}: the shapes must be equal")
            return
        ua, ub = self.dimension(a, x), self.dimension(b, y)
        known = ua not in ("", "1") and ub not in ("", "1") and wire not in self.system.factors
        if known and not units.same_dimension(ua, ub):
            self.problems.append(f"{wire}: {ua} into {ub}: the dimensions differ, and the wire has no factor")
            return
        given = self.system.factors.get(wire, 1.0)  # may turn one quantity into another
        factor = 1.0 if callable(given) else given  # one that follows the parts comes with their values
        source = self.bindings[a].socket.connector(x.split("[")[0])
        whole = source is not None and source.whole
        for index, out in outputs.items():
            inp = inputs[index]
            gain = _gain(factor, out, inp)
            offset = _offset(factor, out, inp, self.system.offsets.get(wire, 0.0))
            if inp.kind != "Real" and (gain != 1.0 or offset or (out.kind == "Real" and not whole)):
                also = f" and offset {offset:g}" if offset else ""
                self.problems.append(
                    f"{wire}: {out.kind} with factor {gain:g}{also} into the {inp.kind} input {inp.variable}"
                )
            other = self.taken.setdefault((b, inp.element), wire)
            if other != wire:
                self.problems.append(f"{wire}: {b}.{inp.element} is already fed by {other}")
            delayed = out.element in self.bindings[a].delayed or inp.element in self.bindings[b].delayed
            self.connections.append(Connection(a, out, b, inp, gain, wire, offset, delayed))

    def unfed(self) -> None:
        for slot, binding in self.bindings.items():
            free = [
                c.name
                for c in binding.socket.connectors
                if c.causality == "input"
                and not c.optional
                and c.name not in binding.held
                and not any((slot, e) in self.taken for e in c.elements)
                and f"{slot}.{c.name}" not in self.system.open
            ]
            if free:
                self.notes.append(f"{slot}: not connected, at start values: {', '.join(free)}")


def assemble(system: System, paths: Mapping[str, Path], maps: Mapping[str, Path] | None = None) -> Assembly:
    """Reads the model descriptions, fits each FMU into its slot, lays the wires and finds the order.

    Coupled in parallel, a system has no algebraic loops, and its parts may stand in any order.
    Raises SocketMismatchError, WiringError, AlgebraicLoopError; nothing is loaded or run.
    """
    unchanged = {slot: s.part in (str(paths[slot]), paths[slot].stem) for slot, s in system.slots.items()}
    maps = {**{slot: file for slot, file in system.maps.items() if unchanged[slot]}, **(maps or {})}
    for what, given in (("part", paths), ("mapping", maps)):
        for slot in given:
            if slot not in system.slots:
                raise WiringError(system.name, [f"{what} for slot '{slot}': slots: {', '.join(system.slots)}"])
    descriptions, bindings = {}, {}
    for slot, declared in system.slots.items():
        d = read_description(Path(paths[slot]))
        if d.coSimulation is None or not d.fmiVersion.startswith(("2.", "3.")):
            what = "has no co-simulation interface" if d.coSimulation is None else f"is FMI {d.fmiVersion}"
            text = f"{slot}: {paths[slot]} {what}; the engines run FMI 2.0 and 3.0 co-simulation"
            raise WiringError(system.name, [text])
        descriptions[slot] = d
        bindings[slot] = fit(
            socket(declared.socket).standing_for(declared.quantities), d, load_mapping(maps.get(slot)), slot
        )
    layer = _Layer(system, bindings, {slot for slot, s in system.slots.items() if Path(paths[slot]).stem == s.part})
    for wire in parse_wires(system.wires):
        layer.lay(*wire)
    if layer.problems:
        raise WiringError(system.name, layer.problems)
    layer.unfed()
    parallel = system.coupling == "parallel"
    if parallel:
        layer.connections = [replace(c, delayed=c.output.constant is None) for c in layer.connections]
    for slot, binding in bindings.items():
        layer.notes += [f"{slot}: {w}" for w in binding.warnings]
    links = [
        Link((c.source, c.output.variable), (c.target, c.input.variable), c.wire)
        for c in layer.connections
        if not c.delayed and c.output.constant is None
    ]
    through = {slot: _stated_feedthrough(feedthrough(d), bindings[slot]) for slot, d in descriptions.items()}
    try:
        order = execution_order(list(system.slots), links, through)
    except AlgebraicLoopError as error:
        raise AlgebraicLoopError(error.loop, _remedy(error.loop, descriptions, bindings)) from None
    delays = dict.fromkeys(c.wire for c in layer.connections if c.delayed)
    why = "parallel coupling" if parallel else "stated in the mapping file"
    order = replace(order, cuts=(*order.cuts, *(Cut(wire, why) for wire in delays)))
    return Assembly(system, dict(paths), descriptions, bindings, layer.connections, order, layer.notes)


def _stated_feedthrough(declared: dict[str, set[str]], binding: Binding) -> dict[str, set[str]]:
    """Return the feedthrough of an FMU without what its mapping file excludes."""
    without = binding.no_feedthrough
    return {y: set() if y in without else xs - without for y, xs in declared.items()}


def _remedy(loop: list[tuple[str, str]], descriptions: Mapping[str, Any], bindings: Mapping[str, Binding]) -> str:
    """Return the lines of mapping files that open an algebraic loop, for the parts that declare no dependencies."""
    lines = []
    for slot, variable in loop:
        known = {u.variable.name for u in descriptions[slot].outputs if u.variable and u.dependencies is not None}
        found = next((b for b in bindings[slot].outputs.values() if b.variable == variable), None)
        if found is not None and variable.split("[")[0] not in known and variable not in known:
            name = found.element.split("[")[0]
            lines.append(
                f"{slot}: {variable} declares no dependencies; if it follows its inputs only with the next step, write "
                f"into the mapping file:\n    [{name}]\n    feedthrough = false"
            )
    if not lines:
        slot, variable = loop[0]
        found = next((b for b in bindings[slot].outputs.values() if b.variable == variable), None)
        name = found.element.split("[")[0] if found else variable
        lines.append(
            f"or delay one of its wires by a communication step, in the mapping file of {slot}:\n"
            f"    [{name}]\n    delay = 1"
        )
    lines.append("or couple all parts in parallel, each wire a communication step late: --coupling parallel")
    return "\n".join(lines)
