"""The commands.  What takes time to import is imported where it is used."""

from __future__ import annotations

import json
import sys
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from gyrobench.bench import Bench

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="FMI co-simulation bench for inertial instruments: test methods as systems of FMUs, ending in a report.",
)

Json = Annotated[bool, typer.Option("--json", help="Machine-readable output.")]
Set = Annotated[
    list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="Option or slot.parameter; may carry a unit.")
]
Out = Annotated[Path | None, typer.Option("--out", help="Folder to write to.")]


class Engine(StrEnum):
    native = "native"
    reference = "reference"


class Target(StrEnum):
    native = "native"
    python = "python"


class Form(StrEnum):
    ssp = "ssp"
    container = "container"


class UsageError(Exception):
    """The command line asks for something that does not exist or does not fit."""


def say(text: str = "") -> None:
    typer.echo(text)


def pairs(values: list[str] | None, option: str) -> dict[str, str]:
    """``["a.b=1"]`` -> ``{"a.b": "1"}``.  Raises UsageError for an entry without ``=``."""
    found = {}
    for v in values or []:
        name, sign, value = v.partition("=")
        if not sign or not name.strip() or not value.strip():
            raise UsageError(f"{option} {v}: write NAME=VALUE, for example {option} latitude=45.75deg")
        found[name.strip()] = value.strip()
    return found


@app.command("list")
def list_command(as_json: Json = False) -> None:
    """Parts, systems and sockets, with what they are.  Example: gyrobench list --json"""
    from gyrobench.listing import listing

    found = listing(Bench.find())
    if as_json:
        say(json.dumps(found, indent=2, ensure_ascii=False))
        return
    for title, rows in found.items():
        if not rows:
            continue
        say(title)
        width = max(len(r["name"]) for r in rows)
        for r in rows:
            say(f"  {r['name']:<{width}}  {r['what']}" + (f"  [{', '.join(r['spec'])}]" if r.get("spec") else ""))


@app.command()
def show(
    system: Annotated[str, typer.Argument(help="Name of a system.")],
    values: Set = None,
    picture: Annotated[Path | None, typer.Option(help="Write the wiring as a picture (.svg).")] = None,
    as_json: Json = False,
) -> None:
    """Slots, wiring, execution order, cuts and delays, plan.  Example: gyrobench show tumble_single_axis"""
    from gyrobench import work

    work.show(system, pairs(values, "--set"), picture, as_json)


@app.command()
def build(
    parts: Annotated[list[str] | None, typer.Argument(help="Names of parts.")] = None,
    every: Annotated[bool, typer.Option("--all", help="Every part of the bench.")] = False,
    target: Annotated[
        Target, typer.Option(help="native: C, no needs; python: runs where Python runs.")
    ] = Target.native,
    fmi: Annotated[int, typer.Option(help="2 or 3.", min=2, max=3)] = 2,
    platform: Annotated[
        list[str] | None, typer.Option(help="linux64, win64, darwin64, aarch64-linux, aarch64-darwin.")
    ] = None,
    out: Out = None,
) -> None:
    """Parts to FMUs.  Example: gyrobench build floated_gyro --target python"""
    from gyrobench import packaging
    from gyrobench.packaging.compiler import PLATFORMS

    bench = Bench.find()
    names = list(bench.parts()) if every else list(parts or [])
    if not names:
        raise UsageError(f"name a part, or --all; parts: {', '.join(bench.parts())}")
    wrong = [p for p in platform or [] if p not in PLATFORMS]
    if wrong:
        raise UsageError(f"--platform {wrong[0]}: one of {', '.join(PLATFORMS)}")
    for name in names:
        say(str(packaging.build(name, target.value, fmi, out, bench.folder, tuple(platform or ()))))


@app.command()
def run(
    system: Annotated[str, typer.Argument(help="Name of a system.")],
    part: Annotated[
        list[str] | None, typer.Option("--part", metavar="SLOT=FMU|PART", help="Another part in a slot.")
    ] = None,
    mapping: Annotated[
        list[str] | None, typer.Option("--map", metavar="SLOT=FILE", help="Mapping file of a foreign FMU.")
    ] = None,
    values: Set = None,
    seed: Annotated[int, typer.Option(help="Seed of all noise.", min=0)] = 1,
    engine: Annotated[Engine | None, typer.Option(help="Default: native where a C compiler is.")] = None,
    step: Annotated[str | None, typer.Option(help="Communication step, for example 1ms.")] = None,
    out: Out = None,
    spec: Annotated[Path | None, typer.Option(help="Acceptance specification (.toml).")] = None,
    check_step: Annotated[
        bool, typer.Option("--check-step", help="Halve the step once and report the change.")
    ] = False,
    isolate: Annotated[
        list[str] | None, typer.Option("--isolate", metavar="SLOT", help="Run this slot in a process of its own.")
    ] = None,
    strict: Annotated[bool, typer.Option("--strict", help="Exit code 1 when the verdict is fail.")] = False,
    as_json: Json = False,
) -> None:
    """Runs a system: record, reduction, report.

    Example: gyrobench run tumble_single_axis --set latitude=45.75deg --set gyro.D_I=0.9deg/h/g --seed 7
    """
    from gyrobench import work

    job = work.Job(
        system=system,
        parts=pairs(part, "--part"),
        maps={k: Path(v) for k, v in pairs(mapping, "--map").items()},
        values=pairs(values, "--set"),
        seed=seed,
        engine=engine.value if engine else None,
        step=step,
        out=out,
        spec=spec,
        check_step=check_step,
        isolate=tuple(isolate or ()),
    )
    verdict = work.run(job, as_json)
    if strict and verdict == "fail":
        raise typer.Exit(1)


