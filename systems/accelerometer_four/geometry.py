"""Four accelerometers a quarter of a turn apart on a head with a horizontal axis, and the errors of its angles.

Head axes at angle 0: x east, y up, z south, the axis; turned right-handed by b the head sees f/g = (sin b, cos b, 0):

    sensor   1                 2                  3                   4
    a_I      sin b             cos b              -sin b              -cos b
    a_O      cos b             -sin b             -cos b              sin b

b = alpha + D(alpha) + eta_i with the nominal angle alpha, the error D of the head, common to all four, and the
misalignment eta of each; a_O = d a_I/d alpha for every sensor.  [ACCEL-MODEL, TEST-ACCEL4; Dong 2014, eq. 1-5, 14]
"""

from __future__ import annotations

import numpy as np

from gyrobench import frames
from gyrobench.arrays import Array

SENSORS = (1, 2, 3, 4)
BASE = np.array([frames.E, frames.U, np.cross(frames.E, frames.U)])  # rows: head axes in (E, N, U) at angle 0
TERMS = ("K_F", "K_I", "K_O", "K_IO", "K_II")


def mount(sensor: int) -> Array:
    """Return the axes I, O, P (rows) of a sensor in head axes."""
    turn = 0.5 * np.pi * (sensor - 1)
    c, s = round(np.cos(turn)), round(np.sin(turn))
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def axes(sensor: int, alpha: Array) -> tuple[Array, Array]:
    """Return a_I and a_O in g at the angles."""
    turn = alpha + 0.5 * np.pi * (sensor - 1)
    return np.sin(turn), np.cos(turn)


def orders(positions: int) -> list[tuple[int, str]]:
    """Return the harmonics of the head that the readings determine: 2 to half the positions; of the last its cosine."""
    last = positions // 2
    found = [(k, kind) for k in range(2, (positions + 1) // 2) for kind in ("cos", "sin")]
    return [*found, (last, "cos")] if positions % 2 == 0 else found


def harmonics(alpha: Array, positions: int) -> Array:
    """Return the columns (n, m) of :func:`orders`."""
    return np.column_stack([np.cos(k * alpha) if kind == "cos" else np.sin(k * alpha) for k, kind in orders(positions)])


def errors(positions: int, half_range: float, seed: int, cosine: float, sine: float) -> Array:
    """Return the errors of the positions: random within +-half_range without constant and first harmonic, and this
    first harmonic; rad.
    """
    alpha = 2.0 * np.pi * np.arange(positions) / positions
    first = np.column_stack([np.ones(positions), np.cos(alpha), np.sin(alpha)])
    raw = np.random.default_rng(seed).uniform(-half_range, half_range, positions)
    rest: Array = raw - first @ np.linalg.lstsq(first, raw, rcond=None)[0]
    return rest + cosine * np.cos(alpha) + sine * np.sin(alpha)
