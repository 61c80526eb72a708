"""Third-order dynamics against the transfer functions of Hu 1981, the loop, and what it shares with floated_gyro."""

import math

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.signal import welch
from scipy.spatial.transform import Rotation
from wired import BENCH, DEG_H, NO_DRIFT, QUIET, FloatedGyro, Native, Wired, begun, given

from gyrobench.component import ComponentError
from gyrobench.drift import NAMES, STANDARD, drift
from gyrobench.packaging import load_part

CompliantGyro = load_part("compliant_gyro", BENCH)
H = 1e-3
G0 = 9.80665
STATES = ("float_angle", "float_rate", "rotor_I", "rotor_O")
RNG = np.random.default_rng(12)


def started(cls=CompliantGyro, **values):
    return begun(cls, **values)


def looped(late=False, **parameters):
    gyro, loop = given("compliant_gyro", **{**QUIET, **parameters}), Native("rebalance_analog", meter=0.0)
    return Wired({"gyro": gyro, "rebalance": loop}, ["gyro", "rebalance"], late=late)


# --------------------------------------------------------------------------------- transfer functions
def matrices(part):
    """A, and columns of (omega_I, omega_O, alpha_O, torque on the float), by differentiation of the equations."""
    a = np.array(part.jacobian())

    def column(name):
        return np.array(part.tangent({name: 1.0})[0])

    torque = column("i") / (-part.H * part.k)
    return a, np.column_stack([column("omega[1]"), column("omega[2]"), column("alpha[2]"), torque])


def response(part, s):
    """b / theta_I, b / theta_O and b / M at s; a case turning by theta has omega = s theta, alpha = s2 theta."""
    a, b = matrices(part)
    x = np.linalg.solve(s * np.eye(4) - a, b)[0]
    return x[0] * s, x[1] * s + x[2] * s * s, x[3]


def book(p, s):
    """DYN-IA, DYN-OA, DYN-TORQUE-TF as written there."""
    tau = p.J / p.C + p.H**2 / (p.K_I * p.C)
    cubic, square = p.H**2 * p.J / (p.K_I * p.K_O * p.C) * s**3, p.H**2 / (p.K_I * p.K_O) * s**2
    delta = cubic + square + tau * s + 1.0
    return (p.H / p.C) / delta, -(cubic + tau * s) / delta, (1.0 + square) / (p.C * s * delta)


@pytest.mark.parametrize("hertz", [0.1, 10.0, 100.0, 800.0, 868.0, 3000.0])
@pytest.mark.parametrize("parameters", [{}, {"H": 0.35, "J": 3e-4, "C": 0.5, "K_I": 700.0, "K_O": 300.0}])
def test_transfer_functions(parameters, hertz):
    part = started(**QUIET, **NO_DRIFT, **parameters)
    s = 2j * math.pi * hertz
    assert np.array(response(part, s)) == pytest.approx(np.array(book(part, s)), rel=1e-11)


def test_acceptance_numbers():
    """[DYN-DEFAULT]: tau 1.5 ms, poles, response to the case about I relative to H/C."""
    part = started(**QUIET, **NO_DRIFT)
    poles = sorted(np.linalg.eigvals(np.array(part.jacobian())), key=lambda z: (abs(z), z.imag))
    assert abs(poles[0]) < 1e-9  # the float integrates
    assert poles[1] == pytest.approx(-671.6, abs=0.05)
    assert [poles[2], poles[3]] == pytest.approx([-164 - 5455j, -164 + 5455j], abs=0.7)
    slow = response(part, 1e-4j)
    assert -slow[1].imag / 1e-4 == pytest.approx(1.5e-3, rel=1e-6)  # b / theta_O -> -tau s: minus, 1.5 ms
    for hertz, gain, phase in ((10.0, 0.99578, -5.384), (100.0, 0.74004, -43.495)):
        y = response(part, 2j * math.pi * hertz)[0] / (part.H / part.C)
        assert abs(y) == pytest.approx(gain, abs=5e-6)
        assert math.degrees(np.angle(y)) == pytest.approx(phase, abs=5e-4)


