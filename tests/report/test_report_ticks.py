"""Names and numbers at the axes of figures: none over its neighbour, none between two whole numbers."""

from __future__ import annotations

import numpy as np
import pytest

from gyrobench.report import plots
from gyrobench.report.style import styled
from gyrobench.result import Series


@pytest.fixture(autouse=True)
def figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Plots return what they draw."""
    monkeypatch.setattr(plots, "svg", lambda fig, *_: fig)


@pytest.mark.parametrize(
    ("names", "turn"),
    [
        (["D_OIS", *"abcd"], 0),  # half the text width: (82 - 20)/4 = 15.5 mm for a name of some 8 mm
        ([f"isolation {k} Hz" for k in range(9)], 40),  # 62/8 = 7.75 mm for 22 mm
        ([f"Sg_x{k % 10}" for k in range(32)], 40),  # the whole text width: 150/31 = 4.8 mm for 8 mm
        ([f"S_{k:04d}" for k in range(60)], 90),  # 150/59 = 2.5 mm, less than two lines are high
    ],
)
def test_names_of_a_correlation_do_not_lie_over_each_other(names: list[str], turn: int) -> None:
    with styled():
        drawn = plots.correlation(np.eye(len(names)).tolist(), names, "c")
    assert {label.get_rotation() for label in drawn.axes[0].get_xticklabels()} == {turn}  # type: ignore[attr-defined]


def test_numbers_of_phases_are_whole() -> None:
    x = [float(k) for k in range(1, 22)]
    series = Series("gyro", x, "number of the phase", "", x, x, [0.0] * 21, "rate", "°/h")
    with styled():
        drawn = plots.fit([series], "f", [series], [series])
    ticks = drawn.axes[1].get_xticks()  # type: ignore[attr-defined]
    assert len(ticks) > 3 and all(t == round(t) for t in ticks)
