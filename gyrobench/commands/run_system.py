"""What the commands do: run, reduce, report, compare, show, export.  Everything here speaks to a person."""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from gyrobench.bench import Bench, UsageError, nearest, short
from gyrobench.commands import console
from gyrobench.commands.progress_display import Meter
from gyrobench.commands.run_folders import keep, labels, run_folder
from gyrobench.commands.user_errors import CommandInterrupted, PostRunError, record_kept, user_message
from gyrobench.record.record import Record
from gyrobench.result import Result, Specification
from gyrobench.system.suite import Suite
from gyrobench.system.system import System, load_system
from gyrobench.system.values import InvalidValueError, parse

HINTS: Mapping[Any, str] = {"rad": "deg", "rad/s": "deg/h"}


@dataclass(frozen=True)
class Job:
    """What ``gyrobench run`` was asked for."""

    system: str
    parts: Mapping[str, str] = field(default_factory=dict)
    maps: Mapping[str, Path] = field(default_factory=dict)
    values: Mapping[str, str] = field(default_factory=dict)
    seed: int = 1
    engine: str | None = None
    step: str | None = None
    out: Path | None = None
    force: bool = False
    spec: str | None = None
    check_step: bool = False
    isolate: tuple[str, ...] = ()
    resume: bool = False


def note(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def tell(notes: Iterable[str]) -> None:
    """Notes on standard error; what is said of several slots is said once."""
    slots: dict[str, list[str]] = {}
    for text in notes:
        slot, colon, rest = text.partition(": ")
        slots.setdefault(rest if colon else text, []).append(slot if colon else "")
    for rest, names in slots.items():
        note("note: " + ", ".join(filter(None, names)) + (": " if names[0] else "") + rest)


def load(name: str, values: Mapping[str, Any] | None = None, step: float | None = None) -> System:
    """Return a system of the bench at hand, or of an SSP archive, with values set.

    Raises BenchError and UsageError.
    """
    if name.endswith(".ssp"):
        from gyrobench.exchange.ssp_import import read_ssp

        system = read_ssp(Path(name), step or System.step)
    else:
        system = load_system(name, Bench.find().folder)
    for key, value in (values or {}).items():
        slot, dot, _ = key.partition(".")
        if dot and slot not in system.slots and not isinstance(system, Suite):
            raise UsageError(f"--set {key}: no slot '{slot}'; {nearest(slot, system.slots)}")
        try:
            system.set(key, value)
        except InvalidValueError as error:
            raise UsageError(f"--set {error}{_bare(system, key, value)}") from None
    return system


def _bare(system: System, key: str, value: Any) -> str:
    """A hint for a number that was given without its unit."""
    option = system.options.get(key)
    if option is None or option.unit not in HINTS or str(value)[-1:].isalpha():
        return ""
    return f"; a number without unit is in {option.unit}, write for example {key}={value}{HINTS[option.unit]}"


def check_fmus(parts: Mapping[str, str]) -> None:
    """Raises UsageError for a file that is given as an FMU and is none."""
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


def runnable(system: System) -> System:
    if isinstance(system, Suite):
        raise UsageError(f"{system.name} is a suite; name one of its tests: {', '.join(system.tests())}")
    if not system.slots:
        raise UsageError(
            f"{system.name} has nothing to run: it reduces measured data (gyrobench reduce {system.name} --template)"
        )
    return system


def specification(spec: str | None) -> Path | None:
    """The file of an acceptance specification, given by name or path."""
    if spec is None or Path(spec).is_file():
        return Path(spec) if spec else None
    known = Bench.find().specifications()
    if spec not in known:
        raise UsageError(f"--spec {spec}: no such file or specification; {nearest(spec, known)}")
    return known[spec]


def limits_of(spec: Path | None) -> Specification | None:
    from gyrobench.report import load_specification

    return load_specification(spec) if spec else None


# ---------------------------------------------------------------------------------------------- run
@dataclass(frozen=True)
class Done:
    """A run: where it is kept, and its result and report (none of a system without reduction).  stopped: what the user
    stopped, or what failed, after the run itself.
    """

    folder: Path
    record: Record
    result: Result | None = None
    paths: Mapping[str, Path] = field(default_factory=dict)
    stopped: PostRunError | None = None


def run(job: Job, as_json: bool = False) -> str:
    """Record, reduction and report of one run, or of a suite; returns the verdict.  Raises as :func:`perform`."""
    step = parse("--step", job.step, "s") if job.step else None
    system = load(job.system, job.values, step)
    if isinstance(system, Suite):
        from gyrobench.commands import run_suite

        return run_suite.run(job, system, as_json)
    done = perform(job, runnable(system), step)
    if done.result is None:
        return no_reduction(done.record, done.folder, as_json)
    show_paths(done.paths, None if as_json else console.answer(done.result))
    if done.stopped:
        raise done.stopped
    return done.result.verdict


def perform(job: Job, system: System, step: float | None) -> Done:
    """Runs a system with its values set; writes record and report.

    Raises what Session.run raises, and PostRunError for whatever goes wrong after the run.
    """
    from gyrobench.engine.session import RunError, RunInterrupted, Session

    spec = specification(job.spec)
    limits = limits_of(spec)
    system.refuse()
    check_fmus(job.parts)
    bench = Bench.find().folder
    with Session(system, job.parts, job.maps, engine=job.engine, isolate=job.isolate, bench=bench) as session:
        h = step or system.step
        folder, keeper = run_folder(session, system, job.seed, h, job.maps, job.out, job.force, job.resume)
        tell([*session.notes, *keeper.notes()])
        try:
            with Meter(system.name) as meter:
                record = session.run({}, job.seed, step, None, meter, keeper)
        except RunError as error:
            if error.record is None:
                raise
            kept = keep(error.record, folder)
            more = f"{error}\nthe record until then is kept in {short(kept)}"
            if isinstance(error, RunInterrupted):
                raise CommandInterrupted(f"{more} (gyrobench report says what it lacks)") from None
            raise PostRunError(more) from None
        record.save(folder)
        keeper.done()
        stopped: PostRunError | None = None
        with record_kept(folder):
            if not reduces(system):
                return Done(folder, record)
            result = reduced(system, record, limits)
            if job.check_step:
                try:
                    result.step_check = step_check(session, system, result, job.seed, h)
                except RunInterrupted as error:
                    stopped = CommandInterrupted(f"step check {error}; the report is without it")
                except Exception as error:
                    stopped = PostRunError(f"step check: {user_message(error)}\nthe report is without it")
                    stopped.__cause__ = error
            return Done(folder, record, result, publish(result, folder, record, spec), stopped)


def reduces(system: System) -> bool:
    return type(system).reduce is not System.reduce


def no_reduction(record: Record, folder: Path, as_json: bool) -> str:
    print(
        json.dumps(record.run.as_dict(), indent=1, ensure_ascii=False)
        if as_json
        else f"no reduction; record: {short(folder)}"
    )
    return console.NO_VERDICT


def reduced(system: System, record: Record, limits: Specification | None) -> Result:
    """The system's own reduction, with the run's circumstances attached."""
    from gyrobench.system.wiring import parse_wires

    result: Result = system.reduce(record, limits)
    wires = [f"{a}.{x} -> {b}.{y}" for a, x, b, y in parse_wires(system.wires)]
    result.provenance = {**record.run.as_dict(), "wires": wires}
    return result


def step_check(session: Any, system: System, result: Result, seed: int, step: float) -> dict[str, Any]:
    """Change of each coefficient when the step is halved, noise off, against its standard uncertainty."""
    bindings = session.assembly.bindings
    known = {f"{slot}.{name}" for slot, binding in bindings.items() for name in binding.parameters}
    quiet = {name: 0.0 for name in system.noises if name in known}
    found = []
    for h in (step, step / 2.0):
        with Meter(f"step check, {h:g} s") as meter:
            found.append(system.reduce(session.run(quiet, seed, h, None, meter), None))
    rows: list[dict[str, Any]] = []
    whole, half = ({c.name: c.estimate for c in r.coefficients} for r in found)
    for c in result.coefficients:
        if c.name in whole and c.name in half:  # one that only noise makes is not there without
            change = half[c.name] - whole[c.name]
            ratio = abs(change) / c.u if c.u > 0.0 else None
            rows.append({"name": c.name, "unit": c.unit, "change": change, "u": c.u, "ratio": ratio})
    return {
        "step": step,
        "rows": rows,
        "worst": max((r["ratio"] for r in rows if r["ratio"] is not None), default=None),
    }


def publish(result: Result, folder: Path, record: Record | None, spec: Path | None) -> dict[str, Path]:
    """Writes the report; returns its files."""
    from gyrobench.report import check_units, write

    if spec is not None:
        check_units(spec, {c.name: c.unit for c in result.coefficients})
    return write(result, folder, record=(record and record.channels) or None, bench=Bench.find().folder)


def show_paths(paths: Mapping[str, Path], text: str | None) -> None:
    """A text and the files; without text the JSON file on standard output and the files on standard error."""
    if text is None:
        print(paths["json"].read_text(encoding="utf-8").rstrip("\n"))
    elif text:
        print(text)
    for path in paths.values():
        print(short(path), file=sys.stderr if text is None else sys.stdout)


# ------------------------------------------------------------------------------------------ side by side
def compare(runs: list[Path], out: Path | None, as_json: bool = False) -> None:
    """Reports of several runs side by side; the first is the baseline."""
    from gyrobench import report as reports

    if len(runs) < 2:
        raise UsageError("compare needs two runs or more: gyrobench compare RUN RUN")
    for folder in runs:
        if not folder.is_dir():
            raise UsageError(f"{folder}: no such folder; runs are in {Bench.find().out}/SYSTEM/")
    missing = [f for f in runs if not (f / "result.json").is_file()]
    if missing:
        raise UsageError(f"{missing[0]}: has no result.json; gyrobench report {missing[0]} makes it")
    results = []
    for folder, name in zip(runs, labels(runs), strict=True):
        file = folder / "result.json"
        try:
            results.append((name, reports.load(file.read_text(encoding="utf-8"))))
        except reports.ResultError as error:
            raise UsageError(f"{file}: {error}") from None
    _comparable(results)
    digest = hashlib.sha256("".join(str(f.resolve()) for f in runs).encode()).hexdigest()[:8]
    target = out or Bench.find().out / "comparison" / digest
    paths = reports.compare(results, target, bench=Bench.find().folder)
    if as_json:
        show_paths(paths, None)
    else:
        found = json.loads(paths["json"].read_text(encoding="utf-8"))
        show_paths(paths, console.ranking(found))


def _comparable(results: list[tuple[str, Result]]) -> None:
    """Raises UsageError for a run that has nothing in common with the baseline; a note where systems differ."""
    (first, base), *others = results
    known = {c.name for c in base.coefficients}
    for name, result in others:
        if known.isdisjoint(c.name for c in result.coefficients):
            raise UsageError(
                f"{name} ({result.system}) and {first} ({base.system}) have no coefficient in common: "
                "nothing to compare"
            )
    systems = dict.fromkeys(r.system for _, r in results)
    if len(systems) > 1:
        note(f"note: runs of different systems ({', '.join(systems)}): equal names may not mean equal quantities")


# -------------------------------------------------------------------------------------------- export
def export(
    name: str,
    to: str,
    values: Mapping[str, str],
    parts: Mapping[str, str],
    maps: Mapping[str, Path],
    seed: int,
    out: Path | None,
) -> Path:
    """The system as an SSP archive or as one container FMU; returns the file."""
    from gyrobench.exchange import container, ssp_export

    suffix = ".ssp" if to == "ssp" else ".fmu"
    system = runnable(load(name, values))
    path = out or Bench.find().products / f"{system.name}{suffix}"
    if path.suffix != suffix:
        raise UsageError(f"--out {path}: a{'n SSP archive' if to == 'ssp' else ' container FMU'} ends in {suffix}")
    check_fmus(parts)
    write = ssp_export.export_ssp if to == "ssp" else container.export_container
    tell(write(system, path, parts, maps, None, seed, Bench.find().folder))
    return path
