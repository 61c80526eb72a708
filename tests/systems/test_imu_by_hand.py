"""An inertial measurement unit put into positions by hand: sizes of gravity, turns, a logger's file.  [IMU-HAND]"""

from __future__ import annotations

import importlib
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from imu_world import Unit, handled, own_axes, poses
from scipy.spatial.transform import Rotation

import gyrobench as gb
from gyrobench.record.column_map import read_map, translate
from gyrobench.record.csv_reader import DataError
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.system.configurable import InvalidConfigurationError
from gyrobench.system.system import load_system
from gyrobench.workflow.fit_columns import write_columns

room = type(load_system("imu_positions")).__module__
hand: Any = importlib.import_module(".hand", room)
log: Any = importlib.import_module(".log", room)
still: Any = importlib.import_module(".still", room)
tables: Any = importlib.import_module(".tables", room)
norms: Any = importlib.import_module(".norms", room)
G0, DPH = 9.80665, math.pi / 648000.0
GYRO, ACC = 2e-5, 1e-3  # noise densities of a small unit, rad/s/sqrt(Hz), m/s2/sqrt(Hz)
HEAD = "# attitudes = unknown\n# latitude = 40.10704566deg\n# gravity = 9.805m/s2\n"  # 0.7 rad


def write(path: Path, time: Any, gyro: Any, acc: Any, units: str = "rad/s m/s2", more: str = "") -> Path:
    """A logger's file; units: of gyros and accelerometers."""
    g, a = units.split()
    heads = [f"g{x} [{g}]" for x in "xyz"] + [f"a{x} [{a}]" for x in "xyz"]
    body = "\n".join(",".join(f"{v:.12g}" for v in row) for row in np.column_stack([time, gyro, acc]).tolist())
    path.write_text(f"{HEAD}{more}time [s],{','.join(heads)}\n{body}\n", encoding="utf-8")
    return path


def record(path: Path, **values: str) -> Any:
    return log.read_log(load_system("imu_positions"), path, values)


def estimates(result: Any) -> dict[str, float]:
    return {c.name: c.estimate * tables.SCALES[c.unit] for c in result.coefficients}


@pytest.mark.long
def test_recovers_a_unit_without_noise(tmp_path: Path) -> None:
    """200 Hz, 18 attitudes: to 3e-7 of the sizes, what the trapezoid and the twelve digits of the file leave.  The
    truth is turned into the axes of the accelerometers by Gram and Schmidt, the reduction does it by LQ."""
    rng = np.random.default_rng(1)
    unit = Unit.drawn(rng, 0.01)
    series = handled(unit, poses(rng, 18), rng, rate=200.0, gyro=1e-9, acc=1e-8)
    result = hand.HandReduction.of_record(record(write(tmp_path / "log.csv", *series)))
    truth = own_axes(unit)
    found = estimates(result)
    assert len(found) == 9 + 9 + 12
    for n, value in found.items():
        size = {"Sa": 3e-7, "ba": 3e-6, "Sg": 3e-6, "bg": 3e-8, "G": 3e-8}[n.split("_")[0]]
        assert value == pytest.approx(truth[n], abs=size), n


@pytest.mark.long
def test_g_sensitivity_while_turning(tmp_path: Path) -> None:
    """0.1 deg/s/g turns with gravity: without it in the model a turn in 1.5 s makes Sg wrong by 2e-4."""
    rng = np.random.default_rng(2)
    unit = Unit.drawn(rng, 0.01)
    unit.G = rng.normal(size=(3, 3)) * math.radians(0.1)
    series = handled(unit, poses(rng, 18), rng, rest=3.0, turn=1.5, gyro=1e-5, acc=1e-3)
    result = hand.HandReduction.of_record(record(write(tmp_path / "log.csv", *series)))
    truth = own_axes(unit)
    off = {c.name: c.estimate * tables.SCALES[c.unit] - truth[c.name] for c in result.coefficients}
    assert np.sqrt(np.mean([v**2 for n, v in off.items() if n.startswith("Sg")])) < 1e-4
    assert max(abs(off[c.name]) / (c.u * tables.SCALES[c.unit]) for c in result.coefficients) < 4.5


