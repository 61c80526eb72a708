"""Runs in the order of the measures that their reduction names for it (``Result.ranked_by``, ``Result.purposes``)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.suite.ranking import RankedValue, rank
from gyrobench.report.page_model import BulletList, Column, PageTable, Row, Section, Text, number_cell, text_cell
from gyrobench.report.replicates import ComparedRun, Draws
from gyrobench.report.result_json import value_at
from gyrobench.result import Coefficient

Json = dict[str, Any]
NOTE = (
    "Probability that a run lies behind the first run of its rank or, for the first of a rank, of the rank before, "
    "lowered for the number of pairs compared (Holm). A new rank begins above 0.975: among equal runs at most one "
    "comparison in twenty shows a false rank. Noise reduction alone does not improve a rank: measures of error are "
    "deviations from the truth."
)


def ranking(runs: Sequence[ComparedRun]) -> Json:
    """Return the ranking by the measure that all runs name, see :func:`ranking_by`; {} where they name none, or not the
    same one.
    """
    (name, *others) = dict.fromkeys(run.result.ranked_by for run in runs)
    return {} if others or not name else ranking_by(runs, name)


def by_purpose(runs: Sequence[ComparedRun]) -> list[Json]:
    """Return a ranking by each further measure that all runs name (``Result.purposes``), with its "purpose"."""
    purposes = runs[0].result.purposes
    common = [n for n in purposes if all(n in run.result.purposes for run in runs)]
    ranked = [(ranking_by(runs, name), purposes[name]) for name in common]
    return [{**found, "purpose": purpose} for found, purpose in ranked if found]


def ranking_by(runs: Sequence[ComparedRun], name: str) -> Json:
    """Return ``{"name", "unit", "meaning", "order": [{"run", "place", "value", "u", "over_best", "apart",
    "probability"}], "void": [{"run", "reason"}]}``; {} where fewer than two runs can be ordered.

    place, probability: see :mod:`gyrobench.reduction.suite.ranking`.  apart: whether the run begins a rank of its own;
    None for the first of all.  void: runs without a value of the measure, or with the verdict void; they have no rank.
    """
    ranked = [run.find(name) for run in runs]
    why = [found[0].no_value if found else "" for found in ranked]
    void = [
        {"run": k, "reason": why[k] or "another measure of the run has no value"}
        for k, run in enumerate(runs)
        if run.result.verdict == "void" or why[k]
    ]
    out = {v["run"] for v in void}
    known = [(k, *found) for k, found in enumerate(ranked)
             if k not in out and found is not None and math.isfinite(found[0].estimate)]  # fmt: skip
    if not known or len(known) + len(void) < 2 or len({c.unit for _, c, _ in known}) > 1:
        return {}
    places = rank([candidate(c, draws) for _, c, draws in known])
    best = known[places[0].index][1]
    order: list[Json] = []
    for count, p in enumerate(places):
        k, c, _ = known[p.index]
        over = c.estimate / best.estimate if best.estimate else None
        order.append(
            {"run": k, "place": p.place, "value": c.estimate, "u": c.u, "over_best": over,
             "apart": p.place == count + 1 if count else None, "probability": p.probability}
        )  # fmt: skip
    return {"name": name, "unit": best.unit, "meaning": best.meaning, "order": order, "void": void}


def candidate(c: Coefficient, draws: Draws) -> RankedValue:
    """Return a coefficient as a candidate of a ranking."""
    return RankedValue(c.estimate, c.u if math.isfinite(c.u) else None, c.k or NORMAL, draws)


def place_text(ranked: Json, entry: Json) -> str:
    """Return "1", or "1 =" where several runs share the place."""
    shared = sum(e["place"] == entry["place"] for e in ranked["order"]) > 1
    return f"{entry['place']} =" if shared else str(entry["place"])


def probability_text(entry: Json) -> str:
    """Return "0.62", "> 0.999", or "" for the first of all."""
    p = entry["probability"]
    return "" if p is None else "> 0.999" if p > 0.999 else f"{p:.3f}" if p > 0.99 else f"{p:.2f}"


def section(doc: Json, letters: Sequence[str]) -> Section:
    """Return the section of a comparison document (:mod:`.comparison`) that shows its ranking; empty without one."""
    ranked = doc["ranking"]
    if not ranked:
        return Section("Ranking", "ranking", [])
    caption = (
        f"Ranking by {ranked['name']}: {ranked['meaning']}; the smallest value ranks first, runs that cannot be told "
        "apart (=) share a rank."
    )
    blocks: list[Any] = [_places(doc, letters)] if doc["purposes"] else []
    blocks += [_table(doc, ("ranking",), caption, letters), Text(NOTE, quiet=True)]
    for k, other in enumerate(doc["purposes"]):
        caption = f"{other['purpose']}: ranking by {other['name']}, {other['meaning']}."
        blocks.append(_table(doc, ("purposes", k), caption, letters))
    without = {(v["run"], v["reason"]): None for r in (ranked, *doc["purposes"]) for v in r["void"]}
    if without:
        blocks.append(BulletList([f"{letters[run]} has no rank: {reason}." for run, reason in without], warn=True))
    return Section("Ranking", "ranking", blocks)


def _places(doc: Json, letters: Sequence[str]) -> PageTable:
    """Return the rank of each run by each measure."""
    rows = []
    for ranked in (doc["ranking"], *doc["purposes"]):
        places = {e["run"]: place_text(ranked, e) for e in ranked["order"]}
        shown = [places.get(k, "–") for k in range(len(letters))]
        cells = [text_cell(x, "strong" if x in ("1", "1 =") else "") for x in shown]
        rows.append(Row([text_cell(ranked.get("purpose", "First measure")), text_cell(ranked["name"]), *cells]))
    columns = [Column("purpose", wide=True), Column("measure"), *(Column(x) for x in letters)]
    return PageTable(columns, rows, "Ranks of all runs by all measures, 1: the smallest value; =: shared.")


def _table(doc: Json, path: tuple[str | int, ...], caption: str, letters: Sequence[str]) -> PageTable:
    ranked = value_at(doc, *path)
    several = len({run["instrument"] for run in doc["runs"]}) > 1
    rows = []
    for index, entry in enumerate(ranked["order"]):
        run, at = doc["runs"][entry["run"]], (*path, "order", index)
        cells = [
            text_cell(place_text(ranked, entry), "strong"),
            text_cell(letters[entry["run"]]),
            text_cell(run["name"]),
            *([text_cell(run["instrument"])] if several else []),
            number_cell(doc, (*at, "value"), entry["u"]),
            number_cell(doc, (*at, "u"), entry["u"]),
            number_cell(doc, (*at, "over_best"), significant=3),
            text_cell(probability_text(entry)),
        ]
        rows.append(Row(cells))
    for entry in ranked["void"]:
        run = doc["runs"][entry["run"]]
        known = [text_cell("–"), text_cell(letters[entry["run"]]), text_cell(run["name"])]
        known += [text_cell(run["instrument"])] if several else []
        rows.append(Row([*known, text_cell("void", "void"), *(text_cell("–") for _ in range(3))]))
    unit = ranked["unit"] if ranked["unit"] != "1" else ""
    columns = [
        Column("rank"),
        Column(""),
        Column("name", wide=True),
        *([Column("instrument")] if several else []),
        Column(ranked["name"], unit),
    ]
    columns += [Column("u"), Column("ratio to the smallest"), Column("probability")]
    return PageTable(columns, rows, caption)
