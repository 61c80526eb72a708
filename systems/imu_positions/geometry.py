"""Positions of a table with two axes, what an instrument on it feels there, and what a plan determines.

The outer axis X of the table is level and points east, the inner axis Y at outer angle 0 north; at angles 0 the plate
lies level.  Plate axes at the angles x, y, and the specific force there:                            [SERVO2-A]

    A = R_y(y) R_x(x)        f = g (-cos x sin y, sin x, cos x cos y)

so that every direction of the plate can point up.  Turning about X at y = 0 is a rate about the x axis of the plate, at
y = 90° about its z axis; turning about Y one about its y axis.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gyrobench import frames
from gyrobench.arrays import Array
from gyrobench.reduction.estimation import regression

AXES = ("outer", "inner")
ANGLES = ("outer_start", "outer_end", "inner_start", "inner_end")  # columns of a record
POSITIONS = (6, 12, 18, 20, 24, 26, 36)
BOTH_WAYS = {24: 12, 36: 18}  # positions -> directions, each reached in both ways
TURN = 2.0 * math.pi
STILL = 1e-4  # rad that the table may move in a window at rest (20 arcsec: encoders jitter)
NODES = 8  # of a Gauss-Legendre rule over a quarter of a turn: exact to rounding for sines of a few turns
EXCITED = math.radians(0.5)  # rad/s, least root mean square of a rate that shows what multiplies it
LIMIT = 300.0  # of the condition of a design with scaled columns


def directions(count: int) -> list[tuple[float, ...]]:
    """Return directions of the plate that point up: its 6 faces, 12 edges, both (18), these with 8 corners (26), or the
    20 vertices of a dodecahedron: the corners, and (0, 1/p, p) with signs and turned round, p = (1 + sqrt 5)/2.
    """
    if count == 20:
        golden = (1.0 + math.sqrt(5.0)) / 2.0
        corners = list(itertools.product((1.0, -1.0), repeat=3))
        others = [(0.0, a / golden, b * golden) for a, b in itertools.product((1.0, -1.0), repeat=2)]
        return corners + [o[-k:] + o[:-k] for k in range(3) for o in others]
    wanted = {6: (1,), 12: (2,), 18: (1, 2), 26: (1, 2, 3)}[count]
    every = [d for d in itertools.product((0, 1, -1), repeat=3) if any(d)]
    return sorted((d for d in every if sum(map(abs, d)) in wanted), key=lambda d: sum(map(abs, d)))


def angles_of(direction: Sequence[float]) -> tuple[float, float]:
    """Return outer and inner angle that turn a direction of the plate upwards; the outer within a quarter of a turn."""
    u = np.asarray(direction, dtype=float) / float(np.linalg.norm(direction))
    x = math.asin(float(np.clip(u[1], -1.0, 1.0)))
    return x, 0.0 if abs(u[1]) > 1.0 - 1e-12 else math.atan2(-float(u[0]), float(u[2]))


def places(count: int) -> list[tuple[float, float]]:
    """Return outer and inner angle of each of so many positions.

    A direction is turned upwards in two ways, (x, y) and (180° - x, y + 180°): the case is then turned by half a turn
    about the vertical, and the level Earth rate in it has the other sign.  24 and 36 positions are 12 and 18 directions
    in both.
    """
    once = [angles_of(d) for d in directions(BOTH_WAYS.get(count, count))]
    if count not in BOTH_WAYS:
        return once
    return [*once, *((math.pi - x, y + math.pi) for x, y in once)]


@dataclass(frozen=True)
class SetUp:
    """Errors of the set-up, rad: the table turned about east, north, up; right angle of its axes; wobble of the outer
    and the inner axis (twice a turn, at this phase at angle 0); the instrument turned about its own axes.
    """

    turned: tuple[float, float, float] = (0.0, 0.0, 0.0)
    squareness: float = 0.0
    wobble: tuple[float, float] = (0.0, 0.0)
    phase: float = 0.0
    mount: tuple[float, float, float] = (0.0, 0.0, 0.0)


EXACT = SetUp()


def _rotation(vector: Sequence[float]) -> Array:
    size = float(np.linalg.norm(vector))
    return frames.rotation(np.asarray(vector, dtype=float), size) if size else np.eye(3)


@dataclass(frozen=True)
class Motion:
    """Angles of the table over windows: start and end (n,) of both axes, rad, and the length of each window, s."""

    outer: tuple[Array, Array]
    inner: tuple[Array, Array]
    length: Array

    @classmethod
    def of(cls, windows: Mapping[str, Array]) -> Motion:
        a = {n: np.asarray(windows[n], dtype=float) for n in (*ANGLES, "t_start", "t_end")}
        outer, inner = ((a[f"{n}_start"], a[f"{n}_end"]) for n in AXES)
        return cls(outer, inner, a["t_end"] - a["t_start"])

    @property
    def moved(self) -> Array:
        """The larger motion of the two axes in each window, rad."""
        return np.maximum(*(np.abs(end - start) for start, end in (self.outer, self.inner)))

    @property
    def at_rest(self) -> NDArray[np.bool_]:
        """True for windows at rest."""
        return np.asarray(self.moved <= STILL)

    def read(self, axis: int, order: int, sine: float, cosine: float) -> Motion:
        """Return the motion of a table whose encoder of an axis reads too much by this harmonic, rad."""
        both = [self.outer, self.inner]
        start, end = (q - sine * np.sin(order * q) - cosine * np.cos(order * q) for q in both[axis])
        both[axis] = start, end
        return Motion(both[0], both[1], self.length)

    def way(self, axis: int) -> Array:
        """Return 1 or -1 (n,) by the way that the axis was turned last, within the window or to it; 0: not yet."""
        start, end = (self.outer, self.inner)[axis]
        came, turned = np.append(0.0, start[1:] - end[:-1]), end - start
        moved = np.where(np.abs(turned) > STILL, turned, np.where(np.abs(came) > STILL, came, 0.0))
        last = np.maximum.accumulate(np.where(moved != 0.0, np.arange(moved.size), 0))
        return np.asarray(np.sign(moved[last]))

    def off(self, axis: int, error: float | Array) -> Motion:
        """Return the motion of a table whose axis stands by ``error`` (rad) further than it reads."""
        both = [self.outer, self.inner]
        both[axis] = both[axis][0] + error, both[axis][1] + error
        return Motion(both[0], both[1], self.length)

    def felt(self, latitude: float, gravity: float, earth_rate: float, error: SetUp = EXACT) -> tuple[Array, Array]:
        """Return inertial rate (n, 3), rad/s, and specific force (n, 3), m/s2, in axes of the case, means over the
        windows, in which both axes turn evenly.
        """
        n = self.length.size
        omega, force = np.empty((n, 3)), np.empty((n, 3))
        rest = self.at_rest
        quarters = max(1, math.ceil(float(self.moved.max(initial=0.0)) / (TURN / 4.0)))
        x, w = np.polynomial.legendre.leggauss(NODES)
        many = (
            (np.arange(quarters)[:, None] + (x + 1.0) / 2.0).ravel() / quarters,
            np.tile(w / 2.0, quarters) / quarters,
        )
        for rows, (place, weight) in ((rest, (np.array([0.5]), np.ones(1))), (~rest, many)):
            if not rows.any():
                continue
            q = [s[rows, None] + place * (e - s)[rows, None] for s, e in (self.outer, self.inner)]
            v = [np.broadcast_to(((e - s) / self.length)[rows, None], q[0].shape) for s, e in (self.outer, self.inner)]
            at = _plate(q, v, frames.earth_rate_local(latitude, earth_rate), gravity * frames.U, error)
            omega[rows], force[rows] = (np.einsum("nki,k->ni", values, weight) for values in at)
        return omega, force


def _plate(q: list[Array], v: list[Array], omega: Array, force: Array, error: SetUp) -> tuple[Array, Array]:
    """Return rate and specific force (n, k, 3) at angles and rates (n, k) of the two axes; as the part table_two_axis:
    passive elementary rotations one after the other, w <- R w + q' e, f <- R f.
    """
    base = _rotation(error.turned).T
    shape = q[0].shape
    w, f = (np.broadcast_to(base @ vector, (*shape, 3)).copy() for vector in (omega, force))

    def turn(axis: int, angle: Array, rate: Array) -> None:
        j, m = (axis + 1) % 3, (axis + 2) % 3
        c, s = np.cos(angle), np.sin(angle)
        for vector in (w, f):
            first, second = vector[..., j].copy(), vector[..., m].copy()
            vector[..., j], vector[..., m] = c * first + s * second, c * second - s * first
        w[..., axis] += rate

    for axis, cross in ((0, (1, 2)), (1, (2, 0))):
        if error.wobble[axis]:
            phase = 2.0 * q[axis] + error.phase
            c, s = error.wobble[axis] * np.cos(phase), error.wobble[axis] * np.sin(phase)
            turn(cross[0], c, -2.0 * s * v[axis])
            turn(cross[1], s, 2.0 * c * v[axis])
        turn(axis, q[axis], v[axis])
        if axis == 0 and error.squareness:
            turn(2, np.full(shape, error.squareness), np.zeros(shape))
    mount = _rotation(error.mount)
    return w @ mount, f @ mount  # rows: the transpose turns them


def accelerometer_columns(force: Array) -> Array:
    """Return what bias and row of the matrix of an accelerometer multiply: 1, f (n, 4)."""
    return np.column_stack([np.ones(len(force)), force])


def gyro_columns(omega: Array, force: Array, seen: Sequence[int]) -> Array:
    """Return what bias, elements of the matrix along the axes ``seen``, and g-sensitivity of a gyro multiply."""
    return np.column_stack([np.ones(len(force)), omega[:, list(seen)], force / frames.G0])


def rates_seen(omega: Array) -> tuple[int, ...]:
    """Return the axes (0, 1, 2) about which a plan turns fast enough to show what multiplies the rate.

    The Earth rate is not enough: an error of a scale factor of 1 % changes it by as much as 0.15 °/h of bias.
    """
    return tuple(k for k in range(3) if float(np.sqrt(np.mean(omega[:, k] ** 2))) > EXCITED)


def force_problems(up: Array) -> list[str]:
    """Return why unit vectors (n, 3) along the vertical, in axes of the case, cannot give bias and matrix."""
    names = ("bias", "x", "y", "z")
    if len(up) <= len(names):
        return [f"{len(up)} positions for {len(names)} unknowns of an instrument: at least {len(names) + 1}"]
    seen = regression.examine(accelerometer_columns(up), names)
    return [f"directions of gravity: {seen.weakness}"] if seen.condition > LIMIT else []


def unseen_rates(seen: Sequence[int]) -> list[str]:
    """Return what turns about these axes of the case leave undetermined, as sentences."""
    lost = [a for k, a in enumerate("xyz") if k not in seen]
    if not lost:
        return []
    which = "any axis" if len(lost) == 3 else " and ".join(lost)
    columns = ", ".join(f"Sg_x{a}, Sg_y{a}, Sg_z{a}" for a in lost)
    return [
        f"The plan does not turn about {which}; not estimable: {columns} (scale factors and misalignments of the "
        "gyros). They are taken as zero; u_gyro_scale states their uncertainty, which the Earth rate brings into the "
        "biases."
    ]
