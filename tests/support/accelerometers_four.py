"""Records of four accelerometers on a head, written from the equations: for tests and for the table of errors.

U_i = K_F + K_I a_I + K_O a_O + K_IO a_I a_O + K_II a_I2 at the true angle alpha + D, exact trigonometry.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
N = 24
ALPHA = 2.0 * np.pi * np.arange(N) / N
ARCSEC = np.pi / 648000.0
#: rows: sensors; columns K_F, K_I, K_O, K_IO, K_II; Dong 2014, Table 1
TRUE = np.array(
    [
        [-8.3e-4, 1.29937, -1.2e-5, -2.8e-5, 4e-6],
        [-4.13e-3, 1.32453, -7.3e-6, 8e-6, 1.6e-5],
        [-9.2e-4, 1.29800, -1.2e-5, -1.9e-5, 7e-6],
        [-1.3e-3, 1.29999, -8.6e-6, -9e-6, 2.5e-6],
    ]
)


def head(rng: np.random.Generator, half_range: float, D1: tuple[float, float] | None = (0.0, 0.0)) -> Array:
    """Errors of the positions, uniform within the range, without constant and first harmonic but the given one; None:
    with the first harmonic that they have.
    """
    raw = rng.uniform(-half_range, half_range, N)
    if D1 is None:
        return np.asarray(raw - raw.mean())
    low = np.column_stack([np.ones(N), np.cos(ALPHA), np.sin(ALPHA)])
    out: Array = raw - low @ np.linalg.lstsq(low, raw, rcond=None)[0]
    return out + D1[0] * np.cos(ALPHA) + D1[1] * np.sin(ALPHA)


def voltages(rng: np.random.Generator, D: Array, noise: float, true: Array = TRUE) -> Array:
    """Readings (24, 4)."""
    out = np.empty((N, 4))
    for i, (F, I, O, IO, II) in enumerate(true):  # noqa: E741
        b = ALPHA + D + 0.5 * np.pi * i
        x, y = np.sin(b), np.cos(b)
        out[:, i] = F + I * x + O * y + IO * x * y + II * x * x + noise * rng.normal(size=N)
    return out


def windows(U: Array) -> dict[str, Array]:
    """Columns of a record."""
    t = 13.0 * np.arange(N)
    columns = {"phase": np.arange(N) + 1.0, "t_start": t, "t_end": t + 10.0, "angle_start": ALPHA, "angle_end": ALPHA}
    return columns | {name: U[:, i] for i, name in enumerate(("mean", "mean_2", "mean_3", "mean_4"))}
