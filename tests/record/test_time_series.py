"""Time series of a laboratory: averaged as the sampler does, whatever the file looks like; phases by number, motion."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from gyrobench.engine.session import Session
from gyrobench.record import time_series
from gyrobench.record.csv_reader import DataError
from gyrobench.record.record import Record
from gyrobench.system.system import System, load_system

TUMBLE = "tumble_single_axis"
RATE = 0.08  # rad/s: a turn in 79 s
PLAN: dict[str, Any] = {"rate": RATE, "windows": 24, "dwell": 20.0, "settle": 2.0}
HEAD = "# latitude = 45.75deg\n# k = 17.2deg/h/mA\n# attitude = E U -N\n"


def load(name: str, values: Mapping[str, Any] | None = None) -> System:
    return load_system(name).with_values(values or {})


@pytest.fixture(scope="module")
def run() -> Record:
    """A tumble of 210 s with every sample of angle, current and phase."""
    system = load(TUMBLE)
    system.channels = ("sequencer.phase", "sequencer.gate", "table.angle", "rebalance.i_read")
    system.channel_period = system.step
    with Session(system) as session:
        return session.run(PLAN)


def exported(run: Record, file: Path, phase: bool, cut: slice = slice(None), **comments: str) -> Path:
    c = {n: v[cut] for n, v in run.channels.items()}
    columns = [c["time"], np.degrees(c["table.angle"]), c["rebalance.i_read"] * 1e3]
    names = ["time [s]", "angle [deg]", "current [mA]"]
    said = {"latitude": "45.75deg", "k": f"{run.run.parameters['gyro.k']!r}", "rate": f"{RATE} rad/s", **comments}
    said |= {n: f"{PLAN[n]}" for n in ("windows", "dwell", "settle")}
    if phase:
        columns.append(np.where(c["sequencer.gate"] > 0.0, c["sequencer.phase"], 0.0))
        names.append("phase")
        said |= {f"phase {row.phase}": row.face for row in run.run.plan}
    head = [f"# {k} = {v}" for k, v in said.items()]
    np.savetxt(file, np.column_stack(columns), "%.17g", ",", header="\n".join([*head, ",".join(names)]), comments="")
    return file


@pytest.mark.long
def test_series_of_a_run_give_its_windows_and_its_result(run: Record, tmp_path: Path) -> None:
    system = load(TUMBLE, PLAN)
    expected = {c.name: c for c in system.reduce(run).coefficients}
    read = load(TUMBLE).read_measured(exported(run, tmp_path / "phases.csv", True), {})
    for name in ("phase", "n", "flagged"):
        assert np.array_equal(read.windows[name], run.windows[name])
    for name in ("t_start", "t_end", "angle_start", "angle_end", "mean"):
        np.testing.assert_allclose(read.windows[name], run.windows[name], rtol=1e-11, atol=1e-14)
    np.testing.assert_allclose(read.windows["std"], run.windows["std"], rtol=1e-6)
    for c in load(TUMBLE).reduce(read).coefficients:
        assert abs(c.estimate - expected[c.name].estimate) < 1e-6 * expected[c.name].u
    # by the motion alone windows begin some samples aside, in other noise
    found = load(TUMBLE).read_measured(exported(run, tmp_path / "motion.csv", False), {})
    assert [row.face for row in found.run.plan] == ["static 3", "mount 1", "static 4", "mount 2"]
    assert np.array_equal(found.windows["phase"], run.windows["phase"])
    assert np.max(np.abs(found.windows["t_start"] - run.windows["t_start"])) < 0.1
    for c in load(TUMBLE).reduce(found).coefficients:
        assert abs(c.estimate - expected[c.name].estimate) < 0.5 * expected[c.name].u


@pytest.mark.parametrize(
    ("comments", "cut", "words"),
    [
        ({"phase 1": "mount 1", "phase 2": "static 3"}, slice(None), r"phase 1 'mount 1.* \(turning at .*rest at 0°"),
        ({"dwell": "15s"}, slice(None), r"phase 1 'static 3' is expected \(17 s long\), but the table is at rest"),
        ({"rate": "0.1 rad/s"}, slice(None), "phase 2 'mount 1, against the Earth' is expected"),
        ({}, slice(0, 110_000), "phase 3 'static 4' is not there"),
        ({"phase 1": "static 3", "phase 2": "mount 1"}, slice(None), "after the last phase of the plan, 2, the table"),
        ({"phase 1": "lying"}, slice(None), "phase lying is not in the plan; it has static 3, mount 1"),
    ],
)  # fmt: skip
def test_motion_that_does_not_fit_the_plan(
    run: Record, tmp_path: Path, comments: dict[str, str], cut: slice, words: str
) -> None:
    file = exported(run, tmp_path / "motion.csv", False, slice(cut.start, cut.stop, 10))
    if cut.stop:
        file = exported(run, tmp_path / "motion.csv", False, slice(0, cut.stop, 10))
    text = file.read_text("utf-8")
    for name, value in comments.items():
        text = "\n".join(line for line in text.split("\n") if not line.startswith(f"# {name} ="))
        text = f"# {name} = {value}\n{text}"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(DataError, match=words):
        load(TUMBLE).read_measured(file, {})


def fixed(
    tmp_path: Path, rows: list[str], head: str = "time [s],current [mA]", more: str = "# window = 2s\n"
) -> Record:
    (tmp_path / "series.csv").write_text(HEAD + more + "\n".join([head, *rows, ""]), encoding="utf-8-sig")
    return load("fixed_position").read_measured(tmp_path / "series.csv", {})


def ramp(seconds: int = 20) -> list[list[str]]:
    """4 samples a second of i = t mA: windows of 2 s have the means 1, 3, 5 ..."""
    return [[f"{0.25 * k:.2f}", f"{0.25 * k:.2f}"] for k in range(4 * seconds + 1)]


def test_windows_by_hand_in_any_dialect(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Mean 1 mA, std of 0.25, 0.5 .. 2 = 0.25 sqrt(8 9/12) mA; also with commas, tabs and in blocks of few rows."""
    plain = fixed(tmp_path, [",".join(r) for r in ramp()])
    np.testing.assert_allclose(plain.windows["mean"], np.arange(1.0, 20.0, 2.0) * 1e-3, rtol=1e-14)
    np.testing.assert_allclose(plain.windows["std"], 0.25e-3 * math.sqrt(6.0), rtol=1e-12)
    assert plain.windows["t_end"].tolist() == [2.0 * k for k in range(1, 11)] and plain.run.notes == []
    german = fixed(tmp_path, [";".join(r).replace(".", ",") for r in ramp()], "time [s];current [mA]")
    tabs = fixed(tmp_path, ["\t".join(r) for r in ramp()], "time [s]\tcurrent [mA]")
    monkeypatch.setattr(time_series, "BLOCK", 100)
    blocks = fixed(tmp_path, [",".join(r) for r in ramp()])
    for other in (german, tabs, blocks):
        for name, values in plain.windows.items():
            np.testing.assert_allclose(other.windows[name], values, rtol=1e-12)


