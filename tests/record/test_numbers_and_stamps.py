"""Separators of thousands, stamps of loggers, columns of one name: read as they are meant, or refused with a word."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from commanding import Command

from gyrobench.record.column_map import read_map, translate
from gyrobench.record.csv_reader import CsvColumn, DataError, read_head, read_measured, thousands
from gyrobench.record.row_faults import row_faults
from gyrobench.record.time_series import read_blocks
from gyrobench.workflow.fit_columns import write_columns

RATE = (CsvColumn("time", "s"), CsvColumn("rate", "rad/s"))
COUNTS = [1070, 965, 1180, 1325, 880, 1044]  # arcsec/s
WORDS = "'1.070' beside '965': separators of thousands"


def by_thousands(numbers: list[int], sign: str = ".") -> list[str]:
    return [f"{n:,}".replace(",", sign) for n in numbers]


@pytest.mark.parametrize(
    ("cells", "refused"),
    [
        (by_thousands(COUNTS), True),
        (by_thousands(COUNTS, ","), True),
        (by_thousands([*COUNTS, 2_000_000]), True),
        (["-1.070", "−965", "1.180", "1.325"], True),
        ([f"{n / 1000:.3f}" for n in COUNTS], False),  # 0.965: decimals
        ([f"{n / 1000:g}" for n in COUNTS], False),  # 1.07
        (["1.070", "1.965", "1.180", "1.325"], False),  # cannot be told: no word either way
        (["1.070", "2", "1.180", "1.325"], False),  # 2 typed for 2.000
        (["1.070", "1965", "1.180", "1.325"], False),  # of four digits without a separator
        (["100", "200", "300.5"], False),
        (["0", "", "-", "text"], False),
    ],
)
def test_separators_of_thousands(cells: list[str], refused: bool) -> None:
    assert bool(thousands("rate", cells)) is refused


def test_no_reader_takes_a_thousand_for_one(tmp_path: Path) -> None:
    """1.070 counts would be 1.07, a thousandth, beside 965 counts: series, windows, and any layout under a map."""
    rows = "".join(f"{k};{text}\n" for k, text in enumerate(by_thousands(COUNTS)))
    file = tmp_path / "a.csv"
    file.write_text(f"time [s];rate [arcsec/s]\n{rows}", encoding="utf-8")
    with pytest.raises(DataError, match=WORDS):
        next(iter(read_blocks(file, read_head(file), RATE)))
    with pytest.raises(DataError, match=WORDS):
        read_measured(file, RATE, time="time")
    layout = 'delimiter = ";"\n[columns.time]\nfrom = 1\nunit = "s"\n[columns.rate]\nfrom = 2\nunit = "arcsec/s"\n'
    for more in ("", 'decimal = ","\n', 'empty = "skip"\n'):
        (tmp_path / "m.toml").write_text(more + layout, encoding="utf-8")
        with pytest.raises(DataError, match=WORDS):
            translate(file, read_map(tmp_path / "m.toml"), tmp_path / "out.csv")


@pytest.mark.parametrize(
    ("cell", "words"),
    [
        ("1,069.61", "separators of thousands"),
        ("1'069", "separators of thousands"),
        ("1\u00a0069,5", "separators of thousands"),
        ("1,069,610", "separators of thousands"),
        ("1,069", "the decimal sign of this file is a point"),  # a decimal comma as well
        ("0,123", "the decimal sign of this file is a point"),
    ],
)
def test_a_cell_that_is_no_number_says_why(cell: str, words: str, tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    file.write_text(f'time [s],rate [deg/s]\n0,1.5\n1,"{cell}"\n', encoding="utf-8")
    head = read_head(file)
    (said,) = row_faults(file, head, {"rate": (1, None)})  # type: ignore[dict-item]
    assert words in said and "row 3" in said


@pytest.mark.parametrize(
    ("stamps", "form"),
    [
        (["11:59:59.500 PM", "12:00:00.000 AM", "12:00:00.500 AM"], "%I:%M:%S.%f %p"),
        (["2026-11-20T23:59:59.5+01:00", "2026-11-21T00:00:00+01:00", "2026-11-21T00:00:00.5+01:00"],
         "%Y-%m-%dT%H:%M:%S.%f%z"),  # fractions that are zero left out
        (["2026-11-20T23:59:59.500Z", "2026-11-21T00:00:00.000Z", "2026-11-21T00:00:00.500Z"],
         "%Y-%m-%dT%H:%M:%S.%f%z"),
        (["2026-11-20 23:59:59.500000000", "2026-11-21 00:00:00.000000000", "2026-11-21 00:00:00.500000000"],
         "%Y-%m-%d %H:%M:%S.%f"),
        (["23:59:59.5", "00:00:00", "00:00:00.5"], "%H:%M:%S.%f"),
    ],
)  # fmt: skip
def test_stamps_of_loggers_over_midnight(stamps: list[str], form: str, tmp_path: Path) -> None:
    """Half a second apart, whatever the form."""
    file = tmp_path / "log.csv"
    file.write_text("Time,Rate (deg/s)\n" + "".join(f"{s},{0.1 * k}\n" for k, s in enumerate(stamps)), encoding="utf-8")
    text, problems = write_columns(file, "drift_record", tmp_path / "m.toml")
    assert f'time = "{form}"' in text and problems == []
    done = translate(file, read_map(tmp_path / "m.toml"), tmp_path / "out.csv")
    assert done.problems() == []
    time, _ = np.loadtxt(tmp_path / "out.csv", delimiter=",", skiprows=1).T
    assert time == pytest.approx([0.0, 0.5, 1.0], abs=1e-9)


def test_a_stamp_of_another_form_is_named(tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text('[columns.time]\nfrom = 1\ntime = "%H:%M:%S.%f"\n', encoding="utf-8")
    (tmp_path / "a.csv").write_text("t,x\n23:59:59.5,1\n25:00:00,2\n", encoding="utf-8")
    done = translate(tmp_path / "a.csv", read_map(tmp_path / "m.toml"), tmp_path / "out.csv")
    assert done.problems() == ["row 3: '25:00:00': column 'time': not of the form %H:%M:%S.%f"]


def test_of_columns_of_one_name_the_one_that_is_taken_is_named(gyrobench: Command) -> None:
    rows = "".join(f"{k},{k}.5,{-k}.25\n" for k in range(9))
    Path("a.csv").write_text(f"time [s],rate [deg/s],rate [deg/s]\n{rows}", encoding="utf-8")
    code, _, err = gyrobench("fit", "a.csv", "--system", "drift_record", "--out", "m.toml")
    assert code == 0 and "column 2 is taken for 'rate'; others are called so, too: 3" in err


def test_a_comma_beside_it_tells_that_a_point_separates_thousands(tmp_path: Path) -> None:
    """6.070 in every row may be %.3f; with 21,5 in another column the point is no decimal sign: not read as 6.07.
    Nothing tells it beside whole numbers or decimals with a point, and most such files are decimals: these are read."""
    columns = (CsvColumn("rate", "rad/s", "rate"), CsvColumn("angle", "rad", "angle"))
    file = tmp_path / "a.csv"
    for beside, refused in (("21,5", True), ("21", False), ("21.5", False)):
        rows = "".join(f"6.07{k};{beside}\n" for k in range(9))
        file.write_text(f"rate [rad/s];angle [rad]\n{rows}", encoding="utf-8")
        if refused:
            with pytest.raises(DataError, match="'21,5' is not a finite number; the decimal sign is a point"):
                read_measured(file, columns, time=None)
        else:
            assert read_measured(file, columns, time=None)[0]["rate"][1] == 6.071
