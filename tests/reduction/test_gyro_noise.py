"""Spectrum of the noise parameters of a gyro against that of the coefficients that they stand for."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gyrobench.reduction.series.gyro_noise import gyro_noise, slow_density

W = 2.0 * math.pi


def test_spectrum_of_the_coefficients() -> None:
    """B2 / w + K2 / w2 + w2 of the angle noise, at 1e-4 to 1 Hz, one at a time and together; flicker within 1 %."""
    f = np.logspace(-4.0, 0.0, 41)
    b, k, q = 3e-8, 2e-10, 4e-7
    tau = 0.2 * 0.5  # of samples of 0.5 s
    angle = (W * f) ** 2 * 2.0 * q**2 * tau / (1.0 + (W * f * tau) ** 2)
    for B, K, Q in ((b, 0.0, 0.0), (0.0, k, 0.0), (0.0, 0.0, q), (b, k, q)):
        noise = gyro_noise({"N": 0.0, "B": B, "K": K, "R": 0.0, "Q": Q}, 0.5, 1e4)
        expected = B**2 / (W * f) + (K / (W * f)) ** 2 + (Q > 0.0) * angle
        assert slow_density(noise, f) == pytest.approx(expected, rel=0.01 if B else 1e-12)


def test_gauss_markov_and_nothing() -> None:
    """2 s2 tau / (1 + (w tau)2): at w tau = 1 it is s2 tau."""
    f = np.array([1.0 / (W * 300.0)])
    assert slow_density({"markov": 2e-8, "markov_tau": 300.0, "white": 1.0}, f) == pytest.approx(
        4e-16 * 300.0, rel=1e-12
    )
    assert np.all(slow_density({"white": 1.0}, f) == 0.0)
