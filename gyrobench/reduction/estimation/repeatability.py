"""The same test repeated - on several days, after several turn-ons: mean, scatter, and what the scatter means.

    mean x = sum x_i / n        sigma = sqrt(sum (x_i - x)^2 / (n - 1))        u(x) = sigma / sqrt(n), t of n - 1

sigma is the random drift from day to day (the measure of stability in Hu 1981), u that of the mean.  Whether
it is more than each day's own uncertainty explains is a chi-squared test, sum ((x_i - x)/u_i)^2 with n - 1 degrees of
freedom for equal u_i.  [TEST-8POS, T3-1-MEAN, T3-1-SIGMA; Hu 1981, ch. 3 par. 2.3, Table 3-1]

Not modelled: trend over the days (a table in the order of time shows it), days of different weight.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import special

from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.reduction.estimation import uncertainty
from gyrobench.reduction.estimation.fit_result import TYPE_A
from gyrobench.reduction.estimation.nuisances import NUISANCES
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.estimation.truth_check import compared
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import BudgetLine, Coefficient, DriftTestResult, Reason, Series, Table, Test

REPEATS = "repeats"  # id of the tests of constancy, with the coefficient


@dataclass(frozen=True)
class Statistics:
    """n values: mean, standard deviation with n - 1 (nan for one), standard uncertainty of the mean."""

    n: int
    mean: float
    sigma: float
    u: float


def statistics(values: Sequence[float], about: float | None = None) -> Statistics:
    """``about``: the value that deviations are taken from in place of the mean (Hu 1981 rounds its means).

    Raises ReductionError for no values or one that is no finite number.
    """
    x = np.asarray(values, dtype=float)
    if x.size == 0 or not np.all(np.isfinite(x)):
        raise ReductionError(f"{x.size} values: at least one is needed, all of them finite")
    mean = float(np.mean(x))
    if x.size == 1:
        return Statistics(1, mean, math.nan, math.nan)
    sigma = math.sqrt(float(np.sum((x - (mean if about is None else about)) ** 2)) / (x.size - 1))
    return Statistics(int(x.size), mean, sigma, sigma / math.sqrt(x.size))


def agreement(values: Sequence[float], u: Sequence[float]) -> tuple[float, float]:
    """Return chi-squared and its probability that values of uncertainties ``u`` are those of one quantity."""
    x, w = np.asarray(values, dtype=float), 1.0 / np.asarray(u, dtype=float) ** 2
    q = float(np.sum(w * (x - np.sum(w * x) / np.sum(w)) ** 2))
    return q, float(special.chdtrc(x.size - 1, q))


def reduce_days(record: Record, reduce: Callable[[Mapping[str, Array]], DriftTestResult]) -> DriftTestResult:
    """Return the result of a record, day by day where its plan holds several.  Raises ReductionError."""
    day = {row.phase: row.day for row in record.run.plan}
    names = np.array([day.get(int(p), "") for p in record.windows["phase"]])
    each = {}
    for name in dict.fromkeys(names.tolist()) or [""]:
        try:
            each[name] = reduce({n: np.asarray(v)[names == name] for n, v in record.windows.items()})
        except ReductionError as error:
            raise ReductionError([f"day {name}: {p}" if name else p for p in error.problems]) from None
    return combine_days(each) if len(each) > 1 else next(iter(each.values()))


def combine_days(results: Mapping[str, DriftTestResult]) -> DriftTestResult:
    """One result of repeats (name of the day -> its result) with the same coefficients.

    Estimates are means over the days with the scatter of the days as type A; a day's type B part is taken as common
    to all days.  Set-up effects that joined the nuisance model of some days only are left to those days.  Series: each
    coefficient against the number of the day.  Raises ReductionError for fewer than two days or coefficients that are
    not the same.
    """
    if len(results) < 2:
        raise ReductionError(f"{len(results)} day: at least two are needed for a scatter from day to day")
    results = _without_own_effects(results)
    days, parts = list(results), list(results.values())
    names = [c.name for c in parts[0].coefficients]
    for day, r in results.items():
        if [c.name for c in r.coefficients] != names:
            raise ReductionError(f"day {day}: coefficients differ from those of day {days[0]}; reduce them alike")
    n = len(parts)
    table = np.array([[c.estimate for c in r.coefficients] for r in parts])
    coefficients, series, tests, budget = [], [], [], []
    for j, name in enumerate(names):
        per_day = [r.coefficients[j] for r in parts]
        coefficients.append(_mean(per_day))
        stats = statistics(table[:, j].tolist())
        u_own = [c.u_a or 0.0 for c in per_day]
        if min(u_own) > 0.0 and stats.sigma > 1e-9 * float(np.max(np.abs(table[:, j]))):
            q, p = agreement(table[:, j].tolist(), u_own)
            text = "varies from day to day by more than its noise" if p < 0.05 else "constant within its noise"
            tests.append(Test(f"{REPEATS}:{name}", f"day to day, {name}", q, p, "change between the days", text))
        c, x, y = coefficients[-1], np.arange(1.0, n + 1.0), table[:, j]
        series.append(Series.of(name, (x, "day", ""), (y, name, c.unit), [stats.mean] * n, y - stats.mean, x))
        note = f"Type A, standard deviation over {n} days divided by √{n}"
        size = (stats.u, c.unit, 1.0, "1", stats.u, c.unit, name, note)
        budget.append(BudgetLine(TYPE_A, "repeatability from day to day", *size))
        budget += [b for b in parts[0].budget if b.coefficient == name and b.id != TYPE_A]
    varying = [t.id.partition(":")[2] for t in tests if t.p is not None and t.p < 0.05]
    variation = f"{', '.join(varying)} vary" if varying else "no coefficient varies"
    first = parts[0]
    scatter = replace(  # what the residuals of one day show is not of the mean
        first,
        dof=float(n - 1),
        noise={"model": f"standard deviation over {n} days, treated as independent"},
        residual_std=math.sqrt(float(np.mean([r.residual_std**2 for r in parts]))),
        acf=None, allan=None, psd=None, harmonics=[],
    )  # fmt: skip
    return replace(
        scatter,
        coefficients=coefficients,
        series=series,
        correlation=_correlation(table) if n > 2 else first.correlation,
        tests=tests,
        budget=budget,
        repeatability={f"σ of {c.name} / ({c.unit})": statistics(table[:, j].tolist()).sigma
                       for j, c in enumerate(first.coefficients)},
        tables=[_table(days, parts, table),
                *(replace(t, id=f"{t.id}:{days[0]}", title=f"{t.title}, day {days[0]}") for t in first.tables)],
        reasons=_reasons(results),
        summary=[
            f"{n} days; {variation} from day to day by more than noise.", *_few(coefficients, table)
        ],
    )  # fmt: skip


def _reasons(results: Mapping[str, DriftTestResult]) -> list[Reason]:
    """Return what limits the days: a warning of several once, a doubt of one with its day."""
    found = [
        r if r.severity in ("error", "warning") else replace(r, text=f"day {day}: {r.text}", names=(), intervals={})
        for day, result in results.items()
        for r in result.reasons
        if r.severity != "condition"
    ]
    return list(dict.fromkeys(found))


def _without_own_effects(results: Mapping[str, DriftTestResult]) -> dict[str, DriftTestResult]:
    """The results without the effects of their nuisance models that are not among the coefficients of all."""
    of_all = set.intersection(*({c.name for c in r.coefficients} for r in results.values()))
    out = {}
    for day, r in results.items():
        effects = {row[0] for t in r.tables if t.kind == NUISANCES for row in t.rows}
        kept = [j for j, c in enumerate(r.coefficients) if c.name in of_all or c.name not in effects]
        correlation = [[r.correlation[i][j] for j in kept] for i in kept]
        changes = [replace(b, changes=[[row[j] for j in kept] for row in b.changes]) for b in r.type_b]
        out[day] = replace(r, coefficients=[r.coefficients[j] for j in kept], correlation=correlation, type_b=changes)
    return out


def _few(coefficients: list[Coefficient], table: Array) -> list[str]:
    sigma = [statistics(column).sigma for column in table.T.tolist()]
    both = list(zip(coefficients, sigma, strict=True))[:2]
    return [f"{c.name} = {plain(c.estimate, 6)} {c.unit}, σ over the days {plain(s)} {c.unit}." for c, s in both]


def _mean(per_day: list[Coefficient]) -> Coefficient:
    stats = statistics([c.estimate for c in per_day])
    half = float(special.stdtrit(stats.n - 1, 0.975)) * stats.u
    common = math.sqrt(float(np.mean([max(c.u**2 - (c.u_a or 0.0) ** 2, 0.0) for c in per_day])))
    u, U = uncertainty.combine_uncertainties(stats.u, half, [common])
    first = per_day[0]
    closed = [c.closed for c in per_day if c.closed is not None]
    truth = [c.truth for c in per_day if c.truth is not None]
    true = float(np.mean(truth)) if len(truth) == len(per_day) else None
    t = stats.mean / stats.u if stats.u > 0.0 else None
    k, interval = U / u if u > 0.0 else uncertainty.NORMAL, (stats.mean - U, stats.mean + U)
    mean = replace(first, estimate=stats.mean, u=u, k=k, interval=interval, u_a=stats.u, dof=float(stats.n - 1))
    return replace(
        compared(mean, true),
        t=t,
        p=None if t is None else float(2.0 * special.stdtr(stats.n - 1, -abs(t))),
        closed=float(np.mean(closed)) if len(closed) == len(per_day) else None,
    )


def _correlation(table: Array) -> list[list[float]]:
    deviation = table - table.mean(axis=0)
    size = np.sqrt(np.sum(deviation * deviation, axis=0))
    safe = np.where(size > 0.0, size, 1.0)
    out = np.clip(deviation.T @ deviation / np.outer(safe, safe), -1.0, 1.0)
    np.fill_diagonal(out, 1.0)
    matrix: list[list[float]] = out.tolist()
    return matrix


def _table(days: list[str], parts: list[DriftTestResult], table: Array) -> Table:
    """Like Table 3-1: a row for each day, then mean and standard deviation; under it the days' own u of type A."""
    per_coefficient = [statistics(column) for column in table.T.tolist()]
    u_own = [
        float(np.sqrt(np.mean([(r.coefficients[j].u_a or 0.0) ** 2 for r in parts])))
        for j in range(len(per_coefficient))
    ]
    rows: list[list[Any]] = [[day, *row] for day, row in zip(days, table.tolist(), strict=True)]
    rows += [
        ["mean", *(s.mean for s in per_coefficient)],
        ["σ (n − 1)", *(s.sigma for s in per_coefficient)],
        ["u within a day", *u_own],
    ]
    head = [f"{c.name} / ({c.unit})" for c in parts[0].coefficients]
    caption = "Estimates of each day, their mean and standard deviation"
    return Table("repeats", "Estimates by day", caption, ["day", *head], rows)
