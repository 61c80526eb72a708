"""Simulated results that miss their truth: said first, with what was set and may explain it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.estimation.effects import PREDICTED
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.result import Coefficient, Reason, Result

LIMIT = 5.0  # of |z|: by chance once in two million


def compared(c: Coefficient, truth: float | None) -> Coefficient:
    """Return an estimate with its simulated value (printed unit), None where it is not known, and z = error/u."""
    z = (c.estimate - truth) / c.u if truth is not None and c.u > 0.0 else None
    return replace(c, truth=truth, z=z)


def missed_truth(result: Result, causes: Sequence[str]) -> list[Reason]:
    """Return the reason not to use a result of which an estimate is more than five u from the truth; none else.

    causes: what was set and may explain it, see :func:`set_values`.
    """
    deviating = [c for c in result.coefficients if c.z is not None and abs(c.z) > LIMIT]
    if not deviating:
        return []
    deviating.sort(key=lambda c: -abs(c.z or 0.0))
    why = (
        f"Possible causes among the values set: {'; '.join(causes)}."
        if causes
        else "No value was set: the model or its u is wrong."
    )
    shifts = {row[0]: row[t.columns.index("sum")] for t in result.tables if t.kind == PREDICTED for row in t.rows}
    left = [abs(c.estimate - (c.truth or 0.0) - shifts.get(c.name, 0.0)) / c.u for c in deviating]
    if shifts and max(left) <= LIMIT:
        why = "The simulated errors of the set-up account for it, see the table of predicted shifts."
    text = (
        f"The result misses the simulated truth by more than five standard uncertainties: {_shown(deviating)}. Chance "
        f"does not explain this; do not use the coefficients, their u or their verdicts. {why}"
    )
    return [Reason("truth.missed", text, blocks=("pass", "fail"), severity="error")]


def _shown(deviating: Sequence[Coefficient], most: int = 4) -> str:
    text = ", ".join(f"{c.name} (z = {c.z:+,.1f})" for c in deviating[:most]).replace("-", "−")
    return text + (f" and {len(deviating) - most} more" if len(deviating) > most else "")


def set_values(run: RunDocument) -> list[str]:
    """Return what was set in a run: set-up errors first, then parts that were swapped, then values in SI.

    Without what is stated of uncertainties of type B: it widens intervals, and moves no estimate by five u.
    """
    errors = {e.parameter.partition("[")[0]: e for e in run.setup_errors}
    causes = [f"set-up error {e.comparison()}" for e in run.setup_errors]
    for name in run.changed:
        slot, colon, _ = name.partition(": part")
        if colon:
            causes.append(f"part {run.parts[slot].name} in slot {slot}" if slot in run.parts else name)
        elif name.partition("[")[0] not in errors and name != "type_b" and not name.startswith("u_"):
            value = run.parameters.get(name, run.options.get(name))
            causes.append(f"{name} = {plain(value, 6)} (SI)" if isinstance(value, float) else name)
    return causes