@pytest.mark.parametrize("block", [1 << 20, 100])
def test_gaps_are_counted_and_their_windows_dropped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, block: int
) -> None:
    """Rows at 3.00 (empty) and 7.25 (NaN) and all of 10.5 .. 14.5 are missing: windows 2, 4, 6, 7 and 8 of 10.

    Of window 8, from 14 s, the rows from 14.75 s are there: a mean of these would not be one of the window.
    """
    monkeypatch.setattr(time_series, "BLOCK", block)
    rows = ramp()
    rows[12][1], rows[29][1] = "", "nan"
    read = fixed(tmp_path, [",".join(r) for k, r in enumerate(rows) if not 42 <= k <= 58])
    assert read.windows["t_start"].tolist() == [0.0, 4.0, 8.0, 16.0, 18.0]
    np.testing.assert_allclose(read.windows["mean"], [1e-3, 5e-3, 9e-3, 17e-3, 19e-3], rtol=1e-14)
    (said,) = read.run.notes
    assert "time series: 3 (2 rows without a value left out); 5 of 10 windows hold a gap and were dropped" in said


def test_thermometers_are_averaged_and_may_be_read_less_often(tmp_path: Path) -> None:
    """20 °C + 0.1 K/s, read at 1, 5, 9 .. s: windows of 2 s without one stand between their neighbours."""
    rows = [[t, i, f"{20.0 + 0.1 * float(t):.2f}" if k % 16 == 4 else ""] for k, (t, i) in enumerate(ramp())]
    read = fixed(tmp_path, [",".join(r) for r in rows], "time [s],current [mA],temperature case [degC]")
    assert read.run.notes == [] and len(read.windows["mean"]) == 10
    kelvin = read.windows["temperature case"] - 273.15
    np.testing.assert_allclose(kelvin[0:10:2], 20.0 + 0.1 * np.arange(1.0, 20.0, 4.0), rtol=1e-12)
    np.testing.assert_allclose(kelvin[1:9:2], 20.0 + 0.1 * np.arange(3.0, 18.0, 4.0), rtol=1e-12)


