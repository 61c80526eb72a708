"""Uncertainty of what a ride leaves on a platform: intervals counted over motions whose level is known."""

import numpy as np
import pytest

from gyrobench.reduction.loops.estimator_metrics import rms
from gyrobench.reduction.loops.rides import share, still

DT, TIME = 0.02, 60.0
FREQUENCY = np.fft.rfftfreq(round(TIME / DT), DT)
COUNT = 300


def motion(rng, peak, width):
    """A random motion of unit rms with its spectrum about ``peak`` Hz."""
    shape = np.exp(-0.5 * ((FREQUENCY - peak) / width) ** 2)
    spectrum = shape * (rng.normal(size=FREQUENCY.size) + 1j * rng.normal(size=FREQUENCY.size))
    spectrum[0] = 0.0
    y = np.fft.irfft(spectrum, round(TIME / DT))
    return y / np.sqrt(2.0 * np.sum(shape[1:] ** 2) * 2.0) * y.size


@pytest.mark.parametrize(("peak", "width"), [(0.15, 0.05), (0.4, 0.1), (5.0, 1.0)])
def test_intervals_of_an_rms_hold(peak, width):
    """A sea and faster motions, 60 s; at 0.15 Hz that is nine periods, and the rms has a scatter of 18 %."""
    rng = np.random.default_rng(5)
    found = [rms(motion(rng, peak, width)) for _ in range(COUNT)]
    inside = np.mean([abs(x.value - 1.0) < 1.96 * x.u for x in found])
    assert (0.80 if peak < 0.2 else 0.88) < inside < 0.99


def test_intervals_of_a_share_hold():
    """-60 dB of the base and noise of its own: the ratio is known to a tenth of what either level is known to."""
    rng = np.random.default_rng(6)
    truth = 10.0 * np.log10(1e-6 + 1e-8)
    found = []
    for _ in range(COUNT):
        base = [motion(rng, 0.2, 0.05), 0.5 * motion(rng, 0.3, 0.05)]
        left = [1e-3 * base[0], 1e-3 * base[1] + 1e-4 * np.sqrt(1.25) * rng.normal(size=base[1].size)]
        found.append(share(left, base))
    inside = np.mean([abs(x.value - truth) < 1.96 * x.u for x in found])
    assert 0.85 < inside < 0.98
    assert 0.0 < np.mean([x.u for x in found]) < 0.05  # dB; the level alone: 0.5


def test_a_drift_is_not_in_it():
    t = np.arange(0.0, 10.0, DT)
    assert np.abs(still(t, 3.0 + 2.0 * t)).max() < 1e-12


def test_a_base_at_rest_has_no_share():
    nothing = share([np.ones(100)], [np.zeros(100)])
    assert np.isnan(nothing.value)
