"""Two-axis servo test.  SERVO2-A, -KIN, -102, -LOCK, -RANK, -E2E, APP2, E47, E50, E51.

The oracle (servo_two_axis.py) integrates the equations of Hu 1981 as corrected; it shares no code with the
system.
"""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from servo_two_axis import (
    DPH,
    X_NAMES,
    Y_NAMES,
    W,
    attitude,
    beta,
    closed,
    frame,
    geometry,
    integrate,
    minus_alpha,
    mounts,
    ours,
    record,
    refusals,
    system,
)

from gyrobench import frames
from gyrobench.reduction.setup.window_checks import ReductionError

PHI = math.radians(45.75)
DAY = 86400.0


def coefficients(rng: np.random.Generator, terms: int) -> tuple[list[float], list[float]]:
    """Random coefficients of the size of Hu 1981: R, U up to 1, K up to 0.2 deg/h per g^n; and the ninth."""
    size = np.array([0.5, 0.6, 0.6, 0.2, 0.06, 0.06, 0.06, 0.06, 0.2])[:terms] * DPH
    return list(size * rng.uniform(-1.0, 1.0, terms)), list(size * rng.uniform(-1.0, 1.0, terms))


def allowed(rng: np.random.Generator, px: list[float], py: list[float]) -> tuple[float, tuple[int, int]]:
    """A latitude of 15 to 75 degrees, north or south, and a pair of mounts out of the four best that its gyro with
    these coefficients does not drive into gimbal lock.
    """

    def rates(at: Any) -> tuple[float, float]:
        return -float(minus_alpha(at, px)), float(beta(at, py))

    while True:
        phi = math.radians(rng.uniform(15.0, 75.0)) * rng.choice([-1.0, 1.0])
        for _, a, b in refusals.best_pairs(phi, DAY, 9, W):
            if all(math.cos(refusals.locked(m, phi, DAY, W, rates)) > 0.25 for m in (a, b)):
                return phi, (a, b)


# ------------------------------------------------------------------------------------------ geometry
def test_attitude_and_its_printed_form() -> None:
    """A = A_y A_x; the element (2,2) is cos x, printed cos y (E47) makes no rotation of it."""
    rng = np.random.default_rng(1)
    x, y = rng.uniform(-3.0, 3.0, (2, 20))
    A = geometry.attitude(x, y)
    assert np.allclose(A, [attitude(a, b) for a, b in zip(x, y, strict=True)], atol=1e-15)
    printed = A.copy()
    printed[:, 1, 1] = np.cos(y)
    assert np.all(np.abs(printed @ np.swapaxes(printed, 1, 2) - np.eye(3)).max(axis=(1, 2)) > 1e-3)


def test_rates_are_those_of_the_attitude() -> None:
    """3-97 against the angular velocity of the plate in inertial axes, by central differences of its attitude."""
    rng = np.random.default_rng(2)
    h = 1e-6
    for _ in range(5):
        phi = rng.uniform(-1.3, 1.3)
        number = int(rng.integers(1, 13))
        x, y, dx, dy = rng.uniform(-1.0, 1.0, 4)
        base, p = frame(number, phi), frames.pole(phi)

        def plate(t: float, base: Any = base, p: Any = p, v: Any = (x, y, dx, dy)) -> Any:
            """Rows of the plate in inertial axes: the Earth turns by 1 rad/s about p."""
            return attitude(v[0] + v[2] * t, v[1] + v[3] * t) @ base @ frames.rotation(p, t).T

        spin = (plate(h) - plate(-h)) / (2.0 * h) @ plate(0.0).T  # [[0, wz, -wy], [-wz, 0, wx], [wy, -wx, 0]]
        one = np.ones(1)
        earth, _ = closed.appendix_2(number, phi)
        alpha, beta_ = closed.gyro_rates(x * one, y * one, dx * one, dy * one, earth)
        assert alpha[0] == pytest.approx(spin[1, 2], abs=1e-8)
        assert beta_[0] == pytest.approx(spin[2, 0], abs=1e-8)


def test_appendix_2() -> None:
    """Earth rate and gravity along X, Y, Z of all twelve mounts; the H column gives lines only (E51)."""
    for phi in (0.3, -1.1):
        for number in range(1, 13):
            rows = frame(number, phi)
            rate, force = closed.appendix_2(number, phi)
            assert np.allclose(rate, rows @ frames.pole(phi), atol=1e-15)
            assert np.allclose(force, rows @ -frames.U, atol=1e-15)
            assert np.allclose(geometry.base(number, phi), rows, atol=1e-15)
    e, n, u, p = frames.E, frames.N, frames.U, frames.pole(0.3)
    i = np.cross(e, p)
    z = {1: u, 2: -n, 3: -u, 4: e, 5: i, 6: -p, 7: -e, 8: n, 9: -i, 10: e, 11: p, 12: -e}
    for number, direction in z.items():  # H along +: 1, 4, 5, 8, 10, 11
        assert np.allclose(geometry.base(number, 0.3)[2], direction, atol=1e-15)


