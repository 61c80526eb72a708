"""Vertical gyro and erection controller: rates, cut-off, false vertical, follow-up ring, by closed forms."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wired import BENCH, Native, Wired

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

VerticalGyro = load_part("vertical_gyro", BENCH)
ErectionController = load_part("erection_controller", BENCH)
Manoeuvre = load_part("manoeuvre", BENCH)
DEG, ARCMIN, G0 = math.pi / 180.0, math.pi / 180.0 / 60.0, 9.80665
H = 0.02
WIRES = [
    ("vehicle.omega", "gyro.omega"),
    ("vehicle.f", "gyro.f"),
    ("gyro.e_x", "erection.e_x"),
    ("gyro.e_y", "erection.e_y"),
    ("gyro.f_inner", "erection.f_inner"),
    ("gyro.turn", "erection.turn"),
    ("erection.T_x", "gyro.T_x"),
    ("erection.T_y", "gyro.T_y"),
]


def row(**first):
    """Tables of the manoeuvre with the first phase filled."""
    return {name: [x] + [0.0] * 98 for name, x in first.items()}


def bench(gyro=None, erection=None, vehicle=None):
    vehicle = {"earth_rate": 0.0, **(vehicle or {})}
    parts = {
        "vehicle": Native("manoeuvre", **vehicle),
        "gyro": Native("vertical_gyro", step=H, **(gyro or {})),
        "erection": Native("erection_controller", step=H, **(erection or {})),
    }
    parts["vehicle"].step = H
    wired = Wired(parts, list(parts), WIRES)
    parts["vehicle"].gate = 1.0  # the manoeuvre begins after the start
    return wired


def true_up(pair):
    pitch, roll, _ = pair.parts["vehicle"].angle
    return up(pitch, roll)


def up(pitch, roll):
    """The vertical in vehicle axes: third column of R2(roll) R1(pitch)."""
    return np.array([-math.sin(roll) * math.cos(pitch), math.sin(pitch), math.cos(roll) * math.cos(pitch)])


def tilt(pair):
    """Angle between the vertical that the gyro shows and the true one, rad."""
    g = pair.parts["gyro"]
    return np.linalg.norm(np.cross(up(g.pitch, g.roll), true_up(pair)))


def run(pair, seconds, watch=None):
    out = []
    for _ in range(round(seconds / H)):
        pair.step(H)
        if watch:
            out.append(watch(pair))
    return out


# ------------------------------------------------------------------------------------------------ erection
def test_time_from_two_degrees_to_the_dead_zone():
    """(2 deg - 10') / (4 deg/min) = 27.5 s, and then it stays at the edge."""
    pair = bench({"tilt": [2.0 * DEG, 0.0]})
    tilts = run(pair, 40.0, tilt)
    assert tilts[0] == pytest.approx(2.0 * DEG, rel=1e-3)
    inside = next(k for k, x in enumerate(tilts) if x < 10.001 * ARCMIN) * H
    assert inside == pytest.approx(27.5, abs=0.03)
    assert max(tilts[1400:]) < 10.01 * ARCMIN


def test_linear_law_decays_with_k():
    """e = e0 exp(-k t) on both axes, k = gain; small tilts."""
    pair = bench({"tilt": [1e-3, -2e-3]}, {"law": 1.0, "gain": 0.05})
    run(pair, 40.0)
    assert tilt(pair) == pytest.approx(math.hypot(1e-3, 2e-3) * math.exp(-2.0), rel=1e-3)


@pytest.mark.long
def test_hang_off_of_the_linear_law_under_earth_rate():
    """Earth rate at 40 deg, k = 0.05 1/s: 3.84 arcmin."""
    pair = bench(None, {"law": 1.0}, {"earth_rate": 7.2921159e-5})
    run(pair, 200.0)
    assert tilt(pair) / ARCMIN == pytest.approx(3.84, abs=0.01)
    pair = bench({"drift": [2e-5, -1e-5]}, {"law": 1.0})
    run(pair, 200.0)
    assert tilt(pair) == pytest.approx(math.hypot(2e-5, 1e-5) / 0.05, rel=1e-3)


def test_torque_about_the_same_axis_only_cones():
    """T = -law along the tilt's own axis: the tilt turns round with k and keeps its size."""
    pair = bench({"tilt": [2e-3, 0.0]}, {"law": 1.0, "cross": 0.0})
    start = np.array([pair.parts["gyro"].e_x, pair.parts["gyro"].e_y])
    run(pair, 2 * math.pi / 0.05 / 4)  # a quarter of a turn
    end = np.array([pair.parts["gyro"].e_x, pair.parts["gyro"].e_y])
    assert np.linalg.norm(end) == pytest.approx(np.linalg.norm(start), rel=1e-3)
    assert abs(start @ end) < 1e-2 * (start @ start)


def test_fast_start():
    """Ten times the rate: from 20 deg to 10' in 29.75 s; at the normal rate it would take ten times as long."""
    pair = bench({"tilt": [0.0, 20.0 * DEG]}, {"fast_time": 40.0})
    tilts = run(pair, 40.0, tilt)
    inside = next(k for k, x in enumerate(tilts) if x < 10.7 * ARCMIN) * H
    assert inside == pytest.approx((20.0 - 1.0 / 6.0) / (40.0 / 60.0), abs=0.1)
    assert pair.parts["erection"].starting == 0.0


# ----------------------------------------------------------------------------------- manoeuvre and cut-off
@pytest.mark.long
def test_acceleration_with_and_without_cut_off():
    """0.2 g for 60 s: 4.0 deg towards the apparent vertical without cut-off (the apparent one 11.3 deg away)."""
    vehicle = row(right=0.2 * G0)
    pair = bench(None, {"cut_off": 0.0}, vehicle)
    run(pair, 60.0)
    assert tilt(pair) / DEG == pytest.approx(4.0, abs=0.01)
    g = pair.parts["gyro"]
    assert g.roll / DEG == pytest.approx(-4.0, abs=0.01)  # the rotor leans to +x: to it the vehicle rolls left
    pair = bench(None, None, vehicle)
    run(pair, 60.0)
    assert pair.parts["erection"].cut == 1.0
    assert tilt(pair) < 1e-9
    run(pair := bench(None, {"cut_off": 0.0, "rate": 0.1}, vehicle), 60.0)
    assert tilt(pair) == pytest.approx(math.atan(0.2) - 10.0 * ARCMIN, abs=1e-3)  # the limit


def test_turn_opens_both_channels():
    """A turn of 3 deg/s at 50 m/s pulls with 0.267 g; cut off by the turn rate alone when a_cut is large."""
    vehicle = {**row(turn=3.0 * DEG), "speed": 50.0}
    pair = bench(None, {"a_cut": 100.0}, vehicle)
    run(pair, 60.0)
    assert pair.parts["erection"].cut == 2.0
    assert tilt(pair) < 1e-9
    g = pair.parts["gyro"]
    assert g.f_inner[0] == pytest.approx(-50.0 * 3.0 * DEG, rel=1e-9)  # towards the left of the turn
    pair = bench(None, {"a_cut": 100.0, "turn_cut": 1.0}, vehicle)
    worst = max(run(pair, 60.0, tilt))
    assert worst > 1.0 * DEG


def test_the_drift_alone_acts_while_cut_off():
    pair = bench({"drift": [0.0, 1e-5]}, None, row(forward=0.2 * G0, right=0.2 * G0))
    run(pair, 100.0)
    assert pair.parts["erection"].cut == 2.0
    assert tilt(pair) == pytest.approx(1e-3, rel=1e-4)


# ------------------------------------------------------------------------------------------ follow-up ring
def attitude_error(pair):
    g = pair.parts["gyro"]
    return np.linalg.norm(np.cross(up(g.pitch, g.roll), true_up(pair)))


def test_full_loop_with_the_ring_shows_pitch_through_360_degrees():
    """36 deg/s for 10 s about x: pitch goes from 0 to 360 deg, roll stays, the rotor keeps the vertical."""
    pair = bench(None, {"turn_cut": 0.01 * DEG}, row(pitch=36.0 * DEG))
    pitch = np.unwrap(run(pair, 10.0, lambda p: p.parts["gyro"].pitch))
    assert pitch[-1] == pytest.approx(2 * math.pi, abs=1e-3)
    assert np.abs(np.diff(pitch) - 36.0 * DEG * H).max() < 1e-3
    assert abs(pair.parts["gyro"].roll) < 1e-9


def test_full_roll():
    pair = bench(None, None, row(roll=60.0 * DEG))
    roll = np.unwrap(run(pair, 6.0, lambda p: p.parts["gyro"].roll))
    # the ring follows with the lag rate / k = 2 deg, which g2 holds
    assert roll[-1] == pytest.approx(2 * math.pi - 60.0 * DEG / 30.0, abs=1e-3)
    assert pair.parts["gyro"].inner == pytest.approx(-60.0 * DEG / 30.0, abs=1e-4)


def test_sign_reversal_beyond_90_degrees():
    """g2 = 1 deg at g3 = 120 deg: with the reversal it dies away as exp(-k |cos g3| t); without, the ring flips."""

    def upset(reversal):
        pair = bench(
            {"tilt": [0.0, 0.0], "reversal": reversal},
            {"cut_off": 0.0, "dead_zone": 3.0, "rate": 1e-9},
            {"start_angle": [60.0 * DEG, 180.0 * DEG, 0.0]},
        )
        g = pair.parts["gyro"]
        # the start put the ring to the vehicle's roll of 180 deg: bring it to the other side, roll 0 and pitch 120 deg
        g.g4 = g.g4 - math.pi + 1.0 * DEG
        before = g.g4
        inner = run(pair, 2.0, lambda p: p.parts["gyro"].inner)
        return before, g.g4, np.array(inner)

    before, after, inner = upset(1.0)
    assert abs(inner[0]) < 0.6 * DEG and abs(inner[-1]) < 1e-9  # sin g2 = sin(1 deg) cos(60 deg) at the start
    assert inner[5] / inner[0] == pytest.approx(math.exp(-30.0 * 0.5 * 5 * H), rel=0.01)
    assert abs(after - before) < 2.0 * DEG
    before, after, inner = upset(0.0)
    assert abs(after - before) / DEG == pytest.approx(180.0, abs=2.0)
    assert np.abs(inner).max() > 25.0 * DEG


@pytest.mark.parametrize("ring", [0.0, 1.0])
def test_measured_angles_are_those_of_the_vehicle(ring):
    """Any attitude below 80 deg of pitch, rotor on the vertical: pitch and roll as the vehicle has them."""
    rng = np.random.default_rng(3)
    for _ in range(10):
        angle = (rng.uniform(-1, 1, 3) * [80 * DEG, 170 * DEG, math.pi]).tolist()
        pair = bench({"ring": ring}, None, {"start_angle": angle})
        g = pair.parts["gyro"]
        assert [g.pitch, g.roll] == pytest.approx(angle[:2], abs=1e-9)
        assert [g.e_x, g.e_y, g.inner] == pytest.approx([0.0] * 3, abs=1e-9)


def test_manoeuvre_is_the_rotation_of_its_rates():
    """Turn in ENU axes, pitch, roll and yaw in vehicle axes, for 2 s, against rotations of scipy; f and omega too."""
    given = {**row(turn=0.3, pitch=-0.5, roll=0.8, yaw=0.4, forward=1.0, right=2.0), "speed": 10.0, "earth_rate": 0.01}
    part = Manoeuvre(**given, start_angle=[0.2, -0.4, 1.1], latitude=0.5)
    part.gate = 1.0
    part.initialize()
    for k in range(2000):
        part.do_step(1e-3 * k, 1e-3)
    # R = exp(turn z t) R0 exp((pitch, roll, yaw) t), R from vehicle to ENU axes
    start = Rotation.from_euler("ZXY", [1.1, 0.2, -0.4])
    r = Rotation.from_rotvec([0, 0, 0.6]) * start * Rotation.from_rotvec([-1.0, 1.6, 0.8])
    heading, pitch, roll = r.as_euler("ZXY")
    assert part.angle == pytest.approx([pitch, roll, heading], abs=1e-9)
    ahead = Rotation.from_euler("Z", heading).apply([2.0 - 10.0 * 0.3, 1.0, 0.0])
    assert part.f == pytest.approx(r.inv().apply(ahead + np.array([0, 0, G0])), abs=1e-9)
    rate = r.inv().apply([0.0, 0.01 * math.cos(0.5), 0.01 * math.sin(0.5) + 0.3]) + np.array([-0.5, 0.8, 0.4])
    assert part.omega == pytest.approx(rate, abs=1e-9)
    part.gate = 0.0
    part._dirty = True
    assert part.get("omega[2]") == pytest.approx(r.inv().apply([0, 0.01 * math.cos(0.5), 0.01 * math.sin(0.5)])[1])


def test_wobble_begins_with_the_gate():
    """A roll rate of 0.5 sin(2 pi 2 s), s since the gate opened at 0.3 s: the roll is 0.5 (1 - cos) / (4 pi)."""
    part = Manoeuvre(**row(roll=0.5, frequency=2.0), earth_rate=0.0)
    part.initialize()
    for k in range(800):
        part.gate = float(k >= 300)
        part.do_step(1e-3 * k, 1e-3)
        s = max(0.0, 1e-3 * (k - 299))
        assert part.omega[1] == pytest.approx(0.5 * math.sin(4.0 * math.pi * s), abs=1e-9)
        assert part.angle[1] == pytest.approx(0.5 * (1.0 - math.cos(4.0 * math.pi * s)) / (4.0 * math.pi), abs=3e-4)


# ------------------------------------------------------------------------------------------------ refusals
def test_lock_without_the_ring_ends_the_run():
    pair = bench({"ring": 0.0}, {"turn_cut": 10.0}, row(pitch=10.0 * DEG))
    with pytest.raises(ComponentError, match=r"the gimbals have locked.*ring = 0.*t = 8\.9"):
        run(pair, 10.0)


def test_acceleration_of_a_manoeuvre_is_the_derivative_of_its_rate():
    """A wobble about all axes in a turn over the turning Earth: central difference over two steps of 1 ms."""
    first = row(turn=0.2, pitch=0.3, roll=-0.5, yaw=0.4, frequency=0.7)
    vehicle = Manoeuvre(start_angle=[0.3, -0.2, 1.0], earth_rate=0.1, **first)
    vehicle.gate = 1.0
    vehicle.initialize()
    rates, told = [], []
    for k in range(1200):
        vehicle.do_step(k * 1e-3, 1e-3)
        rates.append(list(vehicle.omega))
        told.append(list(vehicle.alpha))
    difference = (np.array(rates)[2:] - np.array(rates)[:-2]) / 2e-3
    np.testing.assert_allclose(np.array(told)[1:-1], difference, atol=2e-5)
    assert np.abs(told).max() > 2.0


def test_manoeuvre_that_starts_at_the_vertical_can_be_linearized():
    vehicle = Manoeuvre(start_angle=[90.0 * DEG, 0.0, 0.4])
    vehicle.initialize()
    assert vehicle.angle == pytest.approx([90.0 * DEG, 0.0, 0.4])
    derivatives, outputs = vehicle.tangent({"q[1]": 1.0})
    assert np.all(np.isfinite(derivatives)) and np.all(np.isfinite(outputs))


def test_no_apparent_vertical():
    pair = bench()
    pair.parts["vehicle"].gravity = 4.0
    with pytest.raises(ComponentError, match=r"below 0.5 g: there is no apparent vertical"):
        run(pair, 0.1)


def test_large_tilt_needs_the_fast_start():
    pair = bench({"tilt": [70.0 * DEG, 0.0]})
    with pytest.raises(ComponentError, match=r"leans more than 60 deg .*fast_time"):
        run(pair, 0.1)
    pair = bench({"tilt": [70.0 * DEG, 0.0]}, {"fast_time": 120.0})
    run(pair, 110.0)
    assert tilt(pair) < 11.0 * ARCMIN


@pytest.mark.parametrize(
    "cls, given, message",
    [
        (VerticalGyro, {"H": 0.0}, "H = 0 N.m.s must be > 0"),
        (VerticalGyro, {"ring_rate": -1.0}, "ring_rate = -1 rad/s must be > 0"),
        (ErectionController, {"rate": 0.0}, "rate = 0 rad/s must be > 0"),
        (ErectionController, {"law": 2.0}, "law = 2 1 must be <= 1"),
        (ErectionController, {"fast": 0.5}, "fast = 0.5 1 must be >= 1"),
        (Manoeuvre, {"gravity": 0.0}, "gravity = 0 m/s2 must be > 0"),
    ],
)
def test_refuses(cls, given, message):
    with pytest.raises(ComponentError, match=message):
        cls(**given).initialize()
