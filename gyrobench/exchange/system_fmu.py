"""A system as one native FMU: the parts' C and the wires between them in one library, plan and values inside.

Parameters: what was asked for, or the options of the system that stand for values of parts and nothing else (an option
that also shapes the plan or a design is built in, as everything else; which is which is found by small changes of its
value).  What the system derives from a parameter of a part stays as it was exported.  Inputs: inputs of parts without a
wire, where asked for.  Outputs: what a record needs (channels, windows, the end of the plan), and what was asked for.

A communication step is a whole number of the system's own steps, which are those of a run of the bench: the same bits.
Inputs reach the outputs with the next step.  Not offered: directional derivatives; string variables.
"""

from __future__ import annotations

import dataclasses
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

from gyrobench.component.component import Component
from gyrobench.component.declarations import Scalar
from gyrobench.engine.linked_system import obstacle
from gyrobench.engine.program import build_program
from gyrobench.errors import GyrobenchError
from gyrobench.exchange.ssp_export import ExportError, prepare, recorded, stop_time
from gyrobench.exchange.system_source import Exposed, SystemSource, source_files
from gyrobench.packaging import load_part
from gyrobench.packaging.compiler import this_platform
from gyrobench.packaging.description import add_variable, units
from gyrobench.packaging.description3 import add_time, build_description, reference, xml_text
from gyrobench.packaging.description3 import add_variable as add_variable3
from gyrobench.packaging.fmu import content_hash, guid_of, native_entries, write_archive
from gyrobench.system.parameters import Starts, defaults, resolve
from gyrobench.system.system import System
from gyrobench.system.wiring import Assembly

PROBES = (1.0 + 2.0**-10, 1.0 - 2.0**-10)  # an option times these


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
    chosen = system.with_values(values or {})
    assembly, starts, notes = prepare(chosen, parts, maps, None, seed, bench)
    names = {slot: str((parts or {}).get(slot, declared.part)) for slot, declared in chosen.slots.items()}
    names = {slot: name for slot, name in names.items() if not name.endswith(".fmu")}
    program = build_program(assembly)
    if why := obstacle(program, names, {s: d.guid for s, d in assembly.descriptions.items()}, bench):
        raise ExportError(f"fmu: {why}; one library holds parts of the bench only, use --to container or ssp")
    classes = {slot: (name, load_part(name, bench)) for slot, name in names.items()}
    source = SystemSource(
        chosen.name,
        program,
        classes,
        [(slot, b.reference, float(v)) for slot, given in starts.items() for b, v in given],
        _Exposure(chosen, assembly, starts, classes, seed).variables(list(expose)),
        chosen.step,
    )
    draft = source_files(source, "", fmi)
    guid = guid_of(content_hash(*(f"{n}\n{t}" for n, t in sorted(draft.items()))))
    entries = native_entries(source_files(source, guid, fmi), chosen.name, platforms or (this_platform(),), fmi)
    if fmi == 3:
        entries["sources/buildDescription.xml"] = build_description(chosen.name).encode()
    entries["modelDescription.xml"] = (_description3 if fmi == 3 else _description2)(chosen, source, guid).encode()
    readme = chosen.folder / "README.md" if chosen.folder else None
    if readme is not None and readme.is_file():
        entries["documentation/README.md"] = readme.read_bytes()
    write_archive(Path(path), entries)
    return notes


