"""The annotation ``org.gyrobench`` of an archive: what the bench needs to repeat run, channels and report exactly.

It holds the name of the system, the options and parameters that were set, seed and step, the parts of the bench in the
slots, the mapping files, and a digest of everything else in the archive; beside these, which components stand for
factors of connections.  An archive that was changed since, or whose system this bench does not have, runs as it is
wired, with a warning.
"""

from __future__ import annotations

import copy
import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

from gyrobench.bench import BenchError
from gyrobench.exchange.ssp_values import NS, SSC, SSD
from gyrobench.system.system import InvalidConfigurationError, System, load_system
from gyrobench.system.wiring import Assembly

TYPE, GAINS = "org.gyrobench", "org.gyrobench.gains"
NAMESPACE = "urn:gyrobench:run"
FORMAT = 1


def digest(root: ET.Element, files: Mapping[str, bytes]) -> str:
    """Return the SHA-256 of the structure without this annotation and of all other files."""
    bare = copy.deepcopy(root)
    for element in bare.findall("ssd:Annotations", NS):
        bare.remove(element)
    # prefixes are rewritten: those of a text depend on what its process has registered
    text = ET.canonicalize(ET.tostring(bare, encoding="unicode"), strip_text=True, rewrite_prefixes=True)
    h = hashlib.sha256(text.encode())
    for name in sorted(files):
        h.update(f"\0{name}\0".encode() + hashlib.sha256(files[name]).digest())
    return h.hexdigest()


def annotate(
    root: ET.Element,
    assembly: Assembly,
    parts: Mapping[str, str],
    maps: Mapping[str, Path],
    seed: int,
    files: Mapping[str, bytes],
) -> None:
    """Add the annotation to a structure.

    parts: slot -> name, of parts of the bench.  files: the others of the archive.
    """
    system = assembly.system
    content = {
        "format": FORMAT,
        "system": system.name,
        "values": {n: system.values[n] for n in system.given if n in system.values},
        "parameters": system.overrides,
        "seed": seed,
        "step": system.step,
        "slots": list(system.slots),
        "parts": dict(parts),
        "maps": {slot: Path(file).read_text("utf-8") for slot, file in maps.items()},
        "digest": digest(root, files),
    }
    ET.SubElement(_annotation(root, TYPE), f"{{{NAMESPACE}}}Run", content=json.dumps(content, sort_keys=True))


def annotate_gains(root: ET.Element, names: Iterable[str]) -> None:
    """Add which components stand for factors of connections.

    This is said of the whole: OMSimulator refuses a component with an annotation of its own.
    """
    if joined := " ".join(names):
        ET.SubElement(_annotation(root, GAINS), f"{{{NAMESPACE}}}Gains", components=joined)


def read_gains(root: ET.Element) -> set[str]:
    """Return the components that stand for factors of connections."""
    ours = (one for one in root.findall("ssd:Annotations/ssc:Annotation", NS) if one.get("type") == GAINS)
    return {n for one in ours for g in one.findall(f"{{{NAMESPACE}}}Gains") for n in g.get("components", "").split()}


def _annotation(root: ET.Element, kind: str) -> ET.Element:
    """Return a new annotation, which has one element by the schema, among those of the root."""
    ET.register_namespace("gyrobench", NAMESPACE)
    every = root.find("ssd:Annotations", NS)
    if every is None:
        every = ET.SubElement(root, f"{{{SSD}}}Annotations")
    return ET.SubElement(every, f"{{{SSC}}}Annotation", type=kind)


def read_annotation(root: ET.Element) -> dict[str, Any] | None:
    """Return the content of the annotation; None where there is none that is understood."""
    for one in root.findall("ssd:Annotations/ssc:Annotation", NS):
        element = one.find(f"{{{NAMESPACE}}}Run") if one.get("type") == TYPE else None
        if element is not None:
            try:
                content = json.loads(element.get("content", ""))
            except json.JSONDecodeError:
                return None
            return content if isinstance(content, dict) and content.get("format") == FORMAT else None
    return None


def repeated(content: Mapping[str, Any], root: ET.Element, folder: Path, path: Path) -> System | str:
    """Return the system that was exported, with its values; or why the archive runs as it is wired."""
    names = (f for f in folder.rglob("*") if f.is_file() and f.name != "SystemStructure.ssd")
    files = {f.relative_to(folder).as_posix(): f.read_bytes() for f in names}
    if content.get("digest") != digest(root, files):
        return f"{path.name} was changed since its export"
    try:
        system = load_system(content["system"])
    except (BenchError, InvalidConfigurationError) as error:
        return str(error)
    for slot in content["slots"]:
        system.request(slot)
    if set(content["slots"]) != set(system.slots):
        return f"{system.name} has other slots now"
    system.values.update(content["values"])
    system.overrides.update(content["parameters"])
    system.given = [*content["values"], *content["parameters"]]
    system.step, system.seed = float(content["step"]), int(content["seed"])
    slots = {}
    for slot, declared in system.slots.items():
        file = folder / "resources" / f"{slot}.fmu"
        name = content["parts"].get(slot)
        slots[slot] = replace(declared, part=name if name and _same(name, file) else str(file))
    kept = {slot: folder / "resources" / f"{slot}.toml" for slot in content["maps"]}
    vars(system).update({"slots": slots, "maps": {slot: file for slot, file in kept.items() if file.is_file()}})
    return system


def _same(name: str, file: Path) -> bool:
    """Return whether an FMU is what the bench builds of a part now."""
    from gyrobench.packaging import load_part
    from gyrobench.packaging.fmu import native_guid
    from gyrobench.system.fmu_variables import read_description

    try:
        part = load_part(name)
    except BenchError:
        return False
    return bool(read_description(file).guid == native_guid(name, part))
