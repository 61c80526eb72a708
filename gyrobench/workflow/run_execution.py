"""Execution of a single run: request, record, reduction, report."""

from __future__ import annotations

import contextlib
import shlex
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gyrobench.bench import Bench, display_path
from gyrobench.engine.checkpoint import CheckpointManager
from gyrobench.errors import RESUMING, Advice, GyrobenchError
from gyrobench.record.record import Record
from gyrobench.report import FORMATS, NAMES
from gyrobench.result import Coefficient, Reason, Specification, StepChange, StepCheck
from gyrobench.system.system import System
from gyrobench.workflow.ahead import importing
from gyrobench.workflow.feedback import SILENT, Feedback
from gyrobench.workflow.forecast import forecasting
from gyrobench.workflow.inputs import check_fmu_files, find_specification, load_limits, require_slots
from gyrobench.workflow.run_folders import partial_folder, prepare_run_folder
from gyrobench.workflow.saved_run import RunOutcome, write_report
from gyrobench.workflow.user_errors import CommandInterrupted, PostRunError, record_kept, user_message

if TYPE_CHECKING:
    from gyrobench.engine.session import Session

OTHER = 10.0  # times a measure: a change by the double step that is no effect of its first order


@dataclass(frozen=True)
class RunRequest:
    """The settings of a run other than the system and its values.

    step: s, None for the system's own.  timeout: s, for one call of an FMU, None for the usual.  in_memory: nothing is
    written, ``out``, ``force`` and ``resume`` have no meaning.  formats: of the report.  check_step: whether what the
    step does is found by further runs; None: by short ones for a system with loops or one that is coupled in parallel,
    else not.
    """

    parts: Mapping[str, str] = field(default_factory=dict)
    maps: Mapping[str, Path] = field(default_factory=dict)
    seed: int = 1
    engine: str | None = None
    step: float | None = None
    out: Path | None = None
    force: bool = False
    spec: str | Path | None = None
    check_step: bool | None = None
    timeout: float | None = None
    resume: bool = False
    in_memory: bool = False
    formats: tuple[str, ...] = FORMATS


def open_session(request: RunRequest, system: System) -> Session:
    """Return a system with its FMUs loaded.  Raises UsageError, and what Session raises."""
    from gyrobench.engine.session import TIMEOUT, Session

    require_slots(system).refuse()
    check_fmu_files(request.parts)
    return Session(
        system, request.parts, request.maps, engine=request.engine, bench=Bench.find().folder, child=True,
        timeout=request.timeout or TIMEOUT,
    )  # fmt: skip


def execute_run(
    request: RunRequest, system: System, feedback: Feedback = SILENT, prepared: Session | None = None
) -> RunOutcome:
    """Run a system with its values set; write record and report, unless the request keeps them in memory.

    prepared: the session of an earlier run of the same system, values, parts, engine and timeout.

    Raises what Session.run raises, and PostRunError for whatever goes wrong after the run: its text names the folder
    of the record, its attribute ``record`` holds it.
    """
    spec = find_specification(request.spec)
    limits = load_limits(spec)
    with open_session(request, system) if prepared is None else contextlib.nullcontext(prepared) as session:
        if request.in_memory:
            record = _run(request, feedback, session, None, None)
            return _report(request, system, feedback, session, record, None, limits)
        step, files = request.step or system.step, [NAMES[f] for f in request.formats]
        folder, checkpoints, lock = prepare_run_folder(
            session, system, request.seed, step, request.maps, request.out, request.force, request.resume, files
        )
        with lock:
            run_now = checkpoints is not None  # else the record is there, its report is not
            record = _run(request, feedback, session, folder, checkpoints) if run_now else Record.load(folder)
            return _report(request, system, feedback, session, record, folder, limits, spec)


def _run(
    request: RunRequest,
    feedback: Feedback,
    session: Session,
    folder: Path | None,
    checkpoints: CheckpointManager | None,
) -> Record:
    """Run and save the record, as far as it comes."""
    from gyrobench.engine.run_errors import RunError, RunInterrupted

    feedback.notes([*session.notes, *(checkpoints.notes() if checkpoints else ())])
    try:
        with feedback.progress(session.system.name) as progress:
            step = request.step or session.system.step
            progress = forecasting(progress, session, step, folder is not None, request.check_step is True, feedback)
            if {"html", "pdf"} & set(request.formats) and folder is not None and session.system.has_reduction:
                progress = importing(progress)
            record = session.run({}, request.seed, request.step, None, progress, checkpoints)
    except RunError as error:
        if error.record is None or folder is None:
            raise
        kept = error.record.save(partial_folder(folder))  # beside a complete record of the same run, not over it
        message = f"{error.text}\nthe record until then is kept in {display_path(kept)}"
        if isinstance(error, RunInterrupted):
            report = f"gyrobench report {shlex.quote(display_path(kept))}"
            reducing = Advice("reduce", f"{report} reduces it, or lists what is missing")
            raise CommandInterrupted(message, error.record).advised(*error.advice, reducing) from None
        there = checkpoints is not None and checkpoints.is_there
        going_on = [Advice("resume", f"{RESUMING} goes on from its last checkpoint")] if there else []
        raise PostRunError(message, error.record).advised(*going_on) from None
    if folder is not None and checkpoints is not None:
        record.save(folder)
        checkpoints.remove()
    return record