@pytest.mark.long
def test_counts_are_as_good_as_units(tmp_path: Path) -> None:
    """Counts of any zero and scale give the same sizes: scale factors, biases and angles."""
    rng = np.random.default_rng(2)
    unit = Unit.drawn(rng, 0.01)
    time, gyro, acc = handled(unit, poses(rng, 20), rng, gyro=1e-6, acc=1e-5)
    plain = estimates(hand.HandReduction.of_record(record(write(tmp_path / "si.csv", time, gyro, acc))))
    counts = write(tmp_path / "counts.csv", time, 32768.0 + 4800.0 * gyro, 31000.0 + 415.0 * acc, "counts counts")
    result = hand.HandReduction.of_record(record(counts))
    found = {c.name: c for c in result.coefficients}
    for a in "xyz":
        assert found[f"ka_{a}"].estimate == pytest.approx(415.0 * (1.0 + plain[f"Sa_{a}{a}"]), rel=1e-6)
        assert found[f"kg_{a}"].estimate == pytest.approx(4800.0 * (1.0 + plain[f"Sg_{a}{a}"]), rel=1e-5)
        assert found[f"ba_{a}"].estimate == pytest.approx(31000.0 + 415.0 * plain[f"ba_{a}"], abs=1e-2)
        assert found[f"bg_{a}"].estimate == pytest.approx(32768.0 + 4800.0 * plain[f"bg_{a}"], abs=1e-2)
    correction = next(t for t in result.tables if t.id == "imu.correction")
    C = np.array([row[2:5] for row in correction.rows if row[0] == "accelerometers"], dtype=float)
    b = np.array([row[5] for row in correction.rows if row[0] == "accelerometers"], dtype=float)
    sizes = np.linalg.norm((31000.0 + 415.0 * acc[::40] - b) @ C.T, axis=1)
    assert sizes == pytest.approx(9.805, abs=8e-4)  # as printed, the correction makes gravity of every reading


@pytest.mark.long
def test_intervals_hold_the_truth(tmp_path: Path) -> None:
    """8 runs of 30 coefficients, a small unit in 24 attitudes; tests/benchmarks/imu_positions.py counts more."""
    hits = total = 0
    for seed in range(8):
        rng = np.random.default_rng(50 + seed)
        unit = Unit.drawn(rng, 0.01)
        series = handled(unit, poses(rng, 24), rng, gyro=GYRO, acc=ACC, rest=3.0, turn=1.5)
        result = hand.HandReduction.of_record(record(write(tmp_path / "log.csv", *series)))
        truth = own_axes(unit)
        for c in result.coefficients:
            low, high = (x * tables.SCALES[c.unit] for x in c.interval)
            hits += low <= truth[c.name] <= high
            total += 1
    assert total == 240 and 0.90 < hits / total < 0.99


def test_a_gyro_is_told_the_level_earth_rate_by_the_others(tmp_path: Path) -> None:
    """What one reads does not move the rate that its own fit is told, but that of the others; its u is larger for it:
    two thirds of the data.  From all three its readings counted twice, and intervals of G were 3 % too short."""
    rng = np.random.default_rng(12)
    series = handled(Unit.drawn(rng, 0.01), poses(rng, 18), rng, gyro=GYRO, acc=ACC, rest=2.5)
    log_of = record(write(tmp_path / "log.csv", *series))
    at = hand.HandReduction(log_of.windows, hand.HandSetup.of_record(log_of)).at
    before = [at.level_by_others(k) for k in range(3)]
    at.gyro[:, 0] += 1e-4 * rng.normal(size=len(at.gyro))
    after = [at.level_by_others(k) for k in range(3)]
    assert np.array_equal(before[0][0], after[0][0])
    assert all(np.max(np.abs(before[k][0] - after[k][0])) > 1e-6 for k in (1, 2))
    assert 1.0 < before[0][1] / at.found.u < 1.6


