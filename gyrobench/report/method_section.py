"""Section on the method: model, conventions, system, plan, and every digit of the estimates."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gyrobench.report import wiring_figure
from gyrobench.report.numbers import write_number
from gyrobench.report.page_model import (
    BulletList,
    Cell,
    CollapsedBlocks,
    Column,
    Equation,
    Picture,
    Row,
    Table,
    number_cell,
    pictures,
    text_cell,
)
from gyrobench.report.references import source_blocks
from gyrobench.report.result_json import value_at

Json = dict[str, Any]


def model(doc: Json) -> list[Any]:
    blocks: list[Any] = [Equation(doc["equation"])] if doc["equation"] else []
    blocks += [BulletList(doc["conventions"])] if doc["conventions"] else []
    return blocks + source_blocks(doc["sources"])


def system(doc: Json) -> list[Any]:
    run = doc["provenance"]
    order = [str(s) for s in run.get("order") or []]
    blocks: list[Any] = []
    if order:
        caption = (
            "Components on the diagonal in execution order. Connections above the diagonal (solid) carry values of the "
            "current communication step, those below it (dashed) values of the previous one."
        )
        svg = wiring_figure.draw(order, run, "system")
        blocks += pictures(
            Picture("system", svg, caption, "Components in execution order with their connections: " + ", ".join(order))
        )
        blocks.append(BulletList([f"Execution order: {', '.join(order)}.", *_cuts(run)]))
    rows = []
    keys = (
        "phase",
        "label",
        "mode",
        "shape",
        "face",
        "axis",
        "amplitude",
        "unit",
        "frequency_Hz",
        "angle_deg",
        "angle_y_deg",
        "rate_deg_per_h",
        "settle_s",
        "dwell_s",
        "travel_deg",
        "window_s",
        "window_deg",
    )
    heads = [
        ("phase", ""),
        ("label", ""),
        ("mode", ""),
        ("shape", ""),
        ("orientation", ""),
        ("axis", ""),
        ("amplitude", ""),
        ("unit", ""),
        ("frequency", "Hz"),
        ("angle", "°"),
        ("second angle", "°"),
        ("rate", "°/h"),
        ("settle", "s"),
        ("dwell", "s"),
    ]
    heads += [("travel", "°"), ("window", "s"), ("window", "°")]
    plan = doc["derived"]["plan"]
    for k in range(len(plan)):
        rows.append(Row([number_cell(doc, ("derived", "plan", k, key), significant=7) for key in keys]))
    if rows:
        empty = [all(value_at(plan, k, key) in (None, "") for k in range(len(plan))) for key in keys]
        for row in rows:
            row.cells = [c for c, e in zip(row.cells, empty, strict=True) if not e]
        columns = [Column(h, unit) for (h, unit), e in zip(heads, empty, strict=True) if not e]
        blocks.append(Table(columns, rows, "Test plan.", small=True))
    return blocks


def _cuts(run: Mapping[str, Any]) -> list[str]:
    """Cuts and delays as sentences; a record gives cuts as sentences and delays in s by wire, or both as wires."""
    cuts, delays = run.get("cuts") or [], run.get("delays") or []
    sentences = [f"Delayed connection {c}" for c in map(str, cuts)] or [
        "No delayed connection: every value is used in the communication step in which it is computed"
    ]
    times = dict(delays) if isinstance(delays, Mapping) else dict.fromkeys(delays)
    for wire, seconds in times.items():
        time = "one communication step" if seconds is None else f"{write_number(seconds).text} s"
        k = next((k for k, s in enumerate(sentences) if wire in s), None)
        if k is None:
            sentences.append(f"Delay on {wire}: {time}")
        else:
            sentences[k] += f", {time}"
    return [s.replace("->", "→") + "." for s in sentences]


def full_values(doc: Json) -> list[Any]:
    """Return the table of the estimates at full precision, as they are in result.json."""
    rows = []
    for k, c in enumerate(doc["coefficients"]):
        path = ("coefficients", k)
        cells = [number_cell(doc, (*path, *p)) for p in (("estimate",), ("u",), ("interval", 0), ("interval", 1))]
        rows.append(
            Row([text_cell(c["name"], "strong"), *(Cell(x.full or "–", pointer=x.pointer, full=x.full) for x in cells)])
        )
    columns = [Column("name"), Column("estimate"), Column("u"), Column("95\N{NO-BREAK SPACE}% from"), Column("to")]
    return [
        CollapsedBlocks(
            "Full precision, as in result.json",
            [Table(columns, rows, "Estimates at full precision, units as in the table of coefficients.", small=True)],
        )
    ]
