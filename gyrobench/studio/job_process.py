"""The process of one job: ``python -m gyrobench.studio.job_process FOLDER``.

It does what the command does, and writes how far it is into ``state.json``.  It has no tie to the studio but its
folder: the studio may end, be killed or start anew meanwhile.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import signal
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gyrobench import reading
from gyrobench.bench import Bench, UsageError
from gyrobench.errors import GyrobenchError
from gyrobench.files import FolderInUseError, FolderLock, write_whole
from gyrobench.studio.request import CommandRequest, JobRequest, first_shown, read_request

if TYPE_CHECKING:
    from gyrobench.arrays import Array
    from gyrobench.record.signal_view import LiveSignals

REQUEST, STATE, STARTED, LIVE = "job.json", "state.json", "started", "live.json"
LIVE_SIGNALS, LIVE_ROWS = 4, 1000
PRINTED, LONG = 400, 500  # lines of a command that are kept, characters of one
NICE = 5  # lower than the studio, whose pages answer while runs have all cores
WAIT = 5.0  # s for the lock, which the studio takes for a moment when it looks


@dataclass
class JobReport:
    """Account that a job gives of itself, kept in ``state.json``.

    state: running, done, stopped (it goes on with resume), failed.  fraction: 0 to 1, of the step named by ``label``.
    folder: of the run, once it is known.  advice: actions of :class:`gyrobench.errors.Advice` that go on from its end.
    """

    state: str = "running"
    label: str = ""
    fraction: float = 0.0
    words: str = ""
    notes: list[str] = field(default_factory=list)
    message: str = ""
    advice: list[str] = field(default_factory=list)
    folder: str = ""
    verdict: str = ""


def store(file: Path, content: Mapping[str, Any], durable: bool = True) -> None:
    """Write a file of a job, with its digest."""
    text = json.dumps(reading.sealed(content), ensure_ascii=False)
    write_whole(file, text.encode("utf-8", "backslashreplace"), durable)


def stored(file: Path) -> dict[str, Any] | None:
    """Return the content of a file of a job; None where there is none, or it was changed after it was written."""
    try:
        content, has = reading.opened(
            reading.json_object(reading.read_text(file, ValueError), file, ValueError), file, ValueError
        )
    except ValueError:
        return None
    return content if has else None


def read_report(folder: Path) -> JobReport | None:
    """Return what a job says of itself; None before it has said anything."""
    content = stored(folder / STATE)
    return None if content is None else JobReport(**content)


class _Writer:
    """Receives notes and progress of the workflow and keeps the report on disk."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.report = folder, JobReport()
        self.shown: Callable[[Sequence[str]], Sequence[str]] = lambda names: names  # those that are looked at first
        self.write()

    def write(self) -> None:
        store(self.folder / STATE, vars(self.report), durable=False)

    def notes(self, lines: Iterable[str]) -> None:
        self.report.notes += lines
        self.write()

    @contextlib.contextmanager
    def progress(self, label: str) -> Iterator[Callable[[Any], None]]:
        from gyrobench.record.signal_view import LiveSignals
        from gyrobench.workflow.progress_words import format_status

        live = LiveSignals(LIVE_ROWS)

        def show(status: Any) -> None:
            self.report.label, self.report.fraction = label, float(status.fraction)
            self.report.words = format_status(status)
            self.write()
            if (rows := getattr(status, "rows", None)) is not None:
                self._signals(live, status.units, *rows())

        yield show

    def _signals(self, live: LiveSignals, units: Mapping[str, str], names: Sequence[str], rows: Array) -> None:
        """Write the first signals as they are so far; SI."""
        shown = [*self.shown(names)][:LIVE_SIGNALS]
        live.add(rows[:, [0, *(1 + list(names).index(n) for n in shown)]])
        columns = [[x if math.isfinite(x) else None for x in c] for c in live.rows.T.tolist()]
        content = {
            "names": shown,
            "units": [units.get(n, "") for n in shown],
            "time": columns[0] if columns else [],
            "values": columns[1:],
        }
        store(self.folder / LIVE, content, durable=False)


def _execute(request: JobRequest, resume: bool, writer: _Writer) -> Any:
    """Return the outcome of a request, as the workflow gives it."""
    from gyrobench.report.language import reports_in

    with reports_in(request.language, request.system, Bench.find().folder):
        return _in_language(request, resume, writer)


