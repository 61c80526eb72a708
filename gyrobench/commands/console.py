"""What the commands say on a terminal: coefficient tables, systems, what a record lacks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from gyrobench import units
from gyrobench.record.record import Record
from gyrobench.result import Result

NO_VERDICT = "no specification given"
FAST = 0.01  # rad/s; above it rates are shown in degrees a second


def columns(rows: Sequence[Sequence[str]], left: set[int], indent: str = "") -> list[str]:
    """Rows as aligned lines; columns in ``left`` are flush left, the others flush right."""
    widths = [max(len(r[k]) for r in rows) for k in range(len(rows[0]))] if rows else []
    return [
        indent + "  ".join(x.ljust(w) if k in left else x.rjust(w) for k, (x, w) in enumerate(zip(r, widths))).rstrip()  # noqa: B905
        for r in rows
    ]


def quantity(value: Any, unit: str) -> str:
    """A value in SI as a person writes it: angles in degrees, rates in degrees an hour or a second."""
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
def answer(result: Result) -> str:
    """The coefficient table, the warnings and the verdict."""
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
    return "\n".join([result.title, "", *columns(rows, left), "", *notes])


def suite_answer(result: Result) -> str:
    """The combined values, then what the methods say of each other."""
    found = result.suite
    rows = [["quantity", "methods", "largest E_n", "p", ""]]
    for q in found["quantities"]:
        if q["p"] is not None:
            rows.append([q["name"], str(len(q["values"])), f"{q['largest E_n']:.2f}", f"{q['p']:.2g}", q["words"]])
    table = ["", *columns(rows, {0, 4})] if len(rows) > 1 else []
    said = [f"methods: {found['consistency']}", *result.summary]
    return "\n".join([answer(result), *table, "", *said])


def ranking(found: Mapping[str, Any]) -> str:
    """Runs of a comparison in the order of the measure that ranks them; empty where none does."""
    from gyrobench.report.numbers import write_number

    ranked = found["ranking"]
    if not ranked:
        return ""
    rows = [["", "run", ranked["name"], "u", "unit", "over the best"]]
    for place, entry in enumerate(ranked["order"], 1):
        value, u = (write_number(entry[k], entry["u"]).text for k in ("value", "u"))
        over = write_number(entry["over_best"], significant=3).text
        rows.append([str(place), found["runs"][entry["run"]]["name"], value, u, ranked["unit"], over])
    return "\n".join([*columns(rows, {0, 1, 4}), ""])


# ------------------------------------------------------------------------------------------- systems
def system(found: Mapping[str, Any]) -> str:
    """The description of a system (:func:`gyrobench.system.system_description.describe`)."""
    lines = [found["title"] or found["system"]]
    if found["spec"]:
        lines[0] += f"  [{', '.join(found['spec'])}]"
    lines += ["", f"slots, in the order of execution; step {found['step']:g} s"]
    slots = [(n, found["slots"][n]) for n in found["order"]]
    lines += columns([[n, s["socket"], f"{s['model']} {s['version']}", s["fmu"]] for n, s in slots], {0, 1, 2, 3}, "  ")
    lines += ["", "wires"]
    for w in found["wires"]:
        marks = ["   (value of the step before)"] * w["cut"] + ["   (not offered by the part)"] * (not w["connected"])
        lines.append("  " + w["wire"] + "".join(marks))
    lines += ["", "loops are cut at"] * bool(found["cuts"]) + [f"  {c}" for c in found["cuts"]]
    if found["plan"]:
        ways = "" if "shape" in found["plan"][0] else " without the ways between the phases"
        lines += ["", f"plan: {found['duration']:,.0f} s{ways}"]
        rows = [_phase(p) for p in found["plan"]]
        last = "dwell" if "shape" in found["plan"][0] else "window"
        lines += columns([["", "phase", "mode", "", "settle", last], *rows], {1, 2, 3}, "  ")
    if found["options"]:
        lines += ["", "options (--set NAME=VALUE), and any slot.parameter of a part"]
        options = [[k, quantity(o["value"], o["unit"]), o["doc"]] for k, o in found["options"].items()]
        lines += columns(options, {0, 1, 2}, "  ")
    return "\n".join([*lines, *(f"note: {n}" for n in found["notes"])])


def suite(found: Mapping[str, Any]) -> str:
    """The description of a suite (:func:`gyrobench.commands.run_suite.describe`)."""
    lines = [f"{found['title']}  [{', '.join(found['spec'])}]", "", f"tests of one {found['item']}, in their order"]
    rows = [
        [m["name"], m["title"], f"{len(m['plan'])} phases", f"{m['duration']:,.0f} s", f"--seed {m['seed']}"]
        for m in found["tests"]
    ]
    lines += columns(rows, {0, 1, 4}, "  ")
    lines += ["", f"sets: {'; '.join(f'{k}: {v}' for k, v in found['sets'].items())}"] if found["sets"] else []
    lines += ["", "options (--set NAME=VALUE)"]
    lines += columns(
        [[k, quantity(o["value"], o["unit"]), o["doc"]] for k, o in found["options"].items()], {0, 1, 2}, "  "
    )
    first = found["tests"][0]["name"]
    lines += [
        f"any option of a test, and slot.parameter, goes to all tests that have it; {first}.option and",
        f"{first}.slot.parameter to this one alone",
    ]
    return "\n".join(lines)


def _phase(p: Mapping[str, Any]) -> list[str]:
    if "shape" in p:  # of a loop test
        size = "" if p["mode"] == "hold" else f"{p['shape']} {quantity(p['amplitude'], p['unit'])}, axis {p['axis']}"
        size += f", {p['frequency']:.4g} Hz" if p["frequency"] else ""
        return [str(p["phase"]), p["label"], p["mode"], size, f"{p['settle']:.4g} s", f"{p['dwell']:.4g} s"]
    turning = p["mode"] == "rate"
    if turning:
        size = f"{quantity(p['travel'], 'rad')} at {quantity(p['target'], 'rad/s')}"
    else:
        second = f", {quantity(p['target_y'], 'rad')}" if "target_y" in p else ""
        where = f" at {quantity(p['target'], 'rad')}{second}" if p["mode"] == "index" else ""
        size = f"{p['dwell']:g} s{where}"
    return [
        str(p["phase"]),
        p["label"],
        p["mode"],
        size,
        f"{p['settle']:g} s",
        quantity(p["window"], "rad" if turning else "s"),
    ]


# ------------------------------------------------------------------------------------------- records
def lacking(record: Record) -> str:
    """How far an incomplete record goes, phase by phase of its plan."""
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
