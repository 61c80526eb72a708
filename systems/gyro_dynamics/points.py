"""Points of the response and turns of the table: from the phases of a run, or from the rows of a measured record."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy import integrate

from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.reduction.loops.loop_measures import Gate, gates, phasor
from gyrobench.reduction.loops.response_errors import line_ratio
from gyrobench.reduction.setup.window_checks import ReductionError

from .model import AngleResponse, Complex
from .steps import LEAST, Turn, turns_of

FREQUENCIES = 8  # at least
TABLE, PICKOFF = "table.rate_read", "gyro.u"
UNKNOWN = 1e-3  # of the points of a record that states none: any, the scatter about the curve takes its place


@dataclass(frozen=True)
class Points:
    """Response (None without sines), amplitudes of the table (n,), rad, whether u is known, turns, phases saturated."""

    response: AngleResponse | None
    table: Array
    known: bool = True
    turns: list[Turn] = field(default_factory=list)
    saturated: tuple[str, ...] = ()


def points_of(record: Record, K_sg: float, output: bool) -> Points:
    """Return what a record holds; K_sg: V/rad.  Raises ReductionError."""
    if not record.run.measured:
        return _of_phases(record, K_sg, output)
    return _of_samples(record, K_sg, output) if "time" in record.windows else _of_rows(record, K_sg, output)


def _of_rows(record: Record, K_sg: float, output: bool) -> Points:
    w = {n: np.asarray(v, dtype=float) for n, v in record.windows.items()}
    if np.any(w["table"] <= 0.0) or np.any(w["pickoff"] <= 0.0):
        raise ReductionError("table, pickoff: an amplitude is above 0; a lag belongs into phase")
    known = "u" in w and bool(np.all(np.isfinite(w["u"])))
    if known and np.any(w["u"] <= 0.0):
        raise ReductionError("u: a relative standard uncertainty above 0 is expected")
    u = w["u"] if known else np.full(w["table"].size, UNKNOWN)
    value: Complex = w["pickoff"] / (K_sg * w["table"]) * np.exp(1j * w["phase"])
    return _checked(w["frequency"], value, u, w["table"], output, known)


def _of_samples(record: Record, K_sg: float, output: bool) -> Points:
    t, theta, u = (np.asarray(record.windows[n], dtype=float) for n in ("time", "table", "pickoff"))
    if output:
        raise ReductionError("axis = output: steps are of the input axis, about which the float keeps an angle")
    turns = turns_of(t, theta, u / K_sg)
    if len(turns) < LEAST:
        raise ReductionError(f"{len(turns)} turns of the table with rests: at least {LEAST} are needed")
    return Points(None, np.array([max(float(np.ptp(turn.theta)) for turn in turns)]), turns=turns)


def _of_phases(record: Record, K_sg: float, output: bool) -> Points:
    moved = [g for g in gates(record) if g.kind == "motion"]
    step = float(record.run.step or 0.0)
    rows = []
    for g in (g for g in moved if g.shape == "sine"):
        s = 2j * np.pi * g.f
        value, noise = line_ratio(g, TABLE, PICKOFF)
        # the gyro takes the angle for straight between two communication steps: sinc2(f h) of a sine, without lag
        rows.append((g.f, s * value / K_sg / np.sinc(g.f * step) ** 2, noise, abs(phasor(g.t, g[TABLE], g.f) / s)))
    turns = [_turn(g, K_sg, float(record.run.options["rise"])) for g in moved if g.shape == "step"]
    over = tuple(g.label for g in moved if np.any(g["gyro.saturated"] > 0.5))
    f, u, table = (np.array([float(row[k].real) for row in rows]) for k in (0, 2, 3))
    points = _checked(f, np.array([row[1] for row in rows]), u, table, output, True)
    return Points(points.response, points.table, True, turns, over)


def _turn(gate: Gate, K_sg: float, rise: float) -> Turn:
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
    return Turn(t, theta, u / K_sg, begin, begin + rise)


def _checked(f: Array, value: Complex, u: Array, table: Array, output: bool, known: bool) -> Points:
    if f.size < FREQUENCIES:
        raise ReductionError(f"{f.size} frequencies: at least {FREQUENCIES} are needed")
    if np.unique(f).size < f.size:
        raise ReductionError("a frequency stands twice: one row for each is expected")
    if not (np.all(f > 0.0) and np.all(np.abs(value) > 0.0) and np.all(np.isfinite(value))):
        raise ReductionError("frequencies and amplitudes must be above 0")
    order = np.argsort(f)
    return Points(AngleResponse(f[order], value[order], u[order], output), table[order], known)