@app.command()
def reduce(
    system: Annotated[str, typer.Argument(help="Name of a system.")],
    data: Annotated[Path | None, typer.Option(help="Measured record (.csv).")] = None,
    values: Set = None,
    template: Annotated[
        bool, typer.Option("--template", help="Print an empty table with the columns that are needed.")
    ] = False,
    spec: Annotated[Path | None, typer.Option(help="Acceptance specification (.toml).")] = None,
    out: Out = None,
    strict: Annotated[bool, typer.Option("--strict", help="Exit code 1 when the verdict is fail.")] = False,
    as_json: Json = False,
) -> None:
    """Measured data, same mathematics, same report.

    Example: gyrobench reduce tumble_single_axis --data record.csv --set latitude=45.75deg
    """
    from gyrobench import work

    if template:
        say(work.template(system))
        return
    if data is None:
        raise UsageError("name the record: --data FILE.csv (or --template for its columns)")
    verdict = work.reduce(system, data, pairs(values, "--set"), spec, out, as_json)
    if strict and verdict == "fail":
        raise typer.Exit(1)


@app.command()
def report(
    run_folder: Annotated[Path, typer.Argument(metavar="RUN", help="Folder of a run.")],
    spec: Annotated[Path | None, typer.Option(help="Acceptance specification (.toml).")] = None,
) -> None:
    """Reduces the record of a run again and writes its report.

    Example: gyrobench report reports/out/tumble_single_axis/1a2b3c4d
    """
    from gyrobench import work

    work.report(run_folder, spec)


@app.command()
def compare(
    runs: Annotated[
        list[Path], typer.Argument(metavar="RUN RUN...", help="Folders of runs; the first is the baseline.")
    ],
    out: Out = None,
) -> None:
    """Reports side by side.  Example: gyrobench compare RUN1 RUN2 --out comparison"""
    from gyrobench import work

    work.compare(runs, out)


@app.command()
def export(
    system: Annotated[str, typer.Argument(help="Name of a system.")],
    to: Annotated[
        Form, typer.Option("--to", help="ssp: one archive of FMUs and wiring; container: one FMU.")
    ] = Form.ssp,
    values: Set = None,
    part: Annotated[
        list[str] | None, typer.Option("--part", metavar="SLOT=FMU|PART", help="Another part in a slot.")
    ] = None,
    mapping: Annotated[
        list[str] | None, typer.Option("--map", metavar="SLOT=FILE", help="Mapping file of a foreign FMU.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of all noise.", min=0)] = 1,
    out: Annotated[Path | None, typer.Option("--out", help="File to write.")] = None,
) -> None:
    """A system for other tools.  Example: gyrobench export tumble_single_axis --to ssp"""
    from gyrobench import work

    say(
        str(
            work.export(
                system,
                to.value,
                pairs(values, "--set"),
                pairs(part, "--part"),
                {k: Path(v) for k, v in pairs(mapping, "--map").items()},
                seed,
                out,
            )
        )
    )


@app.command()
def validate(file: Annotated[str, typer.Argument(help="An FMU, or the name of a part.")]) -> None:
    """Checks an FMU against FMI, its units, and its reference run.  Example: gyrobench validate fmus/site.fmu"""
    from gyrobench.packaging.validate import validate as check

    problems = check(file)
    for p in problems:
        say(p)
    if problems:
        raise typer.Exit(1)
    say(f"{file}: no problems found")


@app.command()
def init(
    name: Annotated[Path, typer.Argument(help="Folder to make.")],
    copy: Annotated[
        list[str] | None, typer.Option("--copy", metavar="PART", help="Copy this part to change it.")
    ] = None,
) -> None:
    """A bench of one's own.  Example: gyrobench init mybench --copy floated_gyro"""
    from gyrobench.listing import init_bench

    for line in init_bench(name, list(copy or [])):
        say(line)


def main() -> None:
    """Runs a command; what the user did wrong ends in one message and exit code 2, a failed run in 3."""
    try:
        app(standalone_mode=True)
    except KeyboardInterrupt:
        sys.exit(130)
    except Exception as e:
        if not type(e).__module__.startswith(("gyrobench", "_gyrobench")) and not isinstance(e, OSError):
            raise
        print(f"gyrobench: {e}", file=sys.stderr)
        sys.exit(getattr(e, "exit_code", 2))


if __name__ == "__main__":
    main()
