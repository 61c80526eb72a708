"""A drift record of any length as an evenly sampled rate with gaps, in bounded memory.

Samples are put on the grid k * step from the first one.  A sample that is missing, flagged or not a number is a gap;
so is the step of an angle or a counter that was reset (a jump of more than JUMP times its usual spread), unless it is a
full turn or a power of two of counts: then it is unwrapped.  Rate from angle: the difference quotient, the mean rate
between two samples; its amplitude at f is that of the rate times sin(pi f step)/(pi f step).  [RED-RATE; Hu 1981,
eq. 4-1..4-11]

The means that are held are bounded, see gyrobench.record.block_means; where they are of several samples an
``observer`` gets every sample.

Not modelled: dead time; jitter of the samples themselves (time stamps more than 1 % off the grid are warned of).
"""

from __future__ import annotations

import math
import re
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.record.acquisition import Acquisition, Reading
from gyrobench.record.angles import ROUNDING, CumulativeAngle
from gyrobench.record.block_means import BlockMeans
from gyrobench.record.csv_reader import DataError
from gyrobench.record.drift_columns import ANGLE, DIRECT, FLAG, TIME, DriftTable, Signal, columns_of
from gyrobench.record.frozen import EqualSamples
from gyrobench.record.range_ends import RangeEnds

GAP = 1.5  # steps
SAME = 0.3  # of the rows with the time of the row before: a clock that is too coarse
CHUNK = 200  # samples whose median step is held against the usual one
MIXED = 0.1  # of the step: a larger change of it is another sampling rate
BEGINNING = 100_000  # values that are kept as they are
UNEVEN = 0.25  # of the step, rms: not a grid
BURSTS = 1.5  # mean step of a chunk over its median, where long ones are not whole steps: stamps of arrival
JITTER = 0.01  # of the step, rms  [DAQ-DRIFT]
LARGEST = 1e100  # value of a column, and the inverse of the least range: squares are numbers yet
LONG = 1 << 20  # steps of a gap at most on the grid; of a longer one the rest is left out
CLOCKS = ("s", "ms", "min", "h")


Progress = Callable[[Reading], None]
#: gets (name, index of the first sample on the grid, rates without a gap between them)
Observer = Callable[[str, int, Array], None]


