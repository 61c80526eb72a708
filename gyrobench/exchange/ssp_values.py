"""Parameter values of an SSP archive: sets (SSV), mappings (SSM), units."""

from __future__ import annotations

import functools
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote
from xml.etree import ElementTree as ET

from gyrobench import reading, units
from gyrobench.errors import GyrobenchError

SSP = "http://ssp-standard.org/SSP1/"
SSD, SSC, SSV, SSM = (
    f"{SSP}SystemStructure{n}" for n in ("Description", "Common", "ParameterValues", "ParameterMapping")
)
NS = {"ssd": SSD, "ssc": SSC, "ssv": SSV, "ssm": SSM}

SCHEMAS = {
    f"{{{SSD}}}SystemStructureDescription": "SystemStructureDescription.xsd",
    f"{{{SSV}}}ParameterSet": "SystemStructureParameterValues.xsd",
    f"{{{SSM}}}ParameterMapping": "SystemStructureParameterMapping.xsd",
}
TOLD = 5  # errors by the schema that are listed of a file

#: types of values -> family; the sized ones are those of SSP 2.0
KINDS = {
    **dict.fromkeys(("Real", "Float64", "Float32"), "Real"),
    **dict.fromkeys(("Integer", *(f"{u}Int{n}" for u in ("", "U") for n in (8, 16, 32, 64))), "Integer"),
    **{n: n for n in ("Boolean", "String", "Enumeration")},
}

Scale = tuple[tuple[Any, ...], float, float]  # exponents, factor, offset: SI = factor * value + offset


class ArchiveError(GyrobenchError, ValueError):
    """Something in an archive that is not read; the text says what."""


class Units:
    """Units by name: those of an SSD or SSV element, and those that the bench knows."""

    def __init__(self, *elements: ET.Element | None) -> None:
        self.declared: dict[str, Scale] = {}
        for element in elements:
            for u in element.findall("ssc:Unit", NS) if element is not None else ():
                base = u.find("ssc:BaseUnit", NS)
                if base is not None:
                    exponents = tuple(int(base.get(s, "0")) for s in units.BASE)
                    scale = float(base.get("factor", "1")), float(base.get("offset", "0"))
                    self.declared[u.get("name", "")] = (exponents, *scale)

    def scale(self, name: str) -> Scale | None:
        """Return exponents, factor and offset of a unit; None where it is not known."""
        if name in self.declared:
            return self.declared[name]
        if name.startswith("[") and name.endswith("]"):  # as on a drawing
            return self.scale(name[1:-1])
        try:
            u = units.unit(name)
        except units.UnitError:
            return None
        return tuple(u.exponents), u.factor, u.offset

    def convert(self, source: str, target: str) -> tuple[float, float]:
        """Return (factor, offset) from one unit to another; (1, 0) where one is not given, or is "1" as no unit.

        Raises ArchiveError for units that are not known, or not of one dimension (rad may be left out).
        """
        if not source or not target or source == target:
            return 1.0, 0.0
        a, b = self.scale(source), self.scale(target)
        if a is None or b is None:
            raise ArchiveError(f"unit '{source if a is None else target}' is not known")
        if a[0][:-1] != b[0][:-1]:
            if "1" in (source, target):  # a connector that takes any unit often says so
                return 1.0, 0.0
            raise ArchiveError(f"{source} into {target}: the dimensions differ")
        return a[1] / b[1], (a[2] - b[2]) / b[1]


@dataclass(frozen=True)
class SspValue:
    """One value of a parameter set."""

    kind: str  # "Real", "Integer", "Boolean", "String", "Enumeration"
    value: Any
    unit: str = ""


def transformation(element: ET.Element) -> tuple[float, float]:
    """Return factor and offset of a connection or mapping entry.  Raises ArchiveError for another transformation."""
    for child in element:
        name = child.tag.rpartition("}")[2]
        if name == "LinearTransformation":
            return float(child.get("factor", "1")), float(child.get("offset", "0"))
        if name.endswith("Transformation"):
            raise ArchiveError(f"a transformation of the kind {name} is not read")
    return 1.0, 0.0


def _values(element: ET.Element) -> dict[str, SspValue]:
    found = {}
    for p in element.findall("ssv:Parameters/ssv:Parameter", NS):
        child, name = next(iter(p), None), p.get("name", "")
        if child is None:
            raise ArchiveError(f"parameter '{name}' has no value")
        stated, text = child.tag.rpartition("}")[2], child.get("value", "")
        kind = KINDS.get(stated, "")
        if not kind:
            raise ArchiveError(f"parameter '{name}': type {stated} is not read")
        try:
            value: Any = text
            if kind == "Real":
                value = float(text)
            elif kind in ("Integer", "Enumeration"):
                value = int(text)
            elif kind == "Boolean":
                value = text in ("true", "1")
        except ValueError:
            raise ArchiveError(f"parameter '{name}' = '{text}': not a value of the type {kind}") from None
        found[name] = SspValue(kind, value, child.get("unit", ""))
    return found


@functools.cache
def _schema(name: str) -> Any:
    import fmpy.ssp
    from lxml import etree

    return etree.XMLSchema(etree.parse(Path(fmpy.ssp.__file__).parent / "schema" / name))


