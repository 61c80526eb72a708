"""The three-axis platform: dynamics against Lagrange's equations, energy, momentum, frames, motors, bearings, stop."""

import math

import casadi
import numpy as np
import pytest
from native_parts import make
from scipy.spatial.transform import Rotation
from wired import BENCH, Native

from gyrobench.component import ComponentError
from gyrobench.linear.part_linearization import state_space
from gyrobench.packaging import load_part

Platform = load_part("platform_three_axis", BENCH)
SingleAxis = load_part("platform_single_axis", BENCH)
BARE = {"viscous": [0.0] * 3, "k_e": [0.0] * 3}
DEG = math.pi / 180.0


def passive(pitch, roll, azimuth):
    """C_b^r, C_b^f, C_b^a: each passive rotation is the transpose of the active one."""
    r = Rotation.from_euler("y", roll).inv()
    f = Rotation.from_euler("x", pitch).inv() * r
    return r.as_matrix(), f.as_matrix(), (Rotation.from_euler("z", azimuth).inv() * f).as_matrix()


# ------------------------------------------------------------------------------------------- dynamics
def lagrange():
    """q'' of the gimbals by d/dt dT/dq' - dT/dq = Q, T from the rotation matrices alone (casadi)."""
    q, dq, tau, mg, wb, ab, fb = (casadi.SX.sym(n, 3) for n in ("q", "dq", "tau", "mg", "wb", "ab", "fb"))
    inertia, rho = casadi.SX.sym("I", 3, 3), casadi.SX.sym("rho", 3, 3)  # rows: roll, pitch gimbal, inner
    c, s = casadi.cos(q), casadi.sin(q)
    c_r = casadi.vertcat(casadi.horzcat(c[1], 0, -s[1]), casadi.horzcat(0, 1, 0), casadi.horzcat(s[1], 0, c[1]))
    c_f = casadi.vertcat(casadi.horzcat(1, 0, 0), casadi.horzcat(0, c[0], s[0]), casadi.horzcat(0, -s[0], c[0]))
    c_a = casadi.vertcat(casadi.horzcat(c[2], s[2], 0), casadi.horzcat(-s[2], c[2], 0), casadi.horzcat(0, 0, 1))
    kinetic, potential = 0, 0
    for k, turn in enumerate((c_r, c_f @ c_r, c_a @ c_f @ c_r)):
        # d/dt (C_b^k C_i^b) (C_b^k C_i^b)^T = -[w_k x], with d/dt C_i^b = -[w_b x] C_i^b
        flat = casadi.jtimes(casadi.vec(turn), q, dq)
        skew = casadi.reshape(flat, 3, 3) @ turn.T - turn @ casadi.skew(wb) @ turn.T
        w = -casadi.vertcat(skew[2, 1], skew[0, 2], skew[1, 0])
        kinetic += casadi.dot(w, inertia[k, :].T * w) / 2
        potential += casadi.dot(rho[k, :].T, turn @ fb)
    forces = tau + casadi.jacobian(w, dq).T @ mg - casadi.gradient(potential, q)  # w of the inner element
    momentum = casadi.gradient(kinetic, dq)
    moving = casadi.jtimes(momentum, q, dq) + casadi.jtimes(momentum, wb, ab)
    ddq = casadi.solve(casadi.jacobian(momentum, dq), forces - moving + casadi.gradient(kinetic, q))
    given = [q, dq, tau, mg, wb, ab, fb, inertia, rho]
    return casadi.Function("ddq", given, [ddq]), casadi.Function("T", given, [kinetic])


ACCELERATION, KINETIC = lagrange()


def rigid(rng):
    """Principal moments that a body can have."""
    a, b, c = rng.uniform(0.1, 0.5, 3)
    return [b + c, c + a, a + b]


def test_dynamics_are_those_of_lagrange():
    rng = np.random.default_rng(11)
    for _ in range(60):
        bodies, rho = [rigid(rng) for _ in range(3)], rng.normal(size=(3, 3)) * 0.05
        part = Platform(I_r=bodies[0], I_f=bodies[1], I_a=bodies[2], unbalance=rho.tolist(), **BARE)
        part.initialize()
        q, dq, tau, mg, wb, ab, fb = rng.normal(size=(7, 3)) * [[0.7], [2], [3], [1], [1], [3], [10]]
        q[0] = rng.uniform(-1.4, 1.4)  # within the stop
        part.q, part.dq, part.M_load, part.M_gyro = (list(map(float, x)) for x in (q, dq, tau, mg))
        part.omega_b, part.alpha_b, part.f_b = (list(map(float, x)) for x in (wb, ab, fb))
        part.flow()
        truth = np.array(ACCELERATION(q, dq, tau, mg, wb, ab, fb, np.array(bodies), rho)).ravel()
        np.testing.assert_allclose(part.der.dq, truth, rtol=1e-9, atol=1e-9)


