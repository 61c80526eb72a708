"""Places of the axes of a figure: as the constrained layout of matplotlib has them; nothing cut off or over another."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import Any

import pytest
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.layout_engine import ConstrainedLayoutEngine

from gyrobench.report.figure_layout import PAD, place, ruler
from gyrobench.report.plots import plain_log
from gyrobench.report.style import HALF, WIDE, figure, span_labels, styled


def _fit() -> Any:
    fig, axes = figure(WIDE, 84, nrows=2, ncols=2, sharex="col", sharey="row", height_ratios=[2.2, 1])
    for k in range(2):
        axes[0, k].plot([0.0, 360.0], [-1.0 - k, 2e5])
        axes[1, k].plot([0.0, 360.0], [-0.001, 0.001])
        axes[0, k].set_title(f"mount {k}, a long name of a phase that is wider than its axes")
        axes[1, k].set_xlabel("table angle / °")
    axes[0, 0].set_ylabel("drift rate / (°/h)")
    axes[1, 0].set_ylabel("residual / (°/h)")
    fig.align_ylabels(axes[:, 0])
    return fig


def _legend() -> Any:
    fig, axes = figure(WIDE * 0.8, 96, nrows=2, sharex=True)
    for ax, name in zip(axes[:, 0], ("gain", "phase"), strict=True):
        ax.plot([0.1, 100.0], [1e-3, 1.0], label=name)
        ax.loglog()
        ax.set_ylabel(name)
        plain_log(ax, 1000.0)
    axes[1, 0].set_xlabel("frequency / Hz")
    fig.legend(loc="outside upper left", ncols=3)
    return fig


def _names() -> Any:
    fig, axes = figure(HALF, 50)
    axes[0, 0].plot([1.0, 2.0, 3.0], [0, 1, 2], "o")
    axes[0, 0].set_yticks([0, 1, 2], ["D_F", "a coefficient of a long name", "D_II"])
    return fig


def _labels() -> Any:
    fig, axes = figure(WIDE, 58)
    axes[0, 0].plot([0.0, 100.0], [0.0, 1.0])
    span_labels(axes[0, 0], [(0.0, 5.0, "mount 1 of the table"), (5.0, 10.0, "mount 2 of it"), (10.0, 100.0, "rest")])
    return fig


@pytest.fixture(params=[_fit, _legend, _names, _labels])
def drawn(request: pytest.FixtureRequest) -> Any:
    make: Callable[[], Any] = request.param
    with styled():
        yield make()


def test_nothing_is_cut_off_or_over_another(drawn: Any) -> None:
    place(drawn)
    width, height = drawn.bbox.width, drawn.bbox.height
    boxes = [ax.get_tightbbox(ruler(), for_layout_only=True) for ax in drawn.axes]
    boxes += [legend.get_tightbbox(ruler()) for legend in drawn.legends]
    for box in boxes:
        assert box.x0 > -0.01 and box.x1 < width + 0.01 and box.y0 > -0.01 and box.y1 < height + 0.01
    for i, one in enumerate(boxes):
        for other in boxes[:i]:
            across = min(one.x1, other.x1) - max(one.x0, other.x0)
            along = min(one.y1, other.y1) - max(one.y0, other.y0)
            assert across < 0.01 or along < 0.01
    edge = 72.0 * PAD  # and no room is left over: one axes reaches each edge but for the padding
    assert min(b.x0 for b in boxes) == pytest.approx(edge, abs=0.3)
    assert max(b.x1 for b in boxes) == pytest.approx(width - edge, abs=0.3)
    assert min(b.y0 for b in boxes) == pytest.approx(edge, abs=0.3)


def test_as_the_constrained_layout(drawn: Any) -> None:
    """Within a hundredth of an inch, of figures 2.0 to 6.7 inches wide and high."""
    place(drawn)
    ours = [ax.get_position().extents for ax in drawn.axes]
    for ax in drawn.axes:
        ax.set_in_layout(True)
    drawn.set_layout_engine(ConstrainedLayoutEngine(w_pad=PAD, h_pad=PAD))
    FigureCanvasSVG(drawn).print_svg(io.StringIO())  # the same renderer: another has texts of other sizes
    size = [*drawn.get_size_inches()] * 2
    for own, ax in zip(ours, drawn.axes, strict=True):
        assert own * size == pytest.approx(ax.get_position().extents * size, abs=0.01)


def test_where_nothing_is_left_the_axes_stay() -> None:
    with styled():
        fig, axes = figure(HALF, 8)
        axes[0, 0].set_xlabel("a label\nof many\nlines\nthat is\nhigher\nthan the figure")
        before = axes[0, 0].get_position().extents
        place(fig)
    assert axes[0, 0].get_position().extents == pytest.approx(before)
