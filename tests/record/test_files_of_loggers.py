"""Column maps that are proposed for files as common loggers write them: names, units, times since 1970, sentences."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gyrobench import units
from gyrobench.bench import UsageError
from gyrobench.record.column_map import read_map, translate
from gyrobench.record.column_proposal import find_layout
from gyrobench.record.log_files import as_text, is_log
from gyrobench.record.text_cells import cells_of_file
from gyrobench.system.system import load_system
from gyrobench.workflow.fit_columns import write_columns
from gyrobench.workflow.measured_run import find_faults, reduce_measured

STAMP = 1603372452123456789  # ns since 1970
G, A = ("rad/s",) * 3, ("m/s2",) * 3


def spelled(name: str, names: str = "xyz") -> list[str]:
    return [name.replace("?", a) for a in names]


LOGGERS: dict[str, tuple[str, list[str]]] = {  # kind -> header, columns of the map after time
    "EuRoC": (
        "#timestamp [ns]," + ",".join(spelled("w_RS_S_? [rad s^-1]") + spelled("a_RS_S_? [m s^-2]")),
        spelled("w_RS_S_?") + spelled("a_RS_S_?"),
    ),
    "rostopic": (
        "%time," + ",".join(spelled("field.angular_velocity.?") + spelled("field.linear_acceleration.?")),
        spelled("angular_velocity_?") + spelled("linear_acceleration_?"),
    ),
    "ulog": (
        "timestamp," + ",".join(spelled("gyro_rad[?]", "012") + spelled("accelerometer_m_s2[?]", "012")),
        spelled("gyro_?") + spelled("accelerometer_?"),
    ),
}


@pytest.mark.parametrize("kind", LOGGERS)
def test_a_file_needs_no_hand(kind: str, tmp_path: Path) -> None:
    """Six channels in their units, times in the unit that their size tells: 1.6e18 is 2020 in nanoseconds."""
    header, names = LOGGERS[kind]
    values = np.random.default_rng(3).normal(size=(20, 6)).round(6)
    rows = [f"{STAMP + 10_000_000 * k}," + ",".join(map(str, v)) for k, v in enumerate(values.tolist())]
    (tmp_path / "log.csv").write_text("\n".join([header, *rows, ""]), encoding="utf-8")
    _, problems = write_columns(tmp_path / "log.csv", "drift_record", tmp_path / "map.toml")
    found = read_map(tmp_path / "map.toml")
    assert problems == [] and list(found.columns) == ["time", *names]
    assert found.columns["time"].unit == "ns"
    for name, unit in zip(names, G + A, strict=True):
        assert units.factor(found.columns[name].unit) == 1.0 and units.same_dimension(found.columns[name].unit, unit)
    translate(tmp_path / "log.csv", found, tmp_path / "out.csv")
    _, problems = write_columns(tmp_path / "log.csv", "imu_positions", tmp_path / "positions.toml")
    assert [p[:21] for p in problems] == ["latitude of the place"]  # which no file tells
    assert list(read_map(tmp_path / "positions.toml").columns) == ["time", *spelled("g?"), *spelled("a?")]
    lines = (tmp_path / "out.csv").read_text(encoding="utf-8").splitlines()
    np.testing.assert_array_equal([[float(c) for c in line.split(",")[1:]] for line in lines[1:]], values)


@pytest.mark.parametrize(
    ("first", "unit"),
    [("1603372452.5", "s"), ("1603372452500", "ms"), ("1603372452500000", "us"), ("1200", ""), ("946684", "")],
)
def test_the_unit_of_times_since_1970(first: str, unit: str, tmp_path: Path) -> None:
    """2020 in each unit; numbers that are no such time tell none."""
    rows = "".join(f"{float(first) + k:.1f},{k % 3}\n" for k in range(12))
    (tmp_path / "log.csv").write_text(f"timestamp,gx\n{rows}", encoding="utf-8")
    assert find_layout(tmp_path / "log.csv").columns[0].unit == unit


def test_sentences_with_a_checksum(tmp_path: Path) -> None:
    """Of NMEA 0183; a remark in a cell stays what it is."""
    (tmp_path / "vn.txt").write_text("$VNYMR,+0.5,-0.25*6F\n$VNYMR,+0.5,-0.5*0a\r\n1,2,3*6F\n", encoding="utf-8")
    rows = [cells for _, cells in cells_of_file(tmp_path / "vn.txt", "utf-8", ",")]
    assert rows == [["$VNYMR", "+0.5", "-0.25"], ["$VNYMR", "+0.5", "-0.5"], ["1", "2", "3*6F"]]


HEADS: dict[str, tuple[str, tuple[int, int, bool], list[tuple[str | int, str, str]]]] = {
    # head -> lines above the names, between names and rows, whether rows have names; columns
    "LabVIEW": (  # numbers in the head, and a name more than the rows have cells
        "LabVIEW Measurement\t\nTime\t09:12:33.12\n***End_of_Header***\t\n\t\nChannels\t2\t\t\nSamples\t3000\t3000\t\n"
        "Date\t2024/03/05\t2024/03/05\t\nTime\t09:12:33.12\t09:12:33.12\t\nX0\t0.0E+0\t0.0E+0\t\n"
        "***End_of_Header***\t\t\t\nX_Value\tGyroX\tGyroY\tComment\n",
        (11, 0, False),
        [(1, "X_Value", ""), (2, "GyroX", ""), (3, "GyroY", "")],
    ),
    "oscilloscope": (  # units and an empty line below the names
        "Time\tChannel A\tChannel B\n(ms)\t(V)\t(mV)\n\n",
        (0, 2, True),
        [("Time", "Time", "ms"), ("Channel A", "Channel A", "V"), ("Channel B", "Channel B", "mV")],
    ),
    "amplifier": (  # a row of remarks below the units
        "Catman\nKanäle: 3\n\nZeit  1 - Standardrate\tGyro_X\tTemperatur\ns\t°/h\t°C\n1/1/2024\tKal: 2023\tPT100\n",
        (3, 2, True),
        [("Zeit  1 - Standardrate", "Zeit  1 - Standardrate", "s"), ("Gyro_X", "Gyro_X", "°/h"),
         ("Temperatur", "Temperatur", "degC")],
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", HEADS)
def test_heads_of_other_programs(kind: str, tmp_path: Path) -> None:
    """All rows are read, from the first on."""
    head, layout, columns = HEADS[kind]
    rows = "".join(f"{k / 100:.2f}\t{k % 7}.5\t{20 + k % 3}\n" for k in range(40))
    (tmp_path / "log.txt").write_text(head + rows, encoding="utf-8")
    found = find_layout(tmp_path / "log.txt")
    assert (found.skip, found.below, found.names) == layout and found.rows == 40
    assert [(c.sources[0], c.name, c.unit) for c in found.columns] == columns


@pytest.mark.parametrize("between", ["\n\n", "\n  \n", "\r\r\n"])
@pytest.mark.parametrize("head", ["", "time [s],rate [deg/s]"])
def test_empty_lines_between_the_rows(between: str, head: str, tmp_path: Path) -> None:
    """A logger that ends its rows twice: names are above the first row, and no row is lost."""
    rows = [f"{k / 100:.2f},{k % 7}.5" for k in range(3000)]
    (tmp_path / "log.csv").write_bytes(between.join([*([head] if head else []), *rows, ""]).encode())
    text, _ = write_columns(tmp_path / "log.csv", "drift_record", None)
    names = ('"time [s]"', '"rate [deg/s]"') if head else (1, 2)
    columns = "".join(f'[columns.{n}]\nfrom = {s}\nunit = "{u}"\n'
                      for n, s, u in zip(("time", "rate"), names, ("s", "deg/s"), strict=True))  # fmt: skip
    (tmp_path / "map.toml").write_text(text.partition("[columns")[0] + columns, encoding="utf-8")
    translate(tmp_path / "log.csv", read_map(tmp_path / "map.toml"), tmp_path / "out.csv")
    found = (tmp_path / "out.csv").read_text(encoding="utf-8").splitlines()
    assert [line for line in found if line != "#"] == ["time [s],rate [deg/s]", *rows]


def test_lines_of_two_kinds_in_turn(tmp_path: Path) -> None:
    """A stamp above each sample: no column map has that; a few numbers above the table are a head of it."""
    rows = [f"2018-03-24   22:19:{k // 5:02d}\n-{k % 7}.5   -0.{k % 3}  0.25\n" for k in range(100)]
    (tmp_path / "log.txt").write_text("".join(rows), encoding="utf-8")
    with pytest.raises(
        UsageError, match=r"rows of two kinds in turn \(row 1: '2018-03-24 22:19:00'; row 2: '-0.5 -0.0 0"
    ):
        write_columns(tmp_path / "log.txt", "drift_record", None)
    (tmp_path / "log.txt").write_text(
        "1\t2\n" * 9 + "".join(f"{k}\t{k % 7}.5\t1.5\n" for k in range(9)), encoding="utf-8"
    )
    assert find_layout(tmp_path / "log.txt").rows == 9


def test_rows_that_a_word_tells_apart(tmp_path: Path) -> None:
    """A gyro and an accelerometer in turn, their word before the numbers, as a microcontroller prints them."""
    rows = "".join(f"acc {k} 0.1 {k % 3} 0.9\ngyro {k} 3.1 {k % 5} 0.2\n" for k in range(20))
    (tmp_path / "log.txt").write_text(rows, encoding="utf-8")
    with pytest.raises(UsageError, match=r"rows of several kinds in turn \(acc, gyro\)"):
        find_layout(tmp_path / "log.txt")


def test_a_word_before_the_time_of_rows_without_names(tmp_path: Path) -> None:
    """The first column of numbers that rises is the time; one that rises behind another is not."""
    rows = "".join(f"gyro {2061 + 11 * k} 0.{k % 7} {k} 1.5\n" for k in range(40))
    (tmp_path / "log.txt").write_text(rows, encoding="utf-8")
    text, problems = write_columns(tmp_path / "log.txt", "drift_record", None)
    assert "[columns.time]\nfrom = 2\n" in text and problems[0].startswith("column 'time': its unit")
    (tmp_path / "log.txt").write_text(re.sub(r"gyro \d+", "gyro 7", rows), encoding="utf-8")
    assert "columns.time" not in write_columns(tmp_path / "log.txt", "drift_record", None)[0]


def test_messages_of_ros_in_a_table(tmp_path: Path) -> None:
    """Their covariances are no channels; MATLAB leaves the points of the names out."""
    for of, names in (
        ("{}.{}", "{}_covariance_{}"), ("field.{}.{}", "field.{}_covariance{}"),
        ("field{}{}", "field{}_covariance{}"), ("field{}{}6", "field{}_covariance{}6"),
    ):  # fmt: skip
        head = ["time"]
        for quantity in ("angular_velocity", "linear_acceleration"):
            head += [of.format(quantity, a) for a in "xyz"] + [names.format(quantity, k) for k in range(9)]
        rows = "".join(f"{STAMP + 10_000_000 * k}{',0.5' * 24}\n" for k in range(20))
        (tmp_path / "log.csv").write_text(",".join(head) + "\n" + rows, encoding="utf-8")
        text, problems = write_columns(tmp_path / "log.csv", "drift_record", None)
        units = re.findall(r'^unit = "(.*)"', text, re.MULTILINE)
        assert problems == [] and units == ["ns", *G, *A]


def test_axes_of_a_phone(tmp_path: Path, command: Any) -> None:
    """One sensor a file, no units: each axis is asked for, and `reduce` points to `fit`."""
    rows = "".join(f"{STAMP + 10_000_000 * k},{0.01 * k},{k % 3},{k % 5},{k % 7}\n" for k in range(20))
    (tmp_path / "Gyroscope.csv").write_text(f"time,seconds_elapsed,z,y,x\n{rows}", encoding="utf-8")
    _, problems = write_columns(tmp_path / "Gyroscope.csv", "drift_record", None)
    assert [p.split(";")[0] for p in problems] == [f"column '{a}': its unit: the file tells none" for a in "zyx"]
    code, _, err = command("reduce", "drift_record", "--data", tmp_path / "Gyroscope.csv")
    assert code == 2 and "gyrobench fit" in err, err


def test_numbers_of_eight_bytes(tmp_path: Path, command: Any) -> None:
    """A time and six channels a row; what has no time first, or a rest, is no such file."""
    values = np.random.default_rng(4).normal(size=(300, 7))
    values[:, 0] = 270000.0 + np.arange(300) / 64.0
    file = tmp_path / "flight.ins"
    values.astype("<f8").tofile(file)
    assert "[columns.time]" in write_columns(file, "drift_record", None)[0]
    np.testing.assert_array_equal(np.loadtxt(as_text(file), delimiter=",", skiprows=1), values)
    file.write_bytes(file.read_bytes()[:-4])
    assert not is_log(file)
    values[::-1].astype("<f8").tofile(file)
    assert not is_log(file)
    np.ones((300, 7)).astype("<u4").tofile(file)
    assert not is_log(file)


def test_a_pointer_of_git_lfs(tmp_path: Path, command: Any) -> None:
    (tmp_path / "a.csv").write_text("version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 1\n")
    for line in ("reduce", "drift_record", "--data"), ("fit", "--system", "drift_record"):
        code, _, err = command(*line, tmp_path / "a.csv")
        assert code == 2 and "git lfs pull brings it" in err, err


def test_angles_and_velocities_of_each_sample(tmp_path: Path, command: Any) -> None:
    """Taken for cumulative ones they would have no N and a Q that is certain: what they are is asked for.

    White noise of 0.002 rad/s and 0.02 m/s2 at 100 Hz: N = 0.0002 rad/sqrt(s) = 0.6875 deg/sqrt(h), 0.12 m/s/sqrt(h).
    """
    rng, n, h = np.random.default_rng(6), 6000, 0.01
    noise = rng.normal(size=(n, 2)) * [0.002 * h, 0.02 * h] + [5e-5 * h, 0.0]
    rows = "".join(f"{k * h:.2f},{a:.9e},{v:.9e}\n" for k, (a, v) in enumerate(noise.tolist()))
    log = tmp_path / "increments.csv"
    for names in ("dtheta_x [rad],dvel_x [m/s]", "gyro_x [rad],v [m/s]"):
        log.write_text(f"# type_b = none\ntime [s],{names}\n{rows}", encoding="utf-8")
        code, _, err = command("reduce", "drift_record", "--data", log)
        name = names.split()[0]
        assert code == 2 and f"column '{name}'" in err and "state '# counts = increments'" in err, err
        outcome = reduce_measured(load_system("drift_record"), log, {"counts": "increments"}, in_memory=True)
        for channel, true in zip((name, names.split(",")[1].split()[0]), (0.6875, 0.12), strict=True):
            assert outcome.result[f"N {channel}"].estimate == pytest.approx(true, rel=0.05)
    text, problems = write_columns(tmp_path / "increments.csv", "drift_record", None)
    log.write_text(f"time [s],dtheta_x [rad],dvel_x [m/s]\n{rows}", encoding="utf-8")
    text, problems = write_columns(log, "drift_record", None)
    assert problems == [] and "\n[set]" in text and '\ncounts = "increments"' in text
    turning = "".join(f"{k * h:.2f},{1e-4 * k * h + a:.9e}\n" for k, (a, _) in enumerate(noise.tolist()))
    log.write_text(f"# type_b = none\ntime [s],gyro_x [rad]\n{turning}", encoding="utf-8")  # 20 deg/h
    assert find_faults(load_system("drift_record"), log, {}) == []


def test_a_blank_between_units_multiplies() -> None:
    """m s^-2 is no power of the millisecond, m N no millinewton."""
    assert units.unit("m s^-2").exponents == units.unit("rad s⁻¹ m/s/rad").exponents == units.unit("m/s2").exponents
    assert units.unit("m N").exponents == units.unit("N.m").exponents and units.factor("g cm") == units.factor("g.cm")
