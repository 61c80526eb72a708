"""Every second row of a record that is not as the rows between, and records that are as they should be."""

from __future__ import annotations

import numpy as np
import pytest

from gyrobench.reduction.series.row_pattern import CHANCE, every_second_row, rows_of_a_slower_record


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


@pytest.mark.parametrize(("a", "b", "period"), [(1, 3, 3.0), (2, 5, 2.5), (37.3, 100, 100.0 / 37.3), (3, 4, 4.0)])
def test_rows_of_a_slower_record(a: float, b: float, period: float) -> None:
    """a values to b rows.  Held ones change in 2 of 5 rows, at 0, 2 or 3 rows from one another: after 2.5 or after 5
    rows alike.  Interpolated at 3/4 no three are on a line: not seen.
    """
    x = np.cumsum(np.random.default_rng(6).normal(size=3002))
    at = np.arange(3000) * a / b
    held = rows_of_a_slower_record(x[np.floor(at).astype(int)])
    assert min(abs(held / period - 1.0), abs(held / (2.0 * period) - 1.0)) < 1e-3
    expected = 0.0 if a / b > 0.5 else period
    assert rows_of_a_slower_record(np.interp(at, np.arange(x.size), x)) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("kind", ["white", "walk", "heavy", "line", "missing", "machine", "rounded"])
def test_rows_as_they_were_sampled(kind: str) -> None:
    """A machine whose noise follows its turns, by 0.9 of its mean square, does not make it vanish."""
    for seed in range(5):
        rng = np.random.default_rng([7, seed])
        x = rng.normal(size=5000)
        wave = np.sin(2.0 * np.pi * 0.2317 * np.arange(5000))
        x = {"walk": np.cumsum(x), "heavy": rng.standard_t(3.0, 5000), "line": x + 3.0 * wave,
             "missing": np.where(rng.random(5000) < 0.1, np.nan, x), "machine": x * np.sqrt(1.0 + 0.9 * wave),
             "rounded": np.round(x)}.get(kind, x)  # fmt: skip
        assert rows_of_a_slower_record(x) == 0.0
