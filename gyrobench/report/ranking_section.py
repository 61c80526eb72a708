"""Runs in the order of the one measure that their reduction names for it (``Result.ranked_by``), smallest first."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from gyrobench.report.page_model import BulletList, Column, Row, Section, Table, Text, number_cell, text_cell

Json = dict[str, Any]


def ranking(docs: Sequence[Json]) -> Json:
    """Return ``{"name", "unit", "meaning", "order": [{"run", "place", "value", "u", "over_best", "apart"}], "void":
    [{"run", "reason"}]}``; {} when the runs name no measure, or not the same one.

    place: runs that cannot be told from the first of their place share it.  apart: whether a run is farther from that
    one than the expanded uncertainty of their difference; None for the first of all.  void: runs without a value of the
    measure, or with the verdict void; they have no rank.
    """
    (name, *others) = dict.fromkeys(str(doc.get("ranked_by") or "") for doc in docs)
    if others or not name:
        return {}
    ranked = [next((c for c in doc["coefficients"] if c["name"] == name), None) for doc in docs]
    void = [
        {"run": k, "reason": (c and c["no_value"]) or "another measure of the run has no value"}
        for k, (doc, c) in enumerate(zip(docs, ranked, strict=True))
        if doc["verdict"] == "void" or (c and c["no_value"])
    ]
    out = {v["run"] for v in void}
    known = [
        (c["estimate"], k, c)
        for k, c in enumerate(ranked)
        if k not in out and c is not None and c["estimate"] is not None
    ]
    if not known or len(known) + len(void) < 2 or len({c["unit"] for _, _, c in known}) > 1:
        return {}
    known.sort(key=lambda entry: entry[:2])
    best, _, first = known[0]
    order: list[Json] = []
    leader, place = first, 1
    for count, (value, k, c) in enumerate(known, 1):
        apart = None
        if count > 1 and None not in (c["u"], leader["u"]):
            U = max(c["k"], leader["k"]) * math.hypot(c["u"], leader["u"])
            apart = value - leader["estimate"] > U
        if apart or (apart is None and value > leader["estimate"]):
            leader, place = c, count
        over = value / best if best else None
        order.append({"run": k, "place": place, "value": value, "u": c["u"], "over_best": over, "apart": apart})
    return {"name": name, "unit": first["unit"], "meaning": first["meaning"], "order": order, "void": void}


def place_text(ranked: Json, entry: Json) -> str:
    """Return "1", or "1 =" where several runs share the place."""
    shared = sum(e["place"] == entry["place"] for e in ranked["order"]) > 1
    return f"{entry['place']} =" if shared else str(entry["place"])


def section(doc: Json, letters: Sequence[str]) -> Section:
    """Return the section of a comparison document (:mod:`.comparison`) that shows its ranking; empty without one."""
    ranked = doc["ranking"]
    if not ranked:
        return Section("Ranking", "ranking", [])
    rows = []
    for index, entry in enumerate(ranked["order"]):
        run = doc["runs"][entry["run"]]
        path = ("ranking", "order", index)
        rows.append(
            Row(
                [
                    text_cell(place_text(ranked, entry), "strong"),
                    text_cell(letters[entry["run"]]),
                    text_cell(run["name"]),
                    text_cell(run["instrument"]),
                    number_cell(doc, (*path, "value"), entry["u"]),
                    number_cell(doc, (*path, "u"), entry["u"]),
                    number_cell(doc, (*path, "over_best"), significant=3),
                ]
            )
        )
    for entry in ranked["void"]:
        run = doc["runs"][entry["run"]]
        known = [text_cell("–"), text_cell(letters[entry["run"]]), text_cell(run["name"]), text_cell(run["instrument"])]
        rows.append(Row([*known, text_cell("void", "void"), *(text_cell("–") for _ in range(2))]))
    unit = ranked["unit"] if ranked["unit"] != "1" else ""
    columns = [
        Column("rank"),
        Column(""),
        Column("run", wide=True),
        Column("instrument"),
        Column(ranked["name"], unit),
    ]
    columns += [Column("u"), Column("ratio to the smallest")]
    caption = (
        f"Ranking by {ranked['name']}: {ranked['meaning']}; the smallest value ranks first, runs that cannot be told "
        "apart (=) share a rank."
    )
    note = "Noise reduction alone does not improve the rank: the measure is the deviation from the truth."
    blocks: list[Any] = [Table(columns, rows, caption), Text(note, quiet=True)]
    if ranked["void"]:
        blocks.append(
            BulletList([f"{letters[v['run']]} has no rank: {v['reason']}." for v in ranked["void"]], warn=True)
        )
    return Section("Ranking", "ranking", blocks)
