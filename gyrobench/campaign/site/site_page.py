"""The page of a campaign's site: sections, tables and figures of its analysis."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any
from urllib.parse import quote

from gyrobench.campaign.analysis.measures import SEED_KINDS, CampaignMeasures, Json
from gyrobench.campaign.site import site_figures, statistics_sections
from gyrobench.report.numbers import write_number, write_p
from gyrobench.report.page_model import (
    BulletList,
    Cell,
    CollapsedBlocks,
    Column,
    Markup,
    Page,
    PageTable,
    Row,
    Section,
    Text,
    number_cell,
    text_cell,
)
from gyrobench.report.result_json import content_hash
from gyrobench.report.style import said, styled
from gyrobench.report.tables import compact

MAX_LISTED = 300  # measurements of a lot listed on the page; the table of runs holds all
MAX_DRIFTS = 40

#: {0} ...: texts, of which the fourth names the parts between <code>
RUNS = """<div id="runs-table" hidden>
<div class="runsbar">
<label>{0} <input type="search" id="runs-filter" autocomplete="off" spellcheck="false"
 placeholder="state=failed  D_I&gt;0.5  {2}" aria-describedby="runs-help"></label>
<label>{1} <select id="runs-columns"></select></label>
</div>
<p class="quiet" id="runs-help">{3}</p>
<p id="runs-status" role="status"></p>
<div class="scroll" tabindex="0" role="group" aria-label="{4}">
<table id="runs-rows"><thead></thead><tbody></tbody></table>
</div>
<div class="pager" role="group" aria-label="{5}"></div>
</div>
<noscript><p>{6}</p></noscript>
<link rel="stylesheet" href="site.css">
<script defer src="runs.js"></script>
<script defer src="site.js"></script>"""
CODES = [f"<code>{c}</code>" for c in ("name=text", "name&lt;number", "name&gt;number", "u(name)", "z(name)")]
TEXTS = (
    "Filter",
    "Columns",
    "text",
    "Words filter all columns; {}, {}, {} one of them, {} and {} too; names with spaces in quotes. A heading "
    "sorts.".format(*CODES),
    "Runs",
    "Pages of the table",
    'The table needs scripting; its rows are in <a href="runs.csv">runs.csv</a>.',
)


def page(doc: Json, measures: CampaignMeasures, reports: Callable[[str], str]) -> Page:
    """Return the page.  reports: path of a report in the campaign -> its link from the site."""
    with styled():
        sections = [
            Section("Question and answer", "answer", _answer(doc)),
            Section("Instruments", "instruments", _instruments(doc, reports)),
            Section("Control charts and tolerance intervals", "control", _control(doc, measures)),
            Section("Changes between dates", "dates", _changes(doc)),
            Section("Coverage and normalized errors", "coverage", statistics_sections.coverage_section(doc, measures)),
            Section("Responses and main effects", "responses", statistics_sections.responses_section(doc)),
            Section("Sobol' indices", "sobol", statistics_sections.sobol_section(doc)),
            Section("Distributions", "distributions", statistics_sections.distributions_section(doc, measures)),
            Section("Runs without result", "failures", _failures(doc)),
            Section("Runs", "runs", [Markup(RUNS.format(*map(said, TEXTS)))]),
            Section("Method and provenance", "method", _method(doc)),
        ]
    identity = content_hash(doc)
    head = [
        ("Campaign", doc["name"]),
        ("System", doc["system"] or "–"),
        ("Runs", str(doc["runs"])),
        ("Report", identity),
    ]
    return Page(f"Campaign: {doc['name']}", identity, head, sections).finish()


def own_texts(doc: Json) -> set[str]:
    """Return what is the same in every language: the question, and what files and instruments are called."""
    listed = doc["lot"]["instruments"] if doc["lot"] else []
    dates = (d["instrument"] for d in doc["lot"]["changes"]["drifts"]) if doc["lot"] else ()
    return {doc["question"], doc["name"], doc["system"], *dates, *(i["instrument"] for i in listed)} - {""}


def own_names(doc: Json) -> set[str]:
    """Return names of measures, axes, and of their values."""
    varied = [a["name"] for a in doc["axes"] if a["kind"] not in (*SEED_KINDS, "data")]
    levels = {str(v) for axis in doc["responses"] if not axis["numeric"] for v in axis["levels"]}
    return {*levels, *(d["name"] for d in doc["distributions"]), *varied}


def recorded(doc: Json) -> set[str]:
    """Return what runs warned of and failed for, as the page and its table say it."""
    lot = doc["lot"] or {"instruments": [], "common": []}
    found = {f"{w.rstrip('.')}." for i in lot["instruments"] for w in i["why"]} | {c["warning"] for c in lot["common"]}
    return found | {f["reason"] for f in doc["failures"]}


def _answer(doc: Json) -> list[Any]:
    return [Text(doc["question"] or "No question is stated (question = \"...\" in the campaign's file).",
                 quiet=not doc["question"]), BulletList(doc["answer"])]  # fmt: skip


# ------------------------------------------------------------------------------------------------- lots
def _instruments(doc: Json, reports: Callable[[str], str]) -> list[Any]:
    lot = doc["lot"]
    if not lot:
        return []
    listed = lot["instruments"]
    dated = any(entry["date"] for entry in listed)
    heads = [Column("instrument"), Column("file"), *([Column("date")] if dated else []), Column("verdict")]
    bad = [i for i, entry in enumerate(listed) if entry["why"]]
    blocks: list[Any] = []
    if bad:
        caption = "Measurements that need attention: without result, contradicted by their own record, or unlike the "
        caption += "rest of the lot."
        rows = [
            _instrument(listed[i], reports, dated, [text_cell(" ".join(f"{w.rstrip('.')}." for w in listed[i]["why"]))])
            for i in bad
        ]
        blocks.append(PageTable([*heads, Column("reason", wide=True)], rows, caption))
    if lot["common"]:
        blocks.append(Text("What most of the results warn of, in the words of the first:"))
        blocks.append(BulletList([f"{c['warning']} ({c['runs']} results)" for c in lot["common"]], warn=True))
    if lot["outliers"]:
        o = lot["outliers"]
        how = "in all coefficients together" if o["joint"] else "in each coefficient alone, as the lot is small"
        blocks += statistics_sections.pictures_of(site_figures.distances(lot), "")
        blocks.append(
            Text(
                f"Outliers are judged by robust Mahalanobis distances {how} ({', '.join(o['used'])}), {o['judged']} "
                f"measurements; a normal lot without outliers names any with a probability of "
                f"{write_number(o['level'], significant=2).text}."
            )
        )
    else:
        blocks.append(Text("Outliers are not judged: that takes eight complete results or more."))
    rows = [
        _instrument(entry, reports, dated, [number_cell(doc, ("lot", "instruments", i, "distance"), significant=3)])
        for i, entry in enumerate(listed[:MAX_LISTED])
    ]
    more = f" The first {MAX_LISTED}; all are in the table of runs." if len(listed) > MAX_LISTED else ""
    table = PageTable([*heads, Column("robust distance")], rows, f"Verdict of every measurement.{more}")
    blocks.append(CollapsedBlocks(f"All {len(listed)} measurements", [table]) if bad else table)
    return blocks


def _instrument(entry: Json, reports: Callable[[str], str], dated: bool, more: list[Cell]) -> Row:
    link = reports(entry["report"]) if entry["report"] else ""
    verdict = entry["verdict"]
    cells = [text_cell(entry["instrument"], "strong", link), text_cell(_last(entry["data"]), own=True)]
    cells += [text_cell((entry["date"] or "–")[:10])] if dated else []
    return Row([*cells, text_cell(verdict, verdict, link), *more])


def _last(path: Any) -> str:
    return str(path).replace("\\", "/").rsplit("/", 1)[-1] if isinstance(path, str) else "–"


def _control(doc: Json, measures: CampaignMeasures) -> list[Any]:
    lot = doc["lot"]
    if not lot or not lot["tolerance"]:
        return []
    rows = []
    for i, t in enumerate(lot["tolerance"]):
        at = ("lot", "tolerance", i)
        sd = t["sd"]
        cells = [
            text_cell(t["name"], "strong"),
            text_cell(t["unit"]),
            number_cell(doc, (*at, "n")),
            *(number_cell(doc, (*at, key), sd and 0.1 * sd) for key in ("mean", "sd", "low", "high")),
            number_cell(doc, (*at, "u"), significant=2),
            text_cell(t["kind"] if t["low"] is not None else f"{t['kind']}: too few values"),
            number_cell(doc, (*at, "p_normal"), write=write_p),
            number_cell(doc, (*at, "beyond")),
        ]
        rows.append(Row(cells))
    heads = ("name", "unit", "n", "mean", "standard deviation", "95 % / 95 % from", "to", "median u", "interval",
             "p (normal)", "beyond control limits")  # fmt: skip
    table = PageTable(
        [Column(h) for h in heads],
        rows,
        f"Tolerance intervals: they hold 95 % of the population of instruments with 95 % confidence, uncertainty of "
        f"the measurement included. From {lot['accepted']} accepted measurements. Normal unless the Shapiro-Wilk test "
        "objects (p below 0.05), else from order statistics.",
    )
    text = Text(
        "Control charts: median and limits of three standard deviations from the median moving range (dashed); band: "
        "tolerance interval; diamonds: outliers; squares: contradicted by the own record."
    )
    return [table, text, *statistics_sections.pictures_of(site_figures.control_charts(measures, lot), "control charts")]


def _changes(doc: Json) -> list[Any]:
    lot = doc["lot"]
    if not lot or not lot["changes"]["instruments"]:
        return []
    changes = lot["changes"]
    at = ("lot", "changes", "pooled")
    rows = [
        Row([text_cell(p["name"], "strong"), number_cell(doc, (*at, i, "instruments")),
             number_cell(doc, (*at, i, "ratio"), significant=3), number_cell(doc, (*at, i, "p"), write=write_p)])
        for i, p in enumerate(changes["pooled"])
    ]  # fmt: skip
    pooled = PageTable(
        [Column("name"), Column("instruments"), Column("observed / expected"), Column("p")],
        rows,
        "Standard deviation between dates of one instrument over what u explains, pooled over instruments; a small p "
        "is evidence that instruments change from date to date.",
    )
    order = sorted(range(len(changes["drifts"])), key=lambda k: changes["drifts"][k]["p"])[:MAX_DRIFTS]
    rows = []
    for k in order:
        d = changes["drifts"][k]
        here = ("lot", "changes", "drifts", k)
        mark = "significant" if d["beyond_chance"] else ""
        cells = [
            text_cell(d["instrument"], "strong"),
            text_cell(d["name"]),
            number_cell(doc, (*here, "dates")),
            number_cell(doc, (*here, "slope"), d["u"], mark=mark),
            number_cell(doc, (*here, "u"), d["u"]),
            text_cell(f"{d['unit']} per day"),
            number_cell(doc, (*here, "p_adjusted"), write=write_p),
            text_cell("changed" if d["beyond_chance"] else "–", mark),
        ]
        rows.append(Row(cells))
    heads = ("instrument", "name", "dates", "drift", "u", "unit", "p, adjusted", "")
    drifts = PageTable(
        [Column(h) for h in heads],
        rows,
        f"Drift of instruments between dates, smallest p first ({len(order)} of {len(changes['drifts'])}); p adjusted "
        "for all of them (Holm).",
    )
    return [pooled, drifts]


def _failures(doc: Json) -> list[Any]:
    if not doc["failures"]:
        return []
    rows = []
    for i, f in enumerate(doc["failures"]):
        same = max(re.split(r'[\d"]+', f["reason"]), key=len).strip()  # the longest piece without a number
        words = quote(f'state={f["state"]} "{same}"', safe="")
        cells = [
            text_cell(f["state"], "strong"),
            number_cell(doc, ("failures", i, "runs")),
            text_cell(f["reason"]),
            text_cell("show", link=f"#filter={words}"),
        ]
        rows.append(Row(cells))
    columns = [Column("state"), Column("runs"), Column("reason (of the first)", wide=True), Column("")]
    return [PageTable(columns, rows, "Runs without result by reason; reasons that differ in numbers alone are one.")]


def _method(doc: Json) -> list[Any]:
    rows = [
        Row([text_cell(a["name"], "strong"), text_cell(a["kind"]), text_cell(a["unit"] or "–"),
             number_cell(doc, ("axes", i, "values"))])
        for i, a in enumerate(doc["axes"])
    ]  # fmt: skip
    blocks: list[Any] = []
    if rows:
        columns = [Column("axis"), Column("kind"), Column("unit"), Column("different values")]
        blocks.append(PageTable(columns, rows, "Axes of the campaign."))
    for key, what in (("options", "Fixed options, in SI units"), ("parts", "Components"), ("versions", "Versions")):
        if doc[key]:
            rows = [
                Row([text_cell(k, own=True), text_cell(v if isinstance(v, str) else compact(v), own=True)])
                for k, v in doc[key].items()
            ]
            blocks.append(PageTable([Column("name"), Column("value", wide=True)], rows, f"{what}.", small=True))
    files = "All rows: runs.csv; the numbers of this page: analysis.json."
    return [*blocks, Text(files, quiet=True)]
