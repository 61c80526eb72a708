"""Sections on the validity of a result: residuals, stability, uncertainty, repeatability, uncertainty budget."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from gyrobench.reduction.estimation.step_effect import step_text
from gyrobench.report import budget_figure, plots
from gyrobench.report.numbers import write_number, write_p
from gyrobench.report.page_model import (
    Cell,
    CollapsedBlocks,
    PageTable,
    Picture,
    Row,
    Section,
    Text,
    columns,
    number_cell,
    pictures,
    text_cell,
)
from gyrobench.report.plain_text import step_sentence
from gyrobench.report.result_json import Report
from gyrobench.report.tables import heading, method_table, render_value, unit_groups
from gyrobench.result import Autocorrelation, DriftTestResult, LoopResult, Series

RunResult = DriftTestResult | LoopResult


def validity(report: Report[RunResult]) -> list[Section]:
    """Return the sections on the validity of a drift test or a loop."""
    result = report.result
    first = (
        Section("Errors and innovations", "innovations", _innovations(report, result), sub=True)
        if isinstance(result, LoopResult)
        else Section("Residuals", "residuals", _residuals(report, result), sub=True)
    )
    return [
        first,
        Section("Stability: Allan deviation and spectrum", "stability", _stability(report), sub=True),
        Section("Uncertainty of the estimates", "estimates", _estimates(report), sub=True),
        Section("Repeatability and step check", "repeatability", _repeatability(report), sub=True),
    ]


def _residuals(report: Report[RunResult], result: DriftTestResult) -> list[Any]:
    noise = render_value(report.document, ("noise",), "Noise model of the estimation.")
    if not result.series and not result.tests:
        return noise
    units = list(dict.fromkeys(s.y_unit for s in result.series)) or [""]
    each = [[s for s in result.series if s.y_unit == unit] for unit in units]
    values = [r / scale for alike in each for s in alike for r in s.residual if (scale := _rms(alike, len(units) > 1))]
    in_time = []
    for number, alike in enumerate(each, 1):
        key = "residuals-time" if number == 1 else f"residuals-time-{number}"
        which = f", {', '.join(s.label for s in alike)}" if len(each) > 1 else ""
        shaded = "" if which else ", phases shaded and labelled"
        caption = f"Residuals against time{which}{shaded}. A trend or a step is drift outside the model."
        svg = plots.residuals_in_time(alike, key)
        in_time += pictures(Picture(key, svg, caption, f"Residuals of all windows against time{which}", zoom=True))
    acf = _acf(
        result.acf, "windows",
        "Autocorrelation of the residuals. Band: 95 % bounds for white noise; bars outside it: correlated noise.",
        "Autocorrelation of the residuals against lag, with bounds",
    )  # fmt: skip
    quantiles = Picture(
        "quantiles", plots.quantiles(values, "quantiles"),
        "Residuals against normal quantiles. Points on the line and inside the 95 % band are compatible with a normal "
        "distribution; points off it at the ends are outliers.",
        "Q-Q plot of the residuals against a normal distribution", half=True,
    )  # fmt: skip
    spread = number_cell(report.document, ("residual_std",)).text
    dof = write_number(result.dof, significant=5).text
    sentence = f"Residual standard deviation {spread} {result.residual_unit} with {dof} degrees of freedom."
    if len(units) > 1:
        sentence = f"{dof} degrees of freedom; the rms residual of each series stands with the measured series."
    tests = _tests(
        report,
        "Tests of the residuals. A small p is evidence against the model; one in 20 falls below 0.05 by chance. What "
        "contradicts the result, as a p of 0.01 over the number of tests does, is among the warnings.",
    )
    return [Text(sentence), *in_time, *pictures(acf, quantiles), *tests, *noise]


def _rms(series: Sequence[Series], several: bool) -> float:
    """Return the rms residual of series of one unit; 1 where all have it: then residuals are drawn as they are."""
    if not several:
        return 1.0
    finite = [r for s in series for r in s.residual if math.isfinite(r)]
    return math.sqrt(math.fsum(r * r for r in finite) / len(finite)) if finite else 0.0


def _innovations(report: Report[RunResult], result: LoopResult) -> list[Any]:
    """Return what an estimator's errors and innovations say of it; nothing of a loop without an estimator's tests."""
    if not result.tests:
        return []
    spread = number_cell(report.document, ("residual_std",)).text
    unit = "" if result.residual_unit == "1" else f" {result.residual_unit}"
    sentence = f"Rms error of the estimate {spread}{unit} over {write_number(result.dof, significant=6).text} readings."
    picture = _acf(
        result.acf, "readings",
        "Autocorrelation of the innovations. Band: 95 % bounds for white noise; bars outside it: the signal model of "
        "the filter does not apply.", "Autocorrelation of the innovations against lag, with bounds",
    )  # fmt: skip
    caption = "Tests of errors and innovations. A small p is evidence against what the estimator states."
    return [Text(sentence), *pictures(picture), *_tests(report, caption)]


def _acf(acf: Autocorrelation | None, of: str, caption: str, alt: str) -> Picture:
    return Picture("acf", plots.acf(acf.lag, acf.rho, acf.bound, "acf", of) if acf else "", caption, alt, half=True)


def _tests(report: Report[RunResult], caption: str) -> list[Any]:
    rows = []
    for k, test in enumerate(report.result.tests):
        mark = "warn" if test.p is not None and test.p < 0.01 else ""
        statistic = number_cell(report.document, ("tests", k, "statistic"), significant=3, trim=False)
        p = number_cell(report.document, ("tests", k, "p"), write=write_p, mark=mark)
        rows.append(Row([text_cell(test.name, "strong"), text_cell(test.what), statistic, p, text_cell(test.finding)]))
    heads = columns("test", "sensitive to", "statistic", "p", "finding", wide=("sensitive to", "finding"))
    return [PageTable(heads, rows, caption)] if rows else []


def _stability(report: Report[RunResult]) -> list[Any]:
    result = report.result
    psd = result.psd if isinstance(result, DriftTestResult) else None
    allan = Picture(
        "allan", plots.allan(result.allan, "allan") if result.allan else "",
        "Allan deviation with 95 % confidence intervals. Slope −½: white noise (of a rate: angle random walk); 0: "
        "bias instability; +½: random walk (of a rate: rate random walk). In the residuals of a fit the slow drift "
        "that its terms take up is missing: a fall at long averaging times is then the fit's.",
        "Allan deviation against averaging time, logarithmic axes", half=True,
    )  # fmt: skip
    spectrum = Picture(
        "psd", plots.psd(psd, "psd") if psd else "",
        "Power spectral density of the residuals. Constant: white noise; a narrow peak: a periodic disturbance.",
        "Power spectral density of the residuals, logarithmic axes", half=True,
    )  # fmt: skip
    caption = "Local slopes of the Allan deviation on logarithmic axes."
    return pictures(allan, spectrum) + render_value(report.document, ("allan", "slopes"), caption, significant=3)


def _estimates(report: Report[RunResult]) -> list[Any]:
    result, doc = report.result, report.document
    names = [c.name for c in result.coefficients]
    blocks: list[Any] = []
    if isinstance(result, DriftTestResult) and result.rank:
        condition = number_cell(doc, ("condition",), significant=3).text
        count = len(result.correlation) or len(names)  # without those that are not of the fit, as a threshold
        text = (
            f"The design matrix has rank {result.rank} for {count} reported estimates and condition number "
            f"{condition}. Above 100, errors of the model are amplified in the least-determined combination."
        )
        blocks.append(Text(text))
    heads = ["name", "u, Type A", "dof", "k", "U (95 %)", "t", "p (t)", "closed form", "difference"]
    groups = unit_groups(result.coefficients)
    if not groups:
        heads.insert(1, "unit")
    rows: list[Row] = []
    for unit, members in groups or [("", list(range(len(names))))]:
        rows += [heading(f"u, U, closed form and difference in {unit}")] if groups else []
        rows += [Row(_estimate(report, k, not groups)) for k in members]
    caption = (
        "Uncertainty of each estimate. Closed form: the formula of the source; difference: closed form − estimate."
    )
    blocks.append(PageTable(columns(*heads), rows, caption, small=True))
    matrix = result.correlation if isinstance(result, DriftTestResult) else []
    correlation = Picture(
        "correlation", plots.correlation(matrix, names, "correlation"),
        "Correlation of the estimates. Two coefficients with a correlation near ±1 are hardly separable.",
        "Correlation matrix of the estimates, lower triangle, as coloured cells with numbers", half=len(names) < 11,
    )  # fmt: skip
    scores = Picture(
        "scores", plots.scores(result.coefficients, "scores"),
        "Deviation of the estimates from the truth in units of u. Band: ±k, coverage probability 95 %.",
        "Estimate minus truth over standard uncertainty, one point per coefficient", half=True,
    )  # fmt: skip
    tables = [block for k, t in enumerate(result.tables) for block in method_table(doc, ("tables", k), t)]
    caption = "Harmonics of the record. Those outside the model are expected to be noise."
    return [*blocks, *pictures(correlation, scores), *tables, *render_value(doc, ("harmonics",), caption, by_u=True)]


def _estimate(report: Report[RunResult], k: int, unit: bool) -> list[Cell]:
    """Return the cells of an estimate, with its unit where its table has it."""
    doc, c, path = report.document, report.result.coefficients[k], ("coefficients", k)
    return [
        text_cell(c.name, "strong"),
        *([text_cell(c.unit)] if unit else []),
        number_cell(doc, (*path, "u_a"), significant=2, trim=False),  # may be far below u
        number_cell(doc, (*path, "dof"), significant=3),
        number_cell(doc, (*path, "k"), 0.1),
        number_cell(doc, ("derived", "U", k), c.u),
        number_cell(doc, (*path, "t"), significant=3, trim=False),
        number_cell(doc, (*path, "p"), write=write_p),
        number_cell(doc, (*path, "closed"), c.u),
        number_cell(doc, ("derived", "closed_minus_estimate", k), significant=2),
    ]


def _repeatability(report: Report[RunResult]) -> list[Any]:
    """Return repeatability, and what the communication step does to the coefficients."""
    found = render_value(report.document, ("repeatability",), "Repeatability.")
    check = report.result.step_check
    if check is None or not check.rows:
        text = "The communication step was not checked in this run (option --check-step): its effect is not in u."
        return found + ([Text(text, quiet=True)] if report.result.simulated else [])
    caption = (
        "Step check: effect of the communication step on each coefficient, from runs without noise at two steps, "
        "extrapolated to step zero; taken: what of it was taken out of the estimate, where the linear models with and "
        "without the step differ by as much; u: without it; ratio: what is left / u."
    )
    sentence = step_sentence(check)
    text = f"{sentence[:1].upper()}{sentence[1:]}; step {step_text(check.step)}."
    return [*found, Text(text), *render_value(report.document, ("step_check", "rows"), caption, significant=2)]


def budget(report: Report[RunResult]) -> list[Any]:
    """Return the uncertainty budget: figure, and folded its lines by coefficient, the largest first."""
    doc, lines = report.document, report.result.budget
    if not lines:
        return []
    u = {c.name: c.u for c in report.result.coefficients}
    rows = []
    for name in dict.fromkeys(b.coefficient for b in lines):
        numbers = [k for k, b in enumerate(lines) if b.coefficient == name]
        rows.append(heading(f"{name}, contribution in {lines[numbers[0]].unit}"))
        for k in sorted(numbers, key=lambda k: -lines[k].contribution if math.isfinite(lines[k].contribution) else 0.0):
            b = lines[k]
            size, sensitivity = (
                number_cell(doc, ("budget", k, n), significant=3, trim=False) for n in ("size", "sensitivity")
            )
            share = number_cell(doc, ("budget", k, "contribution"), significant=2, trim=False)
            texts = [text_cell(x) for x in (b.source, b.size_unit, b.sensitivity_unit, b.note)]
            rows.append(Row([texts[0], size, texts[1], sensitivity, texts[2], share, texts[3]]))
        total = number_cell(doc, ("derived", "budget_sum", name), u.get(name))
        note = f"u stated: {write_number(u[name], u[name]).text}" if name in u else ""
        rows.append(Row([text_cell("root sum of squares", "strong"), *[text_cell("")] * 4, total, text_cell(note)]))
    alt = "Uncertainty budget as bars: contribution of each source to the uncertainty of the coefficients"
    caption = "Uncertainty budget: contribution of each source, and their root sum of squares against the stated u."
    heads = ("source", "u(x)", "unit", "sensitivity coefficient c", "unit", "|c|·u(x)", "note")
    table = PageTable(
        columns(*heads, wide=("source", "note")), rows,
        "Uncertainty budget: standard uncertainty u(x) of each source, sensitivity coefficient and contribution to u.",
        small=True,
    )  # fmt: skip
    figure = Picture("budget", budget_figure.budget(lines, u, "budget"), caption, alt)
    return [*pictures(figure), CollapsedBlocks("All lines of the budget", [table])]
