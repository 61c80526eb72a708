"""Samples that are averaged into windows: noise that may have folded into them, words that no noise averages out, a
converter at the end of its range.

Point samples of a current that a fast loop moves hold noise from beyond half the sampling rate.  They are independent:
their spectrum is flat to half that rate.  Means between two samples, or samples behind a low-pass filter, fall off
before it or are of opposite sign in turn.  The ratio

    E (x[k+2] - x[k])^2 / E (x[k+1] - x[k])^2    1: independent;  4: a slope;  2/3: differences of independent readings

hardly depends on a slow change of the signal.  Means of white noise are independent too: what the samples are must be
stated, this says only that they may be the wrong ones.

Rounding to words q leaves a mean of readings with the noise s off by the sawtooth of its place between two words,

    the rms of which is q sqrt(sum over k of exp(-(2 pi k s/q)^2)/(2 (pi k)^2))

however many readings there are: nothing at q = s, 0.07 s at 3 s, q/sqrt(12) without noise.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from gyrobench import units
from gyrobench.arrays import Array
from gyrobench.record.range_ends import RangeEnds

LEAST = 200  # samples, below which nothing is said
CHANGES = 10  # samples that differ from the one before, below which they have no words
HARMONICS = 50  # of the sawtooth of rounding
FLAT = 0.1  # from 1, of the ratio


@dataclass
class Successive:
    """Sums over successive samples."""

    count: int = 0
    first: float = 0.0  # of squares of differences of neighbours
    second: float = 0.0  # of those one apart
    word: float = math.inf  # least difference of neighbours that is not 0
    changes: int = 0  # neighbours that differ
    ends: RangeEnds = field(default_factory=RangeEnds)

    def add(self, x: Array) -> None:
        """Take the samples of a stretch without gaps."""
        change = np.abs(np.diff(x))
        if (change := change[change > 0.0]).size:
            self.word, self.changes = min(self.word, float(np.min(change))), self.changes + change.size
        if x.size:
            self.ends.add(x)
        if x.size > 2:
            self.count += x.size - 2
            self.first += float(np.sum(np.diff(x[:-1]) ** 2))
            self.second += float(np.sum((x[2:] - x[:-2]) ** 2))

    @property
    def scatter(self) -> float:
        """Return the standard deviation of independent samples."""
        return math.sqrt(self.first / (2.0 * self.count)) if self.count else 0.0

    @property
    def independent(self) -> bool:
        """Return whether the spectrum is flat to half the sampling rate; the ratio scatters by 1.6/sqrt(count)."""
        if self.count < LEAST or not self.first:
            return False
        return abs(self.second / self.first - 1.0) < max(FLAT, 5.0 / math.sqrt(self.count))

    @property
    def rounding(self) -> float:
        """Return the rms error of a mean by rounding that the noise does not average out; 0 where that is less than the
        standard deviation of the mean of all samples.
        """
        if self.count < LEAST or self.changes < CHANGES:
            return 0.0
        q, k = self.word, np.arange(1, HARMONICS)
        noise = math.sqrt(max(self.scatter**2 - q * q / 12.0, 0.0))
        sawtooth = np.exp(-((2.0 * math.pi * k * noise / q) ** 2)) / (2.0 * (math.pi * k) ** 2)
        off = q * math.sqrt(float(np.sum(sawtooth)))
        return off if off > self.scatter / math.sqrt(self.count) else 0.0


def stated(comments: Mapping[str, str]) -> tuple[str, float]:
    """Return what a record says of its samples: "means", "points" or "", and the bandwidth of the signal, Hz (0: none).

    Raises ValueError for something else.
    """
    kind = comments.get("samples", "")
    if kind not in ("", "means", "points"):
        raise ValueError(f"samples = {kind}: must be 'means' (between two samples) or 'points'")
    try:
        bandwidth = units.parse_quantity(comments["bandwidth"], "Hz") if "bandwidth" in comments else 0.0
    except units.UnitError as error:
        raise ValueError(f"bandwidth = {comments['bandwidth']}: {error}") from None
    return kind, bandwidth


def warning(signal: str, unit: str, step: float, seen: Successive, kind: str, bandwidth: float) -> str:
    """Return the warning of samples at this step (s) that may be aliased; "" where they are not."""
    if kind == "means" or not step:
        return ""
    rate, scatter = 1.0 / step, seen.scatter / units.factor(unit)
    size = f"The samples scatter by {scatter:.2g} {units.display(unit)}, independent of one another."
    consequence = "a window is then noisier than a mean would be, and what is periodic may fold to a constant error."
    remedy = "Log the mean between two samples (an integrating meter; '# samples = means')"
    if bandwidth:
        if rate >= 2.0 * bandwidth:
            return ""
        return (
            f"Point samples of {signal} at {rate:.3g} Hz alias: the signal reaches to {bandwidth:.3g} Hz, and what is "
            f"above {rate / 2.0:.3g} Hz folds into the windows; {consequence} {remedy}, take {2.0 * bandwidth:.3g} Hz "
            f"or more, or put a low-pass filter below {rate / 2.0:.3g} Hz before the meter."
        )
    if not seen.independent:
        return ""
    return (
        f"Samples of {signal} may be aliased: their spectrum is flat to half the sampling rate of {rate:.3g} Hz, as "
        f"that of point samples of a faster loop. {size} If they are points, {consequence} {remedy}, or state the "
        "bandwidth of the loop or filter ('# bandwidth = 14Hz'): twice that is enough as a sampling rate."
    )


def coarse(signal: str, unit: str, seen: Successive) -> str:
    """Return the warning of samples in words that their noise does not average out; "" of others."""
    if not (off := seen.rounding):
        return ""
    word, rms = (f"{x / units.factor(unit):.{n}g} {units.display(unit)}" for x, n in ((seen.word, 3), (off, 2)))
    return (
        f"Samples of {signal} are rounded to {word}, more than their noise averages out: means are off by {rms} rms, "
        "alike while the signal is, and no uncertainty holds that. Read them in finer words, or with more noise."
    )


def ended(signal: str, seen: Successive) -> str:
    """Return the warning of samples at the end of a range; "" where there are none, or words or the lack of noise make
    the values few.
    """
    if seen.rounding or 2 * seen.changes < seen.count or not (at := seen.ends.limited(seen.count)):
        return ""
    return (
        f"{at} samples of {signal} are at the end of its range, where a converter was at its limit: their means are "
        "wrong, and no uncertainty holds that. Take a larger range."
    )
