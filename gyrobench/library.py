"""Tests and loops from Python: load, set, run, reduce, compare.

    import gyrobench as gb

    test = gb.load("tumble_single_axis", latitude="45.75deg")
    test.set("gyro.D_I", "0.9deg/h/g")
    run = test.run(seed=3)                       # in memory; out="folder" keeps record and result.json
    run.result["D_I"].estimate, run.record.windows["mean"], run.record.frame("windows")
    run.report("folder")                         # record, result.json, report.html, report.pdf
    gb.compare(run, test.run(seed=4))            # shows itself in a notebook, prints as a table
    gb.reduce("tumble_single_axis", "data.csv", latitude="45.75deg", k="17.2deg/h/mA")
    gb.load("tumble_single_axis", parts={"gyro": "vendor.fmu"}, maps={"gyro": "vendor.toml"})

The bench is the nearest folder above the working folder with components/, systems/ and reports/, as for the command.
Every error meant for people is a :class:`gyrobench.errors.GyrobenchError`; an exception in the code of a part or a
system passes as it is before a run, and after it as a PostRunError that holds the record.
"""

from __future__ import annotations

import contextlib
import operator
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from gyrobench.bench import UsageError
from gyrobench.errors import GyrobenchError
from gyrobench.notebook import html
from gyrobench.record.record import Record
from gyrobench.report.notebook_html import fragment, paragraph, table_html
from gyrobench.report.page_model import Column, Row, Table, text_cell
from gyrobench.report.plain_text import align_columns, format_result
from gyrobench.result import Result, SuiteResult
from gyrobench.system.suite import Suite
from gyrobench.system.system import System
from gyrobench.system.values import parse
from gyrobench.units import format_quantity
from gyrobench.workflow.feedback import Feedback
from gyrobench.workflow.inputs import load_test, require_run
from gyrobench.workflow.measured_run import reduce_measured
from gyrobench.workflow.run_comparison import Comparison, compare_results, read_result
from gyrobench.workflow.run_execution import RunRequest, execute_run
from gyrobench.workflow.run_folders import prepare_folder
from gyrobench.workflow.saved_run import RunOutcome, write_report
from gyrobench.workflow.suite_execution import execute_suite
from gyrobench.workflow.suite_report import SuiteOutcome, reduce_runs

if TYPE_CHECKING:
    from gyrobench.engine.run_driver import Status

__all__ = [
    "Comparison",
    "Experiment",
    "GyrobenchError",
    "Record",
    "Result",
    "Run",
    "SuiteExperiment",
    "SuiteRun",
    "compare",
    "load",
    "load_suite",
    "open_run",
    "reduce",
]

KEPT = ("json",)  # of the report, in a folder named by ``out``; Run.report writes the rest
File = str | Path


@dataclass(frozen=True, repr=False)
class Run:
    """A run or the reduction of measured data: record, result, and the folder that keeps them (None: memory only)."""

    record: Record
    folder: Path | None = None
    _result: Result | None = None

    @property
    def result(self) -> Result:
        """The result.  Raises UsageError for a system without reduction, whose runs end with the record."""
        if self._result is None:
            raise UsageError(f"{self.record.run.system} has no reduction: a run of it ends with its record")
        return self._result

    @property
    def name(self) -> str:
        """Name of the folder, else the system and the seed."""
        run = self.record.run
        named = f"{run.system}, seed {run.seed}" if run.seed is not None else run.system
        return self.folder.name if self.folder is not None else named

    def report(self, folder: File | None = None, force: bool = False) -> dict[str, Path]:
        """Write result.json, report.html and report.pdf, into another folder with the record; return the files.

        folder: default that of the run.  force: replace another run that is there.  Raises UsageError, ReportError.
        """
        target = Path(folder) if folder is not None else self.folder
        if target is None:
            raise UsageError("report: this run is in memory only; name a folder: run.report('FOLDER')")
        result = self.result
        if target != self.folder:
            run = self.record.run.as_dict()
            identity = {k: run.get(k) for k in ("system", "parameters", "options", "seed", "step", "data")}
            prepare_folder(target, {k: v for k, v in identity.items() if v is not None}, force)
            kept = self.record.folder
            self.record.save(target)
            self.record.folder = kept
        return write_report(result, target, self.record, None)

    def __str__(self) -> str:
        return format_result(self._result) if self._result is not None else repr(self.record)

    def __repr__(self) -> str:
        where = self.folder if self.folder is not None else "in memory"
        return f"<Run {self.name}: {self._result or self.record!r}, {where}>"

    def _repr_html_(self) -> str | None:
        return html(self._result if self._result is not None else self.record)


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


