"""Values of options and parameters: numbers with units, arrays by element."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from typing import Any

from gyrobench import reading, units
from gyrobench.errors import GyrobenchError


class InvalidValueError(GyrobenchError, ValueError):
    """A value that cannot be used; the message says which, why and what would be right."""


def flatten(name: str, value: Any) -> dict[str, Any]:
    """``("faces", [[1, 0]])`` -> ``{"faces[1,1]": 1, "faces[1,2]": 0}``; a scalar keeps its name."""
    found: dict[str, Any] = {}

    def walk(v: Any, index: tuple[int, ...]) -> None:
        if hasattr(v, "tolist"):
            v = v.tolist()
        if isinstance(v, list | tuple):
            for k, e in enumerate(v, 1):
                walk(e, (*index, k))
        else:
            found[f"{name}[{','.join(map(str, index))}]" if index else name] = v

    walk(value, ())
    return found


@functools.lru_cache(maxsize=1 << 16)  # every run of a system asks for the same thousands of names
def _place(key: str) -> tuple[str, tuple[int, ...]]:
    """``"faces[1,2]"`` -> ``("faces", (1, 2))``; a scalar has no index."""
    name, bracket, index = key.partition("[")
    return (name, tuple(map(int, index[:-1].split(",")))) if bracket else (key, ())


def nest(values: Mapping[str, Any]) -> dict[str, Any]:
    """The inverse of :func:`flatten`: ``{"a[1]": 1, "a[2]": 2, "b": 3}`` -> ``{"a": [1, 2], "b": 3}``"""
    nested: dict[str, Any] = {}
    arrays: dict[str, dict[int, Any]] = {}  # index -> value, or the same of the next index
    for key, value in values.items():
        name, index = _place(key)
        if not index:
            nested[name] = value
            continue
        cells = arrays.setdefault(name, {})
        nested.setdefault(name, None)  # its place
        for i in index[:-1]:
            cells = cells.setdefault(i, {})
        cells[index[-1]] = value

    def build(cells: dict[int, Any]) -> list[Any]:
        ordered = [cells[k] for k in sorted(cells)]
        return [build(c) for c in ordered] if isinstance(ordered[0], dict) else ordered

    return nested | {name: build(cells) for name, cells in arrays.items()}


def with_elements(parameters: Mapping[str, Any], changed: Mapping[str, Any]) -> dict[str, Any]:
    """Return parameters with some of them, or elements of arrays ("a[1,2]"), changed."""
    names = {_place(key)[0] for key in changed}
    elements = {k: v for n in names for k, v in flatten(n, parameters[n]).items()}
    return {**parameters, **nest(elements | dict(changed))}


def parse_number(name: str, value: Any, unit: str = "1") -> float:
    """Return one number in SI, see :func:`parse`.  Raises InvalidValueError for a list too."""
    number = parse(name, value, unit)
    if isinstance(number, list):
        raise InvalidValueError(f"{name} = {reading.shorten(str(value))}: one number is expected, not a list")
    return float(number)


def parse(name: str, value: Any, unit: str = "1", kind: type = float) -> Any:
    """A value as SI number(s): a number, a text with an optional unit, a list (or its JSON text) of these.

    A coefficient per power of g may be given per g (``0.9deg/h/g``).  Raises :class:`InvalidValueError` for text that
    is not a quantity, a wrong dimension, a value that is not finite, or a fraction where an integer is asked for.
    """
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, str):
        text = value.strip()
        if kind is str:
            return text
        if text.startswith("["):
            value = reading.json_value(text, f"{name} = {reading.shorten(text)}", InvalidValueError)
        elif kind is bool and text.lower() in ("true", "false"):
            return text.lower() == "true"
        else:
            try:
                value = units.parse_quantity(text, unit or "1", per_g0=True)
            except units.UnitError as error:
                why = f"'{reading.shorten(text)}': true or false is expected" if kind is bool else error
                raise InvalidValueError(f"{name}: {why}") from None
    if isinstance(value, list | tuple):
        return [parse(f"{name}[{k}]", v, unit, kind) for k, v in enumerate(value, 1)]
    if kind is str:
        return str(value)
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        raise InvalidValueError(f"{name} = {value!r}: a number is expected, or a text with number and unit") from None
    if not math.isfinite(number):
        raise InvalidValueError(f"{name} = {number}: must be finite")
    if kind in (int, bool):
        if number != math.floor(number):
            raise InvalidValueError(f"{name} = {number:g}: must be an integer")
        return kind(number)
    return number
