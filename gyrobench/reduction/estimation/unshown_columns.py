"""Coverage intervals with columns in the model that a record hardly shows, and that could move its estimates far.

Weighed as nuisances they would widen every u; as the intervals of a reason they ask a verdict to hold with them too.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from gyrobench import units
from gyrobench.arrays import Array
from gyrobench.result import Coefficient

FADES = (2.5, 10.0)  # time constants in a position, of what fades after it was taken
HEATS = (0.05, 0.3)  # of a record, in which what is heated warms and cools


def fading(up: Array, t0: Array, t1: Array) -> Array:
    """Return the columns (n, 3) of what fades after an axis was turned over, as heat that another attitude moves does,
    and of a trend; up (n,): sense of the axis in each reading.
    """
    turns = np.concatenate([[0], np.flatnonzero(np.diff(up)) + 1])
    place = np.searchsorted(turns, np.arange(up.size), side="right") - 1
    whole = np.append(t1[turns[1:] - 1], t1[-1]) - t0[turns]
    since = ((t0 + t1) / 2.0 - t0[turns][place]) / whole[place]
    fades = np.where(place > 0, up, 0.0)[:, None] * np.exp(-since[:, None] * np.array(FADES))
    return np.column_stack([fades, t0 - t0.mean()])


def heating(power: Array, t0: Array, t1: Array) -> Array:
    """Return the columns (n, 2) of what warms by the power (n,) of the readings, which goes on between two of them that
    are not apart, and cools without: means over the readings.
    """
    length, gap = t1 - t0, np.append(t0[1:] - t1[:-1], 0.0)
    between = np.where(gap <= length, power, 0.0)
    out = np.empty((power.size, len(HEATS)))
    for k, tau in enumerate(share * float(t1[-1] - t0[0]) for share in HEATS):
        warm = 0.0
        for j, (p, L, q, pause) in enumerate(zip(power, length, between, gap, strict=True)):
            left = -math.expm1(-L / tau)
            out[j, k] = p + (warm - p) * left * tau / L
            warm += (p - warm) * left
            warm += (q - warm) * -math.expm1(-pause / tau)
    return out


def intervals_with(X: Array, y: Array, more: Array, found: Sequence[Coefficient]) -> dict[str, tuple[float, float]]:
    """Return the hull of each coefficient's interval and that with the columns ``more`` (n, k), printed units.

    X (n, p), y (n,): model and data, of the first p coefficients found.  The estimates are of plain least squares, and
    U grows as u there.  Nothing where too few degrees of freedom are left, or a column is one of the model.
    """
    more = more[:, np.any(more != 0.0, axis=0)]
    wide = np.column_stack([X, more])
    own = wide / np.linalg.norm(wide, axis=0)
    if wide.shape[0] < wide.shape[1] + 3 or np.linalg.cond(own) > 1e6:
        return {}
    (_, u), (other, u_other) = _least_squares(X, y), _least_squares(wide, y)
    out = {}
    for k, c in enumerate(found[: u.size]):
        middle = float(other[k]) / units.factor(c.unit)
        U = (c.interval[1] - c.estimate) * float(u_other[k] / u[k])
        out[c.name] = (min(c.interval[0], middle - U), max(c.interval[1], middle + U))
    return out


def _least_squares(X: Array, y: Array) -> tuple[Array, Array]:
    """Return the coefficients and their standard uncertainties under white noise."""
    Q, R = np.linalg.qr(X)
    back = np.linalg.inv(R)
    left = y - Q @ (Q.T @ y)
    sigma = max(float(np.linalg.norm(left)), 1e-300) / math.sqrt(y.size - X.shape[1])
    return back @ (Q.T @ y), np.linalg.norm(back, axis=1) * sigma
