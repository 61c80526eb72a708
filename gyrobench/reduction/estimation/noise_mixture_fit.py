"""Least squares whose noise - white, with or without drift - is estimated from the same data, with honest intervals.

Each candidate noise model (:func:`gyrobench.reduction.estimation.noise.noise_grid`) gives a generalized least squares
estimate, its covariance and a restricted likelihood (REML, the scale integrated out):

    log L = -1/2 [ log|R| + log|X' R^-1 X| + (n - p) log(v' R^-1 v) ]

Estimates and intervals are the mixture over the candidates, weighted by likelihood times prior: the spread between
noise models that the data cannot tell apart goes into u.  A single "best" model would understate the uncertainty: the
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
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.reduction.estimation import known_errors, noise, nuisance_states, power_law
from gyrobench.reduction.estimation.mixture import LIGHT, RESOLVED, Mixture, equivalent_dof
from gyrobench.reduction.estimation.noise_estimate import Evidence, Likeliest, NoiseEstimate, NoiseSummary, spread
from gyrobench.reduction.estimation.normal_equations import NormalEquations, moments
from gyrobench.reduction.estimation.nuisance_evidence import evidence_of, repeated
from gyrobench.reduction.estimation.nuisance_states import NuisanceBlock, NuisanceState
from gyrobench.reduction.estimation.regression import Design, RegressionError, check_data, least_squares
from gyrobench.reduction.estimation.sentences import seconds
from gyrobench.reduction.estimation.uncertainty import NORMAL

SLOW = 0.125  # of the record: longer correlation times are slow drift, which a record tells from white noise badly


class Problem:
    """A fit as it is solved: columns scaled and at right angles, moments under every noise model.

    columns: those of X, then of the blocks, the errors of known size (stated), and what least squares leave of the
    data.  back (c, c): from its unknowns to the coefficients.  start (c,): of least squares.  scale: of the blocks'
    columns.
    """

    def __init__(
        self, X: Array, y: Array, t0: Array, t1: Array, readings: bool, blocks: Sequence[NuisanceBlock],
        known: Array | None,
    ) -> None:  # fmt: skip
        self.X, self.y, self.t0, self.t1, self.blocks = X, y, t0, t1, blocks
        n, p = X.shape
        self.grid = noise.noise_grid(t0, t1, readings)
        size = np.linalg.norm(X, axis=0)
        Q, R = np.linalg.qr(X / size)
        Z = np.column_stack([np.empty((n, 0)), *(b.columns for b in blocks)])
        z_size = np.linalg.norm(Z, axis=0)
        self.scale = np.where(z_size > 0.0, z_size, 1.0)  # a mount of which every row is left out
        self.start = np.concatenate([Q.T @ y, np.zeros(z_size.size)])
        remainder = y - Q @ self.start[:p]
        self.stated = known_errors.columns(known, remainder)
        self.columns = np.column_stack([Q, Z / self.scale, self.stated, remainder])
        self.back = np.zeros((self.start.size, self.start.size))
        self.back[:p, :p] = np.linalg.inv(R) / size[:, None]
        self.back[p:, p:] = np.diag(1.0 / self.scale)
        self.absorbed = known_errors.absorb(moments(t0, t1, self.columns, self.grid), self.start.size, n)

    @property
    def white_only(self) -> NDArray[np.bool_]:
        out: NDArray[np.bool_] = (self.grid.share == 0.0) & (self.grid.reading == 0.0)
        return out


@dataclass(frozen=True)
class Weighed:
    """States (combinations of effects) by noise models: likelihood and weight (s, G), unknowns (s G, c), s2 (s, G)."""

    states: list[NuisanceState]
    equations: NormalEquations
    likelihood: Array
    weight: Array
    unknowns: Array
    s2: Array
    best: tuple[int, int]  # state and noise model


def fit(
    X: Array, y: Array, names: Sequence[str], t0: Array, t1: Array, limit: float = 1e3, readings: bool = False,
    blocks: Sequence[NuisanceBlock] = (), known: Array | None = None,
) -> NoiseEstimate:  # fmt: skip
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
    problem = Problem(X, y, t0, t1, readings, blocks, known)
    weighed = _weigh(problem)
    estimates, beta, counts, mixture = _average(problem, weighed)
    evidence = evidence_of(problem, weighed, estimates, mixture, counts)
    keep = np.concatenate([np.ones(X.shape[1], bool), *(repeated(e.block, e.joined) for e in evidence)])
    return _summarized(problem, weighed, beta, _kept(mixture, keep), keep, names, design, evidence)


def _weigh(problem: Problem) -> Weighed:
    """Return how likely each combination of effects is under each noise model, and its unknowns."""
    (n, p), grid, m = problem.X.shape, problem.grid, problem.absorbed
    c = problem.start.size
    equations, likely, unit = _all_in(problem)
    square = np.einsum("gcc->gc", m.square)[:, p:]
    each = list(nuisance_states.states(problem.blocks, problem.scale, equations.S, square, likely, unit))
    parts = [_posterior(s, equations, m.logdet, n, p) for s in each]
    ll = np.array([part[0] for part in parts]) + np.log(grid.prior)  # (states, models)
    remainder, both = problem.columns[:, -1], problem.columns[:, :c]
    tiny = 1e-12 * np.linalg.norm(problem.y)
    if np.linalg.norm(remainder) <= tiny:  # ideal data: what is left is rounding, no noise
        ll = np.where(problem.white_only & (np.arange(len(each)) == 0)[:, None], 0.0, -np.inf)
    elif problem.blocks and np.linalg.norm(remainder - both @ np.linalg.lstsq(both, remainder)[0]) <= tiny:
        ll = np.where(problem.white_only, ll, -np.inf)
    weight = _normalized(ll + np.array([s.favour for s in each])[:, None])
    unknowns, s2 = (np.concatenate([part[k] for part in parts]) for k in (1, 2))
    best, k = np.unravel_index(int(np.argmax(ll)), ll.shape)
    return Weighed(each, equations, _normalized(ll), weight, unknowns, s2.reshape(ll.shape), (int(best), int(k)))


def _average(problem: Problem, weighed: Weighed) -> tuple[Array, Array, NDArray[np.bool_], Mixture]:
    """Return the estimates (s G, c) of all candidates, their mean, which of them count, and those as a mixture."""
    flat, T = weighed.weight.ravel(), problem.back
    estimates = (problem.start + weighed.unknowns) @ T.T
    beta = flat @ estimates
    off = estimates - beta
    counts = np.maximum(flat, weighed.likelihood.ravel()) > LIGHT * flat.max()
    table = counts.reshape(weighed.weight.shape)
    chosen = zip(weighed.states, table, strict=True)
    cofactors = np.concatenate([weighed.equations.cofactors(s.extra, s.precision, models) for s, models in chosen])
    s2 = weighed.s2.ravel()[counts]
    each = T @ (s2[:, None, None] * cofactors) @ T.T
    n, p = problem.X.shape
    dof = n - p - weighed.states[weighed.best[0]].flat
    slow = np.tile(_slow(problem.grid, problem.t0, problem.t1), len(weighed.states))[counts]
    mixture = Mixture(flat[counts] / flat[counts].sum(), off[counts], each, dof, slow)
    if problem.stated.size:
        mixture = _with_known(problem, weighed, mixture, cofactors, table)
    return estimates, beta, counts, mixture


def _with_known(
    problem: Problem, weighed: Weighed, mixture: Mixture, cofactors: Array, table: NDArray[np.bool_]
) -> Mixture:
    """Return the mixture with the part of its covariances that errors of known size make."""
    counts = table.ravel()
    pulled = problem.back @ known_errors.pulled(problem.absorbed, cofactors, table)
    part = pulled @ pulled.transpose(0, 2, 1)
    # the errors are of known size: what the scatter says of the noise is not of them
    variance = np.tile(problem.absorbed.variance, len(weighed.states))[counts]
    extra = 1.0 - weighed.s2.ravel()[counts] / variance
    at = weighed.best[0] * problem.grid.tau.size + weighed.best[1]
    likeliest = pulled[int(np.searchsorted(np.flatnonzero(counts), at))]  # as the gain
    covariance = mixture.covariance + extra[:, None, None] * part
    return replace(mixture, covariance=covariance, known=likeliest @ likeliest.T, known_each=part)


def _kept(mixture: Mixture, keep: NDArray[np.bool_]) -> Mixture:
    """Return the mixture of the unknowns that are reported."""
    return replace(
        mixture, off=mixture.off[:, keep], covariance=mixture.covariance[:, keep][:, :, keep],
        known=None if mixture.known is None else mixture.known[np.ix_(keep, keep)],
        known_each=None if mixture.known_each is None else mixture.known_each[:, keep][:, :, keep],
    )  # fmt: skip


def _summarized(
    problem: Problem, weighed: Weighed, beta: Array, mixture: Mixture, keep: NDArray[np.bool_],
    names: Sequence[str], design: Design, evidence: Sequence[Evidence],
) -> NoiseEstimate:  # fmt: skip
    """Return what is reported: moments and intervals of the mixture, and what the most likely model says."""
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
    models = weighed.weight.sum(axis=0)
    counted = _counted(models, weighed.best[1])
    columns = np.column_stack([problem.X, *(b.columns for b in problem.blocks)])[:, keep]
    joined = tuple(c for e in evidence if e.joined for c in e.names)
    return NoiseEstimate(
        names=(*names, *joined),
        beta=beta[keep],
        covariance=covariance * np.outer(u / sd, u / sd),
        u=u,
        half_width=half,
        p=mixture.outside(eye, np.abs(beta[keep])),
        dof=equivalent_dof(half / np.maximum(u, 1e-300)),
        residual=problem.y - columns @ beta[keep],
        X=columns,
        design=design,
        mixture=mixture,
        noise=_noise(problem, weighed, models, counted),
        likeliest=_likeliest(problem, weighed, keep, counted),
        evidence=tuple(evidence),
    )


def _likeliest(problem: Problem, weighed: Weighed, keep: NDArray[np.bool_], counted: NDArray[np.intp]) -> Likeliest:
    """Return the fit under the most likely combination and noise model."""
    (best, k), grid, absorbed = weighed.best, problem.grid, problem.absorbed
    state, (n, p), c = weighed.states[best], problem.X.shape, problem.start.size
    index, at = state.index(p), best * grid.tau.size + k
    b = weighed.unknowns[at, index]
    only = slice(k, k + 1)
    one = grid.tau[only], grid.share[only], grid.reading[only]
    Zk = noise.whiten(problem.t0, problem.t1, problem.columns, *one)[0][:, 0, :]
    z = absorbed.predicted(k, index, b)
    scatter = Zk[:, -1] - Zk[:, index] @ b - Zk[:, c:-1] @ z
    plain = np.sum(Zk[:, c:-1] ** 2, axis=0) > absorbed.variance[k]  # told from the noise: the fit takes it away
    model = float(grid.tau[k]), float(grid.share[k]), float(grid.reading[k])
    Mk = absorbed.square[k][np.ix_(index, index)]
    Mk[range(p, len(index)), range(p, len(index))] += state.precision[k]
    columns = [*index, *range(c, c + problem.stated.shape[1])]
    own = noise.whiten_transposed(problem.t0, problem.t1, Zk[:, columns], model).T
    gain = np.zeros((c, n))
    gain[index] = np.linalg.solve(Mk, own[: len(index)] - absorbed.taken[k][index] @ own[len(index) :])
    return Likeliest(
        whitened=scatter / math.sqrt(max(float(weighed.s2.ravel()[at]), 1e-300)),
        fitted=np.column_stack([Zk[:, index], Zk[:, c:-1][:, plain]]),
        gain=(problem.back @ gain)[keep],
        known=problem.stated,
        variance=absorbed.variance[counted],
        set_up=problem.stated @ z,
    )


def _noise(problem: Problem, weighed: Weighed, models: Array, counted: NDArray[np.intp]) -> NoiseSummary:
    """Return the noise models as they are reported; models (G,): their weights."""
    (best, k), grid = weighed.best, problem.grid
    window = float(np.median(problem.t1 - problem.t0))
    v = noise.mean_variance(window / np.abs(grid.tau))
    markov, law = (grid.share > 0.0) & (grid.tau > 0.0), grid.tau < 0.0
    s2 = weighed.s2[best]
    without_reading = s2 * (1.0 - grid.reading)
    tau = spread(models, grid.tau, k, markov)
    white, drift = np.sqrt(without_reading * (1.0 - grid.share) * window), np.sqrt(without_reading * grid.share / v)
    m = int(np.argmax(np.where(law, -1.0, models)))
    record = float(problem.t1[-1] - problem.t0[0])
    unbounded = ""
    if float(models[law].sum()) > 0.5:
        unbounded = (
            f"Over this record of {seconds(record, 4)} the spectrum of the drift rises towards low frequencies as that "
            "of flicker noise or faster. Slower drift is confounded with the constant term, whose interval is valid "
            "for this record only."
        )
    elif float(models[grid.share == 0.0].sum()) < 0.5 and tau[2] > 0.9 * float(grid.tau.max()):
        unbounded = (
            f"The correlation time of the drift is not bounded by this record of {seconds(record, 4)} (it may exceed "
            f"{tau[2]:.0f} s). Slower drift is confounded with the constant term, whose interval is valid for this "
            "record only."
        )
    return NoiseSummary(
        white=float(models[problem.white_only].sum()),
        tau=tau,
        sigma=spread(models, drift, k, ~law),
        density=spread(models, white, k),
        sigma_reading=spread(models, np.sqrt(s2 * grid.reading / 2.0) * window, k),
        law=spread(models, np.sqrt(without_reading * grid.share), k, law),
        markov=(float(white[m]), float(drift[m]), float(grid.tau[m])),
        models=_listed(grid, models, counted),
        unbounded=unbounded,
    )


def _normalized(log_weight: Array) -> Array:
    """Return weights with a sum of 1."""
    weight: Array = np.exp(log_weight - log_weight.max())
    weight /= weight.sum()
    return weight


def _slow(grid: noise.NoiseGrid, t0: Array, t1: Array) -> NDArray[np.bool_]:
    """Return which models (G,) have drift slower than SLOW, as power laws have, that moves the mean of the record more
    than the rest of the noise does: share v(T)/v(w) > (1 - share)/n.  Fainter drift is as good as white noise; with it,
    what is asked for if the drift is slow would mostly be the intervals of white noise.
    """
    record, window = float(t1[-1] - t0[0]), float(np.median(t1 - t0))
    tau = np.abs(grid.tau)
    mean = grid.share * noise.mean_variance(record / tau) / noise.mean_variance(window / tau)
    if np.any(law := grid.tau < 0.0):
        part = [power_law.variance(t0, t1, tau[law], length) for length in (record, window)]
        mean[law] = grid.share[law] * part[0] / part[1]
    out: NDArray[np.bool_] = (law | (tau > SLOW * record)) & (mean > (1.0 - grid.share) / t0.size)
    return out


def _counted(weight: Array, k: int) -> NDArray[np.intp]:
    """Return the numbers of model k and of the models with more than a hundredth of the largest weight."""
    counts = np.flatnonzero(weight > 0.01 * weight.max())
    return np.concatenate([[k], counts[counts != k]])


def _listed(grid: noise.NoiseGrid, weight: Array, order: NDArray[np.intp]) -> Array:
    """Return tau, share, reading and weight (g, 4) of the models ``order``."""
    w = weight[order] / weight[order].sum()
    return np.column_stack([grid.tau[order], grid.share[order], grid.reading[order], w])


def _all_in(problem: Problem) -> tuple[NormalEquations, Array, float]:
    """Normal equations without the p coefficients; with all single effects in the design: weights (G,) of the noise
    models and standard deviation of unit weight.
    """
    blocks, absorbed, (n, p) = problem.blocks, problem.absorbed, problem.X.shape
    single = np.flatnonzero(np.concatenate([np.empty(0, bool), *(repeated(b, not b.scatter) for b in blocks)]))
    try:
        equations = NormalEquations.of(absorbed.square, absorbed.own, absorbed.data, p)
        _, rss, determinant = equations.solve(single.tolist())
    except np.linalg.LinAlgError:
        names = ", ".join(b.name for b in blocks)
        raise RegressionError(
            f"{n} windows: the candidate effects beside the coefficients ({names}) are collinear; set nuisances = "
            "none, or record more"
        ) from None
    rss = np.maximum(rss, 1e-300)
    m = n - p - single.size
    ll = np.log(problem.grid.prior) - 0.5 * (absorbed.logdet + determinant + m * np.log(rss))
    likely = _normalized(ll)
    return equations, likely, math.exp(0.5 * float(likely @ np.log(rss / m)))


def _posterior(
    s: NuisanceState, equations: NormalEquations, logdet: Array, n: int, p: int
) -> tuple[Array, Array, Array]:
    """Log likelihood (G,), coefficients (G, all) and variance of unit weight (G,) of a combination."""
    b, rss, determinant = equations.solve(s.extra, s.precision)
    rss = np.maximum(rss, 0.0)
    m = n - p - s.flat
    ll = -0.5 * (logdet + determinant + m * np.log(np.maximum(math.pi * rss, 1e-300)))
    ll += s.log_weight + math.lgamma(m / 2.0)
    s2: Array = rss / m
    return ll, b, s2


def ordinary(
    X: Array, y: Array, names: Sequence[str], t0: Array, t1: Array, weights: Array | None = None, limit: float = 1e3
) -> NoiseEstimate:
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
    return NoiseEstimate(
        names=ols.names,
        beta=ols.beta,
        covariance=ols.covariance,
        u=ols.u,
        half_width=ols.half_width(),
        p=ols.p,
        dof=np.full(len(names), float(ols.dof)),
        residual=ols.residual,
        X=X,
        design=design,
        mixture=Mixture(np.ones(1), np.zeros((1, len(names))), ols.covariance[None], ols.dof),
        noise=NoiseSummary(density=(density, density, density), markov=(density, 0.0, 1.0)),
        likeliest=Likeliest(whitened, X * root[:, None], ols.gain),
    )


def check_windows(t0: Array, t1: Array) -> None:
    """RegressionError unless every window has a length and starts where or after the one before has ended."""
    length = t1 - t0
    if np.any(~np.isfinite(length)) or np.any(length <= 0.0):
        raise RegressionError("every window needs a finite positive length")
    if np.any(t0[1:] - t1[:-1] < -1e-6 * length.min()):
        raise RegressionError("windows overlap or are out of order")
