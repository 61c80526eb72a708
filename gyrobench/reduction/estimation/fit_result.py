"""From a linear fit to what a test has found: estimates with their budget, tables, figures, reasons against them.

Everything inside is SI; what a result holds is in the printed unit of each quantity.  There is no limit and no verdict
here (gyrobench.reduction.estimation.verdict).  [RED-OLS, RED-GLS; uncertainties of type B by the chain rule]
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator, Mapping, Sequence
from contextvars import ContextVar
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.estimation import asked, outliers, regression, uncertainty
from gyrobench.reduction.estimation.effects import (
    TOUCHED,
    budget_rows,
    correction_table,
    simulated_table,
    standard_changes,
)
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.estimation.sentences import p_text, plain
from gyrobench.reduction.estimation.truth_check import compared
from gyrobench.reduction.estimation.verdict import DECISION_RULE, SLOW_RULE
from gyrobench.reduction.setup.setups import Setup
from gyrobench.reduction.setup.sources import Effect
from gyrobench.result import BudgetLine, Coefficient, DriftTestResult, Harmonic, Reason, Table, TypeB

CONDITION = 100.0  # above this a warning names the weakest direction
TYPE_A = "type_a"  # id of the line of a budget
CLOSED = "closed_form"  # id of the table
UNSTATED = ".unstated"  # how the ids of reasons end that ask for a statement, and say nothing against the record
CONTRADICTED = "residuals.contradict"
_observers: ContextVar[tuple[list[tuple[Findings, Array]], ...]] = ContextVar("observers", default=())


@dataclass(frozen=True, kw_only=True)
class Account:
    """What a test says of itself, beside its figures.

    equation: Typst math.  conventions, summary: sentences.  no_closed: why there are no values of the source's
    formulas, if there should be.  tables: the method's own; one of closed formulas is put before them where quantities
    have any.  random: the type A line of the budget.
    """

    method: str
    sources: Sequence[str]
    equation: str
    conventions: Sequence[str]
    no_closed: str = ""
    closed_caption: str = "From the same data"
    tables: Sequence[Table] = ()
    harmonics: Sequence[Harmonic] = ()
    repeatability: Mapping[str, Any] = field(default_factory=dict)
    reasons: Sequence[Reason] = ()
    title: str = ""  # where it is not that of the system
    random: str = "random drift and reading noise"

    def statements(self) -> dict[str, Any]:
        """Return the fields of a result that are the test's own words and figures."""
        lists = {n: list(getattr(self, n)) for n in ("sources", "conventions", "harmonics")}
        words = {n: getattr(self, n) for n in ("title", "method", "equation")}
        return {**words, **lists, "repeatability": dict(self.repeatability)}


#: of a measured record: readings in steps larger than their noise can lie on the model to the last digit
NO_RESIDUALS = Reason(
    "noise.none",
    "The data lie on the model to the last digit, which measured ones do not: they are computed, read in steps "
    "larger than their noise, or of a rate that is not answered; u holds none of these.",
    ("pass", "fail"),
    severity="doubt",
)


@contextlib.contextmanager
def observed_fits() -> Iterator[list[tuple[Findings, Array]]]:
    """Collect the fits that are reported while the block runs, each with what one standard uncertainty of
    every source of type B changes (parts, q), SI: a prediction of u needs the design matrix and not the numbers alone.
    """
    seen: list[tuple[Findings, Array]] = []
    token = _observers.set((*_observers.get(), seen))
    try:
        yield seen
    finally:
        _observers.reset(token)