@pytest.mark.parametrize("h", [1e-4, 1e-3, 5e-3])
def test_linear_gyro_is_exact_for_held_inputs(h):
    part = started(**QUIET, **NO_DRIFT, step=1.0)
    c, j, spin, k_i, k_o = part.C, part.J, part.H, part.K_I, part.K_O
    a = np.array(  # b, r, x, y as in the README; held: torque, omega_O, alpha_O
        [
            [0, 1, 0, 0, 0, 0, 0],
            [0, -c / j, 0, k_o / j, 1 / j, 0, -1],
            [0, 0, 0, k_o / spin, 0, 0, 0],
            [0, -1, -k_i / spin, 0, 0, -1, 0],
            *np.zeros((3, 7)),
        ]
    )
    m = expm(h * a)[:4]
    x, worst, size = np.zeros(4), np.zeros(4), np.zeros(4)
    for k in range(500):
        part.i, w, acc = 1e-3 * RNG.normal(), 1e-3 * RNG.normal(), 0.01 * RNG.normal()
        part.omega, part.alpha = [0.0, w, 0.0], [0.0, acc, 0.0]
        part.do_step(k * h, h)
        x = m @ [*x, -spin * part.k * part.i, w, acc]
        size = np.maximum(size, abs(x))
        worst = np.maximum(worst, abs(np.array([getattr(part, n) for n in STATES]) - x))
    print(f"h = {h}: {(worst / size).max():.1g}")
    assert (worst / size).max() < 2e-11


def test_a_swinging_table_in_time():
    """100 Hz about I, sampled at 0.02 ms: amplitude and phase of the float angle as the acceptance number says."""
    part = started(**QUIET, **NO_DRIFT)
    h, w, theta = 2e-5, 2.0 * math.pi * 100.0, 1e-5
    rows = []
    for k in range(5000):
        part.omega = [theta * w * math.cos(w * (k + 0.5) * h), 0.0, 0.0]
        part.do_step(k * h, h)
        if k >= 3000:  # four whole periods, the 868 Hz ringing gone
            rows.append([(k + 1) * h, part.b])
    t, b = np.transpose(rows)
    y = 2.0 * np.mean(b * np.exp(-1j * w * t)) / (-1j * theta)  # theta sin w t = Im, b = |y| sin(w t + phase)
    assert abs(y) == pytest.approx(0.74004, rel=2e-4)
    assert math.degrees(np.angle(y)) == pytest.approx(-43.495, abs=0.02)


def test_stiff_limit_is_the_floated_gyro():
    given = {"omega": [1e-3, 2e-4, 3e-3], "alpha": [0.1, 0.02, 0.3], "f": [3.0, -4.0, 8.0], "i": 1e-3}
    stiff = started(**QUIET, **given, K_I=4e8, K_O=2e9)
    rigid = started(FloatedGyro, **QUIET, **given)
    for part in (stiff, rigid):
        for k in range(50):
            part.do_step(k * H, H)
    assert stiff.float_angle == pytest.approx(rigid.float_angle, rel=1e-5)
    assert stiff.float_rate == pytest.approx(rigid.float_rate, rel=1e-5)


# ------------------------------------------------------------------------------------------------ loop
def test_steady_state_is_the_measurement_equation():
    """k i (1 + k2 i + k3 i2) = omega_IA - omega_d, to the last digits, with every term and a mount."""
    mount = Rotation.random(random_state=3).as_matrix()
    w, f = RNG.normal(size=3) * 1e-4, RNG.normal(size=3) * 5.0
    some = {"mount": mount.tolist(), "D_OO": 0.2 * DEG_H, "k2": 0.5, "k3": 20.0}
    pair = looped(**some, omega=w.tolist(), f=f.tolist())
    for _ in range(5000):
        pair.step(H)
    gyro, i = pair.parts["gyro"], pair.parts["rebalance"].i
    wanted = (mount @ w)[0] - drift(-(mount @ f) / G0, {**STANDARD, "D_OO": 0.2 * DEG_H})
    assert gyro.k * i * (1.0 + 0.5 * i + 20.0 * i * i) == pytest.approx(wanted, rel=1e-12)
    assert abs(gyro.b) < 1e-17


