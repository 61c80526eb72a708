"""One FMU instance under FMPy, and the messages it logs.

The engines read and write groups of variables (:class:`gyrobench.engine.program.VariableGroup`); an instance in a
child process (:mod:`gyrobench.engine.isolated_instance`) has the same methods.
"""

from __future__ import annotations

import contextlib
import ctypes
import itertools
from collections import deque
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Protocol

from gyrobench.engine.program import VariableGroup
from gyrobench.errors import GyrobenchError
from gyrobench.system.binding import Bound

STATUS = ("OK", "Warning", "Discard", "Error", "Fatal", "Pending")
KEPT = 50  # messages kept for each FMU


class FmuCallError(GyrobenchError):
    """A call of an FMU failed: slot, call ("doStep", ...), status in words, time (None before the first step)."""

    def __init__(self, slot: str, call: str, status: str, time: float | None, messages: Iterable[str] = ()) -> None:
        self.slot, self.call, self.status, self.time = slot, call, status, time
        self.messages = list(messages)
        when = "" if time is None else f" at t = {time:.12g} s"
        texts = [m.removeprefix(f"{slot}: ") for m in self.messages]
        if texts and time is None:  # the reason before the names of FMI calls
            text = "\n".join([f"{slot} does not start: {texts[0]}", *(f"  {m}" for m in texts[1:])])
            super().__init__(f"{text}\n  ({call}: {status})")
        else:
            super().__init__(f"{slot}: {call} failed{when}: {status}" + "".join(f"\n  FMU log: {m}" for m in texts))


class FmuInstance(Protocol):
    """The methods of an FMU instance that the engines call."""

    slot: str

    def instantiate(self) -> None: ...
    def set_start(self, values: list[tuple[Bound, Any]]) -> None: ...
    def initialize(self, t0: float) -> None: ...
    def exit_initialization(self) -> None: ...
    def write(self, group: VariableGroup) -> None: ...
    def read(self, group: VariableGroup) -> None: ...
    def do_step(self, t: float, h: float) -> None: ...
    def messages(self) -> list[str]: ...
    def free(self) -> None: ...
    def close(self) -> None: ...


_logs: dict[int, deque[tuple[int, str]]] = {}
_ids = itertools.count(1)
_template: Any = None


def _log(environment: int | None, instance: bytes, status: int, category: bytes, message: bytes) -> None:
    log = _logs.get(environment or 0)
    text = (message or b"").decode("utf-8", "replace").strip()
    if log is not None:
        log.append((status, text))
    elif status > 1:
        print(f"{(instance or b'').decode('utf-8', 'replace')}: {text}")


def _callbacks(identity: int) -> Any:
    """Return FMI 2 callbacks that log into the messages of ``identity``.

    FMPy's proxy formats the variadic message and forwards it to one logger for the whole process, so that one
    dispatches by the component environment.
    """
    from fmpy import calloc, free
    from fmpy.fmi2 import (
        fmi2CallbackAllocateMemoryTYPE,
        fmi2CallbackFreeMemoryTYPE,
        fmi2CallbackFunctions,
        fmi2CallbackLoggerTYPE,
    )

    global _template
    if _template is None:
        _template = fmi2CallbackFunctions()
        _template.logger = fmi2CallbackLoggerTYPE(_log)
        _template.python_logger = _template.logger  # keeps the Python function alive behind the proxy
        _template.allocateMemory = fmi2CallbackAllocateMemoryTYPE(calloc)
        _template.freeMemory = fmi2CallbackFreeMemoryTYPE(free)
        try:
            from fmpy.logging import addLoggerProxy

            addLoggerProxy(ctypes.byref(_template))
        except (ImportError, OSError):  # no proxy for this platform: messages come unformatted
            pass
    callbacks = fmi2CallbackFunctions()
    for name in ("logger", "allocateMemory", "freeMemory"):
        setattr(callbacks, name, getattr(_template, name))
    callbacks.componentEnvironment = identity
    return callbacks


