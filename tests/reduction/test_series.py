"""Harmonics, residual series, uncertainty rules, attitude averages."""

from __future__ import annotations

import math

import numpy as np
import pytest
from estimation_coverage import plan as tumble_plan
from scipy import stats

from gyrobench import drift, frames
from gyrobench.reduction.drift import harmonic, window_regressors
from gyrobench.reduction.estimation import residual_series, uncertainty, verdict
from gyrobench.reduction.estimation.regression import RegressionError
from gyrobench.reduction.setup.window_checks import window_problems

rng = np.random.default_rng(3)


# ------------------------------------------------------------------------------------------ harmonics
@pytest.mark.parametrize("n", [8, 24, 25])
def test_harmonics_equal_the_discrete_fourier_sums(n: int) -> None:
    """[RED-HARMONIC] equidistant narrow windows: a_r = 2 Re F_r/n, b_r = -2 Im F_r/n."""
    y = rng.normal(size=n)
    theta = 2 * np.pi * np.arange(n) / n
    f = harmonic.fit(theta - 1e-9, theta + 1e-9, y)
    F = np.fft.rfft(y) / n
    assert f.beta == pytest.approx([F[0].real, 2 * F[1].real, -2 * F[1].imag, 2 * F[2].real, -2 * F[2].imag])


def test_window_damping_is_divided_out() -> None:
    """Means of cos 2 theta over 30 degrees are 4.5 % small; the amplitude comes back."""
    edge = np.radians(np.arange(0, 390, 30.0))
    y = np.diff(np.sin(2 * edge)) / 2 / np.diff(edge)
    f = harmonic.fit(edge[:-1], edge[1:], y)
    assert f.beta[f.names.index("A2")] == pytest.approx(1.0, rel=1e-12)


def test_unequal_steps() -> None:
    """[RED-HARMONIC] rate 1 + 0.2 cos + 0.05 sin 2 at uneven angles: least squares on the angle is exact."""
    theta = np.sort(rng.uniform(0, 2 * np.pi, 48))
    y = 1 + 0.2 * np.cos(theta) + 0.05 * np.sin(2 * theta)
    assert harmonic.fit(theta, theta, y).beta == pytest.approx([1, 0.2, 0, 0, 0.05], abs=1e-12)


def test_harmonic_refusals() -> None:
    theta = np.radians(np.arange(0, 360, 90.0))
    with pytest.raises(RegressionError, match="4 windows for 5 amplitudes"):
        harmonic.fit(theta, theta + 0.1, np.zeros(4))
    with pytest.raises(RegressionError, match="average harmonic 2 away"):
        harmonic.fit(np.arange(8) * np.pi, (np.arange(8) + 1) * np.pi, np.zeros(8))
    with pytest.raises(RegressionError, match="do not cover the circle"):
        harmonic.fit(np.linspace(0, 1e-5, 9), np.linspace(0, 1e-5, 9), np.zeros(9))


def test_whole_turns() -> None:
    edge = np.linspace(1.0, 1.0 - 4 * np.pi, 51)
    assert harmonic.whole_turns(edge[:-1], edge[1:]) == 2
    assert harmonic.whole_turns(edge[:-5], edge[1:-4]) is None
    gap = np.r_[0:20, 21:50]
    assert harmonic.whole_turns(edge[:-1][gap], edge[1:][gap]) is None


# ------------------------------------------------------------------------------------------ attitude
def test_averages_of_the_regressors_are_exact() -> None:
    """Mean of X = c sin a and X^2 over 40 degrees in mount 1, by the primitives."""
    lat = 0.8
    c = math.cos(lat)
    a0, a1 = 0.3, 0.3 + math.radians(40)
    face = frames.MOUNTS[1][None]
    turning = window_regressors.Turning(np.array([a0]), np.array([a1]), np.zeros(1), np.array([100.0]), face)
    base = frames.polar_base(lat)
    X = window_regressors.regressors(turning, base, frames.G0, drift.NAMES)[0]
    w = a1 - a0
    assert X[0] == pytest.approx(1.0, rel=1e-15)
    assert X[1] == pytest.approx(c * (math.cos(a0) - math.cos(a1)) / w, rel=1e-13)
    assert X[4] == pytest.approx(c * c * (0.5 - (math.sin(2 * a1) - math.sin(2 * a0)) / (4 * w)), rel=1e-13)
    assert X[9] == pytest.approx(-c * c * (math.sin(a1) ** 2 - math.sin(a0) ** 2) / (2 * w), rel=1e-13)
    rates = [window_regressors.axis_rate(turning, base, lat, 7e-5, k)[0] for k in range(3)]
    assert rates == pytest.approx([0.0, 7e-5 + w / 100, 0.0], abs=1e-18)


