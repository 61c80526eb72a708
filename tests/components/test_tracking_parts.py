"""Target, tracker and tracking controller by hand: kinematics, delay, resolution, field of view, limits."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are
from scipy.spatial.transform import Rotation
from wired import BENCH

from gyrobench.component import ComponentError
from gyrobench.linear.part_linearization import jacobians
from gyrobench.packaging import load_part

Target = load_part("moving_target", BENCH)
Tracker = load_part("optical_tracker", BENCH)
Controller = load_part("tracking_controller", BENCH)
H = 1e-3
SINES = {"kind": 1, "rate": [0.2, -0.4], "amplitude": [0.3, 0.5], "frequency": 0.7, "lead": 1.1}


def moved(t: float, **given: Any) -> Any:
    """Return a target that has moved for t s, at once."""
    part = Target(**given)
    part.initialize()
    part.do_step(0.0, t)
    return part


@pytest.mark.parametrize("given", [SINES, {"kind": 2, "distance": 300.0, "velocity": [40.0, -60.0, 15.0]}])
@pytest.mark.parametrize("t", [0.4, 3.1])
def test_rates_are_derivatives_of_the_direction(given: dict[str, Any], t: float) -> None:
    """omega = u x u', alpha its derivative: central differences over 2e-4 s, error h2/6 of the third derivative."""
    d = 1e-4
    before, now, after = (moved(t + x, **given) for x in (-d, 0.0, d))
    u = [np.array(p.direction) for p in (before, now, after)]
    assert np.linalg.norm(u[1]) == pytest.approx(1.0, abs=1e-15)
    assert np.array(now.omega) == pytest.approx(np.cross(u[1], (u[2] - u[0]) / (2 * d)), abs=1e-6)
    slope = (np.array(after.omega) - np.array(before.omega)) / (2 * d)
    assert np.array(now.alpha) == pytest.approx(slope, abs=1e-6)


def test_fly_by_is_fastest_where_it_is_nearest() -> None:
    """500 m past at 100 m/s from 1000 m: nearest after 866 m, 8.66 s; v/d = 0.2 rad/s, no acceleration."""
    part = moved(5.0 * math.sqrt(3.0), kind=2, distance=1000.0, velocity=[50.0, -50.0 * math.sqrt(3.0), 0.0])
    assert np.array(part.omega) == pytest.approx([0.0, 0.0, -0.2], abs=1e-12)
    assert np.array(part.alpha) == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)


def test_target_waits_for_its_phase_and_does_not_fly_through_the_tracker() -> None:
    part = Target(first=3, **SINES)
    part.initialize()
    part.do_step(0.0, 1.0)
    assert part.direction == [0.0, 1.0, 0.0] and part.omega == [0.0, 0.0, 0.0]
    with pytest.raises(ComponentError, match="leads through the tracker"):
        Target(kind=2, velocity=[0.0, -10.0, 0.0]).initialize()


def tracked(count: int, omega: tuple[float, float, float] = (0.0, 0.0, 0.0), at: Any = None, **given: Any) -> list[Any]:
    """Return (miss, error, lost) after each millisecond."""
    part = Tracker(image_noise=0.0, **given)
    part.omega = list(omega)
    if at is not None:
        part.direction = [-math.sin(at(0.0)), math.cos(at(0.0)), 0.0]
    part.initialize()
    found = []
    for k in range(count):
        if at is not None:
            a = at((k + 1) * H)
            part.direction = [-math.sin(a), math.cos(a), 0.0]
        part.do_step(k * H, H)
        found.append((list(part.miss), list(part.error), part.lost))
    return found


def test_place_of_a_fixed_target_in_a_turning_tracker() -> None:
    """A constant rate for 0.3 s against scipy's rotation: s = R(-w t) y."""
    w = np.array([0.3, 0.2, -0.5])
    miss = tracked(300, tuple(w))[-1][0]
    s = Rotation.from_rotvec(-0.3 * w).apply([0.0, 1.0, 0.0])
    assert miss == pytest.approx([math.atan2(s[2], s[1]), math.atan2(-s[0], s[1])], abs=1e-9)


def test_images_are_late_by_exposure_processing_and_hold() -> None:
    """Yaw 0.2 t: exposed 10 to 14 ms, mean 0.2 x 12 ms = 2.4 mrad, there from 14 + 7 = 21 ms to 31 ms."""
    found = tracked(40, at=lambda t: 0.2 * t, period=0.01, exposure=0.004, processing=0.007)
    errors = [e[1] for _, e, _ in found]
    assert errors[20:30] == pytest.approx([2.4e-3] * 10, abs=1e-12)
    assert errors[30] == pytest.approx(4.4e-3, abs=1e-12)


