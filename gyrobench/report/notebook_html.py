"""Results, records and comparisons as HTML fragments for a notebook: no script, no file, no network.

The tables and figures are those of the reports; colours follow the notebook's light or dark theme.
"""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING, Any

from gyrobench import notebook
from gyrobench.record.record import Record
from gyrobench.report.numbers import write_number
from gyrobench.report.page_model import BulletList, Cell, Column, PageTable, Row, text_cell
from gyrobench.result import NO_VERDICT, DriftRecordResult, DriftTestResult, LoopResult, Result, SuiteResult

if TYPE_CHECKING:
    from gyrobench.report.result_json import Report

THEME = {  # colour of the report -> that of the notebook, if it has one
    "ink": "var(--jp-content-font-color1, var(--vscode-editor-foreground, #1f2328))",
    "muted": "var(--jp-content-font-color2, var(--vscode-descriptionForeground, #5b6168))",
    "grid": "var(--jp-border-color1, #d5d9de)",
    "shade": "var(--jp-layout-color2, #eef1f4)",
    "page": "var(--jp-layout-color1, #ffffff)",
    "blue": "#0072b2",
    "vermilion": "#d55e00",
    "green": "#009e73",
    "purple": "#cc79a7",
}
MARKS = {
    "pass": ("✓ ", "#00805d"),
    "fail": ("✗ ", "#c04a00"),
    "inconclusive": ("? ", "#8a6800"),
    "void": ("× ", "#c04a00"),
}
MAX_ROWS = 6  # of a record's windows
MAX_CHANNELS = 4  # drawn


def fragment(*blocks: str) -> str:
    """Return blocks of HTML in a frame that defines the colours."""
    colours = "".join(f"--{name}:{value};" for name, value in THEME.items())
    style = f"{colours}color:var(--ink);max-width:60rem;font-variant-numeric:tabular-nums"
    return f'<div class="gyrobench" style="{style}">{"".join(blocks)}</div>'


def paragraph(text: str, strong: bool = False) -> str:
    weight = "font-weight:600;" if strong else ""
    return f'<p style="{weight}margin:.4em 0">{escape(text)}</p>'


def warning_list(warnings: Sequence[str]) -> str:
    """Return warnings as a list, "" where there are none."""
    items = "".join(f"<li>⚠ {escape(w)}</li>" for w in warnings)
    return f'<ul style="list-style:none;padding-left:0;margin:.4em 0">{items}</ul>' if items else ""


def table_html(table: PageTable) -> str:
    """Return a table of a report; numbers stand under each other at their decimal sign."""
    border = "border-bottom:1px solid var(--grid);"
    head = "".join(
        f'<th style="{border}text-align:{"right" if c.number else "left"};padding:.2em .6em">{escape(c.head)}'
        f"{f' / {escape(c.unit)}' if c.unit else ''}</th>"
        for c in table.columns
    )
    rows = []
    for row in table.rows:
        if row.group:
            group = f'<th colspan="{len(table.columns)}" style="text-align:left;font-weight:400;color:var(--muted)">'
            rows.append(f"<tr>{group}{escape(row.group)}</th></tr>")
        else:
            cells = "".join(map(_cell, row.cells, table.columns))
            rows.append(f"<tr>{cells}</tr>")
    caption = f'<p style="font-size:.85em;color:var(--muted);margin:.3em 0 0">{escape(table.caption)}</p>'
    body = '<table style="font:inherit;font-size:.92em;border-collapse:collapse">'
    body += f"<thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table>"
    return f'<div style="overflow-x:auto;margin:.5em 0">{body}{caption if table.caption else ""}</div>'


def _cell(cell: Cell, column: Column) -> str:
    if cell.number:
        rest = f'<span style="display:inline-block;text-align:left;width:{column.width}ch">{escape(cell.rest)}</span>'
        return f'<td style="text-align:right;white-space:nowrap;padding:.15em .6em">{escape(cell.whole)}{rest}</td>'
    mark, colour = MARKS.get(cell.mark, ("", ""))
    style = f"color:{colour};font-weight:600;" if mark else "font-weight:600;" if cell.mark == "strong" else ""
    align = f"text-align:{'right' if column.number else 'left'};"
    align += "min-width:9em;" if column.wide else "white-space:nowrap;"
    return f'<td style="{style}{align}padding:.15em .6em">{mark}{escape(cell.text)}</td>'


def figure_html(svg: str) -> str:
    """Return a figure of a report, "" where there is none."""
    from gyrobench.report.style import themed

    return f'<div style="margin:.6em 0">{themed(svg)}</div>' if svg else ""


