"""Turns between positions at rest: what the gyros must read for gravity to be found where it is afterwards.

    u_k+1 = Q_k^T E^T u_k,    Q_k: product of the turns of each sample, from (1 + S)^-1 (r/D - b)
                                                                          [IMU-HAND; Tedaldi 2014, eq. 11..13]

u: directions of gravity in axes of the case, from the accelerometers; b: mean of the readings at rest before and after.
A sample's rotation vector is the trapezoid of the rate with the first coning term, w_1 x w_2 h2/12 [Savage 1998].
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from gyrobench.arrays import Array

from .mistakes import signed_permutations

STEP = 1e-6  # of S, for slopes
LEVI_CIVITA = np.cross(np.eye(3)[:, None], np.eye(3)[None]).transpose(2, 0, 1)  # (i, j, k): i of e_j x e_k
GUESSES = 90  # of a scale factor that is not known
TURNED = (0.15, 15.0)  # rad, between which the mean turn lies where it is not known
GOOD = 0.15  # rad: a turn by hand is found to some degrees with nominal scale factors
FEW = 12  # turns that a guess looks at
COARSE = 64  # steps of such a turn: 0.25 rad each at most


@dataclass(frozen=True)
class Turn:
    """One turn: times (m,), readings over D less the bias (m, 3), directions of gravity before and after (3,); at: the
    position before it.
    """

    time: Array
    rate: Array
    before: Array
    after: Array
    at: int = 0

    def rotations(self, inverses: Array) -> Array:
        """Return Q (b, 3, 3) for several inverses (b, 3, 3) of 1 + S; columns: axes afterwards in those before."""
        w = np.einsum("bij,mj->bmi", inverses, self.rate)
        h = np.diff(self.time)[:, None]
        vector = 0.5 * h * (w[:, 1:] + w[:, :-1]) + h * h / 12.0 * np.cross(w[:, :-1], w[:, 1:])
        return _product(vector)

    def thinned(self, steps: int) -> Turn:
        """Return the turn in so many steps at most, each the mean of its rates: for a guess, no fit."""
        every = -(-(self.time.size - 1) // steps)
        if every < 2:
            return self
        cuts = np.minimum(np.arange(0, self.time.size - 1 + every, every), self.time.size - 1)
        mean = np.diff(cumulative_trapezoid(self.rate, self.time, axis=0, initial=0.0)[cuts], axis=0)
        mean /= np.diff(self.time[cuts])[:, None]
        middle = 0.5 * (self.time[cuts][1:] + self.time[cuts][:-1])
        time = np.concatenate([self.time[:1], middle, self.time[-1:]])
        return replace(self, time=time, rate=np.concatenate([mean[:1], mean, mean[-1:]]))

    def path(self, inverse: Array) -> Array:
        """Return the direction of gravity (m, 3) at each sample, as the gyros carry it on from the start."""
        w = self.rate @ inverse.T
        h = np.diff(self.time)[:, None]
        q = Rotation.from_rotvec(0.5 * h * (w[1:] + w[:-1])).as_quat()
        reach = 1
        while reach < len(q):  # products of the first 1, 2, 4 ... turns
            longer = (Rotation.from_quat(q[:-reach]) * Rotation.from_quat(q[reach:])).as_quat()
            q = np.concatenate([q[:reach], longer])
            reach *= 2
        return np.vstack([self.before, Rotation.from_quat(q).inv().apply(self.before)])

    def rotation(self, inverse: Array) -> Array:
        """Return Q (3, 3) for one inverse."""
        return np.asarray(self.rotations(inverse[None])[0])

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


def _product(vectors: Array) -> Array:
    """Return products (b, 3, 3) of turns by rotation vectors (b, m, 3), in the order of m: of pairs, then of those."""
    angle = np.linalg.norm(vectors, axis=2)[..., None, None]
    cross = np.einsum("ijk,bmj->bmik", LEVI_CIVITA, vectors)
    square = vectors[..., None] * vectors[..., None, :]
    half = np.sinc(angle / (2.0 * np.pi))
    Q = np.cos(angle) * np.eye(3) + np.sinc(angle / np.pi) * cross + 0.5 * half * half * square
    while Q.shape[1] > 1:
        odd = Q[:, -1:] if Q.shape[1] % 2 else Q[:, :0]
        Q = np.concatenate([Q[:, 0 : Q.shape[1] - odd.shape[1] : 2] @ Q[:, 1::2], odd], axis=1)
    return np.asarray(Q[:, 0])


def _left(turns: list[Turn], matrices: Array) -> Array:
    """Return what gravity is found off by (b, 2 n), rad, for several S (b, 3, 3)."""
    inverses: Array = np.asarray(np.linalg.inv(np.eye(3) + matrices), dtype=float)
    each = [t.before @ t.rotations(inverses) @ t.tangents.T for t in turns]
    return np.concatenate(each, axis=1)


def left(turns: list[Turn], matrix: Array) -> Array:
    """Return by how much gravity is found off, along two tangents of each turn (2 n,), rad; matrix: S (3, 3)."""
    return np.asarray(_left(turns, matrix[None])[0])


def slopes(turns: list[Turn], matrix: Array) -> Array:
    """Return the change (2 n, 9) of :func:`left` for each element of S, row by row."""
    steps = STEP * np.eye(9).reshape(9, 3, 3)
    both = _left(turns, np.concatenate([matrix + steps, matrix - steps]))
    return np.asarray((both[:9] - both[9:]).T / (2.0 * STEP))


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
    some = _largest(turns)
    angles = [float(np.linalg.norm(np.trapezoid(t.rate, t.time, axis=0))) for t in some]
    middle = float(np.median(angles)) or 1.0
    scales = [1.0] if known else [middle / a for a in np.geomspace(*TURNED, GUESSES)]
    each = _offs(some, np.array([s * np.eye(3) for s in scales]))
    identity, good = scales[int(np.argmin(each))], float(np.min(each))
    if good < GOOD:
        return identity, np.eye(3)
    best = (0.5 * good, identity, np.eye(3))
    for p in signed_permutations():
        each = _offs(some, np.array([s * p for s in scales]))
        k = int(np.argmin(each))
        if each[k] < best[0]:
            best = float(each[k]), scales[k], p
    return best[1], best[2]


def factor(turns: list[Turn]) -> float:
    """Return by what factor the readings are too large: 1 where gravity is found with them, or with no factor."""
    some = _largest(turns)
    if _offs(some, np.eye(3)[None])[0] < GOOD:
        return 1.0
    scale, axes = nominal(turns, False)
    if not _offs(some, scale * axes[None])[0] < GOOD:
        return 1.0
    near = solve([replace(t, rate=t.rate @ axes / scale) for t in some], np.zeros((3, 3)))
    return scale * (1.0 + float(np.trace(near)) / 3.0)


def _largest(turns: list[Turn]) -> list[Turn]:
    """Return the turns that a guess looks at, those that carry gravity farthest, in few steps each."""
    return [t.thinned(COARSE) for t in sorted(turns, key=lambda t: -float(np.max(np.abs(t.before - t.after))))[:FEW]]


def _offs(turns: list[Turn], matrices: Array) -> Array:
    """Return the root mean square (b,) of what gravity is found off by, readings = matrix · rate."""
    return np.asarray(np.sqrt(np.mean(_left(turns, matrices - np.eye(3)) ** 2, axis=1)))


def headings(turns: list[Turn], inverse: Array, first: Array) -> list[Array]:
    """Return two level directions (2, 3) in axes of the case at each position: those of the first, carried along."""
    level = across(first)
    found = [level]
    for t in turns:
        level = level @ t.rotation(inverse)
        level = level - np.outer(level @ t.after, t.after)
        found.append(level)
    return found
