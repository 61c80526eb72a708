"""Data sheets of instruments, ``instruments/NAME.toml``, and the values of a system that they make.

    title = "ADIS16405"
    maker = "Analog Devices"
    kind = "vibrating"                     # fibre, laser, vibrating, floated, turntable
    part = "gyro_mems"                     # the part that takes the figures; of a turntable: left out
    source = "data sheet ADIS16400/ADIS16405"
    date = "2009"                          # of the source

    [figures.noise_density]                # the figures that gyrobench.workflow.sheet_values knows for this kind
    value = "0.05 deg/s/sqrt(Hz)"          # as printed, with its unit
    reading = "typical"                    # typical, one_sigma, maximum, minimum, or limit: plus or minus, of all units
    note = "rms in 1 Hz, one-sided"

    [accelerometers.noise_density]         # of a unit: the same of its accelerometers
    value = "300 ug/sqrt(Hz)"
    reading = "typical"

What becomes of the figures is written in :mod:`gyrobench.workflow.sheet_values`.  A gyro goes into the slot gyro, or
three of them into a unit, the accelerometers into the slot accelerometers or the unit; a turntable changes no part: it
sets what the system's table has, and what is believed of it.
[GYRO-SHEET, TABLE-PRESETS]
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from gyrobench import reading
from gyrobench.bench import Bench, UsageError, suggest_names
from gyrobench.boundary import faults_of
from gyrobench.packaging import load_part
from gyrobench.system.suite import Suite
from gyrobench.system.system import System
from gyrobench.system.values import InvalidValueError, parse_number
from gyrobench.workflow import sheet_values
from gyrobench.workflow.sheet_values import FIGURES, SETTINGS, SIGNED

TABLE_SLOTS = ("table", "outer", "inner")
TAKERS = "drift_record, rate_table_test, gyro_bandwidth, turn_on_repeatability, vibration_rectification, north_finder"
UNITS = "imu_positions (with a chamber: over temperature), coning_test, sculling_test, attitude_estimator"
FORCES = "accelerometers"  # kind of the sheet of those of a unit, and their slot
HELD = 0.5  # of the rate of the steps: samples that come more often are told from them by two steps, and unevenly
TABLE_SOCKETS = ("Table", "ServoTable", "TwoAxisTable")


class Figure(BaseModel):
    """A figure of a data sheet as it is printed."""

    model_config = ConfigDict(extra="forbid", strict=True)

    value: str = Field(min_length=1)
    reading: Literal["typical", "one_sigma", "maximum", "minimum", "limit"]
    note: str = ""


class Instrument(BaseModel):
    """The keys of a data sheet; see the module."""

    model_config = ConfigDict(extra="forbid", strict=True)

    title: str = Field(min_length=1)
    maker: str = Field(min_length=1)
    kind: Literal["fibre", "laser", "vibrating", "floated", "turntable"]
    part: str = ""
    source: str = Field(min_length=1)
    date: str = Field(min_length=4)
    figures: dict[str, Figure] = Field(min_length=1)
    accelerometers: dict[str, Figure] = Field(default_factory=dict)

    @property
    def of_accelerometers(self) -> Instrument | None:
        """Return the sheet of the accelerometers of this unit, of no part; None where it states none."""
        if not self.accelerometers:
            return None
        changes = {"kind": FORCES, "part": "", "figures": self.accelerometers, "accelerometers": {}}
        return self.model_copy(update=changes)

    @property
    def label(self) -> str:
        """Return what a report calls it."""
        return f"{self.maker} {self.title} ({self.source}, {self.date}), simulated"

    def si(self, name: str) -> float | None:
        """Return a figure in SI; None where the sheet has none, or only a limit of an error."""
        figure = self.figures.get(name)
        if figure is None or (figure.reading == "limit" and name not in SETTINGS):
            return None
        return float(parse_number(name, figure.value, FIGURES[self.kind][name]))

    def limit(self, name: str) -> float | None:
        """Return the size that no unit exceeds, SI; None where the sheet has no limit of this figure."""
        figure = self.figures.get(name)
        if figure is None or figure.reading not in ("limit", "maximum"):
            return None
        return float(parse_number(name, figure.value, FIGURES[self.kind][name]))

    @property
    def density(self) -> float | None:
        """Return N, the two-sided density of the white noise: the angle random walk, or the density over sqrt 2."""
        return sheet_values.density(self)


def find_instrument(name: str) -> Instrument:
    """Return a data sheet of the bench or of a file.  Raises UsageError, naming all that is wrong."""
    bench = Bench.find()
    known = bench.instruments()
    file = Path(name) if name.endswith(".toml") else known.get(name)
    if file is None or not file.is_file():
        raise UsageError(f"instrument {name}: no such data sheet; {suggest_names(name, known)}")
    return read_instrument(file)


def read_instrument(file: Path) -> Instrument:
    """Return the data sheet of a TOML file.  Raises UsageError naming all that is wrong with it."""
    data = reading.toml(reading.read_text(file, UsageError), file, UsageError)
    try:
        sheet = Instrument.model_validate(data)
    except ValidationError as error:
        tables = ("figures", FORCES)
        found = faults_of(error, lambda place: Figure if place[0] in tables and len(place) > 2 else Instrument)
        raise UsageError("\n".join([f"{file}: not a data sheet:", *(f"  - {p}" for p in found)])) from None
    problems = _faults("figures", sheet.figures, FIGURES[sheet.kind])
    problems += _faults(FORCES, sheet.accelerometers, FIGURES[FORCES])
    if sheet.accelerometers and sheet.kind in ("floated", "turntable"):
        problems.append(f"{FORCES}: a sheet of kind {sheet.kind} has none")
    if (sheet.kind == "turntable") == bool(sheet.part):
        problems.append(
            "part: a turntable names none, its figures go to the table of the system"
            if sheet.part
            else "part: missing; the part that takes the figures"
        )
    if problems:
        raise UsageError("\n".join([f"{file}: not a data sheet:", *(f"  - {p}" for p in problems)]))
    return sheet


def _faults(table: str, figures: Mapping[str, Figure], known: Mapping[str, str]) -> list[str]:
    """Return what is wrong with the figures of a table of a sheet; known: figure -> unit."""
    problems = [f"{table}.{n}: unknown; {suggest_names(n, known)}" for n in figures if n not in known]
    for name, figure in figures.items():
        if name in known:
            try:
                value = float(parse_number(f"{table}.{name}", figure.value, known[name]))
                if not value > 0.0 and name not in SIGNED:
                    problems.append(f"{table}.{name} = {figure.value}: a size is expected, above 0")
            except (InvalidValueError, TypeError, ValueError) as error:
                problems.append(str(error))
    return problems


def parameters(sheet: Instrument) -> dict[str, Any]:
    """Return the parameters of the part of a gyro's or accelerometers' sheet, SI, those that it has.

    Raises UsageError for a part that takes no data sheets.
    """
    part = load_part(sheet.part, Bench.find().folder)
    if sheet.kind == FORCES:
        return sheet_values.accelerometers(sheet, part.declarations)
    found = sheet_values.floated(sheet) if sheet.kind == "floated" else sheet_values.rate_gyro(sheet, part)
    if sheet.kind == "floated" and not found.keys() <= part.declarations.keys():
        raise UsageError(f"{sheet.title}: the part {sheet.part} takes no data sheets of a floated gyro")
    return {n: v for n, v in found.items() if n in part.declarations}


def settings(sheet: Instrument, slot: str = "gyro") -> dict[str, Any]:
    """Return the parameters as values of a system: "gyro.white" -> value."""
    return {f"{slot}.{n}": v for n, v in parameters(sheet).items()}


def output_period(sheet: Instrument, step: float) -> dict[str, float]:
    """Return the time between two samples of a gyro by the output rate of its sheet, of a part that has one; {} where
    it is hardly longer than the communication step (s).
    """
    rate, declared = sheet.si("output_rate"), load_part(sheet.part, Bench.find().folder).declarations
    return {"gyro.period": 1.0 / rate} if rate and "period" in declared and rate * step < HELD else {}


def table_settings(sheet: Instrument, test: System, parts: dict[str, str]) -> dict[str, Any]:
    """Return what a turntable's sheet sets in a system: parameters of its tables, and options of what is believed.

    Raises UsageError where the system has no table, or none that takes a figure of the sheet.
    """
    bench, found = Bench.find(), dict[str, Any]()
    tables = [s for s in TABLE_SLOTS if s in test.slots and test.slots[s].socket in TABLE_SOCKETS]
    if not tables:
        raise UsageError(f"the data sheet {sheet.title} is of a turntable: {test.name} has no slot for one")
    for slot in tables:
        name = parts.get(slot, test.slots[slot].part)
        if name in bench.parts():  # an FMU of another tool keeps what it has
            declared = load_part(name, bench.folder).declarations
            found |= {f"{slot}.{n}": v for n, v in sheet_values.turntable(sheet, declared).items()}
    owner = {target: name for name, option in test.options.items() for target in option.sets.split()}
    found = {owner.get(n, n): v for n, v in found.items()}  # what the plan follows is set by its option
    found |= {n: v for n, v in sheet_values.beliefs(sheet).items() if n in test.options}
    if not found:
        raise UsageError(f"the data sheet {sheet.title}: no figure of it sets anything in {test.name}")
    return found


def unit_settings(sheet: Instrument, test: System, parts: dict[str, str]) -> dict[str, Any]:
    """Return what a rate gyro's sheet sets in a system without a slot for one: three of them in its unit, or the
    options of the drift of its gyros.  Raises UsageError, naming the tests that take it.
    """
    bench, found = Bench.find(), dict[str, Any]()
    part = parts.get("imu", test.slots["imu"].part) if "imu" in test.slots else ""
    if part in bench.parts():
        declared = load_part(part, bench.folder).declarations
        found |= {f"imu.{n}": v for n, v in sheet_values.unit(sheet, declared).items()}
        if forces := sheet.of_accelerometers:
            found |= {f"imu.{n}": v for n, v in sheet_values.unit_forces(forces, declared).items()}
    found |= {n: v for n, v in sheet_values.drifts(sheet).items() if n in test.options}
    if sheet.kind == "floated":
        raise UsageError(f"the data sheet {sheet.title} is of a floated gyro: {test.name} has no slot for one")
    if not found and FORCES in parts:
        raise UsageError(f"the data sheet {sheet.title} states nothing of accelerometers")
    if not found:
        raise UsageError(
            f"the data sheet {sheet.title} is of one gyro: {test.name} has no slot for it. Its tests are {TAKERS}; as "
            f"three gyros of a unit it goes into {UNITS}, by its drift into platform_alignment"
        )
    if (own := test.options.get("bandwidth")) and own.sets and (bandwidth := sheet.si("bandwidth")):
        found["bandwidth"] = bandwidth
    return found


def force_settings(sheet: Instrument, test: System, parts: dict[str, str]) -> dict[str, Any]:
    """Return what the accelerometers of a unit's sheet set in the slot accelerometers; {} where nothing takes them."""
    bench, forces = Bench.find(), sheet.of_accelerometers
    part = parts.get(FORCES, test.slots[FORCES].part if FORCES in test.slots else "")
    if forces is None or part not in bench.parts():
        return {}
    found = sheet_values.accelerometers(forces, load_part(part, bench.folder).declarations)
    return {f"{FORCES}.{n}": v for n, v in found.items()}


