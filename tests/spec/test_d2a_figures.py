"""Acceptance figures of the reduction mathematics (RED-*) that stand in no other test: the bench's code gives them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from polar_drift import DPH, Day, Noise
from scipy import linalg, signal, stats

from gyrobench.reduction.estimation.regression import RegressionError, generalized_least_squares, least_squares
from gyrobench.reduction.series import harmonics, rates
from gyrobench.reduction.series.autoregression import _yule_walker_rows
from gyrobench.reduction.series.checks import SeriesError
from gyrobench.reduction.series.correlation import autocovariance
from gyrobench.reduction.series.orthogonal import orthonormal
from gyrobench.reduction.series.smoothing import LinearModel, smooth

PHI = 0.95


def gauss_markov(rng: np.random.Generator, rows: int, n: int, phi: float) -> np.ndarray:
    """Rows of a process of variance 1, from its own stationary start."""
    e = rng.normal(size=(rows, n))
    e[:, 1:] *= np.sqrt(1.0 - phi**2)
    return np.asarray(signal.lfilter([1.0], [1.0, -phi], e, axis=1))


def test_a_centred_mean_turns_no_phase_and_fixed_angles_damp_as_fixed_times() -> None:
    """RED-RATE (a): omega dT/2 = 1.7: 0.583332, quadrature part 0 to 1e-12.  (e): 0.776699 of the fourth harmonic, by
    equal times and by equal angles of 0.6 rad.
    """
    t = np.linspace(0.0, 20.0, 2001)
    rate = (np.sin(1.7 * (t + 1.0)) - np.sin(1.7 * (t - 1.0))) / 2.0  # of sin 1.7 t, dT = 2 s
    both = np.linalg.lstsq(1.7 * np.column_stack([np.cos(1.7 * t), np.sin(1.7 * t)]), rate, rcond=None)[0]
    assert both == pytest.approx([rates.gain(1.7 / (2.0 * np.pi), 2.0), 0.0], abs=1e-12)
    # rate 1 + m cos 4 theta: t(theta) = int (1 - m cos 4 theta) to first order in m; marks 0.6 rad apart
    m = 1e-4
    middle = 2.0 * np.pi * np.arange(60) / 60.0
    at = {side: middle + side * 0.3 - 0.25 * m * np.sin(4.0 * (middle + side * 0.3)) for side in (-1.0, 1.0)}
    passed = np.array([float(rates.fixed_angle([at[-1.0][k], at[1.0][k]], 0.6).rate[0]) for k in range(60)])
    by_angle = harmonics.equal_steps(passed, 4).a[4] / m
    t = np.arange(0.0, 200.0, 0.01)
    theta = t + 0.25 * m * np.sin(4.0 * t)  # to first order
    seen = rates.from_angles(theta, 0.01, 60, overlapping=True)
    by_time = harmonics.over_angle(np.interp(seen.t, t, theta), seen.rate, 4).a[4] / m
    assert [by_angle, by_time] == pytest.approx([0.776699] * 2, abs=2e-3)


def test_scatter_of_harmonics() -> None:
    """RED-HARMONIC: n times the variances of a_0, a_r, b_r, a_{n/2} are 1, 2, 2, 1 of one value, as stated."""
    found = [harmonics.equal_steps(y, 4) for y in np.random.default_rng(1).normal(size=(6000, 8))]
    a, b = np.array([h.a for h in found]), np.array([h.b for h in found])
    assert 8.0 * a.var(axis=0) == pytest.approx([1.0, 2.0, 2.0, 2.0, 1.0], rel=0.08)
    assert 8.0 * b[:, 1:4].var(axis=0) == pytest.approx([2.0] * 3, rel=0.08)
    stated = harmonics.equal_steps(np.random.default_rng(2).normal(size=8), 2)
    assert stated.u_a**2 * 8.0 / stated.s**2 == pytest.approx([1.0, 2.0, 2.0])


def test_bias_of_an_autocorrelation_is_that_of_the_formula() -> None:
    """RED-ACF: phi = 0.95, N = 500, lag 20: (1 - p/N)(phi^p - var m) = 0.2722 for 0.3585; circular sums are no r."""
    k, n, p = np.arange(1, 500), 500, 20
    mean = (1.0 + 2.0 * np.sum((1.0 - k / n) * PHI**k)) / n
    expected = (1.0 - p / n) * (PHI**p - mean)
    assert expected == pytest.approx(0.2722, abs=5e-5) and pytest.approx(0.3585, abs=5e-5) == PHI**p
    rows = gauss_markov(np.random.default_rng(3), 1500, n, PHI)
    found = [autocovariance(x, p)[p] for x in rows]
    assert np.mean(found) == pytest.approx(expected, abs=4.0 * np.std(found) / np.sqrt(1500.0))
    ramp = np.arange(2000.0)
    r, far = (autocovariance(ramp, q)[q] for q in (400, 1600))
    assert abs(far) / np.var(ramp) == pytest.approx(0.36, abs=0.02) and r > 0.0  # what r_c adds at p = N/5


def test_correlated_noise_in_a_regression() -> None:
    """RED-GLS, N = 144, phi = 0.9, harmonics to 2: the mean has 17.75 times the variance of white noise (19 in the
    limit), generalized least squares have 2 to 5 % less; whitened they scatter as they state.
    """
    N, turn = 144, 2.0 * np.pi * np.arange(144) / 144.0
    X = np.column_stack([np.ones(N), *(f(r * turn) for r in (1, 2) for f in (np.cos, np.sin))])
    names, R = tuple("abcde"), linalg.toeplitz(0.9 ** np.arange(N))
    y = gauss_markov(np.random.default_rng(4), 2000, N, 0.9)
    ordinary, general = least_squares(X, y[0], names), generalized_least_squares(X, y[0], names, R)
    sandwich = ordinary.gain @ R @ ordinary.gain.T
    assert sandwich[0, 0] * N == pytest.approx(17.75, abs=0.01)
    gained = np.diag(general.gain @ R @ general.gain.T) / np.diag(sandwich)
    assert gained.min() > 0.94 and gained.max() < 0.985
    assert general.gain @ R @ general.gain.T == pytest.approx(np.linalg.inv(X.T @ np.linalg.solve(R, X)), rel=1e-9)
    # 5 % tests of "no harmonics" over noise alone: F of the fit itself, and the quadratic form of the general one
    critical = stats.f.ppf(0.95, 4, N - 5)
    P, W = general.covariance[1:, 1:] / general.s**2, np.linalg.inv(R)
    B = y @ general.gain.T
    rest = y - B @ X.T
    s2 = np.einsum("mi,ij,mj->m", rest, W, rest) / (N - 5)
    right = np.einsum("mi,ij,mj->m", B[:, 1:], np.linalg.inv(P), B[:, 1:]) / 4.0 / s2
    alarms = [least_squares(X, row, names).f_test()[0] > critical for row in y[:300]]
    assert np.mean(alarms) == pytest.approx(0.982, abs=0.03)
    assert np.mean(right > critical) == pytest.approx(0.05, abs=0.02)
    assert np.mean(s2) == pytest.approx(1.0, abs=0.02)
    error = y[:300] @ ordinary.gain.T
    own = np.array([least_squares(X, row, names).s for row in y[:300]]) ** 2
    assert np.mean(np.sum((error @ (X.T @ X)) * error, axis=1) / own) / 5.0 == pytest.approx(29.8, rel=0.2)


def test_covariance_of_ordinary_least_squares() -> None:
    """RED-OLS: of 40 000 fits that of the formula within 3 % (Frobenius norm), N = 60, p = 5."""
    turn = 2.0 * np.pi * np.arange(60) / 72.0
    X = np.column_stack([np.ones(60), *(f(r * turn) for r in (1, 2) for f in (np.cos, np.sin))])
    rng = np.random.default_rng(5)
    fit = least_squares(X, rng.normal(size=60), tuple("abcde"))
    found, stated = np.cov(fit.gain @ rng.normal(size=(60, 40_000))), fit.covariance / fit.s**2
    assert np.linalg.norm(found - stated) < 0.03 * np.linalg.norm(stated)


def test_orthogonal_columns_where_gram_schmidt_fails() -> None:
    """RED-ORTHO: ten columns of a Hilbert matrix; each made orthogonal to those before it, they end up parallel."""
    H = linalg.hilbert(10)
    Q = np.zeros((10, 0))
    for column in H.T:
        w = column - Q @ (Q.T @ column)
        Q = np.column_stack([Q, w / np.linalg.norm(w)])
    assert np.abs(Q.T @ Q - np.eye(10)).max() > 0.9
    nine = orthonormal(H[:, :8], tuple("abcdefgh"))[0]
    assert np.abs(nine.T @ nine - np.eye(8)).max() < 1e-14


def test_a_day_tells_a_correlation_time_to_a_fifth() -> None:
    """RED-ARMA: 864 values, phi = 0.945959, by Yule-Walker: bias -(1 + 4 phi)/N = -0.0055 (stated -0.0069 are those of
    400 records, +- 0.0006), scatter 0.0116, median below 1700 s of 1800 s (stated 1599 s).
    """
    phi = float(np.exp(-100.0 / 1800.0))
    rows = gauss_markov(np.random.default_rng(6), 3000, 864, phi)
    found = np.array(_yule_walker_rows(rows - rows.mean(axis=1, keepdims=True), 1))[:, 0]
    assert found.mean() - phi == pytest.approx(-(1.0 + 4.0 * phi) / 864.0, abs=4.0 * found.std() / np.sqrt(3000.0))
    assert found.std() == pytest.approx(0.0116, abs=0.0007)
    assert 1560.0 < np.median(-100.0 / np.log(found)) < 1700.0
    assert np.quantile(np.abs(-100.0 / np.log(found) / 1800.0 - 1.0), 0.683) > 0.15  # to 20 % at best


@pytest.mark.parametrize(("told", "nees"), [(1800.0, 5.0), (900.0, 9.7), (3600.0, 2.9)])
def test_a_wrong_correlation_time_in_the_coefficients_of_a_day(told: float, nees: float) -> None:
    """EST-KF-COEFF: mean normalized error squared of the five coefficients, exactly: trace of P^-1 G R G' over the
    covariance that the wrong tau states.  Windows of 400 s.
    """
    day, true, belief = Day.of(dT=400.0), Noise(), Noise(tau=told)
    X, scale = day.design, DPH**2
    W = np.linalg.inv(day.covariance(belief) / scale)
    P = np.linalg.inv(X.T @ W @ X)
    G = P @ X.T @ W
    found = float(np.trace(np.linalg.solve(P, G @ (day.covariance(true) / scale) @ G.T)))
    assert found == pytest.approx(nees, rel=0.06)


ANGLES = np.arange(0.0, 6.0, 0.2)
ONE = np.eye(1)


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda: rates.from_angles(ANGLES, 0.0), SeriesError, "sampling interval 0"),
        (lambda: rates.from_angles(ANGLES, 1.0, 0), SeriesError, "rates over 0 steps"),
        (lambda: rates.from_angles(np.where(ANGLES > 3.0, np.nan, ANGLES), 1.0), SeriesError, "is not a finite number"),
        (lambda: rates.fixed_angle([0.0, 1.0], 0.0), SeriesError, "angle between marks 0"),
        (lambda: rates.fixed_angle([0.0, 1.0, 1.0], 0.1), SeriesError, "turns round needs angles at equal times"),
        (lambda: harmonics.equal_steps(np.r_[np.nan, ANGLES], 2), SeriesError, "is not a finite number"),
        (lambda: harmonics.over_angle(1e-4 * ANGLES, np.cos(ANGLES), 2), RegressionError, "do not cover the circle"),
        (lambda: harmonics.over_angle(ANGLES[:4], ANGLES[:4], 2), RegressionError, "4 windows for 5"),
        (lambda: autocovariance(ANGLES, ANGLES.size), SeriesError, "lags of 30 values"),
        (lambda: smooth(np.zeros(0), LinearModel(ONE, ONE, ONE, ONE, ONE, np.zeros(1), ONE)), SeriesError, "at least"),
    ],
)  # fmt: skip
def test_refusals(call: Callable[[], object], error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words):
        call()
