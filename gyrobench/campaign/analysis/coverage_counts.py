"""Coverage and normalized errors of the intervals of a campaign whose truth is known."""

from __future__ import annotations

from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.campaign.analysis.intervals import clopper_pearson, effective_runs
from gyrobench.campaign.analysis.lot_attention import DOUBTFUL
from gyrobench.campaign.analysis.measures import CampaignMeasures, Json, error, normalized_error, numbers, shared_seeds

NOMINAL = 0.95


def coverage(measures: CampaignMeasures) -> list[Json]:
    """Return for each measure with truth how many of its 95 % intervals hold it, with Clopper-Pearson bounds.

    z_mean, z_rms: of (estimate - truth) / u.  ``consistent``: the bounds, at a level shared by all measures
    (Bonferroni), hold 0.95.  ``undoubted``: the same count without runs whose verdict is void or inconclusive, where
    there are such runs.  ``effective``: how many independent runs the count is worth, fewer where runs of other
    settings have the same seed.  Runs without result are in no count.
    """
    rows = measures.done
    seeds = shared_seeds(rows)
    judged = [(n, e) for n in measures.names if np.isfinite(e := normalized_error(rows, n)).any()]
    doubtful = rows["verdict"].isin(DOUBTFUL).to_numpy(bool)
    found: list[Json] = []
    for name, e in judged:
        with np.errstate(divide="ignore", invalid="ignore"):
            z = error(rows, name) / numbers(rows, f"{name}.u")
        z = z[np.isfinite(z)]
        entry: Json = {"name": name, "unit": measures.unit(name), **_count(e, seeds)}
        runs = entry["effective"]
        low, high = clopper_pearson(entry["share"] * runs, runs, 1.0 - (1.0 - NOMINAL) / len(judged))
        entry |= {
            "consistent": low <= NOMINAL <= high,
            "z_mean": float(z.mean()) if len(z) else None,
            "z_rms": float(np.sqrt(np.mean(z**2))) if len(z) else None,
        }
        if doubtful.any():
            entry["undoubted"] = _count(e[~doubtful], None if seeds is None else seeds[~doubtful])
        found.append(entry)
    return found


def _count(e: Array, seeds: Any) -> Json:
    good = np.isfinite(e)
    hit = np.abs(e[good]) <= 1.0 + 1e-12
    runs = len(hit)
    effective = float(runs) if seeds is None or not runs else effective_runs(hit, seeds[good])
    share = float(hit.mean()) if runs else None
    low, high = clopper_pearson((share or 0.0) * effective, effective)
    return {"runs": runs, "hits": int(hit.sum()), "share": share, "lo": low, "hi": high, "effective": effective}
