"""The structure of an SSP archive, flattened: components, connections with factor and offset, what sets which value.

Of what an archive holds, ``problems`` lists what is not read and ``notes`` what has no effect.
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import unquote
from xml.etree import ElementTree as ET

from gyrobench.exchange.gains import is_gain
from gyrobench.exchange.ssp_values import NS, ArchiveError, SspValue, Units, as_kind, transformation
from gyrobench.system.binding import Binding, Bound, fit
from gyrobench.system.fmu_variables import read_description
from gyrobench.system.sockets import Socket

ANY = Socket("FMU", "any FMU: its own inputs and outputs", ())
FMU = "application/x-fmu-sharedlibrary"


Place = tuple[str, ...]  # names of the systems and the component, from the outermost
Node = tuple[Place, str]  # connector of a component or of a system


def _described(file: Path) -> Any:
    """Return the description of an FMU.  Raises ArchiveError."""
    try:
        return read_description(file)
    except Exception as error:  # of the zip archive, of the XML, or FMPy's own
        raise ArchiveError(f"{file.name} is not a readable FMU: {error}") from None


@dataclass(frozen=True)
class Feed:
    """Source of a connector's value: value = factor * (value of ``source``) + offset; unit: of the result."""

    source: Node
    factor: float
    offset: float
    unit: str


@dataclass
class _Link:
    start: Node
    factor: float
    offset: float
    convert: bool
    text: str


