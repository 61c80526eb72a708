"""The commands export, fit, validate, init: other tools, other FMUs, other benches."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated

import typer

from gyrobench.bench import Bench, UsageError, display_path
from gyrobench.commands.app import app, echo
from gyrobench.commands.completion import complete_copy, complete_system
from gyrobench.commands.options import Form, Map, Part, Seed, Set, System


@app.command()
def export(
    system: System,
    to: Annotated[
        Form,
        typer.Option(
            "--to",
            help="ssp: FMUs and wiring in one archive; fmu: one native FMU; container: one FMU of the FMUs; "
            "html: a web page that runs it; mat: the state space of it, or of a part, for MATLAB.",
        ),
    ],
    values: Set = None,
    part: Part = None,
    mapping: Map = None,
    seed: Seed = 1,
    out: Annotated[Path | None, typer.Option("--out", metavar="FILE", help="File to write.")] = None,
    expose: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="fmu, container, html: parameter, unwired input or output of a part (gyro.D_I), or option.  "
            "Repeatable.  Default: the options that set values of parts and nothing else.",
        ),
    ] = None,
    fmi: Annotated[int, typer.Option(metavar="2|3", help="fmu: FMI version.", min=2, max=3)] = 2,
    platform: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="fmu: linux64, win64, darwin64, aarch64-linux, aarch64-darwin.  Repeatable."),
    ] = None,
) -> None:
    """Export a system for other tools.

    The file contains the plan of the test and all parameter values.

    \b
    Examples:
      gyrobench export tumble_single_axis --to ssp --set windows=36
      gyrobench export tumble_single_axis --to fmu --expose gyro.D_I --expose gyro.temperature
      gyrobench export stabilizer_sdf --to html --expose platform.J
      gyrobench export stabilizer_sdf --to mat
    """
    from gyrobench.commands import export_system
    from gyrobench.commands.arguments import parse_settings, parse_swaps

    given, swaps = parse_settings(values), parse_swaps(part, mapping)
    path = export_system.export(system, to.value, given, *swaps, seed, out, expose or (), fmi, platform or ())
    echo(display_path(path))


@app.command()
def fit(
    file: Annotated[
        Path, typer.Argument(metavar="FMU|FILE", help="A co-simulation FMU, FMI 2.0 or 3.0, or a text file of data.")
    ],
    slot: Annotated[
        str | None,
        typer.Option("--slot", metavar="SYSTEM.SLOT|SOCKET", help="FMU: the slot, or the socket, that it is to fit."),
    ] = None,
    system: Annotated[
        str | None,
        typer.Option(
            "--system",
            metavar="SYSTEM",
            help="Data: the test that is to read the file, by gyrobench reduce SYSTEM --columns MAP.",
            autocompletion=complete_system,
        ),
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", metavar="FILE", help="File to write; default: print it.")] = None,
) -> None:
    """Write a first mapping of a vendor's FMU or a data file.

    A mapping file names the variables of an FMU, a column map the columns of a laboratory's file.  Their lines
    are proposals from names, units and descriptions; units and signs are to be checked.

    \b
    Examples:
      gyrobench fit vendor.fmu --slot tumble_single_axis.gyro --out vendor.toml
      gyrobench fit messung.csv --system fixed_position --out messung.toml
    """
    if (slot is None) == (system is None):
        raise UsageError(
            "fit: --slot SYSTEM.SLOT for an FMU, or --system SYSTEM for a file of data: the test that is to read it, "
            "drift_record for a record at rest; all tests: gyrobench list"
        )
    if slot is not None:
        from gyrobench.workflow.fit_mapping import write_mapping

        text, problems = write_mapping(file, slot, out)
    else:
        from gyrobench.workflow.fit_columns import write_columns

        assert system is not None
        text, problems = write_columns(file, system, out)
    echo(text.rstrip("\n") if out is None else display_path(out))
    if problems:
        echo("to be completed by hand:", err=True)
        for p in problems:
            echo(f"  - {p}", err=True)
    if system is not None and out is not None:
        words = ["gyrobench", "reduce", system, "--data", display_path(file), "--columns", display_path(out)]
        echo(f"check it, then: {shlex.join(words)}", err=True)


@app.command()
def validate(file: Annotated[str, typer.Argument(metavar="FILE|PART", help="An FMU, or the name of a part.")]) -> None:
    """Validate an FMU: FMI standard, units, reference run.

    \b
    Example: gyrobench validate fmus/site.fmu
    """
    from gyrobench.packaging.validate import validate as check

    problems = check(file, Bench.find().folder)
    for p in problems:
        echo(f"{file}: {p}")
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
    from gyrobench.workflow.catalog import init_bench

    for line in init_bench(name, list(copy or [])):
        echo(line)
