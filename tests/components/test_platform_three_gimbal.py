"""The kinematic three-gimbal platform: lock table, both mounts, servos, limits, lock with time and angle."""

import math

import numpy as np
import pytest
from gimbals import DEG, Three, base_rate, fly, platform_in_base

from gyrobench.component import ComponentError
from gyrobench.linear.part_linearization import state_space


def stepped(inputs=None, h=1e-6, **parameters):
    """After one short step, so that the rates are those of these inputs."""
    part = Three(**parameters)
    for n, x in (inputs or {}).items():
        setattr(part, n, [float(e) for e in x])
    part.initialize()
    part.do_step(0.0, h)
    return part


@pytest.mark.parametrize("mount", [0, 1])
@pytest.mark.parametrize(
    "angle, rate", [(0.0, 1.0), (60.0, 2.0), (80.0, 5.76), (89.0, 57.3), (89.9, 573.0), (-60.0, 2.0)]
)
def test_lock_table(mount, angle, rate):
    """Unit base rate along the normal of the ring plane (of middle and inner axis): largest gimbal rate 1 / cos m."""
    theta = [0.0, 0.0, 0.3]
    theta[mount] = angle * DEG  # mount 0: pitch in the middle
    middle = platform_in_base(np.array([theta[0], theta[1], 0.0]), mount)  # columns: axes of the middle gimbal
    normal = middle[:, 1] if mount == 0 else middle[:, 0]
    part = stepped({"omega_b": normal}, mount=mount, theta_0=theta, rate_max=1e4)
    assert np.max(np.abs(part.theta_dot)) == pytest.approx(rate, rel=2e-3)
    assert part.condition == pytest.approx(1.0 / math.cos(angle * DEG), rel=1e-4)
    assert part.lock == float(abs(angle) > 85.0)
    assert part.omega == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)


@pytest.mark.parametrize("mount", [0, 1])
def test_gimbal_rates_solve_the_kinematics(mount):
    """[a_o a_m a_i] q' = T1 s - omega_b with the axes as columns; det = cos m up to sign for every o and i."""
    rng = np.random.default_rng(5)
    for _ in range(30):
        theta, wb, v = rng.uniform(-1.2, 1.2, 3), rng.normal(size=3), rng.normal(size=3)
        part = Three(mount=mount, theta_0=theta.tolist(), rate_max=1e4, lag=1.0, step=1e-3)
        part.omega_b = wb.tolist()
        part.initialize()
        part.s = v.tolist()
        part.flow()
        c = platform_in_base(theta, mount)
        nothing = np.zeros(3)
        columns = np.zeros((3, 3))
        for k in range(3):  # axis of joint k: what a small turn of it does to the platform, in base axes
            more = theta + 1e-6 * np.eye(3)[k]
            less = theta - 1e-6 * np.eye(3)[k]
            small = (platform_in_base(more, mount) - platform_in_base(less, mount)) @ c.T / 2e-6
            columns[:, k] = [small[2, 1], small[0, 2], small[1, 0]]
        assert abs(np.linalg.det(columns)) == pytest.approx(math.cos(theta[mount]), rel=1e-6)
        middle = platform_in_base(np.array([theta[0], theta[1], 0.0]), mount)
        along = middle.T @ columns  # rates wanted in middle axes: the servos' share of each
        wanted = middle @ [along[0, 0] * v[0], along[1, 1] * v[1], v[2]]
        np.testing.assert_allclose(columns @ part.der.q, wanted - wb, atol=1e-8)
        np.testing.assert_allclose(c @ part.der.turned, wanted + nothing, atol=1e-8)


@pytest.mark.parametrize("mount", [0, 1])
def test_signals_meet_t1_and_the_lag(mount):
    """v -> omega is rate_gain / (lag s + 1) T1; without a decoupler the azimuth turns, cos m weakens the outer axis."""
    f, r, a = 0.4, 0.5, 1.1
    part = Three(mount=mount, theta_0=[f, r, a], rate_gain=0.7, lag=0.05)
    part.initialize()
    part.flow()
    s = 30j
    found = state_space(part, ["v[1]", "v[2]", "v[3]"], [f"omega[{k}]" for k in (1, 2, 3)])(s)
    c, d = math.cos(a), math.sin(a)
    x, y = (1.0, math.cos(f)) if mount == 0 else (math.cos(r), 1.0)
    t1 = np.array([[c * x, d * y, 0], [-d * x, c * y, 0], [0, 0, 1]])
    np.testing.assert_allclose(found, t1 * 0.7 / (0.05 * s + 1), rtol=1e-12, atol=1e-15)


@pytest.mark.long
def test_a_servo_yields_to_torque_like_an_inertia():
    """lag s' = M / drag - s: at first s' = M / (drag lag), the inertia 0.4 kg.m2; in the end M / drag."""
    part = Three()
    part.M_load = [10.0, 0.0, 0.0]
    part.initialize()
    for k in range(1000):
        part.do_step(k * 1e-4, 1e-4)
        if k == 0:
            assert part.s[0] / 1e-4 == pytest.approx(10.0 / 0.4, rel=0.03)
    assert part.omega[0] == pytest.approx(10.0 / 200.0, rel=1e-9)
    assert part.attitude[0] == pytest.approx(0.05 * (0.1 - 2e-3), rel=1e-4)  # delayed by the lag


