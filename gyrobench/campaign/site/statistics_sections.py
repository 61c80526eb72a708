"""Sections of the page of a campaign that show its statistics: coverage, effects, shares of variance, distributions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from gyrobench.campaign.analysis.measures import CampaignMeasures, Json
from gyrobench.campaign.site import site_figures
from gyrobench.report.numbers import write_p
from gyrobench.report.page_model import (
    CollapsedBlocks,
    Column,
    PageTable,
    Picture,
    Pictures,
    Row,
    Text,
    number_cell,
    text_cell,
)

SHOWN_MEASURES = 9  # whose pictures stand open; those of more are folded


def pictures_of(items: Sequence[Picture], what: str) -> list[Any]:
    """Return pictures, those of many measures folded."""
    shown, rest = list(items[:SHOWN_MEASURES]), list(items[SHOWN_MEASURES:])
    blocks: list[Any] = [Pictures(shown)] if shown else []
    if rest:
        blocks.append(CollapsedBlocks(f"{len(rest)} more {what}", [Pictures(rest)]))
    return blocks


# ------------------------------------------------------------------------------------------------ simulations
def coverage_section(doc: Json, measures: CampaignMeasures) -> list[Any]:
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
    figures = pictures_of(site_figures.normalized_errors(measures, covered), "normalized errors")
    return [table, *pictures_of(site_figures.coverage_strip(covered), ""), *([text, *figures] if figures else [])]


def responses_section(doc: Json) -> list[Any]:
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
        cells = [
            text_cell(e["axis"], "strong"),
            text_cell(e["name"]),
            text_cell(e["quantity"]),
            number_cell(doc, ("effects", k, "span"), significant=3),
            text_cell(e["unit"]),
            number_cell(doc, ("effects", k, "share"), significant=2),
            number_cell(doc, ("effects", k, "p_adjusted"), write=write_p),
            text_cell("beyond chance" if e["beyond_chance"] else "–", mark),
        ]
        rows.append(Row(cells))
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
    return [table_block, Text(text), *pictures_of(drawn, "responses")]


def sobol_section(doc: Json) -> list[Any]:
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
    figures = pictures_of(site_figures.indices(sobol["rows"]), "indices")
    return [*blocks, *figures, CollapsedBlocks(f"Table of {len(rows)} indices", [table])]


def distributions_section(doc: Json, measures: CampaignMeasures) -> list[Any]:
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
    return [table, *pictures_of(site_figures.distributions(measures), "distributions")]
