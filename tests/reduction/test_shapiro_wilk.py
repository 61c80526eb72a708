"""Our Shapiro-Wilk test against SciPy's, whose normal quantiles have seven digits."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from gyrobench.reduction.estimation.shapiro_wilk import shapiro_wilk


@pytest.mark.parametrize("n", [3, 4, 5, 6, 11, 12, 68, 900, 5000])
def test_as_scipy_has_it(n: int) -> None:
    """W to 1e-7 and p to 1e-5, of normal values and of ones with heavy tails."""
    rng = np.random.default_rng(n)
    for x in (3.0 + 1e-7 * rng.standard_normal(n), rng.standard_t(3, n)):
        w, p = shapiro_wilk(x)
        expected = stats.shapiro(x)
        assert w == pytest.approx(expected.statistic, rel=1e-7)
        assert p == pytest.approx(expected.pvalue, rel=1e-5, abs=1e-12)


def test_three_values() -> None:
    """a = (-1, 0, 1)/sqrt(2): 0, 1, 5 have W = (5^2/2)/(4 + 1 + 9) = 25/28, p = 6/pi (asin sqrt(25/28) - pi/3)."""
    w, p = shapiro_wilk(np.array([5.0, 0.0, 1.0]))
    assert w == pytest.approx(25.0 / 28.0, rel=1e-14)
    assert p == pytest.approx(6.0 / math.pi * (math.asin(math.sqrt(25.0 / 28.0)) - math.pi / 3.0), rel=1e-12)


def test_values_that_are_all_alike() -> None:
    assert shapiro_wilk(np.full(9, 0.1)) == (1.0, 1.0)


def test_false_alarms() -> None:
    """p is below 0.05 in 100 of 2000 normal samples of 40, four standard deviations of that count either way."""
    rng = np.random.default_rng(0)
    hits = sum(shapiro_wilk(x)[1] < 0.05 for x in rng.standard_normal((2000, 40)))
    assert abs(hits - 100) < 4.0 * math.sqrt(2000 * 0.05 * 0.95)
