"""Covariance of window means against a fine sum, whitening against Cholesky, intervals against Monte Carlo."""

from __future__ import annotations

import math
import os
import tracemalloc

import counting
import estimation_coverage as mc
import numpy as np
import pytest
from scipy import stats

from gyrobench import drift
from gyrobench.reduction.estimation import noise, noise_mixture_fit
from gyrobench.reduction.estimation.mixture import Mixture
from gyrobench.reduction.estimation.regression import RegressionError, least_squares

T0 = np.array([0.0, 10.0, 31.0, 45.0, 45.5])
T1 = np.array([10.0, 30.0, 40.0, 45.5, 60.0])


@pytest.mark.parametrize("tau", [0.3, 7.0, 4e4])
def test_process_covariance_is_the_double_integral(tau: float) -> None:
    """cov of two means = double mean of exp(-|t - s|/tau) (Gauss-Legendre off, Simpson-like sum on the diagonal)."""
    found = noise.process_covariance(T0, T1, tau)
    x, w = np.polynomial.legendre.leggauss(60)
    for i in range(5):
        for j in range(i, 5):
            if i == j:
                # |t - s| has density 2 (1 - d/T)/T: one smooth integral
                T = T1[i] - T0[i]
                d = T * (x + 1) / 2
                edges = np.minimum(1.0, 40 * tau / T)  # nothing beyond 40 tau
                d = d * edges
                value = float(np.sum(w / 2 * edges * T * 2 * (1 - d / T) / T * np.exp(-d / tau)))
            else:
                a, b = (T0[i] + T1[i]) / 2 + (T1[i] - T0[i]) / 2 * x, (T0[j] + T1[j]) / 2 + (T1[j] - T0[j]) / 2 * x
                value = float(w @ np.exp(-np.abs(b[None, :] - a[:, None]) / tau) @ w) / 4
            assert found[i, j] == pytest.approx(value, rel=1e-6, abs=1e-9), (i, j)
            assert found[i, j] == found[j, i]


def test_series_of_the_variance_meets_the_formula() -> None:
    r = np.array([0.9999e-3, 1.0001e-3])
    assert np.diff(noise.mean_variance(r))[0] == pytest.approx(-2e-7 / 3, rel=1e-3)
    assert noise.mean_variance(np.array([1e-9]))[0] == pytest.approx(1.0)
    assert noise.mean_variance(np.array([1e6]))[0] == pytest.approx(2e-6, rel=1e-5)  # 2 tau/T: white seen from afar


@pytest.mark.parametrize(("tau", "share"), [(5.0, 0.0), (0.2, 1.0), (20.0, 0.4), (1e5, 0.999), (30.0, 1.0)])
def test_whitening_is_the_inverse_root_of_the_covariance(tau: float, share: float) -> None:
    window = float(np.median(T1 - T0))
    size = noise.mean_variance(np.array([window / tau]))[0]
    covariance = share * noise.process_covariance(T0, T1, tau) / size + (1 - share) * np.diag(window / (T1 - T0))
    W, logdet = noise.whiten(T0, T1, np.eye(5), np.array([tau]), np.array([share]))
    np.testing.assert_allclose(W[:, 0] @ covariance @ W[:, 0].T, np.eye(5), atol=1e-9)
    assert logdet[0] == pytest.approx(np.linalg.slogdet(covariance)[1], rel=1e-9)
    assert np.allclose(W[:, 0], np.tril(W[:, 0]))


@pytest.mark.parametrize("reading", [0.0, 0.3])
def test_whitening_in_blocks_and_its_transpose(monkeypatch: pytest.MonkeyPatch, reading: float) -> None:
    """Blocks of 7 windows give what one block gives; the matrix of whiten(), applied from the left, gives W' z."""
    rng = np.random.default_rng(5)
    length, gap = rng.uniform(2.0, 9.0, 60), np.where(rng.random(60) < 0.2, 30.0, 0.0)
    t1 = np.cumsum(length + gap)
    t0, z, model = t1 - length, rng.normal(size=(60, 2)), (12.0, 0.7, reading)
    arrays = [np.array([v, v]) for v in model]
    whole, logdet = noise.whiten(t0, t1, np.eye(60), *arrays)
    monkeypatch.setattr(noise, "NUMBERS", 7 * 60 * 2)
    blocks, logdet_blocks = noise.whiten(t0, t1, np.eye(60), *arrays)
    np.testing.assert_allclose(blocks, whole, atol=1e-13)
    np.testing.assert_allclose(logdet_blocks, logdet, rtol=1e-13)
    np.testing.assert_allclose(noise.whiten_transposed(t0, t1, z, model), whole[:, 0].T @ z, atol=1e-13)


