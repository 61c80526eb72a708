"""Stationarity, lines, normality, correlation and spectrum of a series."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy import optimize, signal, stats

from gyrobench.reduction.series import lines, normality, stationarity
from gyrobench.reduction.series.checks import SeriesError
from gyrobench.reduction.series.correlation import autocovariance, correlation
from gyrobench.reduction.series.spectrum import spectrum


def sequence(n1: int, n: int, runs: int) -> Any:
    """Symbols with n1 ones among n in so many runs: single ones and zeros in turn, what is left at both ends."""
    ones = runs // 2
    middle = [True, False] * ones
    out = [True] * (n1 - ones) + middle + [False] * (n - n1 - ones)
    if runs % 2:  # one run more: the last zero goes to the front
        out = [False, *out[:-1]]
    return np.array(out)


@pytest.mark.parametrize(
    ("k", "n1", "runs", "u"),
    [(200, 97, 69, 4.5282), (200, 89, 33, 9.5859), (100, 45, 53, 0.50767), (100, 42, 44, 1.1803)],
)
def test_runs_of_the_source(k: int, n1: int, runs: int, u: float) -> None:
    """Xia 2008, section 3.1.2: the four printed values of U come from these numbers of symbols."""
    found = stationarity.runs_test(sequence(n1, k, runs))
    assert found.runs == runs
    assert abs(found.z) == pytest.approx(u, abs=6e-5)
    assert found.independent == (u < 1.96)


def test_runs_agree_with_statsmodels() -> None:
    from statsmodels.sandbox.stats.runs import runstest_1samp

    x = np.random.default_rng(1).normal(size=4000)
    means, variances = stationarity.block_runs(x, 20)
    blocks = x.reshape(200, 20)
    for found, value in ((means, blocks.mean(axis=1)), (variances, blocks.var(axis=1))):
        z, p = runstest_1samp(value, cutoff="mean", correction=False)
        assert (found.z, found.p) == (pytest.approx(z, rel=1e-12), pytest.approx(p, rel=1e-9))


def test_runs_show_what_they_show() -> None:
    """EX7, EX8: slow variation has too few runs, differenced white noise too many; up-and-down runs miss a trend that
    the slope's interval shows.
    """
    rng = np.random.default_rng(2)
    w = rng.normal(size=16_000)
    assert stationarity.block_runs(signal.lfilter([1.0], [1.0, -0.999], w), 80)[0].z < -1.96
    assert stationarity.block_runs(np.diff(w), 80)[0].z > 1.96
    sloped = w + 1e-4 * np.arange(w.size)
    assert stationarity.up_down_runs(sloped.reshape(200, 80).mean(axis=1)).independent
    slope = stationarity.trend(sloped, 5.0)
    assert slope.significant and slope.low < 1e-4 / 5.0 < slope.high


def test_up_and_down_runs_of_the_source() -> None:
    """EX8: with 200 observations 118 runs are u = -2.527, and a tie is no sign."""
    y = np.zeros(200)
    signs = np.array([1.0, -1.0] * 58 + [1.0] * 82 + [-1.0])  # 118 runs of 199 signs
    y[1:] = np.cumsum(signs)
    found = stationarity.up_down_runs(y)
    assert found.runs == 118
    assert found.z == pytest.approx(-2.527, abs=5e-4)
    assert stationarity.up_down_runs(np.repeat(y, 2)).z == pytest.approx(found.z)


@pytest.mark.long
def test_no_slope_is_significant_over_a_random_walk() -> None:
    rng = np.random.default_rng(3)
    walks = [np.cumsum(rng.normal(size=1000)) for _ in range(12)]
    assert sum(stationarity.trend(x, 1.0).significant for x in walks) <= 1
    assert sum(abs(stats.kendalltau(np.arange(1000), x).pvalue) < 0.05 for x in walks) >= 9  # taken as independent
    read = [stationarity.unit_root(x).reading for x in walks]
    assert sum(r.startswith("random walk") for r in read) >= 9
    assert stationarity.unit_root(rng.normal(size=1000)).reading == "stationary about a level"


def test_refusals_of_the_counts() -> None:
    x = np.arange(400.0)
    with pytest.raises(SeriesError, match="at least 420 are needed"):
        stationarity.block_runs(x, 20)
    with pytest.raises(SeriesError, match="more than 20"):
        stationarity.runs_test(x[:20] > 3)
    with pytest.raises(SeriesError, match="all symbols are equal"):
        stationarity.runs_test(x > -1.0)
    with pytest.raises(SeriesError, match="at least 25"):
        stationarity.up_down_runs(x[:24])
    with pytest.raises(SeriesError, match="value 8 is not a finite"):
        stationarity.up_down_runs(np.where(x == 7, np.nan, x))
    with pytest.raises(SeriesError, match="all values are equal"):
        correlation(np.full(100, 3.0), 1.0, 5)
    with pytest.raises(SeriesError, match="sampling interval"):
        spectrum(x, 0.0)


# ------------------------------------------------------------------------------------------------------ lines
def test_line_of_the_acceptance_and_least_squares() -> None:
    """A = 1.5, f = 2.3e-4 Hz, sigma = 1, 20000 samples, phase 2.5 rad (EX11); equal to least squares of all five."""
    t = 5.0 * np.arange(20_000)
    y = 0.2 + 1.5 * np.sin(2 * np.pi * 2.3e-4 * t + 2.5) + np.random.default_rng(49).normal(size=t.size)
    found = lines.find_lines(y, 5.0)
    (line,) = found.lines
    assert found.complete and line.false_alarm < 1e-20
    assert abs(line.amplitude - 1.5) < 0.03 and abs(line.phase - 2.5) < 0.03

    def misfit(q: Any) -> Any:
        turn = 2 * np.pi * q[0] * 1e-4 * t
        return q[1] * np.sin(turn) + q[2] * np.cos(turn) + q[3] + q[4] * (t / t[-1] - 0.5) - y

    _, a, b, *_ = q = optimize.least_squares(misfit, [2.3, -1.2, 0.9, 0.2, 0.0], xtol=1e-15, ftol=1e-15).x
    assert line.frequency == pytest.approx(q[0] * 1e-4, abs=1e-3 * line.u_frequency)
    assert line.amplitude == pytest.approx(math.hypot(a, b), abs=1e-3 * line.u_amplitude)
    assert line.phase == pytest.approx(math.atan2(b, a), abs=2e-3 * line.u_amplitude / line.amplitude)
    # standard uncertainties of white noise of variance 1: sqrt(2/n), and Kay's bounds; the level is known to a tenth
    u, n = math.sqrt(2 / 20_000), 20_000
    assert line.u_amplitude == pytest.approx(u, rel=0.15)
    assert line.u_frequency == pytest.approx(math.sqrt(24 / n**3) / (2 * math.pi * 5.0 * 1.5), rel=0.15)
    assert found.residual == pytest.approx(y - line.amplitude * np.sin(2 * np.pi * line.frequency * t + line.phase))


def test_lines_in_slow_drift_and_none_where_there_are_none() -> None:
    """Two lines over a random walk of the same power are found with intervals that hold; walks without lines and narrow
    resonances of an autoregression show none.
    """
    rng = np.random.default_rng(5)
    n, t = 6000, np.arange(6000) * 0.1
    walk = 0.02 * np.cumsum(rng.normal(size=n))
    y = walk + rng.normal(size=n) + 0.3 * np.sin(2 * np.pi * 0.71 * t + 1.0) + 0.4 * np.sin(2 * np.pi * 2.345 * t)
    found = sorted(lines.find_lines(y, 0.1).lines, key=lambda line: line.frequency)
    assert len(found) == 2
    for line, f, A in zip(found, (0.71, 2.345), (0.3, 0.4), strict=True):
        assert abs(line.frequency - f) < 3 * line.u_frequency and abs(line.amplitude - A) < 3 * line.u_amplitude
    alarms = 0
    for _ in range(60):
        w = rng.normal(size=1500)
        quiet = (np.cumsum(w), signal.lfilter([1.0], [1.0, -1.2, 0.5], w), np.diff(w))
        alarms += sum(bool(lines.find_lines(x, 1.0, 0.05).lines) for x in quiet)
    assert alarms <= 19  # of 180 at 5 %: 9 expected, standard deviation 3


def test_a_line_that_wanders_is_said_to_and_close_ones_are_told_apart() -> None:
    """Phase of a random walk: two lines, none steady; two lines 2.6 bins apart are two, a comb of eight is eight."""
    rng = np.random.default_rng(23)
    n, t = 8000, np.arange(8000) * 0.01
    wander = np.sin(2 * np.pi * 11.0 * t + np.cumsum(rng.normal(size=n)) * 0.03)
    found = lines.find_lines(rng.normal(size=n) + 2.0 * wander, 0.01)
    assert found.complete and 1 <= len(found.lines) <= 4
    assert all(not line.steady for line in found.lines if abs(line.frequency - 11.0) < 0.1)
    close = np.sin(2 * np.pi * 11.0 * t) + 0.5 * np.sin(2 * np.pi * (11.0 + 2.6 / 80.0) * t + 1.0)
    pair = lines.find_lines(rng.normal(size=n) + close, 0.01).lines
    assert len(pair) == 2 and all(line.steady for line in pair)
    assert pair[1].amplitude == pytest.approx(0.5, abs=4 * pair[1].u_amplitude)
    comb = sum(np.sin(2 * np.pi * 1.7 * k * t + k) / k for k in range(1, 9))
    found = lines.find_lines(rng.normal(size=n) + comb, 0.01)
    assert sorted(round(line.frequency / 1.7) for line in found.lines) == list(range(1, 9))


def test_refusals_of_lines() -> None:
    x = np.random.default_rng(6).normal(size=1000)
    with pytest.raises(SeriesError, match="63 values; at least 64"):
        lines.find_lines(x[:63], 1.0)
    with pytest.raises(SeriesError, match="false-alarm"):
        lines.find_lines(x, 1.0, 0.7)


# ------------------------------------------------------------------------------- normality, correlation, spectrum
def test_standard_errors_of_the_source() -> None:
    """EX6, EX12: 0.018699 for 17157 values; 0.3422 of one block of 200, of 85 blocks 0.0371, u = 3.90."""
    assert round(normality.standard_errors(17157)[0], 6) == 0.018699
    one = normality.standard_errors(200)[1]
    assert round(one, 4) == 0.3422 and 0.14473 / (one / math.sqrt(85)) == pytest.approx(3.90, abs=0.005)


def test_skewness_and_kurtosis_are_the_unbiased_ones() -> None:
    """k_3/k_2^1.5 and k_4/k_2^2 of Fisher's k-statistics."""
    x = np.random.default_rng(7).gamma(3.0, size=1700)
    found = normality.normality(x)
    k2, k3, k4 = (stats.kstat(x, n) for n in (2, 3, 4))
    assert found.skewness == pytest.approx(k3 / k2**1.5, rel=1e-10)
    assert found.kurtosis == pytest.approx(k4 / k2**2, rel=1e-10)
    blocks = stats.kurtosis(x[:1600].reshape(8, 200), axis=1, bias=False)
    assert found.block_kurtosis == pytest.approx(blocks.mean()) and found.p < 1e-6


