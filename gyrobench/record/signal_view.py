"""Views of long signals: the samples that a picture of a stretch of a signal needs, and no more.

Each level keeps of every bucket of samples the places of the smallest and the largest, so that every point that is
shown is a sample of the record, and none that stands out is left out: minimum-maximum pyramid.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from gyrobench.arrays import AnyArray, Array
from gyrobench.record.mapped_column import release

FIRST, FACTOR = 16, 4  # samples in a bucket of the first level, buckets in one of the next


@dataclass(frozen=True)
class SignalView:
    """Samples of a stretch: times and values, in order; ``every``: samples of the record that stand behind a bucket."""

    time: Array
    values: Array
    every: int


class SignalPyramid:
    """A signal over time that gives views of any stretch in a time that does not depend on its length.

    time: s, ascending.  values: of the same length; what is not finite is kept as a gap.  Raises ValueError where the
    lengths differ.
    """

    def __init__(self, time: AnyArray, values: AnyArray) -> None:
        if len(time) != len(values):
            raise ValueError(f"{len(time)} times, {len(values)} values")
        self.time = time
        self.values = np.asarray(values, dtype=float)
        self.levels: list[tuple[int, AnyArray, AnyArray]] = []  # samples in a bucket, places of minima, of maxima
        size, factor = FIRST, FIRST
        low: AnyArray | None = None  # every sample is the smallest and the largest of itself
        high: AnyArray | None = None
        while (len(self.values) if low is None else len(low)) > factor:
            low, high = _extremes(self.values, low, factor, np.argmin), _extremes(self.values, high, factor, np.argmax)
            self.levels.append((size, low, high))
            size, factor = size * FACTOR, FACTOR

    def view(self, begin: float, end: float, points: int = 2000) -> SignalView:
        """Return at most about ``points`` samples of the stretch from ``begin`` to ``end``, s, its edges included.

        Every sample of a short stretch; of a longer one the smallest and the largest of each bucket.
        """
        first = max(0, int(np.searchsorted(self.time, begin, "left")) - 1)
        last = min(len(self.time), int(np.searchsorted(self.time, end, "right")) + 1)
        every, at = 1, np.arange(first, last)
        if last - first > points:
            fitting = (level for level in self.levels if 2 * (last - first) // level[0] <= points)
            every, low, high = next(fitting, self.levels[-1])
            b, e = first // every, -(-last // every)
            at = np.sort(np.concatenate([low[b:e], high[b:e]]))
            at = np.unique(np.clip(np.concatenate([[first], at, [last - 1]]), first, last - 1))
        view = SignalView(np.asarray(self.time[at], dtype=float), self.values[at], every)
        for column in (self.time, self.values):
            release(column)
        return view


class LiveSignals:
    """Signals while they come: rows [time, values ...], thinned evenly so that every signal keeps its extremes.

    Of every stretch of time the smallest and the largest sample of each signal is kept; the stretches double as the
    record grows.  most: rows that are kept, about.
    """

    def __init__(self, most: int = 2000) -> None:
        self.most = most
        self.stretch = 0.0  # s; 0: every row is kept
        self.rows: Array = np.empty((0, 0))

    def add(self, rows: Array) -> None:
        """Take rows; those that are not after the last one, or not in order, are left out."""
        if not rows.size:
            return
        if self.rows.shape[1] != rows.shape[1]:
            self.rows = np.empty((0, rows.shape[1]))
        last = self.rows[-1, 0] if len(self.rows) else -np.inf
        before = np.concatenate([[last], np.maximum.accumulate(np.nan_to_num(rows[:-1, 0], nan=-np.inf))])
        self.rows = np.concatenate([self.rows, rows[rows[:, 0] > np.maximum(before, last)]])
        if len(self.rows) > self.most:
            stretches = max(4, self.most // (2 * max(1, self.rows.shape[1] - 1)))
            span = self.rows[-1, 0] - self.rows[0, 0]
            self.stretch = self.stretch or span / stretches
            while span > stretches * self.stretch:
                self.stretch *= 2.0
            self.rows = self.rows[self._kept()]

    def _kept(self) -> AnyArray:
        """Return the places of the rows that hold the extremes of a signal in a stretch, and the last one."""
        time = self.rows[:, 0]
        number = np.floor(time / self.stretch)
        ends = np.flatnonzero(np.diff(number, append=np.inf))  # the last of each stretch
        starts = np.concatenate([[0], ends[:-1] + 1])
        found = [np.array([len(time) - 1])]
        for column in self.rows[:, 1:].T:
            finite = np.isfinite(column)
            found.append(np.lexsort((np.where(finite, column, np.inf), number))[starts])
            found.append(np.lexsort((np.where(finite, column, -np.inf), number))[ends])
        return np.unique(np.concatenate(found))


def _extremes(values: Array, at: AnyArray | None, factor: int, pick: Callable[..., Any]) -> AnyArray:
    """Return the places of the extremes of buckets of ``factor`` places ``at`` each (None: of all samples, in order).

    pick: argmin or argmax.  The last bucket may be shorter; a value that is not finite is none.
    """
    held = values if at is None else values[at]
    if not np.isfinite(held).all():
        held = np.where(np.isfinite(held), held, np.inf if pick is np.argmin else -np.inf)
    whole = len(held) - len(held) % factor
    first = pick(held[:whole].reshape(-1, factor), axis=1) + np.arange(0, whole, factor)
    rest = [] if whole == len(held) else [whole + int(pick(held[whole:]))]
    found = np.concatenate([first, rest]).astype(np.int64 if len(values) > np.iinfo(np.int32).max else np.int32)
    return found if at is None else at[found]
