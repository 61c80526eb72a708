"""Arguments and options that several commands share, and the words that some of them take."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from gyrobench.commands.completion import complete_setting, complete_slot, complete_specification, complete_system

System = Annotated[
    str,
    typer.Argument(metavar="SYSTEM", help="Name of a system, see gyrobench list.", autocompletion=complete_system),
]
Json = Annotated[bool, typer.Option("--json", help="JSON on standard output, and nothing else there.")]
Set = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="NAME=VALUE",
        help="Option of the system, or slot.parameter of a part; with unit (2deg/s) or in SI.  Repeatable.",
        autocompletion=complete_setting,
    ),
]
Part = Annotated[
    list[str] | None,
    typer.Option(
        "--part",
        metavar="SLOT=FMU|PART",
        help="Another part, or an FMU file, in a slot.",
        autocompletion=complete_slot,
    ),
]
Map = Annotated[
    list[str] | None,
    typer.Option(
        "--map",
        metavar="SLOT=FILE",
        help="Names and units of a foreign FMU (.toml).",
        autocompletion=complete_slot,
    ),
]
Seed = Annotated[int, typer.Option(metavar="N", help="Seed of all noise.", min=0)]
Spec = Annotated[
    str | None,
    typer.Option(
        "--spec",
        metavar="NAME|FILE",
        help="Acceptance specification to judge by.",
        autocompletion=complete_specification,
    ),
]
NoReport = Annotated[
    bool, typer.Option("--no-report", help="Record and result.json only: no HTML, no PDF, for many runs.")
]
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


class Table(StrEnum):
    csv = "csv"


class Form(StrEnum):
    ssp = "ssp"
    container = "container"
