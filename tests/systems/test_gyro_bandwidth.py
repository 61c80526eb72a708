"""Bandwidth of a rate gyro: closed forms come back, set-up errors, measured files, mistakes named."""

from __future__ import annotations

import importlib
import math
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import optimize, signal
from wired import Native

from gyrobench.engine.session import Session
from gyrobench.result import Result
from gyrobench.system.system import load_system

NAME = "gyro_bandwidth"
RESPONSE: Any = importlib.import_module(".response", type(load_system(NAME)).__module__)
#: twelve frequencies up to 150 Hz in some 15 s of table time
SHORT: dict[str, Any] = {"points": 12, "lowest": 3.0, "highest": 150.0, "dwell": 0.3, "periods": 10, "settle": 0.3}
QUIET: dict[str, Any] = {"gyro.white": 0.0}
HEAD = "frequency [Hz],table [deg/s],gyro [deg/s],phase [deg]"


def reduced(part: str, values: dict[str, Any], seed: int = 1) -> Result:
    options = {n: v for n, v in values.items() if "." not in n}
    with Session(NAME, {"gyro": part}) as session:
        record = session.run(values, seed=seed)
    result: Result = load_system(NAME).with_values(options).reduce(record)
    return result


def found(result: Result) -> dict[str, Any]:
    return {c.name: c for c in result.coefficients}


def butterworth(f: np.ndarray, order: int, bandwidth: float) -> np.ndarray:
    b, a = signal.butter(order, 2.0 * math.pi * bandwidth, analog=True)
    return np.asarray(signal.freqs(b, a, 2.0 * np.pi * f)[1])


@pytest.mark.long
@pytest.mark.parametrize("period", [1e-3, 1.23e-3, 4e-3])
def test_samples_that_are_held(period: float) -> None:
    """A sample each period T, held: sinc(f T) exp(-s T/2) times the two poles of 50 Hz, so T/2 later.

    1 ms against the record's 0.6 ms: images f_s - f fold onto 100 Hz; 1.23 ms are no whole steps; of 4 ms 125 Hz is
    half the rate.  Steps h of 0.1 ms: sinc(f h) twice, of table and gyro.
    """
    options = SHORT | QUIET | {"highest": 125.0, "gyro.period": period}
    result = reduced("gyro_mems", options)
    c = found(result)
    assert c["delay"].estimate == pytest.approx(1e3 * (math.sqrt(2.0) / (100.0 * math.pi) + 0.5 * period), abs=1e-3)

    def fallen(f: float) -> float:
        gain = np.sinc(f * period) * np.sinc(f * 1e-4) ** 2 / math.sqrt(1.0 + (f / 50.0) ** 4)
        return float(gain) - math.sqrt(0.5)

    assert c["f_3dB"].estimate == pytest.approx(optimize.brentq(fallen, 20.0, 60.0), rel=2e-5)
    assert not [r.id for r in result.reasons if r.id.startswith(("response.", "truth."))]
    assert ("Left out: 125 Hz" in " ".join(result.conventions)) == (period == 4e-3)


# ------------------------------------------------------------------------------------------------ figures of a curve
@pytest.mark.parametrize("order", [1, 2, 3, 4, 5])
def test_a_butterworth_has_its_order(order: int) -> None:
    f = np.geomspace(1.0, 200.0, 25)
    r = RESPONSE.figures(RESPONSE.GyroResponse.of(f, 0.98 * butterworth(f, order, 60.0), np.full(f.size, 1e-4)))
    K, f3, f90, _, n = r.value
    assert (K, f3, n) == pytest.approx((0.98, 60.0, order), rel=1e-5)
    b, a = signal.butter(order, 2.0 * math.pi * 60.0, analog=True)
    w = np.linspace(1e-3, 2.0 * math.pi * 200.0, 200_001)
    phase = np.unwrap(np.angle(signal.freqs(b, a, w)[1]))
    late = np.flatnonzero(phase < -0.5 * math.pi)
    assert (f90 == pytest.approx(w[late[0]] / (2.0 * math.pi), rel=1e-4)) if late.size else math.isnan(f90)
    assert r.value[3] == pytest.approx(-phase[1] / w[1], rel=2e-3)


