"""Import of an SSP 1.0 archive, of the bench or a third party, as a system: FMUs, connections, parameter values.

Read are components (FMI 2.0 and 3.0 co-simulation), nested systems, which are flattened (``sub.part`` becomes the slot
``sub_part``), connectors of systems, connections with linear transformations and conversions of units, parameter sets
with mappings (inline or as files) bound to systems and components, and the stop time.  The unit of a connector is that
of the archive or of the FMU.  A value of an outer system goes before one of an inner system or a component.

The communication step is that of the caller or of the annotation of a fixed step (``org.openmodelica``); a system
without one does not run.  Refused with a message: signal dictionaries, components that are no FMUs, transformations by
tables, a parameter that no component has.
"""

from __future__ import annotations

import difflib
import hashlib
import math
import os
import shutil
import tempfile
import zipfile
import zlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

from gyrobench import reading
from gyrobench.bench import Bench
from gyrobench.exchange.gains import is_gain
from gyrobench.exchange.ssp_annotation import read_annotation, read_gains, repeated
from gyrobench.exchange.ssp_values import NS, ArchiveError, SspValue, Units, as_kind, bound_values, transformation
from gyrobench.files import check_size
from gyrobench.system.binding import Binding, Bound, fit
from gyrobench.system.fmu_variables import read_description
from gyrobench.system.sockets import Socket
from gyrobench.system.system import InvalidConfigurationError, Slot, System

ANY = Socket("FMU", "any FMU: its own inputs and outputs", ())
FMU = "application/x-fmu-sharedlibrary"
STRUCTURE = "SystemStructure.ssd"

Place = tuple[str, ...]  # names of the systems and the component, from the outermost
Node = tuple[Place, str]  # connector of a component or of a system


@dataclass(frozen=True)
class _Feed:
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
class _Structure:
    """The flattened archive."""

    folder: Path
    units: Units
    ssd_units: ET.Element | None
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
    problems: list[str] = field(default_factory=list)

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
        if element.get("type", FMU) != FMU:
            self.problems.append(f"component '{where}': {element.get('type')} is not read, only FMUs are")
            return
        file = (self.folder / element.get("source", "")).resolve()
        if not file.is_relative_to(self.folder.resolve()) or not file.is_file():
            self.problems.append(f"component '{where}': no file {element.get('source', '')}")
            return
        slot = "_".join(place).replace(".", "_")
        while slot in self.files:
            slot += "_"
        try:
            description = read_description(file)
        except Exception as error:  # of the zip archive, of the XML, or FMPy's own
            self.problems.append(f"component '{where}': {file.name} is not a readable FMU: {error}")
            return
        self.bindings[place] = fit(ANY, description, None, slot)
        if len(place) == 1 and place[0] in self.factors and is_gain(description):
            self.gains[place] = {"factor": 1.0, "offset": 0.0}
        else:
            self.slots[place], self.files[slot] = slot, file
        self.connectors(element, place)
        self.bound.append((place, element))

    def connection(self, c: ET.Element, place: Place) -> None:
        a, x, b, y = (c.get(n, "") for n in ("startElement", "startConnector", "endElement", "endConnector"))
        start, end = ((*place, a) if a else place, x), ((*place, b) if b else place, y)
        text = f"{'.'.join((*start[0], x))} -> {'.'.join((*end[0], y))}"
        unknown = [n for n in (start, end) if not self.exists(n)]
        if unknown:
            self.problems.append(f"{text}: no such output or input")
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

    def feed(self, node: Node, seen: tuple[Node, ...] = ()) -> _Feed:
        """Return where the value of a connector comes from.  Raises ArchiveError."""
        if node[0] in self.gains and node[1] == "y":
            into, gain = self.feed((node[0], "u"), seen), self.gains[node[0]]
            factor, offset = gain["factor"], gain["offset"]
            return _Feed(into.source, factor * into.factor, factor * into.offset + offset, "")
        link = self.links.get(node)
        if link is None:
            return _Feed(node, 1.0, 0.0, self.unit(node))
        if node in seen:
            raise ArchiveError(f"{link.text}: a loop of connectors without a component")
        before = self.feed(link.start, (*seen, node))
        unit = self.unit(node)
        try:
            factor, offset = self.units.convert(before.unit, unit) if link.convert else (1.0, 0.0)
        except ArchiveError as error:
            raise ArchiveError(f"{link.text}: {error}") from None
        if link.offset and (factor, offset) != (1.0, 0.0):
            raise ArchiveError(
                f"{link.text}: an offset beside a conversion of units has no defined order; set suppressUnitConversion"
            )
        factor, offset = link.factor * factor, link.factor * offset + link.offset
        return _Feed(before.source, factor * before.factor, factor * before.offset + offset, unit or before.unit)

    # ------------------------------------------------------------------ parameters
    def set_value(self, place: Place, name: str, value: SspValue, known: Units, raw: dict[str, Any]) -> None:
        """Set a parameter or start value, named from ``place``.  Raises ArchiveError."""
        targets = self.targets(place, name)
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

    def targets(self, place: Place, name: str) -> list[tuple[Node, _Feed]]:
        """Return the variables that a name means, each with how the value gets there."""
        own = (place, name)
        if place in self.bindings:
            return [(own, _Feed(own, 1.0, 0.0, ""))] if self.settable(own) else []
        for inner in (*self.bindings, *self.systems):
            relative = ".".join(inner[len(place) :]) + "." if len(inner) > len(place) else ""
            if inner[: len(place)] == place and relative and name.startswith(relative):
                node = (inner, name[len(relative) :])
                if self.settable(node):
                    return [(node, _Feed(node, 1.0, 0.0, ""))]
                if node in self.system_connectors:
                    return self.reached(node)
        return self.reached(own) if own in self.system_connectors else []

    def settable(self, node: Node) -> bool:
        binding = self.bindings.get(node[0])
        return binding is not None and (node[1] in binding.parameters or node[1] in binding.inputs)

    def reached(self, connector: Node) -> list[tuple[Node, _Feed]]:
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


