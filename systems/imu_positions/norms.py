"""Three accelerometers at rest in unknown attitudes: what they read has the size of gravity in every one.

    |C (r/D - b)| = g,        C = (1 + S)^-1,   S lower triangular              [IMU-HAND; Tedaldi 2014, eq. 10]

Nine unknowns.  The case axes are those of the accelerometers: x along the input axis of the first, y in the plane of
the first two; a turn of the whole triad changes no size.  D: nominal scale factors, 1 for readings in m/s2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from gyrobench.arrays import Array
from gyrobench.reduction.estimation import regression

from .geometry import directions

PLACES = ((0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2))  # of S
NAMES = (*(f"Sa_{'xyz'[i]}{'xyz'[j]}" for i, j in PLACES), "ba_x", "ba_y", "ba_z")
LIMIT = 100.0  # of the condition of the design with scaled columns
LEAST = len(NAMES) + 1  # positions


@dataclass(frozen=True)
class Triad:
    """S (3, 3) and bias b (3,) of a triad, readings over D.  Readings and forces in the same unit."""

    matrix: Array
    bias: Array

    @classmethod
    def of(cls, unknowns: Array) -> Triad:
        """Return the triad of the nine unknowns, in the order of :data:`NAMES`."""
        S = np.zeros((3, 3))
        for value, place in zip(unknowns[:6], PLACES, strict=True):
            S[place] = value
        return cls(S, np.asarray(unknowns[6:], dtype=float))

    @property
    def inverse(self) -> Array:
        """C."""
        return np.asarray(np.linalg.inv(np.eye(3) + self.matrix), dtype=float)

    def force(self, readings: Array) -> Array:
        """Return specific forces (n, 3) from readings over D (n, 3)."""
        return np.asarray((readings - self.bias) @ self.inverse.T)


def slopes(triad: Triad, readings: Array) -> Array:
    """Return the change (n, 9) of the sizes of the forces for each unknown."""
    force = triad.force(readings)
    along = force / np.linalg.norm(force, axis=1)[:, None] @ triad.inverse  # C^T u
    return np.column_stack([*(-along[:, i] * force[:, j] for i, j in PLACES), *(-along.T)])


def nominal(readings: Array, gravity: float) -> Array:
    """Return scale factors (3,) of readings in counts per m/s2, one for all, and the middle of the counts (3,).

    They are those of the sphere that fits the readings.
    """
    middle = readings.mean(axis=0)
    r = readings - middle
    A = np.column_stack([2.0 * r, np.ones(len(r))])
    centre = np.linalg.lstsq(A, np.sum(r**2, axis=1), rcond=None)[0]
    radius = float(np.sqrt(max(centre[3] + centre[:3] @ centre[:3], 1e-300)))
    return np.array([np.full(3, radius / gravity), middle + centre[:3]])


def solve(readings: Array, gravity: float, start: Array) -> Triad:
    """Return the triad that fits readings over D (n, 3) best, from the nine unknowns ``start``."""

    def left(unknowns: Array) -> Array:
        return np.asarray(np.linalg.norm(Triad.of(unknowns).force(readings), axis=1) - gravity)

    def jacobian(unknowns: Array) -> Array:
        return slopes(Triad.of(unknowns), readings)

    return Triad.of(least_squares(left, start, jacobian, x_scale="jac", xtol=1e-15, ftol=1e-15, gtol=1e-15).x)


def problems(up: Array) -> list[str]:
    """Return why the directions of gravity (n, 3), unit vectors in axes of the case, do not determine nine unknowns."""
    if len(up) < LEAST:
        return [
            f"{len(up)} positions for nine unknowns of three accelerometers in unknown attitudes: at least {LEAST}, "
            "spread over all directions"
        ]
    seen = regression.examine(slopes(Triad(np.zeros((3, 3)), np.zeros(3)), up), NAMES)
    if seen.condition <= LIMIT:
        return []
    return [f"directions of gravity in unknown attitudes: {seen.weakness}; missing: {_missing(up)}"]


def _missing(up: Array) -> str:
    """Return which directions of faces, edges and corners are farthest from those that there are, in words."""
    wanted = [np.array(d, dtype=float) for d in directions(26)]
    alone = [(float(np.max(up @ d / np.linalg.norm(d))), d) for d in wanted]
    alone.sort(key=lambda pair: pair[0])
    return ", ".join(_direction(d) for _, d in alone[:4]) + " up"


def _direction(d: Array) -> str:
    return "".join(f"{'+' if v > 0 else '−'}{a}" for v, a in zip(d, "xyz", strict=True) if v)
