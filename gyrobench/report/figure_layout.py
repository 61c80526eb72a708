"""Places of the axes of a figure: as large as the labels around them leave room for.

Between neighbours, and to the edge, is room for what stands out of each axes (numbers, names, titles, texts) and
:data:`PAD`; the axes of a row or column share what is left in the ratios of the grid.  As matplotlib's constrained
layout has it, but what stands out is measured once, and again only where the first places change it: numbers that
follow the size of the axes, texts beside them.
"""

from __future__ import annotations

import functools
import io
from typing import Any

PAD = 0.02  # inch, round everything that stands out of an axes
GAP = 0.02  # of the figure, over the number of rows or columns: least distance of neighbours


@functools.cache
def ruler() -> Any:
    """A renderer that texts are measured with; it draws nothing."""
    from matplotlib.backends import backend_svg

    made: Any = backend_svg.RendererSVG
    return made(100.0, 100.0, io.StringIO())


def place(fig: Any) -> None:
    """Give every axes of a figure of one grid its place; they stay where they are where nothing is left for them.

    Legends of the figure have their room above the axes.
    """
    numbers = _numbers(fig)
    for _ in range(2):
        _place(fig)
        before, numbers = numbers, _numbers(fig)
        if numbers == before and not any(_stands_out(text, ax) for ax in fig.axes for text in ax.texts):
            return


def _numbers(fig: Any) -> list[list[float]]:
    """Return where each axis has its numbers."""
    return [axis.get_majorticklocs().tolist() for ax in fig.axes for axis in (ax.xaxis, ax.yaxis)]


def _stands_out(text: Any, ax: Any) -> bool:
    box, inside = text.get_window_extent(ruler()), ax.bbox
    return bool(box.x0 < inside.x0 or box.x1 > inside.x1 or box.y0 < inside.y0 or box.y1 > inside.y1)


def _place(fig: Any) -> None:
    width, height = fig.get_size_inches()
    to_figure = fig.transFigure.inverted()
    grid = fig.axes[0].get_subplotspec().get_gridspec()
    rows, columns = grid.get_geometry()
    left, right = [0.0] * columns, [0.0] * columns
    top, bottom = [0.0] * rows, [0.0] * rows
    for ax in fig.axes:
        cell, own = ax.get_subplotspec(), ax.get_position(original=True)
        box = ax.get_tightbbox(ruler(), for_layout_only=True).transformed(to_figure)
        r, c = cell.rowspan.start, cell.colspan.start
        left[c], right[c] = max(left[c], own.x0 - box.x0), max(right[c], box.x1 - own.x1)
        bottom[r], top[r] = max(bottom[r], own.y0 - box.y0), max(top[r], box.y1 - own.y1)
    legends = [leg.get_tightbbox(ruler()).transformed(to_figure).height for leg in fig.legends]
    above = max(legends) + 2.0 * PAD / height if legends else 0.0
    x = _shared(left, right, grid.get_width_ratios(), PAD / width, 0.0)
    y = _shared(top, bottom, grid.get_height_ratios(), PAD / height, above)
    if x is None or y is None:
        return
    for ax in fig.axes:
        cell = ax.get_subplotspec()
        (x0, w), (from_top, h) = x[cell.colspan.start], y[cell.rowspan.start]
        ax.set_position([x0, 1.0 - from_top - h, w, h])


def _shared(
    before: list[float], after: list[float], ratios: list[float], pad: float, taken: float
) -> list[tuple[float, float]] | None:
    """Return begin and size of each row or column, of a figure of size 1; None where nothing is left.

    before, after: what stands out of it on either side; taken: at the beginning.
    """
    n = len(ratios)
    between = max(pad, GAP / 2.0 / n)
    first = [b + (between if k else pad) for k, b in enumerate(before)]
    last = [a + (between if k < n - 1 else pad) for k, a in enumerate(after)]
    unit = (1.0 - taken - sum(first) - sum(last)) / sum(ratios)
    if unit <= 0.0:
        return None
    out, at = [], taken
    for b, ratio, a in zip(first, ratios, last, strict=True):
        out.append((at + b, unit * ratio))
        at += b + unit * ratio + a
    return out