@pytest.mark.long
def test_runs_go_the_same_way() -> None:
    """The co-simulation with attitudes that are not read: intervals hold the truth, in axes of the accelerometers."""
    values = {"attitudes": "unknown", "positions": 18, "dwell": 8.0, "windows": 1, "settle": 2.0, "turns": 1}
    result = gb.load("imu_positions", values).run(seed=3, check_step=False).result
    assert {c.name for c in result.coefficients} == own_names()
    z = np.array([(c.estimate - c.truth) / c.u for c in result.coefficients])
    assert np.sqrt(np.mean(z**2)) < 2.0 and np.abs(z).max() < 5.0


def own_names() -> set[str]:
    every = {f"{n}_{a}" for n in ("bg", "ba") for a in "xyz"}
    every |= {f"{n}_{a}{b}" for n in ("Sg", "G") for a in "xyz" for b in "xyz"}
    return every | {f"Sa_{n}" for n in ("xx", "yx", "yy", "zx", "zy", "zz")}


def test_positions_are_found() -> None:
    """The stretches at rest of a series, within half the width of the detector; two seconds of gap end one."""
    rng = np.random.default_rng(4)
    time, gyro, acc = handled(Unit.drawn(rng), poses(rng, 12), rng, gyro=GYRO, acc=ACC)
    found, loud = still.at_rest(time, np.column_stack([gyro, acc]), 10)
    assert len(found) == 12 and loud == 2.0
    for k, (a, b) in enumerate(found):
        # at rest from 6 k to 6 k + 4 s; a cycloid begins and ends so gently that some tenths of a second pass
        assert 6.0 * k - 0.6 <= time[a] and time[b - 1] <= 6.0 * k + 4.6 and b - a > 300
    broken = time + np.where(np.arange(time.size) >= 200, 2.0, 0.0)
    assert len(still.at_rest(broken, np.column_stack([gyro, acc]), 10)[0]) == 13 or len(found) == 12
    assert still.labelled(np.array([0.0, 1.0, 1.0, math.nan, 2.0, 2.0, 0.0])) == [(1, 3), (4, 6)]


SIGNS = {
    "gyros: in axes of the accelerometers x reads y, y reads x, z reads z; so labelled one of the triads is left":
        lambda g, a: (g[:, [1, 0, 2]], a),
    "gyros: in axes of the accelerometers x reads y, y reads z, z reads x": lambda g, a: (g[:, [1, 2, 0]], a),
    "gyros: against the accelerometers the signs of z are reversed; so labelled": lambda g, a: (g * [1, 1, -1], a),
    "the signs of x and y are reversed, or the sign of the accelerometer z is": lambda g, a: (g, a * [1, 1, -1]),
    "accelerometers: at rest they read 0.99": lambda g, a: (g, a / G0),
    "gyros: readings in °/s were taken for rad/s": lambda g, a: (np.degrees(g), a),
    "gyros: readings in rad/s were taken for °/s": lambda g, a: (np.radians(g), a),
}  # fmt: skip


