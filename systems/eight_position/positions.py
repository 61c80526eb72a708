"""The eight positions of Hu 1981 and its closed formulas, corrected.  [POS8-FRAMES, POS8-MODEL+REDUCE; eq. 3-2..3-11]

    position    1    2    3    4    5    6    7    8         x, y: gimbal axes, z: spin axis, right-handed
    x           E    N   -E   -N    U   -E   -U    E
    y           N   -E   -N    E    E    U   -E   -U         W: Earth rate, c, s: cos, sin of the latitude
    z           U    U    U    U    N    N    N    N

    k_x I_x = -R_x + (Wc, 0, -Wc, 0)[1..4] + u_y,   -R_x in 5, 7,   -R_x + (Ws - u_zx) in 6, -R_x - (Ws - u_zx) in 8
    k_y I_y =  R_y + (0, Wc, 0, -Wc)[1..4] + u_x,    R_y in 6, 8,    R_y + (Ws - u_zy) in 5,  R_y - (Ws - u_zy) in 7

The current about x measures the y channel and the other way round.  Printed signs in 3-4, 3-5, 3-8, 3-9 are wrong
(E17) and printed subscripts in 3-11 (E18).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.frames import E, N, U

_AXES = {1: (E, N), 2: (N, -E), 3: (-E, -N), 4: (-N, E), 5: (U, E), 6: (-E, U), 7: (-U, -E), 8: (E, -U)}
#: position -> rows x, y, z in E, N, U
ATTITUDES: dict[int, Array] = {n: np.array([x, y, np.cross(x, y)]) for n, (x, y) in _AXES.items()}
#: name of the mount of each position, as plans and files call it
NAMES = {n: f"position {n}" for n in ATTITUDES}
NUMBERS = {name: n for n, name in NAMES.items()}
#: which unknowns each current gives: scale factor, constant, unbalance along the other axis, along z
UNKNOWNS = {"x": ("k_x", "R_x", "u_y", "u_zx"), "y": ("k_y", "R_y", "u_x", "u_zy")}


def estimates(
    I_x: Mapping[int, float], I_y: Mapping[int, float], rate: float, latitude: float
) -> dict[str, list[float]]:
    """Return every single value inside the means of eq. 3-10, 3-11: name -> values.

    I_x, I_y: current (A) by position.  rate: Earth rate, rad/s.  k in rad/s/A, all others in rad/s (at local g).
    Raises ZeroDivisionError for I_x1 = I_x3 or I_y2 = I_y4.
    """
    Wc, Ws = rate * math.cos(latitude), rate * math.sin(latitude)
    k_x, k_y = 2.0 * Wc / (I_x[1] - I_x[3]), 2.0 * Wc / (I_y[2] - I_y[4])
    p, q = ({n: k * v for n, v in i.items()} for k, i in ((k_x, I_x), (k_y, I_y)))
    R_x, R_y = -(p[5] + p[7]) / 2.0, (q[6] + q[8]) / 2.0
    return {
        "k_x": [k_x],
        "k_y": [k_y],
        "R_x": [-p[5], -p[7]],
        "R_y": [q[6], q[8]],
        "u_zx": [Ws - R_x - p[6], Ws + R_x + p[8]],
        "u_zy": [Ws + R_y - q[5], Ws - R_y + q[7]],
        "u_x": [q[1] - R_y, q[2] - R_y - Wc, q[3] - R_y, q[4] - R_y + Wc],
        "u_y": [p[1] + R_x - Wc, p[2] + R_x, p[3] + R_x + Wc, p[4] + R_x],
    }


def means(position: NDArray[np.int_], value: Array) -> dict[int, float]:
    """Return the mean of values (n,) in each position that is there."""
    return {n: float(np.mean(value[position == n])) for n in ATTITUDES if np.any(position == n)}


def closed(I_x: Mapping[int, float], I_y: Mapping[int, float], rate: float, latitude: float) -> dict[str, float]:
    """Return the means of :func:`estimates`."""
    return {n: float(np.mean(v)) for n, v in estimates(I_x, I_y, rate, latitude).items()}


def earth_and_gravity(attitude: Array, latitude: float) -> tuple[Array, Array]:
    """Return unit vectors of the Earth's rate and of the specific force of Hu 1981 (down) in gyro axes."""
    pole = np.array([0.0, math.cos(latitude), math.sin(latitude)])
    return attitude @ pole, attitude @ -U


def attitude_error(actual: Any, nominal: Array) -> float:
    """Return the angle (rad) of the rotation between two attitudes."""
    off = np.asarray(actual, dtype=float) @ nominal.T
    skew = np.array([off[2, 1] - off[1, 2], off[0, 2] - off[2, 0], off[1, 0] - off[0, 1]])
    return float(math.atan2(0.5 * float(np.linalg.norm(skew)), 0.5 * (float(np.trace(off)) - 1.0)))
