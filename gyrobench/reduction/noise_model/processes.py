"""Gauss-Markov processes of a noise model with intervals of the draws, which hold for every likely model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.noise_model.filter_starts import GM
from gyrobench.reduction.noise_model.maximum import Fitted
from gyrobench.reduction.noise_model.noise_model import ABSENT, Process, Scale, times
from gyrobench.reduction.noise_model.ordinates import split
from gyrobench.reduction.noise_model.posterior import Cloud, quantile
from gyrobench.reduction.series.noise_coefficients import Estimate

LIKELY = 0.1  # part of the posterior of models of a kind, from which on an interval holds for them too
PART = 0.25  # of the variance of several processes: one of them that counts as any


def process(i: int, at: Fitted, clouds: Sequence[Cloud], scale: Scale) -> Process:
    """Return the i-th Gauss-Markov process of a model; intervals are of those that stand in its place in the draws, and
    hold for every likely model.

    Where fewer terms stand for more, the tau of one is between those of two: draws of that model alone reach neither.
    """
    own = np.array([q for t, q in split(at.model, at.p) if t == GM])
    low = high = own[i]
    for some in (clouds, *([c] for c in clouds)):
        q, weight = _in_place_of(own[:, 1], i, some)
        if float(weight.sum()) > LIKELY:
            ends = [[quantile(x, weight, share) for x in q.T] for share in (0.025, 0.975)]
            low, high = np.minimum(low, ends[0]), np.maximum(high, ends[1])
    present = float(_in_place_of(own[:, 1], i, clouds)[1].sum())
    ends = np.exp([0.5, 1.0] * np.array([own[i], low, high])).T.tolist()
    sigma, tau = (Estimate(value, down, up, present > 1.0 - ABSENT) for value, down, up in ends)
    return Process(times(sigma, scale.size), times(tau, scale.tau0), present)


def _in_place_of(taus: Array, i: int, clouds: Sequence[Cloud]) -> tuple[Array, Array]:
    """Return parameters (M, 2) and weights of the processes of the draws that stand in place of the i-th of log taus
    (k,): of those of a draw that are nearer to it than to the others the nearest one, or, where their mean by variance
    is nearer, each with PART of their variance, at equal shares of the weight of the draw.
    """
    parameters, weights = [np.empty((0, 2))], [np.empty(0)]
    for c in clouds:
        each = [q for t, q in split(c.model, c.p) if t == GM]
        if not each:
            continue
        q = np.stack(each, axis=1)  # (M, g, 2)
        off = np.abs(q[:, :, 1:] - taus)  # (M, g, k)
        mine = np.argmin(off, axis=2) == i
        distance = np.where(mine, off[:, :, i], np.inf)
        nearest = np.min(distance, axis=1, keepdims=True)
        variance = np.where(mine, np.exp(q[:, :, 0]), 1e-300)
        part = variance / np.sum(variance, axis=1, keepdims=True)
        mean = np.sum(part * q[:, :, 1], axis=1, keepdims=True)
        counts = mine & np.where(np.abs(mean - taus[i]) < nearest, part > PART, distance == nearest)
        weight = c.weight[:, None] * counts / np.maximum(np.sum(counts, axis=1, keepdims=True), 1)
        parameters.append(q[counts])
        weights.append(weight[counts])
    return np.concatenate(parameters), np.concatenate(weights)