def _in_language(request: JobRequest, resume: bool, writer: _Writer) -> Any:
    from gyrobench.system.suite import Suite
    from gyrobench.workflow.feedback import Feedback
    from gyrobench.workflow.inputs import load_test
    from gyrobench.workflow.run_execution import RunRequest, execute_run
    from gyrobench.workflow.settings import load_with_values

    feedback = Feedback(writer.notes, writer.progress)
    spec = request.spec or None
    if request.data:
        from gyrobench.workflow.measured_run import reduce_measured

        system = load_test(request.system)
        if isinstance(system, Suite):
            raise UsageError(f"{system.name} compares runs: reduce each record by its own test")
        columns = Path(request.columns) if request.columns else None
        return reduce_measured(system, Path(request.data), request.values, spec, feedback=feedback, columns=columns)
    test = load_with_values(request.system, request.values)
    writer.shown = lambda names: first_shown(names, list(getattr(test, "shown", ())))
    seed = getattr(test, "seed", 1) if request.seed is None else request.seed
    maps = {slot: Path(file) for slot, file in request.maps.items()}
    run = RunRequest(parts=request.parts, maps=maps, seed=seed, spec=spec, resume=resume)
    if isinstance(test, Suite):
        from gyrobench.workflow.suite_execution import execute_suite

        return execute_suite(run, test, feedback)
    return execute_run(run, test, feedback)


def _resumed(request: JobRequest, writer: _Writer) -> Any:
    """Return the outcome of a request that goes on where it was; killed before there was anything, it begins anew."""
    from gyrobench.workflow.run_folders import NothingToResumeError

    try:
        return _execute(request, True, writer)
    except NothingToResumeError:
        return _execute(request, False, writer)


def _outcome(request: JobRequest, resume: bool, writer: _Writer) -> Any:
    """Return the outcome of a request; a report that would be half in its language is written in English."""
    from gyrobench.report.language import ENGLISH, UntranslatedError
    from gyrobench.workflow.user_errors import PostRunError

    try:
        return _resumed(request, writer) if resume else _execute(request, False, writer)
    except PostRunError as error:
        if not isinstance(error.__cause__, UntranslatedError):
            raise
        writer.notes([error.__cause__.text])
        return _resumed(replace(request, language=ENGLISH), writer)


def _command(report: JobReport, request: CommandRequest, writer: _Writer) -> None:
    """Execute a command and keep the lines that it prints as notes; exit code 1 is an answer, too."""
    import subprocess

    command = [sys.executable, "-m", "gyrobench", *request.words]
    with subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, encoding="utf-8",
        errors="replace",
    ) as process:  # fmt: skip
        assert process.stdout is not None
        try:
            for line in process.stdout:
                report.notes = [*report.notes, line.rstrip("\n")[:LONG]][-PRINTED:]
                writer.write()
        except KeyboardInterrupt:
            process.send_signal(signal.SIGINT)
            raise
    pages = Bench.find().out / request.folder
    report.folder = str(pages) if request.folder and any(pages.glob("**/*.html")) else ""
    report.state = "done" if process.returncode in (0, 1) else "failed"


def _finish(report: JobReport, request: JobRequest | CommandRequest, resume: bool, writer: _Writer) -> None:
    """Execute the request and put its end into the report."""
    from gyrobench.workflow.user_errors import CommandInterrupted, user_message

    def ended(state: str, error: BaseException) -> None:
        report.state, report.message = state, user_message(error, at_shell=False)
        report.advice = [a.action for a in error.advice] if isinstance(error, GyrobenchError) else []

    try:
        if isinstance(request, CommandRequest):
            return _command(report, request, writer)
        outcome = _outcome(request, resume, writer)
        report.folder = str(outcome.folder or "")
        report.verdict = getattr(outcome, "verdict", "") or getattr(outcome.result, "verdict", "") or ""
        stopped = outcome.stopped
        report.state = "done"
        if stopped is not None:
            ended("done" if report.folder else "failed", stopped)
    except CommandInterrupted as error:
        ended("stopped", error)
    except KeyboardInterrupt:
        when = "before its report was written" if report.fraction else "before its first step"
        report.state, report.message = "stopped", f"stopped {when}"
    except Exception as error:
        ended("failed", error)


def main(folder: Path) -> int:
    """Run the job in a folder; return the exit code."""
    signal.signal(signal.SIGINT, signal.default_int_handler)  # whatever the studio was started with
    until = time.monotonic() + WAIT
    while True:
        try:
            lock = FolderLock(folder)
            break
        except FolderInUseError:
            if time.monotonic() > until:
                return 2
            time.sleep(0.05)
    with lock:
        writer = _Writer(folder)
        content = stored(folder / REQUEST)
        if content is None:
            writer.report.state, writer.report.message = "failed", f"{REQUEST} was changed after it was written"
            writer.write()
            return 3
        _finish(writer.report, read_request(content["request"]), bool(content["resume"]), writer)
        writer.write()
        return 0 if writer.report.state == "done" else 3


if __name__ == "__main__":
    os.environ.setdefault("GYROBENCH_TRACEBACK", "")
    if hasattr(os, "nice"):
        os.nice(NICE)
    sys.exit(main(Path(sys.argv[1])))
