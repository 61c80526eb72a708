"""Time series of a laboratory (CSV at any rate) as averaging windows, a block of rows at a time.

    time [s],phase,angle [deg],current [mA],temperature [degC]

Windows are formed as the part ``sampler`` forms them: counted from the first sample of a phase, boundaries at the
nearest sample (windows by time) or at the first sample that has reached them (windows by angle), mean by trapezoids.
A row with an empty or non-finite cell is left out.  Where rows are missing (a step in time above GAP of the usual one)
there is a gap; a window that holds one is dropped and counted, never averaged over fewer samples.

Memory: blocks of BLOCK bytes and the windows, whatever the length of the file.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.record.circumstances import statement
from gyrobench.record.csv_reader import CsvColumn, DataError, Head, check_utf8, for_arrow, header_places
from gyrobench.record.row_faults import NOTHING, ROWS, grouped, row_faults
from gyrobench.record.sampling import Successive

Block = Mapping[str, Array]
BLOCK = 1 << 20  # bytes of text read at a time
GAP = 1.5  # usual steps; a longer one is a gap
EVEN, FARTHER, WRAPPED = 0.1, 1.6, 20.0  # of the usual rate of a table: scatter, of samples lost, of a turn begun anew
MISSED = 3  # places of which is spoken


@dataclass(frozen=True)
class Averaging:
    """Windows of a phase: their length (s, or rad ``by_angle``) and at most how many; 0: all that fit."""

    window: float
    by_angle: bool = False
    most: int = 0


def read_blocks(file: Path, head: Head, columns: Sequence[CsvColumn]) -> Iterator[dict[str, Array]]:
    """Yield the columns in SI, missing cells as NaN.  Raises DataError with the number of rows that are not numbers."""
    import pyarrow as pa

    places, problems = header_places(head.names, {c.name: c for c in columns})
    problems += grouped(file, head, places)
    if problems:
        raise DataError(file, problems + row_faults(file, head, places, most=ROWS))
    check_utf8(file)  # pyarrow would print the failure of its own decoding
    wrong: list[str] = []

    def incomplete(row: Any) -> str:
        if not row.text.lstrip().startswith("#") or ((s := statement(row.text, 0)) and not s.remark):
            wrong.append(row.text)
        return "skip"

    taken = {n: f"{k}" for n, (k, _) in places.items()}
    rows = 0
    try:
        for batch in _open(file, head, list(taken.values()), pa.float64(), incomplete):
            rows += batch.num_rows
            yield {n: places[n][1].to_si(_floats(batch.column(c))) for n, c in taken.items()}
    except pa.ArrowInvalid as error:
        ended = file.stat().st_size < BLOCK and not rows  # a header without an end of its line
        problems = row_faults(file, head, places)  # [] where it is not of the cells
        raise DataError(file, problems or ["no rows below the header" if ended else str(error)]) from None
    if wrong:
        raise DataError(file, row_faults(file, head, places))
    if not rows:
        raise DataError(file, ["no rows below the header"])


def _open(file: Path, head: Head, wanted: list[str], kind: Any, invalid: Callable[[Any], str]) -> Any:
    from pyarrow import csv as arrow

    names = [f"{k}" for k in range(len(head.names))]
    convert = arrow.ConvertOptions(
        column_types=dict.fromkeys(wanted, kind), include_columns=wanted, null_values=NOTHING,
        decimal_point="," if head.decimal_comma else ".", strings_can_be_null=True,
    )  # fmt: skip
    return arrow.open_csv(
        for_arrow(file),
        arrow.ReadOptions(skip_rows=head.line, column_names=names, block_size=BLOCK),
        arrow.ParseOptions(  # an empty line is a row of one empty cell, or none
            delimiter=head.delimiter, invalid_row_handler=invalid, ignore_empty_lines=len(head.names) > 1
        ),
        convert,
    )


def _floats(column: Any) -> Array:
    values: Array = column.to_numpy(zero_copy_only=False)
    return np.where(np.isfinite(values), values, np.nan)


@dataclass
class Averager:
    """Windows of time series that come in blocks; see the module.

    signals: columns that are averaged.  optional: those that may lack values, averaged over the values there are.
    angles: columns of which the values at both ends are kept; ``angles[0]`` is what windows by angle are counted in.
    keys: columns of whole numbers that name the phase; a row where one is 0 or empty belongs to none.
    """

    signals: Sequence[str]
    angles: Sequence[str]
    keys: Sequence[str]
    averaging: Callable[[tuple[int, ...]], Averaging]
    optional: Sequence[str] = ()
    step: float = 0.0  # usual step, s
    incomplete: int = 0  # rows left out
    gaps: int = 0
    lost: int = 0  # samples that the angle shows, with the times closed up
    dropped: int = 0  # windows
    rest: dict[str, Array] = field(default_factory=dict)  # rows of the window that is not finished
    opened: tuple[float, float, int] | None = None  # time and angle at which its phase began, windows done
    done: list[dict[str, Array]] = field(default_factory=list)
    counted: dict[tuple[int, ...], int] = field(default_factory=dict)
    successive: dict[str, Successive] = field(default_factory=dict)  # of each signal, in the windows

    def add(self, block: Block) -> None:
        """Take further rows.  Raises ValueError where time does not increase."""
        needed = [block[n] for n in ("time", *self.signals, *self.angles)]
        good = np.all(np.isfinite(needed), axis=0)
        self.incomplete += int(good.size - good.sum())
        rows = {n: v[good] for n, v in block.items()}
        for n in self.keys:
            rows[n] = np.where(np.isfinite(rows[n]), rows[n], 0.0)
            if np.any(rows[n] != np.round(rows[n])):
                raise ValueError(f"column '{n}': {rows[n][rows[n] != np.round(rows[n])][0]:g} must be an integer")
        rows["after gap"] = np.zeros(rows["time"].size)
        new = rows["time"].size
        if self.rest:
            rows = {n: np.concatenate([self.rest[n], v]) for n, v in rows.items()}
        if rows["time"].size < 2:
            self.rest = rows
            return
        dt = np.diff(rows["time"])
        if np.any(dt <= 0.0):
            k = int(np.argmax(dt <= 0.0))
            a, b = rows["time"][k : k + 2]
            raise ValueError(
                f"time does not increase in {int(np.sum(dt <= 0.0))} rows; the first: {b:.9g} s after {a:.9g} s"
            )
        self.step = self.step or float(np.median(dt))
        rows["after gap"][1:] = dt > GAP * self.step
        self.gaps += int(np.sum(rows["after gap"][-new:])) if new else 0
        self._runs(rows)

    def _runs(self, rows: dict[str, Array]) -> None:
        """Cut into runs of one phase; the last one may go on in the next block."""
        size = rows["time"].size
        keys = np.stack([rows[n] for n in self.keys]) if self.keys else np.ones((1, size))
        edges = [0, *(np.flatnonzero(np.any(np.diff(keys, axis=1) != 0.0, axis=0)) + 1).tolist(), size]
        opened, left = self.opened, size
        for a, b in pairwise(edges):
            key = tuple(int(v) for v in keys[:, a])
            self.opened = opened if a == 0 else None
            left = b if 0 in key else self._windows(key, {n: v[a:b] for n, v in rows.items()}) + a
        last = size - 1 if left >= size else left  # the last row stays: the step to the next block is seen
        self.rest = {n: v[last:] for n, v in rows.items()}

    def _windows(self, key: tuple[int, ...], rows: dict[str, Array]) -> int:
        """Average what is complete of a run; return its first row that is still needed."""
        how, t = self.averaging(key), rows["time"]
        angle = rows[self.angles[0]] if self.angles else np.zeros_like(t)
        t_open, angle_open, before = self.opened or (float(t[0]), float(angle[0]), 0)
        if how.by_angle:
            way = np.maximum.accumulate(np.abs(angle - angle_open)) / how.window + 1e-9
        else:
            way = np.nextafter((t - t_open + 0.5 * self.step) / how.window, 0.0)  # strictly after the half step
        numbers = np.arange(before + 1, max(int(np.floor(way[-1])), before) + 1)
        ends = np.searchsorted(way, numbers, side="left")
        edges = np.concatenate([[0], ends])
        self.opened = t_open, angle_open, before + numbers.size
        if numbers.size:
            self._average(key, rows, edges[:-1], edges[1:], how.most, before > 0)
        return int(edges[-1])

    def _average(
        self, key: tuple[int, ...], rows: dict[str, Array], start: NDArray[np.intp], end: NDArray[np.intp], most: int,
        later: bool,
    ) -> None:  # fmt: skip
        """later: windows of this run came before, so that ``start[0]`` is a boundary and not the begin of the run."""
        t = rows["time"]
        dt = np.diff(t)
        gaps = np.cumsum(rows["after gap"])
        whole = (gaps[end] == gaps[start]) & (end > start)
        boundary = slice(0 if later else 1, None)
        whole[boundary] &= rows["after gap"][start[boundary]] == 0.0  # it began in the gap
        room = max(most - self.counted.get(key, 0), 0) if most else whole.size
        self.counted[key] = self.counted.get(key, 0) + min(room, whole.size)
        start, end, whole = start[:room], end[:room], whole[:room]
        self.dropped += int(np.sum(~whole))
        start, end = start[whole], end[whole]
        if not start.size:
            return
        span = slice(start[0], end[-1] + 1)
        breaks = np.flatnonzero(rows["after gap"][span])
        for s in self.signals:
            for stretch in np.split(rows[s][span], breaks):
                self.successive.setdefault(s, Successive()).add(stretch)
        for a in self.angles:
            self.lost += _skipped(np.abs(np.diff(rows[a][span])) / dt[start[0] : end[-1]])
        n = (end - start).astype(float)
        out: dict[str, Array] = {k: np.full(start.size, v) for k, v in zip(self.keys, key, strict=False)}
        suspect = np.cumsum(np.nan_to_num(rows["flag"]) != 0.0) if "flag" in rows else np.zeros(t.size)
        out |= {"t_start": t[start], "t_end": t[end], "n": n, "flagged": suspect[end] - suspect[start]}
        for a in self.angles:
            out[f"{a}_start"], out[f"{a}_end"] = rows[a][start], rows[a][end]
        for s in self.signals:
            d = rows[s] - rows[s][0]
            area = np.concatenate([[0.0], np.cumsum(0.5 * (d[1:] + d[:-1]) * dt)])
            total, squares = np.cumsum(d), np.cumsum(d * d)
            out[s] = rows[s][0] + (area[end] - area[start]) / (t[end] - t[start])
            spread = squares[end] - squares[start] - (total[end] - total[start]) ** 2 / n
            out[f"std {s}"] = np.sqrt(np.maximum(spread, 0.0) / np.maximum(n - 1.0, 1.0))
        for s in self.optional:
            there = np.isfinite(rows[s])
            total, count = np.cumsum(np.where(there, rows[s], 0.0)), np.cumsum(there)
            with np.errstate(invalid="ignore", divide="ignore"):
                out[s] = (total[end] - total[start]) / (count[end] - count[start])
        self.done.append(out)

    def lost_sentence(self) -> str:
        """Return that the angle goes on by more than a sample's, "" where it does not."""
        if self.lost < MISSED:
            return ""
        return (
            f"At {self.lost} places the table turns by two samples or more in the time of one: samples were lost, and "
            "the times of the later ones closed up. Windows are too short, rates from angle and time too large. Log "
            "the clock with each sample."
        )

    def windows(self) -> dict[str, Array]:
        """Return all windows so far, columns as named above; empty where there are none."""
        return {n: np.concatenate([d[n] for d in self.done]) for n in self.done[0]} if self.done else {}

    def sentence(self) -> str:
        """Return what was left out, "" for nothing."""
        if not self.dropped and not self.incomplete:
            return ""
        kept = sum(len(d["n"]) for d in self.done)
        return (
            f"Gaps in the time series: {self.gaps} ({self.incomplete} rows without a value left out); {self.dropped} "
            f"of {kept + self.dropped} windows hold a gap and were dropped."
        )


def _skipped(rate: Array) -> int:
    """Return how many rates of an angle (m,) from sample to sample are those of two samples or more; 0 of one that is
    not even.
    """
    usual = float(np.median(rate)) if rate.size else 0.0
    even = float(np.median(np.abs(rate - usual))) < EVEN * usual
    return int(np.count_nonzero((rate > FARTHER * usual) & (rate < WRAPPED * usual))) if even else 0


def average(blocks: Iterable[Block], averager: Averager) -> dict[str, Array]:
    """Return the windows of all blocks."""
    for block in blocks:
        averager.add(block)
    return averager.windows()
