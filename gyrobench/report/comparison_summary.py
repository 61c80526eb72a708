"""Summary of a comparison: the differences that chance does not explain, what was set differently, the order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from statistics import NormalDist
from typing import Any

from gyrobench.report.numbers import write_number

Json = dict[str, Any]
MOST = 4  # names in a sentence


def mark_beyond_chance(measures: Sequence[Json]) -> None:
    """Add ``beyond_chance`` to each difference: larger than all of them together would show by chance in 95 %.

    Bonferroni's bound for N differences: |d| / u above the normal quantile of 1 - 0.025 / N, where U = k u has 1.96 for
    a single one; few degrees of freedom enter through k.
    """
    known = [d for m in measures for d in m["differences"] if d and d["significant"] is not None]
    quantile = NormalDist().inv_cdf
    limit = quantile(1.0 - 0.025 / max(len(known), 1)) / quantile(0.975)
    for d in known:
        d["beyond_chance"] = abs(d["value"]) > limit * d["U"]


def sentences(doc: Mapping[str, Any], letters: Sequence[str]) -> list[str]:
    """Return the opening of a comparison document, largest differences first."""
    names = [f"{letters[k]} ({run['name']})" for k, run in enumerate(doc["runs"])]
    base = doc["baseline"]
    text = [_differs(doc, k, names[k], names[base]) for k in range(len(names)) if k != base]
    known = [d for m in doc["measures"] for d in m["differences"] if d and d["significant"] is not None]
    alone = sum(d["significant"] and not d["beyond_chance"] for d in known)
    if alone:
        by_chance = write_number(0.05 * len(known), significant=2).text
        verb = "difference exceeds its" if alone == 1 else "differences exceed their"
        text.append(f"{alone} more {verb} own U; of {len(known)} about {by_chance} do so by chance.")
    text.append(_settings([row["what"] for row in doc["differing"]]))
    order = _order(doc, names)  # first where a test ranks for purposes: that is what it is made for
    return [*order, *text] if doc["purposes"] else [*text, *order]


def _differs(doc: Mapping[str, Any], run: int, name: str, base: str) -> str:
    pairs = [(m, m["differences"][run]) for m in doc["measures"]]
    known = [(m, d) for m, d in pairs if d and d["significant"] is not None]
    clear = sorted(
        (p for p in known if p[1]["beyond_chance"]), key=lambda p: -abs(p[1]["value"]) / (p[1]["U"] or 1e-300)
    )
    if not known:
        return f"{name} and {base} have no measure with an uncertainty in common."
    same = f"{len(known) - len(clear)} of {len(known)} measures agree" if clear else f"all {len(known)} measures"
    if not clear:
        return f"{name} agrees with {base} in {same} within the uncertainty of the difference."
    shown = [_signed(m, d) for m, d in clear[:MOST]]
    more = f" and {len(clear) - MOST} more" if len(clear) > MOST else ""
    return f"{name} differs from {base} in {', '.join(shown)}{more}; {same}."


def _signed(measure: Json, d: Json) -> str:
    value, U = (write_number(x, d["U"]).text for x in (d["value"], d["U"]))
    sign = "+" if d["value"] > 0.0 else ""
    unit = "" if measure["unit"] == "1" else f" {measure['unit']}"
    return f"{measure['name']} ({measure['meaning']}) by {sign}{value} ± {U}{unit}"


def _settings(differing: Sequence[str]) -> str:
    """Parts, options and parameters by name; digests, dates, seeds and what comes with another part explain nothing."""
    kinds = ("system", "part ", "option ", "site ", "parameter ", "plan ")  # choices, then what follows from them
    chosen = [w for kind in kinds for w in differing if w.startswith(kind)]
    named = [w.removesuffix(": name") for w in chosen if (": " not in w or w.endswith(": name"))]
    swapped = tuple(f"parameter {w.removeprefix('part ')}." for w in named if w.startswith("part "))
    named = [w for w in named if not w.endswith(".seed") and not (swapped and w.startswith(swapped))]
    named = [*dict.fromkeys("plan" if w.startswith("plan ") else w for w in named)]
    if not named:
        return f"No part, option or parameter differs{', only the seed' if 'seed' in differing else ''}."
    more = f" and {len(named) - MOST} more" if len(named) > MOST else ""
    return f"Set differently: {', '.join(named[:MOST])}{more}."


def _order(doc: Mapping[str, Any], names: Sequence[str]) -> list[str]:
    return [_first_of(r, names) for r in (doc["ranking"], *doc["purposes"]) if r and len(r["order"]) > 1]


def _first_of(ranked: Json, names: Sequence[str]) -> str:
    """Return who has the smallest value of a measure, and how many ranks can be told apart."""
    first = [e for e in ranked["order"] if e["place"] == 1]
    purpose = f"{ranked['purpose']}: " if "purpose" in ranked else ""
    measure = str(ranked["name"]) if purpose else f"{ranked['name']} ({ranked['meaning']})"
    if len(first) == len(ranked["order"]):
        return f"{purpose}{'no' if purpose else 'No'} order by {measure}: the runs cannot be told apart."
    best = ", ".join(names[e["run"]] for e in first)
    the = "the" if purpose else "The"
    text = (
        f"{purpose}{the} smallest {measure} is that of {best}."
        if len(first) == 1
        else f"{purpose}{the} smallest {measure}: {best} share the first place, as they cannot be told apart."
    )
    places = sorted({e["place"] for e in ranked["order"]})
    known = [e["probability"] for e in ranked["order"] if e["apart"]]
    if None in known:
        return text
    least = "more than 0.999" if min(known) > 0.999 else f"{min(known):.3f} or more"
    return f"{text} {len(places)} ranks are told apart, each step with a probability of {least}."