def with_instruments(
    names: str | Sequence[str], parts: dict[str, str], test: System | Suite | None = None
) -> tuple[str, dict[str, Any]]:
    """Put the parts of data sheets into their slots; return what a report calls them, and the values that they set.

    names: one name or several, a gyro and a turntable at most.  Raises UsageError.
    """
    found: dict[str, Any] = {}
    titles, taken = [], dict[bool, str]()
    for name in [names] if isinstance(names, str) else names:
        sheet = find_instrument(name)
        table = sheet.kind == "turntable"
        if table in taken:
            raise UsageError(
                f"--instrument {name}: {taken[table]} is a {'turntable' if table else 'gyro'} too; name one"
            )
        taken[table] = name
        titles.append(sheet.label)
        if table:
            if not isinstance(test, System):
                raise UsageError(f"--instrument {name}: a turntable is for one test, not for a suite")
            found |= table_settings(sheet, test, parts)
            continue
        if isinstance(test, System):
            if FORCES in parts and FORCES in test.on_request and FORCES not in test.slots:
                test.request(FORCES)  # they may stand in the place of the gyro
            found |= (forces := force_settings(sheet, test, parts))
            if "gyro" not in test.slots:
                if "imu" in test.slots or not forces:
                    found |= unit_settings(sheet, test, parts)
                continue
        if parts.setdefault("gyro", sheet.part) != sheet.part:
            raise UsageError(f"the data sheet {name} puts {sheet.part} into the slot gyro: name no part for it")
        found |= settings(sheet)
        if isinstance(test, System) and test.sampled_gyro:
            found |= output_period(sheet, test.step)
        if isinstance(test, System) and "u_bias" in test.options and (bias := sheet_values.believed_bias(sheet)):
            found["u_bias"] = bias
    return "; ".join(titles), found
