"""The static model with its sign, the rebalanced pendulum against closed forms, limit, noise."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.signal import welch
from scipy.spatial.transform import Rotation
from wired import BENCH, Native, record

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

AccelerometerPendulous = load_part("accelerometer_pendulous", BENCH)
H = 1e-3
G0 = 9.80665
QUIET = {"white": 0.0, "meter": 0.0}
ROUGH = {"k0": 1e-3, "k1": 1.01, "k2": 2e-3, "k3": -3e-3, "k4": 4e-3, "k5": -5e-3}


def started(f=(0.0, 0.0, 0.0), plain=False, **parameters):
    given = {**QUIET, **parameters}
    part = AccelerometerPendulous(**given) if plain else Native("accelerometer_pendulous", **given)
    part.f = [float(x) for x in f]
    part.initialize()
    return part


def settled(f, seconds=0.5, **parameters):
    part = started(f, **parameters)
    for k in range(round(seconds / H)):
        part.do_step(k * H, H)
    return part


# ---------------------------------------------------------------------------------------- static model
def test_sign_at_rest():
    """x up: f_x = +g, X = -1: lambda i = k0 - k1 + k2 - k3; x down: k0 + k1 + k2 + k3; 1 g0 is 1 mA."""
    up, down = settled([G0, 0.0, 0.0], **ROUGH), settled([-G0, 0.0, 0.0], **ROUGH)
    assert up.i == pytest.approx(1e-3 * (1e-3 - 1.01 + 2e-3 + 3e-3), rel=1e-12)
    assert down.i == pytest.approx(1e-3 * (1e-3 + 1.01 + 2e-3 - 3e-3), rel=1e-12)
    assert up.i < 0.0 < down.i
    # level, y up (Y = -1) and z up (Z = -1): no cross term without X
    assert settled([0.0, G0, 0.0], **ROUGH).i == pytest.approx(1e-6, rel=1e-12)
    # 45 degrees between x and y up: X = Y = -1/sqrt 2, X Y = +1/2; between x and z up: X Z = +1/2
    s = math.sqrt(0.5)
    own = 1e-3 - 1.01 * s + 2e-3 * 0.5 + 3e-3 * 0.5 * s
    assert settled([G0 * s, G0 * s, 0.0], **ROUGH).i == pytest.approx(1e-3 * (own + 2e-3), rel=1e-12)
    assert settled([G0 * s, 0.0, G0 * s], **ROUGH).i == pytest.approx(1e-3 * (own - 2.5e-3), rel=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_steady_state_is_the_model(seed):
    rng = np.random.default_rng(seed)
    mount = Rotation.random(random_state=seed).as_matrix()
    f = rng.normal(size=3) * 4.0
    x, y, z = -(mount @ f) / G0
    k = {n: rng.normal() * 1e-3 for n in ("k0", "k2", "k3", "k4", "k5")}
    part = settled(f, mount=mount.tolist(), scale=7000.0, k1=1.02, **k)
    model = k["k0"] + 1.02 * x + k["k2"] * x**2 + k["k3"] * x**3 + k["k4"] * x * y + k["k5"] * x * z
    assert part.scale * part.i == pytest.approx(G0 * model, rel=1e-12)
    assert abs(part.theta) < 1e-16 and part.saturated == 0.0


def test_harmonics_of_the_multi_point_test():
    """TEST-ACC-MULTI, theta0 = 0, 24 points: a = -g (sin, 0, cos) in mount a, g (-sin, cos, 0) in b."""
    theta = 2.0 * math.pi * np.arange(24) / 24
    k = {"k0": 5e-4, "k1": 1.001, "k2": 2e-4, "k3": -3e-4, "k4": 4e-4, "k5": -6e-4}
    for mount in "ab":
        y = []
        for s, c in zip(np.sin(theta), np.cos(theta), strict=True):
            a = [-s, 0.0, -c] if mount == "a" else [-s, c, 0.0]
            y.append(settled([-G0 * x for x in a], 0.5, **k).i * 1e3)  # lambda i in g0
        A = [np.mean(y)] + [2.0 * np.mean(y * np.cos(n * theta)) for n in (1, 2, 3)]
        B = [0.0] + [2.0 * np.mean(y * np.sin(n * theta)) for n in (1, 2, 3)]
        found = {"k0": A[0] + A[2], "k1": -(B[1] + 3.0 * B[3]), "k2": -2.0 * A[2], "k3": 4.0 * B[3]}
        found |= {"k5": 2.0 * B[2]} if mount == "a" else {"k4": -2.0 * B[2]}
        assert found == pytest.approx({n: k[n] for n in found}, abs=1e-12)
        assert A[1] == pytest.approx(0.0, abs=1e-12)


# -------------------------------------------------------------------------------------------- dynamics
def test_poles():
    part = started(plain=True)
    poles = sorted(np.linalg.eigvals(np.array(part.jacobian())), key=lambda z: (abs(z), z.imag))
    assert poles == pytest.approx([-87.4, -456 - 127j, -456 + 127j], abs=0.7)


@pytest.mark.parametrize("h", [1e-4, 1e-3, 5e-3])
def test_exact_for_held_forces(h):
    part = started(k0=0.0, k2=0.0, k3=0.0, k4=0.0, k5=0.0, step=1.0)
    j, c, k, p, lam = part.J, part.C, part.K, part.P, part.scale
    a = np.zeros((4, 4))  # th, rate, q; held: w
    a[0, 1] = a[2, 0] = 1.0
    a[1] = [-(k + p * lam * part.K_p) / j, -c / j, -p * lam * part.K_i / j, p / j]
    m = expm(h * a)[:3]
    rng = np.random.default_rng(4)
    x, worst, size = np.zeros(3), np.zeros(3), np.zeros(3)
    for n in range(500):
        w = 3.0 * rng.normal()
        part.f = [-w, 0.0, 0.0]
        part.do_step(n * h, h)
        x = m @ [*x, w]
        assert part.saturated == 0.0
        size = np.maximum(size, abs(x))
        worst = np.maximum(worst, abs(np.array([part.angle, part.rate, part.q]) - x))
    print(f"h = {h}: {(worst / size).max():.1g}")
    assert (worst / size).max() < 1e-11


def overload(t):
    """2 g0 for 0.2 s, beyond the range of 1.5 g0, then 1 g0, then -0.5 g0 (X of Hu 1981)."""
    return 2.0 if 0.1 <= t < 0.3 else 1.0 if t < 0.4 else -0.5


def continuous(part, until):
    def right(t, x):
        wish = part.K_p * x[0] + part.K_i * x[2]
        current = min(max(wish, -part.i_max), part.i_max)
        w = G0 * overload(t)
        torque = part.P * (w - part.scale * current) - part.C * x[1] - part.K * x[0]
        return [x[1], torque / part.J, 0.0 if (wish - current) * x[0] > 0.0 else x[0]]

    return solve_ivp(right, (0.0, until), [0.0] * 3, "LSODA", rtol=1e-9, atol=1e-14, max_step=1e-4, dense_output=True)


@pytest.mark.long
def test_overload_and_recovery():
    """The limit: first order in the step while it holds (README), bounded, no wind-up; exact before and after."""
    linear = dict.fromkeys(("k0", "k2", "k3", "k4", "k5"), 0.0)
    exact = continuous(started(**linear), 0.8).sol
    errors = []
    for h in (1e-3, 1e-4):
        part = started(**linear, step=h)
        rows = []
        for k in range(round(0.8 / h)):
            part.f = [-G0 * overload((k + 0.5) * h), 0.0, 0.0]
            part.do_step(k * h, h)
            rows.append([(k + 1) * h, part.theta, part.i, part.saturated])
        t, theta, i, limited = np.transpose(rows)
        assert abs(i).max() == part.i_max
        assert limited[t < 0.1].max() == 0.0 and limited[(t > 0.11) & (t < 0.3)].min() == 1.0
        assert theta.max() < 1.01 * part.P * 0.5 * G0 / part.K  # the spring: P (2 - 1.5) g0 / K
        error = abs(theta - exact(t)[0]) / abs(theta).max()
        assert error[t < 0.1].max() < 1e-11 and error[-1] < 1e-11
        assert i[-1] == pytest.approx(-0.5e-3, rel=1e-9)
        errors.append(error.max())
    print(f"overload: errors of the angle {errors[0]:.2g} (1 ms), {errors[1]:.2g} (0.1 ms)")
    assert errors[0] < 0.15
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=0.3)


def test_a_start_beyond_the_limit():
    """The first step, in which A is taken, may be one of overload: afterwards the loop is as ever."""
    part = started([-3.0 * G0, 0.0, 0.0], k0=0.0)
    part.q = 2e-4
    part.initialize()
    part.do_step(0.0, H)
    assert part.saturated == 1.0
    for k in range(1, 3000):
        part.f = [-0.3 * G0, 0.0, 0.0]
        part.do_step(k * H, H)
    assert part.saturated == 0.0
    assert part.i == pytest.approx(1e-3 * (0.3 + 20e-6 * 0.09 + 20e-6 * 0.027), rel=1e-11)


# ---------------------------------------------------------------------------------------- reading, noise
def test_resolution_of_the_reading():
    part = settled([-0.4321 * G0, 0.0, 0.0], resolution=1e-5, k0=0.0, k2=0.0, k3=0.0)
    assert part.i == pytest.approx(0.4321e-3, rel=1e-12)
    assert part.i_read == pytest.approx(0.43e-3, rel=1e-12)


@pytest.mark.parametrize("h", [1e-3, 4e-3])
def test_noise_of_the_reading(h):
    n, size = 12_000, 1e-9
    part = started(k0=0.0, meter=size, step=1.0)
    x = record(part, n, h, "i_read")
    _, density = welch(x, 1 / h, nperseg=400, return_onesided=False)
    assert np.mean(density) == pytest.approx(size**2, rel=5 / math.sqrt(n))


@pytest.mark.parametrize("h", [1e-3, 4e-3])
def test_white_acceleration_noise(h):
    """Inside the bandwidth lambda i carries the density: the variance of means over 0.4 s is size2 / 0.4."""
    n, size = 24_000, 5e-5
    part = started(k0=0.0, white=size, step=1.0)
    x = record(part, n, h, "i")[200:]
    m = round(0.4 / h)
    means = part.scale * x[: len(x) // m * m].reshape(-1, m).mean(axis=1)
    assert means.var() == pytest.approx(size**2 / 0.4, rel=5 * math.sqrt(2 / len(means)))


@pytest.mark.long
def test_random_bias():
    first, constant = [], []
    for seed in range(1000):
        part = started(plain=True, k0=0.0, markov=1e-4, seed=seed)
        first.append(part.markov_value)
        part = settled([0.0, 0.0, 0.0], 0.3, k0=0.0, turn_on=3e-4, seed=seed) if seed < 300 else part
        constant.append(part.scale * part.i)
    assert np.std(first) == pytest.approx(1e-4, rel=5 / math.sqrt(2000))
    assert np.std(constant[:300]) == pytest.approx(3e-4, rel=5 / math.sqrt(600))
    part = started(k0=0.0, markov=2e-4, markov_tau=1.0, step=1.0)
    x = record(part, 16_000, 0.1, "markov_value")
    independent = 1600.0 / 2.0
    assert x.var() == pytest.approx(4e-8, rel=5 * math.sqrt(2 / independent))
    assert np.mean(x[10:] * x[:-10]) / 4e-8 == pytest.approx(math.exp(-1.0), abs=5 * math.sqrt(2 / independent))


# ------------------------------------------------------------------------------------------- refusals
@pytest.mark.parametrize(
    "parameters, message",
    [
        ({"K_i": 400.0}, r"the rebalance is unstable: .* K_p = 0.3, K_i = 400"),
        ({"mount": [[1, 0, 0], [0, 1, 2e-9], [0, 0, 1]]}, "mount is not a rotation matrix"),
        ({"mount": [[1, 0, 0], [0, 0, 1], [0, 1, 0]]}, "mount is left-handed"),
        ({"scale": 0.0}, "scale = 0 m/s2/A must be > 0"),
        ({"k1": -1.0}, "k1 = -1 1 must be > 0"),
        ({"J": 0.0}, "J = 0 kg.m2 must be > 0"),
        ({"C": 0.0}, "C = 0 N.m.s/rad must be > 0"),
        ({"K": 0.0}, "K = 0 N.m/rad must be > 0"),
        ({"P": -1.0}, "P = -1 kg.m must be > 0"),
        ({"K_i": 0.0}, r"K_i = 0 A/\(rad.s\) must be > 0"),
        ({"i_max": 0.0}, "i_max = 0 A must be > 0"),
        ({"resolution": -1.0}, "resolution = -1 A must be >= 0"),
        ({"white": -1.0}, r"white = -1 m/s2/sqrt\(Hz\) must be >= 0"),
    ],
)
def test_refuses(parameters, message):
    with pytest.raises(ComponentError, match=message):
        started(**parameters)


def test_unstable_means_unstable():
    """At 0.99 of the limit of the refusal the poles are left of the axis, at the limit they are on it."""
    part = started(plain=True)
    torquer = part.scale * part.P
    limit = part.C * (part.K + torquer * part.K_p) / (part.J * torquer)
    part = started(plain=True, K_i=0.99 * limit)
    assert -20.0 < max(np.linalg.eigvals(np.array(part.jacobian())).real) < 0.0
    with pytest.raises(ComponentError, match="unstable"):
        started(K_i=1.0001 * limit)
