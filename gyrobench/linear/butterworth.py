"""The low-pass of second order that sensors and their increments have: its gain in closed form."""

from __future__ import annotations

import cmath
import math


def butterworth_gain(f: float, bandwidth: float, step: float) -> complex:
    """Return the gain at f (Hz) of a Butterworth filter of second order; bandwidth: Hz, 0: none.

    step: s, of samples whose input is held over the step before them; 0: continuous.
    """
    if not bandwidth:
        return 1.0
    w, wn = 2.0 * math.pi * f, 2.0 * math.pi * bandwidth
    if not step:
        x = w / wn
        return 1.0 / (1.0 - x * x + 1j * math.sqrt(2.0) * x)  # no power: it may exceed the numbers
    p, z = wn * cmath.exp(0.75j * math.pi), cmath.exp(1j * w * step)  # y = 1 + (p* e^(p t) - p e^(p* t))/(p - p*)
    q = p.conjugate()
    a, b = cmath.exp(p * step), cmath.exp(q * step)
    return z * (q * (a - 1.0) / (z - a) - p * (b - 1.0) / (z - b)) / (p - q)
