"""modelDescription.xml (FMI 2.0) of a part: units, bounds, starts, dependencies, initial unknowns."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Collection, Iterable, Mapping, Sequence

from gyrobench.component import Component, Scalar
from gyrobench.packaging.dependencies import dependencies, initial_dependencies
from gyrobench.packaging.documentation import LICENCE, is_standard
from gyrobench.packaging.loading import sources
from gyrobench.packaging.own_controller.c_law import UNIT
from gyrobench.packaging.source import PartCode
from gyrobench.packaging.tuning import tuning
from gyrobench.units import OFFERED, base_unit, shown_in, unit

#: section -> causality, variability, initial
ATTRIBUTES = {
    "parameter": ("parameter", "fixed", "exact"),
    "input": ("input", "continuous", None),
    "output": ("output", "continuous", "calculated"),
    "state": ("local", "continuous", "exact"),
    "derivative": ("local", "continuous", "calculated"),
    "discrete": ("local", "discrete", "calculated"),
}
EMPTY: Mapping[str, float] = {}
LONGEST = 1.0  # s; a longer "largest internal step" stands for any
TYPES = {float: "Real", int: "Integer", bool: "Boolean"}


def summary(cls: type[Component]) -> str:
    """Return the first line of the docstring, without its source marks."""
    return (cls.__doc__ or cls.__name__).strip().splitlines()[0].split("  [")[0].rstrip(".")


def number(x: float, kind: type) -> str:
    if kind is bool:
        return "true" if x else "false"
    return str(int(x)) if kind is int else repr(x)


def unit_name(s: Scalar) -> str:
    """Return the unit of a scalar; that of a state derivative is the state's per second."""
    return f"{s.decl.unit}/s" if s.section == "derivative" else s.decl.unit


def unit_attributes(name: str, start: float | None = None) -> dict[str, str]:
    """Return unit and unit of the display of a signal, or of a parameter with its start: a drift in degrees an hour."""
    shown = shown_in(math.inf if start is None else start, name)
    return {"unit": name} if shown == name else {"unit": name, "displayUnit": shown}


def nominal(elements: Sequence[Scalar], sizes: Mapping[str, float]) -> dict[str, str]:
    """Return the nominal value of a variable, a power of ten; nothing where its size is not known.

    sizes: the largest of each scalar in the reference run of the part.  Of others it is that of the start value.
    """
    known = [abs(sizes.get(s.name) or (0.0 if s.section == "output" else s.start)) for s in elements]
    largest = max(known, default=0.0)
    return {"nominal": f"{10.0 ** round(math.log10(largest)):g}"} if 0.0 < largest < math.inf else {}


def add_variable(
    parent: ET.Element, cls: type[Component], s: Scalar, tunable: Collection[int], sizes: Mapping[str, float]
) -> None:
    """Add a variable.  tunable: value references of the parameters that may be set between steps."""
    causality, variability, initial = ATTRIBUTES[s.section]
    variability = "tunable" if s.reference in tunable else variability
    d = s.decl
    kind = TYPES[d.type]
    if kind != "Real" and variability == "continuous":
        variability = "discrete"
    attributes = {
        "name": s.name,
        "valueReference": str(s.reference),
        "causality": causality,
        "variability": variability,
    }
    if initial:
        attributes["initial"] = initial
    if d.doc:
        attributes["description"] = d.doc
    v = ET.SubElement(parent, "ScalarVariable", attributes)
    of_type = of_values((s,), sizes)
    if s.section == "derivative":
        state = next(x for x in cls.states if x.name == s.name[4:-1])
        of_type["derivative"] = str(state.reference + 1)
    ET.SubElement(v, kind, of_type)


def of_values(elements: Sequence[Scalar], sizes: Mapping[str, float]) -> dict[str, str]:
    """Return quantity, unit, nominal value, limits and start of a variable with these elements."""
    s, found = elements[0], dict[str, str]()
    d = s.decl
    if d.type is float:
        found |= {"quantity": d.quantity} if d.quantity else {}
        found |= unit_attributes(unit_name(s), s.start if s.section == "parameter" else None) | nominal(elements, sizes)
    if s.section in ("parameter", "input", "state"):
        limits = {"min": d.above if d.min is None else d.min, "max": d.below if d.max is None else d.max}
        found |= {n: number(x, d.type) for n, x in limits.items() if x is not None and d.type is not bool}
        found["start"] = " ".join(number(e.start, d.type) for e in elements)
    return found


def add_common(root: ET.Element, units: ET.Element, experiment: Mapping[str, str]) -> ET.Element:
    """Add units, log category and default experiment; return the element of the variables."""
    root.append(units)
    categories = ET.SubElement(root, "LogCategories")
    ET.SubElement(categories, "Category", {"name": "logStatusError", "description": "why a call failed"})
    ET.SubElement(root, "DefaultExperiment", dict(experiment))
    return ET.SubElement(root, "ModelVariables")


def xml_text(root: ET.Element) -> str:
    """Return the document, indented."""
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def units(layout: Iterable[Scalar], *more: str) -> ET.Element:
    """Return the definitions of all units in use, see :func:`unit_definitions`."""
    return unit_definitions({unit_name(s) for s in layout if s.decl.type is float}.union(more))


