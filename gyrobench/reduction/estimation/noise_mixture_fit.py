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
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import special

from gyrobench.reduction.estimation import noise
from gyrobench.reduction.estimation.regression import Design, RegressionError, check_data, least_squares

Array = NDArray[np.float64]
NORMAL = 1.959963984540054
LIGHT = 1e-5  # candidates this much less likely than the likeliest are left out of the intervals


@dataclass(frozen=True)
class Mixture:
    """Candidates that count: weights (g,), their estimates less the mean (g, p), covariances (g, p, p), t's dof."""

    weight: Array
    off: Array
    covariance: Array
    dof: int

    def spread(self, J: Array) -> tuple[Array, Array]:
        """Standard deviation and 95 % half width of the combinations J (q, p) of the coefficients."""
        off = self.off @ J.T
        variance = np.einsum("qi,gij,qj->gq", J, self.covariance, J)
        sd = np.sqrt(np.maximum(variance, 0.0))
        half = _half_width(self.weight, off, sd, self.dof)
        return np.sqrt(self.weight @ (sd**2 + off**2)), half

    def outside(self, J: Array, distance: Array) -> Array:
        """Return the probability that a combination lies farther than ``distance`` (q,) from its mean."""
        sd = np.sqrt(np.maximum(np.einsum("qi,gij,qj->gq", J, self.covariance, J), 1e-300))
        return _tails(self.weight, self.off @ J.T, sd, self.dof, distance)


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


def fit(
    X: Array, y: Array, names: Sequence[str], t0: Array, t1: Array, limit: float = 1e3, readings: bool = False
) -> Estimate:
    """Return the coefficients of ``y = X a + noise`` for means ``y`` (n,) over windows [t0, t1] (s).

    readings: the data are differences of readings at t0 and t1, neighbours share one.

    Raises RegressionError (a ValueError) for data that cannot carry the model and for windows without length or out
    of order.  u, half width and interval are in the unit of the coefficients.
    """
    design = check_data(X, y, names, limit)
    check_windows(t0, t1)
    n, p = X.shape
    grid = noise.noise_grid(t0, t1, readings)
    scale = np.linalg.norm(X, axis=0)
    Q, R = np.linalg.qr(X / scale)
    start = Q.T @ y
    remainder = y - Q @ start
    both = np.column_stack([Q, remainder])
    M, xy, yy, logdet = _moments(t0, t1, both, grid)
    Mi = np.linalg.inv(M)
    b = np.einsum("gpq,gq->gp", Mi, xy)
    rss = np.maximum(yy - np.einsum("gp,gp->g", xy, b), 0.0)
    ll = -0.5 * (logdet + np.linalg.slogdet(M)[1] + (n - p) * np.log(np.maximum(rss, 1e-300)))
    ll += np.log(grid.prior)
    if np.linalg.norm(remainder) <= 1e-12 * np.linalg.norm(y):  # ideal data: what is left is rounding, no noise
        ll = np.where((grid.share == 0.0) & (grid.reading == 0.0), 0.0, -np.inf)
    w = np.exp(ll - ll.max())
    w /= w.sum()

    T = np.linalg.inv(R) / scale[:, None]  # back from orthonormal columns
    estimates = (start + b) @ T.T
    beta = T @ (start + w @ b)
    s2 = rss / (n - p)
    cov_each = s2[:, None, None] * (T @ Mi @ T.T)
    off = estimates - beta
    covariance = np.einsum("g,gpq->pq", w, cov_each) + np.einsum("g,gp,gq->pq", w, off, off)
    counts = w > LIGHT * w.max()
    mixture = Mixture(w[counts] / w[counts].sum(), off[counts], cov_each[counts], n - p)
    sd, half = mixture.spread(np.eye(p))
    sd = np.maximum(sd, 1e-300)
    u = np.minimum(sd, half / NORMAL)
    covariance = covariance * np.outer(u / sd, u / sd)
    probability = mixture.outside(np.eye(p), np.abs(beta))

    k = int(np.argmax(ll))
    best = slice(k, k + 1)
    Z = noise.whiten(t0, t1, both, grid.tau[best], grid.share[best], grid.reading[best])[0][:, 0, :]
    scatter = Z[:, p] - Z[:, :p] @ b[k]
    model = float(grid.tau[k]), float(grid.share[k]), float(grid.reading[k])
    gain = T @ Mi[k] @ noise.whiten_transposed(t0, t1, Z[:, :p], model).T
    window = float(np.median(t1 - t0))
    v = noise.mean_variance(window / grid.tau)
    white = float(w[(grid.share == 0.0) & (grid.reading == 0.0)].sum())
    without_reading = s2 * (1.0 - grid.reading)
    tau = _spread(w, grid.tau, k, grid.share > 0.0)
    sigma = _spread(w, np.sqrt(without_reading * grid.share / v), k)
    density = _spread(w, np.sqrt(without_reading * (1.0 - grid.share) * window), k)
    record = float(t1[-1] - t0[0])
    warnings = []
    slow = float(w[grid.share == 0.0].sum()) < 0.5
    if slow and tau[2] > 0.9 * float(grid.tau.max()):
        warnings.append(
            f"The correlation time of the drift is not bounded by this record of {record:.4g} s (it may exceed "
            f"{tau[2]:.3g} s). Slower drift is confounded with the constant term, whose interval is valid for this "
            "record only."
        )
    return Estimate(
        tuple(names), beta, covariance, u, half, probability, equivalent_dof(half / u), y - X @ beta,
        scatter / math.sqrt(s2[k]), gain, design, white, tau, sigma, density,
        model[:2], tuple(warnings), mixture, model[2],
        _spread(w, np.sqrt(s2 * grid.reading / 2.0) * window, k),
    )  # fmt: skip


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
        Mixture(np.ones(1), np.zeros((1, len(names))), ols.covariance[None], ols.dof),
    )  # fmt: skip


