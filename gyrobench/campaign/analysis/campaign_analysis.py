"""Analysis of a campaign as one document: every number of its site is read from here."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gyrobench.campaign.analysis.axis_effects import main_effects, responses
from gyrobench.campaign.analysis.coverage_counts import coverage
from gyrobench.campaign.analysis.lots import analyse_lot
from gyrobench.campaign.analysis.measures import CampaignMeasures, Json, numbers
from gyrobench.campaign.analysis.shown_files import names_alone, without_folders
from gyrobench.campaign.analysis.sobol_indices import sobol_indices
from gyrobench.report.numbers import write_number

if TYPE_CHECKING:
    from gyrobench.campaign.execution.store import Campaign

SCHEMA = "gyrobench-campaign-analysis-1"
MOST = 4  # names in a sentence
FEW = 0.85  # a bound of the coverage below it says that the count says little
PERCENTILES = {"min": 0.0, "q025": 2.5, "median": 50.0, "q975": 97.5, "max": 100.0}


def analyse(campaign: Campaign) -> Json:
    """Return the analysis of a stored campaign: states, distributions, coverage, responses, indices, lot, failures.

    Files are called as a site does (:mod:`.shown_files`).
    """
    rows = without_folders(campaign.table())
    measures = CampaignMeasures.of(rows, campaign.units, campaign.axes)
    definition = campaign.definition
    doc: Json = {
        "schema": SCHEMA,
        "name": campaign.name,
        "question": str(definition.get("question") or ""),
        "system": str(definition.get("system") or definition.get("suite") or ""),
        "created_with": definition.get("created_with"),
        "versions": definition.get("versions") or {},
        "parts": names_alone(definition.get("parts") or {}),
        "options": names_alone(definition.get("options") or {}),
        "axes": [_axis(axis, rows) for axis in campaign.axes],
        "runs": len(rows),
        "states": _counts(rows["state"]),
        "verdicts": _counts(measures.done["verdict"]),
        "distributions": [_distribution(measures, name) for name in measures.names],
        "coverage": coverage(measures),
        "responses": responses(measures),
        "effects": main_effects(measures),
        "sobol": sobol_indices(measures),
        "failures": failures(rows),
        "lot": analyse_lot(measures) if measures.is_lot else None,
    }
    doc["answer"] = answer(doc)
    return doc


def _counts(values: Any) -> dict[str, int]:
    return {str(k): int(n) for k, n in values.dropna().value_counts().items()}


def _axis(axis: Mapping[str, Any], rows: Any) -> Json:
    column = f"in.{axis['name']}"
    varied = int(rows[column].nunique()) if column in rows else None
    return {"name": axis["name"], "kind": axis["kind"], "unit": axis.get("unit") or "", "values": varied}


def _distribution(measures: CampaignMeasures, name: str) -> Json:
    x = numbers(measures.done, f"{name}.estimate")
    u = numbers(measures.done, f"{name}.u")
    x, u = x[np.isfinite(x)], u[np.isfinite(u)]
    return {
        "name": name,
        "unit": measures.unit(name),
        "n": len(x),
        "mean": float(x.mean()) if len(x) else None,
        "sd": float(x.std(ddof=1)) if len(x) > 1 else None,
        **{key: float(np.percentile(x, q)) if len(x) else None for key, q in PERCENTILES.items()},
        "u": float(np.median(u)) if len(u) else None,
    }


def failures(rows: Any) -> list[Json]:
    """Return the reasons why runs have no result, numbers in them left out of the comparison, most frequent first."""
    groups: dict[tuple[str, str], Json] = {}
    for run, index, state, reason in zip(rows["run"], rows["index"], rows["state"], rows["reason"], strict=True):
        if state == "done":
            continue
        text = reason if isinstance(reason, str) else "no reason is stored"
        key = state, re.sub(r"\d+(\.\d+)?([eE][-+]?\d+)?", "#", text)
        group = groups.setdefault(key, {"state": state, "reason": text, "runs": 0, "first": run, "index": int(index)})
        group["runs"] += 1
    return sorted(groups.values(), key=lambda g: -g["runs"])


# ------------------------------------------------------------------------------------------------- sentences
def answer(doc: Mapping[str, Any]) -> list[str]:
    """Return what the campaign shows, in sentences: runs, lot, coverage, effects."""
    said = [_runs(doc)]
    if doc["lot"]:
        said += _lot(doc["lot"])
    elif doc["verdicts"]:
        said.append(f"Verdicts: {_listing(doc['verdicts'])}.")
    if doc["coverage"]:
        said.append(_coverage(doc["coverage"]))
    if doc["effects"]:
        said += _effects(doc["effects"])
    said += _indices(doc["sobol"]["rows"])
    return said


def _listing(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{n} {k}" for k, n in counts.items())


def names_of(names: Sequence[str]) -> str:
    """Return names as a list in a sentence, cut where they are many."""
    names = list(dict.fromkeys(names))
    more = f" and {len(names) - MOST} more" if len(names) > MOST else ""
    return ", ".join(names[:MOST]) + more


def _runs(doc: Mapping[str, Any]) -> str:
    failed = {k: n for k, n in doc["states"].items() if k != "done"}
    done = doc["states"].get("done", 0)
    if not failed:
        return "The run has a result." if doc["runs"] == 1 else f"All {doc['runs']} runs have a result."
    return f"{done} of {doc['runs']} runs have a result; {_listing(failed)}."


def _lot(lot: Mapping[str, Any]) -> list[str]:
    listed = lot["instruments"]
    attention = [i["instrument"] for i in listed if i["why"]]
    rest = [i for i in listed if not i["why"]]
    verdicts: dict[str, int] = {}
    for i in rest:
        verdicts[i["verdict"]] = verdicts.get(i["verdict"], 0) + 1
    said = []
    if attention:
        verb = "needs" if len(attention) == 1 else "need"
        said.append(f"{len(attention)} of {len(listed)} measured files {verb} attention: {', '.join(attention)}.")
    else:
        said.append(f"None of the {len(listed)} measured files needs attention.")
    if rest:
        said.append(f"{'The other' if attention else 'Verdicts of the'} {len(rest)}: {_listing(verdicts)}.")
    changed = [d for d in lot["changes"]["drifts"] if d["beyond_chance"]]
    if lot["changes"]["instruments"]:
        what = names_of([f"{d['instrument']} ({d['name']})" for d in changed])
        said.append(
            f"Changed between dates beyond chance: {what}." if changed else "No instrument changed beyond chance."
        )
    return said


def _coverage(counted: Sequence[Mapping[str, Any]]) -> str:
    shares = [c["share"] for c in counted]
    off = [c["name"] for c in counted if not c["consistent"]]
    span = f"{min(shares):.3f}" if len(shares) == 1 else f"{min(shares):.3f} to {max(shares):.3f}"
    of = f"{counted[0]['runs']} runs" if len({c["runs"] for c in counted}) == 1 else "the runs"
    text = f"The 95 % intervals contain the true value in {span} of {of}"
    if off:
        return f"{text}; not consistent with 0.95: {names_of(off)}."
    low = min(c["lo"] for c in counted)
    few = f" (few independent runs: {low:.2f} would be, too)" if low < FEW else ""
    return f"{text}, consistent with 0.95{few}."


def _effects(effects: Sequence[Mapping[str, Any]]) -> list[str]:
    said = []
    for axis in dict.fromkeys(e["axis"] for e in effects):
        here = [e for e in effects if e["axis"] == axis]
        if all(e["p"] is None for e in here):
            said.append(f"{axis}: no degrees of freedom are left to test its effect.")
            continue
        clear = sorted((e for e in here if e["beyond_chance"]), key=lambda e: -e["share"])
        if not clear:
            said.append(f"{axis}: no effect beyond chance.")
            continue
        by = {q: [e["name"] for e in clear if e["quantity"] == q] for q in dict.fromkeys(e["quantity"] for e in clear)}
        parts = [f"{'u' if q == 'u' else f'the {q}'} of {names_of(names)}" for q, names in by.items()]
        said.append(f"{axis} changes {' and '.join(parts)} beyond chance.")
    return said


def _indices(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the axis with the largest first-order index, where there are several axes."""
    if len({r["axis"] for r in rows}) < 2:
        return []
    largest: dict[str, list[str]] = {}
    for name, quantity in dict.fromkeys((r["name"], r["quantity"]) for r in rows):
        best = max((r for r in rows if (r["name"], r["quantity"]) == (name, quantity)), key=lambda r: r["first"])
        if best["lo"] is None or best["lo"] > 0.0:
            what = f"u of {name}" if quantity == "u" else name
            largest.setdefault(best["axis"], []).append(f"{what} ({write_number(best['first'], significant=2).text})")
    return [f"Largest share of the variance by {axis}: {names_of(what)}." for axis, what in largest.items()]
