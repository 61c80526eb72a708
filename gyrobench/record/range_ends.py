"""Samples at the ends of a column: whether a converter was at its limit, on one side or both."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gyrobench.arrays import Array

FEWEST = 10  # samples at an end
TIMES = 4.0  # as many samples at a limit as at the value next to it, at least
PAIRS = 1e-4  # of the samples: neighbours that are both at a limit


@dataclass
class _End:
    """The largest value of a column, and the next to it: how many samples have them, and neighbours the largest."""

    value: float = -math.inf
    count: int = 0
    following: float = -math.inf
    next_count: int = 0
    pairs: int = 0

    def add(self, value: Array) -> None:
        values, counts = np.unique(value[value >= max(self.following, float(value.min()))], return_counts=True)
        seen = {self.value: self.count, self.following: self.next_count}
        for v, n in zip(values[-2:].tolist(), counts[-2:].tolist(), strict=True):
            seen[v] = seen.get(v, 0) + n
        (following, next_count), (last, count) = sorted(seen.items())[-2:]
        if last != self.value:
            self.pairs = 0
        self.value, self.count, self.following, self.next_count = last, count, following, next_count
        at = value == last
        self.pairs += int(np.sum(at[1:] & at[:-1]))

    def limited(self, samples: int) -> int:
        """Return the samples at the end if they are more than the noise of a column leaves there, else 0.

        The density of noise falls towards its end: no value there has many times as many samples as the next one.
        """
        many = self.count > max(FEWEST, TIMES * self.next_count)
        return self.count if many or self.pairs > max(FEWEST, PAIRS * samples) else 0


class RangeEnds:
    """Both ends of a column that is read in blocks."""

    def __init__(self) -> None:
        self._ends = (_End(), _End())

    def add(self, value: Array) -> None:
        """Take a block (n,) of values without NaN."""
        for end, v in zip(self._ends, (-value, value), strict=True):
            end.add(v)

    @property
    def low(self) -> float:
        return -self._ends[0].value

    @property
    def high(self) -> float:
        return self._ends[1].value

    def limited(self, samples: int) -> int:
        """Return how many of ``samples`` samples are at the limit of a converter, at the end that has more of them."""
        return max(end.limited(samples) for end in self._ends)
