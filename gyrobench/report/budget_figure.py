"""The error budget as a drawing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from gyrobench.report.plots import short
from gyrobench.report.style import BLUE, GREEN, INK, ORANGE, PURPLE, SKY, VERMILION, WIDE, axis_label, chart, svg
from gyrobench.result import BudgetLine

_HATCHES = ("", "////", "....", "\\\\\\\\", "xxxx", "----", "oo")


def budget(lines: Sequence[BudgetLine], u: Mapping[str, float], key: str) -> str:
    """Error budget.

    Several coefficients: one row each, every source a piece of the row as its share of the stated
    variance u², a mark at 1.  One coefficient: its sources as sorted bars, with sum and u.
    """
    known = [b for b in lines if b.contribution > 0.0]
    names = list(dict.fromkeys(b.coefficient for b in known))
    if not known:
        return ""
    if len(names) == 1:
        return _bars(known, u.get(names[0]), key)
    return _shares(known, [n for n in names if u.get(n, 0.0) > 0.0], u, key)


def _bars(lines: Sequence[BudgetLine], observed: float | None, key: str) -> str:
    rows = sorted(lines, key=lambda b: -b.contribution)
    values = [b.contribution for b in rows]
    total = sum(v * v for v in values) ** 0.5
    labels = [short(b.source, 38) for b in rows] + ["root sum of squares"]
    fig, ax = chart(WIDE, 18 + 6.5 * len(labels))
    ax.barh(range(len(rows)), values, color=BLUE, height=0.62)
    ax.barh([len(rows)], [total], color=VERMILION, height=0.62, hatch="////", edgecolor="#fefefe", linewidth=0)
    if observed is not None and observed > 0.0:
        ax.axvline(observed, color=INK, linestyle="--", linewidth=0.9)
        ax.annotate("u stated", (observed, 1), xycoords=("data", "axes fraction"), ha="center", va="bottom", color=INK)
    ax.set_yticks(range(len(labels)), labels)
    ax.set_ylim(len(labels) - 0.4, -0.6)
    ax.set_xlim(0, 1.08 * max([total, *([observed] if observed is not None and observed > 0.0 else [])]))
    ax.set_xlabel(axis_label("standard uncertainty", rows[0].unit))
    ax.grid(False, axis="y")
    return svg(fig, key)


def _shares(lines: Sequence[BudgetLine], names: Sequence[str], u: Mapping[str, float], key: str) -> str:
    weight: dict[str, float] = {}
    for b in lines:
        if b.coefficient in names:
            share = (b.contribution / u[b.coefficient]) ** 2
            weight[b.source] = weight.get(b.source, 0.0) + share
    sources = sorted(weight, key=lambda s: -weight[s])
    shown, minor = sources[:5], sources[5:]
    colours = dict(zip(shown, (BLUE, VERMILION, GREEN, PURPLE, ORANGE), strict=False))
    fig, ax = chart(WIDE, 24 + 6.2 * len(names) + 4.5 * ((len(shown) + bool(minor) + 1) // 2))
    starts = dict.fromkeys(names, 0.0)
    for k, source in enumerate([*shown, *(["other sources"] if minor else [])]):
        members = minor if k == len(shown) else [source]
        pieces = dict.fromkeys(names, 0.0)
        for b in lines:
            if b.source in members and b.coefficient in pieces:
                pieces[b.coefficient] += (b.contribution / u[b.coefficient]) ** 2
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
