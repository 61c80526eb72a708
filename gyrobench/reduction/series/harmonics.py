"""Harmonics of a rate over the table angle: equal steps by sums, any angles by least squares, with uncertainties.

    y = a_0 + sum_r (a_r cos r theta + b_r sin r theta) = a_0 + sum_r C_r sin(r theta + phi_r)
    C_r = hypot(a_r, b_r),  phi_r = atan2(a_r, b_r)

At n equal steps a_r, b_r have the variance 2 s^2/n, a_0 and a_{n/2} s^2/n, all uncorrelated; b_{n/2} is not observable.
Harmonics k n +- r are indistinguishable from r.  Samples at equal times on a table whose rate varies stand at unequal
angles: sums would be wrong (rate 1 + 0.2 cos + 0.05 sin 2: a_0 by 2.2 %), least squares on the angle are right.
[RED-HARMONIC; Hu 1981, eq. 4-12..4-22 with ER5..ER10]
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.drift import harmonic
from gyrobench.reduction.series.checks import SeriesError, checked


@dataclass(frozen=True)
class Harmonics:
    """Arrays over the orders 0..l; b[0] = 0, and b[n/2] is NaN."""

    a: Array
    b: Array
    u_a: Array
    u_b: Array
    s: float  # standard deviation of one value about the harmonics; NaN without degrees of freedom
    dof: int

    @property
    def amplitude(self) -> Array:
        out: Array = np.hypot(self.a, self.b)
        return out

    @property
    def phase(self) -> Array:
        """phi_r, rad."""
        out: Array = np.arctan2(self.a, self.b)
        return out


def equal_steps(y: Any, order: int) -> Harmonics:
    """Return harmonics 0..``order`` of values (n,) at theta_m = 2 pi m/n of one turn; refuses order > n/2."""
    y = checked(y, 2, "rates over a turn")
    n = y.size
    if order < 0 or 2 * order > n:
        raise SeriesError(f"harmonic {order} of {n} steps a turn: {n // 2} is the highest; higher ones alias into it")
    F = np.fft.rfft(y)[: order + 1]
    a, b = 2.0 * F.real / n, -2.0 * F.imag / n
    a[0] /= 2.0
    half = 2 * order == n
    share = np.full(order + 1, 2.0 / n)
    share[0] = 1.0 / n
    if half:
        a[-1] /= 2.0
        share[-1] = 1.0 / n
    dof = n - (2 * order + 1) + int(half)
    r = np.arange(order + 1)
    turn = 2.0 * math.pi * np.outer(np.arange(n), r) / n
    rest = y - np.cos(turn) @ a - np.sin(turn) @ b
    s = math.sqrt(float(rest @ rest) / dof) if dof > 0 else math.nan
    u = s * np.sqrt(share)
    u_b = np.where(r == 0, 0.0, u)
    if half:
        b[-1], u_b[-1] = math.nan, math.nan
    return Harmonics(a, b, u, u_b, s, dof)


def over_angle(theta: Any, y: Any, order: int) -> Harmonics:
    """Return harmonics 0..``order`` of values (n,) at any angles ``theta`` (rad) by least squares, white noise.

    Raises RegressionError for too few values and angles that do not cover the circle.
    """
    theta = checked(theta, 2, "angles")
    fit = harmonic.fit(theta, theta, checked(y, 2, "rates"), order)
    place = {name: k for k, name in enumerate(fit.names)}
    r = range(order + 1)
    columns = [[place.get(f"{letter}{k}", -1) for k in r] for letter in "AB"]
    value, u = np.append(fit.beta, 0.0), np.append(fit.u, 0.0)
    (a, b), (u_a, u_b) = ([v[np.array(c)] for c in columns] for v in (value, u))
    return Harmonics(a, b, u_a, u_b, fit.s, fit.dof)


def over_turns(y: Any, order: int) -> tuple[Harmonics, Harmonics]:
    """Return the mean harmonics of L turns of ``y`` (L, n) at equal steps, and the spread of one turn.

    Spread: standard deviation with divisor L - 1 (in ``u_a``, ``u_b``, and 1/sqrt L of it in those of the mean), which
    holds for turns whose noise is independent.
    """
    y = np.asarray(y, dtype=float)
    if y.ndim != 2 or y.shape[0] < 2:
        raise SeriesError("rates over turns: an array (turns, steps) of at least 2 turns is needed")
    each = [equal_steps(row, order) for row in y]
    a, b = np.array([h.a for h in each]), np.array([h.b for h in each])
    sa, sb = a.std(axis=0, ddof=1), b.std(axis=0, ddof=1)
    root, dof = math.sqrt(len(each)), len(each) - 1
    mean_a, mean_b = a.mean(axis=0), b.mean(axis=0)
    return Harmonics(mean_a, mean_b, sa / root, sb / root, math.nan, dof), Harmonics(
        mean_a, mean_b, sa, sb, math.nan, dof
    )
