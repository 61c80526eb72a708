"""Quantization, orthonormal columns, elimination, likelihood of long records and smoothing of a series."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from numpy.polynomial import legendre
from scipy import linalg, signal

from gyrobench.reduction.estimation.regression import Fit, RegressionError, least_squares
from gyrobench.reduction.series import quantization
from gyrobench.reduction.series.checks import SeriesError
from gyrobench.reduction.series.column_regression import backward, joint_test, orthonormal
from gyrobench.reduction.series.gauss_markov import GaussMarkovEstimate, _Likelihood, settling
from gyrobench.reduction.series.smoothing import smooth_drift


# ------------------------------------------------------------------------------- acquisition
def test_step_of_a_converter_and_its_error() -> None:
    """14 bit over -+5 V: 0.610 mV; noise above half a step makes rounding white; EX9: 5 s behind 720 Hz, 39.5 dB."""
    rng = np.random.default_rng(2)
    q = 10.0 / 2**14
    for noise, white in ((2.0, True), (0.2, False)):
        x = np.round((0.3 + noise * q * rng.normal(size=20_000)) / q) * q
        found = quantization.quantization(x)
        assert found.step == pytest.approx(q, rel=1e-6) and found.white == white
        # the rounding, q/sqrt 12, is taken off where it is a white error
        assert not white or found.noise == pytest.approx(noise * q, rel=0.02)
    assert quantization.quantization(rng.normal(size=5000)).step == 0.0
    # steps of 0.0096 in three decimals are 0.010 and 0.009 in turn, up to 0.038: their mean is told
    x = np.round(np.round(np.linspace(0.0, 3.4, 5000) + 0.1 * rng.normal(size=5000)) * 0.0096, 3)
    assert not (found := quantization.quantization(x)).white and found.step == pytest.approx(0.038 / 4.0, rel=1e-3)
    found = quantization.folded(5.0, 720.0)
    assert found.decibels == pytest.approx(39.5, abs=0.05) and found.longest == pytest.approx(0.56e-3, rel=0.01)
    assert quantization.folded(0.4 / 720.0, 720.0).ratio == pytest.approx(1.0)
    with pytest.raises(SeriesError, match="cutoff"):
        quantization.folded(1.0, 0.0)


# -------------------------------------------------------------------------------- orthogonal columns
def test_orthonormal_columns_and_conversion() -> None:
    """ER34: Q'Q = 1 even of a Hilbert matrix; R^-1 b is least squares; the printed recursion is not orthogonal."""
    rng = np.random.default_rng(4)
    X, y = np.vander(np.linspace(-1, 1, 40), 6, increasing=True), rng.normal(size=40)
    names = tuple("abcdef")
    Q, R = orthonormal(X, names)
    assert pytest.approx(np.eye(6), abs=1e-14) == Q.T @ Q and np.all(np.diag(R) > 0) and pytest.approx(X) == Q @ R
    assert np.linalg.solve(R, Q.T @ y) == pytest.approx(np.linalg.lstsq(X, y, rcond=None)[0], abs=1e-12)
    hilbert = linalg.hilbert(8)
    assert orthonormal(hilbert, tuple("abcdefgh"))[0].T @ orthonormal(hilbert, tuple("abcdefgh"))[0] == pytest.approx(
        np.eye(8), abs=1e-13
    )
    with pytest.raises(RegressionError, match="column 'c' is a combination"):
        orthonormal(np.column_stack([X[:, :2], X[:, 0] - 2 * X[:, 1]]), tuple("abc"))
    with pytest.raises(RegressionError, match="non-finite number"):
        orthonormal(np.full((40, 2), np.nan), tuple("ab"))


def test_exponential_on_legendre_polynomials() -> None:
    """exp on -1..1, six terms: (f, f) - sum a_k^2 = 1.53e-9, by Gauss quadrature."""
    t, w = legendre.leggauss(30)
    root = np.sqrt(w)
    y = root * np.exp(t)
    b = orthonormal(root[:, None] * np.vander(t, 6, increasing=True), tuple("012345"))[0].T @ y
    assert y @ y - b @ b == pytest.approx(1.53e-9, rel=0.01)
    assert b[0] == pytest.approx(math.sinh(1.0) * math.sqrt(2.0))  # mean of exp times the length of 1


