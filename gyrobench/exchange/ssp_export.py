"""A system as SSP 1.0 archive: structure (SSD), parameter values (SSV) and the FMUs.

``SystemStructure.ssd``       components in execution order, connectors with units, connections; communication step and
                              interval of the results as annotations of OMSimulator (SSP has no other place for them)
``resources/<slot>.ssv``      what the system and the user set, bound to the component, in the FMU's own units
``resources/parameters.ssv``  the same of all slots as "slot.variable", for tools that want it handed over
``resources/<slot>.fmu``      one FMU for each slot, and one for each connection with a factor (``gain_01``, ...); those
                              of the bench have the system's step and end, and no unit where the socket takes any:
                              OMSimulator refuses a wire from "A" to "1", whatever the structure says

What other tools do with it, measured (libcosimpy 0.0.6, FMPy 0.3.32):

- libcosim applies the SSV bound to a component (it does not look at bindings of the system), takes the step size from
  its caller, and couples all parts in parallel (Jacobi): every connection carries the value of the last step, in
  the bench only the cut ones.
- FMPy's ``simulate_ssp`` couples in parallel too, starts from zero inputs, and applies parameter values only when they
  are handed over: ``simulate_ssp(f, parameter_set=read_ssv(f, "resources/parameters.ssv"), step_size=..., ...)``.
- FMPy and OMSimulator ignore linear transformations, so a factor of a connection (a torquer's scale factor, a unit or
  sign of a mapping file) is a small FMU of its own (:mod:`gyrobench.exchange.gains`).  The connections to and from it
  suppress conversions of units.
"""

from __future__ import annotations

import io
import math
import zipfile
from collections.abc import Container, Iterable, Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

from gyrobench import units
from gyrobench.errors import GyrobenchError
from gyrobench.exchange.external_record import row_steps
from gyrobench.exchange.gains import INPUT, Gains, gain_fmu, gains_of, varying
from gyrobench.exchange.ssp_annotation import annotate, annotate_gains
from gyrobench.exchange.ssp_values import SSC, SSD, SSV
from gyrobench.files import write_whole
from gyrobench.system.binding import Bound
from gyrobench.system.loop_plan import LoopPlan
from gyrobench.system.parameters import Starts, defaults, resolve
from gyrobench.system.part_files import resolve_parts
from gyrobench.system.system import System
from gyrobench.system.wiring import Assembly, assemble

PARAMETERS = "resources/parameters.ssv"
STAMP = (1980, 1, 1, 0, 0, 0)
SOLVER = "solver1"
STAGES = 4  # of a phase of a loop plan at most, each rounded to a step: settle, gate, fade, and the end
OMS = "https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd"


class ExportError(GyrobenchError):
    """A system that cannot be written in the requested form; the text states why."""


def prepare(
    system: System,
    parts: Mapping[str, Path | str] | None,
    maps: Mapping[str, Path] | None,
    values: Mapping[str, Any] | None,
    seed: int,
    bench: Path | None,
) -> tuple[Assembly, Starts, list[str]]:
    """Return the assembly, the start values by slot, and notes.  Raises what a run would raise before it runs."""
    chosen = system.with_values(values or {})
    chosen.refuse()
    notes: list[str] = []
    paths, _ = resolve_parts(chosen, parts or {}, "native", bench, notes)
    assembly = assemble(chosen, paths, maps)
    starts, _, parameter_notes = resolve(assembly, chosen, seed, defaults(assembly))
    for c in assembly.connections:
        if c.output.constant is not None:
            value = c.gain * c.output.constant + c.offset
            kind = {"Integer": int, "Boolean": bool}.get(c.input.kind, float)
            starts[c.target].append((c.input, kind(value)))
    return assembly, starts, [*notes, *assembly.notes, *parameter_notes]


def recorded(assembly: Assembly) -> dict[str, tuple[str, Bound]]:
    """Return the outputs that a record needs: windows, done and channels, as "slot.output" -> (slot, variable)."""
    system = assembly.system
    names = [*(system.windows.columns.values() if system.windows else ()), *system.channels]
    names += [system.windows.watch] if system.windows else []
    names += [system.done] if system.done else []
    absent = {f"{s}.{n}" for s, b in assembly.bindings.items() for n in b.absent if n not in b.outputs}
    return {n: assembly.output(n) for n in dict.fromkeys(names) if n.partition("[")[0] not in absent}


