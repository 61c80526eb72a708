"""Reduction of a run that another tool has made of an exported system, with the same report as a run of the bench."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import TYPE_CHECKING

from gyrobench.arrays import Array
from gyrobench.bench import Bench, UsageError
from gyrobench.errors import GyrobenchError
from gyrobench.exchange.excitations import check_excitations
from gyrobench.exchange.external_record import ResultReader, check_parameters, find_series
from gyrobench.exchange.result_files import ResultFile, open_result
from gyrobench.exchange.ssp_export import recorded
from gyrobench.files import sha256
from gyrobench.record.record import Record
from gyrobench.record.run_document import DataFile
from gyrobench.system.system import System
from gyrobench.workflow.feedback import SILENT, Feedback
from gyrobench.workflow.inputs import find_specification, load_limits
from gyrobench.workflow.run_execution import RunRequest, open_session
from gyrobench.workflow.run_folders import prepare_folder
from gyrobench.workflow.saved_run import RunOutcome, lacking_phases, missing_windows, write_report
from gyrobench.workflow.user_errors import PostRunError, record_kept

if TYPE_CHECKING:
    from gyrobench.engine.session import Session

ENGINE = "another tool"


def reduce_result(request: RunRequest, system: System, source: Path | Array, feedback: Feedback = SILENT) -> RunOutcome:
    """Reduce a result file, a folder of libcosim or a structured array; write record and report.

    request: parts and mapping files as at the export; out, force, spec, formats, in_memory.  Raises UsageError, what a
    run raises before it runs, DataError for a file that cannot be used, ReductionError and PostRunError.
    """
    if not system.has_reduction:
        raise UsageError(f"{system.name} has no reduction: a run of it ends with its record")
    if isinstance(source, Path) and not source.exists():
        raise UsageError(f"--from {source}: no such file")
    spec = find_specification(request.spec)
    limits = load_limits(spec)
    result_file = open_result(source)
    with open_session(request, system) as session:
        feedback.notes(session.notes)
        record = external_record(session, result_file, _data_file(source))
    run = record.run
    identity = {"system": run.system, "data": run.data.as_dict() if run.data else {}, "options": run.options}
    identity = json.loads(json.dumps({**identity, "parameters": run.parameters}, default=str))
    digest = hashlib.sha256(json.dumps(identity, sort_keys=True).encode()).hexdigest()[:8]
    folder = None if request.in_memory else request.out or Bench.find().out / system.name / f"external-{digest}"
    if folder is not None:
        prepare_folder(folder, identity, request.force)
        record.save(folder)
    with record_kept(folder, record):
        try:
            result = system.reduce(record, limits)
        except (GyrobenchError, KeyError) as error:
            if not run.complete:
                text = f"the record is not complete, so there is no report\n{missing_windows(record)}"
                raise PostRunError(text, record) from None
            if isinstance(error, KeyError):
                lacks = ", ".join(n for n in system.channels if n not in record.channels)
                raise PostRunError(f"the reduction needs {error}; not in the file: {lacks or 'nothing else'}") from None
            raise
        paths = write_report(result, folder, record, spec, request.formats)
    return RunOutcome(record, result, folder, paths)


def external_record(session: Session, result: ResultFile, data: DataFile) -> Record:
    """Return the record of a run that another tool has made, with the values of the session's system."""
    system, _, run = session.prepare()
    assembly = session.assembly
    outputs = recorded(assembly)
    windows = system.windows
    needed = {windows.watch, *windows.columns.values()} if windows else {n for n in outputs if n in system.channels}
    held = {slot for slot, b in assembly.bindings.items() if b.socket.name == "Sampler"}
    series, missing = find_series(result, outputs, needed, held)
    stated = check_parameters(result, assembly.bindings, run.parameters)
    run.engine, run.seed = ENGINE, None
    run.order, run.cuts, run.delays = [], [], {}
    run.parameters = {n: v for n, v in run.parameters.items() if not n.endswith(".seed")}
    run.data = data
    run.external = [
        f"The run was made by another tool ({run.data.file}). How it couples the parts within a communication step is "
        "not known: the effect of the step is not in u."
    ]
    if not stated:
        run.external.append("The file does not state the values of the run: those given here are assumed.")
    reader = ResultReader(system, result, series, run.step)
    reader.read()
    record = reader.record(run)
    check_excitations(record)
    if missing := [n for n in missing if n in system.channels]:
        run.notes.append(f"Channels that are not in the file: {', '.join(missing)}.")
    # without the end of the plan in the file: a window by angle less may be as it should
    run.complete = not lacking_phases(record, spare=1) if reader.done is None else reader.done
    if not run.complete:
        run.problem = "the file ends before the plan"
    return record


def _data_file(source: Path | Array) -> DataFile:
    """Return name and digest of what was reduced; of a folder, those of its files together."""
    if not isinstance(source, Path):
        return DataFile(file="an array", sha256=hashlib.sha256(source.tobytes()).hexdigest())
    if source.is_file():
        return DataFile(file=source.name, sha256=sha256(source))
    files = sorted(f for f in source.glob("*.csv"))
    digests = "".join(f"{f.name} {sha256(f)}\n" for f in files)
    return DataFile(file=source.name, sha256=hashlib.sha256(digests.encode()).hexdigest())