def test_neutral_inertias():
    """[PLATFORM-3AXIS-DYN] 2.0, 1.0, 0.7 kg.m2 about roll, pitch, azimuth, no coupling."""
    for axis, inertia in enumerate((1.0, 2.0, 0.7)):
        part = Platform(**BARE)
        part.initialize()
        part.M_load[axis] = 1.0
        part.flow()
        hand = [0.0, 0.0, 0.0]
        hand[axis] = 1.0 / inertia
        assert part.der.dq == pytest.approx(hand, abs=1e-15)


@pytest.mark.parametrize("h", [1e-4, 1e-3])
@pytest.mark.long
def test_energy_of_the_undriven_gimbals_is_kept(h):
    """10 s, no friction, base at rest: to 1e-8, and the momentum about the roll axis, which nothing can change, too."""
    part = make("platform_three_axis", "native")
    none = {f"{n}[{k}]": 0.0 for n in ("viscous", "k_e") for k in (1, 2, 3)}
    start = {"theta_0[1]": 0.5, "theta_0[2]": 0.1, "theta_0[3]": 0.3}
    rates = {"theta_dot_0[1]": -0.7, "theta_dot_0[2]": 0.4, "theta_dot_0[3]": 3.0}  # swings about pitch 0
    part.set({**none, **start, **rates})
    part.initialize()
    bodies = np.array([[0.8, 0.9, 0.7], [0.4, 0.6, 0.5], [0.6, 0.5, 0.7]])
    z, names = np.zeros(3), [f"{n}[{k}]" for n in ("theta", "theta_dot", "omega") for k in (1, 2, 3)]

    def kept():
        x = np.array(part.get(names))
        q, dq, w = x[:3], x[3:6], x[6:]
        c_r, c_f, c_a = passive(*q)
        w_r = np.array([0.0, dq[1], 0.0])
        w_f = c_f @ c_r.T @ w_r + [dq[0], 0.0, 0.0]
        momentum = c_r.T @ (bodies[0] * w_r) + c_f.T @ (bodies[1] * w_f) + c_a.T @ (bodies[2] * w)
        return float(KINETIC(q, dq, z, z, z, z, z, bodies, np.zeros((3, 3)))), momentum, abs(q[0])

    energy, momentum, _ = kept()
    widest = 0.0
    for k in range(round(10.0 / h)):
        part.step(k * h, h)
        if k % round(0.1 / h) == 0:
            now = kept()
            widest = max(widest, now[2])
            assert now[0] == pytest.approx(energy, rel=1e-8)
            assert now[1][1] == pytest.approx(momentum[1], abs=1e-8)
    part.free()
    assert 0.5 < widest < 85 * DEG  # it moved, and not against the stop
    assert np.max(np.abs(now[1] - momentum)) > 0.1  # about the other axes the bearings may change it


# --------------------------------------------------------------------------------------------- frames
def test_rates_are_t1_t3():
    """5.1.5-5.1.7: omega = T1 omega_A + T3 omega_b, omega_A = absolute rates along x_f, y_r, z_a."""
    rng = np.random.default_rng(2)
    for _ in range(20):
        f, r, a = rng.normal(size=3) * 0.6
        dq, wb = rng.normal(size=(2, 3))
        part = Platform(theta_0=[f, r, a], theta_dot_0=dq.tolist())
        part.omega_b = wb.tolist()
        part.initialize()
        c_r, c_f, c_a = passive(f, r, a)
        w_r = c_r @ wb + [0, dq[1], 0]
        w_f = c_f @ c_r.T @ w_r + [dq[0], 0, 0]
        w_a = c_a @ c_f.T @ w_f + [0, 0, dq[2]]
        along = np.array([w_f[0], w_r[1], w_a[2]])
        s, c = np.sin([f, r, a]), np.cos([f, r, a])
        t1 = [[c[2], c[0] * s[2], 0], [-s[2], c[0] * c[2], 0], [0, 0, 1]]
        t3 = [[s[1] * s[0] * s[2], 0, c[1] * s[0] * s[2]], [s[1] * s[0] * c[2], 0, c[1] * s[0] * c[2]], [0, 0, 0]]
        np.testing.assert_allclose(part.omega, t1 @ along + t3 @ wb, atol=1e-14)
        np.testing.assert_allclose(part.omega, w_a, atol=1e-14)
        np.testing.assert_allclose(part.f, c_a @ [0.0, 0.0, 9.80665], atol=1e-13)


