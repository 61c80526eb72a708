"""Gravity and Earth rate at the site."""

import math

import pytest
from wired import Site

from gyrobench.component import ComponentError
from gyrobench.frames import normal_gravity


def at(**parameters):
    part = Site(**parameters)
    part.initialize()
    return part


def test_normal_gravity_at_equator_pole_and_45_degrees():
    # WGS84 (NIMA TR8350.2): 9.7803253359 and 9.8321849378 m/s2; 45 degrees: 9.80619777 (normal gravity tables)
    assert at(latitude=0.0).g == 9.7803253359
    assert at(latitude=math.pi / 2).g == pytest.approx(9.8321849378, abs=1e-9)
    assert at(latitude=math.pi / 4).g == pytest.approx(9.80619777, abs=1e-8)


def test_same_as_frames_and_boule():
    boule = pytest.importorskip("boule")
    for latitude in (-80.0, -33.0, 12.0, 45.75, 89.0):
        for height in (0.0, 500.0, 2000.0):
            g = at(latitude=math.radians(latitude), height=height).g
            assert g == pytest.approx(normal_gravity(math.radians(latitude), height), rel=1e-15)
            exact = 1e-5 * boule.WGS84.normal_gravity((0.0, latitude, height))
            assert g == pytest.approx(exact, abs=1e-9 + 1.2e-7 * height / 1000.0)


def test_directions():
    part = at(latitude=math.radians(30.0), gravity=9.8, earth_rate=8e-5)
    assert part.f == [0.0, 0.0, 9.8]  # specific force a - G points up at rest
    assert part.omega == pytest.approx([0.0, 8e-5 * math.sqrt(3) / 2, 4e-5], rel=1e-15)
    south = at(latitude=math.radians(-30.0))
    assert south.omega[1] > 0.0 > south.omega[2]


def test_gravity_falls_with_height():
    # free-air gradient -2 g/a (1 + F + m - 2 F sin2) = -3.0877e-6 1/s2 at the equator
    fall = at(latitude=0.0).g - at(latitude=0.0, height=1000.0).g
    assert fall == pytest.approx(1000.0 * 2 * 9.7803253359 / 6378137 * 1.0068026 - 7.2e-7, abs=2e-9)


@pytest.mark.parametrize("gravity", [9.69, 9.91, 1.0])
def test_refuses_gravity(gravity):
    with pytest.raises(ComponentError, match=f"gravity = {gravity:g} m/s2 must lie in 9.7 to 9.9"):
        at(gravity=gravity)


def test_refuses_latitude():
    with pytest.raises(ComponentError, match=r"latitude = 1.6 rad must be <= 1.5708"):
        at(latitude=1.6)
