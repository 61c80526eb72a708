"""Output of the commands that end in a report: table, verdict, files."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from gyrobench.bench import UsageError, display_path
from gyrobench.commands import console
from gyrobench.commands.progress_display import ProgressDisplay
from gyrobench.report import FORMATS
from gyrobench.report.language import ENGLISH
from gyrobench.report.plain_text import format_result, format_summary
from gyrobench.result import NO_VERDICT
from gyrobench.system.suite import Suite
from gyrobench.system.system import System
from gyrobench.workflow.feedback import Feedback
from gyrobench.workflow.inputs import find_specification
from gyrobench.workflow.run_execution import RunRequest, execute_run
from gyrobench.workflow.saved_run import RunOutcome, reduce_saved_run
from gyrobench.workflow.settings import apply_values
from gyrobench.workflow.suite_report import SuiteOutcome

FEEDBACK = Feedback(console.print_notes, ProgressDisplay)


def run(request: RunRequest, test: System | Suite, as_json: bool = False) -> str:
    """Run a system or suite, print its result and return the verdict.  Raises as execute_run and execute_suite."""
    if isinstance(test, Suite):
        from gyrobench.workflow.suite_execution import execute_suite

        return _print_outcome(execute_suite(request, test, FEEDBACK), as_json)
    return _print_outcome(execute_run(request, test, FEEDBACK), as_json)


def report(
    folder: Path, test: System | Suite, spec: str | None, as_json: bool = False, fit_to: str | None = None
) -> str:
    """Reduce a saved run again, print its result and return the verdict.  fit_to: as of :func:`reduce`."""
    if fit_to:
        from gyrobench.workflow.fitted_values import refuse_unfitted

        refuse_unfitted(test, fit_to)
    if isinstance(test, Suite):
        from gyrobench.workflow.suite_report import report_saved_suite

        return _print_outcome(report_saved_suite(folder, test, spec), as_json)
    outcome = reduce_saved_run(folder, test, find_specification(spec))
    verdict = _print_outcome(outcome, as_json)
    _print_fitted(test, outcome, fit_to)
    return verdict


def _print_fitted(test: System, outcome: RunOutcome, fit_to: str | None) -> None:
    """Write the values of a result for a part beside its report, where they are asked for, and print where."""
    if not fit_to or outcome.result is None or outcome.folder is None:
        return
    from gyrobench.workflow.fitted_values import write_fitted

    files = write_fitted(test, outcome.result, outcome.record, fit_to, outcome.folder)
    shown = ", ".join(display_path(f) for f in files)
    console.print_note(f"values for {fit_to}: {shown}; gyrobench run SYSTEM --set @FILE.toml")


def reduce(
    test: System | Suite,
    data: Sequence[Path],
    values: Mapping[str, str],
    spec: str | None,
    out: Path | None,
    force: bool = False,
    as_json: bool = False,
    formats: Sequence[str] = FORMATS,
    fit_to: str | None = None,
    columns: Path | None = None,
    certificate: bool = False,
) -> str:
    """Reduce a laboratory's file, or the runs of a suite; print the result and return the verdict.

    fit_to: part that gets values of the result (workflow.fitted_values).  columns: column map of the file.
    certificate: write that, too, by the profile of the laboratory, which is looked for first.
    """
    from gyrobench.workflow.certificate import find_laboratory, write_certificate
    from gyrobench.workflow.fitted_values import refuse_unfitted

    if certificate:
        find_laboratory()
    if isinstance(test, Suite):
        from gyrobench.workflow.suite_report import reduce_runs

        if fit_to:
            refuse_unfitted(test, fit_to)
        if columns:
            raise UsageError(f"--columns {columns}: {test.name} compares runs; reduce each record by its own test")
        if not data:
            raise UsageError(f"no runs named; gyrobench reduce {test.name} --data RUN --data RUN")
        apply_values(test, values)
        compared = reduce_runs(test, data, spec, out, force, formats)
        verdict = _print_outcome(compared, as_json)
        _print_paths(write_certificate([compared.folder]) if certificate and compared.folder else [], as_json)
        return verdict
    from gyrobench.workflow.measured_run import reduce_measured

    if not data:
        raise UsageError(f"no record named; gyrobench reduce {test.name} --data FILE.csv (--template prints its form)")
    if len(data) > 1:
        raise UsageError(f"{test.name} reduces one record at a time; --data was given {len(data)} times")
    if fit_to:
        refuse_unfitted(test, fit_to)
    outcome = reduce_measured(
        test, data[0], values, spec, out, force, formats=formats, feedback=FEEDBACK, columns=columns
    )
    verdict = _print_outcome(outcome, as_json)
    _print_fitted(test, outcome, fit_to)
    _print_paths(write_certificate([outcome.folder]) if certificate and outcome.folder else [], as_json)
    return verdict


def _print_paths(paths: Sequence[Path], as_json: bool) -> None:
    for path in () if as_json else paths:
        print(display_path(path))


def reduce_result(
    request: RunRequest, test: System | Suite, source: Path, values: Mapping[str, str], as_json: bool = False
) -> str:
    """Reduce a run that another tool has made; print the result and return the verdict."""
    from gyrobench.workflow.external_run import reduce_result

    if isinstance(test, Suite):
        raise UsageError(
            f"--from: {test.name} is a suite; reduce the run of each of its tests, then give it their folders"
        )
    apply_values(test, values)
    return _print_outcome(reduce_result(request, test, source, FEEDBACK), as_json)


def compare(runs: Sequence[Path], out: Path | None, as_json: bool = False, language: str = ENGLISH) -> None:
    """Write and print the comparison of several runs; the first is the baseline.  Raises UsageError."""
    from gyrobench.workflow.run_comparison import compare_folders, comparison_folder

    comparison = compare_folders(runs)
    if comparison.note:
        console.print_note(f"note: {comparison.note}")
    paths = comparison.write(out or comparison_folder(runs), language=language)
    console.print_report_files(paths, None if as_json else format_summary(comparison.document))


def _print_outcome(outcome: RunOutcome | SuiteOutcome, as_json: bool) -> str:
    """Print a result, or where the record of a system without reduction is; return the verdict."""
    if outcome.result is None:
        assert isinstance(outcome, RunOutcome) and outcome.folder is not None
        if as_json:
            print(json.dumps(outcome.record.run.as_dict(), indent=1, ensure_ascii=False))
        else:
            print(f"no reduction; record: {display_path(outcome.folder)}")
    else:
        console.print_report_files(outcome.paths, None if as_json else format_result(outcome.result))
    if outcome.stopped:
        raise outcome.stopped
    if outcome.result is None:
        return NO_VERDICT
    return outcome.verdict if isinstance(outcome, SuiteOutcome) else outcome.result.verdict
