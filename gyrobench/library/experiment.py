"""A system ready to run, and what a run of it leaves."""

from __future__ import annotations

import contextlib
import operator
import weakref
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from gyrobench.bench import Bench, UsageError
from gyrobench.boundary import checked
from gyrobench.errors import GyrobenchError
from gyrobench.notebook import html
from gyrobench.packaging import load_part
from gyrobench.reading import shorten
from gyrobench.record.record import Record
from gyrobench.report.language import ENGLISH, reports_in
from gyrobench.report.notebook_html import fragment, paragraph, table_html
from gyrobench.report.page_model import Column, PageTable, Row, text_cell
from gyrobench.report.plain_text import align_columns, format_result
from gyrobench.result import Result
from gyrobench.system.parameters import refuse_value
from gyrobench.system.system import System
from gyrobench.system.values import parse_number
from gyrobench.units import format_quantity
from gyrobench.workflow.external_run import reduce_result
from gyrobench.workflow.feedback import Feedback
from gyrobench.workflow.inputs import require_run
from gyrobench.workflow.measured_run import reduce_measured
from gyrobench.workflow.run_comparison import read_result
from gyrobench.workflow.run_execution import RunRequest, execute_run, open_session
from gyrobench.workflow.run_folders import prepare_folder
from gyrobench.workflow.saved_run import RunOutcome, write_report

if TYPE_CHECKING:
    from gyrobench.engine.run_driver import ProgressReport
    from gyrobench.engine.session import Session

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

    @checked
    def report(self, folder: File | None = None, force: bool = False, language: str = ENGLISH) -> dict[str, Path]:
        """Write result.json, report.html and report.pdf, into another folder with the record; return the files.

        folder: default that of the run.  force: replace another run that is there.  language: of the pages, en or zh.
        Raises UsageError, ReportError.
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
        with reports_in(language, result.system, Bench.find().folder):
            return write_report(result, target, self.record, None)

    def __str__(self) -> str:
        return format_result(self._result) if self._result is not None else repr(self.record)

    def __repr__(self) -> str:
        where = self.folder if self.folder is not None else "in memory"
        return f"<Run {self.name}: {self._result or self.record!r}, {where}>"

    def _repr_html_(self) -> str | None:
        return html(self._result if self._result is not None else self.record)


@dataclass(frozen=True)
class _Prepared:
    """The session of an experiment, for its next run; key: engine and timeout."""

    key: tuple[str | None, float | None]
    system: System
    session: Session
    close: Callable[[], object]


def name_parts(parts: Mapping[str, File] | None) -> None:
    """Note that the caller has named these parts: a controller's file may be compiled.  Raises UsageError."""
    from gyrobench.packaging.own_controller import allow

    for part in (parts or {}).values():
        allow(part)


