"""Names and numbers at the axes of figures: none over its neighbour, none between two whole numbers."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from gyrobench.report import channel_figure, plots, style
from gyrobench.report.style import WIDE, axis_label, chart, styled, svg
from gyrobench.result import Series


@pytest.fixture(autouse=True)
def figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Plots return what they have drawn."""
    monkeypatch.setattr(style, "svg", lambda fig, key, **zoom: (svg(fig, key, **zoom), fig)[1])


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


LABEL = re.compile(
    r"(?P<name>.*?)(?: (?P<sign>[−+]) (?P<offset>\S+))? / \(?(?:10(?P<power>[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+) ?)?(?P<unit>.*?)\)?"
)
DIGITS = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹−", "-0123456789-")


def read(axis: Any, label: str) -> tuple[str, str]:
    """Return name and unit of an axis whose numbers, by its label alone, are where they stand."""
    found = LABEL.fullmatch(label)
    assert found and not (axis.offsetText.get_visible() and axis.offsetText.get_text()), label
    offset = float(found["offset"] or 0.0) * (-1.0 if found["sign"] == "+" else 1.0)
    factor = 10.0 ** int((found["power"] or "0").translate(DIGITS))
    places, low, high = axis.get_majorticklocs(), *axis.get_view_interval()
    shown = [float(t.get_text().translate(DIGITS)) for t in axis.get_majorticklabels()]
    assert len(shown) == len(places) > 2 and len(set(shown)) == len(shown)
    assert offset + factor * np.array(shown) == pytest.approx(places, rel=1e-15, abs=1e-3 * (high - low))
    assert all(len(f"{number:g}") < 9 for number in shown)
    return found["name"], found["unit"]


@pytest.mark.parametrize(
    ("values", "label"),
    [
        ((1e-9, 3e-9), "rate / (10⁻⁹ °/h)"),
        ((-4e-5, 2e-5), "rate / (10⁻⁶ °/h)"),
        ((1e9, 3e9), "rate / (10⁹ °/h)"),
        ((1e6, 1e6 + 1e-3), "rate − 1000000 / (°/h)"),
        ((-1e6, -1e6 - 1e-6), "rate + 1000000 / (10⁻⁶ °/h)"),
        ((1.0, 1.0 + 1e-7), "rate − 1 / (10⁻⁹ °/h)"),
        ((1.7e9, 1.7e9 + 3600.0), "rate − 1700000000 / (°/h)"),
        ((2e12, 2e12 + 5e6), "rate − 2000000000000 / (10⁶ °/h)"),
        ((0.1, 0.3), "rate / (°/h)"),
        ((0.0, 0.0), "rate / (°/h)"),
    ],
)
def test_an_axis_says_in_its_label_what_its_numbers_leave_out(values: tuple[float, float], label: str) -> None:
    """Power of ten and offset; of an axis of time whose page can be zoomed the limits are these numbers, too."""
    with styled():
        fig, ax = chart(WIDE, 58)
        ax.plot(values, values)
        ax.set_xlabel(axis_label("share", "1"))
        ax.set_ylabel(axis_label("rate", "°/h"))
        drawn = svg(fig, "k", zoom=ax)
    assert ax.get_ylabel() == label
    assert read(ax.yaxis, ax.get_ylabel()) == ("rate", "°/h")
    assert read(ax.xaxis, ax.get_xlabel())[0] == "share"
    first, last = (float(v) for v in re.findall(r'data-x[01]="(.*?)"', drawn))
    shown = [float(t.get_text().translate(DIGITS)) for t in ax.get_xticklabels()]
    assert [n for n in shown if first < n < last], "ticks of the page lie between its limits"


@pytest.mark.parametrize("size", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_a_fit_of_any_size_can_be_read(size: float, offset: float) -> None:
    """The axes of a row are one axis, which has its label at the left."""
    x = [float(k) for k in range(21)]
    y = [offset * size + 1e-3 * size * k for k in x]
    residual = [1e-9 * size * (-1.0) ** k for k in range(21)]
    series = [Series(f"gyro {k}", x, "angle", "°", y, y, residual, "rate", "°/h", t=x) for k in (1, 2)]
    with styled():
        drawn: Any = plots.fit(series, "f", series, series)
        over_time: Any = plots.residuals_in_time(series, "r")
    assert [ax.get_title(loc="left") for ax in drawn.axes[:2]] == ["gyro 1", "gyro 2"]
    for ax in (drawn.axes[0], drawn.axes[2], over_time.axes[0]):
        assert read(ax.yaxis, ax.get_ylabel())[1] == "°/h"


def test_numbers_of_a_logarithmic_axis_carry_their_power() -> None:
    with styled():
        fig, ax = chart(WIDE, 58)
        ax.loglog([1e-9, 1e9], [1e-6, 1e-6 * 3])
        svg(fig, "k")
    shown = [t.get_text() for t in ax.get_xticklabels()]
    assert "1·10⁻⁸" in shown or "1·10⁻⁹" in shown, shown
    assert not any("1e" in t or "$" in t for t in shown)


def test_the_title_of_a_channel_says_what_its_numbers_leave_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(channel_figure, "svg", lambda fig, key, **zoom: (svg(fig, key, **zoom), fig)[1])
    time = np.arange(100.0)
    record = {"time": 1.7e9 + time, "a.y": 9.81 + 1e-9 * time, "b.y": 1e-9 * time}
    with styled():
        drawn: Any = channel_figure.draw(record, [["a.y"], ["b.y"]], {"a.y": "m/s²", "b.y": "m/s²"}, "c")
    first, second = drawn.axes
    assert read(first.yaxis, first.get_title(loc="left")) == ("a.y", "m/s²")
    assert second.get_title(loc="left") == "b.y / (10⁻⁹ m/s²)"
    assert read(second.xaxis, second.get_xlabel()) == ("time", "s")
