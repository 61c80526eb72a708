"""One instance of a part, driven by FMI names, whatever it is: the plain class or an FMU under FMPy.

Tests, reference runs and validation use it.  Values are SI floats; an Integer or Boolean is given and returned
as a float too.  Every failure raises :class:`InstanceError`, whose text is what the part logged.
"""

from __future__ import annotations

import itertools
import json
import shutil
import tempfile
from collections.abc import Callable, Iterable, Sequence
from ctypes import c_double, c_uint
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, NamedTuple, Protocol

from gyrobench.component import Component, ComponentError
from gyrobench.component.declarations import element_names
from gyrobench.errors import GyrobenchError
from gyrobench.files import check_size, temporary_folder, unzip_fmu
from gyrobench.packaging.fmu import build
from gyrobench.packaging.loading import load_part
from gyrobench.packaging.tuning import tuning


class InstanceError(GyrobenchError):
    """A call failed: ``messages`` is what the part logged, ``status`` the FMI status (3 error, 4 fatal)."""

    def __init__(self, call: str, status: int | None, messages: Sequence[str]) -> None:
        self.call, self.status, self.messages = call, status, list(messages)
        super().__init__("; ".join(messages) or f"{call}: status {status}, and no message")


class Instance(Protocol):
    """An instantiated part: set parameters and inputs, initialize, then set, step and get."""

    def set(self, values: dict[str, float]) -> None: ...
    def get(self, names: Sequence[str]) -> list[float]: ...
    def initialize(self, t0: float = 0.0) -> None: ...
    def step(self, t: float, h: float) -> None: ...
    def get_state(self) -> Any: ...
    def set_state(self, state: Any) -> None: ...
    def save(self, state: Any) -> bytes: ...
    def load(self, data: bytes) -> Any: ...
    def reset(self) -> None: ...
    def free(self) -> None: ...


class Plain:
    """An instance of the plain class."""

    messages: ClassVar[list[str]] = []

    def __init__(self, cls: type[Component], name: str = "part") -> None:
        self.part = cls(name)

    def _call(self, name: str, function: Callable[..., Any], *args: Any) -> Any:
        try:
            return function(*args)
        except ComponentError as e:
            raise InstanceError(name, None, [str(e)]) from e

    def set(self, values: dict[str, float]) -> None:
        references = [self.part._find(n).reference for n in values]
        if self.part._running:
            allowed = tuning(type(self.part))
            self.part._tunable, self.part._derived = allowed.tunable, allowed.derived  # type: ignore[misc]
        self._call("set", self.part.write, references, list(values.values()))

    def get(self, names: Sequence[str]) -> list[float]:
        values: list[float] = self._call("get", self.part.read, [self.part._find(n).reference for n in names])
        return values

    def initialize(self, t0: float = 0.0) -> None:
        self._call("initialize", self.part.initialize, t0)

    def step(self, t: float, h: float) -> None:
        self._call("step", self.part.do_step, t, h)

    def get_state(self) -> Any:
        return self.part.get_state()

    def set_state(self, state: Any) -> None:
        self.part.set_state(state)

    def save(self, state: Any) -> bytes:
        return json.dumps(state).encode()

    def load(self, data: bytes) -> Any:
        return json.loads(data)

    def reset(self) -> None:
        self.part.reset()

    def free(self) -> None:
        pass


_logs: dict[int, list[str]] = {}
_ids = itertools.count(1)
_logger: dict[str, Any] = {}


def _log2(environment: int | None, _name: bytes, status: int, _category: bytes, message: bytes) -> None:
    if status > 1 and not message.startswith(b"Fatal py exception"):  # pythonfmu's second, emptier message
        _logs.setdefault(environment or 0, []).append(message.decode("utf-8", "replace").replace("%%", "%"))


def _log3(environment: int | None, status: int, _category: bytes, message: bytes) -> None:
    if status > 1:
        _logs.setdefault(environment or 0, []).append(message.decode("utf-8", "replace"))


def elements(variables: Iterable[Any]) -> list[str]:
    """Return the names of all elements of variables of a description."""
    return [n for v in variables for n in element_names(v.name, tuple(v.shape or ()))]


