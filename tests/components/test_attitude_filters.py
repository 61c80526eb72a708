"""Attitude filters against filters written from the equations with rotation matrices; gates, alignment, observability.
[EST-ATTITUDE]"""

from __future__ import annotations

import math

import numpy as np
import pytest
from native_parts import make
from scipy.linalg import block_diag, expm
from scipy.spatial.transform import Rotation

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

H, G, LAT = 0.05, 9.80665, 0.6981317007977318
EARTH = 7.2921159e-5 * np.array([0.0, math.cos(LAT), math.sin(LAT)])
GYRO, BIAS, TAU, ACC, HEADING, START = 1e-4, 2e-4, 300.0, 5e-3, 4e-3, 1.0
TOLD = {f"noise_of_{n}": x for n, x in
        {"gyro": GYRO, "bias": BIAS, "tau": TAU, "acc": ACC, "heading": HEADING, "start": START}.items()}  # fmt: skip
FILTERS = ("complementary", "kalman", "mekf")


def matrix(pitch, roll, heading):
    """C = R2(roll) R1(pitch) R3(heading), passive."""
    return Rotation.from_euler("ZXY", [heading, pitch, roll]).as_matrix().T


def angles(C):
    heading, pitch, roll = Rotation.from_matrix(C.T).as_euler("ZXY")
    return np.array([pitch, roll, heading])


