"""The command line: options and arguments of each command.  Slow imports are made where they are used."""

from __future__ import annotations

import json
import os
import signal
import sys
import traceback
from pathlib import Path
from typing import Annotated

import typer

from gyrobench.bench import Bench, UsageError, display_path
from gyrobench.commands.completion import complete_copy, complete_part
from gyrobench.commands.options import (
    Data,
    Engine,
    Force,
    Form,
    Json,
    Map,
    NoReport,
    Out,
    Part,
    Resume,
    Seed,
    Set,
    Spec,
    Strict,
    System,
    Table,
    Target,
)
from gyrobench.workflow.user_errors import exit_code, user_message

app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
)

echo = typer.echo


def exit_on_fail(verdict: str, strict: bool) -> None:
    """End the command with exit code 1 where a verdict is void, fail or inconclusive and --strict is set."""
    if strict and verdict in ("void", "fail", "inconclusive"):
        raise typer.Exit(1)


def print_version(wanted: bool) -> None:
    """Print the version and end the command."""
    if wanted:
        from importlib.metadata import PackageNotFoundError, version

        try:
            echo(f"gyrobench {version('gyrobench')}")
        except PackageNotFoundError:
            echo("gyrobench, not installed")
        raise typer.Exit


@app.callback()
def root(
    show_version: Annotated[
        bool, typer.Option("--version", callback=print_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """FMI co-simulation bench for inertial instruments: test methods as systems of FMUs, ending in a report.

    \b
    Start here:
      gyrobench list
      gyrobench show tumble_single_axis
      gyrobench run tumble_single_axis
      gyrobench COMMAND --help

    Exit codes: 0 done, 1 a validation fails or, with --strict, a verdict is void, fail or
    inconclusive, 2 invalid request, configuration or data, 3 a run, its reduction or its report failed,
    130 interrupted.
    """


@app.command("list")
def list_command(as_json: Json = False) -> None:
    """List parts, systems, sockets and acceptance specifications.

    \b
    Example: gyrobench list
    """
    from gyrobench.commands.catalog import list_contents

    contents = list_contents(Bench.find())
    if as_json:
        echo(json.dumps(contents, indent=2, ensure_ascii=False))
        return
    width = max((len(r["name"]) for rows in contents.values() for r in rows), default=0)
    for title, rows in contents.items():
        if rows:
            echo(title)
        for r in rows:
            echo(f"  {r['name']:<{width}}  {r['what']}" + (f"  [{', '.join(r['spec'])}]" if r.get("spec") else ""))


@app.command()
def show(
    system: System,
    values: Set = None,
    part: Part = None,
    mapping: Map = None,
    picture: Annotated[Path | None, typer.Option(metavar="FILE.svg", help="Draw the wiring.")] = None,
    as_json: Json = False,
) -> None:
    """Show wiring, plan and options of a system.

    Print slots, wires, execution order, cut loops and their delays, plan, options; nothing is run.

    \b
    Example: gyrobench show tumble_single_axis --picture wiring.svg
    """
    from gyrobench.commands.arguments import load_with_values, parse_settings, parse_swaps
    from gyrobench.commands.show_system import show_suite, show_system
    from gyrobench.system.suite import Suite

    test = load_with_values(system, parse_settings(values))
    if isinstance(test, Suite):
        show_suite(test, picture, as_json)
    else:
        show_system(test, *parse_swaps(part, mapping), picture, as_json)


@app.command()
def build(
    parts: Annotated[
        list[str] | None, typer.Argument(metavar="PART", help="Parts to build.", autocompletion=complete_part)
    ] = None,
    every: Annotated[bool, typer.Option("--all", help="Build every part of the bench.")] = False,
    target: Annotated[
        Target,
        typer.Option(help="native: compiled C, self-contained; python: needs Python and numpy on the target machine."),
    ] = Target.native,
    fmi: Annotated[int, typer.Option(metavar="2|3", help="FMI version.", min=2, max=3)] = 2,
    platform: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="linux64, win64, darwin64, aarch64-linux, aarch64-darwin.  Repeatable."),
    ] = None,
    out: Out = None,
) -> None:
    """Build parts into FMUs.

    \b
    Example: gyrobench build floated_gyro --target python
    """
    from gyrobench import packaging
    from gyrobench.packaging.compiler import PLATFORMS

    bench = Bench.find()
    names = list(dict.fromkeys([*(parts or []), *(bench.parts() if every else ())]))
    if not names:
        raise UsageError(f"no part named; name one or more, or set --all; parts: {', '.join(bench.parts())}")
    for name in names:
        bench.part_folder(name)
    unknown = [p for p in platform or [] if p not in PLATFORMS]
    if unknown:
        raise UsageError(f"--platform {unknown[0]}: unknown platform; available: {', '.join(PLATFORMS)}")
    for name in names:
        path = packaging.build(name, target.value, fmi, out or bench.products, bench.folder, tuple(platform or ()))
        echo(display_path(path))


@app.command()
def run(
    system: System,
    values: Set = None,
    part: Part = None,
    mapping: Map = None,
    seed: Seed = 1,
    engine: Annotated[Engine | None, typer.Option(help="Default: native where a C compiler is available.")] = None,
    step: Annotated[str | None, typer.Option(metavar="TIME", help="Communication step, for example 1ms.")] = None,
    check_step: Annotated[
        bool | None,
        typer.Option(
            "--check-step/--no-check-step",
            help="Repeat the run with its step and half of it, noise off, and take the effect of the step into u. "
            "Default: two short runs for a system with loops, else none.",
        ),
    ] = None,
    isolate: Annotated[
        list[str] | None,
        typer.Option(
            "--isolate", metavar="SLOT", help="Run the FMU of this slot in a process of its own.  Repeatable."
        ),
    ] = None,
    spec: Spec = None,
    strict: Strict = False,
    no_report: NoReport = False,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Folder of the run; default reports/out/SYSTEM/ID.")
    ] = None,
    force: Force = False,
    resume: Resume = False,
    as_json: Json = False,
) -> None:
    """Run a system: record, reduction, report.

    \b
    Examples:
      gyrobench run tumble_single_axis --set latitude=45.75deg --set gyro.D_I=0.9deg/h/g --seed 7
      gyrobench run tumble_single_axis --part gyro=vendor.fmu --map gyro=vendor.toml --isolate gyro
      gyrobench run tumble_single_axis --spec floated_gyro --strict
      gyrobench run drift_test_suite --set tests="tumble_single_axis servo_polar" --set gyro.D_I=0.9deg/h/g
    """
    from gyrobench.commands import print_runs
    from gyrobench.commands.arguments import load_with_values, parse_settings, parse_step, parse_swaps
    from gyrobench.report import FORMATS
    from gyrobench.workflow.run_execution import RunRequest

    parts, maps = parse_swaps(part, mapping)
    request = RunRequest(
        parts=parts,
        maps=maps,
        seed=seed,
        engine=engine.value if engine else None,
        step=parse_step(step),
        out=out,
        force=force,
        spec=spec,
        check_step=check_step,
        isolate=tuple(isolate or ()),
        resume=resume,
        formats=("json",) if no_report else FORMATS,
    )
    test = load_with_values(system, parse_settings(values), request.step)
    exit_on_fail(print_runs.run(request, test, as_json), strict)