def test_an_instant_is_exposed_without_a_mean() -> None:
    """Without exposure the error is that of the beginning of the frame, 10 ms, there at 10 + 1 + 4 ms."""
    found = tracked(20, at=lambda t: 0.2 * t, period=0.01, exposure=0.0, processing=0.004)
    assert found[14][1][1] == pytest.approx(0.2 * 0.01, abs=1e-12)


def test_pixels_and_field_of_view() -> None:
    """1.23 mrad in pixels of 0.1 mrad is 1.2; 6 mrad is outside of +-5 mrad: no error, lost."""
    given = {"period": 0.01, "exposure": 0.004, "processing": 0.002, "pixel": 1e-4, "field": 0.01}
    seen = tracked(10, at=lambda t: 1.23e-3, **given)[-1]
    assert seen[1][1] == pytest.approx(1.2e-3, abs=1e-15) and seen[2] == 0.0
    lost = tracked(10, at=lambda t: 6e-3, **given)[-1]
    assert lost[1] == [0.0, 0.0] and lost[2] == 1.0


def test_noise_of_the_images() -> None:
    """400 images: rms of each axis 3e-5 within 5 of its standard deviations, 1/sqrt(800)."""
    part = Tracker(image_noise=3e-5, period=0.003, exposure=0.001, processing=0.002)
    part.initialize()
    values = []
    for k in range(1200):
        part.do_step(k * H, H)
        if part.images > len(values):
            values.append(list(part.error))
    rms = np.sqrt(np.mean(np.square(values), axis=0))
    assert rms == pytest.approx([3e-5, 3e-5], rel=5 / math.sqrt(800))
    assert abs(np.corrcoef(np.array(values).T)[0, 1]) < 5 / math.sqrt(400)


@pytest.mark.parametrize("f", [1.0, 5.0, 11.0])
def test_linear_model_is_delay_and_averages(f: float) -> None:
    """T = 2 + 10 + 5 ms; up to f T = 0.19 within 0.3 % and 0.1 degrees."""
    part = Tracker(period=0.01, exposure=0.004, processing=0.01)
    part.initialize()
    a, b, c, d = jacobians(part, ["direction[3]"], ["error[1]"])
    s = 2j * math.pi * f
    got = complex((c @ np.linalg.solve(s * np.eye(len(a)) - a, b) + d)[0, 0])
    want = np.exp(-s * 0.017) * np.sinc(f * 0.01) * np.sinc(f * 0.004)
    assert got / want == pytest.approx(1.0, abs=0.004)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"exposure": 0.02}, "longer than period"),
        ({"processing": 0.08}, "more than 7 images"),
        ({"processing": 0.0105}, "processing = 0.0105 s must be whole communication steps"),
        ({"exposure": 0.001, "processing": 0.001}, "three communication steps or more"),
    ],
)
def test_impossible_images_are_refused(given: dict[str, float], message: str) -> None:
    with pytest.raises(ComponentError, match=message):
        tracked(1, **given)


def test_controller_by_hand() -> None:
    """u = 2 mrad for 0.5 s: K (1 + 0.5 w_i) u = 8 x 2 x 2 mrad = 32 mV, with the minus."""
    part = Controller(K=8.0, integral=2.0)
    part.initialize()
    part.u = 2e-3
    for k in range(500):
        part.do_step(k * H, H)
    assert part.v == pytest.approx(-0.032, abs=1e-12) and part.saturated == 0.0


def test_controller_keeps_its_rate_and_acceleration() -> None:
    """80 mV are wanted at once: 2 V/s give 2 mV in each millisecond, up to 50 mV; the integral waits there."""
    part = Controller(K=8.0, integral=2.0, v_max=0.05, slope_max=2.0)
    part.initialize()
    part.u = -0.01
    values = []
    for k in range(60):
        part.do_step(k * H, H)
        values.append(part.v)
        assert part.saturated == 1.0
    assert np.diff(values[:20]) == pytest.approx(2e-3, abs=1e-12)
    assert values[-1] == pytest.approx(0.05) and part.sum == 0.0


def ahead_of(order: int, w: float, T: float, s: Any) -> Any:
    """Return x + T v + T2 a/2 of the filter with gains l, by its matrices: (c + T e + ..)(s - A + l c)^-1 l."""
    n = order + 1
    gains = np.array([[math.sqrt(2.0) * w, w * w], [2 * w, 2 * w * w, w**3]][order - 1])
    A = np.diag(np.ones(n - 1), 1)
    A[:, 0] -= gains
    row = np.array([1.0, T, T * T / 2.0])[:n]
    return np.array([row @ np.linalg.solve(x * np.eye(n) - A, gains) for x in s])


