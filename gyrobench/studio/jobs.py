"""The jobs of the studio: requests, each in a process of its own, at most so many at once.

A job is a folder, ``reports/out/studio/jobs/ID``: ``job.json`` (what is asked), ``state.json`` (how far it is), a lock
that its process holds.  The folders are the state: the studio may be closed or killed in between, any number of pages
may look, and what was waiting starts when the studio is there again.
"""

from __future__ import annotations

import contextlib
import os
import secrets
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from gyrobench.bench import Bench, UsageError
from gyrobench.errors import GyrobenchError
from gyrobench.files import LOCK, FolderLock, cores
from gyrobench.studio.job_process import REQUEST, STARTED, STATE, JobReport, read_report, store, stored
from gyrobench.studio.request import CommandRequest, JobRequest, read_request

FOLDER = Path("studio", "jobs")  # below reports/out
ENDED = ("done", "stopped", "failed", "lost")
BEGIN = 20.0  # s in which a process that was started takes its lock
SHOWN = 200  # jobs, the newest


@dataclass(frozen=True)
class StudioJob:
    """A job as it is now.

    state: waiting, starting, running, done, stopped, failed, lost (its process was killed).  created: s since 1970.
    """

    key: str
    request: JobRequest | CommandRequest
    resume: bool
    created: float
    state: str
    report: JobReport

    @property
    def active(self) -> bool:
        """True until the job has come to an end."""
        return self.state not in ENDED

    @property
    def resumable(self) -> bool:
        """True for what goes on where it was stopped."""
        ended_so = self.state in ("stopped", "lost") or (self.state in ENDED and "resume" in self.report.advice)
        return ended_so and self.request.resumable


class StudioJobs:
    """The jobs of a bench.

    most: running at once.  read_only: nothing is started or stopped.
    """

    def __init__(self, bench: Bench, most: int | None = None, read_only: bool = False) -> None:
        self.folder = bench.out / FOLDER
        self.home = bench.home
        self.most = most or max(1, min(4, cores()))
        self.read_only = read_only
        self._started: dict[str, subprocess.Popen[bytes]] = {}  # by this studio

    def submit(self, request: JobRequest | CommandRequest, resume: bool = False) -> str:
        """Queue a request and return the key of its job.  Raises UsageError where nothing may be started."""
        self._require_writable()
        key = f"{time.strftime('%Y%m%d-%H%M%S')}-{secrets.token_hex(4)}"
        folder = self.folder / key
        folder.mkdir(parents=True)
        content = {"request": request.as_dict(), "resume": resume, "created": time.time()}
        store(folder / REQUEST, content)
        self.advance()
        return key

    def resume(self, key: str) -> str:
        """Queue a job anew, to go on where it was stopped; return the key of the new job.  Raises UsageError."""
        job = self.find(key)
        if not job.resumable:
            raise UsageError(f"job {key} is {job.state}: there is nothing to continue")
        return self.submit(job.request, resume=True)

    def stop(self, key: str) -> None:
        """Ask a job to end; what it has recorded is kept.  Raises UsageError."""
        self._require_writable()
        job = self.find(key)
        if job.state == "waiting":
            stopped = JobReport(state="stopped", message="stopped before it began")
            store(self.folder / key / STATE, vars(stopped))
        elif job.active and (process := self._process(key)):
            with contextlib.suppress(ProcessLookupError):
                os.kill(process, signal.SIGINT)

    def find(self, key: str) -> StudioJob:
        """Return a job.  Raises UsageError where there is none of this key."""
        job = self._read(self.folder / key) if Path(key).name == key and key not in ("", ".", "..") else None
        if job is None:
            raise UsageError(f"no job {key!r}")
        return job

    def all(self) -> list[StudioJob]:
        """Return the jobs, the newest first."""
        folders = sorted(self.folder.glob("*/"), reverse=True)[:SHOWN] if self.folder.is_dir() else []
        return [job for f in folders if (job := self._read(f)) is not None]

    def advance(self) -> None:
        """Start what is waiting, as far as there is room."""
        if self.read_only:
            return
        jobs = self.all()
        room = self.most - sum(j.state in ("starting", "running") for j in jobs)
        waiting = sorted((j for j in jobs if j.state == "waiting"), key=lambda j: (j.created, j.key))
        for job in waiting[: max(0, room)]:
            self._start(job.key)

    def _start(self, key: str) -> None:
        folder = self.folder / key
        try:
            (folder / STARTED).touch(exist_ok=False)  # another studio on this bench was first
        except FileExistsError:
            return
        root = str(Path(__file__).parents[2])
        paths = os.pathsep.join(p for p in (root, os.environ.get("PYTHONPATH", "")) if p)
        with (folder / "printed.txt").open("wb") as printed:
            self._started[key] = subprocess.Popen(
                [sys.executable, "-m", "gyrobench.studio.job_process", str(folder)],
                stdin=subprocess.DEVNULL, stdout=printed, stderr=printed, cwd=self.home,
                env={**os.environ, "PYTHONPATH": paths}, start_new_session=os.name == "posix",
            )  # fmt: skip

    def _read(self, folder: Path) -> StudioJob | None:
        try:
            content = stored(folder / REQUEST) or {}
            request = read_request(content["request"])
            created, resume = float(content["created"]), bool(content["resume"])
        except (ValueError, TypeError, KeyError):
            return None
        report = read_report(folder)
        if report is not None and report.state in ENDED:
            state = report.state
        elif not (folder / STARTED).exists():
            state = "waiting"
        elif self._lives(folder, report is None):
            state = "starting" if report is None else "running"
        else:
            report = read_report(folder)  # it may have ended between the two looks
            state = report.state if report is not None and report.state in ENDED else "lost"
        return StudioJob(folder.name, request, resume, created, state, report or JobReport(state=state))

    def _lives(self, folder: Path, silent: bool) -> bool:
        """Return whether the process of a job is there; silent: it has said nothing yet."""
        process = self._started.get(folder.name)
        if process is not None:
            return process.poll() is None
        if not (folder / LOCK).exists():  # a studio that is gone has started it: not yet taken, or ended
            return silent and time.time() < (folder / STARTED).stat().st_mtime + BEGIN
        try:
            FolderLock(folder).release()
        except GyrobenchError:
            return True
        return False

    def _process(self, key: str) -> int | None:
        """Return the number of the process of a job that lives, as its lock names it."""
        process = self._started.get(key)
        if process is not None:
            return process.pid
        with contextlib.suppress(OSError, ValueError):
            return int((self.folder / key / LOCK).read_text())
        return None

    def _require_writable(self) -> None:
        if self.read_only:
            raise UsageError("the studio is read-only: gyrobench studio without --read-only starts runs")
