"""Runs in a child process: whatever an FMU does, the command ends with a message and the record until then.

The parent looks at the :class:`gyrobench.engine.run_board.RunBoard` that the child writes while it runs; nothing is
exchanged step by step, so that supervision costs no speed.  Whatever happens to the child, what it recorded is there.
"""

from __future__ import annotations

import contextlib
import os
import select
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.engine.child import Loads, RunFiles, read_ending, run_job
from gyrobench.engine.execution import Ending, Job
from gyrobench.engine.fmu_instance import FmuCallError
from gyrobench.engine.reference_engine import RunState
from gyrobench.engine.run_board import CALLS, RunBoard
from gyrobench.engine.run_driver import EngineStopped, Interrupts, ProgressReport

LOOK = 0.05  # s between two looks at the child
POLL = 0.01  # s between two questions whether it has ended, where the system does not tell
CHECK = 0.1  # s between two looks at its memory and what it prints
REPORT = 0.2  # s between two reports of progress
START = 60.0  # s until the child is at its first FMU
ASLEEP = 5.0  # s between two looks: this process did not run, nor did perhaps the other
ENDING = 10.0  # s without progress once the run is to end or has ended
PRINTED = 1 << 20  # bytes kept of what FMUs print
MAX_LINES = 5  # of them in a message
MEMORY_SHARE = 0.5  # of the machine's memory that a run may take


class _Forked:
    """A child made by fork: it has what this process has, at once."""

    def __init__(self, job: Job, loads: Loads, files: RunFiles, board: RunBoard) -> None:
        parent = os.getpid()
        self.pid = os.fork()
        if self.pid == 0:
            run_job(job, loads, files, board, parent)
        self.code: int | None = None

    def poll(self) -> int | None:
        """Return the exit code, that of a signal negative; None while the child lives."""
        if self.code is None:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            if pid:
                self.code = os.waitstatus_to_exitcode(status)
        return self.code

    def kill(self) -> None:
        os.kill(self.pid, signal.SIGKILL)

    def wait(self) -> None:
        while self.poll() is None:
            time.sleep(0.001)


def _spawn(job: Job, loads: Loads, files: RunFiles) -> subprocess.Popen[bytes]:
    """Return a child that starts Python anew."""
    import pickle

    import gyrobench

    root = str(Path(gyrobench.__file__).parents[1])
    paths = os.pathsep.join(p for p in (root, os.environ.get("PYTHONPATH", "")) if p)
    with files.file("printed").open("ab") as printed:
        process = subprocess.Popen(
            [sys.executable, "-m", "gyrobench.engine.child"],
            stdin=subprocess.PIPE,
            stdout=printed,
            stderr=printed,
            env={**os.environ, "PYTHONPATH": paths},
            start_new_session=os.name == "posix",
        )
    assert process.stdin is not None
    with contextlib.suppress(OSError), process.stdin:  # a child that is gone says so by its exit code
        pickle.dump((job, loads, files.folder, os.getpid()), process.stdin)
    return process


def can_fork() -> bool:
    """Return whether a fork of this process is safe: on Linux, without threads that may hold a lock."""
    return sys.platform == "linux" and threading.active_count() == 1


def memory_limit() -> int | None:
    """Return the bytes that a run may take; None where the system does not say what it has."""
    try:
        have = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return None
    with contextlib.suppress(OSError, ValueError):  # of a container
        have = min(have, int(Path("/sys/fs/cgroup/memory.max").read_text()))
    return int(MEMORY_SHARE * have)


def _resident(process: int) -> int:
    """Return the bytes of memory that a process has, 0 where the system does not say."""
    if sys.platform == "linux":
        with contextlib.suppress(OSError, ValueError, IndexError):
            pages = Path(f"/proc/{process}/statm").read_text().split()
            return int(pages[1]) * os.sysconf("SC_PAGE_SIZE")
    return 0


def _waited(process: int) -> float:
    """Return how long a process has waited for a processor that others had, s; 0 where the system does not say."""
    if sys.platform == "linux":
        with contextlib.suppress(OSError, ValueError, IndexError):
            return 1e-9 * int(Path(f"/proc/{process}/schedstat").read_text().split()[1])
    return 0.0


