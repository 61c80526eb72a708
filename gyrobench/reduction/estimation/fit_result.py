"""From a linear fit to a result: what every test method needs beside its design matrix, its formulas and its tables.

    fitted = fit(quantities, X, y, t_start, t_end, groups, "drift rate", "°/h", units.factor("deg/h"))
    effects = [Effect("torquer scale factor", setup.u_scale_factor, "1", fitted.error(-k * current))]
    result = linear_result(fitted, system="...", title="...", ..., effects=effects, specification=limits)

Two channels measured at once: one result each, then merge_channels.  Everything inside is SI; what a
Result holds is in the printed unit of each quantity.  [RED-OLS, RED-GLS; uncertainties of type B by the chain rule]
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator, Mapping, Sequence
from contextvars import ContextVar
from dataclasses import replace
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.estimation import asked, outliers, regression, uncertainty
from gyrobench.reduction.estimation.effects import (
    TOUCHED,
    Effect,
    budget_rows,
    correction_table,
    simulated_table,
    standard_changes,
)
from gyrobench.reduction.estimation.findings import Findings, Group
from gyrobench.reduction.estimation.linear_fit import fit
from gyrobench.reduction.estimation.quantity import Quantity
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import BudgetLine, Coefficient, DriftTestResult, Specification

__all__ = ["Findings", "Group", "Quantity", "ReductionError", "fit", "linear_result", "observed_fits", "plus_minus"]

CONDITION = 100.0  # above this a warning names the weakest direction
_observers: ContextVar[tuple[list[tuple[Findings, Array]], ...]] = ContextVar("observers", default=())


@contextlib.contextmanager
def observed_fits() -> Iterator[list[tuple[Findings, Array]]]:
    """Collect the fits that linear_result() reports while the block runs, each with what one standard uncertainty of
    every source of type B changes (parts, q), SI: a prediction of u needs the design matrix and not the numbers alone.
    """
    seen: list[tuple[Findings, Array]] = []
    token = _observers.set((*_observers.get(), seen))
    try:
        yield seen
    finally:
        _observers.reset(token)


def linear_result(
    fit: Findings, *, system: str, title: str, method: str, sources: Sequence[str], equation: str,
    conventions: Sequence[str], effects: Sequence[Effect] = (), specification: Specification | None = None,
    site: Mapping[str, Any] | None = None, instrument: str = "", simulated: bool | None = None,
    no_closed: str = "", closed_caption: str = "From the same data", tables: Sequence[dict[str, Any]] = (),
    harmonics: Sequence[dict[str, Any]] = (), repeatability: Mapping[str, Any] | None = None,
    warnings: Sequence[str] = (), summary: Sequence[str] = (), random: str = "random drift and reading noise",
    robust: bool = False, errors: Mapping[str, float] | None = None,
) -> DriftTestResult:  # fmt: skip
    """Return the result of a fit: coefficients with type A and B, verdicts, budget, plots, tests, tables.

    equation: Typst math.  conventions, warnings, summary: sentences.  specification: name -> limits in the printed
    unit.  no_closed: why there are no values of the source's formulas, if there should be.  tables: the method's own,
    {"title", "caption", "columns", "rows"}; a table of closed formulas is put before them where quantities have any.
    simulated: whether truth is known (None: by the quantities).  random: the type A line of the budget.
    robust: a table with a robust fit beside this one.  errors: those of a simulated set-up by their source, SI, see
    gyrobench.reduction.setup.simulated_errors.
    """
    by_source = [standard_changes(fit, e) for e in effects]
    rows = np.vstack([np.zeros((1, fit.value.size)), *by_source])
    for seen in _observers.get():
        seen.append((fit, rows[1:]))
    coefficients = [_coefficient(fit, j, rows[:, j].tolist(), specification or {}) for j in range(rows.shape[1])]
    slow_warnings = _judge_slow_drift(fit, coefficients, rows)
    design = fit.est.design
    odd = outliers.find(fit)
    beside = [*outliers.tables(fit, odd), *(outliers.robust(fit) if robust and asked.whole() else [])]
    fit_warnings = [*outliers.warnings(fit, odd), *fit.est.warnings, *fit.warnings()]
    if no_closed:
        fit_warnings.append(f"No closed-form estimates: {no_closed}.")
    if design.condition > CONDITION:
        fit_warnings.append(
            f"The condition number is {design.condition:.3g} (limit {CONDITION:g}). The least-determined combination "
            f"is {design.weakest}; errors of the model are amplified in it."
        )
    result = DriftTestResult(
        system=system,
        title=title,
        method=method,
        sources=list(sources),
        equation=equation,
        conventions=list(conventions),
        coefficients=coefficients,
        series=fit.series(),
        correlation=regression.correlation(fit.reported.covariance).tolist(),
        condition=design.condition,
        rank=design.rank,
        dof=float(fit.dof),
        noise=fit.noise(),
        tests=list(fit.tests),
        residual_std=fit.residual_std,
        residual_unit=fit.y_unit,
        acf=fit.acf(),
        allan=fit.allan(),
        psd=fit.psd(),
        harmonics=list(harmonics),
        budget=budget_lines(fit, effects, random),
        type_b=changes_by_source(fit, effects, by_source),
        repeatability=dict(repeatability or {}),
        tables=[
            *correction_table(fit),
            *simulated_table(fit, effects, errors),
            *_closed_table(fit, closed_caption),
            *tables,
            *fit.nuisance_tables(),
            *beside,
        ],
        warnings=[*slow_warnings, *fit_warnings, *warnings],
        summary=[*summary, *fit.nuisance_sentences()],
        decision_rule=f"{uncertainty.DECISION_RULE} {uncertainty.SLOW_RULE}",
        verdict=uncertainty.worst_verdict(c.verdict for c in coefficients),
        site=dict(site or {}),
        instrument=instrument,
        simulated=any(q.truth is not None for q in fit.quantities) if simulated is None else simulated,
    )
    for e in effects:
        if e.needed and not e.size:
            touched = np.sqrt(np.sum(e.changes(fit) ** 2, axis=0)) > TOUCHED
            names = [q.title for q, t in zip(fit.quantities, touched, strict=True) if t]
            uncertainty.withhold(result, [f"Of {', '.join(names)}: {e.needed}"], ["pass"], names)
    return uncertainty.withhold(result, _contradictions(fit))


def _contradictions(fit: Findings) -> list[str]:
    """Return why the coverage intervals do not hold what they state, as a sentence; nothing where they may."""
    broken = "; ".join(f"{t.name} {uncertainty.p_text(t.p or 0.0)}, {t.finding}" for t in fit.broken())
    against = [f"The residuals contradict the model or its noise ({broken})."] if broken else []
    return against + fit.implausible_nuisances()


def plus_minus(c: Coefficient) -> str:
    """ "−0.3001 ± 0.0023 °/h (95 %)": expanded uncertainty with two digits."""
    U = c.k * c.u
    if not U > 0.0 or not math.isfinite(U):
        return f"{c.estimate:.6g} {c.unit}".replace("-", "−")
    digits = 1 - math.floor(math.log10(U))
    shown = max(0, digits)
    return f"{round(c.estimate, digits):.{shown}f} ± {round(U, digits):.{shown}f} {c.unit} (95 %)".replace("-", "−")


def _coefficient(fit: Findings, j: int, contributions: Sequence[float], limits: Specification) -> Coefficient:
    q, r = fit.quantities[j], fit.reported
    u, U = uncertainty.combine_uncertainties(float(r.u[j]), float(r.half_width[j]), contributions)
    limit = limits.get(q.title, limits.get(q.name))
    estimate, u_s, U_s = float(r.value[j]) / q.scale, u / q.scale, U / q.scale
    truth = None if q.truth is None else q.truth / q.scale
    u_a, dof = float(r.u[j]) / q.scale, float(r.dof[j])
    c = Coefficient(
        name=q.title,
        meaning=q.meaning,
        unit=q.unit,
        estimate=estimate,
        u=u_s,
        k=U / u if u > 0.0 else uncertainty.NORMAL,
        interval=(estimate - U_s, estimate + U_s),
        t=estimate / u_a if u_a > 0.0 else None,
        p=float(r.p[j]) if u_a > 0.0 else None,
        u_a=u_a,
        dof=dof if math.isfinite(dof) else None,
        closed=None if q.closed is None else q.closed / q.scale,
        truth=truth,
        z=(estimate - truth) / u_s if truth is not None and u_s > 0.0 else None,
        limit=limit,
        verdict=uncertainty.assess_conformity(estimate, U_s, limit),
        combination=dict(q.combination or {q.name: 1.0}),
    )
    return replace(c, z=None) if fit.ideal else c  # u is rounding: nothing to compare with


def _judge_slow_drift(fit: Findings, coefficients: list[Coefficient], contributions: Array) -> list[str]:
    """Make verdicts inconclusive that slow drift, which the record does not exclude, would take back; say so."""
    if all(c.verdict not in ("pass", "fail") for c in coefficients):
        return []
    probability, widening = fit.if_slow()
    turned = []
    for j, c in enumerate(coefficients):
        half = float(fit.reported.half_width[j] * widening[j])
        _, U = uncertainty.combine_uncertainties(0.0, half, contributions[:, j].tolist())
        U /= fit.quantities[j].scale
        if c.verdict in ("pass", "fail") and uncertainty.assess_conformity(c.estimate, U, c.limit) != c.verdict:
            coefficients[j] = replace(c, verdict="inconclusive")
            turned.append(f"{c.name} (U = {U:.2g} {c.unit})")
    if not turned:
        return []
    return [
        f"Inconclusive: {', '.join(turned)}. The noise may be slow drift, which this record does not tell from white "
        f"noise (probability {probability:.2g}), and then U is as given here. A longer record tells."
    ]


def budget_lines(fit: Findings, effects: Sequence[Effect], random: str) -> list[BudgetLine]:
    """Return the lines of the budget of each value: ``random``, of type A, then every source that has a size."""
    lines = []
    note = "Type A, from the residuals" + ("" if fit.white else " under the estimated noise model")
    sources = [(e.unit, *row) for e in effects for row in budget_rows(fit, e)]
    for j, q in enumerate(fit.quantities):
        u_a = float(fit.u[j]) / q.scale
        lines.append(BudgetLine(random, u_a, q.unit, 1.0, "1", u_a, q.unit, q.title, note))
        for unit, source, size, changes, said in sources:
            change = float(changes[j]) / q.scale
            if size > 0.0 and abs(change) * size > 1e-9 * u_a:
                per = q.unit if unit == "1" else f"{q.unit}/{unit}"
                lines.append(BudgetLine(source, size, unit, change, per, abs(change) * size, q.unit, q.title, said))
    return lines


def changes_by_source(fit: Findings, effects: Sequence[Effect], changes: Sequence[Array]) -> list[dict[str, Any]]:
    """Return what one standard uncertainty of each source does to all estimates: its independent parts in rows."""
    scale = np.array([q.scale for q in fit.quantities])
    pairs = zip(effects, changes, strict=True)
    return [{"source": e.source, "changes": (c / scale).tolist()} for e, c in pairs if np.any(c)]


def _closed_table(fit: Findings, caption: str) -> list[dict[str, Any]]:
    rows: list[list[Any]] = []
    for j, q in enumerate(fit.quantities):
        if q.closed is not None:
            a, b = float(fit.value[j]) / q.scale, q.closed / q.scale
            rows.append([q.name, a, b, a - b, float(fit.u[j]) / q.scale, q.unit])
    head = ["coefficient", "least squares", "closed form", "difference", "u", "unit"]
    title = "Least squares and closed form"
    return [{"title": title, "caption": caption, "columns": head, "rows": rows}] if rows else []