@pytest.mark.long
def test_memory_of_the_fit_grows_with_the_rows_not_their_square() -> None:
    """A matrix of 10,000 x 10,000 would take 800 MB.

    u is that of white noise, 0.1/sqrt(10,000), and by what the slowest drift may add that the record cannot show:
    a tenth for Gauss-Markov drift, two for power laws.
    """
    t0 = 10.0 * np.arange(10_000)
    y = 1.0 + 0.1 * np.random.default_rng(1).normal(size=t0.size)
    tracemalloc.start()
    try:
        e = noise_mixture_fit.fit(np.ones((t0.size, 1)), y, ["mean"], t0, t0 + 10.0)
        noise_mixture_fit.ordinary(np.ones((t0.size, 1)), y, ["mean"], t0, t0 + 10.0, np.ones(t0.size))
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 30e6
    assert 0.1 / 100.0 < e.u[0] < 1.35 * 0.1 / 100.0 and e.gain[0] == pytest.approx(1e-4, rel=0.2)


def test_two_windows_by_hand() -> None:
    """Equal adjacent windows T = tau: a = 1 - 1/e, v = 2/e; correlation a^2/v = 0.5431."""
    c = noise.process_covariance(np.array([0.0, 1.0]), np.array([1.0, 2.0]), 1.0)
    assert c[0, 0] == pytest.approx(2 / math.e)
    assert c[0, 1] == pytest.approx((1 - 1 / math.e) ** 2)
    assert c[0, 1] / c[0, 0] == pytest.approx(0.5431, abs=1e-4)


def test_candidates_are_a_probability() -> None:
    t0, t1, _ = mc.plan(36, 5)
    c = noise.noise_grid(t0, t1)
    assert c.prior.sum() == pytest.approx(1.0) and np.all(c.prior > 0)
    assert np.all((c.share >= 0) & (c.share <= 1)) and c.share[0] == 0.0
    # white alone, Gauss-Markov alone, both; one in five has a power law of two slopes, alone and with white noise
    assert c.tau.size == 1 + 9 + 9 * 6 + 2 * (1 + 4)
    assert c.prior[0] == 0.8 * 0.25 and c.prior[1:10].sum() == pytest.approx(0.8 * 0.25)
    assert c.prior[c.tau < 0.0].sum() == pytest.approx(0.2)
    assert c.tau[1:64].min() > 0.3 * mc.WINDOW and c.tau.max() < 0.5 * (t1[-1] - t0[0])


def test_population_by_hand() -> None:
    """tau from 0.3 windows to half the record; where both noises are there, the density of the Gauss-Markov part at
    frequency zero, 2 sigma2 tau, is at least 0.3 of the white one's, share/(1 - share) = sigma2 v / (N2/T) at most 100.
    """
    t0 = 10.0 * np.arange(40)
    rng = np.random.default_rng(1)
    drawn = np.array([noise.sample_instrument(rng, t0, t0 + 10.0, readings=True) for _ in range(4000)])
    tau, share, reading = drawn.T
    assert 3.0 < tau.min() < 3.1 and 195.0 < tau.max() < 200.0
    assert np.median(tau) == pytest.approx(math.sqrt(3.0 * 200.0), rel=0.1)  # log-uniform
    for value, part in ((share == 0.0, 0.25), (share == 1.0, 0.25), (reading == 0.0, 0.25)):
        assert value.mean() == pytest.approx(part, abs=0.03)
    both = (share > 0.0) & (share < 1.0)
    odds = share[both] / (1.0 - share[both])
    variance = odds / 10.0 / noise.mean_variance(10.0 / tau[both])  # of the process, for a white density of 1
    assert np.min(2.0 * variance * tau[both]) == pytest.approx(0.3, rel=0.1) and odds.max() == pytest.approx(
        100, rel=0.1
    )
    assert 0.04 < reading[reading > 0.0].min() < 0.05 and 0.98 < reading.max() < 0.9902


