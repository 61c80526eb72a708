"""What the communication step does to the measures of a run, as a part of their uncertainty.

    effects = step_effects(at_step, other, factor=0.5)            # quiet runs at the step h and at factor h
    result = with_step(result, StepCheck(h, effects))             # lines of the budget, u, intervals, warning

The effect is what a measure at the step h is away from that at step zero, from two steps, of first order in the step:

    m(h) - m(0) = (m(h) - m(p h)) / (1 - p)        p = 1/2 or 2

An effect of second order is overstated by it, by half at p = 1/2 and threefold at p = 2.  u takes it as the bound of a
rectangular distribution (GUM 4.3.7): effect / sqrt(3).  Measures in dB are extrapolated as amplitudes.

Where sign and size are known it is taken out of the estimate (GUM 3.2.4): the linear models of a loop with the step and
without differ by as much, to AGREED.  That difference is subtracted, and the rest of the effect is the bound.

Not modelled: what happens at steps at which the measure is not yet of first order, and the noise, which does not depend
on the step.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeVar

from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.result import BudgetLine, Coefficient, Reason, Result, StepChange, StepCheck

R = TypeVar("R", bound=Result)
STEP = "step"  # id of its line of the budget, and of the warning
RELATIVE = 1e-3  # of the estimate: an effect below it is in u without a warning
AGREED = 0.2  # of the difference of two linear models: an effect so near to it is known
FLOOR = 0.1  # amplitude at step zero over that at the step: no extrapolation beyond, 20 dB
LISTED = 3  # measures in a warning
FINEST = 4  # the step recommended is at most that much shorter


def step_effects(at_step: Sequence[Coefficient], other: Sequence[Coefficient], factor: float) -> list[StepChange]:
    """Return the change of each measure of two runs without noise: at the step, and ``factor`` times it.

    A measure without a value in one of them has no row.
    """
    there = {c.name: c for c in other if not c.no_value}
    rows = []
    for c in at_step:
        if not c.no_value and c.name in there:
            change = _effect(c.unit, c.estimate, there[c.name].estimate, factor)
            rows.append(StepChange(c.name, c.unit, change))
    return rows


def _effect(unit: str, at_step: float, other: float, factor: float) -> float:
    linear = (at_step - other) / (1.0 - factor)
    if unit != "dB":
        return linear
    zero = 1.0 - (1.0 - 10.0 ** ((other - at_step) / 20.0)) / (1.0 - factor)  # amplitude, of that at the step
    return -20.0 * math.log10(max(zero, FLOOR))


def with_step(result: R, check: StepCheck) -> R:
    """Return the result with the effects of the step in u and intervals, lines of the budget and a warning.

    check: with the rows of :func:`step_effects`; they get u without the step, and the ratio of effect and u.
    """
    step = check.step
    changes = {row.name: row for row in check.rows}
    rows: list[StepChange] = []
    parts, widened, budget = {}, [], list(getattr(result, "budget", ()))
    for c in result.coefficients:
        row = changes.get(c.name)
        if row is None or c.no_value:
            widened.append(c)
            continue
        taken = _known(c, row.change)
        left = row.change - taken
        rows.append(replace(row, u=c.u, ratio=abs(left) / c.u if c.u > 0.0 else None, taken=taken))
        parts[c.name] = left / math.sqrt(3.0)
        if c.u > 0.0 and not any(b.coefficient == c.name for b in budget):
            budget.append(
                BudgetLine("type_a", "noise and evaluation", c.u, c.unit, 1.0, "1", c.u, c.unit, c.name, "type A")
            )
        size = (step, "s", parts[c.name] / step, f"{c.unit}/s", abs(parts[c.name]), c.unit, c.name)
        budget.append(BudgetLine(STEP, "coupling step", *size, "m(h) − m(0), rectangular"))
        widened.append(_widened(_corrected(c, taken), abs(parts[c.name])))
    worst = max((r.ratio for r in rows if r.ratio is not None), default=None)
    text = _warning(result, rows, step)
    more: dict[str, Any] = {"budget": budget} if hasattr(result, "budget") else {}
    if getattr(result, "correlation", None):
        more["correlation"] = _correlation(result, widened, parts)
    reasons = [*result.reasons, Reason(STEP, text)] if text else result.reasons
    checked = replace(check, rows=rows, worst=worst)
    return replace(result, coefficients=widened, step_check=checked, reasons=reasons, **more)


def _known(c: Coefficient, change: float) -> float:
    """Return the part of an effect that is known: what the linear models differ by, where the effect is as large."""
    if c.models is None:
        return 0.0
    difference = c.models[0] - c.models[1]
    return difference if abs(change - difference) <= AGREED * abs(difference) else 0.0


def _corrected(c: Coefficient, taken: float) -> Coefficient:
    """Return the coefficient at step zero; a closed form that is the linear model with the step follows."""
    if not taken or c.models is None:
        return c
    closed = c.models[1] if c.closed == c.models[0] else c.closed
    return replace(c, estimate=c.estimate - taken, closed=closed)


def _widened(c: Coefficient, part: float) -> Coefficient:
    """U2 = (k u)2 + (1.96 part)2: the step's part has many degrees of freedom."""
    if part == 0.0:
        return c  # its interval may be one-sided
    half, u = math.hypot(c.k * c.u, NORMAL * part), math.hypot(c.u, part)
    z = (c.estimate - c.truth) / u if c.z is not None and c.truth is not None and u > 0.0 else c.z
    k = half / u if u > 0.0 else c.k
    return replace(c, u=u, k=k, interval=(c.estimate - half, c.estimate + half), z=z)


