"""Measured data: a laboratory's CSV file as columns in SI.

    # latitude = 45.75deg
    # instrument = gyro 17
    phase,t_start [s],t_end [s],angle_start [deg],angle_end [deg],mean [mA]
    1,0,60,0,2.5,0.1432

The first line that is not a comment is the header: ``name [unit]`` for each column, no unit for pure numbers.  Lines
``# key = value`` give circumstances, see :mod:`gyrobench.record.circumstances`.  Comma, semicolon or tab separates; the
decimal sign is a point or, where a semicolon or a tab separates, a comma.
"""

from __future__ import annotations

import codecs
import csv
import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from textwrap import shorten
from typing import Any

import numpy as np

from gyrobench import units
from gyrobench.errors import GyrobenchError
from gyrobench.reading import require_regular
from gyrobench.record.circumstances import Keys, Statement, faults, statement, values_of

MAX_LISTED = 8  # row numbers listed before "and n more"
HEAD_ROWS = 2000  # that tell whether numbers have separators of thousands
SCANNED = 50  # lines below the header that tell the decimal sign
DECIMAL_POINT = re.compile(r"[-+]?\d*\.\d+([eE][-+]?\d+)?")
DECIMAL_COMMA = re.compile(r"[-+]?\d*,\d+([eE][-+]?\d+)?")

GROUPS = re.compile(r"[-+−]?[1-9]\d{0,2}([.,]\d{3})+")


class DataError(GyrobenchError):
    """Data that cannot be reduced; ``problems`` names for each problem its place and the remedy."""

    def __init__(self, file: Path | str, problems: list[str]) -> None:
        self.problems = problems
        super().__init__("\n".join([f"{file}: not usable:", *(f"  - {p}" for p in problems)]))


LARGEST = 1e30  # of a cell: no quantity of a laboratory in any unit, and squares of it are still numbers


@dataclass(frozen=True)
class CsvColumn:
    """A column that is expected: ``unit`` is the SI unit it is converted to ("1": a pure number)."""

    name: str
    unit: str
    meaning: str = ""
    required: bool = True
    whole: bool = False


FLAGGED = CsvColumn("flagged", "1", "suspect samples", required=False, whole=True)
READING_TIMES = (CsvColumn("t_start", "s", "start of the reading"), CsvColumn("t_end", "s", "end of the reading"))
WINDOW_COLUMNS = (
    CsvColumn("phase", "1", "phase of the plan, from 1", whole=True),
    CsvColumn("t_start", "s", "start of the window"),
    CsvColumn("t_end", "s", "end of the window"),
    CsvColumn("angle_start", "rad", "table angle at the start, cumulative"),
    CsvColumn("angle_end", "rad", "table angle at the end, cumulative"),
    CsvColumn("mean", "A", "mean torquer current"),
    CsvColumn("std", "A", "standard deviation of the samples", required=False),
    CsvColumn("n", "1", "number of samples", required=False, whole=True),
    FLAGGED,
)


def regular(file: Path) -> Path:
    """Return a file.  Raises DataError for a pipe or a device, and for the pointer of Git LFS in place of a file."""
    found = require_regular(Path(file), lambda text: DataError(file, [text]))
    if found.is_file() and found.stat().st_size < 400 and found.read_bytes().startswith(b"version https://git-lfs"):
        raise DataError(file, ["a pointer of Git LFS, not the file; git lfs pull brings it"])
    return found


def for_arrow(file: Path) -> Any:
    """Return what pyarrow can open: the path, or the open file where the path is not UTF-8."""
    try:
        str(file).encode()
    except UnicodeEncodeError:
        return file.open("rb")
    return file


def read_lines(file: Path) -> list[str]:
    """Return the lines of a text file.  Raises DataError for one that is not UTF-8, as from spreadsheets on Windows."""
    data = regular(file).read_bytes()
    try:
        return data.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        row = data[: error.start].count(b"\n") + 1
        raise DataError(file, [not_utf8(row)]) from None


