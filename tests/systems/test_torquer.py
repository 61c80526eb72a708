"""The torquer test in co-simulation: recovery, linearity, drift, refusals before and after the run."""

from __future__ import annotations

import importlib
import itertools
import math
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commanding import Command
from reducing import named
from reducing import reduced_run as reduced

from gyrobench.engine.session import Session
from gyrobench.record.run_document import PlanRow
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.system.system import load_system

NAME = "torquer_scale_factor"
DPH = math.pi / 648000.0
KU = DPH * 1e3  # deg/h/mA
SHORT = {"currents": "5 10 20 40 70 100", "range": "0.5deg", "range_large": "5deg"}


M: Any = importlib.import_module(".marks", type(load_system(NAME)).__module__)
P: Any = importlib.import_module(".precession", type(load_system(NAME)).__module__)


def quiet() -> dict[str, Any]:
    return dict.fromkeys(load_system(NAME).noises, 0.0)


# ---------------------------------------------------------------------------------------------- marks
def test_marks_by_hand() -> None:
    """+10 mA: 0 to 10 at 1 rad/s with readings each second, -10 mA: 9.5 back to 1.5 at 0.5 rad/s: marks 1.5 and 9.5."""
    t = np.arange(26.0)
    angle = np.where(t <= 10, t, 9.5 - 0.5 * (t - 10))
    keep = [k for k in range(25) if k != 10 and angle[k + 1] > 1.4]
    w = {
        "phase": np.array([1 if k < 10 else 2 for k in keep]), "t_start": t[keep], "t_end": t[keep] + 1,
        "angle_start": np.array([angle[k] if k != 10 else 9.5 for k in keep]),
        "angle_end": np.array([angle[k + 1] for k in keep]),
        "mean": np.array([0.01 if k < 10 else -0.01 for k in keep]),
    }  # fmt: skip
    plan = [PlanRow(phase=1, mode="servo", target=0.01), PlanRow(phase=2, mode="servo", target=-0.01)]
    rows = M.rows(w, plan)
    assert rows["current"] == pytest.approx([0.01])
    assert rows["rate_plus"] == pytest.approx([1.0]) and rows["rate_minus"] == pytest.approx([0.5])
    assert rows["range_plus"] == rows["range_minus"] and "sigma" not in rows
    with pytest.raises(ReductionError, match="10 mA: no record of the negative current"):
        M.rows({n: v[:9] for n, v in w.items()}, plan)
    far = {
        **w,
        "angle_start": w["angle_start"] - 20.0 * (w["phase"] == 2),
        "angle_end": w["angle_end"] - 20.0 * (w["phase"] == 2),
    }
    with pytest.raises(ReductionError, match="do not turn the table back over the same angles"):
        M.rows(far, plan)
    with pytest.raises(ReductionError, match="flagged windows"):
        M.rows({**w, "flagged": np.ones(len(keep))}, plan)