# ------------------------------------------------------------------------------------------ estimates
def test_ideal_data_come_back_exactly() -> None:
    t0, t1, X = mc.plan(72, 10)
    truth = np.linspace(-1, 1, 9) + 0.05
    e = noise_mixture_fit.fit(X, X @ truth, drift.terms(9), t0, t1)
    np.testing.assert_allclose(e.beta, truth, rtol=1e-12)
    assert np.max(e.u) < 1e-13 and not e.noise.unbounded and e.noise.white == 1.0


def test_gain_reproduces_the_design_and_fits_like_generalized_least_squares() -> None:
    t0, t1, X = mc.plan(36, 5)
    y = next(mc.samples(t0, t1, 5.0, 1.0, 1, 2))
    names = drift.terms(9)
    e = noise_mixture_fit.fit(X, y, names, t0, t1)
    np.testing.assert_allclose(e.gain @ X, np.eye(9), atol=1e-10)
    tau, share, _ = e.noise.best
    window = float(np.median(t1 - t0))
    R = share * noise.process_covariance(t0, t1, tau) / noise.mean_variance(np.array([window / tau]))[0]
    R = R + (1 - share) * np.diag(window / (t1 - t0))
    white = np.linalg.inv(np.linalg.cholesky(R))
    np.testing.assert_allclose(e.gain @ y, np.linalg.lstsq(white @ X, white @ y, rcond=None)[0], rtol=1e-7)


def test_white_noise_gives_nearly_the_ordinary_answer() -> None:
    t0, t1, X = mc.plan(72, 10)
    y = X @ np.ones(9) + next(mc.samples(t0, t1, 0.0, 0.0, 1, 4))
    e, o = noise_mixture_fit.fit(X, y, drift.terms(9), t0, t1), least_squares(X, y, drift.terms(9))
    assert e.noise.white > 0.5  # a fifth beforehand
    np.testing.assert_allclose(e.beta, o.beta, atol=0.1 * o.u.max())
    # what the record does not exclude widens intervals; of D_O, of which only the dwells tell, by a half
    assert np.all((e.u / o.u > 0.9) & (e.u / o.u < 1.6)) and np.median(e.u / o.u) < 1.25
    assert e.noise.density[0] == pytest.approx(o.s * math.sqrt(mc.WINDOW), rel=0.05)


def test_parameters_of_the_noise_are_found() -> None:
    """Mean over records of the likeliest values; correlation time and rms are biased low, as every short record's."""
    t0, t1, X = mc.plan(72, 10)
    found = [noise_mixture_fit.fit(X, y, drift.terms(9), t0, t1) for y in mc.samples(t0, t1, 3.0, 1.0, 40, 8)]
    tau = np.median([e.noise.tau[0] for e in found]) / mc.WINDOW
    sigma = np.median([e.noise.sigma[0] for e in found])
    assert 2.0 < tau < 4.5
    truth = 1 / math.sqrt(noise.mean_variance(np.array([1 / 3.0]))[0])
    assert sigma == pytest.approx(truth, rel=0.2)
    held = np.mean([e.noise.tau[1] <= 3.0 * mc.WINDOW <= e.noise.tau[2] for e in found])
    assert held > 0.75


def test_unbounded_correlation_time_is_said() -> None:
    t0, t1, X = mc.plan(36, 5)
    y = next(mc.samples(t0, t1, 500.0, 1.0, 1, 3))
    e = noise_mixture_fit.fit(X, y, drift.terms(9), t0, t1)  # a random walk as far as the record shows
    assert "confounded with the constant term" in e.noise.unbounded
    e = noise_mixture_fit.fit(np.ones((30, 1)), y[:30], ["mean"], t0[:30], t1[:30])  # too short to weigh power laws
    assert "not bounded by this record" in e.noise.unbounded


def test_scale_and_shift_of_data_do_not_matter() -> None:
    t0, t1, X = mc.plan(36, 5)
    y = next(mc.samples(t0, t1, 3.0, 0.6, 1, 6))
    a = noise_mixture_fit.fit(X, y, drift.terms(9), t0, t1)
    b = noise_mixture_fit.fit(X, 1e-6 * y + X @ np.arange(9.0), drift.terms(9), t0 + 1e5, t1 + 1e5)
    np.testing.assert_allclose(b.u, 1e-6 * a.u, rtol=1e-5)
    np.testing.assert_allclose(b.half_width, 1e-6 * a.half_width, rtol=1e-5)


