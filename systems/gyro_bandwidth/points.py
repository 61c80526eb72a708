"""Points of a frequency response: from the phases of a run, or from the rows of a measured record."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import special

from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.loops.loop_measures import Gate, gates, neighbour_noise, phasor, response
from gyrobench.reduction.setup.window_checks import ReductionError

LEAST = 8  # frequencies
TABLE, GYRO = "table.rate_read", "gyro.rate[1]"
ROUNDING = 1e-6  # least relative uncertainty of a point
UNKNOWN = 1e-3  # of the points of a record that states none: any, the scatter about the curve takes its place
LINES = 12  # numbers from which neighbour_noise estimates


@dataclass(frozen=True)
class Points:
    """Frequencies (n,), Hz; gyro over table; relative u; amplitude of the table, rad/s; whether u is known."""

    f: Array
    value: np.ndarray[tuple[int], np.dtype[np.complex128]]
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
    rows = [(g.f, *_ratio(g), abs(phasor(g.t, g[TABLE], g.f))) for g in gates(record) if g.kind == "motion"]
    over = tuple(g.f for g in gates(record) if g.kind == "motion" and np.any(g["gyro.saturated"] > 0.5))
    f, value, u, table = (np.array(column) for column in zip(*rows, strict=True))
    return Points(f, value, u, table, True, over)


def _ratio(gate: Gate) -> tuple[complex, float]:
    """Return gyro over table, and its relative uncertainty by the lines beside the frequency."""
    t, x, y = gate.t, gate[TABLE], gate[GYRO]
    point = response(t, x, y, gate.f)
    noise = [neighbour_noise(t, signal, gate.f) for signal in (y, x)]
    if any(n is None for n in noise):
        return point.value, max(point.u or 0.0, ROUNDING)
    few = float(special.stdtrit(LINES, 0.975)) / NORMAL  # many points together: no allowance for few numbers
    sizes = [abs(phasor(t, signal, gate.f)) for signal in (y, x)]
    u = math.hypot(*(float(n or 0.0) / few / size for n, size in zip(noise, sizes, strict=True)))
    return point.value, max(u, ROUNDING)
