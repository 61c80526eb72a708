"""Section on the method: model, conventions, system, plan, and every digit of the estimates."""

from __future__ import annotations

from typing import Any

from gyrobench.report import wiring_figure
from gyrobench.report.numbers import write_number
from gyrobench.report.page_model import (
    BulletList,
    Cell,
    CollapsedBlocks,
    Equation,
    PageTable,
    Picture,
    Row,
    columns,
    number_cell,
    pictures,
    text_cell,
)
from gyrobench.report.provenance import Provenance
from gyrobench.report.references import source_blocks
from gyrobench.report.result_json import Report
from gyrobench.result import Result

#: columns of the plan: field of PlanLine -> head, unit
PLAN = {
    "phase": ("phase", ""),
    "label": ("label", ""),
    "mode": ("mode", ""),
    "shape": ("shape", ""),
    "face": ("orientation", ""),
    "axis": ("axis", ""),
    "amplitude": ("amplitude", ""),
    "unit": ("unit", ""),
    "frequency_Hz": ("frequency", "Hz"),
    "angle_deg": ("angle", "°"),
    "angle_y_deg": ("second angle", "°"),
    "rate_deg_per_h": ("rate", "°/h"),
    "settle_s": ("settle", "s"),
    "dwell_s": ("dwell", "s"),
    "travel_deg": ("travel", "°"),
    "window_s": ("window", "s"),
    "window_deg": ("window", "°"),
}


def model(result: Result) -> list[Any]:
    """Return equation, conventions and sources."""
    blocks: list[Any] = [Equation(result.equation)] if result.equation else []
    blocks += [BulletList(result.conventions)] if result.conventions else []
    return blocks + source_blocks(result.sources)


def system(report: Report[Result]) -> list[Any]:
    """Return the drawing of the system, the order of execution, and the plan."""
    run = report.run
    blocks: list[Any] = []
    if run.order:
        caption = (
            "Components on the diagonal in execution order. Connections above the diagonal (solid) carry values of the "
            "current communication step, those below it (dashed) values of the previous one."
        )
        svg = wiring_figure.draw(run.order, run.wires, "system")
        alt = "Components in execution order with their connections: " + ", ".join(run.order)
        blocks += pictures(Picture("system", svg, caption, alt))
        blocks.append(BulletList([f"Execution order: {', '.join(run.order)}.", *_cuts(run)]))
    plan = report.derived.plan
    shown = [name for name in PLAN if any(getattr(line, name) not in (None, "") for line in plan)]
    rows = [
        Row([number_cell(report.document, ("derived", "plan", k, name), significant=7) for name in shown])
        for k in range(len(plan))
    ]
    return blocks + ([PageTable(columns(*(PLAN[n] for n in shown)), rows, "Test plan.", small=True)] if rows else [])


def _cuts(run: Provenance) -> list[str]:
    """Return cuts and delays as sentences: a record gives cuts as "connection: why", and delays in s by connection."""
    cuts = {cut.partition(": ")[0]: cut for cut in run.cuts}
    sentences = []
    for wire, cut in cuts.items():
        delay = f", {write_number(run.delays[wire]).text} s" if wire in run.delays else ""
        sentences.append(f"Delayed connection {cut}{delay}")
    if not cuts:
        sentences = ["No delayed connection: every value is used in the communication step in which it is computed"]
    sentences += [f"Delay on {w}: {write_number(s).text} s" for w, s in run.delays.items() if w not in cuts]
    return [s.replace("->", "→") + "." for s in sentences]


def full_values(report: Report[Result]) -> list[Any]:
    """Return the table of the estimates at full precision, as they are in result.json."""
    rows = []
    for k, c in enumerate(report.result.coefficients):
        path = ("coefficients", k)
        cells = [number_cell(report.document, (*path, *p))
                 for p in (("estimate",), ("u",), ("interval", 0), ("interval", 1))]  # fmt: skip
        rows.append(
            Row([text_cell(c.name, "strong"), *(Cell(x.full or "–", pointer=x.pointer, full=x.full) for x in cells)])
        )
    heads = columns("name", "estimate", "u", "95\N{NO-BREAK SPACE}% from", "to")
    caption = "Estimates at full precision, units as in the table of coefficients."
    return [CollapsedBlocks("Full precision, as in result.json", [PageTable(heads, rows, caption, small=True)])]
