"""The page of a campaign's site: sections, tables and figures of its analysis."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import Any
from urllib.parse import quote

from gyrobench.campaign.analysis.measures import CampaignMeasures, Json
from gyrobench.campaign.site import site_figures
from gyrobench.report.numbers import write_number, write_p
from gyrobench.report.page_model import (
    BulletList,
    Cell,
    CollapsedBlocks,
    Column,
    Markup,
    Page,
    PageTable,
    Picture,
    Pictures,
    Row,
    Section,
    Text,
    number_cell,
    text_cell,
)
from gyrobench.report.result_json import content_hash
from gyrobench.report.style import styled
from gyrobench.report.tables import compact

SHOWN_MEASURES = 9  # whose pictures stand open; those of more are folded
MAX_LISTED = 300  # measurements of a lot listed on the page; the table of runs holds all
MAX_DRIFTS = 40

RUNS = """<div id="runs-table" hidden>
<div class="runsbar">
<label>Filter <input type="search" id="runs-filter" autocomplete="off" spellcheck="false"
 placeholder="state=failed  D_I&gt;0.5  text" aria-describedby="runs-help"></label>
<label>Columns <select id="runs-columns"></select></label>
</div>
<p class="quiet" id="runs-help">Words filter all columns; <code>name=text</code>, <code>name&lt;number</code>,
<code>name&gt;number</code> one of them, <code>u(name)</code> and <code>z(name)</code> too; names with spaces in quotes.
A heading sorts.</p>
<p id="runs-status" role="status"></p>
<div class="scroll" tabindex="0" role="group" aria-label="Runs">
<table id="runs-rows"><thead></thead><tbody></tbody></table>
</div>
<div class="pager" role="group" aria-label="Pages of the table"></div>
</div>
<noscript><p>The table needs scripting; its rows are in <a href="runs.csv">runs.csv</a>.</p></noscript>
<link rel="stylesheet" href="site.css">
<script defer src="runs.js"></script>
<script defer src="site.js"></script>"""


def page(doc: Json, measures: CampaignMeasures, reports: Callable[[str], str]) -> Page:
    """Return the page.  reports: path of a report in the campaign -> its link from the site."""
    with styled():
        sections = [
            Section("Question and answer", "answer", _answer(doc)),
            Section("Instruments", "instruments", _instruments(doc, reports)),
            Section("Control charts and tolerance intervals", "control", _control(doc, measures)),
            Section("Changes between dates", "dates", _changes(doc)),
            Section("Coverage and normalized errors", "coverage", _coverage(doc, measures)),
            Section("Responses and main effects", "responses", _responses(doc)),
            Section("Sobol' indices", "sobol", _sobol(doc)),
            Section("Distributions", "distributions", _distributions(doc, measures)),
            Section("Runs without result", "failures", _failures(doc)),
            Section("Runs", "runs", [Markup(RUNS)]),
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


def _pictures(items: Sequence[Picture], what: str) -> list[Any]:
    """Return pictures, those of many measures folded."""
    shown, rest = list(items[:SHOWN_MEASURES]), list(items[SHOWN_MEASURES:])
    blocks: list[Any] = [Pictures(shown)] if shown else []
    if rest:
        blocks.append(CollapsedBlocks(f"{len(rest)} more {what}", [Pictures(rest)]))
    return blocks


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
        blocks += _pictures(site_figures.distances(lot), "")
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
    return Row(
        [
            text_cell(entry["instrument"], "strong", link),
            text_cell(_last(entry["data"])),
            *([text_cell((entry["date"] or "–")[:10])] if dated else []),
            text_cell(verdict, verdict, link),
            *more,
        ]
    )


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
        rows.append(
            Row(
                [
                    text_cell(t["name"], "strong"),
                    text_cell(t["unit"]),
                    number_cell(doc, (*at, "n")),
                    *(number_cell(doc, (*at, key), sd and 0.1 * sd) for key in ("mean", "sd", "low", "high")),
                    number_cell(doc, (*at, "u"), significant=2),
                    text_cell(t["kind"] if t["low"] is not None else f"{t['kind']}: too few values"),
                    number_cell(doc, (*at, "p_normal"), write=write_p),
                    number_cell(doc, (*at, "beyond")),
                ]
            )
        )
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
    return [table, text, *_pictures(site_figures.control_charts(measures, lot), "control charts")]


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
        rows.append(
            Row(
                [
                    text_cell(d["instrument"], "strong"),
                    text_cell(d["name"]),
                    number_cell(doc, (*here, "dates")),
                    number_cell(doc, (*here, "slope"), d["u"], mark=mark),
                    number_cell(doc, (*here, "u"), d["u"]),
                    text_cell(f"{d['unit']} per day"),
                    number_cell(doc, (*here, "p_adjusted"), write=write_p),
                    text_cell("changed" if d["beyond_chance"] else "–", mark),
                ]
            )
        )
    heads = ("instrument", "name", "dates", "drift", "u", "unit", "p, adjusted", "")
    drifts = PageTable(
        [Column(h) for h in heads],
        rows,
        f"Drift of instruments between dates, smallest p first ({len(order)} of {len(changes['drifts'])}); p adjusted "
        "for all of them (Holm).",
    )
    return [pooled, drifts]


# ------------------------------------------------------------------------------------------------ simulations
def _coverage(doc: Json, measures: CampaignMeasures) -> list[Any]:
    covered = doc["coverage"]
    if not covered:
        return []
    extra = any("undoubted" in c for c in covered)
    rows = []
    for i, c in enumerate(covered):
        at = ("coverage", i)
        mark = "" if c["consistent"] else "significant"
        cells = [
            text_cell(c["name"], "strong"),
            number_cell(doc, (*at, "runs")),
            number_cell(doc, (*at, "share"), significant=3, mark=mark, trim=False),
            *(number_cell(doc, (*at, key), significant=3, trim=False) for key in ("lo", "hi")),
            *(number_cell(doc, (*at, key), 0.05) for key in ("z_mean", "z_rms")),
        ]
        if extra:
            for key in ("runs", "share", "lo", "hi"):
                cells.append(number_cell(doc, (*at, "undoubted", key), significant=3))
        rows.append(Row(cells))
    heads = ["name", "runs", "coverage", "95 % from", "to", "mean of z", "rms of z"]
    heads += ["runs, neither void nor inconclusive", "coverage", "from", "to"] if extra else []
    table = PageTable(
        [Column(h) for h in heads],
        rows,
        "Share of the 95 % coverage intervals that contain the true value, with Clopper-Pearson bounds; marked where "
        "they exclude 0.95 at a level shared by all measures. z = (estimate − truth) / u. Runs without result are not "
        "counted. Runs that share a seed count as fewer where their hits go together.",
    )
    text = Text(
        "Normalized error: error over the half-width of the interval on its side; band: the interval contains the true "
        "value; curve: normal errors with intervals of 95 %; the last bars hold what is farther off."
    )
    figures = _pictures(site_figures.normalized_errors(measures, covered), "normalized errors")
    return [table, *_pictures(site_figures.coverage_strip(covered), ""), *([text, *figures] if figures else [])]


def _responses(doc: Json) -> list[Any]:
    if not doc["effects"]:
        return []
    effects = doc["effects"]
    order = sorted(
        range(len(effects)),
        key=lambda k: (effects[k]["p"] is None, effects[k]["p"] or 0.0, -(effects[k]["share"] or 0.0)),
    )
    rows = []
    for k in order:
        e = doc["effects"][k]
        mark = "significant" if e["beyond_chance"] else ""
        rows.append(
            Row(
                [
                    text_cell(e["axis"], "strong"),
                    text_cell(e["name"]),
                    text_cell(e["quantity"]),
                    number_cell(doc, ("effects", k, "span"), significant=3),
                    text_cell(e["unit"]),
                    number_cell(doc, ("effects", k, "share"), significant=2),
                    number_cell(doc, ("effects", k, "p_adjusted"), write=write_p),
                    text_cell("beyond chance" if e["beyond_chance"] else "–", mark),
                ]
            )
        )
    heads = ("axis", "name", "quantity", "span of means", "unit", "share of variance", "p, adjusted", "")
    table = PageTable(
        [Column(h) for h in heads],
        rows,
        "Main effects: span of the adjusted means over the levels of an axis, the share of the variance that it "
        "alone explains, and p of no effect (F test in the additive model of all axes, Holm over all rows). A dash: no "
        "degrees of freedom, or the axis is a combination of others.",
        small=True,
    )
    drawn, left = site_figures.responses(doc)
    text = "Means over all runs at a value of the axis, adjusted for the main effects of the other axes; where an axis "
    text += (
        "has more than 12 values, over bins of equal count. The interval is that of the dispersion among these runs."
    )
    text += f" {left} pictures without effect beyond chance are left out." if left else ""
    table_block: Any = table if len(rows) <= 12 else CollapsedBlocks(f"Main effects: {len(rows)} tests", [table])
    return [table_block, Text(text), *_pictures(drawn, "responses")]


def _sobol(doc: Json) -> list[Any]:
    sobol = doc["sobol"]
    if not doc["effects"]:
        return []
    blocks: list[Any] = [Text(sobol["word"])]
    if not sobol["rows"]:
        return blocks
    totals = any(r["total"] is not None for r in sobol["rows"])
    keys = ["first", "lo", "hi", *(["total", "total_lo", "total_hi"] if totals else [])]
    rows = [
        Row(
            [text_cell(r["axis"], "strong"), text_cell(r["name"]), text_cell(r["quantity"])]
            + [number_cell(doc, ("sobol", "rows", i, key), 0.01) for key in keys]
        )
        for i, r in enumerate(sobol["rows"])
    ]
    heads = ["axis", "name", "quantity", "first order", "95 % from", "to"]
    heads += ["total", "95 % from", "to"] if totals else []
    table = PageTable([Column(h) for h in heads], rows, "Sobol' indices: shares of the variance.", small=True)
    figures = _pictures(site_figures.indices(sobol["rows"]), "indices")
    return [*blocks, *figures, CollapsedBlocks(f"PageTable of {len(rows)} indices", [table])]


def _distributions(doc: Json, measures: CampaignMeasures) -> list[Any]:
    if not doc["distributions"]:
        return []
    keys = ("mean", "sd", "min", "q025", "median", "q975", "max")
    rows = [
        Row(
            [text_cell(d["name"], "strong"), text_cell(d["unit"]), number_cell(doc, ("distributions", i, "n"))]
            + [number_cell(doc, ("distributions", i, key), d["sd"] and 0.1 * d["sd"]) for key in keys]
            + [number_cell(doc, ("distributions", i, "u"), significant=2)]
        )
        for i, d in enumerate(doc["distributions"])
    ]
    heads = ("name", "unit", "runs", "mean", "standard deviation", "smallest", "2.5 %", "median", "97.5 %", "largest",
             "median u")  # fmt: skip
    table = PageTable([Column(h) for h in heads], rows, "Estimates of all runs with a result.")
    return [table, *_pictures(site_figures.distributions(measures), "distributions")]


def _failures(doc: Json) -> list[Any]:
    if not doc["failures"]:
        return []
    rows = []
    for i, f in enumerate(doc["failures"]):
        same = max(re.split(r'[\d"]+', f["reason"]), key=len).strip()  # the longest piece without a number
        words = quote(f'state={f["state"]} "{same}"', safe="")
        rows.append(
            Row(
                [
                    text_cell(f["state"], "strong"),
                    number_cell(doc, ("failures", i, "runs")),
                    text_cell(f["reason"]),
                    text_cell("show", link=f"#filter={words}"),
                ]
            )
        )
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
                Row([text_cell(k), text_cell(v if isinstance(v, str) else compact(v))]) for k, v in doc[key].items()
            ]
            blocks.append(PageTable([Column("name"), Column("value", wide=True)], rows, f"{what}.", small=True))
    files = "All rows: runs.csv; the numbers of this page: analysis.json."
    return [*blocks, Text(files, quiet=True)]
