"""A recorded motion of a base, from a CSV file to the parameters of the part base_motion.

# instrument = vertical gyro of the ship
time [s],pitch [deg],roll [deg],heading [deg]
0,0.10,-1.20,45.0
0.5,0.12,-1.35,45.1
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.record.csv_reader import CsvColumn, DataError, read_measured

POINTS = 400  # of the part base_motion
GAP = 3.0  # intervals longer than this many median intervals are gaps
RECORDED = 9  # its preset
_COLUMNS = (
    CsvColumn("time", "s", "time of the reading, rising"),
    CsvColumn("pitch", "rad", "pitch, about x (right)", required=False),
    CsvColumn("roll", "rad", "roll, about y (forward)", required=False),
    CsvColumn("heading", "rad", "heading, about z (up), counter-clockwise from above", required=False),
)


def gaps(t: Array) -> list[str]:
    """Return the gaps in the times of a recording as problems, eight at most."""
    intervals = np.diff(t)
    usual = np.median(intervals) if t.size >= 3 else np.inf
    return [
        f"a gap of {intervals[k]:.6g} s after time = {t[k]:.6g} s, where the median interval is {usual:.6g} s: cut the "
        "recording there, or fill it"
        for k in np.flatnonzero(intervals > GAP * usual)[:8]
    ]


def read_profile(file: Path, slot: str = "motion") -> dict[str, Any]:
    """Return the parameters of the base_motion in ``slot`` that play the recording, its time beginning with 0.

    An angle whose column is missing stays 0.  Raises DataError for unsorted times, gaps (an interval of more than 3
    median intervals: an interpolation over it would be invented), fewer than 3 and more than 400 points, no angle at
    all, and as :func:`gyrobench.record.csv_reader.read_measured`; OSError for a missing file.
    """
    columns, _ = read_measured(file, _COLUMNS, "time")
    t = columns["time"]
    angles = [columns.get(name) for name in ("pitch", "roll", "heading")]
    problems = []
    if all(a is None for a in angles):
        problems.append("no column pitch, roll or heading: at least one is needed")
    if not 3 <= t.size <= POINTS:
        advice = f"thin it to every {-(-t.size // POINTS)}th row" if t.size > POINTS else "a recording is expected"
        problems.append(f"{t.size} points: 3 to {POINTS} are allowed; {advice}")
    problems += gaps(t)
    if problems:
        raise DataError(file, problems)
    table = np.column_stack([np.zeros(t.size) if a is None else a for a in angles])
    return {
        f"{slot}.preset": RECORDED,
        f"{slot}.points": int(t.size),
        f"{slot}.profile_t": (t - t[0]).tolist(),
        f"{slot}.profile": table.tolist(),
    }


def profile_rates(t_points: Array, angles: Array, t: Array) -> Array:
    """Return the rates about the axes of the base, rad/s, (3, times), as base_motion makes them of a recording.

    t_points, angles (points, 3): of the recording; before and after it the base rests.
    """
    from scipy.interpolate import BPoly

    before, after = np.diff(t_points)[:-1, None], np.diff(t_points)[1:, None]
    slopes = np.diff(angles, axis=0) / np.diff(t_points)[:, None]
    ends = np.zeros((1, 3))
    slope = np.vstack([ends, (slopes[:-1] * after + slopes[1:] * before) / (before + after), ends])
    curve = np.vstack([ends, 2.0 * np.diff(slopes, axis=0) / (before + after), ends])
    motion = BPoly.from_derivatives(t_points, np.stack([angles, slope, curve], axis=1))
    p, r, _ = motion(np.clip(t, t_points[0], t_points[-1])).T
    inside = (t > t_points[0]) & (t < t_points[-1])
    dp, dr, dh = np.where(inside, motion.derivative()(np.clip(t, t_points[0], t_points[-1])).T, 0.0)
    return np.array([
        np.cos(r) * dp - np.sin(r) * np.cos(p) * dh, dr + np.sin(p) * dh, np.sin(r) * dp + np.cos(r) * np.cos(p) * dh
    ])  # fmt: skip
