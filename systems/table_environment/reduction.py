"""Reduction: the drift of a gyro at rest resolved into tilt, rate of tilting, temperature and field; budgets.

    omega_IA - k i = omega_0 - w_E + s_E q_E + s_N q_N + s_T T + s_dT dT_O + s_B B_E + noise

Input axis east, output axis up, so that with X = gamma q_N, Y = -gamma, Z = gamma q_E to first order in the tilts q

    s_E = gamma D_S - gamma^2 D_OS,   s_N = gamma D_I - gamma^2 D_IO,   s_dT = gamma D_TO

All regressors are window means of what was recorded beside the current.  [ENV-DISTURBANCE]
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from gyrobench import units
from gyrobench.record.record import Record
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.estimation import nuisances
from gyrobench.reduction.estimation.linear_fit import Regression
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.setup.run_metadata import Location, number
from gyrobench.reduction.setup.window_checks import window_problems
from gyrobench.reduction.toolkit import Account, DriftReduction, Effect, Findings, Group, Quantity, SiteSetup, told
from gyrobench.result import BudgetLine, Coefficient, DriftTestResult, Table
from gyrobench.units import ARCSEC, DPH, G0

from . import budgets, isolation, set_up
from .budgets import ERU, ErrorLine

NEEDED = 0.1 * 1e-8 * ERU  # drift rate that a cause may have


class Cause(NamedTuple):
    """A recorded cause: name and printed unit of its sensitivity, column, option with its level, unit of that."""

    name: str
    column: str
    meaning: str
    unit: str
    option: str
    level_unit: str


CAUSES = [
    Cause("s_rate", "ground_rate", "drift per rate of tilting about the input axis", "1", "u_rate", "arcsec/s"),
    Cause("s_E", "tilt_east", "drift per tilt about east, the input axis", "deg/h/arcsec", "u_tilt", "arcsec"),
    Cause("s_N", "tilt_north", "drift per tilt about north", "deg/h/arcsec", "u_tilt", "arcsec"),
    Cause("s_T", "temperature", "drift per mean temperature", "deg/h/K", "u_temperature", "mK"),
    Cause("s_dT", "difference", "drift per temperature difference along the output axis", "deg/h/K", "u_difference",
          "mK"),
    Cause("s_B", "field", "drift per magnetic field along the input axis", "deg/h/mT", "u_field", "uT"),
]  # fmt: skip
COLUMNS = [c.column for c in CAUSES]


@dataclass(frozen=True, kw_only=True)
class EnvironmentSetup(SiteSetup):
    """k: torquer scale factor, rad/s/A.  options: of the budgets, as of the system.  seed: of their draws."""

    k: float
    options: Mapping[str, Any]
    seed: int


class Reduction(DriftReduction[EnvironmentSetup]):
    """Sensitivities of a drift test to its surroundings, and the budgets of a table."""

    @classmethod
    def setup_of(cls, run: RunDocument) -> EnvironmentSetup:
        k = number(run, "k", "gyro.k", "torquer scale factor")
        truth = None if run.measured else true_values(run.parameters, Location.of(run).g)
        return EnvironmentSetup.of(run, k=k, options=run.options, seed=run.seed or 1, truth=truth)

    @classmethod
    def from_record(cls, record: Record) -> DriftTestResult:
        """Return what a record says, with what a foundation leaves where the table stands on one."""
        result = super().from_record(record)
        left = isolation.tables(record, G0 * Location.of(record.run).g)
        return replace(result, tables=[*result.tables, *left]) if left else result

    def problems(self) -> list[str]:
        problems = window_problems(self.windows)
        if missing := [c for c in COLUMNS if c not in self.windows]:
            problems.append(f"no column {', '.join(missing)}: what was recorded beside the current is needed")
        return problems

    def regression(self) -> Regression:
        s, w = self.setup, self.windows
        t0, t1, mean = w["t_start"], w["t_end"], float(np.mean(w["temperature"]))
        columns = [w[c] - mean if c == "temperature" else w[c] for c in COLUMNS]
        true = dict(s.truth or {})
        if true:
            true["ω_0"] += true["s_T"] * mean  # it belongs to the mean temperature
        quantities = [Quantity.of("ω_0", "drift rate at rest, at the mean temperature", "deg/h", true.get("ω_0"))]
        quantities += [Quantity.of(c.name, c.meaning, c.unit, true.get(c.name)) for c in CAUSES]
        shown = Group("at rest", np.arange(t0.size), ((t0 + t1) / 2.0 - t0[0]) / 3600.0, "time", "h")
        candidates = [nuisances.trend(t0, t1)] if s.nuisances else ()
        X = np.column_stack([np.ones(t0.size), *columns])
        return Regression(quantities, X, -s.k * w["mean"], t0, t1, [shown], candidates=candidates)

    def effects(self, found: Findings) -> list[Effect]:
        return set_up.effects(found, self.windows, self.setup, self.setup.k, COLUMNS)

    def account(self, found: Findings) -> Account:
        return Account(
            method="Torque rebalance at rest, input axis east; least squares on recorded tilts, temperatures and field "
            "under an estimated noise model [ENV-DISTURBANCE]",
            sources=["ENV-DISTURBANCE, ALIGN-ERRORS, ERROR-BUDGET; Hu 1981, sections 5.6..5.8, eq. 5-59..5-61, 5-78, "
                     "corrected by ET19..ET21"],
            equation='-k i = omega_0 + s_"rate" w_E + s_E q_E + s_N q_N + s_T T + s_"dT" Delta T_O + s_B B_E',
            conventions=[
                "q: tilt of the ground about east and north (rotation vector); w_E: inertial rate of the ground about "
                "east with Earth rate; T above the temperature of the gyro's coefficients; field along east.",
                "Root of squares: of the sizes as given. Monte Carlo: 20,000 draws, each line by its kind (normal: the "
                "size is the standard deviation; uniform: half width; fixed: that size with either sign).",
            ],
        )  # fmt: skip

    # ------------------------------------------------------------------------------------ budgets
    def completed(self, result: DriftTestResult) -> DriftTestResult:
        """Return the result with the budgets of surroundings, alignment and rate mode."""
        lines, surroundings = self._surroundings(result)
        tables = [*result.tables, surroundings, self._alignment(), self._rate_mode()]
        return replace(result, budget=[*result.budget, *lines], tables=tables)

    def _surroundings(self, result: DriftTestResult) -> tuple[list[BudgetLine], Table]:
        """Return what the levels of later tests do by the sensitivities found: lines of the budget, and its table."""
        lines, rows, effects = [], [], []
        note = "level of the later tests times the sensitivity found"
        for cause in CAUSES:
            c, level = result[cause.name], float(self.setup.options.get(cause.option, 0.0))
            found, meaning = c.estimate * units.factor(cause.unit), cause.meaning
            if cause.column == "tilt_north":
                found += self._turned_rate(result["s_rate"].estimate)
                meaning += ", gravity and Earth rate"
            per, size = abs(found), units.factor(cause.level_unit)
            effect = per * level
            at = (level / size, units.display(cause.level_unit), found / units.factor(cause.unit), c.unit)
            effects.append(ErrorLine(meaning, effect))
            needed = NEEDED / per / size if per else None
            rows.append([meaning, *at, effect / DPH, effect / ERU, needed])
            named = (f"surroundings.{cause.column}", meaning)
            lines.append(BudgetLine(*named, *at, effect / DPH, "°/h", "surroundings", note))
        self.level = total = budgets.combine(effects, self.setup.seed)
        rows += [[name, None, None, None, None, x / DPH, x / ERU, None] for name, x in total.named()]
        caption = (
            "Levels: those of the later tests (options u_...), not of this run. A static tilt about north acts by "
            "gravity (s_N) and turns the input axis against the Earth's rate (W sin φ). Last column: level at which "
            "the effect is 1e-9 ERU, a tenth of 1e-8 ERU."
        )
        head = ["cause", "level", "unit", "sensitivity", "unit", "drift / (°/h)", "drift / ERU", "level needed"]
        return lines, Table("budget.surroundings", "Budget of the surroundings", caption, head, rows)

    def _turned_rate(self, s_rate: float) -> float:
        """Return the drift rate per static tilt about north by the Earth's rate, rad/s per rad.

        Such a tilt q leans the input axis from east downwards: w_E = -q W sin phi is then on it, which the test has
        in the column of the rate and not in that of the tilt.  A tilt about east turns no rate onto the input axis.
        [ENV-DISTURBANCE; Hu 1981, Table 5-4]
        """
        return -s_rate * self.setup.earth_rate * math.sin(self.setup.latitude)

    def _alignment(self) -> Table:
        """Return the budget of the rate on the input axis of a table that turns."""
        options = self.setup.options
        n, sense = float(options["turning"]), int(options["sense"])
        lines = budgets.parse(str(options["align"]), "rad")
        self.align = budgets.combine(lines, self.setup.seed, lambda e: budgets.misalignment_rate(e, n, sense))
        of_each = zip(lines, self.align.each, strict=True)
        rows: list[list[Any]] = [[a.name, a.size / ARCSEC, a.kind, rate / DPH] for a, rate in of_each]
        rows += [[name, None, None, x / DPH] for name, x in self.align.named()]
        caption = (
            f"Rate on the input axis at {n:g} times Earth rate, (n ± 1) W sin φ with "
            f"{'n + 1, as the sense is not known' if sense == 0 else f'n {sense:+d}'}; Monte Carlo by rotations."
        )
        head = ["misalignment", "angle / ″", "kind", "rate / (°/h)"]
        return Table("budget.alignment", "Budget of the alignment", caption, head, rows)

    def _rate_mode(self) -> Table:
        """Return the budget of a rate that is made of angles."""
        options = self.setup.options
        self.averaging, lines = float(options["averaging"]), budgets.parse(str(options["rate_mode"]), "rad")
        self.mode = budgets.combine(lines, self.setup.seed)
        every = [*((a.name, a.size, a.kind) for a in lines), *((name, x, "") for name, x in self.mode.named())]
        rows = [[name, x / ARCSEC, kind, 100.0 * x / self.averaging] for name, x, kind in every]
        caption = f"Errors of the angle; relative error of a rate averaged over {math.degrees(self.averaging):g}°."
        head = ["error", "angle / ″", "kind", "relative / %"]
        return Table("budget.rate_mode", "Budget of the rate mode", caption, head, rows)

    def summary(self, found: Findings, coefficients: Sequence[Coefficient]) -> list[str]:
        """Return the sensitivities that a laboratory can act on, temperature and field, and the totals."""
        acted_on = (c for c in CAUSES if c.name in ("s_T", "s_B"))
        level, align = ([x / DPH for x in (t.rss, t.spread)] for t in (self.level, self.align))
        rss, spread = (100.0 * x / self.averaging for x in (self.mode.rss, self.mode.spread))
        return [
            *told(coefficients, *(f"{c.meaning[:1].upper()}{c.meaning[1:]}: {{{c.name}}}." for c in acted_on)),
            f"Surroundings of the later tests: {plain(level[0])} °/h (root of squares; Monte Carlo {plain(level[1])}).",
            f"Misalignment at {float(self.setup.options['turning']):g} ERU: {plain(align[0])} °/h (Monte Carlo "
            f"{plain(align[1])}); rate over {math.degrees(self.averaging):g}°: {plain(rss)} % (Monte Carlo "
            f"{plain(spread)} %).",
        ]


def true_values(parameters: Mapping[str, Any], g: float) -> dict[str, float] | None:
    """Return the sensitivities that follow from the coefficients of a simulated gyro, SI, at gravity g (in g0).

    ω_0 at the temperature of the coefficients.  None for a gyro that does not know temperature.
    """
    p = {n.removeprefix("gyro."): v for n, v in parameters.items() if n.startswith("gyro.")}
    return None if "D_T" not in p else {
        "ω_0": p["D_F"] - g * p["D_O"] + g * g * p["D_OO"],
        "s_rate": -1.0,
        "s_E": g * p["D_S"] - g * g * p["D_OS"],
        "s_N": g * p["D_I"] - g * g * p["D_IO"],
        "s_T": p["D_T"],
        "s_dT": g * p.get("D_TO", 0.0),
        "s_B": p["D_B"][0],
    }  # fmt: skip
