"""alignment_controller on a platform written from vectors: steady errors, settling, two positions, sigma, refusals.

The platform is a rotation matrix that turns at command + drift against the Earth rate (Rodrigues), no code of the
parts; the settling is held against a continuous model under scipy.  [ALIGN-GYRO]
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from native_parts import make
from scipy.integrate import solve_ivp

from gyrobench.packaging.instance import InstanceError

W, G = 7.2921159e-5, 9.80665
DPH, ARCMIN = math.pi / 648000.0, math.pi / 10800.0
LAT = 0.7
N, U = W * math.cos(LAT), W * math.sin(LAT)
KNOWN = ("bias", "markov", "white", "accelerometer", "force", "latitude", "scale", "vibration")
EXACT = {f"errors_{n}": 0.0 for n in KNOWN}  # the controller is told of no error
H = 0.5
SHORT = {"period": H, "level_frequency": 0.2, "level_time": 90.0, "wanted": 0.0,
         "fast_frequency": 0.03, "slow_frequency": 0.03}  # fmt: skip
NAMES = ["command[1]", "command[2]", "command[3]", "heading", "sigma", "mode", "status", "ready", "done",
         "tilt[1]", "tilt[2]", "correction[1]", "correction[2]", "correction[3]"]  # fmt: skip


def turn(v: np.ndarray) -> np.ndarray:
    """Rotation by a rotation vector (Rodrigues), passive."""
    size = float(np.linalg.norm(v)) or 1e-30
    K = np.array([[0.0, v[2], -v[1]], [-v[2], 0.0, v[0]], [v[1], -v[0], 0.0]]) / size
    return np.eye(3) + math.sin(size) * K + (1.0 - math.cos(size)) * K @ K


def align(
    time: float, psi: float = 0.7, drift: Any = (0.0, 0.0, 0.0), bias: Any = (0.0, 0.0), scale: float = 0.0,
    push: float = 0.0, latitude: float = LAT, **parameters: Any,
) -> dict[str, np.ndarray]:  # fmt: skip
    """Columns of a run: time, error of the heading, true tilt about x and y, and the outputs, every H."""
    part = make("alignment_controller", "native")
    part.set({"latitude": LAT, "time_limit": time, **SHORT, **parameters})
    part.initialize(0.0)
    C = turn(np.array([0.0, 0.02, 0.0])) @ turn(np.array([-0.03, 0.0, 0.0])) @ turn(np.array([0.0, 0.0, -psi]))
    earth = np.array([0.0, W * math.cos(latitude), W * math.sin(latitude)])
    command, rows = np.zeros(3), []
    for k in range(round(time / H)):
        rate = command * [1.0, 1.0, 1.0 + scale] + drift - C @ earth
        middle = turn(0.5 * H * rate) @ C
        C = turn(H * rate) @ C
        f = middle @ [push * math.sin(k), 0.0, G] + [bias[0], bias[1], 0.0]
        part.set({f"f[{j + 1}]": f[j] for j in range(3)})
        part.step(k * H, H)
        out = part.get(NAMES)
        command = np.array(out[:3])
        true = math.atan2(C[1, 0], C[1, 1])
        rows.append([(k + 1) * H, math.remainder(out[3] - true, 2.0 * math.pi), C[1, 2], -C[0, 2], *out])
        if out[8]:
            break
    part.free()
    return dict(zip(["t", "error", "phi_x", "phi_y", *NAMES], np.array(rows).T, strict=True))


# ------------------------------------------------------------------------------------- steady errors
@pytest.mark.parametrize("order", [3, 2])
@pytest.mark.long
def test_steady_errors_are_those_of_the_loops(order: int) -> None:
    """By hand, at rest.  x east, y north; drift d, accelerometer bias b along x and y; heading error = psi - true.

    t_x = phi_x + b_y/g = 0, t_y = phi_y - b_x/g = 0;   0 = d_x + U phi_y - N phi_z:   phi_z = d_x/N + tan(L) b_x/g.
    Order 2: t_x k2/N + N phi_x + d_z = 0 is not 0:  t_x = -N d_z/(k2 + N2), k1 t_x more in the first: phi_z grows by
    2 z w d_z/(w2) = 2 z d_z/w.
    """
    d, b, w = np.array([0.01, 0.02, 0.03]) * DPH, (2e-4, -1e-4), 0.03
    run = align(700.0, drift=d, bias=b, order=order)
    expected = d[0] / N + math.tan(LAT) * b[0] / G + (2.0 * 0.70710678 * d[2] / w if order == 2 else 0.0)
    assert run["error"][-1] == pytest.approx(expected, rel=2e-3)
    assert run["phi_x"][-1] == pytest.approx(-b[1] / G, abs=3e-8)
    assert run["phi_y"][-1] == pytest.approx(b[0] / G, abs=3e-8)
    assert abs(run["heading"][-1]) < 1e-12 and run["mode"][-1] == 7.0


def test_settling_is_that_of_a_continuous_model() -> None:
    """From the first gyrocompass period on: nonlinear platform, gains of (s + w)(s2 + 2 z w s + w2), under scipy."""
    d, w, z = np.array([0.3, -0.2, 0.4]) * DPH, 0.03, 0.70710678
    run = align(400.0, drift=d)
    first = int(np.argmax(run["mode"] == 6.0))
    t0 = run["t"][first]

    def flow(_: float, x: np.ndarray) -> np.ndarray:
        """x: rows of C (9), J_y, integral, tilt as the azimuth takes it."""
        C = x[:9].reshape(3, 3)
        f = C @ [0.0, 0.0, G]
        tx, ty = math.atan2(f[1], f[2]), math.atan2(-f[0], f[2])
        c = [-(1 + 2 * z) * w * tx, N + x[9] - 2 * z * w * ty, U + x[10] + (1 + 2 * z) * w * w / N * x[11]]
        r = np.array(c) + d - C @ [0.0, N, U]
        K = np.array([[0.0, r[2], -r[1]], [-r[2], 0.0, r[0]], [r[1], -r[0], 0.0]])
        return np.concatenate([(K @ C).ravel(), [-w * w * ty, w**3 / N * tx, 10.0 * w * (tx - x[11])]])

    C = turn(np.array([run["phi_x"][first], run["phi_y"][first], 0.0])) @ turn(np.array([0, 0, run["error"][first]]))
    start = np.concatenate([C.ravel(), [run["correction[2]"][first], run["correction[3]"][first], 0.0]])
    t = run["t"][first:]
    found = solve_ivp(flow, (t0, t[-1]), start, t_eval=t, rtol=1e-10, atol=1e-13).y
    heading = -np.arctan2(found[3], found[4])
    moved = np.ptp(run["error"][first:])
    assert moved > 20.0 * ARCMIN  # the drift that the turn brought to the east gyro
    assert np.abs(heading - run["error"][first:]).max() < 0.03 * moved  # delay of a period and a half: w T = 0.02


def test_two_positions_take_the_drift_and_the_accelerometers_out() -> None:
    """Half differences and half sums: neither drifts of x, y nor accelerometer bias are left."""
    values: dict[str, Any] = {"drift": np.array([0.2, -0.1, 0.0]) * DPH, "bias": (5e-4, -3e-4), "psi": 2.5}
    one, two = align(500.0, **values), align(650.0, positions=2, coarse_time=100.0, **values)
    at = int(np.argmax(two["mode"] == 5.0))
    assert abs(one["error"][-1]) > 50.0 * ARCMIN
    assert abs(two["error"][at]) < 0.1 * ARCMIN and abs(two["error"][-1]) < 1.0 * ARCMIN
    tilt = np.array([5e-4, -3e-4]) / G  # J = -(d + U phi_y, d - U phi_x)
    residual = np.array([0.2, -0.1]) * DPH + U * np.array([tilt[0], tilt[1]])
    assert two["correction[1]"][at] == pytest.approx(-residual[0], rel=5e-3)
    assert two["correction[2]"][at] == pytest.approx(-residual[1], rel=5e-3)


# ------------------------------------------------------------------------------------------- sigma
CASES: dict[str, tuple[str, float, list[dict[str, Any]]]] = {
    "drift": ("bias", 0.01 * DPH, [{"drift": 0.01 * DPH * np.eye(3)[k]} for k in range(3)]),
    "accelerometer": ("accelerometer", 2e-4, [{"bias": (2e-4, 0.0)}, {"bias": (0.0, 2e-4)}]),
    "scale": ("scale", 1e-3, [{"scale": 1e-3}]),
}


@pytest.mark.parametrize("positions", [1, 2])
@pytest.mark.parametrize("name", CASES)
def test_sigma_is_the_response_to_each_error(name: str, positions: int) -> None:
    """With one kind of error alone sigma2 is the sum of the squares of what an error of that size does on each axis."""
    key, size, errors = CASES[name]
    both: dict[str, Any] = {"positions": positions, "time": 660.0, "coarse_time": 40.0, "psi": -1.2}
    none = align(**both, **EXACT)
    runs = [align(**both, **{**EXACT, f"errors_{key}": size}, **e) for e in errors]
    squares = np.sqrt(sum((r["error"] - none["error"]) ** 2 for r in runs))
    for mode in (5.0, 6.0):
        at = int(np.argmax(runs[0]["mode"] == mode))
        assert runs[0]["sigma"][at] == pytest.approx(squares[at], rel=0.02, abs=0.02 * ARCMIN), mode
    fine = runs[0]["mode"] >= 6.0
    largest = max(squares[fine].max(), 0.5 * ARCMIN)
    assert np.abs(runs[0]["sigma"] - squares)[fine].max() < 0.06 * largest


def test_sigma_of_a_window_is_that_of_a_slope() -> None:
    """Weight 6x(1 - x)/T: white rates leave 1.2 Ng2/T, white tilt of density S 12 S2/T3 (slope by least squares)."""
    white, force, T = 0.1 * DPH, 1e-3, 200.0
    for values, rate in (
        ({"errors_white": white}, math.sqrt(1.2 * white**2 / T)),
        ({"errors_force": force}, force / G * math.sqrt(12.0 / T**3)),
    ):
        run = align(350.0, coarse_time=T, **{**EXACT, **values})
        assert run["sigma"][run["mode"] == 5.0][0] == pytest.approx(rate / N, rel=0.06)


def test_sigma_of_a_window_on_a_base_that_vibrates() -> None:
    """Each velocity v_n of the base alone through the levelling loop, period by period, of which the mean command is
    a sum: t = phi + (v_n - v_n-1)/(g h).  To 6 %: the loop reads the tilt a period late, k h = 0.07.
    """
    v, T, w, z = 3e-4, 60.0, 0.1, math.sqrt(0.5)
    both: dict[str, Any] = {"time": 420.0, "coarse_time": T, "level_frequency": w, **EXACT}
    still, run = align(**both), align(**{**both, "errors_vibration": v})
    at = int(np.argmax(run["mode"] == 5.0))
    assert at > 0
    n, before = round(T / H), round(150.0 / H)
    each = np.eye(before + n)  # columns: runs with one velocity alone
    phi, J, c, mean = (np.zeros(before + n) for _ in range(4))
    for k in range(before + n):
        t = phi + 0.5 * H * c + (each[k] - (each[k - 1] if k else 0.0)) / (G * H)
        phi = phi + H * c
        J = J - w * w * H * t
        c = J - 2.0 * z * w * t
        x = (k - before + 0.5) / n
        mean = mean + (6.0 * x * (1.0 - x) / n * c if x > 0.0 else 0.0)
    expected = v * float(np.linalg.norm(mean)) / N
    assert math.sqrt(run["sigma"][at] ** 2 - still["sigma"][at] ** 2) == pytest.approx(expected, rel=0.06)


def test_sigma_in_the_steady_state_is_that_of_lyapunov() -> None:
    """Lyapunov equation at z = 0.7071: white tilt S leaves 1.2640 S w^1.5/N, white rates 0.9939 Ng sqrt(w)/N."""
    w, white, force = 0.03, 0.1 * DPH, 1e-4
    for values, expected in (
        ({"errors_white": white}, 0.9939 * white * math.sqrt(w) / N),
        ({"errors_force": force}, 1.2640 * force / G * w**1.5 / N),
    ):
        run = align(800.0, **{**EXACT, **values})
        assert run["sigma"][-1] == pytest.approx(expected, rel=0.03)


# ------------------------------------------------------------------------------- what is not ready
def test_ready_when_sigma_is_there_and_held() -> None:
    run = align(900.0, wanted=6.0 * ARCMIN, hold=30.0)
    ready = run["t"][run["ready"] == 1.0]
    assert run["sigma"][run["ready"] == 1.0].max() <= 6.0 * ARCMIN and run["t"][-1] < 600.0
    last = ready[np.flatnonzero(np.diff(ready, prepend=-9.0) > 1.5 * H)[-1] :]  # unbroken
    assert last[-1] - last[0] == pytest.approx(30.0, abs=2 * H) and run["status"][-1] == 1.0
    never = align(300.0, wanted=0.1 * ARCMIN)
    assert never["done"][-1] == 1.0 and not never["ready"].any()


@pytest.mark.parametrize(
    "values",
    [
        {"latitude": LAT + 0.05},  # U differs by N 0.05
        {"drift": (0.0, 0.5 * DPH, 0.0)},  # along north: the first window
        {"drift": (0.0, 0.0, 1.0 * DPH), **EXACT, "errors_bias": 0.1 * DPH},  # about the vertical: the azimuth channel
    ],
)
def test_rates_that_contradict_are_not_ready(values: dict[str, Any]) -> None:
    run = align(900.0, psi=0.0, wanted=1.0, hold=1e4, **values)
    assert run["status"][-1] == 2.0 and run["ready"][-1] == 0.0


def test_a_platform_that_does_not_come_level_is_never_aligned() -> None:
    run = align(200.0, push=1.0, wanted=1.0)
    assert run["mode"][-1] == 1.0 and run["status"][-1] == 0.0 and run["done"][-1] == 1.0
    assert run["sigma"].min() == pytest.approx(math.pi)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"latitude": 1.5}, "within 5 deg of a pole"),
        ({"level_frequency": 0.5, "period": 1.0}, "is too high for period"),
        ({"slow_frequency": 0.1}, "each must be the next one's at most"),
        ({"coarse_time": 3.0}, "20 periods at least"),
    ],
)
def test_refused(values: dict[str, float], words: str) -> None:
    part = make("alignment_controller", "native")
    part.set(values)
    with pytest.raises(InstanceError, match=words):
        part.initialize(0.0)
