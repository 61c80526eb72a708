"""Sculling test: parts against SciPy's integrals, the closed form, files, mistakes, refusals.  [TEST-SCULLING]"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commanding import Command
from scipy.integrate import quad, solve_ivp
from scipy.spatial.transform import Rotation

from gyrobench.engine.session import Session
from gyrobench.frames import G0
from gyrobench.packaging import load_part
from gyrobench.system.system import load_system
from systems.sculling_test.closed import ScullingMotion, UnitErrors, VelocityChain
from systems.sculling_test.reduction import Reduction, ScullingSetup

NAME = "sculling_test"
DEG, UG = math.pi / 180.0, 1e-6 * G0
SHORT: dict[str, Any] = {"readings": 2, "cycles": 1, "window": 1.0, "nuisances": "none"}


# ------------------------------------------------------------------------------------------------ parts
def test_the_table_rocks_and_shakes() -> None:
    """Means of a step of an open motion, with lever arms and errors, are integrals of its equations by SciPy."""
    h, f, theta, a = 1e-3, 35.0, 0.1, 4.0
    r = np.array([[0.01, -0.02, 0.03], [0.02, 0.01, -0.01], [0.0, 0.015, -0.005]])
    table = load_part("table_sculling")(
        ramp=0.01, vibration=a, phase_error=0.2, angle_gain=0.02, force_gain=-0.01, levers=r.tolist()
    )
    table.frequency_wanted, table.angle_wanted = f, theta
    table.initialize()
    w, size, shake = 2.0 * math.pi * f, 1.02 * theta, 0.99 * a

    def force(t: float, i: int) -> float:
        angle, rate = size * math.sin(w * t), w * size * math.cos(w * t)
        e = np.array([1.0, 0.0, 0.0])
        felt = np.array([0.0, shake * math.sin(w * t + 0.2), G0])
        at = -w * w * angle * np.cross(e, r[i]) + rate**2 * np.cross(e, np.cross(e, r[i]))
        return float((Rotation.from_rotvec(angle * e).inv().apply(felt) + at)[i])

    for k in range(40):
        table.do_step(k * h, h)
        if k * h > 0.01:
            t = k * h
            assert table.omega[0] == pytest.approx(size * (math.sin(w * t + w * h) - math.sin(w * t)) / h, abs=1e-9)
            mean = [quad(force, t, t + h, args=(i,))[0] / h for i in range(3)]
            assert table.f == pytest.approx(mean, abs=1e-4)  # (w h)^4/2880 = 8e-7 of some 40 m/s2


def test_the_user_integrates_a_constant_rate_and_force() -> None:
    """Random ones, one increment an update: the velocity is that of an ODE solved by SciPy."""
    rng = np.random.default_rng(4)
    rate, f = rng.normal(0.0, 3.0, 3), rng.normal(0.0, 10.0, 3)
    h, user = 0.05, load_part("strapdown_attitude")()
    user.initialize()
    total = np.zeros(3)
    for k in range(20):
        user.dtheta, user.dvelocity, user.number = (h * rate).tolist(), (h * f).tolist(), k + 1.0
        user.do_step(h * k, h)
        total += h * np.array(user.acceleration)

    def slope(t: float, v: np.ndarray) -> np.ndarray:
        return np.asarray(Rotation.from_rotvec(t * rate).apply(f))

    hand = solve_ivp(slope, (0.0, 20 * h), np.zeros(3), rtol=1e-10, atol=1e-12).y[:, -1]
    assert total == pytest.approx(hand, abs=1e-7)


# ------------------------------------------------------------------------------------------------ closed form
def test_what_is_left_by_hand() -> None:
    """Small angles: integrals sin x/x, pairs of them as of coning; filters by the real part of their product; size
    effect w2 theta2 z/2; increments with sculling of fine samples: nothing.
    """
    theta, a, T, g = 1e-3, 3.0, 0.01, 9.80665
    for f in (3.0, 17.0, 35.0):
        w, m = 2.0 * math.pi * f, ScullingMotion(f, theta, a)
        x, whole = w * T, 0.5 * theta * (a + g * theta)
        hand = whole * (math.sin(x) / x - 1.0) + theta**2 * g * (1.0 - math.cos(x)) / 12.0
        assert VelocityChain(T, sculling=False).rise(m) == pytest.approx(hand, rel=1e-6)
        two = math.sin(2.0 * x) / (2.0 * x) + 8.0 / 3.0 * math.sin(0.5 * x) ** 2 * math.sin(x) / x
        pairs = VelocityChain(T, sculling=False, samples=2).rise(m)
        assert pairs == pytest.approx(whole * (two - 1.0), rel=0.01)  # up to theta2 g: 1 % of it
        assert abs(VelocityChain(T).rise(m)) < 4e-4 * whole
        more = VelocityChain(T, size=0.02).rise(m) - VelocityChain(T).rise(m)
        assert more == pytest.approx(0.5 * (w * theta) ** 2 * 0.02, rel=1e-5)
        gyro, acc = (1.0 / (1.0 - (f / b) ** 2 + 1j * math.sqrt(2.0) * f / b) for b in (90.0, 60.0))
        hand = whole * ((gyro * acc.conjugate()).real - 1.0) - 0.25 * theta**2 * g * (abs(gyro) ** 2 - 1.0)
        assert VelocityChain(T, 0.0, 90.0, 60.0).rise(m) == pytest.approx(hand, rel=0.01)
    same = UnitErrors(levers=np.tile([0.0, 0.03, 0.05], (3, 1)))  # one place: its mean acceleration is nothing
    assert abs(VelocityChain(T).rise(ScullingMotion(20.0, theta, a), same)) < 1e-3 * 0.5 * (125.0 * theta) ** 2 * 0.05


def steady() -> dict[str, Any]:
    """Return an inertial unit without noise, and without gyro drifts, by which the user's vertical would tilt."""
    quiet: dict[str, Any] = dict.fromkeys(load_system(NAME).noises, 0.0)
    return quiet | {"imu.gyro_bias": [0.0] * 3, "imu.g_sensitivity": [[0.0] * 3] * 3}


