"""The commands run, reduce, report, compare, record: single runs and what becomes of them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gyrobench.bench import Bench, UsageError, display_path
from gyrobench.commands import options
from gyrobench.commands.app import app, echo, exit_on_fail


@app.command()
def run(
    system: options.System,
    values: options.Set = None,
    part: options.Part = None,
    mapping: options.Map = None,
    instrument: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME", help="Data sheet (instruments/NAME.toml, or a file) of a gyro, of a turntable.  Repeatable."
        ),
    ] = None,
    from_run: options.FromRun = None,
    seed: Annotated[int | None, typer.Option(metavar="N", help="Seed of the noise; default 1.", min=0)] = None,
    engine: Annotated[
        options.Engine | None, typer.Option(help="Default: native with a C compiler, linked in long runs.")
    ] = None,
    step: Annotated[str | None, typer.Option(metavar="TIME", help="Communication step, for example 1ms.")] = None,
    coupling: options.Coupling = options.Order.sequential,
    check_step: Annotated[
        bool | None,
        typer.Option(
            "--check-step/--no-check-step",
            help="Repeat the run with its step and half of it, noise off, and take the effect of the step into u. "
            "Default: two short runs for a system with loops or --coupling parallel, else none.",
        ),
    ] = None,
    timeout: Annotated[
        str | None,
        typer.Option(metavar="TIME", help="Stop the run when one call of an FMU takes longer.  Default: 1min."),
    ] = None,
    spec: options.Spec = None,
    strict: options.Strict = False,
    no_report: options.NoReport = False,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Folder of the run; default reports/out/SYSTEM/ID.")
    ] = None,
    force: options.Force = False,
    resume: options.Resume = False,
    language: options.Language = "en",
    as_json: options.Json = False,
) -> None:
    """Run a system: record, reduction, report.

    \b
    Examples:
      gyrobench run tumble_single_axis --set latitude=45.75deg --set gyro.D_I=0.9deg/h/g --seed 7
      gyrobench run tumble_single_axis --part gyro=vendor.fmu --map gyro=vendor.toml
      gyrobench run tumble_single_axis --spec floated_gyro --strict
      gyrobench run drift_record --instrument adis16405
      gyrobench run tumble_single_axis --instrument draper --instrument fecker352
      gyrobench run drift_test_suite --set tests="tumble_single_axis servo_polar" --set gyro.D_I=0.9deg/h/g
    """
    from gyrobench.commands import print_runs
    from gyrobench.commands.arguments import parse_settings, parse_swaps, parse_time
    from gyrobench.report import FORMATS
    from gyrobench.report.language import reports_in
    from gyrobench.system.suite import Suite
    from gyrobench.workflow.handover import handed_over
    from gyrobench.workflow.inputs import load_test
    from gyrobench.workflow.instruments import with_instruments
    from gyrobench.workflow.run_execution import RunRequest
    from gyrobench.workflow.settings import load_with_values

    parts, maps = parse_swaps(part, mapping)
    time_step = parse_time("--step", step)
    title, sheet = with_instruments(instrument, parts, load_test(system)) if instrument else ("", {})
    taken = handed_over(load_test(system), from_run) if from_run else {}
    test = load_with_values(system, {**sheet, **taken, **parse_settings(values)}, time_step, coupling.value)
    if not isinstance(test, Suite):
        test.instrument = title
    elif title and not test["instrument"]:
        test.set("instrument", title)
    request = RunRequest(
        parts=parts, maps=maps, seed=getattr(test, "seed", 1) if seed is None else seed,
        engine=engine.value if engine else None, step=time_step, out=out, force=force, spec=spec, check_step=check_step,
        timeout=parse_time("--timeout", timeout), resume=resume, formats=("json",) if no_report else FORMATS,
    )  # fmt: skip
    with reports_in(language, test.name, Bench.find().folder):
        exit_on_fail(print_runs.run(request, test, as_json), strict)


@app.command()
def reduce(
    system: options.System,
    files: Annotated[list[Path] | None, typer.Argument(metavar="FILE", help="Measured data, as --data.")] = None,
    data: options.Data = None,
    columns: options.Columns = None,
    source: options.From = None,
    values: options.Set = None,
    from_run: options.FromRun = None,
    part: options.Part = None,
    mapping: options.Map = None,
    template: Annotated[
        bool, typer.Option("--template", help="Print an empty record: its columns, their units, the values to state.")
    ] = False,
    spec: options.Spec = None,
    strict: options.Strict = False,
    no_report: options.NoReport = False,
    fit_to: options.FitTo = None,
    out: options.Out = None,
    force: options.Force = False,
    language: options.Language = "en",
    certificate: options.WithCertificate = False,
    as_json: options.Json = False,
) -> None:
    """Reduce measured data, or a run of another tool, and report.

    \b
    Examples:
      gyrobench reduce tumble_single_axis --template > record.csv
      gyrobench reduce tumble_single_axis --data record.csv --set latitude=45.75deg
      gyrobench reduce fixed_position --data messung.csv --columns messung.toml --set latitude=48.1deg --certificate
      gyrobench reduce drift_test_suite --data RUN1 --data RUN2 --set operator=...
      gyrobench reduce tumble_single_axis --from fmpy.csv --set latitude=45.75deg
      gyrobench reduce tumble_single_axis.ssp --from libcosim_output
    """
    from gyrobench.commands import print_runs
    from gyrobench.commands.arguments import parse_settings, parse_swaps
    from gyrobench.report import FORMATS
    from gyrobench.report.language import reports_in
    from gyrobench.workflow.handover import handed_over
    from gyrobench.workflow.inputs import load_test
    from gyrobench.workflow.run_execution import RunRequest

    test = load_test(system)
    data = [*(files or []), *(data or [])]
    if template:
        from gyrobench.workflow.empty_record import empty_record

        echo(empty_record(test).rstrip("\n"))
        return
    formats = ("json",) if no_report else FORMATS
    parts, maps = parse_swaps(part, mapping)
    taken = handed_over(test, from_run) if from_run else {}
    if source is not None:
        if data or fit_to or columns or certificate:
            raise UsageError(
                "--from is a run of another tool; --data, --columns, --fit-to and --certificate are of measured data: "
                "name one of them"
            )
        request = RunRequest(parts, maps, engine="reference", out=out, force=force, spec=spec, formats=formats)
        with reports_in(language, test.name, Bench.find().folder):
            given = taken | parse_settings(values)
            exit_on_fail(print_runs.reduce_result(request, test, source, given, as_json), strict)
        return
    if parts or maps:
        raise UsageError("--part, --map: of a run by another tool (--from); measured data have no FMUs")
    given = taken | parse_settings(values)
    with reports_in(language, test.name, Bench.find().folder):
        verdict = print_runs.reduce(test, data, given, spec, out, force, as_json, formats, fit_to, columns, certificate)
    exit_on_fail(verdict, strict)


@app.command()
def report(
    folder: Annotated[Path, typer.Argument(metavar="RUN", help="Folder of a run.")],
    spec: options.Spec = None,
    strict: options.Strict = False,
    fit_to: options.FitTo = None,
    language: options.Language = "en",
    as_json: options.Json = False,
) -> None:
    """Reduce the record of a run again and rewrite its report.

    \b
    Examples:
      gyrobench report reports/out/tumble_single_axis/1a2b3c4d --spec floated_gyro
      gyrobench report reports/out/imu_positions/1a2b3c4d --fit-to imu_compensator
    """
    from gyrobench.commands import print_runs
    from gyrobench.report.language import reports_in
    from gyrobench.workflow.inputs import load_saved_test

    test = load_saved_test(folder)
    with reports_in(language, test.name, Bench.find().folder):
        exit_on_fail(print_runs.report(folder, test, spec, as_json, fit_to), strict)


@app.command()
def compare(
    runs: Annotated[list[Path], typer.Argument(metavar="RUN RUN...", help="Folders; the first is the baseline.")],
    out: options.Out = None,
    language: options.Language = "en",
    as_json: options.Json = False,
) -> None:
    """Compare runs side by side, or two campaigns.

    Of campaigns: what they differ in beyond chance, in pairs where settings and seeds are equal.

    \b
    Examples:
      gyrobench compare reports/out/tumble_single_axis/1a2b3c4d vendor --out comparison
      gyrobench compare reports/out/lot reports/out/lot_new
    """
    from gyrobench.commands import campaign_site, print_runs

    if campaign_site.are_campaigns(runs):
        campaign_site.compare(runs, out, as_json, language)
    else:
        print_runs.compare(runs, out, as_json, language)


@app.command()
def record(
    folder: Annotated[Path, typer.Argument(metavar="RUN", help="Folder of a run.")],
    to: Annotated[
        options.TableFormat,
        typer.Option("--to", help="csv: a file a table, those of the report in report/; xlsx: a workbook."),
    ],
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Folder; default: of the run, csv/ in it for csv.")
    ] = None,
) -> None:
    """Write the record of a run and the tables of its report.

    A row of windows.csv is a completed window (its columns: docs/systems.md), one of channels.csv a time; names are
    those of the record, "gyro.u [V]" with the SI unit where it is not 1.  Numbers read back bit for bit.

    \b
    Example: gyrobench record reports/out/tumble_single_axis/1a2b3c4d --to csv --out tables
    """
    from gyrobench.workflow.run_tables import write_tables

    for file in write_tables(folder, to.value, out):
        echo(display_path(file))


@app.command()
def verify(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="Folder of a run or of a suite.")],
    key: Annotated[
        Path | None, typer.Option(metavar="FILE.pub", help="Public key that the signature must belong to.")
    ] = None,
) -> None:
    """Verify that a report is as it was written, and signed.

    \b
    Example: gyrobench verify reports/out/tumble_single_axis/e567487f --key laboratory.pub
    """
    from gyrobench.workflow import manifest

    found = manifest.verify(folder, key)
    for name in found.files:
        echo(f"  as written  {name}")
    for name in found.others:
        echo(f"  not covered {name}")
    signed = f"signed by {key}" if found.signed else "signature not asked for (--key)"
    echo(f"report {found.report_id}: all {len(found.files)} files as they were written; {signed}")


@app.command()
def certificate(
    runs: Annotated[list[Path], typer.Argument(metavar="FOLDER...", help="Folders of runs of one test.")],
    laboratory: Annotated[
        Path | None, typer.Option(metavar="FILE.toml", help="Profile; default laboratory.toml, here or in the bench.")
    ] = None,
    number: Annotated[str, typer.Option(help="Number of the certificate; default: that of the report.")] = "",
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Default: the working folder.")] = None,
    language: Annotated[str, typer.Option(metavar="en|zh", help="Default: that of the profile.")] = "",
    dcc: Annotated[
        bool, typer.Option("--dcc", help="Also as XML, a Digital Calibration Certificate by the schema of PTB.")
    ] = False,
) -> None:
    """Write the certificate of an instrument, or of a lot.

    One or two pages of what the laboratory answers for; the reports must verify.

    \b
    Example: gyrobench certificate reports/out/tumble_single_axis/measured-47e4353f --number 2026-014
    """
    from gyrobench.campaign.site.lot_certificate import control_charts
    from gyrobench.workflow.certificate import write_certificate

    for path in write_certificate(runs, laboratory, number, out, language, dcc, control_charts):
        echo(display_path(path))


@app.command()
def sign(
    folder: Annotated[Path | None, typer.Argument(metavar="FOLDER", help="Folder of a run or of a suite.")] = None,
    key: Annotated[Path | None, typer.Option(metavar="FILE.key", help="Private key, Ed25519 in PEM.")] = None,
    new_key: Annotated[
        Path | None, typer.Option(metavar="FILE.key", help="Make a key; its public part gets the suffix .pub.")
    ] = None,
    passphrase: Annotated[bool, typer.Option("--passphrase", help="Ask for the passphrase of the key.")] = False,
) -> None:
    """Sign a report with the key of the laboratory.

    \b
    Examples:
      gyrobench sign --new-key laboratory.key
      gyrobench sign reports/out/tumble_single_axis/e567487f --key laboratory.key
    """
    from gyrobench.workflow import manifest

    if (new_key is None) == (folder is None) or (folder is None) != (key is None):
        raise UsageError("name a folder and the --key that signs it, or a --new-key to make")
    secret = typer.prompt("passphrase", hide_input=True, confirmation_prompt=folder is None) if passphrase else None
    if folder is not None and key is not None:
        echo(display_path(manifest.sign(folder, key, secret)))
    elif new_key is not None:
        public = display_path(manifest.new_key(new_key, secret))
        echo(f"{public}: give it to those who verify; keep {new_key} to yourself")
