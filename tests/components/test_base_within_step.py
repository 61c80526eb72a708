"""Base motion within a communication step: every gimballed part against continuous models that share nothing with it.

The parts are given what the base has at the end of a step.  Held over the step it would turn half a step ahead of the
joints, an error of the first order; with its acceleration the order is two or better.
"""

import math

import numpy as np
import pytest
from gimbal_oracle import accelerations, along, turned
from native_parts import make
from scipy.integrate import solve_ivp

SIZE = np.array([0.8, 0.6, 0.5])  # rad/s
FREQUENCY = 2.0 * math.pi * np.array([0.9, 1.3, 0.7])
PHASE = np.array([0.3, 1.1, 2.0])
END = 1.2  # s
UNBALANCE = np.array([[0.02, 0.0, -0.03], [0.0, 0.02, 0.01], [0.03, -0.02, 0.0]])


def rate(t):
    return SIZE * np.sin(FREQUENCY * t + PHASE)


def acceleration(t):
    return SIZE * FREQUENCY * np.cos(FREQUENCY * t + PHASE)


def force(t):
    return np.array([3.0 * np.sin(2.0 * t), 2.0 * np.cos(3.0 * t), 9.80665])


def integrate(slope, start):
    return solve_ivp(slope, (0.0, END), start, method="DOP853", rtol=1e-11, atol=1e-13).y[:, -1]


def attitude(start):
    """Rows: vehicle axes at END in those where the motion began; C' = -w x C."""

    def slope(t, c):
        return -np.cross(np.tile(rate(t), (3, 1)), c.reshape(3, 3).T).T.ravel()

    return integrate(slope, np.eye(3).ravel()).reshape(3, 3) @ start


def ridden(part, h, outputs, told=True, names=("omega_b", "alpha_b", "f_b"), **parameters):
    """Outputs at END after steps h; ``told``: with the acceleration."""
    one = make(part, "native")
    signals = dict(zip(names, (rate, acceleration if told else lambda t: np.zeros(3), force), strict=True))

    def give(t):
        one.set({f"{n}[{k + 1}]": x for n, f in signals.items() for k, x in enumerate(f(t))})

    one.set({n: float(x) for n, x in parameters.items()})
    give(0.0)
    one.initialize()
    for k in range(round(END / h)):
        give((k + 1) * h)
        one.step(k * h, h)
    out = np.array(one.get(outputs))
    one.free()
    return out


def orders(error, steps=(8e-3, 4e-3, 2e-3)):
    """Errors at these steps, and how often the step goes into them."""
    e = np.array([error(h) for h in steps])
    return e, np.log2(e[:-1] / e[1:])


def elements(name, values):
    return {f"{name}[{i + 1}]": x for i, x in enumerate(values)}


# ------------------------------------------------------------------------------------------ one axis
J, RATIO, J_MOTOR, VISCOUS, K_E, R = 2.0, 3.0, 0.05, 0.4, 1.0, 2.0


def single_axis():
    """Angle and attitude: (J + n2 Jm) w' - n (n - 1) Jm a_b = -(viscous + n2 k_t k_e / R) S - (u x f)_x."""

    def slope(t, x):
        angle, w, _ = x
        s = w - rate(t)[0]
        f = turned(0, angle, force(t))
        torque = -(VISCOUS + RATIO**2 * K_E / R) * s - np.cross([0.0, 0.03, -0.02], f)[0]
        torque += RATIO * (RATIO - 1.0) * J_MOTOR * acceleration(t)[0]
        return [s, torque / (J + RATIO**2 * J_MOTOR), w]

    return integrate(slope, [0.0, rate(0.0)[0], 0.0])[[0, 2]]


@pytest.mark.parametrize(("told", "order"), [(False, 1.0), (True, 2.0)])
def test_single_axis(told, order):
    """Without the acceleration the order is one: what a base held over the step does."""
    truth = single_axis()
    numbers = {"J": J, "ratio": RATIO, "J_motor": J_MOTOR, "viscous": VISCOUS, "k_e": K_E, "R": R, "L": 0.0}
    numbers |= {"unbalance[1]": 0.03, "unbalance[2]": -0.02}

    def error(h):
        return np.max(np.abs(ridden("platform_single_axis", h, ["theta", "attitude"], told, **numbers) - truth))

    errors, found = orders(error)
    np.testing.assert_allclose(found, order, atol=0.2)
    assert bool(errors[-1] < 1e-5) is told  # rad, at 2 ms


# ---------------------------------------------------------------------------------------- three axes
def three_axis(start):
    """Joint angles and integral of the inertial rate, large angles: viscous friction and back EMF, unbalance."""
    drag = 0.3 + 1.0 / 2.0  # viscous + k_t k_e / R

    def slope(t, x):
        q, dq = x[:3], x[3:6]
        none = np.zeros(3)
        ddq, w, _ = accelerations(q, dq, rate(t), acceleration(t), -drag * dq, none, UNBALANCE, force(t))
        return np.concatenate([dq, ddq, w])

    return integrate(slope, np.concatenate([start, np.zeros(6)]))[[0, 1, 2, 6, 7, 8]]


