"""Entries of the result of a suite: its tests, its measurands by every method, the methods pair by pair.

Numbers are in surface units, the unit beside them.  Nothing here computes.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class ReportedEstimate:
    """A coefficient as a test of a suite reports it."""

    name: str
    unit: str
    estimate: float
    u: float
    k: float
    interval: tuple[float, float]
    truth: float | None = None
    z: float | None = None


@dataclass(frozen=True)
class SuiteMember:
    """A test of a suite: of its result, and of its run.json (``test``, as SuiteTestRun)."""

    label: str
    system: str
    title: str
    method: str
    verdict: str
    summary: list[str]
    warnings: list[str]
    site: dict[str, Any]
    instrument: str
    residual_std: float
    unit: str
    condition: float
    rank: int
    windows: int
    estimates: list[ReportedEstimate]
    test: dict[str, Any] = field(default_factory=dict, metadata={"flat": True})


@dataclass(frozen=True)
class FailedMember:
    """A test of a suite that gave no result, and why."""

    label: str
    reason: str


@dataclass(frozen=True)
class SuiteValue:
    """A measurand by one method; weight: in the weighted mean; how: where the value comes from, in words."""

    label: str
    estimate: float
    u: float
    U: float
    u_a: float
    u_b: float
    u_shared: float
    dof: float | None
    weight: float | None
    truth: float | None
    how: str


@dataclass(frozen=True)
class WeightedMean:
    """The mean of the methods."""

    estimate: float
    u: float
    U: float


@dataclass(frozen=True)
class SuiteQuantity:
    """A measurand by all methods that see it, with the test of their consistency.

    verdict: agree, disagree, or "–" where it was not tested.  deviating: the method that deviates from the others, ""
    where there is none or it cannot be told.  words: the finding, for the reader.
    """

    name: str
    unit: str
    meaning: str
    combination: dict[str, float]
    truth: float | None
    values: list[SuiteValue]
    mean: WeightedMean | None
    Q: float | None
    dof: float | None
    birge: float | None
    p: float | None
    p_adjusted: float | None
    largest_E_n: float | None = field(metadata={"key": "largest E_n"})
    verdict: str
    words: str
    deviating: str = ""


@dataclass(frozen=True)
class MethodPair:
    """Two methods on one measurand: difference with its U, normalized error."""

    quantity: str
    unit: str
    a: str
    b: str
    difference: float
    U: float
    E_n: float


@dataclass(frozen=True)
class SuiteComparison:
    """Comparison of the methods of a suite, see gyrobench.reduction.suite.method_comparison."""

    rule: str
    shared: list[str]  # sources of type B that are one and the same error in all tests
    members: list[SuiteMember]
    failed: list[FailedMember]
    quantities: list[SuiteQuantity]
    pairs: list[MethodPair]
    consistency: str  # consistent | inconsistent | not tested
    p: float | None  # the smallest, adjusted
    tested: int  # quantities
    disagreeing: list[str]
    pairs_apart: int  # E_n > 1
