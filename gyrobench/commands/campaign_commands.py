"""The commands sweep, campaign, site, design: many runs, and the shortest ones."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from gyrobench.bench import UsageError
from gyrobench.commands import options
from gyrobench.commands.app import app, echo


@app.command()
def sweep(
    system: options.System,
    over: Annotated[
        list[str] | None,
        typer.Option(
            "--over",
            metavar="NAME=VALUES",
            help="Vary an option or slot.parameter: 0deg..80deg:9 (grid), 1e-3..1:7log deg/h, 0.1,0.3 deg/h/g (list), "
            "uniform(-1, 1) deg/h (drawn, with --runs); SLOT=PART,PART swaps parts.  Repeatable: all combinations.",
        ),
    ] = None,
    seeds: Annotated[int, typer.Option(metavar="N", help="Seeds at each point.", min=1)] = 1,
    runs: Annotated[int | None, typer.Option(metavar="N", help="Points that are drawn from distributions.")] = None,
    design: Annotated[str | None, typer.Option(metavar="random|lhs|sobol", help="How they are drawn.")] = None,
    table: Annotated[
        Path | None, typer.Option(metavar="FILE.csv", help='One row a point, columns "name [unit]".')
    ] = None,
    data: Annotated[str | None, typer.Option(metavar="'DIR/*.csv'", help="Reduce measured files, a run each.")] = None,
    columns: options.Columns = None,
    values: options.Set = None,
    part: options.Part = None,
    mapping: options.Map = None,
    spec: options.Spec = None,
    fixed_design: Annotated[
        bool,
        typer.Option(
            "--fixed-design",
            help="Design once, at nominal values; else what follows from a part does so at each point.",
        ),
    ] = False,
    keep: Annotated[
        str | None,
        typer.Option(metavar="all|failures|extremes|none", help="Records and reports to keep; default failures."),
    ] = None,
    time_limit: Annotated[str | None, typer.Option(metavar="TIME", help="Of one run, default 1h.")] = None,
    memory_limit: Annotated[str | None, typer.Option(metavar="SIZE", help="Of a worker, for example 1GB.")] = None,
    out: options.Store = None,
    workers: options.Workers = None,
    scheduler: options.Scheduler = None,
    retry: options.Retry = False,
    site: options.WithSite = False,
    language: options.SiteLanguage = "en",
    certificate: options.WithCertificate = False,
    strict: options.Strict = False,
    as_json: options.Json = False,
) -> None:
    """Run a system over values and seeds, a row each.

    The same command goes on where it was stopped, and runs nothing twice.

    \b
    Examples:
      gyrobench sweep tumble_single_axis --over "latitude=0deg..80deg:9" --over "gyro.D_I=0.1,0.3,1 deg/h/g" --seeds 100
      gyrobench sweep tumble_single_axis --over "gyro.D_I=normal(0, 0.5) deg/h/g" --runs 256 --design lhs
      gyrobench sweep platform_single_axis --over "platform.J=1,2,4 kg.m2" --fixed-design
      gyrobench sweep tumble_single_axis --data "lot/*.csv" --spec floated_gyro --keep all --site
      gyrobench sweep tumble_single_axis --data "lot/*.csv" --spec floated_gyro --certificate
    """
    from gyrobench.commands import run_campaign

    if certificate:
        keep = run_campaign.require_certifiable(data, keep)
    more = {
        "runs": runs, "design": design, "table": table, "data": data, "columns": columns, "spec": spec, "keep": keep,
        "fixed_design": fixed_design or None, "time_limit": time_limit, "memory_limit": memory_limit,
    }  # fmt: skip
    axes = run_campaign.require_over(over, seeds, data, table)
    definition = run_campaign.from_arguments(system, axes, seeds, values, part, mapping, more)
    store = out or run_campaign.default_out(definition, True)
    if (
        not run_campaign.run(definition, store, scheduler, workers, retry, as_json, site, certificate, language)
        and strict
    ):
        raise typer.Exit(1)


@app.command()
def campaign(
    file: Annotated[Path, typer.Argument(metavar="FILE.toml", help="Definition of the campaign.")],
    out: options.Store = None,
    workers: options.Workers = None,
    scheduler: options.Scheduler = None,
    retry: options.Retry = False,
    site: options.WithSite = False,
    language: options.SiteLanguage = "en",
    strict: options.Strict = False,
    as_json: options.Json = False,
) -> None:
    """Execute a campaign: many runs, a row of results each.

    What is done is not done again: killed at any moment, the same command goes on; runs added to the file run alone.
    docs/guides/campaigns.md has the keys of the file.

    \b
    Example: gyrobench campaign lot.toml --workers 8
    """
    from gyrobench.campaign.execution.definition import read_definition
    from gyrobench.commands import run_campaign

    definition = read_definition(file)
    store = out or definition.out or run_campaign.default_out(definition, False)
    if not run_campaign.run(definition, store, scheduler, workers, retry, as_json, site, language=language) and strict:
        raise typer.Exit(1)


@app.command()
def site(
    campaign: Annotated[str, typer.Argument(metavar="CAMPAIGN", help="Folder or URL of a campaign.")],
    out: Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Folder; default site/ in the campaign.")] = (
        None
    ),
    publish: Annotated[
        Path | None, typer.Option("--publish", metavar="DIR", help="Folder for all of it, reports included.")
    ] = None,
    language: options.SiteLanguage = "en",
) -> None:
    """Write the site of a campaign as static pages.

    Answer, table of runs, coverage, responses, distributions, failures; of measured lots control charts, tolerance
    intervals, outliers, verdicts.

    \b
    Examples:
      gyrobench site reports/out/lot
      gyrobench site s3://bucket/lot --publish public
    """
    from gyrobench.commands.campaign_site import write

    write(campaign, out, publish, language)


@app.command()
def design(
    system: options.System,
    want: Annotated[
        list[str] | None,
        typer.Option(
            "--want",
            metavar="NAME=U",
            help="Standard uncertainty wanted of a value, with unit.  Repeatable.  Default: those of its own plan.",
        ),
    ] = None,
    time: Annotated[
        str | None, typer.Option("--time", metavar="TIME", help="Best uncertainties in this time, for example 4h.")
    ] = None,
    criterion: Annotated[
        str,
        typer.Option(metavar="minimax|A|D", help="Of the ratios of u to the wanted: the largest, the mean square, the "
                     "volume."),
    ] = "minimax",
    instruments: Annotated[
        int, typer.Option(metavar="N", min=1, help="Plan for the worst of N noise models of a population.")
    ] = 1,
    noise: Annotated[
        Path | None, typer.Option(metavar="RUN", help="Take the noise that the reduction of this run estimated.")
    ] = None,
    count: Annotated[
        int, typer.Option(metavar="N", min=0, help="Count the prediction in N runs of the plan.")
    ] = 0,
    values: options.Set = None,
    part: options.Part = None,
    mapping: options.Map = None,
    seed: options.Seed = 1,
    as_json: options.Json = False,
) -> None:  # fmt: skip
    """Find the shortest plan of a test for wanted uncertainties.

    Print the uncertainties that its reduction will state, the plan as a command, the time saved against the system's
    own plan, how much shorter any plan could be, and what the plan does not determine.

    \b
    Examples:
      gyrobench design accelerometer_multipoint --want k2=0.5ug/g2
      gyrobench design tumble_two_axis --want D_I=0.001deg/h/g --want D_F=0.002deg/h --count 100
      gyrobench design tumble_two_axis --time 1h --criterion A --set @noise.toml
      gyrobench design drift_test_suite --set tests="tumble_single_axis tumble_two_axis" --want D_I=0.001deg/h/g
    """
    from gyrobench.commands.arguments import parse_assignments, parse_settings, parse_swaps, parse_time
    from gyrobench.design.designed_test import DesignedSuite, DesignedTest
    from gyrobench.design.shortest_test import design_test
    from gyrobench.design.suite_design import design_suite
    from gyrobench.system.suite import Suite
    from gyrobench.workflow.settings import load_with_values

    settings = parse_settings(values)
    parts, maps = parse_swaps(part, mapping)
    wants = parse_assignments(want, "--want", "D_I=0.001deg/h/g")
    test = load_with_values(system, settings)
    found: DesignedTest | DesignedSuite
    if isinstance(test, Suite):
        if time or noise or instruments > 1:
            raise UsageError(f"{system} is a suite: --time, --noise and --instruments are for one test")
        found = design_suite(test, wants, criterion=criterion, parts=parts, maps=maps, seed=seed, count=count)
    else:
        found = design_test(
            test, wants, time=parse_time("--time", time), criterion=criterion, instruments=instruments, noise_of=noise,
            parts=parts, maps=maps, seed=seed, count=count, given=settings,
        )  # fmt: skip
    echo(json.dumps(found.as_dict(), indent=1, ensure_ascii=False) if as_json else str(found))
