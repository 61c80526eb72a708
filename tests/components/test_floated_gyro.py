"""Dynamics against closed forms, the static model, and the statistics of the random drift."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.signal import welch
from scipy.spatial.transform import Rotation
from wired import DEG_H, NO_DRIFT, QUIET, FloatedGyro, Native, RebalanceAnalog, Wired, begun, given, record

from gyrobench.component import ComponentError
from gyrobench.drift import NAMES, STANDARD, drift

H = 1e-3
G0 = 9.80665
RNG = np.random.default_rng(11)


def started(plain=False, **values):
    return begun(FloatedGyro if plain else "floated_gyro", **values)


def looped(h=H, late=False, **parameters):
    """Gyro and rebalance; the gyro sees the current of the step before."""
    gyro, loop = given("floated_gyro", **{**QUIET, **parameters}), Native("rebalance_analog", meter=0.0)
    return Wired({"gyro": gyro, "rebalance": loop}, ["gyro", "rebalance"], late=late)


# ------------------------------------------------------------------------------------------- dynamics
def discrete(part, h):
    """Exact step of b' = r, r' = (-C r + w) / J with w held: from expm of the extended matrix."""
    c, j = part.C, part.J
    m = expm(h * np.array([[0.0, 1.0, 0.0], [0.0, -c / j, 1.0 / j], [0.0, 0.0, 0.0]]))
    return m[:2, :2], m[:2, 2]


@pytest.mark.parametrize("h", [1e-4, 1e-3, 5e-3])
def test_linear_gyro_is_exact_for_held_inputs(h):
    part = started(**QUIET, **NO_DRIFT, step=1.0)
    a, b = discrete(part, h)
    x = np.zeros(2)
    worst = 0.0
    for k in range(500):
        part.i = 1e-3 * RNG.normal()
        part.alpha = [0.0, 0.01 * RNG.normal(), 0.0]
        part.do_step(k * h, h)
        x = a @ x + b * (-part.H * part.k * part.i - part.J * part.alpha[1])
        worst = max(worst, *abs(np.array([part.float_angle, part.float_rate]) - x) / abs(x).max())
    assert worst < 1e-12


def test_closed_loop_step_against_its_matrix():
    """Gyro and rebalance with held exchange: one matrix a step, from expm, to 1e-12."""
    pair = looped(**NO_DRIFT, omega=[1e-4, 0.0, 0.0])
    gyro, loop = pair.parts["gyro"], pair.parts["rebalance"]
    a, b = discrete(gyro, H)
    x, q, i = np.zeros(2), 0.0, 0.0
    track, exact = [], []
    for _ in range(2000):
        pair.step(H)
        x = a @ x + b * gyro.H * (1e-4 - gyro.k * i)
        u = gyro.K_sg * x[0]
        q = q + H * u
        i = loop.K_p * u + loop.K_i * q
        track.append([gyro.float_angle, loop.i])
        exact.append([x[0], i])
    track, exact = np.array(track), np.array(exact)
    # cos b = 1 - 1e-11 at the largest b of 5e-6 rad: far below
    assert (abs(track - exact).max(axis=0) / abs(exact).max(axis=0) < 1e-12).all()
    # and close to the continuous loop: slowest pole -11.25 1/s
    assert track[-1, 1] == pytest.approx(1e-4 / gyro.k, rel=1e-9)


def test_steady_state_is_the_measurement_equation():
    """k i = omega_IA - omega_d, to the last digits, with every term and a mount."""
    mount = Rotation.random(random_state=3).as_matrix()
    w, f = RNG.normal(size=3) * 1e-4, RNG.normal(size=3) * 5.0
    pair = looped(mount=mount.tolist(), omega=w.tolist(), f=f.tolist(), terms=10, D_OO=0.2 * DEG_H)
    for _ in range(5000):
        pair.step(H)
    gyro, loop = pair.parts["gyro"], pair.parts["rebalance"]
    wanted = (mount @ w)[0] - drift(-(mount @ f) / G0, {**STANDARD, "D_OO": 0.2 * DEG_H})
    assert gyro.k * loop.i == pytest.approx(wanted, rel=1e-13)
    assert abs(gyro.b) < 1e-18


def test_torquer_nonlinearity():
    pair = looped(**NO_DRIFT, omega=[1e-3, 0.0, 0.0], k2=0.5, k3=20.0)
    for _ in range(5000):
        pair.step(H)
    gyro, i = pair.parts["gyro"], pair.parts["rebalance"].i
    assert gyro.k * i * (1 + 0.5 * i + 20.0 * i * i) == pytest.approx(1e-3, rel=1e-13)
    assert abs(gyro.k * i / 1e-3 - 1) > 5e-3


@pytest.mark.parametrize("h, stable", [(1e-4, True), (1e-3, True), (5e-3, True), (2e-2, False)])
def test_loop_with_one_more_step_of_delay(h, stable):
    # [REBAL-COSIM]: stable with a full step of delay at 0.1, 1 and 5 ms, unstable at 20 ms
    pair = looped(late=True, **NO_DRIFT, omega=[1e-6, 0.0, 0.0])
    for part in pair.parts.values():
        part.step = 1.0
    for _ in range(round(1.0 / h)):
        pair.step(h)
    assert (abs(pair.parts["gyro"].b) < 1e-9) is stable


def test_output_axis_acceleration_and_low_frequency_gain():
    # free float: r settles at -(J/C) alpha_O; after a pulse of rate the angle is (H/C) times the angle of the case
    part = started(**QUIET, **NO_DRIFT, alpha=[0.0, 0.05, 0.0])
    for k in range(50):
        part.do_step(k * H, H)
    assert part.float_rate == pytest.approx(-2e-4 / 0.2 * 0.05, rel=1e-12)
    part = started(**QUIET, **NO_DRIFT, H=0.3, omega=[1e-4, 0.0, 0.0])
    part.do_step(0.0, H)
    part.omega = [0.0, 0.0, 0.0]
    for k in range(1, 50):
        part.do_step(k * H, H)
    assert part.float_angle == pytest.approx(0.3 / 0.2 * 1e-7, rel=1e-6)
    assert part.get("u") == pytest.approx(10.0 * part.float_angle, rel=1e-15)


def reference(part, omega, i, until):
    def right(_, x):
        torque = part.H * (omega[0] * math.cos(x[0]) - omega[2] * math.sin(x[0]) - part.k * i) - part.C * x[1]
        return [x[1], torque / part.J]

    return solve_ivp(right, (0.0, until), [0.0, 0.0], "DOP853", rtol=1e-12, atol=1e-18).y[0, -1]


@pytest.mark.parametrize(
    "omega, until, bound",
    [([7e-4, 0.0, 7e-4], 0.5, 1e-10), ([0.02, 0.0, 0.05], 0.5, 1e-7), ([0.2, 0.0, 0.5], 0.5, 1e-5)],
)
def test_cross_coupling_against_a_tight_reference(omega, until, bound):
    """The README's numbers: error of the free float, relative to its angle, with the nonlinear coupling."""
    part = started(**QUIET, **NO_DRIFT, omega=omega, u_max=10.0)
    for k in range(round(until / H)):
        part.do_step(k * H, H)
    exact = reference(part, omega, 0.0, until)
    error = abs(part.float_angle / exact - 1.0)
    print(f"{omega}: angle {exact:.3g} rad, relative error {error:.2g}")
    assert error < bound