class LocalInstance:
    """An FMI 2.0 co-simulation FMU in this process.  Instances may follow one another; the library stays loaded."""

    def __init__(self, slot: str, description: Any, folder: Path) -> None:
        from fmpy.fmi2 import FMU2Slave

        self.slot, self.description = slot, description
        self.identity = next(_ids)
        self.log: deque[tuple[int, str]] = deque(maxlen=KEPT)
        _logs[self.identity] = self.log
        self.time: float | None = None
        self.live = False
        self.initialized = False
        try:
            self.fmu = FMU2Slave(
                guid=description.guid,
                unzipDirectory=str(folder),
                modelIdentifier=description.coSimulation.modelIdentifier,
                instanceName=slot,
            )
        except Exception as error:
            raise FmuCallError(slot, "loading", str(error), None) from None
        self.setters = {k: getattr(self.fmu, f"fmi2Set{k}") for k in ("Real", "Integer", "Boolean")}
        self.getters = {k: getattr(self.fmu, f"fmi2Get{k}") for k in ("Real", "Integer", "Boolean")}
        self.component: Any = None

    def messages(self) -> list[str]:
        """Return the last messages of the FMU: warnings and errors, or all messages where there are none."""
        warnings = [text for status, text in self.log if status > 0]
        return list(dict.fromkeys(warnings or [text for _, text in self.log]))[-5:]

    def fail(self, call: str, error: Exception) -> FmuCallError:
        code = getattr(error, "status", None)
        status = f"status {code} ({STATUS[code]})" if isinstance(code, int) and code < 6 else str(error)
        return FmuCallError(self.slot, call, status, self.time, self.messages())

    def call(self, name: str, function: Any, *args: Any, **kwargs: Any) -> None:
        try:
            function(*args, **kwargs)
        except Exception as error:
            raise self.fail(name, error) from None

    def instantiate(self) -> None:
        """Create the instance; log errors and warnings only, where the FMU declares such categories."""
        self.log.clear()
        self.time = None
        self.initialized = False
        self.call("instantiate", self.fmu.instantiate, callbacks=_callbacks(self.identity), loggingOn=True)
        self.live = True
        self.component = self.fmu.component
        words = ("error", "warning", "fatal", "discard")
        categories = [c.name for c in self.description.logCategories if any(w in c.name.lower() for w in words)]
        if categories:
            self.call("setDebugLogging", self.fmu.setDebugLogging, True, categories)

    def set_start(self, values: list[tuple[Bound, Any]]) -> None:
        """Set parameters and start values, in the FMU's own units, before initialization."""
        for kind in ("Real", "Integer", "Boolean", "String"):
            chosen = [(b, v) for b, v in values if b.kind == kind]
            if chosen:
                names = ", ".join(b.variable for b, _ in chosen[:3]) + (" ..." if len(chosen) > 3 else "")
                function = getattr(self.fmu, f"set{kind}")
                self.call(f"set{kind} of {names}", function, [b.reference for b, _ in chosen], [v for _, v in chosen])

    def initialize(self, t0: float) -> None:
        """Call setupExperiment and enterInitializationMode."""
        self.call("setupExperiment", self.fmu.setupExperiment, startTime=t0)
        self.call("enterInitializationMode", self.fmu.enterInitializationMode)

    def exit_initialization(self) -> None:
        self.call("exitInitializationMode", self.fmu.exitInitializationMode)
        self.initialized = True

    def write(self, group: VariableGroup) -> None:
        """Set the values of a group."""
        try:
            self.setters[group.kind](self.component, group.references, group.n, group.values)
        except Exception as error:
            raise self.fail(f"set{group.kind}", error) from None

    def read(self, group: VariableGroup) -> None:
        """Get the values of a group."""
        try:
            self.getters[group.kind](self.component, group.references, group.n, group.values)
        except Exception as error:
            raise self.fail(f"get{group.kind}", error) from None

    def do_step(self, t: float, h: float) -> None:
        """Do one communication step; a status worse than warning is a failure."""
        try:
            self.fmu.fmi2DoStep(self.component, t, h, 1)
        except Exception as error:
            self.time = t
            raise self.fail("doStep", error) from None

    def pointers(self) -> dict[str, int]:
        """Return the addresses of the functions that the native engine calls."""
        names = ["DoStep", *(f"{a}{k}" for a in ("Set", "Get") for k in ("Real", "Integer", "Boolean"))]
        return {n: ctypes.cast(getattr(self.fmu.dll, f"fmi2{n}"), ctypes.c_void_p).value or 0 for n in names}

    def free(self) -> None:
        """Terminate and free the instance; a second call does nothing."""
        if self.live:
            self.live = False
            if self.initialized:
                with contextlib.suppress(Exception):  # a failed FMU may refuse to terminate; it is freed all the same
                    self.fmu.terminate()
            self.fmu.fmi2FreeInstance(self.component)

    def close(self) -> None:
        """Free the instance and the library."""
        self.free()
        _logs.pop(self.identity, None)
        self.fmu.freeLibrary()
