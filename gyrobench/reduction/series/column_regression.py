"""Regression of an evenly sampled rate whose noise - white, flicker, random walk, Gauss-Markov - is estimated with it.

    rate = level of the stretch + sum of slope * column + noise,   S(f) = N^2 [1 + a/(4 sin^2(phi/2) + s)]  or with
    flicker in place of the second term;   phi = 2 pi f tau0,  s = 0: random walk, s > 0: a corner frequency

In the cosine transform of a stretch (type 2) such noise has uncorrelated ordinates (:mod:`noise_spectra`), so that each
candidate (a, s) is a weighted least squares fit with a restricted likelihood, and estimates and intervals are the
mixture over the candidates, as in :mod:`gyrobench.reduction.estimation.noise_mixture_fit`, whose Gauss-Markov noise
is stationary: under a random walk its 95 % intervals hold a slow column's slope of zero in 0.59 to 0.89 of records.
a: log-uniform from FAINTEST at the first ordinate to STRONGEST at the last one.  The level of each stretch is free.

Elimination: fit all; among what is not significant remove the **one** with the largest probability; refit; repeat.  It
makes p and standard uncertainty of the reduced fit too small: of eight columns of pure noise at least one is kept in a
third of the records at 5 %, and its interval never holds the true zero.  The interval of the fit with all columns holds
the coefficient in 95 % of records, whatever is kept (of the records that keep it, fewer).
[RED-GLS, RED-STEPWISE, RED-ORTHO, DRIFT-COEFFICIENTS; Hu 1981, eq. 4-79..4-101 with ER26..ER28, ER34; own derivation]

Not modelled: noise that grows towards high frequencies (quantization), which makes the intervals wider than they need
be; noise that changes with time.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from scipy import fft, special

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.mixture import LIGHT, Mixture
from gyrobench.reduction.estimation.regression import RegressionError
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.series.checks import SeriesError
from gyrobench.reduction.series.noise_spectra import folded

F = TypeVar("F")
FAINTEST, STRONGEST = 0.3, 10.0  # power of the slow part over the white one, at the first and at the last ordinate
SIZES, CORNERS = 12, 4  # cells of log a, of log s
#: Prior of white noise alone, and with random walk, flicker, Gauss-Markov drift.  Even odds would hold a zero slope
#: under a random walk in 0.78 to 0.93 of records, these in 0.84 to 0.94 (tests/benchmarks/drift_regressors.py).
FAMILIES = (0.15, 0.6, 0.15, 0.1)
DEPENDENT = 1e-10  # of a column's length: what is left of it beside the earlier ones


@dataclass(frozen=True)
class SeriesFit:
    """Slopes of columns; arrays follow ``names``."""

    names: tuple[str, ...]
    beta: Array
    covariance: Array
    u: Array
    half_width: Array  # of the 95 % interval
    p: Array  # two-sided, of a true zero
    dof: int


def _shapes(sine: Array, nu: Array) -> tuple[Array, Array]:
    """Return spectra of the candidates (g, n) over ordinates, the white part 1, and their prior (g,)."""
    parts: list[tuple[Array, float]] = [(np.ones_like(sine), FAMILIES[0])]
    low = float(sine.min())
    corners = np.exp(np.linspace(np.log(10.0 * low), np.log(1.0), CORNERS))
    slow = [(1.0 / sine, FAMILIES[1]), (folded(nu), FAMILIES[2])]
    slow += [(1.0 / (sine + s), FAMILIES[3] / CORNERS) for s in corners]
    for shape, prior in slow:
        first, last = float(shape.max()), float(shape[np.argmax(sine)])
        sizes = np.exp(np.linspace(np.log(FAINTEST / first), np.log(STRONGEST / last), SIZES))
        parts += [(1.0 + a * shape, prior / SIZES) for a in sizes]
    spectra, weights = zip(*parts, strict=True)
    return np.array(spectra), np.array(weights)


class SeriesRegression:
    """Moments of columns and rate under every candidate noise, for fits of any of the columns."""

    def __init__(self, stretches: Sequence[tuple[Array, Array]], names: Sequence[str]) -> None:
        """stretches: columns (n, p) and rate (n,) of each, n >= 4.  Raises SeriesError for too few of them."""
        self.names = tuple(names)
        rows, sine, nu = [], [], []
        for X, y in stretches:
            n = y.size
            rows.append(fft.dct(np.column_stack([X, y]), axis=0, norm="ortho")[1:])
            nu.append(np.arange(1, n) / (2.0 * n))
            sine.append(4.0 * np.sin(np.pi * nu[-1]) ** 2)
        Z = np.concatenate(rows) if rows else np.empty((0, len(names) + 1))
        self.n = len(Z)
        if self.n < len(names) + 8:
            raise SeriesError(f"{self.n} means for {len(names)} columns: {len(names) + 8} are needed")
        self.size = np.linalg.norm(Z, axis=0)
        self.size[self.size == 0.0] = 1.0
        spectra, prior = _shapes(np.concatenate(sine), np.concatenate(nu))
        Z = Z / self.size
        self.moments = np.einsum("gk,ki,kj->gij", 1.0 / spectra, Z, Z, optimize=True)
        self.start = np.log(prior) - 0.5 * np.log(spectra).sum(axis=1)

    def fit(self, names: Sequence[str]) -> SeriesFit:
        """Fit the named columns.  Raises SeriesError for columns that are combinations of each other."""
        k = [self.names.index(n) for n in names]
        M, xy, yy = self.moments[:, k][:, :, k], self.moments[:, k, -1], self.moments[:, -1, -1]
        p = len(k)
        if not p:
            empty = np.empty(0)
            return SeriesFit((), empty, np.empty((0, 0)), empty, empty, empty, self.n)
        if float(np.linalg.cond(M[0])) > 1e10:
            raise SeriesError(f"columns {', '.join(names)} are combinations of each other")
        inverse = np.linalg.inv(M)
        beta = np.einsum("gij,gj->gi", inverse, xy)
        dof = self.n - p
        rest = np.maximum(yy - np.einsum("gi,gi->g", beta, xy), 1e-20 * yy)
        logl = self.start - 0.5 * np.linalg.slogdet(M)[1] - 0.5 * dof * np.log(rest)
        w = np.exp(logl - logl.max())
        w /= w.sum()
        mean = w @ beta
        counts = w > LIGHT * w.max()
        mixture = Mixture(
            w[counts] / w[counts].sum(), (beta - mean)[counts], inverse[counts] * (rest[counts] / dof)[:, None, None],
            dof,
        )  # fmt: skip
        unit = self.size[-1] / self.size[k]
        sd, half = mixture.spread(np.eye(p))
        u = np.minimum(sd, half / NORMAL)
        covariance = np.einsum("g,gpq->pq", mixture.weight, mixture.covariance)
        covariance += np.einsum("g,gp,gq->pq", mixture.weight, mixture.off, mixture.off)
        scale = unit * u / np.maximum(sd, 1e-300)
        return SeriesFit(
            tuple(names), mean * unit, covariance * np.outer(scale, scale), u * unit, half * unit,
            mixture.outside(np.eye(p), np.abs(mean)), dof,
        )  # fmt: skip


@dataclass(frozen=True)
class Removal:
    names: tuple[str, ...]
    statistic: float  # |t| of one column, F of a group
    p: float


def backward(
    names: Sequence[str], candidates: Sequence[tuple[str, ...]], level: float, fit_of: Callable[[Sequence[str]], F],
    test: Callable[[F, tuple[str, ...]], tuple[float, float]],
) -> tuple[F, F, tuple[Removal, ...]]:  # fmt: skip
    """Return the fit with all columns, the one with what is kept, and what left, in order.

    fit_of: of the named columns.  test: statistic and probability of a candidate in a fit.
    """
    kept, left = list(names), list(candidates)
    full = fit = fit_of(kept)
    removed = []
    while left and kept:
        tests = [test(fit, c) for c in left]
        worst = max(range(len(tests)), key=lambda k: (tests[k][1], -tests[k][0]))
        if tests[worst][1] < level:
            break
        out = left.pop(worst)
        removed.append(Removal(out, *tests[worst]))
        kept = [name for name in kept if name not in out]
        fit = fit_of(kept)
    return full, fit, tuple(removed)


def joint_test(beta: Array, covariance: Array, dof: int) -> tuple[float, float]:
    """Return F of several coefficients that are zero, and its probability."""
    statistic = float(beta @ np.linalg.solve(covariance, beta)) / beta.size
    return statistic, float(special.fdtrc(beta.size, dof, statistic))


def orthonormal(X: Array, names: Sequence[str]) -> tuple[Array, Array]:
    """Return Q (n, p) with orthonormal columns and R (p, p), X = Q R, diagonal of R positive.

    By Householder factors (numpy): the basis of Gram and Schmidt without its loss of orthogonality.  b = Q' y are the
    shares of the columns beside those before them, y'y - sum b_k^2 >= 0 (Bessel) is what they leave.
    Raises RegressionError for a column that is a combination of those before it, a non-finite number, n < p.
    """
    n, p = X.shape
    if n < p or len(names) != p:
        raise RegressionError(f"{n} rows and {len(names)} names for {p} columns")
    if not np.all(np.isfinite(X)):
        raise RegressionError("columns hold a non-finite number")
    Q, R = np.linalg.qr(X)
    sign = np.where(np.diag(R) < 0.0, -1.0, 1.0)
    left, length = np.abs(np.diag(R)), np.linalg.norm(X, axis=0)
    for k in range(p):
        if left[k] < DEPENDENT * length[k] or length[k] == 0.0:
            raise RegressionError(f"column '{names[k]}' is a combination of the columns before it; leave it out")
    return Q * sign, R * sign[:, None]
