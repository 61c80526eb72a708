"""Uncertainty of type A and B together, and the verdict against a specification."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from typing import TypeVar

from gyrobench.result import NO_VERDICT, Result

R = TypeVar("R", bound=Result)
NORMAL = 1.959963984540054  # 97.5 % point of a normal distribution
VERDICTS = ("void", "fail", "inconclusive", "pass")  # the worst one first
DECISION_RULE = (
    "Guard band equal to U (coverage probability 95 %). Pass: the coverage interval lies within the limits. Fail: it "
    "lies entirely outside. Otherwise inconclusive, as where the residuals contradict what the interval rests on, and "
    "in place of a pass of measured data without a statement of type B."
)

SLOW_RULE = (
    "A pass or a fail holds, too, if the noise is slow drift (correlation time above an eighth of the record) that the "
    "record does not exclude (probability of 5 % or more); otherwise inconclusive."
)


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


def assess_conformity(estimate: float, U: float, limit: tuple[float | None, float | None] | None) -> str:
    """pass, fail, inconclusive, void (without a value) or "no specification given" by :data:`DECISION_RULE`; None is an
    open side.
    """
    if limit is None or limit == (None, None):
        return NO_VERDICT
    low = -math.inf if limit[0] is None else limit[0]
    high = math.inf if limit[1] is None else limit[1]
    if not math.isfinite(estimate) or not math.isfinite(U):
        return "void"
    if low + U <= estimate <= high - U:
        return "pass"
    return "fail" if estimate + U < low or estimate - U > high else "inconclusive"


def worst_verdict(verdicts: Iterable[str]) -> str:
    """Return the first of :data:`VERDICTS` that was given; "no specification given" when none was."""
    given = set(verdicts)
    return next((word for word in VERDICTS if word in given), NO_VERDICT)


def withhold(
    result: R, reasons: Iterable[str], words: Collection[str] = ("pass", "fail"), names: Collection[str] | None = None
) -> R:
    """Make the verdicts ``words`` of a result (of the coefficients ``names``; None: all) inconclusive for ``reasons``
    (sentences), and return it.

    A warning says so where there was such a verdict.  Without reasons nothing changes.
    """
    reasons = list(reasons)
    new = [r for r in reasons if r not in result.withheld]
    result.withheld += new
    judged = [c for c in result.coefficients if c.verdict in words and (names is None or c.name in names)]
    if not reasons or not judged:
        return result
    for c in judged:
        c.verdict = "inconclusive"
    result.verdict = worst_verdict(c.verdict for c in result.coefficients)
    which, why = ", ".join(c.name for c in judged), " ".join(new or reasons)
    result.warnings.insert(0, f"Inconclusive instead of {' or '.join(words)}: {which}. {why}")
    return result
