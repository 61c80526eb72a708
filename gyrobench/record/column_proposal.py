"""A first column map of a laboratory's text file: its layout, and which of its columns is which of a test.

Found from the text alone: encoding, separator, decimal sign, the row of names (the one above the numbers), a row of
units below it, dates and clock times, units in or below the names.  Which column is which follows from names (English,
German) and dimensions; what a name does not tell (signs, factors, which of two currents) is for the reader to check.
"""

from __future__ import annotations

import codecs
import json
import math
import re
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from gyrobench import units
from gyrobench.bench import UsageError
from gyrobench.record import first_cells
from gyrobench.record.clock_times import moment
from gyrobench.record.csv_reader import DECIMAL_COMMA, regular
from gyrobench.record.row_faults import NOTHING
from gyrobench.record.text_cells import BINARY, cells_of_file, without_mark

SAMPLE = 1 << 22  # bytes that are looked at
FEW_KINDS = 6  # of rows that are told by a word
IN_TURN = 20  # rows of another width that are no head of a file
LONG = 2000  # rows from which on a file is taken for time series
DAYS = (
    "%d.%m.%Y", "%Y-%m-%d", "%d.%m.%y", "%Y/%m/%d", "%d/%m/%Y", "%m/%d/%Y", "%d-%b-%Y", "%d %b %Y", "%d-%b-%y",
)  # fmt: skip
CLOCKS = (
    "%H:%M:%S", "%H:%M:%S.%f", "%H:%M:%S,%f", "%H:%M", "%I:%M:%S %p", "%I:%M:%S.%f %p", "%I:%M %p", "%H:%M:%S%z",
    "%H:%M:%S.%f%z",
)  # fmt: skip
FORMATS = (*(f"{d}{joint}{c}" for d in DAYS for joint in (" ", "T") for c in CLOCKS), *DAYS, *CLOCKS)
STAMP = r"(\d{1,2}[ -][A-Za-z]{3}[ -])?\d[\d.:,/T -]*(Z|[+-]\d\d:?\d\d|[AaPp][Mm])?"
GROUPED = r"\d{1,3}([.,'’ \u00a0\u202f]\d{3})+([.,]\d*)?"  # with separators of thousands: the reader refuses them
NUMBER = re.compile(r"[-+−]?(\d+([.,]\d*)?|[.,]\d+)([eE][-+]?\d+)?")
WITH_UNIT = re.compile(r"(.*?)\s*(?:\[([^\]]*)\]|\(([^)]*)\)|(?:/|\bin)\s+(\S+))\s*")
#: how a row of units writes the form of a date or clock time: TT.MM.JJJJ hh:mm:ss
FORM_OF_TIME = re.compile(r"(?i)([dtmjyhs]{1,4})([.:/, -]+[dtmjyhsf]{1,4})+")
SPELLED = {
    "grad": "deg", "degree": "deg", "degrees": "deg", "sec": "s", "sek": "s", "second": "s", "seconds": "s",
    "sekunde": "s", "sekunden": "s", "minutes": "min", "minuten": "min", "std": "h", "hours": "h", "stunden": "h",
    "c": "degC", "°c": "degC", "volt": "V", "volts": "V", "ampere": "A", "milliampere": "mA", "kelvin": "K",
}  # fmt: skip
WORD = re.compile(r"[^\W\d_]{3,}")
#: end of a name without a unit beside it, as loggers write it: gx_dps, ts_us -> unit
ENDINGS = {
    "dps": "dps", "mdps": "mdps", "degs": "deg/s", "deg_s": "deg/s", "rads": "rad/s", "rad_s": "rad/s", "degh": "deg/h",
    "deg_h": "deg/h", "g": "g", "mg": "mg", "ms2": "m/s2", "mps2": "m/s2", "m_s2": "m/s2",
    "C": "degC", "c": "degC", "celsius": "degC", "celcius": "degC", "degC": "degC", "degc": "degC",
    "s": "s", "sec": "s", "ms": "ms", "us": "us", "ns": "ns",
}  # fmt: skip
#: what messages of ROS and PX4 call a quantity -> unit of their definition
#: (MATLAB leaves out the points: fieldangular_velocityx), their covariances apart
MESSAGES = {
    r"(.*\.|field)?angular_velocity[._]?[xyz]\d*|gyro_rad": "rad/s",
    r"(.*\.|field)?linear_acceleration[._]?[xyz]\d*": "m/s2",
}
#: first cell of each row of an instrument that writes sentences -> its columns
SENTENCES = {
    "$VNYMR": ("", "yaw", "pitch", "roll", *(f"mag_{a}" for a in "xyz"), *(f"acc_{a} [m/s2]" for a in "xyz"),
               *(f"gyro_{a} [rad/s]" for a in "xyz")),
}  # fmt: skip
NO_NAMES = "names = false  # no row of names: columns by their numbers"
ENDING = re.compile(rf"(.*?[^_ .])[_ .]({'|'.join(sorted(ENDINGS, key=len, reverse=True))})")
#: units whose sign means something else elsewhere (mg is milligauss, too) -> names that they count beside
SAID = {"degC": r".*temp.*", **dict.fromkeys(("g", "mg"), r"(.*acc|.*beschl|[af]_?[xyz]).*")}
COUNTER = r"n|nr|no|num|id|index|.*(sample|count|seq|row|packet|frame|number).*"
CLOCK = "((sys(tem)?|gps|log|device|sensor|unix|utc|epoch)_?)"
#: name of the bench, or its beginning -> what laboratories call it
CALLED = {
    "t_start": r"t_?start|start|beginn|begin|von|from|zeit.*|time.*|datum.*|date.*|uhrzeit|t",
    "t_end": r"t_?end|ende?|bis|stop|to|until",
    "time": rf"{CLOCK}?time.*|.*stamp(_.*)?|zeit.*|datum.*|date.*|uhrzeit|x_value|ts?|seconds.*|elapsed.*",
    "phase": r"phase.*|lage.*|abschnitt.*|stellung.*",
    "day": r"day|tag",
    "mean": r"mean.*|mittel.*|strom.*|current.*|i|spannung.*|voltage.*",
    "current": r"strom.*|current.*|i",
    "voltage": r"spannung.*|voltage.*|u",
    "std": r"std.*|streuung.*|standardabw.*|sigma.*",
    "angle": r"angle.*|winkel.*",
    "position": r"position.*|stellung.*|winkel.*",
    "rate": r"rate.*|dreh.*|omega.*",
    "flag": r"flag.*|g[uü]ltig.*",
    "n": r"n|anzahl.*|count.*",
}  # fmt: skip
CALLED |= {f"g{a}": rf"(gyro\w*|gyr|g|omega|angular\w*|w|w_rs_s|rate|dreh\w*)_?{a}" for a in "xyz"}
CALLED |= {f"a{a}": rf"(acc\w*|linear_acc\w*|a|a_rs_s|f|beschl\w*)_?{a}" for a in "xyz"}


