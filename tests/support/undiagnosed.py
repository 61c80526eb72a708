"""Reduction of a record without the search for handling errors, which reduces a laboratory's up to fifty times."""

from __future__ import annotations

import importlib

from gyrobench.record.record import Record
from gyrobench.result import DriftTestResult, Specification
from gyrobench.system.system import load_system


def reduce_undiagnosed(record: Record, limits: Specification | None = None) -> DriftTestResult:
    """The result of a drift test: what is estimated does not depend on that search."""
    reduction = importlib.import_module(".reduction", type(load_system(record.run.system)).__module__)
    examined = getattr(reduction, "_examined", reduction.from_record)
    result = examined.__wrapped__(record, limits)
    assert isinstance(result, DriftTestResult)
    return result