@pytest.mark.parametrize("seed", range(4))
def test_random_units_rise_as_the_closed_form_says(session: Session, seed: int) -> None:
    """Scale factors, misalignments, biases, filters, algorithm, lever arm, axis by chance, no noise; up to 20°."""
    rng = np.random.default_rng(seed)
    values: dict[str, Any] = {
        "axis": "xyz"[seed % 3], "frequencies": "5 12 21", "samples": 1 + seed % 2, "sculling": seed != 1,
        "bandwidth": (0.0, 90.0, 150.0, 0.0)[seed], "acc_bandwidth": (0.0, 120.0, 60.0, 100.0)[seed],
        "size": (0.0, 0.02, -0.01, 0.0)[seed], "angle": (0.5, 0.5, 3.0, 20.0)[seed] * DEG,
        "vibration": rng.uniform(-10.0, 10.0),
    }  # fmt: skip
    errors = {f"imu.{n}_scale": rng.uniform(-1e-2, 1e-2, (3, 3)).tolist() for n in ("gyro", "acc")}
    errors["imu.acc_bias"] = rng.uniform(-0.1, 0.1, 3).tolist()
    record = session.run({**SHORT, **values, **steady(), **errors})
    found = load_system(NAME).with_values({**SHORT, **values}).reduce(record).coefficients
    assert [c.name for c in found] == ["b", "d(5 Hz)", "d(12 Hz)", "d(21 Hz)"]
    assert max(abs(c.truth) for c in found[1:]) > 1.0
    for c in found[1:]:
        assert c.estimate == pytest.approx(c.truth, abs=0.05, rel=1e-5)


def test_set_up_errors_are_predicted(session: Session) -> None:
    """Amplitudes that are off by 1 %, a phase by 1°: in the budget's table of shifts, to second order of them."""
    values = {**SHORT, "frequencies": "10 31", "sculling": False, "acc_bandwidth": 80.0, "size": 0.01}
    errors = {"table.angle_gain": 0.01, "table.force_gain": -0.01, "table.phase_error": DEG}
    exact = {f"imu.{n}_scale": [[0.0] * 3] * 3 for n in ("gyro", "acc")}
    result = load_system(NAME).with_values(values).reduce(session.run({**values, **steady(), **exact, **errors}))
    shift = {row[0]: row[-3] for t in result.tables if t.id.startswith("budget.predicted") for row in t.rows}
    for c in result.coefficients[1:]:
        assert abs(shift[c.name]) > 1.0
        assert c.estimate - c.truth == pytest.approx(shift[c.name], abs=0.02 * abs(shift[c.name]) + 0.3)