@pytest.mark.parametrize("order", [1, 2])
def test_prediction_over_the_delay(order: int) -> None:
    """Delay, averages and filter in a row, up to f T = 0.13; up to s (order 2: s2) the delay's own row is undone."""
    w, T = 60.0, 0.017
    part = Tracker(image_noise=0.0, order=order, ahead=T, bandwidth=w)
    part.initialize()
    A, B, C, D = jacobians(part, ["direction[1]"], ["error[2]"])
    f = np.array([0.05, 0.3, 1.0, 3.0, 8.0])
    s = 2j * np.pi * f
    got = np.array([-(C @ np.linalg.solve(x * np.eye(len(A)) - A, B) + D)[0, 0] for x in s])
    images = np.exp(-T * s) * np.sinc(0.01 * f) * np.sinc(0.004 * f)
    assert got == pytest.approx(images * ahead_of(order, w, T, s), rel=1e-3)
    assert abs(got[0] - 1.0) < 3.0 * (abs(s[0]) / w) ** (order + 1) + 1e-6  # and the averages


@pytest.mark.parametrize("order", [1, 2])
def test_filter_of_the_prediction_is_that_of_the_tracking_index(order: int) -> None:
    """Discrete Kalman gains of an index of 1e-4 by the Riccati equation, Kalata's model (the derivative of `order` + 1
    is white, constant in an image): alpha = l1 period, beta = l2 period2 within some roots of the index, 2 and 8 %.
    """
    index, period = 1e-4, 0.01
    n = order + 1
    F = np.array([[1.0, period, period**2 / 2], [0.0, 1.0, period], [0.0, 0.0, 1.0]])[:n, :n]
    G = np.array([[period**2 / 2], [period], [1.0]])[:n]
    H = np.eye(1, n)
    Q = G @ G.T * (index / period**2) ** 2  # rms over the noise of an image, 1
    M = solve_discrete_are(F.T, H.T, Q, np.eye(1))
    found = (M @ H.T / (H @ M @ H.T + 1.0)).ravel()
    w = index ** (1.0 / n) / period
    gains = [[math.sqrt(2.0) * w, w * w], [2 * w, 2 * w * w, w**3]][order - 1]
    assert found == pytest.approx(np.array(gains) * period, rel={1: 0.02, 2: 0.08}[order])


def test_a_predicted_error_follows_a_constant_rate() -> None:
    """Yaw 0.02 t, from rest: after 8/w the filter gives the true error, but for what the hold makes, half a frame."""
    part = Tracker(image_noise=0.0, order=1, ahead=0.017, bandwidth=60.0)
    part.initialize()
    errors = []
    for k in range(300):
        a = 0.02 * (k + 1) * H
        part.direction = [-math.sin(a), math.cos(a), 0.0]
        part.do_step(k * H, H)
        errors.append(part.error[1] - part.miss[1])
    assert np.mean(errors[-100:]) == pytest.approx(0.0, abs=0.02 * 0.3e-3)
    assert np.max(np.abs(errors[-100:])) < 0.02 * 5e-3


def test_recorded_path_is_met_and_smooth() -> None:
    """Five points: each is met, the rates are the derivative of the direction, and it rests behind the last."""
    t, path = [0.0, 1.0, 1.5, 2.5, 4.0], [[0.0, 0.0], [0.1, 0.2], [0.15, 0.1], [0.3, 0.4], [0.2, 0.5]]
    part = Target(kind=3, points=5)
    for k in range(5):
        part.set(f"path_t[{k + 1}]", t[k])
        for j in (0, 1):
            part.set(f"path[{k + 1},{j + 1}]", path[k][j])
    part.initialize()
    u, w, alpha = [], [], []
    for k in range(4500):
        u.append(list(part.direction))
        w.append(list(part.omega))
        alpha.append(list(part.alpha))
        part.do_step(k * H, H)
    for time, (a, b) in zip(t, path, strict=True):
        direction = [-math.sin(b) * math.cos(a), math.cos(b) * math.cos(a), math.sin(a)]
        assert u[round(time / H)] == pytest.approx(direction, abs=1e-12)
    slope = (np.array(u)[2:] - np.array(u)[:-2]) / (2 * H)
    assert np.cross(np.array(u)[1:-1], slope) == pytest.approx(np.array(w)[1:-1], abs=1e-5)
    assert (np.array(w)[2:] - np.array(w)[:-2]) / (2 * H) == pytest.approx(np.array(alpha)[1:-1], abs=0.02)
    assert w[-1] == [0.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("points", "times", "message"),
    [
        (2, [0.0, 1.0], "3 points or more"),
        (3, [0.0, 1.0, 1.0], "time of point 3 is not after"),
        (3, [1.0, 2.0, 3.0], "0"),
    ],
)
def test_impossible_paths_are_refused(points: int, times: list[float], message: str) -> None:
    part = Target(kind=3, points=points)
    for k, t in enumerate(times, 1):
        part.set(f"path_t[{k}]", t)
    with pytest.raises(ComponentError, match=message):
        part.initialize()