@pytest.mark.parametrize("h, stable", [(1e-4, True), (1e-3, True), (5e-3, True), (2e-2, False)])
def test_loop_with_one_more_step_of_delay(h, stable):
    pair = looped(late=True, **NO_DRIFT, omega=[1e-6, 0.0, 0.0])
    for part in pair.parts.values():
        part.step = 1.0
    for _ in range(round(1.0 / h)):
        pair.step(h)
    assert (abs(pair.parts["gyro"].b) < 1e-9) is stable


def test_pickoff_saturates():
    for rate in (0.5, -0.5):
        part = started(**QUIET, **NO_DRIFT, omega=[rate, 0.0, 0.0])
        part.do_step(0.0, 0.1)
        assert (part.u, part.saturated) == (math.copysign(0.1, rate), 1.0)


# ------------------------------------------------------------------------------- drift, as floated_gyro
def test_same_drift_and_the_same_noise_as_the_floated_gyro():
    """The ports of noise stand in the same order: one seed, one drift, whatever the dynamics."""
    given = {"f": [3.0, -4.0, 8.0], "turn_on": 3e-8, "seed": 5}
    one, other = started(**given), started(FloatedGyro, **given)
    for k in range(50):
        one.do_step(k * H, H)
        other.do_step(k * H, H)
        assert one.drift == pytest.approx(other.drift, rel=1e-14)
    part = started(**QUIET, D_OO=0.3 * DEG_H)
    assert {n: getattr(part, n) for n in NAMES} == pytest.approx({**STANDARD, "D_OO": 0.3 * DEG_H}, rel=1e-15)
    for _ in range(10):
        part.f = (RNG.normal(size=3) * 10.0).tolist()
        part._dirty = True
        wanted = drift(-np.array(part.f) / G0, {**STANDARD, "D_OO": 0.3 * DEG_H})
        assert part.get("drift") == pytest.approx(wanted, rel=1e-13)


@pytest.mark.parametrize("h", [1e-3, 4e-3])
@pytest.mark.parametrize("port, name", [("white", "drift"), ("pickoff", "u")])
def test_noise_density_does_not_depend_on_the_step(port, name, h):
    n, size = 12_000, 3e-7
    part = started("compliant_gyro", **{**QUIET, **NO_DRIFT, port: size, "step": 1.0})
    x = np.empty(n)
    for k in range(n):
        part.do_step(k * h, h)
        x[k] = getattr(part, name)
    _, density = welch(x, 1 / h, nperseg=400, return_onesided=False)
    assert np.mean(density) == pytest.approx(size**2, rel=5 / math.sqrt(n))
    means = x.reshape(-1, 40).mean(axis=1)
    assert means.var() == pytest.approx(size**2 / (40 * h), rel=5 * math.sqrt(2 / len(means)))


# ------------------------------------------------------------------------------------------- refusals
@pytest.mark.parametrize(
    "parameters, message",
    [
        ({"mount": [[1, 0, 0], [0, 1, 2e-9], [0, 0, 1]]}, "mount is not a rotation matrix"),
        ({"mount": [[1, 0, 0], [0, 0, 1], [0, 1, 0]]}, "mount is left-handed"),
        ({"K_I": 0.0}, "K_I = 0 N.m/rad must be > 0"),
        ({"K_O": -1.0}, "K_O = -1 N.m/rad must be > 0"),
        ({"H": 0.0}, "H = 0 N.m.s must be > 0"),
        ({"J": 0.0}, "J = 0 kg.m2 must be > 0"),
        ({"C": 0.0}, "C = 0 N.m.s/rad must be > 0"),
        ({"K_sg": 0.0}, "K_sg = 0 V/rad must be > 0"),
        ({"k": 0.0}, "k = 0 rad/s/A must be > 0"),
        ({"u_max": 0.0}, "u_max = 0 V must be > 0"),
        ({"markov_tau": 0.0}, "markov_tau = 0 s must be > 0"),
        ({"pickoff": -1.0}, r"pickoff = -1 V/sqrt\(Hz\) must be >= 0"),
    ],
)
def test_refuses(parameters, message):
    with pytest.raises(ComponentError, match=message):
        started(**parameters)
