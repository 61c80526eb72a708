"""Responses of loops: Bode plots, ratios and steps, with their linear curves laid over them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from gyrobench.report.page_model import CollapsedBlocks, Column, Picture, Row, Table, number_cell, pictures, text_cell
from gyrobench.report.plots import finite, short
from gyrobench.report.style import BLUE, CYCLE, GREEN, MARKERS, MUTED, VERMILION, WIDE, axis_label, figure, svg

Json = Mapping[str, Any]
LINES = ((VERMILION, "-"), (GREEN, "--"))  # of the linear models, in their order


def blocks(doc: Json) -> list[Any]:
    """One figure for each response of a result document: what happened in the run, open loops, then the others."""
    figures: list[Any] = []
    order = {"time": 0, "loop": 1}
    for k, r in sorted(enumerate(doc.get("responses") or []), key=lambda item: order.get(item[1]["kind"], 2)):
        key = f"response-{k + 1}"
        alt = f"{r['name']}: " + ("lines over time" if r["kind"] == "time" else "measured points and linear curves")
        label = r["name"] if r["kind"] == "step" and r["name"] == r["y_name"] else "measured"
        figures += pictures(Picture(key, draw([(label, r)], key, curves=r["curves"]), r["caption"], alt))
        if r["kind"] not in ("step", "time") and r["x"]:
            figures.append(CollapsedBlocks(f"Points of the {r['name']}", [_points(doc, k)]))
    return figures


def _points(doc: Json, k: int) -> Table:
    """Frequency, gain, phase, uncertainty and coherence of every measured point."""
    r = doc["responses"][k]
    columns = {"x": (r["x_name"], r["x_unit"]), "y": (r["y_name"], r["y_unit"]), "phase": ("phase", "°")}
    columns |= {"u": ("u, relative", ""), "coherence": ("coherence", "")}
    shown = [name for name in columns if r[name]]
    digits = {"x": 4, "u": 2, "coherence": 7}
    rows = [
        Row([number_cell(doc, ("responses", k, n, i), significant=digits.get(n, 6)) for n in shown])
        for i in range(len(r["x"]))
    ]
    if r["counts"]:
        columns["counts"] = ("counts", "")
        shown.append("counts")
        for row, counts in zip(rows, r["counts"], strict=True):
            row.cells.append(text_cell("yes" if counts else "no"))
    caption = f"Points of the {r['name']}. u: standard uncertainty of the gain, relative, and of the phase in radians."
    return Table([Column(*columns[n]) for n in shown], rows, caption, small=True)


def side_by_side(doc: Json, letter: Callable[[int], str]) -> list[Any]:
    """One figure for each response that two runs or more of a comparison document have, all runs in it."""
    figures: list[Any] = []
    for k, r in enumerate(doc["responses"]):
        named = [(f"{letter(i)} {doc['runs'][i]['name']}", run) for i, run in enumerate(r["runs"]) if run is not None]
        alike = [n for n in named if (n[1]["kind"], n[1]["y_unit"]) == (named[0][1]["kind"], named[0][1]["y_unit"])]
        if len(alike) > 1:
            key = f"response-{k + 1}"
            lines = alike[0][1]["curves"]
            several = alike[0][1]["kind"] == "time" and len(lines) > 1
            name = f"{r['name']}, {lines[0]['label']}" if several else r["name"]
            text = f"{name[:1].upper()}{name[1:]} of all runs."
            figures += pictures(Picture(key, draw(alike, key), text, f"{name} of all runs in one figure"))
    return figures


def draw(named: Sequence[tuple[str, Json]], key: str, curves: Sequence[Json] = ()) -> str:
    """Return the same response of one or several runs in one figure; gain in dB over phase, or values over time."""
    first = named[0][1]
    if first["kind"] == "time":
        return _steps([(c["label"], {**first, **c}) for c in curves] or named, key, ())
    if first["kind"] == "step":
        return _steps(named, key, curves)
    phases = first["kind"] == "loop"
    fig, axes = figure(WIDE * 0.8, 96 if phases else 62, nrows=2 if phases else 1, sharex=True)
    top = axes[0, 0]
    for i, (label, r) in enumerate(named):
        colour = BLUE if len(named) == 1 else CYCLE[i % len(CYCLE)]
        counts = r["counts"] or [True] * len(r["x"])
        near = _nearest(r["phase"], first) if phases and r["phase"] else [0.0] * len(r["x"])
        line = "-" if len(named) > 1 else ""
        for chosen, shade in ((True, colour), (False, MUTED)):
            pick = [k for k, c in enumerate(counts) if c is chosen]
            relative = [0.0 if not r["u"] or r["u"][k] is None else r["u"][k] for k in pick]
            x, y, u, phase = finite(
                [r["x"][k] for k in pick], [r["y"][k] for k in pick], relative, [near[k] for k in pick]
            )
            if not x:
                continue
            style: dict[str, Any] = {
                "color": shade,
                "markersize": 3.6,
                "markeredgewidth": 0,
                "zorder": 3 if chosen else 2,
            }
            style |= {"label": label if chosen else "too noisy to count", "elinewidth": 0.9, "linewidth": 0.8}
            shape = MARKERS[i % len(MARKERS)] + (line if chosen else "")
            top.errorbar(x, _db(y), yerr=[20.0 * math.log10(1.0 + 1.96 * v) for v in u], fmt=shape, **style)
            if phases and r["phase"]:
                axes[1, 0].errorbar(x, phase, yerr=[math.degrees(1.96 * v) for v in u], fmt=shape, **style)
    for (colour, dashes), curve in zip(LINES, curves, strict=False):
        top.plot(curve["x"], _db(curve["y"]), dashes, color=colour, linewidth=1.0, label=curve["label"])
        if phases:
            shift = _shift(curve, first)
            axes[1, 0].plot(curve["x"], [p + shift for p in curve["phase"]], dashes, color=colour, linewidth=1.0)
    for ax in axes[:, 0]:
        ax.set_xscale("log")
    if top.dataLim.height < 1e-6:  # a ratio of 1 and its rounding errors
        top.set_ylim(top.dataLim.y0 - 1.0, top.dataLim.y0 + 1.0)
    unit = first["y_unit"]
    top.set_ylabel(axis_label(first["y_name"], "dB" if unit in ("", "1") else f"dB re {unit}"))
    if phases:
        top.axhline(0.0, color=MUTED, linewidth=0.8, zorder=1)
        bottom = axes[1, 0]
        bottom.set_ylabel(axis_label("phase", "°"))
        _phase_axis(bottom)
        fig.align_ylabels(axes[:, 0])
    axes[-1, 0].set_xlabel(axis_label("frequency", "Hz"))
    _frequency_axis(axes[-1, 0])
    if len(named) + len(curves) > 1 or not all(all(r["counts"]) for _, r in named):
        fig.legend(*top.get_legend_handles_labels(), loc="outside upper left", ncols=3, handlelength=2.2)
    return svg(fig, key)


def _steps(named: Sequence[tuple[str, Json]], key: str, curves: Sequence[Json]) -> str:
    fig, axes = figure(WIDE * 0.8, 62)
    ax = axes[0, 0]
    for i, (label, r) in enumerate(named):
        x, y = finite(r["x"], r["y"])
        colour = BLUE if len(named) == 1 else CYCLE[i % len(CYCLE)]
        points = len(named) == 1 and r["kind"] == "step"
        marks: dict[str, Any] = {"marker": "o", "linestyle": "", "markersize": 2.4} if points else {"linestyle": "-"}
        every = max(1, len(x) // 120) if points else 1
        marks |= {"linewidth": 0.6} if len(x) > 1000 else {}
        ax.plot(x[::every], y[::every], color=colour, markeredgewidth=0, label=short(label), zorder=3, **marks)
    for (colour, dashes), curve in zip(LINES, curves, strict=False):
        ax.plot(curve["x"], curve["y"], dashes, color=colour, linewidth=1.0, label=curve["label"])
    first = named[0][1]
    ax.set_xlabel(axis_label(first["x_name"], first["x_unit"]))
    ax.set_ylabel(axis_label(first["y_name"], first["y_unit"]))
    ax.margins(x=0.01)
    if len(named) + len(curves) > 1:
        fig.legend(loc="outside upper left", ncols=3, handlelength=2.2)
    return svg(fig, key)


def _db(values: Sequence[float]) -> list[float]:
    return [20.0 * math.log10(v) if v > 0.0 else math.nan for v in values]


def _shift(curve: Json, points: Json) -> float:
    """Whole turns that bring a curve's phase to that of the points."""
    if not points["phase"] or not curve["phase"]:
        return 0.0
    x0 = points["x"][0]
    k = min(range(len(curve["x"])), key=lambda i: abs(math.log(curve["x"][i] / x0)))
    return 360.0 * float(round((points["phase"][0] - curve["phase"][k]) / 360.0))


def _nearest(phase: Sequence[float], first: Json) -> list[float]:
    """Return the phase moved by whole turns to that of the first run."""
    turns = 360.0 * round((first["phase"][0] - phase[0]) / 360.0) if first["phase"] else 0.0
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
    from matplotlib.ticker import FuncFormatter, LogLocator

    from gyrobench.report.numbers import write_number

    low, high = ax.get_xlim()
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0,) if high / low > 300 else (1.0, 2.0, 5.0), numticks=12))
    ax.xaxis.set_major_formatter(FuncFormatter(lambda v, _: write_number(float(v), significant=2).text))
    ax.minorticks_off()
