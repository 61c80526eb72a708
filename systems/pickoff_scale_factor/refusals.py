"""What makes a pickoff test impossible: number of angles, range, drift during the test, record."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from gyrobench.arrays import Array
from gyrobench.units import ARCSEC, DPH

POINTS = 10
SHARE = 0.01  # of the span, largest drift angle
STILL = 1e-6  # rad, largest motion within a reading


def points_problems(points: int) -> list[str]:
    if points >= POINTS:
        return []
    return [f"{points} angles: at least {POINTS} are needed to judge how straight the pickoff is"]


def drift_problems(drift: float, duration: float, span: float) -> list[str]:
    """Return that drift (rad/s) times duration (s) is above a hundredth of the span of the angles (rad).  [PICKOFF]"""
    angle = abs(drift) * duration
    if angle <= SHARE * span:
        return []
    return [
        f"{duration:.3g} s with a drift of up to {abs(drift) / DPH:.3g} °/h are {angle / ARCSEC:.3g}″, more than 1 % "
        f"of the span of {span / ARCSEC:.4g}″: step faster, take fewer angles or a larger range"
    ]


def range_problems(largest: float, limit: float) -> list[str]:
    """Return angles (rad) beyond the range of the pickoff."""
    if largest <= limit:
        return []
    return [
        f"angles up to {math.degrees(largest) * 60:.4g}′ lie outside the range of the pickoff, "
        f"±{math.degrees(limit) * 60:.4g}′"
    ]


def record_problems(windows: Mapping[str, Array]) -> list[str]:
    """Return readings taken while the table moved, and too few different angles; rows count from 1."""
    a, b = (np.asarray(windows[c], dtype=float) for c in ("angle_start", "angle_end"))
    found = [
        f"row {k + 1}: the table moved by {abs(b[k] - a[k]) / ARCSEC:.3g}″ while its reading was taken"
        for k in np.flatnonzero(np.abs(b - a) > STILL)[:5]
    ]
    different = np.unique(np.round(a / STILL)).size
    return found + points_problems(int(different))