@dataclass(frozen=True)
class FileColumn:
    """A column of the file, or a date and a clock time side by side."""

    sources: tuple[str | int, ...]
    name: str
    unit: str  # "": none, or one that is unknown
    written: str  # unit as it is written
    time: str  # format
    empty: int
    rises: bool = False  # from row to row
    shown: str = ""  # first values of a column without a name
    exchangeable: bool = False  # day and month of its dates fit the other way round, too
    level: float = math.nan  # median of its first numbers
    whole: bool = False  # its first numbers have no fractions
    of_times: str = "s"  # unit that it may be in, if it is a time

    @property
    def counts(self) -> bool:
        """Return whether it numbers the rows, by its name."""
        return bool(re.fullmatch(COUNTER, _plain(self.name)))

    @property
    def exponents(self) -> object:
        return units.unit("s" if self.time else self.unit or "1").exponents


@dataclass(frozen=True)
class FileLayout:
    """Layout of a text file, as its text shows it."""

    encoding: str
    delimiter: str
    decimal: str
    skip: int
    below: int
    rows: int
    columns: tuple[FileColumn, ...]
    names: bool = True  # it has a row of names

    def keys(self, text: bool = True) -> list[str]:
        """Return the lines of a column map that state the layout; text: of a text file, no log."""
        written = {"encoding": self.encoding, "delimiter": self.delimiter, "decimal": self.decimal}
        return [
            *(f"{key} = {json.dumps(value)}" for key, value in written.items() if text),
            f"skip = {self.skip}  # lines above the {'names of the columns' if self.names else 'rows'}",
            f"below = {self.below}  # lines between names and rows" if self.names else NO_NAMES,
        ]


