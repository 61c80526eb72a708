"""The three-step chain of the source, corrected, and each sensor alone: what the joint least squares is compared with.

    V = U1' cos a - U2' sin a - U3' cos a + U4' sin a        U': over the scale factor
    D4+ = (V - fit of harmonics 0 to 3)/2                    harmonics 4 and higher of the head
    D2, D3 from the harmonics 3 and 4 of each U' less those of D4+ and D5, averaged over the sensors
    U' - (D2 + D3 + D4+) a_O -> five terms of each sensor

[TEST-ACCEL4; Dong 2014, eq. 15-22, corrected by EA1, EA3 to EA5]
"""

from __future__ import annotations

import numpy as np

from gyrobench.arrays import Array

from . import geometry


def design(sensor: int, alpha: Array, gamma: float) -> Array:
    """Return the columns of the five terms of a sensor."""
    x, y = geometry.axes(sensor, alpha)
    x, y = gamma * x, gamma * y
    return np.column_stack([np.ones_like(x), x, y, x * y, x * x])


def alone(alpha: Array, U: Array, gamma: float) -> tuple[Array, Array]:
    """Return the five terms (4, 5) of each sensor by itself and the standard deviations (4,) of their residuals."""
    k, s = np.empty((4, 5)), np.empty(4)
    for j, i in enumerate(geometry.SENSORS):
        X = design(i, alpha, gamma)
        k[j] = np.linalg.lstsq(X, U[:, j], rcond=None)[0]
        s[j] = np.linalg.norm(U[:, j] - X @ k[j]) / np.sqrt(alpha.size - 5)
    return k, s


def _order(y: Array, alpha: Array, n: int) -> tuple[float, float]:
    return 2.0 * float(np.mean(y * np.cos(n * alpha))), 2.0 * float(np.mean(y * np.sin(n * alpha)))


def three_steps(alpha: Array, U: Array, gamma: float) -> Array:
    """Return the five terms (4, 5) of the chain, the first harmonic of the head not taken out."""
    scale = alone(alpha, U, gamma)[0][:, 1]
    primed = U / (scale * gamma)
    c, s = np.cos(alpha), np.sin(alpha)
    V = primed[:, 0] * c - primed[:, 1] * s - primed[:, 2] * c + primed[:, 3] * s
    low = np.column_stack([np.ones_like(c), *(f(k * alpha) for k in (1, 2, 3) for f in (np.cos, np.sin))])
    high = (V - low @ np.linalg.lstsq(low, V, rcond=None)[0]) / 2.0  # D4 and above
    D4, D5 = _order(high, alpha, 4), _order(high, alpha, 5)
    found = np.zeros((4, 2, 2))
    for j in range(4):  # with b = alpha + turn sensor j is sensor 1: its angle error has the harmonics turned back
        turn = 0.5 * np.pi * j
        b = alpha + turn
        (c3, s3), (c4, s4) = _order(primed[:, j], b, 3), _order(primed[:, j], b, 4)
        found[j, 0] = np.array([2.0 * c3, 2.0 * s3]) - _turned(D4, 4, turn)  # 0.5 (D2 + D4)
        found[j, 1] = np.array([2.0 * c4, 2.0 * s4]) - _turned(D5, 5, turn)  # 0.5 (D3 + D5)
        found[j, 0], found[j, 1] = _turned(found[j, 0], 2, -turn), _turned(found[j, 1], 3, -turn)
    D2, D3 = found.mean(axis=0)
    D = high + D2[0] * np.cos(2 * alpha) + D2[1] * np.sin(2 * alpha)
    D = D + D3[0] * np.cos(3 * alpha) + D3[1] * np.sin(3 * alpha)
    out = np.empty((4, 5))
    for j, i in enumerate(geometry.SENSORS):
        freed = U[:, j] - scale[j] * gamma * D * geometry.axes(i, alpha)[1]
        out[j] = np.linalg.lstsq(design(i, alpha, gamma), freed, rcond=None)[0]
    return out


def _turned(pair: Array | tuple[float, float], k: int, turn: float) -> Array:
    """Return the harmonic k of an angle as one of that angle plus ``turn``: a cos k a + b sin k a over b = a + turn."""
    a, b = pair
    c, s = np.cos(k * turn), np.sin(k * turn)
    return np.array([a * c - b * s, a * s + b * c])