# ------------------------------------------------------------------------------------------ series
def test_stretches_split_at_gaps_and_lengths() -> None:
    t0 = np.array([0.0, 1, 2, 4, 5, 7])
    t1 = np.array([1.0, 2, 3, 5, 7, 9])
    parts = residual_series.stretches(t0, t1, np.arange(6.0))
    assert [(w, x.tolist()) for w, x in parts] == [(1.0, [0, 1, 2]), (1.0, [3]), (2.0, [4, 5])]


def test_autocorrelation_by_hand() -> None:
    """1, 2 | 3, 1: power 15, one pair in each stretch: (2 + 3)/15 times 4 values over 2 pairs."""
    found = residual_series.autocorrelation([np.array([1.0, 2.0]), np.array([3.0, 1.0])], 2)
    assert found.rho == pytest.approx([1.0, 5 / 15 * 4 / 2, 0.0])
    assert found.bound[1] == pytest.approx(1.96 / math.sqrt(2), rel=1e-4)


def test_ljung_box_agrees_with_statsmodels() -> None:
    sm = pytest.importorskip("statsmodels.stats.diagnostic")
    x = rng.normal(size=200)
    x -= x.mean()
    acf = residual_series.autocorrelation([x], 10)
    q, p = residual_series.ljung_box(acf, 200, 10)
    table = sm.acorr_ljungbox(x, lags=[10])
    assert (q, p) == pytest.approx((table["lb_stat"].iloc[0], table["lb_pvalue"].iloc[0]))


def test_runs_by_hand() -> None:
    """+ + + - - - : 2 runs of 4 expected, variance 1.2; signs that alternate are no trend."""
    z, p = residual_series.runs_test(np.array([3.0, 4, 5, -3, -4, -5]))
    assert z == pytest.approx((2 - 4) / math.sqrt(1.2)) and p == pytest.approx(0.0339, abs=1e-4)
    assert residual_series.runs_test(np.zeros(5)) == (0.0, 1.0)
    assert residual_series.runs_test(np.resize([1.0, -1.0], 40))[1] > 0.999
    same = np.resize([1.0, -1.0], 8)  # noise that can only be this says nothing of the number of runs
    assert residual_series.runs_test(same, np.tile(same, (100, 1))) == (0.0, 1.0)


def test_test_sizes_on_white_noise() -> None:
    hits = np.zeros(3)
    for _ in range(400):
        x = rng.normal(size=150)
        acf = residual_series.autocorrelation([x[:70], x[70:]], 20)
        hits += [
            residual_series.ljung_box(acf, 150, 20)[1] < 0.05,
            residual_series.runs_test(x)[1] < 0.05,
            residual_series.normality(x)[1] < 0.05,
        ]
    assert np.all(hits / 400 < 0.05 + 3.3 * math.sqrt(0.05 * 0.95 / 400) + 0.02)


def test_light_tails_are_no_finding() -> None:
    """Uniform values: W says that they are not normal (p < 1e-4), the test of heavy tails has nothing to say; of the
    squares of normal values, which are skew, it has.
    """
    x = np.linspace(-1.0, 1.0, 200)
    assert stats.shapiro(x).pvalue < 1e-4 and residual_series.normality(x)[1] == 1.0
    z = np.random.default_rng(1).normal(size=200)
    assert residual_series.normality(z**2)[1] < 1e-6 and residual_series.normality(z**3)[1] < 1e-6