@pytest.mark.long
def test_correlated_normal_records_are_not_rejected() -> None:
    """Gauss-Markov of phi = 0.95: without the correction six of ten are; F3 = (1 + phi^3)/(1 - phi^3)."""
    rng = np.random.default_rng(8)
    records = [signal.lfilter([1.0], [1.0, -0.95], rng.normal(size=4500))[500:] for _ in range(100)]
    found = [normality.normality(x) for x in records]
    independent = [stats.jarque_bera(x).pvalue for x in records]
    assert sum(m.p < 0.05 for m in found) <= 12 < 50 < sum(p < 0.05 for p in independent)
    f3 = np.median([4000 / m.effective[0] for m in found])
    assert f3 == pytest.approx((1 + 0.95**3) / (1 - 0.95**3), rel=0.25)
    assert not math.isfinite(normality.normality(np.cumsum(rng.normal(size=2000))).p)  # a walk decides nothing


def test_long_lags_of_long_records_come_from_block_means() -> None:
    """phi = 0.9995 over 60000 samples: the factors from records and from block means agree with the geometric sums."""
    x = signal.lfilter([1.0], [1.0, -0.9995], np.random.default_rng(9).normal(size=90_000))[30_000:]
    f3, f4 = (x.size / e for e in normality.normality(x).effective)
    assert f3 == pytest.approx(2 / (1 - 0.9995**3), rel=0.5) and f4 == pytest.approx(2 / (1 - 0.9995**4), rel=0.5)


