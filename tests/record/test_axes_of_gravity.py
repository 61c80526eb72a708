"""Column maps that are proposed for files without units or names: three accelerometers are told by gravity."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from gyrobench.record.clock_times import moment
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