# -------------------------------------------------------------------------------------- elimination
def eliminate(X: Any, y: Any, names: Sequence[str], level: float, groups: Sequence[tuple[str, ...]] = ()) -> Any:
    """Backward elimination by ordinary least squares; the first column stays."""

    def fit_of(kept: Sequence[str]) -> Fit:
        return least_squares(X[:, [names.index(n) for n in kept]], y, kept)

    def test(fit: Fit, group: tuple[str, ...]) -> tuple[float, float]:
        k = [fit.names.index(n) for n in group]
        if len(k) == 1:
            return float(abs(fit.t[k[0]])), float(fit.p[k[0]])
        return joint_test(fit.beta[k], fit.covariance[np.ix_(k, k)], fit.dof)

    return backward(names, groups or [(n,) for n in names[1:]], level, fit_of, test)


@pytest.mark.long
def test_what_selection_does() -> None:
    """Eight null columns at 5 %: one is kept in 0.337 of records (0.347); two real terms of 0.6 s are both kept in 97
    %. Of what was kept of nothing no interval of the reduced fit holds zero; the full model's covers throughout.
    """
    rng = np.random.default_rng(6)
    X, names = np.column_stack([np.ones(96), rng.normal(size=(96, 8))]), ("1", *(f"x{k}" for k in range(1, 9)))
    kept = wrong = held = 0
    runs = 200
    for _ in range(runs):
        full, fit, removed = eliminate(X, rng.normal(size=96), names, 0.05)
        assert {*fit.names, *(n for r in removed for n in r.names)} == set(names)
        if len(fit.names) > 1:
            kept += 1
            wrong += bool(np.all(np.abs(fit.beta[1:]) > fit.half_width()[1:]))
        held += bool(abs(full.beta[3]) <= full.half_width()[3])
    assert kept / runs == pytest.approx(0.34, abs=0.08)
    assert wrong == kept and 0.91 < held / runs < 0.985
    both = spurious = 0
    truth = np.zeros(9)
    truth[[1, 4]] = 0.6
    for _ in range(120):
        names_kept = eliminate(X, X @ truth + rng.normal(size=96), names, 0.05)[1].names
        both += {"x1", "x4"} <= set(names_kept)
        spurious += len(set(names_kept) - {"1", "x1", "x4"})
    assert both / 120 > 0.93 and spurious / 120 == pytest.approx(0.32, abs=0.16)


def test_one_at_a_time_and_groups() -> None:
    """Collinear pair: neither |t| is significant while F is 1e-19; one is removed, the other stays."""
    rng = np.random.default_rng(7)
    x1 = rng.normal(size=40)
    X = np.column_stack([np.ones(40), x1, x1 + 1e-3 * rng.normal(size=40)])
    full, fit, removed = eliminate(X, x1 + 0.3 * rng.normal(size=40), ("1", "p", "q"), 0.05)
    assert np.abs(full.t[1:]).max() < 2.0 and joint_test(full.beta[1:], full.covariance[1:, 1:], full.dof)[1] < 1e-15
    assert len(removed) == 1 and len(fit.names) == 2 and "1" in fit.names
    t = 2 * math.pi * np.arange(48) / 48
    turn = np.column_stack([np.ones(48), np.cos(t), np.sin(t), np.cos(2 * t), np.sin(2 * t)])
    y = 0.9 * np.cos(t) + 0.3 * rng.normal(size=48)
    pairs = [("A1", "B1"), ("A2", "B2")]
    full, fit, removed = eliminate(turn, y, ("A0", "A1", "B1", "A2", "B2"), 0.01, pairs)
    assert fit.names == ("A0", "A1", "B1") and removed[0].names == ("A2", "B2")
    cos2 = full.beta[3:]
    assert removed[0].statistic == pytest.approx(cos2 @ cos2 / 2 / (full.s**2 * 2 / 48))


# ------------------------------------------------------------------- correlation time of long records
def test_likelihood_of_a_steady_filter_is_that_of_the_tridiagonal_factors() -> None:
    """s < 0: means over the sampling interval.  Values before the filter is steady: r^2k = 1e-18."""
    x = 3.0 + signal.lfilter([1.0], [1.0, -0.95], np.random.default_rng(19).normal(size=19_000))
    found = _Likelihood(x, True)
    for phi, s in ((0.95, 0.0), (0.95, 1.0), (0.5, 30.0), (0.99, 5.0), (0.2, 1e4), (0.97, -0.01)):
        m = settling(phi, s)
        assert 20 * m < x.size
        sums, state = found.exact(phi, s, m)
        assert sums + found.steady(phi, s, m, *state) == pytest.approx(found.exact(phi, s, x.size)[0], rel=1e-10)


