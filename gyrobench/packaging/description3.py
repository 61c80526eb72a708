"""modelDescription.xml (FMI 3.0) of a part.

The variables are the scalars of the FMI 2.0 description, with the same structured names and value references
(arrays are not declared as such), and the independent variable after them.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

from gyrobench.component import Component, Scalar
from gyrobench.packaging.dependencies import dependencies
from gyrobench.packaging.description import ATTRIBUTES, number, summary, unit_name, units
from gyrobench.packaging.source import Source

TYPES = {float: "Float64", int: "Int32", bool: "Boolean"}


def time_name(cls: type[Component]) -> str:
    """Return the name of the independent variable: "time", unless the part has a variable of that name."""
    taken = {s.name for s in cls.layout}
    return next(n for n in ("time", "simulation_time", "independent_time") if n not in taken)


def build_description(identifier: str) -> str:
    """Return sources/buildDescription.xml: how to compile the sources."""
    root = ET.Element("fmiBuildDescription", {"fmiVersion": "3.0"})
    one = ET.SubElement(root, "BuildConfiguration", {"modelIdentifier": identifier})
    files = ET.SubElement(one, "SourceFileSet", {"language": "C11"})
    ET.SubElement(files, "SourceFile", {"name": "fmi3.c"})
    return _text(root)


def _text(root: ET.Element) -> str:
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _variable(parent: ET.Element, cls: type[Component], s: Scalar) -> None:
    causality, variability, initial = ATTRIBUTES[s.section]
    kind = TYPES[s.decl.type]
    if kind != "Float64" and variability == "continuous":
        variability = "discrete"
    attributes = {
        "name": s.name,
        "valueReference": str(s.reference),
        "causality": causality,
        "variability": variability,
    }
    if s.decl.doc:
        attributes["description"] = s.decl.doc
    if initial:
        attributes["initial"] = initial
    if kind == "Float64":
        if s.decl.quantity:
            attributes["quantity"] = s.decl.quantity
        attributes["unit"] = unit_name(s)
    if s.section == "derivative":
        attributes["derivative"] = str(next(x for x in cls.states if x.name == s.name[4:-1]).reference)
    if s.section in ("parameter", "input", "state"):
        lo = s.decl.min if s.decl.min is not None else s.decl.above
        hi = s.decl.max if s.decl.max is not None else s.decl.below
        if kind != "Boolean" and lo is not None:
            attributes["min"] = number(lo, s.decl.type)
        if kind != "Boolean" and hi is not None:
            attributes["max"] = number(hi, s.decl.type)
        attributes["start"] = number(s.start, s.decl.type)
    ET.SubElement(parent, kind, attributes)


def model_description3(cls: type[Component], guid: str, identifier: str) -> str:
    """Return the XML text of the native FMI 3.0 FMU."""
    root = ET.Element(
        "fmiModelDescription",
        {
            "fmiVersion": "3.0",
            "modelName": cls.__name__,
            "instantiationToken": guid,
            "description": summary(cls),
            "version": cls.version,
            "license": "BSD-3-Clause",
            "generationTool": "gyrobench",
            "variableNamingConvention": "structured",
        },
    )
    ET.SubElement(
        root,
        "CoSimulation",
        {
            "modelIdentifier": identifier,
            "canGetAndSetFMUState": "true",
            "canSerializeFMUState": "true",
            "providesDirectionalDerivatives": "true",
            "canHandleVariableCommunicationStepSize": "true",
        },
    )
    units(root, cls, extra=("s",))
    categories = ET.SubElement(root, "LogCategories")
    ET.SubElement(categories, "Category", {"name": "logStatusError", "description": "why a call failed"})
    ET.SubElement(root, "DefaultExperiment", {"startTime": "0.0", "stopTime": "1.0", "stepSize": "0.001"})
    variables = ET.SubElement(root, "ModelVariables")
    for s in cls.layout:
        _variable(variables, cls, s)
    time = {"valueReference": str(len(cls.layout)), "causality": "independent", "variability": "continuous"}
    ET.SubElement(variables, "Float64", {"name": time_name(cls), **time, "unit": "s"})

    structure = ET.SubElement(root, "ModelStructure")
    follows = dependencies(Source(cls))
    outputs = [s for s in cls.layout if s.section == "output"]
    derivatives = [s for s in cls.layout if s.section == "derivative"]
    for s in outputs:
        on = [x.reference for x in cls.layout if x.section == "input" and x.decl.name in follows[s.decl.name]]
        on += [x.reference for x in cls.states]
        reference = {"valueReference": str(s.reference), "dependencies": " ".join(map(str, on))}
        ET.SubElement(structure, "Output", reference)
    for s in derivatives:
        ET.SubElement(structure, "ContinuousStateDerivative", {"valueReference": str(s.reference)})
    for s in (*outputs, *derivatives):
        ET.SubElement(structure, "InitialUnknown", {"valueReference": str(s.reference)})
    return _text(root)
