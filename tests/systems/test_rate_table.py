"""Rate table test of a rate gyro: random errors come back, threshold, set-up errors, measured files, mistakes named."""

from __future__ import annotations

import importlib
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gyrobench import frames
from gyrobench.engine.session import Session
from gyrobench.record.csv_reader import DataError
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import Result
from gyrobench.system.system import InvalidConfigurationError, load_system

NAME = "rate_table_test"
DEG, DPH = math.pi / 180.0, math.pi / 648000.0
SHORT: dict[str, Any] = {"cycles": 2, "dwell": 0.6, "settle": 0.3, "table.acceleration": 50.0}
QUIET = {"gyro.white": 0.0}
PACKAGE = type(load_system(NAME)).__module__
STEPS: Any = importlib.import_module(".steps", PACKAGE)


def reduced(session: Session, values: dict[str, Any], seed: int = 1) -> Any:
    options = {n: v for n, v in values.items() if "." not in n}
    return load_system(NAME).with_values(options).reduce(session.run(values, seed=seed))


def found(result: Result) -> dict[str, Any]:
    return {c.name: c for c in result.coefficients}


# ------------------------------------------------------------------------------------------------ plan
def test_the_order_of_the_rates() -> None:
    assert STEPS.sweep(2.0, 2, 1) == [0.0, 1.0, 2.0, 1.0, 0.0, -1.0, -2.0, -1.0, 0.0]
    assert len(STEPS.sweep(1.0, 5, 3)) == 1 + 4 * 5 * 3


def test_directions_and_cycles() -> None:
    rate = np.array([0.0, 0.0, 1.0, 1.0, 2.0, 1.0, 0.0, -1.0, -2.0, -1.0, 0.0])
    assert STEPS.direction(rate).tolist() == [0, 0, 1, 1, 1, -1, -1, -1, -1, 1, 1]
    # phases of 2 steps and 2 cycles: 1 at rest, 2 to 9, 10 to 17
    assert STEPS.cycle_of(np.array([1, 2, 9, 10, 17]), 2).tolist() == [1, 1, 1, 2, 2]


def test_small_rates_leave_the_earth_rate_to_the_table() -> None:
    system: Any = load_system(NAME).with_values({"small": "0.1", "latitude": "30deg"})
    earth = frames.EARTH_RATE * 0.5
    there = [0.1 * DEG - earth, -0.1 * DEG - earth]
    assert system.rates()[-4:] == pytest.approx([*there, *reversed(there)])


# ------------------------------------------------------------------------------------------------ errors that come back
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_random_errors_without_noise(session: Session, seed: int) -> None:
    rng = np.random.default_rng(seed)
    e, a, c = rng.uniform(-1e-2, 1e-2, 3)
    h, b = rng.uniform(0.0, 0.05) * DEG, rng.uniform(-1.0, 1.0) * DEG
    values = {
        **SHORT, **QUIET, "latitude": float(rng.uniform(-1.4, 1.4)), "gyro.scale": [e, 0.0], "gyro.asymmetry": a,
        "gyro.cubic": c / (100.0 * DEG) ** 2, "gyro.hysteresis": h, "gyro.bias": [b, 0.0],
    }  # fmt: skip
    coefficients = found(reduced(session, values))
    expected = {"e": e * 1e6, "a": a * 1e6, "c": c * 1e6, "h": h / DPH, "b": b / DPH}
    for name, x in expected.items():
        assert coefficients[name].truth == pytest.approx(x, rel=1e-9), name
        assert coefficients[name].estimate == pytest.approx(x, rel=1e-6, abs=1e-4), name


def test_the_intervals_hold_the_truth_with_noise(session: Session) -> None:
    values = {**SHORT, "gyro.scale": [1e-3, 0.0], "gyro.asymmetry": 5e-4}
    coefficients = found(reduced(session, values, seed=4))
    for name in "eachb":
        assert abs(coefficients[name].z) < 3.5, name  # fixed seed


