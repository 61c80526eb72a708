"""The process in which a run happens: its FMUs, its loop, its checkpoints.

What it records goes to :class:`RunFiles`, not through descriptors that an FMU could write to: they are open only while
no FMU runs.  Standard output and error go to a file, all other descriptors of the parent are closed.  On a system where
a process cannot be forked safely it is ``python -m gyrobench.engine.child``, with the job on standard input.
"""

from __future__ import annotations

import contextlib
import ctypes
import faulthandler
import gc
import json
import os
import signal
import sys
import threading
import time
import traceback
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.engine.checkpoint import ResumeError
from gyrobench.engine.execution import Ending, Job, execute
from gyrobench.engine.fmi3_instance import new_instance
from gyrobench.engine.fmu_instance import FmuCallError, FmuInstance
from gyrobench.engine.run_board import RunBoard
from gyrobench.engine.run_driver import SIGNALS, EngineStopped
from gyrobench.files import write_whole

GONE = 0.2  # s between two looks whether the parent lives


@dataclass(frozen=True)
class RunFiles:
    """Files that parent and child share, in a folder.

    board: of the run, where memory cannot be shared otherwise.  channel, window: rows that have left the board, as
    doubles.  ending: how the run ended.  printed: what FMUs wrote to standard output and error.
    """

    folder: Path

    def file(self, name: str) -> Path:
        return self.folder / f"run.{name}"

    def clear(self) -> None:
        """Remove what an earlier run left."""
        for name in ("board", "channel", "window", "ending", "printed"):
            self.file(name).unlink(missing_ok=True)

    def keep(self, channel: Sequence[Array], window: Sequence[Array]) -> None:
        """Append rows, single ones or blocks of them."""
        for name, blocks in (("channel", channel), ("window", window)):
            if any(map(len, blocks)):
                with self.file(name).open("ab") as file:
                    for block in blocks:
                        file.write(np.ascontiguousarray(block).data)

    def rows(self, name: str, width: int, first: int = 0) -> Array:
        """Return the rows that were kept, from the row ``first`` on."""
        file = self.file(name)
        values = np.fromfile(file, offset=8 * width * first) if file.is_file() else np.empty(0)
        return values[: len(values) // width * width].reshape(-1, width)


@dataclass(frozen=True)
class Loads:
    """FMUs to load: slot -> model description and folder of its files.

    memory: bytes by which the address space may grow, None: no limit.
    """

    fmus: Mapping[str, tuple[Any, Path]]
    memory: int | None


def run_job(job: Job, loads: Loads, files: RunFiles, board: RunBoard, parent: int) -> None:
    """Run a job in this process, which does nothing else, and end it."""
    code = 1
    try:
        _settle(files, parent)
        _limit_memory(loads.memory)
        instances: dict[str, FmuInstance] = {}
        board.keep = files.keep
        try:
            place = os.getcwd()
            ending = _load_and_execute(job, loads, board, instances)
            if _here() != place:
                ending.remarks = (f"an FMU changed the working directory to {_here()}; the run was not affected",)
            _write(files, job, ending)
        except BaseException:  # a fault of gyrobench itself
            write_whole(files.file("ending"), json.dumps({"fault": traceback.format_exc()}).encode(), durable=False)
        for instance in instances.values():
            instance.free()
        code = 0
    finally:
        os._exit(code)


def _load_and_execute(job: Job, loads: Loads, board: RunBoard, instances: dict[str, FmuInstance]) -> Ending:
    try:
        for part, slot in enumerate(job.program.order):
            description, folder = loads.fmus[slot]
            instances[slot] = new_instance(slot, description, folder, board.status, part)
    except FmuCallError as error:
        return Ending(None, error)
    return execute(job, instances, board, None, lambda: bool(board.status.stop))


def _here() -> str:
    try:
        return os.getcwd()
    except OSError:
        return "one that does not exist"


def _settle(files: RunFiles, parent: int) -> None:
    """Become a process that shares with the parent only the board and the files of the run, and ends with it."""
    gc.freeze()  # nothing of the parent's is finalized here
    if faulthandler.is_enabled():
        faulthandler.disable()
    for number in SIGNALS:  # the parent's business
        signal.signal(number, signal.SIG_IGN)
    nothing = os.open(os.devnull, os.O_RDWR)
    printed = os.open(files.file("printed"), os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    for target, source in ((0, nothing), (1, printed), (2, printed)):
        os.dup2(source, target)
    if os.name == "posix":
        if os.getpgrp() != os.getpid():
            os.setsid()
        os.closerange(3, os.sysconf("SC_OPEN_MAX") if os.sysconf("SC_OPEN_MAX") < 65536 else 65536)
    else:
        os.close(nothing)
        os.close(printed)
    if sys.platform == "linux":
        libc = ctypes.CDLL(None)
        libc.prctl(1, signal.SIGKILL, 0, 0, 0)  # PR_SET_PDEATHSIG
        # an FMU that calls exit ends this process at once: the exit handlers of the parent's libraries are not for it
        _settle.at_exit = ctypes.CFUNCTYPE(None, ctypes.c_int, ctypes.c_void_p)(_exit_now)  # type: ignore[attr-defined]
        libc.on_exit(_settle.at_exit, None)  # type: ignore[attr-defined]
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _exit_now(code: int, _: Any) -> None:
    ctypes.CDLL(None).fflush(None)
    os._exit(code & 0xFF)


def _end_with(parent: int) -> None:
    """End this process when the parent has ended."""
    if os.name == "posix":
        while os.getppid() == parent:
            time.sleep(GONE)
    else:
        kernel = ctypes.windll.kernel32  # type: ignore[attr-defined,unused-ignore]
        kernel.OpenProcess.restype = ctypes.c_void_p
        kernel.WaitForSingleObject(ctypes.c_void_p(kernel.OpenProcess(0x100000, False, parent)), 0xFFFFFFFF)
    os._exit(1)


def _limit_memory(more: int | None) -> None:
    """Let the address space grow by no more than this many bytes, where the system can limit it."""
    if more is None or sys.platform != "linux":
        return
    import resource

    now = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    limit = now + more if hard == resource.RLIM_INFINITY else min(now + more, hard)
    with contextlib.suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_AS, (limit, hard))


def _write(files: RunFiles, job: Job, ending: Ending) -> None:
    """Write how the run ended, for :func:`read_ending`; its rows are there."""
    found: dict[str, Any] = {"remarks": ending.remarks}
    state, error = ending.state, ending.problem
    if state is not None:
        names = ("k", "last", "finished", "timed", "timed_seconds")
        found["state"] = {name: getattr(state, name) for name in names}
    if isinstance(error, FmuCallError):
        found["call"] = [error.slot, error.call, error.status, error.time, error.messages]
    elif isinstance(error, EngineStopped):
        found["stopped"] = [str(error), error.by_user]
    elif error is not None:
        found["resume"] = [str(error)]
    if job.checkpoints is not None:
        found["checkpoints"] = [job.checkpoints.resumed_at, job.checkpoints.lost]
    write_whole(files.file("ending"), json.dumps(found).encode(), durable=False)


ERRORS: dict[str, Any] = {"call": FmuCallError, "stopped": EngineStopped, "resume": ResumeError}


def read_ending(files: RunFiles) -> dict[str, Any] | None:
    """Return what the child wrote at its end, with its ``problem``; None where it did not come to write it."""
    try:
        found: dict[str, Any] = json.loads(files.file("ending").read_bytes())
    except (OSError, ValueError):
        return None
    found["problem"] = next((ERRORS[key](*found[key]) for key in ERRORS if key in found), None)
    return found


def main() -> None:
    """Run the job on standard input."""
    import pickle

    job, loads, folder, parent = pickle.load(sys.stdin.buffer)
    files = RunFiles(folder)
    run_job(job, loads, files, RunBoard(job.program, files.file("board")), parent)


if __name__ == "__main__":
    main()
