"""The harmonic route of the two-axis tumble, corrected.  [TUM2AX-REDUCE; eq. 3-50..3-53 with E30-E34]

    y = A_0 + sum of A_j cos(f_j theta) + B_j sin(f_j theta), j = 1..12, f_j of geometry.frequencies (signed)

Eleven of the 25 amplitudes are tied to others or zero by the model; :data:`TIES` are the checks.
"""

from __future__ import annotations

import math

import numpy as np

from gyrobench.arrays import Array
from gyrobench.frames import G0

from .geometry import frequencies

#: name, amplitude and what it must equal: (letter, j, sign, letter, j); B_5 and B_9 must be 0
TIES = (
    ("A", 4, 1, "A", 12), ("A", 1, -1, "A", 10), ("A", 7, -1, "A", 11), ("B", 1, 1, "B", 10), ("B", 7, 1, "B", 11),
    ("B", 4, -1, "B", 12),
)  # fmt: skip


def columns(theta: Array, m: int, n: int) -> Array:
    """Return 1, cos f_j theta, sin f_j theta ... (k, 25)."""
    blocks = [np.ones_like(theta)]
    for f in frequencies(m, n):
        blocks += [np.cos(f * theta), np.sin(f * theta)]
    return np.stack(blocks, axis=1)


def amplitudes(theta: Array, y: Array, m: int, n: int) -> tuple[Array, Array]:
    """Return A_0..A_12 and B_0..B_12 (B_0 = 0) of the means y of positions theta; equally spaced, one or more
    cycles.
    """
    v = np.linalg.lstsq(columns(theta, m, n), y, rcond=None)[0]
    return np.concatenate([v[:1], v[1::2]]), np.concatenate([[0.0], v[2::2]])


def expected(D: dict[str, float], latitude: float, gravity: float) -> tuple[Array, Array]:
    """Return the amplitudes that a gyro with coefficients D (per g0) has."""
    g, c, s, s2 = gravity / G0, math.cos(latitude), math.sin(latitude), math.sin(2.0 * latitude)
    x, y, z = D["D_I"] * g, D["D_O"] * g, D["D_S"] * g
    xx, zz, xy, yz, xz = (D[n] * g * g for n in ("D_II", "D_SS", "D_IO", "D_OS", "D_IS"))
    cc, ss = c * c, s * s
    A = [
        D["D_F"] + xx * cc / 2 + zz * (cc / 4 + ss / 2), -zz * s2 / 4, -y * c / 2 + xy * s2 / 4, -y * s, -zz * cc / 8,
        -x * c, zz * (cc / 4 - ss / 2), xy * cc / 4, y * c / 2 + xy * s2 / 4, xx * cc / 2 - zz * cc / 4, zz * s2 / 4,
        -xy * cc / 4, -zz * cc / 8,
    ]  # fmt: skip
    B = [
        0.0, yz * s2 / 4, -z * c / 2 + xz * s2 / 4, z * s, yz * cc / 8, 0.0, yz * (cc / 4 - ss / 2), xz * cc / 4,
        -z * c / 2 - xz * s2 / 4, 0.0, yz * s2 / 4, xz * cc / 4, -yz * cc / 8,
    ]  # fmt: skip
    return np.array(A), np.array(B)


def separate(A: Array, B: Array, latitude: float, gravity: float) -> dict[str, float]:
    """Return nine coefficients, per g0, from the amplitudes."""
    g, c, s, s2 = gravity / G0, math.cos(latitude), math.sin(latitude), math.sin(2.0 * latitude)
    gg = g * g
    return {
        "D_F": A[0] - A[9] + A[6] + 3.0 * (A[4] + A[12]),
        "D_I": -A[5] / (g * c),
        "D_O": ((A[8] - A[2]) / c - A[3] / s) / (2.0 * g),
        "D_S": (B[3] / s - (B[2] + B[8]) / c) / (2.0 * g),
        "D_II": 2.0 * (A[9] - A[4] - A[12]) / (gg * c * c),
        "D_SS": ((A[10] - A[1]) / s2 - 2.0 * (A[4] + A[12]) / (c * c)) / gg,
        "D_IO": ((A[2] + A[8]) / s2 + (A[7] - A[11]) / (c * c)) / gg,
        "D_OS": 4.0 / (3.0 * gg) * ((B[1] + B[10]) / s2 + (B[4] - B[12]) / (c * c)),
        "D_IS": 2.0 * (B[7] + B[11]) / (gg * c * c),
    }
