"""The gimbal of two axes: dynamics against Lagrange, energy and momentum, line of sight, modes, friction."""

from __future__ import annotations

import math
from typing import Any

import casadi
import numpy as np
import pytest
from native_parts import make
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from wired import BENCH

from gyrobench.component import ComponentError
from gyrobench.linear.part_linearization import jacobians
from gyrobench.packaging import load_part

Array = np.ndarray[Any, Any]
Gimbal = load_part("gimbal_two_axis", BENCH)
BARE = {"viscous": [0.0, 0.0]}
DEG = math.pi / 180.0
AXES = {0: ("z", "x"), 1: ("x", "z")}  # outer, inner joint of each form


# ------------------------------------------------------------------------------------------- dynamics
def lagrange(form: int, flexible: bool) -> tuple[Any, Any, Any]:
    """Return functions: accelerations of the joints, kinetic and elastic energy, and the momentum, by casadi.

    Coordinates: joint angles of the bodies (pitch, yaw) and, with modes, of the motors.  d/dt dT/dq' - dT/dq = Q from
    rotation matrices and a potential of the unbalance alone.
    """
    n = 4 if flexible else 2
    q, dq, tau = (casadi.SX.sym(x, n) for x in ("q", "dq", "tau"))
    wb, ab, fb = (casadi.SX.sym(x, 3) for x in ("wb", "ab", "fb"))
    outer, inner, rho = casadi.SX.sym("A", 3, 3), casadi.SX.sym("B", 3, 3), casadi.SX.sym("rho", 2, 3)
    motor, stiff, soft = (casadi.SX.sym(x, 2) for x in ("J", "k", "c"))
    c, s = casadi.cos(q), casadi.sin(q)
    about_x = casadi.vertcat(casadi.horzcat(1, 0, 0), casadi.horzcat(0, c[0], s[0]), casadi.horzcat(0, -s[0], c[0]))
    about_z = casadi.vertcat(casadi.horzcat(c[1], s[1], 0), casadi.horzcat(-s[1], c[1], 0), casadi.horzcat(0, 0, 1))
    first, second = (about_z, about_x) if form == 0 else (about_x, about_z)
    out, inn = (1, 0) if form == 0 else (0, 1)
    kinetic, potential, rates = 0, 0, []
    for k, (turn, body) in enumerate(((first, outer), (second @ first, inner))):
        flat = casadi.jtimes(casadi.vec(turn), q, dq)
        skew = casadi.reshape(flat, 3, 3) @ turn.T - turn @ casadi.skew(wb) @ turn.T
        w = -casadi.vertcat(skew[2, 1], skew[0, 2], skew[1, 0])
        rates.append(w)
        kinetic += casadi.dot(w, body @ w) / 2
        potential += casadi.dot(rho[k, :].T, turn @ fb)
    spin = dq[2:] if flexible else dq
    axis = 0 if form == 0 else 2  # of the inner joint in either gimbal
    kinetic += motor[inn] * (rates[0][axis] + spin[inn]) ** 2 / 2 + motor[out] * (wb[2 - axis] + spin[out]) ** 2 / 2
    loss = 0
    if flexible:
        potential += casadi.dot(stiff, (q[2:] - q[:2]) ** 2) / 2
        loss = casadi.dot(soft, (dq[2:] - dq[:2]) ** 2) / 2
    forces = tau - casadi.gradient(potential, q) - (casadi.gradient(loss, dq) if flexible else 0)
    momentum = casadi.gradient(kinetic, dq)
    moving = casadi.jtimes(momentum, q, dq) + casadi.jtimes(momentum, wb, ab)
    ddq = casadi.solve(casadi.jacobian(momentum, dq), forces - moving + casadi.gradient(kinetic, q))
    given = [q, dq, tau, wb, ab, fb, outer, inner, rho, motor, stiff, soft]
    energy = casadi.Function("E", given, [kinetic + potential])
    return casadi.Function("ddq", given, [ddq]), energy, casadi.Function("w", given, [rates[1]])


