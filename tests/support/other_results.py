"""Results made of a simulated one: without figures, with a coefficient more."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, TypeVar

from gyrobench.result import DriftTestResult, Result

R = TypeVar("R", bound=Result)


def unplotted(result: DriftTestResult) -> DriftTestResult:
    """The result without what its figures of data are drawn from, for a test of the words around them."""
    return replace(result, series=[], correlation=[], budget=[], acf=None, allan=None, psd=None)


def with_coefficient(result: R, index: int, **changes: Any) -> R:
    """The result with changes of one of its coefficients."""
    rows = list(result.coefficients)
    rows[index] = replace(rows[index], **changes)
    return replace(result, coefficients=rows)
