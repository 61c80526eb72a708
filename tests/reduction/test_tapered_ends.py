"""Ordinates of a stretch with tapered ends: what they are worth, and the zeros of a filter, into which ends leak."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import fft

from gyrobench.reduction.noise_model.ordinates import _tapered
from tests.reduction.test_means_over_samples import model_of

N = 10_000


def test_what_an_ordinate_of_a_taper_is_worth() -> None:
    """Over an end sin^4 has the mean 3/8, sin^8 35/128, so of ends of N/40 samples each <w^2> = 1 - (5/8)/20 = 0.96875
    and <w^4> = 1 - (93/128)/20 = 0.963672; powers of white noise stay 1 on average.
    """
    first, square, worth = _tapered(np.random.default_rng(1).normal(size=N))
    assert worth == pytest.approx(0.96875**2 / 0.963672, rel=1e-6)
    assert first == int(30.0 / 250.0 * N / np.pi) and square.size == N - first
    assert float(np.mean(square)) == pytest.approx(1.0, abs=4.0 * (2.0 / square.size / worth) ** 0.5)
    assert float(np.var(square)) == pytest.approx(2.0, rel=0.15)  # of chi squared of one degree of freedom
    assert _tapered(np.zeros(1000))[0] == 1000  # too short for 32 samples at an end


def test_ends_leave_nothing_in_the_zeros_of_two_means() -> None:
    """About the zero of two means over eight at omega = pi/4 |H|^2 is far below what the ends of a stretch leave."""
    white = np.random.default_rng(2).normal(size=N + 14)
    x = np.convolve(white, np.convolve(np.ones(8), np.ones(8)) / 64.0, "valid")
    first, square, _ = _tapered(x)
    omega: NDArray[np.float64] = np.pi * np.arange(first, N) / N
    near = np.abs(omega - 0.25 * np.pi) < 0.01
    expected = float(np.mean((np.sin(4.0 * omega[near]) / (8.0 * np.sin(0.5 * omega[near]))) ** 4))
    plain = fft.dct(x, norm="ortho")[first:] ** 2
    assert float(np.mean(square[near])) == pytest.approx(expected, rel=0.8)  # 60 ordinates, most of it in a few
    assert float(np.mean(plain[near])) > 100.0 * expected


@pytest.mark.long
def test_noise_behind_two_means_over_eight() -> None:
    """Flicker of 0.15 and white noise of 1: with leaking ends N was 0.933 to 0.975, 1.03 to 1.17, 0.945 to 0.986."""
    for seed in (1, 6, 8):
        model = model_of("two means over 8, flicker", seed)
        assert model.filter_words().startswith("two means over 8 samples")
        assert model["N"].low <= 1.0 <= model["N"].high
        assert model.settling is None and not model.swings