def rigid(rng: np.random.Generator, size: float) -> Array:
    """Return an inertia matrix about a point, of six random masses."""
    total = np.zeros((3, 3))
    for r in rng.normal(size=(6, 3)) * size:
        total += r @ r * np.eye(3) - np.outer(r, r)
    return total


@pytest.mark.parametrize("form", [0, 1])
@pytest.mark.parametrize("flexible", [False, True])
def test_dynamics_are_those_of_lagrange(form: int, flexible: bool) -> None:
    rng = np.random.default_rng(11 + form)
    acceleration, _, rate = lagrange(form, flexible)
    for _ in range(40):
        outer, inner, rho = rigid(rng, 0.2), rigid(rng, 0.2), rng.normal(size=(2, 3)) * 0.05
        motor, bending = rng.uniform(0.01, 0.1, 2), (rng.uniform(5.0, 25.0, 2) if flexible else np.zeros(2))
        part = Gimbal(
            form=form, I_outer=outer.tolist(), I_inner=inner.tolist(), unbalance=rho.tolist(), J_motor=motor.tolist(),
            bending=bending.tolist(), **BARE,
        )  # fmt: skip
        part.initialize()
        q, dq, tau = rng.normal(size=(3, 2)) * [[0.8], [2], [3]]
        p, dp = (q + 0.01 * rng.normal(size=2), dq + rng.normal(size=2)) if flexible else (q, dq)
        wb, ab, fb = rng.normal(size=(3, 3)) * [[1], [3], [10]]
        part.q, part.dq, part.p, part.dp, part.M_load = (x.tolist() for x in (q, dq, p, dp, tau))
        part.omega_b, part.alpha_b, part.f_b = (x.tolist() for x in (wb, ab, fb))
        part.flow()
        # k and c of a mode by hand: w2 J Jl/(J + Jl), 2 zeta w J Jl/(J + Jl), Jl of the body on its axis at 0
        i, o = (0, 1) if form == 0 else (1, 0)
        axis = {"x": 0, "z": 2}
        load = np.zeros(2)
        load[i] = inner[axis[AXES[form][1]], axis[AXES[form][1]]]
        load[o] = outer[axis[AXES[form][0]], axis[AXES[form][0]]] + inner[axis[AXES[form][0]], axis[AXES[form][0]]]
        w = 2.0 * np.pi * bending
        both = motor * load / (motor + load)
        given = [
            np.concatenate([q, p]) if flexible else q, np.concatenate([dq, dp]) if flexible else dq,
            np.concatenate([[0.0, 0.0], tau]) if flexible else tau, wb, ab, fb, outer, inner, rho, motor,
            w * w * both, 2.0 * 0.02 * w * both,
        ]  # fmt: skip
        truth = np.array(acceleration(*given)).ravel()
        found = [*part.der.dq, *part.der.dp] if flexible else part.der.dq
        np.testing.assert_allclose(found, truth, rtol=1e-9, atol=1e-9 * np.abs(truth).max())
        part.outputs()
        np.testing.assert_allclose(part.omega, np.array(rate(*given)).ravel(), atol=1e-12)