class DriftReader:
    """Reads a table once: rates of the signals on a grid, with what is known of the acquisition."""

    def __init__(
        self, table: DriftTable, signals: Sequence[Signal], regressors: str = "", sampling: float = 0.0,
        cumulative: bool = True,
    ) -> None:  # fmt: skip
        """cumulative: angles are stated to be, else those that do not grow are asked for."""
        self.table, self.signals, self.cumulative = table, signals, cumulative
        self.columns = columns_of(table, signals, regressors)
        self.timed = any(c.name == TIME for c in self.columns)
        if not self.timed and not sampling:
            raise DataError(
                table.source,
                [f"column 'time [s]' is missing{_clock_of(table)}, and no sampling rate is given: write "
                 "'# sampling = 100Hz' in the file or --set sampling=100Hz"],
            )  # fmt: skip
        self.others = [c.name for c in self.columns if c.name not in {TIME, FLAG, *(s.name for s in signals)}]
        self.about = Acquisition(step=0.0 if self.timed else 1.0 / sampling)
        self.held = BlockMeans([TIME, *(s.name for s in signals), *self.others])
        self.angles = {s.name: CumulativeAngle(s) for s in signals if s.kind == ANGLE}
        self.equal = EqualSamples([s.name for s in signals])
        self.position = 0  # on the grid, of the next sample
        self.cut = 0  # samples of long gaps that are left out of it
        self.before = math.nan  # time of the last sample
        self.last_other = dict.fromkeys(self.others, math.nan)
        self.regular = [0, 0.0, 0.0]  # steps, their sum, squares of their deviation in steps
        self.beginning = {s.name: np.empty(0) for s in signals}  # first values, rad/s, or increments, rad
        self.ends = {s.name: RangeEnds() for s in signals}
        self.steps = {name: [math.inf, -math.inf, 0.0] for name in self.angles}  # least, largest; largest angle

    def read(self, observer: Observer | None = None, progress: Progress | None = None) -> dict[str, Array]:
        """Return the means that are held, NaN in gaps: time, rates in rad/s, other columns in SI.  Raises DataError."""
        self.observer = observer or (lambda name, first, values: None)
        start, rows, told = time.monotonic(), 0, 0.0
        for block in self.table.blocks(self.columns):
            first = next(iter(block.values()))
            try:
                self._add(block, rows)
            except ValueError as error:
                raise DataError(self.table.source, [str(error)]) from None
            rows += first.size
            elapsed = time.monotonic() - start
            if progress is not None and elapsed - told > 0.2:
                told = elapsed
                progress(Reading(rows, min(1.0, self.table.done(rows)), elapsed))
        self._finish(rows)
        return self.held.columns()

    # ------------------------------------------------------------------ block by block
    def _add(self, block: Mapping[str, Array], rows: int) -> None:
        about = self.about
        size = next(iter(block.values())).size
        row = self.table.head.line + 1 + rows + np.arange(size)
        good = np.all(np.isfinite([block[s.name] for s in self.signals]), axis=0)
        if self.timed:
            good &= np.isfinite(block[TIME])
        about.incomplete += int(size - good.sum())
        if FLAG in block:
            suspect = good & (np.nan_to_num(block[FLAG]) != 0.0)
            about.flagged += int(suspect.sum())
            good &= ~suspect
        if not good.any():
            return
        t = block[TIME][good] if self.timed else np.empty(0)
        number = rows + np.flatnonzero(good)
        place = self._places(t, row[good]) if self.timed else number - self.cut
        if not self.timed:
            about.gaps += int(np.sum(np.diff(np.concatenate([[self.position - 1], place])) > 1))
        follows = np.diff(np.concatenate([[self.position - 1], place])) == 1
        follows[0] = follows[0] and about.samples > 0
        dt = self._intervals(t) if self.timed else np.full(place.size, about.step)
        values = {s.name: self._rate(s, block[s.name][good], follows, dt) for s in self.signals}
        others = {n: block[n][good] for n in self.others}
        values[TIME] = t if self.timed else about.step * number.astype(float)
        self.equal.add(values[TIME] - about.first, {s.name: block[s.name][good] for s in self.signals})
        for name, angle in self.angles.items():
            angle.follow(values[TIME], block[name][good])
        about.samples += place.size
        self._put(place, values, others)

    def _places(self, t: Array, row: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the index of each sample on the grid.  Raises ValueError for time that does not fit one."""
        about = self.about
        first = not about.samples
        d = np.diff(t) if first else np.diff(np.concatenate([[self.before], t]))
        after = row[1:] if first else row
        back = np.flatnonzero(d <= 0.0)
        if back.size:
            k = int(back[0])
            others = f" ({back.size} rows in this part of the file)" if back.size > 1 else ""
            now = t[k + 1] if first else t[k]
            if not d[back].any() and back.size > SAME * d.size and t[-1] > t[0]:
                raise ValueError(
                    f"row {after[k]}: time = {now:.9g} s, as in the row before{others}: the clock is coarser than the "
                    "rows.  If the instrument samples evenly, leave the column time out (of the column map) and state "
                    f"its rate: sampling = {(t.size - 1) / (t[-1] - t[0]):.3g}Hz by the rows of this part"
                )
            raise ValueError(
                f"row {after[k]}: time = {now:.9g} s does not come after {now - d[k]:.9g} s{others}; time must "
                "increase: sort the rows, or reduce the parts as records of their own"
            )
        if first:
            about.first = float(t[0])
            if d.size:
                usual = float(np.median(d[:CHUNK]))
                about.step = float(np.mean(d[d < GAP * usual]))
        if not about.step:  # a single row
            about.step = float(d[0]) if d.size else 0.0
            return np.zeros(t.size, dtype=np.int64)
        self._same_rate(d, after)
        steps = np.maximum(np.rint(d / about.step), 1.0).astype(np.int64)
        even = d < GAP * about.step
        self.regular[0] += int(even.sum())
        self.regular[1] += float(d[even].sum())
        self.regular[2] += float(np.sum((d[even] / about.step - 1.0) ** 2))
        gaps = np.flatnonzero(~even)
        about.gaps += gaps.size
        if gaps.size:
            k = int(gaps[np.argmax(d[gaps])])
            if d[k] > about.longest[1]:
                about.longest = (float((t[k + 1] if first else t[k]) - d[k] - about.first), float(d[k]))
        steps[even] = 1
        start = self.position if first else self.position - 1
        place: NDArray[np.int64] = start + np.concatenate([[0], np.cumsum(steps)] if first else [np.cumsum(steps)])
        return place

    def _same_rate(self, d: Array, row: NDArray[np.int64]) -> None:
        """Raise ValueError where the usual step changes within the file, or there is none."""
        step = self.about.step
        chunks = d[: d.size // CHUNK * CHUNK].reshape(-1, CHUNK)
        if not chunks.size:
            return
        usual = np.median(chunks, axis=1)
        ratio = chunks / usual[:, None]
        long = ratio[ratio > GAP]
        if long.size and float(np.median(chunks.mean(axis=1) / usual)) > BURSTS and np.std(long - np.rint(long)) > 0.2:
            mean = float(d.mean())
            raise ValueError(
                f"the time stamps come in bursts, {float(np.median(usual)):.3g} s apart with a mean of {mean:.4g} s: "
                "stamps of arrival, not of sampling?  If the instrument samples evenly, leave the column time out "
                f"(of the column map) and state its rate: sampling = {1.0 / mean:.4g}Hz"
            )
        even = ratio < GAP
        off = np.sqrt(np.sum(np.where(even, ratio - 1.0, 0.0) ** 2, axis=1) / even.sum(axis=1))
        if float(np.median(off)) > UNEVEN:
            raise ValueError(
                f"the samples are not evenly spaced: steps from {float(d.min()):.4g} to {float(chunks[even].max()):.4g}"
                " s; deviations and spectra need an even grid: resample the record, and say so. If only the stamps are "
                "uneven, as those of a computer, and the instrument samples evenly, leave the column time out (of the "
                f"column map) and state its rate: sampling = {1.0 / float(chunks[even].mean()):.4g}Hz"
            )
        other = np.flatnonzero(np.abs(usual / step - 1.0) > MIXED)
        if other.size:
            k = int(other[0])
            raise ValueError(
                f"the sampling changes from {step:.6g} s to {usual[k]:.6g} s at about row {row[k * CHUNK]}: mixed "
                "sampling rates; split the file, or bring it to one rate by means over whole numbers of samples"
            )

    def _intervals(self, t: Array) -> Array:
        """Return the time since the sample before, of an angle's mean rate: the step where stamps are rounded."""
        about = self.about
        d = np.diff(np.concatenate([[self.before], t]))
        if not about.samples:
            about.rounded = _rounding(t, about.step)
        self.before = float(t[-1])
        return np.full(t.size, about.step) if about.rounded else d

    def _rate(self, s: Signal, value: Array, follows: NDArray[np.bool_], dt: Array) -> Array:
        self.ends[s.name].add(value)
        value = value * s.factor if s.factor != 1.0 else value
        if s.kind != ANGLE:
            self._begin(s, value)
            return value if s.kind in DIRECT else value / self.about.step
        d = self.angles[s.name].increments(value, follows)
        self._begin(s, d)
        if (there := d[np.isfinite(d)]).size:
            low, high, size = self.steps[s.name]
            largest = max(size, float(np.max(np.abs(value))))
            self.steps[s.name] = [min(low, float(there.min())), max(high, float(there.max())), largest]
        return d / dt

    def _begin(self, s: Signal, value: Array) -> None:
        if (kept := self.beginning[s.name]).size < BEGINNING:
            self.beginning[s.name] = np.append(kept, value[np.isfinite(value)])[:BEGINNING]

    def _put(self, place: NDArray[np.int64], values: dict[str, Array], others: dict[str, Array]) -> None:
        """Hand on runs without a gap; what lies between is missing, of a long gap LONG samples."""
        steps = np.diff(np.concatenate([[self.position - 1], place]))
        self.about.missing += int(np.sum(steps - 1))
        if np.any(steps > LONG):
            cut = np.cumsum(np.maximum(steps - LONG, 0))
            place, self.cut = place - cut, self.cut + int(cut[-1])
            for part in np.split(np.arange(place.size), np.flatnonzero(steps > LONG)):
                if part.size:
                    taken = {n: v[part] for n, v in values.items()}
                    self._run(place[part], taken, {n: v[part] for n, v in others.items()})
        else:
            self._run(place, values, others)

    def _run(self, place: NDArray[np.int64], values: dict[str, Array], others: dict[str, Array]) -> None:
        """Hand on samples with gaps of LONG at most between them."""
        size = int(place[-1] - place[0]) + 1
        if self.held.first_halved_by(int(place[0]) - self.position + size):
            self._tell(0, self.held.data, self.position)
        self.held.skip(int(place[0]) - self.position)
        gap_free = size == place.size
        at = place - place[0]
        dense = {}
        for n, v in {**values, **others}.items():
            if not gap_free:
                grid = np.full(size, np.nan)
                grid[at] = v
                v = grid
            dense[n] = self._filled(n, v) if n in others else v
        for k in range(0, size, 1 << 18):
            self.held.add({n: v[k : k + (1 << 18)] for n, v in dense.items()})
        if self.held.factor > 1:
            self._tell(int(place[0]), dense, size)
        self.position = int(place[-1]) + 1

    def _tell(self, first: int, values: Mapping[str, Array], size: int) -> None:
        """Hand the first ``size`` values on to the observer; first: index on the grid."""
        for n in (s.name for s in self.signals):
            v = values[n][:size]
            edges = np.flatnonzero(np.diff(np.isfinite(v).astype(np.int8), prepend=0, append=0))
            for a, b in edges.reshape(-1, 2).tolist():
                self.observer(n, first + a, v[a:b])

    def _filled(self, name: str, v: Array) -> Array:
        """Return a slow quantity with its gaps filled by the last value: a thermometer is logged less often."""
        known = np.isfinite(v)
        last = np.maximum.accumulate(np.where(known, np.arange(v.size), -1))
        out = np.where(last >= 0, v[np.maximum(last, 0)], self.last_other[name])
        self.last_other[name] = float(out[-1])
        return out

    # ------------------------------------------------------------------ at the end
    def _finish(self, rows: int) -> None:
        about = self.about
        if about.samples < 2:
            names = ", ".join(s.name for s in self.signals)
            of = f" in each of {names} (choose by channel=NAME)" if len(self.signals) > 1 else ""
            lacking = f"; {rows - about.samples} of {rows} rows have none{of}" if rows > about.samples else ""
            raise DataError(self.table.source, [f"{about.samples} samples with a value{lacking}"])
        if about.gaps > 0.05 * about.samples and about.missing > about.samples:
            raise DataError(
                self.table.source,
                [f"{about.gaps} of {about.samples} steps are longer than the usual one of {about.step:.4g} s: mixed or "
                 "uneven sampling; bring the record to one rate by means over whole numbers of samples"],
            )  # fmt: skip
        if self.timed and self.regular[0]:
            mean = self.regular[1] / self.regular[0]
            about.jitter = math.sqrt(max(self.regular[2] / self.regular[0] - (mean / about.step - 1.0) ** 2, 0.0))
            about.step = mean
        about.last = self.before if self.timed else about.step * (self.position - 1 + self.cut)
        if not self.cumulative and (asked := [q for a in self.angles.values() if (q := a.question())]):
            raise DataError(self.table.source, asked)
        for s in self.signals:
            ends = self.ends[s.name]
            low, high = ends.low, ends.high
            about.stuck[s.name] = ends.limited(about.samples)
            if low == high:
                raise DataError(self.table.source, [f"column '{s.name}': all its values are {low * s.factor:.6g} (SI)"])
            if max(-low, high) > LARGEST or high - low < 1.0 / LARGEST:
                raise DataError(
                    self.table.source,
                    [f"column '{s.name}': values from {low:.6g} to {high:.6g} (SI): squares of them are beyond the "
                     "numbers of the computer; is the unit right?"],
                )  # fmt: skip
        for name, (low, high, size) in self.steps.items():
            if high - low <= ROUNDING * size:
                raise DataError(
                    self.table.source,
                    [f"column '{name}': every step of it is {high:.6g} rad: the noise is below its resolution, there "
                     "is nothing to estimate; read a finer angle, or more seldom"],
                )  # fmt: skip
        about.frozen, about.repeated = self.equal.frozen(), self.equal.rows_repeated()
        about.resets = {n: a.resets for n, a in self.angles.items() if a.resets}
        about.wraps = {n: a.wraps for n, a in self.angles.items() if a.wraps}


def _clock_of(table: DriftTable) -> str:
    """Return a question about columns in a unit of time, which may be the clock under another name; "" for none."""
    found = [n for n in table.head.names if (m := re.search(r"\[(.*)\]$", n)) and m[1].strip() in CLOCKS]
    return f" (is it '{found[0]}'? name it time)" if found else ""


def _rounding(t: Array, step: float) -> float:
    """Return the decimal to which time stamps are rounded, s, where that alone puts them off the grid; else 0."""
    d = np.diff(t)
    d = d[d < GAP * step]
    if d.size < 2 or np.all(np.abs(d / step - 1.0) < JITTER):
        return 0.0
    for digits in range(9):
        q = 10.0**-digits
        if q < JITTER * step:
            return 0.0
        if q <= 2.0 * step and np.all(np.abs(t / q - np.rint(t / q)) < 1e-3):
            return q
    return 0.0


def as_dict(about: Acquisition) -> dict[str, Any]:
    """Return what is known of the acquisition, for run.json."""
    return {**asdict(about), "longest": list(about.longest)}
