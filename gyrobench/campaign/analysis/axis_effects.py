"""Responses to the axes of a campaign: means with intervals, main effects with their tests."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from gyrobench.arrays import Array
from gyrobench.campaign.analysis.measures import CampaignMeasures, Json, numbers, quantities
from gyrobench.reduction.suite.ranking import LEVEL, adjusted

Codes = NDArray[np.intp]

MAX_LEVELS = 12  # values of an axis that are levels each; more are put into bins of equal count
MIN_IN_BIN = 8
ROUNDING = 1e-12  # relative; a dispersion below it is that of the arithmetic


def levels(rows: Any, column: str) -> tuple[list[str] | Array, Codes]:
    """Return the levels of an axis (texts, or numbers: value or mean of a bin) and the level of each row."""
    values = rows[column]
    if values.dtype.kind not in "fiu":
        texts = values.astype(str)
        labels = list(dict.fromkeys(texts))
        place = {label: k for k, label in enumerate(labels)}
        return labels, np.array([place[t] for t in texts])
    x = values.to_numpy(float)
    unique, codes = np.unique(x, return_inverse=True)
    if len(unique) > MAX_LEVELS:
        bins = int(np.clip(len(x) // MIN_IN_BIN, 2, MAX_LEVELS))
        ranks = stats.rankdata(x, method="min") - 1  # equal values in one bin
        codes = np.unique((ranks * bins // len(x)).astype(int), return_inverse=True)[1]
        unique = np.array([x[codes == k].mean() for k in range(codes.max() + 1)])
    return unique, codes


def response(
    y: Array, codes: Codes, count: int, own: tuple[Array, Array] | None = None, widened: float = 1.0,
    seeds: Codes | None = None,
) -> Json:  # fmt: skip
    """Return mean, 95 % interval and number of runs at each level.

    The interval is Student's t of the dispersion within the level, ``widened`` for what was fitted before; runs of one
    seed have the same noise and count as one.  At a level of one it is the run's own interval (lo, hi), where known.
    """
    out: Json = {"mean": [], "lo": [], "hi": [], "runs": []}
    for k in range(count):
        at = np.flatnonzero((codes == k) & np.isfinite(y))
        low, high = None, None
        mean = float(y[at].mean()) if len(at) else None
        independent = y[at] if seeds is None else np.array([y[at][seeds[at] == s].mean() for s in np.unique(seeds[at])])
        n = len(independent)
        if mean is not None and n > 1:
            half = widened * float(stats.t.ppf(0.975, n - 1) * independent.std(ddof=1) / np.sqrt(n))
            low, high = mean - half, mean + half
        elif n == 1 and own is not None and np.isfinite([own[0][at], own[1][at]]).all():
            low, high = (float(end[at].mean()) for end in own)
        for key, value in zip(out, (mean, low, high, len(at)), strict=True):
            out[key].append(value)
    return out


def responses(measures: CampaignMeasures) -> list[Json]:
    """Return the response of every quantity of every measure to every axis.

    Means are adjusted for the main effects of the other axes (additive model, least squares), so that neither they nor
    their intervals hold what the other axes do; of axes that are combinations of each other they are the plain means.
    """
    rows = measures.done
    axes = measures.factors()
    coded = [levels(rows, f"in.{axis['name']}") for axis in axes]
    seeds = shared_seeds(rows)
    found: list[Json] = []
    for axis, (at, _) in zip(axes, coded, strict=True):
        numeric = not isinstance(at, list)
        entry: Json = {"axis": axis["name"], "unit": axis.get("unit", ""), "numeric": numeric}
        found.append({**entry, "levels": [float(v) for v in at] if numeric else list(at), "measures": []})
    for name in measures.names:
        for entry in found:
            entry["measures"].append({"name": name, "unit": measures.unit(name), "quantities": {}})
        for key, y in quantities(rows, name).items():
            own = None
            if key != "u":
                shift = numbers(rows, f"{name}.truth") if key == "error" else 0.0
                own = numbers(rows, f"{name}.lo") - shift, numbers(rows, f"{name}.hi") - shift
            adjusted_for = _without_others(y, [codes for _, codes in coded])
            for entry, (at, codes), (rest, widened) in zip(found, coded, adjusted_for, strict=True):
                entry["measures"][-1]["quantities"][key] = response(rest, codes, len(at), own, widened, seeds)
    return found


def _without_others(y: Array, codes: list[Codes]) -> list[tuple[Array, float]]:
    """Return for each axis the values without the fitted main effects of the others, and how much these cost."""
    good = np.isfinite(y)
    n = int(good.sum())
    if len(codes) < 2:
        return [(y, 1.0)] * len(codes)
    designs = [_dummies(c[good]) for c in codes]
    designs = [d - d.mean(axis=0) for d in designs]
    x = np.hstack(designs)
    if n - 1 <= x.shape[1] or np.linalg.matrix_rank(x) < x.shape[1]:
        return [(y, 1.0)] * len(codes)
    ends = np.cumsum([0] + [d.shape[1] for d in designs])
    b = np.linalg.lstsq(x, y[good] - y[good].mean(), rcond=None)[0]
    effects = [d @ b[i:j] for d, i, j in zip(designs, ends[:-1], ends[1:], strict=True)]
    found = []
    for k, own in enumerate(effects):
        rest = np.full(len(y), np.nan)
        rest[good] = y[good] - sum(effects) + own
        others = x.shape[1] - designs[k].shape[1]
        found.append((rest, float(np.sqrt((n - 1) / (n - 1 - others)))))
    return found


def crossed_seeds(rows: Any, columns: list[str]) -> Codes | None:
    """Return the seed of each row as a number where every setting was run with every seed; else None."""
    seeds = rows["seed"]
    if seeds.isna().any() or seeds.nunique() < 2 or not columns:
        return None
    groups = rows.groupby(columns, dropna=False)["seed"]
    each, number = groups.nunique(), groups.size()
    if len(each) < 2 or (each != seeds.nunique()).any() or (number != each).any():
        return None
    codes: Codes = np.unique(seeds.to_numpy(dtype=float), return_inverse=True)[1]
    return codes


def shared_seeds(rows: Any) -> Codes | None:
    """Return the seed of each row as a number where several rows have one seed; else None."""
    seeds = rows["seed"]
    if seeds.isna().any() or seeds.is_unique:
        return None
    codes: Codes = np.unique(seeds.to_numpy(dtype=float), return_inverse=True)[1]
    return codes


def main_effects(measures: CampaignMeasures) -> list[Json]:
    """Return for each quantity and axis the span of the adjusted means, the share of the variance, and p of no effect.

    Additive model of all axes by least squares; the partial F test of an axis compares it with the model without it,
    so that what several axes share is claimed by none.  Its residual holds interactions and noise.  Runs of
    one seed have the same noise: an axis that varies among them is tested within the seeds, where it cancels, any other
    between their means.  p are adjusted together by Holm.  p is None where no degrees of freedom are left, or the axis
    is a combination of others.
    """
    rows = measures.done
    factors = measures.factors()
    columns = [f"in.{axis['name']}" for axis in factors]
    coded = [levels(rows, c) for c in columns]
    seeds = shared_seeds(rows)
    found: list[Json] = []
    for name in measures.names:
        for key, y in quantities(rows, name).items():
            good = np.isfinite(y)
            if good.sum() < 3:
                continue
            designs = [_dummies(codes[good]) for _, codes in coded]
            tests = _partial_tests(y[good], designs, None if seeds is None else seeds[good])
            rests = [rest for rest, _ in _without_others(y, [codes for _, codes in coded])]
            for axis, (_, codes), rest, (share, p) in zip(factors, coded, rests, tests, strict=True):
                means = [rest[good & (codes == k)].mean() for k in np.unique(codes[good])]
                span = float(max(means) - min(means))
                found.append(
                    {"axis": axis["name"], "name": name, "unit": measures.unit(name), "quantity": key, "span": span,
                     "share": share, "p": p}
                )  # fmt: skip
    known = [e for e in found if e["p"] is not None]
    for entry, p in zip(known, adjusted([e["p"] for e in known]), strict=True):
        entry["p_adjusted"] = p
    for entry in found:
        entry["beyond_chance"] = entry.setdefault("p_adjusted", None) is not None and entry["p_adjusted"] < LEVEL
    return found


def _dummies(codes: Codes) -> Array:
    """Return the columns of a factor: 1 at each level but the first."""
    present = np.unique(codes)
    return np.asarray((codes[:, None] == present[None, 1:]).astype(float))


Test = tuple[float | None, float | None]  # share of the sum of squares that a factor alone explains, p of its F test


def _partial_tests(y: Array, designs: list[Array], seeds: Codes | None) -> list[Test]:
    """Return the test of each factor: where runs share seeds, of factors that vary within them and of the others."""
    n, scale = len(y), float(np.abs(y).max())
    total, negligible = float(((y - y.mean()) ** 2).sum()), n * (ROUNDING * scale) ** 2
    if seeds is None:
        return _f_tests(y - y.mean(), [d - d.mean(axis=0) for d in designs], n - 1, total, negligible)
    seeds = np.unique(seeds, return_inverse=True)[1]
    count = np.bincount(seeds)

    def mean(x: Array) -> Array:
        sums = np.zeros((len(count), x.shape[1]))
        np.add.at(sums, seeds, x)
        return np.asarray((sums / count[:, None])[seeds])

    within = [bool(np.abs(d - mean(d)).max(initial=0.0) > ROUNDING) for d in designs]
    inside = [d - mean(d) for d, inner in zip(designs, within, strict=True) if inner]
    centred = y - mean(y[:, None])[:, 0]
    tests = iter(_f_tests(centred, inside, n - len(count), total, negligible))
    if inside:  # what the inner factors do is taken out before the means are
        x = np.hstack([d for d, inner in zip(designs, within, strict=True) if inner])
        y = y - x @ np.linalg.lstsq(np.hstack(inside), centred, rcond=1e-10)[0]
    means = mean((y - y.mean())[:, None])[:, 0]
    outside = [d - d.mean(axis=0) for d, inner in zip(designs, within, strict=True) if not inner]
    others = iter(_f_tests(means, outside, len(count) - 1, total, negligible))
    return [next(tests if inner else others) for inner in within]


def _f_tests(centred: Array, designs: list[Array], freedom: int, total: float, negligible: float) -> list[Test]:
    """freedom: of the centred values; total: sum of squares of all; negligible: that of the arithmetic."""
    whole, rank = _residual(centred, designs)
    freedom -= rank
    tests: list[Test] = []
    for k in range(len(designs)):
        without, lower = _residual(centred, [d for i, d in enumerate(designs) if i != k])
        explained, df = max(without - whole, 0.0), rank - lower
        if df == 0 or freedom < 1:
            tests.append((None, None))
        elif total <= negligible or explained <= negligible:
            tests.append((0.0, 1.0))
        else:
            f = explained / df / max(whole / freedom, negligible / len(centred))
            tests.append((explained / total, float(stats.f.sf(f, df, freedom))))
    return tests


def _residual(y: Array, designs: list[Array]) -> tuple[float, int]:
    """Return the residual sum of squares of the additive model and its rank."""
    if not designs:
        return float(y @ y), 0
    x = np.hstack(designs)
    fit, _, rank, _ = np.linalg.lstsq(x, y, rcond=1e-10)
    rest = y - x @ fit
    return float(rest @ rest), int(rank)
