"""Reduction: the drift of a gyro at rest resolved into tilt, rate of tilting, temperature and field; budgets.

    omega_IA - k i = omega_0 - w_E + s_E q_E + s_N q_N + s_T T + s_dT dT_O + s_B B_E + noise

Input axis east, output axis up, so that with X = gamma q_N, Y = -gamma, Z = gamma q_E to first order in the tilts q

    s_E = gamma D_S - gamma^2 D_OS,   s_N = gamma D_I - gamma^2 D_IO,   s_dT = gamma D_TO

All regressors are window means of what was recorded beside the current.  [ENV-DISTURBANCE]
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from gyrobench import frames, units
from gyrobench.record.record import Record
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.estimation import nuisances
from gyrobench.reduction.estimation.effects import Effect, with_set_up
from gyrobench.reduction.estimation.fit_result import Findings, Group, Quantity, fit, linear_result, plus_minus
from gyrobench.reduction.setup import run_metadata
from gyrobench.reduction.setup.simulated_errors import simulated_errors
from gyrobench.reduction.setup.window_checks import ReductionError, window_problems
from gyrobench.result import BudgetLine, Coefficient, DriftTestResult, Specification, Table
from gyrobench.units import ARCSEC, DPH

from . import budgets
from .budgets import Line, Total
from .set_up import effects

ERU = units.EARTH_RATE
#: name -> column, meaning, unit of the sensitivity, option with the level, its unit
CAUSES = {
    "s_rate": ("ground_rate", "drift per rate of tilting about the input axis", "1", "u_rate", "arcsec/s"),
    "s_E": ("tilt_east", "drift per tilt about east, the input axis", "deg/h/arcsec", "u_tilt", "arcsec"),
    "s_N": ("tilt_north", "drift per tilt about north", "deg/h/arcsec", "u_tilt", "arcsec"),
    "s_T": ("temperature", "drift per mean temperature", "deg/h/K", "u_temperature", "mK"),
    "s_dT": ("difference", "drift per temperature difference along the output axis", "deg/h/K", "u_difference", "mK"),
    "s_B": ("field", "drift per magnetic field along the input axis", "deg/h/mT", "u_field", "uT"),
}


def from_record(record: Record, specification: Specification | None = None) -> DriftTestResult:
    """Sensitivities with their intervals, and the budgets; Raises ReductionError for a record without the columns."""
    run, w = record.run, record.windows
    problems = window_problems(w)
    missing = [c for c, *_ in CAUSES.values() if c not in w]
    if missing:
        problems.append(f"no column {', '.join(missing)}: what was recorded beside the current is needed")
    if problems:
        raise ReductionError(problems)
    site, k = run_metadata.Site.of(run), run_metadata.number(run, "k", "gyro.k", "torquer scale factor")
    t0, t1 = w["t_start"], w["t_end"]
    base = w["temperature"] - np.mean(w["temperature"])  # omega_0 belongs to the mean temperature
    columns = [base if c == "temperature" else w[c] for c, *_ in CAUSES.values()]
    true = _truth(run, site, float(np.mean(w["temperature"])))
    quantities = [Quantity.of("ω_0", "drift rate at rest, at the mean temperature", "deg/h", true.get("ω_0"))]
    quantities += [Quantity.of(n, c[1], c[2], true.get(n)) for n, c in CAUSES.items()]
    group = Group("at rest", np.arange(t0.size), ((t0 + t1) / 2.0 - t0[0]) / 3600.0, "time", "h")
    weighed = run.options.get("nuisances") != "none"
    sizes = run_metadata.sizes(run.options, ("u_mount", "u_scale_factor", "u_current", "u_scales"))
    found = fit(
        quantities, np.column_stack([np.ones(t0.size), *columns]), -k * w["mean"], t0, t1, [group], "drift rate", "°/h",
        DPH, candidates=[nuisances.trend(t0, t1)] if weighed else (),
    )  # fmt: skip

    def sources(f: Findings) -> list[Effect]:
        return effects(f, w, k, site, [c for c, *_ in CAUSES.values()], sizes)

    found = with_set_up(found, sources, str(run.options.get("corrections", "")))
    result = linear_result(
        found,
        system=run.system,
        title="Surroundings of a table: what ground, heat and field do to a drift test",
        method="Torque rebalance at rest, input axis east; least squares on recorded tilts, temperatures and field "
        "under an estimated noise model [ENV-DISTURBANCE]",
        sources=["ENV-DISTURBANCE, ALIGN-ERRORS, ERROR-BUDGET; Hu 1981, sections 5.6..5.8, eq. 5-59..5-61, 5-78, "
                 "corrected by ET19..ET21"],
        equation='-k i = omega_0 + s_"rate" w_E + s_E q_E + s_N q_N + s_T T + s_"dT" Delta T_O + s_B B_E',
        conventions=[
            "q: tilt of the ground about east and north (rotation vector); w_E: inertial rate of the ground about east "
            "with Earth rate; T above the temperature of the gyro's coefficients; field along east.",
            "Root of squares: of the sizes as given. Monte Carlo: 20,000 draws, each line by its kind (normal: the "
            "size is the standard deviation; uniform: half width; fixed: that size with either sign).",
        ],
        specification=specification,
        site=site.shown(),
        instrument=run.instrument,
        no_closed="",
        effects=sources(found),
        errors=simulated_errors(run),
    )  # fmt: skip
    _budgets(result, run)
    return run_metadata.finish(result, record)


def _truth(run: RunDocument, site: run_metadata.Site, mean: float) -> dict[str, float]:
    """Return the sensitivities that follow from the coefficients of the simulated gyro, SI; {} for measured data."""
    p = {n.removeprefix("gyro."): v for n, v in run.parameters.items() if n.startswith("gyro.")}
    if run.measured or "D_T" not in p:
        return {}
    g = site.gravity / frames.G0
    return {
        "ω_0": p["D_F"] - g * p["D_O"] + g * g * p["D_OO"] + p["D_T"] * mean,
        "s_rate": -1.0,
        "s_E": g * p["D_S"] - g * g * p["D_OS"],
        "s_N": g * p["D_I"] - g * g * p["D_IO"],
        "s_T": p["D_T"],
        "s_dT": g * p.get("D_TO", 0.0),
        "s_B": p["D_B"][0],
    }


# ---------------------------------------------------------------------------------------- budgets
def _budgets(result: DriftTestResult, run: RunDocument) -> None:
    """Add the three budgets to the tables and the summary."""
    options, seed = run.options, run.seed or 1
    by_name = {c.name: c for c in result.coefficients}
    lines, rows = [], []
    for name, (_, meaning, unit, option, level_unit) in CAUSES.items():
        level, c = float(options.get(option, 0.0)), by_name[name]
        effect = abs(c.estimate) * units.factor(unit) * level
        lines.append(Line(meaning, effect))
        tenth = 0.1 * 1e-8 * ERU / (abs(c.estimate) * units.factor(unit)) if c.estimate else None
        shown, size = level / units.factor(level_unit), units.display(level_unit)
        needed = None if tenth is None else tenth / units.factor(level_unit)
        rows.append([meaning, shown, size, c.estimate, c.unit, effect / DPH, effect / ERU, needed])
        note = "level of the later tests times the sensitivity found"
        line = BudgetLine(meaning, shown, size, c.estimate, c.unit, effect / DPH, "°/h", "surroundings", note)
        result.budget.append(line)
    env = budgets.combine(lines, seed)
    result.tables.append(
        Table(
            "budget_of_the_surroundings",
            "Budget of the surroundings",
            "Levels: those of the later tests (options u_...), not of this run. Last column: the level at "
            "which the effect is 1e-9 ERU, a tenth of 1e-8 ERU.",
            [
                "cause",
                "level",
                "unit",
                "sensitivity",
                "unit",
                "drift / (°/h)",
                "drift / ERU",
                "level needed",
            ],
            [*rows, *_totals(env, 5, DPH, 3)],
        )
    )
    n, sense = float(options["turning"]), int(options["sense"])
    align_lines = budgets.parse(str(options["align"]), "rad")
    rates = [float(budgets.misalignment_rate(line.size, n, sense, ERU)) for line in align_lines]
    align = budgets.combine(align_lines, seed, lambda e: budgets.rotated_rate(e, n, sense, ERU))
    result.tables.append(
        Table(
            "budget_of_the_alignment",
            "Budget of the alignment",
            f"Rate on the input axis at {n:g} times Earth rate, (n ± 1) W sin φ with "
            f"{'n + 1, as the sense is not known' if sense == 0 else f'n {sense:+d}'}; Monte Carlo by rotations.",
            ["misalignment", "angle / ″", "kind", "rate / (°/h)"],
            [
                *[[a.name, a.size / ARCSEC, a.kind, r / DPH] for a, r in zip(align_lines, rates, strict=True)],
                *_totals(align, 3, DPH),
            ],
        )
    )
    averaging = float(options["averaging"])
    mode_lines = budgets.parse(str(options["rate_mode"]), "rad")
    mode = budgets.combine(mode_lines, seed)
    result.tables.append(
        Table(
            "budget_of_the_rate_mode",
            "Budget of the rate mode",
            f"Errors of the angle; relative error of a rate averaged over {np.degrees(averaging):g}°.",
            ["error", "angle / ″", "kind", "relative / %"],
            [
                *[[line.name, line.size / ARCSEC, line.kind, 100.0 * line.size / averaging] for line in mode_lines],
                *[[name, value / ARCSEC, "", 100.0 * value / averaging] for name, value in _named(mode)],
            ],
        )
    )
    result.summary += [
        *(f"{c.meaning[:1].upper()}{c.meaning[1:]}: {plus_minus(c)}." for c in _largest(result.coefficients)),
        f"Surroundings of the later tests: {env.rss / DPH:.2g} °/h (root of squares; Monte Carlo "
        f"{env.spread / DPH:.2g}).",
        f"Misalignment at {n:g} ERU: {align.rss / DPH:.2g} °/h (Monte Carlo {align.spread / DPH:.2g}); rate over "
        f"{np.degrees(averaging):g}°: {100.0 * mode.rss / averaging:.2g} % (Monte Carlo "
        f"{100.0 * mode.spread / averaging:.2g} %).",
    ]


def _largest(coefficients: Sequence[Coefficient]) -> list[Coefficient]:
    """Return temperature and field, what a laboratory can act on."""
    return [c for c in coefficients if c.name in ("s_T", "s_B")]


def _named(total: Total) -> list[tuple[str, float]]:
    return [
        ("root of squares", total.rss),
        ("Monte Carlo, standard deviation", total.spread),
        ("Monte Carlo, 95 % within", total.within),
        ("worst case, sum", total.worst),
    ]


def _totals(total: Total, column: int, scale: float, after: int = 1) -> list[list[Any]]:
    """Rows of a table with the totals in ``column``, so many columns ``after`` being its end."""
    rows: list[list[Any]] = []
    for name, value in _named(total):
        row: list[Any] = [name, *[None] * (column - 1), value / scale, *[None] * (after - 1)]
        if after > 1:
            row[column + 1] = value / ERU
        rows.append(row)
    return rows
