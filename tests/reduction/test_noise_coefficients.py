"""Flicker in means over unit time, and coefficients read from the slopes of an Allan deviation."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import fft

from gyrobench.reduction.estimation.noise import process_covariance
from gyrobench.reduction.series import deviations, noise_spectra
from gyrobench.reduction.series.noise_coefficients import slopes


def ordinates(cov: np.ndarray) -> np.ndarray:
    """Covariance of the ordinates 1 .. of a series with this covariance."""
    out: np.ndarray = fft.dctn(cov, norm="ortho")[1:, 1:]
    return out


def test_ordinates_of_flicker_are_those_of_many_relaxations() -> None:
    """Gauss-Markov processes of variance h/pi at tau spaced by h on the logarithm have S = 1/(2 pi f) together."""
    h, edge, n = 0.5, np.arange(257.0), 256
    cov = sum(h / np.pi * process_covariance(edge[:-1], edge[1:], math.exp(h * j)) for j in range(-16, 31))
    found = ordinates(cov)
    k = np.arange(1.0, n)
    ratio, correlations = noise_spectra.flicker()
    low = slice(0, ratio.size)
    assert np.diag(found)[low] == pytest.approx(ratio * noise_spectra.folded(k[low] / (2 * n)), rel=5e-3)
    size = np.sqrt(np.diag(found))
    part = slice(0, 32)
    correlation = (found / np.outer(size, size))[part, part]
    assert correlation == pytest.approx(correlations[part, part], abs=1e-3)


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
            e = found[other]
            if other == name:
                assert (e.value, e.low, e.high) == pytest.approx((1.0, 0.9, 1.2), rel=1e-3) and e.determined
            else:
                assert not e.determined and e.high > 0.0
