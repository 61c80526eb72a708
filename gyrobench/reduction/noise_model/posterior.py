"""Draws from the posterior of the noise models of a record: what intervals and derived figures are taken from.

Of every model worth its weight a t distribution about its maximum, weighted by the posterior over it (importance
sampling); models are weighted by their evidence.  A figure that depends on several parameters or on the choice of the
model - the minimum of the deviation, a coefficient beside other terms - is computed from the same draws.  Bands are
frozen in them; what their parameters leave open is added to all draws alike.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.noise_model.filter_starts import GM, B, K, Q
from gyrobench.reduction.noise_model.maximum import WIDEST, Fitted
from gyrobench.reduction.noise_model.ordinates import Model, Ordinates, joined, split
from gyrobench.reduction.noise_model.prior import Prior
from gyrobench.reduction.noise_model.search import ModelSearch

WINDOW = 6.0  # of the logarithm of the evidence: models below the best by more are left out
MOST = 10  # models
DRAWS = 1200  # in all
FREEDOM = 6.0  # degrees of freedom of the t distribution
SEED = 7041
NONE = -600.0  # logarithm of the size of a term that is not there
SHOWN = 4.0  # of the likelihood ratio, what a term brings that the record shows: two standard deviations of its size


@dataclass(frozen=True)
class Cloud:
    """Draws p (M, q) of one model with their weights (M,), which add up to that of the model, and log posterior."""

    model: Model
    p: Array
    weight: Array
    log: Array


def sample(found: Fitted, data: Ordinates, prior: Prior, count: int, rng: np.random.Generator) -> tuple[Cloud, float]:
    """Return draws of a model, with weights that add up to 1, and what the evidence is above Laplace's, logarithm."""
    q = found.p.size
    values, vectors = np.linalg.eigh(found.information)
    spread = np.minimum(1.0 / np.sqrt(np.maximum(values, 1e-9)), 3.0)
    z = rng.standard_normal((count, q))
    scale = np.sqrt(FREEDOM / rng.chisquare(FREEDOM, count))
    p = found.p + (z * scale[:, None] * spread) @ vectors.T
    log_q = -0.5 * (FREEDOM + q) * np.log1p(np.sum((z * scale[:, None]) ** 2, axis=1) / FREEDOM)
    log_q += math.lgamma(0.5 * (FREEDOM + q)) - math.lgamma(0.5 * FREEDOM) - 0.5 * q * math.log(FREEDOM * math.pi)
    log_q -= float(np.sum(np.log(spread)))
    part = max(1, 400_000 // data.grid.omega.size)
    value = np.concatenate([data.value(found.model, p[i : i + part]) for i in range(0, count, part)])
    log_p = -0.5 * value + prior.log(found.model, p)
    log_w = np.where(np.isfinite(log_p), log_p - log_q, -np.inf)
    top = float(np.max(log_w))
    w = np.exp(log_w - top)
    # a single draw far out must not carry the rest
    w = np.minimum(w, np.sqrt(count) * w.mean())
    evidence = top + math.log(float(w.mean()))
    full = -0.5 * found.value + float(prior.log(found.model, found.p[None])[0])
    laplace = (
        full
        + 0.5 * q * math.log(2.0 * math.pi)
        - 0.5 * float(np.linalg.slogdet(found.information + WIDEST * np.eye(q))[1])
    )
    return Cloud(found.model, p, w / w.sum(), log_p), evidence - laplace


def candidates(search: ModelSearch) -> list[Fitted]:
    """Return the models worth drawing from, the best first, and the best ones with and without each of Q, B and K."""
    ranked = search.ranked
    out = [f for f in ranked if f.evidence > ranked[0].evidence - WINDOW][:MOST]
    for term, has in itertools.product((Q, B, K), (True, False)):
        some = [f for f in ranked if (term in f.model) == has]
        if some and some[0] not in out:
            out.append(some[0])
    return out


def draw(search: ModelSearch) -> list[Cloud]:
    """Return the draws of the models of a search; the weights add up to 1."""
    rng = np.random.default_rng(SEED)
    models = candidates(search)
    best = models[0].evidence
    rows = []
    for found in models:
        share = math.exp(max(found.evidence - best, -4.0))
        count = max(150, round(DRAWS * share / 2.0))
        cloud, more = sample(found, search.data, search.prior, count, rng)
        rows.append((cloud, found.evidence + min(max(more, -2.0), 2.0)))
    top = max(e for _, e in rows)
    total = sum(math.exp(e - top) for _, e in rows)
    return [replace(cloud, weight=cloud.weight * math.exp(e - top) / total) for cloud, e in rows]


def beside_free_bands(clouds: Sequence[Cloud], found: ModelSearch) -> list[Cloud]:
    """Return the draws with what the bands leave open, beside which as they are they were drawn.

    Of bands b off by e the other parameters are off by -H^-1 C e, H their information, C that of them and b: with e
    of the covariance (J - C'H^-1 C)^-1, J the information of b, the draws have that of all parameters together.
    """
    if not found.resonances:
        return list(clouds)
    rng, data = np.random.default_rng(SEED), found.data
    data.hold([])
    out = []
    for c in clouds:
        at = found.seen[c.model]
        whole, p = joined([*split(at.model, at.p), *found.resonances])
        info, k = 0.5 * data.scoring(whole, p)[2], at.p.size
        H, C, J = at.information + WIDEST * np.eye(k), info[:k, k:], info[k:, k:] + WIDEST * np.eye(p.size - k)
        pulled = np.linalg.solve(H, C)
        values, vectors = np.linalg.eigh(J - C.T @ pulled)
        e = rng.standard_normal((c.p.shape[0], values.size)) / np.sqrt(np.maximum(values, WIDEST)) @ vectors.T
        out.append(replace(c, p=c.p - e @ pulled.T))
    data.hold(found.resonances)
    return out


def weighted(clouds: Sequence[Cloud], figure: Callable[[Model, Array], Array | None]) -> tuple[Array, Array]:
    """Return values and weights of a figure of the parameters, of the models that have it (figure not None)."""
    values, weights = [np.empty(0)], [np.empty(0)]
    for c in clouds:
        v = figure(c.model, c.p)
        if v is not None:
            values.append(v)
            weights.append(c.weight)
    return np.concatenate(values), np.concatenate(weights)


def resampled(clouds: Sequence[Cloud], count: int) -> list[tuple[Model, Array]]:
    """Return some draws (M, q) of each model, as many as its weight, by systematic resampling."""
    out, passed = [], 0.0
    for c in clouds:
        edges = passed + np.cumsum(c.weight)
        wanted = (np.arange(count) + 0.5) / count
        inside = wanted[(wanted > passed) & (wanted <= edges[-1])]
        passed = float(edges[-1])
        if inside.size:
            out.append((c.model, c.p[np.minimum(np.searchsorted(edges, inside), c.p.shape[0] - 1)]))
    return out


def quantile(values: Array, weights: Array, share: float) -> float:
    """Return the weighted quantile of values (M,); of models that all lack weight, each draw counts the same."""
    if not weights.sum() > 0.0:
        weights = np.ones_like(weights)
    order = np.argsort(values)
    reached = np.cumsum(weights[order])
    at = (reached - 0.5 * weights[order]) / reached[-1]
    return float(np.interp(share, at, values[order]))


def density_of_walk(slowest: float) -> Callable[[Model, Array], Array | None]:
    """Return the figure log K^2: of the random walk and of Gauss-Markov processes whose log tau is above ``slowest``,
    which drift within the record as a walk of 2 sigma^2/tau does; NONE of draws with neither.
    """

    def figure(model: Model, p: Array) -> Array | None:
        parts = [q[..., 0] if t == K else np.where(q[..., 1] > slowest, q[..., 0] + math.log(2.0) - q[..., 1], NONE)
                 for t, q in split(model, p) if t in (K, GM)]  # fmt: skip
        return np.asarray(np.logaddexp.reduce(parts, axis=0)) if parts else None

    return figure


def shown(figure: Callable[[Model, Array], Array | None], found: ModelSearch) -> bool:
    """Return whether models without a term fit worse: flicker alone is likelier than two processes that fit as well, as
    one term is than two, but the record does not tell it from them.
    """
    best = {True: math.inf, False: math.inf}  # least -2 log likelihood of models with the term and without
    for f in found.seen.values():
        v = figure(f.model, f.p)
        has = v is not None and float(v) > NONE
        best[has] = min(best[has], f.value)
    return best[True] < best[False] - SHOWN
