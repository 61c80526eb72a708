"""Runs that differ in nothing but the seed, taken together as one candidate of a comparison."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import Any

from scipy import special

from gyrobench.report.result_json import content_hash

Json = dict[str, Any]


def pool(names: Sequence[str], docs: Sequence[Json]) -> tuple[list[str], list[Json]]:
    """Return the names and documents of a comparison's candidates, in the order of their first runs.

    Runs of equal system, parts, parameters, options, step and plan with different seeds become one document: each
    estimate is the mean over the seeds, u its standard error (so it holds what the seed changes, and no other error
    that the runs share), k Student's, "draws" the single values by seed.  Responses and figures are those of the first.
    """
    groups: dict[str, list[int]] = {}
    for k, doc in enumerate(docs):
        groups.setdefault(_identity(doc, k), []).append(k)
    alone = len(groups) < 2  # nothing to compare but the runs themselves
    candidates = [[k] for g in groups.values() for k in g] if alone else list(groups.values())
    candidates = [part for g in candidates for part in ([g] if _differ(docs, g) else [[k] for k in g])]
    labels = [_label([names[k] for k in g]) for g in candidates]
    if len(set(labels)) < len(labels):
        labels = [names[g[0]] for g in candidates]
    return labels, [docs[g[0]] if len(g) == 1 else _together([docs[k] for k in g]) for g in candidates]


def _differ(docs: Sequence[Json], group: Sequence[int]) -> bool:
    """Return whether each run has a seed of its own; two of the same seed are compared with each other."""
    seeds = [docs[k]["provenance"].get("seed") for k in group]
    return len(set(seeds)) == len(seeds)


def _identity(doc: Json, number: int) -> str:
    """Return what makes runs replicates: all but the seeds; a measured record or a run of unknown seed is its own."""
    run = doc["provenance"]
    if not doc["simulated"] or run.get("seed") is None:
        return f"run {number}"
    parameters = {k: v for k, v in (run.get("parameters") or {}).items() if not k.endswith(".seed")}
    same = [
        doc["system"],
        doc["site"],
        parameters,
        *(run.get(k) for k in ("parts", "options", "step", "engine", "plan")),
    ]
    return json.dumps(same, sort_keys=True)


def _label(names: Sequence[str]) -> str:
    """Return the name of a single run, of several what their names begin with, without the number of the seed."""
    if len(names) == 1:
        return names[0]
    common = next(names[0][:n] for n in range(len(names[0]), -1, -1) if all(x.startswith(names[0][:n]) for x in names))
    return common.rstrip("0123456789").rstrip(" ,-_/.").removesuffix(", seed") or f"{names[0]} and others"


def _together(docs: Sequence[Json]) -> Json:
    seeds = [int(d["provenance"]["seed"]) for d in docs]
    keys = [(c["name"], c["unit"]) for c in docs[0]["coefficients"]]
    rows = []
    for key in keys:
        each = [next((c for c in d["coefficients"] if (c["name"], c["unit"]) == key), None) for d in docs]
        found = [c for c in each if c is not None]
        if len(found) == len(docs):
            rows.append(_mean(found, seeds))
    verdicts = [d["verdict"] for d in docs]
    merged = {**docs[0], "coefficients": rows, "verdict": "void" if "void" in verdicts else docs[0]["verdict"]}
    if len(set(verdicts)) > 1 and merged["verdict"] != "void":
        merged["verdict"] = "inconclusive"
    return {**merged, "seeds": seeds, "report_id": content_hash({"runs": [d["report_id"] for d in docs]})}


def _mean(found: Sequence[Json], seeds: Sequence[int]) -> Json:
    values = [c["estimate"] for c in found]
    missing = [(s, c) for s, c in zip(seeds, found, strict=True) if c["no_value"] or c["estimate"] is None]
    if missing:
        reason = f"no value with seed {', '.join(str(s) for s, _ in missing)}: {missing[0][1]['no_value']}"
        nothing = {"estimate": None, "u": None, "interval": [None, None], "u_a": None}
        return {**found[0], **nothing, "no_value": reason}
    n = len(values)
    mean = math.fsum(values) / n
    u = math.sqrt(math.fsum((v - mean) ** 2 for v in values) / (n * (n - 1)))
    k = float(special.stdtrit(n - 1, 0.975))
    draws = {str(s): v for s, v in zip(seeds, values, strict=True)}
    return {**found[0], "estimate": mean, "u": u, "k": k, "interval": [mean - k * u, mean + k * u], "u_a": u,
            "draws": draws}  # fmt: skip