def test_repeatability_is_the_scatter_of_the_cycles(session: Session) -> None:
    result = reduced(session, {**SHORT, "cycles": 4}, seed=5)
    table = next(t for t in result.tables if t.id == "rate.cycles")
    scales = np.array([row[1] for row in table.rows])
    assert result.repeatability["scale factor, standard deviation from cycle to cycle / ppm"] == pytest.approx(
        scales.std(ddof=1)
    )
    # white noise only: the scatter is that of the noise, 3 degrees of freedom (0.27 to 1.77 times it at 95 %)
    ratio = scales.std(ddof=1) / result.repeatability["of it by noise of the readings / ppm"]
    assert 0.2 < ratio < 2.2


def test_departures_from_the_straight_line(session: Session) -> None:
    """A cubic c over -R ... R leaves of the line through all readings what numpy's line leaves."""
    c = 2e-3
    result = reduced(session, {**SHORT, **QUIET, "gyro.cubic": c / (100.0 * DEG) ** 2})
    table = next(t for t in result.tables if t.id == "rate.departures")
    x = np.array(STEPS.sweep(1.0, 5, 2))
    line = np.polyfit(x, c * x**3, 1)
    expected = np.max(np.abs(c * x**3 - np.polyval(line, x))) * 1e6
    assert max(abs(row[2]) for row in table.rows) == pytest.approx(expected, rel=1e-3)


# ------------------------------------------------------------------------------------------------ threshold
@pytest.mark.parametrize(
    ("part", "given", "between"),
    [
        ("gyro_fog", {"gyro.dead_band": 0.02 * DEG, "gyro.optical": 0.0}, (0.02, 0.03)),
        ("gyro_laser", {"gyro.lock_in": 0.04 * DEG, "gyro.dither": 0.0}, (0.04, 0.06)),
    ],
)
def test_threshold_of_a_dead_band(part: str, given: dict[str, Any], between: tuple[float, float]) -> None:
    """0.02/sqrt(3/4) = 0.0231 lies between 0.02 and 0.03, 0.0462 between 0.04 and 0.06."""
    values = {**SHORT, "small": "0.01 0.02 0.03 0.04 0.06 0.1", **given}
    system = load_system(NAME).with_values({"small": values["small"]})
    with Session(system, {"gyro": part}) as session:
        result = system.reduce(session.run(values))
    threshold = found(result)["threshold"]
    assert threshold.interval == pytest.approx(between)
    assert threshold.interval[0] <= threshold.truth <= threshold.interval[1]
    # at rest the gyro reads 0, not the Earth rate of 10.8 deg/h: those readings are no part of the fit
    assert abs(found(result)["b"].estimate) < 0.1


def test_threshold_that_is_not_there_or_not_seen(session: Session) -> None:
    small = {**SHORT, "small": "0.5 1"}
    below = found(reduced(session, {**small, **QUIET}))["threshold"]
    assert below.no_value and below.interval == pytest.approx((0.0, 0.5))
    noisy = found(reduced(session, {**small, "small": "0.001", "gyro.white": 1.0 * DEG}))["threshold"]
    assert noisy.no_value and "too noisy" in noisy.no_value


def test_a_drift_between_the_small_rates_is_no_answer(tmp_path: Path) -> None:
    """A gyro that answers none of the small rates, and whose bias b wanders from phase to phase: half the difference of
    the senses is 0.04 at 0.06 deg/s and 0.05 at 0.08 deg/s, by chance.  By the readings within a phase alone (0.001)
    these were answers, "threshold below 0.06"; the repeats of 0.08 differ by 0.06: b wanders.
    """
    rng = np.random.default_rng(5)
    rate, mean = lab(rng, 1e-3)
    small = np.array([0.06, -0.06, 0.08, -0.08])
    b = [0.04, -0.04, 0.08, -0.02, -0.08, 0.02, -0.04, 0.04]
    more = np.repeat([*small, *small[::-1]], 2) - frames.EARTH_RATE * 0.5 / DEG
    wandering = np.repeat(b, 2) + 1e-3 * rng.normal(size=16)
    both = np.concatenate([rate, more]), np.concatenate([mean, wandering])
    assert found(measured(write(tmp_path / "twice.csv", *both)))["threshold"].no_value.startswith("not determined")


