"""Acceptance figures of the reduction mathematics (RED-*) that stand in no other test: the bench's code gives them."""

from __future__ import annotations

import numpy as np
import pytest
from polar_drift import DPH, Day, Noise
from scipy import linalg, signal, stats

from gyrobench.reduction.drift import harmonic
from gyrobench.reduction.estimation.regression import least_squares
from gyrobench.reduction.series.autoregression import yule_walker
from gyrobench.reduction.series.column_regression import joint_test, orthonormal
from gyrobench.reduction.series.correlation import autocovariance

PHI = 0.95


def gauss_markov(rng: np.random.Generator, rows: int, n: int, phi: float) -> np.ndarray:
    """Rows of a process of variance 1, from its own stationary start."""
    e = rng.normal(size=(rows, n))
    e[:, 1:] *= np.sqrt(1.0 - phi**2)
    return np.asarray(signal.lfilter([1.0], [1.0, -phi], e, axis=1))


def test_a_mean_damps_a_harmonic_and_turns_no_phase() -> None:
    """RED-RATE, omega dT/2 or n w/2 = x, factor sin x/x: 0.583332 at 1.7, -3 dB at f dT = 0.4429, -0.2172 at worst;
    1.145 % and 8.9e-6 of the second harmonic of a day in 3600 s and 100 s; 0.776699 of the fourth over 0.6 rad.
    """

    def gain(x: float, n: int = 1) -> np.ndarray:
        return np.asarray(harmonic.columns(np.array([-x / n]), np.array([x / n]), [n])[0][0])

    assert gain(1.7) == pytest.approx([0.583332, 0.0], abs=5e-7)
    assert gain(0.4429 * np.pi)[0] == pytest.approx(np.sqrt(0.5), abs=1e-4)
    assert min(gain(np.pi * f)[0] for f in np.linspace(1, 2, 2001)) == pytest.approx(-0.2172, abs=1e-4)
    day = 7.292115e-5
    assert [1.0 - gain(day * dT, 2)[0] for dT in (3600.0, 100.0)] == [
        pytest.approx(0.01145, abs=5e-6),
        pytest.approx(8.9e-6, abs=5e-8),
    ]
    assert gain(4 * 0.3, 4) == pytest.approx([0.776699, 0.0], abs=5e-7)


@pytest.mark.long
def test_harmonics_of_a_rate_that_varies() -> None:
    """RED-HARMONIC, 48 samples at equal times of a rate 1 + 0.2 cos + 0.05 sin 2: sums give 0.9784, least squares 1.
    n times the variances of a_0, a_r, b_r are 1, 2, 2 of one value, as stated.
    """
    theta = [0.0]
    for _ in range(48 * 400):
        rate = 1 + 0.2 * np.cos(theta[-1]) + 0.05 * np.sin(2 * theta[-1])
        theta.append(theta[-1] + rate * 2 * np.pi / 0.9784 / (48 * 400))
    at = np.array(theta[: 48 * 400 : 400])
    y = 1 + 0.2 * np.cos(at) + 0.05 * np.sin(2 * at)
    assert y.mean() == pytest.approx(0.9784, abs=5e-4)
    assert harmonic.fit(at, at, y).beta == pytest.approx([1.0, 0.2, 0.0, 0.0, 0.05], abs=1e-9)
    even, rng = 2.0 * np.pi * np.arange(8) / 8.0, np.random.default_rng(1)
    fits = [harmonic.fit(even, even, row) for row in rng.normal(size=(2000, 8))]
    assert 8.0 * np.var([f.beta for f in fits], axis=0) == pytest.approx([1.0, 2.0, 2.0, 2.0, 2.0], rel=0.12)
    assert 8.0 * (fits[0].u / fits[0].s) ** 2 == pytest.approx([1.0, 2.0, 2.0, 2.0, 2.0])


@pytest.mark.long
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
    ordinary, W = least_squares(X, y[0], names), np.linalg.inv(R)
    P = np.linalg.inv(X.T @ W @ X)
    general = P @ X.T @ W
    sandwich = ordinary.gain @ R @ ordinary.gain.T
    assert sandwich[0, 0] * N == pytest.approx(17.75, abs=0.01)
    gained = np.diag(general @ R @ general.T) / np.diag(sandwich)
    assert gained.min() > 0.94 and gained.max() < 0.985
    # 5 % tests of "no harmonics" over noise alone: F of the fit itself, and the quadratic form of the general one
    critical = stats.f.ppf(0.95, 4, N - 5)
    B = y @ general.T
    rest = y - B @ X.T
    s2 = np.einsum("mi,ij,mj->m", rest, W, rest) / (N - 5)
    right = np.einsum("mi,ij,mj->m", B[:, 1:], np.linalg.inv(P[1:, 1:]), B[:, 1:]) / 4.0 / s2
    fits = [least_squares(X, row, names) for row in y[:300]]
    alarms = [joint_test(f.beta[1:], f.covariance[1:, 1:], f.dof)[0] > critical for f in fits]
    assert np.mean(alarms) == pytest.approx(0.982, abs=0.03)
    assert np.mean(right > critical) == pytest.approx(0.05, abs=0.02)
    assert np.mean(s2) == pytest.approx(1.0, abs=0.02)
    error = y[:300] @ ordinary.gain.T
    own = np.array([f.s for f in fits]) ** 2
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
    y = rows - rows.mean(axis=1, keepdims=True)
    found = np.einsum("ij,ij->i", y[:, 1:], y[:, :-1]) / np.einsum("ij,ij->i", y, y)
    assert yule_walker(rows[0], 1)[0] == pytest.approx(found[0], rel=1e-12)
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
