"""Runs of equal samples: a channel that is frozen, rows that a logger wrote twice.

A sample of independent noise equals the one before with a probability p0, the share of such pairs in the record; a run
of L equal samples somewhere among n then has a probability below n p0^(L-1).  Readings that a low-pass or a coarse step
make alike have a large p0 and long runs; what stands out of that is frozen.  Samples that are not independent, as
counts that come in lumps, go on being equal more often than p0: of the 100 longest other runs half are longer than the
shortest by e or more, so that a run goes on with a probability of about 2^(-1/e).

Rows that a logger wrote again, at regular places or by chance, are alike in every channel.  Of a single one the least
difference q that is not 0 says how many would be alike by chance: q times the density of the differences at 0, of
normal ones 0.27 over the median of their sizes.  A counter whose values were rounded again has more: of a single
channel less than a twentieth of the rows is not said.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gyrobench.arrays import Array

CHANCE = 1e-6  # of a run by the noise
LONGEST = 100  # runs that tell how runs go on
FEWEST = 20  # repeated rows that are said
PART_OF_ONE = 0.05  # of the rows of a single channel
MORE, MORE_OF_ONE = 10.0, 3.0  # times those by chance
DENSITY = 0.269  # at 0, of normal differences, times the median of their sizes


@dataclass
class EqualSamples:
    """Equal neighbours of channels that are read block by block; samples with a value alone, in their order."""

    names: list[str]
    samples: int = 0
    repeated: int = 0  # rows in which every channel equals the row before
    equal: dict[str, int] = field(default_factory=dict)
    longest: dict[str, tuple[int, float]] = field(default_factory=dict)  # samples, time of the first, s
    running: dict[str, tuple[int, float]] = field(default_factory=dict)
    lengths: dict[str, Counter[int]] = field(default_factory=dict)  # of the runs that have ended
    last: dict[str, float] = field(default_factory=dict)
    least: float = np.inf  # difference of the first channel that is not 0
    median: float = np.inf  # of the sizes of those, in the block where it is least

    def add(self, time: Array, values: Mapping[str, Array]) -> None:
        """Take samples (n,) of every channel and their times, s; n > 0."""
        size = time.size
        every = np.ones(size, dtype=bool)
        for name in self.names:
            v = values[name]
            same = np.empty(size, dtype=bool)
            same[1:] = v[1:] == v[:-1]
            same[0] = name in self.last and self.last[name] == v[0]
            every &= same
            self.equal[name] = self.equal.get(name, 0) + int(same.sum())
            self._run(name, time, same)
            self.last[name] = float(v[-1])
        self.repeated += int(every.sum())
        self.samples += size
        change = np.abs(np.diff(values[self.names[0]]))
        if (change := change[change > 0.0]).size:
            self.least, self.median = min(self.least, float(change.min())), min(self.median, float(np.median(change)))

    def _run(self, name: str, time: Array, same: np.ndarray[Any, Any]) -> None:
        """Follow the runs of one channel, over the edges of the blocks too."""
        begins = np.flatnonzero(~same)
        before, since = self.running.get(name, (0, float(time[0])))
        first = int(begins[0]) if begins.size else same.size
        runs = [(before + first, since)] if before + first else []
        if begins.size:
            lengths = np.diff(np.append(begins, same.size))
            ended = np.bincount(np.append(before + first, lengths[:-1]))
            ended[0] = 0
            many = np.flatnonzero(ended)
            self.lengths.setdefault(name, Counter()).update(dict(zip(many.tolist(), ended[many].tolist(), strict=True)))
            k = int(np.argmax(lengths))
            runs.append((int(lengths[k]), float(time[begins[k]])))
            self.running[name] = (int(lengths[-1]), float(time[begins[-1]]))
        else:
            self.running[name] = runs[0]
        best = max(runs, key=lambda r: r[0])
        if best[0] > self.longest.get(name, (0, 0.0))[0]:
            self.longest[name] = best

    def share(self, name: str) -> float:
        """Return which part of the samples of a channel equal the one before."""
        return self.equal.get(name, 0) / max(self.samples, 1)

    def frozen(self) -> dict[str, tuple[int, float]]:
        """Return the channels with a run of equal samples that noise does not make: its samples, its time, s."""
        out = {}
        for name, (length, when) in self.longest.items():
            others = max(self.samples - length, 1)
            p0 = min(max(self.equal[name] - length + 1, 0) / others + 1.0 / others, 1.0)
            if self.samples * p0 ** (length - 1) < CHANCE and self._stands_out(name, length):
                out[name] = (length, when)
        return out

    def _stands_out(self, name: str, length: int) -> bool:
        """Return whether a run is longer than the long ones of its channel let expect."""
        others = self.lengths.get(name, Counter()) - Counter([length])
        counted = sorted(others.items())
        ordered = np.repeat([n for n, _ in counted], [min(many, LONGEST + 1) for _, many in counted])[-LONGEST - 1 :]
        if ordered.size <= LONGEST or not (half := float(np.median(ordered[1:] - ordered[0]))):
            return True
        return LONGEST * math.pow(0.5, (length - int(ordered[0])) / half) < CHANCE

    def rows_repeated(self) -> int:
        """Return the rows that repeat the one before in all channels, beyond what chance makes."""
        if not self.repeated:
            return 0
        if len(self.names) > 1:
            chance = MORE * float(np.prod([self.equal[n] / self.samples for n in self.names]))
        else:
            chance = PART_OF_ONE + MORE_OF_ONE * DENSITY * self.least / self.median
        several = self.repeated > 0.5 * min(self.equal.values())
        return self.repeated if several and self.repeated > FEWEST + chance * self.samples else 0
