"""Change of the bias of turn-ons with temperature, and whether the gyro follows the temperature late.

A gyro whose temperature lags is read at a temperature that is not its own: b_T of short turn-ons is then less than
that of a gyro at rest in temperature.  Where it drifts within the turn-ons as one does that lags, it is said and b_T
has no value.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy import special

from gyrobench.reduction.drift.late_temperature import following
from gyrobench.reduction.toolkit import Array, Coefficient, plain
from gyrobench.units import DPH

LAGS = (0.3, 1.0, 3.0, 10.0)  # time constants, of the time for which a turn-on is read
LEVEL = 1e-3  # of the F test
LATE = "the gyro follows the temperature late"


def lags(windows: Mapping[str, Any], X: Array, longest: float) -> Array:
    """Return (n, k) temperatures of gyros that lag, less that of the record and what X (n, p) and it take in."""
    T = np.asarray(windows["temperature"], dtype=float)
    C = np.column_stack([following(windows, share * longest) - T for share in LAGS])
    known = np.column_stack([X, T - T.mean()])
    known = known / np.maximum(np.linalg.norm(known, axis=0), 1e-300)
    basis, s, _ = np.linalg.svd(known, full_matrices=False)
    basis = basis[:, s > 1e-9 * s[0]]
    left = C - basis @ (basis.T @ C)
    out: Array = left[:, np.linalg.norm(left, axis=0) > 1e-6 * np.linalg.norm(C, axis=0)]
    return out


def coefficient(slope: tuple[float, float], dof: int, longest: float, late: bool, truth: float | None) -> Coefficient:
    """Return b_T.  slope: with its u, rad/s/K; longest: time to the end of the last reading of a turn-on, s."""
    k, u = (x / DPH for x in slope)
    true = None if truth is None else truth / DPH
    meaning = f"change of the bias with temperature, of turn-ons of {plain(longest, 4)} s"
    factor = float(special.stdtrit(dof, 0.975))
    if late:
        interval = -math.inf, math.inf
        return Coefficient("b_T", meaning, "°/h/K", math.nan, math.nan, factor, interval, truth=true, no_value=LATE)
    z = None if true is None or not u else (k - true) / u
    return Coefficient("b_T", meaning, "°/h/K", k, u, factor, (k - factor * u, k + factor * u), truth=true, z=z)
