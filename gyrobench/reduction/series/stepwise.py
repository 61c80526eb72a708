"""Backward elimination of regressors.

Fit all; among what is not significant remove the **one** with the largest probability; refit; repeat.  A group (cosine
and sine of one harmonic) leaves or stays together, by its joint F test.

Selection makes p and standard uncertainty of the reduced fit too small: of eight columns of pure noise at least one is
kept in a third of the records at 5 %, and its interval never holds the true zero.  The interval of the fit with all
columns holds the coefficient in 95 % of records, whatever is kept (of the records that keep it, fewer).
[RED-STEPWISE; Hu 1981, eq. 4-92..4-97 with ER26..ER28]
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from scipy import special

from gyrobench.arrays import Array

F = TypeVar("F")


@dataclass(frozen=True)
class Removal:
    names: tuple[str, ...]
    statistic: float  # |t| of one column, F of a group
    p: float


def backward(
    names: Sequence[str], candidates: Sequence[tuple[str, ...]], level: float, fit_of: Callable[[Sequence[str]], F],
    test: Callable[[F, tuple[str, ...]], tuple[float, float]],
) -> tuple[F, F, tuple[Removal, ...]]:  # fmt: skip
    """Return the fit with all columns, the one with what is kept, and what left, in order.

    fit_of: of the named columns.  test: statistic and probability of a candidate in a fit.
    """
    kept, left = list(names), list(candidates)
    full = fit = fit_of(kept)
    removed = []
    while left and kept:
        tests = [test(fit, c) for c in left]
        worst = max(range(len(tests)), key=lambda k: (tests[k][1], -tests[k][0]))
        if tests[worst][1] < level:
            break
        out = left.pop(worst)
        removed.append(Removal(out, *tests[worst]))
        kept = [name for name in kept if name not in out]
        fit = fit_of(kept)
    return full, fit, tuple(removed)


def joint_test(beta: Array, covariance: Array, dof: int) -> tuple[float, float]:
    """Return F of several coefficients that are zero, and its probability."""
    statistic = float(beta @ np.linalg.solve(covariance, beta)) / beta.size
    return statistic, float(special.fdtrc(beta.size, dof, statistic))
