"""Points of the response and turns of the table: from the phases of a run, or from the rows of a measured record."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import integrate

from gyrobench.reduction.loops.loop_measures import Gate, gates
from gyrobench.reduction.loops.response_errors import line_ratios, stated_u
from gyrobench.reduction.toolkit import Array, Record, ReductionError, plain

from .model import AngleResponse
from .steps import LEAST, TableTurn, turns_of

FREQUENCIES = 8  # at least
SLOWEST, FASTEST = 1e-6, 1e6  # Hz: beyond there is no table, and powers of them exceed the numbers
TABLE, PICKOFF = "table.rate_read", "gyro.u"


@dataclass(frozen=True)
class ShakenPoints:
    """Response (None without sines), amplitudes of the table (n,), rad, whether u is known, turns, phases saturated."""

    response: AngleResponse | None
    table: Array
    known: bool = True
    turns: list[TableTurn] = field(default_factory=list)
    saturated: tuple[str, ...] = ()


def points_of(record: Record, K_sg: float, output: bool) -> ShakenPoints:
    """Return what a record holds; K_sg: V/rad.  Raises ReductionError."""
    if not record.run.measured:
        return _of_phases(record, K_sg, output)
    return _of_samples(record, K_sg, output) if "time" in record.windows else _of_rows(record, K_sg, output)


def _of_rows(record: Record, K_sg: float, output: bool) -> ShakenPoints:
    w = {n: np.asarray(v, dtype=float) for n, v in record.windows.items()}
    if np.any(w["table"] <= 0.0) or np.any(w["pickoff"] <= 0.0):
        raise ReductionError("table, pickoff: an amplitude is above 0; a lag belongs into phase")
    known, u = stated_u(w)
    value = np.asarray(w["pickoff"] / (K_sg * w["table"]) * np.exp(1j * w["phase"]), dtype=complex)
    return _checked(w["frequency"], value, u, w["table"], output, known)


def _of_samples(record: Record, K_sg: float, output: bool) -> ShakenPoints:
    t, theta, u = (np.asarray(record.windows[n], dtype=float) for n in ("time", "table", "pickoff"))
    if output:
        raise ReductionError("axis = output: steps are of the input axis, about which the float keeps an angle")
    turns = turns_of(t, theta, u / K_sg)
    if len(turns) < LEAST:
        raise ReductionError(f"{len(turns)} turns of the table with rests: at least {LEAST} are needed")
    return ShakenPoints(None, np.array([max(float(np.ptp(turn.theta)) for turn in turns)]), turns=turns)


def _of_phases(record: Record, K_sg: float, output: bool) -> ShakenPoints:
    moved = [g for g in gates(record) if g.kind == "motion"]
    step = float(record.run.step or 0.0)
    r = line_ratios([g for g in moved if g.shape == "sine"], TABLE, PICKOFF)
    s = 2j * np.pi * r.f
    # the gyro takes the angle for straight between two communication steps: sinc2(f h) of a sine, without lag
    value = s * r.value / K_sg / np.sinc(r.f * step) ** 2
    turns = [_turn(g, K_sg, float(record.run.options["rise"])) for g in moved if g.shape == "step"]
    over = tuple(g.label for g in moved if np.any(g["gyro.saturated"] > 0.5))
    points = _checked(r.f, value, r.u, r.x / np.abs(s), output, True)
    return ShakenPoints(points.response, points.table, True, turns, over)


def _turn(gate: Gate, K_sg: float, rise: float) -> TableTurn:
    """Return the turn there: from the second half of the rest before it to the turn back."""
    begin = float(gate.t[0])
    back = begin + gate.row.dwell - rise
    whole = slice(gate.before.start, gate.inside.stop)
    t = gate.channels["time"][whole]
    t, rate, u = (x[t < back] for x in (t, gate.channels[TABLE][whole], gate.channels[PICKOFF][whole]))
    theta = integrate.cumulative_trapezoid(rate, t, initial=0.0)  # of a whole turn exact: its rate is a whole sine
    before, after = t <= begin, t >= begin + rise
    theta[after] = theta[after].mean()  # its noise is that of an angle that wanders: the table rests
    theta[before] = 0.0
    return TableTurn(t, theta, u / K_sg, begin, begin + rise)


def _checked(f: Array, value: NDArray[Any], u: Array, table: Array, output: bool, known: bool) -> ShakenPoints:
    if f.size < FREQUENCIES:
        raise ReductionError(f"{f.size} frequencies: at least {FREQUENCIES} are needed")
    if np.unique(f).size < f.size:
        raise ReductionError("a frequency stands twice: one row for each is expected")
    if not (np.all(f > 0.0) and np.all(np.abs(value) > 0.0) and np.all(np.isfinite(value))):
        raise ReductionError("frequencies and amplitudes must be above 0")
    if f.min() < SLOWEST or f.max() > FASTEST:
        raise ReductionError(f"frequencies from {plain(f.min(), 3)} to {plain(f.max(), 3)} Hz: is their unit right?")
    order = np.argsort(f)
    return ShakenPoints(AngleResponse(f[order], value[order], u[order], output), table[order], known)