def find_encoding(data: bytes) -> str:
    """Return the likely encoding of a text: by its mark, UTF-8 where it is that, UTF-16 by zeros, else cp1252."""
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    if data[:400].count(0) > 0.3 * len(data[:400]):
        return "utf-16-le" if data[:400:2].count(0) < data[1:400:2].count(0) else "utf-16-be"
    for name in ("utf-8", "cp1252"):
        with suppress(UnicodeDecodeError):
            codecs.getincrementaldecoder(name)().decode(data)
            return name
    return "latin-1"


def _share(cells: Sequence[str]) -> float:
    """Return which part of the cells that are not empty are numbers, dates or clock times."""
    there = [c for c in cells if c not in NOTHING]
    like = [c for c in there if NUMBER.fullmatch(c) or re.fullmatch(rf"{STAMP}|[-+−]?{GROUPED}", c)]
    return len(like) / len(there) if there else 0.0


def find_layout(file: Path) -> FileLayout:
    """Return the layout of a text file.  Raises UsageError where there is no table of numbers, or names that are not as
    many as its columns."""
    with regular(file).open("rb") as data:
        begin = data.read(SAMPLE)
    if begin.startswith(BINARY):
        raise UsageError(f"{file}: not a text file; save the table as CSV")
    encoding = find_encoding(begin)
    best: tuple[float, str, int, list[list[str]], list[int]] | None = None
    for delimiter in (";", "\t", ",", " "):
        lines = []
        for number, cells in cells_of_file(file, encoding, delimiter):
            lines.append(cells)
            if number > LONG + 200:
                break
        shares = [_share(c) if len(c) > (delimiter != ",") else 0.0 for c in lines]
        numeric = [k for k, share in enumerate(shares) if share > 0.5]
        width = Counter(len(lines[k]) for k in numeric).most_common(1)[0][0] if numeric else 0
        good = [k for k in numeric if len(lines[k]) == width]
        score = sum(shares[k] for k in good) * (1.0 if width > 1 else 0.5)
        if good and (best is None or score > best[0] * 1.0001):
            start = _first_row(good, lines)
            best = score, delimiter, start, lines, numeric
    if best is None:
        raise UsageError(f"{file}: no table of numbers with a row of names above it")
    _, delimiter, start, lines, numeric = best
    width = len(lines[start])
    others = [k for k in numeric if len(lines[k]) != width]
    alike = [k for k in numeric if len(lines[k]) == width]
    if 2 * len(others) > max(len(alike), IN_TURN):
        shown = "; ".join(f"row {k + 1}: '{' '.join(lines[k])[:40]}'" for k in sorted((alike[0], others[0])))
        raise UsageError(f"{file}: rows of two kinds in turn ({shown}): write what belongs together in one row")
    at, of_units = _rows_above(lines, start, width)
    names = without_mark(lines[at]) if at >= 0 else []
    if _share(names) > 0.0 or len(names) not in (width, width + 1):  # one more: a remark that no row has
        if len(names) == width - 1 > 1 and not _share(names):
            raise UsageError(
                f"{file}: {width} columns of numbers from row {start + 1} on, without a row of as many names above it: "
                "write that row, with the same separator"
            )
        names = []  # a title, or nothing
    rows = [c for c in lines[start:] if len(c) == width]
    if kinds := _kinds([r[0] for r in rows]):
        raise UsageError(
            f"{file}: rows of several kinds in turn ({', '.join(kinds)}): write what belongs together in one row, or "
            "each kind into a file of its own"
        )
    comma = delimiter != "," and any(DECIMAL_COMMA.fullmatch(c) for r in rows for c in r)
    numbered = len(names) != width
    written = SENTENCES.get(rows[-1][0], ())
    names = names[:width] or (list(written) if len(written) == width else [""] * width)
    columns = _columns(names, lines[of_units] if of_units >= 0 else [], rows, numbered)
    skip, below = (start, 0) if numbered else (at, start - at - 1)
    decimal = "," if comma else "."
    return FileLayout(encoding, delimiter, decimal, skip, below, len(rows), columns, not numbered)


