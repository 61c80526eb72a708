"""What a command line names: systems with values, FMU files, specifications, times."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gyrobench.bench import Bench, UsageError, suggest_names
from gyrobench.result import Specification
from gyrobench.system import suite as suites
from gyrobench.system.suite import Suite
from gyrobench.system.system import System
from gyrobench.system.values import InvalidValueError, parse

HINTS: Mapping[Any, str] = {"rad": "deg", "rad/s": "deg/h"}


def parse_assignments(values: list[str] | None, option: str, example: str) -> dict[str, str]:
    """Return ``["a.b=1"]`` as ``{"a.b": "1"}``.

    Raises UsageError for an entry without ``=`` and for a name given twice.
    """
    assignments: dict[str, str] = {}
    for v in values or []:
        name, sign, value = (x.strip() for x in v.partition("="))
        if not (sign and name and value):
            raise UsageError(f"{option} {v}: write NAME=VALUE, for example {option} {example}")
        if name in assignments:
            raise UsageError(f"{option} {name}: given twice, {assignments[name]} and {value}")
        assignments[name] = value
    return assignments


def parse_settings(values: list[str] | None) -> dict[str, str]:
    """Return the values of --set by name.  Raises UsageError."""
    return parse_assignments(values, "--set", "latitude=45.75deg")


def parse_swaps(part: list[str] | None, mapping: list[str] | None) -> tuple[dict[str, str], dict[str, Path]]:
    """Return parts and mapping files by slot.  Raises UsageError for a mapping file that does not exist."""
    parts = parse_assignments(part, "--part", "gyro=vendor.fmu")
    maps = {k: Path(v) for k, v in parse_assignments(mapping, "--map", "gyro=vendor.toml").items()}
    for slot, file in maps.items():
        if not file.is_file():
            raise UsageError(f"--map {slot}={file}: no such file")
    return parts, maps


def parse_step(text: str | None) -> float | None:
    """Return a communication step in s.  Raises InvalidValueError."""
    return float(parse("--step", text, "s")) if text else None


def load_test(name: str, values: Mapping[str, Any] | None = None, step: float | None = None) -> System | Suite:
    """Return a system or suite of the bench at hand, or the system of an SSP archive, with values set.

    step: of an archive, s.  Raises BenchError, InvalidConfigurationError and UsageError.
    """
    test: System | Suite
    if name.endswith(".ssp"):
        from gyrobench.exchange.ssp_import import read_ssp

        test = read_ssp(Path(name), step or System.step)
    else:
        test = suites.load_test(name, Bench.find().folder)
    apply_values(test, values or {})
    return test


def apply_values(test: System | Suite, values: Mapping[str, Any]) -> None:
    """Set values as given to --set.  Raises UsageError."""
    for key, value in values.items():
        try:
            test.set(key, value)
        except InvalidValueError as error:
            raise UsageError(f"--set {error}{_unit_hint(test, key, value)}") from None


def load_saved_test(folder: Path) -> System | Suite:
    """Return the system or suite of a run with its default values.  Raises RecordError for a folder without a run."""
    from gyrobench.record.run_document import FILE, RecordError, read_run

    if not (folder / FILE).is_file():
        raise RecordError(f"{folder}: no run there (no {FILE}); runs are in {Bench.find().out}/SYSTEM/")
    return load_test(read_run(folder).system)


def load_system(name: str, values: Mapping[str, Any] | None = None) -> System:
    """Return a system as :func:`load_test`.  Raises UsageError for a suite too, naming its tests."""
    test = load_test(name, values)
    if isinstance(test, Suite):
        raise UsageError(f"{name} is a suite; name one of its tests: {', '.join(test.tests())}")
    return test


def suite_members(suite: Suite) -> dict[str, System]:
    """Return the tests with their values.  Raises InvalidConfigurationError, and UsageError for a wrong value."""
    try:
        return suite.members(Bench.find().folder)
    except InvalidValueError as error:
        raise UsageError(f"--set {error}") from None


def _unit_hint(test: System | Suite, key: str, value: Any) -> str:
    """Return the end of a message about a number that was given without its unit."""
    option = test.options.get(key)
    if option is None or option.unit not in HINTS or str(value)[-1:].isalpha():
        return ""
    return f"; a number without unit is in {option.unit}, write for example {key}={value}{HINTS[option.unit]}"


def require_slots(system: System) -> System:
    """Return the system.  Raises UsageError where it has nothing to run."""
    if not system.slots:
        raise UsageError(
            f"{system.name} has nothing to run: it reduces measured data (gyrobench reduce {system.name} --template)"
        )
    return system


def check_fmu_files(parts: Mapping[str, str]) -> None:
    """Raise UsageError for a file that is given as an FMU and is not one."""
    for slot, part in parts.items():
        if not part.endswith(".fmu"):
            continue
        from fmpy import read_model_description

        try:
            if not Path(part).is_file():
                raise ValueError("no such file")
            read_model_description(part, validate=False)
        except Exception as error:  # of the zip archive, of the XML, or FMPy's own
            raise UsageError(f"--part {slot}={part}: not an FMU that can be read: {error}") from None


def find_specification(spec: str | None) -> Path | None:
    """Return the file of an acceptance specification, given by name or path.  Raises UsageError."""
    if spec is None or Path(spec).is_file():
        return Path(spec) if spec else None
    known = Bench.find().specifications()
    if spec not in known:
        raise UsageError(f"--spec {spec}: no such file or specification; {suggest_names(spec, known)}")
    return known[spec]


def load_limits(file: Path | None) -> Specification | None:
    """Return the limits of a specification.  Raises SpecificationError."""
    from gyrobench.report import load_specification

    return load_specification(file) if file else None
