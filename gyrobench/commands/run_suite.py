"""Suites behind the commands: tests run one after the other, each in a folder of its own, then one report.

reports/out/<suite>/<id>/<test>/     a run like any other: record, report, checkpoint while it runs
reports/out/<suite>/<id>/            run.json (which tests, their reports), result.json, report.html, report.pdf

A test that fails does not stop the others; one that was stopped goes on with --resume, finished ones are kept.
"""

from __future__ import annotations

import datetime
import hashlib
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from gyrobench.bench import Bench, UsageError, short
from gyrobench.commands import console
from gyrobench.commands.reduce_data import again
from gyrobench.commands.run_folders import beside, claim, labels, whole_record
from gyrobench.commands.run_system import (
    Job,
    check_fmus,
    limits_of,
    note,
    perform,
    publish,
    show_paths,
    tell,
)
from gyrobench.commands.run_system import specification as named
from gyrobench.commands.user_errors import CommandInterrupted, PostRunError, record_kept, user_message
from gyrobench.engine import checkpoint
from gyrobench.files import sha256
from gyrobench.record.run_document import FILE as RUN
from gyrobench.record.run_document import PartInfo, RecordError, RunDocument, SuiteDocument, SuiteTestRun, read_run
from gyrobench.report import NAMES
from gyrobench.result import Result
from gyrobench.system.suite import Suite
from gyrobench.system.system import InvalidConfigurationError, System
from gyrobench.system.values import InvalidValueError, parse


class SuiteError(PostRunError):
    """Some test of a suite failed; the report is of the others."""


def members_of(suite: Suite) -> dict[str, System]:
    """The tests with their values; what is wrong with a value is said as of the command line."""
    try:
        return suite.members(Bench.find().folder)
    except InvalidValueError as error:
        raise UsageError(f"--set {error}") from None


def describe(suite: Suite) -> dict[str, Any]:
    """Return tests with plans and seeds (of --seed 1), sets and options, JSON-able.

    Raises InvalidConfigurationError and UsageError.
    """
    members = members_of(suite)
    return {
        "system": suite.name,
        "title": suite.title,
        "spec": list(suite.spec),
        "item": suite.item,
        "sets": dict(suite.sets),
        "tests": [
            {
                "name": n,
                "title": s.title,
                "spec": list(s.spec),
                "seed": suite.seed_of(1, n),
                "given": suite.given_to(members)[n],
                "plan": s.plan().rows(),
                "duration": s.plan().duration(),
            }
            for n, s in members.items()
        ],
        "options": {k: {"value": suite[k], "unit": "str", "doc": o.doc} for k, o in suite.options.items()},
    }


# ---------------------------------------------------------------------------------------------- run
def run(job: Job, suite: Suite, as_json: bool = False) -> str:
    """Runs all tests, then writes the report of the suite; returns the verdict, fail too where methods disagree.

    Raises InvalidConfigurationError with the problems of all tests before the first one runs, CommandInterrupted when
    the user stops one, SuiteError after the report when some failed.
    """
    step = parse("--step", job.step, "s") if job.step else None
    members = members_of(suite)
    jobs = _jobs(job, suite, members)
    spec = named(job.spec)
    limits_of(spec)
    identity = _identity(job, suite, members, jobs, step)
    digest = hashlib.sha256(json.dumps(identity, sort_keys=True).encode()).hexdigest()[:8]
    folder = job.out or Bench.find().out / suite.name / digest
    if job.resume and not (folder / RUN).is_file():
        raise UsageError(f"--resume: nothing to continue in {folder}: no suite with these tests, parts and values")
    claim(folder, identity, job.force)
    document = _document(suite, identity)
    document.complete = False
    _write(folder, document)
    failed: dict[str, str] = {}
    for number, (name, system) in enumerate(members.items(), 1):
        there = folder / name
        about = f"{name} ({number} of {len(members)})"
        ran = job.resume and not job.force and whole_record(there)
        if ran and all((there / file).is_file() for file in NAMES.values()):
            note(f"{about}: kept as it is in {short(there)}")
            continue
        go_on = job.resume and any((f / checkpoint.FILE).is_file() for f in (there, beside(there)))
        note(f"{about}: {'is reduced again' if ran else 'goes on' if go_on else 'runs'}")
        try:
            if ran:
                done = again(there, system, None)
            else:
                done = perform(replace(jobs[name], out=there, resume=go_on), system, step)
        except CommandInterrupted as error:
            raise CommandInterrupted(f"{error}\nthe suite goes on with the same command and --resume") from None
        except Exception as error:  # the other tests must still run
            message = user_message(error)
            failed[name] = " ".join(line.strip(" -") for line in message.splitlines()[:2])
            note(f"{about}: no result: {message}")
            continue
        if isinstance(done.stopped, CommandInterrupted):
            raise CommandInterrupted(f"{name}: {done.stopped}\nthe suite goes on with the same command and --resume")
        if done.stopped:
            note(f"{about}: {done.stopped}")
        if done.result is None:
            failed[name] = "it has no reduction"
            continue
        note(f"{about}: {done.result.summary[0] if done.result.summary else done.result.verdict}")
    document.tests = {n: SuiteTestRun(folder=n) for n in members if n not in failed}
    document.failed, document.complete = failed, not failed
    if not document.tests:
        _write(folder, document)
        raise SuiteError(f"no test of the suite has a result; what each left is in {short(folder)}")
    verdict = _finish(suite, folder, document, spec, as_json)
    if failed:
        raise SuiteError(
            f"{', '.join(failed)} failed; the report in {short(folder)} is of the others. After correcting the cause: "
            "the same command with --resume runs only what is missing"
        )
    return verdict


