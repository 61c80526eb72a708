"""Filter aided by an angle reference, and the reference: against matrices, consistency, what aiding is there for.
[EST-KF-AIDED]"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from estimating import AIDED, aided_model, aided_series
from native_parts import make
from scipy import stats
from wired import BENCH

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

T, K = AIDED["Ts"], AIDED["k"]
OUT = ["estimate", "variance", "innovation", "nis", "b", "b_variance", "theta", "aided", "nis_angle"]


def played(z: Any, angle: Any, valid: Any = None, instance: Any = None, **given: float) -> np.ndarray:
    """angle: NaN where none is read."""
    one = instance or make("estimator_aided", "native")
    one.set({**AIDED, **given})
    one.initialize(0.0)
    rows = []
    for k, (reading, a) in enumerate(zip(z, angle, strict=True)):
        new = math.isfinite(a)
        there = 1.0 if valid is None else float(valid[k])
        one.set({"z": float(reading), "angle": float(a) if new else 0.0, "angle_new": float(new), "valid": there})
        one.step(k * T, T)
        rows.append(one.get(OUT))
    if instance is None:
        one.free()
    else:
        one.reset()
    return np.array(rows)


def test_it_is_the_filter_in_matrices() -> None:
    """Readings missing, angles in between, the angle given up after `patience` and begun anew."""
    rng = np.random.default_rng(1)
    n = 400
    _, z, angle = aided_series(rng, n, 7)
    angle[:20], angle[200:270] = np.nan, np.nan
    valid = rng.random(n) > 0.1
    found = played(z, angle, valid, patience=0.5, T_c=0.25)
    F, Q = aided_model()
    x, P = np.zeros(4), np.diag([1.0, AIDED["P0_slope"], AIDED["drift"] ** 2, 0.0])
    aided, since, expected = False, 0.0, []
    drop = np.diag([1.0, 1.0, 1.0, 0.0])
    for k in range(n):
        since += T
        if since > 0.5 + 1e-9:
            aided = False
        x, P = F @ x, F @ P @ F.T + Q
        if not aided:
            x, P = drop @ x, drop @ P @ drop
        e = y = 0.0
        for row, reading, R in (
            ([1.0, 0, 1, 0], z[k], AIDED["R"]),
            ([0.0, 0, 0, 1], angle[k], AIDED["sigma_angle"] ** 2),
        ):
            H = np.array(row)
            if H[3] and math.isfinite(reading) and not aided:
                aided, since = True, 0.0
                x[3], P[3, 3] = reading, R
            elif (H[3] and math.isfinite(reading)) or (H[0] and valid[k]):
                S, off = H @ P @ H + R, reading - H @ x
                gain = P @ H / S * [1.0, 1.0, float(aided), 1.0]
                L = np.eye(4) - np.outer(gain, H)
                x, P = x + gain * off, L @ P @ L.T + R * np.outer(gain, gain)
                if H[0]:
                    y, e = off, off * off / S
                else:
                    since = 0.0
        expected.append([x[0] + aided * x[3] / (K * 0.25), P[0, 0], y, e, x[2], P[2, 2], aided * x[3], aided])
    assert found[:, :8] == pytest.approx(np.array(expected), rel=1e-7, abs=1e-10)
    assert 0.0 in found[50:, 7] and found[-1, 7] == 1.0


def test_consistent() -> None:
    """300 series of its own model: errors of rate and drift and both innovations within 99.9 % of chi-square."""
    rng, runs, n = np.random.default_rng(2), 300, 80
    one = make("estimator_aided", "native")
    squares: dict[str, list[float]] = {"rate": [], "drift": [], "nis": [], "angle": []}
    for _ in range(runs):
        X, z, angle = aided_series(rng, n, 8)
        found = played(z, angle, instance=one, T_c=0.0)
        squares["rate"].append((found[-1, 0] - X[-1, 0]) ** 2 / found[-1, 1])
        squares["drift"].append((found[-1, 4] - X[-1, 2]) ** 2 / found[-1, 5])
        squares["nis"] += found[:, 3].tolist()
        squares["angle"] += found[np.isfinite(angle), 8][1:].tolist()
    one.free()
    for name, values in squares.items():
        low, high = stats.chi2.ppf([0.0005, 0.9995], len(values)) / len(values)
        assert low < np.mean(values) < high, name


def test_without_a_reference_it_is_the_rate_filter() -> None:
    """No drift at the start and no angle: estimator_kalman_rate, to rounding."""
    z = np.random.default_rng(3).normal(size=200)
    none = np.full(200, np.nan)
    found = played(z, none, drift=0.0, walk=0.0)
    one = make("estimator_kalman_rate", "native")
    one.set({n: AIDED[n] for n in ("Ts", "q", "R", "P0_slope")})
    one.initialize(0.0)
    for k, reading in enumerate(z):
        one.set({"z": float(reading)})
        one.step(k * T, T)
        assert found[k, :2] == pytest.approx(one.get(["estimate", "variance"]), rel=1e-9, abs=1e-12)
    one.free()
    assert not found[:, 4:8].any()


def test_refused() -> None:
    for given, words in (({"sigma_angle": 0.0}, "sigma_angle = 0"), ({"k": -1.0}, "k = -1"), ({"R": 0.0}, "R = 0")):
        with pytest.raises(ComponentError, match=words):
            load_part("estimator_aided", BENCH)(**given).initialize()


def test_the_reference_reads_in_its_phase() -> None:
    """Every 20 ms from the step in which phase 2 begins; from the angle there; nothing outside; noise of 0.1."""
    part = load_part("angle_reference", BENCH)(period=0.02, phase_read=2, reading=0.1, seed=3)
    part.initialize()
    rows = []
    for k in range(4000):
        part.phase = 2.0 if k >= 10 else 1.0
        part.theta = 5.0 + 1e-3 * k
        part.do_step(k * 1e-3, 1e-3)
        rows.append([part.get(n) for n in ("angle", "new", "off")])
    found = np.array(rows)
    assert not found[:10].any() and np.flatnonzero(found[:, 1])[:3].tolist() == [10, 30, 50]
    assert found[10:, 2] == pytest.approx(1e-3 * np.arange(3990), abs=1e-12)
    new = found[:, 1] > 0.5
    assert np.std(found[new, 0] - found[new, 2]) == pytest.approx(0.1, rel=0.2)  # 200 readings: 5 %
    assert (found[11:30, 0] == found[10, 0]).all()
    always = load_part("angle_reference", BENCH)(reading=0.0)
    always.theta = 3.0
    always.initialize()
    for k in range(3):
        always.theta = 3.0 + 0.1 * k
        always.do_step(k * 1e-3, 1e-3)
    assert [always.get(n) for n in ("angle", "new", "off")] == [0.0, 0.0, pytest.approx(0.2)]
