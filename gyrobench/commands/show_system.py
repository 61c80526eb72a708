"""Descriptions of systems and suites: nothing runs."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gyrobench.bench import Bench, UsageError
from gyrobench.commands import console
from gyrobench.system.suite import Suite
from gyrobench.system.system import System
from gyrobench.workflow.inputs import check_fmu_files, require_slots, suite_members


def show_system(
    system: System, parts: Mapping[str, str], maps: Mapping[str, Path], picture: Path | None, as_json: bool
) -> None:
    """Print slots, wires, order, cuts, delays and plan of a system, or draw its wiring."""
    from gyrobench.engine import preflight
    from gyrobench.system.parameters import defaults, resolve
    from gyrobench.system.part_files import resolve_parts
    from gyrobench.system.system_description import describe
    from gyrobench.system.wiring import assemble

    if picture is not None and picture.suffix != ".svg":
        raise UsageError(f"--picture {picture}: the drawing is an SVG; write {picture.with_suffix('.svg')}")
    check_fmu_files(parts)
    notes: list[str] = []
    paths, built = resolve_parts(require_slots(system), parts, "native", Bench.find().folder, notes)
    assembly = assemble(system, paths, maps)
    parameters = resolve(assembly, system, 1, defaults(assembly))[1]  # refuses parameters that do not exist
    description = describe(assembly)
    foreign = [slot for slot in paths if slot not in built]
    invalid = preflight.problems(assembly, foreign) + preflight.step_problems(assembly, system.step)
    invalid += list(system.check()) or system.check_parameters(parameters)
    description["notes"] += preflight.remarks(assembly, foreign, system.step)
    description["notes"] += [f"a run is refused: {p}" for p in invalid]
    if picture is not None:
        from gyrobench.report import wiring_figure

        wires = [w["wire"] for w in description["wires"] if w["connected"]]
        picture.write_text(wiring_figure.draw(description["order"], wires, "system"), encoding="utf-8")
        console.print_note(str(picture)) if as_json else print(picture)
    if as_json:
        print(json.dumps(description, indent=1, ensure_ascii=False))
    elif picture is None:
        print(console.format_system(description))


def show_suite(suite: Suite, picture: Path | None, as_json: bool) -> None:
    """Print the tests of a suite with their plans, and its options."""
    if picture is not None:
        raise UsageError(
            f"--picture: a suite has no wiring of its own; gyrobench show {suite.tests()[0]} --picture ..."
        )
    description = _describe_suite(suite)
    print(json.dumps(description, indent=1, ensure_ascii=False) if as_json else console.format_suite(description))


def _describe_suite(suite: Suite) -> dict[str, Any]:
    """Return tests with plans and seeds (of --seed 1), sets and options, JSON-able."""
    members = suite_members(suite)
    given = suite.given_to(members)
    return {
        "system": suite.name,
        "title": suite.title,
        "spec": list(suite.spec),
        "item": suite.item,
        "sets": dict(suite.sets),
        "tests": [
            {
                "name": name,
                "title": system.title,
                "spec": list(system.spec),
                "seed": suite.seed_of(1, name),
                "given": given[name],
                "plan": system.plan().rows(),
                "duration": system.plan().duration(),
            }
            for name, system in members.items()
        ],
        "options": {k: {"value": suite[k], "unit": "str", "doc": o.doc} for k, o in suite.options.items()},
    }
