"""Reading of a micromechanical sensor, as data sheets describe it: filter, range, sampling, word.  [GYRO-MEMS]"""

from __future__ import annotations

from gyrobench.component.math import Number, floor, pi, sqrt


def butterworth(s: Number, y: Number, v: Number, bandwidth: Number) -> Number:
    """Return y'' = wn2 (s - y) - sqrt(2) wn y', v = y', wn = 2 pi bandwidth: 3 dB at ``bandwidth`` (Hz)."""
    wn = 2.0 * pi * bandwidth
    return wn * wn * (s - y) - sqrt(2.0) * wn * v


def sample_number(t: Number, period: Number) -> Number:
    """Return the number of the output sample at the time t, s."""
    return floor(t / period + 1e-6)


def word(x: Number, resolution: Number) -> Number:
    """Return x in whole steps of the output word."""
    return resolution * floor(x / resolution + 0.5)