def supervise(
    job: Job,
    fmus: dict[str, tuple[Any, Path]],
    folder: Path,
    progress: Callable[[ProgressReport], None] | None = None,
    timeout: float = 60.0,
) -> Ending:
    """Run a job in a child process and return how it ended.

    fmus: slot -> model description and folder of its files.  folder: for files of the run.  timeout: s, for one call of
    an FMU; what other processes of a busy machine take from it does not count.
    """
    return _Supervisor(job, fmus, RunFiles(folder), progress, timeout).run()


class _Supervisor:
    def __init__(
        self,
        job: Job,
        fmus: dict[str, tuple[Any, Path]],
        files: RunFiles,
        progress: Callable[[ProgressReport], None] | None,
        timeout: float,
    ) -> None:
        self.job, self.files, self.progress, self.timeout = job, files, progress, timeout
        self.memory = memory_limit()
        self.loads = Loads(fmus, None if self.memory is None else 2 * self.memory)
        files.clear()
        self.forked = can_fork()
        self.inherited = _resident(os.getpid()) if self.forked else 0  # pages that the child shares with this process
        self.board = RunBoard(job.program, None if self.forked else files.file("board"))
        self.status = self.board.status
        self.process: Any = None
        self.end: int | None = None  # readable when the process has ended
        self.killed = ""  # why, in words
        self.began = self.looked = self.moved = time.monotonic()
        self.waited = 0.0  # for a processor, when it last moved
        self.seen: tuple[int, ...] = ()
        self.reported = (self.began, 0)  # time and steps
        self.given = 0  # rows of the channels that were shown
        self.due = self.checked = self.began  # of the next report, of the next look at memory and prints

    def run(self) -> Ending:
        h = self.job.schedule.step
        try:
            with Interrupts() as interrupts:
                job, loads, files = self.job, self.loads, self.files
                self.process = _Forked(job, loads, files, self.board) if self.forked else _spawn(job, loads, files)
                with contextlib.suppress(AttributeError, OSError):  # Linux
                    self.end = os.pidfd_open(self.process.pid)
                while self.process.poll() is None:
                    if interrupts.pressed:
                        self.status.stop = 1
                    self._look()
                    if self.end is None:
                        time.sleep(POLL)
                    else:
                        select.select([self.end], [], [], LOOK)
                ending = self._ending()
                if self.progress is not None and ending.problem is None and not interrupts.pressed:
                    self._report(time.monotonic())
        finally:
            self._end_process()
        if interrupts.pressed and ending.problem is None:  # too late for the child
            ending.problem = EngineStopped(f"interrupted at t = {self.status.k * h:.9g} s, the end of the run", True)
        return ending

    # ------------------------------------------------------------ while it runs
    def _look(self) -> None:
        now, s = time.monotonic(), self.status
        seen = (s.k, s.part, s.call, s.channel_rows, s.window_rows)
        if seen != self.seen or now - self.looked > ASLEEP:
            self.seen, self.moved, self.waited = seen, now, _waited(self.process.pid)
        elif (s.call or s.k < 0) and self._silent(now) > (patience := self._patience()):
            self._kill(f"no answer within {patience:g} s; its process was stopped")
        self.looked = now
        if self.progress is not None and s.k >= 0 and not s.stop and now >= self.due:
            self._report(now)
        if now < self.checked:
            return
        self.checked = now + CHECK
        if self.memory is not None and _resident(self.process.pid) > self.memory + self.inherited:
            self._kill(
                f"the run takes more than {self.memory / 1e9:.2g} GB of memory, {MEMORY_SHARE:.0%} of this machine's; "
                "its process was stopped"
            )
        printed = self.files.file("printed")
        with contextlib.suppress(OSError):
            if printed.stat().st_size > PRINTED:
                os.truncate(printed, 0)

    def _silent(self, now: float) -> float:
        """Return how long the child has not moved though it had a processor, s."""
        return now - self.moved - (_waited(self.process.pid) - self.waited)

    def _patience(self) -> float:
        if self.status.stop or self.files.file("ending").exists():
            return min(self.timeout, ENDING)
        return self.timeout if self.status.call else max(self.timeout, START)

    def _report(self, now: float) -> None:
        s, schedule = self.status, self.job.schedule
        h, (before, k_before) = schedule.step, self.reported
        self.reported, self.due = (now, s.k), now + REPORT
        rate = (s.k - k_before) / max(now - before, 1e-9)
        assert self.progress is not None
        self.progress(
            ProgressReport(
                s.k * h,
                schedule.total,
                s.k - s.first,
                s.windows + s.window_rows,
                rate,
                now - self.began,
                s.first * h,
                self._newest,
                self.job.units,
            )
        )

    def _newest(self) -> tuple[Sequence[str], Array]:
        """Return the names of the channels and the rows that came since the last call, some perhaps once more."""
        names = self.job.program.channel.names
        board = self.board.rows()[0]  # first: what leaves it meanwhile is in the file
        kept = self.files.rows("channel", 1 + len(names), self.given)
        self.given += len(kept)
        return names, np.concatenate([kept, board])

    def _kill(self, why: str) -> None:
        if not self.killed:
            self.killed = why
            self.process.kill()

    def _end_process(self) -> None:
        """End the child, whatever it does, and what it has started itself."""
        if self.process is None:
            return
        if self.end is not None:
            os.close(self.end)
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        if os.name == "posix":
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.killpg(self.process.pid, signal.SIGKILL)

    # ------------------------------------------------------------ after it has ended
    def _ending(self) -> Ending:
        found = read_ending(self.files)
        if found is None:
            return Ending(self._state({}), self._failure())
        if "fault" in found:
            raise RuntimeError(f"in the process of the run:\n{found['fault']}")
        checkpoints = self.job.checkpoints
        if checkpoints is not None and "checkpoints" in found:
            checkpoints.resumed_at, checkpoints.lost = found["checkpoints"]
        remarks = [*found["remarks"]]
        if self.process.poll() != 0:
            slot, call = self._call()
            remarks.append(f"{slot}: {call} after the end of the run: {self._words()}; the record is not affected")
        if lines := self._printed():
            remarks.append("FMUs printed, last: " + " | ".join(lines))
        state = self._state(found["state"]) if "state" in found else None
        return Ending(state, found["problem"], tuple(remarks))

    def _state(self, known: dict[str, Any]) -> RunState | None:
        """Return the state of the run with all its rows; ``known``: what the child told of it, nothing if it failed."""
        limit = self.job.schedule.limit
        k = int(self.status.k)
        if not known and not 0 <= k <= limit:  # a damaged count is worse than none
            return None
        program, (channel, window) = self.job.program, self.board.rows()
        return RunState(
            **{"k": k, "timed_seconds": dict.fromkeys(program.order, 0.0), **known},
            channel_rows=self._rows("channel", channel),
            window_rows=self._rows("window", window),
        )

    def _rows(self, name: str, last: Array) -> list[Array]:
        """Return the rows that were kept, and those in the block, each once."""
        kept = self.files.rows(name, last.shape[1])
        if len(kept):
            last = last[last[:, 0] > kept[-1, 0]]
        return [rows for rows in (kept, last) if len(rows)]

    def _failure(self) -> FmuCallError | EngineStopped:
        """Return the error of a child that ended without a word."""
        slot, call = self._call()
        h = self.job.schedule.step
        if not call:
            when = f" at t = {self.status.k * h:.12g} s" if self.status.k >= 0 else " before the first step"
            lines = "".join(f"\n  {line}" for line in self._printed())
            return EngineStopped(f"the run stopped{when}, between two calls of FMUs: {self._words()}{lines}", False)
        at = self.status.k * h if self.status.k >= 0 else None
        return FmuCallError(slot, call, self._words(), at, self._printed())

    def _call(self) -> tuple[str, str]:
        """Return the slot and the name of the call in hand, "" where there is none."""
        order, s = self.job.program.order, self.status
        known = 0 <= s.part < len(order) and 0 < s.call < len(CALLS)
        return (order[s.part], CALLS[s.call]) if known else ("", "")

    def _words(self) -> str:
        """Return in words how the child ended."""
        code = self.process.poll()
        if self.killed:
            return self.killed
        if code < 0:
            name = signal.Signals(-code).name if -code in set(signal.Signals) else f"signal {-code}"
            return f"its process crashed ({name})"
        return f"its process ended with exit code {code}"

    def _printed(self) -> list[str]:
        """Return the last lines that FMUs printed."""
        with contextlib.suppress(OSError), self.files.file("printed").open("rb") as file:
            file.seek(max(0, file.seek(0, os.SEEK_END) - 4096))
            text = file.read().decode("utf-8", "replace")
            printable = "".join(c if c.isprintable() or c == "\n" else " " for c in text)
            return [line.strip()[:200] for line in printable.strip().splitlines()][-MAX_LINES:]
        return []
