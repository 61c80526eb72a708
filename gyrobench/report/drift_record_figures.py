"""Figures of a drift record: record with gaps, deviations with model, spectrum with model, correlation."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from gyrobench.report.plots import acf, finite, plain_log
from gyrobench.report.style import BLUE, GREEN, ORANGE, VERMILION, WIDE, axis_label, chart, svg, time_axis, zero_line
from gyrobench.result import DriftColumn

COLOURS = (BLUE, GREEN, ORANGE)
MARKS = ("o", "s", "^")


def record(column: DriftColumn, key: str) -> str:
    """Band of extremes and line of means against time, broken at gaps; smoothed drift with its band over it."""
    r = column.record
    t, low, mean, high = finite(r.t, r.low, r.mean, r.high)
    if len(t) < 3:
        return ""
    divisor, unit = time_axis(t)
    usual = sorted(b - a for a, b in pairwise(t))[len(t) // 2]
    fig, ax = chart(WIDE, 58)
    edges = [k for k in range(1, len(t)) if t[k] - t[k - 1] > 1.5 * usual]
    for a, b in zip([0, *edges], [*edges, len(t)], strict=True):
        x = [v / divisor for v in t[a:b]]
        ax.fill_between(x, low[a:b], high[a:b], color=BLUE, alpha=0.25, linewidth=0)
        ax.plot(x, mean[a:b], color=BLUE, linewidth=0.8)
    if s := r.smoothed:
        x = [v / divisor for v in s.t]
        ax.fill_between(x, s.low, s.high, color=VERMILION, alpha=0.35, linewidth=0)
        ax.plot(x, s.mean, color=VERMILION, linewidth=1.0)
    if min(low) < 0.0 < max(high):
        zero_line(ax)
    ax.margins(x=0.01)
    ax.set_xlabel(axis_label("time", unit))
    ax.set_ylabel(axis_label(column.quantity, column.level_unit))
    return svg(fig, key, zoom=ax)


def deviations(column: DriftColumn, key: str) -> str:
    """All deviations against averaging time, the interval of the first one, and the model."""
    fig, ax = chart(WIDE * 0.8, 84)
    ax.set_xscale("log")
    ax.set_yscale("log")
    every = []
    for k, d in reversed(list(enumerate(column.deviations))):
        tau, dev, low, high = _positive(d.tau, d.dev, d.low, d.high)
        if not tau:
            continue
        if k == 0:
            ax.fill_between(tau, low, high, color=COLOURS[k], alpha=0.2, linewidth=0)
        size = 3.4 if k == 0 else 2.6
        ax.plot(tau, dev, MARKS[k] + "-", color=COLOURS[k], linewidth=0.7, markersize=size, markeredgewidth=0,
                label=d.kind)  # fmt: skip
        every += dev
    if not every:
        return ""
    if column.model:
        tau, dev = _positive(column.model.tau, column.model.dev)
        ax.plot(tau, dev, "--", color=VERMILION, linewidth=1.2, label="fitted model (Allan)")
    ax.set_ylim(0.5 * min(every), 2.0 * max(every))
    ax.set_xlabel(axis_label("averaging time", "s"))
    ax.set_ylabel(axis_label("deviation", column.unit))
    plain_log(ax, 4.0 * max(every) / min(every))
    handles, labels = ax.get_legend_handles_labels()
    of_record = len(labels) - bool(column.model)
    order = [*range(of_record - 1, -1, -1), *range(of_record, len(labels))]  # Allan first, the model last
    fig.legend([handles[i] for i in order], [labels[i] for i in order], loc="outside upper left", ncols=4)
    return svg(fig, key)


def spectrum(column: DriftColumn, key: str) -> str:
    """Density with its interval and the model."""
    s, model = column.spectrum, column.model
    f, density, low, high = _positive(s.f, s.S, s.low, s.high) if s else ([], [], [], [])
    if len(f) < 2:
        return ""
    fig, ax = chart(WIDE * 0.8, 76)
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.fill_between(f, low, high, color=BLUE, alpha=0.2, linewidth=0)
    ax.plot(f, density, "o-", color=BLUE, linewidth=0.7, markersize=2.6, markeredgewidth=0, label="record")
    if model:
        x, y = _positive(model.f, model.S)
        ax.plot(x, y, "--", color=VERMILION, linewidth=1.2, label="fitted model")
    ax.set_ylim(0.3 * min(density), 4.0 * max(density))
    ax.set_xlabel(axis_label("frequency", "Hz"))
    ax.set_ylabel(axis_label("density", f"({column.unit})²/Hz"))
    plain_log(ax, max(density) / min(density))
    fig.legend(loc="outside upper left", ncols=2)
    return svg(fig, key)


def correlation(values: Sequence[float], bound: float, key: str) -> str:
    """Autocorrelation, or partial autocorrelation, against the lag in samples."""
    return acf(list(range(len(values))), values, [bound], key, "samples")


def _positive(*columns: Sequence[float | None]) -> list[list[float]]:
    rows = [r for r in zip(*finite(*columns), strict=True) if all(v > 0.0 for v in r)]
    return [list(c) for c in zip(*rows, strict=True)] if rows else [[] for _ in columns]
