"""The rates of level and north against a local frame by numbers, the track over the ellipsoid, errors, refusals."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from wired import BENCH, begun

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part
from gyrobench.units import EARTH_RATE

Part = load_part("earth_follower", BENCH)
A, E2 = 6378137.0, 0.00669437999014


started = partial(begun, Part)


def vec(part, name):
    return np.array([part.get(f"{name}[{k}]") for k in (1, 2, 3)])


def frame(latitude, longitude):
    """East, north, up as rows, in axes of the Earth."""
    up = np.array([np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude), np.sin(latitude)])
    east = np.array([-np.sin(longitude), np.cos(longitude), 0.0])
    return np.array([east, np.cross(up, east), up])


@pytest.mark.parametrize(("east", "north", "height"), [(200.0, 100.0, 0.0), (-250.0, 150.0, 9e3), (0.0, 0.0, 0.0)])
def test_rate_is_that_of_the_local_frame(east, north, height):
    """Positions on the ellipsoid by differences: the frame turned by the Earth and the track, as a rotation vector."""
    L, h = 0.8, 0.05
    part = started(latitude=L, velocity=[east, north], height=height)

    def at(t, x):
        v = 1.0 - E2 * np.sin(x[0]) ** 2
        across = A / np.sqrt(v)
        return [north / (across * (1.0 - E2) / v + height), east / (np.cos(x[0]) * (across + height))]

    ends = [solve_ivp(at, (0.0, s * h), [L, 0.0], rtol=1e-12, atol=1e-16).y[:, -1] for s in (-1.0, 1.0)]
    before, after = (frame(x[0], x[1] + s * h * EARTH_RATE) for s, x in zip((-1.0, 1.0), ends, strict=True))
    turned = Rotation.from_matrix(before @ after.T).as_rotvec() / (2.0 * h)  # in the axes of the frame
    assert vec(part, "rate") == pytest.approx(turned, rel=1e-6, abs=1e-12)


def test_by_hand():
    """At 45 deg: M = 6367381.8 m, N = 6388838.3 m; 100 m/s north: -1.57051e-5 rad/s; 200 m/s east: 3.13046e-5."""
    part = started(latitude=np.pi / 4.0, velocity=[200.0, 100.0])
    rate = vec(part, "rate")
    assert rate[0] == pytest.approx(-100.0 / 6367381.8, rel=1e-7)
    half = EARTH_RATE * np.sqrt(0.5)
    assert rate[1:] == pytest.approx([half + 200.0 / 6388838.3] * 2, rel=1e-7)  # tan 45 deg = 1


def test_latitude_and_integral_over_an_hour():
    part = started(latitude=0.7, velocity=[150.0, -120.0])
    for k in range(360):
        part.do_step(10.0 * k, 10.0)

    def w(t, x):
        v = 1.0 - E2 * np.sin(x[0]) ** 2
        n = A / np.sqrt(v)
        down = -120.0 * v**1.5 / (A * (1.0 - E2))
        return [
            down,
            -down,
            EARTH_RATE * np.cos(x[0]) + 150.0 / n,
            EARTH_RATE * np.sin(x[0]) + 150.0 * np.tan(x[0]) / n,
        ]

    wanted = solve_ivp(w, (0.0, 3600.0), [0.7, 0.0, 0.0, 0.0], rtol=1e-11, atol=1e-14).y[:, -1]
    assert part.get("at") == pytest.approx(wanted[0], abs=1e-9)
    assert vec(part, "turned") == pytest.approx(wanted[1:], abs=1e-8)


def test_beliefs_quantum_and_extra():
    part = started(latitude=0.7, latitude_error=1e-3, velocity=[0.0, 0.0], velocity_error=[2.0, 0.0], quantum=1e-7)
    part.extra = [1e-3, 0.0, 0.0]
    part._dirty = True
    n = A / np.sqrt(1.0 - E2 * np.sin(0.701) ** 2)
    exact = [0.0, EARTH_RATE * np.cos(0.701) + 2.0 / n, EARTH_RATE * np.sin(0.701) + 2.0 * np.tan(0.701) / n]
    wanted = np.round(np.array(exact) / 1e-7) * 1e-7 + np.array([1e-3, 0.0, 0.0])
    assert vec(part, "command") == pytest.approx(wanted, abs=1e-15)
    assert part.get("rate[2]") == pytest.approx(EARTH_RATE * np.cos(0.7))


def test_refused_near_a_pole():
    part = started(latitude=1.48, velocity=[0.0, 300.0])
    with pytest.raises(ComponentError, match="north has no direction"):
        for k in range(100):
            part.do_step(60.0 * k, 60.0)
    with pytest.raises(ComponentError, match="latitude"):
        started(latitude=1.5)
