"""The typed form of run.json: provenance of a run, of a test in a laboratory, or of the tests of a suite.

    run = RunDocument(system="tumble_single_axis", options={"latitude": 0.8})
    run.write(folder)
    run = read_run(folder)                         # RecordError where it is not a run.json
    run.options["latitude"], run.plan[0].label, run.complete

Keys that this version does not know are kept.  reports/run.schema.json is the published schema of all this.
"""

from __future__ import annotations

import functools
import json
import math
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError, WithJsonSchema

from gyrobench import reading, units
from gyrobench.errors import GyrobenchError
from gyrobench.files import write_whole

FILE = "run.json"
#: what a record may say of its circumstances, beside instrument and operator, for a report that is signed
ABOUT = ("laboratory", "customer", "conditions", "equipment")
#: a value of an option or a parameter, SI; a number that is not finite as text ("inf")
Value = Annotated[Any, WithJsonSchema({"type": ["number", "boolean", "string", "array", "null"]})]


class RecordError(GyrobenchError):
    """A record that cannot be read; the text says which file and why."""


def _plain(value: Any) -> Any:
    """Return the same without numbers that JSON lacks: an infinite parameter of a third-party FMU becomes text."""
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        numbers = all(type(v) is float for v in value)  # the arrays of a sequencer hold thousands
        return list(value) if numbers and all(map(math.isfinite, value)) else [_plain(v) for v in value]
    return value


class Entry(BaseModel):
    """Base of everything in run.json: unknown keys are kept, keys that were never given are not written."""

    model_config = ConfigDict(extra="allow")

    def as_dict(self) -> dict[str, Any]:
        """Return the JSON object: the keys that were given or changed, and numbers that are not finite as text."""
        for name, default in _defaults(type(self)).items():  # a list that was filled in place counts as given
            if getattr(self, name) != default:
                self.model_fields_set.add(name)
        document: dict[str, Any] = _plain(self.model_dump(exclude_unset=True, by_alias=True))
        return document


@functools.cache
def _defaults(entry: type[Entry]) -> dict[str, Any]:
    """Return what each key is when it was never given; only to compare with."""
    return {name: field.get_default(call_default_factory=True) for name, field in entry.model_fields.items()}


def stops(mode: str, travel: float, step: float) -> int:
    """Return at how many angles a table rests that steps by ``step`` over ``travel`` (rad); 1 in other modes."""
    return round(travel / abs(step)) + 1 if mode == "step" and step else 1


class PlanRow(Entry):
    """A phase of the plan, numbered from 1 as in the record; angles in rad, rates in rad/s, times in s."""

    phase: int = Field(description="number of the phase, from 1")
    label: str = ""
    mode: str = Field(default="", description="hold, index, rate, servo, step; of a loop test: what is excited")
    face: str = Field(default="", description="attitude of the instrument on its table or in the laboratory")
    day: str = Field(default="", description="of a record of several days")
    cycle: int = Field(default=0, description="of a test that repeats its positions: cycle of the day, from 1")
    target: float = Field(default=0.0, description="angle, rad; rate, rad/s; in servo mode what the system makes of it")
    target_y: float = Field(default=0.0, description="angle of the second axis, rad")
    settle: float = Field(default=0.0, description="wait before the first window, s")
    dwell: float = Field(default=0.0, description="length, s")
    travel: float = Field(default=0.0, description="angle turned in mode rate, rad; in mode step, all stops")
    window: float = Field(default=0.0, description="length of a window, s; in mode rate an angle, rad")
    step: float = Field(default=0.0, description="angle from stop to stop in mode step, rad")
    shape: str = Field(default="", description="of a loop test: step, sine ...")
    axis: int = Field(default=0, description="of a loop test: axis of the excitation, from 1")
    amplitude: float = Field(default=0.0, description="of a loop test: size of the excitation, in its unit")
    unit: str = ""
    frequency: float = Field(default=0.0, description="of a loop test, Hz")

    @property
    def stops(self) -> int:
        """Number of angles at which the table rests, 1 but in mode step."""
        return stops(self.mode, self.travel, self.step)


class PartInfo(Entry):
    """The FMU in a slot."""

    name: str = Field(default="", description="model name of the FMU")
    version: str = ""
    target: str = Field(default="", description="native, python, or foreign: not built from a part of the bench")
    fmi: str = ""
    sha256: str = Field(default="", description="SHA-256 of the FMU file")


class SetupError(Entry):
    """A parameter that was set past the option that owns it, or past the method: the test does not use this value."""

    parameter: str = Field(description="slot.parameter")
    value: Value = Field(description="of the run, SI")
    assumed: Value = Field(description="what plan and reduction assume, SI")
    unit: str = ""
    option: str = Field(default="", description="that owns the parameter; empty: the method assumes its value")

    def comparison(self) -> str:
        """Return what is simulated beside what the test assumes, as text."""
        value, assumed = (units.format_quantity(v, self.unit) for v in (self.value, self.assumed))
        option = f" (option {self.option})" if self.option else ""
        text = f"{self.parameter} = {value}, while plan and reduction assume {assumed}{option}"
        return text.replace(" -", " −").replace("[-", "[−")

    def sentence(self) -> str:
        """Return the comparison, and the setting of a test that uses the value."""
        if not self.option:
            return f"{self.comparison()}. No option changes what they assume."
        value = units.format_quantity(self.value, self.unit).replace("°", "deg").replace(" ", "")
        return f"{self.comparison()}. To change the whole test: --set {self.option}={value}."


