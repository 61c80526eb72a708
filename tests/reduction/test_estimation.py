"""Measures of estimators on series whose answer is known by theory; intervals counted by Monte Carlo."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import signal, stats

from gyrobench.reduction.loops import estimator_metrics

T = 1e-3


def markov(rng, n, a):
    """Gaussian series of variance 1 with rho_k = a^k."""
    w = rng.normal(size=n + 200) * math.sqrt(1.0 - a * a)
    return signal.lfilter([1.0], [1.0, -a], w)[200:]


def test_independent_squares_of_a_markov_series():
    # 1 + 2 sum a^(2k) = (1 + a^2)/(1 - a^2): 9.53 for a = 0.9
    rng, n, a = np.random.default_rng(1), 20000, 0.9
    found = np.mean([estimator_metrics.independent_squares(markov(rng, n, a)) for _ in range(20)])
    assert found == pytest.approx(n * (1 - a * a) / (1 + a * a), rel=0.1)
    white = np.mean([estimator_metrics.independent_squares(rng.normal(size=n)) for _ in range(20)])
    assert white == pytest.approx(n, rel=0.05)


@pytest.mark.parametrize("a", [0.0, 0.95])
def test_interval_of_an_rms_holds_the_truth(a):
    rng = np.random.default_rng(2)
    found = [estimator_metrics.rms(2.0 * markov(rng, 4000, a)).interval for _ in range(400)]
    covered = np.mean([low <= 2.0 <= high for low, high in found])
    assert abs(covered - 0.95) < 3.5 * math.sqrt(0.95 * 0.05 / 400) + 0.01


def test_decibels():
    x = np.random.default_rng(3).normal(size=5000)
    found = estimator_metrics.decibels(estimator_metrics.rms(x / 10.0), estimator_metrics.rms(x))
    assert found.value == pytest.approx(-20.0, abs=1e-12)
    # each rms is known to 1/sqrt(2 n) = 1 %: 8.686 dB times sqrt(2) percent
    assert found.u == pytest.approx(8.686 * 0.01 * math.sqrt(2.0), rel=0.05)


@pytest.mark.parametrize("amplitude", [0.0, 0.3, 3.0])
@pytest.mark.long
def test_interval_of_an_rms_with_a_sine_holds_the_truth(amplitude):
    """Noise of variance 1 under a sine: rms = sqrt(1 + A^2/2), intervals hold it, and the sine adds no scatter."""
    rng, t = np.random.default_rng(13), np.arange(6000) * T
    wave = amplitude * np.sin(2.0 * math.pi * 5.0 * t + 0.4)
    true = math.sqrt(1.0 + amplitude**2 / 2.0)
    found = [estimator_metrics.rms_of_sine(t, wave + markov(rng, t.size, 0.8), 5.0) for _ in range(400)]
    covered = np.mean([v.interval[0] <= true <= v.interval[1] for v in found])
    assert abs(covered - 0.95) < 3.5 * math.sqrt(0.95 * 0.05 / 400) + 0.01
    scatter = np.std([v.value for v in found])
    assert np.mean([v.u for v in found]) == pytest.approx(scatter, rel=0.2)
    if amplitude == 3.0:  # taken as noise, the sine would be known to a few periods only
        assert estimator_metrics.rms(wave + markov(rng, t.size, 0.8)).u > 3.0 * scatter


@pytest.mark.parametrize("true", [0.0, 3.0, 7.5, 20.25])
def test_delay(true):
    """A smooth random signal and itself, so many samples late."""
    rng = np.random.default_rng(4)
    t = np.arange(20000) * T
    truth = signal.lfilter(*signal.butter(2, 0.02), rng.normal(size=t.size))
    estimate = estimator_metrics.delay_signal(t, truth, true * T) + 0.02 * truth.std() * rng.normal(size=t.size)
    found = estimator_metrics.delay(t, estimate, truth, 40 * T)
    assert found.value == pytest.approx(true * T, abs=4.0 * found.u + 1e-5)
    assert found.u < 0.2 * T


def test_delay_wants_a_long_record():
    t = np.arange(1000) * T
    with pytest.raises(ValueError, match=r"too short for a delay of up to 0\.1 s: 2 s are needed"):
        estimator_metrics.delay(t, t, t, 0.1)


@pytest.mark.parametrize(("gain", "phase"), [(0.389, 0.0), (1.27, -0.3), (1.0, -2.8), (0.95, 0.05)])
def test_response_to_a_sine(gain, phase):
    rng = np.random.default_rng(6)
    t = 0.123 + np.arange(int(12.3e3)) * T
    w = 2.0 * math.pi * 1.5
    truth = 0.01 * np.sin(w * t + 0.7) + 0.002
    noise = rng.normal(size=t.size) * 1e-3
    found = estimator_metrics.response_to_sine(t, gain * 0.01 * np.sin(w * t + 0.7 + phase) + noise, truth, 1.5)
    assert found.phase is not None
    assert found.gain.value == pytest.approx(gain, abs=4.5 * found.gain.u)
    assert found.phase.value == pytest.approx(phase, abs=4.5 * found.phase.u)
    # white noise s on N samples: amplitude s sqrt(2/N), over 0.01; phase the same over the gain
    expected = 1e-3 * math.sqrt(2.0 / t.size) / 0.01
    assert found.gain.u == pytest.approx(expected, rel=0.6)
    assert found.phase.u == pytest.approx(expected / gain, rel=0.6)
    assert np.std(found.rest) == pytest.approx(1e-3, rel=0.03)


def test_response_wants_ten_periods():
    t = np.arange(9000) * T
    with pytest.raises(ValueError, match="9 periods of 1 Hz are recorded: 10 are needed"):
        estimator_metrics.response_to_sine(t, t, t, 1.0)


def test_response_to_a_random_truth():
    """Wiener gain: half of the truth plus noise of its own."""
    rng = np.random.default_rng(7)
    truth = markov(rng, 20000, 0.5)
    noise = rng.normal(size=truth.size)
    found = estimator_metrics.response_to_truth(0.5 * truth + noise + 3.0, truth)
    assert found.gain.value == pytest.approx(0.5, abs=4.0 * found.gain.u)
    assert found.gain.u == pytest.approx(1.0 / math.sqrt(truth.size), rel=0.6)
    assert np.std(found.rest) == pytest.approx(1.0, rel=0.03)


@pytest.mark.parametrize("a", [0.0, 0.97])
def test_nees_of_correlated_errors_is_rarely_refused(a):
    """At the level 0.95 5 % of consistent records are refused, however slow the error; taken as white, most are."""
    rng = np.random.default_rng(8)
    P, n, runs = 4e-6, 4000, 400
    found, naive = [], []
    for _ in range(runs):
        e = math.sqrt(P) * markov(rng, n, a)
        found.append(estimator_metrics.nees(e, np.full(n, P), 0.95).holds)
        naive.append(estimator_metrics.nis(e * e / P, 0.95).holds)
    assert abs(np.mean(found) - 0.95) < 3.5 * math.sqrt(0.95 * 0.05 / runs) + 0.015
    if a > 0.5:
        assert np.mean(naive) < 0.5


def test_nees_sees_an_overconfident_filter():
    e = markov(np.random.default_rng(9), 20000, 0.9)
    found = estimator_metrics.nees(e, np.full(e.size, 0.7))
    assert not found.holds and found.p < 1e-3 and found.mean == pytest.approx(1.0 / 0.7, rel=0.1)
    assert estimator_metrics.nees(e, np.ones(e.size)).holds


def test_nis_bounds_are_those_of_chi_square():
    values = np.random.default_rng(10).normal(size=500) ** 2
    found = estimator_metrics.nis(values, 0.95)
    assert (found.low, found.high) == pytest.approx(stats.chi2.ppf([0.025, 0.975], 500) / 500, rel=1e-9)
    assert found.p == pytest.approx(2 * min(stats.chi2.cdf(values.sum(), 500), stats.chi2.sf(values.sum(), 500)))


def test_whiteness_is_the_ljung_box_of_statsmodels():
    diagnostic = pytest.importorskip("statsmodels.stats.diagnostic")
    x = markov(np.random.default_rng(11), 3000, 0.05)
    x -= x.mean()  # ours is about zero, theirs about the mean
    _, q, p = estimator_metrics.whiteness(x, 20)
    theirs = diagnostic.acorr_ljungbox(x, lags=[20])
    assert q == pytest.approx(float(theirs["lb_stat"].iloc[0]), rel=1e-9)
    assert p == pytest.approx(float(theirs["lb_pvalue"].iloc[0]), rel=1e-6)


def test_variance_ratio():
    R = 2.0 + 0.1 * np.random.default_rng(12).normal(size=5000)
    found = estimator_metrics.variance_ratio(R, 2.0)
    assert found.value == pytest.approx(1.0, abs=4 * found.u) and found.u < 0.003
