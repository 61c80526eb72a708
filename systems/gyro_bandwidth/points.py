"""Points of a frequency response: from the phases of a run, or from the rows of a measured record."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.reduction.loops.loop_measures import gates
from gyrobench.reduction.loops.open_loop import lead_of
from gyrobench.reduction.loops.response_errors import line_ratios
from gyrobench.reduction.setup.window_checks import ReductionError

LEAST = 8  # frequencies
TABLE, GYRO = "table.rate_read", "gyro.rate[1]"
UNKNOWN = 1e-3  # of the points of a record that states none: any, the scatter about the curve takes its place


@dataclass(frozen=True)
class Points:
    """Frequencies (n,), Hz; gyro over table; relative u; amplitude of the table, rad/s; whether u is known."""

    f: Array
    value: NDArray[Any]
    u: Array
    table: Array
    known: bool = True
    saturated: tuple[float, ...] = ()  # frequencies at which the gyro was beyond its range


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
    return Points(found.f[order], found.value[order], found.u[order], found.table[order], found.known, found.saturated)


def _of_rows(record: Record) -> Points:
    w = {n: np.asarray(v, dtype=float) for n, v in record.windows.items()}
    if np.any(w["table"] <= 0.0):
        raise ReductionError("table: the amplitude of a rate is above 0; a lag belongs into phase")
    known = "u" in w and bool(np.all(np.isfinite(w["u"])))
    if known and np.any(w["u"] <= 0.0):
        raise ReductionError("u: a relative standard uncertainty above 0 is expected")
    u = w["u"] if known else np.full(w["table"].size, UNKNOWN)
    return Points(w["frequency"], w["gyro"] / w["table"] * np.exp(1j * w["phase"]), u, w["table"], known)


def _of_phases(record: Record) -> Points:
    shaken = [g for g in gates(record) if g.kind == "motion"]
    over = tuple(g.f for g in shaken if np.any(g["gyro.saturated"] > 0.5))
    r = line_ratios(shaken, TABLE, GYRO)
    held = float(record.run.parameters.get("gyro.period") or 0.0) > record.run.step
    late = lead_of(record, {"gyro": 0.0}) + 0.5 * record.run.step * held  # a sample is held until the next one
    return Points(r.f, r.value * np.exp(-2j * np.pi * r.f * late), r.u, r.x, True, over)