def test_correlation_is_that_of_statsmodels() -> None:
    """Direct sums, statsmodels, and the determinants of 3.4.10 (ER11)."""
    from statsmodels.tsa.stattools import acf, acovf, pacf

    x = signal.lfilter([1.0], [1.0, -0.9], np.random.default_rng(10).normal(size=900))
    found = correlation(x, 2.0, 20)
    assert found.rho == pytest.approx(acf(x, nlags=20, fft=False), abs=1e-12)
    assert found.partial == pytest.approx(pacf(x, nlags=20, method="ywm"), abs=1e-10)
    assert found.lag[3] == 6.0 and found.bound == pytest.approx(1.96 / 30, rel=1e-4)
    r = found.rho
    three = np.array([[1, r[1], r[1]], [r[1], 1, r[2]], [r[2], r[1], r[3]]])
    whole = np.array([[1, r[1], r[2]], [r[1], 1, r[1]], [r[2], r[1], 1]])
    assert found.partial[3] == pytest.approx(np.linalg.det(three) / np.linalg.det(whole), abs=1e-9)
    y = x - x.mean()
    assert autocovariance(x, 5)[5] == pytest.approx(y[5:] @ y[:-5] / 900, abs=1e-14)
    long = np.random.default_rng(11).normal(size=(1 << 18) + 4001)  # two pieces, the second shorter
    assert autocovariance(long, 30) == pytest.approx(acovf(long, fft=True, nlag=30), abs=1e-14)
    with pytest.raises(SeriesError, match="lags"):
        correlation(x, 1.0, 900)


def test_spectrum_holds_the_truth_and_the_variance() -> None:
    """ARMA-free check: the density of an AR(1) in every bin, 95 % of the intervals; white noise 2 sigma^2 dt."""
    rng = np.random.default_rng(13)
    held = total = 0
    for _ in range(40):
        s = spectrum(signal.lfilter([1.0], [1.0, -0.8], rng.normal(size=4200))[200:], 0.5)
        truth = 2 * 0.5 / np.abs(1 - 0.8 * np.exp(-2j * np.pi * s.frequency * 0.5)) ** 2
        inside = (s.low <= truth) & (truth <= s.high)
        held, total = held + int(inside.sum()), total + inside.size
    assert 0.92 < held / total < 0.98
    white = spectrum(rng.normal(size=100_000), 0.01)
    assert white.density[-1] == pytest.approx(0.02, rel=0.03) and white.frequency[-1] < 50.0
    walk = spectrum(np.cumsum(rng.normal(size=100_000)), 1.0)  # 2/(2 pi f)^2 over decades
    assert np.median(walk.density[:20] * (2 * np.pi * walk.frequency[:20]) ** 2) == pytest.approx(2.0, rel=0.4)
