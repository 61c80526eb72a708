"""Components of variance of biases: between turn-ons and between days, with intervals that hold.

    b = mean + slope (T - mean T) + d_day + o + e          d, o normal with the rms that are sought, e known variance

Of n turn-ons on D days, their means and least squares within days, S_on = sum (b - mean of its day)2 with n - D degrees
of freedom (one less with a temperature), S_day = sum n_d (mean of day - mean)2 with D - 1.  The generalized pivotal
quantities of unbalanced one-way designs (Weerahandi 1993) with n_0 = (n - sum n_d2/n)/(D - 1):

    on2 = S_on/C_1 - v,     day2 = (S_day/C_2 - S_on/C_1)/n_0          C: chi-squared by chance, v: variance of a bias

negative ones count as 0.  Estimates are those with the degrees of freedom in place of C.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from gyrobench.arrays import Array

DRAWS = 20_000
Numbers = np.ndarray[Any, np.dtype[np.intp]]  # of the day of each bias, from 0


@dataclass(frozen=True)
class VarianceComponent:
    """rms and 95 % interval, in the unit of the biases; degrees of freedom."""

    rms: float
    low: float
    high: float
    dof: int


@dataclass(frozen=True)
class Spread:
    """Components of n biases; None where the record does not show them.  slope, u: per kelvin."""

    turn_on: VarianceComponent | None
    day: VarianceComponent | None
    slope: tuple[float, float] | None = None


def spread(bias: Array, day: Array, noise: Array, temperature: Array | None = None) -> Spread:
    """Return the components of biases (n,) on days (n,) with variances (n,) of their noise."""
    days, number = np.unique(day, return_inverse=True)
    n, D = bias.size, days.size
    X = np.zeros((n, D))
    X[np.arange(n), number] = 1.0
    slope = None
    if temperature is not None and n > D + 2 and np.ptp(temperature) > 0.0:
        T = temperature - temperature.mean()
        within = T - _of_days(T, number, D)[number]
        if np.any(np.abs(within) > 1e-9):
            k = float(within @ bias / (within @ within))
            bias = bias - k * T
            X = np.column_stack([X, T])
            left = bias - _of_days(bias, number, D)[number]
            slope = (k, math.sqrt(float(left @ left) / (n - D - 1) / float(within @ within)))
    dof = n - X.shape[1]
    v = float(noise.mean())
    rng = np.random.default_rng(1)
    mean = _of_days(bias, number, D)
    s_on = float(np.sum((bias - mean[number]) ** 2))
    if dof < 1:
        return Spread(None, None, slope)
    chi_on = rng.chisquare(dof, DRAWS)
    on = _component(s_on / dof - v, s_on / chi_on - v, dof)
    if D < 2:
        return Spread(on, None, slope)
    count = np.bincount(number)
    n_0 = (n - float(np.sum(count**2)) / n) / (D - 1)
    s_day = float(np.sum(count * (mean - float(bias.mean())) ** 2))
    drawn = (s_day / rng.chisquare(D - 1, DRAWS) - s_on / chi_on) / n_0
    return Spread(on, _component((s_day / (D - 1) - s_on / dof) / n_0, drawn, D - 1), slope)


def _of_days(x: Array, number: Numbers, D: int) -> Array:
    out: Array = np.bincount(number, weights=x, minlength=D) / np.bincount(number, minlength=D)
    return out


def _component(value: float, drawn: Array, dof: int) -> VarianceComponent:
    low, high = np.sqrt(np.maximum(np.quantile(drawn, [0.025, 0.975]), 0.0)).tolist()
    return VarianceComponent(math.sqrt(max(value, 0.0)), low, high, dof)
