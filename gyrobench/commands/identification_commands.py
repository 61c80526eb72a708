"""The command identify: responses and margins of a loop from a laboratory's file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from gyrobench.commands.app import app, echo
from gyrobench.commands.options import Columns, Json, Out


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
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Identify a loop: open loop, sensitivities, plant and margins, with intervals.

    The file has columns time, excitation, input (of the plant; or controller, its output) and output, each with its
    unit.  A periodic excitation of three periods and more is averaged over them, any other one by bands of
    frequency; an odd multisine with lines left out shows nonlinearity, too.  --out DIR writes a page with Bode,
    Nichols and Nyquist plots.

    \b
    Example: gyrobench identify loop.csv --at "plant input" --out identified
    """
    from gyrobench.identification.identify_loop import identify as identify_loop
    from gyrobench.identification.identify_loop import parse_band

    found = identify_loop(file, at=at, period=period, band=parse_band(band), columns=columns)
    echo(json.dumps(found.as_dict(), indent=1, ensure_ascii=False) if as_json else str(found))
    if out is not None:
        from gyrobench.bench import display_path

        for path in found.write(out).values():
            echo(display_path(path), err=True)
