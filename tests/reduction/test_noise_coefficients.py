"""Noise coefficients: the variances of the ordinates by hand, recovery, absent terms, units, slopes."""

from __future__ import annotations

import dataclasses
import functools
import math

import numpy as np
import pytest
from scipy import fft

from gyrobench.reduction.estimation.noise import process_covariance
from gyrobench.reduction.series import deviations, noise_likelihood, noise_spectra
from gyrobench.reduction.series.long_record import Condensed
from gyrobench.reduction.series.noise_coefficients import NoiseCoefficients, fit, slopes

N = 64


def ordinates(cov: np.ndarray) -> np.ndarray:
    """Covariance of the ordinates 1 .. of a series with this covariance."""
    out: np.ndarray = fft.dctn(cov, norm="ortho")[1:, 1:]
    return out


def test_ordinates_of_random_walk_and_quantization_by_hand() -> None:
    """Means of a Wiener process over unit steps i < j: cov = i + 1/2, var = i + 1/3: uncorrelated ordinates.  Angles
    of variance 1: var 2, neighbours -1; less what the first and last angle add, uncorrelated.
    """
    i = np.arange(N)
    k = np.arange(1.0, N)
    basis = noise_spectra.basis(k, N)
    walk = ordinates(np.minimum(i[:, None], i) + 0.5 - np.eye(N) / 6.0)
    assert walk == pytest.approx(np.diag(basis[2]), abs=1e-9)
    angle = ordinates(2.0 * np.eye(N) - np.eye(N, k=1) - np.eye(N, k=-1))
    u = math.sqrt(2.0 / N) * np.cos(np.pi * k / (2 * N))
    same = (k[:, None] - k) % 2 == 0
    assert angle == pytest.approx(np.diag(basis[3]) + 2.0 * same * np.outer(u, u), abs=1e-12)


def test_ordinates_of_flicker_are_those_of_many_relaxations() -> None:
    """Gauss-Markov processes of variance h/pi at tau spaced by h on the logarithm have S = 1/(2 pi f) together."""
    h, edge, n = 0.5, np.arange(257.0), 256
    cov = sum(h / np.pi * process_covariance(edge[:-1], edge[1:], math.exp(h * j)) for j in range(-16, 31))
    found = ordinates(cov)
    k = np.arange(1.0, n)
    assert np.diag(found) == pytest.approx(noise_spectra.basis(k, n)[1], rel=5e-3)
    size = np.sqrt(np.diag(found))
    part = slice(0, 2 * noise_likelihood.LOW)
    correlation = (found / np.outer(size, size))[part, part]
    assert correlation == pytest.approx(noise_spectra.flicker()[1][part, part], abs=1e-3)


def test_likelihood_of_a_short_record_is_that_of_its_covariance() -> None:
    """-2 log likelihood of the ordinates by their complete covariance, the ramp eliminated: equal up to a constant."""
    x = np.random.default_rng(0).normal(size=N)
    f = noise_likelihood.Likelihood(Condensed([x], 1, np.zeros((7, 0))))
    c, ramp = (fft.dct(y - y.mean(), norm="ortho")[1:] for y in (x, np.arange(N)))
    k = np.arange(1.0, N)
    basis, (_, correlation) = noise_spectra.basis(k, N), noise_spectra.flicker()
    low = np.arange(N - 1) < 2 * noise_likelihood.LOW
    pattern = np.eye(N - 1)
    pattern[np.ix_(low, low)] = correlation[: low.sum(), : low.sum()]
    size = np.sqrt(basis[1])
    u = math.sqrt(2.0 / N) * np.cos(np.pi * k / (2 * N))
    ends = 2.0 * ((k[:, None] - k) % 2 == 0) * np.outer(u, u)
    direct, ours = [], []
    for v in np.array([[1.0, 0.2, 0.01, 0.5], [0.3, 0.0, 0.1, 0.0], [0.0, 1.0, 0.0, 2.0]]):
        cov = np.diag(v @ basis - v[1] * basis[1]) + v[1] * pattern * np.outer(size, size) + v[3] * ends
        inverse = np.linalg.inv(cov)
        info, score = ramp @ inverse @ ramp, ramp @ inverse @ c
        direct.append(np.linalg.slogdet(cov)[1] + c @ inverse @ c - score**2 / info + math.log(info))
        ours.append(f(v)[0])
        for j, h in enumerate(1e-5 * np.eye(4)):
            if v[j] > 0.0:
                assert f(v)[1][j] == pytest.approx((f(v + h)[0] - f(v - h)[0]) / 2e-5, rel=1e-4, abs=1e-5)
    assert np.diff(ours) == pytest.approx(np.diff(direct), abs=1e-6)


def record(n: int, N: float, B: float, K: float, R: float, Q: float, seed: int = 0) -> np.ndarray:
    """Rates over 1 s from the equations; flicker of relaxations from 0.01 to 10 n, sampled often, and averaged."""
    rng = np.random.default_rng(seed)
    x = N * rng.normal(size=n) + R * np.arange(n) + Q * np.diff(rng.normal(size=n + 1))
    step = K * rng.normal(size=n)
    x += np.cumsum(step) - step / 2.0 + K / math.sqrt(12.0) * rng.normal(size=n)
    if B:
        from scipy.signal import lfilter

        fine = 8
        for tau in 10.0 ** np.arange(-2.0, math.log10(n) + 1.5, 0.5):
            p = math.exp(-1.0 / (tau * fine))
            z = rng.normal(size=n * fine) * math.sqrt(1.0 - p * p)
            z[0] = rng.normal()
            slow = lfilter([1.0], [1.0, -p], z).reshape(n, fine).mean(axis=1)
            x += B * math.sqrt(math.log(10.0) / 2.0 / math.pi) * slow
    return x


