"""The fixed-position test: attitudes, recovery, interval, budget, refusals, laboratory files, days."""

from __future__ import annotations

import importlib
import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commanding import Command
from reducing import reduced_run as reduced
from scipy import stats

from gyrobench import drift, frames
from gyrobench.attitudes import parse
from gyrobench.engine.session import Session
from gyrobench.record.csv_reader import DataError
from gyrobench.reduction.estimation import noise
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.system.system import InvalidConfigurationError, System, load_system
from gyrobench.system.values import InvalidValueError

NAME = "fixed_position"
DPH = math.pi / 648000.0
W = frames.EARTH_RATE
SHORT: dict[str, Any] = {"readings": 10, "dwell": 20.0, "settle": 3.0}


def load() -> System:
    return load_system(NAME)


QUIET = {n: 0.0 for n in load().noises}
PACKAGE = type(load()).__module__
R: Any = importlib.import_module(".reduction", PACKAGE)


def turned(rng: np.random.Generator) -> np.ndarray:
    """A random rotation."""
    return frames.rotation(rng.normal(size=3), rng.uniform(0.0, math.pi))


# ------------------------------------------------------------------------------------------ attitude
def test_attitudes_by_name() -> None:
    phi = math.radians(30.0)
    assert np.allclose(parse("E U", phi), [[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    assert np.allclose(parse("E, U, -N", phi), parse("E U", phi))
    assert np.allclose(parse("-P E", phi)[0], [0, -math.cos(phi), -0.5])
    assert np.allclose(parse("Q −E", phi)[0], [0, -0.5, math.cos(phi)])
    assert np.allclose(parse("[[0.6,0.8,0],[-0.8,0.6,0],[0,0,1]]", phi)[1], [-0.8, 0.6, 0])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("E", "1 directions"), ("E X", "'X' is none of"), ("E --U", "'--U' is none of"), ("N P", "30° apart"),
        ("E U N", "determinant is -1"), ("[[1,0],[0,1]]", "a 3x3 matrix is expected"), ("[1,", "no 3x3 matrix"),
        ("[[1,0,0],[0,1,0],[0,0,1.001]]", "not orthonormal"), ("E N N", "not orthonormal"), ("", "0 directions"),
    ],
)  # fmt: skip
def test_impossible_attitudes(session: Session, text: str, said: str) -> None:
    with pytest.raises(ValueError, match=re.escape(said)):
        parse(text, math.radians(30.0))
    with pytest.raises(InvalidConfigurationError, match=re.escape(said)):
        session.run({**SHORT, "attitude": text, "latitude": math.radians(30.0)})


# ------------------------------------------------------------------------------------------ recovery
@pytest.mark.parametrize("seed", range(6))
def test_random_gyros_attitudes_and_latitudes(session: Session, seed: int) -> None:
    """Noise off: the drift of all ten terms, worked out here, to 1e-6 deg/h."""
    rng = np.random.default_rng(seed)
    C, phi, g = turned(rng), rng.uniform(-1.5, 1.5), rng.uniform(9.71, 9.89)
    D = {n: float(rng.uniform(-1.0, 1.0) * DPH) for n in drift.NAMES}
    values = {**SHORT, **QUIET, **{f"gyro.{n}": v for n, v in D.items()}, "gyro.terms": 10, "latitude": phi}
    values |= {"attitude": json.dumps(C.tolist()), "gravity": g, "gyro.k": 15.0 * DPH / 1e-3}
    result = reduced(session, values)
    X, Y, Z = -C[:, 2] * g / 9.80665
    terms = {"D_F": 1, "D_I": X, "D_O": Y, "D_S": Z, "D_II": X * X, "D_OO": Y * Y, "D_SS": Z * Z, "D_IO": X * Y}
    terms |= {"D_OS": Y * Z, "D_IS": X * Z}
    expected = sum(D[n] * v for n, v in terms.items()) / DPH
    (c,) = result.coefficients
    assert c.name == "ω_d" and c.unit == "°/h"
    assert c.estimate == pytest.approx(expected, abs=1e-6)
    assert c.truth == pytest.approx(expected, abs=1e-12)
    assert c.closed == pytest.approx(c.estimate, abs=1e-9)


def test_closed_formula_by_hand() -> None:
    """Input axis up at 45.75 deg: 15.041069 sin phi = 10.7739 deg/h; 0.6 mA of 17.2 deg/h/mA take 10.32 of it."""
    C, phi = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0.0]]), math.radians(45.75)
    t = np.arange(10.0)
    setup = R.FixedPositionSetup(latitude=phi, gravity=9.8, k=17.2 * DPH / 1e-3, attitude=C)
    result = R.Reduction.reduce({"t_start": t, "t_end": t + 1.0, "mean": np.full(10, 6e-4)}, setup)
    assert result.coefficients[0].estimate == pytest.approx(15.041069 * math.sin(phi) - 10.32, abs=1e-6)
    assert result.tables[-1].rows[0][1] == pytest.approx(10.7740, abs=1e-4)


