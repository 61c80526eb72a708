"""Reduction of measured data, with the same report as a run."""

from __future__ import annotations

import hashlib
import shlex
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory

from gyrobench.bench import Bench, UsageError, display_path
from gyrobench.errors import Advice, GyrobenchError
from gyrobench.record.csv_reader import DataError
from gyrobench.record.log_files import as_text, is_log
from gyrobench.record.record import Record
from gyrobench.record.run_document import FILE as RUN
from gyrobench.record.run_document import DataFile
from gyrobench.report import FORMATS
from gyrobench.system.system import MeasuredData, System
from gyrobench.workflow.empty_record import measured_data
from gyrobench.workflow.feedback import SILENT, Feedback
from gyrobench.workflow.inputs import find_specification, load_limits
from gyrobench.workflow.run_folders import prepare_folder
from gyrobench.workflow.saved_run import RunOutcome, write_report
from gyrobench.workflow.user_errors import record_kept


def reduce_measured(
    system: System,
    data: Path,
    values: Mapping[str, str],
    spec: str | Path | None = None,
    out: Path | None = None,
    force: bool = False,
    in_memory: bool = False,
    formats: Sequence[str] = FORMATS,
    feedback: Feedback = SILENT,
    columns: Path | None = None,
) -> RunOutcome:
    """Reduce a laboratory's file; write record and report, unless they are kept in memory.

    values: as given to --set, for the reader.  columns: column map of a file of another layout.  Raises
    UsageError, DataError, ReductionError and PostRunError.
    """
    measured = measured_data(system)
    data = Bench.find().existing(data)
    if data.is_dir() and not (data / RUN).is_file():
        raise UsageError(f"{data}: no run there (no {RUN}); name a file, or the folder of a run")
    file = find_specification(spec)
    limits = load_limits(file)
    if columns is not None:
        record = _read_mapped(measured, system, data, values, columns, feedback)
    else:
        try:
            as_it_is = not is_log(data) or (measured.progress and data.suffix.lower() == ".parquet")
            record = _read(measured, system, data if as_it_is else as_text(data), values, feedback)
        except DataError as error:
            raise DataError(data, error.problems).advised(*_fitting(system, data)) from None
    with (data / RUN if data.is_dir() else data).open("rb") as content:
        digest = hashlib.file_digest(content, "sha256")
    record.run.data = DataFile(file=data.name, sha256=digest.hexdigest())
    if columns is not None:
        written = columns.read_bytes()
        record.run.data.columns, record.run.data.columns_sha256 = columns.name, hashlib.sha256(written).hexdigest()
        digest.update(written)
    digest.update(repr(sorted(values.items())).encode())
    identity = digest.hexdigest()[:8]
    folder = None if in_memory else out or Bench.find().out / system.name / f"measured-{identity}"

    def save() -> None:
        if folder is not None:
            prepare_folder(folder, {"system": system.name, "data": {"file": data.name}}, force)
            record.save(folder)

    with record_kept(folder, record, save):
        result = system.reduce(record, limits)
    save()
    with record_kept(folder, record):
        paths = write_report(result, folder, record, file, formats)
    return RunOutcome(record, result, folder, paths)


def find_faults(system: System, data: Path, values: Mapping[str, str], columns: Path | None = None) -> list[str]:
    """Return all that is wrong with a file, as sentences; nothing where it can be reduced.  Nothing is reduced.

    Arguments as of :func:`reduce_measured`.  Raises UsageError for what is wrong beside the file.
    """
    measured = measured_data(system)
    try:
        if columns is not None:
            _read_mapped(measured, system, data, values, columns, SILENT)
        else:
            _read(measured, system, data, values, SILENT)
    except DataError as error:
        return list(error.problems)
    return []


def _fitting(system: System, data: Path) -> list[Advice]:
    """Return the command that proposes a column map, where one finds columns in a file with a layout of its own: other
    names, rows above or below them, times of day, units spelled out.
    """
    from gyrobench.record.csv_reader import read_head
    from gyrobench.workflow.fit_columns import propose_columns

    with suppress(GyrobenchError):
        proposal = propose_columns(data, system.name)
        layout, found = proposal.layout, proposal.found
        named = all(
            str(c.sources[0]).partition("[")[0].strip() == name and (c.unit or proposal.wanted[name] in ("", "1"))
            for name, c in found.items()
        )
        timed = any(column.time for column in found.values())
        spelled = any(column.unit and column.written.strip("[]() ") != column.unit for column in found.values())
        own = not (named and layout.names) or timed or spelled or layout.below
        if own or (found and read_head(proposal.text_file).line != layout.skip + 1):
            out = f"{data.stem}.toml"
            fit = shlex.join(["gyrobench", "fit", display_path(data), "--system", system.name, "--out", out])
            return [Advice("fit", f"the file has a layout of its own; {fit} proposes a column map for --columns")]
    return []


def _read(measured: MeasuredData, system: System, data: Path, values: Mapping[str, str], feedback: Feedback) -> Record:
    if not measured.progress:
        return measured.read(system, data, values)
    with feedback.progress("reading") as progress:
        return measured.read(system, data, values, progress)


def _read_mapped(
    measured: MeasuredData, system: System, data: Path, values: Mapping[str, str], columns: Path, feedback: Feedback
) -> Record:
    """Return the record of a file under its column map.  Raises DataError with all that is wrong with the file."""
    from gyrobench.record.column_map import read_map, translate

    found = read_map(columns)
    with TemporaryDirectory() as folder:
        file = Path(folder) / "columns.csv"
        done = translate(data, found, file)
        problems = done.problems()
        try:
            record = _read(measured, system, file, {**found.values(), **values}, feedback)
        except DataError as error:
            raise DataError(data, done.problems(error.problems)) from None
    if problems:
        raise DataError(data, problems)
    record.run.notes = [*record.run.notes, *done.notes()]
    return record
