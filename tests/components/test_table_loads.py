"""Loads of a table axis: air bearing, slip rings with their follower."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from wired import BENCH

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

Bearing, Rings = (load_part(n, BENCH) for n in ("bearing_air", "slipring_follower"))
GCM = 9.80665e-5
DEG = math.pi / 180.0


# ---------------------------------------------------------------------------------------- air bearing
def test_viscous_torque_of_the_example():
    """BEARING-AIR: D = 2 r2 = 25 cm, r1 7.5 cm, L 15.8 cm, gaps 0.02 cm, 1 deg/s: 4.261e-2 g.cm; at 20 um 0.426."""
    for gap, expected in ((2e-4, 4.261e-2), (2e-5, 0.4261)):
        part = Bearing(air_gap=gap, air_thrust_gap=gap)
        part.initialize()
        part.rate = DEG
        part.do_step(0.0, 1e-3)
        assert pytest.approx(expected, rel=1e-3) == -part.M / GCM
        assert part.wide_gap == (gap > 1e-4)


def test_eccentricity_and_added_torque():
    """mu pi D3 L / (4 h) = 1.837e-5 pi 0.25^3 0.158 / 8e-5 = 1.7809e-3 N.m.s/rad, times 1.1547 at 0.5."""
    drags = []
    for eps in (0.0, 0.5):
        part = Bearing(air_eccentricity=eps)
        part.initialize()
        part.rate, part.torque = 2.0, 0.5
        part.do_step(0.0, 1e-3)
        assert pytest.approx(0.5 - 2.0 * part.air_drag, rel=1e-14) == part.M
        drags.append(part.air_drag)
    journal = 1.837e-5 * math.pi * 0.25**3 * 0.158 / 8e-5
    assert drags[1] - drags[0] == pytest.approx(journal * (1.0 / math.sqrt(0.75) - 1.0), rel=1e-9)
    faces = 1.837e-5 * math.pi * (0.125**4 - 0.075**4) / 2e-5
    assert drags[0] == pytest.approx(journal + faces, rel=1e-12)


def test_vortex_torque_acts_at_rest_and_is_drawn_at_each_start():
    """At rest it is all of M; on either sense it is the same, so half the sum of both is M_2 and drag drops out.

    Of 400 starts the mean is within 4 sigma/20 of the constant, the scatter within 4 sigma/sqrt(800).
    """
    part = Bearing(air_vortex=-0.003)
    part.initialize()
    torques = []
    for rate in (0.0, 2.0, -2.0):
        part.rate = rate
        part.do_step(0.0, 1e-3)
        torques.append(part.M)
    assert torques[0] == -0.003 and 0.5 * (torques[1] + torques[2]) == pytest.approx(-0.003, rel=1e-12)
    starts = []
    for seed in range(400):
        part = Bearing(air_vortex=-0.003, air_vortex_scatter=0.002, seed=seed)
        part.initialize()
        part.do_step(0.0, 1e-3)
        part.do_step(1e-3, 1e-3)
        starts.append(part.M)
    assert np.mean(starts) == pytest.approx(-0.003, abs=4.0 * 0.002 / 20.0)
    assert np.std(starts) == pytest.approx(0.002, abs=4.0 * 0.002 / math.sqrt(800.0))


def test_unbalance_by_elevation():
    """20 kgf, 0.05 cm: 966 g.cm at 15 deg of elevation, 707 at 45 deg, nothing for a vertical axis (ET8); up is the top
    of the hill: from the angle at which the offset points up the torque drives on.
    """
    for elevation, expected in ((15.0, 965.9), (45.0, 707.1), (90.0, 0.0)):
        part = Bearing(air_unbalance=0.01, air_elevation=elevation * DEG, air_unbalance_angle=0.2)
        part.initialize()
        torques = []
        for x in np.linspace(0.0, 2.0 * math.pi, 361):
            part.angle = float(x)
            part.do_step(0.0, 1e-3)
            torques.append(part.M / GCM)
        assert max(torques) == pytest.approx(expected, abs=0.1)
        assert torques[30] == pytest.approx(expected * math.sin(30.0 * DEG - 0.2), abs=0.1)


# ----------------------------------------------------------------------------------- slip-ring follower
def turning(rate, h=1e-3, time=4.0, **parameters):
    """Return (M, eps) after each step of a table that turns: at a rate, or by a function t -> (angle, rate)."""
    motion = rate if callable(rate) else lambda t: (rate * t, rate)
    part = Rings(**parameters)
    part.angle, part.rate = motion(0.0)
    part.initialize()
    rows = []
    for k in range(round(time / h)):
        part.angle, part.rate = motion(k * h)
        part.do_step(k * h, h)
        rows.append((part.M, part.eps))
    return np.array(rows)


@pytest.mark.parametrize("rate", [1e-3, -0.01, 1.0])
def test_follower_passes_on_its_share_of_the_friction(rate):
    """k_w / (K_s + k_w) = 30 / 330 of 1400 g.cm: 127 g.cm, against the rotation, at any rate: no lag with the rate."""
    rows = turning(rate, time=3.0 if rate == 1e-3 else 1.0)
    assert -rows[-1, 0] / GCM * np.sign(rate) == pytest.approx(1397.0 * 30.0 / 330.0, rel=1e-3)
    assert rows[-1, 1] == pytest.approx(0.137 / 330.0 * np.sign(rate), rel=1e-3)


def test_rings_on_the_axis_give_it_all_their_friction():
    assert turning(0.01, time=0.5, ring_follower=0)[-1, 0] == pytest.approx(-0.137, rel=1e-9)
    assert turning(-0.01, time=0.5, ring_follower=0)[-1, 0] == pytest.approx(0.137, rel=1e-9)


@pytest.mark.long
def test_follower_beside_a_differential_equation():
    """A table that swings: the shaft sticks and slides; winding, friction and leads as differential equations."""
    J, K, d, mc, reach = 0.02, 330.0, 4.0, 0.137, 1e-4

    def motion(t):
        return 2e-3 * math.sin(9.0 * t), 18e-3 * math.cos(9.0 * t)

    def slope(t, s):
        y, v, z = s
        x, rate = motion(t)
        return [v, (K * (x - y) + d * (rate - v) - mc / reach * z) / J, v - abs(v) * z / reach]

    at = np.arange(1, 11) * 0.1
    start = [0.0, 18e-3, reach]  # it slides at the start
    s = solve_ivp(slope, (0.0, 1.0), start, "Radau", t_eval=at, rtol=1e-8, atol=1e-12, max_step=1e-3).y
    expected = np.array([motion(t)[0] for t in at]) - s[0]
    rows = turning(motion, h=5e-4, time=1.0)
    assert np.max(np.abs(rows[np.round(at / 5e-4).astype(int) - 1, 1] - expected)) < 2e-3 * np.max(np.abs(expected))


def test_stiff_leads_are_flagged():
    for k_w, flag in ((30.0, 0.0), (34.0, 1.0)):
        part = Rings(ring_k_w=k_w)
        part.initialize()
        assert part.stiff_leads == flag


@pytest.mark.parametrize(
    ("part", "values", "text"),
    [
        (Bearing, {"air_gap": 0.0}, "air_gap = 0"),
        (Bearing, {"air_eccentricity": 1.0}, "air_eccentricity = 1"),
        (Bearing, {"air_inner": 0.2}, "air_outer = 0.125 m must be above air_inner = 0.2 m"),
        (Rings, {"ring_K_s": 0.0}, "ring_K_s = 0"),
    ],
)
def test_what_is_refused(part, values, text):
    with pytest.raises(ComponentError, match=text):
        part(**values).initialize()


def test_leads_end_the_run_at_their_travel():
    with pytest.raises(ComponentError, match=r"rad from the table, ring_travel is 0\.1 rad"):
        turning(lambda t: (5.0 * t * t, 10.0 * t), ring_K_s=1.0, ring_k_w=0.1, ring_K_d=0.01)
