"""Correlation of channels over averaging times, against records whose correlation is known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gyrobench.reduction.series.channel_correlation import averaging_time, correlate, octaves, whitened


def flat(f: np.ndarray) -> np.ndarray:
    return np.ones_like(f)


def test_octaves_and_their_averaging_times() -> None:
    """1,000 samples every 0.01 s: octaves end at 50, 25 ... Hz; tau = 0.371 sqrt 2/f = 0.525/f: 10.5 ms, 21 ms ..."""
    found = octaves(1000)
    assert found[0] == slice(499, 999) and found[1] == slice(249, 499) and len(found) == 5
    assert averaging_time(found[0], 1000, 0.01) == pytest.approx(0.0105, rel=2e-3)
    assert averaging_time(found[1], 1000, 0.01) == pytest.approx(0.0210, rel=5e-3)


def test_ordinates_are_white_and_a_straight_line_is_gone() -> None:
    """White noise of 3 under a line of a thousand: ordinates of variance 1, sum of squares within 4 sqrt(2/n)."""
    n = 4096
    x = 3.0 * np.random.default_rng(1).normal(size=n) + np.linspace(0.0, 1e3, n)
    z = whitened(x, 0.5, lambda f: 9.0 * 0.5 * flat(f))
    assert np.mean(z**2) == pytest.approx(1.0, abs=4.0 * math.sqrt(2.0 / n))


def test_intervals_hold_the_true_correlation() -> None:
    """Two channels with rho = 0.4, a third with none: 300 records of 500 samples.

    For all four octaves of a pair together 95 % of the intervals hold it: of 300 records 285 are expected, 270 is
    four standard deviations less.  A pair without any is called correlated in 5 % of records at most, for the two
    such pairs and all octaves together: 15 expected, 30 is four more.
    """
    rng = np.random.default_rng(3)
    root = np.linalg.cholesky(np.array([[1.0, 0.4, 0.0], [0.4, 1.0, 0.0], [0.0, 0.0, 1.0]]))
    held = false = 0
    for _ in range(300):
        x = rng.normal(size=(500, 3)) @ root.T
        found = correlate([whitened(x[:, k], 1.0, flat) for k in range(3)], 1.0)
        held += all(c.low <= 0.4 <= c.high for c in found[0, 1])
        false += any(c.p_all < 0.05 for pair in ((0, 2), (1, 2)) for c in found[pair])
    assert 270 <= held < 300 and false <= 30


def test_a_level_that_changes_in_both_makes_no_correlation() -> None:
    """Levels 0.1 to 1.9 in both: <a^4>/<a^2>^2 = 1.9 times the variance of r.  300 records: 15 false ones, 30 is
    four standard deviations more; without it 80 are called correlated.
    """
    rng = np.random.default_rng(8)
    n, false = 4000, 0
    level = 1.0 + 0.9 * np.sin(2.0 * np.pi * 3.0 * np.arange(n) / n)
    for _ in range(300):
        x = rng.normal(size=(n, 2)) * level[:, None] / np.sqrt(np.mean(level**2))
        false += any(c.p_all < 0.05 for c in correlate([whitened(x[:, k], 1.0, flat) for k in (0, 1)], 1.0)[0, 1])
    assert false <= 30


def test_a_correlation_of_slow_drift_alone() -> None:
    """White noise apart, one random walk in both: none at two samples, 0.95 at long averaging times."""
    rng = np.random.default_rng(5)
    n = 8192
    walk = np.cumsum(0.1 * rng.normal(size=n))
    x = [rng.normal(size=n) + walk for _ in range(2)]
    z = [whitened(v, 1.0, lambda f: 1.0 + 0.01 / (4.0 * np.sin(np.pi * f) ** 2)) for v in x]
    found = correlate(z, 1.0)[0, 1]
    assert found[0].p > 1e-4 and found[-1].low > 0.8
    assert [c.tau for c in found] == sorted(c.tau for c in found)
