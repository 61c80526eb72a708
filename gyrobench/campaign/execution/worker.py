"""Work of a worker: a chunk of runs, each of which becomes a row whatever happens to it.

A worker keeps what it has loaded (a session for each setup, the last few) from chunk to chunk.  Runs of one process are
made one after the other.  A failure that is not the run's (full disk, another gyrobench) is raised, and ends the
campaign.
"""

from __future__ import annotations

import contextlib
import logging
import tempfile
import threading
import time
import traceback
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from distributed import Worker, WorkerPlugin

from gyrobench.campaign.execution.bundle import Assigned, tool_digest, unpack
from gyrobench.campaign.execution.campaign_plan import MEASURED, PlannedRun
from gyrobench.campaign.execution.guard import Guard, LostRun, lost_runs
from gyrobench.campaign.execution.rows import result_columns
from gyrobench.engine import engine_library
from gyrobench.engine.run_errors import RunError
from gyrobench.engine.session import Session
from gyrobench.errors import GyrobenchError
from gyrobench.files import MACHINE, temporary_folder
from gyrobench.packaging import compiler
from gyrobench.record.record import Record
from gyrobench.result import Result
from gyrobench.system.suite import Suite, load_test
from gyrobench.system.system import System
from gyrobench.workflow.measured_run import reduce_measured
from gyrobench.workflow.run_execution import RunRequest, execute_run
from gyrobench.workflow.user_errors import PostRunError, user_message

SESSIONS = 8  # loaded at a time


class MachineError(GyrobenchError):
    """A worker cannot work: its disk is full, or it has another gyrobench."""

    exit_code = 3


class PartialSuiteError(RunError):
    """Some tests of a suite have no result; what the others say is in ``result`` and, each by itself, in ``tests``."""

    def __init__(self, message: str, result: Result, tests: Mapping[str, Result]) -> None:
        super().__init__(message)
        self.result, self.tests = result, tests


@dataclass(frozen=True)
class ExecutionSettings:
    """All that the runs of a campaign have in common.

    campaign: name of this execution.  setups: as in the plan.  marks: a worker is a process that may be ended.
    """

    campaign: str
    tool: str
    system: str
    setups: tuple[Mapping[str, Assigned], ...]
    spec: str | None
    columns_map: str | None
    step: float | None
    check_step: bool | None
    nominal: Mapping[str, Any] | None  # values of parts that the design is held at
    keep: str
    time_limit: float
    memory_limit: int | None
    ends: bool


@dataclass
class Chunk:
    """Runs for a worker; content: of measured files, where a worker may not find them."""

    runs: list[PlannedRun]
    content: Mapping[str, bytes] = field(default_factory=dict)
    keep: str | None = None  # instead of that of the settings


@dataclass
class ChunkResult:
    """Result of a chunk: rows, units of columns, log and kept files."""

    rows: list[dict[str, Any]] = field(default_factory=list)
    units: dict[str, str] = field(default_factory=dict)
    log: list[dict[str, Any]] = field(default_factory=list)
    kept: dict[str, dict[str, bytes]] = field(default_factory=dict)


_busy = threading.Lock()
_states: dict[str, _WorkerState] = {}  # by campaign; one at a time


class BundlePlugin(WorkerPlugin):
    """Brings the bundle to every worker, those that join or restart later too."""

    def __init__(self, settings: ExecutionSettings, bundle: bytes) -> None:
        self.name = f"gyrobench-{settings.campaign}"
        self.settings, self.bundle = settings, bundle

    def setup(self, worker: Worker) -> None:
        """Keep the bundle for the chunks of this campaign."""
        limit = getattr(worker.memory_manager, "memory_limit", None)
        folder = marks_folder(self.settings.campaign, worker)
        if self.settings.campaign not in _states:
            _states[self.settings.campaign] = _WorkerState(self.settings, self.bundle, folder, worker.address, limit)

    def teardown(self, worker: Worker) -> None:
        """Free what this campaign has loaded."""
        state = _states.pop(self.settings.campaign, None)
        if state is not None:
            with _busy:
                state.close()


def run_chunk(campaign: str, chunk: Chunk) -> ChunkResult:
    """Run a chunk in this process."""
    with _busy:
        return _states[campaign].run(chunk)


def find_lost_runs(campaign: str, dask_worker: Worker) -> list[LostRun]:
    """Return which runs have ended processes on the machine of a worker; called beside what it works on."""
    return lost_runs(marks_folder(campaign, dask_worker))


def marks_folder(campaign: str, worker: Worker) -> Path:
    """Return the folder that the workers of a machine share."""
    return Path(worker.local_directory).parent / f"gyrobench-{campaign}"


