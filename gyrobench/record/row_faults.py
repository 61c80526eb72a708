"""All faults of the rows of a long CSV file, with their row numbers, once reading it in blocks has failed."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from gyrobench.record.circumstances import statement
from gyrobench.record.csv_reader import HEAD_ROWS, Factor, Head, cells_of, row_list, thousands

DATE = re.compile(r"\s*\d{1,4}[-/.]\d{1,2}[-/.]\d{1,4}|\s*\d{1,2}:\d{2}:")
#: 1,069.61 and 1.069,61; 1'069; 1.069.610: not 1,069, which may be a decimal comma
SEPARATED = re.compile(
    r"[-+−]?[1-9]\d{0,2}(([.,'’ \u00a0\u202f])\d{3}(\2\d{3})*(?!\2)[.,]\d*"
    r"|(['’ \u00a0\u202f]\d{3})+|([.,])\d{3}(\5\d{3})+)"
)
#: cells without a value; those with # are errors of a spreadsheet, in English and German
NOTHING = [
    "", "nan", "NaN", "NAN", "NA", "n/a", "null", "-", "--", "#N/A", "#DIV/0!", "#VALUE!", "#NUM!", "#REF!", "#NAME?",
    "#NULL!", "#NV", "#WERT!", "#ZAHL!", "#BEZUG!",
]  # fmt: skip
ROWS = 2_000_000  # examined of a file whose header is wrong already


@dataclass
class _Fault:
    first: str = ""
    rows: list[int] = field(default_factory=list)

    def add(self, row: int, shown: str) -> None:
        self.first = self.first if self.rows else shown
        self.rows.append(row)


def _lines(file: Path, head: Head, most: int) -> Iterator[tuple[int, str]]:
    with file.open("rb") as lines:
        for number, data in enumerate(lines, 1):
            if most and number > head.line + most:
                return
            text = data.decode("utf-8", "replace").rstrip("\r\n")
            if number > head.line and text.strip():
                yield number, text


def row_faults(
    file: Path, head: Head, places: Mapping[str, tuple[int, Factor]], time: str = "", most: int = 0
) -> list[str]:
    """Return what is wrong with the rows: their number of cells, cells that are not numbers, statements among them.

    places: of the columns that are read.  time: the column that must increase, in rows that have all their values; "":
    none.  most: rows to examine, 0: all.
    """
    count, late = _Fault(), _Fault()
    cells_wrong = {name: _Fault() for name in places}
    back, before = _Fault(), -math.inf
    for number, text in _lines(file, head, most):
        cells = cells_of(text, head.delimiter) if '"' in text else [c.strip() for c in text.split(head.delimiter)]
        if len(cells) != len(head.names):
            if not text.lstrip().startswith("#"):
                count.add(number, text)
            elif (s := statement(text, number)) and not s.remark:
                late.add(number, text)
            continue
        values = {}
        for name, (k, _) in places.items():
            value = _number(cells[k], head.decimal_comma)
            if value is None:
                cells_wrong[name].add(number, cells[k])
            values[name] = math.nan if value is None else value
        if time and time in values and all(math.isfinite(v) for v in values.values()):
            if values[time] <= before:
                back.add(number, cells[places[time][0]])
            before = values[time]
    return _sentences(head, count, late, cells_wrong, (time, back))


def grouped(file: Path, head: Head, places: Mapping[str, tuple[int, Factor]]) -> list[str]:
    """Return which columns are written with separators of thousands, by the first rows."""
    rows = [cells_of(text, head.delimiter) for _, text in itertools.islice(_lines(file, head, 0), HEAD_ROWS)]
    return [p for name, (k, _) in places.items() for p in thousands(name, (r[k] for r in rows if len(r) > k))]


def _number(cell: str, comma: bool) -> float | None:
    """Return a cell as a number, NaN for one without a value, None for anything else."""
    if cell in NOTHING:
        return math.nan
    if comma and "." in cell:
        return None
    try:
        return float(cell.replace(",", ".") if comma else cell)
    except ValueError:
        return None


def _sentences(
    head: Head, count: _Fault, late: _Fault, cells: Mapping[str, _Fault], times: tuple[str, _Fault]
) -> list[str]:
    problems = []
    if late.rows:
        problems.append(f"{row_list(late.rows)}: '{late.first[:80]}' stands among the rows: write it above the header")
    if count.rows:
        many = f"{len(count.rows)} rows have" if len(count.rows) > 1 else "a row has"
        problems.append(
            f"{many} not the {len(head.names)} cells of the header; the first: '{count.first[:80]}' "
            f"({row_list(count.rows)})"
        )
    sign = f"the decimal sign of this file is {'a comma' if head.decimal_comma else 'a point'}"
    for name, fault in cells.items():
        if fault.rows:
            n = len(fault.rows)
            text = fault.first[:40]
            why = sign if any(c.isdigit() for c in text) else f"a missing value? column map: absent = ['{text}']"
            if SEPARATED.fullmatch(text):
                why = "separators of thousands: write the numbers without them"
            if DATE.match(text):
                why = "a date: write seconds from the first sample on"
            problems.append(
                f"column '{name}': {n} cell{'s are' if n > 1 else ' is'} not a number, the first: '{text}' "
                f"({why}; {row_list(fault.rows)})"
            )
    time, back = times
    if back.rows:
        plural = "s" if len(back.rows) > 1 else ""
        where = row_list(back.rows)
        problems.append(
            f"{time} does not increase in {len(back.rows)} row{plural}, the first: '{back.first}' ({where})"
        )
    return problems
