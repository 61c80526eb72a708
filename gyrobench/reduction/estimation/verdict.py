"""The rule of the verdict, and the only function that writes one.  docs/verdict.md says it in words.

    found = reduce(record)                               # estimates and reasons: no limit, no verdict
    result = conclude(found, record, limits, step)       # what is stated of them

1. A coefficient passes where its coverage interval lies within the limits, and fails where it lies entirely outside;
   else it is inconclusive.  One without a value is void, one without limits has no verdict.  Where the specification
   has none, those of the test itself hold (a time that the capture of a table is allowed).
2. Each :class:`gyrobench.result.Reason` takes away what it blocks: of the coefficients it names, or of all.  One with
   intervals does so where the verdict would not hold for them.
3. The verdict of the result is the worst of its coefficients: void, fail, inconclusive, pass.

Before that, once: what the communication step does is taken into u (step_effect), a simulated truth is moved to the
temperature of the record (conditions), and what the record itself says against its figures joins the reasons.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any, TypeVar

from gyrobench.record.record import Record
from gyrobench.reduction.estimation.allowance import allowances
from gyrobench.reduction.estimation.sentences import plain, renewed
from gyrobench.reduction.estimation.step_effect import with_step
from gyrobench.reduction.estimation.truth_check import missed_truth, set_values
from gyrobench.reduction.setup import conditions
from gyrobench.result import NO_VERDICT, Coefficient, Limit, LoopResult, Reason, Result, Specification, StepCheck
from gyrobench.result_entries import StatedLimit

R = TypeVar("R", bound=Result)
PASS, FAIL, INCONCLUSIVE, VOID = "pass", "fail", "inconclusive", "void"
VERDICTS = (VOID, FAIL, INCONCLUSIVE, PASS)  # the worst one first
SEVERITIES = ("error", "doubt", "warning", "condition")  # in the order of the report
WITHHELD = "verdict.withheld"
DECISION_RULE = (
    "Guard band equal to U (coverage probability 95 %). Pass: the coverage interval lies within the limits. Fail: it "
    "lies entirely outside. Otherwise inconclusive, as where the residuals contradict what the interval rests on, and "
    "in place of a pass of measured data without a statement of type B."
)
SLOW_RULE = (
    "A pass or a fail holds, too, if the noise is slow drift (correlation time above an eighth of the record, or a "
    "spectrum as that of flicker noise or steeper) that the record does not exclude (probability of 5 % or more); "
    "otherwise inconclusive."
)


def assess_conformity(interval: tuple[float, float], limit: Limit | None) -> str:
    """Return the verdict of a coverage interval against limits; :data:`NO_VERDICT` without limits.

    An open side of the limits is None.  Void where the interval has no value.
    """
    if limit is None or limit == (None, None):
        return NO_VERDICT
    low = -math.inf if limit[0] is None else limit[0]
    high = math.inf if limit[1] is None else limit[1]
    if not all(map(math.isfinite, interval)):
        return VOID
    if low <= interval[0] and interval[1] <= high:
        return PASS
    return FAIL if interval[1] < low or interval[0] > high else INCONCLUSIVE


def worst_verdict(verdicts: Iterable[str]) -> str:
    """Return the first of :data:`VERDICTS` that was given; "no specification given" when none was."""
    given = set(verdicts)
    return next((word for word in VERDICTS if word in given), NO_VERDICT)


def conclude(
    found: R, record: Record | None = None, limits: Specification | None = None,
    step_check: StepCheck | None = None, **facts: Any,
) -> R:  # fmt: skip
    """Return the result of what a reduction found: with the record's conditions and the step in it, and judged.

    record: None of a suite.  step_check: of :func:`step_effect.step_effects`, with the step.  facts: fields of the
    result that its reduction does not know (title, provenance).
    """
    found = replace(found, **facts)
    if record is not None:
        found = conditions.applied(found, record)
    if step_check is not None and step_check.rows:
        found = with_step(found, step_check)
    if record is not None:
        missed = missed_truth(found, set_values(record.run))
        found = replace(found, reasons=[*missed, *conditions.reasons(record), *found.reasons])
    judged, reasons = _judged(found.coefficients, found.reasons, limits or {})
    verdict = worst_verdict(c.verdict for c in judged)
    rule = found.decision_rule or DECISION_RULE
    found = replace(found, coefficients=judged, reasons=reasons, verdict=verdict, decision_rule=rule)
    if isinstance(found, LoopResult):
        found = replace(found, tables=[*found.tables, *allowances(found.shares, judged)])
    return replace(found, summary=renewed(found))


def _judged(
    coefficients: Sequence[Coefficient], reasons: Sequence[Reason], limits: Specification
) -> tuple[list[Coefficient], list[Reason]]:
    """Return the coefficients with their verdicts, and the reasons with what they have taken away, worst first."""
    judged = []
    for c in coefficients:
        limit = limits.get(c.name, limits.get(c.stands_for, c.limit))
        if isinstance(limit, StatedLimit):
            limit = limit.in_unit(c.unit)
        judged.append(replace(c, limit=limit, verdict=assess_conformity(c.interval, limit)))
    taken: list[Reason] = []
    for reason in reasons:
        hit = {c.name for c in judged if _takes(reason, c)}
        if not hit:
            continue
        words = " or ".join(w for w in reason.blocks if w in (PASS, FAIL))
        judged = [replace(c, verdict=reason.becomes) if c.name in hit else c for c in judged]
        which = ", ".join(_named(c, reason) for c in judged if c.name in hit)
        if reason.becomes == INCONCLUSIVE:
            text = f"Inconclusive instead of {words}: {which}. {reason.text}"
            taken.append(Reason(f"{WITHHELD}:{reason.id}", text, severity="error"))
    ordered = sorted([*dict.fromkeys(reasons), *taken], key=lambda r: SEVERITIES.index(r.severity))
    return judged, ordered


def _named(c: Coefficient, reason: Reason) -> str:
    if c.name not in reason.intervals:
        return c.name
    low, high = reason.intervals[c.name]
    return f"{c.name} (U = {plain(0.5 * (high - low))} {c.unit})"


def _takes(reason: Reason, c: Coefficient) -> bool:
    """Return whether a reason takes the verdict of a coefficient away."""
    if c.verdict not in reason.blocks or (reason.names and c.name not in reason.names):
        return False
    return not reason.intervals or (
        c.name in reason.intervals and assess_conformity(reason.intervals[c.name], c.limit) != c.verdict
    )