@pytest.mark.long
def test_three_axis():
    """A communication step has up to eight internal steps here: the base moves through all of them."""
    start = [0.5, 0.2, 0.8]
    truth = three_axis(start)
    assert np.abs(truth[:3] - start).max() > 0.1
    numbers = {f"unbalance[{i + 1},{j + 1}]": UNBALANCE[i, j] for i in range(3) for j in range(3)}
    numbers |= elements("viscous", [0.3] * 3) | elements("L", [0.0] * 3) | elements("theta_0", start)
    names = [f"{n}[{k}]" for n in ("theta", "attitude") for k in (1, 2, 3)]
    errors, found = orders(lambda h: np.max(np.abs(ridden("platform_three_axis", h, names, **numbers) - truth)))
    assert np.all(found > 1.8)
    assert errors[-1] < 1e-5  # rad, at 2 ms; held: 1e-3


def test_three_axis_keeps_its_momentum_where_the_base_jumps():
    """Free bearings, a rate of the base that begins at once and without an acceleration: the element stays at rest."""
    one = make("platform_three_axis", "native")
    one.set(elements("viscous", [0.0] * 3) | elements("k_e", [0.0] * 3))
    one.initialize()
    one.set({"omega_b[1]": 0.5})
    one.step(0.0, 1e-3)
    assert one.get(["omega[1]", "attitude[1]", "theta_dot[1]"]) == pytest.approx([0.0, 0.0, -0.5], abs=1e-12)
    one.free()


# ---------------------------------------------------------------------- kinematic platforms, vertical gyro
def in_base(part, theta):
    """Platform axes (rows) in axes of the base, from joint angles in A order, and that of the fourth gimbal."""
    rows = np.eye(3)
    if part == "platform_four_gimbal":
        rows = np.column_stack([turned(1, theta[3], c) for c in rows.T])
        return np.column_stack([turned(2, theta[2], turned(1, theta[1], turned(0, theta[0], c))) for c in rows.T])
    return np.column_stack([along(theta, c)[2] for c in rows.T])


@pytest.mark.parametrize("part", ["platform_three_gimbal_2dof", "platform_four_gimbal"])
@pytest.mark.parametrize(("told", "order"), [(False, 1.0), (True, 2.0)])
def test_rate_servo_gimbals(part, told, order):
    """Servos at rest: the platform stays where it was, whatever the base does."""
    start = [0.3, 0.1, 0.7]
    names = [f"theta[{k}]" for k in (1, 2, 3)] + ["theta_4"] * (part == "platform_four_gimbal")
    before = in_base(part, [*start, 0.0])
    base = attitude(np.eye(3))

    def error(h):
        theta = ridden(part, h, names, told, **elements("theta_0", start), rate_max=50.0)
        return np.max(np.abs(in_base(part, theta) @ base - before))

    errors, found = orders(error)
    np.testing.assert_allclose(found, order, atol=0.25)
    assert bool(errors[-1] < 1e-5) is told


@pytest.mark.parametrize(("told", "order"), [(False, 1.0), (True, 2.0)])
def test_vertical_gyro(told, order):
    """No torque: the rotor axis stays in inertial space; f tells it only where it starts."""
    up = force(0.0) / np.linalg.norm(force(0.0))
    x, y, z = attitude(np.eye(3)) @ up
    truth = [math.asin(y), math.atan2(-x, z)]  # pitch and roll without the ring

    def error(h):
        given = {"names": ("omega", "alpha", "f"), "ring": 0.0}
        return np.max(np.abs(ridden("vertical_gyro", h, ["pitch", "roll"], told, **given) - truth))

    errors, found = orders(error)
    np.testing.assert_allclose(found, order, atol=0.2)
    assert bool(errors[-1] < 1e-5) is told


# ------------------------------------------------------------------------------------------ power gyro
def power_gyro():
    """Both gimbal angles: gyroscopic torque H w x z_i about outer x and inner y, dampers, torques from outside."""
    mount = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])  # gyro axes in case axes

    def slope(t, x):
        a, b, p, q = x
        w = turned(0, a, mount @ rate(t))  # of the base, axes of the outer gimbal
        outer = -10.0 * q * math.cos(b) - 10.0 * (p - w[0]) + 4.0
        inner = 10.0 * (p * math.cos(b) - w[2] * math.sin(b)) - 2.0 * (q - w[1]) - 3.0
        return [p - w[0], q - w[1], outer / 0.5, inner / 0.02]

    return integrate(slope, np.zeros(4))[:2]


@pytest.mark.parametrize(("told", "order"), [(False, 1.0), (True, 2.0)])
def test_power_gyro(told, order):
    """The outer gimbal bears the platform, the case is the base; small angles: test_isolation_by_hand."""
    truth = power_gyro()
    numbers = {"H": 10.0, "J_x": 0.5, "J_y": 0.02, "C_x": 10.0, "C_y": 2.0, "M_x": 4.0, "M_y": -3.0, "full": 1.0}
    numbers |= {f"mount[{i},{j}]": float(i % 3 + 1 == j) for i in (1, 2, 3) for j in (1, 2, 3)}
    numbers |= {f"{n}_{c}": 0.0 for n in ("markov", "white", "pickoff") for c in "xy"}
    numbers |= {f"D{c}_{n}": 0.0 for c in "xy" for n in ("0", "x", "y", "z", "xx", "yy", "zz", "xy", "yz", "xz")}

    def error(h):
        given = {"names": ("omega", "alpha_b", "f"), **numbers}
        return np.max(np.abs(ridden("gyro_2dof", h, ["alpha", "beta"], told, **given) - truth))

    errors, found = orders(error)
    np.testing.assert_allclose(found, order, atol=0.1)
    assert bool(errors[-1] < 1e-5) is told  # rad, at 2 ms
