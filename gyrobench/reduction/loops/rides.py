"""Rides of a platform as recorded: its share of the motion of the base."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from gyrobench.reduction.loops.estimator_metrics import UncertainValue

STRETCHES = 10
DECIBEL = 10.0 / math.log(10.0)  # of a ratio of mean squares


def still(t: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return y without its mean and slope: a drift is the gyro's, not the loop's."""
    return np.asarray(y - np.polyval(np.polyfit(t - t[0], y, 1), t - t[0]))


def share(left: Sequence[np.ndarray], base: Sequence[np.ndarray]) -> UncertainValue:
    """Return dB: rms of all axes of the platform over that of all axes of the base; NaN where either is at rest.

    A lively stretch of the base is one of the platform too: u is from the scatter of the ratio over ten stretches.
    Not in it: how much another ride of the same kind would differ in its spectrum.
    """
    taken, given = _mean_squares(left), _mean_squares(base)
    if not taken.any() or not given.any():
        return UncertainValue(math.nan, math.nan)
    scatter = float(np.std(taken / taken.mean() - given / given.mean(), ddof=1)) / math.sqrt(STRETCHES)
    return UncertainValue(DECIBEL * math.log(taken.mean() / given.mean()), DECIBEL * scatter, STRETCHES - 1)


def _mean_squares(axes: Sequence[np.ndarray]) -> np.ndarray:
    total = np.sum([np.square(y) for y in axes], axis=0)
    return np.array([float(np.mean(part)) for part in np.array_split(total, STRETCHES)])
