"""Measured data to the same report as a run."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path

from gyrobench.bench import Bench, UsageError
from gyrobench.commands import console
from gyrobench.commands.inputs import find_specification, load_limits, load_test
from gyrobench.commands.run_folders import prepare_folder
from gyrobench.commands.saved_run import write_report
from gyrobench.commands.user_errors import record_kept
from gyrobench.record.run_document import DataFile
from gyrobench.system.suite import Suite
from gyrobench.system.system import MeasuredData, System


def template(system: System) -> str:
    """Return an empty CSV with the columns that ``gyrobench reduce`` reads, and what each means.  Raises UsageError."""
    from gyrobench.system.lab_record import explained

    return explained(_measured_data(system).template)


def _measured_data(system: System) -> MeasuredData:
    """Return how a laboratory's record is read.  Raises UsageError for a system without, naming those that have one."""
    if system.measured_data is None:
        tests = {name: load_test(name) for name in Bench.find().systems()}
        known = [n for n, t in tests.items() if not isinstance(t, Suite) and t.measured_data is not None]
        raise UsageError(f"{system.name} has no reduction of measured data; there is one for {', '.join(known)}")
    return system.measured_data


def reduce(
    system: System,
    data: Sequence[Path],
    values: Mapping[str, str],
    spec: str | None,
    out: Path | None,
    force: bool = False,
    as_json: bool = False,
) -> str:
    """Reduce a laboratory's file, write and print the report; return the verdict.

    values: as given to --set, for the reader.  Raises UsageError, DataError, ReductionError and PostRunError.
    """
    reader = _measured_data(system).read
    if len(data) > 1:
        raise UsageError(f"{system.name} reduces one record at a time; --data was given {len(data)} times")
    file = find_specification(spec)
    limits = load_limits(file)
    text = data[0].read_bytes()
    record = reader(system, data[0], values)
    record.run.data = DataFile(file=data[0].name, sha256=hashlib.sha256(text).hexdigest())
    identity = hashlib.sha256(text + repr(sorted(values.items())).encode()).hexdigest()[:8]
    folder = out or Bench.find().out / system.name / f"measured-{identity}"

    def save() -> None:
        prepare_folder(folder, {"system": system.name, "data": {"file": data[0].name}}, force)
        record.save(folder)

    with record_kept(folder, save):
        result = system.reduce(record, limits)
    save()
    result.provenance = record.run.as_dict()
    with record_kept(folder):
        paths = write_report(result, folder, record, file)
    console.print_report_files(paths, None if as_json else console.format_result(result))
    return result.verdict