@pytest.mark.parametrize("form", [0, 1])
def test_energy_and_momentum_of_undriven_gimbals_are_kept(form: int) -> None:
    """10 s on a base at rest, full matrices, no friction: energy, and the momentum about the outer axis.

    The momentum is that of rotation matrices: C^T A w_A + C^T B w_B about the axis that the base cannot turn.
    """
    rng = np.random.default_rng(5)
    outer, inner = rigid(rng, 0.15), rigid(rng, 0.15)
    part = make("gimbal_two_axis", "native")
    values = {f"{n}[{i + 1},{j + 1}]": float(m[i, j]) for n, m in (("I_outer", outer), ("I_inner", inner))
              for i in range(3) for j in range(3)}  # fmt: skip
    part.set({**values, "form": form, "viscous[1]": 0.0, "viscous[2]": 0.0, "theta_0[1]": 0.3, "theta_0[2]": 0.5})
    part.initialize()
    h = 1e-3
    names = [f"{n}[{k}]" for n in ("theta", "theta_dot") for k in (1, 2)]
    _, energy, rate = lagrange(form, False)
    o, axis = (1, 2) if form == 0 else (0, 0)
    z = np.zeros(3)

    def kept() -> tuple[float, float]:
        x = np.array(part.get(names))
        q, dq = x[:2], x[2:]
        given = [q, dq, [0, 0], z, z, z, outer, inner, np.zeros((2, 3)), [0.005] * 2, [0, 0], [0, 0]]
        turn = Rotation.from_euler(AXES[form][0], q[o]).inv().as_matrix()
        first = np.eye(3)[axis] * dq[o]
        second = Rotation.from_euler(AXES[form][1], q[1 - o]).inv().as_matrix() @ turn
        w = np.array(rate(*given)).ravel()
        whole = turn.T @ (outer @ first) + second.T @ (inner @ w)
        inside = np.eye(3)[2 - axis] * 0.005 * dq[1 - o]  # the inner joint's motor, its spin on the outer gimbal
        return float(energy(*given)), float((whole + turn.T @ inside)[axis] + 0.005 * dq[o])

    for k in range(400):
        part.set({"M_load[1]": 0.3 if k < 200 else 0.0, "M_load[2]": 0.4 if k < 200 else 0.0})
        part.step(k * h, h)
    e, m = kept()
    for k in range(400, 10400):
        part.step(k * h, h)
    assert kept() == pytest.approx((e, m), rel=1e-8)
    assert e > 0.01
    part.free()


def base_motion(t: float) -> tuple[Array, Array, Array]:
    """Return rate, its derivative and specific force of a swinging base."""
    w = 2.0 * np.pi * np.array([1.3, 0.7, 0.9])
    phase = np.array([0.3, 1.1, 2.0])
    a = np.array([0.4, 0.3, 0.5])
    force = np.array([2.0 * math.sin(5.0 * t), 1.0 * math.cos(7.0 * t), 9.8 + 3.0 * math.sin(9.0 * t)])
    return a * np.sin(w * t + phase), a * w * np.cos(w * t + phase), force