class Experiment:
    """A system with its values and parts, ready to run.

    values: option -> value, SI.  system: what ``systems/NAME/system.py`` declares, with these values.
    """

    def __init__(self, system: System, parts: Mapping[str, File], maps: Mapping[str, File]) -> None:
        self.system = system
        self.parts = {slot: str(part) for slot, part in parts.items()}
        self.maps = _mapping_files(maps)
        self._given: dict[str, str] = {}  # as given, for the reader of measured data

    @property
    def name(self) -> str:
        """Name of the system."""
        return self.system.name

    @property
    def values(self) -> Mapping[str, Any]:
        """Options and their values, SI."""
        return dict(self.system.values)

    def set(self, name: str, value: Any) -> Self:
        """Set an option or, as "slot.parameter", a parameter of a part; a number is SI, a text has its unit.

        Returns the experiment.  Raises InvalidValueError; a parameter is checked when its part is known, at the run.
        """
        self.system.set(name, value)
        self._given[name] = str(value)
        return self

    def run(
        self,
        seed: int = 1,
        *,
        step: float | str | None = None,
        engine: str | None = None,
        check_step: bool = False,
        isolate: Iterable[str] = (),
        spec: File | None = None,
        out: File | None = None,
        force: bool = False,
        resume: bool = False,
        progress: Callable[[Status], None] | None = None,
    ) -> Run:
        """Run the system and reduce its record.

        seed: of all noise.  step: s, or a text with its unit.  engine: "native" or "reference".  check_step: halve the
        step once, noise off.  isolate: slots that run in a process of their own.  spec: name or file of an acceptance
        specification.  out: folder for record and result.json; without it nothing is written.  force: replace another
        run there.  resume: go on with an interrupted run there.  progress: called about five times a second.

        Raises errors of type GyrobenchError; one that comes after the first step holds what was recorded in its
        attribute ``record``.
        """
        if out is None and (force or resume):
            raise UsageError("force, resume: name the folder of the run in out")
        request = RunRequest(
            parts=self.parts, maps=self.maps, seed=_seed(seed), engine=engine, step=_step(step),
            out=_path(out), force=force, resume=resume, spec=spec,
            check_step=check_step, isolate=tuple(isolate), in_memory=out is None, formats=KEPT,
        )  # fmt: skip
        return _finished(execute_run(request, self.system.with_values({}), _feedback(progress)))

    def reduce(
        self,
        data: File,
        *,
        spec: File | None = None,
        out: File | None = None,
        force: bool = False,
        **circumstances: str,
    ) -> Run:
        """Reduce a laboratory's CSV file by the reduction of this system.

        The options that were set and the circumstances (phase, instrument, operator ...) replace comments of the file.
        spec, out, force: as of :meth:`run`.  Raises errors of type GyrobenchError.
        """
        file = Path(data)
        if not file.is_file():
            raise UsageError(f"{file}: no such file of measured data")
        outcome = reduce_measured(
            self.system.with_values({}), file, {**self._given, **circumstances}, spec,
            _path(out), force, out is None, KEPT,
        )  # fmt: skip
        return _finished(outcome)

    def _shown(self, option: str) -> str:
        unit = self.system.options[option].unit
        return format_quantity(self.system[option], unit if isinstance(unit, str) else unit.__name__)

    def __repr__(self) -> str:
        given = ", ".join([*self.system.given, *(f"{slot}: {part}" for slot, part in self.parts.items())])
        return f"<Experiment {self.name}: {given or 'default values'}>"

    def __str__(self) -> str:
        rows = [["option", "value", "meaning"]]
        rows += [[n, self._shown(n), o.doc] for n, o in self.system.options.items()]
        return "\n".join([self.system.title, "", *align_columns(rows, {0, 1, 2})])

    def _repr_html_(self) -> str:
        rows = [
            Row([text_cell(n, "strong"), text_cell(self._shown(n)), text_cell(o.doc)])
            for n, o in self.system.options.items()
        ]
        slots = ", ".join(f"{name}: {self.parts.get(name, s.part)}" for name, s in self.system.slots.items())
        table = Table([Column("option"), Column("value"), Column("meaning")], rows, f"Parts: {slots}.")
        return fragment(paragraph(self.system.title, strong=True), table_html(table))


