"""What exists already: a laboratory's records, and the records of runs, reduced (again)."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from gyrobench.bench import Bench, UsageError
from gyrobench.commands import console
from gyrobench.commands.run_folders import claim
from gyrobench.commands.run_system import (
    Done,
    limits_of,
    load,
    publish,
    reduced,
    show_paths,
    specification,
)
from gyrobench.commands.user_errors import PostRunError, record_kept
from gyrobench.errors import GyrobenchError
from gyrobench.record.record import Record
from gyrobench.record.run_document import FILE, DataFile, RecordError, read_run
from gyrobench.system.suite import Suite
from gyrobench.system.system import MeasuredData, System


def measured_data(system: System) -> MeasuredData:
    """Return how a laboratory's record is read.  Raises UsageError for a system without, naming those that have one."""
    if isinstance(system, Suite):
        raise UsageError(f"{system.name} compares runs: reduce each record by its own test, then give it their folders")
    if system.measured_data is None:
        known = [other for other in Bench.find().systems() if load(other).measured_data is not None]
        raise UsageError(f"{system.name} has no reduction of measured data; there is one for {', '.join(known)}")
    return system.measured_data


def template(name: str) -> str:
    """Return an empty CSV with the columns that ``gyrobench reduce`` reads, and what each means."""
    from gyrobench.system.lab_record import explained

    return explained(measured_data(load(name)).template)


def reduce(
    name: str,
    data: Sequence[Path],
    values: Mapping[str, str],
    spec: str | None,
    out: Path | None,
    force: bool = False,
    as_json: bool = False,
) -> str:
    """A laboratory's CSV to a report, or runs to that of a suite; returns the verdict."""
    if isinstance(load(name), Suite):
        from gyrobench.commands import run_suite

        return run_suite.reduce(load(name, values), data, spec, out, force, as_json)
    system = load(name)
    reader = measured_data(system).read
    if len(data) > 1:
        raise UsageError(f"{name} reduces one record at a time; --data was given {len(data)} times")
    file = specification(spec)
    limits = limits_of(file)
    one = data[0]
    text = one.read_bytes()
    record = reader(system, one, values)
    record.run.data = DataFile(file=one.name, sha256=hashlib.sha256(text).hexdigest())
    identity = hashlib.sha256(text + repr(sorted(values.items())).encode()).hexdigest()[:8]
    folder = out or Bench.find().out / name / f"measured-{identity}"

    def save() -> None:
        claim(folder, {"system": name, "data": {"file": one.name}}, force)
        record.save(folder)

    with record_kept(folder, save):
        result = system.reduce(record, limits)
    save()
    result.provenance = record.run.as_dict()
    with record_kept(folder):
        paths = publish(result, folder, record, file)
    show_paths(paths, None if as_json else console.answer(result))
    return result.verdict


def report(folder: Path, spec: str | None, as_json: bool = False) -> str:
    """Reduces a saved record again and writes its report, or that of a suite; returns the verdict.

    Raises RecordError when the folder is no run, and PostRunError naming what an incomplete record lacks.
    """
    if not (folder / FILE).is_file():
        raise RecordError(f"{folder}: no run there (no {FILE}); runs are in {Bench.find().out}/SYSTEM/")
    system = load(read_run(folder).system)
    if isinstance(system, Suite):
        from gyrobench.commands import run_suite

        return run_suite.report(folder, system, spec, as_json)
    done = again(folder, system, specification(spec))
    assert done.result is not None
    show_paths(done.paths, None if as_json else console.answer(done.result))
    return done.result.verdict


def again(folder: Path, system: System, spec: Path | None) -> Done:
    """Record in ``folder``, of a run of ``system``, reduced and reported again."""
    record = Record.load(folder)
    limits = limits_of(spec)
    with record_kept(folder):
        try:
            result = reduced(system, record, limits)
        except GyrobenchError:
            if record.complete:
                raise
            raise PostRunError(
                f"{folder}: the record is not complete, so there is no report\n{console.lacking(record)}"
            ) from None
        old = folder / "result.json"
        if old.exists():  # the step check is a run of its own and is kept
            result.step_check = json.loads(old.read_text(encoding="utf-8")).get("step_check") or {}
        return Done(folder, record, result, publish(result, folder, record, spec))
