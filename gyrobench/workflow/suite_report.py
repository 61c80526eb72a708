"""The report of a suite: from the tests it has just run, from its folder, or from runs that exist."""

from __future__ import annotations

import datetime
import hashlib
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gyrobench import reading
from gyrobench.bench import Bench, UsageError
from gyrobench.errors import Advice
from gyrobench.record.run_document import FILE as RUN
from gyrobench.record.run_document import (
    PartInfo,
    RecordError,
    RunDocument,
    SuiteDocument,
    SuiteTestRun,
    package_versions,
    read_run,
)
from gyrobench.reduction.estimation.truth_check import missed_truth, set_values
from gyrobench.reduction.estimation.verdict import conclude
from gyrobench.report import FORMATS
from gyrobench.report.result_json import read_document
from gyrobench.result import DriftTestResult, SuiteResult
from gyrobench.system.suite import Suite
from gyrobench.workflow.inputs import find_specification, load_limits
from gyrobench.workflow.run_folders import prepare_folder, short_names
from gyrobench.workflow.saved_run import write_report
from gyrobench.workflow.user_errors import PostRunError, record_kept

if TYPE_CHECKING:
    from gyrobench.reduction.suite.method_comparison import Member


@dataclass(frozen=True)
class SuiteOutcome:
    """The report of a suite; stopped: which tests failed."""

    folder: Path
    result: SuiteResult
    paths: Mapping[str, Path]
    stopped: PostRunError | None = None

    @property
    def verdict(self) -> str:
        """Verdict of the result; fail also where methods are inconsistent."""
        return "fail" if self.result.suite.consistency == "inconsistent" else self.result.verdict


def suite_document(suite: Suite, identity: Mapping[str, Any]) -> SuiteDocument:
    """Return the content of a suite's run.json that is known before its tests."""
    return SuiteDocument(
        **identity,
        title=suite.title,
        date=datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        options=dict(suite.values),
        changed={n: str(suite.passed.get(n, suite.values.get(n))) for n in (*suite.given, *suite.passed)},
        versions=dict(package_versions()),
        **{n: suite[n] for n in suite.about if n in suite.options and suite[n]},
    )


def reduce_runs(
    suite: Suite,
    runs: Sequence[Path],
    spec: str | Path | None = None,
    out: Path | None = None,
    force: bool = False,
    formats: Sequence[str] = FORMATS,
) -> SuiteOutcome:
    """Write the report of a suite from runs that exist, simulated or measured.  Raises UsageError."""
    if suite.passed:
        raise UsageError(f"{next(iter(suite.passed))}: the tests have been run; options: {', '.join(suite.about)}")
    if len(runs) < 2:
        raise UsageError(f"{suite.name}: name two runs or more, each the folder of a run with its result.json")
    for folder in runs:
        if not (folder / "result.json").is_file():
            rewrite = f"write it by gyrobench report {folder}"
            hint = rewrite if (folder / RUN).is_file() else "a measured record becomes a run by gyrobench reduce"
            raise UsageError(f"{folder}: no result.json; {hint}")
    systems = [str(_result(f / "result.json").get("system")) for f in runs]
    labels = short_names(runs)
    names = [s if systems.count(s) == 1 else f"{s} {label}" for s, label in zip(systems, labels, strict=True)]
    file = find_specification(spec)
    digest = hashlib.sha256("".join(str(f.resolve()) for f in runs).encode()).hexdigest()[:8]
    identity = {"system": suite.name, "runs": names}
    folder = prepare_folder(out or Bench.find().out / suite.name / f"runs-{digest}", identity, force)
    document = suite_document(suite, identity)
    paths = [os.path.relpath(f.resolve(), folder.resolve()) for f in runs]
    document.tests = {name: SuiteTestRun(folder=path) for name, path in zip(names, paths, strict=True)}
    document.complete = True
    return write_suite_report(suite, folder, document, file, formats)


