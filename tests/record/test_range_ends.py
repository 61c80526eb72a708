"""Samples at the ends of a column."""

from __future__ import annotations

import numpy as np
import pytest

from gyrobench.record.range_ends import RangeEnds


def limited(x: np.ndarray, blocks: int = 1) -> int:
    ends = RangeEnds()
    for block in np.array_split(x, blocks):
        ends.add(block)
    assert ends.low == x.min() and ends.high == x.max()
    return ends.limited(x.size)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("blocks", [1, 7])
def test_a_limit_on_one_side(side: float, blocks: int) -> None:
    """Of 10,000 normal samples 2.3 % are beyond two standard deviations, few of them neighbours."""
    x = np.random.default_rng(1).normal(size=10_000)
    assert limited(side * np.minimum(x, 2.0), blocks) == np.count_nonzero(x >= 2.0) > 200


@pytest.mark.parametrize("step", [0.3, 1.0, 2.0])
def test_rounding_and_a_sine_are_no_limit(step: float) -> None:
    """The end of rounded noise has fewer samples than the value next to it; that of a sine some 2.4 times as many."""
    x = np.random.default_rng(2).normal(size=20_000)
    assert limited(step * np.round(x / step), 3) == 0
    wave = 3.0 * np.sin(2.0 * np.pi * np.arange(20_000) / 500.0)
    assert limited(0.3 * np.round((wave + 0.3 * x) / 0.3), 3) == 0


def test_a_coarse_limit_by_its_neighbours() -> None:
    """Noise of 0.8 steps, limited to three values: each end has few times the samples of the middle, side by side."""
    x = np.clip(np.round(0.8 * np.random.default_rng(3).normal(size=10_000)), -1.0, 1.0)
    assert limited(x) == max(np.count_nonzero(x == -1.0), np.count_nonzero(x == 1.0))
