"""Noise and the matrix function of the integrator; ``packaging/core.h`` repeats them operation by operation."""

from __future__ import annotations

from statistics import NormalDist

MASK = (1 << 64) - 1
GAMMA = 0x9E3779B97F4A7C15
ROUNDING = 1e-6  # of the internal step before: a shorter one is the rounding of a master that sums up the time
TAYLOR = 18  # terms of phi1: the first left out is below 1e-17 for a norm of 1/2
_normal = NormalDist().inv_cdf


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
    return _normal(((z >> 11) + 0.5) * 2.0**-53)


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
