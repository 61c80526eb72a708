"""Variables of an FMU (FMI 2.0 or 3.0) as scalars: an array of FMI 3.0 counts as its elements, ``omega[1]`` ..."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gyrobench.component.declarations import element_names
from gyrobench.files import check_description, sha256

#: type of an FMU variable -> family: what can be connected with what, and how values are given as text
FAMILIES = {
    "Real": "Real",
    "Float64": "Real",
    "Float32": "Real",
    "Boolean": "Boolean",
    "String": "String",
    **dict.fromkeys(("Integer", "Enumeration", "Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32"), "Integer"),
    **dict.fromkeys(("Int64", "UInt64"), "Integer"),
}


@dataclass(frozen=True)
class Variable:
    """A scalar variable of an FMU, or one element of an array.

    type: as the description has it.  kind: its family, "Real", "Integer", "Boolean", "String"; "" for others.
    index, size: place in the array and its number of elements; 0 and 0 for a scalar.
    """

    name: str
    array: str  # name of the variable of the FMU: that of the array for an element
    causality: str
    type: str
    kind: str
    reference: int
    index: int
    size: int
    unit: str
    quantity: str
    start: str | None
    description: str


def read_description(path: Path) -> Any:
    """Return the model description of an FMU as FMPy reads it, without validation.

    A process reads a file of the same content once: what is returned is not to be changed.  Raises
    OversizedArchiveError, and what the zip archive, the XML and FMPy raise.
    """
    return _read_description(path, sha256(path))


@functools.lru_cache(maxsize=128)
def _read_description(path: Path, _digest: str) -> Any:
    from fmpy import read_model_description

    check_description(path)
    return read_model_description(str(path), validate=False)


def variables(description: Any) -> dict[str, Variable]:
    """Return all variables of an FMPy model description by name, arrays as their elements.

    The size of an array is that of its start values; structural parameters are not changed.
    """
    found = {}
    for v in description.modelVariables:
        shape = tuple(v.shape or ())
        names = element_names(v.name, shape)
        declared = v.declaredType
        for index, (name, start) in enumerate(zip(names, start_values(v), strict=True)):
            found[name] = Variable(
                name, v.name, v.causality or "local", v.type, FAMILIES.get(v.type, ""), int(v.valueReference), index,
                len(names) if shape else 0, v.unit or getattr(declared, "unit", None) or "",
                v.quantity or getattr(declared, "quantity", None) or "", start, v.description or "",
            )  # fmt: skip
    return found


def start_values(variable: Any) -> list[str | None]:
    """Return the start values of a variable of the model description, element by element, as text; None: undeclared."""
    size = math.prod(variable.shape or ())
    if not variable.shape or variable.start is None:
        return [variable.start] * size
    texts = variable.start.split()
    return texts * size if len(texts) == 1 else [*texts[:size], *[None] * (size - len(texts))]


def feedthrough(description: Any) -> dict[str, set[str]]:
    """Return the inputs on which each output of an FMU depends at once (FMPy model description), scalar by scalar.

    An output without a ``dependencies`` attribute, or not listed in the ModelStructure, depends on all inputs.
    """
    elements: dict[str, dict[str, list[str]]] = {"input": {}, "output": {}}  # of each variable, and of its aliases
    for v in description.modelVariables:
        if v.causality in elements:
            own = v if v.alias is None else v.alias
            elements[v.causality].setdefault(own.name, []).extend(element_names(v.name, tuple(v.shape or ())))
    inputs = {e for names in elements["input"].values() for e in names}
    declared = {u.variable.name: u.dependencies for u in description.outputs if u.variable is not None}
    result = {}
    for name, outputs in elements["output"].items():
        known = declared.get(name)
        follows = inputs if known is None else {e for d in known for e in elements["input"].get(d.name, ())}
        result.update({output: set(follows) for output in outputs})
    return result