@dataclass
class Structure:
    """The flattened archive."""

    folder: Path
    units: Units
    slots: dict[Place, str] = field(default_factory=dict)
    files: dict[str, Path] = field(default_factory=dict)
    bindings: dict[Place, Binding] = field(default_factory=dict)
    connector_units: dict[Node, str] = field(default_factory=dict)
    systems: set[Place] = field(default_factory=set)
    system_connectors: dict[Node, str] = field(default_factory=dict)  # -> kind
    links: dict[Node, _Link] = field(default_factory=dict)
    bound: list[tuple[Place, ET.Element]] = field(default_factory=list)  # outer ones last
    factors: set[str] = field(default_factory=set)  # components that stand for factors of connections, by the bench
    gains: dict[Place, dict[str, float]] = field(default_factory=dict)  # of these: the values of factor and offset
    refused: set[Place] = field(default_factory=set)  # components that are not read
    problems: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    # ------------------------------------------------------------------ reading
    def walk(self, element: ET.Element, place: Place) -> None:
        """Read a system and what is in it."""
        self.systems.add(place)
        self.connectors(element, place)
        for child in element.findall("ssd:Elements/*", NS):
            kind, name = child.tag.rpartition("}")[2], child.get("name", "")
            if kind == "System":
                self.walk(child, (*place, name))
            elif kind == "Component":
                self.component(child, (*place, name))
            else:
                self.problems.append(f"'{name}': a {kind} is not read")
        for connection in element.findall("ssd:Connections/ssd:Connection", NS):
            self.connection(connection, place)
        self.bound.append((place, element))

    def connectors(self, element: ET.Element, place: Place) -> None:
        for c in element.findall("ssd:Connectors/ssd:Connector", NS):
            node = place, c.get("name", "")
            kind = next((k for k in c if k.tag.startswith("{" + NS["ssc"])), None)
            unit = kind.get("unit", "") if kind is not None else ""
            if unit:
                self.connector_units[node] = unit
            if place in self.systems:
                self.system_connectors[node] = c.get("kind", "")

    def component(self, element: ET.Element, place: Place) -> None:
        where = ".".join(place)
        try:
            file = self.fmu(element)
            description = _described(file)
        except ArchiveError as error:
            self.refused.add(place)
            self.problems.append(f"component '{where}': {error}")
            return
        slot = "_".join(place).replace(".", "_")
        while slot in self.files:
            slot += "_"
        self.bindings[place] = fit(ANY, description, None, slot)
        if len(place) == 1 and place[0] in self.factors and is_gain(description):
            self.gains[place] = {"factor": 1.0, "offset": 0.0}
        else:
            self.slots[place], self.files[slot] = slot, file
        self.connectors(element, place)
        self.bound.append((place, element))

    def fmu(self, element: ET.Element) -> Path:
        """Return the file of a component.  Raises ArchiveError."""
        source = element.get("source", "")
        if element.get("type", FMU) != FMU:
            raise ArchiveError(f"{element.get('type')} is not read, only FMUs are")
        if element.get("implementation") == "ModelExchange":
            raise ArchiveError("it is to run as model exchange; the bench runs co-simulation")
        file = (self.folder / unquote(source)).resolve()
        if not file.is_relative_to(self.folder.resolve()) or not file.is_file():
            raise ArchiveError(f"no file {source}")
        return file

    def connection(self, c: ET.Element, place: Place) -> None:
        a, x, b, y = (c.get(n, "") for n in ("startElement", "startConnector", "endElement", "endConnector"))
        start, end = ((*place, a) if a else place, x), ((*place, b) if b else place, y)
        if start[0] in self.refused or end[0] in self.refused:
            return
        unknown = [n for n in (start, end) if not self.exists(n)]
        if not unknown and self.gives(end, place) and not self.gives(start, place):
            start, end = end, start  # to the standard, the names say nothing of the direction
        text = " -> ".join(".".join((*n[0], n[1])) for n in (start, end))
        if unknown:
            names = ", ".join(".".join((*n[0], n[1])) for n in unknown)
            self.problems.append(f"{text}: no such output or input: {names}")
            return
        if c.get("startIndices") or c.get("endIndices"):
            self.problems.append(f"{text}: elements of arrays are not connected by indices")
            return
        if end in self.links:
            self.problems.append(f"{text}: it is fed by {self.links[end].text} already")
            return
        convert = c.get("suppressUnitConversion") != "true"
        try:
            factor, offset = transformation(c)
        except ArchiveError as error:
            self.problems.append(f"{text}: {error}")
            return
        self.links[end] = _Link(start, factor, offset, convert, text)

    def exists(self, node: Node) -> bool:
        return node in self.system_connectors if node[0] in self.systems else self.variable(node) is not None

    def gives(self, node: Node, within: Place) -> bool:
        """Return whether a connector gives a value to the connections of a system, which may be its own."""
        if node[0] in self.systems:
            own = node[0] == within
            return self.system_connectors[node] in (("input", "parameter") if own else ("output",))
        return node[1] in self.bindings[node[0]].outputs

    def variable(self, node: Node) -> Bound | None:
        """Return the variable of a component's connector."""
        binding = self.bindings.get(node[0])
        if binding is None:
            return None
        name = node[1]
        return binding.inputs.get(name) or binding.outputs.get(name) or binding.parameters.get(name)

    # ------------------------------------------------------------------ values along connections
    def unit(self, node: Node) -> str:
        """Return the unit of a connector: the archive's, or the FMU's; "" where none is given."""
        given, bound = self.connector_units.get(node, ""), self.variable(node)
        own = bound.unit if bound is not None else ""
        if given and own and given != own and self.units.convert(given, own) != (1.0, 0.0):
            raise ArchiveError(f"{'.'.join((*node[0], node[1]))}: the archive says {given}, its FMU {own}")
        return given or own

    def feed(self, node: Node, seen: tuple[Node, ...] = ()) -> Feed:
        """Return where the value of a connector comes from.  Raises ArchiveError."""
        if node[0] in self.gains and node[1] == "y":
            into, gain = self.feed((node[0], "u"), seen), self.gains[node[0]]
            factor, offset = gain["factor"], gain["offset"]
            return Feed(into.source, factor * into.factor, factor * into.offset + offset, "")
        link = self.links.get(node)
        if link is None:
            return Feed(node, 1.0, 0.0, self.unit(node))
        if node in seen:
            raise ArchiveError(f"{link.text}: a loop of connectors without a component")
        before = self.feed(link.start, (*seen, node))
        unit = self.unit(node)
        try:
            factor, offset = self.units.convert(before.unit, unit) if link.convert else (1.0, 0.0)
        except ArchiveError as error:
            raise ArchiveError(f"{link.text}: {error}") from None
        # the transformation comes after the conversion, as of parameters [SSP 2.0, section 7.1.1]
        factor, offset = link.factor * factor, link.factor * offset + link.offset
        return Feed(before.source, factor * before.factor, factor * before.offset + offset, unit or before.unit)

    # ------------------------------------------------------------------ parameters
    def set_value(self, place: Place, name: str, value: SspValue, known: Units, raw: dict[str, Any]) -> None:
        """Set a parameter or start value, named from ``place``.  Raises ArchiveError."""
        targets = self.targets(place, name)
        if targets is None:
            self.notes.append(f"the value of {'.'.join((*place, name))} sets nothing: its connector feeds no component")
            return
        if not targets:
            near = difflib.get_close_matches(name, self.names(place), n=3, cutoff=0.4)
            hint = f"; nearest: {', '.join(near)}" if near else ""
            where = f" of {'.'.join(place)}" if place else ""
            raise ArchiveError(f"parameter '{name}'{where}: nothing has it{hint}")
        for node, feed in targets:
            bound = self.variable(node)
            assert bound is not None
            number = as_kind(name, value, bound.kind, self.unit(feed.source), known)
            if (feed.factor, feed.offset) != (1.0, 0.0):
                number = feed.factor * number + feed.offset
            if node[0] in self.gains:
                self.gains[node[0]][bound.variable] = number
                continue
            raw[f"{self.slots[node[0]]}.{bound.variable}"] = number

    def targets(self, place: Place, name: str) -> list[tuple[Node, Feed]] | None:
        """Return the variables that a name means, each with how the value gets there.

        None: it is a connector of a system that feeds nothing.
        """
        own = (place, name)
        if place in self.bindings:
            return [(own, Feed(own, 1.0, 0.0, ""))] if self.settable(own) else []
        for inner in (*self.bindings, *self.systems):
            relative = ".".join(inner[len(place) :]) + "." if len(inner) > len(place) else ""
            if inner[: len(place)] == place and relative and name.startswith(relative):
                node = (inner, name[len(relative) :])
                if self.settable(node):
                    return [(node, Feed(node, 1.0, 0.0, ""))]
                if node in self.system_connectors:
                    return self.reached(node) or None
        return (self.reached(own) or None) if own in self.system_connectors else []

    def settable(self, node: Node) -> bool:
        binding = self.bindings.get(node[0])
        return binding is not None and (node[1] in binding.parameters or node[1] in binding.inputs)

    def reached(self, connector: Node) -> list[tuple[Node, Feed]]:
        """Return the variables that a connector of a system feeds."""
        found = [(node, self.feed(node)) for node in self.links if node[0] in self.bindings and self.settable(node)]
        return [(node, feed) for node, feed in found if feed.source == connector]

    def names(self, place: Place) -> list[str]:
        """Return the names that a value bound to a system or component may have."""
        found = []
        for inner, binding in self.bindings.items():
            if inner[: len(place)] == place:
                head = "".join(f"{n}." for n in inner[len(place) :])
                found += [head + n for n in (*binding.parameters, *binding.inputs)]
        return found + [n for p, n in self.system_connectors if p == place]