def stop_time(system: System) -> float:
    """Return a time by which the plan has ended, in whole steps: that at which a run stops, else the duration of the
    plan, of a table with 5 % and a minute for each phase on top, for its ways, of a loop with a step for each stage.
    """
    if system.stop is not None:
        steps = round(system.stop / system.step)  # as many as a run of the bench
    else:
        plan = system.plan()
        phases, duration = len(plan.phases), plan.duration()
        end = (
            duration + STAGES * phases * system.step if isinstance(plan, LoopPlan) else 1.05 * duration + 60.0 * phases
        )
        steps = math.ceil(math.ceil(end) / system.step - 1e-6)
    return float(f"{max(1, steps) * system.step:.15g}")


def experiment(system: System, inputs: bool) -> dict[str, str]:
    """Return the attributes of the DefaultExperiment of a system that is one FMU.

    Its step is that between two rows of the result, which importers take for their output where they are not told
    otherwise; with inputs that someone may feed it is the system's own.
    """
    step = system.step if inputs else float(f"{row_steps(system) * system.step:.15g}")
    return {"startTime": "0.0", "stopTime": repr(stop_time(system)), "stepSize": repr(step)}


def export_ssp(
    system: System,
    path: Path,
    parts: Mapping[str, Path | str] | None = None,
    maps: Mapping[str, Path] | None = None,
    values: Mapping[str, Any] | None = None,
    seed: int = 1,
    bench: Path | None = None,
) -> list[str]:
    """Write the archive; return notes for the user.

    Raises what a run would raise before it runs (misfit, wires, algebraic loop, values).
    """
    assembly, starts, notes = prepare(system, parts, maps, values, seed, bench)
    gains = gains_of(assembly)
    late = sorted({c.wire for c in assembly.connections if c.delayed})
    if late:
        notes.append(f"delays stated in a mapping file are not in the archive: {', '.join(late)}")
    if arrays := slots_with_arrays(assembly, starts):
        notes.append(f"{', '.join(arrays)}: elements of arrays (FMI 3.0) are connectors, which few importers take")
    initial, missing = initial_inputs(assembly, gains, parts, maps, seed, bench)
    notes += missing
    values_of = {name: [*initial.get(name, ()), *v] for name, v in {**starts, **gains.starts()}.items()}
    fmus = {slot: path.read_bytes() for slot, path in assembly.paths.items()}
    if gains.parts:
        fmus |= dict.fromkeys(gains.parts, gain_fmu(bench))
    files = {
        PARAMETERS: _xml(_values(assembly.system.name, values_of, prefix=True)),
        **{f"resources/{s}.ssv": _xml(_values(assembly.system.name, {s: v})) for s, v in values_of.items() if v},
        **{
            f"resources/{name}.fmu": for_system(data, assembly.system, unitless(assembly, gains, name))
            for name, data in fmus.items()
        },
        **{f"resources/{slot}.toml": Path(file).read_bytes() for slot, file in (maps or {}).items()},
    }
    root = structure(assembly, gains, values_of)
    if assembly.system.folder is not None:  # a system of a bench
        chosen = {slot: str((parts or {}).get(slot, s.part)) for slot, s in assembly.system.slots.items()}
        own = {slot: name for slot, name in chosen.items() if not name.endswith(".fmu")}
        annotate(root, assembly, own, maps or {}, seed, files)
    annotate_gains(root, gains.parts)
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in ("SystemStructure.ssd", _xml(root)), *files.items():
            archive.writestr(zipfile.ZipInfo(name, STAMP), data, zipfile.ZIP_DEFLATED)
    write_whole(path, content.getvalue())
    return notes


def slots_with_arrays(assembly: Assembly, starts: Starts) -> list[str]:
    """Return the slots whose FMUs have arrays (FMI 3.0) among what is connected, recorded or set."""
    used = [end for c in assembly.connections for end in ((c.source, c.output), (c.target, c.input))]
    used += [*recorded(assembly).values(), *((slot, b) for slot, given in starts.items() for b, _ in given)]
    return sorted({slot for slot, bound in used if bound.size})


