"""Execution of a single run: request, record, reduction, report."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gyrobench.bench import Bench, display_path
from gyrobench.engine.checkpoint import CheckpointManager
from gyrobench.report import FORMATS
from gyrobench.result import Result
from gyrobench.system.system import System
from gyrobench.workflow.feedback import SILENT, Feedback
from gyrobench.workflow.inputs import check_fmu_files, find_specification, load_limits, require_slots
from gyrobench.workflow.run_folders import prepare_run_folder, save_partial_record
from gyrobench.workflow.saved_run import RunOutcome, reduce_run, write_report
from gyrobench.workflow.user_errors import CommandInterrupted, PostRunError, record_kept, user_message

if TYPE_CHECKING:
    from gyrobench.engine.session import Session


@dataclass(frozen=True)
class RunRequest:
    """The settings of a run other than the system and its values.

    step: s, None for the system's own.  in_memory: nothing is written, ``out``, ``force`` and ``resume`` have no
    meaning.  formats: of the report.
    """

    parts: Mapping[str, str] = field(default_factory=dict)
    maps: Mapping[str, Path] = field(default_factory=dict)
    seed: int = 1
    engine: str | None = None
    step: float | None = None
    out: Path | None = None
    force: bool = False
    spec: str | Path | None = None
    check_step: bool = False
    isolate: tuple[str, ...] = ()
    resume: bool = False
    in_memory: bool = False
    formats: tuple[str, ...] = FORMATS


def open_session(request: RunRequest, system: System) -> Session:
    """Return a system with its FMUs loaded.  Raises UsageError, and what Session raises."""
    from gyrobench.engine.session import Session

    require_slots(system).refuse()
    check_fmu_files(request.parts)
    return Session(
        system, request.parts, request.maps, engine=request.engine, isolate=request.isolate, bench=Bench.find().folder
    )


def execute_run(
    request: RunRequest, system: System, feedback: Feedback = SILENT, prepared: Session | None = None
) -> RunOutcome:
    """Run a system with its values set; write record and report, unless the request keeps them in memory.

    prepared: the session of an earlier run of the same system, values, parts, engine and isolated slots.

    Raises what Session.run raises, and PostRunError for whatever goes wrong after the run: its text names the folder
    of the record, its attribute ``record`` holds it.
    """
    from gyrobench.engine.session import RunError, RunInterrupted

    spec = find_specification(request.spec)
    limits = load_limits(spec)
    with open_session(request, system) if prepared is None else contextlib.nullcontext(prepared) as session:
        step = request.step or system.step
        folder: Path | None = None
        checkpoints: CheckpointManager | None = None
        if not request.in_memory:
            folder, checkpoints = prepare_run_folder(
                session, system, request.seed, step, request.maps, request.out, request.force, request.resume
            )
        feedback.notes([*session.notes, *(checkpoints.notes() if checkpoints else ())])
        try:
            with feedback.progress(system.name) as progress:
                record = session.run({}, request.seed, request.step, None, progress, checkpoints)
        except RunError as error:
            if error.record is None or folder is None:
                raise
            kept = save_partial_record(error.record, folder)
            message = f"{error}\nthe record until then is kept in {display_path(kept)}"
            if isinstance(error, RunInterrupted):
                raise CommandInterrupted(f"{message} (gyrobench report lists what is missing)", error.record) from None
            raise PostRunError(message, error.record) from None
        if folder is not None and checkpoints is not None:
            record.save(folder)
            checkpoints.remove()
        stopped: PostRunError | None = None
        with record_kept(folder, record):
            if not system.has_reduction:
                return RunOutcome(record, folder=folder)
            result = reduce_run(system, record, limits)
            if request.check_step:
                try:
                    result.step_check = check_step(session, system, result, request.seed, step, feedback)
                except RunInterrupted as error:
                    stopped = CommandInterrupted(f"step check {error}; the report is without it")
                except Exception as error:
                    stopped = PostRunError(f"step check: {user_message(error)}\nthe report is without it")
                    stopped.__cause__ = error
            paths = write_report(result, folder, record, spec, request.formats)
            return RunOutcome(record, result, folder, paths, stopped)


def check_step(
    session: Any, system: System, result: Result, seed: int, step: float, feedback: Feedback = SILENT
) -> dict[str, Any]:
    """Return the change of each coefficient when the step is halved, noise off, against its standard uncertainty."""
    bindings = session.assembly.bindings
    known = {f"{slot}.{name}" for slot, binding in bindings.items() for name in binding.parameters}
    quiet = {name: 0.0 for name in system.noises if name in known}
    estimates: list[dict[str, float]] = []
    for h in (step, step / 2.0):
        with feedback.progress(f"step check, {h:g} s") as progress:
            reduced = system.reduce(session.run(quiet, seed, h, None, progress))
        estimates.append({c.name: c.estimate for c in reduced.coefficients})
    full, half = estimates
    rows: list[dict[str, Any]] = []
    for c in result.coefficients:
        if c.name in full and c.name in half:  # a coefficient of the noise alone is missing without it
            change = half[c.name] - full[c.name]
            ratio = abs(change) / c.u if c.u > 0.0 else None
            rows.append({"name": c.name, "unit": c.unit, "change": change, "u": c.u, "ratio": ratio})
    worst = max((r["ratio"] for r in rows if r["ratio"] is not None), default=None)
    return {"step": step, "rows": rows, "worst": worst}