class LinearModel(Entry):
    """x' = A x + B u, y = C x + D u, or the same from step to step; SI."""

    A: list[list[float]]
    B: list[list[float]]
    C: list[list[float]]
    D: list[list[float]]
    inputs: list[str]
    outputs: list[str]
    states: list[str]
    step: float = Field(description="s; 0 of a continuous model")


class LinearPair(Entry):
    """A linear model and the same with the communication step and its delays; None where there is none."""

    continuous: LinearModel | None = None
    discrete: LinearModel | None = None

    def of(self, kind: str) -> LinearModel | None:
        """Return the model of a kind, "continuous" or "discrete"."""
        return {"continuous": self.continuous, "discrete": self.discrete}[kind]


class OpenLoop(LinearPair):
    """The gain of a loop opened at an input."""

    break_at: str = Field(default="", alias="break", description="slot.input")


class LinearModels(Entry):
    """The linear system about the start of the run, or why there is none."""

    missing: str = Field(default="", description="why there is no linear model")
    closed: LinearPair = Field(default_factory=LinearPair, description="from the excitations to the channels")
    loops: dict[str, OpenLoop] = Field(default_factory=dict)
    wanted: dict[str, float] = Field(default_factory=dict, description="loop -> requested gain crossover, Hz")
    warnings: list[str] = Field(
        default_factory=list, description="warnings of the linear models, given as the run begins"
    )


class DataFile(Entry):
    """The file of measured data, or of a run by another tool, that was reduced."""

    file: str = ""
    sha256: str = ""
    columns: str = Field(default="", description="column map of a laboratory's own file")
    columns_sha256: str = ""


class Day(Entry):
    """One of the runs of a record of several days."""

    run: str = Field(description="folder of the run")
    seed: int | None = None
    date: str = ""
    operator: str = ""
    note: str = ""


class Document(Entry):
    """Common keys of the run.json of a run and of a suite."""

    system: str = Field(default="", description="name of the system or suite")
    title: str = ""
    date: str = Field(default="", description="of the run, for example 2026-03-14T09:30:00+00:00")
    seed: int | None = Field(default=None, description="of all noise; none of measured data")
    options: dict[str, Value] = Field(default_factory=dict, description="option of the system -> value, SI")
    versions: dict[str, str] = Field(default_factory=dict, description="package -> version")
    complete: bool = Field(default=True, description="false: the run, or a test of the suite, did not end")
    instrument: str = ""
    operator: str = ""
    laboratory: str = ""
    customer: str = ""
    conditions: str = ""
    equipment: str = ""
    notes: list[str] = Field(default_factory=list, description="notes and warnings given before the run")

    def write(self, folder: Path) -> None:
        """Write run.json into a folder."""
        text = json.dumps(reading.sealed(self.as_dict()), indent=1, ensure_ascii=False, allow_nan=False)
        write_whole(Path(folder) / FILE, (text + "\n").encode("utf-8", "backslashreplace"))

    def replace(self, **changes: Any) -> Self:
        """Return a copy with changed entries."""
        return type(self).model_validate({**self.as_dict(), **changes})


