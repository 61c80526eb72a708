"""What the data say of each possible effect of a fit under estimated noise (noise_mixture_fit)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.mixture import Mixture
from gyrobench.reduction.estimation.noise_estimate import Evidence
from gyrobench.reduction.estimation.nuisance_states import NuisanceBlock

if TYPE_CHECKING:
    from gyrobench.reduction.estimation.noise_mixture_fit import Problem, Weighed


def evidence_of(
    problem: Problem, weighed: Weighed, estimates: Array, mixture: Mixture, counts: NDArray[np.bool_]
) -> list[Evidence]:
    """Return what the data say of each block; estimates (states * models, all columns)."""
    each, w, s2, p = weighed.states, weighed.likelihood, weighed.s2, problem.X.shape[1]
    found, at, flat = [], p, w.ravel()
    sd = np.sqrt(np.maximum(np.einsum("gpp->gp", mixture.covariance), 0.0))
    total = np.zeros_like(estimates)
    total[counts] = sd**2
    for j, block in enumerate(problem.blocks):
        present = np.array([s.blocks[j] for s in each])
        probability = float(w[present].sum())
        inside = np.repeat(present, w.shape[1])
        columns = slice(at, at + block.columns.shape[1])
        at = columns.stop

        def mean(rows: NDArray[np.bool_]) -> tuple[Array, Array]:
            part = np.where(rows & counts, flat, 0.0)
            if not part.sum() > 0.0:
                part = np.where(rows, 1.0, 0.0)
            part = part / part.sum()
            centre = part @ estimates
            return centre, np.sqrt(part @ (total + (estimates - centre) ** 2))

        (with_it, u_with), (without, u_without) = mean(inside), mean(~inside)
        spread = (0.0, 0.0, 0.0, 0.0)
        if block.scatter:
            size = np.array([s.scatter[j] if j in s.scatter else np.zeros(w.shape[1]) for s in each]) * np.sqrt(s2)
            part = np.where(present[:, None], w, 0.0).ravel()
            spread = _moments_of(size.ravel(), part)
        change, u_without = with_it[:p] - without[:p], np.maximum(u_without[:p], 1e-300)
        found.append(Evidence(block, probability, with_it[columns], u_with[columns], change, u_without, spread))
    return found


def _moments_of(values: Array, weight: Array) -> tuple[float, float, float, float]:
    """Mean, standard deviation, 2.5 % and 97.5 % point of weighted values; zeros without weight."""
    if not weight.sum() > 0.0:
        return 0.0, 0.0, 0.0, 0.0
    weight = weight / weight.sum()
    centre = float(weight @ values)
    order = np.argsort(values)
    total = np.cumsum(weight[order])
    low, high = (float(values[order][min(int(np.searchsorted(total, q)), order.size - 1)]) for q in (0.025, 0.975))
    return centre, math.sqrt(float(weight @ (values - centre) ** 2)), low, high


def repeated(block: NuisanceBlock, value: bool) -> NDArray[np.bool_]:
    """Return a value for each column of a block."""
    return np.full(block.columns.shape[1], value)
