"""From a fit to its result, judged: what tests of reductions need beside the bench's own functions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from gyrobench.reduction.estimation.effects import Effect
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.estimation.fit_result import Account, fit_result
from gyrobench.reduction.estimation.verdict import conclude
from gyrobench.reduction.setup.setups import Setup
from gyrobench.reduction.setup.sources import Source
from gyrobench.result import DriftTestResult, Specification

ACCOUNT: dict[str, Any] = {
    "method": "by hand",
    "sources": ["RED-OLS"],
    "equation": "y = a + b x",
    "conventions": ["x counts to the right."],
}


def effect(name: str, size: float, unit: str, error: Any, **more: Any) -> Effect:
    """A source of that name, with its effect on the data."""
    return Source(name.replace(" ", "_"), name, unit).effect(size, error, **more)


def judged(
    found: Findings, effects: Sequence[Effect] = (), limits: Specification | None = None, setup: Setup | None = None,
    **account: Any,
) -> DriftTestResult:  # fmt: skip
    """The result of a fit, with limits in printed units."""
    findings = fit_result(found, Account(**{**ACCOUNT, **account}), effects, setup or Setup())
    return conclude(findings, None, limits, system="line", title="A line")
