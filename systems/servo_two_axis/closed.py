"""Formulas of Hu 1981 for the two-axis servo test, corrected.  [eq. 3-95..3-102, appendix 2, with E47, E50, E51]

    alpha' = x' cos y + e_X cos y + e_Y sin x sin y - e_Z cos x sin y                                       [3-97]
    beta'  = y' + e_Y cos x + e_Z sin x
    -alpha' = R_x + U_z X - U_x Z + (K_zz - K_xx) X Z + K_zx X2 - K_xz Z2 + K_zy X Y - K_xy Y Z              [3-95]
     beta'  = R_y - U_z Y + U_y Z + (K_yy - K_zz) Y Z - K_zy Y2 + K_yz Z2 - K_zx X Y + K_yx X Z

x, y: table angles; e: Earth rate along the axes of the mount; (X, Y, Z) = SF along the gyro axes, by 3-100, 3-101 for
mount 2.  Both lines at the middles of the windows are solved by ordinary least squares, each by itself.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.reduction.drift.channels import BOOK

#: the ninth, empirical term of each line, which Hu 1981 leaves out: ours
EMPIRICAL = {"x": "Dx_y", "y": "Dy_x"}


def appendix_2(mount: int, latitude: float) -> tuple[Array, Array]:
    """Return the Earth rate / W and SF / g along X, Y, Z of a mount.  [APP2]"""
    c, s = math.cos(latitude), math.sin(latitude)
    rate, force = {
        1: ((0, c, s), (0, 0, -1)),
        2: ((0, s, -c), (0, -1, 0)),
        3: ((c, 0, -s), (0, 0, 1)),
        4: ((c, s, 0), (0, -1, 0)),
        5: ((0, 1, 0), (0, -s, -c)),
        6: ((0, 0, -1), (0, -c, s)),
        7: ((s, c, 0), (-1, 0, 0)),
        8: ((s, 0, c), (-1, 0, 0)),
        9: ((1, 0, 0), (-s, 0, c)),
        10: ((1, 0, 0), (-s, -c, 0)),
        11: ((0, 0, 1), (-c, 0, -s)),
        12: ((0, 1, 0), (-c, -s, 0)),
    }[mount]
    return np.array(rate, dtype=float), np.array(force, dtype=float)


def gyro_rates(x: Array, y: Array, x_rate: Array, y_rate: Array, earth: Array) -> tuple[Array, Array]:
    """Return alpha', beta' (n,) of 3-97; earth (3,) along X, Y, Z of the mount."""
    cx, sx, cy, sy = np.cos(x), np.sin(x), np.cos(y), np.sin(y)
    return x_rate * cy + earth[0] * cy + earth[1] * sx * sy - earth[2] * cx * sy, y_rate + earth[1] * cx + earth[2] * sx


def force(x: Array, y: Array, base: Array) -> Array:
    """Return SF along the gyro axes (n, 3) from that along the axes of the mount (3,).  [3-96, E47]"""
    cx, sx, cy, sy = np.cos(x), np.sin(x), np.cos(y), np.sin(y)
    return np.column_stack([
        cy * base[0] + sx * sy * base[1] - cx * sy * base[2],
        cx * base[1] + sx * base[2],
        sy * base[0] - cy * sx * base[1] + cx * cy * base[2],
    ])  # fmt: skip


def rows(channel: str, g: Array) -> Array:
    """Return what the coefficients of Hu 1981 of a line (in the order of BOOK) multiply in alpha' or beta', (n, 8).
    [3-95]
    """
    X, Y, Z = g.T
    one = np.ones_like(X)
    if channel == "x":
        return -np.column_stack([one, X, -Z, X * Z, X * X, -Z * Z, X * Y, -Y * Z])
    return np.column_stack([one, -Y, Z, Y * Z, -Y * Y, Z * Z, -X * Y, X * Z])


def separate(channel: str, rate: Array, g: Array, terms: int = 8) -> dict[str, float]:
    """Return our coefficients of a channel from alpha' (x) or beta' (y) (n,) at SF ``g`` (n, 3) in g0; 9 terms: with
    ours.
    """
    X = rows(channel, g)
    if terms == 9:
        X = np.column_stack([X, g[:, 1 if channel == "x" else 0]])
    v = np.linalg.lstsq(X, rate, rcond=None)[0]
    book = list(BOOK[channel].values())
    out = {name: sign * float(a) for (name, sign), a in zip(book, v, strict=False)}
    return out | ({EMPIRICAL[channel]: float(v[8])} if terms == 9 else {})


def reduce(
    angles: tuple[Array, Array, Array, Array], mount: NDArray[np.int_], place: tuple[float, float, float], terms: int
) -> dict[str, float]:
    """Return our coefficients of both channels, rad/s per g0^n, from angles and rates of both axes (n,) in mounts (n,).

    place: latitude, rad; gravity, g0; Earth rate, rad/s.
    """
    (x, y, x_rate, y_rate), (latitude, g, earth_rate) = angles, place
    alpha, beta, forces = np.empty_like(x), np.empty_like(x), np.empty((x.size, 3))
    for m in np.unique(mount).tolist():
        k = mount == m
        earth, down = appendix_2(m, latitude)
        alpha[k], beta[k] = gyro_rates(x[k], y[k], x_rate[k], y_rate[k], earth_rate * earth)
        forces[k] = force(x[k], y[k], g * down)
    return separate("x", alpha, forces, terms) | separate("y", beta, forces, terms)
