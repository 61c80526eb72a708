"""Reduction of a record and files of its report, of a run just made or of a saved one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from gyrobench import reading
from gyrobench.bench import Bench
from gyrobench.errors import GyrobenchError
from gyrobench.record.record import Record
from gyrobench.record.run_document import RecordError
from gyrobench.report import FORMATS, NAMES
from gyrobench.report.language import chosen
from gyrobench.report.result_json import read_document
from gyrobench.result import Result, StepCheck
from gyrobench.result_content import typed
from gyrobench.system.system import System
from gyrobench.workflow.inputs import load_limits
from gyrobench.workflow.manifest import write_manifest
from gyrobench.workflow.user_errors import PostRunError, record_kept


@dataclass(frozen=True)
class RunOutcome:
    """A run, its result (none of a system without reduction) and where both are kept (None: in memory only).

    stopped: what failed, or what the user stopped, after the run itself.
    """

    record: Record
    result: Result | None = None
    folder: Path | None = None
    paths: Mapping[str, Path] = field(default_factory=dict)
    stopped: PostRunError | None = None


def write_report(
    result: Result, folder: Path | None, record: Record | None, spec: Path | None, formats: Sequence[str] = FORMATS
) -> dict[str, Path]:
    """Write the report and return its files, none without a folder; those of an older one in other formats are removed.

    Raises SpecificationError where ``spec`` does not fit the result.
    """
    from gyrobench.report import check_units, write

    if spec is not None:
        check_units(spec, {c.name: c.unit for c in result.coefficients})
    if folder is None:
        return {}
    for kind in set(FORMATS) - set(formats):
        (folder / NAMES[kind]).unlink(missing_ok=True)
    paths = write(result, folder, formats, (record and record.channels) or None, Bench.find().folder, chosen())
    write_manifest(folder)
    return paths


def reduce_saved_run(folder: Path, system: System, spec: Path | None, formats: Sequence[str] = FORMATS) -> RunOutcome:
    """Reduce the record of a run of ``system`` again and write its report.

    Raises PostRunError, for an incomplete record with what it lacks.
    """
    record = Record.load(folder)
    limits = load_limits(spec)
    with record_kept(folder, record):
        old = folder / "result.json"  # the step check needs further runs and is kept
        check = _step_check(old) if old.exists() else None
        try:
            result = system.reduce(record, limits, check)
        except GyrobenchError:
            if record.complete:
                raise
            missing = missing_windows(record)
            raise PostRunError(f"{folder}: the record is not complete, so there is no report\n{missing}") from None
        return RunOutcome(record, result, folder, write_report(result, folder, record, spec, formats))


def _step_check(file: Path) -> StepCheck | None:
    """Return the step check of a result.json.  Raises RecordError for one that cannot be read or was changed."""
    held = read_document(reading.read_text(file, RecordError), file, RecordError).get("step_check") or {}
    try:
        check: StepCheck = typed(StepCheck, held)
    except TypeError:  # none, or of before the step was in u
        return None
    return None if check.other is None else check


def missing_windows(record: Record) -> str:
    """Return how far an incomplete record goes, phase by phase of its plan."""
    run = record.run
    lines = [run.problem or "the run did not end"]
    lines += [f"recorded until t = {run.stopped_at:,.9g} s"] if run.stopped_at is not None else []
    return "\n".join(f"  - {line}" for line in [*lines, *lacking_phases(record)])


def lacking_phases(record: Record, spare: int = 0) -> list[str]:
    """Return the phases of the plan that lack more than ``spare`` of their windows, as sentences."""
    done = [int(p) for p in record.windows.get("phase", [])]
    lines = []
    for row in record.run.plan:
        length = row.travel if row.mode == "rate" and row.travel else row.dwell
        expected = row.stops * round(length / row.window) if row.window else 0
        have = done.count(row.phase)
        if have < expected - spare:
            lines.append(f"phase {row.phase} ({row.label}): {have} of {expected} windows")
    return lines