def unit_definitions(names: Iterable[str]) -> ET.Element:
    """Return the definitions of units, spelled out in base units."""
    definitions = ET.Element("UnitDefinitions")
    for name in sorted(names):
        u = ET.SubElement(definitions, "Unit", {"name": name})
        base = base_unit(name)
        if base is not None:  # FMI has whole exponents only: sqrt(Hz) is named but not spelled out
            exponents, factor = base
            attributes = {k: str(v) for k, v in exponents.items() if v}
            if factor != 1.0:
                attributes["factor"] = repr(factor)
            ET.SubElement(u, "BaseUnit", attributes)
        for shown in OFFERED.get(name, ()):  # a value in it is the factor times the value in the unit
            ET.SubElement(u, "DisplayUnit", {"name": shown, "factor": repr(unit(name).factor / unit(shown).factor)})
    return definitions


def default_experiment(cls: type[Component]) -> dict[str, str]:
    """Return the experiment that a part is made for: a thousand steps of the size that it declares.

    A part that declares none, or one for each communication step (1e9 s), takes any step: then they have 1 ms.
    """
    declared = cls.declarations.get("step")
    step = float(declared.start) if declared is not None else math.inf
    step = step if step <= LONGEST else 1e-3
    return {"startTime": "0.0", "stopTime": repr(float(f"{1000.0 * step:.12g}")), "stepSize": repr(step)}


def licence(cls: type[Component]) -> dict[str, str]:
    """Return the attribute of the licence, of a part of the standard bench; a user's own part has the user's."""
    return {"license": LICENCE} if is_standard(sources(cls).values()) else {}


def c_units(cls: type[Component]) -> tuple[str, ...]:
    """Return the files of C that are compiled beside that of the FMI version."""
    return () if cls._outside is None else (UNIT,)


def model_description(
    cls: type[Component], guid: str, identifier: str, target: str, sizes: Mapping[str, float] = EMPTY
) -> str:
    """Return the XML text.

    target: "native" or "python", what each can do differs.  sizes: see :func:`nominal`.
    """
    source = PartCode(cls)
    root = ET.Element(
        "fmiModelDescription",
        {
            "fmiVersion": "2.0",
            "modelName": cls.__name__,
            "guid": guid,
            "description": summary(cls),
            "version": cls.version,
            **licence(cls),
            "generationTool": "gyrobench",
            "variableNamingConvention": "structured",
            "numberOfEventIndicators": "0",
        },
    )
    native = target == "native"
    co = ET.SubElement(
        root,
        "CoSimulation",
        {
            "modelIdentifier": identifier,
            "needsExecutionTool": str(not native).lower(),
            "canHandleVariableCommunicationStepSize": "true",
            "canNotUseMemoryManagementFunctions": "true",
            "canGetAndSetFMUstate": "true",
            "canSerializeFMUstate": "true",
            "providesDirectionalDerivative": str(native).lower(),
        },
    )
    if native:
        files = ET.SubElement(co, "SourceFiles")
        for name in ("fmi2.c", *c_units(cls)):
            ET.SubElement(files, "File", {"name": name})
    variables = add_common(root, units(cls.layout), default_experiment(cls))
    tunable = tuning(cls).tunable
    for s in cls.layout:
        add_variable(variables, cls, s, tunable, sizes)
    _structure(ET.SubElement(root, "ModelStructure"), cls, source)
    return xml_text(root)


def _structure(parent: ET.Element, cls: type[Component], source: PartCode) -> None:
    """Add the outputs with the inputs and states they follow without delay, derivatives and initial unknowns."""
    follows = dependencies(source)
    outputs = [s for s in cls.layout if s.section == "output"]
    derivatives = [s for s in cls.layout if s.section == "derivative"]
    node = ET.SubElement(parent, "Outputs") if outputs else None
    for s in outputs:
        on = follows.get(s.decl.name, set())
        indices = [x.reference + 1 for x in cls.layout if x.section == "input" and x.decl.name in on]
        indices += [x.reference + 1 for x in cls.states]
        assert node is not None
        ET.SubElement(node, "Unknown", {"index": str(s.reference + 1), "dependencies": " ".join(map(str, indices))})
    if derivatives:
        node = ET.SubElement(parent, "Derivatives")
        for s in derivatives:
            ET.SubElement(node, "Unknown", {"index": str(s.reference + 1)})
    if outputs or derivatives:
        node = ET.SubElement(parent, "InitialUnknowns")
        known = initial_references(cls, source)
        for s in (*outputs, *derivatives):
            on_index = " ".join(str(r + 1) for r in known[s.name])
            ET.SubElement(node, "Unknown", {"index": str(s.reference + 1), "dependencies": on_index})


def initial_references(cls: type[Component], source: PartCode) -> dict[str, list[int]]:
    """Return the places of the variables that outputs and derivatives depend on during initialization, by name."""
    follows = initial_dependencies(source)
    known = [x for x in cls.layout if x.section in ("parameter", "input", "state")]
    found = {}
    for s in cls.layout:
        if s.section in ("output", "derivative"):
            on = follows[s.decl.name if s.section == "output" else f"der.{s.decl.name}"]
            found[s.name] = [x.reference for x in known if x.decl.name in on]
    return found
