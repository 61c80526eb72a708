"""Noise and the matrix function of the integrator; ``packaging/core.h`` repeats them operation by operation."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from gyrobench.component.elementary import log

MASK = (1 << 64) - 1
GAMMA = 0x9E3779B97F4A7C15
ROUNDING = 1e-6  # of the internal step before: a shorter one is the rounding of a master that sums up the time
TAYLOR = 18  # terms of phi1: the first left out is below 1e-17 for a norm of 1/2

MIDDLE = (  # numerator, denominator
    (
        2.5090809287301226727e3,
        3.3430575583588128105e4,
        6.7265770927008700853e4,
        4.5921953931549871457e4,
        1.3731693765509461125e4,
        1.9715909503065514427e3,
        1.3314166789178437745e2,
        3.3871328727963666080e0,
    ),
    (
        5.2264952788528545610e3,
        2.8729085735721942674e4,
        3.9307895800092710610e4,
        2.1213794301586595867e4,
        5.3941960214247511077e3,
        6.8718700749205790830e2,
        4.2313330701600911252e1,
        1.0,
    ),
)
TAIL = (  # numerator, denominator
    (
        7.74545014278341407640e-4,
        2.27238449892691845833e-2,
        2.41780725177450611770e-1,
        1.27045825245236838258e0,
        3.64784832476320460504e0,
        5.76949722146069140550e0,
        4.63033784615654529590e0,
        1.42343711074968357734e0,
    ),
    (
        1.05075007164441684324e-9,
        5.47593808499534494600e-4,
        1.51986665636164571966e-2,
        1.48103976427480074590e-1,
        6.89767334985100004550e-1,
        1.67638483018380384940e0,
        2.05319162663775882187e0,
        1.0,
    ),
)
END = (  # numerator, denominator
    (
        2.01033439929228813265e-7,
        2.71155556874348757815e-5,
        1.24266094738807843860e-3,
        2.65321895265761230930e-2,
        2.96560571828504891230e-1,
        1.78482653991729133580e0,
        5.46378491116411436990e0,
        6.65790464350110377720e0,
    ),
    (
        2.04426310338993978564e-15,
        1.42151175831644588870e-7,
        1.84631831751005468180e-5,
        7.86869131145613259100e-4,
        1.48753612908506148525e-2,
        1.36929880922735805310e-1,
        5.99832206555887937690e-1,
        1.0,
    ),
)


def _mix(z: int) -> int:
    z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & MASK
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & MASK
    return z ^ (z >> 31)


def normal(seed: int, port: int, count: int) -> float:
    """Return a standard normal number that depends on its three arguments alone.

    Counter-based: the SplitMix64 output function over (key + count * gamma), where the key is itself a
    hash of seed and port; then the inverse normal distribution function (Wichura's AS 241).
    """
    key = _mix((_mix((seed + 1) * GAMMA & MASK) + (port + 1) * GAMMA) & MASK)
    z = _mix((key + count * GAMMA) & MASK)
    return quantile(((z >> 11) + 0.5) * 2.0**-53)


@dataclass(frozen=True)
class OnUse:
    """The samples of a noise port of a part (its size, its seed, its internal step), each made where it is read."""

    part: Any
    stream: int
    size: str

    def __getitem__(self, k: int) -> float:
        size = float(getattr(self.part, self.size))
        return size * normal(int(self.part.seed), self.stream + k, self.part._tick) if size != 0.0 else 0.0


def quantile(p: float) -> float:
    """Return the normal quantile of 0 < p < 1, Wichura's AS 241 (PPND16); ``packaging/noise.h`` has the same."""
    q = p - 0.5
    if abs(q) <= 0.425:
        r = 0.180625 - q * q
        return _rational(MIDDLE, r, q)
    below, above = p, 1.0 - p
    r = math.sqrt(-log(below if below < above else above))
    x = _rational(TAIL, r - 1.6, 1.0) if r <= 5.0 else _rational(END, r - 5.0, 1.0)
    return math.copysign(x, q)


def _rational(of: tuple[tuple[float, ...], tuple[float, ...]], r: float, factor: float) -> float:
    """Return factor times a quotient of two polynomials, highest power first."""
    (above, *more), (below, *others) = of
    for c in more:
        above = above * r + c
    for c in others:
        below = below * r + c
    return above * factor / below


def _product(a: list[list[float]], b: list[list[float]]) -> list[list[float]]:
    n = len(a)
    out = [[0.0] * n for _ in range(n)]
    for i in range(n):
        for j in range(n):
            total = 0.0
            for k in range(n):
                total = total + a[i][k] * b[k][j]
            out[i][j] = total
    return out


def phi1(z: list[list[float]]) -> list[list[float]]:
    """Return phi1(z) = sum z^k / (k+1)!  by Taylor on z / 2^s and doubling phi1(2z) = phi1(z) (I + z phi1(z) / 2)."""
    n = len(z)
    norm = max(sum(abs(a) for a in row) for row in z)
    if not norm < 1e300:
        norm = 0.0  # not finite: found by the check of the states
    s = 0
    while norm > 0.5:
        norm = norm * 0.5
        s += 1
    scale = 0.5**s
    z = [[a * scale for a in row] for row in z]
    out = [[1.0 if i == j else 0.0 for j in range(n)] for i in range(n)]
    for k in range(TAYLOR, 1, -1):  # Horner: I + z/2 (I + z/3 (I + ...))
        out = _product(z, out)
        out = [[out[i][j] / k + (1.0 if i == j else 0.0) for j in range(n)] for i in range(n)]
    for _ in range(s):
        g = _product(z, out)
        g = [[0.5 * g[i][j] + (1.0 if i == j else 0.0) for j in range(n)] for i in range(n)]
        out = _product(out, g)
        z = [[2.0 * a for a in row] for row in z]
    return out
