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
from numpy.typing import ArrayLike, NDArray

from gyrobench import frames
from gyrobench.attitudes import CROSS, EAST, NORTH, POLE, UP, axes

Array = NDArray[np.float64]
#: number in appendix 2 of Hu 1981, ch. 3, -> directions of X (outer axis) and Y (inner axis); Z = X cross Y
MOUNTS = {
    1: (EAST, NORTH), 2: (EAST, UP), 3: (NORTH, EAST), 4: (NORTH, UP),
    5: (EAST, POLE), 6: (EAST, CROSS), 7: (UP, NORTH), 8: (UP, EAST),
    9: (POLE, EAST), 10: (POLE, CROSS), 11: (CROSS, EAST), 12: (CROSS, POLE),
}  # fmt: skip
LEAST = 0.2  # of cos y  [SERVO2-LOCK]
DAY = 2.0 * math.pi / frames.EARTH_RATE


def base(mount: int, latitude: float) -> Array:
    """Rows X, Y, Z of a mount in ENU.  KeyError for a number that is none of the twelve."""
    return axes(*MOUNTS[mount], latitude)


def attitude(x: ArrayLike, y: ArrayLike) -> Array:
    """A (..., 3, 3) of outer and inner angles.  [SERVO2-A, E47]"""
    cx, sx, cy, sy = np.cos(x), np.sin(x), np.cos(y), np.sin(y)
    zero = np.zeros_like(cx * cy)
    rows = [[cy + zero, sx * sy, -cx * sy], [zero, cx + zero, sx + zero], [sy + zero, -cy * sx, cx * cy]]
    out: Array = np.moveaxis(np.array(rows), (0, 1), (-2, -1))
    return out


def swing(mount: int, latitude: float) -> float:
    """Largest inner angle over a day of a gyro without drift, rad.  [SERVO2-LOCK]

    a, b: angles of X and Z to the pole; z goes round the pole at b while X stays at a.
    """
    p, rows = frames.pole(latitude), base(mount, latitude)
    a, b = (math.acos(max(-1.0, min(1.0, float(rows[k] @ p)))) for k in (0, 2))
    return math.pi / 2.0 - min(abs(a - b), abs(math.pi - a - b))


def path(
    mount: int, latitude: float, time: float, points: int = 241, earth_rate: float = frames.EARTH_RATE,
    rates: Callable[[Array], tuple[float, float]] | None = None,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """Times (points,), outer and inner angle from 0, of a gyro that starts in ``mount``; the outer unwrapped.

    rates: drift (omega_dx, omega_dy), rad/s, at (X, Y, Z) = SF / g along the gyro axes, up to where cos y = LEAST is
    passed (the angles then stay); None: no drift, in closed form, through gimbal lock too.
    """
    t = np.linspace(0.0, time, points)
    rows = base(mount, latitude)
    if rates is None:
        turned = np.array([rows @ frames.rotation(frames.pole(latitude), -a) @ rows[2] for a in earth_rate * t])
        y = np.arcsin(np.clip(turned[:, 0], -1.0, 1.0))
        return t, np.unwrap(np.arctan2(-turned[:, 1], turned[:, 2])), y
    e1, e2, e3 = (rows @ frames.earth_rate_local(latitude, earth_rate)).tolist()
    d1, d2, d3 = (rows @ -frames.U).tolist()

    def slope(v: Array) -> Array:
        x, y = v.tolist()  # single numbers: thousands of steps, for which small arrays are ten times slower
        cx, sx, cy, sy = math.cos(x), math.sin(x), math.cos(y), math.sin(y)
        down, earth = cx * d3 - sx * d2, cx * e3 - sx * e2  # along the axis that the inner angle turns
        wx, wy = rates(np.array([cy * d1 - sy * down, cx * d2 + sx * d3, sy * d1 + cy * down]))
        return np.array([(wx - (cy * e1 - sy * earth)) / cy, wy - (cx * e2 + sx * e3)])

    angles, h = np.zeros((points, 2)), time / (points - 1)
    for k in range(points - 1):
        v = angles[k]
        if abs(math.cos(v[1])) < LEAST:
            angles[k + 1 :] = v
            break
        k1 = slope(v)
        k2 = slope(v + 0.5 * h * k1)
        k3 = slope(v + 0.5 * h * k2)
        angles[k + 1] = v + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + slope(v + h * k3))
    return t, angles[:, 0], angles[:, 1]


def force(mount: int, latitude: float, x: Array, y: Array) -> Array:
    """SF / g along the gyro axes (n, 3): gamma of Hu 1981."""
    out: Array = attitude(x, y) @ (base(mount, latitude) @ -frames.U)
    return out
