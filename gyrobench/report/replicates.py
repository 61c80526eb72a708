"""Runs that differ in nothing but the seed, taken together as one candidate of a comparison."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from scipy import special

from gyrobench.report.result_json import content_hash, plain, report_id
from gyrobench.result import Coefficient, Result

Draws = Mapping[int, float]  # seed -> value in the run with it


@dataclass(frozen=True)
class ComparedRun:
    """A run of a comparison, or several with different seeds as one.

    Of several, coefficients are means over the seeds and ``draws`` their single values, in the same order; verdict:
    "inconclusive" where theirs differ, void where one is.  The rest of the result is that of the first.
    """

    name: str
    result: Result
    report_id: str
    seeds: list[int] = field(default_factory=list)
    draws: list[Draws] = field(default_factory=list)

    def find(self, name: str, unit: str = "") -> tuple[Coefficient, Draws] | None:
        """Return a coefficient by name, and by unit where one is given, with its draws."""
        for k, c in enumerate(self.result.coefficients):
            if c.name == name and unit in ("", c.unit):
                return c, self.draws[k] if self.draws else {}
        return None


def pool(results: Sequence[tuple[str, Result]]) -> list[ComparedRun]:
    """Return the candidates of a comparison of named results, in the order of their first runs.

    Runs of equal system, parts, parameters, options, step and plan with different seeds become one: each estimate is
    the mean over the seeds, u its standard error (so it holds what the seed changes, and no other error that the runs
    share), k Student's.  Responses and figures are those of the first.
    """
    groups: dict[str, list[int]] = {}
    for k, (_, result) in enumerate(results):
        groups.setdefault(_identity(result, k), []).append(k)
    alone = len(groups) < 2  # nothing to compare but the runs themselves
    candidates = [[k] for g in groups.values() for k in g] if alone else list(groups.values())
    candidates = [part for g in candidates for part in ([g] if _differ(results, g) else [[k] for k in g])]
    labels = [_label([results[k][0] for k in g]) for g in candidates]
    if len(set(labels)) < len(labels):
        labels = [results[g[0]][0] for g in candidates]
    return [_candidate(name, [results[k][1] for k in g]) for name, g in zip(labels, candidates, strict=True)]


def _differ(results: Sequence[tuple[str, Result]], group: Sequence[int]) -> bool:
    """Return whether each run has a seed of its own; two of the same seed are compared with each other."""
    seeds = [results[k][1].provenance.get("seed") for k in group]
    return len(set(seeds)) == len(seeds)


def _identity(result: Result, number: int) -> str:
    """Return what makes runs replicates: all but the seeds; a measured record or a run of unknown seed is its own."""
    run = result.provenance
    if not result.simulated or run.get("seed") is None:
        return f"run {number}"
    parameters = {k: v for k, v in (run.get("parameters") or {}).items() if not k.endswith(".seed")}
    same = [
        result.system,
        result.site,
        parameters,
        *(run.get(k) for k in ("parts", "options", "step", "engine", "plan")),
    ]
    return json.dumps(plain(same), sort_keys=True)


def _label(names: Sequence[str]) -> str:
    """Return the name of a single run, of several what their names begin with, without the number of the seed."""
    if len(names) == 1:
        return names[0]
    common = next(names[0][:n] for n in range(len(names[0]), -1, -1) if all(x.startswith(names[0][:n]) for x in names))
    return common.rstrip("0123456789").rstrip(" ,-_/.").removesuffix(", seed") or f"{names[0]} and others"


def _candidate(name: str, results: Sequence[Result]) -> ComparedRun:
    first, *others = results
    ids = [report_id(r) for r in results]
    if not others:
        return ComparedRun(name, first, ids[0])
    seeds = [int(r.provenance["seed"]) for r in results]
    rows: list[tuple[Coefficient, Draws]] = []
    for c in first.coefficients:
        each = [next((x for x in r.coefficients if (x.name, x.unit) == (c.name, c.unit)), None) for r in results]
        found = [x for x in each if x is not None]
        if len(found) == len(results):
            rows.append(_mean(found, seeds))
    verdicts = {r.verdict for r in results}
    verdict = "void" if "void" in verdicts else first.verdict if len(verdicts) == 1 else "inconclusive"
    merged = replace(first, coefficients=[c for c, _ in rows], verdict=verdict)
    return ComparedRun(name, merged, content_hash({"runs": ids}), seeds, [draws for _, draws in rows])


def _mean(found: Sequence[Coefficient], seeds: Sequence[int]) -> tuple[Coefficient, Draws]:
    """Return the mean of a coefficient over the seeds, and its single values."""
    values = [c.estimate for c in found]
    missing = [(s, c) for s, c in zip(seeds, found, strict=True) if c.no_value or not math.isfinite(c.estimate)]
    if missing:
        reason = f"no value with seed {', '.join(str(s) for s, _ in missing)}: {missing[0][1].no_value}"
        nothing: dict[str, Any] = {"estimate": math.nan, "u": math.nan, "interval": (math.nan, math.nan), "u_a": None}
        return replace(found[0], **nothing, no_value=reason), {}
    n = len(values)
    mean = math.fsum(values) / n
    u = math.sqrt(math.fsum((v - mean) ** 2 for v in values) / (n * (n - 1)))
    k = float(special.stdtrit(n - 1, 0.975))
    pooled = replace(found[0], estimate=mean, u=u, k=k, interval=(mean - k * u, mean + k * u), u_a=u)
    return pooled, dict(zip(seeds, values, strict=True))
