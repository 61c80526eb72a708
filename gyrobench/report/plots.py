"""The figures of a report, one idea each.  Every function returns an SVG or "" when there is nothing to show."""

from __future__ import annotations

import math
import unicodedata
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

from gyrobench.report import style
from gyrobench.report.language import in_use
from gyrobench.result import AllanDeviation, Coefficient, PowerSpectrum, Series

LETTER = 1.6  # mm, a letter of an axis, about
MANY = 20  # coefficients, from which a correlation below 0.3 is colour only


def short(label: str, length: int = 26) -> str:
    """Return a series label for a figure, in its language: the part before the colon when it is long."""
    language = in_use()
    if language is not None:
        return language.short(label, lambda said: _shortened(said, length, "："))
    return _shortened(label, length, ":")


def _shortened(label: str, length: int, colon: str) -> str:
    head = label.split(colon)[0].strip() or label
    label = label if width(label) <= length else head
    while width(label) > length:
        label = label.removesuffix("…")[:-1] + "…"
    return label


def width(label: str) -> int:
    """Return how wide a label is, in letters: a Chinese character is as wide as two."""
    return sum(2 if unicodedata.east_asian_width(c) in "WF" else 1 for c in label)


def finite(*columns: Sequence[float | None]) -> list[list[float]]:
    """Return the columns without the rows that hold a None or a value that is not finite."""
    rows = [r for r in zip(*columns, strict=False) if all(v is not None and math.isfinite(v) for v in r)]
    return [list(c) for c in zip(*rows, strict=True)] if rows else [[] for _ in columns]


def is_curve(series: Series) -> bool:
    """Return whether a series can be drawn: three or more points that are not all in one place."""
    (x,) = finite(series.x)
    return len(x) >= 3 and max(x) > min(x)


def by_axis(series: Sequence[Series]) -> list[list[Series]]:
    """Return the series that can be drawn, together those of a quantity over one axis, the most points first."""
    groups: dict[tuple[str, str, str, str], list[Series]] = {}
    for s in series:
        if is_curve(s):
            groups.setdefault((s.x_name, s.x_unit, s.y_name, s.y_unit), []).append(s)
    return sorted(groups.values(), key=lambda alike: -sum(len(s.x) for s in alike))


def limits(values: Sequence[float]) -> tuple[float, float] | None:
    low, high = (min(values), max(values)) if values else (0.0, 0.0)
    if not values or low == high:
        return None
    pad = 0.08 * (high - low)
    return low - pad, high + pad


def fit(series: Sequence[Series], key: str, alike: Sequence[Series], everything: Sequence[Series]) -> str:
    """Points, fit and, beneath on the same axis, residuals.

    The scale is shared with the series that are ``alike``, that of the residuals with ``everything``.
    """
    wide = style.WIDE if len(series) > 1 else style.WIDE * 0.75
    fig, axes = style.figure(wide, 84, nrows=2, ncols=len(series), sharex="col", sharey="row", height_ratios=[2.2, 1])
    for k, s in enumerate(series):
        top, bottom = axes[0, k], axes[1, k]
        x, y = finite(s.x, s.y)
        top.plot(x, y, "o", color=style.BLUE, markersize=2.8, markeredgewidth=0, zorder=3)
        fx, fy = finite(*((s.shown_fit_x, s.shown_fit_y) if s.shown_fit_x else (s.x, s.fit)))
        order = sorted(range(len(fx)), key=lambda i, fx=fx: fx[i])  # type: ignore[misc]
        top.plot([fx[i] for i in order], [fy[i] for i in order], "-", color=style.VERMILION)
        top.set_title(short(s.label, 48), color=style.INK)
        rx, ry = finite(s.x, s.residual)
        style.zero_line(bottom)
        bottom.plot(rx, ry, "o", color=style.BLUE, markersize=2.6, markeredgewidth=0)
        bottom.set_xlabel(style.axis_label(s.x_name, s.x_unit))
        style.degree_ticks(bottom, s.x_unit)
        if s.x_unit in ("", "1") and all(value == round(value) for value in x):
            bottom.xaxis.get_major_locator().set_params(integer=True)
    first = series[0]
    axes[0, 0].set_ylabel(style.axis_label(first.y_name, first.y_unit))
    axes[1, 0].set_ylabel(style.axis_label("residual", first.y_unit))
    values = [[*s.y, *s.shown_fit_y] for s in alike], [s.residual for s in everything]
    for row, others in enumerate(values):
        shared = limits([v for column in others for v in column if math.isfinite(v)])
        if shared:
            axes[row, 0].set_ylim(*shared)
    fig.align_ylabels(axes[:, 0])
    return style.svg(fig, key)


