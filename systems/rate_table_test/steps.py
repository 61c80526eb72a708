"""Order of the rates of a rate table test, and what the reduction reads of it: direction, cycle, levels."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from gyrobench import frames
from gyrobench.arrays import Array

SAME = 1e-4  # of the largest rate: rates that are the same


def sweep(full: float, steps: int, cycles: int) -> list[float]:
    """Return 0, then each cycle: up to +full, down to 0, down to -full, up to 0; 1 + 4 steps cycles rates."""
    up = [full * k / steps for k in range(1, steps + 1)]
    way = [*up, *up[-2::-1], 0.0]
    return [0.0, *([*way, *(-r for r in way)] * cycles)]


def earth_rate(options: Mapping[str, Any]) -> float:
    """Return the Earth rate along a vertical axis, rad/s."""
    return frames.EARTH_RATE * math.sin(float(options["latitude"]))


def levels(rate: Array) -> Array:
    """Return the number of the level of each row, from 0: rows that follow one another at the same rate."""
    step = np.abs(np.diff(rate)) > SAME * float(np.max(np.abs(rate)))
    return np.concatenate([[0], np.cumsum(step)])


def direction(rate: Array) -> Array:
    """Return 1 where a level was reached from below, -1 from above, 0 for the first one."""
    level = levels(rate)
    first = np.flatnonzero(np.concatenate([[True], np.diff(level) > 0]))
    steps = np.concatenate([[0.0], np.sign(np.diff(rate[first]))])
    out: Array = steps[level]
    return out


def cycle_of(phase: Array, steps: int) -> Array:
    """Return the cycle, from 1, of the phases of a run's sweep; the first phase, at rest, is of the first one."""
    out: Array = np.maximum(phase - 2, 0) // (4 * steps) + 1
    return out
