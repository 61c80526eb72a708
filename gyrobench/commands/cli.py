"""The commands.  What takes time to import is imported where it is used."""

from __future__ import annotations

import json
import os
import sys
import traceback
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from gyrobench.bench import Bench, UsageError, short
from gyrobench.commands.user_errors import exit_code, user_message

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
)

System = Annotated[str, typer.Argument(metavar="SYSTEM", help="Name of a system, see gyrobench list.")]
Json = Annotated[bool, typer.Option("--json", help="JSON on standard output, and nothing else there.")]
Set = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="NAME=VALUE",
        help="Option of the system, or slot.parameter of a part; with unit (2deg/s) or in SI.  Repeatable.",
    ),
]
Part = Annotated[
    list[str] | None, typer.Option("--part", metavar="SLOT=FMU|PART", help="Another part, or an FMU file, in a slot.")
]
Map = Annotated[
    list[str] | None, typer.Option("--map", metavar="SLOT=FILE", help="Names and units of a foreign FMU (.toml).")
]
Seed = Annotated[int, typer.Option(metavar="N", help="Seed of all noise.", min=0)]
Spec = Annotated[str | None, typer.Option("--spec", metavar="NAME|FILE", help="Acceptance specification to judge by.")]
Strict = Annotated[bool, typer.Option("--strict", help="Exit code 1 when the verdict is fail.")]
Data = Annotated[
    list[Path] | None, typer.Option(metavar="FILE.csv|RUN", help="Measured record; of a suite its runs.  Repeatable.")
]
Force = Annotated[bool, typer.Option("--force", help="Replace another run in --out.")]
Resume = Annotated[bool, typer.Option("--resume", help="Continue this run where it was interrupted.")]
Out = Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Folder to write to.")]


class Engine(StrEnum):
    native = "native"
    reference = "reference"


class Target(StrEnum):
    native = "native"
    python = "python"


class Form(StrEnum):
    ssp = "ssp"
    container = "container"


say = typer.echo


def pairs(values: list[str] | None, option: str, example: str) -> dict[str, str]:
    """``["a.b=1"]`` -> ``{"a.b": "1"}``.  Raises UsageError for an entry without ``=`` and for a name given twice."""
    found: dict[str, str] = {}
    for v in values or []:
        name, sign, value = (x.strip() for x in v.partition("="))
        if not (sign and name and value):
            raise UsageError(f"{option} {v}: write NAME=VALUE, for example {option} {example}")
        if name in found:
            raise UsageError(f"{option} {name}: given twice, {found[name]} and {value}")
        found[name] = value
    return found


def settings(values: list[str] | None) -> dict[str, str]:
    return pairs(values, "--set", "latitude=45.75deg")


def swaps(part: list[str] | None, mapping: list[str] | None) -> tuple[dict[str, str], dict[str, Path]]:
    """Parts and mapping files by slot.  Raises UsageError for a mapping file that is not there."""
    parts = pairs(part, "--part", "gyro=vendor.fmu")
    maps = {k: Path(v) for k, v in pairs(mapping, "--map", "gyro=vendor.toml").items()}
    for slot, file in maps.items():
        if not file.is_file():
            raise UsageError(f"--map {slot}={file}: no such file")
    return parts, maps


def judge(verdict: str, strict: bool) -> None:
    if strict and verdict == "fail":
        raise typer.Exit(1)


def version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import PackageNotFoundError
        from importlib.metadata import version as installed

        try:
            say(f"gyrobench {installed('gyrobench')}")
        except PackageNotFoundError:
            say("gyrobench, not installed")
        raise typer.Exit


@app.callback()
def root(
    show_version: Annotated[bool, typer.Option("--version", callback=version, is_eager=True, help="Version.")] = False,
) -> None:
    """FMI co-simulation bench for inertial instruments: test methods as systems of FMUs, ending in a report.

    \b
    Start here:
      gyrobench list
      gyrobench show tumble_single_axis
      gyrobench run tumble_single_axis
      gyrobench COMMAND --help

    Exit codes: 0 done, 1 a verdict or a validation fails, 2 invalid request, configuration or data,
    3 a run, its reduction or its report failed, 130 interrupted.
    """


