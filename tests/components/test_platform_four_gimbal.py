"""The four-gimbal platform: where its servo keeps it, where not, launch, refusals [PLATFORM-4GIMBAL]."""

import math

import numpy as np
import pytest
from gimbals import DEG, Four, base_rate, fly, platform_in_base
from test_platform_three_gimbal import roll_then_yaw
from wired import Native

from gyrobench.component import ComponentError

PART = "platform_four_gimbal"
VERTICAL = {"theta_0[1]": math.pi / 2}
SEC, SIGN, ONE = 0, 1, 2


def travel(out):
    return np.ptp(out["theta_4"]) / DEG


def worst(out):
    return np.max(out["error"]) / DEG


def inner(out):
    return np.max(np.abs(out["theta"][:, 1])) / DEG


def loop(t):
    """Pitch 0 to 180 deg at 36 deg/s with 1 deg/s of roll and yaw."""
    return base_rate(roll=1.0, pitch=36.0 * (t < 4.9999), yaw=1.0)


def wobble(t):
    return base_rate(yaw=3.0 * math.sin(2 * math.pi * 0.3 * t))


def over(t):
    """From the vertical: pitch over by 90 deg at 18 deg/s, roll 90 deg, yaw 50 deg; 0.5 deg/s of yaw all along."""
    return base_rate(roll=36.0 * (4.9999 < t < 7.4999), pitch=-18.0 * (t < 4.9999), yaw=0.5 + 20.0 * (t > 7.4999))


# ----------------------------------------------------------------------------------------- kinematics
def test_fourth_gimbal_moves_the_inner_ones_as_derived():
    """Platform held: [a_3 a_2 a_1] g' = -a_4 g4' with the axes as columns; at g2 = 0: g2' = -cos g3 g4'."""
    rng = np.random.default_rng(9)
    for n in range(30):
        g, g4 = rng.uniform(-1.0, 1.0, 3), rng.normal()
        g[1] = 0.0 if n < 10 else g[1]
        part = Four(gain=ONE, k=1e3, rate_max=1e3, theta_0=[g[0], g[1] + (1e-9 if n < 10 else 0.0), g[2]], theta_4_0=g4)
        part.initialize()
        part.flow()
        columns, c = [], platform_in_base(g, 1, g4)
        for k in range(4):
            d = 1e-6 * np.eye(4)[k]
            small = platform_in_base(g + d[:3], 1, g4 + d[3]) - platform_in_base(g - d[:3], 1, g4 - d[3])
            small = small @ c.T / 2e-6
            columns.append([small[2, 1], small[0, 2], small[1, 0]])
        a = np.array(columns).T
        hand = np.linalg.solve(a[:, :3], -a[:, 3])
        np.testing.assert_allclose(np.array(part.der.q) / part.der.q4, hand, rtol=1e-5, atol=1e-6)
        if n < 10:
            assert hand[1] == pytest.approx(-math.cos(g[0]), rel=1e-6)


@pytest.mark.parametrize("g3", [0.0, 60.0, 120.0, 180.0])
@pytest.mark.parametrize("gain", [SEC, SIGN, ONE])
def test_sign_of_the_null(g3, gain):
    """g2' = -k G cos g3 g2: the null holds with secant and sign everywhere, with gain 1 for cos g3 > 0 only."""
    part = Four(gain=gain, theta_0=[g3 * DEG, 0.01, 0.2])
    part.initialize()
    for k in range(100):
        part.do_step(k * 1e-3, 1e-3)
    strength = {SEC: 1.0, SIGN: abs(math.cos(g3 * DEG)), ONE: math.cos(g3 * DEG)}[gain]
    assert part.theta[1] == pytest.approx(0.01 * math.exp(-30.0 * strength * 0.1), rel=0.03)
    assert np.linalg.norm(part.attitude) < 1e-9


# -------------------------------------------------------------------------------------------- flights
@pytest.mark.parametrize("gain", [SEC, SIGN])
def test_roll_to_90_then_yaw(gain):
    """Three gimbals lose the 50 deg; four: error < 1e-4 deg, inner roll <= 1.2 deg."""
    out = fly(PART, roll_then_yaw, 8.0, gain=gain)
    assert worst(out) < 1e-4 and inner(out) < 1.21
    assert out["theta_4"][-1] / DEG == pytest.approx(-90.0, abs=0.1)
    assert not out["lock"].any() and not out["saturated"].any()


@pytest.mark.long
def test_full_roll_and_full_loop_with_the_sign():
    """360 deg of roll, then 360 deg of pitch through both verticals: kept; the vertical is reported."""
    out = fly(PART, lambda t: base_rate(roll=72.0 * (t < 5), pitch=72.0 * (t >= 5), yaw=0.5), 10.0, gain=SIGN)
    assert worst(out) < 1e-4
    steep = np.abs(np.cos(out["theta"][:, 0])) < math.sin(5 * DEG)
    assert np.array_equal(out["lock"], steep.astype(float)) and steep.any() and not steep.all()