def test_printed_row_3_of_appendix_2_fails() -> None:
    """E50: W cos(latitude) goes with cos y, not cos x."""
    phi, x, y = 0.8, 0.4, 0.7
    one = np.ones(1)
    alpha, _ = closed.gyro_rates(x * one, y * one, 0.0 * one, 0.0 * one, closed.appendix_2(3, phi)[0])
    right = math.cos(phi) * math.cos(y) + math.sin(phi) * math.cos(x) * math.sin(y)
    printed = math.cos(phi) * math.cos(x) + math.sin(phi) * math.cos(x) * math.sin(y)
    assert alpha[0] == pytest.approx(right, abs=1e-15) and abs(alpha[0] - printed) > 0.1


def test_both_lines_from_torque() -> None:
    """3-95 against M = l x F + (K F) x F: alpha' = -M_y/H, beta' = M_x/H; the printed terms of line 1 fail (E47)."""
    rng = np.random.default_rng(3)
    H, m = 0.7, 1.3
    length, K = rng.normal(size=3), rng.normal(size=(3, 3))
    g = rng.normal(size=(30, 3))
    M = np.cross(length, m * g) + np.cross((m * g) @ K.T, m * g)
    U, k = m * length / H, m * m * K / H
    px = [0.0, U[2], U[0], k[2, 2] - k[0, 0], k[2, 0], k[0, 2], k[2, 1], k[0, 1]]
    py = [0.0, U[2], U[1], k[1, 1] - k[2, 2], k[2, 1], k[1, 2], k[2, 0], k[1, 0]]
    assert np.allclose(closed.rows("x", g) @ px, -M[:, 1] / H, atol=1e-12)
    assert np.allclose(closed.rows("y", g) @ py, M[:, 0] / H, atol=1e-12)
    X, Y, Z = g.T
    printed = (
        U[0] * X - U[2] * Z + (k[0, 2] - k[0, 0]) * X * Z + k[2, 0] * X * X - k[0, 0] * Z * Z + k[2, 1] * X * Y
        - k[0, 1] * Y * Z
    )  # fmt: skip
    assert np.max(np.abs(-printed - closed.rows("x", g) @ px)) > 0.1
    assert tuple(closed.BOOK["x"]) == X_NAMES and tuple(closed.BOOK["y"]) == Y_NAMES


def test_mount_2_written_out() -> None:
    """3-101 and 3-102 corrected: gravity and both lines of mount 2 in the two angles."""
    rng = np.random.default_rng(4)
    x, y = rng.uniform(-1.0, 1.0, (2, 15))
    g = 1.3
    at = closed.force(x, y, g * closed.appendix_2(2, PHI)[1])
    cx, sx, cy, sy, s2x, s2y = np.cos(x), np.sin(x), np.cos(y), np.sin(y), np.sin(2 * x), np.sin(2 * y)
    assert np.allclose(at, g * np.stack([-sx * sy, -cx, sx * cy], axis=-1), atol=1e-15)
    R, U_z, U_x, dK, K_zx, K_xz, K_zy, K_xy = p = rng.normal(size=8)
    minus = (
        R - U_z * g * sx * sy - U_x * g * sx * cy - dK * g * g * sx**2 * s2y / 2 + K_zx * g * g * sx**2 * sy**2
        - K_xz * g * g * sx**2 * cy**2 + K_zy * g * g * s2x * sy / 2 + K_xy * g * g * s2x * cy / 2
    )  # fmt: skip
    assert np.allclose(closed.rows("x", at) @ p, -minus, atol=1e-13)
    R, U_z, U_y, dK, K_zy, K_yz, K_zx, K_yx = p
    second = (
        R + U_z * g * cx + U_y * g * sx * cy - dK * g * g * s2x * cy / 2 - K_zy * g * g * cx**2
        + K_yz * g * g * sx**2 * cy**2 - K_zx * g * g * s2x * sy / 2 - K_yx * g * g * sx**2 * s2y / 2
    )  # fmt: skip
    assert np.allclose(closed.rows("y", at) @ p, second, atol=1e-13)


