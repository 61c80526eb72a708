"""A record whose level changes once, for good: knocked, a bias that jumped, a cable that was touched.

Under the likeliest noise model a jump passes for a random walk, whose intervals hold a drift that goes on for the whole
record and not one that fell together with a motion.  So a step from each row on is tested beside the terms of the fit:

    t_k = s'v / (|s| sd),   s: the step, v: the residuals, both whitened and free of the terms of the fit

externally studentized.  The largest is a jump where chance makes it with less than LEVEL over the number of rows, in
the mean over all noise models: slower ones than the likeliest jump more easily.  A smaller one hides in the random walk
that it makes the likeliest noise itself: a step in white noise is a jump, too, where it is likelier by as much than all
of the record in that noise.  A single row that explains more than any step is an outlier (outliers).  [Chen 1993]
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import special

from gyrobench.arrays import Array
from gyrobench.reduction.estimation import asked
from gyrobench.reduction.estimation import noise as noise_model
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.estimation.sentences import plain
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
    columns = np.hstack([found.est.X, v, steps, rows])
    white, determinant = _whitened(found, columns)
    told = _largest(white, p)
    if told.at >= steps.shape[1] or _chance(found, steps[:, told.at]) >= LEVEL / n:
        squares = told.squares
        told = _largest(columns, p)
        gain = 0.5 * (n - p - 1) * math.log(squares / told.left) + 0.5 * determinant
        if told.at >= steps.shape[1] or gain < math.log(n / LEVEL):
            return []
    by = told.size / found.y_scale
    text = (
        f"From row {told.at + LEAST + 1} on the level of the record is another one, by {plain(by, 3, '+')} "
        f"{found.y_unit} ({told.t:.0f} standard deviations). The estimates take it for slow noise, or for what was "
        "done then. Look for the cause, and measure again or leave the rows before or after it out."
    )
    return [Reason("level.shift", text.replace("-", "−"), ("pass", "fail"), severity="doubt")]


def _chance(found: Findings, step: Array) -> float:
    """Return the probability of so large a step by chance, in the mean over the noise models."""
    square, own, squares, probability = found.beside(step[:, None])
    gain = own[:, 0] ** 2 / square[:, 0, 0]
    free = found.y.size - found.est.X.shape[1] - 1
    return float(probability @ special.fdtrc(1.0, free, gain / np.maximum(squares - gain, 1e-300) * free))


@dataclass(frozen=True)
class _Step:
    """Index of the column that explains most, its size, its t; squares without it, and what it leaves of them."""

    at: int
    size: float
    t: float
    squares: float
    left: float


def _largest(Z: Array, p: int) -> _Step:
    """Return the column of Z beyond p terms and the residuals that explains most of these."""
    Q = np.linalg.qr(Z[:, :p])[0]
    Z = Z[:, p:] - Q @ (Q.T @ Z[:, p:])
    z, Z = Z[:, 0], Z[:, 1:]
    size = np.linalg.norm(Z, axis=0)
    free = size > 1e-6 * np.median(size)  # of the terms of the fit
    along = np.where(free, z @ Z / np.where(free, size, 1.0), 0.0)
    best = int(np.argmax(np.abs(along)))
    squares, explained = float(z @ z), float(along[best])
    left = max(squares - explained**2, 1e-300)
    t = abs(explained) * math.sqrt((len(z) - p - 1) / left)
    return _Step(best, explained / float(size[best]), t, squares, left)


def _whitened(found: Findings, columns: Array) -> tuple[Array, float]:
    """Return columns (n, m) whose noise is white, by the likeliest model, up to a factor, and the log determinant of
    its covariance.
    """
    if found.white:
        weighed = columns if found.weights is None else columns * np.sqrt(found.weights)[:, None]
        return weighed, -math.inf  # nothing but white noise is thought of
    one = tuple(np.array([m]) for m in found.est.noise.best)
    out, determinant = noise_model.whiten(found.t_start, found.t_end, columns, *one)
    return np.asarray(out[:, 0, :]), float(determinant[0])