def residuals_in_time(series: Sequence[Series], key: str) -> str:
    """Residuals of series of one unit against time, the series shaded and named where they follow one another."""
    seconds = [t for s in series for t in s.t if math.isfinite(t)]
    if len(seconds) < 3:
        return ""
    divisor, unit = style.time_axis(seconds)
    fig, ax = style.chart(style.WIDE, 58)
    style.zero_line(ax)
    spans = []
    for s in sorted((s for s in series if s.t), key=lambda s: min(t for t in s.t if math.isfinite(t))):
        t, r = finite(s.t, s.residual)
        if not t:
            continue
        t, r = style.envelope([v / divisor for v in t], r)
        half = 0.5 * (t[-1] - t[0]) / max(len(t) - 1, 1)
        spans.append((t[0] - half, t[-1] + half, short(s.label)))
        ax.plot(t, r, "o", color=style.BLUE, markersize=2.6, markeredgewidth=0)
    ax.set_xlabel(style.axis_label("time", unit))
    ax.set_ylabel(style.axis_label("residual", series[0].y_unit))
    ax.margins(x=0.01)
    if all(b[0] >= 0.5 * (a[0] + a[1]) for a, b in pairwise(spans)):
        style.span_labels(ax, spans)
    return style.svg(fig, key, zoom=ax)


def acf(lags: Sequence[float], values: Sequence[float], bound: Sequence[float], key: str, of: str = "windows") -> str:
    """Return an autocorrelation against its lags in ``of``, with the bounds of white noise: of each lag, or of all."""
    lag, rho = finite(lags, values)
    lag, rho = [m for m in lag if m > 0], [r for m, r in zip(lag, rho, strict=True) if m > 0]
    if not lag:
        return ""
    fig, ax = style.chart(style.HALF, 56)
    (bounds,) = finite(bound)
    if len(bounds) == len(lags):
        ax.fill_between(lags, [-b for b in bounds], bounds, color=style.GREEN, alpha=0.2, linewidth=0)
    elif bounds:
        ax.axhspan(-abs(bounds[0]), abs(bounds[0]), color=style.GREEN, alpha=0.2, linewidth=0)
    style.zero_line(ax)
    ax.vlines(lag, 0, rho, color=style.BLUE, linewidth=1.2)
    ax.plot(lag, rho, "o", color=style.BLUE, markersize=2.6, markeredgewidth=0)
    ax.set_xlabel(style.axis_label("lag", of))
    ax.xaxis.get_major_locator().set_params(integer=True)
    ax.set_ylabel(style.axis_label("autocorrelation", "1"))
    ax.set_ylim(min(-0.5, min(rho) * 1.1), max(0.5, max(rho) * 1.1))
    ax.set_xlim(0, max(lag) + 0.5)
    return style.svg(fig, key)


def quantiles(residuals: Sequence[float], key: str) -> str:
    """Residuals, standardized, against normal quantiles, with the pointwise 95 % band of normal samples."""
    import numpy as np
    from scipy.special import betaincinv, ndtri

    values = np.sort(np.asarray(finite(residuals)[0], float))
    n = len(values)
    spread = float(values.std(ddof=1)) if n > 2 else 0.0
    if n < 5 or spread == 0.0:
        return ""
    z = (values - values.mean()) / spread
    i = np.arange(1, n + 1)
    x = ndtri((i - 0.375) / (n + 0.25))
    fig, ax = style.chart(style.HALF, 56)
    band = [ndtri(betaincinv(i, n + 1 - i, q)) for q in (0.025, 0.975)]
    ax.fill_between(x, band[0], band[1], color=style.GREEN, alpha=0.2, linewidth=0)
    ends = [float(x[0]), float(x[-1])]
    ax.plot(ends, ends, "-", color=style.VERMILION)
    x, z = style.envelope(x.tolist(), z.tolist())
    ax.plot(x, z, "o", color=style.BLUE, markersize=2.6, markeredgewidth=0)
    ax.set_xlabel(style.axis_label("normal quantile", "1"))
    ax.set_ylabel("residual / standard deviation")
    return style.svg(fig, key)


def allan(data: AllanDeviation, key: str) -> str:
    """Allan deviation against averaging time with 95 % intervals, both axes logarithmic."""
    tau, dev, low, high = finite(data.tau, data.dev, data.lo or data.dev, data.hi or data.dev)
    rows = [r for r in zip(tau, dev, low, high, strict=True) if r[0] > 0 and r[1] > 0]
    if len(rows) < 2:
        return ""
    tau, dev, low, high = (list(c) for c in zip(*rows, strict=True))
    low = [max(v, 1e-3 * d) for v, d in zip(low, dev, strict=True)]
    fig, ax = style.chart(style.HALF, 62)
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.fill_between(tau, low, high, color=style.BLUE, alpha=0.2, linewidth=0)
    ax.plot(tau, dev, "o-", color=style.BLUE, linewidth=0.8, markeredgewidth=0)
    ax.set_xlabel(style.axis_label("averaging time", data.tau_unit))
    ax.set_ylabel(style.axis_label("Allan deviation", data.unit))
    plain_log(ax, max(high) / min(low))
    return style.svg(fig, key)