@notebook.html.register
def result_html(result: Result) -> str:
    """Return verdict, warnings, coefficients with u, interval and verdict, and the figure of the fit or the loop."""
    from gyrobench.report.result_json import Report
    from gyrobench.report.result_page import coefficients

    report = Report.of(result)
    verdict = f"Verdict: {result.verdict}." if result.verdict != NO_VERDICT else f"{NO_VERDICT.capitalize()}."
    head = [paragraph(result.title, strong=True), paragraph(verdict), *map(paragraph, result.summary)]
    methods = [paragraph(f"Methods: {result.suite.consistency}.")] if isinstance(result, SuiteResult) else []
    blocks = coefficients(report)
    tables = [table_html(b) for b in blocks if isinstance(b, PageTable)]
    tables += [warning_list(b.items) for b in blocks if isinstance(b, BulletList)]
    return fragment(*head, *methods, warning_list(result.warnings), *tables, figure_html(_main_figure(report)))


def _main_figure(report: Report[Result]) -> str:
    """Return the first loop or response, the deviations of a drift record, or the richest fit, as SVG; "" for none."""
    from gyrobench.report import drift_record_figures, plots, responses
    from gyrobench.report.style import styled

    key, result = f"nb{report.report_id}", report.result  # unique in the notebook
    with styled():
        if isinstance(result, LoopResult) and result.responses:
            first = min(result.responses, key=lambda r: r.kind != "loop")
            return responses.draw([("measured", first)], key, curves=first.curves)
        if isinstance(result, DriftRecordResult) and result.columns:
            return drift_record_figures.deviations(result.columns[0], key)
        groups = plots.by_axis(result.series) if isinstance(result, DriftTestResult | LoopResult) else []
        return plots.fit(groups[0][:2], key, groups[0], [s for alike in groups for s in alike]) if groups else ""


@notebook.html.register
def record_html(record: Record) -> str:
    """Return the first windows, the range of each channel, and the first channels against time."""
    from gyrobench.report import channel_figure
    from gyrobench.report.style import styled

    run = record.run
    seed = "another tool" if run.seed is None else f"seed {run.seed}"
    origin = "measured" if run.measured else f"{seed}, step {run.step:g} s"
    state = "" if record.complete else f" Not complete: {run.problem or 'the run did not end'}."
    blocks = [paragraph(f"Record of {run.system}", strong=True), paragraph(f"{run.title}; {origin}.{state}")]
    blocks += [table_html(t) for t in (_first_windows(record), _channel_ranges(record)) if t.rows]
    if len(record.channels) > 1:
        shown = channel_figure.panels(record.channels, run.units, most=MAX_CHANNELS)
        key = f"nb{abs(hash((run.system, run.seed, tuple(run.tables.values()), id(record)))):x}"
        with styled():
            blocks.append(figure_html(channel_figure.draw(record.channels, shown, run.units, key, run.plan)))
    return fragment(*blocks)


def _first_windows(record: Record) -> PageTable:
    columns, units = record.table("windows")
    count = len(next(iter(columns.values()), ()))
    rows = [Row([_number(v[k].item()) for v in columns.values()]) for k in range(min(count, MAX_ROWS))]
    caption = f"Windows 1 to {len(rows)} of {count}, SI."
    return PageTable([Column(n, "" if units[n] == "1" else units[n]) for n in columns], rows, caption)


def _channel_ranges(record: Record) -> PageTable:
    columns, units = record.table("channels")
    rows = [
        Row([text_cell(name), text_cell(units[name]), *(_number(float(f())) for f in (v.min, v.mean, v.max))])
        for name, v in columns.items()
        if len(v) and name != "time"
    ]
    time: Any = columns.get("time", ())
    span = f", t = {time[0]:.6g} to {time[-1]:.6g} s" if len(time) else ""
    heads = ("channel", "unit", "smallest", "mean", "largest")
    return PageTable([Column(h) for h in heads], rows, f"Channels, {len(time)} samples each{span}; SI.")


def _number(value: float | int) -> Cell:
    written = write_number(value, significant=6)
    return Cell(written.text, written.whole, written.rest, written.full, number=True)


def comparison_html(doc: dict[str, Any], note: str) -> str:
    """Return ranking, estimates and differences to the baseline, and the first response that several runs have."""
    from gyrobench.report.comparison_page import side_figure, side_tables

    head = [paragraph("Comparison; the first run is the baseline", strong=True), warning_list([note] if note else [])]
    head += [paragraph(sentence) for sentence in doc["summary"]]
    figure = figure_html(side_figure(doc, f"nb{doc['report_id']}"))
    return fragment(*head, *map(table_html, side_tables(doc)), figure)
