"""The source: its sine, its processes rebuilt from its own noise, the size of that noise."""

from __future__ import annotations

import math

import numpy as np
import pytest
from estimating import AR3, SIGMA2, arrays
from native_parts import make
from scipy import signal, stats

NAMES = ["z", "truth", "signal", "drift"]


def run(n: int, T: float = 1e-3, **parameters) -> dict[str, np.ndarray]:
    one = make("signal_source", "native")
    one.set(arrays(parameters))
    one.initialize(0.0)
    rows = []
    for k in range(n):
        one.step(k * T, T)
        rows.append(one.get(NAMES))
    one.free()
    return dict(zip(NAMES, np.array(rows).T, strict=True))


def white(series: np.ndarray, sd: float) -> None:
    """Standard deviation within 99.9 % of chi-square, neighbours uncorrelated within 3.3 standard errors."""
    n = series.size
    low, high = stats.chi2.ppf([0.0005, 0.9995], n) / n
    assert low < np.mean(series**2) / sd**2 < high
    assert abs(np.corrcoef(series[1:], series[:-1])[0, 1]) < 3.3 / math.sqrt(n)


def test_sine():
    s = run(400, white=0.0, amplitude=0.01, frequency=7.0, phase=0.4, offset=0.1)
    t = np.arange(1, 401) * 1e-3
    assert np.abs(s["z"] - (0.1 + 0.01 * np.sin(2.0 * math.pi * 7.0 * t + 0.4))).max() < 1e-15
    assert np.array_equal(s["z"], s["truth"]) and not s["drift"].any()


def test_reading_noise_and_its_change():
    s = run(8000, change_time=4.0, change_factor=3.0)
    noise = s["z"] - s["truth"]
    white(noise[:3999], 1.643e-3)
    white(noise[3999:], 3 * 1.643e-3)


def test_autoregressive_and_its_sum():
    s = run(6000, p=3, phi=AR3, w=math.sqrt(SIGMA2), white=0.0)
    w = signal.lfilter([1.0, *(-c for c in AR3)], [1.0], s["drift"])  # what drives it
    white(w, math.sqrt(SIGMA2))
    summed = run(6000, p=3, phi=AR3, w=math.sqrt(SIGMA2), white=0.0, integrated=1)
    assert np.abs(summed["drift"] - np.cumsum(s["drift"])).max() < 1e-12


def test_walk():
    s = run(6000, walk=2e-4, white=0.0)
    white(np.diff(s["drift"], prepend=0.0), 2e-4)


def test_gauss_markov():
    T, tau, rms = 1e-3, 0.05, 1e-3
    s = run(6000, markov=rms, markov_tau=tau, white=0.0)
    a = math.exp(-T / tau)
    white(signal.lfilter([1.0, -a], [1.0], s["drift"]), rms * math.sqrt(1.0 - a * a))


def test_seeds():
    a, b, c = run(50, seed=3), run(50, seed=3), run(50, seed=4)
    assert np.array_equal(a["z"], b["z"]) and not np.array_equal(a["z"], c["z"])


def test_white_noise_is_not_that_of_the_walk():
    s = run(4000, walk=1e-3, white=1e-3)
    r = np.corrcoef(np.diff(s["drift"], prepend=0.0), s["z"] - s["truth"])[0, 1]
    assert abs(r) < 3.3 / math.sqrt(4000)


def test_burg_finds_the_model_again():
    """BENCH-DRIFT-AR3: ARIMA(3,1,0) differenced; Burg's a is -phi.  Standard errors 0.007 to 0.0085."""
    linear = pytest.importorskip("statsmodels.regression.linear_model")
    s = run(17158, T=5.0, p=3, phi=AR3, w=math.sqrt(SIGMA2), white=0.0, integrated=1)
    phi, variance = linear.burg(np.diff(s["z"]), order=3)
    assert np.abs(phi - AR3).max() < 4 * 0.0085
    assert variance == pytest.approx(SIGMA2, rel=4 * math.sqrt(2 / 17158))
