"""Execution of a suite: its tests run one after the other, each in a folder of its own, then one report.

reports/out/<suite>/<id>/<test>/     a run like any other: record, report, checkpoint while it runs
reports/out/<suite>/<id>/            run.json (which tests, their reports), result.json, report.html, report.pdf

A test that fails does not stop the others; one that was stopped continues with --resume, finished ones are kept.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from gyrobench.bench import Bench, UsageError, display_path
from gyrobench.engine import checkpoint
from gyrobench.errors import RESUMING, Advice
from gyrobench.files import sha256
from gyrobench.record.run_document import FILE as RUN
from gyrobench.record.run_document import SuiteTestRun
from gyrobench.report import NAMES
from gyrobench.system.suite import Suite
from gyrobench.system.system import InvalidConfigurationError, System
from gyrobench.system.values import InvalidValueError
from gyrobench.workflow.feedback import SILENT, Feedback
from gyrobench.workflow.inputs import check_fmu_files, find_specification, load_limits, suite_members
from gyrobench.workflow.run_execution import RunRequest, execute_run
from gyrobench.workflow.run_folders import NothingToResumeError, has_complete_record, incomplete_folder, prepare_folder
from gyrobench.workflow.saved_run import RunOutcome, reduce_saved_run
from gyrobench.workflow.suite_report import SuiteOutcome, suite_document, write_suite_report
from gyrobench.workflow.user_errors import CommandInterrupted, PostRunError, user_message


class SuiteError(PostRunError):
    """At least one test of a suite failed; the report covers the others."""


def execute_suite(request: RunRequest, suite: Suite, feedback: Feedback = SILENT) -> SuiteOutcome:
    """Run all tests, then write the report of the suite; its ``stopped`` names the tests that failed.

    Raises InvalidConfigurationError with the problems of all tests before the first one runs, CommandInterrupted when
    the user stops one, SuiteError where none has a result.
    """
    if request.in_memory:
        raise UsageError(f"{suite.name} is a suite: each of its tests is kept in a folder; name theirs: out=FOLDER")
    members = suite_members(suite)
    requests = _test_requests(request, suite, members)
    spec = find_specification(request.spec)
    load_limits(spec)
    identity = _identity(request, suite, members, requests, feedback)
    digest = hashlib.sha256(json.dumps(identity, sort_keys=True).encode()).hexdigest()[:8]
    folder = request.out or Bench.find().out / suite.name / digest
    if request.resume and not (folder / RUN).is_file():
        raise NothingToResumeError(
            f"--resume: nothing to continue in {folder}: no suite with these tests, parts and values"
        )
    prepare_folder(folder, identity, request.force)
    document = suite_document(suite, identity)
    document.complete = False
    document.write(folder)
    failed: dict[str, str] = {}
    for number, (name, system) in enumerate(members.items(), 1):
        problem = _run_test(requests[name], system, folder / name, f"{name} ({number} of {len(members)})", feedback)
        if problem:
            failed[name] = problem
    document.tests = {n: SuiteTestRun(folder=n) for n in members if n not in failed}
    document.failed, document.complete = failed, not failed
    document.write(folder)
    if not document.tests:
        raise SuiteError(f"no test of the suite has a result; records and checkpoints are in {display_path(folder)}")
    outcome = write_suite_report(suite, folder, document, spec, request.formats)
    if not failed:
        return outcome
    stopped = SuiteError(f"{', '.join(failed)} failed; the report in {display_path(folder)} covers the others").advised(
        Advice("resume", f"after correcting the cause, {RESUMING} runs only what is missing")
    )
    return replace(outcome, stopped=stopped)


def _run_test(request: RunRequest, system: System, folder: Path, label: str, feedback: Feedback) -> str:
    """Run a test, or what is missing of it, with notes; return why it has no result, empty where it has one.

    Raises CommandInterrupted.
    """
    going_on = Advice("resume", f"{RESUMING} continues the suite")
    has_run = request.resume and not request.force and has_complete_record(folder)

    def note(text: str) -> None:
        feedback.notes([f"{label}: {text}"])

    if has_run and all((folder / NAMES[kind]).is_file() for kind in request.formats):
        note(f"already complete; kept in {display_path(folder)}")
        return ""
    resume = request.resume and any((f / checkpoint.FILE).is_file() for f in (folder, incomplete_folder(folder)))
    note("reducing again" if has_run else "resuming" if resume else "running")
    try:
        if has_run:
            outcome: RunOutcome = reduce_saved_run(folder, system, None, request.formats)
        else:
            outcome = execute_run(replace(request, out=folder, resume=resume), system, feedback)
    except CommandInterrupted as error:
        raise CommandInterrupted(error.text).advised(going_on) from None
    except Exception as error:  # the other tests must still run
        message = user_message(error)
        note(f"no result: {message}")
        return " ".join(line.strip(" -") for line in message.splitlines()[:2])
    if isinstance(outcome.stopped, CommandInterrupted):
        raise CommandInterrupted(f"{system.name}: {outcome.stopped.text}").advised(going_on)
    if outcome.stopped:
        note(str(outcome.stopped))
    if outcome.result is None:
        return "the system has no reduction"
    result = outcome.result
    note(result.summary[0] if result.summary else result.verdict)
    return ""


def _test_requests(request: RunRequest, suite: Suite, members: Mapping[str, System]) -> dict[str, RunRequest]:
    """Return the request of each test: the parts, files and seed that go to it."""
    try:
        parts, maps = suite.swaps(members, request.parts), suite.swaps(members, request.maps)
    except InvalidValueError as error:
        raise UsageError(str(error)) from None
    check_fmu_files(request.parts)
    return {
        name: replace(request, parts=parts[name], maps=maps[name], spec=None, seed=suite.seed_of(request.seed, name))
        for name in members
    }


def _identity(
    request: RunRequest, suite: Suite, members: Mapping[str, System], requests: Mapping[str, RunRequest],
    feedback: Feedback,
) -> dict[str, Any]:  # fmt: skip
    """Return the identity of this run of a suite.  Raises InvalidConfigurationError with the problems of all tests."""
    from gyrobench.system.parameters import defaults, resolve
    from gyrobench.system.part_files import resolve_parts
    from gyrobench.system.wiring import assemble

    problems: list[str] = []
    tests: dict[str, Any] = {}
    for name, system in members.items():
        system.step = request.step or system.step
        try:
            system.refuse()
            notes: list[str] = []
            paths, _ = resolve_parts(system, requests[name].parts, "native", Bench.find().folder, notes)
            feedback.notes(notes)
            assembly = assemble(system, paths, requests[name].maps)
            parameters = resolve(assembly, system, requests[name].seed, defaults(assembly))[1]
            if invalid := system.check_parameters(parameters):
                raise InvalidConfigurationError(name, invalid)
        except InvalidConfigurationError as error:
            problems += [f"{name}: {p}" for p in error.problems]
            continue
        except InvalidValueError as error:
            problems.append(f"{name}: {error}")
            continue
        hashes = {slot: {"sha256": sha256(p)} for slot, p in paths.items()}
        tests[name] = {"parts": hashes, "parameters": parameters, "options": dict(system.values), "step": system.step}
    if problems:
        raise InvalidConfigurationError(suite.name, problems)
    text = json.dumps([tests, [m.read_text(encoding="utf-8") for m in request.maps.values()]], sort_keys=True)
    return {"system": suite.name, "seed": request.seed, "identity": hashlib.sha256(text.encode()).hexdigest()}