def fit_result(fit: Findings, account: Account, effects: Sequence[Effect], setup: Setup) -> DriftTestResult:
    """Return what a fit has found: coefficients with type A and B, budget, plots, tests, tables, reasons."""
    by_source = [standard_changes(fit, e) for e in effects]
    rows = np.vstack([np.zeros((1, fit.value.size)), *by_source])
    for seen in _observers.get():
        seen.append((fit, rows[1:]))
    coefficients = [coefficient(fit, j, rows[:, j].tolist()) for j in range(rows.shape[1])]
    odd = outliers.find(fit)
    simulated = setup.simulated or setup.truth is not None or any(q.truth is not None for q in fit.quantities)
    robust = outliers.robust(fit) if setup.robust and asked.whole() else []
    return DriftTestResult(
        **account.statements(),
        **_numbers(fit),
        coefficients=coefficients,
        budget=budget_lines(fit, effects, account.random),
        type_b=changes_by_source(fit, effects, by_source),
        tables=[
            *correction_table(fit),
            *simulated_table(fit, effects, setup.errors),
            *_closed_table(fit, account.closed_caption),
            *account.tables,
            *fit.nuisance_tables(),
            *outliers.tables(fit, odd),
            *robust,
        ],
        reasons=[
            *_contradictions(fit),
            *([] if (simulated and not setup.in_steps) or not fit.ideal else [NO_RESIDUALS]),
            *_unstated(fit, effects),
            *_slow_drift(fit, coefficients, rows),
            *outliers.warnings(fit, odd),
            *fit.warnings(),
            *(
                [Reason("closed_form.none", f"No closed-form estimates: {account.no_closed}.")]
                * bool(account.no_closed)
            ),
            *_ill_conditioned(fit),
            *account.reasons,
        ],
        decision_rule=f"{DECISION_RULE} {SLOW_RULE}",
        simulated=simulated,
        **setup.stated(),
    )


def _numbers(fit: Findings) -> dict[str, Any]:
    """Return fields of a result: what the fit says of the data as a whole, and of its residuals."""
    return {
        "series": fit.series(),
        "correlation": regression.correlation(fit.reported.covariance).tolist(),
        "condition": fit.est.design.condition,
        "rank": fit.est.design.rank,
        "dof": float(fit.dof),
        "noise": fit.noise(),
        "tests": list(fit.tests),
        "residual_std": fit.residual_std,
        "residual_unit": fit.y_unit,
        "acf": fit.acf(),
        "allan": fit.allan(),
        "psd": fit.psd(),
        "ideal": fit.ideal,
    }


def with_values(result: DriftTestResult, more: Sequence[Coefficient]) -> DriftTestResult:
    """Return the result with values that are not unknowns of its fit behind its coefficients.

    Their correlation with them is not given, and what is said against the fit is not against them.
    """
    n, m, of_fit = len(result.coefficients), len(more), tuple(result.names)
    correlation = np.eye(n + m)
    correlation[:n, :n] = result.correlation
    return replace(
        result,
        coefficients=[*result.coefficients, *more],
        correlation=correlation.tolist(),
        reasons=[replace(r, names=r.names or of_fit) if r.blocks else r for r in result.reasons],
    )


def coefficient(fit: Findings, j: int, contributions: Sequence[float] = ()) -> Coefficient:
    """Return the estimate of quantity j; contributions: what one standard uncertainty of each source changes, SI."""
    q, r = fit.quantities[j], fit.reported
    u, U = uncertainty.combine_uncertainties(float(r.u[j]), float(r.half_width[j]), contributions)
    estimate, u_s, U_s = float(r.value[j]) / q.scale, u / q.scale, U / q.scale
    truth = None if q.truth is None else q.truth / q.scale
    u_a, dof = float(r.u[j]) / q.scale, float(r.dof[j])
    k, interval = U / u if u > 0.0 else uncertainty.NORMAL, (estimate - U_s, estimate + U_s)
    free = dof if math.isfinite(dof) else None
    c = Coefficient(q.title, q.meaning, q.unit, estimate, u_s, k, interval, u_a=u_a, dof=free)
    c = replace(c, truth=truth) if fit.ideal else compared(c, truth)  # u of ideal data is rounding
    return replace(
        c,
        t=estimate / u_a if u_a > 0.0 else None,
        p=float(r.p[j]) if u_a > 0.0 else None,
        closed=None if q.closed is None else q.closed / q.scale,
        combination=dict(q.combination or {q.name: 1.0}),
        stands_for=q.name if q.shown else "",
    )


def _contradictions(fit: Findings) -> list[Reason]:
    """Return why the coverage intervals do not hold what they state; nothing where they may."""
    broken = "; ".join(f"{t.name} {p_text(t.p or 0.0)}, {t.finding}" for t in fit.broken())
    text = f"The residuals contradict the model or its noise ({broken})."
    against = [Reason(CONTRADICTED, text, ("pass", "fail"), severity="doubt")] if broken else []
    return against + fit.implausible_nuisances()


