"""Inputs that a user names: systems with values, FMU files, specifications."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from gyrobench.bench import Bench, UsageError, suggest_names
from gyrobench.files import OversizedArchiveError, missing
from gyrobench.result import Specification
from gyrobench.system import suite as suites
from gyrobench.system.suite import Suite
from gyrobench.system.system import System
from gyrobench.system.values import InvalidValueError


def load_test(name: str, step: float | None = None) -> System | Suite:
    """Return a system or suite of the bench at hand, or the system of an SSP archive.

    step: of an archive, s.  Raises BenchError and InvalidConfigurationError.
    """
    if name.endswith(".ssp"):
        from gyrobench.exchange.ssp_import import read_ssp

        return read_ssp(Path(name), step)
    return suites.load_test(name, Bench.find().folder)


def load_saved_test(folder: Path) -> System | Suite:
    """Return the system or suite of a run with its default values.  Raises RecordError for a folder without a run."""
    from gyrobench.record.run_document import read_run

    return load_test(read_run(require_run(folder)).system)


def require_run(folder: Path) -> Path:
    """Return the folder of a run.  Raises RecordError for a folder without one."""
    from gyrobench.record.run_document import FILE, RecordError

    if not (folder / FILE).is_file():
        raise RecordError(f"{folder}: no run there (no {FILE}); runs are in {Bench.find().out}/SYSTEM/")
    return folder


def suite_members(suite: Suite) -> dict[str, System]:
    """Return the tests with their values.  Raises InvalidConfigurationError, and UsageError for a wrong value."""
    try:
        return suite.members(Bench.find().folder)
    except InvalidValueError as error:
        raise UsageError(str(error)) from None


def require_slots(system: System) -> System:
    """Return the system.  Raises UsageError where it has nothing to run."""
    if not system.slots:
        raise UsageError(
            f"{system.name} has nothing to run: it reduces measured data (gyrobench reduce {system.name} --template)"
        )
    return system


def check_fmu_files(parts: Mapping[str, str | Path]) -> None:
    """Raise UsageError for a file that is given as an FMU and is not one."""
    for slot, part in parts.items():
        if not str(part).endswith(".fmu"):
            continue
        from gyrobench.system.fmu_variables import read_description

        try:
            if not Path(part).is_file():
                raise ValueError(missing(Path(part)))
            read_description(Path(part))
        except OversizedArchiveError as error:
            raise UsageError(f"slot {slot}: {error}") from None
        except Exception as error:  # of the zip archive, of the XML, or FMPy's own
            raise UsageError(f"slot {slot}: {part}: not a readable FMU: {error}") from None


def find_specification(spec: str | Path | None) -> Path | None:
    """Return the file of an acceptance specification, given by name or path.  Raises UsageError."""
    if spec is None:
        return None
    bench = Bench.find()
    if (file := bench.existing(Path(spec))).is_file():
        return file
    known = bench.specifications()
    spec = str(spec)
    if spec not in known:
        raise UsageError(f"{spec}: no such file or acceptance specification; {suggest_names(spec, known)}")
    return known[spec]


def load_limits(file: Path | None) -> Specification | None:
    """Return the limits of a specification.  Raises SpecificationError."""
    from gyrobench.report import load_specification

    return load_specification(file) if file else None
