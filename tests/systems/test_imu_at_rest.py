"""A whole IMU at rest: summary, correlations, common lines, gravity and Earth's rate, temperature, frozen samples."""

from __future__ import annotations

import importlib
import math
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from gyrobench.record.frozen import EqualSamples
from gyrobench.result import DriftRecordResult, Table
from gyrobench.system.system import load_system

NAME = "drift_record"
CHANNELS: Any = importlib.import_module(".channels", type(load_system(NAME)).__module__)
EARTH = math.degrees(7.2921159e-5) * 3600.0  # deg/h
PHI = math.radians(51.0)
Columns = dict[str, np.ndarray]


def unit_at_rest(n: int = 4096, seed: int = 1, bias: float = 0.0) -> Columns:
    """z up, x north: omega = Omega (cos phi, 0, sin phi) deg/h, f = (0, 0, 1) g; noise 1 deg/h and 1 mg a sample."""
    rng = np.random.default_rng(seed)
    w = EARTH * np.array([math.cos(PHI), 0.0, math.sin(PHI)]) + bias
    columns: Columns = {"time [s]": 0.1 * np.arange(n)}
    columns |= {f"gyro_{a} [deg/h]": w[k] + rng.normal(size=n) for k, a in enumerate("xyz")}
    return columns | {f"acc_{a} [g]": (k == 2) + 1e-3 * rng.normal(size=n) for k, a in enumerate("xyz")}


def reduce(folder: Path, columns: Columns, **values: str) -> DriftRecordResult:
    file = folder / "record.parquet"
    pq.write_table(pa.table(columns), file)
    system = load_system(NAME)
    result = system.reduce(system.read_measured(file, {"type_b": "none", **values}))
    assert isinstance(result, DriftRecordResult)
    return result


def table(result: DriftRecordResult, id: str) -> Table:
    (found,) = [t for t in result.tables if t.id == id]
    return found


@pytest.mark.usefixtures("no_arma")
@pytest.mark.long
def test_units_walks_gravity_and_the_latitude(tmp_path: Path) -> None:
    """N of 1 mg in 0.1 s: 9.80665e-3 sqrt(0.1) 60 = 0.18607 m/s/sqrt(h) = 316.2 ug/sqrt(Hz).

    N of 1 deg/h in 0.1 s: sqrt(0.1)/60 = 0.005270 deg/sqrt(h).  sin phi = w.f/(|w||f|); u(phi) of means of 410 s:
    1/sqrt(4096)/15.04 rad = 0.0595 deg.
    """
    result = reduce(tmp_path, unit_at_rest(), latitude="51deg")
    assert result["N gyro_x"].unit == "°/√h" and result["N acc_x"].unit == "m/s/√h"
    assert result["N gyro_y"].estimate == pytest.approx(0.005270, rel=0.05)
    assert result["N acc_y"].estimate == pytest.approx(0.18607, rel=0.05)
    gyros, forces = table(result, "gyros"), table(result, "accelerometers")
    assert [row[0] for row in gyros.rows] == ["gyro_x", "gyro_y", "gyro_z"]
    assert forces.rows[1][1] == result["N acc_y"].estimate and forces.rows[1][4] == pytest.approx(316.2, rel=0.05)
    size, elevation, rate, vertical, latitude = table(result, "at_rest").rows
    # normal gravity at 51 deg: 9.7803253 (1 + 0.00193185 sin2)/sqrt(1 - 0.00669438 sin2), sin2 = 0.60396: 9.81159
    assert size[1] == pytest.approx(9.80665, abs=1e-4) and size[3] == pytest.approx(9.81159, abs=1e-5)
    assert "acc_z 9" in elevation[-1] or "acc_z 89.9" in elevation[-1]
    assert rate[1] == pytest.approx(EARTH, abs=4.0 / 64.0) and "the Earth's rate" in rate[-1]
    assert vertical[3] == pytest.approx(EARTH * math.sin(PHI)) and abs(vertical[1] - vertical[3]) < 4.0 * vertical[2]
    assert latitude[2] == pytest.approx(0.0595, rel=0.15) and abs(latitude[1] - 51.0) < 4.0 * latitude[2]
    assert result.site["latitude / °"] == pytest.approx(51.0)
    assert not result.warnings and "columns / %" not in gyros.columns


