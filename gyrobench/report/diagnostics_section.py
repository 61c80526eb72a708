"""Sections on the validity of a result: residuals, stability, uncertainty, repeatability, uncertainty budget."""

from __future__ import annotations

from typing import Any

from gyrobench.reduction.estimation.step_effect import step_text
from gyrobench.report import budget_figure, plots
from gyrobench.report.numbers import write_number, write_p
from gyrobench.report.page_model import (
    CollapsedBlocks,
    Column,
    Picture,
    Row,
    Table,
    Text,
    number_cell,
    pictures,
    text_cell,
)
from gyrobench.report.plain_text import step_sentence
from gyrobench.report.tables import heading, render_value, unit_groups, words

Json = dict[str, Any]


def residuals(doc: Json) -> list[Any]:
    if not doc["series"] and not doc["tests"]:
        return render_value(doc, ("noise",), "Noise model of the estimation.")
    values = [r for s in doc["series"] for r in s["residual"]]
    blocks = pictures(
        Picture(
            "residuals-time",
            plots.residuals_in_time(doc["series"], "residuals-time"),
            "Residuals against time, phases shaded and labelled. A trend or a step is drift outside the model.",
            "Residuals of all windows against time",
            zoom=True,
        )
    )
    blocks += pictures(
        Picture(
            "acf",
            plots.acf(doc["acf"], "acf") if doc["acf"] else "",
            "Autocorrelation of the residuals. Band: 95 % bounds for white noise; bars outside it: correlated noise.",
            "Autocorrelation of the residuals against lag, with bounds",
            half=True,
        ),
        Picture(
            "quantiles",
            plots.quantiles(values, "quantiles"),
            "Residuals against normal quantiles. Points on the line and inside the 95 % band are compatible with a "
            "normal distribution; points off it at the ends are outliers.",
            "Q-Q plot of the residuals against a normal distribution",
            half=True,
        ),
    )
    blocks += _tests(doc, "Tests of the residuals. A small p is evidence against the model.")
    spread = number_cell(doc, ("residual_std",))
    dof = write_number(doc["dof"], significant=5).text
    sentence = f"Residual standard deviation {spread.text} {doc['residual_unit']} with {dof} degrees of freedom."
    return [Text(sentence), *blocks, *render_value(doc, ("noise",), "Noise model of the estimation.")]


def innovations(doc: Json) -> list[Any]:
    """Return what an estimator's errors and innovations say of it; nothing of a loop without an estimator's tests."""
    if not doc["tests"]:
        return []
    spread = number_cell(doc, ("residual_std",)).text
    unit = "" if doc["residual_unit"] == "1" else f" {doc['residual_unit']}"
    sentence = f"Rms error of the estimate {spread}{unit} over {write_number(doc['dof'], significant=6).text} readings."
    picture = Picture(
        "acf",
        plots.acf(doc["acf"], "acf", "readings") if doc["acf"] else "",
        "Autocorrelation of the innovations. Band: 95 % bounds for white noise; bars outside it: the signal model of "
        "the filter does not apply.",
        "Autocorrelation of the innovations against lag, with bounds",
        half=True,
    )
    caption = "Tests of errors and innovations. A small p is evidence against what the estimator states."
    return [Text(sentence), *pictures(picture), *_tests(doc, caption)]


def _tests(doc: Json, caption: str) -> list[Any]:
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
    columns = [
        Column("test"),
        Column("sensitive to", wide=True),
        Column("statistic"),
        Column("p"),
        Column("finding", wide=True),
    ]
    return [Table(columns, rows, caption)] if rows else []


def stability(doc: Json) -> list[Any]:
    blocks = pictures(
        Picture(
            "allan",
            plots.allan(doc["allan"], "allan") if doc["allan"].get("tau") else "",
            "Allan deviation with 95 % confidence intervals. Slope −½: white noise (of a rate: angle random walk); 0: "
            "bias instability; +½: random walk (of a rate: rate random walk). In the residuals of a fit the slow drift "
            "that its terms take up is missing: a fall at long averaging times is then the fit's.",
            "Allan deviation against averaging time, logarithmic axes",
            half=True,
        ),
        Picture(
            "psd",
            plots.psd(doc["psd"], "psd") if doc["psd"].get("f") else "",
            "Power spectral density of the residuals. Constant: white noise; a narrow peak: a periodic disturbance.",
            "Power spectral density of the residuals, logarithmic axes",
            half=True,
        ),
    )
    return blocks + render_value(
        doc, ("allan", "slopes"), "Local slopes of the Allan deviation on logarithmic axes.", significant=3
    )


