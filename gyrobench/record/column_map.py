"""Column maps: a laboratory's file of any layout as the bench's own CSV, row for row.

    encoding = "cp1252"                    # default utf-8; utf-16 ...
    delimiter = ";"                        # , ; tab or space
    decimal = ","
    skip = 9                               # lines above the names of the columns
    below = 1                              # lines between names and rows (units)
    names = false                          # no row of names: columns by their numbers
    table = "imu"                          # of a log that has several: a group, topic or sheet
    empty = "skip"                         # missing (default): see the reader; skip: the row; previous: as above it

    [columns.t_start]
    from = ["Datum", "Uhrzeit"]            # joined by a blank; a number: the column at that place, from 1
    time = "%d.%m.%Y %H:%M:%S"             # becomes seconds since the first row

    [columns.t_end]
    next = "t_start"                       # that column in the next row; last = "60s": length of the last one

    [columns.mean]
    from = "Strom / mA"
    unit = "mA"
    factor = -1                            # value in the unit = factor times what is written

    [set]                                  # as --set, which wins
    latitude = "48.1deg"

Clock times without a date go on after midnight.  The rows keep their numbers, so that messages name those of the file.
Not modelled: separators of thousands (refused), changes to summer time (times that run back are refused).
"""

from __future__ import annotations

import codecs
import csv
import io
import itertools
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from gyrobench import reading, units
from gyrobench.bench import UsageError, suggest_names
from gyrobench.boundary import faults_of
from gyrobench.record.clock_times import DATED, HALF_DAY, SET_BACK, length_between, long_readings, moment
from gyrobench.record.column_numbers import write_numbers
from gyrobench.record.csv_reader import HEAD_ROWS, DataError, row_list, thousands
from gyrobench.record.first_cells import COUNTS
from gyrobench.record.log_files import as_text, is_log
from gyrobench.record.row_faults import NOTHING
from gyrobench.record.text_cells import cells_of_file, without_mark

Empty = Literal["missing", "skip", "previous"]
#: a row of names is written above rows that have none
ONE_MORE = "the file has no row of names: rows are counted here as below one, one more than in the file"
COMMA = re.compile(r"[-+]?\d*,\d+([eE][-+]?\d+)?")


class MappedColumn(BaseModel):
    """Where a column of the bench comes from."""

    model_config = ConfigDict(extra="forbid", strict=True)

    source: str | int | list[str | int] = Field(default="", alias="from")
    unit: Annotated[str, AfterValidator(lambda unit: COUNTS.sub("1", unit))] = ""
    factor: float = 1.0
    time: str = ""
    next: str = ""
    last: str = ""
    empty: Empty | None = None

    @property
    def sources(self) -> list[str | int]:
        return self.source if isinstance(self.source, list) else [self.source]


class ColumnMap(BaseModel):
    """The keys of a map; see the module."""

    model_config = ConfigDict(extra="forbid", strict=True)

    encoding: str = "utf-8"
    delimiter: Literal[",", ";", "\t", " "] = ","
    decimal: Literal[".", ","] = "."
    skip: int = Field(default=0, ge=0)
    below: int = Field(default=0, ge=0)
    names: bool = True
    empty: Empty = "missing"
    table: str = ""  # of a log with several
    absent: list[str] = NOTHING  # texts of cells without a value
    columns: dict[str, MappedColumn]
    set: dict[str, str | int | float | bool] = {}

    @property
    def head(self) -> int:
        """Lines above the first row."""
        return self.skip + self.names + self.below

    def values(self) -> dict[str, str]:
        """Return what is set, as texts of --set."""
        return {k: str(v).lower() if isinstance(v, bool) else str(v) for k, v in self.set.items()}


def read_map(file: Path) -> ColumnMap:
    """Return the map of a TOML file.  Raises UsageError naming all that is wrong with it."""
    data = reading.toml(reading.read_text(file, UsageError), file, UsageError)
    try:
        found = ColumnMap.model_validate(data)
    except ValidationError as error:
        problems = faults_of(error, lambda place: MappedColumn if place[0] == "columns" else ColumnMap)
    else:
        problems = _contradictions(found)
        if not problems:
            return found
    raise UsageError("\n".join([f"{file}: not a column map:", *(f"  - {p}" for p in problems)]))


