"""Orthonormal columns in the order of given ones: what each adds to those before it.

    X = Q R,  b = Q' y,  y'y - sum b_k^2 >= 0 (Bessel), what the columns leave

Householder factors (numpy), R with positive diagonal: the basis of Gram and Schmidt, without its loss of
orthogonality.  [RED-ORTHO; Hu 1981, eq. 4-98..4-101 with ER34]
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.regression import RegressionError

DEPENDENT = 1e-10  # of a column's length: what is left of it beside the earlier ones


def orthonormal(X: Array, names: Sequence[str]) -> tuple[Array, Array]:
    """Return Q (n, p) with orthonormal columns and R (p, p), X = Q R, diagonal of R positive.

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
