"""From a result to the sections of its report, in the order a reader needs them."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

from gyrobench.record.run_document import ABOUT
from gyrobench.report import channel_figure, diagnostics_section, method_section, plots, responses
from gyrobench.report.numbers import write_number
from gyrobench.report.page_model import (
    BulletList,
    Cell,
    Page,
    PageTable,
    Picture,
    ResultSummary,
    Row,
    Section,
    Text,
    columns,
    number_cell,
    pictures,
    text_cell,
)
from gyrobench.report.plain_text import no_values
from gyrobench.report.provenance import Provenance
from gyrobench.report.result_json import Report
from gyrobench.report.signature_section import signing
from gyrobench.report.style import styled
from gyrobench.report.tables import heading, how_tables, limit_text, unit_groups, words
from gyrobench.result import NO_VERDICT, Coefficient, DriftTestResult, LoopResult, Result, Series

RunResult = DriftTestResult | LoopResult


def page(report: Report[RunResult], record: Mapping[str, Any] | None = None) -> Page:
    """Return the page of the report of a drift test or a loop.

    ``record`` may hold the decimated channels of the run: "time" in s and "slot.variable" columns; they
    are drawn as long records.
    """
    with styled():
        sections = [
            *opening(report, "Coefficients"),
            Section("Measurement data", "measured", _measured(report, record or {})),
            Section("Validity of the results", "believed", []),
            *diagnostics_section.validity(report),
            Section("Uncertainty budget", "budget", diagnostics_section.budget(report)),
            *closing(report),
        ]
    return Page(report.result.title, report.report_id, head(report), sections).finish()


def opening(report: Report[Result], title: str) -> list[Section]:
    """Return the first sections of the report of a record: answer, set-up errors, coefficients under a title."""
    return [
        Section("Result and conformity", "answer", [answer(report)]),
        Section("Simulated set-up errors", "setup-errors", setup_errors(report)),
        Section(title, "coefficients", coefficients(report)),
    ]


def closing(report: Report[Result]) -> list[Section]:
    """Return the last sections of the report of a record."""
    return [
        Section("Method and provenance", "how", []),
        Section("Model and conventions", "model", method_section.model(report.result), sub=True),
        Section("System and test plan", "system", method_section.system(report), sub=True),
        Section("Components, parameters and provenance", "provenance", how_tables(report), sub=True),
        Section("Values at full precision", "values", method_section.full_values(report), sub=True),
        Section("Statements and signatures", "signatures", signing(report)),
    ]


def head(report: Report[Result]) -> list[tuple[str, str]]:
    """Return the lines at the head of a report: name and text."""
    result, about = report.result, report.about
    return [
        ("Report", report.report_id),
        ("Date", date(about.date or "not recorded")),
        ("Instrument", result.instrument or "not named"),
        ("Site", place(result.site) or "not stated"),
        ("Operator", about.operator or "not recorded"),
        *((name.capitalize(), text) for name in ABOUT if (text := getattr(about, name))),
        ("Method", result.method),
        ("Data", f"{'simulated' if result.simulated else 'measured'}, system {result.system}"),
    ]


def place(site: Mapping[str, Any]) -> str:
    """ "latitude 45.75°, gravity 9.8069 m/s²" """
    return ", ".join(f"{words(k)[0]} {_plain(v)}{_unit(k)}" for k, v in site.items() if v is not None)


def date(text: str) -> str:
    """ "2026-03-14T09:30:00Z" for people; other texts stay as they are."""
    match = re.fullmatch(r"(\d{4}-\d\d-\d\d)T(\d\d:\d\d)[\d:.]*(Z|\+00:00)", text)
    return f"{match[1]} {match[2]} UTC" if match else text


def _plain(value: Any) -> str:
    return write_number(value, significant=8).text if isinstance(value, int | float) else str(value)


def _unit(key: str) -> str:
    unit = words(key)[1]
    return "" if not unit else unit if unit == "°" else f" {unit}"


def answer(report: Report[Result]) -> ResultSummary:
    """Return the box with verdict, summary and warnings, and the table of the requirements."""
    result, doc = report.result, report.document
    rows = []
    for k, c in enumerate(result.coefficients):
        if c.limit is not None:
            cells = [
                text_cell(c.name, "strong"),
                text_cell(c.meaning),
                number_cell(doc, ("coefficients", k, "estimate"), c.u),
                number_cell(doc, ("derived", "U", k), c.u),
                *(text_cell(x) for x in (c.unit, limit_text(c.limit))),
                text_cell(c.verdict, c.verdict),
            ]
            rows.append(Row(cells))
    heads = columns("requirement", "meaning", "estimate", "U (95 %)", "unit", "limit", "verdict", wide=("meaning",))
    table = PageTable(heads, rows, "Conformity with each requirement.") if rows else None
    rule = result.decision_rule if rows or result.verdict != NO_VERDICT else ""
    return ResultSummary(result.verdict, rule, result.summary, result.warnings, table)


def setup_errors(report: Report[Result]) -> list[Any]:
    """Return what was set past the options of the test; nothing where nothing was."""
    errors = report.run.setup_errors
    text = (
        "The simulated instrument or its set-up differs from what the test assumes. The estimates, their u and their "
        "verdicts do not allow for these errors."
    )
    return [Text(text), BulletList([e.sentence() for e in errors], warn=True)] if errors else []


def coefficients(report: Report[Result]) -> list[Any]:
    """Return the table of the coefficients, and why some have no value."""
    result = report.result
    limits = any(c.limit is not None for c in result.coefficients)
    truth = any(c.truth is not None for c in result.coefficients)
    heads = ["name", "meaning", "estimate", "u", "95 % from", "to"]
    heads += [*(["truth", "z"] if truth else []), *(["limit", "verdict"] if limits else [])]
    groups = unit_groups(result.coefficients)
    if not groups:
        heads.insert(4, "unit")
    rows: list[Row] = []
    for unit, members in groups or [("", list(range(len(result.coefficients))))]:
        rows += [heading(f"in {unit}")] if groups else []
        rows += [Row(_coefficient(report, k, not groups, truth, limits)) for k in members]
    note = (
        f"u: {what_u_is(report)}; estimates are rounded to its second significant digit. 95 % from, to: limits of "
        "the coverage interval."
    )
    if truth:
        note += " Truth: true value in the simulation; z = (estimate − truth) / u."
    if not limits:
        note += " No specification was applied; conformity is not stated."
    missing = no_values((c.name, c.no_value) for c in result.coefficients)
    table = [PageTable(columns(*heads, wide=("meaning",)), rows, f"Coefficients. {note}")] if rows else []
    return [*table, BulletList(missing, warn=True)] if missing else table


def _coefficient(report: Report[Result], k: int, unit: bool, truth: bool, limits: bool) -> list[Cell]:
    """Return the cells of a coefficient, with those that its table has."""
    c: Coefficient = report.result.coefficients[k]

    def number(*path: str | int, u: float = c.u) -> Cell:
        return number_cell(report.document, ("coefficients", k, *path), u)

    cells = [
        text_cell(c.name, "strong"),
        text_cell(c.meaning),
        text_cell("no value", "warn") if c.no_value else number("estimate"),
        number("u"),
        *([text_cell(c.unit)] if unit else []),
        number("interval", 0),
        number("interval", 1),
        *([number("truth"), number("z", u=0.1)] if truth else []),
    ]
    if limits:
        verdict = "–" if c.verdict == NO_VERDICT else c.verdict
        cells += [text_cell(limit_text(c.limit)), text_cell(verdict, verdict)]
    return cells


def what_u_is(report: Report[Result]) -> str:
    """Return what u is: combined, or of type A only, and why."""
    valued = [c for c in report.result.coefficients if math.isfinite(c.u)]
    if any(c.u_a is None or c.u > c.u_a * (1.0 + 1e-9) for c in valued):
        return "combined standard uncertainty"
    run = report.about
    if not isinstance(run, Provenance) or not run.measured:
        return "standard uncertainty, type A only (no uncertainty of type B was set)"
    why = "type B is declared absent" if run.type_b == "none" else "no statement of type B"
    return f"standard uncertainty, type A only: {why}"


def _channels(run: Provenance, record: Mapping[str, Any]) -> list[Any]:
    """Return the figure of the channels that the system shows."""
    shown = channel_figure.panels(record, run.units, run.shown)
    caption = (
        "Recorded channels against time. Long records are drawn as the envelope of minimum and maximum in each "
        "interval."
    )
    names = [n for panel in shown for n in panel]
    left = [n for n in record if n != "time" and n not in names]
    caption += f" Not drawn: {', '.join(left)}." if left else ""
    svg = channel_figure.draw(record, shown, run.units, "channels", run.plan) if shown else ""
    alt = "Recorded channels against time: " + ", ".join(names)
    return pictures(Picture("channels", svg, caption, alt, zoom=True))


def _measured(report: Report[RunResult], record: Mapping[str, Any]) -> list[Any]:
    result = report.result
    blocks = [*responses.blocks(report), *_fits(result.series), *_channels(report.run, record)]
    rows = []
    for k, s in enumerate(result.series):
        count = str(len(s.y))
        moments = [
            number_cell(report.document, ("derived", "series", k, name), result.residual_std)
            for name in ("mean", "residual_rms")
        ]
        windows = Cell(text=count, whole=count, full=count, number=True)
        rows.append(Row([text_cell(s.label), windows, text_cell(f"{s.y_name} / ({s.y_unit})"), *moments]))
    if rows:
        caption = "Measured series: mean of the windows and rms residual, in the unit of the quantity."
        heads = columns("series", "windows", "quantity", "mean", "residual rms", wide=("series",))
        blocks.append(PageTable(heads, rows, caption))
    return blocks


def _fits(series: Sequence[Series]) -> list[Any]:
    """Return the figures of the series with their fits, two in each, the richest record first."""
    groups = plots.by_axis(series)
    curves = [s for alike in groups for s in alike]
    blocks: list[Any] = []
    number = 0
    for alike in groups:
        for k in range(0, len(alike), 2):
            pair, name = alike[k : k + 2], alike[k].y_name
            number += 1
            key = f"fit-{number}"
            both = " and ".join(f"“{s.label}”" for s in pair)
            caption = (
                f"{name[:1].upper()}{name[1:]} against {pair[0].x_name}, {both}. Points: window means; line: fitted "
                "model; lower panel: residuals. A pattern in the residuals is evidence against the model."
            )
            alt = f"Points and fitted curve with residuals: {both}"
            same = [s for s in curves if (s.y_name, s.y_unit) == (pair[0].y_name, pair[0].y_unit)]
            blocks += pictures(Picture(key, plots.fit(pair, key, alike, same), caption, alt))
    return blocks