class Experiment:
    """A system with its values and parts, ready to run.

    values: option -> value, SI.  system: what ``systems/NAME/system.py`` declares, with these values.  Its FMUs stay
    loaded between runs of the same values; after a change of a part's or a system's file, load it again.
    """

    def __init__(self, system: System, parts: Mapping[str, File], maps: Mapping[str, File]) -> None:
        self.system = system
        self.parts = {slot: str(part) for slot, part in parts.items()}
        self.maps = mapping_files(maps)
        self._given: dict[str, str] = {}  # as given, for the reader of measured data
        self._prepared: _Prepared | None = None

    @property
    def name(self) -> str:
        """Name of the system."""
        return self.system.name

    @property
    def values(self) -> Mapping[str, Any]:
        """Options and their values, SI."""
        return dict(self.system.values)

    @checked
    def set(self, name: str, value: Any) -> Self:
        """Set an option or, as "slot.parameter", a parameter of a part; a number is SI, a text has its unit.

        Returns the experiment.  Raises InvalidValueError; a parameter of an FMU of others is checked at the run.
        """
        self._check_parameter(name, value)
        self.system.set(name, value)
        self._given[name] = str(value)
        self._release()
        return self

    def _check_parameter(self, name: str, value: Any) -> None:
        """Raise InvalidValueError for a value that a part of the bench does not take."""
        slot, dot, _ = name.partition(".")
        there = self.system.all_slots()
        if not dot or name in self.system.options or slot not in there or slot in self.maps:
            return
        try:
            layout = load_part(self.parts.get(slot, there[slot].part), Bench.find().folder).layout
        except GyrobenchError:  # no part of the bench: it is known when its FMU is loaded
            return
        refuse_value(name, value, layout)

    @checked
    def run(
        self,
        seed: int = 1,
        *,
        step: float | str | None = None,
        engine: str | None = None,
        check_step: bool | None = None,
        timeout: float | str | None = None,
        spec: File | None = None,
        out: File | None = None,
        force: bool = False,
        resume: bool = False,
        progress: Callable[[ProgressReport], None] | None = None,
    ) -> Run:
        """Run the system and reduce its record.

        seed: of all noise.  step: s, or a text with its unit.  engine: "native", "linked" or "reference".
        check_step: find by two further runs without noise what the step does, and take it into u; None: by two short
        ones for a system with loops.  timeout: s or a text with its unit, for one call of an FMU; default 60 s.
        spec: name or file of an acceptance specification.  out: folder for record and result.json; without it nothing
        is written.  force: replace another run there.  resume: go on with an interrupted run there.  progress: called
        about five times a second.

        The run happens in a child process: whatever an FMU does, this one goes on, with an error that says what it was.
        Raises errors of type GyrobenchError; one that comes after the first step holds what was recorded in its
        attribute ``record``.
        """
        if out is None and (force or resume):
            raise UsageError("force, resume: name the folder of the run in out")
        request = RunRequest(
            parts=self.parts, maps=self.maps, seed=checked_seed(seed), engine=engine, step=time_of("step", step),
            out=path_of(out), force=force, resume=resume, spec=spec,
            check_step=check_step, timeout=time_of("timeout", timeout), in_memory=out is None, formats=KEPT,
        )  # fmt: skip
        key = (engine, request.timeout)
        if self._prepared is None or self._prepared.key != key:
            self._release()
            system = self.system.with_values({})
            session = open_session(request, system)
            self._prepared = _Prepared(key, system, session, weakref.finalize(self, session.close))
        return finished(execute_run(request, self._prepared.system, feedback_of(progress), self._prepared.session))

    def _release(self) -> None:
        """Free the FMUs of the run before."""
        if self._prepared is not None:
            self._prepared.close()
            self._prepared = None

    @checked
    def reduce(
        self,
        data: File,
        *,
        spec: File | None = None,
        out: File | None = None,
        force: bool = False,
        columns: File | None = None,
        **circumstances: str,
    ) -> Run:
        """Reduce a laboratory's CSV file by the reduction of this system.

        The options that were set and the circumstances (phase, instrument, operator ...) replace comments of the file.
        columns: column map of a file of another layout, as ``gyrobench fit FILE`` writes it.  spec, out, force: as
        of :meth:`run`.  Raises errors of type GyrobenchError.
        """
        file = Path(data)
        if not file.exists():
            raise UsageError(f"{file}: no such file of measured data")
        outcome = reduce_measured(
            self.system.with_values({}), file, {**self._given, **circumstances}, spec,
            path_of(out), force, out is None, KEPT, columns=path_of(columns),
        )  # fmt: skip
        return finished(outcome)

    @checked
    def reduce_result(
        self,
        result: File | np.ndarray[Any, Any],
        *,
        spec: File | None = None,
        out: File | None = None,
        force: bool = False,
    ) -> Run:
        """Reduce a run of this system, exported with these values and parts, that another tool has made.

        result: the structured array of FMPy, or a file: CSV, .npy, .mat, Parquet, a folder of libcosim's CSV files.
        spec, out, force: as of :meth:`run`.  Raises errors of type GyrobenchError.
        """
        request = RunRequest(
            parts=self.parts, maps=self.maps, engine="reference", out=path_of(out), force=force, spec=spec,
            in_memory=out is None, formats=KEPT,
        )  # fmt: skip
        source = result if isinstance(result, np.ndarray) else Path(result)
        return finished(reduce_result(request, self.system.with_values({}), source))

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
        table = PageTable([Column("option"), Column("value"), Column("meaning")], rows, f"Parts: {slots}.")
        return fragment(paragraph(self.system.title, strong=True), table_html(table))


@checked
def open_run(folder: File) -> Run:
    """Return a run from its folder, with the result that was saved.  Raises RecordError and UsageError."""
    folder = require_run(Path(folder))
    record = Record.load(folder)
    return Run(record, folder, read_result(folder) if (folder / "result.json").is_file() else None)


def finished(outcome: RunOutcome) -> Run:
    """Return the run of an outcome; what failed or was stopped after it is raised."""
    if outcome.stopped:
        raise outcome.stopped
    return Run(outcome.record, outcome.folder, outcome.result)


def feedback_of(progress: Callable[[ProgressReport], None] | None) -> Feedback:
    @contextlib.contextmanager
    def reported(label: str) -> Iterator[Callable[[ProgressReport], None] | None]:
        yield progress

    return Feedback(progress=reported)


def checked_seed(seed: Any) -> int:
    try:
        number = operator.index(seed)
    except TypeError:
        number = -1
    if not 0 <= number < 1 << 63:
        raise UsageError(f"seed {shorten(repr(seed))}: a whole number from 0 to 2^63 - 1 is expected")
    return number


def path_of(file: File | None) -> Path | None:
    return None if file is None else Path(file)


def time_of(name: str, value: float | str | None) -> float | None:
    return None if value is None else parse_number(name, value, "s")


def mapping_files(maps: Mapping[str, File]) -> dict[str, Path]:
    files = {slot: Path(file) for slot, file in maps.items()}
    for slot, path in files.items():
        if not path.is_file():
            raise UsageError(f"slot {slot}: {path}: no such mapping file")
    return files