def test_fit_to_the_windows_by_hand() -> None:
    """rate = K i + d(theta) with K = 2, 3, 4 at i = 1, 2, 3 and d = 0.1 + 0.2 theta + 0.3 theta2: back exactly, as the
    mean of theta2 over a window is the difference of theta3/3; o_n is d less what Legendre polynomials of the range
    -1..1 hold: 0.1 + 0.3/3.
    """
    rows, t = [], 0.0
    for k, (K, i) in enumerate(((2.0, 1.0), (3.0, 2.0), (4.0, 3.0))):
        for sense in (1.0, -1.0):
            edges = sense * np.linspace(-1.0, 1.0, 13) * (1.0 if k else 0.8)
            for a, b in itertools.pairwise(edges):
                mean_d = 0.1 + 0.1 * (b**2 - a**2) / (b - a) + 0.1 * (b**3 - a**3) / (b - a)
                dt = (b - a) / (sense * K * i + mean_d)
                rows.append((2 * k + (sense < 0.0), t, t + dt, a, b, sense * i))
                t += dt
    names = ("phase", "t_start", "t_end", "angle_start", "angle_end", "mean")
    w = dict(zip(names, np.array(rows).T, strict=True))
    found = P.precession(w, {p: p // 2 for p in range(6)}, np.array([1.0, 2.0, 3.0]))
    np.testing.assert_allclose(found.K, [2.0, 3.0, 4.0], rtol=1e-12)
    np.testing.assert_allclose(found.drift, 0.1 + 0.3 / 3.0, rtol=1e-10)


def test_generalized_weights_by_hand() -> None:
    """Two values of variances 1 and 4, uncorrelated: weights 0.8 and 0.2; with covariance 0.5 between them the
    weights go as (4 - 0.5) : (1 - 0.5) = 7 : 1.
    """
    for cross, expected in ((0.0, [0.8, 0.2]), (0.5, [0.875, 0.125])):
        est = types.SimpleNamespace(covariance=np.array([[1.0, cross], [cross, 4.0]]))
        found = P.Precession(np.ones(2), np.zeros(2), est)
        np.testing.assert_allclose(found.weights(np.ones((2, 1)), slice(0, 2)), [expected], rtol=1e-12)


# ------------------------------------------------------------------------------------------ co-simulation
@pytest.mark.parametrize("seed", range(3))
def test_random_torquers(session: Session, seed: int) -> None:
    """Noise off: K to 1e-7, whatever site, drift, scale factor and gyro; the drift cancels and is shown."""
    rng = np.random.default_rng(seed)
    k = float(rng.uniform(15.0, 19.0))
    values = {**SHORT, **quiet(), "latitude": float(rng.uniform(-1.3, 1.3)), "k": k * KU * 1.01, "gyro.k": k * KU}
    values |= {"gyro.D_F": float(rng.uniform(-1.0, 1.0)) * DPH, "gyro.C": float(rng.uniform(0.18, 0.22))}
    r = reduced(session, values)
    c = named(r)
    for name in ("K", "K_LS", "K_1"):
        assert c[name].estimate == pytest.approx(k, rel=1e-7) and c[name].truth == pytest.approx(k, rel=1e-12), name
    assert abs(c["K_3/K_1"].estimate) < 1e-5 and abs(c["linearity"].estimate) < 1e-5  # percent
    # at angle 0: X = 0, Y = -g sin, Z = -g cos of the latitude; the axis sees no Earth rate
    phi, g = values["latitude"], 1.0
    y, z = -g * math.sin(phi), -g * math.cos(phi)
    static = values["gyro.D_F"] / DPH + 0.1 * y - 0.7 * z + 0.04 * z * z - 0.02 * y * z
    # +-0.25 deg of the start, gravity to 0.3 %
    assert r.tables[0].rows[0][-1] == pytest.approx(static, abs=0.012)


def test_cubic_and_even_torquer(session: Session) -> None:
    """k (1 + k2 i + k3 i2): k3 shows as K_3/K_1 = k3 i_max2, k2 k i2 in the half difference and nowhere else."""
    values = {**SHORT, **quiet(), "gyro.k3": -0.05, "gyro.k2": 0.01}
    r = reduced(session, values)
    c = named(r)
    assert c["K_3/K_1"].estimate == pytest.approx(-0.05, rel=2e-4) and c["K_3/K_1"].truth == pytest.approx(-0.05)
    assert c["K_1"].estimate == pytest.approx(17.2, rel=1e-7)
    assert c["K"].estimate == pytest.approx(c["K"].truth, rel=1e-7)
    rows = r.tables[0].rows
    for row in rows:
        assert row[3] == pytest.approx(17.2 * (1.0 - 0.05 * (row[0] * 1e-3) ** 2), rel=1e-6)
    even = rows[-1][-1] - rows[-2][-1]  # 17.2 x 0.01/A x (100 mA x 0.1 A - 70 mA x 0.07 A) = 0.172 x (10 - 4.9)
    assert even == pytest.approx(0.172 * 5.1, rel=0.02)


def test_drift_that_changes_over_the_range(session: Session) -> None:
    """K_n is low by the variance of d/(k i): over a range R from angle 0 the drift goes as slope x angle, variance
    (slope R)2/12.  On the equator the output axis is level at angle 0 and rises about east: Y = -sin(angle), so that
    D_O = 20 deg/h/g is a slope of 20 deg/h per rad.
    """
    values = {**quiet(), "currents": "5 6 7", "range": "10deg", "latitude": 0.0, "windows": 40}
    values |= dict.fromkeys([f"gyro.D_{n}" for n in ("F", "I", "S", "II", "SS", "IO", "OS", "IS")], 0.0)
    values["gyro.D_O"] = 20.0 * DPH
    r = reduced(session, values)
    size = math.radians(10.0)
    for row in r.tables[0].rows:
        expected = -((20.0 * size) ** 2) / 12.0 / (17.2 * row[0]) ** 2
        assert row[3] / 17.2 - 1.0 == pytest.approx(expected, rel=0.1), row[0]


def test_ammeter_error_is_in_the_budget(session: Session) -> None:
    """An ammeter that shows 1e-3 too much makes K small by it."""
    c = named(reduced(session, {**SHORT, **quiet(), "source.error": 1e-3, "u_current": 1e-3}))["K"]
    assert c.estimate == pytest.approx(17.2 / 1.001, rel=1e-7) and c.u == pytest.approx(17.2e-3, rel=1e-2)


# ---------------------------------------------------------------------------------------------- refusals
RUNS: list[tuple[list[str], list[str]]] = [
    (["currents=1 2"], ["2 currents: at least 3"]),
    (["currents=1 2 x"], ["currents = 1 2 x: numbers in mA"]),
    (["currents=0 1 2"], ["currents: 0 mA: give magnitudes"]),
    (["currents=-1 1 2"], ["currents: -1 mA: give magnitudes"]),
    (["currents=5 5 10"], ["the same current twice"]),
    (["currents=5 10 200"], ["currents up to 200 mA", "120 mA at most"]),
    (["range=0"], ["range = 0: must be > 0"]),
    (["slew=0"], ["slew = 0: must be > 0"]),
    (["table.base=[[1,0,0],[0,1,0],[0,0,1]]"], ["right angles to the pole", "of Earth rate"]),
    (["gyro.mount=[[1,0,0],[0,1,0],[0,0,-1]]"], ["gyro.mount", "determinant is -1"]),
]


@pytest.mark.parametrize(("values", "words"), RUNS, ids=[" ".join(v) for v, _ in RUNS])
def test_run_is_refused(refused: Callable[..., None], values: list[str], words: list[str]) -> None:
    refused(NAME, values, words)


@pytest.mark.long
def test_run_and_show(command: Command, tmp_path: Path) -> None:
    code, out, err = command("show", NAME)
    assert code == 0 and "current_source" in out and "+100 mA" in out, err
    more = [w for n, v in SHORT.items() for w in ("--set", f"{n}={v}")]
    code, out, err = command("run", NAME, *more, "--out", tmp_path / "run", pages=True)
    assert code == 0 and "K_3/K_1" in out, err
    assert (tmp_path / "run" / "report.html").exists()