def test_beyond_its_rate_the_platform_is_dragged_along():
    """6 rad/s of yaw, gimbals of 5 rad/s: 1 rad/s is left, and told."""
    part = stepped({"omega_b": [0.0, 0.0, 6.0]})
    assert part.omega[2] == pytest.approx(1.0) and part.theta_dot[2] == -5.0 and part.saturated == 1.0
    assert stepped({"omega_b": [0.0, 0.0, 4.0]}).saturated == 0.0


def test_force_and_acceleration():
    rng = np.random.default_rng(8)
    for mount in (0, 1):
        theta, fb = rng.uniform(-1, 1, 3), rng.normal(size=3)
        part = stepped({"f_b": fb}, mount=mount, theta_0=theta.tolist())
        np.testing.assert_allclose(part.f, platform_in_base(theta, mount).T @ fb, atol=1e-12)
    part = Three()
    part.v = [0.1, 0.0, 0.0]
    part.initialize()
    rates = [0.0]
    for k in range(5):
        part.do_step(k * 1e-4, 1e-4)
        rates.append(part.omega[0])
        assert part.alpha[0] == pytest.approx((rates[-1] - rates[-2]) / 1e-4, rel=1e-12)


def roll_then_yaw(t):
    """36 deg/s of roll to 90 deg, then 50 deg of yaw at 10 deg/s (about the vehicle's own up)."""
    return base_rate(roll=36.0 * (t < 2.4999), yaw=10.0 * (2.4999 < t < 7.4999))


@pytest.mark.long
def test_rolled_into_lock_it_is_dragged_along_by_the_whole_yaw():
    """[PLATFORM-3GIMBAL-2DOF] roll to exactly 90 deg, then 50 deg of yaw: the platform's error is the 50 deg."""
    out = fly("platform_three_gimbal_2dof", roll_then_yaw, 8.0, mount=1, allow_lock=1)
    assert out["error"][-1] == pytest.approx(50.0 * DEG, rel=1e-6)
    assert np.linalg.norm(out["attitude"][-1]) == pytest.approx(50.0 * DEG, rel=1e-6)
    held = out["t"] < 2.5
    assert np.max(out["error"][held]) < 1e-6 * DEG
    other = fly("platform_three_gimbal_2dof", roll_then_yaw, 8.0, mount=0)  # roll outside: no lock by roll
    assert np.max(other["error"]) < 1e-6 * DEG and not other["lock"].any()


@pytest.mark.long
def test_lock_is_told_with_time_and_angle_and_then_refused():
    """Roll at 36 deg/s: within 5 deg of 90 after 85 / 36 s; |cos| < 1e-3 at 89.943 deg after 2.4984 s."""
    part = Three(mount=1)
    part.omega_b = base_rate(roll=36.0).tolist()
    part.initialize()
    assert part.lock_time == -1.0
    with pytest.raises(
        ComponentError, match=r"gimbal lock: \|cos\| of the middle angle -1\.5[67]\d+ rad.*\(t = 2\.499 s\)"
    ):
        for k in range(2600):
            part.do_step(k * 1e-3, 1e-3)
            assert part.lock == float(part.t > 85.0 / 36.0)
    assert part.lock_time == pytest.approx(85.0 / 36.0, abs=1e-3)
    assert part.lock_angle == pytest.approx(-85.0 * DEG, abs=0.04 * DEG)


def test_without_the_resolver_azimuth_costs_margin():
    """Feedback c of the true error, no decoupler: s (lag s + 1) + c e^(+-j azimuth) = 0 up to 90 deg - atan(w lag)."""
    c, lag = 40.0, 2e-3
    w = math.sqrt((math.sqrt(1 + 4 * (c * lag) ** 2) - 1) / 2) / lag  # w sqrt(1 + (w lag)2) = c
    margin = 90.0 - math.degrees(math.atan(w * lag))

    def stable(azimuth):
        part = Three(theta_0=[0.0, 0.0, azimuth * DEG])
        part.initialize()
        part.flow()
        system = state_space(part, ["v[1]", "v[2]"], ["attitude[1]", "attitude[2]"])
        closed = np.linalg.eigvals(system.A - c * system.B @ system.C)
        return np.max(closed.real[np.abs(closed) > 1e-6]) < 0

    assert margin == pytest.approx(85.4, abs=0.1)
    assert stable(margin - 0.1) and not stable(margin + 0.1) and not stable(180.0)


@pytest.mark.parametrize(
    "parameters, message",
    [
        ({"theta_0": [math.pi / 2, 0, 0]}, r"gimbal lock: \|cos\| of the middle angle 1\.5708 rad is below 1e-3"),
        ({"mount": 1, "theta_0": [0, -math.pi / 2, 0]}, "gimbal lock"),
        ({"lag": 0.0}, "parameter lag = 0 s must be > 0"),
        ({"lag": 5e-4}, r"step = 0\.001 s must be <= lag = 0\.0005 s"),
        ({"drag": 0.0}, r"parameter drag = 0 N\.m\.s/rad must be > 0"),
    ],
)
def test_refusals(parameters, message):
    with pytest.raises(ComponentError, match=message):
        Three(**parameters).initialize()
