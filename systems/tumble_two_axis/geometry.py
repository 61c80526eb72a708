"""Positions of the two-axis tumble, the attitudes they give, and when they are enough.  [TUM2AX-GEOM, TUM2AX-RATIO]

The outer table axis lies along the pole p and the gyro's output axis along it at zero; the inner axis is the input
axis, the spin axis points west.  Position theta: outer angle m theta, inner angle n theta, both right-handed.  With c =
cos phi, s = sin phi, gamma = g/g0 the drift's arguments (X, Y, Z) = -f/g0 are                      [eq. 3-47..3-49]

    gamma (-c cos m th,  -c sin m th sin n th - s cos n th,  -c sin m th cos n th + s sin n th)
"""

from __future__ import annotations

import math

import numpy as np

from gyrobench import drift, frames
from gyrobench.arrays import Array
from gyrobench.reduction.estimation import regression

NAMES = drift.terms(9)
ANGLES = ("outer_start", "outer_end", "inner_start", "inner_end")  # columns of a record
#: Gyro axes I, O, S (rows) in plate axes: I = inner axis, O = outer axis at zero.
FACE = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
LEAST = 25  # positions for the harmonic route
LIMIT = 1e3  # of the condition


def base(latitude: float) -> Array:
    """Return table axes at angles 0 in ENU, rows: outer axis p, inner axis (0, -sin phi, cos phi), east."""
    p = frames.pole(latitude)
    inner = np.array([0.0, -p[2], p[1]])
    return np.array([p, inner, np.cross(p, inner)])


def _wobble(axis: int, angle: Array, size: float, phase: float) -> Array:
    """Return rotations (k, 3, 3) of an axis that goes round a cone of ``size`` twice a turn, as of the part
    table_two_axis.
    """
    a = 2.0 * angle + phase
    return frames.passive((axis + 2) % 3, size * np.sin(a)) @ frames.passive((axis + 1) % 3, size * np.cos(a))


def attitude(
    latitude: float, outer: Array, inner: Array, squareness: float = 0.0,
    wobble: tuple[float, float] = (0.0, 0.0), phase: float = 0.0,
) -> Array:  # fmt: skip
    """Return gyro axes I, O, S (rows) in ENU at table angles (k,): (k, 3, 3).  [SERVO2-A]

    wobble: of the outer and the inner axis, twice a turn, at this phase at angle 0.
    """
    x, y = frames.passive(0, outer), frames.passive(1, inner)
    if any(wobble):
        x, y = x @ _wobble(0, outer, wobble[0], phase), y @ _wobble(1, inner, wobble[1], phase)
    return np.asarray(FACE @ y @ frames.passive_z(squareness) @ x @ base(latitude))


def frequencies(m: int, n: int) -> list[int]:
    """Return the twelve signed frequencies of the drift over theta.  [eq. 3-50, 3-51]"""
    return [m - 2 * n, m - n, n, 2 * (m - n), m, 2 * n, 2 * m - n, m + n, 2 * m, m + 2 * n, 2 * m + n, 2 * (m + n)]


def design(latitude: float, m: int, n: int, positions: int) -> Array:
    """Return nine regressors at equally spaced positions, gamma = 1."""
    theta = np.arange(positions) * 2.0 * math.pi / positions
    return drift.regressors(-attitude(latitude, m * theta, n * theta) @ frames.U, NAMES)


def harmonic_problems(latitude: float, m: int, n: int, positions: int) -> list[str]:
    """Return why the harmonic route cannot be had, as sentences."""
    found = []
    f = frequencies(m, n)
    size = [abs(v) for v in f]
    if 0 in f or len(set(size)) < 12:
        twice = sorted({v for v in size if size.count(v) > 1 or v == 0})
        found.append(
            f"harmonic route: the ratio {m}:{n} has not twelve different frequencies (on each other or 0: "
            f"{', '.join(map(str, twice))}); the smallest ratios that have are 5:1 and 1:5"
        )
    elif positions < LEAST or len({min(v % positions, -v % positions) for v in f}) < 12 or positions <= 2 * max(size):
        least = max(LEAST, 2 * max(size) + 1)
        found.append(f"harmonic route: {positions} positions; {m}:{n} needs at least {least}, equally spaced")
    if abs(math.sin(2.0 * latitude)) < 0.05:
        found.append(
            f"harmonic route: its formulas divide by sin φ and sin 2φ, too small at {math.degrees(latitude):.4g}°"
        )
    return found


def visit_problems(latitude: float, outer: Array, inner: Array) -> list[str]:
    """Return why positions at these angles (k,) cannot give nine coefficients, as sentences."""
    if found := frames.latitude_problems(latitude):
        return found
    X = drift.regressors(-attitude(latitude, outer, inner) @ frames.U, NAMES)
    if len(X) < len(NAMES):
        return [f"visits: {len(X)} positions for {len(NAMES)} coefficients: at least {len(NAMES)} different ones"]
    seen = regression.examine(X, NAMES)
    return [f"visits: {seen.weakness}"] if seen.condition > LIMIT else []


def refusals(latitude: float, m: int, n: int, positions: int) -> list[str]:
    """Return why these positions cannot give nine coefficients, as sentences."""
    if found := frames.latitude_problems(latitude):
        return found
    if min(m, n) < 1:
        return [f"ratio {m}:{n}: both numbers must be at least 1"]
    if math.gcd(m, n) != 1:
        g = math.gcd(m, n)
        found.append(f"ratio {m}:{n}: the numbers have the common divisor {g}; {m // g}:{n // g} is the same path")
    if positions < len(NAMES):
        found.append(f"{positions} positions for {len(NAMES)} coefficients: at least {len(NAMES)} different ones")
    polar = abs(math.degrees(latitude)) > 85.0
    if found and not polar:
        return found
    where = f"latitude {math.degrees(latitude):.4g}°, ratio {m}:{n}, {positions} positions"
    seen = regression.examine(design(latitude, m, n, max(positions, 9)), NAMES)
    if seen.condition > LIMIT or polar:
        found.append(f"{where}: {seen.weakness}")
    if polar:
        found.append("only latitudes up to 85° north or south are possible")
    return found


def cautions(latitude: float, m: int, n: int, positions: int) -> list[str]:
    """Return what to expect of positions that are allowed but weak."""
    if refusals(latitude, m, n, positions):
        return []
    seen = regression.examine(design(latitude, m, n, positions), NAMES)
    return [f"{seen.weakness[:1].upper()}{seen.weakness[1:]}."] if seen.condition > 100.0 else []