def _unstated(fit: Findings, effects: Sequence[Effect]) -> list[Reason]:
    """Return what nothing passes without: the size of a source that this plan cannot show."""
    found = []
    for e in effects:
        if e.needed and not e.size:
            touched = np.sqrt(np.sum(e.changes(fit) ** 2, axis=0)) > TOUCHED
            names = tuple(q.title for q, t in zip(fit.quantities, touched, strict=True) if t)
            text = f"Of {', '.join(names)}: {e.needed}"
            found.append(Reason(f"{e.id}{UNSTATED}", text, ("pass",), names, severity="doubt"))
    return found


def _slow_drift(fit: Findings, coefficients: Sequence[Coefficient], contributions: Array) -> list[Reason]:
    """Return that the noise may be slow drift, not excluded by the record: verdicts must hold for it."""
    probability, widening = fit.if_slow()
    intervals = {}
    for j, c in enumerate(coefficients):
        half = float(fit.reported.half_width[j] * widening[j])
        _, U = uncertainty.combine_uncertainties(0.0, half, contributions[:, j].tolist())
        U /= fit.quantities[j].scale
        if widening[j] > 1.0:
            intervals[c.name] = (c.estimate - U, c.estimate + U)
    if not intervals:
        return []
    text = (
        "The noise may be slow drift, which this record does not tell from white noise (probability "
        f"{plain(probability)}); U would then be larger. Record longer to decide."
    )
    return [Reason("noise.slow", text, ("pass", "fail"), severity="condition", intervals=intervals)]


def _ill_conditioned(fit: Findings) -> list[Reason]:
    design = fit.est.design
    if design.condition <= CONDITION:
        return []
    text = (
        f"The condition number is {plain(design.condition, 3)} (limit {CONDITION:g}). The least-determined combination "
        f"is {design.weakest}; errors of the model are amplified in it."
    )
    return [Reason("design.ill_conditioned", text)]


def budget_lines(fit: Findings, effects: Sequence[Effect], random: str) -> list[BudgetLine]:
    """Return the lines of the budget of each value: ``random``, of type A, then every source that has a size."""
    lines = []
    note = "Type A, from the residuals" + ("" if fit.white else " under the estimated noise model")
    sources = [(e.id, e.unit, *row) for e in effects for row in budget_rows(fit, e)]
    for j, q in enumerate(fit.quantities):
        u_a = float(fit.u[j]) / q.scale
        lines.append(BudgetLine(TYPE_A, random, u_a, q.unit, 1.0, "1", u_a, q.unit, q.title, note))
        for id, unit, source, size, changes, said in sources:
            change = float(changes[j]) / q.scale
            if size > 0.0 and abs(change) * size > 1e-9 * u_a:
                per = q.unit if unit == "1" else f"{q.unit}·{unit[2:]}" if unit.startswith("1/") else f"{q.unit}/{unit}"
                line = (size, unit, change, per, abs(change) * size, q.unit, q.title, said)
                lines.append(BudgetLine(id, source, *line))
    return lines


def changes_by_source(fit: Findings, effects: Sequence[Effect], changes: Sequence[Array]) -> list[TypeB]:
    """Return what one standard uncertainty of each source does to all estimates: its independent parts in rows."""
    scale = np.array([q.scale for q in fit.quantities])
    pairs = zip(effects, changes, strict=True)
    return [TypeB(e.id, e.source, (c / scale).tolist()) for e, c in pairs if np.any(c)]


def _closed_table(fit: Findings, caption: str) -> list[Table]:
    rows: list[list[Any]] = []
    for j, q in enumerate(fit.quantities):
        if q.closed is not None:
            a, b = float(fit.value[j]) / q.scale, q.closed / q.scale
            rows.append([q.name, a, b, a - b, float(fit.u[j]) / q.scale, q.unit])
    head = ["coefficient", "least squares", "closed form", "difference", "u", "unit"]
    return [Table(CLOSED, "Least squares and closed form", caption, head, rows)] if rows else []
