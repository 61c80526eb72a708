"""Noise model of a sensor with a digital low-pass that its slow noise passes too, and of a single narrow band."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import signal

from gyrobench.reduction.noise_model.fit import fit_noise
from gyrobench.reduction.noise_model.ordinates import Ordinates, allan, spectrum, split
from gyrobench.reduction.noise_model.sensor_filters import Grid
from gyrobench.reduction.noise_model.terms import NoiseTerm

BUTTERWORTH, CASCADE = NoiseTerm("white", "butterworth"), NoiseTerm("white", "cascade")
W, B, GM = NoiseTerm("readout"), NoiseTerm("flicker"), NoiseTerm("gauss_markov")


def test_powers_are_those_of_the_filters() -> None:
    """Of an order by the bilinear transform, t = tan(omega_c/2); of four means over two samples, cos^8(omega/2)."""
    omega = np.linspace(0.01, 3.1, 50)
    for order in (1, 2, 5):
        b, a = signal.butter(order, 0.4)
        H = signal.freqz(b, a, omega)[1]
        p = np.array([0.0, math.log(math.tan(0.2 * math.pi)), math.log(order)])
        np.testing.assert_allclose(BUTTERWORTH.spectrum(p, Grid(omega)), np.abs(H) ** 2, rtol=1e-6, atol=2e-12)
    p = np.array([0.0, 0.0, math.log(4.0)])
    np.testing.assert_allclose(CASCADE.spectrum(p, Grid(omega)), np.cos(0.5 * omega) ** 8, rtol=1e-9, atol=2e-12)


def test_filters_of_poles_and_of_two_means_are_their_transfer_functions() -> None:
    """Of impulse responses by scipy: a triangle of four and four samples; poles e^s, s2 + 2 zeta w s + w2 = 0."""
    omega = math.pi * (np.arange(50) + 0.5) / 50
    H = signal.freqz(np.convolve(np.full(4, 0.25), np.full(4, 0.25)), 1.0, omega)[1]
    S = NoiseTerm("white", "bartlett4").spectrum(np.zeros(1), Grid(omega))
    np.testing.assert_allclose(S, np.abs(H) ** 2, rtol=1e-9, atol=1e-12)
    w, zeta = 0.5, 0.3
    a = np.real(np.poly(np.exp(np.roots([1.0, 2.0 * zeta * w, w * w]))))
    H = signal.freqz([a.sum()], a, omega)[1]
    S = NoiseTerm("white", "recursive").spectrum(np.array([0.0, math.log(w), math.log(zeta)]), Grid(omega))
    np.testing.assert_allclose(S, np.abs(H) ** 2, rtol=1e-6)


@pytest.mark.parametrize(
    ("model", "p"),
    [
        ((BUTTERWORTH,), [0.0, -0.3, 0.7]),
        ((CASCADE, W), [0.0, 0.0, 1.4, -6.0]),
        ((BUTTERWORTH, GM), [0.0, -1.5, 0.7, 1.0, 2.5]),
        ((NoiseTerm("white", "mean5*"), GM), [0.0, 1.0, 2.5]),
        ((NoiseTerm("white", "bartlett4*"), GM), [0.0, 1.0, 2.5]),
        ((NoiseTerm("white", "recursive"), GM), [0.0, -0.7, -0.7, 1.0, 2.5]),
        ((NoiseTerm("white", "first*"), GM), [0.0, 1.0, 1.0, 2.5]),
    ],
)
def test_the_deviation_is_that_of_the_spectrum(model: tuple[NoiseTerm, ...], p: list[float]) -> None:
    """sigma_A2 of means over m: mean of S 2 sin4(m omega/2)/(m2 sin2(omega/2)) over 0..pi."""
    omega = math.pi * (np.arange(40_000) + 0.5) / 40_000
    S = spectrum(model, np.array(p), Grid(omega))
    for m in (1.0, 2.0, 5.0, 16.0, 200.0):
        weight = 2.0 * np.sin(0.5 * m * omega) ** 4 / (m * np.sin(0.5 * omega)) ** 2
        own = float(allan(model, np.array(p), np.array([m]))[0])
        assert own == pytest.approx(float(np.mean(S * weight)), rel=1e-5)


def test_the_gradient_is_that_of_the_likelihood() -> None:
    """By differences of the likelihood; drift makes a part of what the filter's parameters change."""
    data = Ordinates([np.cumsum(np.random.default_rng(3).normal(size=600)) * 0.1])
    model = (BUTTERWORTH, W, GM, B)
    p = np.array([0.0, -1.0, 0.6, -5.0, 1.0, 3.0, -1.0])
    value, gradient, _ = data.scoring(model, p)
    h = 1e-4
    steps = np.concatenate([p + h * np.eye(p.size), p - h * np.eye(p.size), p[None]])
    values = data.value(model, steps)
    assert value == pytest.approx(float(values[-1]), rel=1e-9)
    np.testing.assert_allclose(gradient, (values[: p.size] - values[p.size : -1]) / (2.0 * h), rtol=2e-3, atol=2e-3)


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, 1])
def test_a_sensor_behind_a_butterworth_filter(seed: int) -> None:
    """N = 1, order 2 at a fifth of the sampling rate, readout of 0.003: N was 0.48 (0.31 to 0.57), with three bands."""
    rng = np.random.default_rng([41, seed])
    b, a = signal.butter(2, 0.4)
    x = signal.lfilter(b, a, rng.normal(size=31_000))[1000:] + 0.003 * rng.normal(size=30_000)
    model = fit_noise(x, 1.0, means=False)
    assert model.agrees and model["N"].determined and model["N"].low < 1.0 < model["N"].high < 1.05
    (term, p), *_ = split(*model.shape)
    assert term == BUTTERWORTH and math.exp(p[1]) == pytest.approx(math.tan(0.2 * math.pi), rel=0.02)
    assert model.filter_words().startswith("digital low-pass") and math.exp(p[2]) == pytest.approx(2.0, rel=0.02)
    assert not model.peaks() and not model.steps


