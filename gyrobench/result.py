"""Results: what reductions return and reports render, a class for each kind, and what they are judged by.

Numbers are in surface units (the unit stands beside them); nothing here computes.  HTML, PDF and
``result.json`` are all rendered from one ``Result``, so a number is the same number everywhere.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any, ClassVar

from gyrobench.bench import UsageError, suggest_names
from gyrobench.notebook import Displayed, data_frame
from gyrobench.result_content import EMPTY, content, typed
from gyrobench.result_entries import (
    NO_VERDICT,
    AllanDeviation,
    AllanSlope,
    Autocorrelation,
    BudgetLine,
    Coefficient,
    Curve,
    DriftColumn,
    Harmonic,
    Limit,
    PowerSpectrum,
    Reason,
    Response,
    Series,
    SetBy,
    Specification,
    StepChange,
    StepCheck,
    Table,
    Test,
    TypeB,
    VarianceShare,
)
from gyrobench.result_suite import SuiteComparison

if TYPE_CHECKING:
    import numpy as np
    import pandas

__all__ = [
    "NO_VERDICT", "AllanDeviation", "AllanSlope", "Autocorrelation", "BudgetLine", "Coefficient", "Curve",
    "DriftColumn", "DriftRecordResult", "DriftTestResult", "Harmonic", "Limit", "LoopResult", "PowerSpectrum", "Reason",
    "Response", "Result", "Series", "SetBy", "Specification", "StepChange", "StepCheck", "SuiteComparison",
    "SuiteResult", "Table", "Test", "TypeB", "VarianceShare",
]  # fmt: skip

#: what :meth:`Result.array` reads of a coefficient
NUMBERS: Mapping[str, Callable[[Coefficient], float | None]] = {
    "estimate": lambda c: c.estimate,
    "u": lambda c: c.u,
    "k": lambda c: c.k,
    "low": lambda c: c.interval[0],
    "high": lambda c: c.interval[1],
    "t": lambda c: c.t,
    "p": lambda c: c.p,
    "u_a": lambda c: c.u_a,
    "dof": lambda c: c.dof,
    "closed": lambda c: c.closed,
    "truth": lambda c: c.truth,
    "z": lambda c: c.z,
}


@dataclass(frozen=True, kw_only=True, repr=False)
class Result(Displayed):
    """Content common to results of every kind; a reduction returns one of the kinds below.

        result["D_I"].estimate, result["D_I"].interval      a coefficient by its name
        result.array("estimate"), result.covariance()       numpy arrays, in the order of result.names
        result.frame(), result.frame("series")              pandas data frames

    Every field is JSON-able through :meth:`as_dict`.  result.json has the same keys for every kind: empty, 0 or 1 where
    a kind does not have them.
    """

    kind: ClassVar[str] = ""

    system: str = ""  # name and title of the test: known where its result is concluded
    title: str = ""
    method: str  # one line, with its source
    sources: list[str]  # "TEST-TUMBLE1-SDF; Hu 1981, eq. 3-12..3-21"
    equation: str = ""  # model equation, Typst math
    conventions: list[str]  # sign and axis conventions, a sentence each
    coefficients: list[Coefficient]
    tests: list[Test] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)  # the method's own
    step_check: StepCheck | None = field(default=None, metadata=EMPTY)
    reasons: list[Reason] = field(default_factory=list)  # warnings, and why verdicts are withheld
    summary: list[str] = field(default_factory=list)  # the three numbers that matter, as sentences
    decision_rule: str = ""
    verdict: str = NO_VERDICT  # written by gyrobench.reduction.estimation.verdict alone
    site: dict[str, Any] = field(default_factory=dict)
    instrument: str = ""
    simulated: bool = True
    provenance: dict[str, Any] = field(default_factory=dict)  # run.json of the record, date, operator
    ranked_by: str = ""  # the coefficient that ranks runs in a comparison, smallest first
    purposes: dict[str, str] = field(default_factory=dict)  # further ones -> what the smallest is the choice for

    def __post_init__(self) -> None:
        if not self.kind:
            raise TypeError("a result is a DriftTestResult, a LoopResult, a DriftRecordResult or a SuiteResult")

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.system}: {len(self.coefficients)} coefficients, {self.verdict}>"

    @property
    def warnings(self) -> list[str]:
        """Sentences for the reader, the most serious first."""
        return [r.text for r in self.reasons if r.severity in ("error", "warning")]

    @property
    def withheld(self) -> list[str]:
        """Sentences on why no "pass" (or "fail") is stated."""
        return [r.text for r in self.reasons if r.severity == "doubt"]

    @property
    def names(self) -> list[str]:
        """Names of the coefficients, in their order."""
        return [c.name for c in self.coefficients]

    def __getitem__(self, name: str) -> Coefficient:
        """Return a coefficient by its name.  Raises UsageError."""
        for c in self.coefficients:
            if c.name == name:
                return c
        raise UsageError(f"{name}: no such coefficient of {self.system}; {suggest_names(str(name), self.names)}")

    def array(self, column: str = "estimate") -> np.ndarray[Any, Any]:
        """Return a number of every coefficient, in the unit of each; NaN where there is none.  Raises UsageError.

        column: estimate, u, k, low, high, t, p, u_a, dof, closed, truth or z.
        """
        import numpy as np

        if column not in NUMBERS:
            raise UsageError(f"{column}: no number of a coefficient; {suggest_names(str(column), NUMBERS)}")
        return np.array([np.nan if v is None else v for v in map(NUMBERS[column], self.coefficients)], dtype=float)

    def covariance(self) -> np.ndarray[Any, Any]:
        """Return the covariance of the estimates in the units of the coefficients; its diagonal is u squared.

        Type A, u_i u_j r_ij, and of each source of type B the product of what it does to both estimates.
        Raises UsageError for a result without correlations: the estimates of a loop are made one by one.
        """
        import numpy as np

        correlation = getattr(self, "correlation", None)
        if not correlation:
            raise UsageError(f"{self.system}: its estimates have no correlation, each is made by itself")
        u = self.array("u")
        changes = [np.asarray(b.changes, dtype=float) for b in getattr(self, "type_b", [])]
        if not changes or any(c.shape[1] != u.size for c in changes):
            return np.asarray(correlation, dtype=float) * np.outer(u, u)
        u_a = np.array([c.u if c.u_a is None else c.u_a for c in self.coefficients])
        total = np.asarray(correlation, dtype=float) * np.outer(u_a, u_a) + sum(c.T @ c for c in changes)
        size = np.sqrt(np.diag(total))
        scale = np.divide(u, size, out=np.zeros_like(u), where=size > 0.0)
        return np.asarray(total * np.outer(scale, scale))

    def frame(self, table: str = "coefficients") -> pandas.DataFrame:
        """Return the coefficients, or the points of all series ("series"), as a data frame.

        Raises MissingPackageError without pandas, and UsageError for another table.
        """
        if table == "coefficients":
            texts = {"meaning": [c.meaning for c in self.coefficients], "unit": [c.unit for c in self.coefficients]}
            numbers: dict[str, Any] = {name: self.array(name) for name in NUMBERS}
            verdicts = {"verdict": [c.verdict for c in self.coefficients]}
            return data_frame({"name": self.names, **texts, **numbers, **verdicts}, {}, "name")
        if table != "series":
            raise UsageError(f"{table}: no table of a result; there are: coefficients, series")
        series: list[Series] = getattr(self, "series", [])
        rows = [(s, k) for s in series for k in range(len(s.x))]
        columns: dict[str, list[Any]] = {"series": [s.label for s, _ in rows]}
        for name in ("t", "x", "y", "fit", "residual"):
            columns[name] = [v[k] if k < len(v) else None for s, k in rows for v in [getattr(s, name)]]
        units = {"t": "s", "x": ", ".join(dict.fromkeys(s.x_unit for s in series))}
        y_unit = ", ".join(dict.fromkeys(s.y_unit for s in series))
        return data_frame(columns, {**units, **dict.fromkeys(("y", "fit", "residual"), y_unit)})

    def as_dict(self) -> dict[str, Any]:
        """Return the content of result.json, with the kind."""
        return {"kind": self.kind, **ABSENT, **content(self), "warnings": self.warnings, "withheld": self.withheld}

    @staticmethod
    def from_dict(data: Mapping[str, Any]) -> DriftTestResult | LoopResult | DriftRecordResult | SuiteResult:
        """Return the result of the right kind, the inverse of :meth:`as_dict`.

        Without ``kind``, as in older files, its content tells it.  Raises TypeError for an unknown or a missing key,
        KeyError for an unknown kind.
        """
        older = "suite" if data.get("suite") else "drift_test" if data.get("correlation") else "loop"
        cls = KINDS[data.get("kind", older)]
        own = {f.name for f in fields(cls)}
        values = {k: v for k, v in data.items() if k not in ("kind", *SAID) and (k in own or k not in ABSENT)}
        if "reasons" not in data:  # of version 0.1.0
            values["reasons"] = [
                *({"id": "", "text": text} for text in data.get("warnings", [])),
                *({"id": "", "text": text, "severity": "doubt"} for text in data.get("withheld", [])),
            ]
        found: DriftTestResult | LoopResult | DriftRecordResult | SuiteResult = typed(cls, values)
        return found


@dataclass(frozen=True, kw_only=True, repr=False)
class DriftTestResult(Result):
    """Coefficients of an instrument from a regression over windows, with its residuals and its error budget."""

    kind: ClassVar[str] = "drift_test"

    series: list[Series]
    correlation: list[list[float]]  # of the estimates, order of `coefficients`
    condition: float
    rank: int
    dof: float
    noise: dict[str, Any]  # {"model": "white" | "ar1" ..., "sigma": .., "tau": .., units in the names}
    residual_std: float
    residual_unit: str
    acf: Autocorrelation | None = field(default=None, metadata=EMPTY)
    allan: AllanDeviation | None = field(default=None, metadata=EMPTY)
    psd: PowerSpectrum | None = field(default=None, metadata=EMPTY)
    harmonics: list[Harmonic] = field(default_factory=list)
    budget: list[BudgetLine] = field(default_factory=list)
    type_b: list[TypeB] = field(default_factory=list)
    repeatability: dict[str, Any] = field(default_factory=dict)
    ideal: bool = False  # data without noise: what is left of them is rounding


@dataclass(frozen=True, kw_only=True, repr=False)
class LoopResult(Result):
    """Measures of a loop, a platform or an estimator, each by itself: responses, steps, drift."""

    kind: ClassVar[str] = "loop"

    responses: list[Response]
    budget: list[BudgetLine] = field(default_factory=list)
    shares: list[VarianceShare] = field(default_factory=list)
    allan: AllanDeviation | None = field(default=None, metadata=EMPTY)
    # of an estimator: its readings and their errors
    series: list[Series] = field(default_factory=list)
    acf: Autocorrelation | None = field(default=None, metadata=EMPTY)
    dof: float = 0.0
    residual_std: float = 0.0
    residual_unit: str = "1"


@dataclass(frozen=True, kw_only=True, repr=False)
class DriftRecordResult(Result):
    """Noise coefficients of a drift record, for each of its columns, with deviations, spectrum and models."""

    kind: ClassVar[str] = "noise_model"

    columns: list[DriftColumn]


@dataclass(frozen=True, kw_only=True, repr=False)
class SuiteResult(Result):
    """Several tests of one instrument: weighted means of what they have in common, and whether the methods agree."""

    kind: ClassVar[str] = "suite"

    suite: SuiteComparison


KINDS: dict[str, type[DriftTestResult | LoopResult | DriftRecordResult | SuiteResult]] = {
    cls.kind: cls for cls in (DriftTestResult, LoopResult, DriftRecordResult, SuiteResult)
}
SAID = ("warnings", "withheld")  # keys that follow from others

#: what result.json holds under the keys that a kind does not have
ABSENT: dict[str, Any] = {
    "series": [],
    "correlation": [],
    "condition": 0.0,
    "rank": 0,
    "dof": 0.0,
    "noise": {},
    "residual_std": 0.0,
    "residual_unit": "1",
    "acf": {},
    "allan": {},
    "psd": {},
    "harmonics": [],
    "budget": [],
    "shares": [],
    "type_b": [],
    "repeatability": {},
    "ideal": False,
    "responses": [],
    "suite": {},
    "columns": [],
}
