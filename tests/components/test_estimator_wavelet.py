"""The streaming filter bank against scipy's filters and PyWavelets, its delay, its threshold, its refusals."""

from __future__ import annotations

import math

import numpy as np
import pytest
from estimating import play
from scipy.signal import lfilter

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

pywt = pytest.importorskip("pywt")
WAVELETS = {1: "haar", 4: "db4"}


def stretched(taps: list[float], j: int) -> np.ndarray:
    out = np.zeros((len(taps) - 1) * 2**j + 1)
    out[:: 2**j] = taps
    return out


def bank(x: np.ndarray, wavelet: str, J: int, threshold: float) -> tuple[np.ndarray, int]:
    """Undecimated bank of zeros at first: delayed reconstruction and its delay in readings."""
    w = pywt.Wavelet(wavelet)
    a, details = x, []
    for j in range(J):
        d = lfilter(stretched(w.dec_hi, j), [1.0], a)
        details.append(pywt.threshold(d, threshold, "soft"))
        a = lfilter(stretched(w.dec_lo, j), [1.0], a)
    delay = 0
    for j in reversed(range(J)):
        d = np.concatenate([np.zeros(delay), details[j]])[: x.size]
        a = 0.5 * (lfilter(stretched(w.rec_lo, j), [1.0], a) + lfilter(stretched(w.rec_hi, j), [1.0], d))
        delay += (w.dec_len - 1) * 2**j
    return a, delay


def signal(n: int = 1500) -> np.ndarray:
    t = np.arange(n) * 1e-3
    z = 0.01 * np.sin(2.0 * math.pi * t) + np.random.default_rng(4).normal(size=n) * 1.643e-3
    z[0] = 0.0  # then the lines, filled with the first reading, are those of a bank that begins with zeros
    return z


@pytest.mark.parametrize("moments", WAVELETS)
@pytest.mark.parametrize("J", [1, 2, 3, 4, 5, 6])
def test_perfect_reconstruction_after_the_stated_delay(moments, J):
    z = np.random.default_rng(J).normal(size=1200)
    found = play("estimator_wavelet", z, ["estimate", "latency"], moments=moments, J=J, sigma=0.0)
    delay = round(found[0, 1] / 1e-3)
    assert delay == (2 * moments - 1) * (2**J - 1)  # L = 2 N taps for N vanishing moments
    assert np.abs(found[delay:, 0] - z[: z.size - delay]).max() < 1e-12
    assert np.abs(found[:delay, 0] - z[0]).max() < 1e-12  # before: the first reading


@pytest.mark.parametrize(("moments", "J"), [(1, 3), (1, 6), (4, 1), (4, 4), (4, 6)])
def test_soft_threshold_is_that_of_pywavelets(moments, J):
    z = signal()
    expected, _ = bank(z, WAVELETS[moments], J, 3.7232973 * 1.643e-3)
    found = play("estimator_wavelet", z, moments=moments, J=J)
    assert np.abs(found - expected).max() < 1e-15
    assert np.abs(found - play("estimator_wavelet", z, moments=moments, J=J, sigma=0.0)).max() > 1e-3


def test_the_printed_rule_is_another_one():
    """sign(w)(w - thr) makes -2 with a threshold of 1 to +3, the soft rule to -1: the part follows the soft one."""
    d = np.array([-2.0, -0.5, 0.5, 2.0])
    soft, printed = pywt.threshold(d, 1.0, "soft"), np.where(np.abs(d) >= 1.0, np.sign(d) * (d - 1.0), 0.0)
    assert soft.tolist() == [-1.0, 0.0, 0.0, 1.0] and printed[0] == 3.0
    # Haar, one level, readings 0, ..., 0, x: d = -x/sqrt(2) (dec_hi begins with -1/sqrt(2)), a = x/sqrt(2), and the
    # estimate is (h1 a + g1 w)/2 = (x/sqrt(2) + w)/(2 sqrt(2)), with w = -(x/sqrt(2) - thr)
    x, thr = 2.0 * math.sqrt(2.0), 1.0
    found = play("estimator_wavelet", [0.0, 0.0, x], moments=1, J=1, sigma=1.0, c=thr)[-1]
    assert found == pytest.approx((2.0 - 1.0) / (2.0 * math.sqrt(2.0)), abs=1e-14)


def test_one_sigma_serves_all_levels():
    """White noise has its own standard deviation in every detail: what a unit norm of every filter means."""
    w = pywt.Wavelet("db4")
    low = np.ones(1)
    for j in range(6):
        high = np.convolve(low, stretched(w.dec_hi, j))
        low = np.convolve(low, stretched(w.dec_lo, j))
        assert np.sum(high**2) == pytest.approx(1.0, abs=1e-12)


def test_nothing_before_the_first_reading():
    valid = np.ones(60)
    valid[:10] = 0.0
    found = play("estimator_wavelet", np.full(60, 0.7), valid=valid, sigma=0.0)
    assert not found[:10].any() and np.abs(found[10:] - 0.7).max() < 1e-14


def test_refusals():
    cls = load_part("estimator_wavelet")
    with pytest.raises(ComponentError, match=r"moments = 2: the wavelets are 1 \(Haar\) and 4 \(db4\)"):
        cls(moments=2).initialize()
    with pytest.raises(ComponentError, match="parameter J = 7 1 must be <= 6"):
        cls(J=7).initialize()
