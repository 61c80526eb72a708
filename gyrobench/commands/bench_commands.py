"""The commands list, show, build: what a bench holds."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Annotated

import typer

from gyrobench.bench import Bench, UsageError, display_path
from gyrobench.commands.app import app, echo
from gyrobench.commands.completion import complete_part
from gyrobench.commands.options import Coupling, Json, Map, Order, Out, Part, Set, System, Target


@app.command("list")
def list_command(
    words: Annotated[
        list[str] | None, typer.Argument(metavar="WORD", help="Only what has all of these in name, title or method.")
    ] = None,
    as_json: Json = False,
) -> None:
    """List parts, systems, sockets, specifications and data sheets.

    A socket is the list of inputs and outputs, with units, that a part must have to stand in a slot of a system.

    \b
    Example: gyrobench list tumble
    """
    from gyrobench.workflow.catalog import list_contents, with_words

    contents = with_words(list_contents(Bench.find()), words or ())
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
    coupling: Coupling = Order.sequential,
    picture: Annotated[Path | None, typer.Option(metavar="FILE.svg", help="Draw the wiring.")] = None,
    as_json: Json = False,
) -> None:
    """Show wiring, plan and options of a system.

    Print slots, wires, execution order, cut loops and their delays, plan, options; nothing is run.

    \b
    Example: gyrobench show tumble_single_axis --picture wiring.svg
    """
    from gyrobench.commands.arguments import parse_settings, parse_swaps
    from gyrobench.commands.show_system import show_suite, show_system
    from gyrobench.system.suite import Suite
    from gyrobench.workflow.settings import load_with_values

    test = load_with_values(system, parse_settings(values), None, coupling.value)
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
    """Build FMUs of parts, or of own controllers (FILE.c, FILE.py).

    \b
    Example: gyrobench build floated_gyro --target python
    """
    from gyrobench import packaging
    from gyrobench.files import cores
    from gyrobench.packaging.compiler import PLATFORMS
    from gyrobench.packaging.own_controller import allow, is_controller

    bench = Bench.find()
    names = list(dict.fromkeys([*(parts or []), *(bench.parts() if every else ())]))
    if not names:
        raise UsageError(f"no part named; name one or more, or set --all; parts: {', '.join(bench.parts())}")
    for name in names:
        if is_controller(name):
            allow(name)
        else:
            bench.part_folder(name)
    unknown = [p for p in platform or [] if p not in PLATFORMS]
    if unknown:
        raise UsageError(f"--platform {unknown[0]}: unknown platform; available: {', '.join(PLATFORMS)}")

    def build_one(name: str) -> Path:
        return packaging.build(name, target.value, fmi, out or bench.products, bench.folder, tuple(platform or ()))

    with ThreadPoolExecutor(cores()) as pool:  # the compiler's processes are nearly all of it
        for path in pool.map(build_one, names):
            echo(display_path(path))