class SuiteExperiment:
    """A suite with its values and parts, ready to run; a value goes to every test that has it."""

    def __init__(self, suite: Suite, parts: Mapping[str, File], maps: Mapping[str, File]) -> None:
        self.suite = suite
        self.parts = {slot: str(part) for slot, part in parts.items()}
        self.maps = _mapping_files(maps)

    @property
    def name(self) -> str:
        """Name of the suite."""
        return self.suite.name

    def set(self, name: str, value: Any) -> Self:
        """Set an option of the suite, of its tests, or a parameter of a part; returns the suite."""
        self.suite.set(name, value)
        return self

    def run(
        self,
        out: File,
        seed: int = 1,
        *,
        step: float | str | None = None,
        spec: File | None = None,
        force: bool = False,
        resume: bool = False,
        progress: Callable[[Status], None] | None = None,
    ) -> SuiteRun:
        """Run all tests, each in a folder inside ``out``, and write their reports and that of the suite.

        ``failed`` of what is returned names the tests without a result.  Raises errors of type GyrobenchError.
        """
        request = RunRequest(
            parts=self.parts, maps=self.maps, seed=_seed(seed), step=_step(step), out=Path(out), force=force,
            resume=resume, spec=spec,
        )  # fmt: skip
        return _finished_suite(execute_suite(request, self.suite, _feedback(progress)))

    def reduce(
        self, runs: Iterable[Run | File], out: File, *, spec: File | None = None, force: bool = False
    ) -> SuiteRun:
        """Write the report of the suite from runs that exist, each in a folder.  Raises UsageError."""
        folders = []
        for number, run in enumerate(runs, 1):
            folder = run.folder if isinstance(run, Run) else Path(run)
            if folder is None:
                raise UsageError(
                    f"run {number} of the suite is in memory only; keep each in a folder: run(out='FOLDER')"
                )
            folders.append(folder)
        return _finished_suite(reduce_runs(self.suite, folders, spec, Path(out), force))

    def __repr__(self) -> str:
        return f"<SuiteExperiment {self.name}: {', '.join(self.suite.tests())}>"


def load(
    name: File,
    values: Mapping[str, Any] | None = None,
    *,
    parts: Mapping[str, File] | None = None,
    maps: Mapping[str, File] | None = None,
    **options: Any,
) -> Experiment:
    """Return a system of the bench, or of an SSP archive, ready to run.

    values, options: as of :meth:`Experiment.set`.  parts: slot -> name of a part or path of an FMU.  maps: slot ->
    mapping file of a foreign FMU.  Raises errors of type GyrobenchError; UsageError for a suite.
    """
    test = load_test(str(name))
    if isinstance(test, Suite):
        raise UsageError(f"{name} is a suite of tests: gyrobench.load_suite('{name}')")
    experiment = Experiment(test, parts or {}, maps or {})
    for key, value in {**(values or {}), **options}.items():
        experiment.set(key, value)
    return experiment


