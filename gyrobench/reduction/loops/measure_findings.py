"""What a test measures, each figure by itself, and the result that its report shows.

    found = MeasureFindings(record)
    found.measure("K", "stiffness", "N·m/rad", value, u, closed=H * K_m / C_b)
    found.warn("motor.limit", "The motor was at its limit.")
    return found.result(Account(method=..., sources=[...], equation=..., conventions=[...]), summary)

Loops add gates, margins and steps (loop_result).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from scipy import special

from gyrobench.record.record import Record
from gyrobench.reduction.estimation.fit_result import Account
from gyrobench.reduction.estimation.truth_check import compared
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.loops.estimator_metrics import UncertainValue
from gyrobench.result import NO_VERDICT, BudgetLine, Coefficient, Limit, LoopResult, Reason, Response, Table, Test

EVERY = ("pass", "fail", "inconclusive", NO_VERDICT)


class MeasureFindings:
    """Collects what was found in one record; see the module.  facts: further fields of the result (site, dof)."""

    def __init__(self, record: Record) -> None:
        self.record, self.run = record, record.run
        self.coefficients: list[Coefficient] = []
        self.responses: list[Response] = []
        self.tables: list[Table] = []
        self.tests: list[Test] = []
        self.budget: list[BudgetLine] = []
        self.reasons: list[Reason] = []
        self.unstable = ""  # why no figure has a value
        self.facts: dict[str, Any] = {}

    def warn(self, id: str, text: str, severity: str = "warning") -> None:
        """Add what a reader must know, once; nothing for ""."""
        reason = Reason(id, text, severity=severity)
        self.reasons += [reason] if text and reason not in self.reasons else []

    def doubt(self, id: str, text: str) -> None:
        """Add why nothing may pass or fail; nothing for ""."""
        self.reasons += [Reason(id, text, ("pass", "fail"), severity="doubt")] if text else []

    def measure(
        self, name: str, meaning: str, unit: str, estimate: float | None, u: float | None = None, *,
        scale: float = 1.0, closed: float | None = None, truth: float | None = None, no_value: str = "",
        unsettled: str = "", dof: float = math.inf, k: float | None = None, limit: Limit | None = None,
        interval: tuple[float, float] | None = None,
    ) -> None:  # fmt: skip
        """Add a row of the table of coefficients; nothing for an estimate of None without a reason.

        scale: SI of all numbers per printed unit; 1: they are in that unit.  u: standard uncertainty, None or 0 where
        the data leave none; dof: its degrees of freedom; k: its coverage factor, if not by these; interval: of 95 %,
        printed unit, if not estimate +- k u.  closed: the closed form.  no_value: why there is no estimate; without a
        limit such a row says no more than that.  unsettled: the same, with the verdict void.  limit: printed unit, what
        the test itself requires.
        """
        no_value = unsettled or no_value
        if no_value:
            estimate = u = math.nan
        elif estimate is None or not math.isfinite(estimate):
            return
        size = u / scale if u is not None and (no_value or math.isfinite(u)) else 0.0
        value, known, true = (None if x is None else x / scale for x in (estimate, closed, truth))
        assert value is not None
        if unsettled:
            self.reasons.append(Reason("unsettled", unsettled, EVERY, (name,), "void", "condition"))
        if interval is not None and size > 0.0:
            k = 0.5 * (interval[1] - interval[0]) / size
        if k is None:
            k = float(special.stdtrit(dof, 0.975)) if math.isfinite(dof) else NORMAL
        interval = interval or (value - k * size, value + k * size)
        c = Coefficient(name, meaning, unit, value, size, k, interval, limit=limit, no_value=no_value)
        free = dof if math.isfinite(dof) else None
        self.coefficients.append(replace(compared(c, true), u_a=size, dof=free, closed=known))

    def add(self, name: str, meaning: str, unit: str, v: UncertainValue, **more: Any) -> None:
        """Add an estimate with degrees of freedom of its own, as :meth:`measure`; one that is not finite has no value.

        more: scale, closed, truth.
        """
        none = "" if math.isfinite(v.value) else "a ratio to nothing"
        self.measure(name, meaning, unit, v.value, v.u, dof=v.dof, no_value=none, **more)

    def void(self, names: Sequence[str], reason: str) -> None:
        """Take the values of coefficients away: their phase was unstable or unsettled."""
        nothing: dict[str, Any] = {"estimate": math.nan, "u": math.nan, "interval": (math.nan, math.nan)}
        for k, c in enumerate(self.coefficients):
            if c.name in names:
                self.coefficients[k] = replace(c, **nothing, u_a=None, z=None, no_value=reason)
        self.reasons.append(Reason("unstable", reason, EVERY, tuple(names), "void", "condition"))

    @property
    def estimates(self) -> dict[str, float]:
        """Return what was measured, in printed units."""
        return {c.name: c.estimate for c in self.coefficients if not c.no_value}

    def __getitem__(self, name: str) -> Coefficient:
        """Return a coefficient by its name.  Raises KeyError."""
        found = {c.name: c for c in self.coefficients}
        return found[name]

    def result(self, account: Account, summary: Sequence[str] = (), ranked_by: str = "") -> LoopResult:
        """Return what was found, with what the test says of itself."""
        if self.unstable:
            self.void([c.name for c in self.coefficients], self.unstable)
            text = f"The run has no value: {self.unstable}. Its figures show what it did, no measure."
            self.warn("unstable", text, "error")
            summary = [f"No value: {self.unstable}."]
        found = LoopResult(
            title=account.title,
            method=account.method,
            sources=list(account.sources),
            equation=account.equation,
            conventions=list(account.conventions),
            coefficients=self.coefficients,
            responses=self.responses,
            **{"instrument": self.run.instrument, **self.facts},
        )
        return replace(
            found, tests=self.tests, tables=[*self.tables, *account.tables], budget=self.budget,
            reasons=[*self.reasons, *account.reasons], summary=list(summary), simulated=not self.run.measured,
            ranked_by=ranked_by,
        )  # fmt: skip
