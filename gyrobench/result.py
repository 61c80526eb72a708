"""The one object every reduction returns and every report renders.

Numbers are in surface units (the unit stands beside them); nothing here computes.  HTML, PDF and
``result.json`` are all rendered from one ``Result``, so a number is the same number everywhere.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

Limit = tuple[float | None, float | None]  # low and high, in the unit of the report; None: that side is open
Specification = Mapping[str, Limit]  # coefficient -> limit: what a result is judged by


@dataclass
class Coefficient:
    """One estimated quantity, or one inseparable combination under the combination's name."""

    name: str  # "D_I"; a combination: "D_F + D_OO·X²"
    meaning: str
    unit: str  # "°/h/g"
    estimate: float
    u: float  # combined standard uncertainty
    k: float  # coverage factor of the 95 % interval
    interval: tuple[float, float]
    t: float | None = None  # estimate / u of type A
    p: float | None = None  # two-sided p of t
    u_a: float | None = None  # type A part of u
    dof: float | None = None
    closed: float | None = None  # the source's closed formula (corrected), same unit
    truth: float | None = None  # simulated runs only
    z: float | None = None  # (estimate - truth) / u
    limit: Limit | None = None
    verdict: str = "no specification given"  # pass | fail | inconclusive | no specification given
    combination: dict[str, float] = field(default_factory=dict)  # of model coefficients, printed units; {}: its name


@dataclass
class Series:
    """A measured quantity against a position or a time, with its fit."""

    label: str  # "mount 1: output axis along the pole"
    x: list[float]
    x_name: str  # "table angle"
    x_unit: str  # "°"
    y: list[float]
    fit: list[float]
    residual: list[float]
    y_name: str  # "drift rate"
    y_unit: str  # "°/h"
    t: list[float] = field(default_factory=list)  # mid time of each window, s
    shown_fit_x: list[float] = field(default_factory=list)  # dense curve for the plot
    shown_fit_y: list[float] = field(default_factory=list)


@dataclass
class Test:
    """A statistical test of the residuals or of repeatability."""

    name: str
    statistic: float
    p: float | None
    what: str  # what it looks for, in words
    finding: str  # what it says here, in words


@dataclass
class BudgetLine:
    """One line of the error budget; contribution = |sensitivity| * size, all as standard uncertainties."""

    source: str
    size: float
    size_unit: str
    sensitivity: float
    sensitivity_unit: str
    contribution: float
    unit: str
    coefficient: str  # which coefficient it touches
    note: str = ""


@dataclass
class Response:
    """A measured response of a loop, with the curves of its linear models laid over it.

    kind: "loop" (open loop gain: Bode plot with margins), "ratio" (a gain against frequency), "step" (against time),
    "time" (several quantities against time: all of them in curves, y is the one that runs are compared by).
    x: Hz or s, rising.  y: gain (positive) or value.  phase: degrees, [] for a step.  u: standard uncertainty, relative
    of a gain (u rad of its phase too), in y_unit of a step; None: not known.  curves: {"label", "x", "y", "phase"}.
    """

    name: str
    kind: str
    caption: str
    x: list[float]
    x_name: str
    x_unit: str
    y: list[float]
    y_name: str
    y_unit: str
    phase: list[float] = field(default_factory=list)
    u: list[float | None] = field(default_factory=list)
    coherence: list[float] = field(default_factory=list)
    curves: list[dict[str, Any]] = field(default_factory=list)


@dataclass
class Result:
    """What a reduction found.  Every field is JSON-able through :meth:`as_dict`."""

    system: str
    title: str
    method: str  # one line, with its source
    sources: list[str]  # "TEST-TUMBLE1-SDF; Hu 1981, eq. 3-12..3-21"
    equation: str  # model equation, Typst math
    conventions: list[str]  # sign and axis conventions, a sentence each
    coefficients: list[Coefficient]
    series: list[Series]
    correlation: list[list[float]]  # of the estimates, order of `coefficients`
    condition: float
    rank: int
    dof: float
    noise: dict[str, Any]  # {"model": "white" | "ar1" ..., "sigma": .., "tau": .., units in the names}
    tests: list[Test]
    residual_std: float
    residual_unit: str
    acf: dict[str, list[float]] = field(default_factory=dict)  # lag, rho, bound
    allan: dict[str, Any] = field(default_factory=dict)  # tau, dev, lo, hi, slopes; unit
    psd: dict[str, Any] = field(default_factory=dict)  # f, S; unit
    harmonics: list[dict[str, Any]] = field(default_factory=list)  # {"series", "n", "a", "b", "u"}
    budget: list[BudgetLine] = field(default_factory=list)
    type_b: list[dict[str, Any]] = field(default_factory=list)  # {"source", "changes": independent parts x estimates}
    repeatability: dict[str, Any] = field(default_factory=dict)
    step_check: dict[str, Any] = field(default_factory=dict)  # {"step", "rows": [{name, change, u, ratio}], "worst"}
    tables: list[dict[str, Any]] = field(default_factory=list)  # method's own: {"title","caption","columns","rows"}
    warnings: list[str] = field(default_factory=list)
    summary: list[str] = field(default_factory=list)  # the three numbers that matter, as sentences
    decision_rule: str = ""
    verdict: str = "no specification given"
    site: dict[str, Any] = field(default_factory=dict)
    instrument: str = ""
    simulated: bool = True
    provenance: dict[str, Any] = field(default_factory=dict)  # run.json of the record, date, operator
    ranked_by: str = ""  # the coefficient that ranks runs in a comparison, smallest first
    responses: list[Response] = field(default_factory=list)  # of loops
    suite: dict[str, Any] = field(
        default_factory=dict
    )  # of several tests: see gyrobench.reduction.suite.method_comparison

    def as_dict(self) -> dict[str, Any]:
        return asdict(self)

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Result:
        """The inverse of :meth:`as_dict`; raises TypeError for an unknown field."""
        d = dict(data)
        d["coefficients"] = [Coefficient(**c) for c in d["coefficients"]]
        d["series"] = [Series(**s) for s in d["series"]]
        d["tests"] = [Test(**t) for t in d["tests"]]
        d["budget"] = [BudgetLine(**b) for b in d.get("budget", [])]
        d["responses"] = [Response(**r) for r in d.get("responses", [])]
        for c in d["coefficients"]:
            c.interval = tuple(c.interval)
            c.limit = tuple(c.limit) if c.limit is not None else None
        return cls(**d)
