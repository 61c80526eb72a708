"""Acceptance figures of drift statistics and estimators (Xia 2008) that stand in no other test."""

from __future__ import annotations

import math

import numpy as np
import pytest
from estimating import AR3, SIGMA2, companion
from scipy import linalg, signal, stats

from gyrobench.reduction.series import stationarity

SIGMA, T = 1.643e-3, 1e-3


@pytest.mark.parametrize(
    ("sign", "rest", "fastest", "white", "gain", "error"),
    [(-1.0, 2.1, -6.0, -3.0, 1.2705, 2.7), (1.0, -8.2, -3.0, -4.6, 0.3891, 8.6)],
)
def test_the_drift_filter_by_either_sign(
    sign: float, rest: float, fastest: float, white: float, gain: float, error: float
) -> None:
    """EST-KF-AR: steady filter of 4.2.2 with the printed coefficients (-1) and with those of the table read as a (+1):
    dB at rest, at the highest frequency, of white noise; 1 Hz of 0.01 in noise of 1.643e-3: error over the raw one.
    """
    F, Q = companion([sign * c for c in AR3], SIGMA2)
    H = np.eye(1, 3)
    P = linalg.solve_discrete_are(F.T, H.T, Q, np.array([[SIGMA2]]))
    K = P @ H.T / (P[0, 0] + SIGMA2)
    back = (np.eye(3) - K @ H) @ F

    def response(f: float) -> complex:
        turn = np.exp(-2j * math.pi * f * T)
        return complex((H @ np.linalg.solve(np.eye(3) - back * turn, K))[0, 0])

    assert 20.0 * math.log10(abs(response(0.0))) == pytest.approx(rest, abs=0.06)
    assert 20.0 * math.log10(abs(response(0.5 / T))) == pytest.approx(fastest, abs=0.06)
    impulse = [float((H @ np.linalg.matrix_power(back, k) @ K)[0, 0]) for k in range(200)]
    passed = float(np.sum(np.square(impulse)))
    assert 10.0 * math.log10(passed) == pytest.approx(white, abs=0.06)
    at = response(1.0)
    assert abs(at) == pytest.approx(gain, rel=0.01)
    left = abs(at - 1.0) ** 2 * 0.01**2 / 2.0 + passed * SIGMA**2
    assert 10.0 * math.log10(left / SIGMA**2) == pytest.approx(error, abs=0.1)


@pytest.mark.long
def test_power_and_size_of_the_runs() -> None:
    """DRIFT-STATS-RUNS, 200 blocks of 80: of white noise 5 % are rejected; of a random walk, of noise that doubles, of
    a trend of 1e-4 sigma a sample, and of a stationary autoregression of 0.999 all; the up-and-down runs see no trend,
    which Kendall's rank correlation of the same means does.
    """
    rng, runs = np.random.default_rng(14), 120
    names = ("white, means", "white, variances", "walk", "doubled", "trend", "autoregression", "up and down", "kendall")
    rejected = dict.fromkeys(names, 0)
    for _ in range(runs):
        w = rng.normal(size=16_000)
        sloped = w + 1e-4 * np.arange(w.size)
        doubled = w * np.where(np.arange(w.size) < 8000, 1.0, 2.0)
        slow = signal.lfilter([1.0], [1.0, -0.999], w)
        means, variances = stationarity.block_runs(w, 80)
        blocks = sloped.reshape(200, 80).mean(axis=1)
        found = {
            "white, means": not means.independent,
            "white, variances": not variances.independent,
            "walk": not stationarity.block_runs(np.cumsum(w), 80)[0].independent,
            "doubled": not stationarity.block_runs(doubled, 80)[1].independent,
            "trend": not stationarity.block_runs(sloped, 80)[0].independent,
            "autoregression": not stationarity.block_runs(slow, 80)[0].independent,
            "up and down": not stationarity.up_down_runs(blocks).independent,
            "kendall": stats.kendalltau(np.arange(200), blocks).pvalue < 0.05,
        }
        for name, value in found.items():
            rejected[name] += bool(value)
    for name in ("white, means", "white, variances", "up and down"):
        assert rejected[name] <= 0.12 * runs, name  # 5 % of 120 are 6, 14 with a probability of 0.001
    for name in ("walk", "doubled", "trend", "autoregression", "kendall"):
        assert rejected[name] >= 0.98 * runs, name
