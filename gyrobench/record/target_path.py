"""A recorded path of a target, from a CSV file of any length to the parameters of the part moving_target.

# instrument = radar, target 4, 4 May
time [s],azimuth [deg],elevation [deg]
0,312.10,21.20
0.1,312.14,21.22

The direction at its first row is the line of sight at the start.  In the axes there (x right, y along it, z up) a later
one is u = (-sin b cos a, cos b cos a, sin a).  Of a long recording as few rows are kept as pass it within a tolerance.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.record.csv_reader import CsvColumn, DataError, read_measured
from gyrobench.record.motion_profile import gaps

POINTS = 400  # of the part moving_target
STEEP = np.radians(85.0)  # largest turn about x: beyond it a turn about z is next to none
FIRST = 16  # intervals from which the search for the rows to keep begins
RECORDED = 3  # its kind
_COLUMNS = (
    CsvColumn("time", "s", "time of the reading, rising"),
    CsvColumn("azimuth", "rad", "azimuth, about z (up), counter-clockwise from above"),
    CsvColumn("elevation", "rad", "elevation, up", required=False),
)


@dataclass(frozen=True)
class TargetPath:
    """Turns about x and z, rad (points, 2), at times from 0 on, s; off: what the recording is off by, rad, at most."""

    t: Array
    angles: Array
    rows: int
    off: float

    def parameters(self) -> dict[str, Any]:
        """Return the parameters of the part in slot target."""
        table = {"points": int(self.t.size), "path_t": self.t.tolist(), "path": self.angles.tolist()}
        return {"target.kind": RECORDED} | {f"target.{n}": v for n, v in table.items()}


def read_path(file: Path, tolerance: float) -> TargetPath:
    """Return the path of a file; tolerance: rad, of the angles between the rows that are kept.

    An elevation whose column is missing is 0.  Raises DataError for gaps (an interval of more than 3 median intervals),
    fewer than 3 rows, elevations beyond the vertical, turns of more than 85 degrees up or down from the first
    direction, a path that 400 rows do not pass within the tolerance, and as
    :func:`gyrobench.record.csv_reader.read_measured`; OSError for a missing file.
    """
    columns, _ = read_measured(file, _COLUMNS, "time")
    t, azimuth = columns["time"], columns["azimuth"]
    elevation = columns.get("elevation", np.zeros(t.size))
    problems = []
    if t.size < 3:
        problems.append(f"{t.size} rows: 3 or more are needed")
    problems += gaps(t)
    over = np.flatnonzero(np.abs(elevation) > 0.5 * np.pi)
    if over.size:
        problems.append(
            f"elevation of {np.degrees(elevation[over[0]]):.6g} deg at time = {t[over[0]]:.6g} s: beyond 90"
        )
    if problems:
        raise DataError(file, problems)
    angles = turned(azimuth, elevation)
    steep = np.flatnonzero(np.abs(angles[:, 0]) > STEEP)
    if steep.size:
        text = (
            f"at time = {t[steep[0]]:.6g} s it is {np.degrees(angles[steep[0], 0]):.4g} deg above its first direction"
        )
        raise DataError(file, [f"{text}; {np.degrees(STEEP):.3g} deg at most: begin the recording later"])
    keep, off = _kept(t - t[0], angles, tolerance)
    if off > tolerance:
        raise DataError(
            file,
            [f"{t.size} rows: {POINTS} of them pass the path within {1e6 * off:.3g} µrad only, {1e6 * tolerance:.3g} "
             "µrad are wanted: smooth the recording, cut it, or want less of the accuracy"],
        )  # fmt: skip
    return TargetPath(t[keep] - t[0], angles[keep], int(t.size), off)


def turned(azimuth: Array, elevation: Array) -> Array:
    """Return the turns about x and z from the first direction, rad (rows, 2)."""
    east, north, up = -np.sin(azimuth) * np.cos(elevation), np.cos(azimuth) * np.cos(elevation), np.sin(elevation)
    c, s = np.cos(azimuth[0]), np.sin(azimuth[0])
    x, level = c * east + s * north, c * north - s * east
    c, s = np.cos(elevation[0]), np.sin(elevation[0])
    y, z = c * level + s * up, c * up - s * level
    return np.column_stack([np.arcsin(np.clip(z, -1.0, 1.0)), np.unwrap(np.arctan2(-x, y))])


def along(t: Array, angles: Array, at: Array) -> tuple[Array, Array]:
    """Return angles and rates at times of the quintics through the points, as the part has them (times, 2)."""
    before, after = np.diff(t)[:-1, None], np.diff(t)[1:, None]
    slopes = np.diff(angles, axis=0) / np.diff(t)[:, None]
    slope, curve = np.zeros_like(angles), np.zeros_like(angles)
    slope[1:-1] = (slopes[:-1] * after + slopes[1:] * before) / (before + after)
    curve[1:-1] = 2.0 * (slopes[1:] - slopes[:-1]) / (before + after)
    k = np.clip(np.searchsorted(t, at, "right") - 1, 0, t.size - 2)
    d = (t[k + 1] - t[k])[:, None]
    x = np.clip((at[:, None] - t[k, None]) / d, 0.0, 1.0)
    p1, p2 = slope[k] * d, 0.5 * curve[k] * d * d
    rise = angles[k + 1] - angles[k] - p1 - p2
    bend, kink = slope[k + 1] * d - p1 - 2.0 * p2, 0.5 * curve[k + 1] * d * d - p2
    p3, p4, p5 = (a * rise + b * bend + c * kink for a, b, c in ((10, -4, 1), (-15, 7, -2), (6, -3, 1)))
    value = angles[k] + x * (p1 + x * (p2 + x * (p3 + x * (p4 + x * p5))))
    rate = (p1 + x * (2.0 * p2 + x * (3.0 * p3 + x * (4.0 * p4 + x * 5.0 * p5)))) / d
    return value, np.where((at[:, None] < t[0]) | (at[:, None] >= t[-1]), 0.0, rate)


def _kept(t: Array, angles: Array, tolerance: float) -> tuple[NDArray[np.intp], float]:
    """Return the rows to keep, POINTS at most, and how far the path is off the others, rad.

    Each interval that is off by more is halved, the worst first, until none is or the points are used up.
    """
    if t.size <= POINTS:
        return np.arange(t.size), 0.0
    keep = np.unique(np.linspace(0, t.size - 1, FIRST + 1).astype(np.intp))
    while True:
        miss = np.max(np.abs(along(t[keep], angles[keep], t)[0] - angles), axis=1)
        worst = np.maximum.reduceat(miss[:-1], keep[:-1])
        order = np.argsort(-worst)
        halved = [k for k in order if worst[k] > tolerance and keep[k + 1] - keep[k] > 1]
        room = POINTS - keep.size
        if not halved or not room:
            return keep, float(miss.max())
        halved = halved[: min(room, max(1, keep.size // 4))]
        keep = np.unique(np.append(keep, [(keep[k] + keep[k + 1]) // 2 for k in halved]))
