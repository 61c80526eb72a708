"""Quantization of a record, and the aliasing of a sampling interval.

    quantization(x)        step of the converter found in the values, noise over step
    angle_quantization(d)  the same of a cumulative angle, from its increments
    folded(dt, cutoff)     what a sampling interval folds into the record behind a low-pass of that cutoff

Rounding to steps q adds a white error of variance q^2/12 as long as the noise of a sample exceeds about half a step;
below, the error repeats with the signal and no averaging removes it.   [DAQ-DRIFT; Xia 2008, section 3.1.1 with EX6,
EX9]

Of an angle that moves by m + s n steps q from sample to sample, n normal, the rounding is a sawtooth of the angle: its
errors have the correlation (6/pi^2) exp(-2 pi^2 s^2) cos(2 pi m) + ... from one sample to the next, 0.026 at s = 0.4
and 0.18 at s = 0.25, where N and Q are off by more than their intervals say.   [sawtooth's Fourier series, own
derivation]
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.series.checks import SeriesError, checked, checked_step

LOOKED_AT = 100_000  # values the step is found from
FEW, FEW_OFF = 0.01, 0.15  # values over samples, and what their steps may be off the mean one
DITHER = 0.5  # noise of a sample over the step from which on rounding is a white error
ANGLE_DITHER = 0.4  # of the change of an angle within a sample


@dataclass(frozen=True)
class Rounding:
    step: float  # unit; 0: none found
    noise: float  # rms of a sample without the rounding, from successive differences, unit
    dither: float = DITHER  # noise over step from which on rounding is a white error

    @property
    def white(self) -> bool:
        """Return whether rounding acts as a white error."""
        return self.step == 0.0 or self.noise >= self.dither * self.step


def quantization(x: Any) -> Rounding:
    """Return what rounding did to a record (n,)."""
    x = checked(x, 16)
    step = _step(x)
    # two levels in turn at a boundary, whatever makes them, have a variance of q^2/4: q^2/6 without that of rounding
    variance = float(np.mean(np.diff(x[:LOOKED_AT]) ** 2)) / 2.0 - step * step / 12.0
    return Rounding(step, math.sqrt(max(variance, 0.0)))


def angle_quantization(d: Any, step: float = 0.0) -> Rounding:
    """Return what rounding did to an angle of these increments (n,), gaps left out; step: of the angle, 0: is found.

    The difference of two increments has three errors of q^2/12: six times that in all.
    """
    d = checked(d, 16)
    step = step or _step(d)
    variance = float(np.mean(np.diff(d[:LOOKED_AT]) ** 2)) / 2.0 - step * step / 4.0
    return Rounding(step, math.sqrt(max(variance, 0.0)), dither=ANGLE_DITHER)


def _step(x: Array) -> float:
    """Return the step of the values, 0 where there is none."""
    values = np.unique(x[:LOOKED_AT])
    apart = np.diff(values)
    # decimals of a file differ from each other by rounding of the computer
    apart = apart[apart > 1e-9 * (values[-1] - values[0])]
    low = float(np.quantile(apart, 0.05))  # a typical small difference: the mean over its multiples is the step
    times = np.round(apart / low)
    small = (times >= 1.0) & (times <= 20.0)
    step = float(apart[small].sum() / times[small].sum())
    times = np.maximum(np.round(apart / step), 1.0)
    # a few steps are told where the decimals of the file round them in turn: 0.010, 0.019, 0.029
    off = FEW_OFF if values.size < FEW * min(x.size, LOOKED_AT) else 0.01
    regular = bool(np.all(np.abs(apart / step - times) < off * times))
    few = values.size < 0.5 * min(x.size, LOOKED_AT)
    return step if regular and few else 0.0


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
