"""What a rate table test says of readings in steps, of settling, of noise at large rates, of a whole-angle gyro."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gyrobench.engine.session import Session
from gyrobench.record.csv_reader import DataError
from gyrobench.report.diagnostics_section import validity
from gyrobench.report.page_model import Text
from gyrobench.report.result_json import Report
from gyrobench.result import Result
from gyrobench.system.system import load_system

NAME = "rate_table_test"
DEG, DPH = math.pi / 180.0, math.pi / 648000.0
SHORT: dict[str, Any] = {"cycles": 2, "dwell": 0.6, "settle": 0.3, "table.acceleration": 50.0}


def reduced(part: str, values: dict[str, Any], seed: int = 1) -> Result:
    system = load_system(NAME).with_values({n: v for n, v in (SHORT | values).items() if "." not in n})
    with Session(system, {"gyro": part}) as session:
        return system.reduce(session.run(SHORT | values, seed=seed))


def broken(result: Result) -> dict[str, float]:
    """Return the tests that the doubt of the result names, with their p."""
    said = next((r.text for r in result.reasons if r.id == "residuals.contradict"), "")
    return {t.id: t.p or 0.0 for t in result.tests if f"{t.name} p" in said}


def test_readings_that_are_all_steps_have_a_doubt() -> None:
    """Words of 33.5 deg/s at rates of 33.33 k deg/s: a gyro that is 0.3 % off reads 33.43 k as 33.5 k, 0.5 % off."""
    values = {"steps": 3, "gyro.white": 0.0, "gyro.scale": [3e-3, 0.0], "gyro.resolution": 33.5 * DEG}
    result = reduced("gyro_mems", values)
    e = result["e"]
    assert (e.estimate, e.truth) == (pytest.approx(5000.0, abs=0.1), pytest.approx(3000.0))
    assert "noise.none" in {r.id for r in result.reasons if r.severity == "doubt"}


def test_data_without_noise_and_steps_have_none() -> None:
    result = reduced("gyro_mems", {"steps": 3, "gyro.white": 0.0})
    assert "noise.none" not in {r.id for r in result.reasons}


def test_steps_larger_than_the_noise_repeat_at_each_rate() -> None:
    """Words of 7 deg/s read 16.7, 33.3, 50, 66.7, 83.3, 100 as 14, 35, 49, 70, 84, 98: off by -2.7, 1.7, -1, 3.3, 0.7,
    -2 deg/s, of neither square nor cubic, each time.
    """
    values = {"steps": 6, "gyro.white": 1e-4 * DEG, "gyro.resolution": 7.0 * DEG}
    assert "levels" in broken(reduced("gyro_mems", values))
    assert not broken(reduced("gyro_mems", values | {"gyro.resolution": 0.0}))


def test_a_slow_gyro_has_not_settled() -> None:
    """0.2 s after a ramp the filter of 1.5 Hz lacks exp(-0.7 9.4 0.2) = 0.26 of the step, and less after it."""
    values = {"settle": 0.2, "gyro.white": 0.1 * DEG, "gyro.bandwidth": 1.5}
    assert "settled" in broken(reduced("gyro_mems", values))
    assert not broken(reduced("gyro_mems", values | {"gyro.bandwidth": 50.0}))


def test_a_ring_laser_is_noisier_near_the_rate_of_its_dither() -> None:
    """sqrt(W2 - w2) of the noise falls to its floor at w = W = 100 deg/s, the largest rate; at W = 300 by 3 % alone."""
    near = broken(reduced("gyro_laser", {"gyro.dither": 100.0 * DEG}))
    assert "spread" in near
    assert not broken(reduced("gyro_laser", {"gyro.dither": 300.0 * DEG}))


def test_beyond_the_dither_there_is_no_truth_of_the_scale_factor() -> None:
    result = reduced("gyro_laser", {"gyro.dither": 60.0 * DEG, "gyro.dither_noise": 0.1})
    assert [result[n].truth for n in "eac"] == [None] * 3
    assert result["h"].truth == 0.0


def test_a_hysteresis_wider_than_a_step_has_no_truth() -> None:
    """A step of 20 deg/s goes twice through a width of 10, and half through one of 40 deg/s."""
    given = {"gyro.hysteresis": 0.05 * DEG, "gyro.hysteresis_width": 10.0 * DEG}
    assert reduced("gyro_mems", given)["h"].truth == pytest.approx(180.0)
    assert reduced("gyro_mems", given | {"gyro.hysteresis_width": 40.0 * DEG})["h"].truth is None


def test_a_whole_angle_gyro_is_simulated_and_turns_its_pattern() -> None:
    """Windows of 0.3 s at 20 deg/s turn the pattern by 0.277 x 6 = 1.7 deg: 90 deg need 90/(0.277 x 20) = 16.2 s."""
    result = reduced("gyro_hemispherical", {})
    assert result.simulated
    said = next(r for r in result.reasons if r.id == "rate.pattern")
    assert (said.severity, said.blocks) == ("doubt", ("pass", "fail"))
    assert "windows of 16 s and more at 20 °/s" in said.text
    long = reduced("gyro_hemispherical", {"steps": 2, "cycles": 1, "dwell": 15.0, "gyro.gain": 1.0})
    assert "rate.pattern" not in {r.id for r in long.reasons}  # 7.2 s at 50 deg/s: 360 deg
    assert "rate.pattern" not in {r.id for r in reduced("gyro_mems", {}).reasons}


def test_the_summary_does_not_call_white_what_the_tests_do_not() -> None:
    values = {"steps": 6, "gyro.white": 1e-4 * DEG, "gyro.resolution": 7.0 * DEG}
    noise = [s for s in reduced("gyro_mems", values).summary if s.startswith("Residual standard deviation")]
    assert len(noise) == 1
    assert "compatible with white noise" not in noise[0]


def test_words_of_the_gyro_are_doubted_where_they_are_as_large_as_the_steps() -> None:
    """One cycle of three steps and words of a step: whatever the fit leaves, 33.3/sqrt(12) = 9.6 deg/s are rounded."""
    word = 100.0 / 3.0 * 1.01 * DEG
    for white, said in ((1e-6 * DEG, True), (word / 10.0, False)):
        values = {"gyro.range_max": 0.0, "steps": 3, "cycles": 1, "gyro.resolution": word, "gyro.white": white}
        result = reduced("gyro_mems", values)
        assert ("gyro.words" in {r.id for r in result.reasons}) == said


def test_what_a_band_lacks_of_the_sweep_is_told_from_its_threshold() -> None:
    """A band of 1 deg/s, threshold 1.15 between 1.1 and 1.2, lacks (1/20)2/2 = 1250 ppm at 20 deg/s."""
    band = {"gyro.dead_band": DEG, "small": "0.5 1.1 1.2 1.9"}
    said = [r.text for r in reduced("gyro_fog", band).reasons if r.id == "threshold.tail"]
    assert len(said) == 1
    assert float(said[0].split("lacks ")[1].split()[0]) == pytest.approx(
        0.75 * (1.15 / 20.0) ** 2 / 2.0 * 1e6, rel=0.01
    )
    tiny = {"gyro.dead_band": 1e-4 * DEG, "small": "0.00005 0.0002 0.0004"}
    assert "threshold.tail" not in {r.id for r in reduced("gyro_fog", tiny).reasons}


def test_the_ratio_of_variances() -> None:
    """Four values of 2 and twelve of 1, signs by turns: 4; of white noise the probability is uniform, here near 0.5."""
    import gyrobench.reduction.estimation.residual_series as series

    rows = np.arange(16) < 4
    null = series.fitted_noise(np.ones((16, 1)))
    ratio, p = series.variance_ratio(np.where(rows, 2.0, 1.0) * (-1.0) ** np.arange(16), rows, null)
    assert ratio == pytest.approx(4.0)
    assert 0.001 < p < 0.1  # F(4, 12) beyond 4 has 0.027
    assert series.variance_ratio(np.ones(16), np.ones(16, dtype=bool), null) == (1.0, 1.0)


def test_the_rank_is_that_of_the_estimates_of_the_fit() -> None:
    """A threshold, which stands between two rates, is no unknown of the design matrix: rank 5 for 5, not for 6."""
    result = reduced("gyro_fog", {"gyro.dead_band": 0.02 * DEG, "small": "0.01 0.03 0.1"})
    assert len(result.coefficients) == 6
    texts = [b.text for s in validity(Report.of(result)) for b in s.blocks if isinstance(b, Text)]
    assert any(t.startswith("The design matrix has rank 5 for 5 reported estimates") for t in texts)


def series(late: float, phase: bool, window: float, folder: Path) -> Path:
    """Two cycles of 0, +-20, +-40 deg/s for 10 s at 10 Hz, a second between; a gyro with 0.2 % that is ``late``, s."""
    sweep = [0.0, *[20.0, 40.0, 20.0, 0.0, -20.0, -40.0, -20.0, 0.0] * 2]
    rate = np.concatenate([np.append(np.full(100, w), np.linspace(w, x, 12)[1:-1]) for w, x in pairwise([*sweep, 0.0])])
    number = np.concatenate([np.append(np.full(100, k + 1), np.zeros(10)) for k in range(len(sweep))])
    t = 0.1 * np.arange(rate.size)
    mean = 1.002 * np.interp(t - late, t, rate) + 0.01 * np.random.default_rng(1).normal(size=t.size)
    names = ["time [s]", *["phase"] * phase, "rate [deg/s]", "mean [deg/s]"]
    rows = [",".join(f"{v:.9g}" for v in row) for row in zip(t, *[number] * phase, rate, mean, strict=True)]
    head = ["# latitude = 0deg", "# type_b = none", "# samples = means", f"# window = {window}s", ",".join(names)]
    file = folder / "series.csv"
    file.write_text("\n".join([*head, *rows]) + "\n", encoding="utf-8")
    return file


def test_time_series_are_averaged_by_their_phases(tmp_path: Path) -> None:
    """The rates are those of the steps (they were their standard deviations, and transitions were averaged, too)."""
    system = load_system(NAME)
    record = system.read_measured(series(0.0, True, 3.0, tmp_path), {})
    assert np.unique(np.round(record.windows["rate"] / DEG, 6)).tolist() == [-40.0, -20.0, 0.0, 20.0, 40.0]
    e = system.reduce(record)["e"]
    assert e.estimate == pytest.approx(2000.0, abs=4.0 * e.u) and e.u < 30.0  # 0.01/sqrt(30) deg/s of 27 rms, 51 times
    with pytest.raises(DataError, match="add a column 'phase'"):
        system.read_measured(series(0.0, False, 3.0, tmp_path), {})


@pytest.mark.parametrize(("window", "said"), [(9.0, "rate.once"), (3.0, "record.unsettled")])
def test_a_late_gyro_that_is_read_once_a_rate_has_a_word(tmp_path: Path, window: float, said: str) -> None:
    """1.5 s late, a second of them in the ramp: the first 0.5 s of a rate hold 10 deg/s less on average, h is 0.5 deg/s
    and no residual shows it of one reading; of three the first is not as the others.
    """
    system = load_system(NAME)
    result = system.reduce(system.read_measured(series(1.5, True, window, tmp_path), {}))
    assert {r.id for r in result.reasons} & {"rate.once", "record.unsettled"} == {said}
    clean = system.reduce(system.read_measured(series(0.0, True, window, tmp_path), {}))
    assert not {r.id for r in clean.reasons} & {"rate.once", "record.unsettled"}


def steps(folder: Path, seed: int, fifth: float = 0.0, heat: float = 0.0, tau: float = 60.0) -> Result:
    """Two cycles of four steps to 50 deg/s, two readings of 5 s each, 0.01 deg/s of noise; a gyro whose fifth power is
    ``fifth`` (deg/s at 50 deg/s) and whose scale factor grows by ``heat`` over 50 deg/s where the largest rate has
    warmed it.
    """
    way = [12.5, 25.0, 37.5, 50.0, 37.5, 25.0, 12.5, 0.0]
    rate = np.repeat([0.0, *[*way, *(-w for w in way)] * 2], 2)
    x, before = rate / 50.0, 0.0
    warm = np.empty(x.size)
    for k, power in enumerate(x * x):
        after = power + (before - power) * math.exp(-5.0 / tau)
        warm[k], before = 0.5 * (before + after), after
    mean = rate + fifth * x**5 + heat * x * warm + 0.01 * np.random.default_rng(seed).normal(size=x.size)
    rows = [f"{5 * k},{5 * k + 5},{w:g},{y:.9g}" for k, (w, y) in enumerate(zip(rate, mean, strict=True))]
    file = folder / "steps.csv"
    head = ["# latitude = 0deg", "# type_b = none", "t_start [s],t_end [s],rate [deg/s],mean [deg/s]"]
    file.write_text("\n".join([*head, *rows]) + "\n", encoding="utf-8")
    system = load_system(NAME)
    return system.reduce(system.read_measured(file, {}))


def test_a_fifth_power_that_its_test_does_not_see(tmp_path: Path) -> None:
    """k x5 on x and x3: c = k (2.75 1.2081 - 1.7656 1.3877)/0.6989 = 1.248 k over R (sums of x2, x8, x4, x6, x =
    1/4, 1/2, 3/4 twice and 1), 749 ppm of k = 0.03 deg/s, 5 u; what is left is 1.1146 - 1.0960 = 0.0186 k2 of eight
    such sums, 1.3 times the variance of a reading.
    """
    result = steps(tmp_path, 2, fifth=0.03)
    c = result["c"]
    assert c.estimate == pytest.approx(749.0, abs=3.0 * c.u) and c.interval[0] > 300.0
    (reason,) = [r for r in result.reasons if r.id == "shape.with"]
    assert reason.severity == "condition" and reason.intervals["c"][0] < 0.0 < reason.intervals["c"][1]
    (told,) = [r for r in steps(tmp_path, 2, fifth=0.1).reasons if r.id == "shape.with"]
    assert told.severity == "warning"  # 15 times the variance of a reading


def test_heat_of_the_turning_is_no_hysteresis_and_no_scale_factor(tmp_path: Path) -> None:
    """A scale factor that lags by a minute behind the square of the rate, 0.2 % at the largest: 2000 ppm times the mean
    of the squares, 0.34, are in e, and a rate that was reached from above is warmer.  The gyro has neither e nor h.
    """
    result = steps(tmp_path, 1, heat=0.1)
    (reason,) = [r for r in result.reasons if r.id == "heat.with"]
    for name in "eh":
        (low, high), (wide, most) = result[name].interval, reason.intervals[name]
        assert not low < 0.0 < high and wide < 0.0 < most