def report_saved_suite(folder: Path, suite: Suite, spec: str | None = None) -> SuiteOutcome:
    """Write the report of a suite again, from the results of its tests."""
    document = read_run(folder)
    if not isinstance(document, SuiteDocument) or not document.tests:
        going_on = Advice("resume", "the same run command with --resume continues it")
        raise RecordError(f"{folder}: the suite is not complete").advised(going_on)
    for name in suite.options:
        if name in document.options:
            suite.set(name, document.options[name])
    return write_suite_report(suite, folder, document, find_specification(spec))


def write_suite_report(
    suite: Suite, folder: Path, document: SuiteDocument, spec: Path | None, formats: Sequence[str] = FORMATS
) -> SuiteOutcome:
    """Write run.json and the report from the results of the tests."""
    from gyrobench.reduction.suite.method_comparison import combine_methods

    members = {n: _load_member(folder / test.folder, test.folder) for n, test in document.tests.items()}
    document.tests = {n: member.test for n, member in members.items()}
    for name in suite.about:  # what the suite does not state may be stated by its tests
        texts = dict.fromkeys(str(m.result.provenance.get(name) or "") for m in members.values())
        if text := suite[name] or "; ".join(filter(None, texts)):
            setattr(document, name, text)
    limits = load_limits(spec)
    with record_kept(folder, save=lambda: document.write(folder)):
        found = combine_methods(
            members, system=suite.name, title=suite.title, method=suite.method, sources=suite.sources,
            conventions=suite.conventions, shared=suite.shared, failed=document.failed, provenance=document.as_dict(),
        )  # fmt: skip
        runs = [RunDocument.model_validate(m.result.provenance) for m in members.values()]
        missed = missed_truth(found, list(dict.fromkeys(cause for run in runs for cause in set_values(run))))
        instrument = suite["instrument"] or found.instrument
        result = conclude(found, None, limits, reasons=[*missed, *found.reasons], instrument=instrument)
    document.write(folder)
    with record_kept(folder):
        paths = write_report(result, folder, None, spec, formats)
    return SuiteOutcome(folder, result, paths)


def _result(file: Path) -> dict[str, Any]:
    return read_document(reading.read_text(file, RecordError), file, RecordError)


def _load_member(folder: Path, label: str) -> Member:
    """Return a test of a suite from its folder.  Raises RecordError for a result that cannot be read."""
    from gyrobench.reduction.suite.method_comparison import Member
    from gyrobench.report import load

    file = folder / "result.json"
    try:
        text = file.read_text(encoding="utf-8")
        result, report_id = load(text), str(_result(file)["report_id"])
    except (OSError, ValueError, KeyError) as error:
        raise RecordError(f"{file}: not a readable result: {error}") from None
    if not isinstance(result, DriftTestResult):
        kind = "a suite itself; name its tests" if result.kind == "suite" else f"a {result.kind} test; leave it out"
        raise RecordError(f"{folder}: is {kind}")
    run = RunDocument.model_validate(result.provenance)
    test = SuiteTestRun(
        folder=label, report_id=report_id, date=run.date or None, operator=run.operator or None, seed=run.seed,
        step=run.step or None, engine=run.engine or None, phases=len(run.plan), duration=_duration(run, result),
        changed=run.changed, result_sha256=hashlib.sha256(text.encode()).hexdigest(),
        record_sha256=_record_hash(folder), data=run.data, versions=run.versions or None,
        parts={s: PartInfo(name=p.name, version=p.version, sha256=p.sha256) for s, p in run.parts.items()},
        step_check=result.step_check.worst if result.step_check else None, complete=run.complete,
    )  # fmt: skip
    return Member(result, test)


def _duration(run: RunDocument, result: DriftTestResult) -> float | None:
    """Return the time of the test, s: of the run, else from first to last window."""
    if run.stopped_at is not None:
        return run.stopped_at
    times = [t for s in result.series for t in s.t]
    return max(times) - min(times) if times else None


def _record_hash(folder: Path) -> str:
    for name in ("record.parquet", "record.csv"):
        if (folder / name).is_file():
            return hashlib.sha256((folder / name).read_bytes()).hexdigest()
    return ""
