"""A suite ready to run, and what a run of it leaves."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from gyrobench.bench import UsageError
from gyrobench.boundary import checked
from gyrobench.library.experiment import File, Run, checked_seed, feedback_of, mapping_files, open_run, time_of
from gyrobench.notebook import html
from gyrobench.report.plain_text import format_result
from gyrobench.result import SuiteResult
from gyrobench.system.suite import Suite
from gyrobench.workflow.run_execution import RunRequest
from gyrobench.workflow.suite_execution import execute_suite
from gyrobench.workflow.suite_report import SuiteOutcome, reduce_runs

if TYPE_CHECKING:
    from gyrobench.engine.run_driver import ProgressReport


@dataclass(frozen=True, repr=False)
class SuiteRun:
    """The report of a suite, and the runs of its tests by name."""

    result: SuiteResult
    folder: Path
    runs: Mapping[str, Run] = field(default_factory=dict)
    failed: str = ""  # which tests have no result

    @property
    def name(self) -> str:
        """Name of the folder."""
        return self.folder.name

    def __str__(self) -> str:
        return format_result(self.result)

    def __repr__(self) -> str:
        return f"<SuiteRun of {', '.join(self.runs)}: {self.result.suite.consistency}, {self.folder}>"

    def _repr_html_(self) -> str | None:
        return html(self.result)


class SuiteExperiment:
    """A suite with its values and parts, ready to run; a value goes to every test that has it."""

    def __init__(self, suite: Suite, parts: Mapping[str, File], maps: Mapping[str, File]) -> None:
        self.suite = suite
        self.parts = {slot: str(part) for slot, part in parts.items()}
        self.maps = mapping_files(maps)

    @property
    def name(self) -> str:
        """Name of the suite."""
        return self.suite.name

    @checked
    def set(self, name: str, value: Any) -> Self:
        """Set an option of the suite, of its tests, or a parameter of a part; returns the suite."""
        self.suite.set(name, value)
        return self

    @checked
    def run(
        self,
        out: File,
        seed: int = 1,
        *,
        step: float | str | None = None,
        spec: File | None = None,
        force: bool = False,
        resume: bool = False,
        progress: Callable[[ProgressReport], None] | None = None,
    ) -> SuiteRun:
        """Run all tests, each in a folder inside ``out``, and write their reports and that of the suite.

        ``failed`` of what is returned names the tests without a result.  Raises errors of type GyrobenchError.
        """
        request = RunRequest(
            parts=self.parts, maps=self.maps, seed=checked_seed(seed), step=time_of("step", step), out=Path(out),
            force=force, resume=resume, spec=spec,
        )  # fmt: skip
        return _suite_run(execute_suite(request, self.suite, feedback_of(progress)))

    @checked
    def reduce(
        self, runs: Iterable[Run | File], out: File, *, spec: File | None = None, force: bool = False
    ) -> SuiteRun:
        """Write the report of the suite from runs that exist, each in a folder.  Raises UsageError."""
        folders = []
        for number, run in enumerate(runs, 1):
            if not isinstance(run, Run | str | Path):
                raise UsageError(f"run {number} of the suite = {run!r}: a run or the folder of one is expected")
            folder = run.folder if isinstance(run, Run) else Path(run)
            if folder is None:
                raise UsageError(
                    f"run {number} of the suite is in memory only; keep each in a folder: run(out='FOLDER')"
                )
            folders.append(folder)
        return _suite_run(reduce_runs(self.suite, folders, spec, Path(out), force))

    def __repr__(self) -> str:
        return f"<SuiteExperiment {self.name}: {', '.join(self.suite.tests())}>"


def _suite_run(outcome: SuiteOutcome) -> SuiteRun:
    tests = {n: outcome.folder / t["folder"] for n, t in outcome.result.provenance["tests"].items()}
    runs = {name: open_run(folder) for name, folder in tests.items()}
    return SuiteRun(outcome.result, outcome.folder, runs, str(outcome.stopped or ""))
