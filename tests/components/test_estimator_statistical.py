"""Statistical filter: weights by counts, limits, variance of normal noise (the source's claim is wrong), outliers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from estimating import play
from numpy.typing import NDArray
from scipy import integrate, stats

PART = "estimator_statistical"
Array = NDArray[np.float64]


def weighted(z: Array, width: float) -> float:
    """The weighted mean of one window, by its definition."""
    n = (np.abs(z[:, None] - z[None, :]) <= width).sum(axis=1)
    return float(n @ z / n.sum())


@pytest.mark.parametrize("width", [0.0, 0.5, 3.0, 100.0])
def test_weights_are_counts(width: float) -> None:
    z, N = np.random.default_rng(5).standard_t(2, size=120), 9
    found = play(PART, z, ["estimate", "latency"], N=N, width=width)
    wanted = [weighted(z[max(0, k - N + 1) : k + 1], width) for k in range(z.size)]
    assert found[:, 0] == pytest.approx(np.array(wanted), abs=1e-13)
    assert found[-1, 1] == pytest.approx(0.5 * (N - 1) * 1e-3)
    if width in (0.0, 100.0):  # all weights alike
        assert found[-1, 0] == pytest.approx(z[-N:].mean(), abs=1e-13)


def asymptotic(width: float) -> float:
    """N times the variance for unit normal noise: E IF2, IF(x) = E[x + Z; |x - Z| < width] / P(|Z - Z'| < width)."""

    def influence(x: float) -> float:
        a, b = x - width, x + width
        part = stats.norm.cdf(b) - stats.norm.cdf(a)
        return x * part + stats.norm.pdf(a) - stats.norm.pdf(b)

    near = 2.0 * stats.norm.cdf(width / math.sqrt(2.0)) - 1.0
    value = integrate.quad(lambda x: influence(x) ** 2 * stats.norm.pdf(x), -9.0, 9.0)[0]
    return float(value / near**2)


@pytest.mark.long
def test_of_normal_noise_it_leaves_more_than_the_mean_not_less() -> None:
    """Small widths: IF = 2 sqrt(2) x e^(-x2/2), E IF2 = 8/sqrt(27) = 1.540; width of one sigma over 96 readings as the
    integral says; the print has it below 1.
    """
    assert asymptotic(1e-3) == pytest.approx(8.0 / math.sqrt(27.0), rel=1e-4)
    assert asymptotic(8.0) == pytest.approx(1.0, abs=1e-4)
    N, z = 96, np.random.default_rng(8).normal(size=(1500, 96))
    near = np.abs(z[:, :, None] - z[:, None, :]) <= 1.0
    n = near.sum(axis=2)
    estimates = (n * z).sum(axis=1) / n.sum(axis=1)
    ratio = N * float(estimates.var())
    assert ratio == pytest.approx(asymptotic(1.0), rel=0.12) and ratio > 1.1  # 1500 windows: 3.7 %


def test_outliers_hardly_move_it() -> None:
    """One reading of 1000 sigma in 16: the mean moves by 62, the filter by 1000/(1 + 15 x 15) = 4.4 at most."""
    z = np.zeros(16)
    z[7] = 1000.0
    assert play(PART, z, N=16, width=3.0)[-1] == pytest.approx(1000.0 / 226.0)
    assert z.mean() == 62.5