def _contradictions(found: ColumnMap) -> list[str]:
    problems = []
    try:
        codecs.lookup(found.encoding)
    except LookupError:
        problems.append(f"encoding = {found.encoding}: unknown; utf-8, cp1252, utf-16, latin-1 ...")
    if found.delimiter == found.decimal:
        problems.append(f"delimiter and decimal are both '{found.decimal}'")
    if not found.columns:
        problems.append("columns: none is named")
    if found.below and not found.names:
        problems.append("below: nothing stands between names and rows where names = false; count the lines in skip")
    for name, c in found.columns.items():
        if re.search(r"[\[\],\"]", name):
            problems.append(f"columns.{name}: a name of the bench has no unit, comma or quote")
        if bool(c.next) == (c.sources != [""]):
            problems.append(f"columns.{name}: either 'from' or 'next' is expected")
        if not found.names and any(isinstance(source, str) and source for source in c.sources):
            problems.append(f"columns.{name}: from: where names = false, the number of the column, from 1")
        of = found.columns.get(c.next)
        if c.next and (of is None or of.next):
            problems.append(f"columns.{name}: next = {c.next}: no column of this map with 'from'")
        elif c.last and (of is None or not (of.time or _is_time(of.unit))):
            problems.append(f"columns.{name}: last = {c.last}: only beside next = a column of times, in a unit of time")
        if len(c.sources) > 1 and not c.time:
            problems.append(f"columns.{name}: several columns are joined for a date and a clock time: time is missing")
        if c.time and (c.unit or c.factor != 1.0):
            problems.append(f"columns.{name}: time gives seconds; leave out unit and factor")
        for key, text in (("unit", c.unit), ("last", c.last)):
            try:
                if text and key == "unit":
                    units.unit(text)
                elif text:
                    units.parse_quantity(text, "s")
            except units.UnitError as error:
                problems.append(f"columns.{name}.{key}: {error}")
    dated = {n: (bool(DATED.search(c.time)), "%z" in c.time) for n, c in found.columns.items() if c.time}
    if len(set(dated.values())) > 1:
        problems.append(f"columns {', '.join(dated)}: all with a date or none, all with a zone (%z) or none")
    return problems


def _is_time(unit: str) -> bool:
    try:
        return units.same_dimension(unit or "1", "s")
    except units.UnitError:  # named already
        return True


