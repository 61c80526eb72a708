"""The command bearing: design of an aerostatic bearing of a table."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from gyrobench.commands.app import app, echo
from gyrobench.commands.options import Json, Out


@app.command()
def bearing(
    values: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUE",
            help="diameter, length, land, gap, orifices (of a row), orifice, supply, ambient (absolute), density, "
            "viscosity, discharge; with unit or in SI.  Repeatable.",
        ),
    ] = None,
    stiffness: Annotated[
        str | None, typer.Option("--stiffness", metavar="VALUE", help="Wanted dW/de: finds the gap.")
    ] = None,
    load: Annotated[str, typer.Option("--load", metavar="FORCE", help="Radial load of the shaft.")] = "0",
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Design an aerostatic journal bearing of a table.

    Print pressure, stiffness, load and eccentricity.  --out DIR writes a page with the general curves, load and
    stiffness, and bearing.toml, the values of the part bearing_air for --set @FILE.

    \b
    Example: gyrobench bearing --set orifices=24 --set supply=600kPa --stiffness 1e9N/m --load 500N --out bearing
    """
    from gyrobench.bench import display_path
    from gyrobench.commands.arguments import parse_settings
    from gyrobench.design.bearing_design import design_bearing

    found = design_bearing(parse_settings(values), stiffness, load)
    echo(json.dumps(found.as_dict(), indent=1, ensure_ascii=False) if as_json else str(found))
    if out is not None:
        from gyrobench.design.bearing_page import write_bearing

        for path in write_bearing(found, out).values():
            echo(display_path(path), err=True)
