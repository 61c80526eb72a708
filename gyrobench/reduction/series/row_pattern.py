"""Whether every second row of a record has another level, or another noise, than the rows between.

Two instruments whose rows are in one column, a multiplexer, rows that were interpolated.  Noise knows no rows: level
and logarithm of the mean square of even and odd rows, each less the mean of its two neighbours, have the same
expectation.  Their differences in blocks of the record are compared by the t test, which holds for noise of any
distribution, and for one whose level changes.  [own derivation]
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import special

from gyrobench.arrays import Array

BLOCKS, LEAST = 64, 16  # at most, at least
SAMPLES = 12  # of each kind of rows in a block, at least
CHANCE = 1e-6  # of a difference in a record without any


@dataclass(frozen=True)
class RowPattern:
    """Even rows beside odd ones: level, the difference of their levels, and ratio, that of their rms; p of each by
    chance.
    """

    level: float
    ratio: float
    p_level: float
    p_ratio: float

    @property
    def levels_differ(self) -> bool:
        return self.p_level < CHANCE

    @property
    def noise_differs(self) -> bool:
        return self.p_ratio < CHANCE


def every_second_row(x: Array, clean: Array | None = None) -> RowPattern:
    """Return how even and odd rows of a series (n,) differ, NaN where a sample is missing.

    clean (n,): the series without lines and steps, whose noise is compared; the series itself unless given.  p is 1
    where the series is too short.
    """
    level, p_level = _tested(np.array([np.mean(v, axis=1) for v in _blocks(x)]))
    squares = np.array([np.mean(v * v, axis=1) for v in _blocks(x if clean is None else clean)])
    tiny = 1e-12 * float(np.mean(squares)) + np.finfo(float).tiny if squares.size else 1.0
    ratio, p_ratio = _tested(np.log(squares + tiny))
    # a row differs from the mean of its neighbours by twice what it does from that of all
    return RowPattern(0.5 * level, math.exp(0.5 * ratio), p_level, p_ratio)


def _blocks(x: Array) -> list[Array]:
    """Return rows less the mean of their neighbours (2, samples) of each block in which enough are there."""
    bend = x[1:-1] - 0.5 * (x[:-2] + x[2:])
    pairs = bend[: bend.size // 2 * 2].reshape(-1, 2)
    pairs = pairs[np.isfinite(pairs).all(axis=1)]
    count = min(BLOCKS, pairs.shape[0] // SAMPLES)
    return [v.T[::-1] for v in np.array_split(pairs, count)] if count >= LEAST else []


def _tested(values: Array) -> tuple[float, float]:
    """Return the mean difference of values (blocks, 2), the first less the second, and p of so large a one."""
    if not values.size:
        return 0.0, 1.0
    off = values[:, 0] - values[:, 1]
    mean, u = float(off.mean()), float(off.std(ddof=1)) / math.sqrt(off.size)
    return mean, float(2.0 * special.stdtr(off.size - 1, -abs(mean) / u)) if u > 0.0 else float(mean == 0.0)
