"""Column maps that are proposed for files without units or names: three accelerometers are told by gravity."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from gyrobench.record.clock_times import moment
from gyrobench.record.column_map import read_map
from gyrobench.workflow.fit_columns import write_columns


def rows(*columns: float, n: int = 30) -> list[str]:
    """Rows of these levels with a noise of a thousandth."""
    values = np.array(columns) + 1e-3 * np.random.default_rng(2).normal(size=(n, len(columns)))
    return [",".join(f"{v:.5f}" for v in row) for row in values]


def proposed(folder: Path, name: str, head: str, lines: list[str], system: str = "drift_record") -> dict[str, str]:
    """Return column of the map -> unit that is proposed for it."""
    (folder / name).write_text("\n".join([head] * bool(head) + lines) + "\n", encoding="utf-8")
    text, _ = write_columns(folder / name, system, None)
    return dict(re.findall(r'\[columns\.(\w+)\]\n(?:.*\n)?(?:# )?unit = "(.*)"', text))


@pytest.mark.parametrize(("level", "unit"), [(9.7, "m/s2"), (0.94, "g"), (1010.0, "mg"), (16384.0, "m/s2")])
def test_the_unit_of_accelerometers(level: float, unit: str, tmp_path: Path) -> None:
    """Nine tenths along an axis and 0.436 along another, sqrt(0.81 + 0.19) = 1; of counts m/s2 is asked for."""
    values = rows(0.9 * level, 0.0, 0.436 * level, 0.3, 0.2, 0.1)
    found = proposed(tmp_path, "x.csv", "acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z", values)
    assert [found[f"acc_{a}"] for a in "xyz"] == [unit] * 3 and found["gyro_x"] == "deg/s"


def test_axes_without_a_word_for_the_quantity(tmp_path: Path) -> None:
    """Files of a phone, as MATLAB writes them: gravity tells the accelerometers, and the name of the file the gyros."""
    lines = [f"09-Jan-2023 19:38:{k:02d}.327,{row}" for k, row in enumerate(rows(0.0, 9.79, 0.6))]
    found = proposed(tmp_path, "up.txt", "Timestamp,X,Y,Z", lines)
    assert found == {"X": "m/s2", "Y": "m/s2", "Z": "m/s2"}
    assert "%d-%b-%Y %H:%M:%S.%f" in write_columns(tmp_path / "up.txt", "drift_record", None)[0]
    assert moment("09-Jan-2023 19:38:27.327", "%d-%b-%Y %H:%M:%S.%f").microsecond == 327000
    found = proposed(tmp_path, "Gyroscope.csv", "X,Y,Z", rows(0.0, 1.0, 0.1))
    assert found == {"X": "deg/s", "Y": "deg/s", "Z": "deg/s"}


def test_six_columns_without_names(tmp_path: Path) -> None:
    """Forces first, rates behind them: for a record at rest, and for positions by hand without a time."""
    values = rows(8.6, 0.1, 4.7, -0.01, 0.002, 0.005)
    found = proposed(tmp_path, "x.log", "", values)
    assert list(found) == ["acc_x", "acc_y", "acc_z", "gyro_x", "gyro_y", "gyro_z"] and found["acc_z"] == "m/s2"
    found = proposed(tmp_path, "x.log", "", values, "imu_positions")
    assert list(found) == ["gx", "gy", "gz", "ax", "ay", "az"] and found["az"] == "m/s2"


def test_a_field_of_one_is_no_gravity(tmp_path: Path) -> None:
    """A magnetometer that was scaled to 1 beside forces of 10, and a quaternion."""
    head = "wx,wy,wz,mx,my,mz,qx,qy,qz,qw,tx,ty,tz"
    found = proposed(tmp_path, "x.csv", head, rows(0, 0, 0, 0.6, 0.8, 0, 0, 0, 0, 1, 0.1, 0.1, 9.9), "imu_positions")
    assert found["ax"] == "m/s2"


def test_a_quaternion_without_names_is_no_gravity(tmp_path: Path) -> None:
    """A time and (1, 0, 0, 0), beside lengths of meters."""
    lines = [f"{k},1,0.0000{k % 3},0,0,0.85,{k % 7},1.17" for k in range(30)]
    assert "acc_x" not in proposed(tmp_path, "x.csv", "", lines)


def test_a_word_before_the_quantity(tmp_path: Path) -> None:
    found = proposed(
        tmp_path, "x.csv", "imu_gyr_1,imu_gyr_2,imu_gyr_3,imu_acc_1,imu_acc_2,imu_acc_3", rows(0, 0, 0, 0, 0, 1)
    )
    assert list(found.values()) == ["deg/s"] * 3 + ["g"] * 3


def test_a_field_of_one_before_forces_of_ten(tmp_path: Path) -> None:
    """Angles of 0.6 and 0.8 by chance, nine columns without names: what reads 9.8 is the accelerometers."""
    text = write_columns_of(tmp_path, rows(0.6, -0.8, 0.1, 0.2, 0.3, 0.3, 0.1, 0.2, -9.8))
    assert re.findall(r"from = (\d)", text) == ["7", "8", "9"]


def write_columns_of(folder: Path, lines: list[str]) -> str:
    (folder / "x.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return write_columns(folder / "x.txt", "drift_record", None)[0]


def test_sentences_of_an_instrument(tmp_path: Path) -> None:
    """Twelve values behind $VNYMR: angles, field, forces in m/s2, rates in rad/s, and a checksum."""
    lines = ["$VNYMR,-134.051,-000.443,-000.892,-00.1575,+00.1599,+00.3040," + row.replace(",", ",+0", 1) + "*68"
             for row in rows(0.1, 0.2, 9.8, 0.001, 0.002, 0.003)]  # fmt: skip
    text = write_columns_of(tmp_path, [line.replace("+0-", "-0") for line in lines])
    found = re.findall(r'\[columns\.(\w+)\]\nfrom = (\d+)\nunit = "(.*)"', text)
    assert found == [
        *((f"acc_{a}", str(8 + k), "m/s2") for k, a in enumerate("xyz")),
        *((f"gyro_{a}", str(11 + k), "rad/s") for k, a in enumerate("xyz")),
    ]


def test_what_belongs_to_a_channel_is_none(tmp_path: Path) -> None:
    """How good it is, its size and its temperature; angle and velocity of each sample behind an address."""
    head = (
        "sys_time,accuracy(more=better),acc_x,acc_y,acc_z,acc_norm,gyro_temp,rot0,unit-1:deltaThetaX,unit-1:deltaVelX"
    )
    lines = [f"{10262 + 10 * k},3,{row},1.0,31.{k},0.1,0.0{k}1,0.0{k}2" for k, row in enumerate(rows(0.1, 0.2, 0.97))]
    found = proposed(tmp_path, "x.csv", head, lines)
    assert found == {
        "time": "ms", "acc_x": "g", "acc_y": "g", "acc_z": "g", "gyro_temp": "degC", "rot0": "deg/s",
        "unit_1_deltaThetaX": "rad", "unit_1_deltaVelX": "m/s",
    }  # fmt: skip


@pytest.mark.parametrize(("step", "unit"), [(1, "s"), (2, "ms"), (5000, "us"), (2_500_000, "ns"), (0.01, "s")])
def test_the_unit_of_whole_times(step: float, unit: str, tmp_path: Path) -> None:
    """By the rate of the rows: 500, 200 and 400 a second; a step of one may be a second, a fraction is of one."""
    lines = [f"{1000 + k * step:g},{row}" if step < 1 else f"{1000 + k * step},{row}"
             for k, row in enumerate(rows(0.1, 0.2, 9.8))]  # fmt: skip
    assert proposed(tmp_path, "x.csv", "timestamp,ax,ay,az", lines)["time"] == unit


def test_counts_need_no_unit_in_positions_by_hand(tmp_path: Path) -> None:
    """Whole numbers that are no gravity; a number of the sample is no time."""
    values = np.round(np.array([300.0, 2.0, 4100.0, 7.0, -3.0, 5.0]) + np.random.default_rng(1).normal(size=(40, 6)))
    lines = [",".join([str(k), *(f"{v:.0f}" for v in row)]) for k, row in enumerate(values.tolist())]
    head = "n_samples,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z"
    found = proposed(tmp_path, "x.csv", head, lines, "imu_positions")
    assert found == dict.fromkeys(["gx", "gy", "gz", "ax", "ay", "az"], "counts")
    (tmp_path / "map.toml").write_text('[columns.ax]\nfrom = "acc_x"\nunit = "counts"\n', encoding="utf-8")
    assert read_map(tmp_path / "map.toml").columns["ax"].unit == "1"


def test_nine_columns_of_counts_without_names(tmp_path: Path) -> None:
    """Nothing tells which they are: what a logger's file needs is asked for, not the angles of a table."""
    (tmp_path / "x.txt").write_text("\n".join(["31 -20 1040 70 80 90 100 200 30"] * 20 + [""]), encoding="utf-8")
    text, problems = write_columns(tmp_path / "x.txt", "imu_positions", None)
    assert 'attitudes = "unknown"' in text and not any("outer" in p for p in problems)
    assert [p[8:10] for p in problems if p.startswith("column")] == ["gx", "gy", "gz", "ax", "ay", "az"]


def test_positions_of_a_file_of_one_triad(tmp_path: Path) -> None:
    """Axes with their unit, and milliseconds since 1970 behind a word and a place."""
    lines = [f"{1570546289843 + 5 * k}\t" + row.replace(",", "\t").replace(".", ",")
             for k, row in enumerate(rows(0.3, 0.1, 9.8))]  # fmt: skip
    found = proposed(tmp_path, "x.txt", "TStamp Europe/Rome\tX [m/s²]\tY [m/s²]\tZ [m/s²]", lines, "imu_positions")
    assert found == {"time": "ms", "ax": "m/s²", "ay": "m/s²", "az": "m/s²"}