def test_acceleration_is_the_derivative_of_the_rate():
    """Central difference of omega over two short steps under a turning, accelerated base."""
    rng = np.random.default_rng(6)
    for _ in range(5):
        q, dq, wb, ab, v = rng.normal(size=(5, 3)) * [[0.6], [1], [1], [2], [5]]
        part = Platform(theta_0=q.tolist(), theta_dot_0=dq.tolist())
        h, rates, told = 1e-5, [], []
        for k in range(-2, 3):
            part.omega_b, part.alpha_b, part.v = (wb + ab * k * h).tolist(), ab.tolist(), v.tolist()
            if k == -2:
                part.initialize()
            part.outputs()
            rates.append(np.array(part.omega))
            told.append(np.array(part.alpha))
            part.set("v[1]", v[0])
            part.do_step(k * h, h)
        np.testing.assert_allclose(told[2], (rates[3] - rates[1]) / (2 * h), rtol=1e-4, atol=1e-3)


@pytest.mark.long
def test_attitude_is_the_integral_of_the_rate():
    part = Platform(theta_0=[0.4, 0.2, 0.7], theta_dot_0=[0.3, -0.2, 0.5])
    part.initialize()
    rates = [np.array(part.omega)]
    for k in range(500):
        part.do_step(k * 1e-3, 1e-3)
        rates.append(np.array(part.omega))
    np.testing.assert_allclose(part.attitude, np.trapezoid(rates, dx=1e-3, axis=0), atol=1e-7)


# ------------------------------------------------------------------------------------ motors, bearings
@pytest.mark.long
def test_back_emf_by_base_motion():
    """Base at 0.1 rad/s about x, pitch motor shorted, L = 0: w = w_b (1 - exp(-t k_t k_e / (R I))), I = 1.0."""
    part = Platform(viscous=[0.0] * 3, L=[0.0] * 3, theta_dot_0=[-0.1, 0.0, 0.0])
    part.omega_b = [0.1, 0.0, 0.0]
    part.initialize()
    assert part.omega == [0.0, 0.0, 0.0] and part.i_motor == [0.0] * 3  # none has flowed
    for k in range(1000):
        part.do_step(k * 1e-3, 1e-3)
    assert part.omega[0] == pytest.approx(0.1 * (1 - math.exp(-0.5)), rel=1e-9)
    assert part.saturated == 0.0


@pytest.mark.parametrize("axis, inertia", [(0, 0.9), (1, 2.0), (2, 0.7)])
def test_one_axis_alone_is_the_single_axis_platform(axis, inertia):
    """Neutral position, only this axis driven, hard enough to meet both limits, with a bearing that sticks.

    The damping of the contact is of the least inertia an axis can have: pitch and azimuth have that one here.
    """
    numbers = {"v_max": 12.0, "i_max": 4.0, "k_t": 0.8, "k_e": 0.9, "L": 3e-3}
    if axis != 1:
        numbers.update(friction=0.3, stiction=0.5)
    arrays = {
        n: [x if k == axis else 0.0 if n.endswith("ction") else 1.0 for k in range(3)] for n, x in numbers.items()
    }
    inner = [0.6 if axis == 1 else 0.5, 0.5, 0.7]
    many = Native("platform_three_axis", I_a=inner, **{**arrays, "L": [3e-3] * 3})
    one = Native("platform_single_axis", J=inertia, **numbers)
    many.initialize(), one.initialize()
    limited = 0.0
    for k in range(800):
        volts = 15.0 * math.sin(20.0 * k * 1e-3) * (k < 600)
        many.v, one.v = [volts * (k == axis) for k in range(3)], volts
        many.M_load, one.M_load = [0.2 * (k == axis) for k in range(3)], 0.2
        many.do_step(k * 1e-3, 1e-3), one.do_step(k * 1e-3, 1e-3)
        assert many.theta[axis] == pytest.approx(one.theta, rel=1e-9, abs=1e-13)
        assert many.i_motor[axis] == pytest.approx(one.i_motor, rel=1e-9, abs=1e-13)
        assert many.saturated == one.saturated
        limited += one.saturated
    assert 0 < limited < 700
    assert axis == 1 or abs(one.theta_dot) < 1e-6  # it stands, held by its bearing