@pytest.mark.parametrize("gap", [(0.0, 0.0), (15.0, 111.0)])
def test_a_phase_that_turns_between_points(gap: tuple[float, float]) -> None:
    """A link that is 30 ms late: 1.3 turns from 157 to 200 Hz; one of 4 ms and a gap: 138 degrees by it, 117 by two
    poles of 40 Hz.  Continuous: -w T - arctan2(1.4 x, 1 - x2), x = f/40 Hz.
    """
    f = np.geomspace(1.0, 200.0, 23)
    f = f[(f <= gap[0]) | (f >= gap[1])]
    late = 0.004 if gap[1] else 0.03
    x = f / 40.0
    r = RESPONSE.GyroResponse.of(f, np.exp(-2j * np.pi * f * late) / (1.0 + 1.4j * x - x * x), np.full(f.size, 1e-3))
    assert r.phase == pytest.approx(-2.0 * np.pi * f * late - np.arctan2(1.4 * x, 1.0 - x * x))
    assert RESPONSE.figures(r).value[3] == pytest.approx(late + 1.4 / (80.0 * math.pi), rel=1e-6)


def test_the_order_of_one_pole_is_not_known_exactly() -> None:
    """A second pole at 2 kHz is below the noise: 2 f^2 [1/(f^2 + 40^2) + 1/(f^2 + 2000^2)] = 1.0004 at -3 dB, not 1."""
    f = np.geomspace(1.0, 200.0, 25)
    noise = np.random.default_rng(3).normal(size=(2, f.size)) * 3e-3
    value = np.exp(noise[0] + 1j * noise[1]) / ((1.0 + 1j * f / 40.0) * (1.0 + 1j * f / 2000.0))
    r = RESPONSE.figures(RESPONSE.GyroResponse.of(f, value, np.full(f.size, 3e-3)))
    assert r.curve.shape == (1, False)
    assert 1e-4 < r.u[4] < 1e-2
    assert abs(r.value[4] - 1.0004) < 2.0 * r.u[4]


@pytest.mark.long
def test_random_responses_come_back() -> None:
    """24 low-passes with a delay, noise of 0.3 %: z of all figures, chi2 of 96 within 4 standard deviations."""
    rng = np.random.default_rng(4)
    f = np.geomspace(1.0, 200.0, 20)
    squares = []
    for _ in range(24):
        b, z, t = rng.uniform(30.0, 80.0), rng.uniform(0.5, 0.9), rng.uniform(0.0, 2e-3)

        def true(g: np.ndarray, b: float = b, z: float = z, t: float = t) -> np.ndarray:
            x = 1j * g / b
            return np.asarray(np.exp(-2j * np.pi * g * t) / (1.0 + 2.0 * z * x + x * x))

        noisy = true(f) * np.exp(3e-3 * (rng.normal(size=f.size) + 1j * rng.normal(size=f.size)))
        r = RESPONSE.figures(RESPONSE.GyroResponse.of(f, noisy, np.full(f.size, 3e-3)))
        dense = np.linspace(0.01, 200.0, 20_000)
        values = true(dense)
        gain, phase = np.abs(values), np.unwrap(np.angle(values))
        f3 = np.interp(-math.sqrt(0.5), -gain[gain.argmax() :], dense[gain.argmax() :])
        f90 = np.interp(0.5 * math.pi, -phase, dense)
        delay = t + 2.0 * z / (2.0 * math.pi * b)
        squares.append(((r.value[:4] - [1.0, f3, f90, delay]) / r.u[:4]) ** 2)
    assert np.sum(squares) == pytest.approx(96.0, abs=4.0 * math.sqrt(2.0 * 96.0) * 1.3)


# ------------------------------------------------------------------------------------------------ runs
@pytest.mark.parametrize(
    ("part", "given", "expected"),
    [
        # two poles of the filter: 50 Hz both, order 2; delay sqrt(2)/(2 pi 50)
        ("gyro_mems", {"gyro.white": 0.0}, (1.0, 50.0, 50.0, math.sqrt(2.0) / (0.1 * math.pi), 2.0)),
        # rebalance of 30 Hz: one pole; the delay of the wide filter beside it
        ("gyro_vibratory", {"gyro.white": 0.0, "gyro.loop": 30.0, "gyro.bandwidth": 5000.0},
         (1.0, 30.0, None, 1e3 / (60.0 * math.pi) + math.sqrt(2.0) / (10.0 * math.pi), 1.0)),
        # mean of the step that ends: half of 0.1 ms
        ("gyro_fog", {"gyro.optical": 0.0}, (1.0, None, None, 0.05, None)),
    ],
)  # fmt: skip
@pytest.mark.long
def test_closed_forms_come_back(part: str, given: dict[str, Any], expected: tuple[float | None, ...]) -> None:
    c = found(reduced(part, {**SHORT, **given}))
    for name, value in zip(("K", "f_3dB", "f_90", "delay", "order"), expected, strict=True):
        if value is None:
            assert c[name].no_value, name
        else:
            assert c[name].estimate == pytest.approx(value, rel=3e-3), name
            assert c[name].estimate == pytest.approx(c[name].truth, rel=1e-3), name