def test_what_is_wrong_is_said_once_with_its_count(tmp_path: Path) -> None:
    rows = ramp()
    wrong = [[t, "bad" if k > 20 else i] for k, (t, i) in enumerate(rows)]
    with pytest.raises(DataError, match=r"column 'current': 60 cells are not a number, the first: 'bad'") as error:
        fixed(tmp_path, [",".join(r) for r in wrong])
    assert len(error.value.problems) == 1
    with pytest.raises(DataError, match=r"3 rows have not the 2 cells of the header; the first: '0.00,0.00,9'"):
        fixed(tmp_path, [",".join(r) + (",9" if k < 3 else "") for k, r in enumerate(rows)])
    with pytest.raises(DataError, match=r"time does not increase in 1 rows; the first: 1 s after 1\.25 s"):
        fixed(tmp_path, [",".join(r) for r in (*rows[:4], rows[5], rows[4], *rows[6:])])
    (tmp_path / "series.csv").write_text(f"{HEAD}# window = 2s\ntime [s],current [mA]", encoding="utf-8")
    with pytest.raises(DataError, match="no rows below the header"):
        load("fixed_position").read_measured(tmp_path / "series.csv", {})
    with pytest.raises(DataError, match="column 'current': no unit"):
        fixed(tmp_path, [",".join(r) for r in rows], "time [s],current")
    with pytest.raises(DataError, match="no window is complete"):
        fixed(tmp_path, [",".join(r) for r in rows], more="# window = 30s\n")


def test_servo_phases_want_their_column(tmp_path: Path) -> None:
    file = tmp_path / "servo.csv"
    file.write_text("# latitude = 45deg\ntime [s],angle [deg]\n0,0\n1,0.1\n2,0.2\n", encoding="utf-8")
    with pytest.raises(DataError, match="not recognised by the motion of the table: add a column 'phase'"):
        load("servo_vertical_level").read_measured(file, {})


# ------------------------------------------------------------------------------------------------ aliased samples
def logged(run: Record, file: Path, every: int, means: bool, **comments: str) -> Path:
    """The run at 1 kHz as a file with a sample in ``every``, or with the mean since the one before; the noise of the
    current is limited to 14 Hz, the bandwidth of the loop, by a second-order filter."""
    c = run.channels
    a = 2.0 * math.pi * 14.0 * 1e-3
    y = c["rebalance.i_read"]
    for _ in range(2):
        y = lfilter([a], [1.0, a - 1.0], y, zi=[(1.0 - a) * y[0]])[0]
    averaged = lfilter(np.full(every, 1.0 / every), [1.0], y) if means else y
    thin = slice(every, None, every)
    said = {n: v[thin] for n, v in (run.channels | {"rebalance.i_read": averaged}).items()}
    return exported(Record(run.windows, said, run.run), file, True, **comments)


