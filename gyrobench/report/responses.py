"""Responses of loops: Bode plots, ratios and steps, with their linear curves laid over them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from gyrobench.report.page_model import (
    CollapsedBlocks,
    PageTable,
    Picture,
    Row,
    columns,
    number_cell,
    pictures,
    text_cell,
)
from gyrobench.report.plots import finite, plain_log, short
from gyrobench.report.result_json import Report
from gyrobench.report.style import BLUE, CYCLE, GREEN, MARKERS, MUTED, VERMILION, WIDE, axis_label, chart, figure, svg
from gyrobench.result import Curve, LoopResult, Response, Result

DECADES = 1e-7  # of the largest value: what a spectrum is drawn down to
LINES = ((VERMILION, "-"), (GREEN, "--"))  # of the linear models, in their order
Named = Sequence[tuple[str, Response]]


def blocks(report: Report[Result]) -> list[Any]:
    """Return a figure for each response of a loop: what happened in the run, open loops, then the others."""
    if not isinstance(report.result, LoopResult):
        return []
    figures: list[Any] = []
    order = {"time": 0, "loop": 1}
    for k, r in sorted(enumerate(report.result.responses), key=lambda item: order.get(item[1].kind, 2)):
        key = f"response-{k + 1}"
        lines = {"time": "lines over time", "spectrum": "lines over frequency"}
        alt = f"{r.name}: {lines.get(r.kind, 'measured points and linear curves')}"
        label = r.name if r.kind == "step" and r.name == r.y_name else "measured"
        figures += pictures(Picture(key, draw([(label, r)], key, r.curves), r.caption, alt))
        if r.kind in ("loop", "ratio") and r.x:
            figures.append(CollapsedBlocks(f"Points of the {r.name}", [_points(report, k, r)]))
    return figures


def _points(report: Report[Result], k: int, r: Response) -> PageTable:
    """Return frequency, gain, phase, uncertainty and coherence of every measured point."""
    heads = {"x": (r.x_name, r.x_unit), "y": (r.y_name, r.y_unit), "phase": ("phase", "°")}
    heads |= {"u": ("u, relative", ""), "coherence": ("coherence", "")}
    shown = {name: head for name, head in heads.items() if getattr(r, name)}
    digits = {"x": 4, "u": 2, "coherence": 7}
    rows = []
    for i in range(len(r.x)):
        cells = [number_cell(report.document, ("responses", k, n, i), significant=digits.get(n, 6)) for n in shown]
        rows.append(Row([*cells, *([text_cell("yes" if r.counts[i] else "no")] if r.counts else [])]))
    caption = f"Points of the {r.name}. u: standard uncertainty of the gain, relative, and of the phase in radians."
    return PageTable(columns(*shown.values(), *(["counts"] if r.counts else [])), rows, caption, small=True)


def of_all_runs(key: str, named: Named) -> list[Any]:
    """Return the figure of one response of several runs (name -> response), none where fewer than two are alike."""
    first = named[0][1]
    alike = [n for n in named if (n[1].kind, n[1].y_unit) == (first.kind, first.y_unit)]
    if len(alike) < 2:
        return []
    several = first.kind in ("time", "spectrum") and len(first.curves) > 1
    name = f"{first.name}, {first.curves[0].label}" if several else first.name
    text = f"{name[:1].upper()}{name[1:]} of all runs."
    return pictures(Picture(key, draw(alike, key), text, f"{name} of all runs in one figure"))


def draw(named: Named, key: str, curves: Sequence[Curve] = ()) -> str:
    """Return the same response of one or several runs in one figure; gain in dB over phase, or values over time."""
    first = named[0][1]
    if first.kind == "time":
        lines = [(c.label, c.x, c.y) for c in curves] or [(label, r.x, r.y) for label, r in named]
        return _over_time(lines, first, key, ())
    if first.kind == "spectrum":
        return _over_frequency(
            [(c.label, c.x, c.y) for c in curves] or [(label, r.x, r.y) for label, r in named], first, key
        )
    if first.kind == "step":
        return _over_time([(label, r.x, r.y) for label, r in named], first, key, curves)
    phases = first.kind == "loop"
    fig, axes = figure(WIDE * 0.8, 96 if phases else 62, nrows=2 if phases else 1, sharex=True)
    top = axes[0, 0]
    for i, (label, r) in enumerate(named):
        colour = BLUE if len(named) == 1 else CYCLE[i % len(CYCLE)]
        near = _nearest(r.phase, first) if phases and r.phase else []
        line = "-" if len(named) > 1 else ""
        for counts, shade in ((True, colour), (False, MUTED)):
            _draw_points(axes[:, 0], r, near, counts, {
                "color": shade, "zorder": 3 if counts else 2, "label": label if counts else "too noisy to count",
                "fmt": MARKERS[i % len(MARKERS)] + (line if counts else ""),
            })  # fmt: skip
    for (colour, dashes), curve in zip(LINES, curves, strict=False):
        top.plot(curve.x, _db(curve.y), dashes, color=colour, linewidth=1.0, label=curve.label)
        if phases:
            shift = _shift(curve, first)
            axes[1, 0].plot(curve.x, [p + shift for p in curve.phase], dashes, color=colour, linewidth=1.0)
    _axes(fig, axes[:, 0], first)
    if len(named) + len(curves) > 1 or not all(all(r.counts) for _, r in named):
        fig.legend(*top.get_legend_handles_labels(), loc="outside upper left", ncols=3, handlelength=2.2)
    return svg(fig, key)


def _draw_points(axes: Any, r: Response, phase: Sequence[float], counts: bool, style: dict[str, Any]) -> None:
    """Draw the points of a response that count, or those that do not, with 95 % error bars."""
    pick = [k for k, c in enumerate(r.counts or [True] * len(r.x)) if c is counts]
    known = [(r.u[k] if r.u else None) or 0.0 for k in pick]
    u = [v if math.isfinite(v) else 0.0 for v in known]
    x, y, u, p = finite([r.x[k] for k in pick], [r.y[k] for k in pick], u, [phase[k] if phase else 0.0 for k in pick])
    if not x:
        return
    style |= {"markersize": 3.6, "markeredgewidth": 0, "elinewidth": 0.9, "linewidth": 0.8}
    axes[0].errorbar(x, _db(y), yerr=[20.0 * math.log10(1.0 + 1.96 * v) for v in u], **style)
    if phase:
        axes[1].errorbar(x, p, yerr=[math.degrees(1.96 * v) for v in u], **style)


def _axes(fig: Any, axes: Any, first: Response) -> None:
    """Label the axes of gain and, where there is one, phase over frequency."""
    top = axes[0]
    for ax in axes:
        ax.set_xscale("log")
    if top.dataLim.height < 1e-6:  # a ratio of 1 and its rounding errors
        top.set_ylim(top.dataLim.y0 - 1.0, top.dataLim.y0 + 1.0)
    top.set_ylabel(axis_label(first.y_name, "dB" if first.y_unit in ("", "1") else f"dB re {first.y_unit}"))
    if len(axes) > 1:
        top.axhline(0.0, color=MUTED, linewidth=0.8, zorder=1)
        axes[1].set_ylabel(axis_label("phase", "°"))
        _phase_axis(axes[1])
        fig.align_ylabels(axes)
    axes[-1].set_xlabel(axis_label("frequency", "Hz"))
    _frequency_axis(axes[-1])


def _over_time(
    lines: Sequence[tuple[str, Sequence[float], Sequence[float]]], first: Response, key: str, curves: Sequence[Curve]
) -> str:
    """Return lines (label, x, y) in one figure, with the curves of models over them; a step alone as points."""
    fig, ax = chart(WIDE * 0.8, 62)
    points = len(lines) == 1 and first.kind == "step"
    for i, (label, *values) in enumerate(lines):
        x, y = finite(*values)
        colour = BLUE if len(lines) == 1 else CYCLE[i % len(CYCLE)]
        marks: dict[str, Any] = {"marker": "o", "linestyle": "", "markersize": 2.4} if points else {"linestyle": "-"}
        every = max(1, len(x) // 120) if points else 1
        marks |= {"linewidth": 0.6} if len(x) > 1000 else {}
        ax.plot(x[::every], y[::every], color=colour, markeredgewidth=0, label=short(label), zorder=3, **marks)
    for (colour, dashes), curve in zip(LINES, curves, strict=False):
        ax.plot(curve.x, curve.y, dashes, color=colour, linewidth=1.0, label=curve.label)
    ax.set_xlabel(axis_label(first.x_name, first.x_unit))
    ax.set_ylabel(axis_label(first.y_name, first.y_unit))
    ax.margins(x=0.01)
    if len(lines) + len(curves) > 1:
        fig.legend(loc="outside upper left", ncols=3, handlelength=2.2)
    return svg(fig, key)


def _over_frequency(lines: Sequence[tuple[str, Sequence[float], Sequence[float]]], first: Response, key: str) -> str:
    """Return lines (label, x, y) in one figure, both axes logarithmic; pairs of a measured line and its model alike."""
    fig, ax = chart(WIDE * 0.8, 72)
    for i, (label, *values) in enumerate(lines):
        x, y = finite(*values)
        modelled = label.endswith("linear")
        ax.plot(x, y, "--" if modelled else "-", color=CYCLE[(i // 2 if len(lines) == 4 else i) % len(CYCLE)],
                linewidth=1.2 if modelled else 0.8, label=label)  # fmt: skip
    ax.set_xscale("log")
    ax.set_yscale("log")
    low, high = ax.get_ylim()
    ax.set_ylim(max(low, DECADES * high), high)
    ax.set_xlabel(axis_label(first.x_name, first.x_unit))
    ax.set_ylabel(axis_label(first.y_name, first.y_unit))
    ax.margins(x=0.01)
    plain_log(ax, ax.get_ylim()[1] / ax.get_ylim()[0])
    fig.legend(loc="outside upper left", ncols=2, handlelength=2.2)
    return svg(fig, key)


def _db(values: Sequence[float]) -> list[float]:
    return [20.0 * math.log10(v) if v > 0.0 else math.nan for v in values]


def _shift(curve: Curve, points: Response) -> float:
    """Return whole turns that bring a curve's phase to that of the points."""
    if not points.phase or not curve.phase:
        return 0.0
    x0 = points.x[0]
    k = min(range(len(curve.x)), key=lambda i: abs(math.log(curve.x[i] / x0)))
    return 360.0 * float(round((points.phase[0] - curve.phase[k]) / 360.0))


def _nearest(phase: Sequence[float], first: Response) -> list[float]:
    """Return the phase moved by whole turns to that of the first run."""
    turns = 360.0 * round((first.phase[0] - phase[0]) / 360.0) if first.phase else 0.0
    return [p + turns for p in phase]


def _phase_axis(ax: Any) -> None:
    from matplotlib.ticker import MultipleLocator

    low, high = ax.get_ylim()
    ticks = ((90.0, 300.0), *((step, 3.0 * step) for step in (45.0, 30.0, 15.0, 10.0, 5.0, 2.0, 1.0)))
    ax.yaxis.set_major_locator(MultipleLocator(next((step for step, span in ticks if high - low >= span), 0.5)))
    for level in range(-900, 901, 360):
        if low <= level - 180 <= high:
            ax.axhline(level - 180, color=MUTED, linewidth=0.8, zorder=1)


def _frequency_axis(ax: Any) -> None:
    from matplotlib.ticker import LogLocator

    low, high = ax.get_xlim()
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0,) if high / low > 300 else (1.0, 2.0, 5.0), numticks=12))
    ax.minorticks_off()