def initial_inputs(
    assembly: Assembly,
    gains: Gains,
    parts: Mapping[str, Path | str] | None,
    maps: Mapping[str, Path] | None,
    seed: int,
    bench: Path | None,
) -> tuple[Starts, list[str]]:
    """Return the values of the connected inputs at the start, in the FMUs' units, and notes.

    They are what the outputs give after initialization, from a run of one step in a child process: tools that do not
    propagate initial outputs begin with them.  A system whose parts do not start has none, with a note.
    """
    from gyrobench.engine.run_errors import RunError
    from gyrobench.engine.session import run

    system = assembly.system.with_values({})
    outputs = tuple(dict.fromkeys(f"{c.source}.{c.output.element}" for c in varying(assembly)))
    short = {"channels": outputs, "windows": None, "done": None, "stop": system.step, "channel_period": system.step}
    cls = type(system)
    system.__class__ = type(cls.__name__, (cls,), {"loops": {}, **short})
    for name in short:
        vars(system).pop(name, None)
    try:
        found = run(system, parts, maps, seed=seed, bench=bench, child=True).channels
    except RunError as error:
        return {}, [f"start values of inputs are not in the archive: {error}"]
    starts: Starts = {}
    own = {n: assembly.output(n)[1].own(found[n][0]) for n in outputs}
    for c in varying(assembly):
        value = c.gain * own[f"{c.source}.{c.output.element}"] + c.offset
        kind = {"Integer": int, "Boolean": bool}.get(c.input.kind, float)
        starts.setdefault(c.target, []).append((c.input, kind(value)))
    for name, c in gains.parts.items():
        starts[name] = [(INPUT, float(own[f"{c.source}.{c.output.element}"]))]
    return starts, []


def for_system(fmu: bytes, system: System, unitless: Container[str] = ()) -> bytes:
    """Return an FMU of the bench with the step and the stop time of a system in its description; another as it is.

    unitless: variables that lose their unit.
    """
    with zipfile.ZipFile(io.BytesIO(fmu)) as source:
        entries = {info: source.read(info) for info in source.infolist()}
    info, text = next((i, d) for i, d in entries.items() if i.filename == "modelDescription.xml")
    root = ET.fromstring(text)
    if root.get("generationTool") != "gyrobench":
        return fmu
    experiment = root.find("DefaultExperiment")
    assert experiment is not None
    experiment.attrib |= {"stopTime": repr(stop_time(system)), "stepSize": repr(system.step)}
    for variable in root.iterfind("ModelVariables/*"):
        if variable.get("name") in unitless:
            for element in variable.iter():
                element.attrib.pop("unit", None)
                element.attrib.pop("displayUnit", None)
    entries[info] = _xml(root)
    changed = io.BytesIO()
    with zipfile.ZipFile(changed, "w", zipfile.ZIP_DEFLATED) as target:
        for info, data in entries.items():
            target.writestr(info, data, zipfile.ZIP_DEFLATED)
    return changed.getvalue()


def _xml(root: ET.Element) -> bytes:
    ET.indent(root)
    data: bytes = ET.tostring(root, encoding="utf-8", xml_declaration=True)
    return data


def _unit(assembly: Assembly, gains: Gains, name: str, bound: Bound) -> str:
    """Return the unit of a connector; none of a gain, and where the socket takes any."""
    if name in gains.parts or bound.kind != "Real":
        return ""
    connector = assembly.bindings[name].socket.connector(bound.element.split("[")[0])
    return bound.unit if connector is None or connector.unit else ""


def unitless(assembly: Assembly, gains: Gains, name: str) -> set[str]:
    """Return the variables of a component, arrays as such, that have no unit in an archive."""
    ports = (b for _, b in _ports(assembly, gains, name) if not _unit(assembly, gains, name, b))
    return {b.variable.partition("[")[0] if b.size else b.variable for b in ports}


