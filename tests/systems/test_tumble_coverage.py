"""Do the intervals cover?  The Monte Carlo of tests/benchmarks/coverage_tumble.py with fewer runs."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from typing import Any

import pytest
from scipy import stats

RUNS = 50
RISK = 1e-4  # probability of a false alarm per coefficient, were the coverage 0.93


def _benchmark() -> Any:
    file = Path(__file__).parents[1] / "benchmarks" / "coverage_tumble.py"
    spec = importlib.util.spec_from_file_location("coverage_tumble", file)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["coverage_tumble"] = module
    spec.loader.exec_module(module)
    return module


benchmark = _benchmark()


def test_bound() -> None:
    """With coverage p the hits are binomial: of 50 intervals fewer than 38 hold the truth with probability < 1e-4 if
    p = 0.93 (< 1e-6 if p = 0.95), for one coefficient; a coverage of 0.7 is found out three times in four.
    """
    least = int(stats.binom.ppf(RISK, RUNS, 0.93))
    assert least == 38
    assert stats.binom.cdf(least - 1, RUNS, 0.93) < RISK <= stats.binom.cdf(least, RUNS, 0.93)
    assert stats.binom.cdf(least - 1, RUNS, 0.7) > 0.75


@pytest.mark.parametrize("case", list(benchmark.CASES))
def test_intervals_cover(case: str) -> None:
    """At least 38 of 50 for every coefficient, and u within a factor of the scatter it claims to be."""
    hits, ratio = benchmark.coverage(case, RUNS, turns=1, seed=2)
    least = int(stats.binom.ppf(RISK, RUNS, 0.93))
    assert hits.min() >= least, dict(zip(benchmark.NAMES, hits.tolist(), strict=True))
    # all nine together: 450 intervals of coverage 0.93 give fewer than 397 with the same risk, were they independent
    assert hits.sum() >= int(stats.binom.ppf(RISK, 9 * RUNS, 0.93))
    # rms of 50 errors scatters by 10 %: u is not smaller than the scatter, nor twice as large
    assert ratio.min() > 0.7 and ratio.max() < 2.2
