"""Backward elimination of regressors, with intervals that say what selection did to them.

Fit all; among what is not significant remove the **one** with the largest probability; refit; repeat.  The constant and
protected names stay; a group (cosine and sine of one harmonic) leaves or stays together, by its joint F test.

Selection makes p and standard uncertainty of the reduced fit too small: of eight columns of pure noise at least one
is kept in a third of the records at 5 %, and its interval never holds the true zero.  So two intervals are given:
``full_low, full_high``: of the model with all columns.  They hold the coefficient in 95 % of records, whatever is
kept (of the records that keep it, fewer); ``low, high``: of the reduced fit, u from the full model's s and Scheffe's
factor sqrt(p F(p, nu)), p columns that were free to be combined.  They hold the coefficients that the reduced model
has on the true mean, all at once, for any rule of selection, in at least 95 %; they are wide.   [RED-STEPWISE; Hu
1981, eq. 4-92..4-97 with ER26..ER28; Scheffe 1953, Berk 2013]
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from scipy import special

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.regression import (
    Fit,
    RegressionError,
    check_data,
    generalized_least_squares,
    least_squares,
)

F = TypeVar("F")


@dataclass(frozen=True)
class Removal:
    names: tuple[str, ...]
    statistic: float  # |t| of one column, F of a group
    p: float


@dataclass(frozen=True)
class Stepwise:
    """Arrays follow ``fit.names``, full_* follow ``full.names``."""

    fit: Fit  # of what was kept; its u and p are those without selection, too small
    full: Fit
    removed: tuple[Removal, ...]
    low: Array
    high: Array
    full_low: Array
    full_high: Array
    level: float  # of one test: alpha, or alpha over the number of candidates

    @property
    def kept(self) -> tuple[str, ...]:
        return self.fit.names


def eliminate(
    X: Array, y: Array, names: Sequence[str], alpha: float, protected: Sequence[str] = (),
    groups: Sequence[Sequence[str]] = (), covariance: Array | None = None, family: bool = False,
) -> Stepwise:  # fmt: skip
    """Eliminate columns of ``X`` (n, p) at the level ``alpha``.

    covariance: of the data up to a factor, where they are correlated (generalized least squares).  family: alpha
    holds for all candidates together (alpha over their number).  A constant column is never a candidate. Raises
    RegressionError for alpha outside 0..0.5, fewer than 2 p data, a rank-deficient full model, unknown names.
    """
    n, p = X.shape
    if not 0.0 < alpha < 0.5:
        raise RegressionError(f"alpha = {alpha}: it must lie between 0 and 0.5")
    check_data(X, y, names, math.inf)
    if n < 2 * p:
        raise RegressionError(f"{n} data for {p} columns: elimination needs at least {2 * p}")
    unknown = sorted({*protected, *(name for g in groups for name in g)} - set(names))
    if unknown:
        raise RegressionError(f"no column '{unknown[0]}'; columns: {', '.join(names)}")
    index = {name: k for k, name in enumerate(names)}
    stays = set(protected) | {name for name, k in index.items() if np.ptp(X[:, k]) == 0.0}
    grouped = {name for g in groups for name in g}
    candidates = [tuple(g) for g in groups] + [(name,) for name in names if name not in grouped]
    candidates = [c for c in candidates if not stays & set(c)]
    level = alpha / max(len(candidates), 1) if family else alpha

    def fit_of(kept: Sequence[str]) -> Fit:
        columns = X[:, [index[name] for name in kept]]
        if covariance is None:
            return least_squares(columns, y, kept)
        return generalized_least_squares(columns, y, kept, covariance)

    full, fit, removed = backward(names, candidates, level, fit_of, _test, 1)
    half = full.half_width()
    # u of the reduced fit with the full model's s, which no selection has touched
    wide = math.sqrt(p * float(special.fdtri(p, full.dof, 0.95))) * fit.u * full.s / fit.s
    return Stepwise(fit, full, removed, fit.beta - wide, fit.beta + wide, full.beta - half, full.beta + half, level)


def backward(
    names: Sequence[str], candidates: Sequence[tuple[str, ...]], level: float, fit_of: Callable[[Sequence[str]], F],
    test: Callable[[F, tuple[str, ...]], tuple[float, float]], fewest: int = 0,
) -> tuple[F, F, tuple[Removal, ...]]:  # fmt: skip
    """Return the fit with all columns, the one with what is kept, and what left, in order.

    fit_of: of the named columns.  test: statistic and probability of a candidate in a fit.  fewest: columns that stay.
    """
    kept, left = list(names), list(candidates)
    full = fit = fit_of(kept)
    removed = []
    while left and len(kept) > fewest:
        tests = [test(fit, c) for c in left]
        worst = max(range(len(tests)), key=lambda k: (tests[k][1], -tests[k][0]))
        if tests[worst][1] < level:
            break
        out = left.pop(worst)
        if len(kept) - len(out) < fewest:
            break
        removed.append(Removal(out, *tests[worst]))
        kept = [name for name in kept if name not in out]
        fit = fit_of(kept)
    return full, fit, tuple(removed)


def joint_test(beta: Array, covariance: Array, dof: int) -> tuple[float, float]:
    """Return F of several coefficients that are zero, and its probability."""
    statistic = float(beta @ np.linalg.solve(covariance, beta)) / beta.size
    return statistic, float(special.fdtrc(beta.size, dof, statistic))


def _test(fit: Fit, names: Sequence[str]) -> tuple[float, float]:
    """Return |t| of one column or the joint F of several, and its probability."""
    k = [fit.names.index(name) for name in names]
    if len(k) == 1:
        return float(abs(fit.t[k[0]])), float(fit.p[k[0]])
    return joint_test(fit.beta[k], fit.covariance[np.ix_(k, k)], fit.dof)
