"""Import of an SSP 1.0 archive, of the bench or a third party, as a system: FMUs, connections, parameter values.

Read are components (FMI 2.0 and 3.0 co-simulation), nested systems, which are flattened (``sub.part`` becomes the slot
``sub_part``), connectors of systems, connections with linear transformations and conversions of units, parameter sets
with mappings (inline or as files) bound to systems and components, and the stop time.  The unit of a connector is that
of the archive or of the FMU.  A value of an outer system goes before one of an inner system or a component.

The communication step is that of the caller or of OMSimulator's annotation; a system without one does not run.
Refused with a message: signal dictionaries, components that are no FMUs, transformations by tables, a parameter that no
component has.  What has no effect, and what the schema of SSP 1.0 forbids but can be read, is a warning of the run.
"""

from __future__ import annotations

import hashlib
import math
import os
import shutil
import tempfile
import zipfile
import zlib
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

from gyrobench import reading
from gyrobench.bench import Bench
from gyrobench.exchange.ssp_annotation import read_annotation, read_gains, repeated
from gyrobench.exchange.ssp_structure import ANY, Structure
from gyrobench.exchange.ssp_values import NS, ArchiveError, Units, bound_values, schema_errors
from gyrobench.files import check_size, missing
from gyrobench.system.system import InvalidConfigurationError, Slot, System

STRUCTURE = "SystemStructure.ssd"
STOP = 1.0  # s, where an archive names no time
ROWS = 1000  # of the channels, about


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
        raise InvalidConfigurationError(path.name, [missing(path)])
    try:
        folder = _unpack(path)
        return folder, reading.xml((folder / STRUCTURE).read_bytes(), STRUCTURE, ArchiveError)
    except InvalidConfigurationError:
        raise
    except Exception as error:  # of the file, the zip archive, its compressed data, the XML
        raise InvalidConfigurationError(path.name, [f"not an SSP archive: {error}"]) from None


#: of OMSimulator: element of the annotation at the system and its attribute, of version 3 and of older ones
FIXED_STEP = {"SimulationInformation": "fixedStepSize", "FixedStepMaster": "stepSize"}


def _fixed_step(top: ET.Element) -> float:
    """Return the step of the annotation that OMSimulator writes; NaN where there is none."""
    for annotation in top.findall("ssd:Annotations/ssc:Annotation", NS):
        for element in annotation.iter():
            text = element.get(FIXED_STEP.get(element.tag.rpartition("}")[2], ""))
            if text is not None:
                try:
                    return float(text)
                except ValueError:
                    return math.nan
    return math.nan


class Archive(System):
    """The system of an archive; its channels are all connected outputs."""

    unlike: str = ""  # why it is not the system that was exported
    remarks: tuple[str, ...] = ()  # on what was read

    def warnings(self) -> list[str]:
        """Say that the archive runs as it is wired, where it names a system; and what was read with a doubt."""
        unlike = [f"{self.unlike}: the archive runs as it is wired, without a reduction"] if self.unlike else []
        return [*unlike, *self.remarks]

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
    except (ValueError, KeyError, TypeError, OverflowError, RecursionError, OSError) as error:
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
    s = Structure(folder, Units(ssd_units))
    schema = schema_errors(folder / STRUCTURE, STRUCTURE)
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
            for name, value, known in bound_values(element, folder, ssd_units, schema):
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
    experiment = root.find("ssd:DefaultExperiment", NS)
    start, stop = (experiment.get(n) if experiment is not None else None for n in ("startTime", "stopTime"))
    if start and float(start) != 0.0:
        s.problems.append(f"its experiment begins at t = {start} s; a run of the bench begins at 0")
    if not s.slots and not s.problems:
        s.problems.append("it has no component: there is nothing to run")
    if s.problems:
        raise InvalidConfigurationError(path.name, [*schema, *s.problems])
    if not stop:
        s.notes.append(f"the archive names no stop time: the run ends at {STOP:g} s")
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
        "remarks": (*schema, *dict.fromkeys(s.notes)),
    }
    system: System = type("Archive", (Archive,), members)()
    system.name, system.step = path.stem, _fixed_step(top) if step is None else step
    system.stop = float(stop) if stop else STOP
    if system.step > 0.0:
        system.channel_period = system.step * max(1, round(system.stop / system.step / ROWS))
    return system