@pytest.mark.long
def test_point_samples_of_a_fast_loop_are_named(run: Record, tmp_path: Path) -> None:
    """Points at 5 Hz of a loop of 14 Hz; means at the same 5 Hz scatter a quarter as much.  Stated means, a stated
    bandwidth of 2 Hz, and samples at 200 Hz, which fall off before 100 Hz, have no warning."""

    def notes(every: int, means: bool = False, **comments: str) -> list[str]:
        return load(TUMBLE).read_measured(logged(run, tmp_path / "log.csv", every, means, **comments), {}).run.notes

    (said,) = notes(200)
    assert "current may be aliased: their spectrum is flat to half the sampling rate of 5 Hz" in said
    assert "'# samples = means'" in said and "low-pass" not in said
    (said,) = notes(200, bandwidth="14Hz")
    assert "Point samples of current at 5 Hz alias: the signal reaches to 14 Hz, and what is above 2.5 Hz folds" in said
    assert "take 28 Hz or more, or put a low-pass filter below 2.5 Hz before the meter" in said
    assert notes(200, means=True, samples="means") == notes(200, bandwidth="2Hz") == notes(5) == []
    with pytest.raises(DataError, match="samples = integrated: must be 'means'"):
        notes(200, samples="integrated")
    scatter = [
        float(np.median(load(TUMBLE).read_measured(logged(run, tmp_path / "log.csv", 200, m), {}).windows["std"]))
        for m in (False, True)
    ]
    assert scatter[0] > 2.0 * scatter[1]
    result = load(TUMBLE).reduce(load(TUMBLE).read_measured(logged(run, tmp_path / "log.csv", 200, False), {}))
    assert any("may be aliased" in w for w in result.warnings)


@pytest.mark.parametrize(
    ("word", "end", "said"),
    [
        (1.0, 9.0, ""),
        (3.0, 9.0, "rounded to 3 mA, more than their noise averages out: means are off by 0.0"),
        (0.0, 1.0, "samples of current are at the end of its range"),
        (0.0, 9.0, ""),
    ],
)
def test_words_and_ends_that_no_noise_averages_out(tmp_path: Path, word: float, end: float, said: str) -> None:
    """Noise of 1 mA at 0.7 mA: of words of 3 mA the mean is off by up to 3/pi exp(-2 pi2/9) = 0.11 mA, 0.075 rms, of
    1 mA by 1e-9; of 20000 samples 1/141.
    """
    current = 0.7 + np.minimum(np.random.default_rng(1).normal(size=20_000), end)
    if word:
        current = word * np.rint(current / word)
    more = "# samples = means\n# type_b = none\n# arrangement = checked\n"
    read = fixed(tmp_path, [f"{0.1 * k:.1f},{i:.9g}" for k, i in enumerate(current)], more=more)
    assert read.run.notes == [] and len(read.run.doubts) == bool(said) and said in " ".join(read.run.doubts)
    verdict = load("fixed_position").reduce(read, {"ω_d": (None, 1e9)})["ω_d"].verdict
    assert verdict == ("inconclusive" if said else "pass")
    off = np.mean(read.windows["mean"]) * 1e3 - 0.7
    assert (abs(off) > 5.0 / math.sqrt(20_000.0)) == bool(said)


@pytest.mark.parametrize(("stated", "lost"), [("closed up", 7), ("as they were", 0)])
def test_an_angle_that_goes_on_by_two_samples_is_named(tmp_path: Path, stated: str, lost: int) -> None:
    """A table at 10 deg/s, 10 Hz, 0.001 deg of noise, turned from 359 deg to 0 three times; one row in 150 of 1160 is
    missing, seven in all.  With their own times the rate shows nothing, and a window with a gap is left out."""
    t = 0.1 * np.arange(1160)
    keep = np.mod(np.arange(t.size) + 1, 150) != 0
    angle = np.mod(10.0 * t[keep] + 1e-3 * np.random.default_rng(2).normal(size=int(keep.sum())), 360.0)
    time = t[: angle.size] if stated == "closed up" else t[keep]
    averager = time_series.Averager(["mean"], ["angle"], [], lambda _: time_series.Averaging(10.0))
    time_series.average([{"time": time, "angle": angle, "mean": np.ones(angle.size)}], averager)
    assert averager.lost == lost and ("samples were lost" in averager.lost_sentence()) == bool(lost)