@pytest.mark.parametrize("form", [0, 1])
@pytest.mark.long
def test_a_ride_is_that_of_an_integrated_lagrangian(form: int) -> None:
    """2 s with base motion, unbalance, both modes, cable, cogging, viscous friction; line of sight by quaternion.

    The truth shares nothing but the numbers of the parameters: Lagrange's equations and SciPy's Rotation in
    solve_ivp at 1e-11.  Steps of 0.5 ms.
    """
    rng = np.random.default_rng(2)
    outer, inner, rho = rigid(rng, 0.1), rigid(rng, 0.1), rng.normal(size=(2, 3)) * 0.02
    acceleration, _, rate = lagrange(form, True)
    viscous, cable, cogging, order = np.array([0.02, 0.03]), np.array([0.4, 0.2]), np.array([0.05, 0.03]), 12.0
    motor, zeta, w = np.array([0.01, 0.02]), 0.02, 2.0 * np.pi * np.array([20.0, 30.0])
    part = Gimbal(
        form=form, I_outer=outer.tolist(), I_inner=inner.tolist(), unbalance=rho.tolist(), J_motor=motor.tolist(),
        bending=[20.0, 30.0], viscous=viscous.tolist(), cable=cable.tolist(), cogging=cogging.tolist(),
        cogging_order=[order] * 2, theta_0=[0.3, -0.4],
    )  # fmt: skip
    stiff, soft = np.array(part_values(part, "stiff")), np.array(part_values(part, "soft"))
    assert stiff[0] > 0.0 and soft == pytest.approx(2.0 * zeta * stiff / w)

    def slope(t: float, x: Array) -> Array:
        q, dq, turned = x[:4], x[4:8], x[8:12]
        wb, ab, fb = base_motion(t)
        m = -viscous * dq[2:] - cable * q[2:] - cogging * np.sin(order * q[2:])
        given = [q, dq, np.concatenate([[0.0, 0.0], m]), wb, ab, fb, outer, inner, rho, motor, stiff, soft]
        wx, wy, wz = np.array(rate(*given)).ravel()
        x_, y_, z_, w_ = turned  # quaternion from inner axes to space, scalar last: q' = q w / 2
        spin = [w_ * wx + y_ * wz - z_ * wy, w_ * wy + z_ * wx - x_ * wz,
                w_ * wz + x_ * wy - y_ * wx, -x_ * wx - y_ * wy - z_ * wz]  # fmt: skip
        return np.concatenate([dq, np.array(acceleration(*given)).ravel(), 0.5 * np.array(spin)])

    begin = np.array([0.3, -0.4, 0.3, -0.4, 0, 0, 0, 0, 0, 0, 0, 1.0])
    truth = solve_ivp(slope, (0.0, 2.0), begin, rtol=1e-10, atol=1e-11, method="DOP853").y[:, -1]
    h = 5e-4
    told = base_motion(0.0)
    part = part_again(part)
    part.omega_b, part.alpha_b, part.f_b = (x.tolist() for x in told)
    part.initialize()
    for k in range(4000):
        told = base_motion((k + 1) * h)
        part.omega_b, part.alpha_b, part.f_b = (x.tolist() for x in told)
        part.do_step(k * h, h)
    assert part.theta == pytest.approx(truth[2:4], abs=2e-6)
    star = Rotation.from_quat(truth[8:12]).inv().apply([0.0, 1.0, 0.0])
    assert part.los == pytest.approx([math.atan2(-star[2], star[1]), math.atan2(star[0], star[1])], abs=2e-6)
    assert np.abs(truth[:2]).max() > 0.2


def part_values(part: Any, name: str) -> list[float]:
    """Return a discrete array of a part after its start, without base motion."""
    part.initialize()
    return list(getattr(part, name))


def part_again(part: Any) -> Any:
    """Return a new part with the parameters of this one."""
    names = ("form", "I_outer", "I_inner", "unbalance", "J_motor", "bending", "viscous", "cable", "cogging",
             "cogging_order", "theta_0")  # fmt: skip
    return Gimbal(**{n: getattr(part, n) for n in names})


# ---------------------------------------------------------------------------------------- line of sight
@pytest.mark.parametrize("form", [0, 1])
@pytest.mark.parametrize("angle", [-60.0, 0.0, 40.0, 70.0])
def test_a_torque_on_the_outer_axis_reaches_the_line_of_sight_by_the_cosine(form: int, angle: float) -> None:
    """Diagonal inertias: alpha = cos(q1) M / M33, M33 = A33 + s2 B22 + c2 B33 + J by hand."""
    i, o = (0, 1) if form == 0 else (1, 0)
    start, load = [0.0, 0.0], [0.0, 0.0]
    start[i], load[o] = angle * DEG, 0.7
    part = Gimbal(form=form, theta_0=start)
    part.M_load = load
    part.initialize()
    part.flow()
    part.outputs()
    c, s = math.cos(angle * DEG), math.sin(angle * DEG)
    m33 = 0.03 + s * s * 0.03 + c * c * 0.045 + 0.005
    assert part.alpha[2 if form == 0 else 0] == pytest.approx(c * 0.7 / m33, rel=1e-12)
    assert part.keyhole == 0.0


@pytest.mark.parametrize(("angle", "flag"), [(74.9, 0.0), (75.1, 1.0), (-80.0, 1.0), (100.0, 1.0)])
def test_the_keyhole_is_said(angle: float, flag: float) -> None:
    part = Gimbal(theta_0=[angle * DEG, 0.2])
    part.initialize()
    assert part.keyhole == flag


