"""Tests of what the fit of a rate table test leaves: rates that repeat off it, settling, noise that changes with w."""

from __future__ import annotations

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.estimation import residual_series as series
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.result import Test

LARGEST = 0.95  # of the largest rate, and more


def add_tests(found: Findings, rate: Array, level: Array, way: Array) -> None:
    """Add the tests; rate, way (n,): of the readings that are fitted, level (n,): numbers of their dwells.

    A gyro in steps larger than its noise, of another hysteresis or another shape, repeats what the fit leaves at a
    rate; readings begun too early hold a part of the step before; a ring laser near the rate of its dither is noisier.
    """
    if found.ideal:
        return
    x = rate / np.max(np.abs(rate))
    same = np.unique(np.column_stack([np.round(x, 4), way]), axis=0, return_inverse=True)[1].ravel()
    found.f_test(
        "levels", "constants of the rates", np.eye(same.max() + 1)[same],
        "shape, steps of the reading", "the rates differ from the model, alike each time: another shape, or readings "
        "in steps larger than their noise",
        "the rates agree within the noise",
    )  # fmt: skip
    first = np.concatenate([[True], np.diff(level) > 0])
    if not np.all(first):
        step = np.diff(x[first], prepend=x[0])[np.cumsum(first) - 1]
        found.f_test(
            "settled", "step before the first reading", np.where(first, step, 0.0)[:, None],
            "settling", "the first reading of a rate holds a part of the step to it: settle longer",
            "settled before the first reading",
        )  # fmt: skip
    null = series.fitted_noise(found.est.likeliest.fitted)
    ratio, p = series.variance_ratio(found.est.likeliest.whitened, np.abs(x) > LARGEST, null)
    bad, good = "the noise is larger at the largest rates: u is that of its mean", "not noisier at the largest rates"
    found.tests.append(Test("spread", "spread at the largest rates", ratio, p, "noise", bad if p < 0.05 else good))