def load_suite(
    name: str,
    values: Mapping[str, Any] | None = None,
    *,
    parts: Mapping[str, File] | None = None,
    maps: Mapping[str, File] | None = None,
    **options: Any,
) -> SuiteExperiment:
    """Return a suite of the bench, ready to run; arguments as of :func:`load`.  Raises UsageError for a system."""
    test = load_test(name)
    if not isinstance(test, Suite):
        raise UsageError(f"{name} is one test, no suite: gyrobench.load('{name}')")
    suite = SuiteExperiment(test, parts or {}, maps or {})
    for key, value in {**(values or {}), **options}.items():
        suite.set(key, value)
    return suite


def reduce(
    name: str, data: File, *, spec: File | None = None, out: File | None = None, force: bool = False, **values: str
) -> Run:
    """Return the reduction of a laboratory's CSV file; values: options and circumstances, which replace its comments.

    ``gyrobench reduce NAME --template`` prints an empty file.  Raises errors of type GyrobenchError.
    """
    return load(name).reduce(data, spec=spec, out=out, force=force, **values)


def open_run(folder: File) -> Run:
    """Return a run from its folder, with the result that was saved.  Raises RecordError and UsageError."""
    folder = require_run(Path(folder))
    record = Record.load(folder)
    return Run(record, folder, read_result(folder) if (folder / "result.json").is_file() else None)


def compare(*runs: Run | SuiteRun | File, names: Iterable[str] = ()) -> Comparison:
    """Return runs, or folders of runs, side by side; the first is the baseline.

    names: of the runs, in their order; default the names of their folders, numbered where two are equal.
    ``print`` shows the estimates, a notebook tables; ``.frame()`` is a data frame, ``.write(folder)`` a report.
    Raises UsageError for fewer than two runs, for names that are too few or equal, and for runs with nothing in common.
    """
    opened = [r if isinstance(r, Run | SuiteRun) else Path(r) for r in runs]
    results = [read_result(r) if isinstance(r, Path) else r.result for r in opened]
    named = list(names)
    if named and len(named) != len(results):
        raise UsageError(f"compare: {len(results)} runs, {len(named)} names")
    if not named:
        named = [r.name for r in opened]
        named = [n if named.count(n) == 1 else f"{n} ({k})" for k, n in enumerate(named, 1)]
    return compare_results(list(zip(named, results, strict=True)))


def _finished(outcome: RunOutcome) -> Run:
    """Return the run of an outcome; what failed or was stopped after it is raised."""
    if outcome.stopped:
        raise outcome.stopped
    return Run(outcome.record, outcome.folder, outcome.result)


def _finished_suite(outcome: SuiteOutcome) -> SuiteRun:
    tests = {n: outcome.folder / t["folder"] for n, t in outcome.result.provenance["tests"].items()}
    runs = {name: open_run(folder) for name, folder in tests.items()}
    return SuiteRun(outcome.result, outcome.folder, runs, str(outcome.stopped or ""))


def _feedback(progress: Callable[[Status], None] | None) -> Feedback:
    @contextlib.contextmanager
    def reported(label: str) -> Iterator[Callable[[Status], None] | None]:
        yield progress

    return Feedback(progress=reported)


def _seed(seed: Any) -> int:
    try:
        number = operator.index(seed)
    except TypeError:
        number = -1
    if number < 0:
        raise UsageError(f"seed {seed!r}: a whole number from 0 is expected")
    return number


def _path(file: File | None) -> Path | None:
    return None if file is None else Path(file)


def _step(step: float | str | None) -> float | None:
    return None if step is None else float(parse("step", step, "s"))


def _mapping_files(maps: Mapping[str, File]) -> dict[str, Path]:
    files = {slot: Path(file) for slot, file in maps.items()}
    for slot, path in files.items():
        if not path.is_file():
            raise UsageError(f"slot {slot}: {path}: no such mapping file")
    return files
