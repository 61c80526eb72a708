"""Regression on orthonormal columns: independent coefficients, share of each, conversion back.

    sqrt(w) X = Q R,  b = Q' sqrt(w) y,  cov b = s^2 1,  beta = R^-1 b,  cov beta = s^2 R^-1 R^-T
    y'y - sum b_k^2 >= 0 (Bessel), what the columns leave

Householder factors (numpy), R with positive diagonal: the basis of Gram and Schmidt in the order of the columns,
without its loss of orthogonality.  Since the b_k are uncorrelated, one may be left out without a refit, and the
others do not change; with Bonferroni's level the chance of keeping any column of noise is that level, whatever is
kept.
[RED-ORTHO; Hu 1981, eq. 4-98..4-101 with ER34]
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg, special

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.regression import RegressionError

DEPENDENT = 1e-10  # of a column's length: what is left of it beside the earlier ones


def orthonormal(X: Array, names: Sequence[str], weights: Array | None = None) -> tuple[Array, Array]:
    """Return Q (n, p) with orthonormal columns and R (p, p), sqrt(weights) X = Q R, diagonal of R positive.

    Raises RegressionError for a column that is a combination of those before it, a negative weight, n < p.
    """
    n, p = X.shape
    if n < p or len(names) != p:
        raise RegressionError(f"{n} rows and {len(names)} names for {p} columns")
    if weights is not None and (weights.shape != (n,) or not np.all(weights >= 0.0)):
        raise RegressionError("weights must not be negative, one for each row")
    Z = X if weights is None else X * np.sqrt(weights)[:, None]
    if not np.all(np.isfinite(Z)):
        raise RegressionError("columns or weights hold a non-finite number")
    Q, R = np.linalg.qr(Z)
    sign = np.where(np.diag(R) < 0.0, -1.0, 1.0)
    left, length = np.abs(np.diag(R)), np.linalg.norm(Z, axis=0)
    for k in range(p):
        if left[k] < DEPENDENT * length[k] or length[k] == 0.0:
            raise RegressionError(f"column '{names[k]}' is a combination of the columns before it; leave it out")
    return Q * sign, R * sign[:, None]


@dataclass(frozen=True)
class OrthogonalFit:
    """Arrays over the columns, in their order."""

    names: tuple[str, ...]
    b: Array  # of the orthonormal columns
    u: float  # standard uncertainty of every b
    left: Array  # sum of squares left after the columns up to this one
    beta: Array  # of the columns themselves
    covariance: Array  # of beta
    dof: int

    @property
    def p(self) -> Array:
        """Two-sided probability of |b|/u without that direction."""
        out: Array = 2.0 * special.stdtr(self.dof, -np.abs(self.b) / self.u)
        return out

    def significant(self, alpha: float = 0.05) -> tuple[str, ...]:
        """Names of the directions with p below alpha over their number."""
        return tuple(n for n, p in zip(self.names, self.p, strict=True) if p < alpha / len(self.names))


def orthogonal_fit(X: Array, y: Array, names: Sequence[str], weights: Array | None = None) -> OrthogonalFit:
    """Fit ``y`` (n,), n > p, on the columns of ``X``; weights: proportional to 1/variance."""
    Q, R = orthonormal(X, names, weights)
    n, p = X.shape
    z = y if weights is None else y * np.sqrt(weights)
    if n <= p or not np.all(np.isfinite(z)):
        raise RegressionError(f"{n} finite data for {p} columns: at least {p + 1} are needed")
    b = Q.T @ z
    rest = z - Q @ b
    dof = n - p if weights is None else int(np.count_nonzero(weights)) - p
    s2 = float(rest @ rest) / dof
    inverse = linalg.solve_triangular(R, np.eye(p))
    left = float(rest @ rest) + np.concatenate([np.cumsum((b * b)[::-1])[::-1][1:], [0.0]])
    return OrthogonalFit(tuple(names), b, math.sqrt(s2), left, inverse @ b, s2 * inverse @ inverse.T, dof)
