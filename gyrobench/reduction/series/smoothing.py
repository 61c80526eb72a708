"""Gauss-Markov drift taken out of a record by fixed-interval smoothing: from all readings, past and later.

    x_{k+1} = phi x_k + w_k,   z_k = x_k + v_k,   phi = exp(-dt/tau),   var x = sigma^2,   var v = N^2/dt

The recursion is that of statsmodels (equal to the dense estimate of all unknowns to 1e-13, where the one of the source
loses 1e-11).  Readings that are NaN are missing.  A reduction: every value uses the readings after it, so it is no
filter for a loop.   [EST-SMOOTHER; Hu 1981, eq. 6-32..6-83 with ER41..ER52]
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.series.checks import SeriesError, checked_step
from gyrobench.reduction.series.gauss_markov import GaussMarkovEstimate


def smooth_drift(x: Any, dt: float, drift: GaussMarkovEstimate, mean: float | None = None) -> tuple[Array, Array]:
    """Return the Gauss-Markov part of a record (n,) and its standard deviation, given what was found in it.

    mean: level the drift is about (default: mean of the record).  NaN readings are bridged by the model.
    """
    from statsmodels.tsa.statespace.kalman_smoother import KalmanSmoother

    x, dt = np.asarray(x, dtype=float), checked_step(dt)
    if drift.density <= 0.0:
        raise SeriesError("the record holds no white noise beside the drift; there is nothing to smooth")
    level = float(np.nanmean(x)) if mean is None else mean
    phi, unit = math.exp(-dt / drift.tau), drift.sigma
    # tolerance 0: its test for a steady state is absolute
    smoother = KalmanSmoother(k_endog=1, k_states=1, tolerance=0)
    smoother.bind((x[:, None] - level) / unit)
    smoother["transition"], smoother["state_cov"] = [[phi]], [[1.0 - phi**2]]
    smoother["selection"] = smoother["design"] = [[1.0]]
    smoother["obs_cov"] = [[drift.density**2 / dt / unit**2]]
    smoother.initialize_known(np.zeros(1), np.eye(1))
    smoothed = smoother.smooth()
    sd = np.sqrt(np.maximum(smoothed.smoothed_state_cov[0, 0], 0.0))
    return level + unit * smoothed.smoothed_state[0], unit * sd
