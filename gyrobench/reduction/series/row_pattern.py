"""Whether every second row of a record has another level, or another noise, than the rows between; whether noise comes
and goes with the rows.

Two instruments whose rows are in one column, a multiplexer, rows that were interpolated.  Noise knows no rows: level
and logarithm of the mean square of even and odd rows, each less the mean of its two neighbours, have the same
expectation.  Their differences in blocks of the record are compared by the t test, which holds for noise of any
distribution, and for one whose level changes.

Rows that were held or interpolated from a slower record: at regular places a row equals the one before, or three are on
a straight line.  The square of what they differ by then has a line in its spectrum, at whose phases it vanishes.
Machines make noise that comes and goes too, but none that vanishes.  Rows interpolated in a ratio between 1/2 and 1
leave no three on a line and are not seen.  [own derivation]
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft, ndimage, special

from gyrobench.arrays import Array

BLOCKS, LEAST = 64, 16  # at most, at least
SAMPLES = 12  # of each kind of rows in a block, at least
CHANCE = 1e-6  # of a difference in a record without any
LONGEST = 1 << 18  # rows that are looked at
SHORTEST = 2048
NEAR, OWN = 129, 5  # bins around one, and those of its own
PHASES, STILL = 12, 0.1  # of a cycle; mean square over that of all below which the noise vanishes
HIGHEST = 10.0  # mean squares of a single row


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


def rows_of_a_slower_record(x: Array) -> float:
    """Return after how many rows the changes of a series (n,), NaN where a sample is missing, vanish and come back;
    0 where they do not.
    """
    x = x[: LONGEST + 2]
    return _vanishes(np.diff(x)) or _vanishes(x[1:-1] - 0.5 * (x[:-2] + x[2:]))


def _vanishes(change: Array) -> float:
    """Return the period in rows with which changes (n,) vanish, 0 where they do not."""
    there = np.isfinite(change)
    if np.count_nonzero(there) < SHORTEST:
        return 0.0
    square = np.where(there, change, 0.0) ** 2
    mean = float(np.mean(square[there]))
    size = np.where(there, np.minimum(square, HIGHEST * mean), 0.0)
    size = np.where(there, size - np.mean(size[there]), 0.0)
    power = np.abs(fft.rfft(size)) ** 2
    around = NEAR * ndimage.uniform_filter1d(power, NEAR, mode="reflect")
    around = (around - OWN * ndimage.uniform_filter1d(power, OWN, mode="reflect")) / (NEAR - OWN)
    ratio = power / np.maximum(around, 1e-300)
    ratio[:OWN] = 0.0
    k = int(np.argmax(ratio))
    if ratio[k] < math.log(power.size / CHANCE):
        return 0.0
    frequency = _refined(size, k / size.size)
    phase = np.floor(PHASES * np.remainder(frequency * np.arange(square.size), 1.0)).astype(int)[there]
    count = np.bincount(phase, minlength=PHASES)
    level = np.bincount(phase, square[there], minlength=PHASES)[count > 0] / count[count > 0]
    return 1.0 / frequency if float(level.min()) < STILL * mean else 0.0


def _refined(x: Array, frequency: float) -> float:
    """Return the frequency (cycles per sample) of a line in a series (n,), from its phases in both halves."""
    half = x.size // 2
    wave: NDArray[np.complex128] = np.exp(-2j * math.pi * frequency * np.arange(2 * half))
    first, second = np.sum((x[: 2 * half] * wave).reshape(2, half), axis=1)
    return frequency + float(np.angle(second * np.conj(first))) / (2.0 * math.pi * half)
