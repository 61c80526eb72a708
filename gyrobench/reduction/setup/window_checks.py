"""Refusals that all reductions of window records share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.errors import GyrobenchError

AXES = ("angle", "outer", "inner")
SAME = 0.1  # of the mean motion of a window: angles that are the same
REQUIRED = ("phase", "t_start", "t_end", "angle_start", "angle_end", "mean")


class ReductionError(GyrobenchError, ValueError):
    """Data that cannot be reduced; ``problems`` says for each finding what is wrong, where, and what would be
    right.
    """

    def __init__(self, problems: str | Sequence[str]) -> None:
        self.problems = [problems] if isinstance(problems, str) else list(problems)
        super().__init__("\n".join(["the data cannot be reduced:", *(f"  - {p}" for p in self.problems)]))


def _list(rows: NDArray[np.intp], shown: int = 5) -> str:
    text = ", ".join(str(int(r) + 1) for r in rows[:shown])
    return text + (f" and {rows.size - shown} more" if rows.size > shown else "")


def window_problems(windows: Mapping[str, Array], required: Sequence[str] = REQUIRED) -> list[str]:
    """Return what is wrong with the rows of a record, as sentences; windows count from 1, wherever their rows stand.

    Columns ``required`` (t_start and t_end among them) in SI: all finite, times strictly increasing, no window twice,
    none flagged (saturated torquer, lost lock) in any column whose name begins with "flagged".
    """
    missing = [c for c in required if c not in windows]
    if missing:
        return [f"column {', '.join(missing)} is missing; a record has {', '.join(required)}"]
    sizes = {c: len(windows[c]) for c in required}
    if len(set(sizes.values())) > 1:
        return [f"columns of different length: {sizes}"]
    if sizes["t_start"] == 0:
        return ["the record holds no windows"]
    problems = []
    for c in required:
        invalid = np.flatnonzero(~np.isfinite(np.asarray(windows[c], dtype=float)))
        if invalid.size:
            problems.append(f"column {c}: non-finite number in window {_list(invalid)}")
    if problems:
        return problems
    t0, t1 = np.asarray(windows["t_start"], dtype=float), np.asarray(windows["t_end"], dtype=float)
    length = t1 - t0
    invalid = np.flatnonzero(length <= 0.0)
    if invalid.size:
        problems.append(f"windows without length (t_end <= t_start): window {_list(invalid)}")
    slack = 1e-6 * max(float(np.median(length)), 0.0)
    twice = np.flatnonzero(np.abs(np.diff(t0)) <= slack) + 1
    if twice.size:
        problems.append(f"duplicate windows: window {_list(twice)} starts when the one before it starts")
    back = np.flatnonzero((np.diff(t0) < -slack) | ((t0[1:] < t1[:-1] - slack) & (np.diff(t0) > slack))) + 1
    if back.size:
        problems.append(
            f"time does not increase or windows overlap: window {_list(back)}; give the rows in order of time"
        )
    problems += [p for axis in AXES if (p := _exchanged_ends(windows, t0, t1, axis))]
    for c in (c for c in windows if c.startswith("flagged")):
        invalid = np.flatnonzero(np.asarray(windows[c]) > 0)
        if invalid.size:
            channel = "" if c == "flagged" else f" ({c})"
            problems.append(
                f"flagged windows{channel} (saturated torquer or lost lock): window {_list(invalid)}; a flagged mean "
                "is no measurement: repeat the phase or leave these rows out"
            )
    return problems


def _exchanged_ends(windows: Mapping[str, Array], t0: Array, t1: Array, axis: str) -> str:
    """Return that the angles at the start and at the end of the windows stand in each other's column; "" if not.

    Where one window begins when the one before it ends, so does its angle.  With the columns exchanged the table would
    jump by two windows and turn back; the first angle of a window is then the second of the one after it.
    """
    columns = [np.asarray(windows.get(f"{axis}_{end}", ()), dtype=float) for end in ("start", "end")]
    phase = np.asarray(windows.get("phase", np.zeros(t0.size)), dtype=float)
    if any(c.size != t0.size for c in columns) or phase.size != t0.size:
        return ""
    start, end = columns
    joined = (np.abs(t0[1:] - t1[:-1]) <= SAME * (t1 - t0)[:-1]) & (phase[1:] == phase[:-1])
    if np.count_nonzero(joined) < 2:
        return ""
    motion = float(np.median(np.abs(end - start)[:-1][joined]))
    as_labelled = float(np.median(np.abs(start[1:] - end[:-1])[joined]))
    exchanged = float(np.median(np.abs(end[1:] - start[:-1])[joined]))
    if not as_labelled > motion > 0.0 or exchanged > SAME * motion:
        return ""
    return (
        f"columns {axis}_start and {axis}_end are exchanged: a window that follows another begins "
        f"{as_labelled / motion:.3g} times its motion away from where that ended, and ends where that began"
    )