class _Access(NamedTuple):
    """A call that sets or gets variables of one FMI type.

    number: type of its values.  names: of all elements of the variables.  in_part: some of these are not asked for.
    values: those of doubles, and arguments: of the FMI functions that get and set them there, which are called without
    FMPy's detour by lists; None of other types.
    """

    kind: str
    number: type
    references: list[int]
    names: list[str]
    in_part: bool
    values: Any = None
    arguments: tuple[Any, ...] = ()


@dataclass
class Unzipped:
    """The model description of an FMU, as FMPy reads it, and the folder of its files."""

    description: Any
    folder: Path


class Fmu:
    """An FMU of either FMI version, by FMPy.

    ``like`` is an instance of the same FMU, or its files, which are used too and not removed.
    """

    def __init__(
        self, path: Path, name: str = "part", like: Fmu | Unzipped | None = None, logging: bool = True
    ) -> None:
        import fmpy

        self._own = like is None
        if like is None:
            check_size(path)
            self.description = fmpy.read_model_description(str(path), validate=False)
            self.folder = temporary_folder()
            unzip_fmu(path, self.folder)
        else:
            self.description, self.folder = like.description, like.folder
        self.three = self.description.fmiVersion.startswith("3")
        self.identity = next(_ids)
        self.messages = _logs.setdefault(self.identity, [])
        self.variables = {v.name: v for v in self.description.modelVariables}
        self._known: dict[tuple[str, ...], list[_Access]] = {}
        self.holding = {n: v for n, v in self.variables.items() if not v.shape}  # element -> its variable
        self.holding |= {n: v for v in self.variables.values() if v.shape for n in elements([v])}
        self.t0 = 0.0
        arguments = {
            "guid": self.description.guid,
            "unzipDirectory": str(self.folder),
            "modelIdentifier": self.description.coSimulation.modelIdentifier,
            "instanceName": name,
        }
        if self.three:
            self._instantiate3(arguments, logging)
        else:
            self._instantiate2(arguments, logging)

    def _instantiate2(self, arguments: dict[str, str], logging: bool) -> None:
        from fmpy import calloc, fmi2, free

        if "2" not in _logger:
            _logger["2"] = fmi2.fmi2CallbackLoggerTYPE(_log2)
        self.callbacks = fmi2.fmi2CallbackFunctions()
        self.callbacks.logger = _logger["2"]
        self.callbacks.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(calloc)
        self.callbacks.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(free)
        self.callbacks.componentEnvironment = self.identity
        self.fmu = fmi2.FMU2Slave(**arguments)
        self._call("instantiate", self.fmu.instantiate, callbacks=self.callbacks, loggingOn=logging)

    def _instantiate3(self, arguments: dict[str, str], logging: bool) -> None:
        from fmpy import fmi3

        def log(_environment: Any, status: int, category: bytes, message: bytes) -> None:
            _log3(self.identity, status, category, message)

        self.fmu = fmi3.FMU3Slave(**arguments)
        self._call("instantiate", self.fmu.instantiate, loggingOn=logging, logMessage=log)

    def _call(self, name: str, function: Callable[..., Any], *args: Any, **kwargs: Any) -> Any:
        from fmpy.fmi1 import FMICallException

        self.messages.clear()
        try:
            return function(*args, **kwargs)
        except FMICallException as e:
            raise InstanceError(name, e.status, self.messages) from None
        except Exception as e:  # FMPy's own message when instantiation fails
            if name != "instantiate":
                raise
            raise InstanceError(name, None, self.messages or [str(e)]) from None

    def _variables(self, names: Iterable[str]) -> list[Any]:
        """Return the variables that hold these elements, each once."""
        return list({v.valueReference: v for v in map(self.holding.__getitem__, names)}.values())

    def _calls(self, names: tuple[str, ...]) -> list[_Access]:
        """Return the calls for these elements, one for each FMI type."""
        if names not in self._known:
            groups: dict[str, list[Any]] = {}
            for v in self._variables(names):
                groups.setdefault(v.type, []).append(v)
            self._known[names] = [
                self._access(
                    kind,
                    {"Real": float, "Float64": float, "Boolean": bool}.get(kind, int),
                    [v.valueReference for v in of],
                    elements(of),
                    not set(names) >= set(elements(of)),
                )
                for kind, of in groups.items()
            ]
        return self._known[names]

    def _access(self, kind: str, number: type, references: list[int], names: list[str], in_part: bool) -> _Access:
        if number is not float:
            return _Access(kind, number, references, names, in_part)
        values = (c_double * len(names))()
        places = (c_uint * len(references))(*references)
        size = (len(names),) if self.three else ()
        arguments = (self.fmu.component, places, len(references), values, *size)
        return _Access(kind, number, references, names, in_part, values, arguments)

    def _direct(self, verb: str, access: _Access) -> None:
        """Get or set doubles."""
        self.messages.clear()
        function = getattr(self.fmu.dll, f"fmi{3 if self.three else 2}{verb.title()}{access.kind}")
        if (status := function(*access.arguments)) > 1:
            raise InstanceError(verb, status, self.messages)

    def _values(self, access: _Access) -> dict[str, float]:
        if access.values is not None:
            self._direct("get", access)
            return dict(zip(access.names, access.values, strict=True))
        size = {"nValues": len(access.names)} if self.three else {}
        values = self._call("get", getattr(self.fmu, f"get{access.kind}"), access.references, **size)
        return dict(zip(access.names, map(float, values), strict=True))

    def set(self, values: dict[str, float]) -> None:
        for access in self._calls(tuple(values)):
            given = {**self._values(access), **values} if access.in_part else values  # an array is set as a whole
            numbers = [access.number(given[n]) for n in access.names]
            if access.values is not None:
                access.values[:] = numbers
                self._direct("set", access)
                continue
            self._call("set", getattr(self.fmu, f"set{access.kind}"), access.references, numbers)

    def get(self, names: Sequence[str]) -> list[float]:
        found: dict[str, float] = {}
        for access in self._calls(tuple(names)):
            found |= self._values(access)
        return [found[n] for n in names]

    def initialize(self, t0: float = 0.0) -> None:
        if self.three:
            self._call("initialize", self.fmu.enterInitializationMode, startTime=t0)
        else:
            self._call("initialize", self.fmu.setupExperiment, startTime=t0)
            self._call("initialize", self.fmu.enterInitializationMode)
        self._call("initialize", self.fmu.exitInitializationMode)

    def step(self, t: float, h: float) -> None:
        self._call("step", self.fmu.doStep, t, h)

    def derivative(self, unknown: Sequence[str], known: dict[str, float]) -> list[float]:
        """Return the directional derivative of the unknowns along ``known``."""
        variables = self._variables(unknown), self._variables(known)
        rows, columns = map(elements, variables)
        references = [[v.valueReference for v in of] for of in variables]
        size = {"nSensitivity": len(rows)} if self.three else {}
        seed = [known.get(n, 0.0) for n in columns]
        found = self._call("derivative", self.fmu.getDirectionalDerivative, *references, seed, **size)
        values = dict(zip(rows, found, strict=True))
        return [values[n] for n in unknown]

    def get_state(self) -> Any:
        return self._call("state", self.fmu.getFMUState if self.three else self.fmu.getFMUstate)

    def set_state(self, state: Any) -> None:
        self._call("state", self.fmu.setFMUState if self.three else self.fmu.setFMUstate, state)

    def save(self, state: Any) -> bytes:
        serialize = self.fmu.serializeFMUState if self.three else self.fmu.serializeFMUstate
        return bytes(self._call("state", serialize, state))

    def load(self, data: bytes) -> Any:
        deserialize = self.fmu.deserializeFMUState if self.three else self.fmu.deSerializeFMUstate
        return self._call("state", deserialize, data)

    def reset(self) -> None:
        self._call("reset", self.fmu.reset)

    def free(self) -> None:
        """Free the instance, and remove the unzipped folder if it was made for it."""
        self.fmu.freeInstance()
        _logs.pop(self.identity, None)
        if self._own:
            shutil.rmtree(self.folder, ignore_errors=True)


TARGETS = ("plain", "python", "native", "native-fmi3")


def make(part: str | type[Component], target: str, name: str = "part", bench: Path | None = None) -> Instance:
    """Return a new instance of a part for one of :data:`TARGETS`; FMUs are built (or taken from the cache)."""
    if target == "plain":
        return Plain(load_part(part, bench) if isinstance(part, str) else part, name)
    if target not in TARGETS:
        raise ValueError(f"target {target!r}: one of {', '.join(TARGETS)}")
    with tempfile.TemporaryDirectory(prefix="gyrobench-") as out:
        kind, fmi = target.removesuffix("-fmi3"), 3 if target.endswith("-fmi3") else 2
        return Fmu(build(part, kind, fmi=fmi, out=Path(out), bench=bench), name)