def _correlation(result: Result, widened: Sequence[Coefficient], parts: Mapping[str, float]) -> list[list[float]]:
    """One step moves all estimates together: its covariance is the product of its signed parts."""
    old, new = result.coefficients, widened
    matrix = [list(row) for row in getattr(result, "correlation", [])]
    for i, row in enumerate(matrix):
        for j, r in enumerate(row):
            if i != j and new[i].u > 0.0 and new[j].u > 0.0:
                both = parts.get(new[i].name, 0.0) * parts.get(new[j].name, 0.0)
                row[j] = (r * old[i].u * old[j].u + both) / (new[i].u * new[j].u)
    return matrix


def _warning(result: Result, rows: Sequence[StepChange], step: float) -> str:
    """Return what to do where the step moves measures by more than their u; "" where it does not."""
    sizes = {c.name: abs(c.estimate) for c in result.coefficients}
    measured = [(abs(r.change - r.taken), r.u or 0.0, r) for r in rows]
    over = [(change / max(u, RELATIVE * sizes[r.name], 1e-300), change, u, r) for change, u, r in measured
            if change > max(u, RELATIVE * sizes[r.name])]  # fmt: skip
    if not over:
        return ""
    over.sort(key=lambda row: -row[0])
    shown = [
        f"{r.name} by {_short(change)} {r.unit} (u without it {_short(u)} {r.unit})"
        for _, change, u, r in over[:LISTED]
    ]
    more = f" and {len(over) - LISTED} more" if len(over) > LISTED else ""
    finer = step / min(FINEST, 2 ** math.ceil(math.log2(over[0][0])))
    return (
        f"The communication step of {step_text(step)} moves {', '.join(shown)}{more}: more than their u. It is part of "
        f"the u stated. For figures with less of it run with --step {step_text(finer).replace(' ', '')}."
    )


def _short(x: float) -> str:
    return f"{float(f'{x:.2g}'):g}"


def step_text(step: float) -> str:
    """Return a step as people write it: 0.1 ms, 25 us."""
    for factor, unit in ((1.0, "s"), (1e-3, "ms"), (1e-6, "us")):
        if step >= 0.1 * factor * (1.0 - 1e-12):
            return f"{step / factor:.6g} {unit}"
    return f"{step / 1e-6:.6g} us"
