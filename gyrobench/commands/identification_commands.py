"""The commands identify and multisine: responses and margins of a real loop, and an excitation for it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from gyrobench.commands.app import app, echo
from gyrobench.commands.options import Columns, Json, Out, Seed


@app.command()
def identify(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Record of the loop: CSV, Parquet, MATLAB, HDF5 ...")],
    at: Annotated[
        str,
        typer.Option(
            "--at",
            metavar="PLACE",
            help="Where the excitation enters: plant input, reference, plant output.  Default: by the file's comments "
            "or its unit.",
        ),
    ] = "",
    period: Annotated[
        str, typer.Option("--period", metavar="TIME", help="Period of the excitation.  Default: found in the record.")
    ] = "",
    band: Annotated[
        str, typer.Option("--band", metavar="LOW..HIGH", help="Frequencies to look at, such as 0.5Hz..80Hz.")
    ] = "",
    columns: Columns = None,
    fit: Annotated[
        list[str] | None,
        typer.Option(
            "--fit",
            metavar="NAME[=VALUE]",
            help="Physical parameter of the plant to find, or with its value known: J, viscous, k_t, k_e, R, L, delay, "
            "mode; held: the input is held between samples.  Repeatable.",
        ),
    ] = None,
    twin: Annotated[
        Path | None, typer.Option("--twin", metavar="FILE.toml", help="Write the parameters as values for --set @FILE.")
    ] = None,
    want: Annotated[
        list[str] | None,
        typer.Option(
            "--want",
            metavar="'MEASURE=VALUE'",
            help="Margin that the loop must have: phase margin=40deg, gain margin=6dB, disk margin=0.5, "
            "delay margin=2ms, peak S<6dB, peak T<3dB.  Repeatable.",
        ),
    ] = None,
    against: Annotated[
        Path | None,
        typer.Option("--against", metavar="FILE", help="Record of the same loop at another amplitude, to compare."),
    ] = None,
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Identify a loop from its record: responses and margins.

    The file has columns time, excitation, input (of the plant; or controller, its output) and output, each with its
    unit.  A periodic excitation of three periods and more is averaged over them, any other one by bands of
    frequency; an odd multisine with lines left out shows nonlinearity, too.  --out DIR writes a page with Bode,
    Nichols and Nyquist plots.  Exit code 1: a margin that is wanted does not pass.

    \b
    Examples:
      gyrobench identify loop.csv --at "plant input" --want "phase margin=40deg" --out identified
      gyrobench identify loop.csv --fit J --fit viscous --fit delay --twin twin.toml
    """
    from gyrobench.bench import UsageError, display_path
    from gyrobench.commands.arguments import require_suffix
    from gyrobench.files import write_whole
    from gyrobench.identification.identify_loop import identify as identify_loop
    from gyrobench.identification.identify_loop import parse_band

    if twin is not None and not fit:
        raise UsageError("--twin: what is to be found? Name the parameters, such as --fit J --fit viscous")
    require_suffix("--twin", twin, ".toml", "a file of values")
    found = identify_loop(
        file, at=at, period=period, band=parse_band(band), columns=columns, fit=fit or [], want=want or [],
        against=against,
    )  # fmt: skip
    echo(json.dumps(found.as_dict(), indent=1, ensure_ascii=False) if as_json else str(found))
    if twin is not None and found.fit is not None:
        write_whole(twin, found.fit.toml(found.record.name).encode())
        echo(display_path(twin), err=True)
    if out is not None:
        for path in found.write(out).values():
            echo(display_path(path), err=True)
    if any(v.verdict != "pass" for v in found.verdicts):
        raise typer.Exit(1)


@app.command()
def multisine(
    out: Annotated[Path, typer.Argument(metavar="FILE", help="CSV that is written: time and excitation.")],
    band: Annotated[str, typer.Option("--band", metavar="LOW..HIGH", help="Frequencies, such as 0.5Hz..80Hz.")],
    peak: Annotated[str, typer.Option("--peak", metavar="VALUE", help="Largest value, with its unit: 0.2N.m, 1deg/s.")],
    period: Annotated[str, typer.Option("--period", metavar="TIME", help="Period.")] = "4s",
    rate: Annotated[str, typer.Option("--rate", metavar="RATE", help="Samples a second.")] = "1kHz",
    periods: Annotated[int, typer.Option("--periods", metavar="N", help="Periods in the file.", min=1, max=1000)] = 10,
    seed: Seed = 1,
) -> None:
    """Write an odd multisine as the excitation of a loop.

    \b
    Example: gyrobench multisine excitation.csv --band 0.5Hz..100Hz --peak 0.2N.m
    """
    from gyrobench.bench import UsageError, display_path
    from gyrobench.commands.arguments import require_suffix
    from gyrobench.identification.multisine import parse_multisine

    require_suffix("FILE", out, ".csv", "an excitation")
    if out.exists():  # it may be a record
        raise UsageError(f"{out}: the file exists; choose another name")
    made = parse_multisine(band, peak, period, rate, seed)
    made.write(out, periods)
    echo(str(made))
    echo(display_path(out), err=True)
