"""An FMU in a child process: its crash or hang ends in a message, not in a dead bench.

The child (:mod:`gyrobench.engine.isolation_server`) is started for each instance.  Writes are buffered and sent
with the next step or read, so that a step costs one or two round trips.
"""

from __future__ import annotations

import contextlib
import dataclasses
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import IO, Any

from gyrobench.engine.fmu_instance import FmuCallError
from gyrobench.engine.isolation_server import receive, send
from gyrobench.engine.program import VariableGroup
from gyrobench.system.binding import Bound

POLL = 0.05  # s between two checks of the watchdog


class _Watchdog(threading.Thread):
    """A thread that kills the process when a call takes longer than allowed."""

    def __init__(self, process: subprocess.Popen[bytes]) -> None:
        super().__init__(daemon=True)
        self.process = process
        self.deadline: float | None = None
        self.hung = False

    def run(self) -> None:
        while self.process.poll() is None:
            deadline = self.deadline
            if deadline is not None and time.monotonic() > deadline:
                self.hung = True
                self.process.kill()
                return
            time.sleep(POLL)


class IsolatedInstance:
    """An FMU instance in a child process; its methods are those of :class:`gyrobench.engine.fmu_instance.FmuInstance`.

    timeout: s, for one call (the first one, which starts Python and loads the FMU, may take 30 s longer).
    """

    def __init__(self, slot: str, folder: Path, timeout: float = 10.0) -> None:
        self.slot, self.folder, self.timeout = slot, folder, timeout
        self.process: subprocess.Popen[bytes] | None = None
        self.errors: IO[bytes] | None = None
        self.watchdog: _Watchdog | None = None
        self.pending: list[tuple[int, list[Any]]] = []
        self.known: dict[int, int] = {}
        self.groups: list[VariableGroup] = []
        self.time: float | None = None

    # ------------------------------------------------------------ the process
    def _start(self) -> None:
        import gyrobench

        root = str(Path(gyrobench.__file__).parents[1])
        paths = os.pathsep.join(p for p in (root, os.environ.get("PYTHONPATH", "")) if p)
        self.errors = tempfile.TemporaryFile()  # noqa: SIM115  (closed in _stop)
        self.process = subprocess.Popen(
            [sys.executable, "-m", "gyrobench.engine.isolation_server", self.slot, str(self.folder)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self.errors,
            env={**os.environ, "PYTHONPATH": paths},
            start_new_session=os.name == "posix",  # Ctrl-C is the parent's business
        )
        self.watchdog = _Watchdog(self.process)
        self.watchdog.start()
        self.known, self.groups = {}, []

    def _stop(self) -> None:
        if self.process is not None:
            process, self.process = self.process, None
            process.kill()
            process.wait()
            for stream in (process.stdin, process.stdout, self.errors):
                if stream is not None:
                    stream.close()
            self.errors = None

    def _last_lines(self) -> list[str]:
        """Return the last lines that the child wrote to standard error."""
        if self.errors is None:
            return []
        self.errors.seek(0)
        lines = self.errors.read().decode("utf-8", "replace").strip().splitlines()
        return lines[-5:]

    def _process_failure(self, call: str) -> FmuCallError:
        """Return the error of a call whose process crashed, ended or was killed."""
        assert self.process is not None and self.watchdog is not None
        code = self.process.wait()
        lines = self._last_lines()
        if self.watchdog.hung:
            status = f"no answer within {self.timeout:g} s; its process was stopped"
        elif code < 0:
            status = f"its process crashed ({signal.Signals(-code).name})"
        else:
            status = f"its process ended with exit code {code}"
        return FmuCallError(self.slot, call, status, self.time, lines)

    def ask(self, call: str, *arguments: Any) -> Any:
        """Send a request and return the reply.  Raises FmuCallError when it fails, crashes or hangs."""
        grace = 0.0
        if self.process is None:
            self._start()
            grace = 30.0
        assert self.process is not None and self.watchdog is not None
        assert self.process.stdin is not None and self.process.stdout is not None
        self.watchdog.deadline = time.monotonic() + self.timeout + grace
        try:
            send(self.process.stdin, (call, *arguments))  # type: ignore[arg-type]
            reply = receive(self.process.stdout)  # type: ignore[arg-type]
        except (EOFError, OSError):
            raise self._process_failure({"step": "doStep"}.get(call, call)) from None
        finally:
            self.watchdog.deadline = None
        if reply[0] == "ok":
            return reply[1]
        _, failed_call, status, when, messages = reply
        raise FmuCallError(self.slot, failed_call, status, self.time if when is None else when, messages)

    def number(self, group: VariableGroup) -> int:
        """Return the number under which the child knows a group."""
        number = self.known.get(id(group))
        if number is None:
            number = self.known[id(group)] = len(self.groups)
            self.groups.append(group)
            self.ask("group", number, group.kind, list(group.references))
        return number

    def flush(self) -> None:
        """Send the buffered writes."""
        pending, self.pending = self.pending, []
        for number, values in pending:
            self.ask("write", number, values)

    # ------------------------------------------------------------ the methods of FmuInstance
    def instantiate(self) -> None:
        self.pending, self.time = [], None
        self.ask("instantiate")

    def set_start(self, values: list[tuple[Bound, Any]]) -> None:
        self.ask("set_start", [(dataclasses.astuple(b), v) for b, v in values])

    def initialize(self, t0: float) -> None:
        self.ask("initialize", t0)

    def exit_initialization(self) -> None:
        self.flush()
        self.ask("exit_initialization")

    def write(self, group: VariableGroup) -> None:
        self.pending.append((self.number(group), list(group.values)))

    def read(self, group: VariableGroup) -> None:
        self.flush()
        group.values[:] = self.ask("read", self.number(group))

    def do_step(self, t: float, h: float) -> None:
        self.time = t
        pending, self.pending = self.pending, []
        self.ask("step", pending, t, h, [])

    def messages(self) -> list[str]:
        """Return no messages: they come with the failures."""
        return []

    def free(self) -> None:
        """End the process; the next instance gets a new one."""
        if self.process is not None and self.process.poll() is None:
            with contextlib.suppress(FmuCallError):
                self.ask("free")
        self._stop()

    def close(self) -> None:
        self.free()
