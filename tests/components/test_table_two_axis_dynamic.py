"""The two-axis table as it is built: torques of the axes on each other, commands, attitude."""

import math

import numpy as np
import pytest
from native_parts import make
from native_parts import stepped as run

from gyrobench.packaging.instance import InstanceError

ARCSEC = math.pi / 648000.0
ERU = 7.2921159e-5
SOFT = {"outer_law_p": 0.7, "inner_law_p": 0.7}


@pytest.fixture
def table():
    part = make("table_two_axis_dynamic", "native")
    yield part
    part.free()


@pytest.mark.long
def test_the_axes_load_each_other(table):
    """Both turn evenly, D = 4.0 - 0.2 kg.m2: the motors hold against M_x = D x' y' sin 2y = 0.0319 N.m sin 2y and
    M_y = -(D/2) x'2 sin 2y = -0.0122 N.m sin 2y.
    """
    u, v = 0.08, 0.105
    values = {"across[1]": 0.2, "across[2]": 4.0, "outer_axis_J": 5.0, "outer_law_J": 5.0, "mode_x": 2.0, "mode_y": 2.0}
    names = ["angle_y", "torque_x", "torque_y"]
    rows = run(table, 62.0, names, target_x=u, target_y=v, **values, **SOFT)[2000:]
    y = rows[:, 0]
    A = np.column_stack([np.sin(2.0 * y), np.cos(2.0 * y), np.ones_like(y)])
    (sx, cx, _), (sy, cy, _) = (np.linalg.lstsq(A, rows[:, k], rcond=None)[0] for k in (1, 2))
    assert sx == pytest.approx(3.8 * u * v, rel=0.05) and abs(cx) < 0.05 * sx
    assert sy == pytest.approx(-1.9 * u * u, rel=0.1) and abs(cy) < 0.1 * abs(sy)


def test_inertia_of_the_outer_axis_grows_with_the_inner_angle(table):
    """Unbalance switched on by a step of gravity: x'' = M / (J + D sin2 y) before the loop answers (T = 5 ms)."""
    acc = {}
    for y in (0.0, 90.0):
        part = make("table_two_axis_dynamic", "native")
        part.set({"angle0[2]": math.radians(y), "across[2]": 3.0, "outer_axis_unbalance[1]": 0.05})
        part.set({"f_local[3]": 0.0, "f_local[2]": 0.0})
        part.initialize()
        part.set({"f_local[3]": 9.80665})
        for k in range(4):  # the first step takes the load on, the next three turn under it
            part.step(k * 1e-3, 1e-3)
            if k == 0:
                before = part.get(["rate_x"])[0]
        acc[y] = (part.get(["rate_x"])[0] - before) / 3e-3
        part.free()
    # |x''| = 0.05 x 9.80665 / 2.56 at 0 and / (2.56 + 2.4) at 90 degrees
    assert abs(acc[0.0]) == pytest.approx(0.4903325 / 2.56, rel=1e-3)
    assert acc[0.0] / acc[90.0] == pytest.approx((2.56 + 2.4) / 2.56, rel=1e-3)


def test_goes_to_both_angles(table):
    goal = {"target_x": math.radians(20.0), "target_y": math.radians(-35.0)}
    rows = run(table, 8.0, ["angle_x", "angle_y", "in_position", "saturated"], mode_x=1.0, mode_y=1.0, **goal)
    arrived = np.argmax(rows[:, 2] == 1.0) * 1e-3
    assert 6.1 < arrived < 6.6  # 35 deg at 0.1 rad/s: 6.11 s and a ramp of 0.1 s
    assert np.abs(rows[-500:, 0] - goal["target_x"]).max() < ARCSEC
    assert np.abs(rows[-500:, 1] - goal["target_y"]).max() < ARCSEC
    assert not rows[:, 3].any()


def test_stands_against_the_earth_as_the_kinematic_table(table):
    """The rates and forces on the face at rest are those of table_two_axis at the same angles, errors included."""
    same = {"squareness": 0.002, "wobble[1]": 1e-4, "wobble[2]": 2e-4, "f_local[1]": 0.3, "omega_local[2]": 5e-5}
    angles = {"angle0[1]": 0.7, "angle0[2]": -0.4}
    names = [f"{v}[{k}]" for v in ("omega", "f") for k in (1, 2, 3)]
    kinematic = make("table_two_axis", "native")
    expected = run(kinematic, 1e-3, names, **same, **angles)[-1]
    kinematic.free()
    seen = run(table, 1.0, names, **same, **angles)
    off = np.abs(np.mean(seen[-500:], axis=0) - expected)
    assert off[:3].max() < 3e-7 and off[3:].max() < 1.5 * 8.73e-7 * 9.81  # angles to a count or so of 0.18 arcsec
    assert np.abs(expected).max() > 5.0


def test_alpha_is_the_derivative_of_omega(table):
    """Both axes accelerate; omega turns with the plate, so the mean over a step of 0.1 ms is met to h."""
    names = [*(f"omega[{k}]" for k in (1, 2, 3)), *(f"alpha[{k}]" for k in (1, 2, 3))]
    values = {"mode_x": 2.0, "mode_y": 2.0, "target_x": 0.1, "target_y": -0.08}
    rows = run(table, 0.3, names, 1e-4, **values, **SOFT)
    change = np.diff(rows[:, :3], axis=0) / 1e-4
    assert np.abs(change - rows[1:, 3:]).max() < 2e-3 * np.abs(rows[:, 3:]).max()


def test_refuses_a_plate_heavier_than_its_axis(table):
    with pytest.raises(InstanceError, match=r"holds the inertia of the plate about X"):
        run(table, 0.01, ["angle_x"], **{"across[1]": 3.0})
