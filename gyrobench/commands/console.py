"""Output of the commands: notes, descriptions of systems, files."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from gyrobench.bench import display_path
from gyrobench.reading import visible
from gyrobench.report.plain_text import align_columns
from gyrobench.units import format_quantity


def print_note(text: str) -> None:
    """Print a line on standard error."""
    print(visible(text), file=sys.stderr, flush=True)


def print_notes(notes: Iterable[str]) -> None:
    """Print notes on standard error; one that several slots share is printed once."""
    slots: dict[str, list[str]] = {}
    for text in notes:
        slot, colon, fact = text.partition(": ")
        slots.setdefault(fact if colon else text, []).append(slot if colon else "")
    for fact, names in slots.items():
        print_note("note: " + ", ".join(filter(None, names)) + (": " if names[0] else "") + fact)


def print_report_files(paths: Mapping[str, Path], text: str | None) -> None:
    """Print a text and the files; without text the JSON file on standard output and the files on standard error."""
    if text is None:
        print(paths["json"].read_text(encoding="utf-8").rstrip("\n"))
    elif text:
        print(visible(text))
    for path in paths.values():
        print(display_path(path), file=sys.stderr if text is None else sys.stdout)


# ------------------------------------------------------------------------------------------- systems
def format_system(description: Mapping[str, Any]) -> str:
    """Return the description of a system (:func:`gyrobench.system.system_description.describe`)."""
    lines = [description["title"] or description["system"]]
    if description["spec"]:
        lines[0] += f"  [{', '.join(description['spec'])}]"
    lines += ["", f"slots, in the order of execution; step {description['step']:g} s"]
    slots = [(n, description["slots"][n]) for n in description["order"]]
    lines += align_columns(
        [[n, s["socket"], f"{s['model']} {s['version']}", s["fmu"]] for n, s in slots], {0, 1, 2, 3}, "  "
    )
    if description["on_request"]:
        wanted = ", ".join(f"{n} (--set {n}.PARAMETER=VALUE or --part {n}=PART)" for n in description["on_request"])
        lines += [f"  on request: {wanted}"]
    lines += ["", "wires"]
    for w in description["wires"]:
        marks = ["   (value of the previous step)"] * w["cut"] + ["   (not provided by the part)"] * (
            not w["connected"]
        )
        lines.append("  " + w["wire"] + "".join(marks))
    lines += ["", "delayed wires, each closes a loop of parts"] * bool(description["cuts"]) + [
        f"  {c}" for c in description["cuts"]
    ]
    if description["plan"]:
        transitions = "" if "shape" in description["plan"][0] else " without the transitions between the phases"
        lines += ["", f"plan: {description['duration']:,.0f} s{transitions}"]
        rows = [_phase(p) for p in description["plan"]]
        last = "dwell" if "shape" in description["plan"][0] else "window"
        lines += align_columns([["", "phase", "mode", "", "settle", last], *rows], {1, 2, 3}, "  ")
    if description["options"]:
        lines += ["", "options (--set NAME=VALUE), and any slot.parameter of a part"]
        options = [[k, format_quantity(o["value"], o["unit"]), o["doc"]] for k, o in description["options"].items()]
        lines += align_columns(options, {0, 1, 2}, "  ")
    return "\n".join([*lines, *(f"note: {n}" for n in description["notes"])])


def format_suite(description: Mapping[str, Any]) -> str:
    """Return the description of a suite, see gyrobench.commands.show_system."""
    lines = [
        f"{description['title']}  [{', '.join(description['spec'])}]",
        "",
        f"tests of one {description['item']}, in their order",
    ]
    rows = [
        [m["name"], m["title"], f"{len(m['plan'])} phases", f"{m['duration']:,.0f} s", f"--seed {m['seed']}"]
        for m in description["tests"]
    ]
    lines += align_columns(rows, {0, 1, 4}, "  ")
    lines += (
        ["", f"sets: {'; '.join(f'{k}: {v}' for k, v in description['sets'].items())}"] if description["sets"] else []
    )
    lines += ["", "options (--set NAME=VALUE)"]
    first = description["tests"][0]["name"]
    lines += [
        f"any option of a test, and slot.parameter, goes to all tests that have it; {first}.option and",
        f"{first}.slot.parameter to this one alone",
    ]
    return "\n".join(lines)


def _phase(p: Mapping[str, Any]) -> list[str]:
    if "shape" in p:  # of a loop test
        size = (
            ""
            if p["mode"] == "hold"
            else f"{p['shape']} {format_quantity(p['amplitude'], p['unit'])}, axis {p['axis']}"
        )
        size += f", {p['frequency']:.4g} Hz" if p["frequency"] else ""
        return [str(p["phase"]), p["label"], p["mode"], size, f"{p['settle']:.4g} s", f"{p['dwell']:.4g} s"]
    turning = p["mode"] == "rate" and p["travel"] > 0.0
    if p["mode"] == "rate" and not turning:
        size = f"{p['dwell']:g} s at {format_quantity(p['target'], 'rad/s')}, {format_quantity(p['target_y'], 'rad/s')}"
    elif turning:
        size = f"{format_quantity(p['travel'], 'rad')} at {format_quantity(p['target'], 'rad/s')}"
    else:
        second = f", {format_quantity(p['target_y'], 'rad')}" if "target_y" in p else ""
        where = f" at {format_quantity(p['target'], 'rad')}{second}" if p["mode"] == "index" else ""
        size = f"{p['dwell']:g} s{where}"
    return [
        str(p["phase"]),
        p["label"],
        p["mode"],
        size,
        f"{p['settle']:g} s",
        format_quantity(p["window"], "rad" if turning else "s"),
    ]