@pytest.mark.long
@pytest.mark.parametrize("flicker", [0.06, 0.2])
def test_a_mean_of_flicker_too(flicker: float) -> None:
    """White noise of 1 and flicker, the sum averaged over three samples: its zeros hold neither.

    With a mean that flicker does not pass its upper end was 0.012 of a true 0.06, and N 1.045 (1.021 to 1.074).
    Flicker by half a difference: spectrum B^2/(2 sin(omega/2)), which is B^2/omega towards 0.
    """
    rng = np.random.default_rng(61)
    k = np.arange(1.0, 20_000.0)
    half = np.concatenate([[1.0], np.cumprod((k - 0.5) / k)])
    slow = signal.fftconvolve(rng.normal(size=30_000), half)[20_000:30_000]
    x = signal.lfilter(np.full(3, 1.0 / 3.0), [1.0], rng.normal(size=10_000) + flicker * slow)[3:]
    model = fit_noise(x, 1.0, means=False)
    assert model.agrees and model["N"].low < 1.0 < model["N"].high < 1.06
    assert model["B"].low <= flicker <= model["B"].high < 2.5 * flicker
    if flicker > 0.1:
        assert model.filter_words() == "mean over 3 samples" and model.slow_filtered


@pytest.mark.long
def test_one_narrow_band_under_angle_noise() -> None:
    """A dither of rms 2 that keeps its phase for 400 samples under angle noise of 1: its band, fitted beside a filter
    that stood for the angle noise and then kept, was twice as wide; none of four records agreed with its model.
    """
    rng = np.random.default_rng(77)
    n, fine, tau, omega = 9608, 8, 400.0, 2.94
    r = math.exp(-1.0 / (fine * tau))
    drive = rng.normal(size=fine * (n + 1 + 9 * int(tau)))
    angle = signal.lfilter([1.0], [1.0, -2.0 * r * math.cos(omega / fine), r * r], drive)[::fine][-n - 1 :]
    model = fit_noise(np.diff(2.0 / angle.std() * angle + rng.normal(size=n + 1)), 1.0, means=False)
    assert model.agrees and model["Q"].low < 1.0 < model["Q"].high < 1.04
