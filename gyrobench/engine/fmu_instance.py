"""One FMU instance under FMPy, and the messages it logs.

The engines read and write groups of variables (:class:`gyrobench.engine.program.VariableGroup`).  Before each call the
instance writes into the status of the run which one it is, for the process that supervises this one.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import inspect
import itertools
from collections import deque
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from gyrobench.engine.program import VariableGroup
from gyrobench.engine.run_board import CALLS, GET, SET, STEP, Status
from gyrobench.errors import GyrobenchError
from gyrobench.system.binding import Bound

STATUS = ("OK", "Warning", "Discard", "Error", "Fatal", "Pending")
KEPT = 50  # messages kept for each FMU


#: beyond the statuses of FMI: what the engines themselves find in a call
NO_PROGRESS, ENDED, OUT_OF_RANGE = 100, 101, 102
FOUND = {NO_PROGRESS: "it returns early and makes no progress", ENDED: "the FMU asks for the end of the simulation"}


def status_text(code: int) -> str:
    """Return a status of a call in words."""
    word = STATUS[code] if 0 <= code < len(STATUS) else "not one of the standard"
    return FOUND.get(code) or f"status {code} ({word})"


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


@functools.cache
def with_signatures(slave: type) -> type:
    """Return FMPy's class; its FMI functions know their signatures.

    FMPy asks for those of all at every FMU, and Python finds each anew: half the time of loading.
    """
    for name, function in inspect.getmembers(slave, inspect.isfunction):
        if name.startswith("fmi"):
            function.__signature__ = inspect.signature(function)  # type: ignore[attr-defined]
    return slave


class FmuInstance:
    """An FMI 2.0 co-simulation FMU in this process.  Instances may follow one another; the library stays loaded.

    status: of the run, where each call is noted before it is made, under the number ``part``.
    """

    fmi3 = False
    prefix, state, restore = "fmi2", "FMUstate", "deSerializeFMUstate"

    def __init__(self, slot: str, description: Any, folder: Path, status: Status | None = None, part: int = 0) -> None:
        self.slot, self.description = slot, description
        self.status, self.part = Status() if status is None else status, part
        self.identity = next(_ids)
        self.log: deque[tuple[int, str]] = deque(maxlen=KEPT)
        _logs[self.identity] = self.log
        self.time: float | None = None
        self.live = False
        self.initialized = False
        self.note("loading")
        identifier = str(description.coSimulation.modelIdentifier)
        if Path(identifier).name != identifier or "\\" in identifier or ":" in identifier:
            raise FmuCallError(
                slot, "loading", f"modelIdentifier '{identifier}' is not the name of a file inside the FMU", None
            )
        try:
            self.fmu = self.new_slave()(
                guid=description.guid, unzipDirectory=str(folder), modelIdentifier=identifier, instanceName=slot
            )
        except Exception as error:
            raise FmuCallError(slot, "loading", str(error), None) from None
        self.component: Any = None
        self.functions: dict[str, Any] = {}  # by FMI name without "fmi2", as far as used

    def new_slave(self) -> Any:
        """Return FMPy's class of such FMUs."""
        from fmpy.fmi2 import FMU2Slave

        return with_signatures(FMU2Slave)

    def function(self, name: str) -> Any:
        """Return FMPy's function for an FMI function: "SetReal" -> fmi2SetReal."""
        found = self.functions.get(name)
        if found is None:
            found = self.functions[name] = getattr(self.fmu, f"{self.prefix}{name}")
        return found

    def note(self, call: str) -> None:
        """Note a call before it is made."""
        self.status.part, self.status.call = self.part, CALLS.index(call)

    def messages(self) -> list[str]:
        """Return the last messages of the FMU: warnings and errors, or all messages where there are none."""
        warnings = [text for status, text in self.log if status > 0]
        return list(dict.fromkeys(warnings or [text for _, text in self.log]))[-5:]

    def fail(self, call: str, error: Exception) -> FmuCallError:
        code = getattr(error, "status", None)
        status = status_text(code) if isinstance(code, int) else str(error)
        return FmuCallError(self.slot, call, status, self.time, self.messages())

    def call(self, name: str, function: Any, *args: Any, **kwargs: Any) -> None:
        self.note(name.split()[0])
        try:
            function(*args, **kwargs)
        except Exception as error:
            raise self.fail(name, error) from None

    def instantiate(self) -> None:
        """Create the instance; log errors and warnings only, where the FMU declares such categories."""
        self.log.clear()
        self.time = None
        self.initialized = False
        self.create()
        self.live = True
        self.component = self.fmu.component
        words = ("error", "warning", "fatal", "discard")
        categories = [c.name for c in self.description.logCategories if any(w in c.name.lower() for w in words)]
        if categories:
            self.call("setDebugLogging", self.fmu.setDebugLogging, True, categories)

    def create(self) -> None:
        self.call("instantiate", self.fmu.instantiate, callbacks=_callbacks(self.identity), loggingOn=True)

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

    def write(self, group: VariableGroup, call: str = "") -> None:
        """Set the values of a group; call: what a failure names, the function without it."""
        self._transfer(f"Set{group.type.call}", SET, group, call)

    def read(self, group: VariableGroup) -> None:
        """Get the values of a group."""
        self._transfer(f"Get{group.type.call}", GET, group)

    def _transfer(self, name: str, code: int, group: VariableGroup, call: str = "") -> None:
        self.status.part, self.status.call = self.part, code + group.code
        count = (group.n,) if self.fmi3 else ()
        try:
            self.function(name)(self.component, group.references, group.n_references, group.values, *count)
        except Exception as error:
            raise self.fail(call or name[0].lower() + name[1:], error) from None

    def do_step(self, t: float, h: float) -> None:
        """Do one communication step; a status worse than warning is a failure."""
        self.status.part, self.status.call = self.part, STEP
        try:
            self.fmu.fmi2DoStep(self.component, t, h, 1)
        except Exception as error:
            self.time = t
            raise self.fail("doStep", error) from None

    def pointer(self, name: str) -> int:
        """Return the address of an FMI function, for the native engine."""
        return self.address(f"{self.prefix}{name}")

    def address(self, name: str) -> int:
        """Return the address of a function of the library."""
        return ctypes.cast(getattr(self.fmu.dll, name), ctypes.c_void_p).value or 0

    def _of_state(self, verb: str) -> Any:
        return getattr(self.fmu, verb + self.state)

    def save_state(self) -> bytes:
        """Return the serialized state.  Raises FmuCallError."""
        self.note("serializeFMUstate")
        try:
            state = self._of_state("get")()
            try:
                return bytes(self._of_state("serialize")(state))
            finally:
                self._of_state("free")(state)
        except Exception as error:
            raise self.fail(f"serialize{self.state}", error) from None

    def load_state(self, data: bytes) -> None:
        """Set the initialized FMU to a serialized state.  Raises FmuCallError."""
        self.note("deSerializeFMUstate")
        try:
            state = getattr(self.fmu, self.restore)(data)
            try:
                self._of_state("set")(state)
            finally:
                self._of_state("free")(state)
        except Exception as error:
            raise self.fail(self.restore, error) from None

    def free(self) -> None:
        """Terminate and free the instance; a second call does nothing."""
        if self.live:
            self.live = False
            if self.initialized:
                self.note("terminate")
                with contextlib.suppress(Exception):  # a failed FMU may refuse to terminate; it is freed all the same
                    self.fmu.terminate()
            self.note("freeInstance")
            self.function("FreeInstance")(self.component)

    def close(self) -> None:
        """Free the instance and the library."""
        self.free()
        _logs.pop(self.identity, None)
        self.fmu.freeLibrary()
