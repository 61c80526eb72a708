"""Normal equations (A + D) b = c of G noise models, for many choices of columns that share the first p.

The p coefficients are in every combination of effects, without a prior: they are eliminated once (Schur's complement),

    S = A_qq - A_qp A_pp^-1 A_pq,      s = c_q - A_qp A_pp^-1 c_p

and each combination solves the equations of its own few columns e of the q others, with the precision D of their prior:

    log|A + D| = log|A_pp| + log|S_e + D|,      y' R^-1 y - c' b = (y' R^-1 y - c_p' A_pp^-1 c_p) - s_e' b_e

[RED-GLS: X' R^-1 X b = X' R^-1 y; elimination: own derivation, proved by a test]
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.reduction.estimation import noise


@dataclass(frozen=True)
class NormalEquations:
    """Of G models, p of c columns eliminated: A_pp^-1 (G, p, p), its solution A_pp^-1 c_p (G, p), back = A_pp^-1 A_pq
    (G, p, q), S (G, q, q), s (G, q); rss (G,): y'R^-1 y less what the p columns explain; logdet (G,): log|A_pp|.
    """

    inverse: Array
    solution: Array
    back: Array
    S: Array
    s: Array
    rss: Array
    logdet: Array

    @classmethod
    def of(cls, square: Array, own: Array, data: Array, p: int) -> NormalEquations:
        """Eliminate the first p columns of square (G, c, c), own (G, c); data (G,): y' R^-1 y.

        Raises numpy.linalg.LinAlgError where they are no p columns.
        """
        first, cross = square[:, :p, :p], square[:, p:, :p]
        inverse = np.asarray(np.linalg.inv(first), dtype=float)
        solution = (inverse @ own[:, :p, None])[..., 0]
        back = inverse @ square[:, :p, p:]
        left = own[:, p:] - (cross @ solution[..., None])[..., 0]
        rss = data - np.einsum("gp,gp->g", own[:, :p], solution)
        return cls(inverse, solution, back, square[:, p:, p:] - cross @ back, left, rss, np.linalg.slogdet(first)[1])

    def _of(self, extra: Sequence[int], precision: Array | float, models: NDArray[np.bool_] | slice) -> Array:
        """S_e + D (m, k, k) of the columns ``extra`` of the q, of those models."""
        e = np.array(extra, dtype=np.intp)
        out = self.S[models][:, e[:, None], e]
        np.einsum("gkk->gk", out)[:] += precision
        return out

    def solve(self, extra: Sequence[int], precision: Array | float = 0.0) -> tuple[Array, Array, Array]:
        """Coefficients (G, c), zeros where a column is out, y' R^-1 y - c' b (G,) and log|A + D| (G,).

        extra: the columns beside the first p, by their number among the q others; precision (G, k) of their prior, 0:
        flat.  Raises numpy.linalg.LinAlgError where the columns are combinations of one another.
        """
        p, q = self.back.shape[1:]
        b = np.zeros((len(self.rss), p + q))
        b[:, :p] = self.solution
        if not len(extra):
            return b, self.rss.copy(), self.logdet.copy()
        e = np.array(extra, dtype=np.intp)
        own = self._of(extra, precision, slice(None))
        s = self.s[:, e]
        found = np.linalg.solve(own, s[..., None])
        b[:, p + e] = found[..., 0]
        b[:, :p] -= (self.back[:, :, e] @ found)[..., 0]
        return b, self.rss - np.einsum("gk,gk->g", s, found[..., 0]), self.logdet + np.linalg.slogdet(own)[1]

    def cofactors(self, extra: Sequence[int], precision: Array, models: NDArray[np.bool_]) -> Array:
        """(A + D)^-1 (m, c, c) of the columns of :meth:`solve`, zeros elsewhere, for the m ``models`` (G,) alone."""
        p, q = self.back.shape[1:]
        out = np.zeros((int(models.sum()), p + q, p + q))
        out[:, :p, :p] = self.inverse[models]
        if len(extra):
            e = np.array(extra, dtype=np.intp)
            own = np.linalg.inv(self._of(extra, precision[models], models))
            back = self.back[models][:, :, e]
            side = back @ own
            out[:, :p, :p] += side @ back.transpose(0, 2, 1)
            out[:, :p, p + e] = -side
            out[:, (p + e)[:, None], p + e] = own
            out[:, p + e, :p] = -side.transpose(0, 2, 1)
        return out


def moments(t0: Array, t1: Array, columns: Array, grid: noise.NoiseGrid) -> tuple[Array, Array, Array, Array]:
    """X'X, X'y, y'y of the whitened columns (y the last) and log determinants, model by model."""
    models, c = grid.tau.size, columns.shape[1]
    square, logdet = np.zeros((models, c, c)), np.zeros(models)
    law, read = grid.tau < 0.0, grid.reading > 0.0  # without reading errors it is quicker
    for alike in (~law & ~read, ~law & read, law):
        g = np.flatnonzero(alike)
        if g.size:
            for _, Z, part in noise.whitened_blocks(t0, t1, columns, grid.tau[g], grid.share[g], grid.reading[g]):
                zt = np.ascontiguousarray(Z.transpose(2, 1, 0))
                square[g] += zt @ zt.transpose(0, 2, 1)
                logdet[g] += part
    return square[:, :-1, :-1], square[:, :-1, -1], square[:, -1, -1], logdet


def beside(square: Array, own: Array, data: Array, p: int) -> tuple[Array, Array, Array]:
    """Return moments (g, c, c), those with the data (g, c) and the squares of these (g,) of what the first p columns
    leave of the others.
    """
    first = square[:, :p, :p]
    taken = square[:, p:, :p] @ np.linalg.inv(first)
    value = np.linalg.solve(first, own[:, :p, None])[..., 0]
    left = own[:, p:] - np.einsum("gkp,gp->gk", taken, own[:, :p])
    return square[:, p:, p:] - taken @ square[:, :p, p:], left, data - np.einsum("gp,gp->g", value, own[:, :p])