# ------------------------------------------------------------------------------------------ what mounts tell
def test_gimbal_lock() -> None:
    """SERVO2-LOCK: the table at 45.75 degrees; the path itself; 5 and 12 everywhere, 3 and 8 at 45 degrees."""
    table = [44.25, 45.75, 88.5, 45.75, 90.0, 0.0, 44.25, 88.5, 0.0, 0.0, 0.0, 90.0]
    assert [math.degrees(geometry.swing(m, PHI)) for m in range(1, 13)] == pytest.approx(table, abs=1e-6)
    for phi in (PHI, math.radians(-30.0), math.radians(70.0)):
        for m in range(1, 13):
            highest = np.max(np.abs(geometry.path(m, phi, DAY, 2881)[2]))
            assert highest == pytest.approx(geometry.swing(m, phi), abs=math.radians(0.1))
        assert geometry.swing(5, phi) == geometry.swing(12, phi) == pytest.approx(math.pi / 2)
    for m in (3, 8):
        assert geometry.swing(m, math.radians(45.0)) == pytest.approx(math.pi / 2)


@pytest.mark.long
def test_path_against_integration() -> None:
    """Both ways of the path, without and with drift, against the equations of Hu 1981 integrated."""
    t = np.linspace(0.0, DAY, 241)
    for m in (2, 4, 9):
        none = [0.0] * 8
        for phi in (PHI, -0.5):
            for p, rates in ((none, None), ([0.5 * DPH] * 8, True)):
                drift = None if rates is None else lambda at, p=p: (-float(minus_alpha(at, p)), float(beta(at, p)))
                _, x, y = geometry.path(m, phi, DAY, 241, rates=drift)
                outer, inner = integrate(m, phi, 1.0, p, p, t)
                assert np.max(np.abs(np.array([x - outer, y - inner]))) < 2e-6


def test_rank_and_best_pairs() -> None:
    """SERVO2-RANK at 45.75 degrees, 24 h, the eight terms a channel of Hu 1981."""
    ranks = {1: (8, 8), 2: (8, 8), 4: (8, 8), 9: (5, 5), 10: (5, 5), 7: (5, 4), 6: (1, 1), 11: (1, 1)}
    each = {m: refusals.designs([m], PHI, DAY, 8, W) for m in ranks}
    for m, expected in ranks.items():
        assert tuple(int(np.linalg.matrix_rank(each[m][c], tol=1e-7)) for c in "xy") == expected, m
    for m in (1, 2, 4):
        assert 1600.0 < refusals.condition(each[m]) < 2000.0  # about 2e3
    pairs = {(a, b): k for k, a, b in refusals.best_pairs(PHI, DAY, 8, W, 8)}
    told = {(2, 4): 19.8, (1, 4): 20.1, (2, 9): 22.7, (2, 10): 22.7, (1, 9): 23.4, (1, 10): 23.4}
    for pair, k in told.items():
        assert pairs[pair] == pytest.approx(k, abs=0.15), pair
    assert set(list(pairs)[:6]) == set(told)


# ------------------------------------------------------------------------------------------ recovery
@pytest.mark.parametrize(("seed", "terms"), [(1, 8), (2, 9)])
@pytest.mark.long
def test_recovery_to_1e_8(seed: int, terms: int) -> None:
    """SERVO2-E2E: 24 h each in two mounts, 120 s windows, random gyro and latitude: all coefficients to 1e-8 deg/h."""
    rng = np.random.default_rng(seed)
    px, py = coefficients(rng, terms)
    phi, pair = (PHI, (2, 4)) if seed == 1 else allowed(rng, px, py)
    result = system.reduce(record(pair, phi, 1.0, px, py, terms=terms))
    truth = ours(px, py)
    assert {c.name for c in result.coefficients} == set(truth)
    for c in result.coefficients:
        assert c.estimate == pytest.approx(truth[c.name], abs=1e-8), (c.name, math.degrees(phi), pair)
        assert c.closed == pytest.approx(truth[c.name], abs=1e-8), c.name
    book = next(t for t in result.tables if t.title == "Notation of Hu 1981").rows
    expected = [v / DPH for v in (*px[:8], *py[:8])]
    assert [row[1] for row in book] == pytest.approx(expected, abs=1e-8)


@pytest.mark.long
def test_windows_of_ten_minutes() -> None:
    """600 s: the spline between the readings costs less than 1e-6 deg/h, at 0.98 g0 of gravity."""
    rng = np.random.default_rng(7)
    px, py = coefficients(rng, 9)
    result = system.reduce(record((1, 4), math.radians(40.0), 0.98, px, py, window=600.0))
    truth = ours(px, py)
    for c in result.coefficients:
        assert c.estimate == pytest.approx(truth[c.name], abs=1e-6), c.name
        assert c.closed == pytest.approx(truth[c.name], abs=1e-6), c.name