@app.command("list")
def list_command(as_json: Json = False) -> None:
    """Parts, systems, sockets, specifications.

    \b
    Example: gyrobench list
    """
    from gyrobench.commands.catalog import listing

    found = listing(Bench.find())
    if as_json:
        say(json.dumps(found, indent=2, ensure_ascii=False))
        return
    width = max((len(r["name"]) for rows in found.values() for r in rows), default=0)
    for title, rows in found.items():
        if rows:
            say(title)
        for r in rows:
            say(f"  {r['name']:<{width}}  {r['what']}" + (f"  [{', '.join(r['spec'])}]" if r.get("spec") else ""))


@app.command()
def show(
    system: System,
    values: Set = None,
    part: Part = None,
    mapping: Map = None,
    picture: Annotated[Path | None, typer.Option(metavar="FILE.svg", help="Draw the wiring.")] = None,
    as_json: Json = False,
) -> None:
    """Wiring, plan and options of a system.

    Slots, wires, execution order, cuts and delays, plan, options; nothing runs.

    \b
    Example: gyrobench show tumble_single_axis --picture wiring.svg
    """
    from gyrobench.commands import show_system

    show_system.show(system, settings(values), *swaps(part, mapping), picture, as_json)


@app.command()
def build(
    parts: Annotated[list[str] | None, typer.Argument(metavar="PART", help="Names of parts.")] = None,
    every: Annotated[bool, typer.Option("--all", help="Every part of the bench.")] = False,
    target: Annotated[
        Target, typer.Option(help="native: C, needs nothing where it runs; python: needs Python and numpy there.")
    ] = Target.native,
    fmi: Annotated[int, typer.Option(metavar="2|3", help="FMI version.", min=2, max=3)] = 2,
    platform: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="linux64, win64, darwin64, aarch64-linux, aarch64-darwin.  Repeatable."),
    ] = None,
    out: Out = None,
) -> None:
    """Builds parts into FMUs.

    \b
    Example: gyrobench build floated_gyro --target python
    """
    from gyrobench import packaging
    from gyrobench.packaging.compiler import PLATFORMS

    bench = Bench.find()
    names = list(dict.fromkeys([*(parts or []), *(bench.parts() if every else ())]))
    if not names:
        raise UsageError(f"name a part, or say --all; parts: {', '.join(bench.parts())}")
    for name in names:
        bench.part_folder(name)
    wrong = [p for p in platform or [] if p not in PLATFORMS]
    if wrong:
        raise UsageError(f"--platform {wrong[0]}: one of {', '.join(PLATFORMS)}")
    for name in names:
        path = packaging.build(name, target.value, fmi, out or bench.products, bench.folder, tuple(platform or ()))
        say(short(path))


@app.command()
def run(
    system: System,
    values: Set = None,
    part: Part = None,
    mapping: Map = None,
    seed: Seed = 1,
    engine: Annotated[Engine | None, typer.Option(help="Default: native where there is a C compiler.")] = None,
    step: Annotated[str | None, typer.Option(metavar="TIME", help="Communication step, for example 1ms.")] = None,
    check_step: Annotated[
        bool, typer.Option("--check-step", help="Halve the step once, noise off, and report the change.")
    ] = False,
    isolate: Annotated[
        list[str] | None,
        typer.Option("--isolate", metavar="SLOT", help="Run this slot in a process of its own.  Repeatable."),
    ] = None,
    spec: Spec = None,
    strict: Strict = False,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Folder of the run; default reports/out/SYSTEM/ID.")
    ] = None,
    force: Force = False,
    resume: Resume = False,
    as_json: Json = False,
) -> None:
    """Runs a system: record, reduction, report.

    \b
    Examples:
      gyrobench run tumble_single_axis --set latitude=45.75deg --set gyro.D_I=0.9deg/h/g --seed 7
      gyrobench run tumble_single_axis --part gyro=vendor.fmu --map gyro=vendor.toml --isolate gyro
      gyrobench run tumble_single_axis --spec floated_gyro --strict
      gyrobench run drift_test_suite --set tests="tumble_single_axis servo_polar" --set gyro.D_I=0.9deg/h/g
    """
    from gyrobench.commands import run_system

    parts, maps = swaps(part, mapping)
    job = run_system.Job(
        system=system,
        parts=parts,
        maps=maps,
        values=settings(values),
        seed=seed,
        engine=engine.value if engine else None,
        step=step,
        out=out,
        force=force,
        spec=spec,
        check_step=check_step,
        isolate=tuple(isolate or ()),
        resume=resume,
    )
    judge(run_system.run(job, as_json), strict)


