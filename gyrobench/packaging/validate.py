"""Checks of an FMU, or of a part with everything that is built from it."""

from __future__ import annotations

import re
import tempfile
import zipfile
from pathlib import Path
from typing import Any

from gyrobench.bench import Bench, BenchError
from gyrobench.files import check_description, missing
from gyrobench.packaging.compiler import command, this_platform
from gyrobench.packaging.fmu import build
from gyrobench.packaging.instance import Fmu, InstanceError, Plain, elements
from gyrobench.packaging.reference import Reference, compare, outdated, read_reference
from gyrobench.units import UnitError, unit

#: A name of the naming convention "structured", by the grammar of FMI 2.0 (2.2.9), which is that of FMI 3.0 too.  It is
#: a regular language; FMPy's general parser takes seconds for an FMU of a few hundred variables.
BASE = r"""(?:[_a-zA-Z][_a-zA-Z0-9]*|'(?:[_a-zA-Z0-9!#$%&()*+,\-./:;<>=?@\[\]^{}|~ ]|\\['"?\\abfnrtv])+')"""
INDEXED = rf"{BASE}(?:\[[0-9]+(?:,[0-9]+)*\])?"
IDENTIFIER = rf"{INDEXED}(?:\.{INDEXED})*"
STRUCTURED = re.compile(rf"{IDENTIFIER}|der\({IDENTIFIER}(?:,[0-9]+)?\)")


def validate(what: str | Path, bench: Path | None = None) -> list[str]:
    """Return the problems of an FMU file, or of a part (by name) in all its targets; empty where there are none.

    An FMU is checked against the FMI standard (schema, structure, starts, units of the description), for units
    that gyrobench does not know, and for a binary that runs here.  One that was built from a part of the bench
    repeats the part's reference run bit for bit.  A third-party FMU is not run.

    Raises BenchError where ``what`` is neither a file nor a part.
    """
    path = Path(what)
    home = Bench.find(bench)
    if path.is_file():
        return _file(path, home)
    if path.suffix == ".fmu" or path.name != str(what):
        raise BenchError(f"{what}: {missing(path)}")
    return _part(str(what), home)


def _part(name: str, home: Bench) -> list[str]:
    from gyrobench.packaging import load_part

    home.part_folder(name)  # says which parts there are
    reference = _reference(name, home)
    if reference is None:
        return [f"{name} has no reference.csv beside its model.py"]
    cls = load_part(name, home.folder)
    names = {k: [s.name for s in cls.layout if s.section == k] for k in ("input", "output")}
    problems = outdated(reference, names) or compare(reference, Plain(cls, name), "plain class")
    targets = [("python", 2)]
    if command(this_platform()):
        targets += [("native", 2), ("native", 3)]
    else:
        problems.append("no C compiler: the native FMUs of this part were not checked")
    with tempfile.TemporaryDirectory(prefix="gyrobench-") as out:
        for target, fmi in targets:
            file = build(name, target, fmi=fmi, out=Path(out), bench=home.folder)
            problems += [f"{target} FMU (FMI {fmi}): {p}" for p in _file(file, home, reference)]
    return problems


def _reference(name: str, home: Bench) -> Reference | None:
    folder = home.parts().get(name)
    file = folder / "reference.csv" if folder else None
    return read_reference(file) if file and file.is_file() else None


def _file(path: Path, home: Bench, reference: Reference | None = None) -> list[str]:
    """Return the problems of a file.  reference: that of its part, where it is known."""
    from fmpy import supported_platforms

    try:
        description, problems = _described(path)
        available = supported_platforms(str(path))
    except Exception as error:  # of the archive, of the XML, or FMPy's own
        return [f"not a readable FMU: {error}"]
    problems += _units(description)
    if description.coSimulation is None:
        return [*problems, "no co-simulation: the bench runs co-simulation FMUs only"]
    platform = this_platform()
    if platform not in available and {"linux64": "x86_64-linux"}.get(platform, platform) not in available:
        problems.append(f"no binary for {platform}; it has {', '.join(available) or 'none'}")
    elif description.generationTool == "gyrobench" and not problems:
        problems += _reference_run(path, description, home, reference)
    return problems


def _described(path: Path) -> tuple[Any, list[str]]:
    """Return the model description and its problems: FMPy's checks but for that of the names, which is made here."""
    from fmpy import read_model_description

    check_description(path)
    with zipfile.ZipFile(path) as archive:
        names = [f.orig_filename for f in archive.filelist if "\\" in f.orig_filename]
    problems = [f'The file path "{n}" contains a backslash.' for n in names]
    try:
        description = read_model_description(str(path), validate=True, validate_model_structure=True)
    except Exception as error:  # ValidationError, with its problems, or what the schema says
        problems += map(str, getattr(error, "problems", [error]))
        description = read_model_description(str(path), validate=False)
    flat = description.variableNamingConvention == "flat"
    for v in description.modelVariables:
        if not (re.fullmatch(r"[^\r\n\t]*", v.name) if flat else STRUCTURED.fullmatch(v.name)):
            convention = "flat" if flat else "structured"
            problems.append(
                f'"{v.name}" (line {v.sourceline}) is not a legal name of the naming convention "{convention}"'
            )
    return description, problems


def _units(description: Any) -> list[str]:
    """Return the units that are neither known nor defined by the FMU itself."""
    problems: dict[str, str] = {}
    defined = {u.name for u in description.unitDefinitions if u.baseUnit is not None}
    for v in description.modelVariables:
        name = v.unit or (v.declaredType.unit if v.declaredType is not None else None)
        if name and name not in problems and name not in defined:
            try:
                unit(name)
            except UnitError as error:
                problems[name] = f"{v.name}: {error}"
    return list(problems.values())


def _reference_run(path: Path, description: Any, home: Bench, reference: Reference | None) -> list[str]:
    name = description.coSimulation.modelIdentifier
    if description.modelName in home.systems():  # a system in one FMU, whose name may be that of a part too
        return []
    reference = reference or _reference(name, home)
    if reference is None:
        return []
    if reference.version != description.version:
        return [f"{name} {description.version}, but the reference run is that of {reference.version}"]
    of = {k: elements(v for v in description.modelVariables if v.causality == k) for k in ("input", "output")}
    problems = outdated(reference, of)
    if problems:
        return problems
    instance = Fmu(path, name)
    try:
        return compare(reference, instance, "reference run")
    except InstanceError as error:
        return [f"reference run: {error}"]
    finally:
        instance.free()