# ------------------------------------------------------------------------------------------------ set-up errors
def test_budget_and_predicted_shift_of_the_set_up(session: Session) -> None:
    """u_time is u of e; a leaning table axis changes b by W cos(latitude) tilt, as predicted."""
    values = {**SHORT, **QUIET, "gyro.bias": [1.0 * DEG, 0.0], "u_time": 1e-4, "u_axis": 1e-3, "latitude": "60deg"}
    plain = found(reduced(session, values))
    assert plain["e"].u == pytest.approx(100.0, rel=0.02)
    assert plain["b"].u == pytest.approx(frames.EARTH_RATE * 0.5 * 1e-3 / DPH, rel=0.02)
    tilted = reduced(session, {**values, "table.tilt": [1e-3, 0.0]})
    shift = found(tilted)["b"].estimate - plain["b"].estimate
    table = next(t for t in tilted.tables if t.id == "budget.predicted")
    predicted = next(row for row in table.rows if row[0] == "b")
    assert shift == pytest.approx(float(predicted[2]), rel=0.02)
    assert abs(shift) == pytest.approx(frames.EARTH_RATE * 0.5 * 1e-3 / DPH, rel=0.02)


def test_a_leaning_input_axis_reads_its_cosine(session: Session) -> None:
    """About y by 20 mrad: cos - 1 = -200 ppm; stated by u_mount = 20 mrad: sqrt(2) 4e-4."""
    s, c = math.sin(0.02), math.cos(0.02)
    values = {**SHORT, **QUIET, "gyro.mount": [[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]], "u_mount": 0.02}
    e = found(reduced(session, values))["e"]
    assert e.estimate == pytest.approx((c - 1.0) * 1e6, abs=1.0)
    assert e.u == pytest.approx(math.sqrt(2.0) * 400.0, rel=0.01)


# ------------------------------------------------------------------------------------------------ measured data
def lab(rng: np.random.Generator, noise: float = 0.01) -> tuple[np.ndarray, np.ndarray]:
    """Rates of two cycles, two readings each, and a gyro with 0.1 % and 3 deg/h at latitude 30 deg, in deg/s."""
    rate = np.repeat(STEPS.sweep(50.0, 4, 2), 2)
    earth = frames.EARTH_RATE * 0.5 / DEG
    return rate, 1.001 * (rate + earth) + 3.0 / 3600.0 + noise * rng.normal(size=rate.size)


HEAD = "t_start [s],t_end [s],rate [deg/s],mean [deg/s]"


def write(file: Path, rate: np.ndarray, mean: np.ndarray, head: str = HEAD) -> Path:
    rows = [f"{5 * k},{5 * (k + 1)},{r:.9g},{y:.9g}" for k, (r, y) in enumerate(zip(rate, mean, strict=True))]
    file.write_text("\n".join(["# latitude = 30deg", "# type_b = none", head, *rows]) + "\n", encoding="utf-8")
    return file


def measured(file: Path) -> Result:
    system = load_system(NAME)
    return system.reduce(system.read_measured(file, {}))


def said(result: Result) -> str:
    return " ".join(r.text for r in result.reasons)


def test_a_measured_file(tmp_path: Path) -> None:
    result = measured(write(tmp_path / "a.csv", *lab(np.random.default_rng(1))))
    c = found(result)
    assert abs(c["e"].estimate - 1000.0) < 3.0 * c["e"].u and c["e"].u < 100.0
    assert abs(c["b"].estimate - 3.0) < 3.0 * c["b"].u
    assert "times the rate" not in said(result)