def test_dynamic_against_quasi_static(session: Session) -> None:
    """With noise the co-simulation stays within its own interval of what it gives without."""
    values = {**SHORT, "dwell": 600.0, "readings": 20, "attitude": "P E", "latitude": 0.6}
    quiet, noisy = (reduced(session, {**values, **q}, seed=5).coefficients[0] for q in (QUIET, {}))
    assert quiet.estimate == pytest.approx(quiet.truth, abs=1e-6)
    assert abs(noisy.estimate - quiet.estimate) < 4.0 * noisy.u and noisy.u > 1e-4


@pytest.mark.parametrize("correlated", [0.0, 0.002, 0.004])
@pytest.mark.long
def test_intervals_cover(correlated: float) -> None:
    """The default plan, white 0.0178 deg/h/sqrt(Hz) and Gauss-Markov noise of 300 s: of 100 intervals of coverage 0.93
    fewer than 83 hold the truth with probability 1e-4.
    """
    rng, n, window = np.random.default_rng(1), 30, 120.0
    t0 = 10.0 + window * np.arange(n)
    C = 0.0178**2 / window * np.eye(n) + correlated**2 * noise.process_covariance(t0, t0 + window, 300.0)
    L, k = np.linalg.cholesky(C), 17.2 * DPH / 1e-3
    setup = R.FixedPositionSetup(latitude=0.7, gravity=9.8, k=k, attitude=parse("E U", 0.7))
    hits = 0
    for _ in range(100):
        mean = (L @ rng.normal(size=n)) * DPH / k
        lo, hi = R.Reduction.reduce({"t_start": t0, "t_end": t0 + window, "mean": mean}, setup).coefficients[0].interval
        hits += lo <= 0.0 <= hi
    assert hits >= int(stats.binom.ppf(1e-4, 100, 0.93)), hits


# ------------------------------------------------------------------------------------------ uncertainty of type B
def test_budget_by_hand(session: Session) -> None:
    """Input axis up, output east, spin north.  Turned about O = E: I gains north, W cos phi; about S = N: I gains east,
    nothing.  Latitude: W cos phi.  Scale factor: k i = W sin phi - drift.
    """
    eps, phi = 1e-4, math.radians(50.0)
    values = {**SHORT, **QUIET, "latitude": phi, "attitude": "U E", "u_attitude": eps, "u_latitude": eps}
    values |= {"u_scale_factor": eps, "u_current": 1e-6}
    result = reduced(session, values)
    lines = {b.source: b.contribution for b in result.budget}
    north, up = W * math.cos(phi) / DPH, W * math.sin(phi) / DPH
    assert lines["gyro turned about its output axis"] == pytest.approx(north * eps, rel=1e-4)
    assert lines.get("gyro turned about its spin axis", 0.0) == pytest.approx(0.0, abs=1e-7)
    assert lines["latitude"] == pytest.approx(north * eps, rel=1e-4)
    assert lines["torquer scale factor"] == pytest.approx((up - result.coefficients[0].estimate) * eps, rel=1e-4)
    assert lines["offset of the current reading"] == pytest.approx(17.2e-3, rel=1e-4)
    # and the shift itself: the table tilted by eps about east tips U towards -N: omega_IA is W sin phi - eps W cos phi
    tilted = reduced(session, {**values, "table.tilt": [eps, 0.0]})
    shift = tilted.coefficients[0].estimate - result.coefficients[0].estimate
    assert shift == pytest.approx(north * eps, rel=0.1)


