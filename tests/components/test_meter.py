"""Reading of a meter: scale error, zero, and a noise that is new in every step."""

import numpy as np
import pytest
from wired import BENCH

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

Meter = load_part("meter", BENCH)


def test_reading():
    """12 V, 0.5 % too much, zero of 0.02 V: 12.08 V; 4000 readings with 0.05 V of noise: their mean and scatter."""
    exact = Meter(scale_error=0.005, zero=0.02)
    exact.x = 12.0
    exact.initialize()
    assert exact.reading == pytest.approx(12.08, abs=1e-12)
    noisy = Meter(noise_rms=0.05, seed=3)
    noisy.x = 12.0
    noisy.initialize()
    readings = np.zeros(4000)
    for k in range(readings.size):
        noisy.do_step(k * 1e-4, 1e-4)
        readings[k] = noisy.reading
    assert abs(readings.mean() - 12.0) < 4.0 * 0.05 / 4000**0.5
    assert readings.std() == pytest.approx(0.05, rel=0.05)
    assert abs(np.corrcoef(readings[1:], readings[:-1])[0, 1]) < 4.0 / 4000**0.5


def test_refusal():
    with pytest.raises(ComponentError, match="scale_error"):
        Meter(scale_error=0.2).initialize()
