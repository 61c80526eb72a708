"""Columns that a drift rate follows: which are found, harmonics over an angle, the smoothed drift."""

from __future__ import annotations

import importlib
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gyrobench.record.csv_reader import DataError
from gyrobench.report import drift_record_page, report_files, result_json
from gyrobench.result import DriftRecordResult
from gyrobench.system.system import load_system

ROOM = type(load_system("drift_record")).__module__
R: Any = importlib.import_module(".regressors", ROOM)
ReductionError: Any = importlib.import_module(".reduction", ROOM).ReductionError


def reduce(file: Path, columns: dict[str, np.ndarray], **values: str) -> DriftRecordResult:
    np.savetxt(file, np.column_stack(list(columns.values())), "%.9g", ",", header=",".join(columns), comments="")
    system = load_system("drift_record")
    result = system.reduce(system.read_measured(file, {"type_b": "none", **values}))
    assert isinstance(result, DriftRecordResult)
    return result


def rows(result: DriftRecordResult, table: int = 0) -> dict[Any, list[Any]]:
    return {row[0]: row for row in result.columns[0].tables["regression"][table].rows}


def regress(y: np.ndarray, **others: np.ndarray) -> dict[str, Any]:
    return {r.name: r for r in R.regress(y, others, {})}


def test_of_two_columns_that_tell_the_same_one_stays() -> None:
    """Two thermometers 0.01 K apart: with both neither slope is known, with one it is 0.5 per K to 1 %.

    n = 2000, T of rms 2, white noise of 1: u of one slope 1/(2 sqrt(2000)) = 0.011.
    """
    rng = np.random.default_rng(1)
    n = 2000
    T = 2.0 * math.sqrt(2.0) * np.sin(6.0 * np.pi * np.arange(n) / n)
    y = 0.5 * T + rng.normal(size=n)
    found = regress(y, case=T + 0.1 * rng.normal(size=n), room=T + 0.1 * rng.normal(size=n), nothing=rng.normal(size=n))
    kept = [r for r in found.values() if r.kept]
    assert len(kept) == 1 and kept[0].name in ("case", "room")
    assert kept[0].slope == pytest.approx(0.5, abs=4 * 0.012) and kept[0].u == pytest.approx(0.0112, rel=0.2)
    assert kept[0].full[1] - kept[0].full[0] > 5.0 * 1.96 * 2.0 * kept[0].u, "with both it is not known"
    # the column makes 0.25 * 4 = 1 of the variance 1 + 1 of a sample; with both the interval of a share is wide
    share, low, high = kept[0].share
    assert share == pytest.approx(0.5, abs=4 * 0.0225) and low < 0.05 and high > share


@pytest.mark.long
def test_columns_of_noise_stay_out() -> None:
    """Six slow columns, a record of random walk and white noise: 7.5 % of records take one out, for all together.

    60 records: more than 10 have a probability of 0.003.  Under stationary noise (before) it was 28 %.
    """
    taken = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        y = rng.normal(size=800) + 0.05 * np.cumsum(rng.normal(size=800))
        walks = {f"c{k}": np.cumsum(rng.normal(size=800)) for k in range(6)}
        taken += any(r.kept for r in regress(y, **walks).values())
    assert taken <= 10


def test_a_column_that_is_another_is_named() -> None:
    y, a = np.random.default_rng(2).normal(size=(2, 600))
    with pytest.raises(ReductionError, match="column 'b' is a combination of the columns before it"):
        R.regress(y, {"a": a, "b": 2.0 * a}, {})


@pytest.fixture(scope="module")
def turning(tmp_path_factory: pytest.TempPathFactory) -> DriftRecordResult:
    """A table that turns 37 times in 6000 s at an uneven rate: 3 cos t - 4 cos 2t of the angle t, in deg/h, and noise.

    Means over n/200 samples, 30 s of 162 s a turn, would wash out a part of the second harmonic.
    """
    n = 6000
    t = np.arange(float(n))
    theta = 2.0 * np.pi * 37.0 * t / n + 0.3 * np.sin(2.0 * np.pi * t / 500.0)
    y = 3.0 * np.cos(theta) - 4.0 * np.cos(2.0 * theta) + np.random.default_rng(3).normal(size=n)
    columns = {"time [s]": t, "rate [deg/h]": y, "table [deg]": np.degrees(theta) % 360.0}
    return reduce(tmp_path_factory.mktemp("turning") / "r.csv", columns, angle="table", harmonics="3")