@app.command()
def reduce(
    system: System,
    data: Data = None,
    values: Set = None,
    template: Annotated[
        bool, typer.Option("--template", help="Print an empty record: columns, units and what to state.")
    ] = False,
    spec: Spec = None,
    strict: Strict = False,
    out: Out = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Reduces measured data to the same report.

    \b
    Examples:
      gyrobench reduce tumble_single_axis --template > record.csv
      gyrobench reduce tumble_single_axis --data record.csv --set latitude=45.75deg
      gyrobench reduce drift_test_suite --data RUN1 --data RUN2 --set operator=...
    """
    from gyrobench.commands import reduce_data

    if template:
        say(reduce_data.template(system).rstrip("\n"))
        return
    if not data:
        raise UsageError(f"name the record: gyrobench reduce {system} --data FILE.csv (--template prints its form)")
    judge(reduce_data.reduce(system, data, settings(values), spec, out, force, as_json), strict)


@app.command()
def report(
    folder: Annotated[Path, typer.Argument(metavar="RUN", help="Folder of a run.")],
    spec: Spec = None,
    strict: Strict = False,
    as_json: Json = False,
) -> None:
    """Reduces the record of a run again and writes its report.

    \b
    Example: gyrobench report reports/out/tumble_single_axis/1a2b3c4d --spec floated_gyro
    """
    from gyrobench.commands import reduce_data

    judge(reduce_data.report(folder, spec, as_json), strict)


@app.command()
def compare(
    runs: Annotated[list[Path], typer.Argument(metavar="RUN RUN...", help="Folders; the first is the baseline.")],
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Lays the reports of several runs side by side.

    \b
    Example: gyrobench compare reports/out/tumble_single_axis/1a2b3c4d vendor --out comparison
    """
    from gyrobench.commands import run_system

    run_system.compare(runs, out, as_json)


@app.command()
def export(
    system: System,
    to: Annotated[Form, typer.Option("--to", help="ssp: FMUs and wiring in one archive; container: one FMU.")],
    values: Set = None,
    part: Part = None,
    mapping: Map = None,
    seed: Seed = 1,
    out: Annotated[Path | None, typer.Option("--out", metavar="FILE", help="File to write.")] = None,
) -> None:
    """Writes a system for other tools.

    The plan of the test and all values are in it.

    \b
    Example: gyrobench export tumble_single_axis --to ssp --set windows=36
    """
    from gyrobench.commands import run_system

    say(short(run_system.export(system, to.value, settings(values), *swaps(part, mapping), seed, out)))


@app.command()
def validate(file: Annotated[str, typer.Argument(metavar="FILE|PART", help="An FMU, or the name of a part.")]) -> None:
    """Checks an FMU: standard, units, reference run.

    \b
    Example: gyrobench validate fmus/site.fmu
    """
    from gyrobench.packaging.validate import validate as check

    problems = check(file, Bench.find().folder)
    for p in problems:
        say(p)
    if problems:
        raise typer.Exit(1)
    say(f"{file}: no problems found")


@app.command()
def init(
    name: Annotated[Path, typer.Argument(metavar="NAME", help="Folder to make.")],
    copy: Annotated[
        list[str] | None,
        typer.Option("--copy", metavar="PART|SYSTEM", help="Copy this part or system to change it.  Repeatable."),
    ] = None,
) -> None:
    """Makes a bench; what it lacks the standard one has.

    \b
    Example: gyrobench init mybench --copy floated_gyro
    """
    from gyrobench.commands.catalog import init_bench

    for line in init_bench(name, list(copy or [])):
        say(line)


def main() -> None:
    """Run a command; an error ends in one message and an exit code, and with GYROBENCH_TRACEBACK=1 in a traceback."""
    try:
        app(standalone_mode=True)
    except KeyboardInterrupt:
        print("gyrobench: interrupted", file=sys.stderr)
        sys.exit(130)
    except Exception as error:
        code = exit_code(error)
        if code is None:
            raise
        if os.environ.get("GYROBENCH_TRACEBACK"):
            traceback.print_exception(error)
        print(f"gyrobench: {user_message(error)}", file=sys.stderr)
        sys.exit(code)


if __name__ == "__main__":
    main()
