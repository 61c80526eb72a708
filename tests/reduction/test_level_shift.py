"""A level that changes once is named by row and size; slow noise and single rows are not."""

from __future__ import annotations

import numpy as np
import pytest

from gyrobench import units
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.estimation.level_shift import jumped
from gyrobench.reduction.estimation.linear_fit import fit
from gyrobench.reduction.estimation.quantity import Quantity

DPH = units.factor("deg/h")
N = 96


def record(shift: float = 0.0, at: int = 56, *, spike: float = 0.0, walk: float = 0.0, seed: int = 1) -> Findings:
    """Rest and motion by turns, eight rows each, noise of 0.01 deg/h; from a row on another level, in its units."""
    rng = np.random.default_rng(seed)
    e = rng.normal(size=N) + walk * np.cumsum(rng.normal(size=N))
    e[at:] += shift
    e[at] += spike
    moved = (np.arange(N) // 8 % 2).astype(float)
    X = np.column_stack([np.ones(N), moved])
    t = 2.0 * np.arange(N)
    wanted = [Quantity.of("b", "at rest", "deg/h"), Quantity.of("d", "in motion", "deg/h")]
    return fit(wanted, X, DPH * (X @ [0.3, -0.2] + 0.01 * e), t, t + 2.0, [], "rate", "°/h", DPH)


@pytest.mark.parametrize("seed", range(3))
def test_a_level_that_changes_is_named(seed: int) -> None:
    """By 10 standard deviations where a motion begins, row 57: 0.1 deg/h, known to 0.01 sqrt(1/8 + 1/8) or so."""
    (reason,) = jumped(record(10.0, seed=seed))
    assert reason.blocks == ("pass", "fail") and reason.severity == "doubt"
    assert reason.text.startswith("From row 57 on ")
    size = float(reason.text.split("by ")[1].split(" °/h")[0])
    assert size == pytest.approx(0.1, abs=0.03)


@pytest.mark.parametrize(("walk", "spike"), [(0.0, 0.0), (0.3, 0.0), (1.0, 0.0), (0.0, 12.0)])
def test_slow_noise_and_a_single_row_are_not(walk: float, spike: float) -> None:
    assert not [r for seed in range(6) for r in jumped(record(seed=seed, walk=walk, spike=spike))]
