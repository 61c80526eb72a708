"""What the windows of each method say of the heading: design, unknowns, and the heading as their function."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import Legendre
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.regression import least_squares
from gyrobench.reduction.setup.window_checks import ReductionError

LEAST = {"two": 2, "null": 2, "four": 4, "several": 3, "strapdown two": 2}  # positions
NEEDED = {"tilt": ("f_y",), "strapdown": ("mean_x", "f_x", "f_y"), "strapdown two": ("mean_x", "f_x", "f_y")}
STEEP = math.radians(85.0)
NEAR_NULL = math.radians(10.0)


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
class HeadingProblem:
    """y = X a + noise over rows of t_start, t_end.  bias: its index in a, -1 without.  along: (n,) angle of y from the
    reference, clockwise; axis: 1 of rows of y, 0 of x.  force: where the tilt is read.  zero: heading at which a cosine
    alone is 1 (rad).  Raises ReductionError for an attitude that is not one.
    """

    names: tuple[str, ...]
    X: Array
    y: Array
    t_start: Array
    t_end: Array
    bias: int
    along: Array
    axis: Array
    earth: LocalEarth
    force: Force | None = None
    zero: float = 0.0

    def __post_init__(self) -> None:
        if self.force is not None:
            attitude(self.force.x, self.force.y, self.earth.gravity)  # refuses

    def heading(self, a: Array) -> tuple[float, float]:
        """Return heading and horizontal rate from the unknowns; the rate is NaN where the method takes it for known."""
        if self.force is not None:
            # y at the angle q is y cos q - x sin q
            rates = (a[0], a[1]) if np.any(self.axis == 0.0) else (-a[1], a[0])
            return tilted_heading(rates, self.force, self.earth)
        if self.names[0] == "c":
            half = math.acos(float(np.clip(a[0] / self.earth.north, -1.0, 1.0)))
            heading = self.zero + (half if self.earth.rough >= 0.0 else -half)
            return math.remainder(heading, 2.0 * math.pi), math.nan
        return math.atan2(a[1], a[0]), math.hypot(a[0], a[1])


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


def tilted_heading(rates: tuple[float, float], force: Force, place: LocalEarth) -> tuple[float, float]:
    """Return heading and horizontal rate from the rates and forces along x and y, at any tilt.  [NORTH-STRAPDOWN]"""
    theta, gamma = attitude(force.x, force.y, place.gravity)
    st, ct, sg, cg = math.sin(theta), math.cos(theta), math.sin(gamma), math.cos(gamma)
    east = -(rates[0] * ct - rates[1] * sg * st + place.up * sg)
    north = (rates[1] - place.up * st) * cg
    return math.atan2(east, north), math.hypot(east, north) / (ct * cg)


def drift_columns(t_start: Array, t_end: Array, order: int) -> Array:
    """Return window means (n, order) of the Legendre polynomials P_1 .. P_order of time, -1 at the first start and 1 at
    the last end: the size of each is what it adds at the end.  [NORTH-DRIFT]
    """
    first, last = float(np.min(t_start)), float(np.max(t_end))
    a, b = (2.0 * (t - first) / (last - first) - 1.0 for t in (t_start, t_end))
    sums = [Legendre.basis(k).integ() for k in range(1, order + 1)]
    return np.column_stack([(f(b) - f(a)) / (b - a) for f in sums]) if sums else np.zeros((t_start.size, 0))


def of_windows(method: str, w: Mapping[str, Array], earth: LocalEarth, order: int = 0) -> HeadingProblem:
    """Return the problem of a method with a drift of the bias up to this power of time.  Raises ReductionError for
    windows that do not carry it.
    """
    problem = _of_method(method, w, earth)
    if order == 0:
        return problem
    if method.startswith("strapdown"):
        raise ReductionError(f"drift_order = {order}: of the methods with one gyro axis, not of {method}")
    X = np.column_stack([problem.X, drift_columns(problem.t_start, problem.t_end, order)])
    if np.linalg.matrix_rank(X) < X.shape[1] or np.linalg.cond(X) > 1e3:
        raise ReductionError(
            f"drift_order = {order}: these positions do not tell the drift from the heading; take them more than once, "
            "or turn the head (method continuous)"
        )
    names = (*problem.names, *(f"d_{k}" for k in range(1, order + 1)))
    return replace(problem, names=names, X=X)


def _of_method(method: str, w: Mapping[str, Array], earth: LocalEarth) -> HeadingProblem:
    missing = [n for n in NEEDED.get(method, ()) if n not in w]
    if missing:
        raise ReductionError(f"method {method}: column {', '.join(missing)} is missing")
    a0, a1 = np.asarray(w["angle_start"], dtype=float), np.asarray(w["angle_end"], dtype=float)
    t0, t1, rate = (np.asarray(w[n], dtype=float) for n in ("t_start", "t_end", "mean"))
    middle = (a0 + a1) / 2.0
    damping = np.sinc((a1 - a0) / 2.0 / math.pi)  # of cos and sin by averaging over the window
    c, s, one = damping * np.cos(middle), damping * np.sin(middle), np.ones_like(middle)
    if method.startswith("strapdown"):
        return _strapdown(method == "strapdown two", w, earth, c, s)
    least = LEAST.get(method)
    quarters = len({round(math.cos(a), 2) + 1j * round(math.sin(a), 2) for a in middle})
    if least is not None and quarters < least:
        raise ReductionError(f"method {method}: {quarters} positions, at least {least} are needed")
    if method == "null":
        return _null(rate, t0, t1, middle, earth)
    if method == "two":
        if float(np.max(np.abs(s))) > 0.01:
            raise ReductionError("method two: positions at the angles 0 and 180° are needed")
        return HeadingProblem(("c", "bias"), np.column_stack([c, one]), rate, t0, t1, 1, -middle, one, earth)
    X = np.column_stack([c, s, one])
    if np.linalg.cond(X) > 1e3:
        raise ReductionError(
            f"method {method}: the angles do not determine the heading; at least three positions over more than half a "
            "turn, or half a turn of rotation are needed"
        )
    problem = HeadingProblem(("C", "B", "bias"), X, rate, t0, t1, 2, -middle, one, earth)
    if method != "tilt":
        return problem
    # of the force as of the rate; a bias of the accelerometer is a constant
    f = least_squares(X, np.asarray(w["f_y"], dtype=float), problem.names)
    return replace(problem, force=Force(-float(f.beta[1]), float(f.beta[0]), float(f.u[1]), float(f.u[0])))


def at_null(w: Mapping[str, Array]) -> NDArray[np.bool_]:
    """Return which windows of the method null are within NEAR_NULL of the last position, or half a turn from it."""
    angle = np.asarray(w["angle_end"], dtype=float)
    out: NDArray[np.bool_] = np.abs(np.sin(angle - angle[-1])) < math.sin(NEAR_NULL)
    return out


def _null(rate: Array, t0: Array, t1: Array, middle: Array, earth: LocalEarth) -> HeadingProblem:
    """Return the problem of pairs about the null: c = A cos(psi - zero), zero the angle of the last position.

    Across it the rate is +-A, of which a small turn of a pair against the last one takes its sine.  [NORTH-NULL]
    """
    side = 1.0 if earth.rough >= 0.0 else -1.0
    zero = math.remainder(float(middle[-1]), 2.0 * math.pi)
    if math.cos(zero + side * 0.5 * math.pi - earth.rough) < 0.0:  # of the two positions that of the rough heading
        zero = math.remainder(zero + math.pi, 2.0 * math.pi)
    x = middle - zero
    X = np.column_stack([np.cos(x), np.ones_like(x)])
    return HeadingProblem(("c", "bias"), X, rate - side * earth.north * np.sin(x), t0, t1, 1, -middle, np.ones_like(x),
                          earth, zero=zero)  # fmt: skip


def _strapdown(two: bool, w: Mapping[str, Array], earth: LocalEarth, c: Array, s: Array) -> HeadingProblem:
    """Return the problem of two channels, one after the other; with two positions each has its bias."""
    sign = np.sign(c)
    if float(np.max(np.abs(s))) > 0.01 or (np.all(sign == sign[0]) if two else np.any(sign < 0.0)):
        at = " two: windows at the angles 0 and 180°" if two else ": windows at the angle 0"
        raise ReductionError(f"method strapdown{at} are needed")
    columns = np.column_stack([sign, np.ones_like(sign)] if two else [sign])
    names = ("force", "bias")[: columns.shape[1]]
    f_x, f_y = (least_squares(columns, np.asarray(w[n], dtype=float), names) for n in ("f_x", "f_y"))
    X = np.kron(np.eye(2), columns)[:, [0, 2, 1, 3] if two else [0, 1]]
    t0, t1, x, y = (np.asarray(w[n], dtype=float) for n in ("t_start", "t_end", "mean_x", "mean"))
    after = t1[-1] - t0[0]  # the channels one after the other in time: their noises have nothing to do with each other
    return HeadingProblem(
        ("w_x", "w_y", "bias_x", "bias_y")[: X.shape[1]], X, np.concatenate([x, y]),
        np.concatenate([t0, t0 + after]), np.concatenate([t1, t1 + after]), 3 if two else -1,
        np.tile(np.where(sign > 0.0, 0.0, math.pi), 2), np.repeat([0.0, 1.0], sign.size), earth,
        Force(*(float(v[0]) for v in (f_x.beta, f_y.beta, f_x.u, f_y.u))),
    )  # fmt: skip
