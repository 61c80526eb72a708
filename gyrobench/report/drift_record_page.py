"""Report of a drift record: noise coefficients, then for each column record, deviations, spectrum, tests and models."""

from __future__ import annotations

from typing import Any

from gyrobench.report import channels_section, result_page
from gyrobench.report import drift_record_figures as figures
from gyrobench.report.language import in_use
from gyrobench.report.page_model import (
    BulletList,
    CollapsedBlocks,
    Page,
    PageTable,
    Picture,
    Row,
    Section,
    Text,
    columns,
    number_cell,
    pictures,
)
from gyrobench.report.result_json import Report
from gyrobench.report.style import styled
from gyrobench.report.tables import method_table
from gyrobench.result import DriftRecordResult
from gyrobench.side_by_side import each

SMOOTHED = (
    " Red: Gauss–Markov drift of the longest stretch, lines and columns taken out, smoothed from all samples, with its "
    "95 % band, if its correlation time and sizes are those that were estimated."
)
WIDE = ("finding", "meaning", "use")


def page(report: Report[DriftRecordResult]) -> Page:
    """Return the page of the report of a drift record."""
    with styled():
        first, *rest = result_page.opening(report, "Noise coefficients")
        sections = [first, *channels_section.sections(report), *rest]
        # side by side, but in a language, which notes here what it lacks
        of_columns = each(lambda k: _sections(report, k), len(report.result.columns), in_use() is None)
        sections += [section for of_one in of_columns for section in of_one]
        sections += result_page.closing(report)
    return Page(report.result.title, report.report_id, result_page.head(report), sections).finish()


def _sections(report: Report[DriftRecordResult], k: int) -> list[Section]:
    """Return the sections of a column."""
    c, key = report.result.columns[k], f"column-{k + 1}"
    of = f": {c.name}" if len(report.result.columns) > 1 else ""

    def part(title: str, slug: str, *blocks: Any) -> Section:
        content = [*_texts(report, k, slug), *blocks, *_tables(report, k, slug)]
        return Section(title, f"{slug}-{k + 1}", content, sub=True)

    record, deviations, spectrum, correlations = _figures(report, k, key)
    acquired = [*_tables(report, k, "acquisition"), *_texts(report, k, "acquisition")]
    return [
        Section(f"Record{of}", f"record-{k + 1}", [*pictures(record), *acquired]),
        part(f"Regression on other columns{of}", "regression"),
        Section(f"Stability and spectrum{of}", f"stability-{k + 1}", []),
        part("Deviations", "deviations", *pictures(deviations), _values(report, k)),
        part("Spectrum and lines", "spectrum", *pictures(spectrum)),
        Section(f"Validity of the model{of}", f"validity-{k + 1}", []),
        part("Stationarity and distribution", "stationarity"),
        part("Model of the random drift", "model", *pictures(*correlations)),
    ]


def _figures(report: Report[DriftRecordResult], k: int, key: str) -> tuple[Picture, Picture, Picture, list[Picture]]:
    """Return the figures of a column: record, deviations, spectrum, correlations."""
    c = report.result.columns[k]
    what = c.quantity.capitalize()
    record = Picture(
        f"{key}-record", figures.record(c, f"{key}-record"),
        f"{what} of the record: band from the smallest to the largest value of each interval, line through the means. "
        f"White: no samples.{SMOOTHED if c.record.smoothed else ''}", f"{what} against time with gaps", zoom=True,
    )  # fmt: skip
    allan = Picture(
        f"{key}-deviations", figures.deviations(c, f"{key}-deviations"),
        "Allan deviation with 95 % intervals (band), modified Allan and Hadamard deviation; dashed: Allan deviation of "
        "the fitted model. Slope −1: quantization; −½: angle random walk; 0: bias instability; +½: rate "
        "random walk; +1: rate ramp, to which the Hadamard deviation is blind. Intervals hold for one averaging time.",
        "Deviations against averaging time, logarithmic axes, with the fitted model",
    )  # fmt: skip
    spectrum = Picture(
        f"{key}-spectrum", figures.spectrum(c, f"{key}-spectrum"),
        "One-sided power spectral density after the lines are removed, with 95 % intervals (band); dashed: the fitted "
        "model.", "Power spectral density against frequency, logarithmic axes, with the fitted model",
    )  # fmt: skip
    r = c.correlation
    both = (("rho", "Autocorrelation", r.rho), ("partial", "Partial autocorrelation", r.partial)) if r else ()
    correlations = [
        Picture(
            f"{key}-{name}", figures.correlation(values, r.bound, f"{key}-{name}") if r else "",
            f"{title} of the samples. Band: 95 % bounds for white noise.", f"{title} against lag", half=True,
        ) for name, title, values in both
    ]  # fmt: skip
    return record, allan, spectrum, correlations


def _texts(report: Report[DriftRecordResult], k: int, slug: str) -> list[Any]:
    sentences = report.result.columns[k].texts.get(slug, [])
    return [Text(sentences[0])] if len(sentences) == 1 else [BulletList(sentences)] if sentences else []


def _tables(report: Report[DriftRecordResult], k: int, slug: str) -> list[Any]:
    """Return the tables of a section."""
    blocks = []
    for i, table in enumerate(report.result.columns[k].tables.get(slug, [])):
        blocks += method_table(report.document, ("columns", k, "tables", slug, i), table, WIDE)
    return blocks


def _values(report: Report[DriftRecordResult], k: int) -> Any:
    """Return the deviations as a folded table: Allan with interval and degrees of freedom, the others beside it."""
    c, doc = report.result.columns[k], report.document
    first, *others = c.deviations
    index = [{t: i for i, t in enumerate(d.tau)} for d in others]
    rows = []
    for i, tau in enumerate(first.tau):
        path = ("columns", k, "deviations", 0)
        cells = [number_cell(doc, (*path, n, i)) for n in ("tau", "dev", "low", "high")]
        cells.append(number_cell(doc, (*path, "edf", i), significant=3))
        for n, at in enumerate(index, 1):
            cells.append(number_cell(doc, ("columns", k, "deviations", n, "dev", at.get(tau, -1))))
        rows.append(Row(cells))
    heads = columns(("averaging time", "s"), (first.kind, c.unit), "95 % from", "to", "edf")
    heads += columns(*((d.kind, c.unit) for d in others))
    caption = "Deviations. edf: equivalent degrees of freedom of the Allan deviation."
    return CollapsedBlocks("Values of the deviations", [PageTable(heads, rows, caption, small=True)])