def estimates(doc: Json) -> list[Any]:
    names = [c["name"] for c in doc["coefficients"]]
    condition = number_cell(doc, ("condition",), significant=3).text
    blocks: list[Any] = (
        []
        if not doc["rank"]
        else [
            Text(
                f"The design matrix has rank {doc['rank']} for {len(names)} reported estimates and condition number "
                f"{condition}. Above 100, errors of the model are amplified in the least-determined combination."
            )
        ]
    )
    columns = [
        Column(h)
        for h in (
            "name",
            "u, Type A",
            "dof",
            "k",
            "U (95 %)",
            "t",
            "p (t)",
            "closed form",
            "difference",
        )
    ]
    groups = unit_groups(doc["coefficients"])
    if not groups:
        columns.insert(1, Column("unit"))
    rows: list[Row] = []
    for unit, members in groups or [("", list(range(len(names))))]:
        rows += [heading(f"u, U, closed form and difference in {unit}")] if groups else []
        for k in members:
            c = doc["coefficients"][k]
            path, u = ("coefficients", k), c["u"]
            rows.append(
                Row(
                    [
                        text_cell(c["name"], "strong"),
                        *([] if groups else [text_cell(c["unit"])]),
                        number_cell(doc, (*path, "u_a"), significant=2, trim=False),  # may be far below u
                        number_cell(doc, (*path, "dof"), significant=3),
                        number_cell(doc, (*path, "k"), 0.1),
                        number_cell(doc, ("derived", "U", k), u),
                        number_cell(doc, (*path, "t"), significant=3, trim=False),
                        number_cell(doc, (*path, "p"), write=write_p),
                        number_cell(doc, (*path, "closed"), u),
                        number_cell(doc, ("derived", "closed_minus_estimate", k), significant=2),
                    ]
                )
            )
    caption = (
        "Uncertainty of each estimate. Closed form: the formula of the source; difference: closed form − estimate."
    )
    blocks.append(Table(columns, rows, caption, small=True))
    z = [c["z"] for c in doc["coefficients"]]
    blocks += pictures(
        Picture(
            "correlation",
            plots.correlation(doc["correlation"], names, "correlation"),
            "Correlation of the estimates. Two coefficients with a correlation near ±1 are hardly separable.",
            "Correlation matrix of the estimates, lower triangle, as coloured cells with numbers",
            half=len(names) < 11,
        ),
        Picture(
            "scores",
            plots.scores(names, z, [c["k"] for c in doc["coefficients"]], "scores"),
            "Deviation of the estimates from the truth in units of u. Band: ±k, coverage probability 95 %.",
            "Estimate minus truth over standard uncertainty, one point per coefficient",
            half=True,
        ),
    )
    caption = "Harmonics of the record. Those outside the model are expected to be noise."
    return blocks + _method_tables(doc) + render_value(doc, ("harmonics",), caption, by_u=True)


def repeatability(doc: Json) -> list[Any]:
    return render_value(doc, ("repeatability",), "Repeatability.") + _step(doc)


def _step(doc: Json) -> list[Any]:
    """Return the step check: what the communication step does to the coefficients."""
    check = doc["step_check"]
    if not check.get("rows"):
        text = "The communication step was not checked in this run (option --check-step): its effect is not in u."
        return [Text(text, quiet=True)] if doc["simulated"] else []
    caption = (
        "Step check: effect of the communication step on each coefficient, from runs without noise at two steps, "
        "extrapolated to step zero; u: without it; ratio: effect / u."
    )
    table = render_value(doc, ("step_check", "rows"), caption, significant=2)
    sentence = step_sentence(check).replace("step check", "Step check", 1)
    return [Text(f"{sentence}; step {step_text(check['step'])}."), *table]


def _method_tables(doc: Json) -> list[Any]:
    """Return the tables a method brings itself; numbers are rounded to the column "u" where there is one."""
    blocks: list[Any] = []
    for k, table in enumerate(doc["tables"]):
        heads = [str(h) for h in table.get("columns", [])]
        rows = []
        for i, values in enumerate(table.get("rows", [])):
            u = next((v for h, v in zip(heads, values, strict=False) if h == "u"), None)
            cells = []
            for j, head in enumerate(heads):
                apart = {"significant": 2} if head == "difference" else {"u": u}
                cells.append(number_cell(doc, ("tables", k, "rows", i, j), **apart))
            rows.append(Row(cells))
        caption = ". ".join(t.rstrip(".") for t in (table.get("title", ""), table.get("caption", "")) if t)
        if rows:
            blocks.append(Table([Column(*words(h)) for h in heads], rows, f"{caption}."))
    return blocks


def budget(doc: Json) -> list[Any]:
    lines = doc["budget"]
    if not lines:
        return []
    u = {c["name"]: c["u"] for c in doc["coefficients"]}
    rows = []
    for name in dict.fromkeys(b["coefficient"] for b in lines):
        numbers = [k for k, b in enumerate(lines) if b["coefficient"] == name]
        unit = lines[numbers[0]]["unit"]
        rows.append(heading(f"{name}, contribution in {unit}"))
        for k in sorted(numbers, key=lambda k: -(lines[k]["contribution"] or 0.0)):
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
        note = f"u stated: {write_number(u[name], u[name]).text}" if name in u else ""
        rows.append(Row([text_cell("root sum of squares", "strong"), *[text_cell("")] * 4, total, text_cell(note)]))
    heads = ("source", "u(x)", "unit", "sensitivity coefficient c", "unit", "|c|·u(x)", "note")
    columns = [Column(h, wide=h in ("source", "note")) for h in heads]
    alt = "Uncertainty budget as bars: contribution of each source to the uncertainty of the coefficients"
    caption = "Uncertainty budget: contribution of each source, and their root sum of squares against the stated u."
    table = Table(
        columns,
        rows,
        "Uncertainty budget: standard uncertainty u(x) of each source, sensitivity coefficient and contribution to u.",
        small=True,
    )
    return [
        *pictures(Picture("budget", budget_figure.budget(lines, u, "budget"), caption, alt)),
        CollapsedBlocks("All lines of the budget", [table]),
    ]
