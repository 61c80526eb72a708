"""From a result to the sections of its report, in the order a reader needs them."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from typing import Any

from gyrobench.record.run_document import ABOUT, SetupError
from gyrobench.report import channel_figure, diagnostics_section, method_section, plots, responses
from gyrobench.report.numbers import write_number
from gyrobench.report.page_model import (
    BulletList,
    Cell,
    Column,
    Page,
    Picture,
    ResultSummary,
    Row,
    Section,
    Table,
    Text,
    number_cell,
    pictures,
    text_cell,
)
from gyrobench.report.plain_text import no_values
from gyrobench.report.signature_section import signing
from gyrobench.report.style import styled
from gyrobench.report.tables import heading, how_tables, limit_text, unit_groups, words
from gyrobench.result import NO_VERDICT

Json = dict[str, Any]


def page(doc: Json, record: Mapping[str, Any] | None = None) -> Page:
    """Return the report of one result document (see :func:`gyrobench.report.result_json.document`).

    ``record`` may hold the decimated channels of the run: "time" in s and "slot.variable" columns; they
    are drawn as long records.
    """
    with styled():
        sections = [
            Section("Result and conformity", "answer", [answer(doc)]),
            Section("Simulated set-up errors", "setup-errors", setup_errors(doc)),
            Section("Coefficients", "coefficients", coefficients(doc)),
            Section("Measurement data", "measured", _measured(doc, record or {})),
            Section("Validity of the results", "believed", []),
            _residuals(doc),
            Section(
                "Stability: Allan deviation and spectrum", "stability", diagnostics_section.stability(doc), sub=True
            ),
            Section("Uncertainty of the estimates", "estimates", diagnostics_section.estimates(doc), sub=True),
            Section("Repeatability and step check", "repeatability", diagnostics_section.repeatability(doc), sub=True),
            Section("Uncertainty budget", "budget", diagnostics_section.budget(doc)),
            Section("Method and provenance", "how", []),
            Section("Model and conventions", "model", method_section.model(doc), sub=True),
            Section("System and test plan", "system", method_section.system(doc), sub=True),
            Section("Components, parameters and provenance", "provenance", how_tables(doc), sub=True),
            Section("Values at full precision", "values", method_section.full_values(doc), sub=True),
            Section("Statements and signatures", "signatures", signing(doc)),
        ]
    return Page(doc["title"], doc["report_id"], head(doc), sections).finish()


def _residuals(doc: Json) -> Section:
    """Return the section on the residuals of a fit, or on the errors and innovations of an estimator."""
    if doc["kind"] == "loop":
        return Section("Errors and innovations", "innovations", diagnostics_section.innovations(doc), sub=True)
    return Section("Residuals", "residuals", diagnostics_section.residuals(doc), sub=True)


def head(doc: Json) -> list[tuple[str, str]]:
    run = doc["provenance"]
    site = place(doc["site"])
    rows = [
        ("Report", doc["report_id"]),
        ("Date", date(str(run.get("date") or "not recorded"))),
        ("Instrument", doc["instrument"] or "not named"),
        ("Site", site or "not stated"),
        ("Operator", str(run.get("operator") or "not recorded")),
        *((name.capitalize(), str(run[name])) for name in ABOUT if run.get(name)),
        ("Method", doc["method"]),
        ("Data", f"simulated, system {doc['system']}" if doc["simulated"] else f"measured, system {doc['system']}"),
    ]
    return rows


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


def answer(doc: Json) -> ResultSummary:
    rows = []
    for k, c in enumerate(doc["coefficients"]):
        if c["limit"] is None:
            continue
        path, u = ("coefficients", k), c["u"]
        rows.append(
            Row(
                [
                    text_cell(c["name"], "strong"),
                    text_cell(c["meaning"]),
                    number_cell(doc, (*path, "estimate"), u),
                    number_cell(doc, ("derived", "U", k), u),
                    text_cell(c["unit"]),
                    text_cell(limit_text(c["limit"])),
                    text_cell(c["verdict"], c["verdict"]),
                ]
            )
        )
    columns = [
        Column("requirement"),
        Column("meaning", wide=True),
        Column("estimate"),
        Column("U (95 %)"),
        Column("unit"),
        Column("limit"),
        Column("verdict"),
    ]
    table = Table(columns, rows, "Conformity with each requirement.") if rows else None
    rule = doc["decision_rule"] if rows or doc["verdict"] != NO_VERDICT else ""
    return ResultSummary(doc["verdict"], rule, doc["summary"], doc["warnings"], table)


def setup_errors(doc: Json) -> list[Any]:
    """Return what was set past the options of the test; nothing where nothing was."""
    errors = [SetupError.model_validate(e) for e in doc["provenance"].get("setup_errors") or []]
    if not errors:
        return []
    text = (
        "The simulated instrument or its set-up differs from what the test assumes. The estimates, their u and their "
        "verdicts do not allow for these errors."
    )
    return [Text(text), BulletList([e.sentence() for e in errors], warn=True)]


def coefficients(doc: Json) -> list[Any]:
    limits = any(c["limit"] is not None for c in doc["coefficients"])
    truth = any(c["truth"] is not None for c in doc["coefficients"])
    columns = [
        Column("name"),
        Column("meaning", wide=True),
        Column("estimate"),
        Column("u"),
        Column("95 % from"),
        Column("to"),
    ]
    columns += [Column("truth"), Column("z")] if truth else []
    columns += [Column("limit"), Column("verdict")] if limits else []
    groups = unit_groups(doc["coefficients"])
    if not groups:
        columns.insert(4, Column("unit"))
    rows: list[Row] = []
    for unit, members in groups or [("", list(range(len(doc["coefficients"]))))]:
        rows += [heading(f"in {unit}")] if groups else []
        for k in members:
            c = doc["coefficients"][k]
            path, u = ("coefficients", k), c["u"]
            cells = [
                text_cell(c["name"], "strong"),
                text_cell(c["meaning"]),
                text_cell("no value", "warn") if c["no_value"] else number_cell(doc, (*path, "estimate"), u),
                number_cell(doc, (*path, "u"), u),
                *([] if groups else [text_cell(c["unit"])]),
                number_cell(doc, (*path, "interval", 0), u),
                number_cell(doc, (*path, "interval", 1), u),
            ]
            if truth:
                cells += [number_cell(doc, (*path, "truth"), u), number_cell(doc, (*path, "z"), 0.1)]
            if limits:
                verdict = c["verdict"] if c["limit"] is not None or c["no_value"] else "–"
                cells += [text_cell(limit_text(c["limit"])), text_cell(verdict, verdict)]
            rows.append(Row(cells))
    note = (
        f"u: {_uncertainty(doc)}; estimates are rounded to its second significant digit. 95 % from, to: limits of the "
        "coverage interval."
    )
    if truth:
        note += " Truth: true value in the simulation; z = (estimate − truth) / u."
    if not limits:
        note += " No specification was applied; conformity is not stated."
    missing = no_values((c["name"], c["no_value"]) for c in doc["coefficients"])
    table = [Table(columns, rows, f"Coefficients. {note}")] if rows else []
    return [*table, BulletList(missing, warn=True)] if missing else table


def _uncertainty(doc: Json) -> str:
    """Return what u is: combined, or of type A only, and why."""
    run = doc["provenance"]
    valued = [c for c in doc["coefficients"] if c["u"] is not None]
    if any(c["u_a"] is None or c["u"] > c["u_a"] * (1.0 + 1e-9) for c in valued):
        return "combined standard uncertainty"
    if not run.get("measured"):
        return "standard uncertainty, type A only (no uncertainty of type B was set)"
    why = "type B is declared absent" if run.get("type_b") == "none" else "no statement of type B"
    return f"standard uncertainty, type A only: {why}"


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _channels(run: Json, record: Mapping[str, Any]) -> list[Any]:
    """Return the figure of the channels that the system shows."""
    units = run.get("units") or {}
    shown = channel_figure.panels(record, units, run.get("shown") or ())
    caption = (
        "Recorded channels against time. Long records are drawn as the envelope of minimum and maximum in each "
        "interval."
    )
    names = [n for panel in shown for n in panel]
    left = [n for n in record if n != "time" and n not in names]
    caption += f" Not drawn: {', '.join(left)}." if left else ""
    svg = channel_figure.draw(record, shown, units, "channels", run.get("plan") or ()) if shown else ""
    alt = "Recorded channels against time: " + ", ".join(names)
    return pictures(Picture("channels", svg, caption, alt, zoom=True))


def _measured(doc: Json, record: Mapping[str, Any]) -> list[Any]:
    curves = [s for s in doc["series"] if plots.is_curve(s)]
    blocks: list[Any] = responses.blocks(doc)
    number = 0
    axes = Counter(axis for s in curves for axis in [(s["x_name"], s["x_unit"])] * len(s["x"]))
    for axis, _ in axes.most_common():  # the richest record first
        alike = [s for s in curves if (s["x_name"], s["x_unit"]) == axis]
        for k in range(0, len(alike), 2):
            pair = alike[k : k + 2]
            number += 1
            key = f"fit-{number}"
            both = " and ".join(f"“{s['label']}”" for s in pair)
            caption = (
                f"{_capital(pair[0]['y_name'])} against {axis[0]}, {both}. Points: window means; line: fitted model; "
                f"lower panel: residuals. A pattern in the residuals is evidence against the model."
            )
            alt = f"Points and fitted curve with residuals: {both}"
            blocks += pictures(Picture(key, plots.fit(pair, key, alike, curves), caption, alt))
    blocks += _channels(doc["provenance"], record)
    rows = []
    for k, s in enumerate(doc["series"]):
        rows.append(
            Row(
                [
                    text_cell(s["label"]),
                    Cell(text=str(len(s["y"])), whole=str(len(s["y"])), full=str(len(s["y"])), number=True),
                    text_cell(f"{s['y_name']} / ({s['y_unit']})"),
                    *(
                        number_cell(doc, ("derived", "series", k, name), doc["residual_std"])
                        for name in ("mean", "residual_rms")
                    ),
                ]
            )
        )
    columns = [
        Column("series", wide=True),
        Column("windows"),
        Column("quantity"),
        Column("mean"),
        Column("residual rms"),
    ]
    if rows:
        blocks.append(
            Table(
                columns,
                rows,
                "Measured series: mean of the windows and rms residual, in the unit of the quantity.",
            )
        )
    return blocks