def test_likelihood_of_a_long_record_by_a_filter_run_through_it() -> None:
    """Kalman filter sample by sample, 25,000 of them; without its steady state mixed() agrees to the rounding."""
    y = signal.lfilter([1.0], [1.0, -0.95], np.random.default_rng(20).normal(size=25_000))
    phi, s, P, a, b, log, squares = 0.9, 0.7, 1.0, 0.0, 0.0, 0.0, np.zeros(3)
    for reading in y.tolist():
        F = P + s
        v, u = reading - a, 1.0 - b
        log += math.log(F)
        squares += np.array([v * v, u * v, u * u]) / F
        a, b, P = phi * (a + P / F * v), phi * (b + P / F * u), phi * phi * P * s / F + 1.0 - phi * phi
    rest = squares[0] - squares[1] ** 2 / squares[2]
    expected = -0.5 * (log + math.log(squares[2]) + (y.size - 1) * math.log(rest))
    assert _Likelihood(y, True).mixed(phi, s) == pytest.approx((expected, rest / (y.size - 1)), rel=1e-12)


def test_values_until_a_filter_is_steady() -> None:
    # q = 3/4, s = 1: P^2 = 3/4, r = 1/2/(1.866025) = 0.267949, 2 + 41.45/(2 1.316958) = 17.7
    assert settling(0.5, 1.0) == 18
    assert settling(0.9999999, 1e5) > 19_000 and settling(0.9, -0.8) == 0


# ---------------------------------------------------------------------------------------- smoothing
def test_smoother_is_the_dense_estimate() -> None:
    """25 readings, three of them missing: values and standard deviations of the estimate of all states at once."""
    n, tau, sigma, density, dt = 25, 7.0, 1.3, 0.8, 0.5
    drift = GaussMarkovEstimate(tau, 0.0, math.inf, sigma, density, 100.0, n, dt)
    z = 4.0 + np.random.default_rng(8).normal(size=n)
    z[[3, 10, 11]] = np.nan
    P = sigma**2 * linalg.toeplitz(np.exp(-dt / tau * np.arange(n)))
    there = np.isfinite(z)
    A = np.eye(n)[there]
    gain = P @ A.T @ np.linalg.inv(A @ P @ A.T + density**2 / dt * np.eye(there.sum()))
    level, sd = smooth_drift(z, dt, drift, mean=4.0)
    assert level == pytest.approx(4.0 + gain @ (z[there] - 4.0), abs=1e-12)
    assert sd == pytest.approx(np.sqrt(np.diag(P - gain @ A @ P)), abs=1e-12)


def test_smoothed_drift_is_half_as_uncertain_as_filtered() -> None:
    """AR(1), phi = 0.946, signal to noise 1: variance 0.162 smoothed (0.245 filtered), of rates of 1e-8 rad/s too."""
    rng = np.random.default_rng(9)
    phi, n, unit = 0.946, 4000, 1e-8
    truth = signal.lfilter([math.sqrt(1 - phi**2)], [1.0, -phi], rng.normal(size=n + 200))[200:]
    z = unit * (truth + rng.normal(size=n)) + 3e-7
    z[1000:1010] = np.nan
    drift = GaussMarkovEstimate(-1.0 / math.log(phi), 0.0, math.inf, unit, unit, 100.0, n, 1.0)
    level, sd = smooth_drift(z, 1.0, drift, mean=3e-7)
    assert np.mean(((level - 3e-7) / unit - truth) ** 2) == pytest.approx(0.165, abs=0.012)
    assert (sd[500] / unit) ** 2 == pytest.approx(0.162, abs=5e-4) and sd[1005] > 1.5 * sd[500]
    P = 1.0  # variance of the filter, by its recursion
    for _ in range(500):
        P = phi**2 * P / (P + 1.0) + 1.0 - phi**2
    assert pytest.approx(0.245, abs=5e-4) == P / (P + 1.0) and pytest.approx((sd[-1] / unit) ** 2) == P / (P + 1.0)
    with pytest.raises(SeriesError, match="nothing to smooth"):
        smooth_drift(z, 1.0, GaussMarkovEstimate(18.0, 0.0, math.inf, unit, 0.0, 100.0, n, 1.0))
