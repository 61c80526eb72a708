"""A system as one native FMU: the parts' C and the wires between them in one library, plan and values inside.

Parameters: what was asked for, or the options of the system that stand for values of parts and nothing else (an option
that also shapes the plan or a design is built in, as everything else; which is which is found by small changes of its
value).  What the system derives from a parameter of a part stays as it was exported.  Inputs: inputs of parts without a
wire, where asked for.  Outputs: what a record needs (channels, windows, the end of the plan), and what was asked for.

A communication step is a whole number of the system's own steps, which are those of a run of the bench: the same bits.
Inputs reach the outputs with the next step.  Not offered: directional derivatives; string variables.
"""

from __future__ import annotations

import copy
import dataclasses
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

from gyrobench.component.component import Component
from gyrobench.engine.linked_system import obstacle
from gyrobench.engine.program import build_program
from gyrobench.exchange.exposure import SECTIONS, ExposedVariable, choose
from gyrobench.exchange.ssp_export import ExportError, experiment, prepare, recorded
from gyrobench.exchange.system_source import Exposed, SystemSource, source_files
from gyrobench.packaging import load_part
from gyrobench.packaging.compiler import this_platform
from gyrobench.packaging.description import EMPTY, add_common, add_variable, units, xml_text
from gyrobench.packaging.description3 import add_time, build_description, reference
from gyrobench.packaging.description3 import add_variable as add_variable3
from gyrobench.packaging.documentation import LICENCE, index_page, is_standard, licences
from gyrobench.packaging.fmu import content_hash, guid_of, native_entries, write_archive
from gyrobench.packaging.icon import icon
from gyrobench.packaging.loading import sources
from gyrobench.system.parameters import Starts
from gyrobench.system.system import System
from gyrobench.system.wiring import Assembly


def export_fmu(
    system: System,
    path: Path,
    parts: Mapping[str, Path | str] | None = None,
    maps: Mapping[str, Path] | None = None,
    values: Mapping[str, Any] | None = None,
    seed: int = 1,
    bench: Path | None = None,
    expose: Iterable[str] = (),
    fmi: int = 2,
    platforms: tuple[str, ...] = (),
) -> list[str]:
    """Write the FMU (co-simulation, FMI 2.0 or 3.0); return notes for the user.

    expose: "slot.variable" (a parameter, an input without a wire, an output) and names of options, for the default set
    of parameters.  platforms: as for parts, this one by default.

    Raises ExportError where a slot holds another FMU than a native part of the bench or a name cannot be exposed,
    CompilerError, and what a run would raise before it runs.
    """
    remedy = "one library holds parts of the bench only, use --to container or ssp"
    linked = linked_source(system, parts, maps, values, seed, bench, expose, "fmu", remedy)
    chosen, source = linked.system, linked.source
    draft = source_files(source, "", fmi)
    guid = guid_of(content_hash(*(f"{n}\n{t}" for n, t in sorted(draft.items()))))
    entries = native_entries(source_files(source, guid, fmi), chosen.name, platforms or (this_platform(),), fmi)
    if fmi == 3:
        entries["sources/buildDescription.xml"] = build_description(chosen.name).encode()
    entries["modelDescription.xml"] = (_description3 if fmi == 3 else _description2)(chosen, source, guid).encode()
    entries |= index_page(chosen.name, chosen.title, _text(source), [e.scalar for e in source.exposed], whole=False)
    entries |= licences() | icon("system", fmi)
    readme = chosen.folder / "README.md" if chosen.folder else None
    if readme is not None and readme.is_file():
        entries["documentation/README.md"] = readme.read_bytes()
    write_archive(Path(path), entries)
    return linked.notes


class LinkedSource(NamedTuple):
    """A system with its values, its C, and notes for the user."""

    system: System
    source: SystemSource
    notes: list[str]


def linked_source(
    system: System, parts: Mapping[str, Path | str] | None, maps: Mapping[str, Path] | None,
    values: Mapping[str, Any] | None, seed: int, bench: Path | None, expose: Iterable[str], to: str, remedy: str,
) -> LinkedSource:  # fmt: skip
    """Return the system as one C component, for the export ``to``.  Raises ExportError, which ends in the remedy, where
    a slot holds another FMU than a native part of the bench, and what a run would raise before it runs.
    """
    chosen = system.with_values(values or {})
    assembly, starts, notes = prepare(chosen, parts, maps, None, seed, bench)
    names = {slot: str((parts or {}).get(slot, declared.part)) for slot, declared in chosen.slots.items()}
    names = {slot: name for slot, name in names.items() if not name.endswith(".fmu")}
    program = build_program(assembly)
    if why := obstacle(program, names, {s: d.guid for s, d in assembly.descriptions.items()}, bench):
        raise ExportError(f"{to}: {why}; {remedy}")
    classes = {slot: (name, load_part(name, bench)) for slot, name in names.items()}
    settings = [(slot, b.reference, float(v)) for slot, given in starts.items() for b, v in given]
    exposed = _exposed(assembly, starts, classes, choose(chosen, assembly, seed, expose), to)
    return LinkedSource(chosen, SystemSource(chosen.name, program, classes, settings, exposed, chosen.step), notes)


