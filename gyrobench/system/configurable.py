"""Common base of system and suite: a name, a title, options with values; loading."""

from __future__ import annotations

import copy
import functools
import importlib.util
import math
import sys
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Self

from gyrobench.bench import Bench
from gyrobench.errors import GyrobenchError
from gyrobench.reading import shorten
from gyrobench.system.bare_numbers import question, usual_size
from gyrobench.system.values import InvalidValueError, flatten, parse
from gyrobench.user_code import blamed, check_attributes

#: unit of options -> the one that people write
HINTS = {"rad": "deg", "rad/s": "deg/h"}


class InvalidConfigurationError(GyrobenchError):
    """The system refuses to run with these values; ``problems`` lists why."""

    def __init__(self, name: str, problems: list[str]) -> None:
        self.problems = problems
        super().__init__("\n".join([f"{name} refuses to run:", *(f"  - {p}" for p in problems)]))


def _bound(value: float, unit: str) -> str:
    """A bound with its unit; an angle in degrees too, as nobody writes a latitude in radians."""
    shown = f"{value:g}" if unit == "1" else f"{value:g} {unit}"
    return f"{shown} ({math.degrees(value):.6g}deg)" if unit == "rad" and value else shown


def _unit_hint(name: str, given: str, unit: str) -> str:
    """Return the end of a message about a number that was given without its unit."""
    if unit not in HINTS or given[-1:].isalpha():
        return ""
    return f"; a number without unit is in {unit}, write for example {name}={given}{HINTS[unit]}"


@dataclass(frozen=True)
class Option:
    """A value that the user may set; ``default`` may carry a unit.  ``unit`` int, bool or str: of that type.

    sets: parameters of parts that the option owns, which take its value: "site.latitude stand.latitude".  form: text ->
    why the reduction of a run would refuse it, "" where it would not.
    """

    default: Any
    unit: str | type
    doc: str = ""
    min: float | None = None
    max: float | None = None
    sets: str = ""
    form: Callable[[str], str] | None = None

    @property
    def kind(self) -> type:
        return self.unit if isinstance(self.unit, type) else float

    def parse(self, name: str, value: Any) -> Any:
        """The SI value; raises InvalidValueError for a wrong dimension or a broken bound."""
        unit = "1" if isinstance(self.unit, type) else self.unit
        number = parse(name, value, unit, self.kind)
        if isinstance(number, list) and not isinstance(self.default, list | tuple):
            raise InvalidValueError(f"{name} = {shorten(str(value))}: a list, where one value is expected")
        if not isinstance(number, str | list):
            given = value.strip() if isinstance(value, str) else f"{number:g}"
            hint = _unit_hint(name, given, unit)
            if self.min is not None and not number >= self.min:
                raise InvalidValueError(f"{name} = {given}: must be >= {_bound(self.min, unit)}{hint}")
            if self.max is not None and not number <= self.max:
                raise InvalidValueError(f"{name} = {given}: must be <= {_bound(self.max, unit)}{hint}")
        if self.form is not None and (wrong := self.form(str(number))):
            raise InvalidValueError(wrong)
        if self.kind is float and value is not self.default:
            own = flatten("", parse(name, self.default, unit, self.kind)).values()
            question(name, value, number, unit, usual_size(own, (self.min, self.max)))
        return number


def lacking_methods(cls: type) -> list[str]:
    """Return the methods that a class has not, though its base leaves them to it, as sentences.

    Families mark them and are no ``ABC``, whose refusal at the making would come before this sentence.
    """
    lacking = [n for n in dir(cls) if getattr(getattr(cls, n), "__isabstractmethod__", False)]
    return [f"{cls.__name__} has no {n}(), which its family leaves to the test" for n in lacking]


class Configurable:
    """Base of System and Suite: what ``systems/<name>/system.py`` declares of either, with one set of values."""

    title: ClassVar[str] = ""
    spec: ClassVar[tuple[str, ...]] = ()  # ids of methods, see docs/methods
    options: ClassVar[Mapping[str, Option]] = {}
    name: str = ""
    folder: Path | None = None

    def __init__(self) -> None:
        self.name = self.name or type(self).__name__.lower()
        self.values = {k: o.parse(k, o.default) for k, o in self.options.items()}
        self.given: list[str] = []  # names that were set

    def __getitem__(self, option: str) -> Any:
        """The SI value of an option."""
        return self.values[option]

    def set(self, name: str, value: Any) -> None:
        """Set an option.  Raises InvalidValueError."""
        if name not in self.options:
            raise InvalidValueError(f"{name}: no such option of {self.name}")
        self.values[name] = self.options[name].parse(name, value)
        self._was_given(name)

    def _was_given(self, name: str) -> None:
        if name not in self.given:
            self.given.append(name)

    def unfinished(self) -> list[str]:
        """Return what the declaration still lacks, as sentences: methods that its family leaves to it."""
        return lacking_methods(type(self))

    def with_values(self, values: Mapping[str, Any]) -> Self:
        """Return a copy with further values set."""
        other = copy.copy(self)
        for key, held in vars(self).items():
            if isinstance(getattr(type(self), key, None), functools.cached_property):
                del other.__dict__[key]  # it was derived from other values
            elif isinstance(held, dict | list):
                other.__dict__[key] = copy.copy(held)
        for name, value in values.items():
            other.set(name, value)
        return other


def load_configurable(name: str, bench: Path | None = None) -> Configurable:
    """Return the system or suite ``name`` of a bench with its default values.

    Raises BenchError when there is no such system, InvalidConfigurationError when its file does not define exactly one
    system or suite, or one that is not finished.
    """
    folder = Bench.find(bench).system_folder(name)
    file = folder / "system.py"
    module_name = f"gyrobench_system_{name}_{zlib.crc32(str(folder.resolve()).encode()):08x}"
    spec = importlib.util.spec_from_file_location(module_name, file, submodule_search_locations=[str(folder)])
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[module_name] = module
    with blamed(file):
        spec.loader.exec_module(module)
    classes = [
        v
        for v in vars(module).values()
        if isinstance(v, type) and issubclass(v, Configurable) and v.__module__ == module_name
    ]
    if len(classes) != 1:
        raise InvalidConfigurationError(name, [f"{file}: defines {len(classes)} systems or suites, must define one"])
    base = next(c for c in classes[0].__mro__ if c.__module__ != module_name)
    check_attributes(classes[0], base, file, {"options": Option})
    with blamed(file):
        loaded = classes[0]()
        loaded.name, loaded.folder = name, folder
        lacks = loaded.unfinished()
    if lacks:
        raise InvalidConfigurationError(name, [f"{file}: {lack}" for lack in lacks])
    return loaded
