"""Turns between positions at rest: what the gyros must read for gravity to be found where it is afterwards.

    u_k+1 = Q_k^T E^T u_k,    Q_k: product of the turns of each sample, from (1 + S)^-1 (r/D - b)
                                                                          [IMU-HAND; Tedaldi 2014, eq. 11..13]

u: directions of gravity in axes of the case, from the accelerometers; b: mean of the readings at rest before and after.
A sample's rotation vector is the trapezoid of the rate with the first coning term, w_1 x w_2 h2/12 [Savage 1998].
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from gyrobench.arrays import Array

STEP = 1e-6  # of S, for slopes
GUESSES = 90  # of a scale factor that is not known
TURNED = (0.15, 15.0)  # rad, between which the mean turn lies where it is not known
FEW = 12  # turns that a guess looks at


@dataclass(frozen=True)
class Turn:
    """One turn: times (m,), readings over D less the bias (m, 3), directions of gravity before and after (3,)."""

    time: Array
    rate: Array
    before: Array
    after: Array

    def rotation(self, inverse: Array) -> Array:
        """Return Q (3, 3), columns: axes of the case afterwards in those before."""
        w = self.rate @ inverse.T
        h = np.diff(self.time)[:, None]
        vector = 0.5 * h * (w[1:] + w[:-1]) + h * h / 12.0 * np.cross(w[:-1], w[1:])
        size = np.linalg.norm(vector, axis=1)
        sine = 0.5 * np.sinc(0.5 * size / np.pi)
        return _matrix(_product(np.column_stack([np.cos(0.5 * size), vector * sine[:, None]])))

    @property
    def tangents(self) -> Array:
        """Two directions (2, 3) at right angles to gravity afterwards."""
        return across(self.after)


def across(direction: Array) -> Array:
    """Return two directions (2, 3) at right angles to a unit vector and to one another."""
    least = np.eye(3)[int(np.argmin(np.abs(direction)))]
    first = np.cross(direction, least)
    first /= np.linalg.norm(first)
    return np.array([first, np.cross(direction, first)])


def _times(a: Array, b: Array) -> Array:
    """Return products of quaternions (n, 4), scalar first."""
    w, x, y, z = a.T
    W, X, Y, Z = b.T
    return np.column_stack([
        w * W - x * X - y * Y - z * Z, w * X + x * W + y * Z - z * Y,
        w * Y - x * Z + y * W + z * X, w * Z + x * Y - y * X + z * W,
    ])  # fmt: skip


def _product(q: Array) -> Array:
    """Return the product of quaternions (n, 4) in their order."""
    while len(q) > 1:
        if len(q) % 2:
            q = np.vstack([q, [[1.0, 0.0, 0.0, 0.0]]])
        q = _times(q[::2], q[1::2])
    return np.asarray(q[0] / np.linalg.norm(q[0]))


def _matrix(q: Array) -> Array:
    w, v = q[0], q[1:]
    cross = np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
    out: Array = np.eye(3) + 2.0 * w * cross + 2.0 * cross @ cross
    return out


def left(turns: list[Turn], matrix: Array) -> Array:
    """Return by how much gravity is found off, along two tangents of each turn (2 n,), rad; matrix: S (3, 3)."""
    inverse: Array = np.linalg.inv(np.eye(3) + matrix)
    found = (t.tangents @ (t.rotation(inverse).T @ t.before) for t in turns)
    return np.concatenate(list(found))


def slopes(turns: list[Turn], matrix: Array) -> Array:
    """Return the change (2 n, 9) of :func:`left` for each element of S, row by row."""
    columns = []
    for k in range(9):
        change = STEP * np.eye(9)[k].reshape(3, 3)
        columns.append((left(turns, matrix + change) - left(turns, matrix - change)) / (2.0 * STEP))
    return np.column_stack(columns)


def solve(turns: list[Turn], start: Array) -> Array:
    """Return S (3, 3) that fits best."""

    def of(unknowns: Array) -> Array:
        return left(turns, unknowns.reshape(3, 3))

    found = least_squares(of, start.ravel(), lambda x: slopes(turns, x.reshape(3, 3)), method="lm", xtol=1e-12)
    return np.asarray(found.x.reshape(3, 3))


def nominal(turns: list[Turn], known: bool) -> tuple[float, Array]:
    """Return the scale factor (readings over rate; 1 where it is ``known``) and the signed permutation P (3, 3) of the
    axes with which gravity is found best: readings = scale P rate.  Unit matrix: the axes are labelled as those of the
    accelerometers.
    """
    some = sorted(turns, key=lambda t: -float(np.max(np.abs(t.before - t.after))))[:FEW]
    angles = [float(np.linalg.norm(np.trapezoid(t.rate, t.time, axis=0))) for t in some]
    middle = float(np.median(angles)) or 1.0
    scales = [1.0] if known else [middle / a for a in np.geomspace(*TURNED, GUESSES)]
    identity = min(scales, key=lambda s: _off(some, s * np.eye(3)))
    good = _off(some, identity * np.eye(3))
    if good < 0.15:  # rad: a turn by hand is found to some degrees with nominal scale factors
        return identity, np.eye(3)
    guesses = scales if known else scales[::2]
    best = min(((_off(some, s * p), s, k) for k, p in enumerate(_signed()) for s in guesses), key=lambda g: g[0])
    return (best[1], list(_signed())[best[2]]) if best[0] < 0.5 * good else (identity, np.eye(3))


def _off(turns: list[Turn], matrix: Array) -> float:
    """Return the root mean square of what gravity is found off by, readings = matrix · rate."""
    return float(np.sqrt(np.mean(left(turns, matrix - np.eye(3)) ** 2)))


def _signed() -> Iterator[Array]:
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            p = np.zeros((3, 3))
            p[range(3), order] = signs
            yield p


def headings(turns: list[Turn], inverse: Array, first: Array) -> list[Array]:
    """Return two level directions (2, 3) in axes of the case at each position: those of the first, carried along."""
    level = across(first)
    found = [level]
    for t in turns:
        level = level @ t.rotation(inverse)
        level = level - np.outer(level @ t.after, t.after)
        found.append(level)
    return found
