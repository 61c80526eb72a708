"""Misfit of a curve by residuals that neighbours in frequency share: then the response has another shape.

Where the uncertainty of the points is not known, their scatter about the curve takes its place, and chi squared says
nothing of the curve.  The order of the residuals does: of m unknowns fitted to N points, r = M e with M the projection
that the fit makes, and D the sum of squared differences of neighbours,

    d = r'D r / r'r       mean tr(MD)/v       variance 2 [v tr(MD MD) - tr(MD)^2] / [v^2 (v + 2)]       v = N - m

for white e; d is small where neighbours lie on one side.  [Durbin 1950]
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.sentences import plain

LEAST = 1e-3  # p below which the residuals of neighbours are alike: one clean record in a thousand
STEP = 1e-5  # of the size of an unknown, for the derivatives of the curve


def alike(curve: Callable[[Array], Array], p: Array, size: Array, left: Array) -> float:
    """Return the probability that white noise leaves neighbours so alike as these residuals, about the curve at p.

    curve: unknowns -> gain and phase (2, n), over the u of the points; size: of each unknown; left: residuals (2, n).
    """
    step = STEP * np.maximum(np.abs(p), size)
    moves = np.diag(step)
    columns = [(curve(p + m) - curve(p - m)).ravel() / (2.0 * h) for m, h in zip(moves, step, strict=True)]
    q = np.linalg.qr(np.column_stack([c / max(float(np.linalg.norm(c)), 1e-300) for c in columns]))[0]
    n = left.shape[1]
    differences = np.diff(np.eye(n), axis=0)
    D = np.kron(np.eye(2), differences.T @ differences)
    M = np.eye(2 * n) - q @ q.T
    r, v, MD = left.ravel(), 2 * n - p.size, M @ D
    mean = float(np.trace(MD)) / v
    variance = 2.0 * (v * float(np.sum(MD * MD.T)) - (v * mean) ** 2) / (v * v * (v + 2.0))
    if not (variance > 0.0 and float(r @ r) > 0.0):
        return 1.0
    return 0.5 * math.erfc(-(float(r @ D @ r) / float(r @ r) - mean) / math.sqrt(2.0 * variance))


def misfit(known: bool, chi2: float, dof: int, neighbours: Callable[[], float]) -> str:
    """Return that a curve does not fit points of known u, or others whose neighbours are alike; "" where it does.

    neighbours: what :func:`alike` says of them.
    """
    if known and chi2 > dof + 4.0 * math.sqrt(2.0 * dof):
        found = (
            f"The curve does not fit the points: χ² = {plain(chi2, 3)} of {dof} degrees of freedom. u of the figures "
        )
        found += "is widened by its root."
    elif not known and neighbours() < LEAST:
        found = "Neighbouring points lie on one side of the curve more often than noise explains, and their scatter is "
        found += "no measure of their uncertainty."
    else:
        return ""
    return f"{found} The gyro has a response of another shape, or points are wrong."