def _kinds(words: Sequence[str]) -> list[str]:
    """Return the words of a first column that says of which of some kinds each row is; [] of any other column."""
    kinds = Counter(words)
    turns = sum(a != b for a, b in pairwise(words))
    return sorted(kinds) if len(kinds) <= FEW_KINDS and 3 * turns > len(words) > 9 and not _share([*kinds]) else []


def _first_row(good: Sequence[int], lines: Sequence[Sequence[str]]) -> int:
    """Return the first row of numbers: of three with numbers where most rows have them, or above those with half."""
    usual = Counter(tuple(_share([c]) > 0.0 for c in lines[k]) for k in good).most_common(1)[0][0]
    like = [
        k for k in good if all(c in NOTHING or _share([c]) > 0.0 for c, u in zip(lines[k], usual, strict=True) if u)
    ]
    filled = [k for k, cells in enumerate(lines) if any(cells)]  # rows may have an empty line between them
    place = {k: a for a, k in enumerate(filled)}
    after = [[place[j] - place[k] for j in like[a + 1 : a + 3]] for a, k in enumerate(like)]
    start = next((k for k, steps in zip(like, after, strict=True) if steps in ([], [1], [1, 2])), like[0])
    first = usual.index(True)
    for k in reversed(filled[: place[start]]):
        if len(lines[k]) != len(usual) or _share(lines[k]) < 0.5 or not _share([lines[k][first]]):
            break
        start = k
    return start


def _rows_above(lines: Sequence[list[str]], start: int, width: int) -> tuple[int, int]:
    """Return the row of names above the first row of numbers, and that of units, -1 for none.

    Names stand above units, which may have a row of remarks below them.
    """
    above = [k for k in range(start - 1, max(start - 6, -1), -1) if any(lines[k])]
    for k, over in pairwise(above[:4]):
        if _are_units(lines[k]) and all(len(without_mark(lines[r])) == width for r in (k, over)):
            return over, k
    return (above[0] if above else -1), -1


def _read_unit(text: str) -> str | None:
    """Return the unit of a text, None for one that is unknown."""
    text = text.strip("[]() ")
    text = text.rstrip(".")  # Sek., deg.
    text = SPELLED.get(text.casefold(), text)
    if text in ("", "-"):
        return ""
    for one in (text, WORD.sub(lambda word: SPELLED.get(word[0].casefold(), word[0]), text)):  # Grad/s, °/Std
        with suppress(units.UnitError):
            units.unit(one)
            return one
    return None


def _unit_at_end(text: str) -> tuple[str, str]:
    """Return a name, and the unit that it ends with, "" for none: one that the name does not contradict."""
    if known := next((u for pattern, u in MESSAGES.items() if re.fullmatch(pattern, text)), ""):
        return text.removesuffix("_rad"), known
    if match := ENDING.fullmatch(text):
        name, unit = match[1], ENDINGS[match[2]]
        said = CALLED["time"] if units.same_dimension(unit, "s") else SAID.get(unit, ".*")
        if re.fullmatch(said, name, re.IGNORECASE):
            return name, unit
    return text, ""


def _are_units(cells: Sequence[str]) -> bool:
    found = [_read_unit("" if FORM_OF_TIME.fullmatch(c) else c) for c in cells]
    return _share(cells) <= 0.5 and any(found) and all(f is not None for f in found)