def _jobs(job: Job, suite: Suite, members: Mapping[str, System]) -> dict[str, Job]:
    try:
        parts, maps = suite.swaps(members, job.parts), suite.swaps(members, job.maps)
        isolate = suite.swaps(members, dict.fromkeys(job.isolate))
    except InvalidValueError as error:
        raise UsageError(str(error)) from None
    check_fmus(job.parts)
    return {
        n: replace(
            job, system=n, parts=parts[n], maps=maps[n], isolate=tuple(isolate[n]), values={}, spec=None,
            seed=suite.seed_of(job.seed, n),
        )
        for n in members
    }  # fmt: skip


def _identity(
    job: Job, suite: Suite, members: Mapping[str, System], jobs: Mapping[str, Job], step: float | None
) -> dict[str, Any]:
    """What makes this suite another one.  Raises InvalidConfigurationError with all that its tests refuse."""
    from gyrobench.system.parameters import defaults, resolve
    from gyrobench.system.part_files import resolve_parts
    from gyrobench.system.wiring import assemble

    problems: list[str] = []
    tests: dict[str, Any] = {}
    for name, system in members.items():
        system.step = step or system.step
        try:
            system.refuse()
            notes: list[str] = []
            paths, _ = resolve_parts(system, jobs[name].parts, "native", Bench.find().folder, notes)
            tell(notes)
            assembly = assemble(system, paths, jobs[name].maps)
            parameters = resolve(assembly, system, jobs[name].seed, defaults(assembly))[1]
            if found := system.check_parameters(parameters):
                raise InvalidConfigurationError(name, found)
        except InvalidConfigurationError as error:
            problems += [f"{name}: {p}" for p in error.problems]
            continue
        except InvalidValueError as error:
            problems.append(f"{name}: --set {error}")
            continue
        hashes = {slot: {"sha256": sha256(p)} for slot, p in paths.items()}
        tests[name] = {"parts": hashes, "parameters": parameters, "options": dict(system.values), "step": system.step}
    if problems:
        raise InvalidConfigurationError(suite.name, problems)
    text = json.dumps([tests, [m.read_text(encoding="utf-8") for m in job.maps.values()]], sort_keys=True)
    return {"system": suite.name, "seed": job.seed, "identity": hashlib.sha256(text.encode()).hexdigest()}


def _document(suite: Suite, identity: Mapping[str, Any]) -> SuiteDocument:
    """Return what run.json says of a suite before its tests."""
    from gyrobench.engine.session import package_versions

    return SuiteDocument(
        **identity,
        title=suite.title,
        date=datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        options=dict(suite.values),
        changed={n: str(suite.passed.get(n, suite.values.get(n))) for n in (*suite.given, *suite.passed)},
        versions=dict(package_versions()),
        **{n: suite[n] for n in suite.about if n in suite.options and suite[n]},
    )


def _write(folder: Path, document: SuiteDocument) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    document.write(folder)


