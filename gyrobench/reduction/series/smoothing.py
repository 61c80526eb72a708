"""Fixed-interval smoothing of a record with a linear model: states and disturbances from all readings, past and later.

    x_{i+1} = Phi_i x_i + Gamma_i w_i,   w_i ~ (Wbar_i, Q_i)
    z_i = H_i x_i + v_i,   v_i ~ (0, R_i);   x_0 ~ (x0, P0)

before the first reading.  Matrices may be given once or for every step (leading axis of n readings).  The recursion
is that of statsmodels (equal to the dense estimate of all unknowns to 1e-13, where the one of the source loses
1e-11). Readings that are NaN are missing.  A reduction: every value uses the readings after it, so it is no filter
for a loop.
[EST-SMOOTHER; Hu 1981, eq. 6-32..6-83 with ER41..ER52]
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.series.checks import SeriesError, checked_step
from gyrobench.reduction.series.gauss_markov import GaussMarkov


@dataclass(frozen=True)
class LinearModel:
    """Matrices (k, k), (k, g), (g, g), (m, k), (m, m), or (n, ...) of them; x0 (k,), P0 (k, k), Wbar (g,) or (n, g)."""

    Phi: Array
    Gamma: Array
    Q: Array
    H: Array
    R: Array
    x0: Array
    P0: Array
    Wbar: Array | None = None


@dataclass(frozen=True)
class Smoothed:
    """Arrays over the n readings."""

    state: Array  # (n, k)
    covariance: Array  # (n, k, k)
    disturbance: Array  # (n, g): w_i, of the step after reading i
    disturbance_covariance: Array  # (n, g, g)
    filtered: Array  # (n, k): from the readings up to i, for comparison
    filtered_covariance: Array

    @property
    def sd(self) -> Array:
        out: Array = np.sqrt(np.maximum(np.einsum("nkk->nk", self.covariance), 0.0))
        return out


def _each(name: str, value: Any, n: int, shape: tuple[int, ...]) -> Array:
    """Return ``value`` with the time axis last, as statsmodels wants it, one long where constant."""
    array = np.asarray(value, dtype=float)
    if array.shape == shape:
        return array[..., None]
    if array.shape == (n, *shape):
        return np.moveaxis(array, 0, -1)
    raise SeriesError(f"{name} has the shape {array.shape}; {shape} or {(n, *shape)} is needed")


def _check_covariance(name: str, matrices: Array, definite: bool) -> None:
    least = np.linalg.eigvalsh(np.moveaxis(matrices, -1, 0)).min(axis=1)
    size = np.abs(matrices).max(axis=(0, 1))
    if np.any(np.abs(matrices - matrices.swapaxes(0, 1)) > 1e-9 * size) or np.any(least < -1e-12 * size):
        raise SeriesError(f"{name} is not a covariance: it must be symmetric without a negative eigenvalue")
    if definite and np.any(least <= 1e-14 * size):
        raise SeriesError(f"{name} is singular; readings without noise need a state of their own")


def smooth(z: Any, model: LinearModel) -> Smoothed:
    """Smooth readings ``z`` (n, m), NaN where missing.

    Raises SeriesError for shapes that do not fit, a singular R, a Q or P0 that is not a covariance, n below k.
    """
    from statsmodels.tsa.statespace.kalman_smoother import KalmanSmoother

    z = np.asarray(z, dtype=float)
    z = z[:, None] if z.ndim == 1 else z
    n, m = z.shape
    k = int(np.asarray(model.x0).size)
    g = int(np.asarray(model.Gamma).shape[-1])
    if n < k:
        raise SeriesError(f"{n} readings for {k} states: at least as many as states are needed")
    if np.any(np.isinf(z)):
        raise SeriesError("readings hold an infinite number; mark a missing one as NaN")
    Phi, Gamma = _each("Phi", model.Phi, n, (k, k)), _each("Gamma", model.Gamma, n, (k, g))
    Q, H, R = _each("Q", model.Q, n, (g, g)), _each("H", model.H, n, (m, k)), _each("R", model.R, n, (m, m))
    P0 = np.asarray(model.P0, dtype=float)
    _check_covariance("Q", Q, False)
    _check_covariance("R", R, True)
    _check_covariance("P0", P0[..., None], False)
    # tolerance 0: its test for a steady state is absolute, and covariances of drift rates in SI are below it at once
    smoother = KalmanSmoother(k_endog=m, k_states=k, k_posdef=g, tolerance=0)
    smoother.bind(np.asarray(z, order="C"))
    smoother["transition"], smoother["selection"], smoother["state_cov"] = Phi, Gamma, Q
    smoother["design"], smoother["obs_cov"] = H, R
    given = np.zeros((g, 1)) if model.Wbar is None else _each("Wbar", model.Wbar, n, (g,))
    mean = np.broadcast_to(given, (g, n))
    smoother["state_intercept"] = np.einsum("kgt,gt->kt", np.broadcast_to(Gamma, (k, g, n)), mean)
    smoother.initialize_known(np.asarray(model.x0, dtype=float), P0)
    found = smoother.smooth()
    return Smoothed(
        np.ascontiguousarray(found.smoothed_state.T), np.moveaxis(found.smoothed_state_cov, -1, 0),
        found.smoothed_state_disturbance.T + mean.T,
        np.moveaxis(found.smoothed_state_disturbance_cov, -1, 0), np.ascontiguousarray(found.filtered_state.T),
        np.moveaxis(found.filtered_state_cov, -1, 0),
    )  # fmt: skip


def smooth_drift(x: Any, dt: float, drift: GaussMarkov, mean: float | None = None) -> tuple[Array, Array]:
    """Return the Gauss-Markov part of a record (n,) and its standard deviation, given what was found in it.

    mean: level the drift is about (default: mean of the record).  NaN readings are bridged by the model.
    """
    dt = checked_step(dt)
    x = np.asarray(x, dtype=float)
    if drift.density <= 0.0:
        raise SeriesError("the record holds no white noise beside the drift; there is nothing to smooth")
    level = float(np.nanmean(x)) if mean is None else mean
    phi, one = float(np.exp(-dt / drift.tau)), np.eye(1)
    unit = drift.sigma
    model = LinearModel(
        phi * one, one, (1.0 - phi**2) * one, one, drift.density**2 / dt / unit**2 * one, np.zeros(1), one
    )
    found = smooth((x - level) / unit, model)
    return level + unit * found.state[:, 0], unit * found.sd[:, 0]
