"""Stretches of a record at rest in which the instrument was moved: taken up, put down, knocked at.

A block of samples is compared with the others by the median size of its differences of samples LAG apart, less their
median: a step of the level, single wild samples and a steady slope leave it as it is.  Where it is TIMES that of most
blocks in any channel, the block and its neighbors are no noise of the instrument; nor are blocks in which a gyro reads
TURNED more than usual, as it does where it is turned smoothly for most of the record.  More than MOST of a record is
not for leaving out: it is no record at rest, or one whose noise changes.  [DRIFT-NOISE-MODEL]
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array

BLOCK, LAG = 32, 8  # samples
SECONDS = 0.5  # of a block at least: a hand moves at some hertz
TIMES = 8.0  # of 10⁴ blocks of a random walk, which differ most, the largest is 4
TURNED = math.radians(10.0)  # rad/s: no bias of a gyro at rest changes by as much
MOST = 0.2  # of a record, that may be left out
ROUNDING = 1e-6  # of the largest: differences of whole counts over a step are as even as their last digits
FEW = 10  # blocks of an end that was cut off by a motion


def moved(channels: Mapping[str, Array], step: float) -> NDArray[np.bool_]:
    """Return the samples (n,) in which one channel or more moves far beyond its noise; step: s."""
    n, size = next(iter(channels.values())).size, _size(step)
    blocks = n // size
    found = np.zeros(blocks, dtype=bool)
    for x in channels.values():
        scatter = _scatter(x[: blocks * size].reshape(blocks, size), size * LAG // BLOCK)
        scatter[scatter < ROUNDING * np.nanmax(scatter, initial=0.0)] = 0.0
        known = scatter[scatter > 0.0]  # of coarse steps most blocks may have none
        usual = float(np.nanmedian(scatter)) or (float(known.min()) if known.size else math.inf)
        found |= scatter > TIMES * usual
    out = np.zeros(n, dtype=bool)
    if not found.any():
        return out
    found = np.convolve(found, np.ones(3), "same") > 0.0
    free = np.flatnonzero(~found)
    runs = np.split(free, np.flatnonzero(np.diff(free) > 1) + 1)
    for run in (runs[0], runs[-1]):
        if free.size and run.size < FEW and (run[0] == 0 or run[-1] == blocks - 1):
            found[run] = True
    out[: blocks * size] = np.repeat(found, size)
    out[blocks * size :] = found[-1]
    return out


def turned(rates: Iterable[Array], step: float) -> NDArray[np.bool_]:
    """Return the samples (n,) in which a gyro or more (n,), rad/s, is turned fast; step: s."""
    size = _size(step)
    found = np.zeros(0, dtype=bool)
    for x in rates:
        blocks = x.size // size
        level = _median(np.sort(x[: blocks * size].reshape(blocks, size), axis=1))
        fast = np.repeat(np.abs(level - np.nanmedian(level)) > TURNED, size)
        fast = np.concatenate([fast, np.repeat(fast[-1:], x.size - fast.size)])
        found = found | fast if found.size else fast
    return found


def _size(step: float) -> int:
    return max(BLOCK, math.ceil(SECONDS / step))


def _scatter(x: Array, lag: int) -> Array:
    """Return the median size of the differences within each block (blocks, size) less their median; NaN without any."""
    d = np.sort(np.abs(_less_median(x[:, lag:] - x[:, :-lag])), axis=1)  # NaN last
    return _median(d)


def _less_median(d: Array) -> Array:
    return d - _median(np.sort(d, axis=1))[:, None]


def _median(ordered: Array) -> Array:
    """Return the upper median of each row (k, m), its NaN last; NaN of a row without half of its values."""
    count = np.isfinite(ordered).sum(axis=1)
    middle = ordered[np.arange(len(ordered)), np.minimum(count // 2, ordered.shape[1] - 1)]
    return np.where(2 * count >= ordered.shape[1], middle, np.nan)
