"""Where the accelerometer's axes are, and what they see of gravity.

Table axes at angle 0: x east, y up, z = x × y south, horizontal: the axis of the head.  Turned right-handed by the
angle theta, the input axis x of both mounts rises:

    a   output axis y against the table axis, pendulum axis z(0) up:     (X, Y, Z) = gamma (-sin t, 0, -cos t)
    b   pendulum axis z against the table axis, output axis y(0) down:   (X, Y, Z) = gamma (-sin t, cos t, 0)

with t = theta + theta_0, gamma = g/g0 and the sign of Hu 1981, (X, Y, Z) = -f/g0: an axis that points up reads -gamma.
theta_0 is the zero of the head and the error of the input axis together; one mount cannot tell them apart.
[ACC; Hu 1981, eq. 3-38..3-43]
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from gyrobench import frames
from gyrobench.arrays import Array

BASE = np.array([frames.E, frames.U, np.cross(frames.E, frames.U)])  # rows: table axes in (E, N, U) at angle 0
FACES: dict[str, Array] = {  # rows: accelerometer axes x, y, z in table axes
    "a": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    "b": np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]]),
}
CROSS = {"a": "k5", "b": "k4"}  # which cross term a mount sees


def specific_force(mount: str, t: Array, gamma: float) -> tuple[Array, Array, Array]:
    """Return X, Y, Z (n,) of a mount with the input axis at the elevations ``t`` (n,), rad."""
    zero = np.zeros_like(t)
    x, c = -gamma * np.sin(t), gamma * np.cos(t)
    return (x, zero, -c) if mount == "a" else (x, c, zero)


def zero_angle(mount: str, axes: ArrayLike) -> float:
    """Return theta_0 (rad) of an accelerometer whose axes are the rows of ``axes`` in the mount (a parameter of the
    part).
    """
    x = FACES[mount].T @ np.asarray(axes, dtype=float)[0]  # input axis in table axes
    return math.atan2(float(x[1]), float(x[0]))
