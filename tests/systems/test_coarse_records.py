"""Drift records that the noise model does not describe: coarse angles, rates that something else explains, limits."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from gyrobench.record.csv_reader import DataError
from gyrobench.record.record import Record
from gyrobench.reduction.series.deviations import Deviation
from gyrobench.reduction.series.noise_coefficients import slopes
from gyrobench.reduction.series.quantization import angle_quantization
from gyrobench.result import DriftRecordResult
from gyrobench.system.system import load_system

NAME = "drift_record"
pytestmark = pytest.mark.usefixtures("no_arma")
N_UNIT = math.sqrt(1.0 / 3600.0)  # deg/sqrt(h) of arcsec/sqrt(s): 3600 arcsec are a degree, 3600 s an hour


def counted(s: float, n: int = 3000, seed: int = 4) -> np.ndarray:
    """Counts of an angle that moves by 0.3 and normally by s counts from sample to sample."""
    rng = np.random.default_rng(seed)
    return np.floor(np.cumsum(0.3 + s * rng.normal(size=n)) + rng.random())


def read(file: Path, columns: dict[str, np.ndarray], **values: str) -> Record:
    rows = (",".join(f"{v:.15g}" for v in row) for row in zip(*columns.values(), strict=True))
    file.write_text("\n".join([",".join(columns), *rows, ""]), encoding="utf-8")
    return load_system(NAME).read_measured(file, {**values, "type_b": "none"})


def reduced(record: Record, **limits: tuple[float | None, float | None]) -> DriftRecordResult:
    found = load_system(NAME).reduce(record, limits or None)
    assert isinstance(found, DriftRecordResult)
    return found


def test_rounding_of_an_angle_is_white_from_two_fifths_of_a_step_on() -> None:
    """Correlation of neighbouring errors by the sawtooth's first harmonic, 6/pi2 exp(-2 pi2 s2) cos(2 pi 0.3): s = 0.25
    gives -0.055, 0.5 gives -0.0014; the change within a sample without the rounding is s."""
    for s, white in ((0.1, False), (0.25, False), (0.5, True), (2.0, True)):
        x = counted(s, 50_000)
        found = angle_quantization(np.diff(x) * 2e-6)
        assert found.step == pytest.approx(2e-6) and found.white == white
        if white:
            assert found.noise == pytest.approx(s * 2e-6, rel=0.03)
        assert angle_quantization(np.diff(x) * 2e-6, 2e-6) == found
    rng = np.random.default_rng(6)
    angle = np.cumsum(0.3 + 0.25 * rng.normal(size=200_000))
    e = np.floor(angle) - angle + 0.5
    expected = 6.0 / math.pi**2 * math.exp(-2.0 * math.pi**2 * 0.0625) * math.cos(0.6 * math.pi)
    assert np.mean(e[1:] * e[:-1]) * 12.0 == pytest.approx(expected, abs=0.01)


@pytest.mark.parametrize("column", ["counts [1]", "angle [arcsec]", "each [1]"])
@pytest.mark.long
def test_a_coarse_angle_is_named_and_passes_nothing(tmp_path: Path, column: str) -> None:
    """A quarter of a count of random change: N, 0.25 arcsec a second, comes out wrong by more than its interval."""
    x = counted(0.25)
    values = {"scale": "1arcsec"} if column[-2] == "1" else {}
    if column.startswith("each"):
        x, values["counts"] = np.diff(x, prepend=x[0]), "increments"
    record = read(tmp_path / "r.csv", {"time [s]": np.arange(float(x.size)), column: x}, **values)
    result = reduced(record, N=(0.0, 1.0), R=(None, 1e9))
    assert {c.verdict for c in result.coefficients if c.limit} == {"inconclusive"} and result.verdict == "inconclusive"
    assert result.warnings[0].startswith("Inconclusive instead of pass or fail: N, R.")
    assert any("The angle is rounded to 1″, more than 2.5 times its random change" in w for w in result.warnings)
    assert not any("largest or smallest value" in w for w in result.warnings)


@pytest.mark.long
def test_a_fine_angle_passes(tmp_path: Path) -> None:
    x = counted(0.8)
    record = read(tmp_path / "r.csv", {"time [s]": np.arange(float(x.size)), "counts [1]": x}, scale="1arcsec")
    result = reduced(record, N=(0.0, 1.0))
    low, high = result["N"].interval
    assert result["N"].verdict == "pass" and low < 0.8 * N_UNIT < high
    assert not any("rounded" in w for w in result.warnings)


@pytest.mark.long
def test_a_rate_that_another_column_explains_leaves_rounding(tmp_path: Path) -> None:
    x = np.random.default_rng(2).normal(size=1500)
    columns = {"time [s]": np.arange(1500.0), "rate [deg/h]": x, "T [degC]": 20.0 + 3.0 * x}
    result = reduced(read(tmp_path / "r.csv", columns), N=(0.0, 1.0))
    assert result["N"].verdict == "inconclusive"
    assert any("explain all of the rate but" in w and "computed from the rate" in w for w in result.warnings)


@pytest.mark.long
def test_a_line_at_half_the_sampling_rate_is_no_angle_noise(tmp_path: Path) -> None:
    """Levels in turn, 1 deg/h, and noise of 0.02: an angle error with (2 Q)^2 = 1 there would be one of 0.5 arcsec."""
    x = (-1.0) ** np.arange(1500) + 0.02 * np.random.default_rng(3).normal(size=1500)
    result = reduced(read(tmp_path / "r.csv", {"time [s]": np.arange(1500.0), "rate [deg/h]": x}), Q=(None, 0.1))
    assert result["Q"].no_value and result["Q"].verdict != "fail"
    assert math.isnan(result["Q"].interval[1]) or result["Q"].interval[1] < 0.1


@pytest.mark.parametrize("size", [1e-200, 1e300])
def test_rates_whose_squares_are_no_numbers_are_refused(tmp_path: Path, size: float) -> None:
    x = size * np.random.default_rng(1).normal(size=600)
    with pytest.raises(DataError, match="squares of them are beyond the numbers of the computer"):
        read(tmp_path / "r.csv", {"time [s]": np.arange(600.0), "rate [deg/h]": x})


def test_slopes_of_a_deviation_of_zero() -> None:
    """Two levels in turn have no deviation over even numbers of samples: nothing is read there, and nothing warns.

    From 8 to 16 samples the slope is -1: Q = 8 0.5/sqrt(3).
    """
    tau, dev = 2.0 ** np.arange(5.0), np.array([1.0, 0.0, 0.0, 0.5, 0.25])
    many = np.full(5, 100)
    with np.errstate(all="raise"):
        found = slopes(Deviation("allan", tau, dev, 0.9 * dev, 1.1 * dev, 0.5 * many, many, 0 * many))
    assert found["Q"].determined and found["Q"].value == pytest.approx(4.0 / math.sqrt(3.0))


@pytest.mark.parametrize(("n", "missing"), [(20_000, 0.1), (20_000, 0.2), (6_000, 0.04)])
@pytest.mark.long
def test_samples_missing_all_over_do_not_raise_the_white_noise(tmp_path: Path, n: int, missing: float) -> None:
    """N = 1 arcsec/sqrt(s): means over k of m samples have 1/k of the variance, at a tenth missing 1.11 times 1/m; a
    fifth missing leaves no stretch of 40 samples to tell.
    """
    rng = np.random.default_rng(21)
    x = rng.normal(size=n)
    x[rng.random(n) < missing] = math.nan
    record = read(tmp_path / "r.csv", {"time [s]": np.arange(float(n)), "rate [deg/h]": x})
    result = reduced(record)
    low, high = result["N"].interval
    assert low < N_UNIT < high and high - low < 0.4 * N_UNIT
    assert all(result[name].no_value for name in "BKR")
