"""From what a run leaves to its row."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gyrobench.result import NO_VERDICT, Result


def result_columns(result: Result, tests: Mapping[str, Result]) -> tuple[dict[str, Any], dict[str, str]]:
    """Return the columns of a result, and their units; tests: of a suite, each with its name before its quantities."""
    row: dict[str, Any] = {}
    units: dict[str, str] = {}
    each = [("", c) for c in result.coefficients]
    each += [(f"{test}.", c) for test, own in tests.items() for c in own.coefficients]
    for before, c in each:
        name = before + c.name
        while f"{name}.estimate" in row:  # two quantities of one name
            name += "'"
        low, high = c.interval
        numbers = {"estimate": c.estimate, "u": c.u, "lo": low, "hi": high, "truth": c.truth}
        row.update({f"{name}.{k}": None if v is None else float(v) for k, v in numbers.items()})
        units.update({f"{name}.{k}": c.unit for k in numbers})
    row["verdict"] = None if result.verdict == NO_VERDICT else result.verdict
    row["warnings"] = list(result.warnings)
    return row, units
