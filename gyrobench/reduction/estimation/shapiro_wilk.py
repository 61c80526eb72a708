"""Shapiro-Wilk test of normality, 3 to 5000 values, by Royston's approximations.  [Royston 1995]

    W = (sum a_i x_(i))^2 / sum (x_i - mean)^2

x_(i): values in order; a: the expected normal order statistics m_i = z((i - 3/8)/(n + 1/4)) over their length, the
outer one (of n > 5: two) on each side by a polynomial in 1/sqrt(n).  A function of ln(1 - W) is normal, its mean and
standard deviation polynomials in n (up to 11) or ln n; of three values the distribution is known.

SciPy has the test, too, with normal quantiles of seven digits; its module of statistics takes half a second to load.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy import special

Array = NDArray[np.float64]
#: coefficients of powers 0, 1, ... of 1/sqrt(n): what the two outer coefficients are above m_i over its length
OUTERMOST = (0.0, 0.221157, -0.147981, -2.071190, 4.434685, -2.706056)
NEXT = (0.0, 0.042981, -0.293762, -1.752461, 5.682633, -3.582633)
#: of n up to 11: gamma, mean and logarithm of the standard deviation of -ln(gamma - ln(1 - W))
FEW = 11
GAMMA = (-2.273, 0.459)
MEAN_OF_FEW = (0.5440, -0.39978, 0.025054, -6.714e-4)
SPREAD_OF_FEW = (1.3822, -0.77857, 0.062767, -0.0020322)
#: of larger n, in ln n: of ln(1 - W)
MEAN = (-1.5861, -0.31082, -0.083751, 0.0038915)
SPREAD = (-0.4803, -0.082676, 0.0030302)


def shapiro_wilk(x: Array) -> tuple[float, float]:
    """Return W and the probability of one so small, of values x (n,) that are normal; 1, 1 if all are alike."""
    n, x = x.size, np.sort(x)
    if n < 3 or x[0] == x[-1]:
        return 1.0, 1.0
    d = x - np.mean(x)
    square = float(d @ d)
    w = min(float(_coefficients(n) @ d) ** 2 / square, 1.0)
    if n == 3:
        p = 6.0 / math.pi * (math.asin(math.sqrt(w)) - math.asin(math.sqrt(0.75)))
        return w, min(max(p, 0.0), 1.0)
    if w == 1.0:
        return 1.0, 1.0
    y = math.log(1.0 - w)
    if n > FEW:
        z = (y - _power_series(MEAN, math.log(n))) / math.exp(_power_series(SPREAD, math.log(n)))
    elif y >= (gamma := _power_series(GAMMA, n)):
        return w, 0.0
    else:
        z = (-math.log(gamma - y) - _power_series(MEAN_OF_FEW, n)) / math.exp(_power_series(SPREAD_OF_FEW, n))
    return w, float(special.ndtr(-z))


def _coefficients(n: int) -> Array:
    """a (n,), of length 1."""
    if n == 3:
        return np.array([-math.sqrt(0.5), 0.0, math.sqrt(0.5)])
    m = special.ndtri((np.arange(1, n + 1) - 0.375) / (n + 0.25))
    square = float(m @ m)
    known = (OUTERMOST, NEXT) if n > 5 else (OUTERMOST,)
    ends = [_power_series(c, 1.0 / math.sqrt(n)) + m[-1 - k] / math.sqrt(square) for k, c in enumerate(known)]
    rest = (square - 2.0 * sum(m[-1 - k] ** 2 for k in range(len(ends)))) / (1.0 - 2.0 * sum(e * e for e in ends))
    a: Array = m / math.sqrt(rest)
    for k, end in enumerate(ends):
        a[k], a[-1 - k] = -end, end
    return a


def _power_series(coefficients: tuple[float, ...], x: float) -> float:
    return float(np.polynomial.polynomial.polyval(x, coefficients))
