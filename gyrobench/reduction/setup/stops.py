"""Stops of a table that rests at one angle of the circle after the other, found in the angles of its windows."""

from __future__ import annotations

import math

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.sentences import plain

#: rad; a table at rest creeps less in a window, and its stops are farther apart
REST = 1e-3


def rests(start: Array, end: Array) -> Array:
    """Return the different angles of the circle (rad, ascending) at which a table rests in its windows."""
    angles = np.sort(np.mod((start + end) / 2.0, 2.0 * math.pi))
    first = np.diff(angles, prepend=angles[-1] - 2.0 * math.pi) > REST
    return np.asarray(angles[first] if first.any() else angles[:1])


def spacing(start: Array, end: Array) -> float:
    """Return the angle from reading to reading, rad: the widest window, or the step of a table that rests in them."""
    width = float(np.max(np.abs(end - start)))
    if width > REST:
        return width
    angles = rests(start, end)
    return float(np.median(np.diff(angles, append=angles[0] + 2.0 * math.pi)))


def whole_stops(start: Array, end: Array) -> bool:
    """Return whether a table rests at equally spaced angles of the circle, in equally many windows at each."""
    angles = rests(start, end)
    steps = np.diff(angles, append=angles[0] + 2.0 * math.pi) * angles.size / (2.0 * math.pi)
    off = np.mod((start + end) / 2.0 - angles[0], 2.0 * math.pi) * angles.size / (2.0 * math.pi)
    counts = np.bincount(np.rint(off).astype(int) % angles.size, minlength=angles.size)
    return bool(np.all(np.abs(steps - 1.0) < 0.01) and np.all(counts == counts[0]))


def stop_problems(start: Array, end: Array, t_start: Array, t_end: Array) -> list[str]:
    """Return what is wrong with the windows of a table that should rest at five angles of the circle or more, and move
    between them in no window.
    """
    creep = float(np.max(np.abs(end - start)))
    if creep > REST:
        turned = f"{plain(math.degrees(creep), 3)}° in a window"
        return [f"the table turns by {turned}, expected at rest at its stops; of a turning table state stops = 0"]
    angles = rests(start, end)
    if angles.size < 5:
        return [f"the table rests at {angles.size} angles of the circle, at least 5 are needed for two harmonics"]
    moved = np.abs(end[1:] - end[:-1]) > REST
    if np.any(hasty := moved & (t_start[1:] <= t_end[:-1])):
        k = int(np.argmax(hasty))
        way, at = plain(math.degrees(abs(float(end[k + 1] - end[k]))), 4), plain(t_end[k], 9)
        return [f"the table moves by {way}° at t = {at} s in no time, expected windows at rest alone"]
    return []
