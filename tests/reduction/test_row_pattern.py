"""Every second row of a record that is not as the rows between, and records that are as they should be."""

from __future__ import annotations

import numpy as np
import pytest

from gyrobench.reduction.series.row_pattern import CHANCE, every_second_row


def test_rows_of_two_instruments() -> None:
    """Levels 0.1 apart in noise of 1: of 20,000 rows the difference is known to 2/sqrt(20,000) = 0.014."""
    x = np.random.default_rng(1).normal(size=20_000)
    x[::2] += 0.1
    found = every_second_row(x)
    assert found.levels_differ and not found.noise_differs
    assert found.level == pytest.approx(0.1, abs=4.0 * 0.014)


def test_noise_of_two_instruments() -> None:
    """1 and 1.3: of a row less the mean of its neighbours, 1 + 1.69/2 beside 1.69 + 1/2: rms in the ratio 1.09."""
    x = np.random.default_rng(2).normal(size=20_000)
    x[::2] *= 1.3
    found = every_second_row(x)
    assert found.noise_differs and not found.levels_differ
    assert found.ratio == pytest.approx((2.19 / 1.845) ** 0.5, rel=0.03)


def test_rows_that_were_interpolated() -> None:
    x = np.random.default_rng(3).normal(size=2000)
    found = every_second_row(np.interp(np.arange(3999) / 2.0, np.arange(2000.0), x))
    assert found.noise_differs and found.ratio > 1e3


@pytest.mark.parametrize("kind", ["white", "walk", "heavy", "line", "missing", "level", "short"])
def test_records_without_a_pattern(kind: str) -> None:
    """Ten records each: by chance one in 50,000 has a pattern."""
    for seed in range(10):
        rng = np.random.default_rng([4, seed])
        n = 300 if kind == "short" else 5000
        x = rng.normal(size=n)
        if kind == "walk":
            x = np.cumsum(x)
        if kind == "heavy":
            x = rng.standard_t(3.0, n)
        if kind == "line":
            x += 3.0 * np.sin(2.0 * np.pi * 0.2317 * np.arange(n))
        if kind == "missing":
            x[rng.random(n) < 0.1] = np.nan
        if kind == "level":
            x *= np.linspace(0.3, 3.0, n)
        found = every_second_row(x)
        assert min(found.p_level, found.p_ratio) > CHANCE, (seed, found)
