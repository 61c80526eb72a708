"""Linear regression: identifiability in coefficient names, least squares white, weighted and with a given covariance.

    y = X a + e,  cov e = s^2 R,  a = (X' R^-1 X)^-1 X' R^-1 y,  s^2 = v' R^-1 v / (n - p),   cov a = s^2 (X'R^-1X)^-1

solved by singular value or QR decomposition of the whitened, column-scaled X, never by the normal equations.
[RED-OLS, RED-GLS; Hu 1981, eq. 4-64..4-97 with the divisor n - p and t tests on the residual sum]
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg, special

from gyrobench.arrays import Array
from gyrobench.errors import GyrobenchError


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
        return f"condition {self.condition:.3g}, least determined: {self.weakest}"


def _words(names: Sequence[str], vector: Array, floor: float = 0.05) -> str:
    vector = vector / vector[np.argmax(np.abs(vector))]
    parts = []
    for k in np.argsort(-np.abs(vector), kind="stable"):
        if abs(vector[k]) >= floor:
            sign = "−" if vector[k] < 0 else "+"
            size = "" if abs(abs(vector[k]) - 1.0) < 5e-7 else f"{abs(vector[k]):.4g} "
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
        out: Array = np.sqrt(np.diag(self.covariance))
        return out

    @property
    def t(self) -> Array:
        """beta / u; large when a coefficient differs from zero."""
        with np.errstate(divide="ignore", invalid="ignore"):
            out: Array = self.beta / self.u
        return out

    @property
    def p(self) -> Array:
        """Two-sided probability of |t| under a true zero."""
        out: Array = 2.0 * special.stdtr(self.dof, -np.abs(self.t))
        return out

    def half_width(self, level: float = 0.95) -> Array:
        """Half the confidence interval."""
        out: Array = float(special.stdtrit(self.dof, 0.5 + level / 2.0)) * self.u
        return out

    @property
    def correlation(self) -> Array:
        return correlation(self.covariance)

    def f_test(self) -> tuple[float, float]:
        """F and its probability that all coefficients but the constant are zero; refuses a model without constant."""
        y = self.fitted + self.residual
        n, p = y.size, self.beta.size
        if not np.any(np.all(np.isclose(self.gain.sum(axis=1)[:, None], np.eye(p), atol=1e-9), axis=0)):
            raise RegressionError("the F test needs a constant column")
        total = float(np.sum((y - y.mean()) ** 2))
        unexplained = float(np.sum(self.residual**2))
        value = ((total - unexplained) / (p - 1)) / (unexplained / (n - p))
        return value, float(special.fdtrc(p - 1, n - p, value))


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
            f"condition number {design.condition:.4g} above {limit:g}; least determined: {design.weakest}"
        )
    return design


def _solve(Z: Array, z: Array, X: Array, y: Array, names: Sequence[str], whitener: Array | None) -> Fit:
    """Least squares of Z = W X and z = W y; whitener: W, or its diagonal."""
    n, p = Z.shape
    scale = np.linalg.norm(Z, axis=0)
    q, r = np.linalg.qr(Z / scale)
    inverse = np.linalg.inv(r) / scale[:, None]
    gain = inverse @ q.T
    beta = gain @ z
    v = z - Z @ beta
    s2 = float(v @ v) / (n - p)
    if whitener is not None:
        gain = gain * whitener if whitener.ndim == 1 else gain @ whitener
    fitted = X @ beta
    return Fit(tuple(names), beta, s2 * inverse @ inverse.T, math.sqrt(s2), n - p, fitted, y - fitted, gain)


def least_squares(X: Array, y: Array, names: Sequence[str], weights: Array | None = None) -> Fit:
    """Ordinary, or with ``weights`` (n,) proportional to 1/variance, weighted least squares.

    Raises RegressionError as :func:`check_data` does, and for a weight that is not finite and positive.
    """
    check_data(X, y, names, math.inf)
    if weights is None:
        return _solve(X, y, X, y, names, None)
    if weights.shape != y.shape or not np.all(np.isfinite(weights)) or np.any(weights <= 0):
        raise RegressionError("weights must be finite and positive, one for each datum")
    w = np.sqrt(weights)
    return _solve(X * w[:, None], y * w, X, y, names, w)


def generalized_least_squares(X: Array, y: Array, names: Sequence[str], covariance: Array) -> Fit:
    """Least squares with the covariance of the data known up to a factor; it must be symmetric and positive
    definite.
    """
    check_data(X, y, names, math.inf)
    if covariance.shape != (y.size, y.size) or not np.allclose(covariance, covariance.T, rtol=1e-10, atol=0.0):
        raise RegressionError(f"the covariance must be symmetric, {y.size} by {y.size}")
    try:
        L = np.linalg.cholesky(covariance)
    except np.linalg.LinAlgError:
        raise RegressionError("the covariance is not positive definite") from None
    whitener = linalg.solve_triangular(L, np.eye(y.size), lower=True)
    return _solve(whitener @ X, whitener @ y, X, y, names, whitener)