def test_degrees_of_freedom_say_the_same_as_the_coverage_factor() -> None:
    t0, t1, X = mc.plan(36, 5)
    e = noise_mixture_fit.fit(X, next(mc.samples(t0, t1, 3.0, 1.0, 1, 7)), drift.terms(9), t0, t1)
    for k, dof in zip(e.half_width / e.u, e.dof, strict=True):
        assert k == pytest.approx(1.959964 if math.isinf(dof) else stats.t.ppf(0.975, dof), rel=2e-3)
    assert np.all((e.p >= 0) & (e.p <= 1))


def test_refusals() -> None:
    t0, t1, X = mc.plan(36, 5)
    y, names = np.zeros(t0.size), drift.terms(9)
    with pytest.raises(RegressionError, match="finite positive length"):
        noise_mixture_fit.fit(X, y, names, t0, t0)
    with pytest.raises(RegressionError, match="overlap or are out of order"):
        noise_mixture_fit.fit(X, y, names, t0[::-1], t1[::-1])
    with pytest.raises(RegressionError, match="non-finite"):
        noise_mixture_fit.fit(X, y + math.nan, names, t0, t1)


# ------------------------------------------------------------------------------------------ coverage
def bounds(runs: int, low: float = 0.93, high: float = 0.97) -> tuple[float, float]:
    """Observed fractions that a true coverage inside low..high allows (4 standard deviations)."""
    return low - 4 * math.sqrt(low * (1 - low) / runs), high + 4 * math.sqrt(high * (1 - high) / runs)


SLOW = os.environ.get("GYROBENCH_SLOW") == "1"


@pytest.mark.parametrize(("turn", "dwell"), [(36, 5), (72, 10)])
@pytest.mark.parametrize(("tau", "share"), [(0.0, 0.0), (1.0, 1.0), (3.0, 1.0), (8.0, 1.0)])
@pytest.mark.long
def test_intervals_cover(turn: int, dwell: int, tau: float, share: float) -> None:
    """Nine coefficients, white and Gauss-Markov noise whose parameters the fit estimates itself."""
    runs = 1000 if SLOW else 120 if turn == 36 else 50
    found = mc.coverage(turn, dwell, tau, share, runs, seed=20)
    low, high = bounds(runs)
    assert np.all(found >= low), dict(zip(drift.terms(9), found, strict=True))
    assert np.all(found <= max(high, 1.0 if not SLOW else 0.0)), dict(zip(drift.terms(9), found, strict=True))
    assert 0.925 < found.mean() < 0.985


@pytest.mark.parametrize(("design", "readings"), [("tumble", False), ("mean", True)])
@pytest.mark.long
def test_intervals_cover_the_population(design: str, readings: bool) -> None:
    """Noise drawn from the population, nine coefficients of a tumble or one mean of 30 windows: 95 % of the intervals
    hold the truth, not 90 and not 99 (see counting.check).
    """
    if design == "tumble":
        t0, t1, X = mc.plan(36, 5)
        runs = 190
    else:
        t0 = 10.0 * np.arange(30)
        t1, X = t0 + 10.0, np.ones((30, 1))
        runs = 500
    rng, names = np.random.default_rng(12), drift.terms(9)[: X.shape[1]]
    ratio = []
    for _ in range(runs):
        V = reading_covariance(t0, t1, *noise.sample_instrument(rng, t0, t1, readings))
        e = noise_mixture_fit.fit(
            X, np.linalg.cholesky(V) @ rng.standard_normal(t0.size), names, t0, t1, readings=readings
        )
        ratio.append(e.beta / e.half_width)
    counting.check(np.array(ratio))


def test_combinations_are_of_the_mixture() -> None:
    """Two candidates by hand: t of 1e9 degrees, sd 1 and 2 about 0.5 and -0.5, weights alike; of the sum of the two
    coefficients, which are independent, the means are +-1 and the sd sqrt2 and 2 sqrt2: variance (2 + 8)/2 + 1.
    """
    m = Mixture(
        np.array([0.5, 0.5]), np.array([[0.5, 0.5], [-0.5, -0.5]]), np.array([np.eye(2), 4.0 * np.eye(2)]), 10**9
    )
    sd, half = m.spread(np.array([[1.0, 1.0], [1.0, 0.0]]))
    assert sd[0] == pytest.approx(math.sqrt(6.0)) and sd[1] == pytest.approx(math.sqrt(2.5 + 0.25))
    inside = [stats.norm.cdf(half[0], c, s) - stats.norm.cdf(-half[0], c, s) for c, s in ((1, 2**0.5), (-1, 8**0.5))]
    assert np.mean(inside) == pytest.approx(0.95, abs=1e-6)
    assert m.outside(np.array([[1.0, 1.0]]), half[:1])[0] == pytest.approx(0.05, abs=1e-6)