@app.command()
def reduce(
    system: System,
    data: Data = None,
    values: Set = None,
    template: Annotated[
        bool, typer.Option("--template", help="Print an empty record: its columns, their units, the values to state.")
    ] = False,
    spec: Spec = None,
    strict: Strict = False,
    no_report: NoReport = False,
    fit_to: Annotated[
        str | None,
        typer.Option(
            "--fit-to",
            metavar="PART",
            help="drift_record: write the noise of the record as values of a gyro of the bench (floated_gyro), a file "
            "for --set @FILE.",
        ),
    ] = None,
    out: Out = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Reduce measured data and write the same report.

    \b
    Examples:
      gyrobench reduce tumble_single_axis --template > record.csv
      gyrobench reduce tumble_single_axis --data record.csv --set latitude=45.75deg
      gyrobench reduce drift_test_suite --data RUN1 --data RUN2 --set operator=...
    """
    from gyrobench.commands import print_runs
    from gyrobench.commands.arguments import parse_settings
    from gyrobench.report import FORMATS
    from gyrobench.workflow.inputs import load_test

    test = load_test(system)
    if template:
        from gyrobench.workflow.measured_run import empty_record

        echo(empty_record(test).rstrip("\n"))
        return
    formats = ("json",) if no_report else FORMATS
    verdict = print_runs.reduce(test, data or [], parse_settings(values), spec, out, force, as_json, formats, fit_to)
    exit_on_fail(verdict, strict)


@app.command()
def report(
    folder: Annotated[Path, typer.Argument(metavar="RUN", help="Folder of a run.")],
    spec: Spec = None,
    strict: Strict = False,
    as_json: Json = False,
) -> None:
    """Reduce the record of a run again and rewrite its report.

    \b
    Example: gyrobench report reports/out/tumble_single_axis/1a2b3c4d --spec floated_gyro
    """
    from gyrobench.commands import print_runs
    from gyrobench.workflow.inputs import load_saved_test

    exit_on_fail(print_runs.report(folder, load_saved_test(folder), spec, as_json), strict)


@app.command()
def compare(
    runs: Annotated[list[Path], typer.Argument(metavar="RUN RUN...", help="Folders; the first is the baseline.")],
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Compare the results of several runs side by side.

    \b
    Example: gyrobench compare reports/out/tumble_single_axis/1a2b3c4d vendor --out comparison
    """
    from gyrobench.commands import print_runs

    print_runs.compare(runs, out, as_json)


@app.command()
def record(
    folder: Annotated[Path, typer.Argument(metavar="RUN", help="Folder of a run.")],
    to: Annotated[Table, typer.Option("--to", help="csv: windows.csv and channels.csv, SI, units in the header.")],
    out: Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Folder; default csv/ in the run.")] = None,
) -> None:
    """Write the record of a run as tables for other programs.

    A row of windows.csv is a completed window (its columns: docs/systems.md), one of channels.csv a time; names are
    those of the record, "gyro.u [V]" with the SI unit where it is not 1.  Numbers read back bit for bit.

    \b
    Example: gyrobench record reports/out/tumble_single_axis/1a2b3c4d --to csv --out tables
    """
    from gyrobench.record.record import Record
    from gyrobench.workflow.inputs import require_run

    assert to is Table.csv
    for file in Record.load(require_run(folder)).to_csv(out or folder / "csv"):
        echo(display_path(file))


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
    """Export a system for other tools.

    The file contains the plan of the test and all parameter values.

    \b
    Example: gyrobench export tumble_single_axis --to ssp --set windows=36
    """
    from gyrobench.commands import export_system
    from gyrobench.commands.arguments import parse_settings, parse_swaps

    path = export_system.export(system, to.value, parse_settings(values), *parse_swaps(part, mapping), seed, out)
    echo(display_path(path))


@app.command()
def validate(file: Annotated[str, typer.Argument(metavar="FILE|PART", help="An FMU, or the name of a part.")]) -> None:
    """Validate an FMU: FMI standard, units, reference run.

    \b
    Example: gyrobench validate fmus/site.fmu
    """
    from gyrobench.packaging.validate import validate as check

    problems = check(file, Bench.find().folder)
    for p in problems:
        echo(p)
    if problems:
        raise typer.Exit(1)
    echo(f"{file}: no problems found")


@app.command()
def init(
    name: Annotated[Path, typer.Argument(metavar="NAME", help="Folder to create.")],
    copy: Annotated[
        list[str] | None,
        typer.Option(
            "--copy",
            metavar="PART|SYSTEM",
            help="Copy this part or system into the new bench.  Repeatable.",
            autocompletion=complete_copy,
        ),
    ] = None,
) -> None:
    """Create a bench.

    Parts, systems, specifications and templates that it does not define come from the standard bench.

    \b
    Example: gyrobench init mybench --copy floated_gyro
    """
    from gyrobench.commands.catalog import init_bench

    for line in init_bench(name, list(copy or [])):
        echo(line)


def main() -> None:
    """Run a command; an error ends in one message and an exit code, with a traceback if GYROBENCH_TRACEBACK=1."""
    for name in ("SIGTERM", "SIGHUP"):  # as Ctrl-C: files that are being written are finished or removed
        if hasattr(signal, name) and signal.getsignal(getattr(signal, name)) is signal.SIG_DFL:
            signal.signal(getattr(signal, name), signal.default_int_handler)
    try:
        app(prog_name="gyrobench", standalone_mode=True)
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