@pytest.mark.usefixtures("no_arma")
@pytest.mark.long
def test_a_mistaken_unit_is_named(tmp_path: Path) -> None:
    """Values in g under a head of m/s2: |f| is 1/9.80665 of gravity; a bias of 0.1 deg/s hides the Earth's rate."""
    columns = unit_at_rest(bias=360.0)
    renamed = {name.replace("[g]", "[m/s2]"): values for name, values in columns.items()}
    result = reduce(tmp_path, renamed)
    (said,) = [r for r in result.reasons if r.id == "drift_record.gravity"]
    assert "the values are in g, not in m/s²?" in said.text and said.names[0] == "N acc_x"
    rate = table(result, "at_rest").rows[-1]
    assert "a bias hides it" in rate[-1] and len(table(result, "at_rest").rows) == 2
    assert not any("latitude" in s and "that is" in s for s in result.summary)


def test_a_mean_that_was_taken_out_is_said(tmp_path: Path) -> None:
    columns = {n: v - v.mean() if n.startswith("acc") else v for n, v in unit_at_rest(1024).items()}
    (said,) = [r for r in reduce(tmp_path, columns).reasons if r.id == "drift_record.gravity"]
    assert "the mean was taken out" in said.text and "not at rest" not in said.text


@pytest.mark.usefixtures("no_arma")
@pytest.mark.long
def test_a_single_accelerometer_above_gravity_is_named_from_a_forked_process_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """1 g under a head of 10 g; what comes back from a process is a copy, equal but not the same."""
    columns = unit_at_rest(2048)
    few = {"time [s]": columns["time [s]"], "gyro_x [deg/h]": columns["gyro_x [deg/h]"],
           "acc_z [g]": 9.8 * columns["acc_z [g]"]}  # fmt: skip
    for long in (CHANNELS.LONG, 1):
        monkeypatch.setattr(CHANNELS, "LONG", long)
        (said,) = [r for r in reduce(tmp_path, few).reasons if r.id == "drift_record.gravity"]
        assert said.text.startswith("acc_z reads 96.1 m/s² at rest, 9.8 times gravity")


@pytest.mark.usefixtures("no_arma")
@pytest.mark.long
def test_correlation_and_line_of_several_channels(tmp_path: Path) -> None:
    """gyro_x and gyro_y share half of their white power, gyro_z and acc_x a line of 1.7 Hz; no other pair has any."""
    n = 8192
    columns = unit_at_rest(n, 3)
    rng = np.random.default_rng(9)
    shared = rng.normal(size=n)
    columns["gyro_x [deg/h]"] += shared
    columns["gyro_y [deg/h]"] += shared
    line = np.sin(2.0 * np.pi * 1.7 * columns["time [s]"])
    columns["gyro_z [deg/h]"] += 0.2 * line
    columns["acc_x [g]"] += 2e-4 * line
    result = reduce(tmp_path, columns)
    (pair,) = table(result, "correlations").rows
    assert pair[0] == "gyro_x – gyro_y" and pair[3] < 0.5 < pair[4] and pair[5] < 1e-6
    assert any(s.startswith("1 of 15 pairs") for s in result.summary)
    (found,) = table(result, "common_lines").rows
    assert found[0] == pytest.approx(1.7, abs=4.0 * found[1]) and found[2] == 2
    assert "gyro_z 0.2" in found[3] and "acc_x" in found[3]


