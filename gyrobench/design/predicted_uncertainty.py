"""Uncertainty that a reduction will state for a plan, predicted from its fit of one run of that plan.

The design matrix, the windows, the set-up effects that are weighed and the functions of the unknowns are those of that
fit; its data are replaced by the fitted model plus noise drawn from the true noise model, and it is made again, a few
dozen times.  So everything the reduction does to u is in the prediction: noise that is estimated and not known, effects
that may be there, degrees of freedom, sources of type B.

    u       mean over the draws of the standard uncertainty that the reduction states
    error   standard deviation of the estimate: gain V gain' of each draw, V the covariance of the noise, averaged
    least   that of generalized least squares with the noise known: no reduction of this plan can do better
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gyrobench.arrays import Array
from gyrobench.design.visit_protocol import DataNoise
from gyrobench.reduction.estimation import noise_mixture_fit
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.estimation.noise import mean_variance
from gyrobench.reduction.estimation.uncertainty import NORMAL

DRAWS = 160
#: a fit of many rows under many set-up effects is slow, and its u varies little: rows times combinations of effects up
#: to which all draws are made, and the fewest
EASY, FEWEST = 300.0, 12


@dataclass(frozen=True)
class Prediction:
    """Prediction for a fit: names and printed units of its values; u, error, least (q,) in these units, u of type B."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    scale: Array
    u: Array
    error: Array
    least: Array
    type_b: Array
    hidden: tuple[str, ...]  # effects that this plan does not show, with the reason


def predict(fit: Findings, type_b: Array, V: Array, draws: int = DRAWS, seed: int = 0) -> Prediction:
    """Return the prediction for a fit as observed_fits() gives it; V (n, n): covariance of the noise of its data."""
    draws = max(min(draws, FEWEST), round(draws * min(1.0, EASY / (fit.y.size * 2.0 ** len(fit.candidates)))))
    L = np.linalg.cholesky(V)
    rng = np.random.default_rng(seed)
    p, q = fit.X.shape[1], len(fit.quantities) - len(fit.joined)
    model = fit.X @ fit.est.beta[:p]
    if fit.function is not None:
        J = fit.linearized(fit.function, fit.est.beta[:p])[1]
    else:  # a reduction may have turned its unknowns into values itself: by factors
        J = np.diag(fit.reported.u[:q] / np.maximum(fit.est.u[:q], 1e-300))[:, :p]
    u, variance = np.zeros(q), np.zeros(q)
    for _ in range(draws):
        drawn = model + L @ rng.standard_normal(fit.y.size)
        if fit.known is not None:
            drawn += rng.standard_normal(len(fit.known)) @ fit.known
        again, gain = _again(fit, drawn, J)
        u += again / draws
        variance += np.einsum("qi,ij,qj->q", gain, V, gain) / draws
    white = np.linalg.solve(L, fit.X)
    size = np.linalg.norm(white, axis=0)
    least = np.linalg.norm(J / size @ np.linalg.pinv(white / size), axis=1)
    b = np.sqrt(np.sum(type_b[:, :q] ** 2, axis=0)) if len(type_b) else np.zeros(q)
    scale = np.array([x.scale for x in fit.quantities[:q]])
    return Prediction(
        tuple(x.name for x in fit.quantities[:q]), tuple(x.unit for x in fit.quantities[:q]), scale,
        np.hypot(u, b) / scale, np.sqrt(variance) / scale, least / scale, b / scale,
        tuple(f"{h.candidate.meaning}: {h.reason}" for h in fit.hidden),
    )  # fmt: skip


def _again(fit: Findings, y: Array, J: Array) -> tuple[Array, Array]:
    """Return u (q,) and gain (q, n) of the values J b of the same fit of other data, as :meth:`Findings.derive` does,
    without its tests of the residuals, which would take most of the time.
    """
    p = fit.X.shape[1]
    names = fit.est.names[:p]
    if fit.white:
        est = noise_mixture_fit.ordinary(fit.X, y, names, fit.t_start, fit.t_end, fit.weights, math.inf)
    else:
        blocks = [c.block for c in fit.candidates]
        readings = fit.data.noise == "readings"
        est = noise_mixture_fit.fit(fit.X, y, names, fit.t_start, fit.t_end, math.inf, readings, blocks, fit.known)
    full = np.column_stack([J, np.zeros((len(J), est.beta.size - p))])
    sd, half = est.mixture.spread(full)
    return np.minimum(sd, half / NORMAL), full @ est.gain


def effective(noise: DataNoise, window: float) -> float:
    """Return the density that white noise would have with the variance of this noise over a window (s)."""
    return math.sqrt(noise.white**2 + window * noise.markov**2 * float(mean_variance(np.array(window / noise.tau))))