def schema_errors(file: Path, source: str) -> list[str]:
    """Return what the schema of SSP 1.0 forbids in a file that is XML, the first places; nothing of a later version.

    Raises ArchiveError for a namespace that is no URI.
    """
    from lxml import etree

    try:
        root = etree.fromstring(file.read_bytes(), etree.XMLParser(resolve_entities=False, no_network=True))
    except etree.XMLSyntaxError as error:  # the other reader took it: a namespace that is no URI
        raise ArchiveError(f"{source}: {error.msg}") from None
    if root.tag not in SCHEMAS or root.get("version") != "1.0":
        return []
    schema = _schema(SCHEMAS[root.tag])
    schema.validate(root)
    found = [f"{source}, line {e.line}: {re.sub('{[^}]*}', '', e.message)}" for e in schema.error_log]
    more = [f"{source}: {len(found) - TOLD} more of the kind"] if len(found) > TOLD else []
    return [f"against the schema of SSP 1.0: {x}" for x in (*found[:TOLD], *more)]


def _read(binding: ET.Element, folder: Path, inline: str, what: str, schema: list[str]) -> ET.Element | None:
    """Return an element that stands in the binding or in the file that it names."""
    element = binding.find(inline, NS)
    source = binding.get("source")
    if element is not None or source is None:
        return element
    if binding.get("sourceBase", "SSD") != "SSD":
        raise ArchiveError(f"{what} {source}: a source inside a component is not read")
    file = (folder / unquote(source)).resolve()
    if not file.is_relative_to(folder.resolve()) or not file.is_file():
        raise ArchiveError(f"{what} {source}: no such file in the archive")
    found = reading.xml(file.read_bytes(), f"{what} {source}", ArchiveError)
    schema += [e for e in schema_errors(file, source) if e not in schema]
    return found


def bound_values(
    element: ET.Element, folder: Path, ssd_units: ET.Element | None, schema: list[str]
) -> Iterator[tuple[str, SspValue, Units]]:
    """Yield name, value and units of all that is bound to a system or a component, after mappings.

    With a mapping only its entries are applied, those without a source to nothing.  schema: gets what the schemas
    forbid in the files.  Raises ArchiveError.
    """
    for binding in element.findall("ssd:ParameterBindings/ssd:ParameterBinding", NS):
        kind = binding.get("type", "application/x-ssp-parameter-set")
        if kind != "application/x-ssp-parameter-set":
            raise ArchiveError(f"parameters of the type {kind} are not read")
        holder = binding.find("ssd:ParameterValues", NS)
        found = _read(binding, folder, "ssd:ParameterValues/ssv:ParameterSet", "parameter set", schema)
        if found is None:
            raise ArchiveError("a parameter binding has neither source nor values" if holder is None else "no values")
        known = Units(ssd_units, found.find("ssv:Units", NS))
        values = {binding.get("prefix", "") + n: v for n, v in _values(found).items()}
        mapping = binding.find("ssd:ParameterMapping", NS)
        if mapping is None:
            yield from ((name, value, known) for name, value in values.items())
            continue
        entries = _read(mapping, folder, "ssm:ParameterMapping", "parameter mapping", schema)
        if entries is None:
            raise ArchiveError("a parameter mapping has neither source nor entries")
        for entry in entries.findall("ssm:MappingEntry", NS):
            source, target = entry.get("source", ""), entry.get("target", "")
            if not source:
                continue
            if not target:
                raise ArchiveError(f"parameter mapping: the entry of {source} has no target")
            if source not in values:
                raise ArchiveError(f"parameter mapping: no parameter '{source}' in the set for {target}")
            yield target, _mapped(entry, values[source]), known


def _mapped(entry: ET.Element, value: SspValue) -> SspValue:
    factor, offset = transformation(entry)
    suppressed = entry.get("suppressUnitConversion") == "true"
    if (factor, offset) == (1.0, 0.0):
        return SspValue(value.kind, value.value, "" if suppressed else value.unit)
    if value.kind not in ("Real", "Integer"):
        raise ArchiveError(f"parameter mapping: {entry.get('source')} is {value.kind}, which no factor applies to")
    if offset and value.unit and not suppressed:
        raise ArchiveError(
            f"parameter mapping: {entry.get('source')}: an offset beside a unit conversion has no defined order; "
            "set suppressUnitConversion"
        )
    return SspValue(value.kind, factor * value.value + offset, "" if suppressed else value.unit)


def as_kind(name: str, value: SspValue, kind: str, target_unit: str, known: Units) -> Any:
    """Return a value as one of a variable of the FMU, in its unit.  Raises ArchiveError."""
    if kind == "Real" and value.kind in ("Real", "Integer"):
        factor, offset = known.convert(value.unit, target_unit)
        return float(value.value) if (factor, offset) == (1.0, 0.0) else factor * value.value + offset
    if kind == "Integer" and value.kind in ("Integer", "Enumeration"):
        return value.value
    if kind == value.kind:
        return value.value
    raise ArchiveError(f"{name}: a value of the type {value.kind} for a variable of the type {kind}")
