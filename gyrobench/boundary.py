"""The typed boundary: an argument of a call, or a key of a file, of another type than the one written is a UsageError.

    @checked
    def load(name: File, values: Mapping[str, Any] | None = None) -> Experiment: ...

What an annotation admits is found once, from its text: alternatives between ``|``, of a mapping also its keys and
values, of a list its items.  A name that is not in KINDS (a client of dask) admits everything.
"""

from __future__ import annotations

import functools
import inspect
import os
import re
from collections.abc import Callable, Iterable, Mapping
from typing import Any, ParamSpec, TypeVar

import numpy as np
from pydantic import BaseModel, ValidationError

from gyrobench.bench import UsageError, suggest_names
from gyrobench.reading import shorten

P = ParamSpec("P")
T = TypeVar("T")
Test = Callable[[Any], bool]
LONGEST = 1000  # characters of a name


def _name(value: Any) -> bool:
    return isinstance(value, str | os.PathLike) and "\0" not in str(value) and 0 < len(str(value)) <= 4 * LONGEST


#: name in an annotation -> what it admits, and how that is called
KINDS: dict[str, tuple[Test, str]] = {
    "str": (lambda v: isinstance(v, str) and "\0" not in v, "a text"),
    "File": (_name, "a name or path"),
    "bool": (lambda v: isinstance(v, bool | np.bool_), "True or False"),
    "int": (lambda v: isinstance(v, int | np.integer) and not isinstance(v, bool), "a whole number"),
    "float": (lambda v: isinstance(v, int | float | np.integer | np.floating) and not isinstance(v, bool), "a number"),
    "Path": (_name, "a path"),
    "None": (lambda v: v is None, "None"),
    "Callable": (callable, "a function"),
    "Mapping": (lambda v: isinstance(v, Mapping), "a dictionary"),
    "Iterable": (lambda v: isinstance(v, Iterable) and not isinstance(v, str | bytes), "a list"),
    "np.ndarray": (lambda v: isinstance(v, np.ndarray), "an array"),
    "Run": (lambda v: type(v).__name__ == "Run", "a run"),
    "SuiteRun": (lambda v: type(v).__name__ == "SuiteRun", "the run of a suite"),
}


def _split(text: str, mark: str) -> list[str]:
    """Return what stands between marks that are in no bracket."""
    parts = re.split(rf"{re.escape(mark)}(?![^\[]*\])", text)
    return [p.strip() for p in parts]


@functools.cache
def _admits(annotation: str) -> tuple[Test, str] | None:
    """Return the test of an annotation and what it admits, in words; None where it admits everything."""
    tests: list[Test] = []
    words = []
    for alternative in _split(annotation, "|"):
        head, _, inside = alternative.partition("[")
        if head not in KINDS:
            return None
        test, word = KINDS[head]
        inner = [_admits(a) for a in _split(inside[:-1], ",")] if head in ("Mapping", "Iterable") and inside else []
        tests.append(functools.partial(_with_inner, test, inner))
        words.append(word + (" of names" if inner and head == "Mapping" else ""))
    return lambda v: any(t(v) for t in tests), " or ".join(w for w in words if w != "None") or "None"


def _with_inner(test: Test, inner: list[tuple[Test, str] | None], value: Any) -> bool:
    if not test(value):
        return False
    if not inner or not isinstance(value, Mapping | list | tuple):
        return True
    items = [(k, v) for k, v in value.items()] if isinstance(value, Mapping) else [(v,) for v in value]
    return all(one is None or one[0](v) for item in items for v, one in zip(item, inner, strict=False))


def checked(function: Callable[P, T]) -> Callable[P, T]:
    """Raise UsageError where a function is called with arguments of other types, unknown ones or too few."""
    signature = inspect.signature(function)
    annotations = {n: str(p.annotation) for n, p in signature.parameters.items() if n != "self"}
    kinds = {n: p.kind for n, p in signature.parameters.items()}

    @functools.wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> T:
        try:
            given = signature.bind(*args, **kwargs).arguments
        except TypeError as error:
            raise UsageError(f"{function.__name__}: {error}") from None
        for name, annotation in annotations.items():
            admitted = _admits(annotation) if name in given else None
            if admitted is None:
                continue
            values = [given[name]]
            if kinds[name] is inspect.Parameter.VAR_POSITIONAL:
                values = list(given[name])
            elif kinds[name] is inspect.Parameter.VAR_KEYWORD:
                values = list(given[name].values())
            for value in values:
                if not admitted[0](value):
                    shown = shorten(repr(value))
                    raise UsageError(f"{function.__name__}: {name} = {shown}: {admitted[1]} is expected")
        return function(*args, **kwargs)

    return call


def faults_of(error: ValidationError, model_at: Callable[[tuple[int | str, ...]], type[BaseModel]]) -> list[str]:
    """Return all that is wrong with a file that people write; model_at: place of a key -> the model that it is of."""
    found = []
    for fault in error.errors():
        place, model = ".".join(map(str, fault["loc"])), model_at(fault["loc"])
        if fault["type"] == "extra_forbidden":
            known = [field.alias or name for name, field in model.model_fields.items()]
            found.append(f"{place}: unknown key; {suggest_names(str(fault['loc'][-1]), known)}")
            continue
        given = "" if fault["type"] == "missing" else f" = {shorten(repr(fault['input']))}"
        said = str(fault["ctx"]["error"]) if fault["type"] == "value_error" else fault["msg"]
        found.append(f"{place}{given}: {said[:1].lower()}{said[1:]}")
    return found