# ------------------------------------------------------------------------------------------------ files
def rows(sense: float = 1.0, factor: float = 1.0, rest: float = 2.0e3) -> list[list[float]]:
    """Accelerations (ug) of integrals, 10 ms, by hand: theta a/2 (sin x/x - 1) and the small part of gravity."""
    rng = np.random.default_rng(7)
    out, t, theta, a = [], 0.0, 0.3 * DEG, 6.0
    for f in (0.0, 4.0, 9.0, 0.0, 15.0, 25.0, 0.0):
        for _ in range(5):
            y = rest + rng.normal(0.0, 5.0)
            if f:
                x = 2.0 * math.pi * f * 0.01
                left = 0.5 * theta * (a + G0 * theta) * (math.sin(x) / x - 1.0)
                y += sense * (left + theta**2 * G0 * (1.0 - math.cos(x)) / 12.0) / UG
            out.append([t, t + 4.0, f, 0.3 * factor if f else 0.0, a * factor if f else 0.0, y])
            t += 5.0
    return out


HEAD = ["interval = 10ms", "bandwidth = 0Hz", "acc_bandwidth = 0Hz", "sculling = false", "samples = 1", "size = 0mm"]


def reduced(
    command: Command, folder: Path, table: list[list[float]], code: int = 0, type_b: str = "type_b = none"
) -> Any:
    names = "t_start [s],t_end [s],frequency [Hz],angle [deg],vibration [m/s2],acceleration [ug]"
    file = folder / "sculling.csv"
    lines = [*(f"# {x}" for x in (*HEAD, type_b)), names]
    file.write_text("\n".join([*lines, *(",".join(f"{v:.9g}" for v in row) for row in table)]) + "\n")
    found, _, err = command("reduce", NAME, "--data", str(file), "--out", str(folder / "r"), "--force")
    assert found == code, err
    return json.loads((folder / "r" / "result.json").read_text()) if code == 0 else err


@pytest.mark.long
def test_a_laboratorys_file(command: Command, tmp_path: Path) -> None:
    result = reduced(command, tmp_path, rows())
    found = {c["name"]: c for c in result["coefficients"]}
    stated = next(t for t in result["tables"] if t["id"] == "sculling.expected")["rows"]
    assert [row[0] for row in stated] == [4.0, 9.0, 15.0, 25.0]
    for f, *_, expected, _, _ in stated:
        low, high = found[f"d({f:g} Hz)"]["interval"]
        x, theta = 2.0 * math.pi * f * 0.01, 0.3 * DEG
        hand = 0.5 * theta * (6.0 + G0 * theta) * (math.sin(x) / x - 1.0) + theta**2 * G0 * (1 - math.cos(x)) / 12
        assert low < hand / UG < high and high - low < 40.0
        assert expected == pytest.approx(hand / UG, rel=1e-3)
    assert not any(r["id"] == "sculling.implausible" for r in result["reasons"])


def test_gravity_is_in_the_acceleration_at_rest_alone(command: Command, tmp_path: Path) -> None:
    """What is taken off too much is in b; differences to the readings at rest do not have it."""
    plain, gravity = (reduced(command, tmp_path, rows(), type_b=x) for x in ("type_b = none", "u_gravity = 1e-3m/s2"))
    for before, after in zip(plain["coefficients"], gravity["coefficients"], strict=True):
        extra = 1e-3 / UG if after["name"] == "b" else 0.0
        assert after["u"] == pytest.approx(math.hypot(before["u"], extra), rel=1e-3)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (rows(sense=-1.0), "antiphase"),
        (rows(factor=0.1), "more than with nothing"),
        (rows(rest=1e6), "gravity taken off"),
        ([[*row[:2], 2.0 * math.pi * row[2], *row[3:]] for row in rows()], "not rad/s"),
    ],
)
def test_mistakes_are_named(given: list[list[float]], said: str) -> None:
    names = ("t_start", "t_end", "frequency", "angle", "vibration", "acceleration")
    units = (1.0, 1.0, 1.0, DEG, 1.0, UG)
    windows = {n: np.array(v) * u for n, v, u in zip(names, zip(*given, strict=True), units, strict=True)}
    setup = ScullingSetup(chain=VelocityChain(0.01, sculling=False))
    reasons = [r.text for r in Reduction.reduce(windows, setup).reasons if r.id.startswith("sculling.")]
    assert len(reasons) == 1 and said in reasons[0]


def test_records_that_say_nothing(command: Command, tmp_path: Path) -> None:
    assert "at rest" in reduced(command, tmp_path, [r for r in rows() if r[2]], 2)
    assert "no reading has a motion" in reduced(command, tmp_path, [r for r in rows() if not r[2]], 2)
