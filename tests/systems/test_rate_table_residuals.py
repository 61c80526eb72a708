"""What a rate table test says of readings in steps, of settling, of noise at large rates, of a whole-angle gyro."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from gyrobench.engine.session import Session
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