def test_printed_formulas_do_not_recover() -> None:
    """E47: a record reduced with the printed line 1 of 3-95 or the printed matrix 3-96 does not give its truth."""
    rng = np.random.default_rng(11)
    px, py = coefficients(rng, 8)
    made = record((2, 4), PHI, 1.0, px, py, window=600.0, terms=8).windows
    x, y = ((made[f"{a}_start"] + made[f"{a}_end"]) / 2.0 for a in ("outer", "inner"))
    first = made["phase"] == 1
    at, wrong, alpha = np.empty((x.size, 3)), np.empty((x.size, 3)), np.empty(x.size)
    for rows, m in ((first, 2), (~first, 4)):
        A = geometry.attitude(x[rows], y[rows])
        printed = A.copy()
        printed[:, 1, 1] = np.cos(y[rows])
        down = closed.appendix_2(m, PHI)[1]
        at[rows], wrong[rows] = A @ down, printed @ down
    alpha = -minus_alpha(at, px)  # what 3-97 tells
    X, Y, Z = at.T
    one = np.ones_like(X)
    good = np.linalg.lstsq(closed.rows("x", at), alpha, rcond=None)[0]
    assert np.allclose(good, px, atol=1e-9 * DPH)
    for rows in (
        -np.column_stack([one, -Z, X, X * Z, X * X, -Z * Z, X * Y, -Y * Z]),  # U_x g_x - U_z g_z
        -np.column_stack([one, X, -Z, X * Z, X * X - Z * Z, X * Y, -Y * Z]),  # K_zx X2 - K_zx Z2 for K_zx, K_xz
        closed.rows("x", wrong),
    ):
        v = np.linalg.lstsq(rows, alpha, rcond=None)[0]
        off = np.max(np.abs(rows @ v - alpha)) / DPH
        assert off > 1e-3 or abs(v[1] - px[1]) > 1e-3 * DPH


# ------------------------------------------------------------------------------------------ refusals of records
@pytest.fixture(scope="module")
def made() -> Any:
    return record((2, 4), PHI, 1.0, *coefficients(np.random.default_rng(5), 9), window=600.0)


def changed(made: Any, plan: list[str] | None = None, keep: Any = slice(None), **columns: Any) -> Any:
    w = {c: np.array(v)[keep] for c, v in {**made.windows, **columns}.items()}
    run = made.run
    if plan is not None:
        run = run.replace(plan=[{"phase": k, "label": m, "mode": "servo"} for k, m in enumerate(plan, 1) if m])
    return type(made)(w, {}, run)


def test_refused_records(made: Any) -> None:
    w = made.windows
    nan = w["inner_end"].copy()
    nan[3] = math.nan
    cases = [
        (changed(made, plan=["mount 2", "mount 13"]), "'mount 13' is none of the mounts"),
        (changed(made, inner_end=nan), "column inner_end: non-finite number in window 4"),
        (changed(made, inner_end=w["inner_end"] + 0.7), r"gimbal lock: the inner angle reaches .*78\.5° is allowed"),
        (record((9, 10), PHI, 1.0, [0.0] * 9, [0.0] * 9, 600.0), "x channel: rank 5 of 9, not estimable: "),
        (changed(made, keep=w["phase"] == 1), r"phase 2 \(mount 4\) has no windows"),
        (changed(made, flagged=np.ones_like(w["t_end"])), "flagged windows"),
        (changed(made, t_end=w["t_start"] - 1.0), "windows without length"),
        (changed(made, keep=w["t_start"] % 86900.0 < 7200.0), "condition .* 1000 is allowed: add another mount"),
    ]
    for bad, text in cases:
        with pytest.raises(ReductionError, match=text):
            system.reduce(bad)


def test_single_mount_is_warned_of(made: Any) -> None:
    """Mount 2 alone: rank 9, condition above 1e3 said with the weakest direction; the estimates are still right."""
    rng = np.random.default_rng(5)
    truth = ours(*coefficients(rng, 9))
    one = changed(made, plan=["mount 2"], keep=made.windows["phase"] == 1)
    result = system.reduce(one)
    assert any("condition" in text and "least determined" in text for text in result.warnings)
    for c in result.coefficients:
        assert c.estimate == pytest.approx(truth[c.name], abs=1e-4), c.name


@pytest.mark.long
def test_gap_in_the_record(made: Any) -> None:
    """Rows left out in the middle of a mount: two stretches, each with a spline of its own."""
    truth = ours(*coefficients(np.random.default_rng(5), 9))
    part = changed(made, keep=np.delete(np.arange(made.windows["phase"].size), [40, 41, 42, 200]))
    for c in system.reduce(part).coefficients:
        assert c.estimate == pytest.approx(truth[c.name], abs=1e-5), c.name


def test_allowed_latitudes_have_pairs() -> None:
    """From 15 to 75 degrees there is a pair with a condition below 60 with nine terms; below 7 degrees none."""
    for degrees, sign in itertools.product((15.0, 30.0, 60.0, 75.0), (1.0, -1.0)):
        assert refusals.best_pairs(sign * math.radians(degrees), DAY, 9, W)[0][0] < 60.0
    assert refusals.best_pairs(math.radians(5.0), DAY, 9, W)[0][0] > 1e3
    assert len(mounts(PHI)) == 12