def test_pickoff_saturates():
    part = started(**QUIET, **NO_DRIFT, omega=[0.5, 0.0, 0.0])
    part.do_step(0.0, 0.1)
    assert part.u == 0.1 and part.saturated == 1.0 and part.b > 0.01
    part = started(**QUIET, **NO_DRIFT, omega=[-0.5, 0.0, 0.0])
    part.do_step(0.0, 0.1)
    assert part.u == -0.1 and part.saturated == 1.0


# ---------------------------------------------------------------------------------------- static model
def test_standard_gyro():
    part = started(plain=True, **QUIET)
    assert {n: getattr(part, n) for n in NAMES} == pytest.approx(STANDARD, rel=1e-15)
    for _ in range(10):
        f = RNG.normal(size=3) * 10.0
        part.f = f.tolist()
        part._dirty = True
        assert part.get("drift") == pytest.approx(drift(-f / G0, STANDARD), rel=1e-13)


def test_ageing_and_temperature_in_torque_sign():
    """Hu 1981, eq. 2-39..2-42 written out in torque sign, omega_d = -omega_M."""
    d_k, u_x, u_y, u_z = 2e-6, 3e-6, -1e-6, 4e-6
    t_zx, t_yy, t_xz = 5e-8, 6e-8, 7e-8
    part = started(
        **QUIET,
        **{**NO_DRIFT, "D_F": -d_k, "D_I": -u_z, "D_O": -u_y, "D_S": u_x},
        p_F=1e-3,
        p_I=2e-3,
        p_O=3e-3,
        p_S=4e-3,
        D_TI=t_zx,
        D_TO=t_yy,
        D_TS=t_xz,
        age=100.0,
        dT=[0.3, -0.4, 0.5],
        D_vI=-0.5,
        D_vO=1.5,
        D_vS=2.0,
        v_float=[1e-6, 2e-6, -3e-6],
        f=[-2 * G0, -3 * G0, 5 * G0],
    )
    t = 100.0
    x, y, z = 2.0, 3.0, -5.0
    torque_sign = (
        d_k * (1 + 1e-3 * t)
        + (0.5 * 1e-6 - 1.5 * 2e-6 + 2.0 * 3e-6)  # D_vx = 0.5, D_vy = -1.5, D_vz = -2 in torque sign
        + (u_z * (1 + 2e-3 * t) - t_zx * 0.5) * x
        + (u_y * (1 + 3e-3 * t) + t_yy * -0.4) * y
        + (-u_x * (1 + 4e-3 * t) + t_xz * 0.3) * z
    )
    assert part.drift == pytest.approx(-torque_sign, rel=1e-14)
    part.do_step(0.0, 10.0)
    assert part.drift == pytest.approx(
        -torque_sign - 10.0 * (d_k * 1e-3 + u_z * 2e-3 * x + u_y * 3e-3 * y - u_x * 4e-3 * z)
    )


