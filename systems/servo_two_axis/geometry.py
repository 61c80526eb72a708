"""Mounts, attitudes and kinematics of the two-axis servo test.  [SERVO2-A, SERVO2-KIN, APP2; eq. 3-94..3-99, E47, E50]

    v_gyro = A v_mount,   A = Ry(y) Rx(x) = [[cy, sx sy, -cx sy], [0, cx, sx], [sy, -cy sx, cx cy]]
    omega_x = x' cy + e . A row 1        omega_y = y' + e . A row 2        e: Earth rate along X, Y, Z of the mount

x, y: outer and inner table angle, right-handed about the outer axis X and the inner axis Y; (X, Y, Z) of a mount in ENU
are the rows of :func:`base`.  The gyro's z axis stays where it is among the stars, but for the drift; its components
along X, Y, Z are the third row of A, so that sin y = z . X(t) and tan x = -(z . Y) / (z . Z).
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from gyrobench import frames
from gyrobench.arrays import Array
from gyrobench.attitudes import CROSS, EAST, NORTH, POLE, UP, axes

#: number in appendix 2 of Hu 1981, ch. 3, -> directions of X (outer axis) and Y (inner axis); Z = X cross Y
MOUNTS = {
    1: (EAST, NORTH), 2: (EAST, UP), 3: (NORTH, EAST), 4: (NORTH, UP),
    5: (EAST, POLE), 6: (EAST, CROSS), 7: (UP, NORTH), 8: (UP, EAST),
    9: (POLE, EAST), 10: (POLE, CROSS), 11: (CROSS, EAST), 12: (CROSS, POLE),
}  # fmt: skip
Rates = Callable[[tuple[float, float, float]], tuple[float, float]]
LEAST = 0.2  # of cos y  [SERVO2-LOCK]


def base(mount: int, latitude: float) -> Array:
    """Return rows X, Y, Z of a mount in ENU.  KeyError for a number that is none of the twelve."""
    return axes(*MOUNTS[mount], latitude)


def attitude(x: ArrayLike, y: ArrayLike) -> Array:
    """Return A (..., 3, 3) of outer and inner angles.  [SERVO2-A, E47]"""
    cx, sx, cy, sy = np.cos(x), np.sin(x), np.cos(y), np.sin(y)
    zero = np.zeros_like(cx * cy)
    rows = [[cy + zero, sx * sy, -cx * sy], [zero, cx + zero, sx + zero], [sy + zero, -cy * sx, cx * cy]]
    return np.asarray(np.moveaxis(np.array(rows), (0, 1), (-2, -1)))


def swing(mount: int, latitude: float) -> float:
    """Return the largest inner angle over a day of a gyro without drift, rad.  [SERVO2-LOCK]

    a, b: angles of X and Z to the pole; z goes round the pole at b while X stays at a.
    """
    p, rows = frames.pole(latitude), base(mount, latitude)
    a, b = (math.acos(max(-1.0, min(1.0, float(rows[k] @ p)))) for k in (0, 2))
    return math.pi / 2.0 - min(abs(a - b), abs(math.pi - a - b))


def path(
    mount: int, latitude: float, time: float, points: int = 241, earth_rate: float = frames.EARTH_RATE,
    rates: Rates | None = None,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """Return times (points,), outer and inner angle from 0, of a gyro that starts in ``mount``; the outer unwrapped.

    rates: drift (omega_dx, omega_dy), rad/s, at (X, Y, Z) = SF / g along the gyro axes, up to where cos y = LEAST is
    passed (the angles then stay); None: no drift, in closed form, through gimbal lock too.
    """
    t = np.linspace(0.0, time, points)
    rows = base(mount, latitude)
    if rates is None:
        p, a, z = frames.pole(latitude), (-earth_rate * t)[:, None], rows[2]
        turn = z * np.cos(a) + np.cross(p, z) * np.sin(a) + p * (p @ z) * (1.0 - np.cos(a))  # Rodrigues
        turned = turn @ rows.T
        y = np.arcsin(np.clip(turned[:, 0], -1.0, 1.0))
        return t, np.unwrap(np.arctan2(-turned[:, 1], turned[:, 2])), y
    e1, e2, e3 = (rows @ frames.earth_rate_local(latitude, earth_rate)).tolist()
    d1, d2, d3 = (rows @ -frames.U).tolist()

    def slope(x: float, y: float) -> tuple[float, float]:
        cx, sx, cy, sy = math.cos(x), math.sin(x), math.cos(y), math.sin(y)
        down, earth = cx * d3 - sx * d2, cx * e3 - sx * e2  # along the axis that the inner angle turns
        wx, wy = rates((cy * d1 - sy * down, cx * d2 + sx * d3, sy * d1 + cy * down))
        return (wx - (cy * e1 - sy * earth)) / cy, wy - (cx * e2 + sx * e3)

    # single numbers: thousands of steps, for which small arrays are ten times slower
    x = y = 0.0
    angles, h = [(x, y)], time / (points - 1)
    while len(angles) < points:
        if abs(math.cos(y)) < LEAST:
            angles += [(x, y)] * (points - len(angles))
            break
        (x1, y1), half = slope(x, y), 0.5 * h
        x2, y2 = slope(x + half * x1, y + half * y1)
        x3, y3 = slope(x + half * x2, y + half * y2)
        x4, y4 = slope(x + h * x3, y + h * y3)
        x += h / 6.0 * (x1 + 2.0 * x2 + 2.0 * x3 + x4)
        y += h / 6.0 * (y1 + 2.0 * y2 + 2.0 * y3 + y4)
        angles.append((x, y))
    outer, inner = np.array(angles).T
    return t, outer, inner


def force(mount: int, latitude: float, x: Array, y: Array) -> Array:
    """Return SF / g along the gyro axes (n, 3): gamma of Hu 1981."""
    return np.asarray(attitude(x, y) @ (base(mount, latitude) @ -frames.U))