def psd(data: PowerSpectrum, key: str) -> str:
    """Return the power spectral density of the residuals, both axes logarithmic."""
    f, density = finite(data.f, data.S)
    rows = [(a, b) for a, b in zip(f, density, strict=True) if a > 0 and b > 0]
    if len(rows) < 2:
        return ""
    f, density = style.envelope([r[0] for r in rows], [r[1] for r in rows])
    fig, ax = style.chart(style.HALF, 62)
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.plot(f, density, "-", color=style.BLUE, linewidth=1.0)
    ax.set_xlabel(style.axis_label("frequency", data.f_unit))
    ax.set_ylabel(style.axis_label("density", data.unit))
    plain_log(ax, max(density) / min(density))
    return style.svg(fig, key)


def plain_log(ax: Any, ratio: float) -> None:
    """Decades as plain numbers or powers of ten; 2 and 5 between them where the axis is short."""
    from matplotlib.ticker import LogLocator

    low, high = ax.get_xlim()
    for axis, span in ((ax.xaxis, high / low), (ax.yaxis, ratio)):
        axis.set_major_locator(LogLocator(subs=(1.0,) if span > 200 else (1.0, 3.0) if span > 15 else (1.0, 2.0, 5.0)))
    ax.minorticks_off()  # nothing of them is shown, and there are many


def correlation(matrix: Sequence[Sequence[float]], names: Sequence[str], key: str) -> str:
    """Return the correlation of the estimates, lower triangle, in hundredths; among many only the large ones."""
    from matplotlib.patches import Rectangle

    n = len(names)
    if n < 2 or len(matrix) != n:
        return ""
    least = 0.0 if n <= MANY else 0.3  # whose number is written
    side = style.HALF if n < 11 else style.WIDE
    fig, ax = style.chart(side, 14 + 6.4 * n)
    ax.grid(False)
    for i in range(1, n):
        for j in range(i):
            r = matrix[i][j]
            if not math.isfinite(r):
                continue
            colour, depth = (style.BLUE if r > 0.0 else style.VERMILION), 0.6 * min(1.0, abs(r))
            ax.add_patch(Rectangle((j - 0.47, i - 0.46), 0.94, 0.92, facecolor=colour, alpha=depth, linewidth=0))
            if abs(r) < least:
                continue
            text = f"{r:.2f}".replace("-", "−") if abs(r) >= 0.005 else "0"
            ax.text(j, i, text, ha="center", va="center", color=style.INK, fontsize=7 if n < 11 else 8)
    ax.set_xlim(-0.5, n - 1.5)
    ax.set_ylim(n - 0.5, 0.5)
    below = [short(m, 14) for m in names[:-1]]
    column = (side / style.MM - 20.0) / (n - 1)  # mm
    turned = 0 if max(map(len, below)) * LETTER < column else 40 if column > 2.0 * LETTER else 90
    ax.set_xticks(range(n - 1), below, rotation=turned, ha="right" if turned == 40 else "center")
    ax.set_yticks(range(1, n), [short(m, 22) for m in names[1:]])
    return style.svg(fig, key)


def scores(coefficients: Sequence[Coefficient], key: str) -> str:
    """(estimate - truth) / u of each coefficient with the band in which 95 % should lie."""
    rows = [(c.name, c.z, c.k) for c in coefficients if c.z is not None and math.isfinite(c.z) and math.isfinite(c.k)]
    if not rows:
        return ""
    fig, ax = style.chart(style.HALF, 14 + 6.4 * len(rows))
    y = range(len(rows))
    for i, (_, _, w) in enumerate(rows):
        ax.fill_betweenx([i - 0.5, i + 0.5], -w, w, color=style.GREEN, alpha=0.2, linewidth=0)
    ax.axvline(0.0, color=style.INK, linestyle="--", linewidth=0.9)
    ax.plot([r[1] for r in rows], y, "o", color=style.BLUE, markersize=4, markeredgewidth=0)
    ax.set_yticks(list(y), [short(r[0], 18) for r in rows])
    ax.set_ylim(len(rows) - 0.4, -0.6)
    reach = max(3.0, 1.1 * max(abs(r[1]) for r in rows))
    ax.set_xlim(-reach, reach)
    ax.set_xlabel("(estimate − truth) / u")
    return style.svg(fig, key)


def strip(
    ax: Any,
    names: Sequence[str],
    values: Sequence[tuple[float, float, float]],
    unit: str,
    title: str,
    baseline: float | None,
) -> None:
    """Estimates with intervals, one row per run, on one axis; dashed the baseline (comparison reports)."""
    if baseline is not None:
        ax.axvline(baseline, color=style.MUTED, linestyle="--", linewidth=0.9)
    for i, (value, low, high) in enumerate(values):
        colour = style.CYCLE[i % len(style.CYCLE)]
        ax.plot([low, high], [i, i], "-", color=colour, linewidth=1.4)
        ax.plot([value], [i], style.MARKERS[i % len(style.MARKERS)], color=colour, markersize=4.5, markeredgewidth=0)
    ax.set_yticks(range(len(names)), [short(n, 20) for n in names])
    ax.set_ylim(len(names) - 0.4, -0.6)
    ax.locator_params(axis="x", nbins=5)
    ax.set_xlabel(style.axis_label(title, unit))
