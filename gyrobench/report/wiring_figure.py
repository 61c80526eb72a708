"""The wiring of a system as a drawing (N² diagram)."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from gyrobench.report.style import BLUE, INK, MM, PAPER, VERMILION, WIDE, chart, styled, svg

LABEL, NAME = 7.5, 8.0  # pt
LINE = 3.4  # mm, of a label
BROKEN = (17.0, 12.0, 8.0)  # mm: a longer name of a wire goes on after its underscore in the next line
PAD = 1.2  # mm, around a text
GAP = 0.8  # mm, between columns


def ends_of(wires: Sequence[str]) -> list[tuple[str, str, str, str]]:
    """Return slot and variable of both ends of connections "a.x -> b.y"."""
    out = []
    for wire in wires:
        (a, x), (b, y) = (end.strip().split(".", 1) for end in wire.split("->"))
        out.append((a, x, b, y))
    return out


def merge_indices(names: Sequence[str]) -> list[str]:
    """``f[1] f[2] f[3]`` becomes ``f``; other names stay, each once."""
    return list(dict.fromkeys(re.sub(r"\[[\d,]+\]$", "", n) for n in names))


@dataclass
class Layout:
    """Layout of the drawing, mm from its left upper corner; its text is as large as it is printed.

    centres: middle of each part's column and row.  boxes: width and height of each part's box.  names: its lines.
    labels: (row, column) -> lines of the wires' names, none where they do not fit the page.
    """

    width: float = 0.0
    height: float = 0.0
    centres: list[tuple[float, float]] = field(default_factory=list)
    boxes: list[tuple[float, float]] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    labels: dict[tuple[int, int], list[str]] = field(default_factory=dict)


def text_width(text: str, size: float) -> float:
    """Return the width of the widest line, mm."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    font = FontProperties(family="DejaVu Sans", size=size)
    lines = text.split("\n")
    points = max(text_to_path.get_text_width_height_descent(line, font, ismath=False)[0] for line in lines)
    return float(points) / 72.0 / MM


def layout(order: Sequence[str], wires: Sequence[tuple[str, str, str, str]]) -> Layout:
    """Return the places of parts and wires: columns as wide as their texts, rows as high.

    Where the page is too narrow, names are broken: the part's beneath its number, those of wires at underscores.  Where
    it still is, the wires have no names.
    """
    cells: dict[tuple[int, int], list[str]] = {}
    for a, variable, b, _ in wires:
        cells.setdefault((order.index(a), order.index(b)), []).append(variable)
    cells = {where: merge_indices(names) for where, names in cells.items()}
    page = WIDE / MM - 2.0
    tries = [(" ", math.inf, cells), *(("\n", longest, cells) for longest in BROKEN), ("\n", 0.0, {})]
    for separator, broken, labels in tries:
        names = [f"{k}{separator}{name}" for k, name in enumerate(order, 1)]
        lines = {where: [line for n in named for line in broken_name(n, broken)] for where, named in labels.items()}
        boxes = [text_width(name, NAME) + 2.0 * PAD for name in names]
        needed = [
            max([box, *(text_width("\n".join(text), LABEL) + 2.0 * PAD for (_, j), text in lines.items() if j == k)])
            for k, box in enumerate(boxes)
        ]
        if sum(needed) + GAP * (len(order) - 1) <= page:
            break
    spare = max(0.0, page - sum(needed)) / max(1, len(order) - 1)
    tall = 5.2 if separator == " " else 8.2
    rows = [
        max([tall + 2.4, *(LINE * len(text) + 2.0 * PAD for (i, _), text in lines.items() if i == k)])
        for k in range(len(order))
    ]
    left = [sum(needed[:k]) + spare * k for k in range(len(order))]
    top = [sum(rows[:k]) for k in range(len(order))]
    return Layout(
        width=max(page, sum(needed)),
        height=sum(rows),
        centres=[(x + w / 2.0, y + h / 2.0) for x, w, y, h in zip(left, needed, top, rows, strict=True)],
        boxes=[(box, tall) for box in boxes],
        names=names,
        labels=lines,
    )


def broken_name(name: str, longest: float) -> list[str]:
    """Return a name in lines, broken behind its underscores where it is wider than ``longest``, mm."""
    if text_width(name, LABEL) <= longest:
        return [name]
    lines = [""]
    for piece in re.findall(r"[^_]*_|[^_]+$", name):
        if lines[-1] and text_width(lines[-1] + piece, LABEL) > longest:
            lines.append("")
        lines[-1] += piece
    return lines


def draw(order: Sequence[str], wires: Sequence[str], key: str) -> str:
    """Return the SVG: parts on the diagonal in execution order, wires above it forward, below it backward.

    A wire below the diagonal carries the value of the step before: it is drawn dashed.  The SVG can also stand alone.
    """
    with styled():
        return _n_squared(order, [w for w in ends_of(wires) if w[0] in order and w[2] in order], key)


def _n_squared(order: Sequence[str], wires: Sequence[tuple[str, str, str, str]], key: str) -> str:
    from matplotlib.patches import Rectangle

    if len(order) < 2:
        return ""
    places = layout(order, wires)
    fig, ax = chart((places.width + 2.0) * MM, places.height + 2.0)  # wider than the page: it is made smaller there
    ax.set_axis_off()
    ax.set_xlim(-0.4, places.width + 0.4)
    ax.set_ylim(places.height, 0.0)
    for i, j in sorted({(order.index(a), order.index(b)) for a, _, b, _ in wires}):
        forward = j > i
        colour, dash = (BLUE, "-") if forward else (VERMILION, (0, (4, 2)))
        (x, y), (x_end, y_end) = places.centres[i], places.centres[j]
        start = x + (0.5 if forward else -0.5) * places.boxes[i][0]
        ax.plot([start, x_end, x_end], [y, y, y_end], linestyle=dash, color=colour, linewidth=1.0, zorder=1)
        tip = y_end + (-0.5 if forward else 0.5) * (places.boxes[j][1] + 1.6)
        ax.plot([x_end], [tip], "v" if forward else "^", color=colour, markersize=4, zorder=2)
    for (i, j), lines in places.labels.items():
        text = ax.text(
            places.centres[j][0], places.centres[i][1], "\n".join(lines), ha="center", va="center", fontsize=LABEL,
            color=INK, linespacing=1.15, zorder=3,
        )  # fmt: skip
        text.set_bbox({"facecolor": PAPER, "edgecolor": "none", "pad": 1.2})
    for (x, y), (wide, tall), name in zip(places.centres, places.boxes, places.names, strict=True):
        corner = (x - 0.5 * wide, y - 0.5 * tall)
        ax.add_patch(Rectangle(corner, wide, tall, facecolor=PAPER, edgecolor=INK, linewidth=1.0, zorder=4))
        ax.text(x, y, name, ha="center", va="center", fontsize=NAME, color=INK, linespacing=1.1, zorder=5)
    return svg(fig, key)
