"""accelerometer_mems against its closed forms, by numpy alone.  [ACCEL-MEMS]"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from wired import Native

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

G0 = 9.80665


def readings(force: Any, h: float = 1e-3, **given: Any) -> np.ndarray:
    """Measured specific force after each step of length h; force (n, 3), held over the steps."""
    temperature = given.pop("temperature", 0.0)
    part = Native("accelerometer_mems", **{"white": 0.0, **given})
    part.f, part.temperature = list(force[0]), temperature
    part.initialize()
    out = np.empty((len(force), 3))
    for k, f in enumerate(force):
        part.f = list(f)
        part.do_step(k * h, h)
        out[k] = part.f_read
    return out


def test_at_rest() -> None:
    """By numpy: a = axes mount f; 1 + scale + scale_T T, square and cubic of a, bias and its temperature."""
    mount = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    axes = np.array([[1.0, 2e-3, -1e-3], [3e-3, 1.0, 0.0], [0.0, -2e-3, 1.0]])
    f, scale, bias, slope = np.array([3.0, -7.0, 5.0]), [1e-3, -2e-3, 3e-3], [0.01, -0.02, 0.03], [1e-4, 2e-4, -3e-4]
    a = axes @ mount @ f
    want = (1.0 + np.array(scale) + 2e-5 * 25.0) * a + 1e-4 * a**2 + 1e-5 * a**3 + bias + 25.0 * np.array(slope)
    got = readings(
        np.tile(f, (5, 1)), mount=mount.tolist(), axes=axes.tolist(), scale=scale, scale_T=2e-5, square=1e-4,
        cubic=1e-5, bias=bias, bias_T=slope, temperature=25.0,
    )  # fmt: skip
    assert got[-1] == pytest.approx(want, rel=1e-12)


def test_filter_has_three_decibels_at_the_bandwidth() -> None:
    """A sine at 40 Hz through 40 Hz: amplitude 1/sqrt 2, 90 degrees late (Butterworth, second order).  Inputs held over
    the step of 0.1 ms come half a step, 0.72 degrees, later: 1 % of the amplitude's two phases."""
    h, w = 1e-4, 2.0 * math.pi * 40.0
    t = h * np.arange(5000)
    got = readings(np.outer(np.sin(w * t), [1.0, 0.0, 0.0]), h, bandwidth=40.0)[2500:, 0]
    late = t[2500:] + h
    in_phase, quadrature = (2.0 * float(np.mean(got * wave)) for wave in (np.sin(w * late), np.cos(w * late)))
    assert math.hypot(in_phase, quadrature) == pytest.approx(1.0 / math.sqrt(2.0), rel=2e-3)
    assert math.degrees(math.atan2(quadrature, in_phase)) == pytest.approx(-90.0 - 0.72, abs=0.2)


def test_a_step_halved_is_the_same_filter() -> None:
    """A force held over each of the longer steps, through 40 Hz: exact at both."""
    force = np.random.default_rng(2).normal(size=(30, 3))
    whole, halved = readings(force, 2e-3, bandwidth=40.0), readings(np.repeat(force, 2, axis=0), 1e-3, bandwidth=40.0)
    assert whole == pytest.approx(halved[1::2], rel=1e-10, abs=1e-12)


def test_vibration_is_rectified() -> None:
    """A vibration of amplitude A about 0: the mean reads square A2/2, far above the bandwidth too."""
    t = 1e-4 * np.arange(20_000)
    f = np.outer(5.0 * np.sin(2.0 * math.pi * 500.0 * t), [0.0, 1.0, 0.0])
    mean = readings(f, 1e-4, square=1.02e-4, bandwidth=50.0)[10_000:].mean(axis=0)
    assert mean[1] == pytest.approx(1.02e-4 * 12.5, rel=0.01)
    assert abs(mean[0]) < 1e-9


def test_white_noise_has_the_density_that_is_shown() -> None:
    """Means of 0.5 s of 300 records of three axes: variance N2/T, chi2 of 900 degrees of freedom, 5 %."""
    part = Native("accelerometer_mems", white=7e-4)
    part.f = [0.0, 0.0, 0.0]
    part.initialize()
    m, h = 250, 2e-3
    means = np.empty((300, 3))
    for j in range(len(means)):
        total = np.zeros(3)
        for k in range(m):
            part.do_step((j * m + k) * h, h)
            total += part.f_read
        means[j] = total / m
    assert np.mean(means**2) * m * h == pytest.approx(part.density**2, rel=0.2)
    assert np.abs(np.corrcoef(means.T) - np.eye(3)).max() < 0.2  # the axes are independent
    assert part.density == 7e-4


def test_range_word_and_output_rate() -> None:
    """A ramp of 1 m/s3 from 0, slow against 400 Hz: a new sample every 20 steps, in steps of 0.01, held at 0.1."""
    t = 1e-3 * np.arange(200)
    got = readings(np.outer(t, [1.0, 0.0, 0.0]), bandwidth=400.0, period=0.02, resolution=0.01, range_max=0.1)[:, 0]
    assert got / 0.01 == pytest.approx(np.rint(got / 0.01), abs=1e-9)
    assert np.flatnonzero(np.diff(got)).size <= 10 and np.all(np.diff(np.flatnonzero(np.diff(got))) == 20)
    assert got.max() == pytest.approx(0.1) and got[100] == pytest.approx(0.1, abs=0.011)
    part = Native("accelerometer_mems", white=0.0, range_max=5.0)
    part.f = [0.0, 0.0, -G0]
    part.initialize()
    part.do_step(0.0, 1e-3)
    assert part.f_read == pytest.approx([0.0, 0.0, -5.0]) and part.saturated == 1.0


def test_random_drift_of_each_axis_is_its_own() -> None:
    still = np.zeros((200, 3))
    walk = readings(still, y_walk=1e-3)
    assert np.ptp(walk[:, 1]) > 0.0 and not walk[:, [0, 2]].any()
    flicker = readings(still, z_flicker=1e-3)
    assert np.ptp(flicker[:, 2]) > 0.0 and not flicker[:, :2].any()
    start = np.concatenate([readings(still[:1], turn_on=1e-3, seed=s)[0] for s in range(100)])
    assert np.std(start) == pytest.approx(1e-3, rel=0.2)  # 4 % standard deviation of it


def test_axes_must_be_unit_vectors() -> None:
    with pytest.raises(ComponentError, match="each row must be a unit vector within 10 %"):
        load_part("accelerometer_mems")(axes=[[2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]).initialize()
