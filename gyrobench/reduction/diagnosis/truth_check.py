"""Simulated results that miss their truth: said first, with what was set and may explain it."""

from __future__ import annotations

from collections.abc import Sequence

from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.estimation.effects import PREDICTED
from gyrobench.result import Coefficient, Result

LIMIT = 5.0  # of |z|: by chance once in two million


def check_truth(result: Result, causes: Sequence[str]) -> None:
    """Put a warning before all others where an estimate is more than five standard uncertainties from the truth.

    causes: what was set and may explain it, see :func:`set_values`.
    """
    deviating = [c for c in result.coefficients if c.z is not None and abs(c.z) > LIMIT]
    if not deviating:
        return
    deviating.sort(key=lambda c: -abs(c.z or 0.0))
    why = (
        f"Possible causes among the values set: {'; '.join(causes)}."
        if causes
        else "No value was set: the model or its u is wrong."
    )
    shifts = _predicted(result)
    left = [abs(c.estimate - (c.truth or 0.0) - shifts.get(c.name, 0.0)) / c.u for c in deviating]
    if shifts and max(left) <= LIMIT:
        why = f"The simulated errors of the set-up account for it, see the table '{PREDICTED}'."
    result.warnings.insert(
        0,
        f"The result misses the simulated truth by more than five standard uncertainties: {_shown(deviating)}. Chance "
        f"does not explain this; do not use the coefficients, their u or their verdicts. {why}",
    )


def _predicted(result: Result) -> dict[str, float]:
    """Return name -> shift by the simulated errors that the budget knows, in the printed unit."""
    for table in result.tables:
        if table["title"] == PREDICTED:
            return {row[0]: row[table["columns"].index("sum")] for row in table["rows"]}
    return {}


def _shown(deviating: Sequence[Coefficient], most: int = 4) -> str:
    text = ", ".join(f"{c.name} (z = {c.z:+,.1f})" for c in deviating[:most]).replace("-", "−")
    return text + (f" and {len(deviating) - most} more" if len(deviating) > most else "")


def set_values(run: RunDocument) -> list[str]:
    """Return what was set in a run: set-up errors first, then parts that were swapped, then values in SI."""
    errors = {e.parameter.partition("[")[0]: e for e in run.setup_errors}
    causes = [f"set-up error {e.comparison()}" for e in run.setup_errors]
    for name in run.changed:
        slot, colon, _ = name.partition(": part")
        if colon:
            causes.append(f"part {run.parts[slot].name} in slot {slot}" if slot in run.parts else name)
        elif name.partition("[")[0] not in errors:
            value = run.parameters.get(name, run.options.get(name))
            causes.append(f"{name} = {value:.6g} (SI)" if isinstance(value, float) else name)
    return causes