class _WorkerState:
    """State of a process that works for a campaign: the unpacked bundle, loaded sessions, the guard."""

    def __init__(self, settings: ExecutionSettings, bundle: bytes, folder: Path, name: str, memory: int | None) -> None:
        self.settings, self.bundle, self.folder, self.name, self.memory = settings, bundle, folder, name, memory
        self.sessions: OrderedDict[tuple[int, str], Session] = OrderedDict()
        self.opened = False
        self.guard: Guard | None = None

    def _open(self) -> None:
        """Prepare this process, at the first chunk."""
        if self.opened:
            return
        if self.settings.tool != tool_digest():
            raise MachineError(
                f"worker {self.name}: its gyrobench differs from the one that sent the run; install the same everywhere"
            )
        self.root, self.inbox = unpack(self.bundle), temporary_folder()
        if (self.root / "engine").is_dir() and compiler.command(compiler.this_platform()) is None:
            engine_library.provide(next((self.root / "engine").iterdir()))
        self.bench = self.root / "bench"
        self.test: System | Suite = load_test(self.settings.system, self.bench)
        if self.settings.ends:
            logging.getLogger("gyrobench").setLevel(logging.ERROR)  # warnings are in the rows
            # where Ctrl-C ends the scheduler first, a message under way would be a traceback on the terminal
            logging.getLogger("distributed").setLevel(logging.CRITICAL)
            given = self.settings.memory_limit
            limit = given or (int(0.9 * self.memory) if self.memory else None)
            self.guard = Guard(self.folder, self.settings.time_limit, limit, bool(given))
        self.opened = True

    def close(self) -> None:
        """Free the sessions."""
        for session in self.sessions.values():
            session.close()
        self.sessions.clear()
        if self.guard:
            self.guard.close()

    def run(self, chunk: Chunk) -> ChunkResult:
        """Return the rows of a chunk."""
        try:
            self._open()
        except OSError as error:
            raise MachineError(f"worker {self.name}: {error.strerror or error}") from None
        done = ChunkResult()
        for run in chunk.runs:
            with self.guard.watching(run.run) if self.guard else contextlib.nullcontext():
                self._row(run, chunk, done)
        return done

    # ------------------------------------------------------------------------------------------ one run
    def _row(self, run: PlannedRun, chunk: Chunk, done: ChunkResult) -> None:
        start = time.perf_counter()
        row: dict[str, Any] = run.columns(self.settings.system)
        record: Record | None = None
        result: Result | None = None
        tests: Mapping[str, Result] = {}
        detail = ""
        try:
            record, result, tests = self._execute(run, chunk)
            row["state"] = "done"
        except MemoryError:
            row |= {"state": "memory", "reason": "not enough memory"}
        except Exception as error:
            _raise_of_machine(error, self.name)
            row["state"], row["reason"] = self._failure(error)
            if run.data is not None:  # the same path wherever the file was read
                row["reason"] = row["reason"].replace(f"{self.inbox}/", f"{Path(run.data).parent}/")
            record, result = getattr(error, "record", None), getattr(error, "result", None)
            tests = getattr(error, "tests", {})
            self._drop(run.setup)  # whatever state its FMUs are in
        if result is not None:
            columns, units = result_columns(result, tests)
            row |= columns
            done.units |= units
        if record is not None and record.run.measured:
            row |= {"instrument": record.run.instrument or None, "date": record.run.date or None}
        if self._keeps(row, chunk.keep or self.settings.keep):
            try:
                done.kept[run.run] = self._files(record, result)
            except Exception as error:
                _raise_of_machine(error, self.name)
                detail = f"its report failed: {user_message(error)}"
            row["report"] = f"kept/{run.run}/report.html" if "report.html" in done.kept.get(run.run, {}) else None
        done.rows.append(row)
        seconds = time.perf_counter() - start
        done.log.append(
            {"run": run.run, "worker": self.name, "seconds": seconds, "finished_at": _now(), "detail": detail}
        )

    @staticmethod
    def _keeps(row: Mapping[str, Any], keep: str) -> bool:
        failed = row["state"] != "done" or row.get("verdict") in ("fail", "void")
        return keep == "all" or (keep == "failures" and failed)

    def _execute(self, run: PlannedRun, chunk: Chunk) -> tuple[Record | None, Result | None, Mapping[str, Result]]:
        """Return record and result, and the results of the tests of a suite."""
        if run.setup == MEASURED:
            return *self._reduce(run, chunk), {}
        assert run.seed is not None
        spec = self.root / self.settings.spec if self.settings.spec else None
        request = RunRequest(
            seed=run.seed, step=self.settings.step, spec=spec, check_step=self.settings.check_step, in_memory=True
        )
        if isinstance(self.test, Suite):
            return None, *self._suite(run, request)
        system = self.test.with_values(run.values)
        system.nominal = None if self.settings.nominal is None else dict(self.settings.nominal)
        session = self._session(run.setup, "", system)
        outcome = execute_run(request, system, prepared=session)
        if outcome.stopped is not None:
            raise outcome.stopped
        return outcome.record, outcome.result, {}

    def _session(self, setup: int, member: str, system: System) -> Session:
        """Return the loaded session for a system of this structure, with the values of this one."""
        key = (setup, member)
        if key not in self.sessions:
            system.refuse()
            assigned = self.settings.setups[setup][member]
            root = self.root
            parts = {s: str(root / p) if p.endswith(".fmu") else p for s, p in assigned.parts.items()}
            self.sessions[key] = Session(
                system,
                parts,
                {s: root / f for s, f in assigned.maps.items()},
                bench=self.bench,
                prebuilt={name: root / f for name, f in assigned.prebuilt.items()},
            )
        session = self.sessions[key]
        self.sessions.move_to_end(key)
        while len(self.sessions) > SESSIONS:
            self.sessions.popitem(last=False)[1].close()
        session.system = system
        return session

    def _drop(self, setup: int) -> None:
        """Close the sessions of a setup."""
        for key in [k for k in self.sessions if k[0] == setup]:
            self.sessions.pop(key).close()

    def _reduce(self, run: PlannedRun, chunk: Chunk) -> tuple[Record, Result | None]:
        assert isinstance(self.test, System) and run.data is not None
        values = {name: str(value) for name, value in run.values.items()}
        spec = self.root / self.settings.spec if self.settings.spec else None
        file = Path(run.data)
        sent = run.data in chunk.content
        if sent:
            file = self.inbox / file.name
            file.write_bytes(chunk.content[run.data])
        columns = self.root / self.settings.columns_map if self.settings.columns_map else None
        test = self.test.with_values({})
        try:
            outcome = reduce_measured(test, file, values, spec, in_memory=True, formats=(), columns=columns)
        finally:
            if sent:
                file.unlink()
        return outcome.record, outcome.result

    def _suite(self, run: PlannedRun, request: RunRequest) -> tuple[Result, dict[str, Result]]:
        """Run the tests of a suite; return what it says of them, as gyrobench run does, and the result of each."""
        from gyrobench.record.run_document import SuiteTestRun
        from gyrobench.workflow.suite_report import suite_document, write_suite_report

        assert isinstance(self.test, Suite) and run.seed is not None
        suite = self.test.with_values(run.values)
        failed: dict[str, str] = {}
        results: dict[str, Result] = {}
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            members = suite.members(self.bench)
            for test, system in members.items():
                out = folder / test
                own = replace(
                    request, seed=suite.seed_of(run.seed, test), out=out, in_memory=False, formats=("json",), spec=None
                )
                try:
                    outcome = execute_run(own, system, prepared=self._session(run.setup, test, system))
                    if outcome.result is not None:
                        results[test] = outcome.result
                except Exception as error:
                    _raise_of_machine(error, self.name)
                    failed[test] = self._failure(error)[1].replace(f"{folder}/", "")
            document = suite_document(suite, {"system": suite.name, "seed": run.seed, "identity": run.run})
            document.tests = {n: SuiteTestRun(folder=n) for n in members if n not in failed}
            document.failed, document.complete = failed, not failed
            problem = "; ".join(f"{n}: {reason}" for n, reason in failed.items())
            if not document.tests:
                raise RunError(problem)
            spec = self.root / self.settings.spec if self.settings.spec else None
            said = write_suite_report(suite, folder, document, spec, ("json",)).result
            if failed:
                raise PartialSuiteError(problem, said, results)
            return said, results

    def _files(self, record: Record | None, result: Result | None) -> dict[str, bytes]:
        """Return the files of a run that is kept."""
        from gyrobench import report
        from gyrobench.workflow.manifest import write_manifest

        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            if record is not None:
                kept = record.folder
                record.save(folder)
                record.folder = kept
            if result is not None:
                report.write(result, folder, ("json", "html"), (record and record.channels) or None, self.bench)
                write_manifest(folder)
            return {str(f.relative_to(folder)): f.read_bytes() for f in folder.rglob("*") if f.is_file()}

    def _failure(self, error: Exception) -> tuple[str, str]:
        """Return the state and the reason of a run that raised an error: the same text on every machine."""
        state = "failed"
        if isinstance(error, PostRunError):
            error = error.__cause__ if isinstance(error.__cause__, Exception) else error
        elif isinstance(error, RunError):
            state = "refused" if error.exit_code == 2 else "failed"
        elif isinstance(error, GyrobenchError):
            state = "refused"
        text = str(error).partition("\nthe record ")[0]
        if not isinstance(error, GyrobenchError):
            text = f"{self._place(error)}{type(error).__name__}: {text}"
        return state, text.replace(f"{self.bench}/", "").replace(f"{self.root}/", "")

    def _place(self, error: Exception) -> str:
        """Return file and line of the innermost call in the bench, else in gyrobench."""
        frames = [(Path(f.filename), f.lineno) for f in traceback.extract_tb(error.__traceback__)]
        for root in (self.bench, Path(__file__).parents[3]):
            inside = [f"{file.relative_to(root)}:{line}: " for file, line in frames if file.is_relative_to(root)]
            if inside:
                return inside[-1]
        return ""


def _raise_of_machine(error: BaseException | None, worker: str) -> None:
    """Raise MachineError where an error, or what it comes from, is the machine's."""
    while error is not None:
        if isinstance(error, OSError) and error.errno in MACHINE:
            raise MachineError(f"worker {worker}: {error.strerror or error}") from None
        error = error.__cause__ or error.__context__


def _now() -> str:
    import datetime

    return datetime.datetime.now(datetime.UTC).isoformat(timespec="milliseconds")