class _Exposure:
    """The variables of the FMU: found by name, in the order parameters, inputs, outputs."""

    def __init__(
        self,
        system: System,
        assembly: Assembly,
        starts: Starts,
        classes: Mapping[str, tuple[str, type[Component]]],
        seed: int,
    ) -> None:
        self.system, self.assembly, self.seed = system, assembly, seed
        self.scalars = {f"{slot}.{s.name}": s for slot, (_, cls) in classes.items() for s in cls.layout}
        self.given = {(slot, b.reference): v for slot, set_here in starts.items() for b, v in set_here}
        self.wired = {f"{c.target}.{c.input.variable}": c.wire for c in assembly.connections}

    def variables(self, asked: list[str]) -> list[Exposed]:
        """Return all variables, their value references in order.  Raises ExportError."""
        options = [n for n in asked if "." not in n]
        of_parts = [self.of_part(e) for n in asked if "." in n for e in self.elements(n)]
        if unknown := [n for n in options if n not in self.system.options]:
            raise ExportError(f"--expose {unknown[0]}: neither 'slot.variable' nor an option of {self.system.name}")
        found = {} if of_parts and not options else {n: self.option(n) for n in options or self.system.options}
        if lost := [n for n in options if found[n] is None]:
            raise ExportError(
                f"--expose {lost[0]}: the option does more than set values of parts, so it is built in; "
                f"set it with --set {lost[0]}=..."
            )
        chosen = [e for e in found.values() if e is not None] + of_parts
        for name, (slot, bound) in recorded(self.assembly).items():
            if bound.gain != 1.0 or bound.offset != 0.0:
                raise ExportError(f"fmu: {name} is mapped with a factor or offset, which its outputs do not apply")
            chosen.append(self.exposed(name, "output", [(slot, self.scalars[f"{slot}.{bound.variable}"])]))
        named = {e.scalar.name: e for e in chosen}
        order = [
            e for section in ("parameter", "input", "output") for e in named.values() if e.scalar.section == section
        ]
        return [dataclasses.replace(e, scalar=dataclasses.replace(e.scalar, reference=i)) for i, e in enumerate(order)]

    def elements(self, name: str) -> list[str]:
        """Return the scalars of a variable: itself, or the elements of an array."""
        found = [n for n in self.scalars if n == name or n.startswith(f"{name}[")]
        if not found:
            slot = name.partition(".")[0]
            have = [n for n in self.scalars if n.startswith(f"{slot}.")]
            what = (
                f"{slot} has no such variable" if have else f"no slot '{slot}'; slots: {', '.join(self.assembly.paths)}"
            )
            raise ExportError(f"--expose {name}: {what}")
        return found

    def of_part(self, name: str) -> Exposed:
        """Return a variable of a part.  Raises ExportError for one that cannot be exposed."""
        scalar, slot = self.scalars[name], name.partition(".")[0]
        if name in self.wired:
            raise ExportError(f"--expose {name}: this input is wired: {self.wired[name]}")
        if scalar.section not in ("parameter", "input", "output"):
            raise ExportError(f"--expose {name}: it is internal; parameters, inputs and outputs can be exposed")
        return self.exposed(name, scalar.section, [(slot, scalar)])

    def exposed(self, name: str, section: str, ends: list[tuple[str, Scalar]]) -> Exposed:
        slot, scalar = ends[0]
        start = float(self.given.get((slot, scalar.reference), scalar.start))
        new = dataclasses.replace(scalar, name=name, section=section, start=start)
        return Exposed(new, tuple((slot, s.reference) for slot, s in ends))

    def option(self, name: str) -> Exposed | None:
        """Return an option whose only effect is that parameters or inputs of parts take its value, else None."""
        value, kind = self.system[name], self.system.options[name].kind
        if kind is float and isinstance(value, float | int):
            probes: list[Any] = [value * p if value else p - 1.0 for p in PROBES]
        elif kind is int and isinstance(value, int):
            probes = [value + 1, value - 1]
        elif kind is bool:
            probes = [not value]
        else:
            return None
        before = self.settings(self.system)
        ends: set[tuple[str, str]] | None = None
        for probe in probes:
            try:
                after = self.settings(self.system.with_values({name: probe}))
            except GyrobenchError:
                continue  # outside its bounds
            changed = {k for k in {**before, **after} if before.get(k) != after.get(k)}
            if any(before.get(k) != value or after.get(k) != probe for k in changed):
                return None
            if ends is not None and changed != ends:
                return None
            ends = changed
        if not ends or any(f"{slot}.{variable}" in self.wired for slot, variable in ends):
            return None
        return self.exposed(name, "parameter", [(s, self.scalars[f"{s}.{v}"]) for s, v in sorted(ends)])

    def settings(self, system: System) -> dict[tuple[str, str], Any]:
        """Return what is set in the parts, and the times of a system, by (slot, variable)."""
        starts, _, _ = resolve(self.assembly, system, self.seed, defaults(self.assembly))
        found: dict[tuple[str, str], Any] = {(s, b.variable): v for s, given in starts.items() for b, v in given}
        found[("", "step")], found[("", "stop")] = system.step, system.stop
        return found


class _Face:
    """What the writers of descriptions take for a part."""

    states = ()

    def __init__(self, source: SystemSource) -> None:
        self.layout = [e.scalar for e in source.exposed]


def _attributes(system: System, fmi: int) -> dict[str, str]:
    return {
        "fmiVersion": f"{fmi}.0",
        "modelName": system.name,
        "description": system.title,
        "version": version("gyrobench"),
        "license": "BSD-3-Clause",
        "generationTool": "gyrobench",
        "variableNamingConvention": "structured",
    }


def _common(root: ET.Element, system: System, face: Any, extra: tuple[str, ...]) -> ET.Element:
    """Add units, log category and default experiment; return the element of the variables."""
    units(root, face, extra)
    categories = ET.SubElement(root, "LogCategories")
    ET.SubElement(categories, "Category", {"name": "logStatusError", "description": "why a call failed"})
    times = {"startTime": "0.0", "stopTime": repr(stop_time(system)), "stepSize": repr(system.step)}
    ET.SubElement(root, "DefaultExperiment", times)
    return ET.SubElement(root, "ModelVariables")


def _description2(system: System, source: SystemSource, guid: str) -> str:
    """Return modelDescription.xml, FMI 2.0."""
    face: Any = _Face(source)
    attributes = {**_attributes(system, 2), "guid": guid, "numberOfEventIndicators": "0"}
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
    for s in face.layout:
        add_variable(variables, face, s)
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
    root = ET.Element("fmiModelDescription", {**_attributes(system, 3), "instantiationToken": guid})
    abilities = ("canGetAndSetFMUState", "canSerializeFMUState", "canHandleVariableCommunicationStepSize")
    ET.SubElement(root, "CoSimulation", {"modelIdentifier": system.name, **dict.fromkeys(abilities, "true")})
    variables = _common(root, system, face, ("s",))
    add_time(variables, face)
    for s in face.layout:
        add_variable3(variables, face, s)
    structure = ET.SubElement(root, "ModelStructure")
    known = " ".join(reference(e.scalar) for e in source.exposed if e.scalar.section != "output")
    for what, on in (("Output", ""), ("InitialUnknown", known)):
        for e in source.section("output"):
            ET.SubElement(structure, what, {"valueReference": reference(e.scalar), "dependencies": on})
    return xml_text(root)
