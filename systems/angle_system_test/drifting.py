"""Readings that drift against one another while the positions are gone through.

Two heads that move apart, or a scale against the reference, add f(t) to their difference.  Where the positions are gone
through in the order of their angle, t goes with it, and the lowest harmonics take most of f.  What is left shows it:
f even with the time and its square, beside the terms of the fit, by an F test.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import special

from gyrobench.reduction.toolkit import Array, Reason, plain
from gyrobench.units import ARCSEC

from .readings import FIRST, MEANS, POSITIONS, TURNED

LEVEL = 1e-3  # probability that a clean record is said to drift
WHAT = {
    POSITIONS: "The second reading of the scale drifts against the first",
    MEANS: "The scale drifts against the reference",
    FIRST: "The scale drifts against the reference, in its first turn",
    TURNED: "The scale drifts against the reference, after it was turned",
}


def drifting(X: Array, y: Array, weights: Array, kind: Sequence[str], t: Array) -> list[Reason]:
    """Return which readings drift: X (n, p), y (n,) rad, weights (n,) of the fit; kind, t (n,) s of the rows.

    The drift that explains most joins the terms of the fit, then the others are looked at again.
    """
    root = np.sqrt(weights)
    terms, z = X * root[:, None], y * root
    kinds = np.asarray(kind)
    left = [k for k in WHAT if np.count_nonzero(kinds == k) > 2]
    limit, found = LEVEL / max(len(left), 1), list[Reason]()
    while left:
        tried = []
        for k in left:
            of = kinds == k
            x = np.where(of, (2.0 * t - t[of].min() - t[of].max()) / max(float(np.ptp(t[of])), 1e-9), 0.0)
            columns = np.column_stack([x, x * x]) * root[:, None]
            tried.append((*_explained(terms, z, columns), k, columns))
        p, change, k, columns = min(tried, key=lambda each: each[0])
        if p >= limit:
            break
        size = (-2.0 if k == POSITIONS else 2.0) * change / ARCSEC  # its rows are first less second
        text = (
            f"{WHAT[k]}, by {plain(size, 2, '+')}″ from the first position to the last. Low harmonics hold part of it "
            "where the positions follow one another around the turn. Wait until the temperature is even, or go to the "
            "positions in an irregular order."
        )
        found.append(Reason("readings.drift", text.replace("-", "−"), ("pass", "fail"), severity="doubt"))
        terms = np.hstack([terms, columns])
        left.remove(k)
    return found


def _explained(terms: Array, z: Array, columns: Array) -> tuple[float, float]:
    """Return p of the F test of two columns beside the terms, and the coefficient of the first."""
    Q = np.linalg.qr(terms)[0]
    own, rest = columns - Q @ (Q.T @ columns), z - Q @ (Q.T @ z)
    size = np.linalg.lstsq(own, rest, rcond=None)[0]
    free, taken = z.size - terms.shape[1] - 2, float(rest @ own @ size)
    if free < 1:
        return 1.0, 0.0
    F = 0.5 * taken * free / max(float(rest @ rest) - taken, 1e-300)
    return float(special.fdtrc(2, free, F)), float(size[0])