def check_utf8(file: Path) -> None:
    """Raise DataError for a file of any length that is not UTF-8 text, with the row."""
    decoder, row = codecs.getincrementaldecoder("utf-8")(), 1
    with regular(file).open("rb") as data:
        block = b" "
        while block:
            block = data.read(1 << 20)
            try:
                decoder.decode(block, final=not block)
            except UnicodeDecodeError as error:
                raise DataError(file, [not_utf8(row + block[: error.start].count(b"\n"))]) from None
            row += block.count(b"\n")


@dataclass(frozen=True)
class Factor:
    """SI = factor value + offset."""

    factor: float
    offset: float

    def to_si(self, values: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        return values * self.factor + self.offset if self.offset else values * self.factor


@dataclass(frozen=True)
class Head:
    """Head of a CSV file: the lines above its rows, and how the rows are written."""

    names: list[str]  # of the columns, with units
    statements: list[Statement]  # of the comments above it
    line: int  # number of the header line, from 1
    delimiter: str
    decimal_comma: bool

    @property
    def comments(self) -> dict[str, str]:
        """Return what the comments state: key -> value."""
        return values_of(self.statements)


def read_head(file: Path) -> Head:
    """Return header and comments of a file of any length.  Raises DataError for none, and for text not in UTF-8."""
    stated: list[Statement | None] = []
    with regular(file).open("rb") as lines:
        for number, data in enumerate(lines, 1):
            try:
                line = data.decode("utf-8-sig" if number == 1 else "utf-8").rstrip("\r\n")
            except UnicodeDecodeError:
                raise DataError(file, [not_utf8(number)]) from None
            if line.lstrip().startswith("#"):
                stated.append(statement(line, number))
            elif line.strip():
                delimiter, names = _split_header(line)
                if all(_is_number(n) for n in names):
                    raise DataError(
                        file,
                        [f"row {number}: numbers, where names and units of the columns are expected, as 'time [s],rate "
                         "[deg/h]': write that line above them"],
                    )  # fmt: skip
                below = (next(lines, b"").decode("ascii", "replace") for _ in range(SCANNED))
                cells = (c.strip() for text in below for c in text.split(delimiter))
                said = [s for s in stated if s is not None]
                return Head(names, said, number, delimiter, delimiter != "," and _decimal_comma(cells))
    raise DataError(file, ["no header line"])


def cells_of(line: str, delimiter: str = ",") -> list[str]:
    """Return the cells of a line; of one that is no CSV (a return within it) what stands between the delimiters."""
    try:
        cells = next(csv.reader([line], delimiter=delimiter), [])
    except csv.Error:
        cells = line.split(delimiter)
    return [c.strip() for c in cells]


def read_statements(file: Path) -> list[Statement]:
    """Return what the comments of a file state, wherever they stand.  Raises DataError for text not in UTF-8."""
    lines = enumerate(read_lines(file), 1)
    stated = (statement(line, number) for number, line in lines if line.lstrip().startswith("#"))
    return [s for s in stated if s is not None]


def _split_header(line: str) -> tuple[str, list[str]]:
    delimiter = max(",;\t", key=line.count)
    return delimiter, cells_of(line, delimiter)


def _is_number(cell: str) -> bool:
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return False
    return True


def _decimal_comma(cells: Iterable[str]) -> bool:
    """True where numbers have decimal commas and none has a point: 1,234 beside 0.5 may be a thousand and more."""
    found = False
    for c in cells:
        if DECIMAL_POINT.fullmatch(c):
            return False
        found = found or DECIMAL_COMMA.fullmatch(c) is not None
    return found


def thousands(name: str, cells: Iterable[str]) -> list[str]:
    """Return the problem of a column with separators of thousands: 1.070 beside 965, of no other form.

    A column of decimals with three places would have them in all cells (%.3f), or fewer in some (%g).
    """
    marked, plain = [], []
    for c in cells:
        if "." in c or "," in c:
            if not GROUPS.fullmatch(c):
                return []
            marked.append(c)
        elif (digits := c.lstrip("+-−")).isdecimal():
            if len(digits) > 3:
                return []
            plain += [c] if len(digits) == 3 else []
    if len(marked) < 3 or not plain:
        return []
    return [
        f"column '{name}': '{marked[0]}' beside '{plain[0]}': separators of thousands, which could be decimal signs; "
        f"write the numbers without them (where they are decimals: {plain[0]}{marked[0][-4]}000)"
    ]


def not_utf8(row: int) -> str:
    return f"row {row}: not UTF-8 text; save the table as CSV (UTF-8), or gyrobench fit writes a column map for it"


def read_measured(
    file: Path, columns: tuple[CsvColumn, ...] = WINDOW_COLUMNS, time: str | None = "t_start", keys: Keys | None = None
) -> tuple[dict[str, np.ndarray[Any, Any]], dict[str, str]]:
    """Return the columns of a CSV file in SI, and its comments.

    time: the column that must increase strictly (None: none).  keys: what the comments may state (None: anything).
    Raises DataError naming unknown and doubled keys, missing and doubled columns, missing or wrong units, cells that
    are not a finite number, doubled rows and times that do not increase, all of them, with the row numbers as an
    editor counts them.
    """
    stated: list[Statement | None] = []
    table: list[tuple[int, str]] = []
    for number, line in enumerate(read_lines(file), 1):
        if line.lstrip().startswith("#"):
            stated.append(statement(line, number))
        elif line.strip():
            table.append((number, line))
    if not table:
        raise DataError(file, ["no header line"])
    delimiter, header = _split_header(table[0][1])
    rows = [(n, cells_of(line, delimiter)) for n, line in table[1:]]
    as_written = rows
    if delimiter != "," and _decimal_comma(c for _, cells in rows for c in cells):
        rows = [(n, [c.replace(",", ".") if DECIMAL_COMMA.fullmatch(c) else c for c in cells]) for n, cells in rows]
    said = [s for s in stated if s is not None]
    problems = faults(said, keys) if keys is not None else []
    expected = {c.name: c for c in (*columns, *conditions(header))}
    places, of_header = header_places(header, expected)
    problems += of_header
    if short := [(n, len(r)) for n, r in rows if len(r) != len(header)]:
        problems.append(f"{row_list([n for n, _ in short])}: {short[0][1]} cells, the header has {len(header)}")
    if not rows:
        problems.append("no rows below the header")
    rows = [(n, r) for n, r in rows if len(r) == len(header)]
    columns_si = {}
    for name, (k, factor) in places.items():
        problems += thousands(name, (r[k] for _, r in as_written if len(r) == len(header)))
        values, invalid = _numbers(name, [(n, r[k]) for n, r in rows], expected[name].whole)
        columns_si[name] = values if expected[name].whole else factor.to_si(values)
        problems += invalid
    problems += _repeats(columns_si, [n for n, _ in rows], time)
    if problems:
        raise DataError(file, problems)
    return columns_si, values_of(said)


def conditions(header: list[str]) -> list[CsvColumn]:
    """Columns that any record may have, for the nuisance model: temperature [degC], temperature 2 ..., turn_on."""
    names = [t.split("[")[0].strip() for t in header]
    found = [CsvColumn(n, "K", "temperature", required=False) for n in names if n.startswith("temperature")]
    return [*found, *(CsvColumn(n, "1", "number of the turn-on", required=False) for n in names if n == "turn_on")]


def header_places(
    header: list[str], expected: Mapping[str, CsvColumn]
) -> tuple[dict[str, tuple[int, Factor]], list[str]]:
    """Return place and factor of each expected column, and the problems of the header."""
    places: dict[str, tuple[int, Factor]] = {}
    problems = []
    known = set[str]()
    for k, text in enumerate(header):
        match = re.fullmatch(r"([^\[\]]+?)\s*(?:\[(.*)\])?", text)
        name, unit = (match[1], match[2]) if match else (text, None)
        column = expected.get(name)
        if column is None:  # further columns are the laboratory's own
            if not match and (begins := text.split("[")[0].strip()) in expected:
                known.add(begins)
                problems.append(f"header '{text[:40]}': not of the form '{begins} [{expected[begins].unit}]'")
            continue
        known.add(name)
        if name in places:
            problems.append(f"column '{name}': appears twice")
        fits = ", ".join(units.fitting(column.unit)[:5])
        if unit is None and column.unit != "1":
            problems.append(f"column '{name}': no unit; write '{name} [{column.unit}]' (units that fit: {fits})")
            continue
        try:
            u = units.unit(unit or "1")
        except units.UnitError as error:
            problems.append(f"column '{name}': {error}")
            continue
        if u.exponents != units.unit(column.unit).exponents:
            problems.append(f"column '{name}': wrong unit [{unit}]: units that fit: {fits}")
            continue
        places[name] = (k, Factor(u.factor, u.offset))
    for c in expected.values():
        if c.required and c.name not in known:
            unit = f" [{c.unit}]" if c.unit != "1" else ""
            present = shorten(", ".join(header), 200)
            problems.append(f"column '{c.name}{unit}' is missing ({c.meaning}); columns of the file: {present}")
    return places, problems


def row_list(numbers: list[int]) -> str:
    """Return row numbers as "row 3" or "rows 3, 4 and 58 more (60 rows)"."""
    if len(numbers) == 1:
        return f"row {numbers[0]}"
    text = "rows " + ", ".join(map(str, numbers[:MAX_LISTED]))
    more = len(numbers) - MAX_LISTED
    return text + (f" and {more} more ({len(numbers)} rows)" if more > 0 else "")


def _numbers(name: str, cells: list[tuple[int, str]], whole: bool) -> tuple[np.ndarray[Any, Any], list[str]]:
    values: list[float] = []
    invalid: dict[str, list[tuple[int, str]]] = {}  # what is wrong -> rows and cells
    for n, text in cells:
        try:
            x = float(text)
        except ValueError:
            x = math.nan
        if not math.isfinite(x):
            comma = "; the decimal sign is a point" if DECIMAL_COMMA.fullmatch(text) else ""
            invalid.setdefault(f"is not a finite number{comma}" if text else "is empty", []).append((n, text))
        elif abs(x) > LARGEST:
            invalid.setdefault(f"is larger than {LARGEST:g}", []).append((n, text))
        elif whole and (x != math.floor(x) or abs(x) > 2.0**53):
            invalid.setdefault("must be an integer", []).append((n, text))
        values.append(x)
    problems = []
    for what, where in invalid.items():
        cell = {"must": where[0][1], "is e": "a cell"}.get(what[:4], f"'{where[0][1]}'")
        others = "" if len({text for _, text in where}) == 1 else f" (row {where[0][0]}, and others alike)"
        problems.append(f"{row_list([n for n, _ in where])}, column '{name}': {cell} {what}{others}")
    array = np.array(values)
    return (array.astype(np.int64) if whole and not problems else array), problems


def _repeats(columns: Mapping[str, np.ndarray[Any, Any]], numbers: list[int], time: str | None) -> list[str]:
    """Return which rows are doubled, else where the time does not increase; cells that are not numbers apart."""
    if not columns:
        return []
    good = np.all([np.isfinite(c) for c in columns.values()], axis=0).tolist()
    first_row: dict[tuple[float, ...], int] = {}
    twice = []
    for n, whole, row in zip(numbers, good, zip(*(c.tolist() for c in columns.values()), strict=True), strict=True):
        if whole and row in first_row:
            twice.append((n, first_row[row]))
        first_row.setdefault(row, n)
    if twice:
        return [
            f"{row_list([n for n, _ in twice])}: the same as row {twice[0][1]}" + (" and others" * (len(twice) > 1))
        ]
    if time is None or time not in columns:
        return []
    there = np.flatnonzero(np.isfinite(columns[time]))
    t, rows = columns[time][there], [numbers[k] for k in there.tolist()]
    back = np.flatnonzero(np.diff(t) <= 0.0)
    if not back.size:
        return []
    k = int(back[0])
    first = f"{time} = {t[k + 1]:g} s does not come after {t[k]:g} s (row {rows[k]})"
    return [f"{row_list([rows[j + 1] for j in back.tolist()])}: {first}" + (", and others alike" * (back.size > 1))]
