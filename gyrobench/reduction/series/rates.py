"""Rates from angle readings, what averaging does to them, and their errors.

    from_angles(theta, dt, n)    mean rates over n steps, end to end or overlapping
    fixed_angle(t, step)         mean rates between equally spaced angle marks
    gain(f, dT)                  sinc(f dT), the factor on an oscillation of frequency f; negative for f dT = 1..2

A difference quotient is exactly the mean rate over its interval dT and belongs to its midpoint (truncation
theta''' dT^2/24).  White reading errors s at both ends: sqrt2 s/dT, successive end-to-end rates correlated by -1/2, so
the mean of M of them has sqrt2 s/(M dT), not 1/sqrt M of one.  A gain is divided out of fitted amplitudes, never out of
samples.  [RED-RATE; Hu 1981, eq. 4-1..4-11 with ER1..ER4]
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.series.checks import SeriesError, checked, checked_step

AMBIGUOUS = 0.9  # of half a turn between samples: unwrapping may then be a turn wrong
LEAST_GAIN = 0.1


@dataclass(frozen=True)
class Rates:
    """Mean rates; ``u``: of one, from reading errors; neighbours ``lag`` apart are correlated by -1/2."""

    t: Array  # s, midpoints, from the first reading
    rate: Array  # rad/s
    width: float  # dT, s (mean, for fixed angles)
    u: Array  # rad/s
    lag: int

    def u_mean(self) -> float:
        """Standard uncertainty of the mean of all end-to-end rates: only the outermost readings remain."""
        if self.lag != 1:
            raise SeriesError("the mean of overlapping rates repeats readings; take end-to-end ones")
        return float(np.mean(self.u)) / self.rate.size


def gain(frequency: Any, width: float) -> Array:
    """Return sin(x)/x, x = pi f dT: what a mean over ``width`` s makes of an oscillation of ``frequency`` (Hz)."""
    out: Array = np.sinc(np.asarray(frequency, dtype=float) * checked_step(width))
    return out


def corrected_amplitude(amplitude: float, frequency: float, width: float) -> float:
    """Divide the gain out of a fitted amplitude; refuses a gain below a tenth."""
    factor = float(gain(frequency, width))
    if abs(factor) < LEAST_GAIN:
        raise SeriesError(
            f"means over {width:.4g} s leave {factor:.3g} of an oscillation at {frequency:.4g} Hz; shorten the interval"
        )
    return amplitude / factor


def from_angles(theta: Any, dt: float, n: int = 1, overlapping: bool = False, u_angle: float = 0.0) -> Rates:
    """Return mean rates over ``n`` steps of angle readings (rad, wrapped or not) taken every ``dt`` s.

    overlapping: one rate a step, neighbours share n - 1 of n steps and rates n steps apart are correlated by -1/2.
    Raises SeriesError for n < 1, fewer than n + 1 readings, and readings so far apart that a turn may be lost.
    """
    if n < 1:
        raise SeriesError(f"rates over {n} steps: at least 1 is needed")
    theta, dt = checked(theta, n + 1, "angles"), checked_step(dt)
    step = (np.diff(theta) + math.pi) % (2.0 * math.pi) - math.pi
    largest = float(np.abs(step).max())
    if largest > AMBIGUOUS * math.pi:
        raise SeriesError(
            f"angles: {math.degrees(largest):.4g} deg between two readings; the number of turns is not certain, "
            "sample faster"
        )
    whole = np.concatenate([[0.0], np.cumsum(step)])
    first = np.arange(0, whole.size - n, 1 if overlapping else n)
    rate = (whole[first + n] - whole[first]) / (n * dt)
    u = np.full(rate.size, math.sqrt(2.0) * u_angle / (n * dt))
    return Rates(np.asarray((first + n / 2.0) * dt), rate, n * dt, u, n if overlapping else 1)


def fixed_angle(t: Any, step: float, u_time: float = 0.0, u_mark: float = 0.0) -> Rates:
    """Return mean rates between marks ``step`` (rad) apart that were passed at the times ``t`` (s, increasing).

    u_mark: of one mark, rad.  Equal angles weigh slow stretches less: their mean is the harmonic mean of the rate, low
    by half the squared relative variation.  Raises SeriesError for a rate that changes its sign.
    """
    t = checked(t, 2, "times of the marks")
    if not (math.isfinite(step) and step != 0.0):
        raise SeriesError(f"angle between marks {step}: it must be finite and not zero")
    width = np.diff(t)
    if np.any(width <= 0.0):
        k = int(np.flatnonzero(width <= 0.0)[0])
        raise SeriesError(f"times of the marks: mark {k + 2} is not later than mark {k + 1}; a rate that turns round "
                          "needs angles at equal times")  # fmt: skip
    rate = step / width
    u = math.sqrt(2.0) * np.hypot(rate * u_time, u_mark) / width
    return Rates((t[1:] + t[:-1]) / 2.0 - t[0], rate, float(width.mean()), u, 1)
