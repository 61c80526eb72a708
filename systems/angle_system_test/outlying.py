"""Readings that lie outside the noise of the others, by the residuals of the fit.

Rows are taken out one by one, the farthest first, while it lies beyond the Bonferroni limit in robust standard
deviations (median absolute deviation) of the rest; one reading makes two rows at a position.  Noise of rounding is
bounded, so that a clean record has fewer than the normal distribution that the limit is of.
"""

from __future__ import annotations

import math

import numpy as np
from scipy import special

from gyrobench.reduction.toolkit import Array, Reason, plain
from gyrobench.units import ARCSEC

LEVEL = 1e-3  # probability that any row of a clean record of normal noise is named
MAD = 1.4826  # standard deviation of a normal distribution over its median absolute deviation
MOST = 0.1  # of the rows
LISTED = 8


def outlying(X: Array, y: Array, weights: Array, angle: Array) -> list[Reason]:
    """Return which readings lie outside: X (n, p), y (n,) rad, weights (n,) of the fit; angle (n,) of the table."""
    root = np.sqrt(weights)
    A, z, n = X * root[:, None], y * root, y.size
    limit = -float(special.ndtri(LEVEL / 2.0 / n)) * MAD
    keep, far = np.ones(n, dtype=bool), list[int]()
    while len(far) < MOST * n:
        left = z - A @ np.linalg.lstsq(A[keep], z[keep], rcond=None)[0]
        size = np.where(keep, np.abs(left), 0.0)
        worst = int(np.argmax(size))
        if size[worst] <= limit * max(float(np.median(size[keep])), 1e-300):
            break
        keep[worst] = False
        far.append(worst)
    if not far:
        return []
    apart = (y - X @ np.linalg.lstsq(A[keep], z[keep], rcond=None)[0]) / ARCSEC
    at = {f"{math.degrees(angle[k]) % 360.0:.2f}°": f"{plain(apart[k], 3, '+')}″" for k in sorted(far, reverse=True)}
    listed = ", ".join(f"{place} ({off})" for place, off in list(at.items())[:LISTED]).replace("-", "−")
    more = f" and {len(at) - LISTED} more" if len(at) > LISTED else ""
    text = (
        f"Readings lie outside the noise of the others: at {listed}{more}. They are in the estimates. Look "
        "for the cause, and leave them out only if it is one."
    )
    return [Reason("outliers", text, ("pass", "fail"))]