@dataclass
class MappedRows:
    """Rows of a file under a map, as lines of the bench's CSV; what was wrong and what was left out.

    faults: what -> rows, each with the first text.  skipped, endless: rows left out.
    """

    map: ColumnMap
    file: Path
    faults: dict[str, tuple[str, list[int]]] = field(default_factory=dict)
    skipped: list[int] = field(default_factory=list)
    endless: list[int] = field(default_factory=list)  # without a row after it
    read: list[tuple[str, MappedColumn, Empty, list[int]]] = field(default_factory=list)  # with their places in a row
    origin: datetime | None = None
    before: dict[str, str] = field(default_factory=dict)  # last value of each column, as written
    clock: dict[str, float] = field(default_factory=dict)  # last time of each column, s
    lengths: dict[int, float] = field(default_factory=dict)  # of readings that last to the next row

    def lines(self, rows: Iterable[tuple[int, list[str]]]) -> Iterator[str]:
        """Yield a line for each line of the file: remarks, the header, then the rows, "#" for what is left out.

        rows: number and cells of each line.  Raises DataError for columns that the file does not have.
        """
        width = 0
        waiting: list[tuple[int, dict[str, str] | None]] = []  # a row whose end is in the next one, and lines left out
        for number, cells in rows:
            if number <= self.map.skip:
                yield self._remark(cells)
                continue
            if number == self.map.skip + 1:
                cells = without_mark(cells)
                width = len(cells)
                self._place(cells)
                yield _line([self._header(n, c.unit) for n, c in self.map.columns.items()])
                if self.map.names:
                    continue
            if number <= self.map.head or not any(cells) or cells[0].startswith("#"):
                waiting.append((number, None))
            else:
                row, left_out = self._row(number, cells, width)
                for before in waiting:
                    yield self._ended(*before, row)
                waiting = [(number, None if left_out else row)]
        for before in waiting:
            yield self._ended(*before, {})

    def _remark(self, cells: Sequence[str]) -> str:
        """Return a line above the names: its own comments state circumstances, all else is left out."""
        return self.map.delimiter.join(cells) if cells and cells[0].startswith("#") else "#"

    def _header(self, name: str, unit: str) -> str:
        c = self.map.columns[name]
        if c.time:
            unit = "s"
        if c.next:
            of = self.map.columns[c.next]
            unit = "s" if of.time else of.unit
        return f"{name} [{unit}]" if unit else name

    def _place(self, names: list[str]) -> None:
        problems = []
        for name, c in self.map.columns.items():
            if c.next:
                continue
            places: list[int] = []
            self.read.append((name, c, c.empty or self.map.empty, places))
            for source in c.sources:
                if isinstance(source, int):
                    if not 1 <= source <= len(names):
                        problems.append(f"columns.{name}: from = {source}: the file has {len(names)} columns")
                    places.append(source - 1)
                elif names.count(source) == 1:
                    places.append(names.index(source))
                else:
                    many = "several columns have this name: give its number" if source in names else "no such column"
                    near = f"; {suggest_names(source, [n for n in names if n])}" if source not in names else ""
                    problems.append(f"columns.{name}: from = '{source}': {many} in row {self.map.skip + 1}{near}")
        if problems:
            raise DataError(self.file, problems)

    def _row(self, number: int, cells: list[str], width: int) -> tuple[dict[str, str], bool]:
        """Return the values by column, "" where one is missing, and whether the row is left out."""
        while len(cells) > width and not cells[-1]:
            cells = cells[:-1]
        if len(cells) != width:
            of = "the names in " if self.map.names else ""
            self._fault(f"not the {width} cells of {of}row {self.map.skip + 1}", " ".join(cells), number)
            return {}, True
        row, left_out = {}, False
        for name, c, rule, places in self.read:
            parts = [cells[k] for k in places]
            text = "" if any(p in self.map.absent for p in parts) else " ".join(parts)
            if not text and rule == "previous":
                text = self.before.get(name, "")
            elif not text and rule == "skip":
                left_out = True
            self.before[name] = text
            row[name] = self._value(number, name, c, text) if text else ""
        if left_out:
            self.skipped.append(number)
        return row, left_out

    def _value(self, number: int, name: str, c: MappedColumn, text: str) -> str:
        if c.time:
            try:
                now = moment(text, c.time)
            except ValueError:
                self._fault(f"column '{name}': not of the form {c.time}", text, number)
                return text
            self.origin = self.origin or now
            t = (now - self.origin).total_seconds()
            if not DATED.search(c.time):
                last = self.clock.get(name, 0.0)
                while t < last - HALF_DAY:
                    t += 2.0 * HALF_DAY
                if t < last:
                    self._fault(
                        f"column '{name}': runs back, or after half a day and more: a date is needed", text, number
                    )
                self.clock[name] = max(t, last)
            return repr(t)
        if not text.isascii():
            text = text.replace("−", "-")
        if self.map.decimal == ",":
            if "." in text:
                self._fault(f"column '{name}': a point, where the decimal sign is a comma", text, number)
            if "," in text and COMMA.fullmatch(text):
                text = text.replace(",", ".")
        if c.factor == 1.0:
            return text
        try:
            return repr(float(text) * c.factor)
        except ValueError:
            return text

    def _ended(self, number: int, row: Mapping[str, str] | None, following: Mapping[str, str]) -> str:
        """Return the line of a row, with the values that the next one has; of None one that is left out."""
        left_out = "#" if len(self.map.columns) > 1 else ""  # beside one column a remark would be a cell
        if row is None:
            return left_out
        cells = []
        for name, c in self.map.columns.items():
            if not c.next:
                cells.append(row[name])
            elif following:
                cells.append(following[c.next])
                self.lengths[number] = length = length_between(row[c.next], following[c.next])
                if length <= 0.0:
                    timed = self.map.columns[c.next].time
                    after = self.before[c.next] + SET_BACK if timed else following[c.next]
                    self._fault(
                        f"column '{c.next}': the next row has {after}", row[c.next] + " s" * bool(timed), number
                    )
            elif c.last:
                cells.append(self._last(c, row[c.next]))
            else:
                self.endless.append(number)
                return left_out
        return _line(cells)

    def _last(self, c: MappedColumn, start: str) -> str:
        unit = self.map.columns[c.next].unit or "s"
        try:
            return repr(float(start) + units.convert(units.parse_quantity(c.last, "s"), "s", unit))
        except ValueError:  # the reader names the start
            return ""

    def _fault(self, what: str, text: str, row: int) -> None:
        self.faults.setdefault(what, (text, []))[1].append(row)

    def problems(self, of_reader: Sequence[str] = ()) -> list[str]:
        """Return what was wrong, each with its rows, before what the reader of the lines found."""
        own = [f"{row_list(rows)}: '{text[:60]}': {what}" for what, (text, rows) in self.faults.items()]
        return [*own, *of_reader, *([ONE_MORE] if of_reader and not self.map.names else [])]

    def notes(self) -> list[str]:
        """Return what was left out, for the report."""
        said = [f"Left out for an empty cell: {row_list(self.skipped)}."] if self.skipped else []
        said += long_readings(self.lengths)
        last = "Left out, since no row after it tells its end"
        return said + ([f'{last}: {row_list(self.endless)}; last = "60s" in the map gives it.'] if self.endless else [])


