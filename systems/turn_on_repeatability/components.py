"""Components of variance of biases: between turn-ons and between days, with intervals that hold.

    b = mean + slope (T - mean T) + d_day + o + e          d, o normal with the rms that are sought, e known covariance

Of n turn-ons on D days, r are the n - D differences within days (one less with a temperature), orthonormal, V their
part of the covariance of e; S_day = sum n_d (mean of day - mean)2 with D - 1.  The generalized pivotal quantities of
unbalanced one-way designs (Weerahandi 1993) with n_0 = (n - sum n_d2/n)/(D - 1):

    r' (on2 + V)^-1 r = C_1,     day2 = (S_day/C_2 - on2 - v)/n_0        C: chi-squared by chance, v: variance of a bias

V is not that of equal, independent noises where the biases share the error of a scale factor, by their sense.  Each
noise model that the record allows has its own V, from which on2 is drawn by its weight: their mean, of some models with
slow drift that moves a bias by more than the biases differ, held sigma_on in 0.925.  Negative ones count as 0; the
upper end is that of the others, or of biases without noise where these are hardly any: it is not 0.  Estimates are
those with the degrees of freedom in place of C, the median over the noise models.
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
SEEN = 100  # draws above 0 of which the upper end is taken
ALONE = np.ones(1)
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


def spread(
    bias: Array, day: Array, noise: Array, temperature: Array | None = None, weight: Array = ALONE
) -> Spread:  # fmt: skip
    """Return the components of biases (n,) on days (n,) with the covariance (n, n) of their noise; or of biases (g, n)
    and covariances (g, n, n) under noise models of this weight (g,).
    """
    n, days, number = day.size, *np.unique(day, return_inverse=True)
    bias, noise, D = bias.reshape(-1, n), noise.reshape(-1, n, n), days.size
    X = np.zeros((n, D))
    X[np.arange(n), number] = 1.0
    slope = None
    if temperature is not None and n > D + 2 and np.ptp(temperature) > 0.0:
        T = temperature - temperature.mean()
        within = T - _of_days(T, number, D)[number]
        if np.any(np.abs(within) > 1e-9):
            k = bias @ within / (within @ within)
            bias = bias - np.outer(k, T)
            X = np.column_stack([X, T])
            mean = weight @ bias
            left = mean - _of_days(mean, number, D)[number]
            slope = (float(weight @ k), math.sqrt(float(left @ left) / (n - D - 1) / float(within @ within)))
    dof = n - X.shape[1]
    if dof < 1:
        return Spread(None, None, slope)
    rng = np.random.default_rng(1)
    within = np.linalg.svd(X)[0][:, X.shape[1] :]
    count = np.bincount(number)
    n_0 = max((n - float(np.sum(count**2)) / n) / max(D - 1, 1), 1.0)
    drawn, own = [], []
    for k, draws in enumerate(rng.multinomial(DRAWS, weight)):
        if draws:
            diagonal = float(np.trace(noise[k]))
            v = max((n * diagonal - float(noise[k].sum())) / (n * (n - 1)), 0.0)
            C_1, C_2 = (np.append(rng.chisquare(d, draws), d) for d in (dof, max(D - 1, 1)))
            r = within.T @ bias[k]
            on_2 = _pivot(r, within.T @ noise[k] @ within, C_1)
            s_day = float(np.sum(count * (_of_days(bias[k], number, D) - float(bias[k].mean())) ** 2))
            each = np.array([on_2, (s_day / C_2 - on_2 - v) / n_0, r @ r / C_1, s_day / C_2 / n_0])
            drawn.append(each[:, :-1])
            own.append(np.tile(each[:2, -1:], draws))
    value, of_all = np.median(np.concatenate(own, axis=1), axis=1), np.concatenate(drawn, axis=1)
    on, between = (_component(float(value[k]), of_all[k::2], d) for k, d in enumerate((dof, D - 1)))
    return Spread(on, between if D > 1 else None, slope)


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
    """Return the component; drawn (2, m): its variances, and what they would be without noise of the biases."""
    above = drawn[0][drawn[0] > 0.0]
    low, high = np.quantile(drawn[0], 0.025), np.quantile(above if above.size > SEEN else drawn[1], 0.975)
    return VarianceComponent(math.sqrt(max(value, 0.0)), math.sqrt(max(low, 0.0)), math.sqrt(high), dof)


def coefficient(name: str, meaning: str, part: VarianceComponent, truth: float | None) -> Coefficient:
    """Return the component, SI, as it is reported; truth: SI."""
    low, high = part.low / DPH, part.high / DPH
    shown = None if truth is None else truth / DPH
    return Coefficient(name, meaning, "°/h", part.rms / DPH, (high - low) / (2.0 * NORMAL), NORMAL, (low, high),
                       truth=shown)  # fmt: skip