# --------------------------------------------------------------------------------------- random drift
@pytest.mark.parametrize("h", [1e-3, 4e-3])
@pytest.mark.parametrize("port, name", [("white", "drift"), ("pickoff", "u")])
def test_noise_density_does_not_depend_on_the_step(port, name, h):
    n, size = 16_000, 3e-7
    part = started(**{**QUIET, **NO_DRIFT, port: size, "step": 1.0})
    x = record(part, n, h, name)
    _, density = welch(x, 1 / h, nperseg=400, return_onesided=False)
    assert np.mean(density) == pytest.approx(size**2, rel=5 / math.sqrt(n))
    low, high = density[1:100].mean(), density[100:200].mean()
    assert low == pytest.approx(high, rel=0.15)  # flat
    means = x.reshape(-1, 40).mean(axis=1)
    assert means.var() == pytest.approx(size**2 / (40 * h), rel=5 * math.sqrt(2 / len(means)))


@pytest.mark.parametrize("h", [0.05, 0.2])
def test_gauss_markov_variance_and_correlation(h):
    rms, tau, n = 2e-8, 1.0, 16_000
    part = started(**{**QUIET, **NO_DRIFT, "markov": rms, "markov_tau": tau, "step": 1.0})
    x = record(part, n, h)
    independent = n * h / (2 * tau)
    assert x.var() == pytest.approx(rms**2, rel=5 * math.sqrt(2 / independent))
    for lag in (0.4, 1.0, 2.0):
        k = round(lag / h)
        r = np.mean(x[k:] * x[:-k]) / rms**2
        assert r == pytest.approx(math.exp(-lag / tau), abs=5 * math.sqrt(2 / independent))


@pytest.mark.long
def test_gauss_markov_starts_stationary_and_turn_on_is_one_value_a_run():
    first, constant = [], []
    for seed in range(1500):
        part = started(plain=True, **{**QUIET, **NO_DRIFT, "markov": 1e-8, "seed": seed})
        first.append(part.drift)
        part = started(plain=True, **{**QUIET, **NO_DRIFT, "turn_on": 3e-8, "seed": seed})
        constant.append(part.drift)
    spread = 5 / math.sqrt(2 * 1500)
    assert np.std(first) == pytest.approx(1e-8, rel=spread)
    assert np.std(constant) == pytest.approx(3e-8, rel=spread)
    before = part.drift
    record(part, 100, H)
    assert part.drift == before


