"""Errors of known size in the data of a fit: y = X a + E z + noise, z independent and of unit variance, E known.

What is stated of a set-up (a gyro mounted to 20 arcsec, an encoder, constants from mount to mount) is such an error:
E (n, m) is what one standard uncertainty of each part does to the data, drawn once for a record.  The data have the
covariance

    V = s^2 R + E E'              s^2 R: noise, of a noise model R whose scale s is estimated

and generalized least squares with V have the right weights [RED-GLS]: an error that the residuals show is not taken for
drift and widens no interval twice, once as noise and once as type B.  All a fit needs of R are the moments
A = [X y]' R^-1 [X y] and log|R|; those of V/s^2 are (Woodbury's identity)

    A - B (C + s^2 I)^-1 B',    log|R| + log|I + C/s^2|,    B = [X y]' R^-1 E,    C = E' R^-1 E

so that noise models and set-up effects are weighed as without E.  s of each noise model is that of the greatest
likelihood of the data less all coefficients and effects that may be there (:func:`_noise_variance`): it is known to
1/sqrt(2 (n - p)), and a mean over it would change nothing that a count sees.

The estimate is linear in the data, a = G y, G X = I, so its error is G (E z + noise): the lines of type B are G E, and
what the noise does is type A.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array

FAINT = 1e-3  # of the residuals' rms: directions of E that are smaller move no weight
LOUD = 30.0  # of it, too: larger ones count as so large; no weight differs, and their square would swallow the noise
ROUNDING = 1e-9  # of the largest: what the coefficients leave of a column that is made of them
STEPS = 50


def columns(errors: Array | None, residual: Array) -> Array:
    """Return K (n, r) with K K' = E E', for E' = errors (m, n), but for faint and loud directions; residual: (n,)."""
    if errors is None or not np.any(errors):
        return np.empty((residual.size, 0))
    u, size, _ = np.linalg.svd(np.asarray(errors).T, full_matrices=False)
    rms = np.sqrt(np.mean(residual**2))
    seen = size > FAINT * rms
    return np.asarray(u[:, seen] * np.minimum(size[seen], LOUD * rms * np.sqrt(residual.size)))


@dataclass(frozen=True)
class Absorbed:
    """Moments of c columns and of the data with errors of known size in the covariance, for each of G noise models.

    square (G, c, c), own (G, c), data (G,), logdet (G,); variance (G,): s^2, 1 without such errors; inner (G, r, r):
    (C + s^2 I)^-1; cross (G, c, r), of_data (G, r): X' R^-1 K, K' R^-1 y.
    """

    square: Array
    own: Array
    data: Array
    logdet: Array
    variance: Array
    inner: Array
    cross: Array
    of_data: Array

    @property
    def taken(self) -> Array:
        """(G, c, r): what is taken of X' R^-1 for each row of K' R^-1."""
        return np.asarray(self.cross @ self.inner)

    @property
    def pull(self) -> Array:
        """(G, c, r): X' (V/s^2)^-1 K, what the columns see of each error."""
        return np.asarray(self.variance[:, None, None] * self.taken)

    def predicted(self, g: int, index: list[int], b: Array) -> Array:
        """Return the best linear prediction of z (r,) under model g, with coefficients b (k,) of the columns index."""
        return np.asarray(self.inner[g] @ (self.of_data[g] - b @ self.cross[g][index]))


def absorb(moments: tuple[Array, Array, Array, Array], c: int, n: int, variance: Array | None = None) -> Absorbed:
    """Return the moments of the first c columns with the others, of n data, as errors of known size.

    moments: X'X (G, c + r, c + r), X'y, y'y, log determinants of the whitened columns.  variance: s^2 (G,) if known.
    """
    M, xy, yy, logdet = moments
    r = M.shape[1] - c
    if not r:
        return Absorbed(M, xy, yy, logdet, np.ones_like(yy), M[:, c:, c:], M[:, :, c:], xy[:, c:])
    cross, own, of_data = M[:, :c, c:], M[:, c:, c:], xy[:, c:]
    s2 = _noise_variance(M, xy, yy, c, n) if variance is None else variance
    inner = np.linalg.inv(own + s2[:, None, None] * np.eye(r))
    taken: Array = cross @ inner
    return Absorbed(
        M[:, :c, :c] - taken @ cross.transpose(0, 2, 1),
        xy[:, :c] - np.einsum("gcr,gr->gc", taken, of_data),
        yy - np.einsum("gr,grs,gs->g", of_data, inner, of_data),
        logdet - np.linalg.slogdet(inner)[1] - r * np.log(s2),
        s2, np.asarray(inner, dtype=float), cross, of_data,
    )  # fmt: skip


def pulled(absorbed: Absorbed, cofactors: Array, counts: NDArray[np.bool_]) -> Array:
    """Return G K (candidates, c, r) of the candidates that count, G = (X'V^-1 X)^-1 X'V^-1: what the errors do to the
    coefficients.

    cofactors (candidates, c, c): (X'V^-1 X)^-1 of each; counts (states, models).
    """
    return np.asarray(cofactors @ absorbed.pull[np.nonzero(counts)[1]])


def _noise_variance(M: Array, xy: Array, yy: Array, c: int, n: int) -> Array:
    """Return s^2 (G,) of the greatest likelihood of the data less the first c columns.

    With u_j the data along the directions in which K still shows, d_j its size there, and rss of nu others:
    d log L/d log s = 0 is  s^2 = (rss + sum w_j^2 u_j^2)/(nu + sum w_j),  w_j = s^2/(s^2 + d_j^2).
    """
    A, B = M[:, :c, :c], M[:, :c, c:]
    inverse = np.linalg.pinv(A, rcond=ROUNDING, hermitian=True)
    rank = int(np.linalg.matrix_rank(A[0], tol=ROUNDING * np.linalg.norm(A[0], 2), hermitian=True))
    left = B.transpose(0, 2, 1) @ inverse
    C = M[:, c:, c:] - left @ B
    y = xy[:, c:] - np.einsum("grc,gc->gr", left, xy[:, :c])
    square = yy - np.einsum("gc,gcd,gd->g", xy[:, :c], inverse, xy[:, :c])
    d2, U = np.linalg.eigh((C + C.transpose(0, 2, 1)) / 2.0)
    whole = np.maximum(np.einsum("grr->gr", M[:, c:, c:]).max(axis=1), 1e-300)
    there = d2 > ROUNDING * whole[:, None]
    u2 = np.where(there, np.einsum("grj,gr->gj", U, y) ** 2 / np.where(there, d2, 1.0), 0.0)
    rss = np.maximum(square - u2.sum(axis=1), 0.0)
    nu = np.maximum(n - rank - there.sum(axis=1), 0)
    s2 = np.maximum(square, 1e-300) / max(n - rank, 1)
    for _ in range(STEPS):
        w = np.where(there, s2[:, None] / (s2[:, None] + d2), 0.0)
        new = np.maximum((rss + np.sum(w * w * u2, axis=1)) / np.maximum(nu + w.sum(axis=1), 1e-300), 1e-300)
        done = bool(np.all(np.abs(new - s2) <= 1e-6 * s2))
        s2 = new
        if done:
            break
    return np.asarray(s2)
