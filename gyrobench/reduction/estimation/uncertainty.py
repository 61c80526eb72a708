"""Uncertainty of type A and B together."""

from __future__ import annotations

import math
from collections.abc import Iterable

NORMAL = 1.959963984540054  # 97.5 % point of a normal distribution


def combine_uncertainties(u_a: float, half_a: float, contributions: Iterable[float]) -> tuple[float, float]:
    """Return the standard uncertainty u and 95 % half width U of a type A part and independent type B contributions.

    u^2 = u_a^2 + sum of squares; U^2 = half_a^2 + 1.96^2 times the same sum (type B known with many degrees of
    freedom).
    """
    b2 = sum(c * c for c in contributions)
    return math.sqrt(u_a * u_a + b2), math.sqrt(half_a * half_a + NORMAL**2 * b2)


def p_text(p: float) -> str:
    """Return a probability as the tables write it: "p < 0.001" or "p = 0.23"."""
    return "p < 0.001" if p < 0.001 else f"p = {p:.2g}"
