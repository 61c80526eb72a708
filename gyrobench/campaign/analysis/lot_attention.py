"""Measurements of a lot that need attention, and why: no result, a record that contradicts its test, an outlier.

A whole lot may be inconclusive for one cause, such as a statement of type B that all files lack.  What more than half
of the results warn of is therefore said once, of the lot, and singles out nobody.
"""

from __future__ import annotations

import re
from collections import Counter
from typing import Any

import numpy as np

from gyrobench.campaign.analysis.lot_outliers import LotOutliers
from gyrobench.campaign.analysis.measures import CampaignMeasures, Json
from gyrobench.report.numbers import write_number
from gyrobench.result import NO_VERDICT

DOUBTFUL = ("void", "inconclusive")
COMMON = 0.5  # share of the results from which on a warning is one of the lot
HANDLING = "Handling error"  # opens the warning of gyrobench.reduction.diagnosis.handling_errors


def pattern(warning: str) -> str:
    """Return a warning without its numbers and names of coefficients, to compare warnings of several runs."""
    text = re.sub(r"\S*[\d_]\S*", "", warning)
    return re.sub(r"[\W_]+", " ", text).strip()


def warnings_of(row: Any) -> list[str]:
    """Return the warnings of a row."""
    return [] if row["warnings"] is None else [str(w) for w in row["warnings"]]


def common_warnings(rows: Any) -> dict[str, tuple[int, str]]:
    """Return what more than half of the results warn of: pattern -> number of results, the first warning."""
    done = [warnings_of(row) for _, row in rows[rows["state"] == "done"].iterrows()]
    counts = Counter(p for warnings in done for p in {pattern(w) for w in warnings})
    first = {pattern(w): w for warnings in reversed(done) for w in reversed(warnings)}
    return {p: (n, first[p]) for p, n in counts.most_common() if n > COMMON * len(done) and n > 1}


def contradictions(rows: Any) -> list[list[str]]:
    """Return for each row why it has no result, or what its own record says against it; [] for most."""
    common = common_warnings(rows)
    found = []
    for _, row in rows.iterrows():
        own = [w for w in warnings_of(row) if pattern(w) not in common]
        handling = [w for w in own if w.startswith(HANDLING)]
        if row["state"] != "done":
            found.append([re.sub(r"\s*\n[\s-]*", " ", row["reason"] or "no reason is stored")])
        elif handling:
            found.append(handling[:1])
        elif row["verdict"] in DOUBTFUL and own:
            found.append(own[:1])
        elif row["verdict"] == "void" or (row["verdict"] in DOUBTFUL and not warnings_of(row)):
            found.append([f"{row['verdict']}, without a warning of its own"])
        else:
            found.append([])
    return found


def instruments(lot: CampaignMeasures, against: list[list[str]], outliers: LotOutliers | None) -> list[Json]:
    """Return every row of a lot: instrument, file, date, verdict, distance, and why it needs attention (or [])."""
    listed = []
    for k, (name, (_, row)) in enumerate(zip(lot.instrument(), lot.rows.iterrows(), strict=True)):
        outlier = outliers is not None and bool(outliers.outlier[k])
        distance = None if outliers is None or not np.isfinite(outliers.distance[k]) else float(outliers.distance[k])
        entry: Json = {"run": row["run"], "instrument": name, "data": row["data"], "verdict": _verdict(row)}
        entry |= {key: row[key] if isinstance(row.get(key), str) else None for key in ("date", "report")}
        entry |= {"distance": distance, "outlier": outlier, "contradicted": bool(against[k]), "why": list(against[k])}
        if outlier and outliers is not None:
            entry["why"].append(_unlike(lot, outliers.score[k]))
        listed.append(entry)
    return listed


def _unlike(lot: CampaignMeasures, score: Any) -> str:
    """Return in which coefficient an outlier differs most."""
    worst = int(np.nanargmax(np.abs(score)))
    side = "above" if score[worst] > 0.0 else "below"
    size = write_number(abs(float(score[worst])), significant=2).text
    return f"outlier: {lot.names[worst]} is {size} standard deviations {side} the accepted instruments"


def _verdict(row: Any) -> str:
    """Return the verdict of a row, or the state of a run that has none."""
    if row["state"] != "done":
        return str(row["state"])
    return row["verdict"] if isinstance(row["verdict"], str) else NO_VERDICT
