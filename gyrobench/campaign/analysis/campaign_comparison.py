"""Differences of two campaigns beyond chance: two benches, two versions, two methods.

Runs that share the values of all common axes and the seed (of measured data the file) are compared in pairs, so that
noise common to both cancels; without such pairs the campaigns count as independent.  Runs that share a seed at several
settings share noise: their mean is one value.  All p are adjusted together (S. Holm, Scand. J. Stat. 6 (1979) 65):
of campaigns that do not differ at most 5 % show any difference.

error or estimate   mean difference; Student's t of the pairs, else Welch's
spread              standard deviation of errors or estimates; t of the absolute deviations from the medians (Brown and
                    Forsythe, J. Am. Stat. Assoc. 69 (1974) 364), of the pairs or of both campaigns
u                   ratio of the geometric means; t of the logarithms
coverage, result,   shares of intervals that hold the truth, of runs with a result, of verdicts pass; exact binomial
pass                test of the pairs that differ (McNemar), else Fisher's; t of the shares where runs share seeds
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from gyrobench.arrays import Array
from gyrobench.bench import UsageError
from gyrobench.campaign.analysis import measures
from gyrobench.campaign.execution.store import Campaign
from gyrobench.reduction.suite.ranking import LEVEL, ROUNDING, adjusted
from gyrobench.report.numbers import write_number
from gyrobench.report.result_json import content_hash, plain

SCHEMA = "gyrobench-campaign-comparison-1"
MIN_RUNS = 3  # with a result on both sides, for a test of a measure
MOST = 4  # names in a sentence


@dataclass(frozen=True)
class DifferenceTest:
    """a, b: values of the two campaigns.  change: b - a, or b / a of u, with its 95 % interval (None: not known)."""

    a: float
    b: float
    change: float
    low: float | None
    high: float | None
    p: float


def compare_campaigns(a: Campaign, b: Campaign) -> measures.Json:
    """Return the comparison of two campaigns, the first the baseline.  Raises UsageError where no measure is common."""
    both = [measures.CampaignMeasures.of(c.table(), c.units, c.axes) for c in (a, b)]
    common = [n for n in both[0].names if n in both[1].names and both[0].unit(n) == both[1].unit(n)]
    if not common:
        raise UsageError(f"{a.url} and {b.url} have no measure of one name and unit in common: nothing to compare")
    pairs = _pairs(*both)
    sides = Sides.of(both, pairs)
    tests: list[measures.Json] = []
    for name in common:
        tests += _of_measure(name, both, sides)
    tests += _of_runs(both, sides)
    for test, p in zip(tests, adjusted([t["p"] for t in tests]), strict=True):
        test |= {"p_adjusted": p, "beyond_chance": p < LEVEL}
    doc: measures.Json = plain(
        {
            "campaigns": [
                {"name": c.name, "url": c.url, "runs": len(m.rows), "system": c.definition.get("system") or ""}
                for c, m in zip((a, b), both, strict=True)
            ],
            "pairs": len(pairs[0]) if pairs else 0,
            "identical": _identical(common, both, pairs),
            "differing": _differing(a.definition, b.definition),
            "only": [[n for n in m.names if n not in common] for m in both],
            "tests": tests,
        }
    )
    doc["answer"] = _answer(doc)
    return {"schema": SCHEMA, "report_id": content_hash(doc), **doc}


# ---------------------------------------------------------------------------------------------------- pairs
Pairs = tuple[Sequence[int], Sequence[int]] | None


def _pairs(a: measures.CampaignMeasures, b: measures.CampaignMeasures) -> Pairs:
    """Return the places of the runs that belong together, None where a setting does not name one run in each."""
    axes = [n for n in (x["name"] for x in a.axes if x["kind"] not in (*measures.SEED_KINDS, "data"))]
    columns = [f"in.{n}" for n in axes if f"in.{n}" in a.rows and f"in.{n}" in b.rows]
    keys = []
    for m in (a, b):
        cells = [m.rows[c].astype(object).where(m.rows[c].notna(), None) for c in (*columns, "seed", "data")]
        found = {key: k for k, key in enumerate(zip(*cells, strict=True))}
        if len(found) < len(m.rows):
            return None
        keys.append(found)
    shared = [k for k in keys[0] if k in keys[1]]
    return ([keys[0][k] for k in shared], [keys[1][k] for k in shared]) if len(shared) >= MIN_RUNS else None


def _identical(names: Sequence[str], both: Sequence[measures.CampaignMeasures], pairs: Pairs) -> int:
    """Return how many pairs have the same numbers, to the last bit, and the same state."""
    if not pairs:
        return 0
    rows = [m.rows.iloc[list(at)] for m, at in zip(both, pairs, strict=True)]
    same = rows[0]["state"].to_numpy() == rows[1]["state"].to_numpy()
    for name in names:
        for key in ("estimate", "u", "lo", "hi"):
            x, y = (measures.numbers(r, f"{name}.{key}") for r in rows)
            same &= (x == y) | (np.isnan(x) & np.isnan(y))
    return int(same.sum())


def _differing(a: measures.Json, b: measures.Json) -> list[measures.Json]:
    """Return what was set differently: systems, options, parts, versions, axes."""
    found = []
    for key in ("system", "suite", "options", "parts", "versions"):
        x, y = a.get(key), b.get(key)
        if isinstance(x, dict) and isinstance(y, dict):
            names = [n for n in {**x, **y} if x.get(n) != y.get(n)]
            found += [{"what": f"{key[:-1]} {n}", "values": [x.get(n), y.get(n)]} for n in names]
        elif x != y:
            found.append({"what": key, "values": [x, y]})
    return found


# ---------------------------------------------------------------------------------------------------- tests
@dataclass(frozen=True)
class Sides:
    """The runs of both campaigns that a test uses: places of the pairs (None: all runs of each), clusters of seeds."""

    at: Pairs
    clusters: tuple[Any, Any]

    @classmethod
    def of(cls, both: Sequence[measures.CampaignMeasures], pairs: Pairs) -> Sides:
        rows = [m.rows.iloc[list(at)] for m, at in zip(both, pairs, strict=True)] if pairs else [m.rows for m in both]
        return cls(pairs, (measures.shared_seeds(rows[0]), measures.shared_seeds(rows[1])))

    def choose(self, values: Sequence[Array]) -> tuple[Array, Array] | None:
        """Return the finite values of both, those of one seed as their mean; None for too few."""
        x, y = (v[list(at)] for v, at in zip(values, self.at, strict=True)) if self.at else values
        goods = [np.isfinite(x), np.isfinite(y)]
        if self.at:
            goods = [goods[0] & goods[1]] * 2
        clusters = [None if c is None else c[g] for c, g in zip(self.clusters, goods, strict=True)]
        x, y = _means_of(x[goods[0]], clusters[0]), _means_of(y[goods[1]], clusters[1])
        return (x, y) if min(len(x), len(y)) >= MIN_RUNS else None


def _means_of(values: Array, clusters: Any) -> Array:
    if clusters is None:
        return values
    size = np.bincount(clusters)
    return np.asarray((np.bincount(clusters, values) / np.maximum(size, 1))[size > 0])


def _of_measure(name: str, both: Sequence[measures.CampaignMeasures], sides: Sides) -> list[measures.Json]:
    rows = [m.rows for m in both]
    known = all(np.isfinite(measures.error(r, name)).any() for r in rows)
    values = [measures.error(r, name) if known else measures.numbers(r, f"{name}.estimate") for r in rows]
    found: dict[str, DifferenceTest | None] = {
        "error" if known else "estimate": _means(values, sides),
        "spread": _spreads(values, sides),
        "u": _ratios([measures.numbers(r, f"{name}.u") for r in rows], sides),
    }
    if known:
        e = [measures.normalized_error(r, name) for r in rows]
        found["coverage"] = _shares([np.where(np.isfinite(x), np.abs(x) <= 1.0, np.nan) for x in e], sides)
    unit = both[0].unit(name)
    units = {"u": "1", "coverage": "1"}
    return [
        {"name": name, "quantity": q, "unit": units.get(q, unit), **test.__dict__}
        for q, test in found.items()
        if test is not None
    ]


def _of_runs(both: Sequence[measures.CampaignMeasures], sides: Sides) -> list[measures.Json]:
    """Return the tests of what runs have as a whole: a result, the verdict pass."""
    rows = [m.rows for m in both]
    verdicts = [np.where(r["verdict"].notna(), r["verdict"] == "pass", np.nan).astype(float) for r in rows]
    found = {"result": [(r["state"] == "done").to_numpy(float) for r in rows], "pass": verdicts}
    tests = {q: _shares(values, sides) for q, values in found.items()}
    return [{"name": "runs", "quantity": q, "unit": "1", **t.__dict__} for q, t in tests.items() if t is not None]


def _difference(x: Array, y: Array, paired: bool) -> tuple[float, float | None, float | None, float]:
    """Return the mean of y minus that of x, its 95 % interval and p of none."""
    change = float(y.mean() - x.mean())
    scale = ROUNDING * max(float(np.abs(x).max()), float(np.abs(y).max()))
    if paired:
        d = y - x
        if np.ptp(d) <= scale:  # the same difference in all pairs
            same = bool(np.abs(d).max() <= scale)
            return (0.0, 0.0, 0.0, 1.0) if same else (change, change, change, 0.0)
        u, freedom = float(d.std(ddof=1)) / np.sqrt(len(d)), float(len(d) - 1)
    else:
        parts = [float(v.var(ddof=1)) / len(v) for v in (x, y)]
        if np.sqrt(sum(parts)) <= scale:
            return (0.0, 0.0, 0.0, 1.0) if abs(change) <= scale else (change, change, change, 0.0)
        u = float(np.sqrt(sum(parts)))
        freedom = sum(parts) ** 2 / sum(p**2 / (len(v) - 1) for p, v in zip(parts, (x, y), strict=True))
    half = float(stats.t.ppf(0.975, freedom)) * u
    return change, change - half, change + half, 2.0 * float(stats.t.sf(abs(change) / u, freedom))


def _means(values: Sequence[Array], sides: Sides) -> DifferenceTest | None:
    chosen = sides.choose(values)
    if chosen is None:
        return None
    x, y = chosen
    return DifferenceTest(float(x.mean()), float(y.mean()), *_difference(x, y, sides.at is not None))


def _spreads(values: Sequence[Array], sides: Sides) -> DifferenceTest | None:
    chosen = sides.choose([np.abs(v - np.nanmedian(v)) for v in values])
    if chosen is None:
        return None
    a, b = (float(np.nanstd(v, ddof=1)) for v in values)
    *_, p = _difference(*chosen, sides.at is not None)
    return DifferenceTest(a, b, b - a, None, None, p)


def _ratios(values: Sequence[Array], sides: Sides) -> DifferenceTest | None:
    with np.errstate(divide="ignore", invalid="ignore"):
        chosen = sides.choose([np.where(v > 0.0, np.log(v), np.nan) for v in values])
    if chosen is None:
        return None
    x, y = chosen
    change, low, high, p = _difference(x, y, sides.at is not None)
    ends = [None if v is None else float(np.exp(v)) for v in (low, high)]
    return DifferenceTest(float(np.exp(x.mean())), float(np.exp(y.mean())), float(np.exp(change)), ends[0], ends[1], p)


def _shares(values: Sequence[Array], sides: Sides) -> DifferenceTest | None:
    """values: 1 hit, 0 miss, NaN not judged."""
    chosen = sides.choose(values)
    if chosen is None:
        return None
    x, y = chosen
    a, b = float(x.mean()), float(y.mean())
    if any(c is not None for c in sides.clusters):
        return DifferenceTest(a, b, *_difference(x, y, sides.at is not None))
    if sides.at:
        gained, lost = int((y > x).sum()), int((x > y).sum())
        p = float(stats.binomtest(gained, gained + lost).pvalue) if gained + lost else 1.0
    else:
        counts = [[int(v.sum()), int((1.0 - v).sum())] for v in (x, y)]
        p = float(stats.fisher_exact(counts).pvalue)
    return DifferenceTest(a, b, b - a, None, None, p)


# ------------------------------------------------------------------------------------------------- sentences
def _answer(doc: measures.Json) -> list[str]:
    a, b = (c["name"] for c in doc["campaigns"])
    a, b = (f"A ({a})", f"B ({b})")
    pairs = doc["pairs"]
    said = [
        f"{pairs} runs of {a} and {b} are compared in pairs of equal settings and seeds."
        if pairs
        else f"The runs of {a} and {b} do not form pairs; the campaigns are compared as independent."
    ]
    if pairs and doc["identical"] == pairs:
        return [*said, "All of them are identical to the last bit."]
    if doc["identical"]:
        said.append(f"{doc['identical']} pairs are identical to the last bit.")
    clear = sorted((t for t in doc["tests"] if t["beyond_chance"]), key=lambda t: t["p"])
    if not doc["tests"]:
        said.append("Too few independent runs to compare: seeds or settings of their own make more.")
    elif not clear:
        said.append(f"No difference beyond chance in {len(doc['tests'])} tests.")
    for t in clear[:MOST]:
        x, y = (write_number(t[k], significant=3).text for k in ("a", "b"))
        unit = "" if t["unit"] in ("", "1") else f" {t['unit']}"
        name = "Runs" if t["name"] == "runs" else t["name"]
        said.append(f"{name}, {QUANTITIES[t['quantity']]}: {x}{unit} in A, {y}{unit} in B.")
    if len(clear) > MOST:
        said.append(f"{len(clear) - MOST} more of {len(doc['tests'])} tests show a difference beyond chance.")
    if doc["differing"]:
        named = [d["what"] for d in doc["differing"]]
        more = f" and {len(named) - MOST} more" if len(named) > MOST else ""
        said.append(f"Set differently: {', '.join(named[:MOST])}{more}.")
    return said


QUANTITIES = {
    "estimate": "mean estimate",
    "error": "mean error",
    "spread": "standard deviation",
    "u": "u, geometric mean",
    "coverage": "coverage of the 95 % intervals",
    "result": "share with a result",
    "pass": "share of verdicts pass",
}