def check_windows(t0: Array, t1: Array) -> None:
    """RegressionError unless every window has a length and starts where or after the one before has ended."""
    length = t1 - t0
    if np.any(~np.isfinite(length)) or np.any(length <= 0.0):
        raise RegressionError("every window needs a finite positive length")
    if np.any(t0[1:] - t1[:-1] < -1e-6 * length.min()):
        raise RegressionError("windows overlap or are out of order")


def _tails(w: Array, off: Array, sd: Array, dof: int, distance: Array) -> Array:
    """Return the probability of the mixture outside +-distance from its mean, per coefficient."""
    upper = special.stdtr(dof, -(distance - off) / sd)
    lower = special.stdtr(dof, -(distance + off) / sd)
    out: Array = w @ (upper + lower)
    return np.clip(out, 0.0, 1.0)


def _half_width(w: Array, off: Array, sd: Array, dof: int, level: float = 0.95) -> Array:
    """Newton's method on the tails between bounds that close in; bisection where a narrow candidate makes it creep."""
    quantile = float(special.stdtrit(dof, 0.5 + level / 2))
    high = np.max(np.abs(off) + quantile * sd, axis=0)
    low = np.zeros_like(high)
    height = math.exp(math.lgamma((dof + 1) / 2) - math.lgamma(dof / 2)) / math.sqrt(dof * math.pi)
    size = np.maximum(sd, 1e-300)
    x = np.minimum(quantile * np.sqrt(w @ (sd**2 + off**2)), high)
    for k in range(40):
        excess = _tails(w, off, size, dof, x) - (1.0 - level)
        low, high = np.where(excess > 0.0, x, low), np.where(excess > 0.0, high, x)
        density = sum((1.0 + ((x + s * off) / size) ** 2 / dof) ** (-(dof + 1) / 2) for s in (1.0, -1.0))
        step = x + excess / np.maximum(height * (w @ (density / size)), 1e-300)
        new = np.where((step >= low) & (step <= high) & (k < 12), step, (low + high) / 2.0)
        done = bool(np.all(np.abs(new - x) <= 1e-9 * high))
        x = new
        if done:
            break
    out: Array = x
    return out


def equivalent_dof(ratio: Array) -> Array:
    """Return the degrees of freedom whose t quantile over one standard uncertainty (of the scaled t) is ``ratio``."""
    table = np.concatenate([np.arange(1.0, 30.0, 0.25), np.geomspace(30.0, 1e4, 60)])
    quantile = special.stdtrit(table, 0.975)
    out = np.interp(ratio, quantile[::-1], table[::-1])
    result: Array = np.where(ratio <= quantile[-1], np.inf, out)
    return result


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


def _moments(t0: Array, t1: Array, columns: Array, grid: noise.NoiseGrid) -> tuple[Array, Array, Array, Array]:
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
