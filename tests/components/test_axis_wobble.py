"""Wobble of a table axis: attitude, rate and its integral, nothing at amplitude 0."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wired import BENCH

from gyrobench.packaging import load_part

AxisWobble = load_part("axis_wobble", BENCH)
H = 1e-3


def expected(axis, q):
    """R_m(q2) R_j(q1), passive, j and m after ``axis`` (from 1)."""
    e = np.eye(3)
    j, m = e[axis % 3], e[(axis + 1) % 3]
    return (Rotation.from_rotvec(-q[1] * m) * Rotation.from_rotvec(-q[0] * j)).as_matrix()


@pytest.mark.parametrize("axis", [1, 2, 3])
def test_attitude_and_rate(axis):
    """omega is the rate of the attitude: its matrix, step by step, is that of the mean rate to second order in H."""
    r, n, p = 0.02, 3, 0.4
    part = AxisWobble(axis=axis, amplitude=r, order=n, phase=p)
    rng = np.random.default_rng(axis)
    f, w = rng.normal(size=3) * 5.0, rng.normal(size=3) * 1e-4
    part.angle = 0.7
    part.initialize()
    part.f_base, part.omega_base = list(f), list(w)
    before = expected(axis, (r * math.cos(n * 0.7 + p), r * math.sin(n * 0.7 + p)))
    for k in range(20):
        part.angle = 0.7 + 0.3 * (k + 1) * H
        part.do_step(k * H, H)
        a = n * part.angle + p
        now = expected(axis, (r * math.cos(a), r * math.sin(a)))
        assert np.allclose(part.f, now @ f, atol=1e-14)
        # turned in inertial space by the base (w) and by the wobble: rotation vector of now before' in the new axes
        turn = Rotation.from_matrix(now @ before.T).as_rotvec()
        assert np.allclose(np.array(part.omega) * H, -turn + now @ w * H, atol=2e-8)
        before = now
    assert np.linalg.norm(part.omega) > 0.01  # r n 0.3 = 0.018 rad/s


def test_integral_of_the_rate_is_the_wobble():
    """A small wobble: the cross components add up to q1, q2 at the end less those at the start, however coarse h is."""
    r = 1e-5
    part = AxisWobble(axis=3, amplitude=r, order=2)
    part.initialize()
    total = np.zeros(3)
    for k in range(7):
        part.angle = 0.25 * (k + 1)
        part.do_step(0.1 * k, 0.1)
        total += np.array(part.omega) * 0.1
    # axis 3: j = 1 (q1, cos from r to r cos 3.5), m = 2 (q2, sin from 0 to r sin 3.5); products of both are r2
    assert total[0] == pytest.approx(r * (math.cos(3.5) - 1.0), rel=1e-4)
    assert total[1] == pytest.approx(r * math.sin(3.5), rel=1e-4)
    assert abs(total[2]) < 10.0 * r * r


def test_nothing_without_amplitude():
    part = AxisWobble()
    part.initialize()
    part.angle, part.f_base, part.omega_base = 1.0, [1.0, 2.0, 3.0], [4e-5, 5e-5, 6e-5]
    part.do_step(0.0, H)
    assert list(part.f) == [1.0, 2.0, 3.0] and list(part.omega) == [4e-5, 5e-5, 6e-5]
