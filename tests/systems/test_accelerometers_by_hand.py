"""Accelerometers without gyros in unknown attitudes: files of samples without a time, and of one mean a position."""

from __future__ import annotations

import importlib
import re
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gyrobench.arrays import Array
from gyrobench.record.csv_reader import DataError
from gyrobench.record.record import Record
from gyrobench.report import write
from gyrobench.result import DriftTestResult
from gyrobench.system.system import load_system

GEOMETRY: Any = importlib.import_module(".geometry", type(load_system("imu_positions")).__module__)
S = np.array([[2e-3, 0.0, 0.0], [-1e-3, -3e-3, 0.0], [4e-3, 5e-4, 1e-3]])  # rad, of sines
BIAS = np.array([0.01, -0.02, 0.03])  # g
GIVEN = {"attitudes": "unknown", "gravity": "9.80665m/s2"}


def readings(number: int = 26) -> Array:
    """What the accelerometers read in so many directions, g: (1 + S) f + b, |f| = 1."""
    up = np.array(GEOMETRY.directions(number), dtype=float)
    up /= np.linalg.norm(up, axis=1)[:, None]
    return np.asarray(up @ (np.eye(3) + S).T + BIAS)


def read(folder: Path, rows: Array, unit: str = " [g]", **values: str) -> Record:
    file = folder / "log.csv"
    file.write_text(
        "\n".join([",".join(f"a{a}{unit}" for a in "xyz"), *(",".join(f"{v:.9f}" for v in r) for r in rows)]) + "\n"
    )
    return load_system("imu_positions").read_measured(file, {"type_b": "none", **GIVEN, **values})


def check(record: Record, ppm: float, ug: float) -> None:
    """The unknowns are those of :data:`S` and :data:`BIAS`."""
    result = load_system("imu_positions").reduce(record)
    assert isinstance(result, DriftTestResult)
    second = np.pi / 648000.0
    for (i, j), value in np.ndenumerate(S):
        if j <= i:
            unit, off = (1e-6, ppm) if i == j else (second, ppm * 1e-6 / second)
            assert result[f"Sa_{'xyz'[i]}{'xyz'[j]}"].estimate == pytest.approx(value / unit, abs=off)
    for a, value in zip("xyz", BIAS, strict=True):
        assert result[f"ba_{a}"].estimate == pytest.approx(value * 1e6, abs=ug)
    assert len(result.coefficients) == 9


def test_one_mean_a_position(tmp_path: Path) -> None:
    """Without noise the nine unknowns come back to the digits of the file, 1e-9 g; of gravity no latitude is asked."""
    check(read(tmp_path, readings()), 0.1, 0.1)


def test_samples_without_a_time_of_a_unit_that_creeps(tmp_path: Path) -> None:
    """3 s in each of 26 positions, 1 s between them; noise of 1 mg a sample of 100 Hz, 60 ug in the 2.5 s that are kept
    of a position: 26 of them make 20 to 40 ug.  In a further one it turns by 2.8 degrees in 10 s:
    4.9 mg a second, whose scatter of 1.4 mg is no motion, 49 mg in all with one of 14 mg.
    """
    rng = np.random.default_rng(4)
    rest = [np.repeat(r[None], 300, axis=0) for r in readings()]
    turn = [np.linspace(a[0], b[0], 100) for a, b in pairwise(rest)]
    tilt = np.radians(np.linspace(0.0, 2.8, 1000))
    creep = np.column_stack([np.sin(tilt), 0.0 * tilt, np.cos(tilt)]) @ (np.eye(3) + S).T + BIAS
    rows = np.concatenate([p for pair in zip(rest, turn, strict=False) for p in pair] + [rest[-1], turn[0], creep])
    rows = rows + 1e-3 * rng.normal(size=rows.shape)
    record = read(tmp_path, rows, sampling="100Hz")
    check(record, 200.0, 200.0)
    (said,) = [n for n in record.run.notes if n.startswith("Not taken for a position at rest")]
    assert "from t = 10" in said


@pytest.mark.usefixtures("chinese_font")
def test_scale_factors_of_counts_in_chinese(tmp_path: Path) -> None:
    noise = np.random.default_rng(1).normal(size=(26, 3))
    record = read(tmp_path, 16384.0 * readings() + noise, unit="")
    write(load_system("imu_positions").reduce(record), tmp_path / "out", language="zh")
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "计数" in page and "是否计入" not in page  # the unit, not whether something counts


def test_many_rows_without_a_time_are_samples(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"no sampling rate is given: write '# sampling = 100Hz'"):
        read(tmp_path, np.tile(readings(), (20, 1)))


def test_two_commands_from_numbers_alone(tmp_path: Path, command: Any) -> None:
    """Counts of 16384 to the g, no names: `fit`, then the command that it prints and the latitude."""
    rows = 16384.0 * readings(26)
    (tmp_path / "x.txt").write_text("\n".join(",".join(f"{v:.3f}" for v in r) for r in rows) + "\n")
    code, _, err = command("fit", tmp_path / "x.txt", "--system", "imu_positions", "--out", tmp_path / "m.toml")
    assert code == 0 and "each row is the mean of a position" in err
    code, out, err = command(
        "reduce", "imu_positions", "--data", tmp_path / "x.txt", "--columns", tmp_path / "m.toml", "--set",
        "gravity=9.80665m/s2", "--set", "type_b=none", "--out", tmp_path / "out",
    )  # fmt: skip
    # 16384 (1 + 0.002)/9.80665 = 1674.0445
    assert code == 0 and re.search(r"^ka_x +1674\.0444", out, re.MULTILINE), out + err
