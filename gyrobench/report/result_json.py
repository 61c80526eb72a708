"""``result.json``, and the report of a result: the result, its document, and the few numbers that a page adds.

:class:`Report` is what pages are made from.  Everything they say comes from the typed result; every number they show is
found in ``Report.document``, the JSON content (NaN and infinities are null), by its JSON pointer.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from gyrobench import reading
from gyrobench.result import DriftTestResult, LoopResult, Result, Series, SuiteResult
from gyrobench.result_content import ResultError, content

if TYPE_CHECKING:
    from gyrobench.record.run_document import Document, PlanRow, SuiteDocument
    from gyrobench.report.provenance import Provenance

R = TypeVar("R", bound=Result, covariant=True)
S = TypeVar("S", bound=Result)
SCHEMA = "gyrobench-result-1"
DEGREE = 180.0 / math.pi


def plain(value: Any) -> Any:
    """JSON values only: numpy scalars and arrays to Python, NaN and infinities to None."""
    if value is None or isinstance(value, bool | str):
        return value
    if hasattr(value, "tolist"):  # numpy scalar or array
        value = value.tolist()
    if isinstance(value, bool | int):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, Sequence | set | frozenset) and not isinstance(value, str):
        return [plain(v) for v in (sorted(value) if isinstance(value, set | frozenset) else value)]
    return str(value)


@dataclass(frozen=True)
class SeriesMoments:
    """Mean of the windows of a series and root mean square of their residuals; None where there is none."""

    mean: float | None
    residual_rms: float | None


@dataclass(frozen=True)
class PlanLine:
    """A phase of the plan in degrees, degrees per hour and seconds; None: not stated, or not of its mode."""

    phase: int
    label: str
    mode: str
    shape: str | None
    face: str | None
    axis: int | None
    amplitude: float | None
    unit: str | None
    frequency_Hz: float | None
    angle_deg: float | None
    angle_y_deg: float | None
    rate_deg_per_h: float | None
    settle_s: float | None
    dwell_s: float | None
    travel_deg: float | None
    window_s: float | None
    window_deg: float | None


@dataclass(frozen=True)
class Derived:
    """Numbers that a report shows and no reduction delivers.

    U: expanded uncertainties, closed_minus_estimate: both in the order of the coefficients.  budget_sum: root sum of
    squares of the contributions to a coefficient.  series, plan: in the order of the result's and of the run's.
    """

    U: list[float]
    closed_minus_estimate: list[float | None]
    budget_sum: dict[str, float]
    series: list[SeriesMoments]
    plan: list[PlanLine]


@dataclass(frozen=True)
class Report(Generic[R]):
    """A result with what a page adds to it.  document: the content of result.json, for the cells of numbers alone."""

    result: R
    derived: Derived
    document: Mapping[str, Any]

    @staticmethod
    def of(result: S) -> Report[S]:
        """Return the report of a result.  Raises ResultError where its provenance is no run.json."""
        derived = _derived(result)
        found = plain({**result.as_dict(), "derived": content(derived)})
        return Report(result, derived, {"schema": SCHEMA, "report_id": content_hash(found), **found})

    @property
    def report_id(self) -> str:
        """Ten hexadecimal digits that stand for the content: same numbers and provenance, same id."""
        return str(self.document["report_id"])

    @functools.cached_property
    def run(self) -> Provenance:
        """The run.json of the result of a record."""
        from gyrobench.report.provenance import Provenance, provenance

        return provenance(self.result, Provenance)

    @functools.cached_property
    def suite(self) -> SuiteDocument:
        """The run.json of the result of a suite."""
        from gyrobench.record.run_document import SuiteDocument
        from gyrobench.report.provenance import provenance

        return provenance(self.result, SuiteDocument)

    @property
    def about(self) -> Document:
        """The circumstances of a record or a suite, as its run.json states them."""
        return self.suite if isinstance(self.result, SuiteResult) else self.run


def _derived(result: Result) -> Derived:
    from gyrobench.report.provenance import Provenance, provenance

    sums: dict[str, float] = {}
    for line in result.budget if isinstance(result, DriftTestResult | LoopResult) else ():
        if math.isfinite(line.contribution):
            sums[line.coefficient] = math.hypot(sums.get(line.coefficient, 0.0), line.contribution)
    drawn: list[Series] = result.series if isinstance(result, DriftTestResult | LoopResult) else []
    run = None if isinstance(result, SuiteResult) else provenance(result, Provenance)
    return Derived(
        U=[c.k * c.u for c in result.coefficients],
        closed_minus_estimate=[None if c.closed is None else c.closed - c.estimate for c in result.coefficients],
        budget_sum=sums,
        series=[_moments(s) for s in drawn],
        plan=[] if run is None else [_plan_line(row) for row in run.plan],
    )


def _moments(series: Series) -> SeriesMoments:
    ys, rs = ([v for v in values if math.isfinite(v)] for values in (series.y, series.residual))
    rms = math.sqrt(math.fsum(r * r for r in rs) / len(rs)) if rs else None
    return SeriesMoments(math.fsum(ys) / len(ys) if ys else None, rms)


def _plan_line(row: PlanRow) -> PlanLine:
    given, turning = row.as_dict(), row.mode == "rate"
    about = "target" if given.get("target") else "target_y"  # the axis that turns
    by_angle = turning and row.travel > 0.0

    def number(key: str, factor: float = 1.0, shown: bool = True) -> float | None:
        return factor * given[key] if shown and given.get(key) is not None else None

    return PlanLine(
        phase=row.phase, label=row.label, mode=row.mode, shape=given.get("shape"), face=given.get("face"),
        axis=given.get("axis"), amplitude=given.get("amplitude"), unit=given.get("unit"),
        frequency_Hz=given.get("frequency"), angle_deg=number("target", DEGREE, not turning),
        angle_y_deg=number("target_y", DEGREE, not turning), rate_deg_per_h=number(about, DEGREE * 3600.0, turning),
        settle_s=number("settle"), dwell_s=number("dwell", shown=not by_angle),
        travel_deg=number("travel", DEGREE, by_angle), window_s=number("window", shown=not by_angle),
        window_deg=number("window", DEGREE, by_angle),
    )  # fmt: skip


def document(result: Result) -> dict[str, Any]:
    """Return the content of ``result.json``: the result, ``derived``, ``schema`` and ``report_id``."""
    return dict(Report.of(result).document)


def report_id(result: Result) -> str:
    """Return ten hexadecimal digits that stand for the content of a result."""
    return Report.of(result).report_id


def read_document(text: str, name: object, error: reading.Raise) -> dict[str, Any]:
    """Return the content of a ``result.json``, whose report_id is the digest of all the rest; else raise the error."""
    data = reading.json_object(text, name, error)
    if data.get("schema") != SCHEMA:
        raise error(f"{name}: not a result of gyrobench: 'schema' must be {SCHEMA!r}")
    rest = {key: value for key, value in data.items() if key not in ("schema", "report_id")}
    reading.check_digest(rest, data.get("report_id"), name, lambda text: error(f"{text}; gyrobench report writes it"))
    return data


def load(text: str, name: object = "result.json") -> Result:
    """Return the Result in the text of a ``result.json``; raises ResultError, with the name, for any other text."""
    data = read_document(text, name, ResultError)
    for key in ("schema", "report_id", "derived"):
        data.pop(key, None)
    try:
        return Result.from_dict(data)
    except (KeyError, TypeError) as error:
        raise ResultError(f"{name}: a result with missing or unknown fields: {error}") from None


def pointer(*path: str | int) -> str:
    """RFC 6901 JSON pointer of a path: ``pointer("coefficients", 0, "u")`` is ``/coefficients/0/u``."""
    return "".join("/" + str(p).replace("~", "~0").replace("/", "~1") for p in path)


def value_at(doc: Any, *path: str | int) -> Any:
    """Return the value at a path, None where the path ends early."""
    for key in path:
        try:
            doc = doc[key]
        except (KeyError, IndexError, TypeError):
            return None
    return doc


def content_hash(content: Mapping[str, Any]) -> str:
    """Return ten hexadecimal digits of the SHA-256 of JSON content."""
    return reading.digest(content)[: reading.SHORTEST]
