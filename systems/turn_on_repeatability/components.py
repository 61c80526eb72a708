"""Components of variance of biases: between turn-ons and between days, with intervals that hold.

    b = mean + slope (T - mean T) + d_day + o + e          d, o normal with the rms that are sought, e known covariance

Of n turn-ons on D days, r are the n - D differences within days (one less with a temperature), orthonormal, V their
part of the covariance of e; S_day = sum n_d (mean of day - mean)2 with D - 1.  The generalized pivotal quantities of
unbalanced one-way designs (Weerahandi 1993) with n_0 = (n - sum n_d2/n)/(D - 1):

    r' (on2 + V)^-1 r = C_1,     day2 = (S_day/C_2 - on2 - v)/n_0        C: chi-squared by chance, v: variance of a bias

V is not that of equal, independent noises where the biases share the error of a scale factor, by their sense.  Negative
ones count as 0.  Estimates are those with the degrees of freedom in place of C.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.result import Coefficient
from gyrobench.units import DPH

DRAWS, POINTS = 20_000, 4000
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
    """Return the components of biases (n,) on days (n,) with the covariance (n, n) of their noise."""
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
    apart = float(noise.sum() - np.trace(noise)) / (n * (n - 1))
    v = max(float(np.trace(noise)) / n - apart, 0.0)
    rng = np.random.default_rng(1)
    mean = _of_days(bias, number, D)
    if dof < 1:
        return Spread(None, None, slope)
    within = np.linalg.svd(X)[0][:, X.shape[1] :]
    on_2 = _pivot(within.T @ bias, within.T @ noise @ within, np.append(rng.chisquare(dof, DRAWS), dof))
    on = _component(float(on_2[-1]), on_2[:-1], dof)
    if D < 2:
        return Spread(on, None, slope)
    count = np.bincount(number)
    n_0 = (n - float(np.sum(count**2)) / n) / (D - 1)
    s_day = float(np.sum(count * (mean - float(bias.mean())) ** 2))
    drawn = (s_day / rng.chisquare(D - 1, DRAWS) - on_2[:-1] - v) / n_0
    return Spread(on, _component((s_day / (D - 1) - float(on_2[-1]) - v) / n_0, drawn, D - 1), slope)


def _pivot(r: Array, V: Array, chi: Array) -> Array:
    """Return the on2 at which r' (on2 + V)^-1 r is each of chi; it falls from the pole at less the least of V."""
    variance, axes = np.linalg.eigh(V)
    squares, above = (axes.T @ r) ** 2, variance - variance[0]
    total = max(float(squares.sum()), 1e-300)
    x = np.geomspace(1e-12, 1e6, POINTS) * (total / r.size + float(above[-1]))
    falling = np.log(np.maximum((squares / (x[:, None] + above)).sum(axis=1), 1e-300))
    out: Array = np.exp(np.interp(-np.log(chi), -falling, np.log(x))) - variance[0]
    return out


def _of_days(x: Array, number: Numbers, D: int) -> Array:
    out: Array = np.bincount(number, weights=x, minlength=D) / np.bincount(number, minlength=D)
    return out


def _component(value: float, drawn: Array, dof: int) -> VarianceComponent:
    low, high = np.sqrt(np.maximum(np.quantile(drawn, [0.025, 0.975]), 0.0)).tolist()
    return VarianceComponent(math.sqrt(max(value, 0.0)), low, high, dof)


def coefficient(name: str, meaning: str, part: VarianceComponent, truth: float | None) -> Coefficient:
    """Return the component, SI, as it is reported; truth: SI."""
    low, high = part.low / DPH, part.high / DPH
    shown = None if truth is None else truth / DPH
    return Coefficient(name, meaning, "°/h", part.rms / DPH, (high - low) / (2.0 * NORMAL), NORMAL, (low, high),
                       truth=shown)  # fmt: skip
