"""Two drawings that are not data plots: the error budget and the wiring of a system."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from gyrobench.report.plots import short
from gyrobench.report.style import (
    BLUE,
    GREEN,
    INK,
    ORANGE,
    PAPER,
    PURPLE,
    SKY,
    VERMILION,
    WIDE,
    axis_label,
    figure,
    styled,
    svg,
)

_HATCHES = ("", "////", "....", "\\\\\\\\", "xxxx", "----", "oo")


def budget(lines: Sequence[Mapping[str, Any]], u: Mapping[str, float | None], key: str) -> str:
    """Error budget.

    Several coefficients: one row each, every source a piece of the row as its share of the stated
    variance u², a mark at 1.  One coefficient: its sources as sorted bars, with sum and u.
    """
    known = [b for b in lines if b["contribution"] is not None and b["contribution"] > 0.0]
    names = list(dict.fromkeys(b["coefficient"] for b in known))
    if not known:
        return ""
    if len(names) == 1:
        return _bars(known, u.get(names[0]), key)
    return _shares(known, [n for n in names if u.get(n)], u, key)


def _bars(lines: Sequence[Mapping[str, Any]], observed: float | None, key: str) -> str:
    rows = sorted(lines, key=lambda b: -b["contribution"])
    values = [b["contribution"] for b in rows]
    total = sum(v * v for v in values) ** 0.5
    labels = [short(b["source"], 38) for b in rows] + ["root sum of squares"]
    fig, axes = figure(WIDE, 18 + 6.5 * len(labels))
    ax = axes[0, 0]
    ax.barh(range(len(rows)), values, color=BLUE, height=0.62)
    ax.barh([len(rows)], [total], color=VERMILION, height=0.62, hatch="////", edgecolor="#fefefe", linewidth=0)
    if observed:
        ax.axvline(observed, color=INK, linestyle="--", linewidth=0.9)
        ax.annotate("u stated", (observed, 1), xycoords=("data", "axes fraction"), ha="center", va="bottom", color=INK)
    ax.set_yticks(range(len(labels)), labels)
    ax.set_ylim(len(labels) - 0.4, -0.6)
    ax.set_xlim(0, 1.08 * max([total, *([observed] if observed else [])]))
    ax.set_xlabel(axis_label("standard uncertainty", rows[0]["unit"]))
    ax.grid(False, axis="y")
    return svg(fig, key)


def _shares(lines: Sequence[Mapping[str, Any]], names: Sequence[str], u: Mapping[str, float | None], key: str) -> str:
    weight: dict[str, float] = {}
    for b in lines:
        if b["coefficient"] in names:
            share = (b["contribution"] / float(u[b["coefficient"]] or 1.0)) ** 2
            weight[b["source"]] = weight.get(b["source"], 0.0) + share
    sources = sorted(weight, key=lambda s: -weight[s])
    shown, minor = sources[:5], sources[5:]
    colours = dict(zip(shown, (BLUE, VERMILION, GREEN, PURPLE, ORANGE), strict=False))
    fig, axes = figure(WIDE, 24 + 6.2 * len(names) + 4.5 * ((len(shown) + bool(minor) + 1) // 2))
    ax = axes[0, 0]
    starts = dict.fromkeys(names, 0.0)
    for k, source in enumerate([*shown, *(["other sources"] if minor else [])]):
        members = minor if k == len(shown) else [source]
        pieces = dict.fromkeys(names, 0.0)
        for b in lines:
            if b["source"] in members and b["coefficient"] in pieces:
                pieces[b["coefficient"]] += (b["contribution"] / float(u[b["coefficient"]] or 1.0)) ** 2
        ax.barh(
            range(len(names)), [pieces[n] for n in names], left=[starts[n] for n in names], height=0.66,
            color=colours.get(source, SKY), hatch=_HATCHES[k], edgecolor="#fefefe", linewidth=0.4,
            label=short(source, 46),
        )  # fmt: skip
        for n in names:
            starts[n] += pieces[n]
    ax.axvline(1.0, color=INK, linestyle="--", linewidth=0.9)
    ax.set_yticks(range(len(names)), [short(n, 22) for n in names])
    ax.set_ylim(len(names) - 0.4, -0.6)
    ax.set_xlim(0, 1.06 * max(1.0, *starts.values()))
    ax.set_xlabel("fraction of the stated variance u² / 1  (dashed: all of it)")
    ax.grid(False, axis="y")
    fig.legend(loc="outside upper left", ncols=2, handlelength=1.6, columnspacing=1.5)
    return svg(fig, key)


def wires_of(provenance: Mapping[str, Any]) -> list[tuple[str, str, str, str]]:
    """(from slot, variable, to slot, variable) of each wire.

    A wire is "a.x -> b.y", a pair of ends, or a dictionary with "wire" or with "from" and "to"; one that is marked as
    not connected is left out.
    """
    out = []
    for wire in provenance.get("wires") or []:
        if isinstance(wire, Mapping):
            if not wire.get("connected", True):
                continue
            wire = wire["wire"] if "wire" in wire else (wire.get("from"), wire.get("to"))
        ends = re.split(r"\s*->\s*", wire) if isinstance(wire, str) else [str(e) for e in wire]
        if len(ends) == 2 and all("." in e for e in ends):
            (a, x), (b, y) = (e.split(".", 1) for e in ends)
            out.append((a, x, b, y))
    return out


def merge_indices(names: Sequence[str]) -> list[str]:
    """``f[1] f[2] f[3]`` becomes ``f``; other names stay, each once."""
    return list(dict.fromkeys(re.sub(r"\[[\d,]+\]$", "", n) for n in names))


def system(order: Sequence[str], provenance: Mapping[str, Any], key: str) -> str:
    """N² drawing: parts on the diagonal in execution order, wires above it forward, below it backward.

    A wire below the diagonal carries the value of the step before: it is drawn dashed.  ``provenance`` holds the
    "wires"; the SVG can also stand alone.
    """
    with styled():
        return _n_squared(order, provenance, key)


def _n_squared(order: Sequence[str], provenance: Mapping[str, Any], key: str) -> str:
    from matplotlib.patches import Rectangle

    wires = [w for w in wires_of(provenance) if w[0] in order and w[2] in order]
    n = len(order)
    if n < 2:
        return ""
    cells: dict[tuple[int, int], list[str]] = {}
    for a, variable, b, _ in wires:
        cells.setdefault((order.index(a), order.index(b)), []).append(variable)
    cells = {where: merge_indices(names) for where, names in cells.items()}
    tall = [max([1.9] + [1.0 * len(v) + 0.7 for (i, _), v in cells.items() if i == row]) for row in range(n)]
    tops = [sum(tall[:row]) for row in range(n + 1)]
    fig, axes = figure(WIDE, 4.1 * tops[-1] + 3)
    ax = axes[0, 0]
    ax.set_axis_off()
    ax.set_xlim(-0.5, n - 0.5)
    ax.set_ylim(tops[-1], 0)
    middle = [0.5 * (tops[row] + tops[row + 1]) for row in range(n)]
    for i, j in cells:
        forward = j > i
        colour, dash = (BLUE, "-") if forward else (VERMILION, (0, (4, 2)))
        edge = 0.42 if forward else -0.42
        ax.plot(
            [i + edge, j, j], [middle[i], middle[i], middle[j]], linestyle=dash, color=colour, linewidth=1.0, zorder=1
        )
        tip = middle[j] - 0.75 if forward else middle[j] + 0.75
        ax.plot(
            [j], [tip - (0.12 if forward else -0.12)], "v" if forward else "^", color=colour, markersize=4, zorder=2
        )
    for (i, j), names in cells.items():
        text = ax.text(
            j, middle[i], "\n".join(short(m, 17) for m in names), ha="center", va="center", fontsize=7.5,
            color=INK, linespacing=1.15, zorder=3,
        )  # fmt: skip
        text.set_bbox({"facecolor": PAPER, "edgecolor": "none", "pad": 1.2})
    for row, name in enumerate(order):
        box = Rectangle(
            (row - 0.42, middle[row] - 0.7), 0.84, 1.4, facecolor=PAPER, edgecolor=INK, linewidth=1.0, zorder=4
        )
        ax.add_patch(box)
        ax.text(row, middle[row], f"{row + 1}  {short(name, 14)}", ha="center", va="center", color=INK, zorder=5)
    return svg(fig, key)
