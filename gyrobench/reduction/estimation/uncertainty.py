"""Uncertainty of type A and B together, and exact intervals of counts."""

from __future__ import annotations

import math
from collections.abc import Iterable

from scipy import special

NORMAL = 1.959963984540054  # 97.5 % point of a normal distribution


def combine_uncertainties(u_a: float, half_a: float, contributions: Iterable[float]) -> tuple[float, float]:
    """Return the standard uncertainty u and 95 % half width U of a type A part and independent type B contributions.

    u^2 = u_a^2 + sum of squares; U^2 = half_a^2 + 1.96^2 times the same sum (type B known with many degrees of
    freedom).
    """
    b2 = sum(c * c for c in contributions)
    return math.sqrt(u_a * u_a + b2), math.sqrt(half_a * half_a + NORMAL**2 * b2)


def clopper_pearson(hits: float, runs: float, level: float = 0.95) -> tuple[float, float]:
    """Return the exact bounds of a share that was met ``hits`` times in ``runs``; (0, 1) for no run at all.

    Numbers that are not whole are those of runs that count less (gyrobench.campaign.analysis.intervals).
    """
    tail = 0.5 * (1.0 - level)
    low = float(special.betaincinv(hits, runs - hits + 1, tail)) if hits > 0 else 0.0
    high = float(special.betaincinv(hits + 1, runs - hits, 1.0 - tail)) if hits < runs else 1.0
    return low, high


def poisson_interval(count: int) -> tuple[float, float]:
    """Return the 95 % interval of the mean of a Poisson count (Garwood)."""
    low = float(special.gammaincinv(count, 0.025)) if count else 0.0
    return low, float(special.gammaincinv(count + 1, 0.975))