def test_hysteresis_that_changes_with_the_rate_is_said(tmp_path: Path) -> None:
    """It was in h, 8 u off the mean of nothing, and no word was said."""
    rate, mean = lab(np.random.default_rng(1))
    ways = np.repeat(np.sign(np.diff(rate[::2], prepend=rate[0])), 2)
    result = measured(write(tmp_path / "a.csv", rate, mean + 0.05 * ways * np.abs(rate) / 50.0))
    assert {"residuals.contradict", "hysteresis.rate"} <= {r.id for r in result.reasons}


def test_a_dead_band_is_not_read_as_a_scale_factor(tmp_path: Path) -> None:
    """A dead band d takes d off all rates beyond it.  Of the levels x = 1/4, 1/2, 3/4 twice and 1 once least squares
    make of it e x + c x3 with e = -(d/R) (4 * 1.3877 - 2.125 * 1.7656)/(2.75 * 1.3877 - 1.7656^2) = -2.574 d/R (sums of
    x, x6, x3, x4, x2): -1030 ppm of d = 0.02 deg/s, R = 50 deg/s.  Small rates of which one has no answer let it into
    the model; without them an F test names it.
    """
    rng = np.random.default_rng(3)
    rate, _ = lab(rng)
    earth, small = frames.EARTH_RATE * 0.5 / DEG, [0.01, 0.1, 0.3]
    for given in ([], small):
        every = np.append(rate, np.repeat([s * r - earth for r in given for s in (1.0, -1.0, -1.0, 1.0)], 2))
        w = every + earth
        passed = np.sign(w) * np.maximum(np.abs(w) - 0.02, 0.0)
        mean = 1.001 * passed + 3.0 / 3600.0 + 0.01 * rng.normal(size=w.size)
        result = measured(write(tmp_path / "a.csv", every, mean))
        e, ids = found(result)["e"], {r.id for r in result.reasons}
        if given:
            assert e.interval[0] < 1000.0 < e.interval[1] and e.u < 400.0
            assert not {"fifth", "dead_band"} & ids
        else:
            assert {"dead_band", "residuals.contradict"} <= ids
            assert e.estimate == pytest.approx(1000.0 - 1030.0, abs=3.0 * e.u)


def test_a_lock_in_that_no_small_rate_shows(tmp_path: Path) -> None:
    """sqrt(w2 - d2) of d = 0.5 deg/s lacks 0.01 deg/s, the noise, at 12.5 deg/s, and the Earth rate at rest: e is 4 u
    off.  The interval with a dead band and a lock-in holds it; a record with small rates needs none.
    """
    rng = np.random.default_rng(8)
    rate, _ = lab(rng)
    earth = frames.EARTH_RATE * 0.5 / DEG
    w = rate + earth
    passed = np.sign(w) * np.sqrt(np.maximum(w * w - 0.5**2, 0.0))
    result = measured(write(tmp_path / "a.csv", rate, 1.001 * passed + 3.0 / 3600.0 + 0.01 * rng.normal(size=w.size)))
    (reason,) = [r for r in result.reasons if r.id == "threshold.unmeasured"]
    low, high = reason.intervals["e"]
    e = found(result)["e"]
    assert not e.interval[0] < 1000.0 < e.interval[1] and low < 1000.0 < high
    small = np.repeat([s * r - earth for r in (0.6, 0.8) for s in (1.0, -1.0, -1.0, 1.0)], 2)
    every = np.append(rate, small)
    result = measured(write(tmp_path / "b.csv", every, 1.001 * (every + earth) + 0.01 * rng.normal(size=every.size)))
    assert "threshold.unmeasured" not in {r.id for r in result.reasons}