def _line(cells: Sequence[str]) -> str:
    line = ",".join(cells)
    if line.count(",") == len(cells) - 1 and '"' not in line:
        return line
    text = io.StringIO()
    csv.writer(text, lineterminator="").writerow(cells)
    return text.getvalue()


def translate(file: Path, columns: ColumnMap, to: Path) -> MappedRows:
    """Write a file under its map as the bench's CSV, and return what was wrong and left out.  Raises DataError."""
    done = MappedRows(columns, file)
    if columns.table and not is_log(file):
        raise DataError(file, [f"table = '{columns.table}': a text file has one table; leave it out"])
    text = as_text(file, columns.table) if is_log(file) else file
    if not _quick(text, done, to):
        done = MappedRows(columns, file)
        with to.open("w", encoding="utf-8", newline="\n") as out:
            for line in done.lines(cells_of_file(text, columns.encoding, columns.delimiter)):
                out.write(line + "\n")
    if not done.read:
        raise DataError(file, [f"no names of columns in row {columns.skip + 1} (skip = {columns.skip})"])
    lines = cells_of_file(text, columns.encoding, columns.delimiter)
    rows = [cells for _, cells in itertools.islice(lines, columns.head, columns.head + HEAD_ROWS)]
    numbers = [(name, places[0]) for name, c, _, places in done.read if not c.time]
    if wrong := [p for name, k in numbers for p in thousands(name, (r[k] for r in rows if len(r) > k))]:
        raise DataError(file, wrong)
    return done


def _quick(file: Path, done: MappedRows, to: Path) -> bool:
    """Write a file of plain numbers under its map at once; return False, having written what is written anew, else."""
    m = done.map
    if any(c.time or c.next for c in m.columns.values()):
        return False
    above = m.skip + 1 + m.below  # lines of the CSV above its rows
    with to.open("wb") as out:
        lines = done.lines(itertools.islice(cells_of_file(file, m.encoding, m.delimiter), above))
        for line in itertools.islice(lines, above):
            out.write(line.encode() + b"\n")
        places = [places[0] for _, _, _, places in done.read]
        factors = [c.factor for _, c, _, _ in done.read]
        layout = {"encoding": m.encoding, "delimiter": m.delimiter, "decimal": m.decimal}
        return write_numbers(file, m.head, places, factors, out, **layout)
