"""Reduction of a record without the search for handling errors, which reduces a laboratory's up to fifty times."""

from __future__ import annotations

import importlib

from gyrobench.record.record import Record
from gyrobench.reduction.estimation.verdict import conclude
from gyrobench.result import DriftTestResult, Specification
from gyrobench.system.system import load_system


def reduce_undiagnosed(record: Record, limits: Specification | None = None) -> DriftTestResult:
    """The result of a drift test: what is estimated does not depend on that search."""
    reduction = importlib.import_module(".reduction", type(load_system(record.run.system)).__module__)
    result = conclude(reduction.Reduction.of_record(record), record, limits)
    assert isinstance(result, DriftTestResult)
    return result
