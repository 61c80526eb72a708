"""Arguments and options that several commands share, and the values that some of them accept."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from gyrobench.commands.completion import complete_setting, complete_slot, complete_specification, complete_system

System = Annotated[
    str, typer.Argument(metavar="SYSTEM", help="Name of a system, see gyrobench list.", autocompletion=complete_system)
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON, and nothing else, on standard output.")]
Set = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="NAME=VALUE|@FILE",
        help="Set an option of the system, or slot.parameter of a part; with unit (2deg/s) or in SI.  @FILE.toml: all "
        "values of a file, parameters in a table named as their slot.  Repeatable.",
        autocompletion=complete_setting,
    ),
]
FromRun = Annotated[
    list[Path] | None,
    typer.Option(
        "--from-run",
        metavar="RUN",
        help="Take values of the result of another test, where this one says how (accelerometer_four: the first "
        "harmonic of a table_position_test); --set goes before them.  Repeatable.",
    ),
]
Part = Annotated[
    list[str] | None,
    typer.Option(
        "--part",
        metavar="SLOT=FMU|PART|FILE",
        help="Put another part, an FMU, or a controller of your own (.c, .py) into a slot.  Repeatable.",
        autocompletion=complete_slot,
    ),
]
Map = Annotated[
    list[str] | None,
    typer.Option(
        "--map",
        metavar="SLOT=FILE",
        help="Mapping file (.toml): names and units of a third-party FMU.  Repeatable.",
        autocompletion=complete_slot,
    ),
]
Seed = Annotated[int, typer.Option(metavar="N", help="Seed of the noise.", min=0)]
Spec = Annotated[
    str | None,
    typer.Option(
        "--spec",
        metavar="NAME|FILE",
        help="Acceptance specification for the verdict.",
        autocompletion=complete_specification,
    ),
]
NoReport = Annotated[bool, typer.Option("--no-report", help="Write record and result.json only, no HTML and PDF.")]
Strict = Annotated[
    bool, typer.Option("--strict", help="End with exit code 1 if the verdict is fail, inconclusive or void (no value).")
]
Data = Annotated[
    list[Path] | None, typer.Option(metavar="FILE.csv|RUN", help="Measured record; for a suite, its runs.  Repeatable.")
]
Columns = Annotated[
    Path | None,
    typer.Option(
        "--columns",
        metavar="MAP",
        help="Column map (.toml) of a file of another layout; gyrobench fit FILE --system SYSTEM writes one.",
    ),
]
From = Annotated[
    Path | None,
    typer.Option(
        "--from",
        metavar="FILE|FOLDER",
        help="A run of the exported system in another tool: CSV, .npy (FMPy), .mat, Parquet, or the folder of "
        "libcosim's CSV files; values by --set, --part and --map as at the export.",
    ),
]
FitTo = Annotated[
    str | None,
    typer.Option(
        "--fit-to",
        metavar="PART",
        help="Write values of the result for a part, files for --set @FILE.toml, and of JSON and C: the noise of a "
        "drift_record for a gyro (floated_gyro), the errors that imu_positions found for imu_compensator.",
    ),
]
WithCertificate = Annotated[
    bool, typer.Option("--certificate", help="Write the certificate, too; needs laboratory.toml.")
]
Language = Annotated[str, typer.Option("--language", metavar="en|zh", help="Language of the report.")]
SiteLanguage = Annotated[str, typer.Option("--language", metavar="en|zh", help="Language of the site.")]
Force = Annotated[bool, typer.Option("--force", help="Replace another run in the folder --out.")]
Resume = Annotated[bool, typer.Option("--resume", help="Continue this run from where it was interrupted.")]
Out = Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Folder to write to.")]
Store = Annotated[
    str | None,
    typer.Option("--out", metavar="DIR|URL", help="Where results are stored; default reports/out/campaigns/NAME."),
]
Workers = Annotated[int | None, typer.Option(metavar="N", help="Local processes; default: one for each core.", min=1)]
Scheduler = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="Scheduler of a dask cluster, for example tcp://host:8786.")
]
Retry = Annotated[bool, typer.Option("--retry", help="Run again what crashed, hung or had no memory.")]
WithSite = Annotated[bool, typer.Option("--site", help="Write the site of the campaign, too; see gyrobench site.")]


class Order(StrEnum):
    sequential = "sequential"
    parallel = "parallel"


Coupling = Annotated[
    Order,
    typer.Option(
        help="sequential: part after part, each with the newest values; parallel: each wire carries the value of the "
        "step before, so that loops of direct feedthrough run too."
    ),
]


class Engine(StrEnum):
    native = "native"
    linked = "linked"
    reference = "reference"


class Target(StrEnum):
    native = "native"
    python = "python"


class TableFormat(StrEnum):
    csv = "csv"
    xlsx = "xlsx"


class Form(StrEnum):
    ssp = "ssp"
    container = "container"
    fmu = "fmu"
    html = "html"
    mat = "mat"