def test_every_limit_shows():
    for k in range(3):
        part = Platform()
        part.initialize()
        part.set(f"v[{k + 1}]", -49.0)
        assert part.get("saturated") == 1.0
        part.set(f"v[{k + 1}]", -47.0)
        assert part.get("saturated") == 0.0


def test_pitch_stop_and_lock():
    """1 rad/s against the stop at 85 deg: thrown back slower, never 1 deg beyond; `lock` beyond 80 deg only."""
    part = Native("platform_three_axis", theta_0=[1.3, 0.2, 0.4], theta_dot_0=[1.0, 0.0, 0.0], **BARE)
    part.initialize()
    widest = 0.0
    for k in range(1000):
        part.do_step(k * 1e-3, 1e-3)
        widest = max(widest, part.theta[0])
        assert part.lock == float(abs(part.theta[0]) > 80 * DEG)
        assert part.at_stop == float(abs(part.theta[0]) > 85 * DEG)
    assert 85 * DEG < widest < 86 * DEG
    assert -0.5 < part.theta_dot[0] < -0.05  # damping 0.5 on one half-wave leaves exp(-pi / (2 sqrt(0.75))) = 0.16
    part.M_load = [50.0, 0.0, 0.0]  # pressed against it: rests at stop + M / stiffness
    part.viscous = [5.0] * 3
    for k in range(1000, 5000):
        part.do_step(k * 1e-3, 1e-3)
    assert part.theta[0] == pytest.approx(85 * DEG + 50.0 / 2e4, abs=2e-4)


def test_linearization_around_a_tilted_position():
    """At rest at pitch 40, azimuth 30 deg: poles and zeros of v -> omega are those of M q'' = k_t i (numpy)."""
    angles = (40 * DEG, 10 * DEG, 30 * DEG)
    part = Platform(theta_0=list(angles), **BARE)
    part.initialize()
    system = state_space(part, ["v[1]", "v[2]", "v[3]"], ["omega[1]", "omega[2]", "omega[3]", "alpha[1]"])
    w = 50.0
    z, eye = np.zeros(3), np.eye(3)
    bodies, none = np.array([part.I_r, part.I_f, part.I_a]), np.zeros((3, 3))
    inverse = np.hstack([np.array(ACCELERATION(angles, z, e, z, z, z, z, bodies, none)) for e in eye])
    joints = np.zeros((3, 3))
    for k in range(3):
        part.dq = eye[k].tolist()
        part.outputs()
        joints[:, k] = part.omega
    hand = joints @ inverse / (1j * w) / (2.0 + 4e-3j * w)
    np.testing.assert_allclose(system(1j * w)[:3], hand, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(system(1j * w)[3], hand[0] * 1j * w, rtol=1e-9, atol=1e-12)


# ------------------------------------------------------------------------------------------- refusals
@pytest.mark.parametrize(
    "parameters, message",
    [
        ({"I_a": [0.6, 0.0, 0.7]}, r"parameter I_a\[2\] = 0 kg\.m2 must be > 0"),
        ({"I_f": [0.1, 0.1, 0.5]}, "I_f is not of a rigid body: no moment may exceed the sum of the others"),
        ({"theta_0": [1.5, 0.0, 0.0]}, r"theta_0\[1\] = 1\.5 rad must be within the pitch stop, \+-1\.48353 rad"),
        ({"pitch_stop": math.pi / 2}, "parameter pitch_stop = 1.5708 rad must be <= 1.5698"),
        ({"L": [4e-3, 1e-3, 0.0]}, "step = 0.001 s must be <= L / R of each motor"),
        ({"friction": [0.5, 0, 0], "stiction": [0.4, 0, 0]}, "stiction of an axis must be 0 or at least its friction"),
        ({"R": [2.0, 2.0, 0.0]}, r"parameter R\[3\] = 0 Ohm must be > 0"),
    ],
)
def test_refusals(parameters, message):
    with pytest.raises(ComponentError, match=message):
        Platform(**parameters).initialize()


def test_pitch_of_90_degrees_is_refused():
    part = Platform(theta_0=[1.48, 0.0, 0.0], theta_dot_0=[40.0, 0.0, 0.0], stop_stiffness=1.0)
    part.initialize()
    with pytest.raises(
        ComponentError, match=r"pitch = 1\.[56]\d* rad, through its stop at 1\.48353 rad: it must stay below"
    ):
        for k in range(10):
            part.do_step(k * 1e-3, 1e-3)