@pytest.mark.long
def test_a_free_gimbal_keeps_its_line_of_sight_but_for_the_outer_gimbal() -> None:
    """Balanced, without friction, inner angle 0: a base that turns about an axis of the joints leaves it at rest."""
    part = Gimbal(**BARE)
    part.initialize()
    for k in range(2000):
        t = (k + 1) * 1e-3
        part.omega_b[2], part.alpha_b[2] = 0.3 * math.sin(6 * t), 1.8 * math.cos(6 * t)
        part.do_step(k * 1e-3, 1e-3)
    assert np.abs(part.los).max() < 1e-12 < abs(part.theta[1])


def test_the_mode_of_the_linear_model_is_where_it_was_asked_for() -> None:
    """42 Hz and 35 Hz with 2 %; the other joint held by its inertia alone leaves a diagonal gimbal's as it is."""
    part = Gimbal(bending=[42.0, 35.0], **BARE)
    part.initialize()
    a = np.array(jacobians(part, [], [])[0])
    poles = np.linalg.eigvals(a)
    modes = sorted({round(abs(x) / (2 * math.pi), 6) for x in poles if x.imag > 1.0})
    assert modes == pytest.approx([35.0, 42.0], rel=1e-6)
    assert all(-x.real / abs(x) == pytest.approx(0.02, rel=1e-6) for x in poles if x.imag > 1.0)


# ------------------------------------------------------------------------------------------- torques
@pytest.mark.long
def test_stiction_holds_and_lets_go() -> None:
    """A torque that rises to 98 % of it stays within presliding; above it the joint turns by M - friction."""
    part = Gimbal(friction=[0.04, 0.0], stiction=[0.05, 0.0], **BARE)
    part.initialize()
    for k in range(3000):
        part.M_load = [min(0.049, 0.049 * k / 1000), 0.0]
        part.do_step(k * 1e-3, 1e-3)
    assert part.theta[0] == pytest.approx(0.049 / 0.05 * 2e-4, rel=1e-6)
    part.M_load = [0.06, 0.0]
    for k in range(3000, 3500):
        part.do_step(k * 1e-3, 1e-3)
    rate = part.theta_dot[0]
    part.do_step(3.5, 1e-3)
    assert (part.theta_dot[0] - rate) / 1e-3 == pytest.approx((0.06 - 0.04) / (0.045 + 0.005), rel=1e-6)


def test_motor_limits() -> None:
    part = Gimbal(R=[2.0, 1.0], v_max=[24.0, 24.0], i_max=[10.0, 10.0])
    part.v = [30.0, 5.0]
    part.initialize()
    assert part.i_motor == [10.0, 5.0] and part.saturated == 1.0
    part.v = [8.0, -5.0]
    part.do_step(0.0, 1e-6)
    assert part.i_motor == [4.0, -5.0] and part.saturated == 0.0


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"I_inner": [[1.0, 0.1, 0.0], [0.2, 1.0, 0.0], [0.0, 0.0, 1.0]]}, "I_inner is not of a rigid body"),
        ({"I_outer": [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 3.0]]}, "I_outer is not of a rigid body"),
        ({"I_outer": [[1.0, 2.0, 0.0], [2.0, 1.0, 0.0], [0.0, 0.0, 1.0]]}, "I_outer is not of a rigid body"),
        ({"bending": [42.0, 0.0], "J_motor": [0.0, 0.1]}, "needs J_motor"),
        ({"bending": [142.0, 0.0]}, "too long for bending"),
        ({"friction": [0.05, 0.0], "stiction": [0.04, 0.0]}, "stiction of an axis"),
        ({"friction": [5.0, 0.0], "presliding": 1e-6}, "too long for presliding"),
    ],
)
def test_refused(given: dict[str, Any], message: str) -> None:
    with pytest.raises(ComponentError, match=message):
        Gimbal(**given).initialize()