def _unpack(path: Path) -> Path:
    """Return the folder of the unzipped archive in the user's cache, keyed by content."""
    check_size(path)
    key = hashlib.sha256(path.read_bytes()).hexdigest()[:20]
    folder = Bench.find().cache / f"ssp-{key}"
    if folder.is_dir() and not _is_intact(folder, path):
        shutil.rmtree(folder)
    if not folder.is_dir():
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder.parent) as name:
            unpacked = Path(name) / "open"
            with zipfile.ZipFile(path) as archive:
                for member in archive.namelist():
                    if not (unpacked / member).resolve().is_relative_to(unpacked.resolve()):
                        raise InvalidConfigurationError(path.name, [f"'{member}' leaves the archive"])
                archive.extractall(unpacked)
            if not folder.is_dir():
                os.replace(unpacked, folder)
    return folder


def _is_intact(folder: Path, path: Path) -> bool:
    """Return whether the files of an unzipped archive are those in it, by their checksums."""
    try:
        with zipfile.ZipFile(path) as archive:
            files = [(folder / info.filename, info.CRC) for info in archive.infolist() if not info.is_dir()]
        return all(zlib.crc32(file.read_bytes()) == checksum for file, checksum in files)
    except OSError:
        return False


def open_archive(path: Path) -> tuple[Path, ET.Element]:
    """Return the folder of the unzipped archive and its description.  Raises InvalidConfigurationError."""
    if not path.is_file():
        raise InvalidConfigurationError(path.name, ["no such file"])
    try:
        folder = _unpack(path)
        return folder, reading.xml((folder / STRUCTURE).read_bytes(), STRUCTURE, ArchiveError)
    except InvalidConfigurationError:
        raise
    except Exception as error:  # of the file, the zip archive, its compressed data, the XML
        raise InvalidConfigurationError(path.name, [f"not an SSP archive: {error}"]) from None


def _fixed_step(top: ET.Element) -> float:
    """Return the step of the annotation that OMSimulator writes; NaN where there is none."""
    for annotation in top.findall("ssd:Annotations/ssc:Annotation", NS):
        for element in annotation.iter():
            if element.tag.rpartition("}")[2] == "FixedStepMaster":
                try:
                    return float(element.get("stepSize", "nan"))
                except ValueError:
                    return math.nan
    return math.nan


