"""JSON content of results and comparisons, both ways, by the types of their fields.

    content(result)                  # dictionaries and lists, as in result.json
    typed(LoopResult, data)          # the inverse

A field stands under its name unless its metadata say otherwise: ``key``, another name; ``empty``, {} stands for None;
``flat``, its keys stand beside those of the entry.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import Field, fields, is_dataclass
from types import NoneType, UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

from gyrobench.errors import GyrobenchError

#: texts that files of version 0.1.0 do not have, or need not have
OLDER = {"id": "", "title": "", "caption": ""}
#: of an entry that may be missing: None in Python, {} in the file
EMPTY = {"empty": True}


class ResultError(GyrobenchError, ValueError):
    """Raised for a result.json that cannot be read; the text says why."""


def content(value: Any) -> Any:
    """Return dataclasses, lists and mappings as JSON objects and arrays; anything else as it is."""
    if isinstance(value, list | tuple):
        return [v if isinstance(v, float | str) else content(v) for v in value]
    if isinstance(value, Mapping):
        return {k: content(v) for k, v in value.items()}
    if not is_dataclass(value):
        return value
    found: dict[str, Any] = {}
    for f in fields(value):
        held = getattr(value, f.name)
        if f.metadata.get("flat"):
            found.update(held)
        else:
            found[_key(f)] = {} if held is None and f.metadata.get("empty") else content(held)
    return found


def typed(kind: Any, value: Any) -> Any:
    """Return JSON content as a value of a type: dataclasses, containers of them; null of a number is NaN.

    Raises TypeError for content of another form, an unknown or a missing key.
    """
    origin, args = get_origin(kind), get_args(kind)
    if kind is float:
        return math.nan if value is None else value
    if origin in (Union, UnionType):
        if value is None or (value == {} and is_dataclass(args[0])):
            return None
        return typed(next(a for a in args if a is not NoneType), value)
    if is_dataclass(kind):
        return _entry(kind, value)
    if origin in (list, Sequence, tuple):
        if not isinstance(value, list | tuple):
            raise TypeError(f"{value!r:.40} is no list")
        each = args * len(value) if origin is not tuple or args[-1] is ... else args
        found = [typed(a, v) for a, v in zip(each, value, strict=False)]
        return tuple(found) if origin is tuple else found
    if origin in (dict, Mapping):
        return {k: typed(args[1], v) for k, v in _object(value).items()}
    return value


def _entry(kind: Any, value: Any) -> Any:
    by_key, flat = _fields(kind)
    given: dict[str, Any] = {k: v for k, v in OLDER.items() if k in by_key}
    rest = {}
    for key, v in _object(value).items():
        if flat and key not in by_key:
            rest[key] = v
        else:
            name, hint = by_key.get(key, (key, Any))  # of an unknown key the class complains
            given[name] = typed(hint, v)
    return kind(**given, **({flat: rest} if flat else {}))


def _object(value: Any) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise TypeError(f"{value!r:.40} is no object")
    return value


def _key(f: Field[Any]) -> str:
    return str(f.metadata.get("key", f.name))


@functools.cache
def _fields(kind: Any) -> tuple[dict[str, tuple[str, Any]], str]:
    """Return key -> name and type of the fields of a dataclass, and the name of its flat one, "" where it has none."""
    hints = get_type_hints(kind)
    own = {_key(f): (f.name, hints[f.name]) for f in fields(kind) if not f.metadata.get("flat")}
    return own, next((f.name for f in fields(kind) if f.metadata.get("flat")), "")