def skew(v):
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def readings(n, size=0.3, seed=2):
    """Rates, specific forces, headings (nan: none) of a vehicle that rolls, pitches and yaws; noisy and biased."""
    rng = np.random.default_rng(seed)
    t = H * np.arange(1, n + 1)
    true = size * np.column_stack([np.sin(0.9 * t), np.sin(0.7 * t + 1.0), 2.0 * np.sin(0.3 * t)])
    C = np.array([matrix(*a) for a in true])
    rate = np.array([Rotation.from_matrix(C[k] @ C[k - 1].T).as_rotvec() / -H if k else np.zeros(3) for k in range(n)])
    omega = rate + C @ EARTH + np.array([3e-4, -2e-4, 1e-4]) + GYRO / math.sqrt(H) * rng.normal(size=(n, 3))
    f = G * C[:, :, 2] + ACC / math.sqrt(H) * rng.normal(size=(n, 3))
    f[n // 2] *= 1.2  # beyond the gate
    heading = np.where(np.arange(n) % 10 == 0, true[:, 2] + HEADING * rng.normal(size=n), np.nan)
    return omega, f, heading, true


def played(name, omega, f, heading, **given):
    part = load_part(f"attitude_{name}")(**({} if name == "complementary" else TOLD), **given)
    part.initialize()
    rows = []
    for k in range(len(omega)):
        part.omega, part.f = omega[k].tolist(), f[k].tolist()
        part.heading_new = 0.0 if math.isnan(heading[k]) else 1.0
        part.heading = 0.0 if math.isnan(heading[k]) else float(heading[k])
        part.do_step(k * H, H)
        P = np.array(part.covariance) if name != "complementary" else None
        rows.append((np.array(part.angle), np.array(part.bias), P, getattr(part, "nis", None), part.aided))
    return rows


def resting(name, n, omega, f, every=1, **given):
    """Angle and bias after n steps of constant readings (of the first one: rest), by the native FMU; the heading reads
    0 every so many steps, 0: in the first one alone."""
    one = make(f"attitude_{name}", "native")
    try:
        one.set({**({"w_0": 0.1} if name == "complementary" else {**TOLD, "noise_of_tau": 1e5}), **given})
        one.set({f"omega[{k + 1}]": float(x) for k, x in enumerate(omega)})
        one.initialize(0.0)
        for k in range(n):
            reading = f if k else [0.0, 0.0, G]
            one.set({f"f[{j + 1}]": float(x) for j, x in enumerate(reading)})
            one.set({"heading_new": float(k == 0 or (every > 0 and k % every == 0))})
            one.step(k * H, H)
        return np.array(one.get([f"{v}[{j}]" for v in ("angle", "bias") for j in (1, 2, 3)])).reshape(2, 3)
    finally:
        one.free()


def aligned(f, heading):
    """Pitch and roll that put the specific force along the vertical."""
    u = f / np.linalg.norm(f)
    return matrix(math.asin(u[1]), math.atan2(-u[0], u[2]), heading)


def close(a, b):
    return (a - b + math.pi) % (2.0 * math.pi) - math.pi


def test_complementary_filter_on_matrices():
    omega, f, heading, _ = readings(200)
    rows = played("complementary", omega, f, heading, w_0=0.5, zeta=0.8, gate=1.0)
    C, b, ahead = aligned(f[0], heading[0]), np.zeros(3), 0.0
    for k in range(1, 200):
        n = C[:, 2]
        size = np.linalg.norm(f[k])
        e = ahead * n + (np.cross(f[k] / size, n) if abs(size - G) <= 1.0 else 0.0)
        C = expm(-skew((omega[k] - b - C @ EARTH + 2.0 * 0.8 * 0.5 * e) * H)) @ C
        b = b - 0.25 * H * e
        if not math.isnan(heading[k]):
            ahead = float(close(heading[k], angles(C)[2]))
        assert rows[k][0] == pytest.approx(angles(C), abs=1e-12)
        assert rows[k][1] == pytest.approx(b, abs=1e-14)
    assert rows[100][4] == 0.0 and rows[101][4] == 1.0


def test_kalman_filter_in_matrices():
    """Six states, F and Q by exponentials, readings of the step as one vector, Joseph form."""
    omega, f, heading, _ = readings(200, size=0.1)
    rows = played("kalman", omega, f, heading, gate=1.0)
    s = 2.0 * BIAS**2 / TAU
    A, L = np.array([[0.0, -1.0], [0.0, -1.0 / TAU]]), np.diag([GYRO**2, s])
    e = expm(np.block([[-A, L], [np.zeros((2, 2)), A.T]]) * H)
    F, Q = block_diag(*[e[2:, 2:].T] * 3), block_diag(*[e[2:, 2:].T @ e[:2, 2:]] * 3)
    x = np.zeros(6)
    x[::2] = angles(aligned(f[0], heading[0]))
    tilt = ACC**2 / (H * G**2)
    P = np.diag([tilt, BIAS**2, tilt, BIAS**2, HEADING**2, BIAS**2])
    for k in range(1, 200):
        earth = matrix(*x[::2]) @ EARTH
        x, P = F @ x, F @ P @ F.T + Q
        x[::2] += H * (omega[k] - earth)
        size = np.linalg.norm(f[k])
        z, H_k, R = [], [], []
        if abs(size - G) <= 1.0:
            z += [math.asin(f[k][1] / size) - x[0], math.atan2(-f[k][0], f[k][2]) - x[2]]
            H_k, R = [np.eye(6)[0], np.eye(6)[2]], [tilt, tilt]
        if not math.isnan(heading[k]):
            z, H_k, R = [*z, float(close(heading[k], x[4]))], [*H_k, np.eye(6)[4]], [*R, HEADING**2]
        nis = 0.0
        if z:
            M = np.array(H_k)
            S = M @ P @ M.T + np.diag(R)
            K = np.linalg.solve(S, M @ P).T
            nis = float(z @ np.linalg.solve(S, z))
            x, J = x + K @ z, np.eye(6) - K @ M
            P = J @ P @ J.T + K @ np.diag(R) @ K.T
        # exponentials against the part's expansion to h2 of h/tau = 1.7e-4
        assert rows[k][0] == pytest.approx(x[::2], abs=1e-6)
        assert rows[k][1] == pytest.approx(x[1::2], abs=1e-7)
        order = [0, 2, 4, 1, 3, 5]
        # rotation by an error of each angle, by differences of the matrices
        C = matrix(*x[::2])
        turned = [Rotation.from_matrix(C @ matrix(*(x[::2] + 1e-6 * d)).T).as_rotvec() / 1e-6 for d in np.eye(3)]
        T = block_diag(np.array(turned).T, np.eye(3))
        P_vehicle = T @ P[np.ix_(order, order)] @ T.T
        scale = np.sqrt(np.diag(P_vehicle))
        assert rows[k][2] / np.outer(scale, scale) == pytest.approx(P_vehicle / np.outer(scale, scale), abs=5e-4)
        assert rows[k][3] == pytest.approx(nis, rel=1e-3, abs=1e-6)


@pytest.mark.parametrize(("local", "least"), [(True, 1e-3), (False, 0.1)])
def test_mekf_in_matrices(local, least):
    """Attitude as a matrix, transition by the exponential of the error equations, one vector of readings, Joseph form.

    Once with the error in local axes as the part has it, once in vehicle axes; they differ in second order.
    """
    n = 200
    omega, f, heading, true = readings(n, size=0.5)
    rows = played("mekf", omega, f, heading, gate=1.0)
    C, b = aligned(f[0], heading[0]), np.zeros(3)
    axes = np.eye(3) if local else C  # from local axes to those of the error
    tilt = ACC**2 / (H * G**2)
    P = block_diag(axes @ np.diag([tilt, tilt, HEADING**2]) @ axes.T, BIAS**2 * np.eye(3))
    s = 2.0 * BIAS**2 / TAU
    for k in range(1, n):
        w = omega[k] - b
        after = expm(-skew((w - C @ EARTH) * H)) @ C
        middle = 0.5 * (C + after)
        turn, drift = (-skew(EARTH), -middle.T) if local else (-skew(w), -np.eye(3))
        A = np.block([[turn, drift], [np.zeros((3, 3)), -np.eye(3) / TAU]])
        e = expm(np.block([[-A, np.diag([GYRO**2] * 3 + [s] * 3)], [np.zeros((6, 6)), A.T]]) * H)
        F, Q = e[6:, 6:].T, e[6:, 6:].T @ e[:6, 6:]
        C, b, P = after, math.exp(-H / TAU) * b, F @ P @ F.T + Q
        back = C if local else np.eye(3)  # from the axes of the error to those of the vehicle
        y, M, R = [], [], []
        if abs(np.linalg.norm(f[k]) - G) <= 1.0:
            y += (f[k] - G * C[:, 2]).tolist()
            M += np.hstack([G * skew(C[:, 2]) @ back, np.zeros((3, 3))]).tolist()
            R += [ACC**2 / H] * 3
        if not math.isnan(heading[k]):
            a = angles(C)
            y.append(float(close(heading[k], a[2])))
            row = np.array([-math.sin(a[1]) / math.cos(a[0]), 0.0, math.cos(a[1]) / math.cos(a[0])]) @ back
            M.append([*row, 0.0, 0.0, 0.0])
            R.append(HEADING**2)
        if y:
            M = np.array(M)
            S = M @ P @ M.T + np.diag(R)
            K = np.linalg.solve(S, M @ P).T
            x, J = K @ y, np.eye(6) - K @ M
            P = J @ P @ J.T + K @ np.diag(R) @ K.T
            C, b = expm(-skew(back @ x[:3])) @ C, b + x[3:]
            assert rows[k][3] == pytest.approx(float(y @ np.linalg.solve(S, y)), rel=10.0 * least, abs=least)
        shown = block_diag(C if local else np.eye(3), np.eye(3))
        P_vehicle = shown @ P @ shown.T
        scale = np.sqrt(np.diag(P_vehicle))
        assert np.abs(close(rows[k][0], angles(C))).max() < least * scale[:3].min()
        assert np.abs(rows[k][1] - b).max() < least * scale[3:].min()
        assert rows[k][2] / np.outer(scale, scale) == pytest.approx(P_vehicle / np.outer(scale, scale), abs=2.0 * least)
    assert np.abs(close(rows[-1][0], true[-1])).max() < 5.0 * scale[:3].max()


@pytest.mark.parametrize("name", FILTERS)
def test_drift_is_found_at_rest_and_along_the_vertical_by_the_heading_alone(name):
    """Without noise: biases of 1e-4 rad/s are found; with no heading readings not that along the vertical."""
    n, bias = 6000, np.array([1e-4, -1e-4, 1e-4])
    # heading 0: vehicle axes are east, north, up
    with_heading = resting(name, n, EARTH + bias, [0.0, 0.0, G], every=20)
    none = resting(name, n, EARTH + bias, [0.0, 0.0, G], every=0)
    assert with_heading[1] == pytest.approx(bias, abs=5e-6)
    # without heading the Earth rate couples the level biases with the error of the heading
    assert none[1][:2] == pytest.approx(bias[:2], abs=1e-5) and abs(none[1][2]) < 5e-5


@pytest.mark.parametrize("name", FILTERS)
def test_an_acceleration_below_the_gate_is_taken_for_gravity_one_above_it_not(name):
    n, a = 4000, 0.5
    tilt = math.atan(a / G)
    open_, closed = (resting(name, n, EARTH, [0.0, a, G], gate=g)[0][0] for g in (0.1, 0.001))
    assert open_ == pytest.approx(tilt, rel=0.05)
    assert abs(closed) < 1e-3 * tilt


def test_attitude_beyond_90_degrees_is_one_that_the_mekf_keeps():
    """A loop: pitch through 90 and 180 deg and back to 0, at 20 deg/s, without noise; up is found to 1e-4."""
    n = round(18.0 / H)
    w = math.radians(20.0)
    C, omega, f = np.eye(3), [], []
    for _ in range(n):
        omega.append(np.array([w, 0.0, 0.0]) + C @ EARTH)
        C = expm(-skew([w * H, 0.0, 0.0])) @ C
        f.append(G * C[:, 2])
    rows = played("mekf", np.array(omega), np.array(f), np.where(np.arange(n) < 1, 0.0, np.nan))
    assert np.abs(rows[-1][0]).max() < 5e-3  # alignment takes the first step of 1 deg for rest
    assert max(abs(r[0][0]) for r in rows) > math.radians(89.0)


@pytest.mark.parametrize(("name", "given"), [("complementary", {"w_0": 0.0}), ("kalman", {"noise_of_acc": 0.0}),
                                             ("mekf", {"noise_of_gyro": 0.0}), ("mekf", {"gate": 0.0})])  # fmt: skip
def test_refused(name, given):
    with pytest.raises(ComponentError, match=f"{next(iter(given))} = 0.* > 0"):
        load_part(f"attitude_{name}")(**given).initialize()
