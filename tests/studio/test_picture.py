"""The moving picture in headless Chromium: it stands as the record says, and is read on every ground and width."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from studio_pages import CHROMIUM, NONE, at_rest, base_of, soon

import gyrobench as gb
from gyrobench.bench import standard_folder
from gyrobench.engine.session import Session
from gyrobench.system.moving_bodies import attitudes, parse_bodies

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason=NONE)

MOVING = {
    "tumble_single_axis": {"rate": "30deg/s", "dwell": "2s", "settle": "0.5s", "windows": "12"},
    "tumble_two_channel": {"rate": "30deg/s", "dwell": "2s", "settle": "0.5s", "windows": "12"},
    "tumble_two_axis": {"positions": "12"},
    "platform_three_axis": {"hold": "5s"},
    "accelerometer_four": {}, "accelerometer_multipoint": {}, "attitude_estimator": {}, "north_finder": {},
    "pickoff_scale_factor": {}, "rebalance_loop_test": {},
}  # fmt: skip
#: axes of the bodies as they are drawn: name -> x, y, z axes in east, north, up
DRAWN = """() => {
  const scene = getElement(document.querySelector('.scene').id.slice(1));
  const found = {};
  for (const {mesh} of scene.objects.values()) {
    if (!mesh?.name?.startsWith('body ')) continue;
    mesh.updateWorldMatrix(true, false);
    const e = mesh.matrixWorld.elements;
    found[mesh.name.slice(5)] = [[e[0], e[1], e[2]], [e[4], e[5], e[6]], [e[8], e[9], e[10]]];
  }
  return found;
}"""

#: nothing hides the ground of the page, and it has this colour
GROUND = """colour => {
  const scene = document.querySelector('.scene');
  return scene && getComputedStyle(scene).backgroundColor === colour
    && getElement(scene.id.slice(1))?.renderer?.getClearAlpha() === 0;
}"""
#: so many names, and no part of one is outside of the picture
NAMED = """count => {
  const scene = document.querySelector('.scene'), all = scene?.getBoundingClientRect();
  const names = [...scene?.children[1]?.children ?? []].map(e => e.getBoundingClientRect());
  return names.length === count && names.every(n => n.width > 0
    && n.left >= all.left && n.right <= all.right && n.top >= all.top && n.bottom <= all.bottom);
}"""


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=() if n == "tumble_two_axis" else pytest.mark.long) for n in MOVING]
)
def test_what_is_drawn_stands_as_the_record_says(
    page: Any, studio: tuple[str, Path], name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Read from the scene, at four times, by keyboard and mouse: the axes of all bodies, to 1e-9.

    That the record's attitudes are the true ones: tests/system/test_moving_bodies.py.
    """
    folder = studio[1] / "reports" / "out" / name / "moving"
    system = gb.load(name, MOVING[name]).system
    if name == "platform_three_axis":  # its motion begins with the first phase
        monkeypatch.setattr(type(system), "stop", 40.0)
        monkeypatch.setattr(type(system), "channel_period", 0.01)
    with Session(system, bench=standard_folder()) as session:
        record = session.run(seed=1)
    record.save(folder)
    page.goto(base_of(studio) + f"/run/{name}/moving")
    page.get_by_role("tab", name="Moving picture").click()
    slider = page.get_by_role("slider")
    page.locator(".scene canvas").first.wait_for()
    bodies = parse_bodies(system.bodies)
    rows: set[int] = set()
    for share in (None, 0.0, 0.4, 0.7):  # None: as it is at first
        if share:
            box = slider.bounding_box()
            page.mouse.click(box["x"] + share * box["width"], box["y"] + 0.5 * box["height"])
        elif share is not None:
            page.locator(".time [tabindex='0']").press("ArrowRight")
        soon(lambda: int(slider.get_attribute("aria-valuenow")) in rows, False)
        row = int(slider.get_attribute("aria-valuenow"))
        rows.add(row)
        expected = {body: axes[0] for body, axes in attitudes(bodies, record, np.array([row])).items()}
        soon(lambda axes=expected: off_by(page, axes) < 1e-9, True)
    page.emulate_media(color_scheme="dark")
    page.wait_for_function(GROUND, arg="rgb(30, 36, 43)")
    page.emulate_media(color_scheme="light")
    page.wait_for_function(GROUND, arg="rgb(244, 246, 248)")
    page.wait_for_function(NAMED, arg=len(expected) + 5)  # east, north, up, pole, gravity
    page.set_viewport_size({"width": 390, "height": 844})
    page.wait_for_function(f"count => innerWidth === 390 && ({NAMED})(count)", arg=len(expected) + 5)
    if name == next(iter(MOVING)):  # what stands still is drawn for a second, and then no more
        frames = "getElement(document.querySelector('.scene').id.slice(1)).framesDrawn"
        page.wait_for_function(f"() => {frames} > 0")
        before = at_rest(page, lambda: page.evaluate(frames), 500)
        page.locator(".time [tabindex='0']").press("ArrowRight")
        page.wait_for_function(f"before => {frames} > before", arg=before)


def off_by(page: Any, expected: dict[str, Any]) -> float:
    """Return by how much the axes that are drawn differ from the expected ones; infinity for other bodies."""
    drawn = page.evaluate(DRAWN)
    if set(drawn) != set(expected):
        return np.inf
    return max(float(np.abs(np.array(drawn[b]) - axes).max()) for b, axes in expected.items())
