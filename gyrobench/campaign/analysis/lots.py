"""A lot of measured instruments: control charts, tolerance intervals, changes between dates."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import special, stats

from gyrobench.arrays import Array
from gyrobench.campaign.analysis.intervals import tolerance_interval
from gyrobench.campaign.analysis.lot_attention import common_warnings, contradictions, instruments
from gyrobench.campaign.analysis.lot_outliers import LEVEL, robust_outliers
from gyrobench.campaign.analysis.measures import CampaignMeasures, Json, numbers
from gyrobench.reduction.suite.ranking import LEVEL as CHANGE_LEVEL
from gyrobench.reduction.suite.ranking import adjusted

MEDIAN_RANGE = 0.9538725524  # median of |x1 - x2| of two normal values over their sigma
#: number of values -> half width of the limits over sigma from the median moving range, so that 0.27 % of all values of
#: normal lots lie outside as they do of 3 sigma where sigma is known: counted over 12e6 values each, to 0.3 %; an even
#: and an odd number of differences have medians of their own
ODD = {5: 6.01, 7: 5.30, 9: 4.79, 11: 4.45, 13: 4.22, 15: 4.05, 21: 3.74}
EVEN = {6: 6.91, 8: 5.65, 10: 4.96, 12: 4.52, 16: 4.09, 20: 3.84}
MANY = {30: 3.534, 50: 3.310, 100: 3.156, 200: 3.071}
NORMAL = 1.959963984540054
DAY = 86400.0


def control_limits(values: Array) -> tuple[float, float, float] | None:
    """Return centre and limits of a chart of single values: median ± c sigma, sigma from the median moving range.

    Medians, since the few bad values that a chart is to show would widen limits of means.  c is 3 for long charts and
    more for short ones, whose sigma is not well known (:func:`half_width`): of normal values 0.27 % lie outside by
    chance, however many they are.  None where fewer than five values, or no dispersion, is there.
    """
    x = values[np.isfinite(values)]
    if len(x) < 5:
        return None
    sigma = float(np.median(np.abs(np.diff(x)))) / MEDIAN_RANGE
    centre = float(np.median(x))
    half = half_width(len(x)) * sigma
    return None if sigma == 0.0 else (centre, centre - half, centre + half)


def half_width(n: int) -> float:
    """Return the half width of the limits for n values, 5 or more, over sigma: from the tables, linear in 1/n."""
    table = {**(EVEN if n % 2 == 0 else ODD), **MANY}
    inverse = [0.0, *(1.0 / k for k in sorted(table, reverse=True))]
    return float(np.interp(1.0 / n, inverse, [3.0, *(table[k] for k in sorted(table, reverse=True))]))


def seconds(rows: Any) -> Array:
    """Return the dates of the rows in s since 1970, NaN where there is none."""
    import pandas as pd

    if "date" not in rows:
        return np.full(len(rows), np.nan)
    dates = pd.to_datetime(rows["date"], errors="coerce", utc=True, format="ISO8601")
    elapsed = (dates - pd.Timestamp(0, tz="UTC")).dt.total_seconds()
    return np.asarray(elapsed.to_numpy(float, na_value=np.nan))


def in_order(rows: Any) -> Any:
    """Return the rows by date, those without one last; by their place in the plan where a result has no date."""
    return rows.iloc[np.argsort(seconds(rows), kind="stable")] if all_dated(rows) else rows


def all_dated(rows: Any) -> bool:
    """Return whether every row with a result has a date."""
    done = (rows["state"] == "done").to_numpy(bool)
    return bool(done.any() and np.isfinite(seconds(rows)[done]).all())


def analyse_lot(measures: CampaignMeasures) -> Json:
    """Return the analysis of a lot.

    Tolerance intervals are those of the accepted rows: with a result that its record does not contradict, and not named
    as outliers.
    """
    lot = CampaignMeasures.of(in_order(measures.rows), measures.units, measures.axes)
    rows = lot.rows
    against = contradictions(rows)
    done = (rows["state"] == "done").to_numpy(bool)
    values = np.column_stack([numbers(rows, f"{n}.estimate") for n in lot.names] or [np.empty(len(rows))])
    found = robust_outliers(np.where(done[:, None], values, np.nan)) if lot.names else None
    listed = instruments(lot, against, found)
    accepted = np.array([not i["why"] for i in listed], bool)
    return {
        "instruments": listed,
        "common": [{"warning": text, "runs": n} for n, text in common_warnings(rows).values()],
        "outliers": None
        if found is None
        else {
            "joint": found.joint,
            "limit": found.limit,
            "level": LEVEL,
            "used": [n for n, u in zip(lot.names, found.used, strict=True) if u],
            "judged": int(np.isfinite(found.distance).sum()),
        },
        "accepted": int(accepted.sum()),
        "tolerance": [_tolerance(lot, name, values[:, k], accepted) for k, name in enumerate(lot.names)],
        "changes": changes_between_dates(lot, np.array([not reason for reason in against], bool)),
    }


def _tolerance(lot: CampaignMeasures, name: str, values: Array, accepted: np.ndarray) -> Json:
    inside = values[accepted]
    found = tolerance_interval(inside)
    limits = control_limits(values)
    beyond = 0 if limits is None else int(((values < limits[1]) | (values > limits[2])).sum())
    u = numbers(lot.rows, f"{name}.u")[accepted]
    u = u[np.isfinite(u)]
    finite = inside[np.isfinite(inside)]
    return {
        "name": name,
        "unit": lot.unit(name),
        "n": found.n,
        "mean": float(finite.mean()) if len(finite) else None,
        "sd": float(finite.std(ddof=1)) if len(finite) > 1 else None,
        "u": float(np.median(u)) if len(u) else None,
        "low": found.low,
        "high": found.high,
        "kind": found.kind,
        "p_normal": found.p_normal,
        "control": None if limits is None else {"centre": limits[0], "low": limits[1], "high": limits[2]},
        "beyond": beyond,
    }


# ------------------------------------------------------------------------------------------- changes between dates
def changes_between_dates(lot: CampaignMeasures, usable: np.ndarray) -> Json:
    """Return what changed between the dates of instruments that were measured on two dates or more.

    For each coefficient ``ratio`` is the standard deviation between dates of one instrument over what u explains,
    pooled; for each instrument the drift a day is the slope of a weighted line, its u widened by the ratio of all other
    instruments where that is above 1, and its p is adjusted (Holm) over all of them.
    """
    when = seconds(lot.rows)
    usable = usable & np.isfinite(when)
    groups: dict[str, list[int]] = {}
    for k, name in enumerate(lot.instrument()):
        if usable[k]:
            groups.setdefault(name, []).append(k)
    groups = {n: at for n, at in groups.items() if len(set(when[at])) > 1}
    pooled: list[Json] = []
    drifts: list[Json] = []
    for name in lot.names:
        y, u = numbers(lot.rows, f"{name}.estimate"), standard_uncertainty(lot.rows, name)
        good = {i: np.array([k for k in at if np.isfinite(y[k]) and u[k] > 0.0], int) for i, at in groups.items()}
        good = {i: at for i, at in good.items() if len(set(when[at])) > 1}
        if not good:
            continue
        parts = [_line(when[at] / DAY, y[at], u[at]) for at in good.values()]
        chi2 = sum(part[2] for part in parts)
        freedom = sum(len(at) - 1 for at in good.values())
        ratio = float(np.sqrt(chi2 / freedom))
        p = float(special.chdtrc(freedom, chi2))
        pooled.append({"name": name, "unit": lot.unit(name), "instruments": len(good), "ratio": ratio, "p": p})
        for instrument, at, (slope, deviation, own) in zip(good, good.values(), parts, strict=True):
            others = freedom - len(at) + 1
            widened = max(1.0, float(np.sqrt((chi2 - own) / others))) if others else 1.0
            s = deviation * widened
            tail = 2.0 * float(stats.t.sf(abs(slope) / s, others) if widened > 1.0 else special.ndtr(-abs(slope) / s))
            drifts.append(
                {"instrument": instrument, "name": name, "unit": lot.unit(name), "dates": len(at), "slope": slope,
                 "u": s, "p": tail}
            )  # fmt: skip
    for entry, p in zip(drifts, adjusted([d["p"] for d in drifts]), strict=True):
        entry["p_adjusted"] = p
        entry["beyond_chance"] = p < CHANGE_LEVEL
    return {"instruments": len(groups), "pooled": pooled, "drifts": drifts}


def standard_uncertainty(rows: Any, name: str) -> Array:
    """Return u, or where it is larger the half-width of the 95 % interval over 1.96: few degrees of freedom count."""
    u = numbers(rows, f"{name}.u")
    half = 0.5 * (numbers(rows, f"{name}.hi") - numbers(rows, f"{name}.lo")) / NORMAL
    return np.asarray(np.fmax(u, half))


def _line(t: Array, y: Array, u: Array) -> tuple[float, float, float]:
    """Return slope and its u of a weighted line, and the chi-square of a constant."""
    w = u**-2
    off, level = t - w @ t / w.sum(), y - w @ y / w.sum()
    square = float(w @ off**2)
    return float(w @ (off * level)) / square, float(square**-0.5), float(w @ level**2)
