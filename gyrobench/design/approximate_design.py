"""Approximate optimal designs: which share of the time each candidate gets, and how far from the optimum that can be.

With information matrices M_j (p, p) of the candidates per second, shares w_j >= 0 of sum 1 and M = sum w_j M_j, the
variances of the values C b (q, p) after one second are v_k = c_k' M^-1 c_k.  Criteria, all to be minimized:

    A         phi = sum_k v_k
    minimax   phi = max_k v_k
    D         phi = det(C M^-1 C')^(1/q)

1/phi is concave in M and of degree 1, so that its tangent bounds it everywhere (the equivalence theorem is the case of
equality): with the gradient d_j = -d log phi / d log w_j / w_j of a candidate no shares have a phi below

    bound = phi / max_j d_j                                                      [Kiefer 1974; Pukelsheim 1993, ch. 7]

For minimax the weighted sum of the v_k takes the place of phi: each choice of the weights is a bound, the largest
counts.  The shares come from the multiplicative algorithm (w_j <- w_j d_j^(1/2), which never raises phi of A and D);
whether it has converged does not matter to the bound.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gyrobench.arrays import Array
from gyrobench.errors import GyrobenchError

CRITERIA = ("minimax", "A", "D")


@dataclass(frozen=True)
class ApproximateDesign:
    """Shares (m,) of the candidates; value: phi of the criterion; bound: no shares have a smaller one; gradient (m,):
    d_j, at most 1 with equality on the support where the shares are optimal.
    """

    shares: Array
    value: float
    bound: float
    gradient: Array

    @property
    def efficiency(self) -> float:
        """Return the least possible ratio of the optimum to this design, 1 where it is optimal."""
        return self.bound / self.value


class SingularDesignError(GyrobenchError, ValueError):
    """Candidates that do not determine what is wanted, all of them together."""


def variances(information: Array, wanted: Array) -> Array:
    """Return c' M^-1 c (q,) of the rows of ``wanted`` (q, p).  Raises SingularDesignError."""
    inverse, estimable = _inverse(information)
    if not np.allclose(wanted @ estimable, wanted, atol=1e-7 * float(np.max(np.abs(wanted), initial=1e-300))):
        raise SingularDesignError("the candidates do not determine every wanted value")
    return np.asarray(np.einsum("qi,ij,qj->q", wanted, inverse, wanted))


def _inverse(information: Array) -> tuple[Array, Array]:
    """Return the pseudoinverse and the projection on what is determined, scaled so that units do not matter."""
    size = np.sqrt(np.diag(information))
    unit = np.where(size > 0.0, size, 1.0)
    values, vectors = np.linalg.eigh(information / np.outer(unit, unit))
    kept = values > 1e-11 * max(float(values.max(initial=0.0)), 1e-300)
    inverse = (vectors[:, kept] / values[kept]) @ vectors[:, kept].T
    return inverse / np.outer(unit, unit), (unit[:, None] * (vectors[:, kept] @ vectors[:, kept].T)) / unit[None, :]


def evaluate(
    candidates: Array, wanted: Array, shares: Array, criterion: str, multipliers: Array | None = None
) -> tuple[float, Array, Array]:
    """Return phi, gradient d (m,) and variances (q,) of shares (m,); candidates (m, p, p), wanted (q, p).

    multipliers (q,): weights of the variances in place of the maximum (minimax).
    """
    M = np.einsum("j,jpr->pr", shares, candidates)
    v = variances(M, wanted)
    inverse, _ = _inverse(M)
    if criterion == "D":
        V = wanted @ inverse @ wanted.T
        K = wanted.T @ np.linalg.solve(V, wanted)
        phi = float(np.exp(np.linalg.slogdet(V)[1] / len(wanted)))
        d = np.einsum("ab,jbc,ca->j", inverse @ K @ inverse, candidates, np.eye(len(M))) / len(wanted)
        return phi, d, v
    weight = np.ones(len(wanted)) if multipliers is None else multipliers
    K = (wanted * weight[:, None]).T @ wanted
    phi = float(weight @ v)
    d = np.einsum("ab,jba->j", inverse @ K @ inverse, candidates) / phi
    return phi, d, v


def approximate_design(
    candidates: Array, wanted: Array, criterion: str = "minimax", rounds: int = 2000, tolerance: float = 1e-4
) -> ApproximateDesign:
    """Return optimal shares for candidates (m, p, p) and the rows (q, p) of what is wanted, each over its wanted u.

    Ends after ``rounds`` or when the bound is within ``tolerance`` of the value.  Raises SingularDesignError.
    """
    if criterion not in CRITERIA:
        raise ValueError(f"criterion '{criterion}': one of {', '.join(CRITERIA)}")
    m, q = len(candidates), len(wanted)
    shares = np.full(m, 1.0 / m)
    multipliers = np.full(q, 1.0 / q) if criterion == "minimax" else None
    best: tuple[float, Array, Array] | None = None  # value, shares, gradient
    bound = 0.0
    for k in range(rounds):
        phi, d, v = evaluate(candidates, wanted, shares, criterion, multipliers)
        value = float(v.max()) if criterion == "minimax" else phi
        bound = max(bound, phi / float(d.max()))
        if best is None or value < best[0]:
            best = value, shares.copy(), d
        if bound >= best[0] * (1.0 - tolerance):
            break
        shares = shares * np.sqrt(np.maximum(d, 0.0))
        shares /= shares.sum()
        if multipliers is not None and k % 5 == 4:  # towards those that are the largest
            multipliers = np.maximum(multipliers * (v / v.max()) ** 0.5, 1e-9)
            multipliers /= multipliers.sum()
        if k % 50 == 49:  # a candidate that is far below never comes back
            shares = np.where(shares > 1e-9, shares, 0.0)
            shares /= shares.sum()
    assert best is not None
    return ApproximateDesign(best[1], best[0], bound, best[2])
