"""Linear regression: identifiability in coefficient names, ordinary and weighted least squares.

    y = X a + e,  cov e = s^2/w,  a = (X' w X)^-1 X' w y,  s^2 = v' w v / (n - p),   cov a = s^2 (X' w X)^-1

w a diagonal matrix of weights, solved by singular value or QR decomposition of the weighted, column-scaled X, never by
the normal equations.
[RED-OLS; Hu 1981, eq. 4-64..4-97 with the divisor n - p and t tests on the residual sum]
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import special

from gyrobench.arrays import Array
from gyrobench.errors import GyrobenchError
from gyrobench.reduction.estimation.sentences import plain


class RegressionError(GyrobenchError, ValueError):
    """The data cannot carry the model; the message names the coefficients concerned."""


@dataclass(frozen=True)
class Design:
    """What a design matrix can tell apart."""

    names: tuple[str, ...]
    rank: int
    condition: float  # of X with columns scaled to length 1; infinite when the rank is short
    lost: tuple[str, ...]  # combinations the data do not see, in words
    weakest: str  # the direction the data see least, in words

    @property
    def short(self) -> bool:
        """True where some combination leaves every datum as it is."""
        return self.rank < len(self.names)

    @property
    def weakness(self) -> str:
        """What is not estimable, or else least determined, in words."""
        if self.short:
            return f"rank {self.rank} of {len(self.names)}, not estimable: {'; '.join(self.lost)}"
        return f"condition {plain(self.condition, 3)}, least determined: {self.weakest}"


def _words(names: Sequence[str], vector: Array, floor: float = 0.05) -> str:
    vector = vector / vector[np.argmax(np.abs(vector))]
    parts = []
    for k in np.argsort(-np.abs(vector), kind="stable"):
        if abs(vector[k]) >= floor:
            sign = "−" if vector[k] < 0 else "+"
            size = "" if abs(abs(vector[k]) - 1.0) < 5e-7 else f"{plain(abs(vector[k]), 4)} "
            parts.append(f"{sign} {size}{names[k]}")
    return " ".join(parts).removeprefix("+ ")


def examine(X: Array, names: Sequence[str], tolerance: float = 1e-9) -> Design:
    """Return rank, condition, lost combinations and weakest direction of ``X`` (n, p) with columns called ``names``.

    A lost combination "D_II + D_OO − 0.99 D_F" is a change of the coefficients that leaves every datum as it is.
    """
    p = X.shape[1]
    scale = np.linalg.norm(X, axis=0)
    top = float(scale.max(initial=0.0)) or 1.0
    safe = np.where(scale > 1e-13 * top, scale, top)  # a column of rounding is a column of zeros
    _, s, vt = np.linalg.svd(np.linalg.qr(X / safe, mode="r"), full_matrices=True)
    s = np.concatenate([s, np.zeros(p - s.size)])
    rank = int(np.sum(s > tolerance * s[0])) if s[0] > 0 else 0
    lost = []
    null = vt[rank:] / safe
    for row in _echelon(null):
        lost.append(_words(names, row, 1e-6))
    weakest = _words(names, vt[-1] / safe, 0.1)
    return Design(tuple(names), rank, float(s[0] / s[-1]) if rank == p else math.inf, tuple(lost), weakest)


def _echelon(rows: Array) -> list[Array]:
    """Reduced echelon form with full pivoting: each combination as short as it gets."""
    m, done = np.array(rows), []
    free = list(range(m.shape[0]))
    while free:
        block = np.abs(m[free])
        i, j = np.unravel_index(int(np.argmax(block)), block.shape)
        k = free.pop(int(i))
        m[k] /= m[k, j]
        for other in range(m.shape[0]):
            if other != k:
                m[other] -= m[other, j] * m[k]
        done.append(k)
    m[np.abs(m) < 1e-9] = 0.0
    return [m[k] for k in sorted(done)]


@dataclass(frozen=True)
class Fit:
    """A regression with its statistics; arrays follow ``names``."""

    names: tuple[str, ...]
    beta: Array
    covariance: Array
    s: float  # standard deviation of unit weight
    dof: int
    fitted: Array
    residual: Array
    gain: Array  # (p, n): beta = gain y

    @property
    def named(self) -> dict[str, float]:
        """Return beta by name."""
        return dict(zip(self.names, self.beta.tolist(), strict=True))

    @property
    def u(self) -> Array:
        """Standard uncertainties."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def t(self) -> Array:
        """beta / u; large when a coefficient differs from zero."""
        with np.errstate(divide="ignore", invalid="ignore"):
            out: Array = self.beta / self.u
        return out

    @property
    def p(self) -> Array:
        """Two-sided probability of |t| under a true zero."""
        return np.asarray(2.0 * special.stdtr(self.dof, -np.abs(self.t)))

    def half_width(self, level: float = 0.95) -> Array:
        """Half the confidence interval."""
        return np.asarray(float(special.stdtrit(self.dof, 0.5 + level / 2.0)) * self.u)


def correlation(covariance: Array) -> Array:
    """Return the correlation matrix of a covariance; 0 off the diagonal where a variance is 0."""
    u = np.sqrt(np.diag(covariance))
    safe = np.where(u > 0, u, 1.0)
    out: Array = covariance / np.outer(safe, safe)
    np.fill_diagonal(out, 1.0)
    return np.clip(out, -1.0, 1.0)


def check_data(X: Array, y: Array, names: Sequence[str], limit: float = 1e3) -> Design:
    """Raises RegressionError for non-finite data, n <= p, a short rank or a condition above ``limit``."""
    n, p = X.shape
    if y.shape != (n,) or len(names) != p:
        raise RegressionError(f"{n} rows and {p} columns do not go with {y.shape[0]} data and {len(names)} names")
    if not (np.all(np.isfinite(X)) and np.all(np.isfinite(y))):
        raise RegressionError("data or regressors hold a non-finite number")
    if n <= p:
        raise RegressionError(f"{n} data for {p} coefficients: at least {p + 1} are needed")
    design = examine(X, names)
    if design.rank < p:
        raise RegressionError(f"rank {design.rank} for {p} coefficients; not estimable: {'; '.join(design.lost)}")
    if design.condition > limit:
        raise RegressionError(
            f"condition number {plain(design.condition, 4)} above {limit:g}; least determined: {design.weakest}"
        )
    return design


def least_squares(X: Array, y: Array, names: Sequence[str], weights: Array | None = None) -> Fit:
    """Fit by ordinary, or with ``weights`` (n,) proportional to 1/variance, weighted least squares.

    Raises RegressionError as :func:`check_data` does, and for a weight that is not finite and positive.
    """
    check_data(X, y, names, math.inf)
    w = np.ones_like(y) if weights is None else weights
    if w.shape != y.shape or not np.all(np.isfinite(w)) or np.any(w <= 0):
        raise RegressionError("weights must be finite and positive, one for each datum")
    w = np.sqrt(w)
    Z, z = X * w[:, None], y * w
    n, p = Z.shape
    scale = np.linalg.norm(Z, axis=0)
    q, r = np.linalg.qr(Z / scale)
    inverse = np.linalg.inv(r) / scale[:, None]
    gain = inverse @ q.T
    beta = gain @ z
    v = z - Z @ beta
    s2 = float(v @ v) / (n - p)
    fitted = X @ beta
    return Fit(tuple(names), beta, s2 * inverse @ inverse.T, math.sqrt(s2), n - p, fitted, y - fitted, gain * w)