def structure(assembly: Assembly, gains: Gains, starts: Starts) -> ET.Element:
    """Return the structure without the annotation of the bench.  starts: what is set, by component."""
    for prefix, uri in (("ssd", SSD), ("ssc", SSC)):
        ET.register_namespace(prefix, uri)
    system = assembly.system
    root = ET.Element(f"{{{SSD}}}SystemStructureDescription", version="1.0", name=system.name)
    if system.title:
        root.set("description", f"{system.title}; communication step {system.step:g} s")
    top = ET.SubElement(root, f"{{{SSD}}}System", name=system.name)
    elements = ET.SubElement(top, f"{{{SSD}}}Elements")
    used: set[str] = set()
    for name in gains.order:
        component = ET.SubElement(
            elements,
            f"{{{SSD}}}Component",
            name=name,
            type="application/x-fmu-sharedlibrary",
            source=f"resources/{name}.fmu",
        )
        if name in gains.parts:
            component.set("description", f"factor of {gains.parts[name].wire}")
        ports = ET.SubElement(component, f"{{{SSD}}}Connectors")
        for kind, bound in _ports(assembly, gains, name):
            connector = ET.SubElement(ports, f"{{{SSD}}}Connector", name=bound.variable, kind=kind)
            unit = _unit(assembly, gains, name, bound)
            ET.SubElement(connector, f"{{{SSC}}}{bound.kind}", {"unit": unit} if unit else {})
            used.add(unit)
        if starts[name]:
            bindings = ET.SubElement(component, f"{{{SSD}}}ParameterBindings")
            kind = "application/x-ssp-parameter-set"
            ET.SubElement(bindings, f"{{{SSD}}}ParameterBinding", type=kind, source=f"resources/{name}.ssv")
        _solver(component, name=SOLVER)
    connections = ET.SubElement(top, f"{{{SSD}}}Connections")
    for link in gains.links:
        element = ET.SubElement(
            connections,
            f"{{{SSD}}}Connection",
            startElement=link.source,
            startConnector=link.output.variable,
            endElement=link.target,
            endConnector=link.input.variable,
        )
        if link.gain:
            element.set("suppressUnitConversion", "true")
    _solver(top, name=SOLVER, method="oms_ma", fixedStepSize=repr(system.step))
    _units(root, assembly, used)
    experiment = ET.SubElement(root, f"{{{SSD}}}DefaultExperiment", startTime="0", stopTime=repr(stop_time(system)))
    every = row_steps(system)  # half a step less: a row at the multiples, whatever the rounding of the time
    _solver(experiment, resultFile=f"{system.name}_res.mat", loggingInterval=repr((every - 0.5) * system.step))
    return root


def _solver(element: ET.Element, **settings: str) -> None:
    """Annotate a system with the solver of OMSimulator 3, a component with its name, the experiment with the results.

    Without the name at a component, OMSimulator runs it at steps of 1 ms without a word; others read past it.
    """
    ET.register_namespace("oms", OMS)
    one = ET.SubElement(
        ET.SubElement(element, f"{{{SSD}}}Annotations"), f"{{{SSC}}}Annotation", type="org.openmodelica"
    )
    ET.SubElement(ET.SubElement(one, f"{{{OMS}}}Annotations"), f"{{{OMS}}}SimulationInformation", settings)


def _ports(assembly: Assembly, gains: Gains, name: str) -> Iterable[tuple[str, Bound]]:
    """Return connected inputs, connected and recorded outputs; an input that is not connected keeps its start value."""
    inputs = {link.input.variable: link.input for link in gains.links if link.target == name}
    outputs = {link.output.variable: link.output for link in gains.links if link.source == name}
    outputs |= {b.variable: b for s, b in recorded(assembly).values() if s == name and b.constant is None}
    return [*(("input", b) for b in inputs.values()), *(("output", b) for b in outputs.values())]


def _units(root: ET.Element, assembly: Assembly, used: set[str]) -> None:
    declared = {u.name: u.baseUnit for d in assembly.descriptions.values() for u in d.unitDefinitions if u.baseUnit}
    element = ET.SubElement(root, f"{{{SSD}}}Units")
    for name in sorted(used - {""}):
        base = declared.get(name)
        if base is not None:
            exponents = {s: int(getattr(base, s) or 0) for s in units.BASE}
            factor = float(base.factor)
        else:
            try:
                base_unit = units.base_unit(name)
            except units.UnitError:
                base_unit = None
            exponents, factor = base_unit if base_unit is not None else ({}, 1.0)
        attributes = {s: str(e) for s, e in exponents.items() if e}
        if factor != 1.0:
            attributes["factor"] = repr(factor)
        ET.SubElement(ET.SubElement(element, f"{{{SSC}}}Unit", name=name), f"{{{SSC}}}BaseUnit", attributes)
    if not len(element):
        root.remove(element)


def _values(name: str, starts: Starts, prefix: bool = False) -> ET.Element:
    ET.register_namespace("ssv", SSV)
    root = ET.Element(f"{{{SSV}}}ParameterSet", version="1.0", name=name)
    parameters = ET.SubElement(root, f"{{{SSV}}}Parameters")
    for slot, values in starts.items():
        for bound, value in values:
            text = (
                str(value).lower() if isinstance(value, bool) else str(value) if bound.kind != "Real" else repr(value)
            )
            parameter = ET.SubElement(
                parameters, f"{{{SSV}}}Parameter", name=(f"{slot}." if prefix else "") + bound.variable
            )
            ET.SubElement(parameter, f"{{{SSV}}}{bound.kind}", value=text)
    return root