class RunDocument(Document):
    """A run, or a test in a laboratory (``measured``)."""

    spec: list[str] = Field(default_factory=list, description="identifiers of the methods")
    measured: bool = Field(default=False, description="true: the data come from a laboratory")
    step: float = Field(default=0.0, description="communication step, s")
    engine: str = Field(
        default="", description="native, linked (native, in any case in the linked form), reference; another tool"
    )
    order: list[str] = Field(default_factory=list, description="slots in the order of execution")
    cuts: list[str] = Field(default_factory=list, description="connections that carry the value of the step before")
    delays: dict[str, float] = Field(default_factory=dict, description="connection -> delay, s")
    coupling: str = Field(default="", description="parallel: every connection carries the value of the step before")
    parts: dict[str, PartInfo] = Field(default_factory=dict, description="slot -> FMU")
    parameters: dict[str, Value] = Field(default_factory=dict, description="slot.parameter -> value, SI")
    changed: list[str] = Field(default_factory=list, description="options, parameters and slots that were set")
    setup_errors: list[SetupError] = Field(default_factory=list, description="what was set past options and method")
    units: dict[str, str] = Field(default_factory=dict, description="recorded channel -> unit")
    window_units: dict[str, str] = Field(default_factory=dict, description="column of the windows -> unit, SI")
    plan: list[PlanRow] = Field(default_factory=list)
    linear: LinearModels | None = Field(default=None, description="of a system with loops")
    timing: dict[str, float] = Field(default_factory=dict, description="slot -> s of wall time")
    steps: int = Field(default=0, description="communication steps done")
    stopped_at: float | None = Field(default=None, description="simulated time at the end, s")
    resumed_at: list[float] = Field(default_factory=list, description="simulated times at which it was continued, s")
    linked: bool = Field(default=False, description="the native engine ran in its linked form")
    problem: str = Field(default="", description="why the run is not complete")
    tables: dict[str, str] = Field(default_factory=dict, description="file of the record -> SHA-256")
    data: DataFile | None = None
    doubts: list[str] = Field(default_factory=list, description="of measured data: why its readings bear no verdict")
    external: list[str] = Field(default_factory=list, description="of a run by another tool: what is not known of it")
    series: dict[str, Any] | None = Field(default=None, description="of a drift record: columns and acquisition, SI")
    days: list[Day] = Field(default_factory=list, description="of a record of several days")
    polarity: str = Field(default="", description="sign convention of measured data")
    type_b: str = Field(default="", description="of measured data, none: no uncertainty of type B is declared")
    arrangement: str = Field(default="", description="of measured data, checked: what no residual shows was checked")
    report: str = Field(default="", description="number of the laboratory's report")
    source: str = Field(default="", description="where measured data were published")
    made: str = ""
    note: str = ""

    @property
    def type_b_stated(self) -> bool:
        """True where an uncertainty of type B (an option u_...) is given, or declared absent (type_b = none)."""
        sizes = (v for n, v in self.options.items() if n.startswith("u_") and isinstance(v, int | float))
        return self.type_b == "none" or any(v > 0.0 for v in sizes)


class SuiteTestRun(Entry):
    """A test of a suite: its folder, and what its result and its record say of it."""

    folder: str = Field(description="from the folder of the suite")
    report_id: str = ""
    date: str | None = None
    operator: str | None = None
    seed: int | None = None
    step: float | None = None
    engine: str | None = None
    phases: int = 0
    duration: float | None = Field(default=None, description="s")
    changed: list[str] = Field(default_factory=list)
    result_sha256: str = ""
    record_sha256: str = ""
    data: DataFile | None = None
    versions: dict[str, str] | None = None
    parts: dict[str, PartInfo] = Field(default_factory=dict)
    step_check: float | None = Field(default=None, description="largest change of a coefficient at half the step, in u")
    complete: bool = True


class SuiteDocument(Document):
    """The tests of a suite."""

    identity: str = Field(default="", description="SHA-256 of parts, parameters and options of all tests")
    runs: list[str] = Field(default_factory=list, description="of a suite of existing runs: their names")
    changed: dict[str, str] = Field(default_factory=dict, description="what was set -> value as given")
    tests: dict[str, SuiteTestRun] = Field(default_factory=dict)
    failed: dict[str, str] = Field(default_factory=dict, description="test without a result -> why")


#: keys of the run.json of a suite that no run has
SUITE_KEYS = {"identity", "runs", "tests"}


#: of the run.json of 0.1.0, and of one that was written by hand
NO_DIGEST = "run.json has no SHA-256 of its own: whether it was changed after the run is not known."


def _changed(problem: str) -> RecordError:
    return RecordError(f"{problem}; restore it from a copy, or repeat the run")


def read_run(folder: Path) -> RunDocument | SuiteDocument:
    """Return the run.json of a folder.  Raises RecordError where there is none that can be read."""
    file = Path(folder) / FILE
    data, verified = reading.opened(
        reading.json_object(reading.read_text(file, RecordError), file, RecordError), file, _changed
    )
    try:
        kind: type[RunDocument | SuiteDocument] = SuiteDocument if SUITE_KEYS & data.keys() else RunDocument
        run = kind.model_validate(data)
        if not verified and NO_DIGEST not in run.notes:
            run.notes.append(NO_DIGEST)
        return run
    except ValidationError as error:
        problems = [f"{'.'.join(map(str, e['loc']))}: {e['msg']}" for e in error.errors()]
        shown = "; ".join([*problems[:3], *([f"and {len(problems) - 3} more"] if len(problems) > 3 else [])])
        raise RecordError(f"{file}: not a run.json of gyrobench: {shown}") from None


def schema() -> dict[str, Any]:
    """Return the JSON Schema of run.json, as published in reports/run.schema.json."""
    head = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": "https://gyrobench.example/schema/run-1.json",
        "title": "gyrobench run",
        "description": "What a record says of its run, or of the tests of a suite. SI units; further keys are "
        "allowed. sha256, the last key of a file, is the SHA-256 of all others as JSON text in UTF-8 with sorted keys, "
        "', ' and ': ' between them.",
    }
    return {**head, **TypeAdapter(RunDocument | SuiteDocument).json_schema()}


@functools.cache
def package_versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that determine a result."""
    import platform
    from importlib.metadata import PackageNotFoundError, version

    versions = {"python": platform.python_version()}
    for name in ("gyrobench", "fmpy", "numpy"):
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = "not installed"
    return versions
