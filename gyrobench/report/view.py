"""From a result to the sections of its report, in the order a reader needs them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from . import drawing, plots
from .blocks import (
    Answer,
    Cell,
    Column,
    Equation,
    Fold,
    Items,
    Page,
    Picture,
    Pictures,
    Row,
    Section,
    Table,
    Text,
    number_cell,
    text_cell,
    walk,
)
from .document import look
from .numbers import write_number, write_p
from .style import styled
from .tables import generic, heading, how_tables, limit_text, words

Json = dict[str, Any]


def page(doc: Json, record: Mapping[str, Any] | None = None) -> Page:
    """The report of one result document (see :func:`gyrobench.report.document.document`).

    ``record`` may hold the decimated channels of the run: "time" in s and "slot.variable" columns; they
    are drawn as long records.
    """
    with styled():
        sections = [
            Section("The answer", "answer", [_answer(doc)]),
            Section("Coefficients", "coefficients", _coefficients(doc)),
            Section("What was measured", "measured", _measured(doc, record or {})),
            Section("Can it be believed", "believed", []),
            Section("Residuals", "residuals", _residuals(doc), sub=True),
            Section("Drift in time and frequency", "stability", _stability(doc), sub=True),
            Section("The estimates", "estimates", _estimates(doc), sub=True),
            Section("Repeatability and step", "repeatability", _repeatability(doc), sub=True),
            Section("Error budget", "budget", _budget(doc)),
            Section("How it was done", "how", []),
            Section("Model and conventions", "model", _model(doc), sub=True),
            Section("System and plan", "system", _system(doc), sub=True),
            Section("Parts, parameters and provenance", "provenance", how_tables(doc), sub=True),
            Section("Full values", "values", _full_values(doc), sub=True),
        ]
    return Page(doc["title"], doc["report_id"], _head(doc), sections).finish()


def _head(doc: Json) -> list[tuple[str, str]]:
    run = doc["provenance"]
    site = ", ".join(f"{words(k)[0]} {_plain(v)}{_unit(k)}" for k, v in doc["site"].items() if v is not None)
    rows = [
        ("Report", doc["report_id"]),
        ("Date", str(run.get("date") or "not recorded")),
        ("Instrument", doc["instrument"] or "not named"),
        ("Site", site or "not stated"),
        ("Operator", str(run.get("operator") or "not recorded")),
        ("Method", doc["method"]),
        ("Data", f"simulated, system {doc['system']}" if doc["simulated"] else f"measured, system {doc['system']}"),
    ]
    return rows


def _plain(value: Any) -> str:
    return write_number(value, significant=8).text if isinstance(value, int | float) else str(value)


def _unit(key: str) -> str:
    unit = words(key)[1]
    return "" if not unit else unit if unit == "°" else f" {unit}"


def _answer(doc: Json) -> Answer:
    rows = []
    for k, c in enumerate(doc["coefficients"]):
        if c["limit"] is None:
            continue
        path, u = ("coefficients", k), c["u"]
        rows.append(
            Row(
                [
                    text_cell(c["name"], "strong"),
                    number_cell(doc, (*path, "estimate"), u),
                    number_cell(doc, ("derived", "U", k), u),
                    text_cell(c["unit"]),
                    text_cell(limit_text(c["limit"])),
                    text_cell(c["verdict"], c["verdict"]),
                ]
            )
        )
    columns = [Column("requirement"), Column("estimate"), Column("U (95\N{NO-BREAK SPACE}%)"), Column("unit"), Column("limit"), Column("verdict")]
    table = Table(columns, rows, "Verdict per requirement.") if rows else None
    rule = doc["decision_rule"] if rows or doc["verdict"] != "no specification given" else ""
    return Answer(doc["verdict"], rule, doc["summary"], doc["warnings"], table)


def _coefficients(doc: Json) -> list[Any]:
    limits = any(c["limit"] is not None for c in doc["coefficients"])
    truth = any(c["truth"] is not None for c in doc["coefficients"])
    columns = [Column("name"), Column("meaning", wide=True), Column("estimate"), Column("u"), Column("95\N{NO-BREAK SPACE}% from"), Column("to")]
    columns += [Column("truth"), Column("z")] if truth else []
    columns += [Column("limit"), Column("verdict")] if limits else []
    rows: list[Row] = []
    for unit in dict.fromkeys(c["unit"] for c in doc["coefficients"]):
        rows.append(heading(f"in {unit}"))
        for k, c in enumerate(doc["coefficients"]):
            if c["unit"] != unit:
                continue
            path, u = ("coefficients", k), c["u"]
            cells = [
                text_cell(c["name"], "strong"),
                text_cell(c["meaning"]),
                number_cell(doc, (*path, "estimate"), u),
                number_cell(doc, (*path, "u"), u),
                number_cell(doc, (*path, "interval", 0), u),
                number_cell(doc, (*path, "interval", 1), u),
            ]
            if truth:
                cells += [number_cell(doc, (*path, "truth"), u), number_cell(doc, (*path, "z"), 0.1)]
            if limits:
                verdict = c["verdict"] if c["limit"] is not None else "–"
                cells += [text_cell(limit_text(c["limit"])), text_cell(verdict, verdict)]
            rows.append(Row(cells))
    note = "u: combined standard uncertainty; estimates are rounded to its second significant digit."
    if truth:
        note += " Truth: the value the simulation was given; z = (estimate − truth) / u."
    if not limits:
        note += " No specification given: no limits, no verdict."
    return [Table(columns, rows, f"Coefficients. {note}")] if rows else []


def _pictures(*pictures: Picture) -> list[Any]:
    shown = [p for p in pictures if p.svg]
    return [Pictures(shown)] if shown else []


def _measured(doc: Json, record: Mapping[str, Any]) -> list[Any]:
    curves = [s for s in doc["series"] if plots.is_curve(s)]
    blocks: list[Any] = []
    for k in range(0, len(curves), 2):
        pair = curves[k : k + 2]
        first = pair[0]
        key = f"fit-{k // 2 + 1}"
        names = " and ".join(f"“{s['label']}”" for s in pair)
        caption = (
            f"{first['y_name'].capitalize()} against {first['x_name']}, {names}. Points: measured windows; line: the fitted "
            f"model; beneath: what is left. A model that fits leaves no pattern beneath."
        )
        blocks += _pictures(Picture(key, plots.fit(pair, key, curves), caption, f"Points and fitted curve with residuals: {names}"))
    for k, name in enumerate(n for n in record if n != "time"):
        key = f"channel-{k + 1}"
        svg = plots.channels(record, name, name, "SI", key)
        caption = f"Recorded channel {name}, in SI units; long records are drawn by their smallest and largest values."
        blocks += _pictures(Picture(key, svg, caption, f"Record of {name} against time", zoom=True))
    rows = []
    for k, s in enumerate(doc["series"]):
        rows.append(
            Row(
                [
                    text_cell(s["label"]),
                    Cell(text=str(len(s["y"])), whole=str(len(s["y"])), full=str(len(s["y"])), number=True),
                    text_cell(f"{s['y_name']} / ({s['y_unit']})"),
                    *(number_cell(doc, ("derived", "series", k, name), doc["residual_std"]) for name in ("mean", "residual_rms")),
                ]
            )
        )
    columns = [Column("series", wide=True), Column("windows"), Column("quantity"), Column("mean"), Column("residual rms")]
    if rows:
        blocks.append(Table(columns, rows, "Measured series: mean of the windows and rms of the residuals, in the unit of the quantity."))
    return blocks


def _residuals(doc: Json) -> list[Any]:
    residuals = [r for s in doc["series"] for r in s["residual"]]
    blocks = _pictures(
        Picture(
            "residuals-time",
            plots.residuals_in_time(doc["series"], "residuals-time"),
            "Residuals against time, mounts or phases shaded and named. A drift or a jump would show here.",
            "Residuals of all windows against time",
            zoom=True,
        )
    )
    blocks += _pictures(
        Picture(
            "acf",
            plots.acf(doc["acf"], "acf") if doc["acf"] else "",
            "Autocorrelation of the residuals. Band: 95\N{NO-BREAK SPACE}% bounds for white noise; bars outside it mean correlated noise.",
            "Autocorrelation of the residuals against lag, with bounds",
            half=True,
        ),
        Picture(
            "quantiles",
            plots.quantiles(residuals, "quantiles"),
            "Residuals against normal quantiles. On the line and inside the 95\N{NO-BREAK SPACE}% band: normal; bent ends: outliers.",
            "Q-Q plot of the residuals against a normal distribution",
            half=True,
        ),
    )
    rows = []
    for k, test in enumerate(doc["tests"]):
        mark = "warn" if test["p"] is not None and test["p"] < 0.01 else ""
        rows.append(
            Row(
                [
                    text_cell(test["name"], "strong"),
                    text_cell(test["what"]),
                    number_cell(doc, ("tests", k, "statistic"), significant=3, trim=False),
                    number_cell(doc, ("tests", k, "p"), write=write_p, mark=mark),
                    text_cell(test["finding"]),
                ]
            )
        )
    columns = [Column("test"), Column("looks for", wide=True), Column("statistic"), Column("p"), Column("finding", wide=True)]
    if rows:
        blocks.append(Table(columns, rows, "Tests of the residuals. A small p speaks against what the model assumes."))
    spread = number_cell(doc, ("residual_std",))
    sentence = f"Residual standard deviation {spread.text} {doc['residual_unit']} with {_plain(doc['dof'])} degrees of freedom."
    return [Text(sentence), *blocks, *generic(doc, ("noise",), "Noise model of the estimation.")]


def _stability(doc: Json) -> list[Any]:
    blocks = _pictures(
        Picture(
            "allan",
            plots.allan(doc["allan"], "allan") if doc["allan"].get("tau") else "",
            "Allan deviation with its 95\N{NO-BREAK SPACE}% interval. Slope −½: white noise; flat: bias instability; +½: random walk.",
            "Allan deviation against averaging time, logarithmic axes",
            half=True,
        ),
        Picture(
            "psd",
            plots.psd(doc["psd"], "psd") if doc["psd"].get("f") else "",
            "Power spectral density of the residuals. Flat: white; a line above it: a periodic disturbance.",
            "Power spectral density of the residuals, logarithmic axes",
            half=True,
        ),
    )
    return blocks + generic(doc, ("allan", "slopes"), "Slopes of the Allan deviation.")


def _estimates(doc: Json) -> list[Any]:
    names = [c["name"] for c in doc["coefficients"]]
    condition = number_cell(doc, ("condition",), significant=3).text
    blocks: list[Any] = [
        Text(
            f"The regression has rank {doc['rank']} for {len(names)} reported estimates; its condition number is "
            f"{condition}. Above 100 a small error of the model makes a large one in some combination."
        )
    ]
    columns = [Column(h) for h in ("name", "u, type A", "dof", "k", "U (95\N{NO-BREAK SPACE}%)", "t", "p (t)", "closed formula", "difference")]
    rows: list[Row] = []
    for unit in dict.fromkeys(c["unit"] for c in doc["coefficients"]):
        rows.append(heading(f"u, U, closed formula and difference in {unit}"))
        for k, c in enumerate(doc["coefficients"]):
            if c["unit"] == unit:
                path, u = ("coefficients", k), c["u"]
                rows.append(
                    Row(
                        [
                            text_cell(c["name"], "strong"),
                            number_cell(doc, (*path, "u_a"), u),
                            number_cell(doc, (*path, "dof")),
                            number_cell(doc, (*path, "k"), 0.1),
                            number_cell(doc, ("derived", "U", k), u),
                            number_cell(doc, (*path, "t"), significant=3, trim=False),
                            number_cell(doc, (*path, "p"), write=write_p),
                            number_cell(doc, (*path, "closed"), u),
                            number_cell(doc, ("derived", "closed_minus_estimate", k), significant=2),
                        ]
                    )
                )
    caption = "Uncertainty of each estimate, and the book's closed formula against the reported estimate."
    blocks.append(Table(columns, rows, caption, small=True))
    z = [c["z"] for c in doc["coefficients"]]
    blocks += _pictures(
        Picture(
            "correlation",
            plots.correlation(doc["correlation"], names, "correlation"),
            "Correlation of the estimates. Near ±1 two coefficients are known only in combination.",
            "Correlation matrix of the estimates, lower triangle, as coloured cells with numbers",
            half=len(names) < 11,
        ),
        Picture(
            "scores",
            plots.scores(names, z, [c["k"] for c in doc["coefficients"]], "scores"),
            "Estimates against truth in units of u. Band: ±k; 95\N{NO-BREAK SPACE}% of the points should lie inside.",
            "Estimate minus truth over standard uncertainty, one point per coefficient",
            half=True,
        ),
    )
    return blocks + generic(doc, ("harmonics",), "Harmonics of the record. Those the model does not hold should be noise.", by_u=True)


def _repeatability(doc: Json) -> list[Any]:
    blocks = generic(doc, ("repeatability",), "Repeatability.")
    blocks += generic(doc, ("step_check",), "Step check: the same run with half the step; change of each coefficient against u.")
    for k, table in enumerate(doc["tables"]):
        columns = [Column(str(h)) for h in table.get("columns", [])]
        rows = [
            Row([number_cell(doc, ("tables", k, "rows", i, j)) for j in range(len(columns))])
            for i in range(len(table.get("rows", [])))
        ]
        caption = ". ".join(t.rstrip(".") for t in (table.get("title", ""), table.get("caption", "")) if t)
        blocks.append(Table(columns, rows, f"{caption}."))
    return blocks


def _budget(doc: Json) -> list[Any]:
    lines = doc["budget"]
    if not lines:
        return []
    u = {c["name"]: c["u"] for c in doc["coefficients"]}
    rows = []
    for name in dict.fromkeys(b["coefficient"] for b in lines):
        mine = [k for k, b in enumerate(lines) if b["coefficient"] == name]
        unit = lines[mine[0]]["unit"]
        rows.append(heading(f"{name}, contribution in {unit}"))
        for k in sorted(mine, key=lambda k: -(lines[k]["contribution"] or 0.0)):
            b = lines[k]
            rows.append(
                Row(
                    [
                        text_cell(b["source"]),
                        number_cell(doc, ("budget", k, "size"), significant=3, trim=False),
                        text_cell(b["size_unit"]),
                        number_cell(doc, ("budget", k, "sensitivity"), significant=3, trim=False),
                        text_cell(b["sensitivity_unit"]),
                        number_cell(doc, ("budget", k, "contribution"), significant=2, trim=False),
                        text_cell(b["note"]),
                    ]
                )
            )
        total = number_cell(doc, ("derived", "budget_sum", name), u.get(name))
        blank = [text_cell("")] * 4
        rows.append(Row([text_cell("sum (root of squares)", "strong"), *blank, total, text_cell("")]))
        index = next((k for k, c in enumerate(doc["coefficients"]) if c["name"] == name), None)
        if index is not None:
            stated = number_cell(doc, ("coefficients", index, "u"), u.get(name))
            rows.append(Row([text_cell("u stated", "strong"), *blank, stated, text_cell("")]))
    heads = ("source", "size", "unit", "sensitivity", "unit", "contribution", "note")
    columns = [Column(h, wide=h in ("source", "note")) for h in heads]
    alt = "Error budget as bars: contribution of each source to the uncertainty of the coefficients"
    caption = "Error budget. Which source makes the uncertainty, and whether the known sources explain the stated u."
    table = Table(columns, rows, "Error budget: size times sensitivity of each source, as standard uncertainties.", small=True)
    return [*_pictures(Picture("budget", drawing.budget(lines, u, "budget"), caption, alt)), Fold("Every line of the budget", [table])]


def _model(doc: Json) -> list[Any]:
    blocks: list[Any] = [Equation(doc["equation"])] if doc["equation"] else []
    blocks += [Items(doc["conventions"])] if doc["conventions"] else []
    blocks += [Text("Sources: " + "; ".join(doc["sources"]) + ".", quiet=True)] if doc["sources"] else []
    return blocks


def _system(doc: Json) -> list[Any]:
    run = doc["provenance"]
    order = [str(s) for s in run.get("order") or []]
    blocks: list[Any] = []
    if order:
        caption = (
            "The system as it ran: parts on the diagonal in execution order. Above it (solid) values of this step go forward; "
            "below it (dashed) values of the step before go back."
        )
        svg = drawing.system(order, run, "system")
        blocks += _pictures(Picture("system", svg, caption, "Parts in execution order with their wires: " + ", ".join(order)))
        cuts, delays = run.get("cuts") or [], run.get("delays") or []
        blocks.append(Items([f"Order: {', '.join(order)}.", f"Cut at: {_ends(cuts)}.", f"Delayed by one step: {_ends(delays)}."]))
    rows = []
    keys = ("phase", "label", "mode", "face", "angle_deg", "rate_deg_per_h", "settle_s", "dwell_s", "travel_deg", "window_s", "window_deg")
    heads = [("phase", ""), ("label", ""), ("mode", ""), ("face", ""), ("angle", "°"), ("rate", "°/h"), ("settle", "s"), ("dwell", "s")]
    heads += [("travel", "°"), ("window", "s"), ("window", "°")]
    plan = doc["derived"]["plan"]
    for k in range(len(plan)):
        rows.append(Row([number_cell(doc, ("derived", "plan", k, key), significant=7) for key in keys]))
    if rows:
        empty = [all(look(plan, k, key) in (None, "") for k in range(len(plan))) for key in keys]
        for row in rows:
            row.cells = [c for c, e in zip(row.cells, empty, strict=True) if not e]
        columns = [Column(h, unit) for (h, unit), e in zip(heads, empty, strict=True) if not e]
        blocks.append(Table(columns, rows, "Plan of the test.", small=True))
    return blocks


def _ends(wires: Any) -> str:
    """Cut or delayed wires in words."""
    if isinstance(wires, Mapping):
        return ", ".join(f"{k} ({v})" for k, v in wires.items()) or "nothing"
    parts = [w if isinstance(w, str) else " → ".join(str(e) for e in (w.values() if isinstance(w, Mapping) else w)) for w in wires]
    return ", ".join(parts) or "nothing"


def _full_values(doc: Json) -> list[Any]:
    """All digits of the estimates: the proof that page and result.json hold the same numbers."""
    rows = []
    for k, c in enumerate(doc["coefficients"]):
        path = ("coefficients", k)
        cells = [number_cell(doc, (*path, *p)) for p in (("estimate",), ("u",), ("interval", 0), ("interval", 1))]
        rows.append(Row([text_cell(c["name"], "strong"), *(Cell(x.full or "–", pointer=x.pointer, full=x.full) for x in cells)]))
    columns = [Column("name"), Column("estimate"), Column("u"), Column("95\N{NO-BREAK SPACE}% from"), Column("to")]
    return [Fold("All digits, as in result.json", [Table(columns, rows, "Full values of the estimates, units as in the table of coefficients.", small=True)])]


__all__ = ["page", "walk"]
