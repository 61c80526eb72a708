"""The examination of a measured record: mistakes that its residuals show, and mistakes that no residual shows."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

from gyrobench.errors import GyrobenchError
from gyrobench.record.record import Record
from gyrobench.reduction.diagnosis import plausibility
from gyrobench.reduction.diagnosis.handling_errors import HANDLING, HandlingCandidate, Reduce, cures, with_diagnosis
from gyrobench.reduction.diagnosis.unshown import unshown
from gyrobench.reduction.setup.run_metadata import Location
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import DriftTestResult


def examined(
    record: Record, reduce: Reduce, candidates: Callable[[Record], Iterable[HandlingCandidate]] | None,
    regression_of: Callable[[Record], Any] | None = None,
) -> DriftTestResult:  # fmt: skip
    """Return the reduction of a record, with the diagnosis in it where it is measured and not ordinary, and with what
    no residual shows where it does not state that it was checked.

    candidates: record -> the mistakes that make sense in the test; None: no diagnosis, but what no residual shows is
    asked for all the same.  regression_of: as of :func:`unshown.unshown`.  Raises ReductionError.
    """
    if not record.run.measured:  # a simulated one knows its truth, and its set-up errors by name
        return reduce(record)
    if candidates is None:
        return _asked(record, reduce(record), reduce, regression_of)
    try:
        result = reduce(record)
    except GyrobenchError as error:
        if named := cures(reduce, candidates(record)):
            hint = f"it can be reduced, with ordinary residuals, with {named}: was that mistaken?"
            raise ReductionError([*getattr(error, "problems", [str(error)]), hint]) from None
        raise
    if "latitude" in record.run.options and "since" not in record.windows:  # turn-ons: the Earth rate is in the bias
        near = plausibility.earth_rate_warnings(result, Location.of(record.run))
        result = replace(result, reasons=[*result.reasons, *near])
    found = with_diagnosis(record, result, reduce, candidates)
    return _asked(record, found, reduce, regression_of)


def _asked(
    record: Record, found: DriftTestResult, reduce: Reduce, regression_of: Callable[[Record], Any] | None
) -> DriftTestResult:
    """Return the result with what no residual shows, where the record does not state that it was checked."""
    if record.run.arrangement == "checked" or any(r.id == HANDLING for r in found.reasons):
        return found
    return replace(found, reasons=[*found.reasons, *unshown(record, found, reduce, regression_of)])