@pytest.mark.usefixtures("no_arma")
@pytest.mark.long
def test_the_share_of_a_temperature_is_its_own(tmp_path: Path) -> None:
    """A random walk beside a temperature that trends through the record: plain least squares give it most.

    The true share is that of 0.02 deg/h per K: slope2 var(T)/var(rate).
    """
    n, rng = 4096, np.random.default_rng(12)
    t = 0.1 * np.arange(n)
    T = 25.0 + 3.0 * t / t[-1] + 0.2 * np.sin(2.0 * np.pi * t / 150.0)
    rate = np.cumsum(0.02 * rng.normal(size=n)) + 0.05 * rng.normal(size=n) + 0.02 * (T - T.mean())
    plain = np.corrcoef(T, rate)[0, 1] ** 2
    truth = 0.02**2 * np.var(T) / np.var(rate)
    assert plain > 0.3 > 0.05 > truth, "of this record"
    result = reduce(tmp_path, {"time [s]": t, "rate [deg/h]": rate, "temperature [degC]": T})
    rows = {row[0]: row for row in result.columns[0].tables["regression"][0].rows}
    share, low, high = rows["temperature"][7:10]
    assert low <= 100.0 * truth <= high and low == 0.0 and rows["temperature"][-1].startswith("not significant")
    assert share >= 0.0 and "d(temperature)/dt" in rows


@pytest.mark.usefixtures("no_arma")
@pytest.mark.long
def test_a_rate_follows_the_change_of_the_temperature(tmp_path: Path) -> None:
    """0.05 deg/h per K/h, T of 2 K in a sine of 600 s: T' = 2 2pi/600 3600 = 75.4 K/h, 3.8 deg/h."""
    n, rng = 8192, np.random.default_rng(4)
    t = 0.1 * np.arange(n)
    turn = 2.0 * np.pi / 600.0
    T, change = 25.0 + 2.0 * np.sin(turn * t), 2.0 * turn * np.cos(turn * t) * 3600.0
    result = reduce(tmp_path, {"time [s]": t, "rate [deg/h]": 0.05 * change + rng.normal(size=n), "case [degC]": T})
    rows = {row[0]: row for row in result.columns[0].tables["regression"][0].rows}
    found = rows["d(case)/dt"]
    assert found[-1] == "taken out" and found[3] < 0.05 < found[4] and found[5] == "°/h per K/h"
    truth = 0.05**2 * np.var(change) / (1.0 + 0.05**2 * np.var(change))
    assert found[8] <= 100.0 * truth <= found[9] and found[7] == pytest.approx(100.0 * truth, rel=0.05)
    assert rows["case"][-1] == "not significant, left in"


@pytest.mark.usefixtures("no_arma")
@pytest.mark.long
def test_a_change_that_follows_its_temperature_is_left_out(tmp_path: Path) -> None:
    """A warm-up, T = -3 exp(-t/tau): its rate of change is 3/tau exp(-t/tau), the same but for the factor."""
    n = 4096
    t = 0.1 * np.arange(n)
    T = 30.0 - 3.0 * np.exp(-t / 120.0)
    result = reduce(
        tmp_path, {"time [s]": t, "rate [deg/h]": np.random.default_rng(2).normal(size=n), "case [degC]": T}
    )
    assert [row[0] for row in result.columns[0].tables["regression"][0].rows] == ["case"]
    (said,) = result.columns[0].texts["regression"]
    assert "(correlation −1.000)" in said and "cannot be told apart" in said


@pytest.mark.usefixtures("no_arma")
@pytest.mark.long
def test_frozen_channels_and_repeated_rows_are_named(tmp_path: Path) -> None:
    """gyro_y stays for 60 samples; then each row is written twice.  Noise of 1 in steps of 0.1: p0 = 0.03."""
    columns = {n: np.round(v / q) * q for (n, v), q in
               zip(unit_at_rest(4096).items(), (1e-3, 0.1, 0.1, 0.1, 1e-4, 1e-4, 1e-4), strict=True)}  # fmt: skip
    columns["gyro_y [deg/h]"][1000:1060] = columns["gyro_y [deg/h]"][1000]
    result = reduce(tmp_path, columns)
    (frozen,) = [r for r in result.reasons if r.id == "drift_record.frozen" and r.severity == "warning"]
    assert frozen.text.startswith("gyro_y: 6") and "from 100 s on" in frozen.text
    assert "frozen" in table(result, "gyros").rows[1][-1] and not any("repeat" in r.id for r in result.reasons)
    twice = {n: np.repeat(v, 2) for n, v in unit_at_rest(2048).items() if n != "time [s]"}
    result = reduce(tmp_path, {"time [s]": 0.05 * np.arange(4096), **twice})
    (rows,) = [r for r in result.reasons if r.id == "drift_record.repeated"]
    assert rows.text.startswith("2048 of 4096 rows")