def _report(
    request: RunRequest,
    system: System,
    feedback: Feedback,
    session: Session,
    record: Record,
    folder: Path | None,
    limits: Specification | None,
    spec: Path | None = None,
) -> RunOutcome:
    """Reduce a record, with the effect of the step where it is wanted, and write its report."""
    from gyrobench.engine.run_errors import RunInterrupted

    stopped: PostRunError | None = None
    step = request.step or system.step
    with record_kept(folder, record):
        check: StepCheck | None = None
        by_default = bool(system.loops) or system.closed_loop or system.coupling == "parallel"
        wanted = by_default if request.check_step is None else request.check_step
        kept = "report" if system.has_reduction else "record"
        if wanted and record.complete:
            try:
                if system.has_reduction:
                    check = check_step(session, system, request.seed, step, feedback, short=request.check_step is None)
                else:
                    record.run.notes += channel_step_effect(session, record, request.seed, step, feedback)
            except RunInterrupted as error:
                stopped = CommandInterrupted(f"step check {error}; the {kept} is without it")
            except Exception as error:
                stopped = PostRunError(f"step check: {user_message(error)}\nthe {kept} is without it")
                stopped.__cause__ = error
        unknown = ""
        if stopped is not None and request.check_step is None and not isinstance(stopped, CommandInterrupted):
            unknown, stopped = f"{stopped}.".replace(":\n  - ", ": ").replace("\n", "; "), None
        if not system.has_reduction:
            if unknown:
                record.run.notes.append(f"The effect of the communication step is not known: {unknown}")
                feedback.notes(record.run.notes[-1:])
            if folder is not None and wanted:
                record.save(folder)
            return RunOutcome(record, folder=folder, stopped=stopped)
        reasons = [Reason("step.missing", f"The communication step is not in u: {unknown}")] if unknown else []
        result = system.reduce(record, limits, check, reasons)
        paths = write_report(result, folder, record, spec, request.formats)
        return RunOutcome(record, result, folder, paths, stopped)


def channel_step_effect(
    session: Session, record: Record, seed: int, step: float, feedback: Feedback = SILENT
) -> list[str]:
    """Return what half the step changes in the channels of a run without a reduction, as a sentence for each."""
    with feedback.progress(f"step check, {0.5 * step:g} s") as progress:
        other = session.run({}, seed, 0.5 * step, None, progress).channels
    sentences = []
    for name, values in record.channels.items():
        if name == "time":
            continue
        rows = min(len(values), len(other[name]))
        change = float(np.max(np.abs(other[name][:rows] - values[:rows]), initial=0.0))
        span = float(np.ptp(values)) if len(values) else 0.0
        share = f" ({change / span:.2g} of its range)" if span > 0.0 else ""
        sentences.append(f"Half the step changes {name} by up to {change:.3g}{share}.")
    feedback.notes(sentences)
    return sentences


def check_step(
    session: Session, system: System, seed: int, step: float, feedback: Feedback = SILENT, short: bool = False
) -> StepCheck:
    """Return what the step does to each coefficient, from two runs with the noise off; see reduction.step_effect.

    The second run has half the step.  short: twice the step, in a quarter of the time, and the shortest holds that the
    system takes; half the step where the parts refuse the double one, have no figures there, or others (a loop hunts).
    """
    import time

    from gyrobench.engine.run_errors import RunInterrupted
    from gyrobench.reduction.estimation.step_effect import step_effects

    bindings = session.assembly.bindings
    known = {f"{slot}.{name}" for slot, binding in bindings.items() for name in binding.parameters}
    values: dict[str, Any] = {name: 0.0 for name in system.noises if name in known}
    hold = system.options.get("hold")
    if short and hold is not None and hold.min is not None:
        values["hold"] = min(hold.min, system["hold"])

    def coefficients(h: float) -> list[Coefficient]:
        with feedback.progress(f"step check, {h:g} s") as progress:
            return system.reduce(session.run(values, seed, h, None, progress)).coefficients

    start = time.perf_counter()
    at_step = coefficients(step)
    rows: list[StepChange] = []
    factor = 2.0 if short else 0.5
    if any(not c.no_value for c in at_step):
        try:
            rows = step_effects(at_step, coefficients(factor * step), factor)
        except RunInterrupted:
            raise
        except GyrobenchError:
            if not short:
                raise
        sizes = {c.name: abs(c.estimate) for c in at_step}
        if not rows or (short and any(r.unit != "dB" and abs(r.change) > OTHER * sizes[r.name] > 0.0 for r in rows)):
            factor = 0.5
            rows = step_effects(at_step, coefficients(factor * step), factor)
    return StepCheck(step, rows, factor * step, time.perf_counter() - start)