@pytest.mark.parametrize("cycles", [1, 2])
def test_a_scale_factor_that_changes_is_no_asymmetry(tmp_path: Path, cycles: int) -> None:
    """One cycle at 30 ppm a reading: the middles of the senses are 44 readings apart, 1320 ppm of asymmetry that is not
    there; it read -1120 with u = 200 and no word.  Of two cycles an F test says so.
    """
    rng = np.random.default_rng(5)
    rate = np.repeat(STEPS.sweep(50.0, 11, cycles), 2)
    earth = frames.EARTH_RATE * 0.5 / DEG
    scale = 1.0 + 30e-6 * np.arange(rate.size)
    result = measured(write(tmp_path / "a.csv", rate, scale * (rate + earth) + 0.01 * rng.normal(size=rate.size)))
    a = found(result)["a"]
    assert ("scale.time" in {r.id for r in result.reasons}) == (cycles == 2)
    assert cycles == 2 or a.interval[0] < 0.0 < a.interval[1]
    assert ("scale trend" in found(result)) == (cycles == 1)


def exchanged(rate: np.ndarray, mean: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The rates of the second and the third step, in the two readings of each."""
    return rate[[0, 1, 4, 5, 2, 3, *range(6, rate.size)]], mean


def reversed_step(rate: np.ndarray, mean: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.where(np.isin(np.arange(rate.size), [6, 7]), -rate, rate), mean


def row_before(rate: np.ndarray, mean: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """One reading a step, written one row late."""
    return rate[2::2], mean[:-2:2]


def late_row(rate: np.ndarray, mean: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Row 13, the first reading at 25 deg/s after 37.5: 0.3 of its mean is of the rate before."""
    mean[12] += 0.3 * (rate[11] - rate[12])
    return rate, mean


def row_of_the_step_before(rate: np.ndarray, mean: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    mean[20] = mean[19]
    return rate, mean


def late_rows(rate: np.ndarray, mean: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The first of both readings of each rate has begun too early: 0.1 of it is of the rate before."""
    mean[2::2] += 0.1 * (rate[1:-1:2] - rate[2::2])
    return rate, mean


def rate_left_out(rate: np.ndarray, mean: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Both readings at 25 deg/s on the way down are at 37.5: the table stayed."""
    mean[12:14] = mean[10:12] + 0.01
    return rate, mean


def wild_row(rate: np.ndarray, mean: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Beyond both neighbours: 50 deg/s is the largest rate."""
    mean[8] += 5.0
    return rate, mean


@pytest.mark.parametrize(
    ("mistake", "words"),
    [
        (late_row, "row 13 left out (held is 0.3 of the rate before)"),
        (row_of_the_step_before, "row 21 left out (held is 1 of the rate before)"),
        (rate_left_out, "rows 13 to 14 left out (held is 1 of the rate before)"),
        (late_rows, "a part of 0.1 of the rate before in each reading that begins a rate"),
        (wild_row, "row 9 left out (off by 5 °/s)"),
        (exchanged, "the rates of steps 2 and 3 exchanged"),
        (reversed_step, "the sense of the rate reversed in 2 rows"),
        (row_before, "the reading belonging to the row before"),
    ],
)
@pytest.mark.long
def test_mistakes_that_residuals_show(tmp_path: Path, mistake: Any, words: str) -> None:
    rate, mean = lab(np.random.default_rng(2))
    assert words in said(measured(write(tmp_path / "a.csv", *mistake(rate, mean))))


def test_rates_without_their_sign(tmp_path: Path) -> None:
    rate, mean = lab(np.random.default_rng(2))
    with pytest.raises(ReductionError, match="negative sense given without their sign"):
        measured(write(tmp_path / "a.csv", np.abs(rate), mean))


def test_readings_without_their_sign(tmp_path: Path) -> None:
    """abs(w) = asymmetry 2, scale factor 0: no residual shows it."""
    rate, mean = lab(np.random.default_rng(2))
    assert "given without their sign" in said(measured(write(tmp_path / "a.csv", rate, np.abs(mean))))


@pytest.mark.parametrize(
    ("rate_factor", "mean_factor", "words"),
    [(1.0, -1.0, "reversed"), (1.0, math.pi / 180.0, "rad/s"), (1.0, 3600.0, "°/h"), (1.0, 1.25, "Check the senses")],
)
@pytest.mark.long
def test_mistakes_that_no_residual_shows(tmp_path: Path, rate_factor: float, mean_factor: float, words: str) -> None:
    rate, mean = lab(np.random.default_rng(3))
    result = measured(write(tmp_path / "a.csv", rate_factor * rate, mean_factor * mean))
    assert words in said(result) and "times the rate" in said(result)


def test_refused(tmp_path: Path) -> None:
    rate, mean = lab(np.random.default_rng(4))
    with pytest.raises(ReductionError, match="one sense only"):
        measured(write(tmp_path / "a.csv", rate[rate >= 0.0], mean[rate >= 0.0]))
    with pytest.raises(ReductionError, match="fewer than three rates"):
        measured(write(tmp_path / "b.csv", np.tile([50.0, -50.0], 10), np.tile([50.0, -50.0], 10)))
    with pytest.raises(DataError, match="rate"):
        measured(write(tmp_path / "c.csv", rate, mean, "t_start [s],t_end [s],rate [deg],mean [deg/s]"))


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"small": "0.1 x"}, "numbers in deg/s"),
        ({"small": "50"}, "below the first step"),
        ({"small": "0.2 0.1"}, "must rise"),
        ({"cycles": 6}, "phases"),
    ],
)
def test_refused_plans(values: dict[str, Any], words: str) -> None:
    with pytest.raises(InvalidConfigurationError, match=words):
        load_system(NAME).with_values(values).refuse()


def test_a_vibrating_gyro_by_hand() -> None:
    """Rebalance: 1 % scale times cos 0.1; bias with quadrature 2 deg/s through sin 0.1.  Open loop at its split: 1.

    A whole-angle gyro has its rate, and no stated truth.
    """
    given = {"gyro.white": 0.0, "gyro.scale": [0.01, 0.0], "gyro.phase_error": [0.1, 0.0], "gyro.range_max": 0.0}
    with Session(NAME, {"gyro": "gyro_vibratory"}) as prepared:
        for quadrature in (0.0, 2.0 * DEG):
            result = reduced(prepared, {**SHORT, **given, "gyro.quadrature": [quadrature, 0.0]})
            e, b = found(result)["e"], found(result)["b"]
            assert e.estimate == pytest.approx(1e6 * (1.01 * math.cos(0.1) - 1.0), abs=1e-2)
            assert e.truth == pytest.approx(e.estimate, abs=1e-2)
            assert b.estimate == pytest.approx(quadrature * math.sin(0.1) / DPH, abs=1e-2)
            assert (b.truth is None) == (quadrature > 0.0)
        still = {"gyro.white": 0.0, "gyro.closed": 0.0, "settle": 2.0}
        assert abs(found(reduced(prepared, {**SHORT, **still}))["e"].estimate) < 50.0  # ppm: what rings on after 2.3 s
    with Session(NAME, {"gyro": "gyro_hemispherical"}) as prepared:
        result = reduced(prepared, {**SHORT, "gyro.white": 0.0})
    assert abs(found(result)["e"].estimate) < 20.0 and found(result)["e"].truth is None  # ppm, its drift by angle


def test_a_bias_that_jumps_in_one_sweep_is_named(tmp_path: Path) -> None:
    """5 standard deviations of a reading: the likeliest noise is then a random walk, in which no step stands out; but
    that the rest walks nowhere is less likely than a jump.  b was 4 u off without a word; a clean sweep is not named.
    """
    rate, mean = lab(np.random.default_rng(6))
    half = rate.size // 2
    for by, said in ((0.0, False), (0.05, True)):
        jumped = mean[:half] + np.where(np.arange(half) >= 20, by, 0.0)
        text = " ".join(r.text for r in measured(write(tmp_path / "a.csv", rate[:half], jumped)).reasons)
        assert ("From row 21 on the level of the record is another one" in text) == said
