"""From a record to its report: reduction, files of the report, the same again for a run that was saved."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from gyrobench.bench import Bench
from gyrobench.commands import console
from gyrobench.commands.inputs import find_specification, load_limits
from gyrobench.commands.user_errors import PostRunError, record_kept
from gyrobench.errors import GyrobenchError
from gyrobench.record.record import Record
from gyrobench.result import Result, Specification
from gyrobench.system.system import System


@dataclass(frozen=True)
class RunOutcome:
    """A run: where it is kept, and its result and report (none of a system without reduction).

    stopped: what failed, or what the user stopped, after the run itself.
    """

    folder: Path
    record: Record
    result: Result | None = None
    paths: Mapping[str, Path] = field(default_factory=dict)
    stopped: PostRunError | None = None


def reduce_run(system: System, record: Record, limits: Specification | None) -> Result:
    """Return the result of the system's own reduction, with the run as provenance."""
    from gyrobench.system.wiring import parse_wires

    result = system.reduce(record, limits)
    wires = [f"{a}.{x} -> {b}.{y}" for a, x, b, y in parse_wires(system.wires)]
    result.provenance = {**record.run.as_dict(), "wires": wires}
    return result


def write_report(result: Result, folder: Path, record: Record | None, spec: Path | None) -> dict[str, Path]:
    """Write the report and return its files.  Raises SpecificationError where ``spec`` does not fit the result."""
    from gyrobench.report import check_units, write

    if spec is not None:
        check_units(spec, {c.name: c.unit for c in result.coefficients})
    return write(result, folder, record=(record and record.channels) or None, bench=Bench.find().folder)


def reduce_saved_run(folder: Path, system: System, spec: Path | None) -> RunOutcome:
    """Reduce the record of a run of ``system`` again and write its report.

    Raises PostRunError, for an incomplete record with what it lacks.
    """
    record = Record.load(folder)
    limits = load_limits(spec)
    with record_kept(folder):
        try:
            result = reduce_run(system, record, limits)
        except GyrobenchError:
            if record.complete:
                raise
            missing = console.format_missing_windows(record)
            raise PostRunError(f"{folder}: the record is not complete, so there is no report\n{missing}") from None
        old = folder / "result.json"
        if old.exists():  # the step check is a run of its own and is kept
            result.step_check = json.loads(old.read_text(encoding="utf-8")).get("step_check") or {}
        return RunOutcome(folder, record, result, write_report(result, folder, record, spec))


def report(folder: Path, system: System, spec: str | None, as_json: bool = False) -> str:
    """Reduce a saved run again, write and print its report; return the verdict.  Raises as reduce_saved_run."""
    outcome = reduce_saved_run(folder, system, find_specification(spec))
    assert outcome.result is not None
    console.print_report_files(outcome.paths, None if as_json else console.format_result(outcome.result))
    return outcome.result.verdict