@pytest.mark.parametrize("design", ["tumble", "twelve positions"])
@pytest.mark.long
def test_sizes_after_a_fit(design: str) -> None:
    """White noise less what a fit takes of it, 200 records: tests at 0.05, 0.01 and 0.001 reject no more often than
    that (within 3.3 standard deviations of the counts).  A chi-squared probability of Ljung and Box rejects 20 % and
    53 % at 0.05; runs of independent values are too few in 0.5 % and none.
    """
    if design == "tumble":  # nine coefficients, 68 windows in four phases
        X, sizes = tumble_plan(24, 10)[2], [10, 24, 10, 24]
    else:
        c, s = np.cos(np.arange(12) * np.pi / 6), np.sin(np.arange(12) * np.pi / 6)
        X, sizes = np.column_stack([np.ones(12), c, s, c * s, c * c, c**3]), [12]
    null = residual_series.fitted_noise(X)
    assert null is not None
    z = np.random.default_rng(5).normal(size=(200, len(X)))
    left = z - z @ X @ np.linalg.pinv(X)
    lags, edges = max(len(X) // 5, 3), np.cumsum(sizes)[:-1]
    parts = [np.split(x, edges) for x in left]
    box = np.array([residual_series.ljung_box_of_fit(x, lags, null)[1] for x in parts])
    runs = np.array([residual_series.runs_test(x, null)[1] for x in left])
    for p in (box, runs):
        for level in (0.05, 0.01, 0.001):
            assert np.mean(p < level) <= level + 3.3 * math.sqrt(level / p.size), (level, np.mean(p < level))
        assert np.mean(p < 0.5) > 0.3  # and not much less often
    chi = [residual_series.ljung_box(residual_series.autocorrelation(x, lags), len(X), lags)[1] for x in parts]
    assert np.mean(np.array(chi) < 0.05) > 0.15


def test_allan_of_white_noise() -> None:
    """White rate noise of window means s: dev(tau) = s/sqrt(m), slope -1/2, intervals that hold it; two stretches
    pool.
    """
    x = 2.0 * rng.normal(size=1000)
    found = residual_series.allan([(10.0, x[:1500]), (10.0, x[1500:]), (33.0, np.ones(9))])
    for tau, dev, lo, hi in zip(found.tau, found.dev, found.lo, found.hi, strict=True):
        assert lo < dev < hi
        if tau < 1000:
            assert 0.8 * lo < 2.0 / math.sqrt(tau / 10) < 1.2 * hi
    assert found.slopes[0].slope == pytest.approx(-0.5, abs=0.1)
    assert residual_series.allan([(10.0, x[:5])]) is None


def test_allan_agrees_with_allantools() -> None:
    import allantools

    x = rng.normal(size=500)
    found = residual_series.allan([(2.0, x)])
    _, dev, _, _ = allantools.oadev(x, rate=0.5, data_type="freq", taus=[2.0, 16.0])
    assert [found.dev[0], found.dev[3]] == pytest.approx(dev.tolist())


def test_spectrum_of_white_noise() -> None:
    """One-sided density of white means s over windows T: 2 s^2 T."""
    x = 3.0 * rng.normal(size=(40, 256))
    found = residual_series.spectrum([(5.0, row) for row in x])
    assert np.mean(found.S[2:-2]) == pytest.approx(2 * 9.0 * 5.0, rel=0.06)
    assert found.f[-1] == pytest.approx(0.1)
    assert residual_series.spectrum([(5.0, x[0][:9])]) is None


# ------------------------------------------------------------------------------------------ uncertainty
def test_combination() -> None:
    u, U = uncertainty.combine_uncertainties(3.0, 6.6, [4.0])
    assert (u, U) == pytest.approx((5.0, math.hypot(6.6, 1.959964 * 4)))
    assert uncertainty.combine_uncertainties(1.0, 2.2, []) == (1.0, 2.2)


@pytest.mark.parametrize(("estimate", "limit", "expected"), [
    (0.0, (-1.0, 1.0), "pass"), (0.9, (-1.0, 1.0), "pass"), (0.95, (-1.0, 1.0), "inconclusive"),
    (1.05, (-1.0, 1.0), "inconclusive"), (1.2, (-1.0, 1.0), "fail"), (-1.2, (-1.0, None), "fail"),
    (99.0, (-1.0, None), "pass"), (0.0, None, "no specification given"), (0.0, (None, None), "no specification given"),
    (math.nan, (-1.0, 1.0), "void"),
])  # fmt: skip
def test_verdicts(estimate: float, limit: tuple[float | None, float | None] | None, expected: str) -> None:
    assert verdict.assess_conformity((estimate - 0.1, estimate + 0.1), limit) == expected


def test_overall() -> None:
    assert verdict.worst_verdict(["pass", "no specification given"]) == "pass"
    assert verdict.worst_verdict(["pass", "inconclusive", "fail"]) == "fail"
    assert verdict.worst_verdict(["pass", "inconclusive"]) == "inconclusive"
    assert verdict.worst_verdict([]) == "no specification given"


def test_window_problems_are_none_for_good_windows() -> None:
    good = {n: np.array([0.0, 1.0, 2.0]) for n in ("phase", "t_start", "angle_start", "angle_end", "mean")}
    good["t_end"] = good["t_start"] + 1.0
    assert window_problems(good) == []
    assert "different length" in window_problems({**good, "mean": np.zeros(2)})[0]