def _exposed(
    assembly: Assembly,
    starts: Starts,
    classes: Mapping[str, tuple[str, type[Component]]],
    choices: Iterable[ExposedVariable],
    to: str,
) -> list[Exposed]:
    """Return the variables of the FMU, numbered in the order parameters, inputs, outputs.  Raises ExportError."""
    scalars = {f"{slot}.{s.name}": s for slot, (_, cls) in classes.items() for s in cls.layout}
    given = {(slot, b.reference): v for slot, set_here in starts.items() for b, v in set_here}
    chosen = list(choices)
    for name, (slot, bound) in recorded(assembly).items():
        if bound.gain != 1.0 or bound.offset != 0.0:
            raise ExportError(f"{to}: {name} is mapped with a factor or offset, which its outputs do not apply")
        chosen.append(ExposedVariable(name, "output", ((slot, bound.variable),)))
    named: dict[str, Exposed] = {}
    for choice in chosen:
        ends = [(slot, scalars[f"{slot}.{variable}"]) for slot, variable in choice.ends]
        slot, scalar = ends[0]
        start = float(given.get((slot, scalar.reference), scalar.start))
        decl = copy.copy(scalar.decl)
        decl.unit, decl.doc = choice.unit or decl.unit, choice.doc or decl.doc
        new = dataclasses.replace(scalar, name=choice.name, section=choice.section, start=start, decl=decl)
        named[choice.name] = Exposed(new, tuple((slot, s.reference) for slot, s in ends))
    order = [e for section in SECTIONS for e in named.values() if e.scalar.section == section]
    return [dataclasses.replace(e, scalar=dataclasses.replace(e.scalar, reference=i)) for i, e in enumerate(order)]


def _text(source: SystemSource) -> str:
    parts = "\n".join(f"  {slot}: {name}" for slot, (name, _) in source.parts.items())
    step = f"A communication step is a whole number of the system's own steps of {source.step:g} s."
    return f"{step}\n\nParts, in the order of execution:\n{parts}"


class _Face:
    """System in the form of a part, for the writers of descriptions."""

    states = ()

    def __init__(self, source: SystemSource) -> None:
        self.layout = [e.scalar for e in source.exposed]


def _attributes(system: System, source: SystemSource, fmi: int) -> dict[str, str]:
    files = [f for _, cls in source.parts.values() for f in sources(cls).values()]
    files += [system.folder] if system.folder is not None else []
    return {
        **({"license": LICENCE} if is_standard(files) else {}),
        "fmiVersion": f"{fmi}.0",
        "modelName": system.name,
        "description": system.title,
        "version": version("gyrobench"),
        "generationTool": "gyrobench",
        "variableNamingConvention": "structured",
    }


def _common(root: ET.Element, system: System, face: Any, extra: tuple[str, ...]) -> ET.Element:
    inputs = any(s.section == "input" for s in face.layout)
    return add_common(root, units(face.layout, *extra), experiment(system, inputs))


def _description2(system: System, source: SystemSource, guid: str) -> str:
    """Return modelDescription.xml, FMI 2.0."""
    face: Any = _Face(source)
    attributes = {**_attributes(system, source, 2), "guid": guid, "numberOfEventIndicators": "0"}
    root = ET.Element("fmiModelDescription", attributes)
    abilities = dict.fromkeys(
        (
            "canHandleVariableCommunicationStepSize",
            "canNotUseMemoryManagementFunctions",
            "canGetAndSetFMUstate",
            "canSerializeFMUstate",
        ),
        "true",
    )
    co = ET.SubElement(root, "CoSimulation", {"modelIdentifier": system.name, **abilities})
    ET.SubElement(ET.SubElement(co, "SourceFiles"), "File", {"name": "fmi2.c"})
    variables = _common(root, system, face, ())
    tunable = source.tunable()
    for s in face.layout:
        add_variable(variables, face, s, tunable, EMPTY)
    structure = ET.SubElement(root, "ModelStructure")
    known = " ".join(str(e.scalar.reference + 1) for e in source.exposed if e.scalar.section != "output")
    for what, on in (("Outputs", ""), ("InitialUnknowns", known)):
        node = ET.SubElement(structure, what)
        for e in source.section("output"):
            ET.SubElement(node, "Unknown", {"index": str(e.scalar.reference + 1), "dependencies": on})
    return xml_text(root)


def _description3(system: System, source: SystemSource, guid: str) -> str:
    """Return modelDescription.xml, FMI 3.0."""
    face: Any = _Face(source)
    root = ET.Element("fmiModelDescription", {**_attributes(system, source, 3), "instantiationToken": guid})
    abilities = ("canGetAndSetFMUState", "canSerializeFMUState", "canHandleVariableCommunicationStepSize")
    own = {"modelIdentifier": system.name, "fixedInternalStepSize": repr(system.step)}
    ET.SubElement(root, "CoSimulation", {**own, **dict.fromkeys(abilities, "true")})
    variables = _common(root, system, face, ("s",))
    add_time(variables, face)
    tunable = source.tunable()
    for s in face.layout:
        add_variable3(variables, face, s, tunable, EMPTY)
    structure = ET.SubElement(root, "ModelStructure")
    known = " ".join(reference(e.scalar) for e in source.exposed if e.scalar.section != "output")
    for what, on in (("Output", ""), ("InitialUnknown", known)):
        for e in source.section("output"):
            ET.SubElement(structure, what, {"valueReference": reference(e.scalar), "dependencies": on})
    return xml_text(root)