def test_the_table_loses_no_angle() -> None:
    part = Native("rate_table_vibrating", read_gain=0.01, read_lag=1e-3)
    part.initialize()
    part.motion_angle, part.motion_rate, part.motion_acceleration = [0, 0, 0.2], [0, 0, 3.0], [0, 0, 10.0]
    part.do_step(0.0, 0.1)
    assert part.omega[2] == pytest.approx(2.0)  # 0.2 rad in 0.1 s
    assert part.rate_read == pytest.approx(1.01 * (3.0 - 0.01))


# ------------------------------------------------------------------------------------------------ files
def written(tmp_path: Path, rows: np.ndarray, comments: str = "") -> Path:
    file = tmp_path / "r.csv"
    head = f"{HEAD},u [1]" if rows.shape[1] == 5 else HEAD
    lines = [",".join(f"{x:.9g}" for x in row) for row in rows]
    file.write_text("\n".join([*comments.splitlines(), head, *lines]) + "\n", encoding="utf-8")
    return file


def rows_of(order: int = 2, bandwidth: float = 50.0, noise: float = 1e-3) -> np.ndarray:
    rng = np.random.default_rng(5)
    f = np.geomspace(1.0, 200.0, 20)
    h = butterworth(f, order, bandwidth) * np.exp(noise * (rng.normal(size=20) + 1j * rng.normal(size=20)))
    return np.column_stack([f, np.full(20, 10.0), 10.0 * np.abs(h), np.degrees(np.unwrap(np.angle(h)))])


def measured(tmp_path: Path, rows: np.ndarray, comments: str = "# type_b = none\n# arrangement = checked") -> Result:
    system = load_system(NAME).with_values({})
    result: Result = system.reduce(system.read_measured(written(tmp_path, rows, comments), {}))
    return result


@pytest.mark.long
def test_a_measured_file(tmp_path: Path) -> None:
    """With u and without: the scatter about the curve takes its place."""
    rows = rows_of()
    for table in (rows, np.column_stack([rows, np.full(20, 1e-3)])):
        c = found(measured(tmp_path, table))
        assert abs(c["f_3dB"].estimate - 50.0) < 4.0 * c["f_3dB"].u < 0.2
        assert c["order"].estimate == pytest.approx(2.0, abs=0.02)


def test_nothing_stated_nothing_passes(tmp_path: Path) -> None:
    """Each figure needs what moves it: K the gain of the reading of the table, f_90 and the delay its lag."""
    gain, lag, left_out = "# u_gain = 1e-3", "# u_lag = 1e-5s", {"gain": ("K",), "lag": ("f_90", "delay")}
    for said in ("", gain, lag, f"{gain}\n{lag}", "# type_b = none"):
        result = measured(tmp_path, rows_of(), said)
        names = [left_out[n] for n in left_out if f"u_{n}" not in said and "type_b" not in said]
        reasons = [r for r in result.reasons if r.id == "type_b.unstated" and r.blocks == ("pass", "fail")]
        assert [r.names for r in reasons] == names and all(r.text in result.summary for r in reasons)


@pytest.mark.long
def test_what_no_residual_shows_is_asked_for(tmp_path: Path) -> None:
    """Frequencies in rad/s are fitted as well: f_3dB is 6.28 times what it is, with a u of a thousandth."""
    rows = rows_of()
    rows[:, 0] *= 2.0 * np.pi
    result = measured(tmp_path, rows, "# type_b = none")
    asked = next(r for r in result.reasons if r.id == "arrangement.unstated")
    assert asked.blocks == ("pass",) and "frequencies in rad/s given as Hz" in asked.text
    assert "a time base wrong by 2 % (f_3dB by" in asked.text.replace("delay", "f_3dB").replace("f_90", "f_3dB")
    for said in ("# u_time = 1e-3", "# u_gain = 1e-3"):
        result = measured(tmp_path, rows, said)
        text = next(r.text for r in result.reasons if r.id == "arrangement.unstated")
        assert ("a time base" in text) is ("u_gain" in said) and ("a gain of" in text) is ("u_time" in said)
    assert "arrangement.unstated" not in [r.id for r in measured(tmp_path, rows).reasons]


