"""Power spectral density with a confidence interval, from the record's length to half the sampling rate.

One Hann-tapered periodogram of the whole record (straight line removed), averaged over bins of equal logarithmic width,
at the geometric mean of each bin.  Neighbouring values of a tapered periodogram are correlated (their powers by 4/9 and
1/36), so an average of m of them has

    nu = 2 m/(1 + 2 (1 - 1/m) 4/9 + 2 (1 - 2/m) 1/36)

degrees of freedom: S nu/S_true is chi-squared.  Lines must be removed before: they widen over their bin.
One-sided: the integral over 0..1/(2 dt) is the variance.  [RED-ACF; Hu 1981, eq. 4-23..4-27]
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import fft, special

from gyrobench.arrays import Array
from gyrobench.reduction.series.checks import checked, checked_step

PER_DECADE = 10  # bins
FIRST = 3  # bin: below it, the straight line has taken its share


@dataclass(frozen=True)
class Spectrum:
    """Arrays over frequency bins; one-sided density, unit^2/Hz, and its 95 % interval."""

    frequency: Array  # Hz
    density: Array
    low: Array
    high: Array


def spectrum(x: Any, dt: float) -> Spectrum:
    """Return the density of ``x`` (n,) sampled every ``dt`` s."""
    x, dt = checked(x, 64), checked_step(dt)
    n = x.size
    t = (np.arange(n) - (n - 1) / 2.0) / n
    taper = 0.5 + 0.5 * np.cos(2.0 * np.pi * t)
    y = (x - x.mean() - t * (12.0 * float(t @ x) / n)) * taper
    power = np.abs(fft.rfft(y)) ** 2
    power *= 2.0 * dt / float(taper @ taper)
    last = power.size - 1 - (n % 2 == 0)  # the highest of an even n has one degree of freedom
    edges = FIRST * 10.0 ** (np.arange(1 + int(np.ceil(PER_DECADE * np.log10(last / FIRST)))) / PER_DECADE)
    index = np.unique(np.append(np.minimum(np.ceil(edges).astype(int), last + 1), last + 1))
    m = np.diff(index).astype(float)
    sums = np.add.reduceat(power[: last + 1], index[:-1])
    density = sums / m
    frequency = np.sqrt((index[:-1] - 0.5) * (index[1:] - 0.5)) / (n * dt)
    dof = 2.0 * m / (1.0 + 2.0 * (1.0 - 1.0 / m) * 4.0 / 9.0 + 2.0 * np.maximum(1.0 - 2.0 / m, 0.0) / 36.0)
    low, high = density * dof / special.chdtri(dof, 0.025), density * dof / special.chdtri(dof, 0.975)
    return Spectrum(frequency, density, low, high)
