"""The wiring figure: texts that fit their boxes and the page, and lie on nothing else."""

from __future__ import annotations

import pytest

from gyrobench.report.style import MM, WIDE, styled
from gyrobench.report.wiring_figure import LABEL, LINE, NAME, Layout, broken_name, layout, text_width
from gyrobench.system.system import load_system
from gyrobench.system.wire_text import parse_wires


def wiring(name: str) -> tuple[list[str], list[tuple[str, str, str, str]]]:
    """Slots and wires of a standard system; the order of declaration is as wide as that of execution."""
    system = load_system(name)
    wires = [(a, v.partition("[")[0], b, u) for a, v, b, u in parse_wires(system.wires)]
    return list(system.slots), wires


def rectangles(places: Layout) -> list[tuple[str, float, float, float, float]]:
    """Left, top, right, bottom of every text, mm; sizes are those of the printed font, not those of the layout."""
    found = []
    for (x, y), name in zip(places.centres, places.names, strict=True):
        w, h = text_width(name, NAME), LINE * (name.count("\n") + 1)
        found.append((name, x - w / 2, y - h / 2, x + w / 2, y + h / 2))
    for (i, j), lines in places.labels.items():
        x, y = places.centres[j][0], places.centres[i][1]
        w, h = text_width("\n".join(lines), LABEL), LINE * len(lines)
        found.append((" ".join(lines), x - w / 2, y - h / 2, x + w / 2, y + h / 2))
    return found


@pytest.mark.parametrize("name", ["stabilizer_sdf", "platform_three_axis", "platform_four_gimbal"])
def test_texts_neither_overlap_nor_leave_the_page(name: str) -> None:
    """Eleven equal columns of 170 mm were narrower than "11  azimuth", and "motion_acceleration" lay on the exciter."""
    order, wires = wiring(name)
    with styled():
        places = layout(order, wires)
        texts = rectangles(places)
    assert places.width <= WIDE / MM
    assert {(order.index(a), order.index(b)) for a, _, b, _ in wires} == set(places.labels)
    for k, (one, left, top, right, bottom) in enumerate(texts):
        assert left >= 0.0 and right <= places.width and top >= 0.0 and bottom <= places.height, one
        for other, left_2, top_2, right_2, bottom_2 in texts[k + 1 :]:
            apart = right <= left_2 or right_2 <= left or bottom <= top_2 or bottom_2 <= top
            assert apart, f"“{one}” lies on “{other}”"
    for (_, left, _, right, _), (wide, _) in zip(texts, places.boxes, strict=False):
        assert right - left < wide


@pytest.mark.long
def test_a_system_too_wide_for_names_of_wires_keeps_those_of_its_parts() -> None:
    order = [f"gyro_{k}" for k in range(12)]
    places = layout(order, [(a, "omega_of_platform_element", b, "u") for a in order for b in order])
    assert places.labels == {} and places.names[11] == "12\ngyro_11" and places.width <= WIDE / MM
    places = layout(2 * order, [])
    assert places.width > WIDE / MM and all(text_width(n, NAME) < w for n, (w, _) in zip(places.names, places.boxes))  # noqa: B905


def test_long_names_are_broken_at_underscores() -> None:
    assert broken_name("motion_acceleration", 17.0) == ["motion_", "acceleration"]
    assert broken_name("u_axes", 17.0) == ["u_axes"]
    assert broken_name("acceleration", 2.0) == ["acceleration"]  # nowhere to break