def mistaken(kind: str) -> np.ndarray:
    rows = rows_of(noise=1e-4)
    w = 2.0 * math.pi * rows[:, 0]
    if kind == "sense":
        rows[:, 3] += 180.0
    elif kind == "sign":
        rows[:, 3] *= -1.0
    elif kind == "unit":
        rows[:, 2] *= 3600.0
    elif kind == "integral":
        rows[:, 2] /= w
        rows[:, 3] -= 90.0
    elif kind == "derivative":
        rows[:, 1] /= w
        rows[:, 3] += 90.0
    elif kind == "rows":
        rows[[4, 11], 2:] = rows[[11, 4], 2:]
    else:
        rows[9, 2] *= 1.2
    return rows


@pytest.mark.parametrize(
    ("kind", "id", "said"),
    [
        ("sense", "response.sense", "reversed"),
        ("sign", "response.lead", "opposite sign"),
        ("unit", "response.factor", "°/h"),
        ("integral", "response.angle", "integral of the rate"),
        ("derivative", "response.angle", "derivative of the rate"),
        ("rows", "response.exchanged", "Hz and"),
        ("point", "response.outlier", "off the curve"),
    ],
)
@pytest.mark.long
def test_mistakes_are_named(tmp_path: Path, kind: str, id: str, said: str) -> None:
    reasons = {r.id: r.text for r in measured(tmp_path, mistaken(kind)).reasons}
    assert said in reasons.get(id, f"only {sorted(reasons)}")


@pytest.mark.long
def test_a_good_record_names_none(tmp_path: Path) -> None:
    reasons = [r.id for r in measured(tmp_path, rows_of(noise=1e-4)).reasons]
    assert not [r for r in reasons if r.startswith("response.")]


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"lowest": 300.0}, "must be below highest"),
        ({"highest": 2000.0}, "20 communication steps"),
        ({"lowest": 0.01}, "turns the table by"),
    ],
)
def test_refused(values: dict[str, Any], said: str) -> None:
    assert said in " ".join(load_system(NAME).with_values(values).check())


# ------------------------------------------------------------------------------------------------ what u does not show
def low_pass(change: str, noise: float = 1e-3) -> np.ndarray:
    """Rows without u of 1/(1 + s/(2 pi 40 Hz)) with something that no curve of poles makes, or nothing."""
    rng = np.random.default_rng(9)
    f = np.geomspace(1.0, 200.0, 25)
    h = np.exp(noise * (rng.normal(size=25) + 1j * rng.normal(size=25))) / (1.0 + 1j * f / 40.0)
    gain, phase = np.abs(h), np.degrees(np.angle(h))
    if change == "half the points 2 % up":
        gain[12:] *= 1.02
    elif change == "phases in rad":
        phase = np.radians(phase)
    elif change == "rms":
        gain *= math.sqrt(0.5)
    elif change == "per minute":
        gain /= 60.0
    return np.column_stack([f, np.full(25, 10.0), 10.0 * gain, phase])


def test_scatter_that_is_none(tmp_path: Path) -> None:
    """Without u the scatter about the curve takes its place: K was then 10 u off and no word was said."""
    withheld = {r.id for r in measured(tmp_path, low_pass("half the points 2 % up")).reasons if r.severity == "doubt"}
    assert withheld == {"response.misfit"}
    assert not measured(tmp_path, low_pass("")).reasons


def test_phases_in_radians_are_named(tmp_path: Path) -> None:
    assert "response.radians" in {r.id for r in measured(tmp_path, low_pass("phases in rad")).reasons}


@pytest.mark.parametrize(("change", "said"), [("rms", "rms value"), ("per minute", "per minute")])
def test_the_nearest_factor_is_named(tmp_path: Path, change: str, said: str) -> None:
    """1/60 lies within 10 % of pi/180, which was named."""
    (reason,) = [r for r in measured(tmp_path, low_pass(change)).reasons if r.id == "response.factor"]
    assert said in reason.text


def test_neighbours_by_chance() -> None:
    """Of 400 records of white noise about a straight line in ln f, p is below 0.05 in some 20."""
    misfit = importlib.import_module("gyrobench.reduction.loops.curve_misfit")
    rng, x = np.random.default_rng(2), np.linspace(-1.0, 1.0, 20)
    X = np.column_stack([np.ones(20), x])
    of = lambda p: np.vstack([X @ p[:2], X @ p[2:]])  # noqa: E731
    count = 0
    for _ in range(400):
        y = rng.standard_normal((2, 20))
        p = np.concatenate([np.linalg.lstsq(X, row, rcond=None)[0] for row in y])
        count += misfit.alike(of, p, np.ones(4), y - of(p)) < 0.05
    assert 8 <= count <= 34  # 20 and 3.3 standard deviations
    bent = np.vstack([3.0 * x**2 + 0.3 * rng.standard_normal(20), 0.3 * rng.standard_normal(20)])
    p = np.concatenate([np.linalg.lstsq(X, row, rcond=None)[0] for row in bent])
    assert misfit.alike(of, p, np.ones(4), bent - of(p)) < 1e-3


