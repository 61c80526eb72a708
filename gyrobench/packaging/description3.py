"""modelDescription.xml (FMI 3.0) of a part.

The variables are the independent variable, whose value reference is 0, and what the part declares: a vector or matrix
is one variable with dimensions, its values row by row.  Value references are larger by one than in the FMI 2.0
description; an array has that of its first element.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Collection, Iterable, Mapping, Sequence

from gyrobench.component import Component, Scalar
from gyrobench.packaging.dependencies import dependencies
from gyrobench.packaging.description import (
    ATTRIBUTES,
    EMPTY,
    add_common,
    default_experiment,
    initial_references,
    licence,
    of_values,
    summary,
    units,
    xml_text,
)
from gyrobench.packaging.native_target import variables
from gyrobench.packaging.source import PartCode
from gyrobench.packaging.tuning import tuning

TYPES = {float: "Float64", int: "Int32", bool: "Boolean"}


def reference(s: Scalar) -> str:
    """Return the value reference of a scalar, or of the array that begins with it: 0 is the time's."""
    return str(s.reference + 1)


def time_name(cls: type[Component]) -> str:
    """Return the name of the independent variable: "time", unless the part has a variable of that name."""
    taken = {s.name.partition("[")[0] for s in cls.layout}
    return next(n for n in ("time", "simulation_time", "independent_time") if n not in taken)


def build_description(identifier: str, beside: Iterable[str] = ()) -> str:
    """Return sources/buildDescription.xml: how to compile the sources.  beside: C files beside fmi3.c."""
    root = ET.Element("fmiBuildDescription", {"fmiVersion": "3.0"})
    one = ET.SubElement(root, "BuildConfiguration", {"modelIdentifier": identifier})
    files = ET.SubElement(one, "SourceFileSet", {"language": "C11"})
    for name in ("fmi3.c", *beside):
        ET.SubElement(files, "SourceFile", {"name": name})
    return xml_text(root)


def array_name(s: Scalar) -> str:
    """Return the name of the variable that a scalar is an element of, or its own."""
    return f"der({s.decl.name})" if s.section == "derivative" else s.decl.name


def add_variable(
    parent: ET.Element, cls: type[Component], s: Scalar, tunable: Collection[int], sizes: Mapping[str, float],
    array: Sequence[Scalar] = (),
) -> None:  # fmt: skip
    """Add a variable: the scalar, or the array of these elements, of which it is the first."""
    causality, variability, initial = ATTRIBUTES[s.section]
    variability = "tunable" if s.reference in tunable else variability
    kind = TYPES[s.decl.type]
    if kind != "Float64" and variability == "continuous":
        variability = "discrete"
    attributes = {
        "name": array_name(s) if array else s.name,
        "valueReference": reference(s),
        "causality": causality,
        "variability": variability,
    }
    if s.decl.doc:
        attributes["description"] = s.decl.doc
    if initial:
        attributes["initial"] = initial
    attributes |= of_values(array or (s,), sizes)
    if s.section == "derivative":
        attributes["derivative"] = reference(next(x for x in cls.states if x.name == s.name[4:-1]))
    variable = ET.SubElement(parent, kind, attributes)
    for n in s.decl.shape if array else ():
        ET.SubElement(variable, "Dimension", {"start": str(n)})


def add_time(parent: ET.Element, cls: type[Component]) -> None:
    """Add the independent variable, of reference 0."""
    time = {"valueReference": "0", "causality": "independent", "variability": "continuous"}
    ET.SubElement(parent, "Float64", {"name": time_name(cls), **time, "unit": "s"})


def model_description3(cls: type[Component], guid: str, identifier: str, sizes: Mapping[str, float] = EMPTY) -> str:
    """Return the XML text of the native FMI 3.0 FMU; sizes: see :func:`nominal`."""
    root = ET.Element(
        "fmiModelDescription",
        {
            "fmiVersion": "3.0",
            "modelName": cls.__name__,
            "instantiationToken": guid,
            "description": summary(cls),
            "version": cls.version,
            **licence(cls),
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
    declared = add_common(root, units(cls.layout, "s"), default_experiment(cls))
    add_time(declared, cls)
    every, tunable = variables(cls), tuning(cls).tunable
    for v in every:
        add_variable(declared, cls, v[0], tunable, sizes, v if v[0].decl.shape else ())

    structure = ET.SubElement(root, "ModelStructure")
    source = PartCode(cls)
    follows, initial = dependencies(source), initial_references(cls, source)
    firsts = [v[0] for v in every]
    outputs = [s for s in firsts if s.section == "output"]
    derivatives = [s for s in firsts if s.section == "derivative"]
    states = [s for s in firsts if s.section == "state"]
    for s in outputs:
        on = [x for x in firsts if x.section == "input" and x.decl.name in follows[s.decl.name]]
        known = " ".join(reference(x) for x in (*on, *states))
        ET.SubElement(structure, "Output", {"valueReference": reference(s), "dependencies": known})
    for s in derivatives:
        ET.SubElement(structure, "ContinuousStateDerivative", {"valueReference": reference(s)})
    for s in (*outputs, *derivatives):
        known = " ".join(reference(x) for x in firsts if x.reference in initial[s.name])
        ET.SubElement(structure, "InitialUnknown", {"valueReference": reference(s), "dependencies": known})
    return xml_text(root)
