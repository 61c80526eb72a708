"""Points of a frequency response: from the phases of a run, or from the rows of a measured record."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.reduction.loops.loop_measures import Gate, gates
from gyrobench.reduction.loops.response_errors import line_ratios, stated_u
from gyrobench.reduction.setup.window_checks import ReductionError

LEAST = 8  # frequencies
TABLE, GYRO = "table.rate_read", "gyro.rate[1]"
IMAGE = 2.0  # lines of the record from a sine to its image, at least


@dataclass(frozen=True)
class Points:
    """Frequencies (n,), Hz; gyro over table; relative u; amplitude of the table, rad/s; whether u is known."""

    f: Array
    value: NDArray[Any]
    u: Array
    table: Array
    known: bool = True
    saturated: tuple[float, ...] = ()  # frequencies at which the gyro was beyond its range
    folded: tuple[float, ...] = ()  # left out: near a multiple of half the output rate
    held: float = 0.0  # s, time between two samples of the gyro, of which value is at their own times


def points_of(record: Record) -> Points:
    """Return the points of a record by rising frequency.  Raises ReductionError."""
    found = _of_rows(record) if record.run.measured else _of_phases(record)
    if found.f.size < LEAST:
        raise ReductionError(f"{found.f.size} frequencies: at least {LEAST} are needed")
    if np.unique(found.f).size < found.f.size:
        raise ReductionError("a frequency stands twice: one row for each is expected")
    if not (np.all(found.f > 0.0) and np.all(np.abs(found.value) > 0.0) and np.all(np.isfinite(found.value))):
        raise ReductionError("frequencies and amplitudes must be above 0")
    order = np.argsort(found.f)
    return replace(
        found, f=found.f[order], value=found.value[order], u=found.u[order], table=found.table[order],
    )  # fmt: skip


def _of_rows(record: Record) -> Points:
    w = {n: np.asarray(v, dtype=float) for n, v in record.windows.items()}
    if np.any(w["table"] <= 0.0):
        raise ReductionError("table: the amplitude of a rate is above 0; a lag belongs into phase")
    known, u = stated_u(w)
    return Points(w["frequency"], w["gyro"] / w["table"] * np.exp(1j * w["phase"]), u, w["table"], known)


def _of_phases(record: Record) -> Points:
    period, step = float(record.run.parameters.get("gyro.period") or 0.0), float(record.run.step or 0.0)
    held = period > 1.5 * step
    shaken = [g for g in gates(record) if g.kind == "motion"]
    over = tuple(g.f for g in shaken if np.any(g["gyro.saturated"] > 0.5))
    lost = [g for g in shaken if held and _folded(g, period)]
    shaken = [g for g in shaken if g not in lost]
    r = line_ratios(shaken, TABLE, GYRO, [taken(g, period, step) for g in shaken] if held else None)
    return Points(r.f, r.value, r.u, r.x, True, over, tuple(g.f for g in lost), period if held else 0.0)


def taken(gate: Gate, period: float, step: float) -> Gate:
    """Return the samples of a gyro that gives one each period (s), once each, at the times at which they were taken.

    Rows between two samples show the last one.  A sine through all rows would meet the images f_s - f, f_s + f ... of
    the held signal, which the rows, themselves samples, fold onto f where both rates have a common divisor.
    """
    number = np.floor(gate.t / period + 1e-6)
    times = np.ceil(number * period / step - 1e-3) * step
    rows = np.flatnonzero(np.diff(number, prepend=number[0] - 1.0))
    rows = rows[times[rows] > gate.t[0] - 0.5 * step]
    return replace(gate, t=times[rows], inside=slice(None), before=slice(0), channels={GYRO: gate[GYRO][rows]})


def _folded(gate: Gate, period: float) -> bool:
    """Return whether the image of a sampled sine is too near it: its sampling shows one phase only."""
    off = 2.0 * gate.f * period
    return abs(off - round(off)) / period < IMAGE / float(gate.t[-1] - gate.t[0]) and round(off) > 0
