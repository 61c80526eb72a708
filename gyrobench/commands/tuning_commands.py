"""The command tune: the controller of a stabilizer loop for wanted margins and bandwidth."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from gyrobench.commands.app import app, echo
from gyrobench.commands.options import Json, Map, Out, Part, Seed, Set, System


@app.command()
def tune(
    system: System,
    want: Annotated[
        list[str] | None,
        typer.Option(
            "--want",
            metavar="'MEASURE=VALUE'",
            help="phase margin=40deg, gain margin=6dB, disk margin=0.5, delay margin=2ms, bandwidth>20Hz, peak S<6dB, "
            "peak T<3dB, S at 1Hz<-40dB, jitter=25urad (of a system with a line of sight).  Repeatable.",
        ),
    ] = None,
    over: Annotated[
        list[str] | None,
        typer.Option(
            "--over",
            metavar="SLOT.PARAM=±30%|LOW..HIGH",
            help="Spread over which all of it must hold: ±30%, ±0.1kg.m2, 1.5..2.5kg.m2.  Repeatable, up to six.",
        ),
    ] = None,
    structure: Annotated[
        str,
        typer.Option(
            "--structure",
            metavar="FACTOR+FACTOR",
            help="Factors of the controller beside its gain: lead-lag (where none is named), pi, lag, lead, notch, "
            "rolloff; gain alone; or a whole one that is computed: lqg, hinf.",
        ),
    ] = "",
    loop: Annotated[str, typer.Option("--loop", metavar="NAME", help="Loop of a system that has several.")] = "",
    pareto: Annotated[
        list[str] | None,
        typer.Option("--pareto", metavar="MEASURE", help="Two of the wishes, given one each: show their trade."),
    ] = None,
    values: Set = None,
    part: Part = None,
    mapping: Map = None,
    seed: Seed = 1,
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Tune a stabilizer loop for wanted margins.

    The linear models are those of the parts; what is wanted holds in the worst case over the spread, and is proven in
    co-simulation with noise, friction and limits as they are.  Print the controller as values that are ready to run.
    --out DIR writes a page with Nichols and
    Nyquist plots, S and T.  Exit code 1: it cannot be had (the text says why), or the co-simulation contradicts.

    \b
    Example: gyrobench tune platform_single_axis --want "phase margin=40deg" --want "bandwidth>10Hz"
    """
    from gyrobench.commands.arguments import parse_settings, parse_swaps
    from gyrobench.tuning.tune_loop import tune as tune_loop
    from gyrobench.workflow.settings import load_system

    settings = parse_settings(values)
    parts, maps = parse_swaps(part, mapping)
    found = tune_loop(
        load_system(system, settings), want or [], over or [], structure, parts=parts, maps=maps, seed=seed,
        given=settings, loop=loop, pareto=pareto or [],
    )  # fmt: skip
    echo(json.dumps(found.as_dict(), indent=1, ensure_ascii=False) if as_json else str(found))
    if out is not None:
        from gyrobench.bench import display_path

        for path in found.write(out).values():
            echo(display_path(path), err=True)
    if not found.proven:
        raise typer.Exit(1)
