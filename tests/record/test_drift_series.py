"""Drift records as a laboratory has them: columns, units, gaps, resets, time, sizes; and what a wrong file is told."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from gyrobench.record import block_means, drift_series
from gyrobench.record.csv_reader import DataError
from gyrobench.record.drift_columns import find_signals, open_table
from gyrobench.record.drift_series import DriftReader

DPH, ARCSEC = math.pi / 648000.0, math.pi / 648000.0
N, STEP = 1000, 0.01
RATE = np.random.default_rng(1).normal(size=N)  # deg/h
TIME = np.arange(N) * STEP


def write(folder: Path, columns: dict[str, Any], head: str = "", name: str = "record.csv") -> Path:
    """A CSV; NaN is an empty cell."""
    rows = zip(*(np.asarray(c).tolist() for c in columns.values()), strict=True)
    cells = (",".join("" if isinstance(v, float) and math.isnan(v) else str(v) for v in row) for row in rows)
    file = folder / name
    file.write_text("\n".join([*head.splitlines(), ",".join(columns), *cells, ""]), encoding="utf-8")
    return file


def read(
    file: Path,
    channel: str = "",
    scale: str = "",
    increments: bool = False,
    regressors: str = "",
    sampling: float = 0.0,
) -> tuple[DriftReader, dict[str, Any], list[tuple[str, int, Any]]]:
    table = open_table(file)
    reader = DriftReader(table, find_signals(table, channel, scale, increments), regressors, sampling)
    runs: list[tuple[str, int, Any]] = []
    columns = reader.read(lambda name, first, values: runs.append((name, first, values.copy())))
    return reader, columns, runs


def test_a_rate_in_any_unit_and_file(tmp_path: Path) -> None:
    """CSV with decimal commas, in deg/s and minutes; Parquet with the unit in the name or in the field."""
    rows = [f"{k};{t / 60.0:.9f};{x / 3600.0:.12f}" for k, (t, x) in enumerate(zip(TIME, RATE, strict=True))]
    german = "\n".join(["number;time [min];rate [deg/s]", *(r.replace(".", ",") for r in rows)])
    (tmp_path / "g.csv").write_text(german + "\n", encoding="utf-8")
    pq.write_table(pa.table({"time [s]": TIME, "rate [deg/h]": RATE.astype(np.float32)}), tmp_path / "a.parquet")
    fields = [
        pa.field("time", pa.float64(), metadata={"unit": "ms"}),
        pa.field("rate", pa.float64(), metadata={"unit": "deg/h"}),
    ]
    pq.write_table(pa.table([TIME * 1e3, RATE], schema=pa.schema(fields)), tmp_path / "b.parquet")
    for name, close in (("g.csv", 1e-6), ("a.parquet", 1e-6), ("b.parquet", 1e-12)):
        reader, columns, _ = read(tmp_path / name)
        assert list(columns) == ["time", "rate"] and reader.about.step == pytest.approx(STEP, rel=1e-6)
        assert np.allclose(columns["rate"], RATE * DPH, rtol=0, atol=close * 5 * DPH)


def test_gaps_are_found_and_kept(tmp_path: Path) -> None:
    """Rows missing, a cell without a value and a flagged row: NaN at their places."""
    there = np.ones(N, bool)
    there[100:110] = False
    x, flag = RATE.copy(), np.zeros(N)
    x[500], flag[700] = np.nan, 1.0
    temperature = np.where(np.arange(N) % 10 == 0, 20.0 + TIME, np.nan)
    columns = {"time [ms]": TIME * 1e3, "rate [deg/h]": x, "flag": flag, "temperature [degC]": temperature}
    reader, out, runs = read(write(tmp_path, {n: v[there] for n, v in columns.items()}))
    lost = ~there | np.isnan(x) | (flag > 0)
    assert np.array_equal(np.isnan(out["rate"]), lost) and np.allclose(out["rate"][~lost], RATE[~lost] * DPH)
    assert not runs  # every sample is held: no deviation needs another account of them
    about = reader.about
    assert (about.gaps, about.missing, about.incomplete, about.flagged) == (3, 12, 1, 1)
    assert about.longest == (pytest.approx(0.99), pytest.approx(0.11))
    assert out["temperature"][57] == pytest.approx(273.15 + 20.5)  # the reading before, logged every tenth sample


@pytest.mark.parametrize("timed", [True, False])
def test_a_long_gap_is_cut_short(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, timed: bool) -> None:
    """The grid holds LONG steps of it, the times are those of the file, and so are the samples missing."""
    monkeypatch.setattr(drift_series, "LONG", 50)
    monkeypatch.setattr("gyrobench.record.time_series.BLOCK", 1000)
    keep = (np.arange(N) < 300) | (np.arange(N) >= 700)
    columns = {"time [s]": TIME[keep], "rate [deg/h]": RATE[keep]}
    x = np.where(keep, RATE, np.nan)
    reader, out, _ = read(write(tmp_path, columns if timed else {"rate [deg/h]": x}), sampling=0.0 if timed else 100)
    assert reader.about.missing == 400 and reader.about.gaps == 1 and out["rate"].size == 649
    assert np.isnan(out["rate"][300:349]).all() and np.allclose(out["rate"][349:], RATE[700:] * DPH)
    assert out["time"][349] == pytest.approx(7.0) and reader.about.last == pytest.approx(9.99)


def test_rate_of_angles_and_counts(tmp_path: Path) -> None:
    """Difference quotients; a counter of 16 bits is unwrapped, one that was reset is a gap, and both are counted."""
    counts = np.round(np.cumsum(100 + 10 * RATE)).astype(int)
    reset = counts.copy()
    reset[600:] -= reset[599]
    angle = np.cumsum(RATE) * STEP * DPH  # rad
    turned = np.degrees(np.angle(np.exp(1j * (angle * 1e5 + 3.0))))  # crosses +-180 deg
    file = write(tmp_path, {"time [s]": TIME, "a": counts % 65536, "b": reset}, "# scale = 0.5arcsec")
    reader, out, _ = read(file, scale="0.5arcsec")
    expected = np.diff(counts) * 0.5 * ARCSEC / STEP
    assert np.allclose(out["a"][1:], expected) and reader.about.wraps == {"a": 1} and reader.about.resets == {"b": 1}
    assert np.flatnonzero(np.isnan(out["b"])).tolist() == [0, 600]
    assert np.allclose(np.delete(out["b"], [0, 600]), np.delete(expected, 599))
    assert np.allclose(reader.beginning["a"] / ARCSEC, 0.5 * np.diff(counts))  # increments, unwrapped
    coarse = np.cumsum(np.where(np.arange(N) % 3 == 1, 16, 15))  # most steps are 15: one more is no reset
    reader, out, _ = read(write(tmp_path, {"time [s]": TIME, "c": coarse}, "# scale = 0.5arcsec"), scale="0.5arcsec")
    assert not reader.about.resets and np.allclose(out["c"][1:], np.diff(coarse) * 0.5 * ARCSEC / STEP)
    _, out, _ = read(write(tmp_path, {"time [s]": TIME, "angle [deg]": turned}))
    assert np.allclose(out["angle"][1:], RATE[1:] * DPH * 1e5, rtol=1e-6)
    _, out, _ = read(write(tmp_path, {"time [s]": TIME, "turn [arcsec]": RATE}), increments=True)
    assert np.allclose(out["turn"], RATE * ARCSEC / STEP)
    _, out, _ = read(write(tmp_path, {"time [s]": TIME, "i [mA]": RATE}), scale="17.2deg/h/mA")
    assert np.allclose(out["i"], RATE * 17.2 * DPH)


def test_time_stamps(tmp_path: Path) -> None:
    """Stamps rounded to 1 ms at 300 Hz are a grid, and a rate from an angle takes its step; jitter is told."""
    t = np.round(np.arange(N) / 300.0, 3)
    angle = np.cumsum(1000.0 + RATE)
    reader, out, _ = read(write(tmp_path, {"time [s]": t, "angle [arcsec]": angle}))
    assert reader.about.rounded == 1e-3 and reader.about.step == pytest.approx(1 / 300.0, rel=1e-3)
    assert np.nanstd(out["angle"]) == pytest.approx(np.std(RATE) * 300.0 * ARCSEC, rel=0.01)  # not 14 % of the mean
    uneven = TIME + 0.05 * STEP * np.random.default_rng(2).normal(size=N)
    reader, _, _ = read(write(tmp_path, {"time [s]": uneven, "rate [deg/h]": RATE}))
    assert not reader.about.rounded and reader.about.jitter == pytest.approx(0.05 * math.sqrt(2), rel=0.1)


@pytest.mark.parametrize("timed", [True, False])
def test_bounded_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, timed: bool) -> None:
    """At most MOST means are held, each of all its samples or a gap; the runs are complete."""
    monkeypatch.setattr(block_means, "MOST", 64)
    monkeypatch.setattr("gyrobench.record.time_series.BLOCK", 1000)  # bytes: the file comes in some 20 blocks
    x = RATE.copy()
    x[[5, 6, 7, 300, 301, 511, 998]] = np.nan
    columns = {"time [s]": TIME, "rate [deg/h]": x}
    file = write(tmp_path, columns if timed else {"rate [deg/h]": x})
    reader, out, runs = read(file, sampling=0.0 if timed else 100.0)
    assert reader.held.factor == 16 and out["rate"].size == 62
    assert np.allclose(out["time"][[1, 61]], [0.235, 9.835])  # the middle of the samples of a mean
    expected = (x * DPH)[: 62 * 16].reshape(62, 16).mean(axis=1)
    assert np.allclose(out["rate"], expected, equal_nan=True)
    assert np.array_equal(np.concatenate([v for _, _, v in runs]), (x * DPH)[np.isfinite(x)])
    assert np.array_equal(np.concatenate([k + np.arange(v.size) for _, k, v in runs]), np.flatnonzero(np.isfinite(x)))


BACK = TIME.copy()
BACK[500:] -= 1.0
TWO = np.concatenate([TIME[:500], TIME[499] + 0.1 * np.arange(1, 501)])
# four samples 2 ms apart, then one after 36 to 48 ms: means of 10 ms
BURSTS = np.cumsum(np.where(np.arange(N) % 5, 0.002, np.random.default_rng(2).uniform(0.036, 0.048, N)))
PAIRS = np.cumsum(np.where(np.arange(N) % 2 == 0, 0.01, 0.004))


@pytest.mark.parametrize(
    ("columns", "scale", "words"),
    [
        ({"time [s]": BACK, "rate [deg/h]": RATE}, "", "row 502: time = 4 s does not come after 4.99 s"),
        ({"time [s]": np.floor(TIME * 20.0), "rate [deg/h]": RATE}, "", "as in the row before (800 rows"),
        ({"time [s]": np.floor(TIME * 20.0), "rate [deg/h]": RATE}, "", "its rate: sampling = 5.02Hz"),
        ({"time [s]": TWO, "rate [deg/h]": RATE}, "", "the sampling changes from 0.01 s to 0.1 s at about row"),
        ({"time [s]": BURSTS, "rate [deg/h]": RATE}, "", "come in bursts, 0.002 s apart with a mean of 0.0"),
        ({"time [s]": PAIRS, "rate [deg/h]": RATE}, "", "not evenly spaced: steps from 0.004 to 0.01 s"),
        ({"time [s]": PAIRS, "rate [deg/h]": RATE}, "", "its rate: sampling = 142.9Hz"),  # means of 0.007 s
        ({"time": TIME, "rate [deg/h]": RATE}, "", "column 'time': no unit; write 'time [s]'"),
        ({"time [kg]": TIME, "rate [deg/h]": RATE}, "", "column 'time': wrong unit [kg]"),
        ({"time [s]": TIME, "rate": RATE}, "", "column 'rate': no unit; a drift record holds a rate [deg/h]"),
        ({"time [s]": TIME, "rate [deg/m]": RATE}, "", "column 'rate': [deg/m] is no rate, angle or specific force"),
        ({"time [s]": TIME, "rate [°/hour]": RATE}, "", "unknown symbol 'hour'"),
        ({"time [s]": TIME, "i [mA]": RATE}, "17.2", "scale = 17.2: no unit"),
        ({"time [s]": TIME, "i [mA]": RATE}, "17.2deg/h/V", "is no rate, angle or specific force"),
        ({"rate [deg/h]": RATE}, "", "no sampling rate is given: write '# sampling = 100Hz'"),
        ({"t [ms]": TIME, "rate [deg/h]": RATE}, "", "column 'time [s]' is missing (is it 't [ms]'? name it time)"),
        ({"time [s]": TIME, "n": 15.0 * np.arange(N)}, "0.5arcsec", "column 'n': every step of it is 3.6361e-05 rad"),
        ({"time [s]": TIME, "rate [deg/h]": np.full(N, np.nan)}, "", "0 samples with a value; 1000 of 1000 rows have"),
        ({"time [s]": TIME, "rate [deg/h]": np.full(N, 2.0)}, "", "all its values are"),
        ({"time [s]": TIME, "rate [deg/h]": ["0.1", "fast"] * 500}, "", "column 'rate': 500 cells are not a number"),
        ({"time [s]": ["2026-05-01T00:00:00"] * N, "rate [deg/h]": RATE}, "", "00:00:00' (a date: write seconds from"),
        ({"time [s]": TIME, "temperature [degC]": RATE}, "", "no rate, angle or specific force among the columns of"),
    ],
)  # fmt: skip
def test_wrong_files(tmp_path: Path, columns: dict[str, Any], scale: str, words: str) -> None:
    with pytest.raises(DataError) as error:
        read(write(tmp_path, columns), scale=scale)
    assert words in str(error.value), str(error.value)


def test_files_that_are_none(tmp_path: Path) -> None:
    (tmp_path / "empty.csv").write_text("")
    (tmp_path / "text.parquet").write_text("time [s],rate [deg/h]\n0,1\n")
    (tmp_path / "head.csv").write_text("time [s],rate [deg/h]\n")
    (tmp_path / "bare.csv").write_text("# gyro 7\n0,1.5\n0.1,2\n")
    (tmp_path / "latin.csv").write_bytes("time [s],rate [deg/h]\n0,1\n0.1,2 °\n".encode("latin-1"))
    (tmp_path / "torn.csv").write_bytes(b"time [s],rate [deg/h]\n0,1\n0.1,2\xc3")
    pq.write_table(pa.table({"time [s]": ["a", "b"], "rate [deg/h]": [1.0, 2.0]}), tmp_path / "words.parquet")
    pq.write_table(pa.table({"time [s]": TIME, "rate [deg/h]": RATE}), tmp_path / "page.parquet")
    whole = (tmp_path / "page.parquet").read_bytes()
    (tmp_path / "page.parquet").write_bytes(whole[:40] + b"\xff" * 40 + whole[80:])
    for name, words in {
        "empty.csv": "the file is empty", "latin.csv": "not UTF-8 text", "torn.csv": "not UTF-8 text",
        "bare.csv": "row 2: numbers, where names and units of the columns are expected",
        "nothing.csv": "no such file", "text.parquet": "not a readable Parquet file",
        "page.parquet": "not a readable Parquet file",
        "head.csv": "no rows below the header",
        "words.parquet": "column 'time': holds string, numbers are expected",
    }.items():  # fmt: skip
        with pytest.raises(DataError) as error:
            read(tmp_path / name)
        assert words in str(error.value)
    with pytest.raises(DataError, match="column 'gyro' is missing; columns of the file: time, rate"):
        read(write(tmp_path, {"time [s]": TIME, "rate [deg/h]": RATE}), channel="gyro")
    with pytest.raises(DataError, match="regressor 'pressure': no such column"):
        read(write(tmp_path, {"time [s]": TIME, "rate [deg/h]": RATE}), regressors="pressure")
