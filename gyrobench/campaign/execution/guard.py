"""Limits of a run in a worker process, and what a process leaves that did not survive a run.

A file of the process names the run that it works on.  A thread watches time and memory: beyond a limit it notes so in
that file and ends the process; the supervisor of dask starts another one.  Who works next on the same machine finds
the file of the process that is gone and reports which run ended it, and how: a crash, which nobody can note, is a run
that began and did not end.

A process that is not a worker of its own (threads in a notebook) is never ended: no limits there.
"""

from __future__ import annotations

import contextlib
import faulthandler
import json
import mmap
import os
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

SIZE = 512  # bytes of a file: JSON, padded
PERIOD = 0.05  # s between two looks
CALLS = 8  # shown of where a signal came


@dataclass(frozen=True)
class LostRun:
    """A run whose process ended: state crashed, hung or memory, the same reason each time, and what is known more."""

    run: str
    state: str
    reason: str
    detail: str


class Guard:
    """Watches the runs of this process.

    folder: of the files of all processes of a campaign on this machine.  time_limit: s.  memory_limit: bytes of the
    whole process, None: no limit.
    """

    def __init__(self, folder: Path, time_limit: float, memory_limit: int | None, given: bool = True) -> None:
        import psutil

        self.time_limit, self.memory_limit, self.given = time_limit, memory_limit, given
        self.process = psutil.Process()
        folder.mkdir(parents=True, exist_ok=True)
        self.stem = folder / f"{os.getpid()}-{_born(self.process)}"
        self.handle = self.stem.with_suffix(".run").open("w+b")
        self.handle.write(b" " * SIZE)
        self.handle.flush()
        self.note = mmap.mmap(self.handle.fileno(), SIZE)
        self.trace = self.stem.with_suffix(".trace").open("w")
        faulthandler.enable(self.trace)  # a signal that ends the process leaves its name there
        self.run = ""
        self.closed = False
        self.since = 0.0
        self.ending = threading.Lock()
        self.thread = threading.Thread(target=self._watch, name="gyrobench-guard", daemon=True)
        self.thread.start()

    def _write(self, **content: str) -> None:
        self.note[:] = json.dumps(content).encode()[:SIZE].ljust(SIZE)

    @contextlib.contextmanager
    def watching(self, run: str) -> Iterator[None]:
        """Watch a run until it ends, however it ends."""
        self._write(run=run)
        self.since, self.run = time.monotonic(), run
        try:
            yield
        finally:
            with self.ending:  # what exceeds its limit in this moment is ended
                self.run = ""
                self.note[:] = b" " * SIZE

    def close(self) -> None:
        """Remove the files of this process, and the folder where they were the last."""
        self.closed = True
        for suffix in (".run", ".trace"):
            self.stem.with_suffix(suffix).unlink(missing_ok=True)
        with contextlib.suppress(OSError):
            self.stem.parent.rmdir()

    def _watch(self) -> None:
        while not self.closed:
            time.sleep(PERIOD)
            with self.ending:
                if not self.run:
                    continue
                if time.monotonic() - self.since > self.time_limit:
                    self._end("hung", f"no result within {self.time_limit:g} s (time_limit)", "")
                used = self.process.memory_info().rss
                if self.memory_limit is not None and used > self.memory_limit:
                    whose = "memory_limit" if self.given else "memory of the worker"
                    limit = f"more than {self.memory_limit / 1e6:.0f} MB in use ({whose})"
                    self._end("memory", limit, f"{used / 1e6:.0f} MB")

    def _end(self, state: str, reason: str, detail: str) -> None:
        """End this process; its files say why."""
        self._write(run=self.run, state=state, reason=reason, detail=detail)
        self.note.flush()
        os._exit(1)


def _born(process: Any) -> str:
    """Return when a process began: with its number, its identity."""
    return str(round(100.0 * process.create_time()))


def lost_runs(folder: Path) -> list[LostRun]:
    """Return what ended processes of this machine that are gone, each once."""
    import psutil

    found = []
    for file in sorted(folder.glob("*.run")):
        number, _, born = file.stem.partition("-")
        with contextlib.suppress(psutil.Error):
            process = psutil.Process(int(number))
            if _born(process) == born and process.status() != psutil.STATUS_ZOMBIE:
                continue  # it lives
        taken = file.with_suffix(".taken")
        try:
            os.rename(file, taken)  # of two processes that look, one succeeds
        except OSError:
            continue
        text = taken.read_bytes().decode(errors="replace").strip()
        trace = file.with_suffix(".trace")
        with contextlib.suppress(ValueError, OSError):
            content = json.loads(text) if text else {}
            if content.get("run"):
                found.append(_lost_run(content, trace.read_text(errors="replace") if trace.exists() else ""))
        for old in (taken, trace):
            old.unlink(missing_ok=True)
    return found


def _lost_run(content: dict[str, str], trace: str) -> LostRun:
    if "state" in content:
        return LostRun(content["run"], content["state"], content["reason"], content.get("detail", ""))
    fault = trace.partition("\n")[0].removeprefix("Fatal Python error: ").strip()
    cause = f": {fault}" if fault else ", without a signal from inside"
    calls = trace.partition("Current thread")[2].partition("\n\n")[0].splitlines()[1 : 1 + CALLS]
    return LostRun(content["run"], "crashed", f"ended its worker process{cause}", "\n".join(calls))