def test_a_measured_attitude_is_taken_out(session: Session) -> None:
    """Input axis up, the gyro turned about its output axis (east) by 60 arcsec: I gains -N, the Earth rate along it
    falls by W cos phi eps, and what is missing is taken for drift.  A gyro without g terms.
    """
    eps, phi = 60.0 * DPH, math.radians(50.0)
    values = {**SHORT, **QUIET, "latitude": phi, "attitude": "U E", **{f"gyro.{n}": 0.0 for n in drift.terms(9)}}
    wrong = {**values, "gyro.mount": frames.rotation([0.0, 1.0, 0.0], eps).T.tolist()}
    text = f"gyro turned about its output axis = {eps!r}(1e-6) rad"
    (plain,), (off,), (right,) = (
        reduced(session, v).coefficients for v in (values, wrong, {**wrong, "corrections": text})
    )
    assert off.estimate - plain.estimate == pytest.approx(W * math.cos(phi) * eps / DPH, rel=1e-3)
    assert right.estimate == pytest.approx(plain.estimate, abs=1e-5)


# ------------------------------------------------------------------------------------------ refusals
def test_refusals(session: Session) -> None:
    for values, said in (
        ({"gravity": 9.0}, "gravity 9 m/s²"),
        ({"gyro.mount": [[1, 0, 0], [0, 1, 0], [0, 0, -1]]}, "gyro.mount: determinant"),
    ):  # fmt: skip
        with pytest.raises(InvalidConfigurationError, match=re.escape(said)):
            session.run({**SHORT, **values})
    for values in ({"k": -1.0}, {"settle": 0.2}, {"readings": 7}, {"latitude": "91deg"}):
        with pytest.raises(InvalidValueError):
            load().with_values(values)
    with pytest.raises(InvalidConfigurationError, match="exchanges once a step"):
        session.run(SHORT, step=0.01)
    record = session.run({**SHORT, **QUIET, "attitude": "U E", "rebalance.i_max": 1e-4})
    with pytest.raises(ValueError, match="flagged windows"):
        load().with_values({"attitude": "U E"}).reduce(record)
    t = np.arange(6.0)
    setup = R.FixedPositionSetup(latitude=0.7, gravity=9.8, k=math.nan, attitude=2.0 * np.eye(3))
    with pytest.raises(ReductionError) as error:
        R.Reduction.reduce({"t_start": t, "t_end": t + 1.0, "mean": t}, setup)
    assert "scale factor" in str(error.value) and "attitude: rows are not orthonormal" in str(error.value)
    with pytest.raises(ReductionError, match="6 readings"):
        R.Reduction.reduce(
            {"t_start": t, "t_end": t + 1.0, "mean": t}, R.FixedPositionSetup(latitude=0.7, gravity=9.8, k=1.0)
        )


def test_trend_is_seen(session: Session) -> None:
    """Ageing by D_F p_F t: -0.3 deg/h 1e-3/s over 190 s is a trend of 0.057 deg/h, -1.08 deg/h/h: in the model, or
    found by the F test.  In the model it is no part of u.
    """
    values = {**SHORT, "dwell": 200.0, "readings": 20, "gyro.p_F": 1e-3, **QUIET, "gyro.white": 0.002 * DPH}
    result = reduced(session, values)
    assert result.repeatability["trend over the record / (°/h)"] == pytest.approx(-0.3e-3 * 190.0, rel=0.3)
    assert [c.name for c in result.coefficients] == ["ω_d", "trend"]
    trend = result.coefficients[1]
    assert trend.interval[0] < -0.3e-3 * 3600.0 < trend.interval[1] < -0.7
    plain = reduced(session, {**values, "nuisances": "none"})
    assert plain.repeatability["trend over the record / (°/h)"] == pytest.approx(-0.3e-3 * 190.0, rel=0.3)
    assert next(t.p for t in plain.tests if t.name == "trend") < 0.01
    assert plain.coefficients[0].u > 2.0 * result.coefficients[0].u


# ------------------------------------------------------------------------------------------ files and days
def test_laboratory_file(session: Session, tmp_path: Path, command: Command) -> None:
    values = {**SHORT, "attitude": "U E"}
    record = session.run(values, seed=2)
    expected = load().with_values(values).reduce(record).coefficients[0]
    w = record.windows
    code, template, err = command("reduce", NAME, "--template")
    assert code == 0, err
    rows = [f"{a!r},{b!r},{m * 1e3!r}" for a, b, m in zip(w["t_start"], w["t_end"], w["mean"], strict=True)]
    text = re.sub(r"np\.float64\(([^)]*)\)", r"\1", template.replace("E U -N", "U E N") + "\n".join(rows) + "\n")
    (tmp_path / "lab.csv").write_text(text, encoding="utf-8")
    code, _, err = command("reduce", NAME, "--data", tmp_path / "lab.csv", "--out", tmp_path / "out")
    assert code == 0, err
    result = json.loads((tmp_path / "out" / "result.json").read_text("utf-8"))
    assert result["simulated"] is False and result["coefficients"][0]["truth"] is None
    assert result["coefficients"][0]["estimate"] == pytest.approx(expected.estimate, abs=1e-8)
    for missing in ("latitude = 45.75deg", "k = 17.2deg/h/mA", "attitude = U E N"):
        (tmp_path / "bad.csv").write_text(text.replace(f"# {missing}\n", ""), encoding="utf-8")
        with pytest.raises(DataError, match=f"'{missing.split()[0]}' is not given"):
            load().read_measured(tmp_path / "bad.csv", {})


