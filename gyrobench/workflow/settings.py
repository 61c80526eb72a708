"""Systems and suites with the values that a user gives them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gyrobench.bench import UsageError
from gyrobench.system.suite import Suite
from gyrobench.system.system import System
from gyrobench.system.values import InvalidValueError
from gyrobench.workflow.inputs import load_test


def load_with_values(
    name: str, values: Mapping[str, str], step: float | None = None, coupling: str = "sequential"
) -> System | Suite:
    """Return a system or suite with the values of --set, see :func:`gyrobench.workflow.inputs.load_test`."""
    test = load_test(name, step)
    if coupling == "parallel":
        if isinstance(test, Suite):
            raise UsageError(f"--coupling: {name} is a suite; run its tests one by one: {', '.join(test.tests())}")
        test.coupling = coupling
    apply_values(test, values)
    return test


def load_system(name: str, values: Mapping[str, str], coupling: str = "sequential") -> System:
    """Return a system with the values of --set.  Raises UsageError for a suite too, naming its tests."""
    test = load_with_values(name, values, None, coupling)
    if isinstance(test, Suite):
        raise UsageError(f"{name} is a suite; name one of its tests: {', '.join(test.tests())}")
    return test


def apply_values(test: System | Suite, values: Mapping[str, Any]) -> None:
    """Set values.  Raises UsageError."""
    for key, value in values.items():
        try:
            test.set(key, value)
        except InvalidValueError as error:
            raise UsageError(f"--set {error}") from None
