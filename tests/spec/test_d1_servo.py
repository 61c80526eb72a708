"""Servo-table tests.  SERVO-TF, -NOISE, SERVO-C1, -C2, SERVO-C3-REDUCE, STAT-ERR, CROSS-MAP, E35-E46, E52, E53.

Truth comes from the torque-sign polynomial of section 1 put into 3-59, attitude by attitude, written out here.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from servo_table import (
    CLOSED,
    DEFAULT,
    DPH,
    NAMES,
    REFUSALS,
    SEEDS,
    VL_CLOSED,
    VL_REFUSALS,
    W,
    amplitudes,
    ideal_record,
    omega_m,
    polar_gamma,
    random_gyro,
    random_latitude,
    rate,
)

from gyrobench import drift, frames
from gyrobench.attitudes import LEVEL, SERVO_ATTITUDES, on_servo_table
from gyrobench.reduction.drift import harmonic, servo_regression
from gyrobench.reduction.setup import run_metadata
from gyrobench.system.system import load_system


# ------------------------------------------------------------------------------------------ 5.0, frames
def test_attitudes_sense_what_the_method_says() -> None:
    """SF/g and Earth rate along x in all twenty attitudes; rows of a rotation."""
    for phi in (math.radians(45.75), math.radians(-30.0)):
        s, c = math.sin(phi), math.cos(phi)
        for name in SERVO_ATTITUDES:
            A = frames.check_rotation(on_servo_table(name, phi), name)
            down, earth = A @ -frames.U, A @ frames.pole(phi)
            if name.startswith("polar"):
                m = 1.0 if name == "polar S" else -1.0
                np.testing.assert_allclose(down, [m * s, 0.0, m * c], atol=1e-15)
                assert earth[0] == pytest.approx(-m)
                np.testing.assert_allclose(A[1], -frames.E, atol=1e-15)
            elif name in LEVEL:
                east = {"east": 0.0, "north": c, "west": 0.0, "south": -c}[name.split()[1].rstrip(",")]
                assert earth[0] == pytest.approx(east, abs=1e-15)
                np.testing.assert_allclose(down, VL_REFUSALS.gravity_along(name), atol=1e-15)
            else:
                np.testing.assert_allclose(down, [1.0 if name == "x down" else -1.0, 0.0, 0.0], atol=1e-15)


def test_rate_noise_of_angle_readings() -> None:
    """sqrt2 eps / dT; 1 arcsec over 1 s = 1 deg/h; 0.2 arcsec over 600 s = 4.7e-4 deg/h [SERVO-NOISE]."""
    arcsec = math.pi / 648000.0
    assert arcsec / 1.0 == pytest.approx(DPH, rel=1e-12)
    assert math.sqrt(2.0) * 0.2 * arcsec / 600.0 / DPH == pytest.approx(4.7e-4, abs=0.05e-4)


def test_servo_stiffness_offsets_the_angle_forward() -> None:
    """E35: alpha_0 = alpha_in + M/(K1 G_g G_s): the table of 3-54 in its steady state, G_g = H K_sg/(J s + C)."""
    H, K, J, C, Js, K1, K2, Gs, M = 0.2, 10.0, 2e-4, 0.2, 2.0, 3.0, 0.5, 7.0, 0.01

    def alpha(s: float, alpha_in: float) -> float:
        G = H * K / (J * s + C)
        return (K1 * G * Gs * alpha_in + M) / (Js * s * s + K2 * Gs * s + K1 * G * Gs)

    stiff = K1 * H * K / C * Gs
    assert alpha(0.0, 1e-3) == pytest.approx(1e-3 + M / stiff, rel=1e-14)
    assert alpha(0.0, 1e-3) != pytest.approx(1e-3 - M / stiff, rel=1e-6)  # printed
    # the same from the torque balance in time: Js a'' = -K1 Gs u - K2 Gs a' + M with u = H K (a - a_in)/C
    run = solve_ivp(
        lambda _, y: [y[1], (M - K2 * Gs * y[1] - stiff * (y[0] - 1e-3)) / Js], (0, 60), [0, 0], rtol=1e-10, atol=1e-14
    )
    assert run.y[0, -1] == pytest.approx(1e-3 + M / stiff, rel=1e-6)


@pytest.mark.parametrize("seed", SEEDS)
def test_our_sign_and_that_of_the_source(seed: int) -> None:
    """CROSS-MAP: omega_d of gyrobench.drift is -omega_M, coefficient by coefficient; E36 printed fails."""
    rng = np.random.default_rng(seed)
    p, gamma = random_gyro(rng), rng.uniform(-1.0, 1.0, 3)
    ours = {name: sign * p[symbol] for name, (symbol, sign) in servo_regression.BOOK.items() if symbol in p}
    assert float(drift.drift(gamma, ours)) == pytest.approx(-omega_m(p, gamma), rel=1e-12)
    X, Y, Z = gamma
    printed = p["R"] + p["U_x"] * X - p["U_z"] * Z + p["ΔK"] * X * Z + p["K_zx"] * X * X - p["K_xz"] * X * X
    printed += p["K_zy"] * X * Y - p["K_zy"] * Y * Z
    assert abs(printed - omega_m(p, gamma)) > 1e-6 * DPH
    signs = {
        "R": "D_F",
        "U_z": "D_I",
        "U_x": "D_S",
        "ΔK": "D_IS",
        "K_zx": "D_II",
        "K_xz": "D_SS",
        "K_zy": "D_IO",
        "K_xy": "D_OS",
    }
    for symbol, name in signs.items():
        assert servo_regression.BOOK[name] == (symbol, 1 if symbol in ("U_x", "K_xz", "K_xy") else -1)


# ------------------------------------------------------------------------------------------ 5.1 - 5.3
@pytest.mark.parametrize("seed", SEEDS)
def test_class_1_and_2(seed: int) -> None:
    """All eighteen attitudes against 3-60..3-83; E37, E38 printed fail."""
    rng = np.random.default_rng(seed)
    p, phi, g = random_gyro(rng), random_latitude(rng), 1.001
    s, c = math.sin(phi), math.cos(phi)
    R, Uz, Ux, Kzx, Kxz = (p[n] for n in ("R", "U_z", "U_x", "K_zx", "K_xz"))
    for name in SERVO_ATTITUDES:
        if name.startswith("polar"):
            continue
        A = on_servo_table(name, phi)
        theta_dot = -W * (A @ frames.pole(phi))[0] - omega_m(p, A @ -frames.U * g)
        if name == "x down":
            expected = W * s - R - Uz * g - Kzx * g * g
            assert abs(W * s - R - Ux * g - Kzx * g * g - theta_dot) > 1e-6 * DPH  # E37
        elif name == "x up":
            expected = -W * s - R + Uz * g - Kzx * g * g
        else:
            along = {"east": 0.0, "north": W * c, "west": 0.0, "south": -W * c}[name.split()[1].rstrip(",")]
            axis, way = name[-4:].split()[0] if name.endswith("up") else name.split()[2], name.split()[-1]
            z = {"y": 0.0, "z": 1.0 if way == "down" else -1.0}[axis.strip(",")]
            expected = -along - R + z * Ux * g + abs(z) * Kxz * g * g
            if z:  # E38: K_xx, that is nothing of K_xz
                assert abs(-along - R + z * Ux * g - theta_dot) > 1e-6 * DPH
        assert theta_dot == pytest.approx(expected, rel=1e-12, abs=1e-20), name


@pytest.mark.parametrize("seed", SEEDS)
def test_three_term_route(seed: int) -> None:
    """R, U_z, U_x exactly without compliance; with it R takes K_zx g2 and U_x g (K_xz + K_zx) g2; E41 printed fails."""
    rng = np.random.default_rng(seed)
    full, phi, g = random_gyro(rng), random_latitude(rng), 1.0003
    s = math.sin(phi)
    simple = {**dict.fromkeys(NAMES, 0.0), **{n: full[n] for n in ("R", "U_z", "U_x")}}

    def rates(p: dict[str, float]) -> list[float]:
        names = ("x down", "x up", "x east, z down")
        A = [on_servo_table(n, phi) for n in names]
        return [float(-W * (a @ frames.pole(phi))[0] - omega_m(p, a @ -frames.U * g)) for a in A]

    one = rates(simple)
    found = VL_CLOSED.three_term(*one, W * s, g)
    for n in found:
        assert found[n] == pytest.approx(simple[n], rel=1e-9, abs=1e-9 * DPH)
    biased = VL_CLOSED.three_term(*rates(full), W * s, g)
    assert biased["R"] == pytest.approx(full["R"] + full["K_zx"] * g * g, rel=1e-9)
    assert biased["U_z"] == pytest.approx(full["U_z"], rel=1e-9)
    assert biased["U_x"] * g == pytest.approx(full["U_x"] * g + (full["K_xz"] + full["K_zx"]) * g * g, rel=1e-9)
    # E41: +R and U_x in 3-61', 3-63': the rates they give
    assert abs(W * s + simple["R"] - simple["U_x"] * g - one[0]) > 1e-6 * DPH
    assert abs(-W * s + simple["R"] + simple["U_x"] * g - one[1]) > 1e-6 * DPH


@pytest.mark.parametrize(
    ("names", "shown"),
    [
        (("x down", "x up"), ["D_F + γ² D_II", "D_I"]),
        (("x down", "x up", "x east, z down"), ["D_F + γ² D_II", "D_I", "D_S − γ D_II + γ D_SS"]),
        (("x east, y up", "x east, y down", "x east, z up", "x east, z down"), ["D_F", "D_S", "D_O", "D_SS"]),
        (tuple(n for n in SERVO_ATTITUDES if not n.startswith("polar")), ["D_F", "D_I", "D_S", "D_O", "D_II", "D_SS"]),
        (("x north, z up",), ["D_F − γ D_S + γ² D_SS"]),
    ],
)
def test_what_attitudes_tell(names: tuple[str, ...], shown: list[str]) -> None:
    """Ranks and the words for combinations; ideal data give what the words say, by closed formulas too."""
    seen = VL_REFUSALS.seen(names)
    assert [seen.shown(n) or n for n in seen.names] == shown
    rng = np.random.default_rng(1)
    g, true = 0.9987, {n: float(rng.uniform(-1, 1)) for n in drift.terms(9)}
    rows = np.array([VL_REFUSALS.gravity_along(n) * g for n in names])
    y = drift.regressors(rows, drift.terms(9)) @ np.array(list(true.values()))
    found, *_ = np.linalg.lstsq(drift.regressors(rows, seen.names), y, rcond=None)
    for n, v in zip(seen.names, found, strict=True):
        assert v == pytest.approx(seen.truth(n, true, g), rel=1e-9)
    classes: dict[str, list[float]] = {}
    for n, v in zip(names, y.tolist(), strict=True):
        classes.setdefault(n.rpartition(", ")[2], []).append(v)
    for n, v in VL_CLOSED.formulas({k: float(np.mean(v)) for k, v in classes.items()}, g).items():
        assert v == pytest.approx(seen.truth(n, true, g), rel=1e-9), n
    assert set(seen.lost) >= {"D_IO", "D_OS", "D_IS"}


# ------------------------------------------------------------------------------------------ 5.4
@pytest.mark.parametrize("seed", SEEDS)
def test_polar_geometry(seed: int) -> None:
    """theta' of 5.4 is 3-59 in both mounts; the code's attitudes give the same gamma; E39, E40 printed fail."""
    rng = np.random.default_rng(seed)
    p, phi, g = random_gyro(rng), random_latitude(rng), 1.0005
    s, c, s2 = math.sin(phi), math.cos(phi), math.sin(2 * phi)
    th = np.linspace(0.0, 7.0, 50)
    R, Uz, Ux, dK, Kzx, Kxz, Kzy, Kxy = (p[n] for n in NAMES)
    for mount, m in (("S", 1.0), ("N", -1.0)):
        wide = -0.5 * Kzy * g * g * s2 * np.sin(th) + (m * Ux * g * c - 0.5 * dK * g * g * s2) * np.cos(th)
        wide = wide + 0.5 * Kxy * (g * c) ** 2 * np.sin(2 * th) + 0.5 * Kxz * (g * c) ** 2 * np.cos(2 * th)
        constant = R + m * Uz * g * s + Kzx * (g * s) ** 2 - 0.5 * Kxz * (g * c) ** 2
        truth = rate(p, mount, th, phi, g)
        np.testing.assert_allclose(m * W - constant + wide, truth, rtol=1e-12)
        axes = np.repeat(on_servo_table(f"polar {mount}", phi)[None], th.size, axis=0)
        seen = servo_regression.HeldWindows(th, th, th, th + 1.0, axes).seen(np.array([0.0, 0.0, -g]))[:, 0, :]
        np.testing.assert_allclose(seen.T, polar_gamma(mount, th, phi, g), atol=1e-12)
        if mount == "S":  # E39: U_x for U_z, K_xz for K_zx in the constant, cos for cos2
            bad = R + Ux * g * s + Kxz * (g * s) ** 2 - 0.5 * Kxz * g * g * c
            assert np.max(np.abs(W - bad + wide - truth)) > 1e-6 * DPH
        else:  # E40: sin for sin2 in the K_xy term, -1/2 K_zz cos2
            bad = wide - 0.5 * Kxy * (g * c) ** 2 * (np.sin(2 * th) - np.sin(th)) - Kxz * (g * c) ** 2 * np.cos(2 * th)
            assert np.max(np.abs(-W - constant + bad - truth)) > 1e-6 * DPH


@pytest.mark.parametrize("seed", SEEDS)
def test_polar_separation(seed: int) -> None:
    """Table 3-3 corrected gives all but R, K_zx; routes (i), (ii) those; printed forms (E42-E44, E52) fail."""
    rng = np.random.default_rng(seed)
    p, phi, g = random_gyro(rng), random_latitude(rng), 0.9991
    s, c, s2 = math.sin(phi), math.cos(phi), math.sin(2 * phi)
    S, N = amplitudes(p, "S", phi, g), amplitudes(p, "N", phi, g)
    found = CLOSED.separate(S, N, phi, g, W)
    for n in ("U_x", "U_z", "ΔK", "K_xz", "K_zy", "K_xy"):
        assert found[n] == pytest.approx(p[n], rel=1e-8, abs=1e-9 * DPH), n
    assert found["U_y"] == pytest.approx(0.0, abs=1e-9 * DPH)
    assert found["R+"] == pytest.approx(p["R"] + p["K_zx"] * (g * s) ** 2, rel=1e-8, abs=1e-9 * DPH)
    two = CLOSED.resolve(found, phi, g, p["R"], False)
    assert two["K_zx"] == pytest.approx(p["K_zx"], rel=1e-8, abs=2e-8 * DPH) and two["R"] == p["R"]
    one = CLOSED.resolve(found, phi, g, None, True)
    B2 = (S["B2"] + N["B2"]) / 2
    assert one["R"] == pytest.approx(-(S["A0"] + N["A0"]) / 2 + B2 - 2 * B2 * math.tan(phi) ** 2, rel=1e-9)
    assert one["K_zx"] == one["K_xz"]
    assert CLOSED.ours(two)["D_F"] == -p["R"]
    # E42: Table 3-2, A0 of mount N as printed, and U_x for U_z in S
    Kxz, Kzx = p["K_xz"], p["K_zx"]
    assert N["A0"] == pytest.approx(
        -W - p["R"] + p["U_z"] * g * s - Kzx * (g * s) ** 2 + 0.5 * Kxz * (g * c) ** 2, rel=1e-9
    )
    assert abs(-W - p["R"] - p["U_x"] * g * s + Kzx * (g * s) ** 2 - N["A0"]) > 1e-6 * DPH
    # E43: R of opposite sign, K_zy from the difference, K_xy = -2 A2N
    assert abs((S["A0"] + N["A0"]) / 2 - B2 - found["R+"]) > 1e-6 * DPH
    assert abs((N["A1"] - S["A1"]) / s2 - p["K_zy"]) > 1e-6 * DPH
    assert abs(-2 * N["A2"] / c**2 - p["K_xy"]) > 1e-6 * DPH
    # E44: + and sin(2 phi)
    assert abs((S["A0"] + N["A0"] - 2 * B2 + 2 * p["R"]) / (2 * math.sin(2 * phi)) - Kzx) > 1e-6 * DPH
    assert two["K_zx"] == pytest.approx(-(S["A0"] + N["A0"] - 2 * B2 + 2 * p["R"]) / (2 * (g * s) ** 2), rel=1e-12)
    # E52: theta' is fitted (3-88 prints omega_d): taken as the drift, U_z is off by W/(g s)
    wrong = CLOSED.separate({**S, "A0": S["A0"] - W}, {**N, "A0": N["A0"] + W}, phi, g, W)
    assert wrong["U_z"] - p["U_z"] == pytest.approx(W / (g * s), rel=1e-6)


def test_cosine_and_sine_names() -> None:
    """E52: here A are sines and B cosines, the other way round than in gyrobench.reduction.drift.harmonic."""
    theta = np.linspace(0.0, 2 * math.pi, 37)
    r = 1.0 + 0.5 * np.sin(theta) + 0.25 * np.cos(2 * theta)
    fine = np.linspace(0.0, 2 * math.pi, 36 * 200 + 1)
    del r
    value = 1.0 + 0.5 * np.sin(fine) + 0.25 * np.cos(2 * fine)
    mean = np.array([np.trapezoid(value[k : k + 201]) / 200 for k in range(0, 7200, 200)])
    named, fit = CLOSED.amplitudes(theta[:-1], theta[1:], mean)
    assert named["A1"] == pytest.approx(0.5, rel=1e-4) and named["B2"] == pytest.approx(0.25, rel=1e-3)
    assert fit.beta[fit.names.index("B1")] == named["A1"]


@pytest.mark.parametrize(
    ("degrees", "condition"), [(5.0, 935.0), (20.0, 60.0), (45.75, 15.7), (60.0, 14.8), (80.0, 131.0)]
)
def test_condition_with_two_dwells(degrees: float, condition: float) -> None:
    """SERVO-C3-SING: rank 8, N = 36 a mount and the two dwells."""
    phi = math.radians(degrees)
    windows, _ = REFUSALS.held(phi, ("x east, y up", "x east, y down", "polar S", "polar N"))
    X = servo_regression.design(windows, run_metadata.Location(phi, frames.G0), drift.terms(8))
    assert np.linalg.matrix_rank(X) == 8
    assert float(np.linalg.cond(X)) == pytest.approx(condition, rel=0.006)


def test_ranks() -> None:
    """Two mounts alone 7 of 8: R and K_zx only as R + K_zx g2 s2 (E53: the text says nine); 4 on the equator, 3 at a
    pole even with the dwells.
    """
    phi = math.radians(45.75)
    both = REFUSALS.examine(phi, ("polar S", "polar N"), drift.terms(8))
    assert both.rank == 7 and len(both.lost) == 1
    assert set(both.lost[0].replace("−", "").split()) >= {"D_II", "D_F"} and f"{math.sin(phi) ** 2:.4g}" in both.lost[0]
    every = ("x east, y up", "x east, y down", "polar S", "polar N")
    assert REFUSALS.examine(0.0, every, drift.terms(8)).rank == 4
    assert REFUSALS.examine(math.pi / 2, every, drift.terms(8)).rank == 3
    assert REFUSALS.examine(phi, every, drift.terms(9)).rank == 9
    assert REFUSALS.examine(phi, ("polar S", "polar N"), drift.terms(9)).rank == 8
    for mount in ("polar S", "polar N"):
        assert REFUSALS.examine(phi, (mount,), drift.terms(9)).rank == 5


def test_uncertainties_per_unit_noise() -> None:
    """36 points a mount and two dwells at 45.75 degrees: the eight numbers of SERVO-C3-SING."""
    phi = math.radians(45.75)
    windows, _ = REFUSALS.held(phi, ("x east, y up", "x east, y down", "polar S", "polar N"))
    X = servo_regression.design(windows, run_metadata.Location(phi, frames.G0), drift.terms(8))
    u = dict(zip(drift.terms(8), np.sqrt(np.diag(np.linalg.inv(X.T @ X))).tolist(), strict=True))
    expected = {
        "D_F": 0.707,
        "D_I": 0.165,
        "D_S": 0.239,
        "D_IS": 0.333,
        "D_II": 1.43,
        "D_SS": 0.685,
        "D_IO": 0.333,
        "D_OS": 0.685,
    }
    for n, v in expected.items():
        assert u[n] == pytest.approx(v, abs=0.006 if v > 1 else 0.0006), n


@pytest.fixture(scope="module")
def day() -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """theta at every 600 s of 24 h in mount S at 45.75 degrees, default coefficients."""
    p, phi = {n: v * DPH for n, v in DEFAULT.items()}, math.radians(45.75)
    t = np.arange(145) * 600.0
    run = solve_ivp(
        lambda _, y: [float(rate(p, "S", y[0], phi))], (0, 86400), [0.0], "DOP853", t, rtol=1e-13, atol=1e-14
    )
    return t, run.y[0]


def test_end_to_end_of_a_day(day: Any) -> None:
    """SERVO-C3-E2E: five amplitudes within 2e-6 deg/h by window-averaged regressors, 4e-5 by those at mid-angle."""
    _, theta = day
    truth = amplitudes({n: v * DPH for n, v in DEFAULT.items()}, "S", math.radians(45.75))
    mean = np.diff(theta) / 600.0
    found, _ = CLOSED.amplitudes(theta[:-1], theta[1:], mean)
    worst = max(abs(found[n] - truth[n]) for n in truth) / DPH
    assert worst < 2e-6
    middle = (theta[:-1] + theta[1:]) / 2
    columns, names = harmonic.columns(middle, middle, range(3))
    rough, *_ = np.linalg.lstsq(columns, mean, rcond=None)
    other = {"A": "B", "B": "A"}
    crude = {n if n == "A0" else other[n[0]] + n[1]: float(v) for n, v in zip(names, rough, strict=True)}
    assert 2e-5 < max(abs(crude[n] - truth[n]) for n in truth) / DPH < 6e-5


@pytest.mark.parametrize("seed", range(4))
def test_reducer_from_ideal_input(seed: int) -> None:
    """A day that follows 3-59: least squares to 1e-7 deg/h, the formulas, which take each window as an even turn, to
    1e-4.
    """
    rng = np.random.default_rng(100 + seed)
    phi, g = random_latitude(rng), 1.0
    true = {n: float(rng.uniform(-1, 1)) * DPH for n in drift.terms(9)}
    record = ideal_record(true, phi, g)
    result = load_system("servo_polar").reduce(record)
    for c in result.coefficients:
        assert c.estimate * DPH == pytest.approx(true[c.name], abs=1e-7 * DPH), c.name
        assert c.closed is not None and c.closed * DPH == pytest.approx(true[c.name], abs=1e-4 * DPH), c.name
