"""Readings taken before gyro or table had settled, or after they moved on, as the dwells of a measured record show.

Of each dwell with three readings or more: what its first reading (a) and its last one (b) are above the mean of those
between.  Stationary noise is the same backwards in time, a drift that is linear within the dwells gives a = -b, so

* a + b has the mean 0: a t test over the dwells; it has not where each of them settles from the same side;
* a + b and a - b are not correlated, since a and b scatter alike (Pitman and Morgan, 1939), neither as they are nor by
  their ranks, which no single outlier moves; they are where the sense of settling is that of the step before the dwell.

Either is said where its p, times the number of tests of the record, is below LEVEL.  The effect upon the mean of n
readings is then of the size of its uncertainty or more (4/sqrt(n) times), and the same in every dwell of its kind: no
residual of a fit to dwells shows it.  [own derivation]

Not seen: dwells of one or two readings, fewer than DWELLS of them, settling that is slower than a dwell.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from scipy import special

from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.result import Reason

DWELLS = 8  # least number
LEVEL = 1e-3  # probability that a record that has settled is named
#: what is the same throughout a dwell
SAME = ("phase", "rate", "frequency", "level", "up", "turned", "angle_", "outer_", "inner_")
WARMING = ("since", "turn_on")  # of a test of settling itself


def unsettled(record: Record, names: list[str]) -> list[Reason]:
    """Return that the ends of the dwells are not as what lies between; names: of the columns of readings."""
    w = record.windows
    if any(n in w for n in WARMING):
        return []
    dwells = _dwells(w, names)
    tested = [(n, *_tested(ends), ends) for n in names if (ends := _ends(w[n], dwells)) is not None]
    limit = LEVEL / max(2 * len(tested), 1)
    said = [_said(name, by_mean, ends) for name, by_mean, p, ends in tested if p < limit]
    if not said:
        return []
    text = (
        f"Dwells hold readings of gyro or table not at rest ({'; '.join(said)}; p < 0.001), taken before they had "
        "settled, or after they moved on. What these differ by is in the coefficients, not in the uncertainties. "
        "Leave such readings out, or wait longer."
    )
    return [Reason("record.unsettled", text, blocks=("pass", "fail"), severity="doubt")]


def _dwells(w: dict[str, Array], names: list[str]) -> list[slice]:
    """Return the stretches of three rows or more in which nothing but time and readings (names) changes."""
    kept = [np.asarray(v, dtype=float) for n, v in w.items() if n.startswith(SAME) and n not in names]
    n = len(w["t_start"]) if "t_start" in w else 0
    if n == 0 or not kept:
        return []
    table = np.column_stack(kept)
    edge = np.flatnonzero(np.any(table[1:] != table[:-1], axis=1)) + 1
    ends = [0, *edge.tolist(), n]
    return [slice(a, b) for a, b in pairwise(ends) if b - a > 2]


def _ends(values: Array, dwells: list[slice]) -> Array | None:
    """Return first and last reading of each dwell above the mean of those between, (m, 2); None: too few to say."""
    y = np.asarray(values, dtype=float)
    found = np.array([[y[d][0], y[d][-1]] - np.mean(y[d][1:-1]) for d in dwells])
    found = found[np.all(np.isfinite(found), axis=1)] if found.size else found
    return found if len(found) >= DWELLS and np.all(np.std(found, axis=0) > 0.0) else None


def _tested(ends: Array) -> tuple[bool, float]:
    """Return whether the test of the means is the likelier one, and the less p of both."""
    m, even, odd = len(ends), ends.sum(axis=1), ends[:, 0] - ends[:, 1]
    if not (np.std(even) > 0.0 and np.std(odd) > 0.0):  # readings in steps larger than their noise
        return True, 1.0
    t = float(even.mean() / np.std(even, ddof=1)) * math.sqrt(m)
    ranks = [np.argsort(np.argsort(v)) for v in (even, odd)]
    r = min(abs(float(np.corrcoef(x, y)[0, 1])) for x, y in ((even, odd), ranks))
    by_scatter = r * math.sqrt((m - 2) / max(1.0 - r * r, 1e-12))
    aside, scattered = (2.0 * float(special.stdtr(dof, -x)) for dof, x in ((m - 1, abs(t)), (m - 2, by_scatter)))
    return aside < scattered, min(aside, scattered)


def _said(name: str, by_mean: bool, ends: Array) -> str:
    mean, scatter = np.mean(ends, axis=0), np.std(ends, axis=0, ddof=1)
    k = int(np.argmax(np.abs(mean) if by_mean else scatter))
    which, others = ("first", "last") if k == 0 else ("last", "first")
    if by_mean:
        off = plain(mean[k] / scatter[1 - k], 2, "+").replace("-", "−")
        return f"{name}: the {which} one lies {off} standard deviations off"
    return f"{name}: the {which} ones scatter {plain(scatter[k] / scatter[1 - k])} times the {others} ones"
