"""Report of a drift record: noise coefficients, then for each column record, deviations, spectrum, tests and models."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from gyrobench.report import drift_record_figures as figures
from gyrobench.report import method_section, result_page
from gyrobench.report.numbers import write_p
from gyrobench.report.page_model import (
    BulletList,
    CollapsedBlocks,
    Column,
    Page,
    Picture,
    Row,
    Section,
    Table,
    Text,
    number_cell,
    pictures,
)
from gyrobench.report.signature_section import signing
from gyrobench.report.style import styled
from gyrobench.report.tables import how_tables, words

Json = dict[str, Any]
SMOOTHED = (
    " Red: Gauss–Markov drift of the longest stretch, lines and columns taken out, smoothed from all samples, with its "
    "95 % band, if its correlation time and sizes are those that were estimated."
)


def page(doc: Json) -> Page:
    """Return the report of one result document (see :func:`gyrobench.report.result_json.document`)."""
    several = len(doc["columns"]) > 1
    with styled():
        sections = [
            Section("Result and conformity", "answer", [result_page.answer(doc)]),
            Section("Simulated set-up errors", "setup-errors", result_page.setup_errors(doc)),
            Section("Noise coefficients", "coefficients", result_page.coefficients(doc)),
        ]
        for k, column in enumerate(doc["columns"]):
            sections += _sections(doc, k, f": {column['name']}" if several else "")
        sections += [
            Section("Method and provenance", "how", []),
            Section("Model and conventions", "model", method_section.model(doc), sub=True),
            Section("System and test plan", "system", method_section.system(doc), sub=True),
            Section("Components, parameters and provenance", "provenance", how_tables(doc), sub=True),
            Section("Values at full precision", "values", method_section.full_values(doc), sub=True),
            Section("Statements and signatures", "signatures", signing(doc)),
        ]
    return Page(doc["title"], doc["report_id"], result_page.head(doc), sections).finish()


def _sections(doc: Json, k: int, of: str) -> list[Section]:
    c, key = doc["columns"][k], f"column-{k + 1}"

    def part(title: str, slug: str, blocks: Sequence[Any], sub: bool = True) -> Section:
        return Section(title, f"{slug}-{k + 1}", [*_texts(c, slug), *blocks, *_tables(doc, k, slug)], sub=sub)

    smoothed = SMOOTHED if "smoothed" in c["record"] else ""
    record = Picture(
        f"{key}-record", figures.record(c, f"{key}-record"),
        "Rate of the record: band from the smallest to the largest value of each interval, line through the means. "
        "White: no samples." + smoothed, "Rate against time with gaps", zoom=True,
    )  # fmt: skip
    allan = Picture(
        f"{key}-deviations", figures.deviations(c, f"{key}-deviations"),
        "Allan deviation with 95 % intervals (band), modified Allan and Hadamard deviation; dashed: Allan deviation of "
        "the fitted noise coefficients. Slope −1: quantization; −½: angle random walk; 0: bias instability; +½: rate "
        "random walk; +1: rate ramp, to which the Hadamard deviation is blind. Intervals hold for one averaging time.",
        "Deviations against averaging time, logarithmic axes, with the fitted model",
    )  # fmt: skip
    spectrum = Picture(
        f"{key}-spectrum", figures.spectrum(c, f"{key}-spectrum"),
        "One-sided power spectral density after the lines are removed, with 95 % intervals (band); dashed: the fitted "
        "noise coefficients.", "Power spectral density against frequency, logarithmic axes, with the fitted model",
    )  # fmt: skip
    acf = [
        Picture(
            f"{key}-{name}", figures.correlation(c, name, f"{key}-{name}"),
            f"{title} of the samples. Band: 95 % bounds for white noise.", f"{title} against lag", half=True,
        ) for name, title in (("rho", "Autocorrelation"), ("partial", "Partial autocorrelation"))
    ]  # fmt: skip
    return [
        Section(f"Record{of}", f"record-{k + 1}", [*pictures(record), *_tables(doc, k, "acquisition"),
                                                  *_texts(c, "acquisition")]),
        part(f"Regression on other columns{of}", "regression", []),
        Section(f"Stability and spectrum{of}", f"stability-{k + 1}", []),
        part("Deviations", "deviations", [*pictures(allan), _values(doc, k)]),
        part("Spectrum and lines", "spectrum", pictures(spectrum)),
        Section(f"Validity of the model{of}", f"validity-{k + 1}", []),
        part("Stationarity and distribution", "stationarity", []),
        part("Model of the random drift", "model", pictures(*acf)),
    ]  # fmt: skip


def _texts(c: Json, slug: str) -> list[Any]:
    sentences = c["texts"].get(slug) or []
    return [Text(sentences[0])] if len(sentences) == 1 else [BulletList(sentences)] if sentences else []


def _tables(doc: Json, k: int, slug: str) -> list[Any]:
    """Return the tables of a section; numbers are rounded to the column "u" where there is one."""
    blocks = []
    for i, table in enumerate(doc["columns"][k]["tables"].get(slug) or []):
        heads = [str(h) for h in table["columns"]]
        rows = [Row([_cell(doc, ("columns", k, "tables", slug, i, "rows", r), heads, values, j)
                     for j in range(len(heads))]) for r, values in enumerate(table["rows"])]  # fmt: skip
        wide = {"finding", "meaning", "use"}
        columns = [Column(*words(h), wide=h in wide) for h in heads]
        caption = ". ".join(t.rstrip(".") for t in (table["title"], table["caption"]) if t)
        if rows:
            blocks.append(Table(columns, rows, f"{caption}."))
    return blocks


def _cell(doc: Json, row: tuple[str | int, ...], heads: Sequence[str], values: Sequence[Any], j: int) -> Any:
    head = heads[j]
    if head == "p" or head.startswith("p "):
        return number_cell(doc, (*row, j), write=write_p)
    u = next((v for h, v in zip(heads, values, strict=True) if h == "u"), None)
    own = next((v for h, v in zip(heads, values, strict=True) if h == f"u({_symbol(head)})"), None)
    return number_cell(doc, (*row, j), own or u)


def _symbol(head: str) -> str:
    return {"frequency": "f", "amplitude": "A"}.get(words(head)[0], words(head)[0])


def _values(doc: Json, k: int) -> Any:
    """Return the deviations as a folded table: Allan with interval and degrees of freedom, the others beside it."""
    c = doc["columns"][k]
    first, *others = c["deviations"]
    index = [{t: i for i, t in enumerate(d["tau"])} for d in others]
    rows = []
    for i, tau in enumerate(first["tau"]):
        path = ("columns", k, "deviations", 0)
        cells = [number_cell(doc, (*path, "tau", i))]
        cells += [number_cell(doc, (*path, n, i)) for n in ("dev", "low", "high")]
        cells.append(number_cell(doc, (*path, "edf", i), significant=3))
        for n, at in enumerate(index, 1):
            cells.append(number_cell(doc, ("columns", k, "deviations", n, "dev", at.get(tau, -1))))
        rows.append(Row(cells))
    heads = [("averaging time", "s"), (first["kind"], c["unit"]), ("95 % from", ""), ("to", ""), ("edf", "")]
    columns = [Column(*h) for h in [*heads, *((d["kind"], c["unit"]) for d in others)]]
    caption = "Deviations. edf: equivalent degrees of freedom of the Allan deviation."
    return CollapsedBlocks("Values of the deviations", [Table(columns, rows, caption, small=True)])
