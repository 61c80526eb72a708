"""The gyro as a power gyro: torques on its gimbals, gimbals at full size, torque on its mount, the stop."""

import math

import numpy as np
import pytest
from native_parts import make
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.spatial.transform import Rotation
from wired import begun

from gyrobench.component import ComponentError

QUIET = dict.fromkeys(("markov_x", "markov_y", "white_x", "white_y", "pickoff_x", "pickoff_y"), 0.0)
STILL = {**QUIET, **{f"D{c}_{n}": 0.0 for c in "xy" for n in ("0", "x", "y", "z", "xx", "yy", "zz", "xy", "yz", "xz")}}
POWER = {"H": 10.0, "J_x": 0.5, "J_y": 0.02, "C_x": 10.0, "C_y": 2.0}  # STAB-POWER-2DOF
STATES = ("psi_x", "psi_y", "p", "q")


def started(**values):
    return begun("gyro_2dof", **{**STILL, **values})


def run(part, seconds, h):
    for k in range(round(seconds / h)):
        part.do_step(k * h, h)
    return np.array([part.get(n) for n in STATES])


def test_stab_power_plant_is_exact_for_held_torques():
    """J_x a'' + C_a a' + H b' = M_x, J_y b'' + C_b b' - H a' = M_y [5-7, 5-8] by expm, any step."""
    h, jx, jy, (ca, cb), spin = 2e-3, 0.5, 0.02, (10.0, 2.0), 10.0
    part = started(**POWER, u_max=10.0)
    a = np.zeros((6, 6))  # a, b, a', b'; held: M_x, M_y
    a[0, 2] = a[1, 3] = 1.0
    a[2, [2, 3, 4]] = -ca / jx, -spin / jx, 1.0 / jx
    a[3, [2, 3, 5]] = spin / jy, -cb / jy, 1.0 / jy
    m, x, rng = expm(h * a)[:4], np.zeros(4), np.random.default_rng(4)
    for k in range(300):
        part.M_x, part.M_y = rng.normal(size=2).tolist()
        part.do_step(k * h, h)
        x = m @ [*x, part.M_x, part.M_y]
        assert [part.alpha, part.beta] == pytest.approx(x[:2], rel=1e-11, abs=1e-12 * abs(x[:2]).max())


def test_torques_from_outside_precess_a_gyro_without_nutation():
    part = started(H=0.3, M_x=2e-3, M_y=-5e-3)
    run(part, 0.1, 1e-3)
    assert part.beta == pytest.approx(0.1 * 2e-3 / 0.3, rel=1e-12)  # H b' = M_x
    assert part.alpha == pytest.approx(0.1 * 5e-3 / 0.3, rel=1e-12)  # -H a' = M_y
    assert part.M_react == pytest.approx([0.0, 0.0, 0.1 * 2e-3**2 / 0.3], abs=1e-8)  # H b' sin b, no more


def tight(omega, moment, seconds, start=(0.0, 0.0, 0.0, 0.0)):
    """Gimbals at full size, from the rates of the rotor's frame: gyroscopic torque -(w x H z_i), by solve_ivp."""

    def right(_, x):
        alpha, beta, p, q = x
        to_outer = Rotation.from_euler("x", -alpha).as_matrix()  # v_outer = to_outer v_case
        wo = to_outer @ omega
        outer = np.array([p, q, wo[2]])  # inertial rates, outer axes, with the inner gimbal's own about y
        z_i = np.array([math.sin(beta), 0.0, math.cos(beta)])
        torque = -np.cross(outer, 10.0 * z_i)
        return [
            p - omega[0],
            q - wo[1],
            (torque[0] - 10.0 * (p - omega[0]) + moment[0]) / 0.5,
            (torque[1] - 2.0 * (q - wo[1]) + moment[1]) / 0.02,
        ]

    return solve_ivp(right, (0.0, seconds), start, "DOP853", rtol=1e-12, atol=1e-14).y[:, -1]


def test_full_size_gimbals_on_a_turning_base_against_a_tight_reference():
    """alpha to 0.4 rad, beta to 0.6 rad; the error falls with the square of the step (Rosenbrock-Euler)."""
    omega, moment = np.array([0.3, -0.4, 0.5]), (6.0, -5.0)
    exact = tight(omega, moment, 1.0)
    assert abs(exact[0]) > 0.15 and abs(exact[1]) > 0.4
    errors = []  # measured: 1.4e-7, 3.4e-8, 8.5e-9 rad
    for h in (2e-3, 1e-3, 5e-4):
        part = started(**POWER, full=1.0, step=1.0, omega=omega.tolist(), M_x=moment[0], M_y=moment[1])
        errors.append(abs(run(part, 1.0, h) - exact)[:2].max())
    print("error of the gimbal angles, h = 2, 1, 0.5 ms:", errors)
    assert errors[2] < 1.5e-8
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.2) and errors[1] / errors[2] == pytest.approx(4.0, rel=0.2)
    small = run(started(**POWER, omega=omega.tolist(), M_x=moment[0], M_y=moment[1]), 1.0, 1e-3)
    assert abs(small - exact)[:2].max() > 1e-2  # the cosines matter here: the test can fail