@pytest.mark.parametrize(("factor", "said"), [(1.0, ""), (1e3, "1030 times the Earth"), (1e-3, "less than that")])
def test_a_current_in_another_unit(tmp_path: Path, factor: float, said: str) -> None:
    """0.9 mA of 17.2 deg/h/mA are 15.5 deg/h, 1.03 of 15.04 deg/h; in mA of A 1029 times the Earth rate.  A scatter of
    0.0002 mA, 0.0034 deg/h in a minute, is a random walk of 0.0034 sqrt(1/60) = 4.4e-4 deg/sqrt(h), of a thousandth
    4.4e-7.
    """
    current = 0.9 + 2e-4 * np.random.default_rng(1).normal(size=40)
    rows = "".join(f"{60 * k},{60 * k + 60},{factor * x:.12g}\n" for k, x in enumerate(current.tolist()))
    head = "# latitude = 45.75deg\n# k = 17.2deg/h/mA\n# attitude = E U -N\n# type_b = none\n"
    (tmp_path / "lab.csv").write_text(f"{head}t_start [s],t_end [s],mean [mA]\n{rows}", encoding="utf-8")
    reasons = load().reduce(load().read_measured(tmp_path / "lab.csv", {})).reasons
    assert [said in r.text and "mA, not A" in r.text for r in reasons if r.id == "current.unit"] == [True] * bool(said)


@pytest.mark.long
def test_days(session: Session, tmp_path: Path) -> None:
    """Eight turn-ons of rms 0.2 deg/h: mean, sigma (n - 1), t interval; the scatter is found significant."""
    values, folders = {**SHORT, "gyro.turn_on": 0.2 * DPH}, []
    each = []
    for seed in range(8):
        folders.append(f"day{seed}")
        each.append(load().reduce(session.run(values, seed=seed, out=tmp_path / folders[-1])).coefficients[0].estimate)
    (tmp_path / "days.csv").write_text("run\n" + "\n".join(folders), encoding="utf-8")
    result = load().reduce(load().read_measured(tmp_path / "days.csv", {}))
    (c,) = result.coefficients
    assert c.estimate == pytest.approx(np.mean(each))
    sigma = float(np.std(each, ddof=1))
    assert result.repeatability["σ of ω_d / (°/h)"] == pytest.approx(sigma) and 0.08 < sigma < 0.4
    assert c.interval[1] - c.estimate == pytest.approx(stats.t.ppf(0.975, 7) * sigma / math.sqrt(8))
    assert result.tests[0].p is not None and result.tests[0].p < 1e-6
    assert "ω_d vary from day to day" in result.summary[0] or "ω_d" in result.summary[0]


# ------------------------------------------------------------------------------------------ noise coefficients
@pytest.mark.long
def test_long_record_gives_noise_coefficients(session: Session) -> None:
    """600 windows of 1 s: flicker and angle noise of the gyro lie in their intervals, in a test of 600 windows the
    flicker is not told from other slow noise; 30 windows: no table.
    """
    values = {**SHORT, **QUIET, "gyro.white": 0.003 * DPH, "gyro.flicker": 0.05 * DPH, "gyro.quantization": 1e-6}
    short = reduced(session, {**values, "readings": 30})
    assert "Noise coefficients" not in [t.title for t in short.tables]
    long = reduced(session, {**values, "readings": 600, "dwell": 600.0, "nuisances": "none"}, seed=7)
    (table,) = (t for t in long.tables if t.title == "Noise coefficients")
    rows = {row[0][0]: row for row in table.rows}
    for name, true in (("B", 0.05), ("Q", math.degrees(1e-6) * 3600.0)):
        assert rows[name][2] <= true <= rows[name][3]
    assert rows["B"][5] == "not determined" and rows["Q"][1] == pytest.approx(math.degrees(1e-6) * 3600.0, rel=0.15)