@pytest.mark.parametrize("said", SIGNS)
def test_mistakes_are_named(said: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    time, gyro, acc = handled(Unit.drawn(rng), poses(rng, 16), rng, gyro=GYRO, acc=ACC, rest=2.5)
    path = write(tmp_path / "log.csv", time, *SIGNS[said](gyro, acc))
    with pytest.raises(ReductionError) as error:
        hand.HandReduction.of_record(record(path))
    assert said in str(error.value)


@pytest.mark.parametrize("channel", ["ax", "gy"])
def test_a_channel_beyond_its_range_is_refused(channel: str, tmp_path: Path) -> None:
    """Readings clipped at 0.9 of the largest force and at half of the fastest turn; rounded ones that stand still
    at rest are none."""
    rng = np.random.default_rng(17)
    time, gyro, acc = handled(Unit.drawn(rng), poses(rng, 12), rng, gyro=GYRO, acc=ACC, rest=2.5)
    limit = 0.5 * float(np.abs(gyro[:, 1]).max())
    clipped = (gyro, np.minimum(acc, [0.9 * acc[:, 0].max(), 99.0, 99.0])) if channel == "ax" else (
        np.clip(gyro, [-99.0, -limit, -99.0], [99.0, limit, 99.0]), acc)  # fmt: skip
    with pytest.raises(DataError, match=f"column {channel}: .* samples from t = .* beyond its range"):
        record(write(tmp_path / "log.csv", time, *clipped))
    record(write(tmp_path / "coarse.csv", time, np.round(gyro / 1e-3) * 1e-3, np.round(acc / 0.02) * 0.02))


def test_slow_noise_of_accelerometers_is_found_in_the_directions() -> None:
    """Data of 24 positions with the noise of three biases, correlated over 15 s: plain least squares hold the truth in
    0.66 of the intervals of the biases (the residuals change their sign with the directions), weighed ones in 0.9; t
    with 15 degrees of freedom 2.131."""
    noise: Any = importlib.import_module(".hand_noise", room)
    rng = np.random.default_rng(18)
    time = 4.5 * np.arange(24.0)
    slow = np.linalg.cholesky(np.exp(-np.abs(time[:, None] - time) / 15.0))
    hits = {"plain": 0, "weighed": 0}
    for _ in range(40):
        up = np.array([p.inv().apply([0.0, 0.0, 1.0]) for p in poses(rng, 24)])
        X = norms.slopes(norms.Triad(np.zeros((3, 3)), np.zeros(3)), up)
        y = -np.sum(up * (slow @ rng.normal(size=(24, 3)) * 3.0 + rng.normal(size=(24, 3))), axis=1)
        for name, W in (("plain", np.eye(24)), ("weighed", noise.whitener(noise.of_sizes(up, time, X, y)))):
            found, left = np.linalg.lstsq(W @ X, W @ y, rcond=None)[:2]
            u = np.sqrt(np.diag(np.linalg.inv((W @ X).T @ (W @ X))) * left[0] / 15.0)
            hits[name] += int(np.sum(np.abs(found[6:]) < 2.131 * u[6:]))
    assert hits["plain"] < 0.75 * 120 and hits["weighed"] >= 0.9 * 120, hits


def test_an_order_that_hides_a_drift_is_said(tmp_path: Path) -> None:
    """Directions one after the other from +x to -x: a bias that grows in time has the sizes of a scale factor.  The
    same directions with opposite ones in turn do not."""
    rng = np.random.default_rng(19)
    # t about -u_x: t u_x about -u_x^2, the size that 1 + Sa_xx makes
    rings = [(h, a) for h in (1.0, 0.6, 0.2, -0.2, -0.6, -1.0) for a in np.arange(3) * 2.1 + h][1:-1]
    up = [np.array([h, math.sqrt(1 - h * h) * math.cos(a), math.sqrt(1 - h * h) * math.sin(a)]) for h, a in rings]
    mixed = [v for pair in zip(up[: len(up) // 2], up[: len(up) // 2 - 1 : -1], strict=True) for v in pair]
    said = []
    for k, directions in enumerate((up, mixed)):
        attitudes = [Rotation.align_vectors([[0.0, 0.0, 1.0]], [d])[0] for d in directions]
        series = handled(Unit.drawn(rng), attitudes, rng, gyro=GYRO, acc=ACC, rest=2.5)
        result = hand.HandReduction.of_record(record(write(tmp_path / f"{k}.csv", *series)))
        said.append([r.text for r in result.reasons if r.id == "order.trend"])
    assert "hides a bias of the accelerometer x" in said[0][0] and not said[1]


@pytest.mark.long
def test_squares_of_the_instruments_are_named(tmp_path: Path) -> None:
    """10^-3 f²/g of the accelerometers and 2·10⁻⁴ rad/s/g² of the gyros move the biases by 3 to 5 u."""
    rng = np.random.default_rng(20)
    time, gyro, acc = handled(Unit.drawn(rng, 0.01), poses(rng, 24), rng, gyro=GYRO, acc=ACC, rest=3.0)
    for name, g, a in (("a", gyro, acc + 1e-3 * acc**2 / G0), ("g", gyro + 2e-4 * (acc / G0) ** 2, acc)):
        result = hand.HandReduction.of_record(record(write(tmp_path / f"{name}.csv", time, g, a)))
        channels = {t.id.partition(":")[2] for t in result.tests if t.id.startswith("square") and t.p < 1e-3}
        assert channels == ({"accelerometers"} if name == "a" else {"gx", "gy", "gz"})
        assert any(r.id == "residuals.contradict" for r in result.reasons)


@pytest.mark.long
def test_latitude_and_time_base_are_lines_of_the_budget(tmp_path: Path) -> None:
    """1 degree of latitude changes the vertical Earth rate by 15.041 cos 0.7 pi/180 = 0.2008 deg/h, along each axis
    that points up: G_kk by it (g0/9.805 = 1.0002); 100 ppm of time change Sg_kk by 100 ppm."""
    rng = np.random.default_rng(21)
    series = handled(Unit.drawn(rng, 1e-3), poses(rng, 18), rng, gyro=GYRO, acc=ACC, rest=2.5)
    path = write(tmp_path / "log.csv", *series)
    result = hand.HandReduction.of_record(record(path, u_latitude="1deg", u_time="100e-6"))
    lines = {(b.coefficient, b.source): b for b in result.budget}
    for a in "xyz":
        assert abs(lines[f"G_{a}{a}", "latitude"].contribution) == pytest.approx(0.2008, rel=2e-3)
        assert lines[f"Sg_{a}{a}", "time base"].contribution == pytest.approx(100.0, rel=2e-3)


def test_few_positions_say_what_is_missing(tmp_path: Path) -> None:
    rng = np.random.default_rng(6)
    time, gyro, acc = handled(Unit.drawn(rng), poses(rng, 6), rng, gyro=GYRO, acc=ACC)
    with pytest.raises(DataError, match="6 positions at rest found in the samples"):
        record(write(tmp_path / "log.csv", time, gyro, acc))
    ring = [Rotation.from_rotvec([x, 0.0, 0.0]) for x in np.linspace(0.0, 5.5, 12)]  # x never up or down
    time, gyro, acc = handled(Unit.drawn(rng), ring, rng, gyro=GYRO, acc=ACC)
    with pytest.raises(ReductionError) as error:
        hand.HandReduction.of_record(record(write(tmp_path / "ring.csv", time, gyro, acc)))
    assert "least determined: Sa_xx" in str(error.value) and "+x" in str(error.value) and "−x" in str(error.value)


def test_all_faults_of_a_file_in_one_list(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(
        "# attitudes = unknown\n# u_atitude = 5arcsec\ntime [s],gx [deg/s],gy [counts],gz [deg/s],"
        "ax [g],ay [g]\n0,1,1,1,1,1\n", encoding="utf-8",
    )  # fmt: skip
    with pytest.raises(DataError) as error:
        record(path)
    text = "\n".join(error.value.problems)
    for said in (
        "u_atitude",
        "'latitude' is not given",
        "columns not found: az; columns of the file: time, gx, gy, gz, ax, ay. Other names are mapped: gyrobench fit",
        "counts and another unit",
    ):
        assert said in text


def test_channels_that_stand_twice_or_still(tmp_path: Path) -> None:
    rng = np.random.default_rng(7)
    time, gyro, acc = handled(Unit.drawn(rng), poses(rng, 12), rng, gyro=GYRO, acc=ACC)
    acc[:, 1], gyro[:, 2] = acc[:, 0], 0.0
    with pytest.raises(DataError) as error:
        record(write(tmp_path / "log.csv", time, gyro, acc))
    text = str(error.value)
    assert "columns ax and ay are the same" in text and "column gz: all values are the same" in text


def test_plan_that_is_not_enough_is_refused_before_the_run() -> None:
    with pytest.raises(InvalidConfigurationError) as error:
        gb.load("imu_positions", {"attitudes": "unknown", "positions": 6, "turns": 0}).run(seed=1)
    assert "6 positions for nine unknowns" in str(error.value)


@pytest.mark.long
def test_a_proposed_map_reads_other_names_and_numbered_positions(tmp_path: Path) -> None:
    rng = np.random.default_rng(8)
    unit = Unit.drawn(rng)
    time, gyro, acc = handled(unit, poses(rng, 12), rng, gyro=GYRO, acc=ACC)
    number = np.where(np.mod(time, 6.0) < 3.9, np.floor(time / 6.0) + 1.0, 0.0)
    heads = ["time [s]", *(f"Gyro_{x.upper()} [deg/s]" for x in "xyz"), *(f"acc {x} [g]" for x in "xyz"), "position"]
    rows = np.column_stack([time, np.degrees(gyro), acc / G0, number])
    path = tmp_path / "log.csv"
    text = "\n".join(",".join(f"{v:.9g}" for v in row) for row in rows.tolist())
    path.write_text(f"{HEAD}{','.join(heads)}\n{text}\n", encoding="utf-8")
    text, problems = write_columns(path, "imu_positions", None)
    assert not problems and "# Not used: position" in text and '\nattitudes = "unknown"' in text
    (tmp_path / "map.toml").write_text(text.replace("# Not used", '[columns.position]\nfrom = "position"\n#'))
    translate(path, read_map(tmp_path / "map.toml"), tmp_path / "columns.csv")
    read = record(tmp_path / "columns.csv", attitudes="unknown", latitude="40.10704566deg", gravity="9.805m/s2")
    assert read.windows["phase"].size == 12
    result = hand.HandReduction.of_record(read)
    truth = own_axes(unit)
    z = [
        (c.estimate * tables.SCALES[c.unit] - truth[c.name]) / (c.u * tables.SCALES[c.unit])
        for c in result.coefficients
    ]
    assert np.sqrt(np.mean(np.square(z))) < 2.0


def test_positions_that_were_not_at_rest_are_named(tmp_path: Path) -> None:
    """Numbers that reach into the motion; a position that turned evenly about the vertical, which no scatter shows."""
    rng = np.random.default_rng(14)
    time, gyro, acc = handled(Unit.drawn(rng), poses(rng, 12), rng, gyro=GYRO, acc=ACC)
    number = np.where(np.mod(time, 6.0) < np.where(time < 12.0, 5.5, 3.9), np.floor(time / 6.0) + 1.0, 0.0)
    path = write(tmp_path / "log.csv", time, gyro, acc)
    lines = path.read_text("utf-8").splitlines()
    head = next(k for k, line in enumerate(lines) if line.startswith("time"))
    rows = [f"{line},{n:g}" for line, n in zip(lines[head + 1 :], number, strict=True)]
    path.write_text("\n".join([*lines[:head], lines[head] + ",position", *rows]) + "\n", encoding="utf-8")
    with pytest.raises(DataError) as error:
        record(path)
    assert "position 1 (t = 0 s): gx scatters" in str(error.value) and "position 3" not in str(error.value)
    still_rows = (time >= 30.0) & (time < 34.0)
    turning = gyro + 0.1 * np.where(still_rows, 1.0, 0.0)[:, None]
    with pytest.raises(ReductionError, match=r"position 6 .* °/s more than in the others: it was not at rest"):
        hand.HandReduction.of_record(record(write(tmp_path / "even.csv", time, turning, acc)))


def test_turns_without_samples_leave_the_gyros_bias_and_sensitivity(tmp_path: Path) -> None:
    """A logger that was switched off twice: four turns before, between and behind, and the report says what is not
    estimable."""
    rng = np.random.default_rng(15)
    unit = Unit.drawn(rng)
    time, gyro, acc = handled(unit, poses(rng, 14), rng, gyro=GYRO, acc=ACC)
    there = ~(((time > 28.3) & (time < 29.5)) | ((time > 58.3) & (time < 59.5)))
    result = hand.HandReduction.of_record(record(write(tmp_path / "log.csv", time[there], gyro[there], acc[there])))
    names = {c.name for c in result.coefficients}
    assert "bg_x" in names and "G_zz" in names and not any(n.startswith("Sg") for n in names)
    assert any(r.id == "turns.none" and "not estimable: Sg" in r.text for r in result.reasons)
    level = next(line for line in result.budget if "level Earth rate" in line.source)
    assert level.size == pytest.approx(15.0410686 * math.cos(0.7) / math.sqrt(2.0) * DPH, rel=1e-6)


@pytest.mark.long
def test_readings_at_rest_change_the_turns_as_the_budget_says(tmp_path: Path) -> None:
    """One reading of an accelerometer 1e-4 m/s2 off: gravity after each turn, with the matrix held, is off by the row
    of the source, fit of the nine unknowns included; to first order of 1e-5 rad."""
    rng = np.random.default_rng(16)
    series = handled(Unit.drawn(rng, 0.01), poses(rng, 12), rng, gyro=1e-7, acc=1e-6)
    read = record(write(tmp_path / "log.csv", *series))
    positions: Any = importlib.import_module(".hand_positions", room)
    errors: Any = importlib.import_module(".turn_errors", room)
    turns: Any = importlib.import_module(".turns", room)
    said = positions.HandSetup.of_record(read)
    at = positions.Positions(read.windows, said)
    rows = errors.of_accelerometers(at)
    clean = turns.left(at.found.turned, at.found.matrix)
    for place, axis in ((0, 0), (5, 1), (11, 2)):
        off = {n: np.array(v, dtype=float) for n, v in read.windows.items()}
        off[f"mean_a{'xyz'[axis]}"][place] += 1e-4
        other = positions.Positions(off, said)
        moved = [turns.Turn(t.time, t.rate, other.up[k], other.up[k + 1]) for k, t in enumerate(at.raw_turns)]
        plain = [turns.Turn(t.time, t.rate, at.up[k], at.up[k + 1]) for k, t in enumerate(at.raw_turns)]
        change = turns.left(moved, at.found.matrix) - turns.left(plain, at.found.matrix)
        assert change == pytest.approx(1e-4 * rows[3 * place + axis], abs=2e-8)
        assert np.abs(change).max() > 1e-6
    rest = errors.of_gyros(at)
    half = [turns.Turn(t.time, t.rate - (0.5e-5 if k in (3, 4) else 0.0) * np.eye(3)[1], t.before, t.after)
            for k, t in enumerate(at.found.turned)]  # fmt: skip
    assert turns.left(half, at.found.matrix) - clean == pytest.approx(1e-5 * rest[3 * 4 + 1], abs=1e-9)


@pytest.mark.parametrize(("every", "said"), [(101, 1), (0, 0)])
def test_samples_lost_with_the_times_closed_up_are_named(tmp_path: Path, every: int, said: int) -> None:
    """One sample in 101 missing everywhere: each turn is read 1/101 too short, as a scale factor error of -9901 ppm is,
    which put Sg 13 u off without a word."""
    rng = np.random.default_rng(17)
    time, gyro, acc = handled(Unit.drawn(rng, 0.01), poses(rng, 16), rng, gyro=GYRO, acc=ACC)
    keep = np.mod(np.arange(time.size) + 1, every) != 0 if every else np.ones(time.size, dtype=bool)
    run = record(write(tmp_path / "log.csv", time[: np.count_nonzero(keep)], gyro[keep], acc[keep])).run
    assert len(run.doubts) == said and all("samples were lost" in text for text in run.doubts)