def test_undamped_gyroscopic_torque_does_no_work():
    """C = 0, M = 0: J_x p2 + J_y q2 stays; the step keeps it to 1e-6 over ten nutations at 0.2 ms."""
    part = started(**{**POWER, "C_x": 0.0, "C_y": 0.0}, full=1.0, p=1.0, psi_y=0.4)
    run(part, 10 * 2 * math.pi * math.sqrt(0.5 * 0.02) / 10.0, 2e-4)
    assert 0.5 * part.p**2 + 0.02 * part.q**2 == pytest.approx(0.5, rel=1e-6)


def test_reaction_is_the_momentum_balance():
    """Torque on the mount = -dh/dt + outside torque; h = J_x p about x, J_y q about y of the outer gimbal, H along
    the rotor.  At rest base the balance is exact about x and y of the outer gimbal, and of H about its z."""
    turned = Rotation.from_rotvec([0.3, -0.5, 0.9]).as_matrix()
    given = {"i_x": 3.0, "i_y": -4.0, "k_x": 0.01, "k_y": 0.02, "mount": turned.tolist(), "Dx_0": 0.003}
    start = {"psi_x": 0.3, "psi_y": -0.4, "p": 0.5, "q": -0.7}
    part = started(**POWER, full=1.0, M_x=2.0, M_y=-3.0, **given, **start)
    found = turned @ part.M_react
    found = Rotation.from_euler("x", -0.3).apply(found)  # outer gimbal axes
    h = 1e-6
    part.do_step(0.0, h)
    dp, dq, beta = (part.p - 0.5) / h, (part.q + 0.7) / h, -0.4
    rate = np.cross([0.5, -0.7, 0.0], 10.0 * np.array([math.sin(beta), 0.0, math.cos(beta)]))  # d(H z_i)/dt
    wanted = np.array([2.0 - 0.5 * dp, -3.0 - 0.02 * dq, 0.0]) - rate
    assert found == pytest.approx(wanted, rel=1e-4, abs=1e-3)


@pytest.mark.parametrize("inertia", [{}, {"J_x": 2e-4, "J_y": 1e-4, "C_x": 0.02, "C_y": 0.03}])
def test_reaction_of_a_gyro_in_rebalance(inertia):
    """Rotor carried along: the mount must turn H, and feels -omega x H (nutation settled or none)."""
    w = np.array([2e-3, -1e-3, 0.0])
    part = started(H=0.2, omega=w.tolist(), i_y=w[0] / 0.08, i_x=w[1] / 0.08, k_x=0.08, k_y=0.08, **inertia)
    run(part, 0.2, 1e-3)
    assert max(abs(part.alpha), abs(part.beta)) < 1e-5
    wanted = -np.cross(w, [0.0, 0.0, 0.2])
    assert part.get("M_react[1]") == pytest.approx(wanted[0], rel=1e-8)
    assert part.get("M_react[2]") == pytest.approx(wanted[1], rel=1e-8)
    assert abs(part.get("M_react[3]")) < 1e-8


def test_native_is_bit_equal_at_full_size():
    """reference.csv runs the small angles; this one the gimbals at full size with A taken anew each step."""
    values = {"full": 1.0, **POWER, "seed": 3.0, "stop": 1.2}
    rows = []
    for target in ("plain", "native"):
        one = make("gyro_2dof", target)
        one.set(values)
        one.set({"M_x": 6.0, "omega[3]": 0.4})
        one.initialize(0.0)
        for k in range(200):
            one.set({"M_y": math.sin(0.1 * k)})
            one.step(k * 1e-3, 1e-3)
        rows.append(one.get(["alpha", "beta", "M_react[1]", "M_react[2]", "M_react[3]", "u_x"]))
        one.free()
    assert rows[0] == rows[1] and abs(rows[0][1]) > 0.05


def test_the_stop_ends_the_run_with_time_and_angle():
    """beta = M_x t / H: 0.1 rad at 0.2 s."""
    part = started(H=10.0, M_x=5.0, stop=0.1)
    with pytest.raises(ComponentError, match=r"inner gimbal has reached its stop: beta = 0.1\d* rad \(t = 0.2"):
        run(part, 1.0, 1e-3)
    run(started(H=10.0, M_x=5.0), 1.0, 1e-3)  # none by default
    lock = started(**POWER, full=1.0, M_x=100.0)
    with pytest.raises(ComponentError, match=r"reached its stop: beta = 1\.[56]"):
        run(lock, 2.0, 1e-3)


@pytest.mark.parametrize(
    "parameters, message",
    [
        ({"full": 1.0}, "full = 1 .* needs nutation: J_x and J_y above 0"),
        ({"stop": 1.6}, "stop = 1.6 rad: the inner gimbal must stop before pi/2"),
        ({"stop": -0.1}, "stop = -0.1 rad must be >= 0"),
    ],
)
def test_refuses(parameters, message):
    with pytest.raises(ComponentError, match=message):
        started(**parameters)