def test_ordinary_least_squares_does_not_cover() -> None:
    """Why all this: under Gauss-Markov noise of three windows the ordinary intervals hold the truth half the time."""
    t0, t1, X = mc.plan(36, 5)
    hits = np.zeros(9)
    for e in mc.samples(t0, t1, 3.0, 1.0, 200, 1):
        fit = least_squares(X, e, drift.terms(9))
        hits += np.abs(fit.beta) <= fit.half_width()
    assert hits[0] / 200 < 0.75 and hits.mean() / 200 < 0.85


def reading_covariance(t0, t1, tau, share, reading):
    """Dense covariance of window means of the process and white noise, and of differences of readings."""
    window = float(np.median(t1 - t0))
    size = share / float(noise.mean_variance(np.array(window / tau)))
    rate = size * noise.process_covariance(t0, t1, tau) + np.diag((1.0 - share) * window / (t1 - t0))
    points = np.unique(np.round(np.concatenate([t0, t1]), 9))
    D = np.zeros((t0.size, points.size))
    for i, (a, b) in enumerate(zip(t0, t1, strict=True)):
        D[i, np.searchsorted(points, round(b, 9))] = 1.0 / (b - a)
        D[i, np.searchsorted(points, round(a, 9))] = -1.0 / (b - a)
    return (1.0 - reading) * rate + reading * window**2 / 2.0 * D @ D.T


@pytest.mark.parametrize("reading", [0.0, 0.3, 0.97])
@pytest.mark.parametrize("share", [0.0, 0.6, 1.0])
def test_reading_errors_are_shared_by_neighbours(share, reading):
    """Whitened data against the dense covariance: same quadratic form, same log determinant; gap and odd windows."""
    t0 = np.array([0.0, 10.0, 20.0, 30.0, 55.0, 65.0, 71.0, 85.0])
    t1 = np.array([10.0, 20.0, 30.0, 40.0, 65.0, 71.0, 81.0, 95.0])
    V = reading_covariance(t0, t1, 17.0, share, reading)
    if reading > 0.0:
        window2 = (t1 - t0)[0] * (t1 - t0)[1]
        both = (1.0 - reading) * share * noise.process_covariance(t0, t1, 17.0)[0, 1]
        both /= float(noise.mean_variance(np.array(10.0 / 17.0)))
        assert V[0, 1] == pytest.approx(both - reading * 100.0 / 2.0 / window2)  # lag-1 of the readings: -1/2
    y = np.random.default_rng(3).normal(size=(t0.size, 2))
    z, logdet = noise.whiten(t0, t1, y, np.array([17.0]), np.array([share]), np.array([reading]))
    form = z[:, 0, :].T @ z[:, 0, :]
    np.testing.assert_allclose(form, y.T @ np.linalg.solve(V, y), rtol=1e-10)
    assert logdet[0] == pytest.approx(np.linalg.slogdet(V)[1], rel=1e-10, abs=1e-10)


def test_readings_are_told_from_white_rate_noise():
    """300 windows of reading errors alone: the mean is known to sqrt2 s / (N T), not s_r / sqrt N [RED-RATE]."""
    rng = np.random.default_rng(8)
    n, T, s = 300, 100.0, 0.1
    t0 = T * np.arange(n)
    y = 5.0 + np.diff(rng.normal(0.0, s, n + 1)) / T
    found = noise_mixture_fit.fit(np.ones((n, 1)), y, ("mean",), t0, t0 + T, readings=True)
    assert found.noise.best[2] > 0.9 and found.noise.sigma_reading[0] == pytest.approx(s, rel=0.1)
    naive = np.std(y) / np.sqrt(n)
    assert found.u[0] < 0.4 * naive
    assert found.u[0] > 0.5 * np.sqrt(2.0) * s / (n * T)
    assert abs(found.beta[0] - 5.0) < 4.0 * found.u[0]
