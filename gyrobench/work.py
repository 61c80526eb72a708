"""What the commands do: run, reduce, report, compare, show, export.  Everything here speaks to a person."""

from __future__ import annotations

import hashlib
import json
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from gyrobench.bench import Bench
from gyrobench.reduction.result import Result
from gyrobench.system.record import Record
from gyrobench.system.system import System, load_system

Specification = Mapping[str, tuple[float | None, float | None]]


class WorkError(Exception):
    """Something after the run failed; what was computed before is on disk, and the text says where."""

    exit_code = 3


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
    spec: Path | None = None
    check_step: bool = False
    isolate: tuple[str, ...] = ()


def load(name: str, values: Mapping[str, Any] | None = None) -> System:
    """A system of the bench at hand, with values set.  Raises BenchError and ValueProblem."""
    system = load_system(name, Bench.find().system_folder(name).parent.parent)
    for key, value in (values or {}).items():
        system.set(key, value)
    return system


def _limits(spec: Path | None) -> Specification | None:
    if spec is None:
        return None
    from gyrobench.report import load_specification

    return load_specification(spec)


def _progress() -> Callable[[Any], None]:
    """Prints rate and time left on one line, from the second second on."""
    last = [0.0]

    def show(status: Any) -> None:
        now = time.monotonic()
        if status.elapsed < 1.0 or now - last[0] < 0.5:
            return
        last[0] = now
        speed = f"{status.rate / 1e6:.2f} M steps/s"
        text = f"{100 * status.fraction:5.1f} %  t = {status.time:,.0f} s  {speed}  {status.eta:.0f} s left"
        end = "\r" if sys.stderr.isatty() else "\n"
        if sys.stderr.isatty() or int(status.elapsed) % 10 == 0:
            print(text.ljust(70), end=end, file=sys.stderr, flush=True)

    return show


# ---------------------------------------------------------------------------------------------- run
def run(job: Job, as_json: bool = False) -> str:
    """Record, reduction and report of one run; returns the verdict.

    Raises what Session.run raises, and WorkError when reduction or report fail after the run.
    """
    from gyrobench.system.run import Session
    from gyrobench.system.values import parse

    system = load(job.system, job.values)
    limits = _limits(job.spec)
    step = parse("--step", job.step, "s") if job.step else None
    system.refuse()
    bench = Bench.find()
    with Session(system, job.parts, job.maps, engine=job.engine, isolate=job.isolate, bench=bench.folder) as session:
        identity = repr((sorted(session.hashes.items()), sorted(job.values.items()), job.seed, step, session.engine))
        folder = job.out or bench.out / job.system / hashlib.sha256(identity.encode()).hexdigest()[:8]
        record = session.run({}, job.seed, step, folder, _progress())
        try:
            result = reduced(system, record, limits)
            if job.check_step:
                result.step_check = step_check(session, system, result, job.seed, step or system.step)
        except Exception as error:
            if not type(error).__module__.startswith(("gyrobench", "gyrobench_system")):
                raise
            raise WorkError(f"{error}\nthe record is kept in {folder}") from error
    return publish(result, folder, record, as_json, job.spec)


def reduced(system: System, record: Record, limits: Specification | None) -> Result:
    """The system's own reduction, with the run's circumstances attached."""
    from gyrobench.system.wiring import parse_wires

    result: Result = system.reduce(record, limits)
    wires = [f"{a}.{x} -> {b}.{y}" for a, x, b, y in parse_wires(system.wires)]
    result.provenance = {**record.meta, "wires": wires}
    return result


def step_check(session: Any, system: System, result: Result, seed: int, step: float) -> dict[str, Any]:
    """Change of each coefficient when the step is halved, noise off, against its standard uncertainty."""
    quiet = {name: 0.0 for name in getattr(system, "noises", ())}
    a, b = (system.reduce(session.run(quiet, seed, h, None, _progress()), None) for h in (step, step / 2.0))
    rows = []
    for c, x, y in zip(result.coefficients, a.coefficients, b.coefficients, strict=True):
        change = y.estimate - x.estimate
        rows.append({"name": c.name, "unit": c.unit, "change": change, "u": c.u, "ratio": abs(change) / c.u})
    return {"step": step, "rows": rows, "worst": max(r["ratio"] for r in rows)}


def publish(result: Result, folder: Path, record: Record, as_json: bool, spec: Path | None) -> str:
    """Writes the report, prints the answer, returns the verdict."""
    from gyrobench.report import check_units, write

    if spec is not None:
        check_units(spec, {c.name: c.unit for c in result.coefficients})
    paths = write(result, folder, record=record.channels or None)
    if as_json:
        print(paths["json"].read_text(encoding="utf-8"))
    else:
        print(answer(result))
        for path in paths.values():
            print(path)
    return result.verdict


def answer(result: Result) -> str:
    """The coefficient table and the warnings, as text."""
    from gyrobench.report.numbers import write_number

    head = ["coefficient", "estimate", "u", "95 % interval", "unit"]
    truth = any(c.truth is not None for c in result.coefficients)
    head += ["truth", "z"] if truth else []
    head += ["verdict"] if result.verdict != "no specification given" else []
    rows = [head]
    for c in result.coefficients:
        lo, hi = (write_number(x, c.u).text for x in c.interval)
        row = [c.name, write_number(c.estimate, c.u).text, write_number(c.u, c.u).text, f"{lo} … {hi}", c.unit]
        if truth:
            row += [write_number(c.truth, c.u).text, "–" if c.z is None else f"{c.z:+.2f}".replace("-", "−")]
        rows.append(row + ([c.verdict] if "verdict" in head else []))
    widths = [max(len(r[k]) for r in rows) for k in range(len(head))]
    left = {0, head.index("unit"), len(head) - 1 if "verdict" in head else 0}
    lines = [
        "  ".join(x.ljust(w) if k in left else x.rjust(w) for k, (x, w) in enumerate(zip(r, widths, strict=True)))
        for r in rows
    ]
    notes = [f"warning: {w}" for w in result.warnings]
    if result.step_check:
        worst = result.step_check["worst"]
        notes.append(f"step check: halving the step changes no coefficient by more than {worst:.2g} u")
    return "\n".join([result.title, "", *(x.rstrip() for x in lines), "", *notes, f"verdict: {result.verdict}"])