TRUTH = {"N": 1.0, "B": 0.2, "K": 0.01, "R": 1e-4, "Q": 2.0}


@functools.cache
def all_five() -> NoiseCoefficients:
    return fit(record(40000, **TRUTH, seed=4), 1.0)


@pytest.mark.long
def test_all_five_are_recovered() -> None:
    found = all_five()
    for name, truth in TRUTH.items():
        e = getattr(found, name)
        assert e.low <= truth <= e.high and e.determined, (name, e)
    assert found.N.value == pytest.approx(1.0, rel=0.05) and found.Q.value == pytest.approx(2.0, rel=0.02)


def test_absent_terms_are_not_determined() -> None:
    found = fit(record(4000, N=1.0, B=0.0, K=0.0, R=0.0, Q=0.0, seed=3), 1.0)
    assert found.N.determined and found.N.value == pytest.approx(1.0, rel=0.06)
    for name in "BKRQ":
        e = getattr(found, name)
        assert not e.determined and e.low <= 0.0 < e.high, (name, e)
    assert found.B.high < 0.1 and found.K.high < 0.01 and found.Q.high < 0.3


def test_units() -> None:
    """Rates a times larger over times b times longer: N a sqrt(b), B a, K a/sqrt(b), R a/b, Q a b."""
    x, a, b = record(600, **TRUTH), 3.0, 4.0
    one, other = fit(x, 1.0), fit(a * x, b)
    for name, factor in {"N": a * 2.0, "B": a, "K": a / 2.0, "R": a / b, "Q": a * b}.items():
        first, second = (dataclasses.astuple(getattr(f, name)) for f in (one, other))
        assert second[:3] == pytest.approx([factor * y for y in first[:3]], rel=1e-3, abs=1e-9)


def test_a_gap_splits_the_record() -> None:
    """A step across a gap is no random walk."""
    x = record(3000, N=1.0, B=0.0, K=0.0, R=0.0, Q=0.0, seed=5)
    x[1500:] += 100.0
    x[1450:1500] = math.nan
    found = fit(x, 1.0)
    assert not found.K.determined and found.K.high < 0.02
    with pytest.raises(ValueError, match="no stretch of 40 samples"):
        fit(np.where(np.arange(100) % 20 == 0, math.nan, x[:100]), 1.0)
    with pytest.raises(ValueError, match="constant"):
        fit(np.ones(100), 1.0)


def test_slopes_read_straight_lines() -> None:
    """One term alone: sigma = sqrt(3) Q/tau, N/sqrt(tau), 0.664 B, K sqrt(tau/3), R tau/sqrt(2)."""
    tau = 2.0 ** np.arange(10)
    lines = {"Q": math.sqrt(3.0) / tau, "N": tau**-0.5, "B": 0.6643 + 0.0 * tau, "K": np.sqrt(tau / 3.0)}
    lines["R"] = tau / math.sqrt(2.0)
    one = np.full(10, 50)
    for name, line in lines.items():
        curve = deviations.Deviation("allan", tau, line, 0.9 * line, 1.2 * line, one.astype(float), one, one)
        found = slopes(curve)
        for other in lines:
            e = getattr(found, other)
            if other == name:
                assert (e.value, e.low, e.high) == pytest.approx((1.0, 0.9, 1.2), rel=1e-3) and e.determined
            else:
                assert not e.determined and e.high > 0.0


def test_allan_of_the_model() -> None:
    """The model's deviation at the fitted coefficients passes through that of the record."""
    x = record(40000, **TRUTH, seed=4)
    curve = deviations.deviations(x, 1.0)["allan"]
    model = all_five().allan(curve.tau)
    assert np.mean((curve.low < model) & (model < curve.high)) > 0.8


@pytest.mark.long
def test_check_of_the_model() -> None:
    """White noise passes; a line and Gauss-Markov drift of half the variance do not, and are found where they are."""
    n, rng = 20000, np.random.default_rng(1)
    x = rng.normal(size=n)
    good = fit(x, 0.1).check
    assert good is not None and good.p > 0.01 and good.line_p > 0.01 and good.finding() == ""
    line = fit(x + 0.1 * np.sin(0.3 * np.arange(n)), 0.1).check
    assert line is not None and line.p > 0.01 and line.line_p < 1e-6
    assert "a line at 0.477" in line.finding() and line.line == pytest.approx(0.3 / (2.0 * math.pi) / 0.1, abs=1e-3)
    from scipy.signal import lfilter

    drift = lfilter([1.0], [1.0, -math.exp(-1.0 / 50.0)], 0.2 * rng.normal(size=n))  # corner at 0.032 Hz
    bad = fit(x + drift, 0.1).check
    assert bad is not None and bad.p < 1e-6 and 0.002 < bad.band[0] < 0.3 and "times the power" in bad.finding()
    step = fit(x[:2000] + np.where(np.arange(2000) > 1000, 100.0, 0.0), 0.1).check
    assert step is not None and step.p < 0.001 and "a step or a wild sample" in step.finding()


@pytest.mark.parametrize("shape", ["parabola", "rounded ramp", "random walk", "short"])
def test_extreme_records_have_coefficients(shape: str) -> None:
    """Records of ten and more decades of power, or without any at some frequencies: a maximum is found, intervals are
    finite and hold the estimate.
    """
    t, z = np.arange(2000.0), np.random.default_rng(0).normal(size=2000)
    records = {"parabola": t**2 + z, "rounded ramp": np.diff(np.round(0.618 * t)), "random walk": np.cumsum(z)}
    found = fit(records.get(shape, z[:40]), 1.0)
    for name in "NBKRQ":
        e = getattr(found, name)
        assert e.low <= e.value <= e.high < 1e5, (name, e)
