"""Measured CSV files: units, and what is wrong with a file, with row numbers."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from gyrobench.record.csv_reader import DataError, read_measured

GOOD = """# latitude = 45.75deg
# a remark
phase;t_start [s];t_end [min];angle_start [deg];angle_end [rad];mean [mA];room [degC]
1;0;1;0;0.1;0.25;21
# a later comment
1;60;2;5.5;0.2;-0.5;21
"""


def read(tmp_path: Path, text: str) -> tuple[dict[str, list[float]], dict[str, str]]:
    file = tmp_path / "data.csv"
    file.write_text(text, encoding="utf-8-sig")
    columns, meta = read_measured(file)
    return {k: v.tolist() for k, v in columns.items()}, meta


def test_units_and_comments(tmp_path: Path) -> None:
    columns, meta = read(tmp_path, GOOD)
    assert meta == {"latitude": "45.75deg"}
    assert columns["phase"] == [1, 1]
    assert columns["t_end"] == [60.0, 120.0]
    assert columns["angle_start"] == pytest.approx([0.0, math.radians(5.5)])
    assert columns["mean"] == pytest.approx([2.5e-4, -5e-4])
    assert "room" not in columns


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("mean [mA]", "mean [mV]", r"column 'mean': wrong unit \[mV\]: units that fit: A, mA"),
        ("mean [mA]", "mean", r"column 'mean': no unit; write 'mean \[A\]'"),
        ("mean [mA]", "current [mA]", r"column 'mean \[A\]' is missing \(mean torquer current\)"),
        ("mean [mA]", "mean [mAmp]", r"unknown symbol 'mAmp'"),
        ("0.25", "nan", r"row 4, column 'mean': 'nan' is not a finite number"),
        ("-0.5", "1,5", r"row 6, column 'mean': '1,5' is not a finite number"),
        ("1;60", "1.5;60", r"row 6, column 'phase': 1.5 must be an integer"),
        ("1;60", "1;0", r"row 6: t_start = 0 s does not come after 0 s \(row 4\)"),
        ("1;60;2;5.5;0.2;-0.5;21", "1;0;1;0;0.1;0.25;22", r"row 6: the same as row 4"),
        ("-0.5;21", "-0.5", r"row 6: 6 cells, the header has 7"),
        ("room [degC]", "mean [A]", r"column 'mean': appears twice"),
    ],
)
def test_findings(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in GOOD
    with pytest.raises(DataError, match=words):
        read(tmp_path, GOOD.replace(old, new))


def test_a_fault_of_many_rows_is_one_line(tmp_path: Path) -> None:
    head, first, *_ = GOOD.split("\n")[2:]
    rows = [first.replace("1;0;1", f"1;{60 * k};{k + 1}").replace("0.25", "bad") for k in range(60)]
    with pytest.raises(DataError) as error:
        read(tmp_path, "\n".join([head, *rows]))
    (said,) = error.value.problems
    assert said.startswith("rows 2, 3, 4, 5, 6, 7, 8, 9 and 52 more (60 rows), column 'mean'") and "'bad'" in said


def test_decimal_commas(tmp_path: Path) -> None:
    """Beside a decimal point a comma is none: it may separate thousands."""
    columns, _ = read(tmp_path, GOOD.replace(".", ","))
    assert columns["mean"] == pytest.approx([2.5e-4, -5e-4]) and columns["angle_end"] == pytest.approx([0.1, 0.2])


def test_empty_files(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="no header line"):
        read(tmp_path, "# nothing\n")
    with pytest.raises(DataError, match="no rows below the header"):
        read(tmp_path, GOOD.split("1;0")[0])
