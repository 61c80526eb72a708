"""A record whose level changes once, for good: knocked, a bias that jumped, a cable that was touched.

Under the likeliest noise model a jump passes for a random walk, whose intervals hold a drift that goes on for the whole
record and not one that fell together with a motion.  So a step from each row on is tested beside the terms of the fit:

    t_k = s'v / (|s| sd),   s: the step, v: the residuals, both whitened and free of the terms of the fit

externally studentized, LEVEL over the number of rows.  A single row that explains more than any step is an outlier
(outliers), not a jump.  [Chen 1993]
"""

from __future__ import annotations

import numpy as np
from scipy import special

from gyrobench.arrays import Array
from gyrobench.reduction.estimation import asked
from gyrobench.reduction.estimation import noise as noise_model
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.result import Reason

LEVEL = 0.002  # probability that a clean record is said to jump; its likeliest noise is an estimate
LEAST = 3  # rows on each side
FEWEST, MOST = 10, 2000  # degrees of freedom that must be left; rows


def jumped(found: Findings) -> list[Reason]:
    """Return from which row on the level of a record is another one, by how much; nothing of one without a jump."""
    n, p = found.y.size, found.est.X.shape[1]
    if found.ideal or found.dof < FEWEST or not 2 * LEAST < n <= MOST or not asked.whole():
        return []
    steps, rows = np.tri(n)[:, LEAST : n - LEAST + 1], np.eye(n)
    v = (found.est.residual - found.est.likeliest.set_up)[:, None]
    Z = _whitened(found, np.hstack([found.est.X, v, steps, rows]))
    Q = np.linalg.qr(Z[:, :p])[0]
    Z = Z[:, p:] - Q @ (Q.T @ Z[:, p:])
    z, Z = Z[:, 0], Z[:, 1:]
    size = np.linalg.norm(Z, axis=0)
    free = size > 1e-6 * np.median(size)  # of the terms of the fit
    along = np.where(free, z @ Z / np.where(free, size, 1.0), 0.0)
    best = int(np.argmax(np.abs(along)))
    left = max(float(z @ z) - float(along[best]) ** 2, 1e-300)
    t = float(along[best]) * np.sqrt((n - p - 1) / left)
    if best >= steps.shape[1] or 2.0 * float(special.stdtr(n - p - 1, -abs(t))) >= LEVEL / n:
        return []
    by = float(along[best] / size[best]) / found.y_scale
    text = (
        f"From row {best + LEAST + 1} on the level of the record is another one, by {by:+.3g} {found.y_unit} "
        f"({abs(t):.0f} standard deviations). The estimates take it for slow noise, or for what was done then. Look "
        "for the cause, and measure again or leave the rows before or after it out."
    )
    return [Reason("level.shift", text.replace("-", "−"), ("pass", "fail"), severity="doubt")]


def _whitened(found: Findings, columns: Array) -> Array:
    """Return columns (n, m) whose noise is white, by the likeliest model, up to a factor."""
    if found.white:
        return columns if found.weights is None else columns * np.sqrt(found.weights)[:, None]
    one = tuple(np.array([m]) for m in found.est.noise.best)
    out: Array = noise_model.whiten(found.t_start, found.t_end, columns, *one)[0][:, 0, :]
    return out