# ------------------------------------------------------------------------------- measured data, again
def template(name: str) -> str:
    """An empty CSV with the columns that ``gyrobench reduce`` reads, and what each means."""
    return str(_measuring(load(name)).template())


def _measuring(system: System) -> Any:
    from gyrobench.cli import UsageError

    if not hasattr(system, "measured"):
        raise UsageError(f"{system.name} has no reduction of measured data")
    return system


def reduce(
    name: str, data: Path, values: Mapping[str, str], spec: Path | None, out: Path | None, as_json: bool = False
) -> str:
    """A laboratory's CSV to a report; returns the verdict."""
    system = _measuring(load(name))
    limits = _limits(spec)
    record = system.measured(data, values)
    result: Result = system.reduce(record, limits)
    text = data.read_bytes()
    record.meta["data"] = {"file": data.name, "sha256": hashlib.sha256(text).hexdigest()}
    result.provenance = dict(record.meta)
    identity = hashlib.sha256(text + repr(sorted(values.items())).encode()).hexdigest()[:8]
    folder = out or Bench.find().out / name / f"measured-{identity}"
    record.save(folder)
    return publish(result, folder, record, as_json, spec)


def report(folder: Path, spec: Path | None) -> str:
    """Reduces a saved record again and writes its report."""
    record = Record.load(folder)
    system = load(str(record.meta["system"]))
    limits = _limits(spec)
    result = reduced(system, record, limits)
    old = folder / "result.json"
    if old.exists():  # the step check is a run of its own and is kept
        result.step_check = json.loads(old.read_text(encoding="utf-8")).get("step_check") or {}
    return publish(result, folder, record, False, spec)


def compare(runs: list[Path], out: Path | None) -> None:
    """Reports of several runs side by side; the first is the baseline."""
    from gyrobench import report as reports

    results = []
    for folder in runs:
        name = folder.name if [f.name for f in runs].count(folder.name) == 1 else str(folder)
        results.append((name, reports.load((folder / "result.json").read_text(encoding="utf-8"))))
    digest = hashlib.sha256("".join(str(f.resolve()) for f in runs).encode()).hexdigest()[:8]
    target = out or Bench.find().out / "comparison" / digest
    for path in reports.compare(results, target).values():
        print(path)


# -------------------------------------------------------------------------------------- show, export
def _assembly(system: System, parts: Mapping[str, str], maps: Mapping[str, Path]) -> Any:
    from gyrobench.system.parts import resolve_parts
    from gyrobench.system.wiring import assemble

    notes: list[str] = []
    paths, _ = resolve_parts(system, parts, "native", Bench.find().folder, notes)
    return assemble(system, paths, maps)


def show(name: str, values: Mapping[str, str], picture: Path | None, as_json: bool) -> None:
    """Slots, wires, order, cuts, delays and plan of a system."""
    from gyrobench.system.describe import describe

    found = describe(_assembly(load(name, values), {}, {}))
    if picture is not None:
        from gyrobench.report.drawing import system

        picture.write_text(system(found["order"], found, "system"), encoding="utf-8")
        print(picture)
        return
    if as_json:
        print(json.dumps(found, indent=1, ensure_ascii=False))
        return
    print(f"{found['title']}  [{', '.join(found['spec'])}]\n")
    print("slot (execution order)")
    for slot in found["order"]:
        s = found["slots"][slot]
        print(f"  {slot:<12} {s['socket']:<12} {s['model']} {s['version']}  {s['fmu']}")
    print("wires")
    for w in found["wires"]:
        marks = ["(one step delay)"] * w["cut"] + ["(not offered)"] * (not w["connected"])
        print("  ".join(["", w["wire"], *marks]))
    print("cuts")
    for c in found["cuts"]:
        print(f"  {c}")
    print(f"plan  ({found['duration']:,.0f} s without the ways, step {found['step']:g} s)")
    for p in found["plan"]:
        turning = p["mode"] == "rate"
        size = f"{p['travel']:.6g} rad at {p['target']:.6g} rad/s" if turning else f"{p['dwell']:g} s"
        window = f"window {p['window']:.6g} {'rad' if turning else 's'}"
        print(f"  {p['phase']:>2} {p['label']:<28} {p['mode']:<6} {size}, settle {p['settle']:g} s, {window}")
    print("options")
    for key, o in found["options"].items():
        print(f"  {key:<16} {o['value']!s:<22} {o['unit']:<6} {o['doc']}")


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
    from gyrobench.system import ssp

    system = load(name, values)
    system.refuse()
    suffix = ".ssp" if to == "ssp" else ".fmu"
    path = out or Bench.find().fmus / f"{name}{suffix}"
    path.parent.mkdir(parents=True, exist_ok=True)
    assembly = _assembly(system, parts, maps)
    if to == "ssp":
        return Path(ssp.export_ssp(assembly, path, seed))
    return Path(ssp.export_container(assembly, path, seed))