def test_rows_of_two_units_in_one_file_are_named(tmp_path: Path) -> None:
    """Levels 30 apart in noise of 10 deg/h: said, and no limit is judged."""
    columns = {n: v for n, v in unit_at_rest(2048).items() if n[:6] in ("time [", "gyro_x")}
    columns["gyro_x [deg/h]"][::2] += 30.0
    reasons = [r for r in reduce(tmp_path, columns).reasons if r.id == "drift_record.rows"]
    assert "Every second row is 30" in reasons[0].text or "Every second row is 29" in reasons[0].text


def test_runs_of_equal_samples_over_blocks() -> None:
    """A run over the edge of two blocks is one run; noise in coarse steps has runs and is not frozen."""
    rng = np.random.default_rng(1)
    x = np.round(rng.normal(size=3000))  # p0 = 0.27
    x[990:1030] = 2.0
    found = EqualSamples(["x", "y"])
    t, y = np.arange(3000.0), np.round(rng.normal(size=3000))
    for k in range(0, 3000, 1000):
        found.add(t[k : k + 1000], {"x": x[k : k + 1000], "y": y[k : k + 1000]})
    ((name, (length, when)),) = found.frozen().items()
    assert name == "x" and length >= 40 and 985.0 <= when <= 990.0
    assert found.rows_repeated() == 0


@pytest.mark.parametrize("stopped", [0, 500])
def test_counts_that_come_in_lumps_are_not_frozen(stopped: int) -> None:
    """Quiet and busy in turn, 30 samples each on average, zeros with 0.97 and 0.2: p0 is 0.5, and a run of zeros goes
    on far longer than independent samples let expect; one of 500 is longer than those yet."""
    rng = np.random.default_rng(2)
    quiet = np.cumsum(rng.random(40_000) < 1.0 / 30.0) % 2 == 0
    x = np.where(rng.random(quiet.size) < np.where(quiet, 0.97, 0.2), 0.0, np.round(5.0 * rng.normal(size=quiet.size)))
    x[7000 : 7000 + stopped] = 0.0
    found = EqualSamples(["x"])
    for k in range(0, x.size, 8000):
        found.add(np.arange(k, k + 8000.0), {"x": x[k : k + 8000]})
    assert found.longest["x"][0] > 60 and list(found.frozen()) == ["x"] * (stopped > 0)


@pytest.mark.parametrize(("step", "again", "named"), [(1e-5, 0.1, True), (0.03, 0.1, True), (0.03, 0.0, False),
                                                      (0.3, 0.1, False), (1.0, 0.0, False)])  # fmt: skip
def test_rows_repeated_by_chance_in_a_single_channel(step: float, again: float, named: bool) -> None:
    """White noise of 1 in steps q has 0.28 q of its rows like the one before: 1 in 120 at 0.03, 1 in 12 at 0.3."""
    rng = np.random.default_rng(3)
    x = np.round(rng.normal(size=20_000) / step) * step
    for i in 1 + np.flatnonzero(rng.random(x.size - 1) < again):
        x[i] = x[i - 1]
    found = EqualSamples(["x"])
    for part in np.array_split(np.arange(x.size), 7):
        found.add(np.float64(0.01) * part, {"x": x[part]})
    assert (found.rows_repeated() > 0) == named


@pytest.mark.usefixtures("no_arma")
@pytest.mark.long
def test_channels_side_by_side_are_those_one_after_the_other(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    columns = {n: v for n, v in unit_at_rest(2048).items() if n[:6] in ("time [", "gyro_x", "acc_z ")}
    one = reduce(tmp_path, columns)
    monkeypatch.setattr(CHANNELS, "LONG", 1)
    assert repr(reduce(tmp_path, columns).as_dict()) == repr(one.as_dict()), "NaN is not NaN"
    short = {n: np.where(np.arange(2048) < 300, v, np.nan) if "acc" in n else v for n, v in columns.items()}
    with pytest.raises(Exception, match="at least 512 needed"):
        reduce(tmp_path, short)
