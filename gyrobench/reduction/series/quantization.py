"""Quantization and range of a record, and the aliasing of a sampling interval.

    quantization(x)        step of the converter found in the values, noise over step, values at the ends of the range
    folded(dt, cutoff)     what a sampling interval folds into the record behind a low-pass of that cutoff

Rounding to steps q adds a white error of variance q^2/12 as long as the noise of a sample exceeds about half a step;
below, the error repeats with the signal and no averaging removes it.   [DAQ-DRIFT; Xia 2008, section 3.1.1 with EX6,
EX9]
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from gyrobench.reduction.series.checks import SeriesError, checked, checked_step

LOOKED_AT = 100_000  # values the step is found from
DITHER = 0.5  # noise of a sample over the step from which on rounding is a white error
SATURATED = 3  # equal values in a row at an end of the range


@dataclass(frozen=True)
class Quantization:
    step: float  # unit; 0: none found
    noise: float  # rms of a sample without the rounding, from successive differences, unit
    saturated: float  # share of values in rows of three or more at the lowest or highest value

    @property
    def error(self) -> float:
        """Standard deviation of the rounding, q/sqrt 12."""
        return self.step / math.sqrt(12.0)

    @property
    def white(self) -> bool:
        """Whether rounding acts as a white error."""
        return self.step == 0.0 or self.noise >= DITHER * self.step


def quantization(x: Any) -> Quantization:
    """Return what rounding and the range of a converter did to a record (n,)."""
    x = checked(x, 16)
    values = np.unique(x[:LOOKED_AT])
    apart = np.diff(values)
    # decimals of a file differ from each other by rounding of the computer
    apart = apart[apart > 1e-9 * (values[-1] - values[0])]
    low = float(np.quantile(apart, 0.05))  # a typical small difference: the mean over its multiples is the step
    times = np.round(apart / low)
    small = (times >= 1.0) & (times <= 20.0)
    step = float(apart[small].sum() / times[small].sum())
    times = np.maximum(np.round(apart / step), 1.0)
    regular = bool(np.all(np.abs(apart / step - times) < 0.01 * times))
    few = values.size < 0.5 * min(x.size, LOOKED_AT)
    if not (regular and few):
        step = 0.0
    # two levels in turn at a boundary, whatever makes them, have a variance of q^2/4: q^2/6 without that of rounding
    variance = float(np.mean(np.diff(x[:LOOKED_AT]) ** 2)) / 2.0 - step * step / 12.0
    at_end = (x == x.max()) | (x == x.min())
    edges = np.flatnonzero(np.diff(np.concatenate([[False], at_end, [False]]).astype(int)))
    rows = edges[1::2] - edges[::2]
    saturated = float(rows[rows >= SATURATED].sum()) / x.size if few and values.size > 8 else 0.0
    return Quantization(step, math.sqrt(max(variance, 0.0)), saturated)


@dataclass(frozen=True)
class Folding:
    longest: float  # s, sampling interval of the rule 1/(2.5 f_c)
    ratio: float  # white variance of the samples over that behind a low-pass that suits the interval, 1/(2.5 dt)

    @property
    def decibels(self) -> float:
        return 10.0 * math.log10(self.ratio)


def folded(dt: float, cutoff: float) -> Folding:
    """Return what samples every ``dt`` s of a signal behind a first-order low-pass of ``cutoff`` (Hz) fold in."""
    dt = checked_step(dt)
    if not (math.isfinite(cutoff) and cutoff > 0.0):
        raise SeriesError(f"cutoff {cutoff} Hz: it must be finite and positive")
    longest = 1.0 / (2.5 * cutoff)
    return Folding(longest, max(dt / longest, 1.0))