@pytest.mark.long
def test_harmonics_over_the_angle(turning: DriftRecordResult) -> None:
    """C sin(t + phi): 3 cos t = 3 sin(t + 90 deg), -4 cos 2t = 4 sin(2t - 90 deg); u = sqrt(2/n) = 0.018."""
    found = rows(turning, 1)
    assert list(found) == [1, 2, 3]
    for n, size, phase in ((1, 3.0, 90.0), (2, 4.0, -90.0)):
        _, C, u, phi, p = found[n]
        assert pytest.approx(size, abs=4 * u) == C and u == pytest.approx(math.sqrt(2.0 / 6000.0), rel=0.15)
        assert phi == pytest.approx(phase, abs=4.0 * math.degrees(u / size)) and p < 1e-6
    assert found[3][-1] > 0.05 / 3.0 and rows(turning)["cos3θ"][-1] == "not significant, left in"
    # what is left is the noise of 1 deg/h in 1 s: N = 1/60 deg/sqrt(h)
    assert turning["N"].interval[0] < 1.0 / 60.0 < turning["N"].interval[1]
    page = drift_record_page.page(result_json.Report.of(turning))
    assert "Harmonics over the angle" in str(page)


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ({"rate [deg/h]": 1.0}, "column 'table' is missing"),
        ({"rate [deg/h]": 1.0, "table [V]": 2.0}, r"\[V\] is no angle"),
        ({"rate [deg/h]": 1.0, "table [deg]": 50.0}, "50 deg from sample to sample; harmonic 2 needs 45 deg at most"),
    ],
)
def test_angles_that_carry_no_harmonics(tmp_path: Path, columns: dict[str, float], said: str) -> None:
    t = np.arange(600.0)
    table = {"time [s]": t, **{n: np.random.default_rng(1).normal(size=600) if k == 0 else v * t
                               for k, (n, v) in enumerate(columns.items())}}  # fmt: skip
    with pytest.raises(DataError, match=said):
        reduce(tmp_path / "r.csv", table, angle="table")


@pytest.mark.long
def test_the_smoothed_drift_follows_the_true_one(tmp_path: Path) -> None:
    """Gauss-Markov drift of 0.5 deg/h and 200 s under white noise of 1 deg/h in 1 s: its 95 % band holds it."""
    rng = np.random.default_rng(4)
    n, phi = 8000, math.exp(-1.0 / 200.0)
    drift = np.zeros(n)
    for k, w in enumerate(rng.normal(scale=0.5 * math.sqrt(1.0 - phi**2), size=n - 1)):
        drift[k + 1] = phi * drift[k] + w
    result = reduce(tmp_path / "r.csv", {"time [s]": np.arange(float(n)), "rate [deg/h]": drift + rng.normal(size=n)})
    s = {k: np.array(v) for k, v in result.columns[0].record.smoothed.__dict__.items()}
    true = np.interp(s["t"], np.arange(n) + 0.5, drift)
    assert 0.9 < np.mean((s["low"] < true) & (true < s["high"])) < 0.99
    assert np.std(s["mean"] - true) < 0.6 * np.std(drift)
    assert "smoothed from all samples" in str(drift_record_page.page(result_json.Report.of(result)))


@pytest.mark.long
def test_a_report_in_chinese_keeps_the_names_of_the_columns(tmp_path: Path) -> None:
    """A regressor, a channel and a sentence that names both, as a German logger calls them: no text of a catalogue."""
    rng = np.random.default_rng(4)
    n = 600
    time = np.arange(n, dtype=float)
    warming = 25.0 + 2.0 * (1.0 - np.exp(-time / 150.0))  # its rate of change follows it, by 1 - exp
    columns = {"time [s]": time, "Drehrate_X [deg/h]": rng.normal(size=n), "Temperatur [degC]": warming}
    columns["Beschl_X [m/s2]"] = 1e-3 * rng.normal(size=n)
    result = reduce(tmp_path / "a.csv", columns)
    page = report_files.page_in("zh", result_json.Report.of(result))
    said = str(page)
    for text in ("Drehrate_X", "Temperatur的变化率与Temperatur本身同步", "Beschl_X：比力"):
        assert text in said, text
