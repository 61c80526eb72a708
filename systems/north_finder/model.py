"""What the windows of each method say of the heading: design, unknowns, and the heading as their function."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.setup.window_checks import ReductionError

LEAST = {"two": 2, "four": 4, "several": 3, "strapdown two": 2}  # positions
STEEP = math.radians(85.0)


@dataclass(frozen=True)
class LocalEarth:
    """Horizontal and vertical Earth rate (rad/s), gravity (m/s2); rough: rough heading, rad."""

    north: float
    up: float
    gravity: float
    rough: float = 0.0


@dataclass(frozen=True)
class Force:
    """Specific force of the head at table angle 0 along x and y (m/s2), and its standard uncertainties by noise."""

    x: float
    y: float
    u_x: float
    u_y: float


@dataclass(frozen=True)
class Problem:
    """y = X a + noise over rows of t_start, t_end; ``heading``: a -> heading and horizontal rate (the latter NaN where
    the method takes it for known), ``bias``: index of the bias in a, -1 without.  along: (n,) angle of y from the
    reference, clockwise; axis: 1 of rows of y, 0 of x.  Where the tilt is read, force, and rates: a -> rates of the
    head along x and y at table angle 0.
    """

    names: tuple[str, ...]
    X: Array
    y: Array
    t_start: Array
    t_end: Array
    heading: Callable[[Array], tuple[float, float]]
    bias: int
    along: Array
    axis: Array
    force: Force | None = None
    rates: Callable[[Array], tuple[float, float]] | None = None


def attitude(x: float, y: float, gravity: float) -> tuple[float, float]:
    """Return pitch and roll from the specific force along x and y.  Raises ReductionError beyond 85 deg."""
    s = y / gravity
    theta = math.asin(s) if abs(s) < 1.0 else math.pi / 2.0
    right = -x / gravity / max(math.cos(theta), 1e-9)
    if abs(theta) > STEEP or abs(right) > math.sin(STEEP):
        raise ReductionError(
            "f_x, f_y: pitch or roll beyond 85°, or a unit is wrong (specific force of a level head: 0)"
        )
    return theta, math.asin(right)


def tilted_heading(rates: tuple[float, float], x: float, y: float, place: LocalEarth) -> tuple[float, float]:
    """Return heading and horizontal rate from the rates and forces along x and y, at any tilt.  [NORTH-STRAPDOWN]"""
    theta, gamma = attitude(x, y, place.gravity)
    st, ct, sg, cg = math.sin(theta), math.cos(theta), math.sin(gamma), math.cos(gamma)
    east = -(rates[0] * ct - rates[1] * sg * st + place.up * sg)
    north = (rates[1] - place.up * st) * cg
    return math.atan2(east, north), math.hypot(east, north) / (ct * cg)


def _read(columns: Array, values: Array) -> tuple[Array, Array]:
    """Return the constants (p,) of readings and their standard uncertainties, by least squares."""
    found: Array = np.asarray(np.linalg.lstsq(columns, values, rcond=None)[0], dtype=float)
    dof = max(values.size - columns.shape[1], 1)
    sigma = float(np.linalg.norm(values - columns @ found)) / math.sqrt(dof)
    u: Array = np.asarray(sigma * np.sqrt(np.diag(np.linalg.inv(columns.T @ columns))))
    return found, u


def of_windows(method: str, w: Mapping[str, Array], place: LocalEarth) -> Problem:
    """Return the problem of a method.  Raises ReductionError for windows that do not carry it."""
    missing = [n for n in NEEDED.get(method, ()) if n not in w]
    if missing:
        raise ReductionError(f"method {method}: column {', '.join(missing)} is missing")
    a0, a1 = np.asarray(w["angle_start"], dtype=float), np.asarray(w["angle_end"], dtype=float)
    half = (a1 - a0) / 2.0
    damping = np.sinc(half / math.pi)  # of cos and sin by averaging over the window
    middle = (a0 + a1) / 2.0
    X = np.column_stack([damping * np.cos(middle), damping * np.sin(middle), np.ones_like(middle)])
    t0, t1 = np.asarray(w["t_start"], dtype=float), np.asarray(w["t_end"], dtype=float)
    rate = np.asarray(w["mean"], dtype=float)
    if method.startswith("strapdown"):
        return _strapdown(method, w, place, X, rate, t0, t1)
    least = LEAST.get(method)
    quarters = len({round(math.cos(a), 2) + 1j * round(math.sin(a), 2) for a in middle})
    if least is not None and quarters < least:
        raise ReductionError(f"method {method}: {quarters} positions, at least {least} are needed")
    if method == "two":
        if float(np.max(np.abs(X[:, 1]))) > 0.01:
            raise ReductionError("method two: positions at the angles 0 and 180° are needed")
        sign = 1.0 if place.rough >= 0.0 else -1.0

        def halved(a: Array) -> tuple[float, float]:
            c = float(np.clip(a[0] / place.north, -1.0, 1.0))
            return sign * math.acos(c), math.nan

        return Problem(("c", "bias"), X[:, [0, 2]], rate, t0, t1, halved, 1, -middle, np.ones_like(middle))
    if np.linalg.cond(X) > 1e3:
        raise ReductionError(
            f"method {method}: the angles do not determine the heading; at least three positions over more than half a "
            "turn, or half a turn of rotation are needed"
        )
    problem = Problem(("C", "B", "bias"), X, rate, t0, t1, _rotated, 2, -middle, np.ones_like(middle))
    if method != "tilt":
        return problem
    # y at the angle a is y cos a - x sin a: of the force as of the rate; a bias of the accelerometer is a constant
    f, u = _read(X, np.asarray(w["f_y"], dtype=float))
    return _tilted(problem, Force(-float(f[1]), float(f[0]), float(u[1]), float(u[0])), lambda a: (-a[1], a[0]), place)


def _tilted(p: Problem, force: Force, rates: Callable[[Array], tuple[float, float]], place: LocalEarth) -> Problem:
    def heading(a: Array) -> tuple[float, float]:
        return tilted_heading(rates(a), force.x, force.y, place)

    attitude(force.x, force.y, place.gravity)  # refuses
    return replace(p, heading=heading, force=force, rates=rates)


NEEDED = {"tilt": ("f_y",), "strapdown": ("mean_x", "f_x", "f_y"), "strapdown two": ("mean_x", "f_x", "f_y")}


def _rotated(a: Array) -> tuple[float, float]:
    return math.atan2(a[1], a[0]), math.hypot(a[0], a[1])


def _strapdown(
    method: str, w: Mapping[str, Array], place: LocalEarth, X: Array, rate: Array, t0: Array, t1: Array
) -> Problem:
    """Two channels, one after the other; with two positions each has its bias."""
    sign = np.sign(X[:, 0])
    two = method == "strapdown two"
    if float(np.max(np.abs(X[:, 1]))) > 0.01 or (two and np.all(sign == sign[0])) or (not two and np.any(sign < 0.0)):
        where = "at the angles 0 and 180°" if two else "at the angle 0"
        raise ReductionError(f"method {method}: windows {where} are needed")
    columns = np.column_stack([sign, np.ones_like(sign)]) if two else sign[:, None]
    (f_x, u_x), (f_y, u_y) = (_read(columns, np.asarray(w[n], dtype=float)) for n in ("f_x", "f_y"))
    force = Force(float(f_x[0]), float(f_y[0]), float(u_x[0]), float(u_y[0]))
    n = rate.size
    zero = np.zeros(n)
    X = np.column_stack([np.concatenate([sign, zero]), np.concatenate([zero, sign])])
    names: tuple[str, ...] = ("w_x", "w_y")
    if two:
        X = np.column_stack([X, np.concatenate([np.ones(n), zero]), np.concatenate([zero, np.ones(n)])])
        names = ("w_x", "w_y", "bias_x", "bias_y")
    y = np.concatenate([np.asarray(w["mean_x"], dtype=float), rate])
    along = np.concatenate([np.where(sign > 0.0, 0.0, math.pi)] * 2)
    of_y = np.concatenate([zero, np.ones(n)])
    after = t1[-1] - t0[0]  # the channels one after the other in time: their noises have nothing to do with each other
    t = (np.concatenate([t0, t0 + after]), np.concatenate([t1, t1 + after]))
    problem = Problem(names, X, y, *t, _rotated, 3 if two else -1, along, of_y)
    return _tilted(problem, force, lambda a: (a[0], a[1]), place)
