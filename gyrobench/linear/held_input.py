"""The exact step of a continuous system whose inputs are held."""

from __future__ import annotations

import numpy as np

from gyrobench.arrays import Array


def held(a: Array, b: Array, t: float) -> tuple[Array, Array]:
    """Return e^(A t) and int_0^t e^(A s) ds B, B (n, m) or (n,): both are in the exponential of [[A, B], [0, 0]] t."""
    from scipy.linalg import expm

    n, columns = len(a), b if b.ndim == 2 else b[:, None]
    both = np.zeros((n + columns.shape[1],) * 2)
    both[:n, :n], both[:n, n:] = a, columns
    both = expm(both * t)
    return both[:n, :n], both[:n, n:].reshape(b.shape)