def test_default_noise_scatters_a_minute_by_3_thousandths():
    """Variance of the 60 s mean of k i: white and Gauss-Markov in closed form, pickoff through the loop."""
    part, loop = started(), RebalanceAnalog()
    T, tau = 60.0, part.markov_tau
    white = part.white**2 / T
    markov = part.markov**2 * 2 * tau / T * (1 - tau / T * (1 - math.exp(-T / tau)))
    meter = (part.k * loop.meter) ** 2 / T
    # pickoff: states b, r, q, sum of i; u = K_sg b + v / sqrt(h), the gyro sees i of the step before
    a, b = discrete(part, H)
    m, s = np.zeros((5, 5)), np.zeros(5)  # b, r, q, i, sum
    m[:2, :2], m[:2, 3] = a, -b * part.H * part.k
    out = part.K_sg * m[0]
    m[2] = H * out
    m[2, 2] += 1.0
    m[3] = loop.K_p * out + loop.K_i * m[2]
    m[4] = m[3]
    m[4, 4] += 1.0
    v = part.pickoff / math.sqrt(H)
    s[2], s[3] = H * v, (loop.K_p + loop.K_i * H) * v
    s[4] = s[3]
    p = np.zeros((5, 5))
    for _ in range(3000):
        p = m @ p @ m.T + np.outer(s, s)
    p[4], p[:, 4] = 0.0, 0.0
    for _ in range(60_000):
        p = m @ p @ m.T + np.outer(s, s)
    pickoff = part.k**2 * p[4, 4] / 60_000**2
    parts = [math.sqrt(x) / DEG_H for x in (white, markov, pickoff, meter)]
    assert parts == pytest.approx([0.0023, 0.0019, 0.0002, 0.0002], abs=6e-5)
    assert math.sqrt(white + markov + pickoff + meter) / DEG_H == pytest.approx(0.0030, abs=1e-4)


# ------------------------------------------------------------------------------------------- refusals
def only(*names):
    return {**NO_DRIFT, **{n: STANDARD[n] or DEG_H for n in names}}


@pytest.mark.parametrize(
    "terms, names",
    [
        (3, ("D_F", "D_I", "D_S")),
        (4, ("D_F", "D_I", "D_S", "D_IS")),
        (5, ("D_F", "D_I", "D_S", "D_II", "D_IS")),
        (8, ("D_F", "D_I", "D_S", "D_II", "D_SS", "D_IO", "D_OS", "D_IS")),
        (9, ("D_F", "D_I", "D_O", "D_S", "D_II", "D_SS", "D_IO", "D_OS", "D_IS")),
        (10, NAMES),
    ],
)
def test_term_sets(terms, names):
    started(terms=terms, **only(*names))
    for outside in set(NAMES) - set(names):
        with pytest.raises(ComponentError, match=f"{outside} must be 0 with terms = {terms}"):
            started(terms=terms, **only(*names, outside))


@pytest.mark.parametrize(
    "parameters, message",
    [
        ({"terms": 7}, "terms = 7 is not a static model: it must be 3, 4, 5, 8, 9 or 10"),
        ({"mount": [[1, 0, 0], [0, 1, 2e-9], [0, 0, 1]]}, "mount is not a rotation matrix"),
        ({"mount": [[1, 0, 0], [0, 0, 1], [0, 1, 0]]}, "mount is left-handed"),
        ({"H": 0.0}, "H = 0 N.m.s must be > 0"),
        ({"J": -1.0}, "J = -1 kg.m2 must be > 0"),
        ({"C": -0.1}, "C = -0.1 N.m.s/rad must be >= 0"),
        ({"K_sg": 0.0}, "K_sg = 0 V/rad must be > 0"),
        ({"k": 0.0}, "k = 0 rad/s/A must be > 0"),
        ({"u_max": 0.0}, "u_max = 0 V must be > 0"),
        ({"markov_tau": 0.0}, "markov_tau = 0 s must be > 0"),
        ({"white": -1.0}, r"white = -1 rad/s/sqrt\(Hz\) must be >= 0"),
        ({"age": -1.0}, "age = -1 s must be >= 0"),
    ],
)
def test_refuses(parameters, message):
    with pytest.raises(ComponentError, match=message):
        started(**parameters)