# -------------------------------------------------------------------------------------- from what is there
def reduce(suite: System, runs: Sequence[Path], spec: str | None, out: Path | None, force: bool, as_json: bool) -> str:
    """The report of a suite from runs that exist, simulated or measured; returns the verdict."""
    assert isinstance(suite, Suite)
    if suite.passed:
        raise UsageError(
            f"--set {next(iter(suite.passed))}: the tests have been run; options: {', '.join(suite.about)}"
        )
    if len(runs) < 2:
        raise UsageError("name the runs, two or more: --data RUN --data RUN; a folder with a result.json each")
    for folder in runs:
        if not (folder / "result.json").is_file():
            there = (folder / RUN).is_file()
            hint = (
                f"gyrobench report {folder} makes it"
                if there
                else "a measured record becomes a run by gyrobench reduce"
            )
            raise UsageError(f"--data {folder}: no result.json there; {hint}")
    systems = [str(json.loads((f / "result.json").read_text(encoding="utf-8"))["system"]) for f in runs]
    folders = labels(runs)
    names = [s if systems.count(s) == 1 else f"{s} {f}" for s, f in zip(systems, folders, strict=True)]
    file = named(spec)
    digest = hashlib.sha256("".join(str(f.resolve()) for f in runs).encode()).hexdigest()[:8]
    identity = {"system": suite.name, "runs": names}
    folder = claim(out or Bench.find().out / suite.name / f"runs-{digest}", identity, force)
    document = _document(suite, identity)
    document.tests = {
        n: SuiteTestRun(folder=os.path.relpath(f.resolve(), folder.resolve())) for n, f in zip(names, runs, strict=True)
    }
    document.complete = True
    return _finish(suite, folder, document, file, as_json)


def report(folder: Path, suite: Suite, spec: str | None, as_json: bool = False) -> str:
    """The report of a suite again, from the results of its tests; returns the verdict."""
    document = read_run(folder)
    if not isinstance(document, SuiteDocument) or not document.tests:
        raise RecordError(f"{folder}: the suite did not end; the same run command with --resume goes on")
    for name in suite.options:
        if name in document.options:
            suite.set(name, document.options[name])
    return _finish(suite, folder, document, named(spec), as_json)


def _finish(suite: Suite, folder: Path, document: SuiteDocument, spec: Path | None, as_json: bool) -> str:
    """Writes run.json and the report, prints the answer; returns the verdict."""
    from gyrobench.reduction.suite.method_comparison import together

    members = {n: _member(folder / test.folder, test.folder) for n, test in document.tests.items()}
    document.tests = {n: member.test for n, member in members.items()}
    for name in suite.about:  # what the suite is not told the tests may say
        texts = dict.fromkeys(str(m.result.provenance.get(name) or "") for m in members.values())
        if text := suite[name] or "; ".join(filter(None, texts)):
            setattr(document, name, text)
    limits = limits_of(spec)
    with record_kept(folder, lambda: _write(folder, document)):
        result = together(
            members, system=suite.name, title=suite.title, method=suite.method, sources=suite.sources,
            conventions=suite.conventions, shared=suite.shared, specification=limits,
            failed=document.failed, provenance=document.as_dict(),
        )  # fmt: skip
        if suite["instrument"]:
            result.instrument = suite["instrument"]
    _write(folder, document)
    with record_kept(folder):
        paths = publish(result, folder, None, spec)
    show_paths(paths, None if as_json else console.suite_answer(result))
    bad = result.suite["consistency"] == "inconsistent"
    return "fail" if bad else result.verdict


def _member(folder: Path, shown: str) -> Any:
    """A test of a suite from its folder.  Raises RecordError for a result that cannot be read."""
    from gyrobench.reduction.suite.method_comparison import Member
    from gyrobench.report import load

    file = folder / "result.json"
    try:
        text = file.read_text(encoding="utf-8")
        result, report_id = load(text), str(json.loads(text)["report_id"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise RecordError(f"{file}: no result that can be read: {error}") from None
    if result.suite:
        raise RecordError(f"{folder}: is a suite itself; name its tests")
    run = RunDocument.model_validate(result.provenance)
    test = SuiteTestRun(
        folder=shown, report_id=report_id, date=run.date or None, operator=run.operator or None, seed=run.seed,
        step=run.step or None, engine=run.engine or None, phases=len(run.plan), duration=_duration(run, result),
        changed=run.changed, result_sha256=hashlib.sha256(text.encode()).hexdigest(),
        record_sha256=_record_hash(folder), data=run.data, versions=run.versions or None,
        parts={s: PartInfo(name=p.name, version=p.version, sha256=p.sha256) for s, p in run.parts.items()},
        step_check=(result.step_check or {}).get("worst"), complete=run.complete,
    )  # fmt: skip
    return Member(result, test)


def _duration(run: RunDocument, result: Result) -> float | None:
    """Time of the test, s: of the run, else from first to last window."""
    if run.stopped_at is not None:
        return run.stopped_at
    times = [t for s in result.series for t in s.t]
    return max(times) - min(times) if times else None


def _record_hash(folder: Path) -> str:
    for name in ("record.parquet", "record.csv"):
        if (folder / name).is_file():
            return hashlib.sha256((folder / name).read_bytes()).hexdigest()
    return ""
