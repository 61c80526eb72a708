"""What the communication step does to the measures of a run, as a part of their uncertainty.

    effects = step_effects(at_step, other, factor=0.5)     # quiet runs at the step h and at factor h
    apply_step(result, {"step": h, "rows": effects})       # lines of the budget, u, intervals, verdicts, warnings

The effect is what a measure at the step h is away from that at step zero, from two steps, of first order in the step:

    m(h) - m(0) = (m(h) - m(p h)) / (1 - p)        p = 1/2 or 2

An effect of second order is overstated by it, by half at p = 1/2 and threefold at p = 2.  u takes it as the bound of a
rectangular distribution (GUM 4.3.7): effect / sqrt(3).  Measures in dB are extrapolated as amplitudes.

Not modelled: what happens at steps at which the measure is not yet of first order, and the noise, which does not depend
on the step.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from gyrobench.reduction.estimation.uncertainty import NORMAL, assess_conformity, worst_verdict
from gyrobench.reduction.loops.loop_summary import Sentence
from gyrobench.result import BudgetLine, Coefficient, Result

SOURCE = "coupling step"
RELATIVE = 1e-3  # of the estimate: an effect below it is in u without a warning
FLOOR = 0.1  # amplitude at step zero over that at the step: no extrapolation beyond, 20 dB
NOTED = 0.5  # effect over u from which the sentences, written before, are said to be without it
LISTED = 3  # measures in a warning
FINEST = 4  # the step recommended is at most that much shorter


def step_effects(at_step: Sequence[Coefficient], other: Sequence[Coefficient], factor: float) -> list[dict[str, Any]]:
    """Return name, unit and ``change`` of each measure of two runs without noise: at the step, and ``factor`` times it.

    A measure without a value in one of them has no row.
    """
    there = {c.name: c for c in other if not c.no_value}
    rows = []
    for c in at_step:
        if not c.no_value and c.name in there:
            change = _effect(c.unit, c.estimate, there[c.name].estimate, factor)
            rows.append({"name": c.name, "unit": c.unit, "change": change})
    return rows


def _effect(unit: str, at_step: float, other: float, factor: float) -> float:
    linear = (at_step - other) / (1.0 - factor)
    if unit != "dB":
        return linear
    zero = 1.0 - (1.0 - 10.0 ** ((other - at_step) / 20.0)) / (1.0 - factor)  # amplitude, of that at the step
    return -20.0 * math.log10(max(zero, FLOOR))


def apply_step(result: Result, check: Mapping[str, Any]) -> None:
    """Take the effects of the step into u, intervals and verdicts of a result; add budget lines and a warning.

    check: ``{"step": s, "rows": ...}`` of :func:`step_effects`, with whatever else is to stand in the result.  Its rows
    get u without the step, and the ratio of effect and u.
    """
    before = worst_verdict(c.verdict for c in result.coefficients)
    old = {c.name: c.u for c in result.coefficients}
    rows, parts = [], dict.fromkeys(old, 0.0)
    for row in check["rows"]:
        c = next((c for c in result.coefficients if c.name == row["name"] and not c.no_value), None)
        if c is None:
            continue
        change = float(row["change"])
        rows.append({**row, "u": c.u, "ratio": abs(change) / c.u if c.u > 0.0 else None})
        parts[c.name] = change / math.sqrt(3.0)
        _budget(result, c, parts[c.name], float(check["step"]))
        _widen(c, abs(parts[c.name]))
    worst = max((r["ratio"] for r in rows if r["ratio"] is not None), default=None)
    result.step_check = {**check, "rows": rows, "worst": worst}
    if result.verdict == before:
        result.verdict = worst_verdict(c.verdict for c in result.coefficients)
    _correlate(result, old, parts)
    stated = any("±" in s and not isinstance(s, Sentence) for s in result.summary)  # the others are renewed
    if stated and worst is not None and worst > NOTED:
        result.summary.append("These are without the effect of the communication step; the table has it in u.")
    warning = _warning(result, rows, float(check["step"]))
    if warning:
        result.warnings.append(warning)


def _budget(result: Result, c: Coefficient, part: float, step: float) -> None:
    lines: list[BudgetLine] | None = getattr(result, "budget", None)
    if lines is None:
        return
    if c.u > 0.0 and not any(b.coefficient == c.name for b in lines):
        lines.append(BudgetLine("noise and evaluation", c.u, c.unit, 1.0, "1", c.u, c.unit, c.name, "type A"))
    note = "m(h) − m(0), rectangular"
    lines.append(BudgetLine(SOURCE, step, "s", part / step, f"{c.unit}/s", abs(part), c.unit, c.name, note))


def _widen(c: Coefficient, part: float) -> None:
    """U2 = (k u)2 + (1.96 part)2: the step's part has many degrees of freedom."""
    plain = c.verdict == assess_conformity(c.estimate, c.k * c.u, c.limit)
    half = math.hypot(c.k * c.u, NORMAL * part)
    c.u = math.hypot(c.u, part)
    c.k = half / c.u if c.u > 0.0 else c.k
    c.interval = (c.estimate - half, c.estimate + half)
    if c.z is not None and c.truth is not None and c.u > 0.0:
        c.z = (c.estimate - c.truth) / c.u
    if plain:
        c.verdict = assess_conformity(c.estimate, half, c.limit)


def _correlate(result: Result, old: Mapping[str, float], parts: Mapping[str, float]) -> None:
    """One step moves all estimates together: its covariance is the product of its signed parts."""
    correlation: list[list[float]] | None = getattr(result, "correlation", None)
    if not correlation:
        return
    c = result.coefficients
    for i, row in enumerate(correlation):
        for j, r in enumerate(row):
            if i != j and c[i].u > 0.0 and c[j].u > 0.0:
                a, b = c[i].name, c[j].name
                row[j] = (r * old[a] * old[b] + parts[a] * parts[b]) / (c[i].u * c[j].u)


def _warning(result: Result, rows: Sequence[Mapping[str, Any]], step: float) -> str:
    """Return what to do where the step moves measures by more than their u; "" where it does not."""
    sizes = {c.name: abs(c.estimate) for c in result.coefficients}
    large = [r for r in rows if abs(r["change"]) > max(r["u"], RELATIVE * sizes[r["name"]])]
    if not large:
        return ""
    large.sort(key=lambda r: -abs(r["change"]) / max(r["u"], RELATIVE * sizes[r["name"]]))
    shown = [
        f"{r['name']} by {_short(abs(r['change']))} {r['unit']} (u without it {_short(r['u'])} {r['unit']})"
        for r in large[:LISTED]
    ]
    more = f" and {len(large) - LISTED} more" if len(large) > LISTED else ""
    wanted = max(abs(r["change"]) / max(r["u"], RELATIVE * sizes[r["name"]]) for r in large)
    finer = step / min(FINEST, 2 ** math.ceil(math.log2(wanted)))
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