def _columns(
    names: Sequence[str], below: Sequence[str], rows: Sequence[Sequence[str]], numbered: bool
) -> tuple[FileColumn, ...]:
    found = []
    for k, text in enumerate(names):
        index = re.fullmatch(r"(.*)\[([012])\]", text)  # a vector: gyro_rad[0]
        match = None if index else WITH_UNIT.fullmatch(text)
        written = next((g for g in match.groups()[1:] if g), "") if match else ""
        name = index[1] if index else (match[1] if match and match[1] else text).lstrip("#% ").removeprefix("field.")
        if below:
            written = below[k] or written
        elif not written:
            name, written = _unit_at_end(name)
        name += f"_{'xyz'[int(index[2])]}" if index else ""
        cells = [r[k] for r in rows if r[k] not in NOTHING]
        dated = cells and not NUMBER.fullmatch(cells[0])  # no form of a date or clock time is a number
        time = next((f for f in FORMATS if dated and all(_fits(c, f) for c in cells[:200])), "")
        if not (written or time) and re.fullmatch(CALLED["time"], _plain(name)):
            written = first_cells.epoch(cells)
        unit = "" if time else _read_unit(written) or ""
        source: str | int = text if names.count(text) == 1 and text and not numbered else k + 1
        shown = "" if name and not re.fullmatch(r"column_\d+", name) else ", ".join(cells[:3])
        empty, name = len(rows) - len(cells), name or f"column_{k + 1}"
        other = time.replace("%d/%m", "%m/%d")  # the one that is tried later
        either = time != other and all(_fits(c, other) for c in cells[:200])
        of = (first_cells.rises(cells), shown, either, first_cells.level(cells), first_cells.whole(cells))
        found.append(FileColumn((source,), name, unit, written, time, empty, *of, first_cells.unit_of_times(cells)))
    joined: list[FileColumn] = []
    for c in found:
        last = joined[-1] if joined else None
        if last is not None and last.time in DAYS and c.time in CLOCKS:
            sources, time = (*last.sources, *c.sources), f"{last.time} {c.time}"
            joined[-1] = FileColumn(sources, last.name, "", "", time, c.empty, exchangeable=last.exchangeable)
        else:
            joined.append(c)
    return tuple(joined)


def _fits(text: str, form: str) -> bool:
    with suppress(ValueError):
        moment(text, form)
        return True
    return False


def _plain(name: str) -> str:
    return re.sub(r"[\s_.-]+", "_", name.strip()).casefold()


def _likeness(wanted: str, unit: str, column: FileColumn) -> int:
    """Return how well a column of the file fits one of the bench: 0 not at all, 1 by its dimension only."""
    if (column.unit or column.time) and column.exponents != units.unit(unit or "1").exponents:
        return 0
    if _plain(column.name) == wanted:
        return 4
    base = next((b for b in (wanted, wanted.rsplit("_", 1)[0], wanted.split("_")[0]) if b in CALLED), "")
    if base and re.fullmatch(CALLED[base], _plain(column.name)):
        ending = wanted[len(base) :]
        return 3 if not ending or _plain(column.name).endswith(ending) else 0
    if column.unit and re.fullmatch(r"[ag][xyz]", wanted) and _plain(column.name) in "xyz":
        return 2 * (_plain(column.name) == wanted[1])  # of a file of one triad, whose unit tells which
    return 1 if column.unit and unit not in ("", "1", "s") else 0


def match_columns(wanted: Sequence[tuple[str, str]], layout: FileLayout) -> dict[str, FileColumn]:
    """Return name of the bench -> column of the file: the best fits first, those by dimension where they are alone."""
    scores = sorted(
        ((_likeness(n, u, c), -a, -b) for a, (n, u) in enumerate(wanted) for b, c in enumerate(layout.columns)),
        reverse=True,
    )
    found: dict[str, FileColumn] = {}
    for score, a, b in scores:
        name, column = wanted[-a][0], layout.columns[-b]
        if not score or name in found or column in found.values():
            continue
        alone = sum(s == 1 and i == a for s, i, _ in scores) == 1 == sum(s == 1 and i == b for s, _, i in scores)
        if score > 1 or alone:
            found[name] = column
    return found


def series_columns(wanted: Sequence[tuple[str, str]]) -> list[tuple[str, str]]:
    """Return the columns of time series for those of windows: time, current for mean, one angle for its two."""
    out: dict[str, str] = {"time": "s"}
    for name, unit in wanted:
        if name in ("t_start", "t_end", "n") or name.startswith(("std", "flagged")):
            continue
        kind = {"A": "current", "V": "voltage"}.get(units.unit(unit or "1").dimension.split("/")[0], "mean")
        if units.same_dimension(unit or "1", "V"):
            kind = "voltage"
        out[re.sub(r"_(start|end)$", "", name.replace("mean", kind))] = unit
    return list(out.items())
