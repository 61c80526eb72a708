"""Measured data: a laboratory's CSV file as columns in SI.

    # latitude = 45.75deg
    # instrument = gyro 17
    phase,t_start [s],t_end [s],angle_start [deg],angle_end [deg],mean [mA]
    1,0,60,0,2.5,0.1432

The first line that is not a comment is the header: ``name [unit]`` for each column, no unit for pure numbers.  Lines
``# key = value`` give circumstances.  Comma, semicolon or tab separates; the decimal sign is a point.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from textwrap import shorten
from typing import Any

import numpy as np

from gyrobench import units
from gyrobench.errors import GyrobenchError

MAX_LISTED = 8  # problems of one kind listed before "and n more"


class DataError(GyrobenchError):
    """Data that cannot be reduced; ``problems`` names for each problem its place and the remedy."""

    def __init__(self, file: Path | str, problems: list[str]) -> None:
        self.problems = problems
        super().__init__("\n".join([f"{file}: not usable:", *(f"  - {p}" for p in problems)]))


@dataclass(frozen=True)
class Column:
    """A column that is expected: ``unit`` is the SI unit it is converted to ("1": a pure number)."""

    name: str
    unit: str
    meaning: str = ""
    required: bool = True
    whole: bool = False


WINDOW_COLUMNS = (
    Column("phase", "1", "phase of the plan, from 1", whole=True),
    Column("t_start", "s", "start of the window"),
    Column("t_end", "s", "end of the window"),
    Column("angle_start", "rad", "table angle at the start, cumulative"),
    Column("angle_end", "rad", "table angle at the end, cumulative"),
    Column("mean", "A", "mean torquer current"),
    Column("std", "A", "standard deviation of the samples", required=False),
    Column("n", "1", "number of samples", required=False, whole=True),
    Column("flagged", "1", "suspect samples", required=False, whole=True),
)


def read_lines(file: Path) -> list[str]:
    """Return the lines of a text file.  Raises DataError for one that is not UTF-8, as from spreadsheets on Windows."""
    data = Path(file).read_bytes()
    try:
        return data.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        row = data[: error.start].count(b"\n") + 1
        raise DataError(file, [f"row {row}: not UTF-8 text; save the table as CSV (UTF-8)"]) from None


def read_measured(
    file: Path, columns: tuple[Column, ...] = WINDOW_COLUMNS, time: str | None = "t_start"
) -> tuple[dict[str, np.ndarray[Any, Any]], dict[str, str]]:
    """Return the columns of a CSV file in SI, and its comments.

    time: the column that must increase strictly (None: none).  Raises DataError naming missing and doubled columns,
    missing or wrong units, cells that are not a finite number, doubled rows and times that do not increase, with
    the row numbers as an editor counts them.
    """
    lines = read_lines(file)
    meta: dict[str, str] = {}
    table: list[tuple[int, str]] = []
    for number, line in enumerate(lines, 1):
        if line.lstrip().startswith("#"):
            key, sign, value = line.lstrip("# \t").partition("=")
            if sign:
                meta[key.strip()] = value.strip()
        elif line.strip():
            table.append((number, line))
    if not table:
        raise DataError(file, ["no header line"])
    head = table[0][1]
    delimiter = max(",;\t", key=head.count)
    header = [h.strip() for h in next(csv.reader([head], delimiter=delimiter))]
    rows = [(n, [c.strip() for c in next(csv.reader([line], delimiter=delimiter))]) for n, line in table[1:]]
    expected = {c.name: c for c in columns}
    factors, problems = _header(header, expected)
    incomplete = [f"row {n}: {len(r)} cells, the header has {len(header)}" for n, r in rows if len(r) != len(header)]
    if len(incomplete) > MAX_LISTED:
        incomplete = [*incomplete[:MAX_LISTED], f"and {len(incomplete) - MAX_LISTED} more rows"]
    problems += incomplete
    if not rows:
        problems.append("no rows below the header")
    if problems:
        raise DataError(file, problems)
    columns_si = {}
    for name, (k, factor, offset) in factors.items():
        values, invalid = _numbers(name, [(n, r[k]) for n, r in rows], expected[name].whole)
        columns_si[name] = values if expected[name].whole else values * factor + offset if offset else values * factor
        problems += invalid
    if not problems:
        problems += _repeats(columns_si, [n for n, _ in rows], time)
    if problems:
        raise DataError(file, problems)
    return columns_si, meta


def _header(header: list[str], expected: Mapping[str, Column]) -> tuple[dict[str, tuple[int, float, float]], list[str]]:
    """Return place, factor and offset of each expected column, and the problems of the header."""
    places: dict[str, tuple[int, float, float]] = {}
    problems = []
    for k, text in enumerate(header):
        match = re.fullmatch(r"([^\[\]]+?)\s*(?:\[(.*)\])?", text)
        name, unit = (match[1], match[2]) if match else (text, None)
        column = expected.get(name)
        if column is None:
            continue  # further columns are the laboratory's own
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
        places[name] = (k, u.factor, u.offset)
    known = {t.split("[")[0].strip() for t in header}
    for c in expected.values():
        if c.required and c.name not in known:
            unit = f" [{c.unit}]" if c.unit != "1" else ""
            present = shorten(", ".join(header), 200)
            problems.append(f"column '{c.name}{unit}' is missing ({c.meaning}); columns of the file: {present}")
    return places, problems


def _numbers(name: str, cells: list[tuple[int, str]], whole: bool) -> tuple[np.ndarray[Any, Any], list[str]]:
    values, problems = [], []
    for n, text in cells:
        try:
            x = float(text)
        except ValueError:
            x = math.nan
        if not math.isfinite(x):
            comma = "; the decimal sign is a point" if re.fullmatch(r"[-+]?\d*,\d+([eE][-+]?\d+)?", text) else ""
            problems.append(f"row {n}, column '{name}': '{text}' is not a finite number{comma}")
        elif whole and x != math.floor(x):
            problems.append(f"row {n}, column '{name}': {text} must be an integer")
        values.append(x)
    if len(problems) > MAX_LISTED:
        problems = [*problems[:MAX_LISTED], f"column '{name}': and {len(problems) - MAX_LISTED} more"]
    array = np.array(values)
    return (array.astype(np.int64) if whole and not problems else array), problems


def _repeats(columns: Mapping[str, np.ndarray[Any, Any]], numbers: list[int], time: str | None) -> list[str]:
    problems: list[str] = []
    first_row: dict[tuple[float, ...], int] = {}
    for n, row in zip(numbers, zip(*(c.tolist() for c in columns.values()), strict=True), strict=True):
        if row in first_row:
            problems.append(f"row {n}: the same as row {first_row[row]}")
        first_row.setdefault(row, n)
    if time is not None and time in columns and not problems:
        t = columns[time]
        for k in np.flatnonzero(np.diff(t) <= 0.0)[:MAX_LISTED]:
            problems.append(
                f"row {numbers[k + 1]}: {time} = {t[k + 1]:g} s does not come after {t[k]:g} s (row {numbers[k]})"
            )
    return problems
