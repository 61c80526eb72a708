"""Noise of the readings in positions by hand, as a covariance of the data that each fit is whitened with.

An accelerometer's slow noise reaches a position with the direction that gravity had there, so that the data of
neighbours are correlated as their directions are alike: no series of residuals shows it.  [IMU-HAND]
"""

from __future__ import annotations

import numpy as np

from gyrobench.arrays import Array

WHITE = 0.5  # probability of white noise alone, beforehand
TIMES, SIZES = 6, 9  # correlation times; variances of the drift over that of the white noise
SMALLEST, LARGEST = 0.1, 1e3  # of these


def restricted(covariance: Array, X: Array, y: Array) -> tuple[float, float]:
    """Return ln det R + ln det X'R^-1 X and the squares y'R^-1 y that the fit of X (n, p) leaves."""
    root = np.linalg.cholesky(covariance)
    Z, d = np.linalg.solve(root, X), np.linalg.solve(root, y)
    left = d - Z @ np.linalg.lstsq(Z, d, rcond=None)[0]
    volume = 2.0 * float(np.sum(np.log(np.diag(root)))) + float(np.linalg.slogdet(Z.T @ Z)[1])
    return volume, float(left @ left)


def whitener(covariance: Array) -> Array:
    """Return the symmetric matrix (n, n) that makes data of this covariance white, the typical variance kept."""
    values, vectors = np.linalg.eigh(covariance)
    scale = np.sqrt(float(np.median(np.diag(covariance))))
    return np.asarray((vectors * (scale / np.sqrt(values))) @ vectors.T)


def of_sizes(directions: Array, time: Array, X: Array, y: Array) -> Array:
    """Return the covariance (n, n) of sizes of gravity y (n,) with regressors X, up to a factor.

    directions (n, 3): change of each size with the reading of each accelerometer; time (n,): of the positions, s.  The
    noise of a reading is white, or white and a Gauss-Markov drift of any correlation time up to that of the record; the
    covariance is the mean over these, each with the probability that the data give it (restricted likelihood, the size
    of the noise anything).
    """
    apart, alike = np.abs(time[:, None] - time), directions @ directions.T
    white = np.diag(np.diag(alike))
    models = [white]
    for tau in np.geomspace(float(np.median(np.diff(time))), float(np.ptp(time)), TIMES):
        models += [white + s * np.exp(-apart / tau) * alike for s in np.geomspace(SMALLEST, LARGEST, SIZES)]
    freedom = y.size - X.shape[1]
    volume, square = np.array([restricted(m, X, y) for m in models]).T
    weight = np.full(len(models), (1.0 - WHITE) / (len(models) - 1))
    weight[0] = WHITE
    logarithm = np.log(weight) - 0.5 * volume - 0.5 * freedom * np.log(np.maximum(square, 1e-300))
    weight = np.exp(logarithm - np.max(logarithm))
    return np.asarray(np.einsum("m,mij->ij", weight / np.sum(weight) * square, np.array(models)))