class Archive(System):
    """The system of an archive; its channels are all connected outputs."""

    unlike: str = ""  # why it is not the system that was exported

    def warnings(self) -> list[str]:
        """Say that the archive runs as it is wired, where it names a system."""
        return [f"{self.unlike}: the archive runs as it is wired, without a reduction"] if self.unlike else []

    def check(self) -> list[str]:
        """Refuse a run without a step."""
        if self.step > 0.0:
            return []
        return ["the archive names no communication step: give it by --step, for example --step 1ms"]


def read_ssp(path: Path, step: float | None = None) -> System:
    """Return the archive as a system that can be run, shown and exported again; its channels are all connected outputs.

    An archive of the bench that nobody has changed is the system that was exported, with values, plan and reduction.
    step: communication step, s; None: that of the archive, NaN where it names none.  Raises InvalidConfigurationError
    for what is not read, and for a file that is not an SSP archive.
    """
    path = Path(path)
    try:
        return _read(path, step)
    except (
        ValueError,
        KeyError,
        TypeError,
        OverflowError,
        RecursionError,
        OSError,
    ) as error:
        raise InvalidConfigurationError(path.name, [f"not an archive that can be read: {error}"]) from None


def _read(path: Path, step: float | None) -> System:
    folder, root = open_archive(path)
    top = root.find("ssd:System", NS)
    if top is None:
        raise InvalidConfigurationError(path.name, ["it has no system"])
    content, unlike = read_annotation(root), ""
    if content is not None:
        found = repeated(content, root, folder, path)
        if isinstance(found, System):
            found.step = found.step if step is None else step
            return found
        unlike = found
    ssd_units = root.find("ssd:Units", NS)
    s = _Structure(folder, Units(ssd_units), ssd_units)
    fed = {c.get("endElement", "") for c in top.findall("ssd:Connections/ssd:Connection[@endConnector='u']", NS)}
    s.factors = fed & read_gains(root)
    s.walk(top, ())
    raw: dict[str, Any] = {}
    wires: list[str] = []
    factors: dict[str, float] = {}
    offsets: dict[str, float] = {}
    outputs: list[str] = []
    for place, element in () if s.problems else s.bound:  # of a component first, of the systems around it after
        try:
            for name, value, known in bound_values(element, folder, ssd_units):
                s.set_value(place, name, value, known, raw)
        except ArchiveError as error:
            s.problems.append(str(error))
    for end in () if s.problems else [n for n in s.links if n[0] not in s.gains]:
        try:
            feed = s.feed(end)
        except ArchiveError as error:
            s.problems.append(str(error))
            continue
        source, target = s.variable(feed.source), s.variable(end)
        if source is None or feed.source[1] not in s.bindings[feed.source[0]].outputs:
            continue  # from the outside: a start value
        output = f"{s.slots[feed.source[0]]}.{source.variable}"
        outputs.append(output)
        if target is None:
            continue  # to the outside
        wire = f"{output} -> {s.slots[end[0]]}.{target.variable}"
        wires.append(wire)
        natural = 1.0 if source.gain == target.gain else source.gain / target.gain
        if feed.factor != natural:
            factors[wire] = feed.factor * target.gain / source.gain
        if feed.offset:
            offsets[wire] = feed.offset * target.gain
    if s.problems:
        raise InvalidConfigurationError(path.name, s.problems)
    experiment = root.find("ssd:DefaultExperiment", NS)
    stop = experiment.get("stopTime") if experiment is not None else None
    members = {
        "__doc__": root.get("description", ""),
        "title": root.get("name", path.stem),
        "slots": {slot: Slot(ANY, str(file)) for slot, file in s.files.items()},
        "wires": "\n".join(wires),
        "factors": factors,
        "offsets": offsets,
        "raw": raw,
        "channels": tuple(dict.fromkeys(outputs)),
        "unlike": unlike,
    }
    system: System = type("Archive", (Archive,), members)()
    system.name, system.step = path.stem, _fixed_step(top) if step is None else step
    system.stop = float(stop) if stop else 1.0
    return system
