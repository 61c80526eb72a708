"""Differencing: the d-th difference, what it does to a line, and the signs of one difference too many.

A line of amplitude A at f becomes 2 A sin(pi f dt) per difference, with the phase + (pi/2 - pi f dt): slow lines nearly
vanish from a differenced series and stay in the series itself, so lines are removed **before** differencing.
[DRIFT-DIFF; Xia 2008, eq. 3.4.1 with EX10]
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.series.checks import SeriesError, checked, checked_step

MOST_NEGATIVE = -0.45  # lag-one correlation from which on a series counts as over-differenced
NEAR_MINUS_ONE = 0.05  # of its moving-average coefficient


def difference(x: Any, order: int = 1) -> Array:
    """Return the difference of ``order``, (1 - B)^d x; it is ``order`` values shorter."""
    if order < 0 or order != int(order):
        raise SeriesError(f"difference of order {order}: it must be 0, 1, 2, ...")
    out: Array = np.diff(checked(x, order + 2), n=int(order))
    return out


def line_after_difference(frequency: float, dt: float, order: int = 1) -> tuple[float, float]:
    """Return amplitude factor and phase shift (rad) of a sine of ``frequency`` (Hz) under the difference.

    The phase is that at the last of the samples of which a difference is made.
    """
    turn = math.pi * frequency * checked_step(dt)
    return abs(2.0 * math.sin(turn)) ** order, order * (math.pi / 2.0 - turn)


@dataclass(frozen=True)
class OverDifferencing:
    """The two signs of one difference too many; white noise differenced has -1/2 and -1."""

    lag_one: float  # correlation
    ma: float  # coefficient theta of x_t = e_t + theta e_{t-1}, exact maximum likelihood

    @property
    def flagged(self) -> bool:
        return self.lag_one <= MOST_NEGATIVE or self.ma <= -1.0 + NEAR_MINUS_ONE


def over_differencing(x: Any) -> OverDifferencing:
    """Return lag-one correlation and moving-average coefficient of a (differenced) series."""
    from gyrobench.reduction.series.moving_average import fit_arma

    x = checked(x, 50)
    y = x - x.mean()
    return OverDifferencing(float(y[1:] @ y[:-1] / (y @ y)), float(fit_arma(x, 0, 1).theta[0]))
