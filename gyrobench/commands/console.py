"""What the commands print: notes, tables of results, descriptions of systems, files."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from gyrobench import units
from gyrobench.bench import display_path
from gyrobench.record.record import Record
from gyrobench.result import NO_VERDICT, Result, SuiteResult

FAST = 0.01  # rad/s; above it rates are shown in degrees a second


def print_note(text: str) -> None:
    """Print a line on standard error."""
    print(text, file=sys.stderr, flush=True)


def print_notes(notes: Iterable[str]) -> None:
    """Print notes on standard error; one that several slots share is printed once."""
    slots: dict[str, list[str]] = {}
    for text in notes:
        slot, colon, rest = text.partition(": ")
        slots.setdefault(rest if colon else text, []).append(slot if colon else "")
    for rest, names in slots.items():
        print_note("note: " + ", ".join(filter(None, names)) + (": " if names[0] else "") + rest)


def print_report_files(paths: Mapping[str, Path], text: str | None) -> None:
    """Print a text and the files; without text the JSON file on standard output and the files on standard error."""
    if text is None:
        print(paths["json"].read_text(encoding="utf-8").rstrip("\n"))
    elif text:
        print(text)
    for path in paths.values():
        print(display_path(path), file=sys.stderr if text is None else sys.stdout)


def align_columns(rows: Sequence[Sequence[str]], left: set[int], indent: str = "") -> list[str]:
    """Return rows as aligned lines; columns in ``left`` are flush left, the others flush right."""
    widths = [max(len(r[k]) for r in rows) for k in range(len(rows[0]))] if rows else []
    return [
        indent + "  ".join(x.ljust(w) if k in left else x.rjust(w) for k, (x, w) in enumerate(zip(r, widths))).rstrip()  # noqa: B905
        for r in rows
    ]


def format_quantity(value: Any, unit: str) -> str:
    """Return a value in SI as a person writes it: angles in degrees, rates in degrees an hour or a second."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if not isinstance(value, int | float) or unit in ("int", "str"):
        return str(value)
    if unit == "rad":
        return f"{units.convert(value, 'rad', 'deg'):.9g}°"
    if unit == "rad/s":
        name = "deg/s" if abs(value) > FAST else "deg/h"
        return f"{units.convert(value, 'rad/s', name):.9g} {name.replace('deg', '°')}"
    return f"{value:g}" if unit == "1" else f"{value:g} {unit}"


# ------------------------------------------------------------------------------------------- results
def format_result(result: Result) -> str:
    """Return the coefficient table, the warnings and the verdict."""
    from gyrobench.report.numbers import write_number

    truth = any(c.truth is not None for c in result.coefficients)
    judged = result.verdict != NO_VERDICT
    head = ["coefficient", "estimate", "u", "95 % interval", "unit"]
    rows = [head + (["truth", "z"] if truth else []) + (["verdict"] if judged else [])]
    for c in result.coefficients:
        lo, hi = (write_number(x, c.u).text for x in c.interval)
        row = [c.name, write_number(c.estimate, c.u).text, write_number(c.u, c.u).text, f"{lo} … {hi}", c.unit]
        if truth:
            row += [write_number(c.truth, c.u).text, "–" if c.z is None else f"{c.z:+.2f}".replace("-", "−")]
        rows.append(row + ([c.verdict] if judged else []))
    notes = [f"warning: {w}" for w in result.warnings]
    if result.step_check:
        worst = result.step_check["worst"]
        notes.append(f"step check: halving the step changes no coefficient by more than {worst:.2g} u")
    if judged:
        notes.append(f"verdict: {result.verdict}")
    left = {0, 4} | ({len(rows[0]) - 1} if judged else set())
    return "\n".join([result.title, "", *align_columns(rows, left), "", *notes])


def format_suite_result(result: SuiteResult) -> str:
    """Return the combined values, then how far the methods agree."""
    rows = [["quantity", "methods", "largest E_n", "p", ""]]
    for q in result.suite.quantities:
        if q["p"] is not None:
            rows.append([q["name"], str(len(q["values"])), f"{q['largest E_n']:.2f}", f"{q['p']:.2g}", q["words"]])
    table = ["", *align_columns(rows, {0, 4})] if len(rows) > 1 else []
    return "\n".join([format_result(result), *table, "", f"methods: {result.suite.consistency}", *result.summary])


def format_ranking(comparison: Mapping[str, Any]) -> str:
    """Return the runs of a comparison in the order of the measure that ranks them; empty where none does."""
    from gyrobench.report.numbers import write_number

    ranked = comparison["ranking"]
    if not ranked:
        return ""
    rows = [["", "run", ranked["name"], "u", "unit", "over the best"]]
    for place, entry in enumerate(ranked["order"], 1):
        value, u = (write_number(entry[k], entry["u"]).text for k in ("value", "u"))
        over = write_number(entry["over_best"], significant=3).text
        rows.append([str(place), comparison["runs"][entry["run"]]["name"], value, u, ranked["unit"], over])
    return "\n".join([*align_columns(rows, {0, 1, 4}), ""])


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
    lines += ["", "wires"]
    for w in description["wires"]:
        marks = ["   (value of the step before)"] * w["cut"] + ["   (not offered by the part)"] * (not w["connected"])
        lines.append("  " + w["wire"] + "".join(marks))
    lines += ["", "loops are cut at"] * bool(description["cuts"]) + [f"  {c}" for c in description["cuts"]]
    if description["plan"]:
        ways = "" if "shape" in description["plan"][0] else " without the ways between the phases"
        lines += ["", f"plan: {description['duration']:,.0f} s{ways}"]
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
    turning = p["mode"] == "rate"
    if turning:
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


# ------------------------------------------------------------------------------------------- records
def format_missing_windows(record: Record) -> str:
    """Return how far an incomplete record goes, phase by phase of its plan."""
    run = record.run
    done = [int(p) for p in record.windows.get("phase", [])]
    lines = [run.problem or "the run did not end"]
    lines += [f"recorded until t = {run.stopped_at:,.9g} s"] if run.stopped_at is not None else []
    for row in run.plan:
        length = row.travel if row.mode == "rate" else row.dwell
        expected = round(length / row.window) if row.window else 0
        have = done.count(row.phase)
        if have < expected:
            lines.append(f"phase {row.phase} ({row.label}): {have} of {expected} windows")
    return "\n".join(f"  - {line}" for line in lines)
