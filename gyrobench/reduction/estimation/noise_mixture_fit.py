"""Least squares whose noise - white, Gauss-Markov or both - is estimated from the same data, with honest intervals.

Each candidate noise model (:func:`gyrobench.reduction.estimation.noise.noise_grid`) gives a generalized least squares
estimate, its covariance and a restricted likelihood (REML, the scale integrated out):

    log L = -1/2 [ log|R| + log|X' R^-1 X| + (n - p) log(v' R^-1 v) ]

Estimates and intervals are the mixture over the candidates, weighted by likelihood times prior: the spread between
noise models that the data cannot tell apart goes into u.  A single "best" model would be too sure of itself: the
regressors swallow a good part of the slow noise they are to be judged by.  Deterministic; no iteration.

The prior is a population of instruments (constants of gyrobench.reduction.estimation.noise).  Given a candidate the
estimate is a t of n - p degrees of freedom exactly (scale with the Jeffreys prior), so 95 % intervals hold the truth of
95 % of the instruments of that population, whatever the design; of one certain instrument they may hold it more or less
often.  tests/benchmarks/coverage.py counts, for every test method; its README has the figures.

Standard uncertainty u: standard deviation of the mixture, or the 95 % half width over 1.96 where heavy tails make
that smaller.  [RED-GLS; Hu 1981, eq. 4-79..4-88]
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.reduction.estimation import known_errors, noise, nuisance_states
from gyrobench.reduction.estimation.mixture import LIGHT, RESOLVED, Mixture, equivalent_dof
from gyrobench.reduction.estimation.normal_equations import NormalEquations
from gyrobench.reduction.estimation.nuisance_states import Block, State
from gyrobench.reduction.estimation.regression import Design, RegressionError, check_data, least_squares
from gyrobench.reduction.estimation.uncertainty import NORMAL

JOINED = 0.99  # probability from which on a possible effect is reported with the coefficients
SLOW = 0.125  # of the record: longer correlation times are slow drift, which a record tells from white noise badly


@dataclass(frozen=True)
class Evidence:
    """What the data say of a possible effect: probability that it is there, its constants if it is, and by how much
    the coefficients (p,) then differ from those without it.
    """

    block: Block
    probability: float
    value: Array  # (k,)
    u: Array
    change: Array  # (p,)
    u_without: Array
    u_with: Array
    scatter: tuple[float, float, float, float]  # of its constants: mean, standard deviation, 2.5 % and 97.5 % point

    @property
    def joined(self) -> bool:
        return self.probability >= JOINED

    @property
    def names(self) -> tuple[str, ...]:
        k = self.block.columns.shape[1]
        return (self.block.name,) if k == 1 else tuple(f"{self.block.name} {j + 1}" for j in range(k))


@dataclass(frozen=True)
class Estimate:
    """A fit under an estimated noise model; arrays follow ``names``."""

    names: tuple[str, ...]
    beta: Array
    covariance: Array  # of the mixture, scaled to ``u``
    u: Array
    half_width: Array  # of the 95 % interval, symmetric about beta
    p: Array  # two-sided probability of a true zero
    dof: Array  # of the t distribution with the same u and half width; infinite for a normal one
    residual: Array
    whitened: Array  # residuals under the most likely model, decorrelated, unit variance
    gain: Array  # (p, n): beta = gain y under the most likely model
    design: Design
    white: float  # share of the noise models without correlation, 0..1
    tau: tuple[float, float, float]  # correlation time: likeliest, 5 % and 95 % point, s
    sigma: tuple[float, float, float]  # rms of the Gauss-Markov part: likeliest, 5 % and 95 % point
    density: tuple[float, float, float]  # density N of the white part (unit sqrt(s)): likeliest, 5 % and 95 % point
    best: tuple[float, float]  # tau and share of the most likely model
    warnings: tuple[str, ...]
    mixture: Mixture
    reading: float = 0.0  # share of reading errors in the most likely model
    sigma_reading: tuple[float, float, float] = (0.0, 0.0, 0.0)  # of one reading: likeliest, 5 % and 95 % point
    X: Array = field(default_factory=lambda: np.empty((0, 0)))  # the columns of ``names``
    evidence: tuple[Evidence, ...] = ()  # of each block
    fitted: Array = field(default_factory=lambda: np.empty((0, 0)))  # the columns that ``whitened`` are residuals of
    models: Array = field(default_factory=lambda: np.array([[1.0, 0.0, 0.0, 1.0]]))
    # (g, 4): tau, share, reading and weight of the noise models that count, the most likely one first
    known: Array = field(default_factory=lambda: np.empty((0, 0)))  # (n, r): errors of known size, known_errors.columns
    variance: Array = field(default_factory=lambda: np.ones(1))  # (g,): of unit weight beside them, of each of models
    set_up: Array = field(default_factory=lambda: np.zeros(1))  # (n,) or 0: what is predicted of them


def fit(
    X: Array, y: Array, names: Sequence[str], t0: Array, t1: Array, limit: float = 1e3, readings: bool = False,
    blocks: Sequence[Block] = (), known: Array | None = None,
) -> Estimate:  # fmt: skip
    """Return the coefficients of ``y = X a + noise`` for means ``y`` (n,) over windows [t0, t1] (s).

    readings: the data are differences of readings at t0 and t1, neighbours share one.  blocks: effects that may be in
    the data too (gyrobench.reduction.estimation.nuisance_states); their columns must not be combinations of X.  The
    coefficients of those that are, with a probability above JOINED, follow the others.  known (m, n): errors in the
    data of one standard uncertainty each, independent (known_errors): they are in the weights, in no u and half width.

    Raises RegressionError (a ValueError) for data that cannot carry the model and for windows without length or out
    of order.  u, half width and interval are in the unit of the coefficients.
    """
    design = check_data(X, y, names, limit)
    check_windows(t0, t1)
    n, p = X.shape
    grid = noise.noise_grid(t0, t1, readings)
    scale = np.linalg.norm(X, axis=0)
    Q, R = np.linalg.qr(X / scale)
    Z = np.column_stack([np.empty((n, 0)), *(b.columns for b in blocks)])
    z_scale = np.linalg.norm(Z, axis=0)
    z_scale = np.where(z_scale > 0.0, z_scale, 1.0)  # a mount of which every row is left out
    start = np.concatenate([Q.T @ y, np.zeros(z_scale.size)])
    remainder = y - Q @ start[:p]
    stated = known_errors.columns(known, remainder)
    c = start.size
    both = np.column_stack([Q, Z / z_scale, stated, remainder])
    absorbed = known_errors.absorb(moments(t0, t1, both, grid), c, n)
    M, xy, yy, logdet = absorbed.square, absorbed.own, absorbed.data, absorbed.logdet
    T = np.zeros((start.size, start.size))  # back from the columns of both
    T[:p, :p] = np.linalg.inv(R) / scale[:, None]
    T[p:, p:] = np.diag(1.0 / z_scale)
    equations, likely, unit = _all_in(blocks, M, xy, yy, logdet, n, p, grid.prior)
    each = list(nuisance_states.states(blocks, z_scale, equations.S, np.einsum("gcc->gc", M)[:, p:], likely, unit))
    parts = [_posterior(s, equations, logdet, n, p) for s in each]
    ll = np.array([part[0] for part in parts]) + np.log(grid.prior)  # (states, models)
    white_only = (grid.share == 0.0) & (grid.reading == 0.0)
    tiny = 1e-12 * np.linalg.norm(y)
    if np.linalg.norm(remainder) <= tiny:  # ideal data: what is left is rounding, no noise
        ll = np.where(white_only & (np.arange(len(each)) == 0)[:, None], 0.0, -np.inf)
    elif blocks and np.linalg.norm(remainder - both[:, :c] @ np.linalg.lstsq(both[:, :c], remainder)[0]) <= tiny:
        ll = np.where(white_only, ll, -np.inf)
    likelihood = _normalized(ll)
    w = _normalized(ll + np.array([s.favour for s in each])[:, None])
    flat = w.ravel()
    b, s2 = (np.concatenate([part[k] for part in parts]) for k in (1, 2))

    estimates = (start + b) @ T.T
    beta = flat @ estimates
    off = estimates - beta
    counts = np.maximum(flat, likelihood.ravel()) > LIGHT * flat.max()
    chosen = zip(each, counts.reshape(w.shape), strict=True)
    cofactors = np.concatenate([equations.cofactors(s.extra, s.precision, models) for s, models in chosen])
    cov_each = T @ (s2[counts, None, None] * cofactors) @ T.T
    best, k = np.unravel_index(int(np.argmax(ll)), ll.shape)
    dof = n - p - each[best].flat
    slow_drift = _slow(grid, t0, t1)
    slow_drift = np.tile(slow_drift, len(each))[counts]
    mixture = Mixture(flat[counts] / flat[counts].sum(), off[counts], cov_each, dof, slow_drift)
    if stated.size:
        pulled = T @ known_errors.pulled(absorbed, cofactors, counts.reshape(w.shape))
        part = pulled @ pulled.transpose(0, 2, 1)
        # the errors are of known size: what the scatter says of the noise is not of them
        extra = 1.0 - s2[counts] / np.tile(absorbed.variance, len(each))[counts]
        likeliest = pulled[int(np.searchsorted(np.flatnonzero(counts), np.argmax(ll)))]  # as the gain
        mixture = replace(
            mixture, covariance=cov_each + extra[:, None, None] * part, known=likeliest @ likeliest.T, known_each=part
        )
    evidence = _evidence(blocks, each, likelihood, estimates, mixture, counts, s2.reshape(w.shape), p)
    keep = np.concatenate([np.ones(p, bool), *(_repeated(e.block, e.joined) for e in evidence)])
    mixture = replace(
        mixture, off=mixture.off[:, keep], covariance=mixture.covariance[:, keep][:, :, keep],
        known=None if mixture.known is None else mixture.known[np.ix_(keep, keep)],
        known_each=None if mixture.known_each is None else mixture.known_each[:, keep][:, :, keep],
    )  # fmt: skip
    eye = np.eye(int(keep.sum()))
    covariance = np.einsum("g,gpq->pq", mixture.weight, mixture.covariance)
    covariance += np.einsum("g,gp,gq->pq", mixture.weight, mixture.off, mixture.off)
    sd, half = mixture.spread(eye)
    sd = np.maximum(sd, 1e-300)
    u = np.minimum(sd, half / NORMAL)
    if mixture.known_each is not None:
        covariance -= np.einsum("g,gpq->pq", mixture.weight, mixture.known_each)
        np.fill_diagonal(covariance, np.maximum(np.diag(covariance), RESOLVED * np.diag(mixture.known_each[0])))
        sd = np.maximum(np.sqrt(np.diag(covariance)), 1e-300)
    covariance = covariance * np.outer(u / sd, u / sd)
    probability = mixture.outside(eye, np.abs(beta[keep]))

    index, at = each[best].index(p), int(best) * grid.tau.size + int(k)
    only = slice(k, k + 1)
    one = grid.tau[only], grid.share[only], grid.reading[only]
    Zk = noise.whiten(t0, t1, both, *one)[0][:, 0, :]
    z = absorbed.predicted(int(k), index, b[at, index])
    scatter = Zk[:, -1] - Zk[:, index] @ b[at, index] - Zk[:, c:-1] @ z
    plain = np.sum(Zk[:, c:-1] ** 2, axis=0) > absorbed.variance[k]  # told from the noise: the fit takes it away
    model = float(grid.tau[k]), float(grid.share[k]), float(grid.reading[k])
    Mk = M[k][np.ix_(index, index)]
    Mk[range(p, len(index)), range(p, len(index))] += each[best].precision[k]
    own = noise.whiten_transposed(t0, t1, Zk[:, [*index, *range(c, c + stated.shape[1])]], model).T
    gain = np.zeros((start.size, n))
    gain[index] = np.linalg.solve(Mk, own[: len(index)] - absorbed.taken[k][index] @ own[len(index) :])
    gain = (T @ gain)[keep]
    window = float(np.median(t1 - t0))
    v = noise.mean_variance(window / grid.tau)
    models, best_s2 = w.sum(axis=0), s2.reshape(w.shape)[best]
    white = float(models[white_only].sum())
    without_reading = best_s2 * (1.0 - grid.reading)
    tau = _spread(models, grid.tau, int(k), grid.share > 0.0)
    sigma = _spread(models, np.sqrt(without_reading * grid.share / v), int(k))
    density = _spread(models, np.sqrt(without_reading * (1.0 - grid.share) * window), int(k))
    record = float(t1[-1] - t0[0])
    warnings = []
    slow = float(models[grid.share == 0.0].sum()) < 0.5
    if slow and tau[2] > 0.9 * float(grid.tau.max()):
        warnings.append(
            f"The correlation time of the drift is not bounded by this record of {record:.4g} s (it may exceed "
            f"{tau[2]:.0f} s). Slower drift is confounded with the constant term, whose interval is valid for this "
            "record only."
        )
    columns, counted = np.column_stack([X, Z])[:, keep], _counted(models, int(k))
    joined = tuple(c for e in evidence if e.joined for c in e.names)
    return Estimate(
        (*names, *joined), beta[keep], covariance, u, half, probability, equivalent_dof(half / np.maximum(u, 1e-300)),
        y - columns @ beta[keep], scatter / math.sqrt(max(float(s2[at]), 1e-300)), gain, design, white, tau, sigma,
        density, model[:2], tuple(warnings), mixture, model[2],
        _spread(models, np.sqrt(best_s2 * grid.reading / 2.0) * window, int(k)), columns, tuple(evidence),
        np.column_stack([Zk[:, index], Zk[:, c:-1][:, plain]]), _listed(grid, models, counted), stated,
        absorbed.variance[counted], stated @ z,
    )  # fmt: skip


def _normalized(log_weight: Array) -> Array:
    """Return weights with a sum of 1."""
    weight: Array = np.exp(log_weight - log_weight.max())
    weight /= weight.sum()
    return weight


def _slow(grid: noise.NoiseGrid, t0: Array, t1: Array) -> NDArray[np.bool_]:
    """Return which models (G,) have drift slower than SLOW that moves the mean of the record more than the rest of the
    noise does: share v(T/tau)/v(w/tau) > (1 - share)/n.  Fainter drift is as good as white noise; with it, what is
    asked for if the drift is slow would mostly be the intervals of white noise.
    """
    record, window = float(t1[-1] - t0[0]), float(np.median(t1 - t0))
    mean = grid.share * noise.mean_variance(record / grid.tau) / noise.mean_variance(window / grid.tau)
    out: NDArray[np.bool_] = (grid.tau > SLOW * record) & (mean > (1.0 - grid.share) / t0.size)
    return out


def _counted(weight: Array, k: int) -> NDArray[np.intp]:
    """Return the numbers of model k and of the models with more than a hundredth of the largest weight."""
    counts = np.flatnonzero(weight > 0.01 * weight.max())
    return np.concatenate([[k], counts[counts != k]])


def _listed(grid: noise.NoiseGrid, weight: Array, order: NDArray[np.intp]) -> Array:
    """Return tau, share, reading and weight (g, 4) of the models ``order``."""
    w = weight[order] / weight[order].sum()
    return np.column_stack([grid.tau[order], grid.share[order], grid.reading[order], w])


def _all_in(
    blocks: Sequence[Block], M: Array, xy: Array, yy: Array, logdet: Array, n: int, p: int, prior: Array
) -> tuple[NormalEquations, Array, float]:
    """Normal equations without the p coefficients; with all single effects in the design: weights (G,) of the noise
    models and standard deviation of unit weight.
    """
    single = np.flatnonzero(np.concatenate([np.empty(0, bool), *(_repeated(b, not b.scatter) for b in blocks)]))
    try:
        equations = NormalEquations.of(M, xy, yy, p)
        _, rss, determinant = equations.solve(single.tolist())
    except np.linalg.LinAlgError:
        names = ", ".join(b.name for b in blocks)
        raise RegressionError(
            f"{n} windows cannot tell apart what may be in them beside the coefficients ({names}); set nuisances = "
            "none, or record more"
        ) from None
    rss = np.maximum(rss, 1e-300)
    m = n - p - single.size
    ll = np.log(prior) - 0.5 * (logdet + determinant + m * np.log(rss))
    likely = np.exp(ll - ll.max())
    likely /= likely.sum()
    return equations, likely, math.exp(0.5 * float(likely @ np.log(rss / m)))


def _repeated(block: Block, value: bool) -> NDArray[np.bool_]:
    """A value for each column of a block."""
    return np.full(block.columns.shape[1], value)


def _posterior(s: State, equations: NormalEquations, logdet: Array, n: int, p: int) -> tuple[Array, Array, Array]:
    """Log likelihood (G,), coefficients (G, all) and variance of unit weight (G,) of a combination."""
    b, rss, determinant = equations.solve(s.extra, s.precision)
    rss = np.maximum(rss, 0.0)
    m = n - p - s.flat
    ll = -0.5 * (logdet + determinant + m * np.log(np.maximum(math.pi * rss, 1e-300)))
    ll += s.log_weight + math.lgamma(m / 2.0)
    s2: Array = rss / m
    return ll, b, s2


def _evidence(
    blocks: Sequence[Block], each: Sequence[State], w: Array, estimates: Array, mixture: Mixture,
    counts: NDArray[np.bool_], s2: Array, p: int,
) -> list[Evidence]:  # fmt: skip
    """What the data say of each block; estimates (states * models, all columns), w and s2 (states, models)."""
    found, at, flat = [], p, w.ravel()
    sd = np.sqrt(np.maximum(np.einsum("gpp->gp", mixture.covariance), 0.0))
    total = np.zeros_like(estimates)
    total[counts] = sd**2
    for j, block in enumerate(blocks):
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
        found.append(
            Evidence(block, probability, with_it[columns], u_with[columns], change, u_without, u_with[:p], spread)
        )
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


def ordinary(
    X: Array, y: Array, names: Sequence[str], t0: Array, t1: Array, weights: Array | None = None, limit: float = 1e3
) -> Estimate:
    """As :func:`fit` for noise that is taken as white: (weighted) least squares with t intervals of n - p degrees.

    weights (n,): proportional to 1/variance.  For a few readings, from which no noise model can be estimated; slow
    drift, which would make the intervals too narrow, is not modelled.
    """
    design = check_data(X, y, names, limit)
    check_windows(t0, t1)
    ols = least_squares(X, y, names, weights)
    root = np.ones_like(y) if weights is None else np.sqrt(weights)
    spread = ols.s / float(np.median(root))
    density = spread * math.sqrt(float(np.median(t1 - t0)))
    whitened = ols.residual * root / ols.s if ols.s > 0.0 else np.zeros_like(y)
    dof = np.full(len(names), float(ols.dof))
    return Estimate(
        ols.names, ols.beta, ols.covariance, ols.u, ols.half_width(), ols.p, dof, ols.residual, whitened,
        ols.gain, design, 1.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (density, density, density), (1.0, 0.0), (),
        Mixture(np.ones(1), np.zeros((1, len(names))), ols.covariance[None], ols.dof), X=X,
        fitted=X * root[:, None],
    )  # fmt: skip


def check_windows(t0: Array, t1: Array) -> None:
    """RegressionError unless every window has a length and starts where or after the one before has ended."""
    length = t1 - t0
    if np.any(~np.isfinite(length)) or np.any(length <= 0.0):
        raise RegressionError("every window needs a finite positive length")
    if np.any(t0[1:] - t1[:-1] < -1e-6 * length.min()):
        raise RegressionError("windows overlap or are out of order")


def _spread(w: Array, values: Array, k: int, where: NDArray[np.bool_] | None = None) -> tuple[float, float, float]:
    """Return the value of the likeliest model with the 5 % and 95 % points over all (``where``) models."""
    if where is not None:
        w = np.where(where, w, 0.0)
        k = k if where[k] else int(np.argmax(w))
    if not w.sum() > 0.0:
        return 0.0, 0.0, 0.0
    order = np.argsort(values)
    total = np.cumsum(w[order]) / w.sum()
    low, high = (float(values[order][min(int(np.searchsorted(total, q)), order.size - 1)]) for q in (0.05, 0.95))
    return float(values[k]), low, high


def moments(t0: Array, t1: Array, columns: Array, grid: noise.NoiseGrid) -> tuple[Array, Array, Array, Array]:
    """X'X, X'y, y'y of the whitened columns (y the last) and log determinants, model by model."""
    models, c = grid.tau.size, columns.shape[1]
    square, logdet = np.zeros((models, c, c)), np.zeros(models)
    for alike in (grid.reading == 0.0, grid.reading > 0.0):  # without reading errors it is quicker
        g = np.flatnonzero(alike)
        if g.size:
            for _, Z, part in noise.whitened_blocks(t0, t1, columns, grid.tau[g], grid.share[g], grid.reading[g]):
                zt = np.ascontiguousarray(Z.transpose(2, 1, 0))
                square[g] += zt @ zt.transpose(0, 2, 1)
                logdet[g] += part
    return square[:, :-1, :-1], square[:, :-1, -1], square[:, -1, -1], logdet
