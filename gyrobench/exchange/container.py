"""A system as one container FMU, through fmu-manipulation-toolbox (sequential: execution order of the bench)."""

from __future__ import annotations

import logging
import tempfile
import zipfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

from gyrobench.exchange.exposure import choose
from gyrobench.exchange.gains import FACTOR, INPUT, OFFSET, OUTPUT, gain_fmu, gains_of
from gyrobench.exchange.ssp_export import ExportError, experiment, for_system, prepare, recorded, slots_with_arrays
from gyrobench.packaging.description import unit_attributes, unit_definitions, xml_text
from gyrobench.packaging.fmu import write_archive
from gyrobench.system.fmu_variables import variables
from gyrobench.system.recorded_units import recorded_units
from gyrobench.system.system import System

DESCRIPTION = "modelDescription.xml"


def export_container(
    system: System,
    path: Path,
    parts: Mapping[str, Path | str] | None = None,
    maps: Mapping[str, Path] | None = None,
    values: Mapping[str, Any] | None = None,
    seed: int = 1,
    bench: Path | None = None,
    expose: Iterable[str] = (),
) -> list[str]:
    """Write a container FMU (FMI 2.0 co-simulation); return notes for the user.

    Its outputs "slot.output" are those that a record needs, with their units; in SI by a gain part where a mapping file
    gives an FMU other units.  Its step is the system's, the plan is built in.
    expose: as for :func:`gyrobench.exchange.exposure.choose`; a parameter of parts that share a value sets all of them.
    Within a step the FMUs run in the execution order of the bench, each with the newest values, factors of wires right
    before the part that takes them; initial outputs are not propagated around cut loops (the toolbox logs this).  When
    it is instantiated, the library of the toolbox logs "Solver configure...." as an error, which is none.
    Raises ExportError without the toolbox, where a mapping file states a delay or a slot has arrays (FMI 3.0), and what
    a run would raise before it runs.
    """
    try:
        from fmu_manipulation_toolbox.assembly import AssemblyNode
    except ImportError:
        raise ExportError("container: needs fmu-manipulation-toolbox; pip install gyrobench[container]") from None
    chosen = system.with_values(values or {})
    assembly, starts, notes = prepare(chosen, parts, maps, None, seed, bench)
    if late := sorted({c.wire for c in assembly.connections if c.delayed}):
        raise ExportError(f"container: a container FMU cannot carry the delay of {', '.join(late)}; export to SSP")
    if arrays := slots_with_arrays(assembly, starts):
        raise ExportError(f"container: {', '.join(arrays)}: has arrays (FMI 3.0); the toolbox connects scalars only")
    gains = gains_of(assembly)
    asked = list(expose)
    if "time" in asked:
        raise ExportError("--expose time: a container has a variable of that name; expose what it sets in a part")
    choices = [c for c in choose(chosen, assembly, seed, asked) if c.name != "time"]
    outputs = {port: (slot, b) for port, (slot, b) in recorded(assembly).items() if b.constant is None}
    in_si = {port: f"{port.replace('.', '_')}_in_SI" for port, (_, b) in outputs.items() if b.gain != 1.0 or b.offset}
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="gyrobench-") as name:
        folder = Path(name)
        node = AssemblyNode(
            path.name, step_size=assembly.system.step, sequential=True, auto_link=False, auto_input=False,
            auto_output=False,
        )  # fmt: skip
        gain = gain_fmu(bench) if gains.parts or in_si else b""
        for part in (*gains.order, *in_si.values()):
            data = assembly.paths[part].read_bytes() if part in assembly.paths else gain
            (folder / f"{part}.fmu").write_bytes(for_system(data, assembly.system))
            node.add_fmu(f"{part}.fmu")
        links = [(c.source, c.output.variable, c.target, c.input.variable) for c in gains.links]
        links += [(*_end(outputs[port]), part, INPUT.variable) for port, part in in_si.items()]
        for source, output, target, into in links:
            node.add_link(f"{source}.fmu", output, f"{target}.fmu", into)
        wired = {link[:2] for link in links}
        exposed = {c.name: c.ends[0] for c in choices if c.section == "output"}
        exposed |= {port: (in_si[port], OUTPUT.variable) if port in in_si else _end(outputs[port]) for port in outputs}
        for port, (slot, variable) in exposed.items():
            if (slot, variable) not in wired:  # a wired one is a local of that name by itself, see _described
                node.add_output(f"{slot}.fmu", variable, port)
        for choice in choices:
            for slot, variable in choice.ends if choice.section != "output" else ():
                node.add_input(choice.name, f"{slot}.fmu", variable)
        of_outputs = {part: [(FACTOR, outputs[p][1].gain), (OFFSET, outputs[p][1].offset)] for p, part in in_si.items()}
        for slot, given in {**starts, **gains.starts(), **of_outputs}.items():
            for bound, value in given:
                text = repr(value) if bound.kind == "Real" else str(value).lower() if bound.kind == "Boolean" else value
                node.add_start_value(f"{slot}.fmu", bound.variable, str(text))
        logger = logging.getLogger("fmu_manipulation_toolbox")
        level = logger.level
        logger.setLevel(logging.CRITICAL)
        try:
            node.make_fmu(folder)
        except Exception as error:
            raise ExportError(f"container: {type(error).__name__}: {getattr(error, 'reason', error)}") from None
        finally:
            logger.setLevel(level)
        with zipfile.ZipFile(folder / path.name) as made:
            entries = {n: made.read(n) for n in made.namelist() if not n.endswith("/")}
        units = {c.name: variables(assembly.descriptions[slot])[v].unit for c in choices for slot, v in c.ends[:1]}
        units |= recorded_units(assembly, {name: name for name in outputs})
        local = {f"{slot}.{variable}": name for name, (slot, variable) in exposed.items()}
        entries[DESCRIPTION] = _described(entries[DESCRIPTION], assembly.system, local, units)
        write_archive(path, entries)
    return notes


def _described(text: bytes, system: System, outputs: Mapping[str, str], units: Mapping[str, str]) -> bytes:
    """Return the description of a container in which what is wired inside is an output too, with units.

    What the toolbox states of its user and of a licence is left out.  outputs: "slot.variable", the name that a wired
    one has, -> its name.  units: by name.
    """
    root = ET.fromstring(text)
    for name in ("author", "license", "copyright"):
        root.attrib.pop(name, None)
    root.set("description", system.title)
    declared, structure, times = (root.find(n) for n in ("ModelVariables", "ModelStructure", "DefaultExperiment"))
    assert declared is not None and structure is not None and times is not None
    times.attrib |= experiment(system, any(v.get("causality") == "input" for v in declared))
    for variable in declared:
        name = variable.get("name", "")
        if name in outputs and variable.get("causality") == "local":
            variable.attrib |= {"name": outputs[name], "causality": "output"}
        if (unit := units.get(variable.get("name", ""))) and variable[0].tag == "Real":
            start = float(variable[0].get("start", "0")) if variable.get("causality") == "parameter" else None
            variable[0].attrib |= unit_attributes(unit, start)
    root.insert(1, unit_definitions(set(units.values()) - {""}))
    places = [str(k) for k, variable in enumerate(declared, 1) if variable.get("causality") == "output"]
    structure.clear()
    for section in ("Outputs", "InitialUnknowns"):
        ET.SubElement(structure, section).extend(ET.Element("Unknown", index=k) for k in places)
    return xml_text(root).encode()


def _end(of: tuple[str, Any]) -> tuple[str, str]:
    slot, bound = of
    return slot, bound.variable
