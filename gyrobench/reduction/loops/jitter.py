"""Jitter: the mean square of an angle in bands of frequency, with its interval, from a record of a random motion.

Welch's estimate: segments of 8 periods of the lowest frequency, Hann's window, half overlapping, each without its mean
and slope.  The mean square of a band is the mean over the segments of what their spectra have in it; its uncertainty
comes from their scatter, neighbours correlated by 1/36 as half-overlapping Hann windows of a noise are.

Not in the interval: how another ride of the same spectrum differs by chance in what is slower than a segment.
Source: Welch 1967; Harris 1978 for the correlation of the overlap (1/6, squared for powers).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.loops.estimator_metrics import UncertainValue

Complex = np.ndarray[Any, np.dtype[np.complex128]]
PERIODS = 8.0  # of the lowest frequency in a segment
FEWEST = 8  # segments
OVERLAP = 1.0 / 36.0  # correlation of the powers of two neighbours


@dataclass(frozen=True)
class Spectra:
    """One-sided spectral densities of the segments of a record.

    f: Hz.  segments: (segments, frequencies), unit squared per Hz.
    """

    f: Array
    segments: Array

    @property
    def mean(self) -> Array:
        """Return Welch's estimate of the density."""
        return np.asarray(self.segments.mean(axis=0))

    def mean_square(self, low: float, high: float = math.inf) -> UncertainValue:
        """Return the mean square from low to below high, Hz."""
        powers = self.segments @ widths(self.f, low, high)
        n = powers.size
        u = float(np.std(powers, ddof=1)) * math.sqrt((1.0 + 2.0 * OVERLAP) / n)
        return UncertainValue(float(powers.mean()), u, n - 1)

    def rms(self, low: float, high: float = math.inf) -> UncertainValue:
        """Return the root mean square from low to below high, Hz."""
        return root(self.mean_square(low, high))

    def together(self, other: Spectra) -> Spectra:
        """Return the spectra of two axes together."""
        return Spectra(self.f, self.segments + other.segments)


def widths(f: Array, low: float, high: float = math.inf) -> Array:
    """Return what each of equidistant lines has of a band, Hz: the part of its interval that is inside.

    A line at the edge counts half: of a spectrum that falls, the lines from the lowest on would be too much otherwise.
    """
    half = 0.5 * float(f[1] - f[0])
    return np.asarray(np.clip(np.minimum(high, f + half) - np.maximum(low, f - half), 0.0, 2.0 * half))


def root(square: UncertainValue) -> UncertainValue:
    """Return the root of a mean square."""
    size = math.sqrt(square.value)
    return UncertainValue(size, square.u / (2.0 * size) if size else 0.0, square.dof)


def samples_of(dt: float, lowest: float) -> int:
    """Return the samples of a segment."""
    return round(PERIODS / (lowest * dt))


def shortest(lowest: float) -> float:
    """Return the shortest record, s, whose jitter from a lowest frequency, Hz, is stated."""
    return 0.5 * (FEWEST + 1) * PERIODS / lowest


def segments(dt: float, y: Array, lowest: float) -> Complex | None:
    """Return the transforms of the windowed segments of a record, (segments, frequencies); None for too few of them.

    Scaled so that the mean of |segment|^2 is the one-sided density from the second line on.
    """
    n = samples_of(dt, lowest)
    starts = range(0, y.size - n + 1, max(1, n // 2))
    if len(starts) < FEWEST:
        return None
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(n) / n)
    line = np.column_stack([np.ones(n), np.arange(n) - 0.5 * (n - 1)])
    rows = []
    for k in starts:
        part = y[k : k + n]
        rows.append(np.fft.rfft(window * (part - line @ np.linalg.lstsq(line, part, rcond=None)[0])))
    return np.asarray(np.array(rows) * math.sqrt(2.0 * dt / float(np.sum(window**2))))


def spectra(dt: float, y: Array, lowest: float) -> Spectra | None:
    """Return the spectra of a record sampled every dt s, down to a lowest frequency, Hz; None for too few segments."""
    found = segments(dt, y, lowest)
    if found is None:
        return None
    return Spectra(np.asarray(np.fft.rfftfreq(samples_of(dt, lowest), dt)), np.abs(found) ** 2)
