"""Report page that compares two campaigns."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from gyrobench.campaign.analysis.campaign_comparison import QUANTITIES
from gyrobench.campaign.analysis.measures import Json
from gyrobench.report.language import ENGLISH, used
from gyrobench.report.numbers import write_p
from gyrobench.report.page_model import (
    BulletList,
    Cell,
    Column,
    Page,
    PageTable,
    Row,
    Section,
    Text,
    number_cell,
    text_cell,
)
from gyrobench.report.report_files import COMPARISON_NAMES, write_files
from gyrobench.report.tables import compact


def write_comparison(doc: Json, folder: Path, bench: Path, language: str = ENGLISH) -> dict[str, Path]:
    """Write comparison.json, .html and .pdf; return their paths.  Raises UntranslatedError before any page."""
    named = [(letter, c["name"]) for letter, c in zip("AB", doc["campaigns"], strict=True)]
    own = {form.format(*n) for n in named for form in ("{1}", "{0}, {1}", "{0} ({1})")}
    own.add(_title(doc))
    names = {t["name"] for t in doc["tests"]}.union(*doc["only"])
    with used(language, Path(__file__).parent, own, names) as words:
        made = page(doc)
        made = words.page(made, "the comparison") if words else made
    return write_files(doc, lambda: made, folder, tuple(COMPARISON_NAMES), COMPARISON_NAMES, bench)


def _title(doc: Json) -> str:
    return ", ".join(c["name"] for c in doc["campaigns"])


def page(doc: Json) -> Page:
    """Return the page of a comparison document."""
    a, b = doc["campaigns"]
    head = [
        ("Report", doc["report_id"]),
        ("Baseline", f"A, {a['name']}, {a['runs']} runs"),
        ("Compared", f"B, {b['name']}, {b['runs']} runs"),
    ]
    sections = [
        Section("Summary", "summary", [BulletList(doc["answer"])]),
        Section("Differing settings", "differs", _settings(doc)),
        Section("Measures", "measures", [_tests(doc), *_only(doc)]),
    ]
    return Page(f"Comparison: {_title(doc)}", doc["report_id"], head, sections).finish()


def _settings(doc: Json) -> list[Any]:
    if not doc["differing"]:
        return [Text("No option, part or version differs between the campaigns.")]
    rows = [Row([text_cell(d["what"]), *map(_value, d["values"])]) for d in doc["differing"]]
    columns = [Column("setting"), Column("A", wide=True), Column("B", wide=True)]
    return [PageTable(columns, rows, "Options, components and versions that differ.", small=True)]


def _value(value: Any) -> Cell:
    return text_cell("–" if value is None else value if isinstance(value, str) else compact(value), own=True)


def _tests(doc: Json) -> PageTable:
    rows = []
    for i, t in enumerate(doc["tests"]):
        at = ("tests", i)
        mark = "significant" if t["beyond_chance"] else ""
        u = None if t["low"] is None or t["high"] is None else 0.25 * (t["high"] - t["low"])
        cells = [
            text_cell(t["name"], "strong"),
            text_cell(QUANTITIES[t["quantity"]]),
            text_cell("" if t["unit"] == "1" else t["unit"]),
            *(number_cell(doc, (*at, key), significant=4) for key in ("a", "b")),
            *(number_cell(doc, (*at, key), u, mark=mark, significant=3) for key in ("change", "low", "high")),
            number_cell(doc, (*at, "p_adjusted"), write=write_p),
            text_cell("beyond chance" if t["beyond_chance"] else "–", mark),
        ]
        rows.append(Row(cells))
    heads = ("name", "quantity", "unit", "A", "B", "B − A (u: B / A)", "95 % from", "to", "p, adjusted", "")
    how = (
        f"{doc['pairs']} runs of equal settings and seeds in pairs" if doc["pairs"] else "the campaigns are independent"
    )
    return PageTable(
        [Column(h) for h in heads],
        rows,
        f"What chance does not explain: {how}; runs that share a seed count as one; p adjusted for all rows (Holm).",
        small=True,
    )


def _only(doc: Json) -> list[Any]:
    return [
        Text(f"Only in {letter}: {', '.join(names)}.") for letter, names in zip("AB", doc["only"], strict=True) if names
    ]