def test_beyond_90_degrees_of_pitch():
    """Start g2 = 1 deg at g3 = 120 deg: secant and sign keep ring 4 within 2 deg, constant 1 turns it over by 180 deg
    while g2 swings to 30 deg."""
    start = {"theta_0[1]": 2.1, "theta_0[2]": DEG}
    for gain in (SEC, SIGN):
        out = fly(PART, lambda t: base_rate(), 2.0, gain=gain, **start)
        assert travel(out) < 2.0 and worst(out) < 1e-6
    out = fly(PART, lambda t: base_rate(), 2.0, gain=ONE, allow_vertical=1, **start)
    assert travel(out) == pytest.approx(178.0, abs=1.0) and inner(out) == pytest.approx(30.0, abs=1.0)


@pytest.mark.parametrize(
    "gain, moved, error, swing", [(SEC, 182.0, 0.32, None), (ONE, 182.0, 1.31, 12.3), (SIGN, 41.0, 0.003, None)]
)
@pytest.mark.long
def test_crossing_pitch_90(gain, moved, error, swing):
    """At 36 deg/s with 1 deg/s of roll and yaw.  With the sign the error is below PLATFORM-4GIMBAL's."""
    out = fly(PART, loop, 10.0, gain=gain, allow_vertical=1)
    assert travel(out) == pytest.approx(moved, rel=0.02)
    assert worst(out) < 2 * error and (gain == SIGN or worst(out) > error / 2)
    assert swing is None or inner(out) == pytest.approx(swing, rel=0.02)


@pytest.mark.long
def test_vertical_launch_active_or_locked():
    """3 deg of yaw wobble at the vertical: the active servo runs 90 deg for nothing, locked it stands, g2 follows."""
    active = fly(PART, wobble, 10.0, gain=SEC, allow_vertical=1, **VERTICAL)
    assert travel(active) == pytest.approx(90.0, abs=2.0) and inner(active) < 0.6 and worst(active) < 1e-4
    locked = fly(PART, wobble, 10.0, gain=SEC, launch=1, **VERTICAL)
    assert travel(locked) == 0.0 and locked["lock"].all() and worst(locked) < 1e-4
    assert inner(locked) == pytest.approx(3.0 * 2 / (2 * math.pi * 0.3), rel=1e-3)  # the wobble's swing, 3.18 deg


@pytest.mark.long
def test_launch_sequence():
    """Locked until the pitch has left the vertical, then roll 90, yaw 50: < 0.001 deg; three gimbals lose > 2 deg."""
    out = fly(PART, over, 10.0, gain=SEC, launch=1, **VERTICAL)
    assert worst(out) < 1e-3
    released = out["t"][np.argmax(out["lock"] == 0.0)]
    assert released == pytest.approx(10.0 / 18.0, abs=2e-3)  # 80 deg at 18 deg/s
    three = fly("platform_three_gimbal_2dof", over, 10.0, mount=1, allow_lock=1, **VERTICAL)
    assert worst(three) > 2.0


def test_lock_input_holds_and_releases():
    hold = lambda t: {"lock_4": float(t < 1.0)}  # noqa: E731
    out = fly(PART, lambda t: base_rate(roll=4.0 * (t < 0.9999)), 1.5, inputs=hold, gain=SEC)
    before = out["t"] <= 1.0
    assert np.all(out["theta_4"][before][1:] == out["theta_4"][1]) and np.all(out["lock"][before][2:] == 1.0)
    assert out["theta"][before][-1, 1] / DEG == pytest.approx(-4.0, abs=0.02)
    assert abs(out["theta"][-1, 1]) < 1e-6 and worst(out) < 1e-6  # ring 4 has taken the roll over


# ------------------------------------------------------------------------------------------- refusals
def flight(rate, steps=3000, **parameters):
    part = Native("platform_four_gimbal", **{n: x for n, x in parameters.items() if n != "lock_4"})
    part.lock_4 = parameters.get("lock_4", 0.0)
    part.omega_b = rate.tolist()
    part.initialize()
    for k in range(steps):
        part.do_step(k * 1e-3, 1e-3)


@pytest.mark.parametrize(
    "rate, parameters, message",
    [
        (
            base_rate(roll=36),
            {"lock_4": 1.0},
            r"inner roll is -1\.047\d* rad, at its stop 1\.0472 rad.*\(t = 1\.667 s\)",
        ),
        (
            base_rate(),
            {"launch": 1, "theta_0": [0.2, 0.1, 0.0]},
            r"inner roll is 0\.1 rad: the fourth gimbal is released",
        ),
        (base_rate(pitch=36), {}, r"pitch 1\.4\d+ rad is within 5 deg of 90 deg, where gain = 0 turns.*\(t = 2\.36"),
        (base_rate(pitch=36), {"gain": 2}, "where gain = 2 turns the fourth gimbal over: lock it, take gain = 1"),
        (base_rate(), {"theta_0": [0.0, 1.1, 0.0]}, r"theta_0\[2\] = 1\.1 rad must be within the stop"),
        (base_rate(), {"cap": 0.5}, "parameter cap = 0.5 1 must be >= 1"),
        (base_rate(), {"lag": 5e-4}, r"step = 0\.001 s must be <= lag = 0\.0005 s"),
    ],
)
def test_refusals(rate, parameters, message):
    with pytest.raises(ComponentError, match=message):
        flight(rate, **parameters)
