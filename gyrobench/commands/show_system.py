"""What ``gyrobench show`` says of a system or of a suite."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

from gyrobench.bench import Bench, UsageError
from gyrobench.commands import console
from gyrobench.commands.run_system import check_fmus, load, note, runnable
from gyrobench.system.suite import Suite


def show(
    name: str,
    values: Mapping[str, str],
    parts: Mapping[str, str],
    maps: Mapping[str, Path],
    picture: Path | None,
    as_json: bool,
) -> None:
    """Slots, wires, order, cuts, delays and plan of a system."""
    from gyrobench.system.parameters import defaults, resolve
    from gyrobench.system.part_files import resolve_parts
    from gyrobench.system.system_description import describe
    from gyrobench.system.wiring import assemble

    if picture is not None and picture.suffix != ".svg":
        raise UsageError(f"--picture {picture}: the drawing is an SVG; write {picture.with_suffix('.svg')}")
    system = load(name, values)
    if isinstance(system, Suite):
        return _suite(system, picture, as_json)
    system = runnable(system)
    check_fmus(parts)
    notes: list[str] = []
    paths, _ = resolve_parts(system, parts, "native", Bench.find().folder, notes)
    assembly = assemble(system, paths, maps)
    resolve(assembly, system, 1, defaults(assembly))  # refuses parameters that do not exist
    found = describe(assembly)
    if picture is not None:
        from gyrobench.report import diagrams

        picture.write_text(diagrams.system(found["order"], found, "system"), encoding="utf-8")
        note(str(picture)) if as_json else print(picture)
    if as_json:
        print(json.dumps(found, indent=1, ensure_ascii=False))
    elif picture is None:
        print(console.system(found))


def _suite(suite: Suite, picture: Path | None, as_json: bool) -> None:
    """Tests of a suite with their plans, and its options."""
    from gyrobench.commands import run_suite

    if picture is not None:
        raise UsageError(
            f"--picture: a suite has no wiring of its own; gyrobench show {suite.tests()[0]} --picture ..."
        )
    found = run_suite.describe(suite)
    print(json.dumps(found, indent=1, ensure_ascii=False) if as_json else console.suite(found))
