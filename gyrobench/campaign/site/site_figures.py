"""Figures of the site of a campaign.  Every function returns pictures, none where there is nothing to show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy import special

from gyrobench.arrays import Array
from gyrobench.campaign.analysis.lots import all_dated, in_order
from gyrobench.campaign.analysis.measures import CampaignMeasures, Json, normalized_error, numbers
from gyrobench.report import style
from gyrobench.report.numbers import write_number
from gyrobench.report.page_model import Picture

MAX_BARS = 40
FAR = 6.0  # quartile distances from the quartiles; what is farther off leaves no room for the rest
MAX_LEVELS_DRAWN = 24  # texts beside an axis
MAX_RESPONSES = 24  # pictures of responses


def distributions(measures: CampaignMeasures) -> list[Picture]:
    """Return a histogram of the estimates of each measure."""
    pictures = []
    for i, name in enumerate(measures.names):
        x = numbers(measures.done, f"{name}.estimate")
        x = x[np.isfinite(x)]
        if len(x) < 5 or np.ptp(x) <= 1e-12 * np.abs(x).max():
            continue
        fig, ax = style.chart(style.HALF, 45)
        beyond = _histogram(ax, x)
        ax.set_xlabel(style.axis_label(name, measures.unit(name)))
        ax.locator_params(axis="x", nbins=5)
        ax.set_ylabel("runs")
        key = f"distribution-{i + 1}"
        caption = f"{name}: estimates of {len(x)} runs." + (f" {beyond} beyond the scale." if beyond else "")
        pictures.append(Picture(key, style.svg(fig, key), caption, f"Histogram of {name}", half=True))
    return pictures


def _histogram(ax: Any, x: Array) -> int:
    """Draw counts in bins after Freedman and Diaconis; return how many values are too far off to be drawn."""
    low, high = np.percentile(x, [25.0, 75.0])
    near = (x >= low - FAR * (high - low)) & (x <= high + FAR * (high - low))
    drawn = x[near] if high > low else x
    count = int(np.clip(len(np.histogram_bin_edges(drawn, bins="fd")) - 1, 5, MAX_BARS))
    counts, edges = np.histogram(drawn, bins=count)
    ax.bar(edges[:-1], counts, np.diff(edges), align="edge", color=style.BLUE, alpha=0.75, edgecolor="none")
    ax.set_ylim(bottom=0)
    return len(x) - len(drawn)


def normalized_errors(measures: CampaignMeasures, covered: Sequence[Json]) -> list[Picture]:
    """Return a histogram of error over half-width for each measure, with the normal curve that 95 % intervals imply."""
    pictures = []
    for i, entry in enumerate(covered):
        e = normalized_error(measures.done, entry["name"])
        e = e[np.isfinite(e)]
        if len(e) < 20:
            continue
        fig, ax = style.chart(style.HALF, 45)
        ax.axvspan(-1.0, 1.0, color=style.GREEN, alpha=0.2, linewidth=0, zorder=0)
        shown = np.clip(e, -3.0, 3.0)  # what is farther off stands in the last bar
        counts, edges = np.histogram(shown, bins=int(np.clip(2.0 * len(e) ** (1 / 3), 10, MAX_BARS)), range=(-3.0, 3.0))
        ax.bar(edges[:-1], counts, np.diff(edges), align="edge", color=style.BLUE, alpha=0.75, edgecolor="none")
        x = np.linspace(-3.0, 3.0, 121)
        k = float(special.ndtri(0.975))
        density = k * np.exp(-0.5 * (k * x) ** 2) / np.sqrt(2.0 * np.pi)
        ax.plot(x, len(e) * density * (edges[1] - edges[0]), color=style.VERMILION)
        ax.set_xlim(-3.0, 3.0)
        ax.set_ylim(bottom=0)
        ax.set_xlabel("error / half-width of the interval")
        ax.set_ylabel("runs")
        key = f"normalized-{i + 1}"
        caption = f"{entry['name']}: {entry['hits']} of {entry['runs']} normalized errors within ±1."
        pictures.append(
            Picture(
                key, style.svg(fig, key), caption, f"Histogram of the normalized errors of {entry['name']}", half=True
            )
        )
    return pictures


def coverage_strip(covered: Sequence[Mapping[str, Any]]) -> list[Picture]:
    """Return the coverage of each measure with its bounds, 0.95 dashed."""
    if not covered:
        return []
    fig, ax = style.chart(style.HALF, 16 + 5.5 * len(covered))
    ax.axvline(0.95, color=style.MUTED, linestyle="--", linewidth=0.9)
    for i, c in enumerate(covered):
        colour, marker = (style.BLUE, "o") if c["consistent"] else (style.VERMILION, "D")
        ax.plot([c["lo"], c["hi"]], [i, i], "-", color=colour, linewidth=1.4)
        ax.plot([c["share"]], [i], marker, color=colour, markersize=4.5, markeredgewidth=0)
    ax.set_yticks(range(len(covered)), [c["name"] for c in covered])
    ax.set_ylim(len(covered) - 0.4, -0.6)
    ax.locator_params(axis="x", nbins=5)
    ax.set_xlabel("share of intervals that contain the true value")
    caption = "Coverage with 95 % bounds; dashed: 0.95; diamonds: not consistent with it."
    return [
        Picture("coverage", style.svg(fig, "coverage"), caption, "Coverage of the 95 % intervals by measure", half=True)
    ]


def responses(doc: Json) -> tuple[list[Picture], int]:
    """Return a picture for each measure and axis, u beneath, and how many are not drawn.

    Drawn first: those with an effect beyond chance.
    """
    clear = {(e["axis"], e["name"]) for e in doc["effects"] if e["beyond_chance"]}
    pairs = [(axis, m) for axis in doc["responses"] for m in axis["measures"]]
    pairs.sort(key=lambda p: (p[0]["axis"], p[1]["name"]) not in clear)
    chosen = pairs[:MAX_RESPONSES]
    pictures = []
    for i, (axis, m) in enumerate(chosen):
        drawn = {q: r for q, r in m["quantities"].items() if any(v is not None for v in r["mean"])}
        if not drawn:
            continue
        fig = (_against_numbers if axis["numeric"] else _against_texts)(axis, m["unit"], drawn)
        key = f"response-{i + 1}"
        caption = f"{m['name']} against {axis['axis']}: {' and '.join(drawn)}, mean with 95 % interval."
        pictures.append(Picture(key, style.svg(fig, key), caption, f"{m['name']} against {axis['axis']}", half=True))
    return pictures, len(pairs) - len(chosen)


def _against_numbers(axis: Json, unit: str, drawn: Mapping[str, Json]) -> Any:
    fig, axes = style.figure(style.HALF, 14 + 31 * len(drawn), nrows=len(drawn), sharex=True)
    for ax, (quantity, r) in zip(axes[:, 0], drawn.items(), strict=True):
        mean, low, high = _numbers(r)
        ax.plot(axis["levels"], mean, "o-", color=style.BLUE, linewidth=0.8, markersize=3.5, markeredgewidth=0)
        ax.vlines(axis["levels"], low, high, color=style.BLUE, linewidth=1.4)
        if quantity == "error":
            style.zero_line(ax)
        ax.set_ylabel(style.axis_label(quantity, unit))
        ax.locator_params(axis="y", nbins=4)
    axes[-1, 0].locator_params(axis="x", nbins=6)
    axes[-1, 0].set_xlabel(style.axis_label(axis["axis"], axis["unit"]))
    fig.align_ylabels(axes[:, 0])
    return fig


def _against_texts(axis: Json, unit: str, drawn: Mapping[str, Json]) -> Any:
    """Return one row for each text, which has the room of the left margin."""
    count = min(len(axis["levels"]), MAX_LEVELS_DRAWN)
    fig, axes = style.figure(style.HALF, (14 + 5.5 * count) * len(drawn), nrows=len(drawn))
    for ax, (quantity, r) in zip(axes[:, 0], drawn.items(), strict=True):
        mean, low, high = (v[:count] for v in _numbers(r))
        if quantity == "error":
            ax.axvline(0.0, color=style.MUTED, linewidth=0.8)
        ax.hlines(range(count), low, high, color=style.BLUE, linewidth=1.4)
        ax.plot(mean, range(count), "o", color=style.BLUE, markersize=4, markeredgewidth=0)
        ax.set_yticks(range(count), [_short(t, 22) for t in axis["levels"][:count]])
        ax.set_ylim(count - 0.4, -0.6)
        ax.locator_params(axis="x", nbins=5)
        ax.set_xlabel(style.axis_label(quantity, unit))
    return fig


def _numbers(r: Json) -> tuple[Array, ...]:
    return tuple(np.array([np.nan if v is None else v for v in r[k]], float) for k in ("mean", "lo", "hi"))


def _short(text: str, length: int = 18) -> str:
    return text if len(text) <= length else text[: length - 1] + "…"


def indices(rows: Sequence[Mapping[str, Any]]) -> list[Picture]:
    """Return the indices of each quantity of each measure: first-order full, total hollow."""
    pictures = []
    for i, (name, quantity) in enumerate(dict.fromkeys((r["name"], r["quantity"]) for r in rows)):
        shown = [r for r in rows if (r["name"], r["quantity"]) == (name, quantity)]
        fig, ax = style.chart(style.HALF, 16 + 7.0 * len(shown))
        ax.axvline(0.0, color=style.MUTED, linewidth=0.8)
        for k, r in enumerate(shown):
            for key, low, high, shift, colour, marker in (
                ("first", "lo", "hi", -0.14, style.BLUE, "o"),
                ("total", "total_lo", "total_hi", 0.14, style.VERMILION, "D"),
            ):
                if r[key] is None:
                    continue
                if r[low] is not None:
                    ax.plot([r[low], r[high]], [k + shift] * 2, "-", color=colour, linewidth=1.4)
                ax.plot([r[key]], [k + shift], marker, color=colour, markersize=4, markeredgewidth=0)
        ax.set_yticks(range(len(shown)), [_short(r["axis"], 22) for r in shown])
        ax.set_ylim(len(shown) - 0.4, -0.6)
        ax.set_xlabel("share of the variance / 1")
        ax.locator_params(axis="x", nbins=5)
        total = "; diamonds: total" if shown[0]["total"] is not None else ""
        key = f"sobol-{i + 1}"
        caption = f"{name}, {quantity}: first-order indices{total}."
        pictures.append(Picture(key, style.svg(fig, key), caption, f"Sobol' indices of {name}, {quantity}", half=True))
    return pictures


def control_charts(measures: CampaignMeasures, lot: Json) -> list[Picture]:
    """Return a chart of single values for each coefficient, with control limits and those named as outliers."""
    rows = in_order(measures.rows)
    done = (rows["state"] == "done").to_numpy(bool)
    outlier = np.array([i["outlier"] for i in lot["instruments"]])
    doubtful = done & np.array([i["contradicted"] for i in lot["instruments"]]) & ~outlier
    place = np.arange(1, len(rows) + 1)
    dated = all_dated(rows)
    pictures = []
    for i, entry in enumerate(lot["tolerance"]):
        name, limits = entry["name"], entry["control"]
        y = np.where(done, numbers(rows, f"{name}.estimate"), np.nan)
        if limits is None:
            continue
        fig, ax = style.chart(style.HALF, 50)
        if entry["low"] is not None:
            ax.axhspan(entry["low"], entry["high"], color=style.GREEN, alpha=0.18, linewidth=0, zorder=0)
        control_lines(ax, limits)
        plain = ~outlier & ~doubtful
        ax.plot(place[plain], y[plain], "o", color=style.BLUE, markersize=2.8, markeredgewidth=0)
        ax.plot(place[doubtful], y[doubtful], "s", color=style.ORANGE, markersize=4, markeredgewidth=0)
        ax.plot(place[outlier], y[outlier], "D", color=style.VERMILION, markersize=4, markeredgewidth=0)
        cut = _scale(ax, y, limits, entry)
        ax.set_xlabel("measurement, by date" if dated else "measurement, in the order of the files")
        ax.set_ylabel(style.axis_label(name, entry["unit"]))
        ax.margins(x=0.03)
        ax.locator_params(axis="x", nbins=6, integer=True)
        beyond = f" {cut} beyond the scale, marked at its edge." if cut else ""
        key = f"control-{i + 1}"
        caption = f"{name}: {entry['beyond']} beyond the control limits.{beyond}"
        pictures.append(Picture(key, style.svg(fig, key), caption, f"Control chart of {name}", half=True))
    return pictures


def control_lines(ax: Any, limits: Mapping[str, float]) -> None:
    """Draw centre and limits of a control chart."""
    ax.axhline(limits["centre"], color=style.INK, linewidth=0.8)
    for key in ("low", "high"):
        ax.axhline(limits[key], color=style.MUTED, linewidth=0.9, linestyle="--")


def _scale(ax: Any, y: Array, limits: Json, entry: Json) -> int:
    """Hold the scale to where the lot is; mark what is farther off at the edge, and return how many that are."""
    ends = [v for v in (limits["low"], limits["high"], entry["low"], entry["high"]) if v is not None]
    low, high = min(ends), max(ends)
    low, high = low - 0.6 * (high - low), high + 0.6 * (high - low)
    finite = y[np.isfinite(y)]
    bottom, top = max(low, float(finite.min())), min(high, float(finite.max()))
    bottom, top = min(bottom, *ends), max(top, *ends)
    pad = 0.06 * (top - bottom)
    ax.set_ylim(bottom - pad, top + pad)
    with np.errstate(invalid="ignore"):
        for off, edge, marker in ((y > top, top, "^"), (y < bottom, bottom, "v")):
            at = np.flatnonzero(off)
            ax.plot(at + 1, np.full(len(at), edge), marker, color=style.VERMILION, markersize=5, markeredgewidth=0)
        return int((y > top).sum() + (y < bottom).sum())


def distances(lot: Json) -> list[Picture]:
    """Return the robust distance of every measurement with the limit above which one is named."""
    found = [(k, i["distance"], i["outlier"]) for k, i in enumerate(lot["instruments"], 1) if i["distance"] is not None]
    if not found or lot["outliers"] is None:
        return []
    fig, ax = style.chart(style.HALF, 50)
    for flag, colour, marker in ((False, style.BLUE, "o"), (True, style.VERMILION, "D")):
        here = [(k, d) for k, d, o in found if o is flag]
        ax.plot([k for k, _ in here], [d for _, d in here], marker, color=colour, markersize=3.5, markeredgewidth=0)
    limit = lot["outliers"]["limit"]
    ax.axhline(limit, color=style.MUTED, linestyle="--", linewidth=0.9)
    if max(d for _, d, _ in found) > 8.0 * limit:
        ax.set_yscale("log")
        ax.minorticks_off()
    ax.set_xlabel("measurement")
    ax.set_ylabel("robust distance / 1")
    number = write_number(limit, significant=3).text
    caption = (
        f"Robust distance of each measurement; dashed: {number}, above which one is named as an outlier, as is one by "
        "a coefficient alone."
    )
    return [Picture("distances", style.svg(fig, "distances"), caption, "Robust Mahalanobis distances", half=True)]