@pytest.mark.parametrize(("at", "withheld"), [(20.0, set()), (47.0, {"response.between"})])
def test_a_resonance_in_the_band_is_in_the_curve(tmp_path: Path, at: float, withheld: set[str]) -> None:
    """Two poles of 50 Hz and a suspension that takes 2 % of the force, damping 0.03; truth by the same closed form.  By
    poles alone f_3dB was off by up to 9 u.  About the crossing itself no verdict rests on what is between the points.
    """

    def true(f: np.ndarray | float) -> Any:
        x, y = 1j * f / 50.0, 1j * f / at
        return (1.0 - 0.02 * y * y / (1.0 + 0.06 * y + y * y)) / (1.0 + math.sqrt(2.0) * x + x * x)

    rng, f = np.random.default_rng(6), np.geomspace(1.0, 200.0, 40)
    h = true(f) * np.exp(1e-3 * (rng.normal(size=40) + 1j * rng.normal(size=40)))
    rows = np.column_stack([f, np.full(40, 10.0), 10.0 * np.abs(h), np.degrees(np.unwrap(np.angle(h)))])
    for table in (rows, np.column_stack([rows, np.full(40, 1e-3)])):
        result = measured(tmp_path, table)
        c = found(result)["f_3dB"]
        (said,) = re.findall(r"a resonance at (\S+) Hz", " ".join(result.conventions))
        assert float(said) == pytest.approx(at, rel=1e-2)
        assert {r.id for r in result.reasons if r.blocks} == withheld
        crossing = optimize.brentq(lambda f: abs(true(f)) - math.sqrt(0.5), at, 60.0)
        assert abs(c.estimate - crossing) < 3.0 * c.u < 3.0


def test_a_late_sample_and_a_table_that_falls_off_are_said(tmp_path: Path) -> None:
    """1 ms of lag is in the phase alone: two poles at 50 Hz have a delay of sqrt 2/(2 pi 50) = 4.50 ms, the rest is no
    pole's.  No residual has it, nor 2 % of amplitude at the highest frequency: both are asked for.  A table that
    falls off by 4 % makes the gain that of more poles, whose phase is not there."""
    rows = rows_of()
    late = rows - np.outer(rows[:, 0], [0.0, 0.0, 0.0, 0.36])
    result = measured(tmp_path, late, "# type_b = none")
    assert found(result)["delay"].estimate == pytest.approx(5.50, abs=0.02)
    assert any(text.startswith("1 ms of the delay (u = 0.0004") for text in result.conventions)
    (asked,) = (r.text for r in result.reasons if r.id == "arrangement.unstated")
    assert "a reading late by 1 ms (a sample too much) (f_90 by" in asked
    assert "an amplitude wrong by 2 % at the highest frequency (" in asked
    low = rows * np.column_stack([*np.ones((2, 20)), 1.0 - 0.04 * (rows[:, 0] / 200.0) ** 2, np.ones(20)])
    for table, said in ((rows, False), (low, True)):
        assert any(r.id == "response.early" for r in measured(tmp_path, table).reasons) == said


def test_a_resonance_whose_covariance_is_singular_has_its_variances() -> None:
    """Of a covariance of one direction, less a little by rounding, no root of Cholesky: the step along it is its own.

    K alone (its logarithm) is off by 0.01: the mean square of exp(+-0.01 sqrt n) - 1 over n is 0.01 squared.
    """
    n = 6
    p = np.array([0.0, 1e-3, math.log(0.3), math.log(2.0 * math.pi * 80.0), 0.01, 0.1])
    cov = np.zeros((n, n))
    cov[0, 0] = 1e-4
    curve = RESPONSE.PoleCurve(0, p, cov - 1e-22 * np.eye(n), 1.0, 10, 0.0, 100.0, resonant=True)
    variance = curve.variances()
    assert variance[0] == pytest.approx(1e-4, rel=0.01)


@pytest.mark.parametrize(("poles", "said"), [(1, "1 pole and a delay"), (2, "2 poles and a delay")])
def test_one_pole_is_one(poles: int, said: str) -> None:
    curve = SimpleNamespace(poles=poles, resonant=False)
    test = SimpleNamespace(figures=SimpleNamespace(curve=curve))
    reduction: Any = importlib.import_module(".reduction", type(load_system(NAME)).__module__)
    assert reduction.Reduction._curve_named(test) == said
