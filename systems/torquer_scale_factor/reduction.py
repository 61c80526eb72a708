"""Scale factor and linearity of a torquer from servo-table rates.  [TEST-TORQUER; eq. A3-1..A3-6 with E48, E49]

For each current i the table follows the gyro's precession over the same angle range with +i and with -i; r_plus and
r_minus are the magnitudes of its rate:

    omega = (r_plus + r_minus)/2      free of the constant drift  [SF-APP1]
    K_n = omega/i  (E48: no minus)    K = mean K_n      linearity_n = (K_n - K)/K
    drift_n = (r_plus - r_minus)/2

A table of rates: the angle marks have a constant error, so over an angle range Theta the rate has one proportional to
i/Theta and K_n one proportional to 1/Theta.  A gain that changes with the range is held against that noise: what is
beyond it is in u, and withholds the verdict.  Least squares weighs K_n with Theta^2 (alike when no ranges are given),
first with one constant, then with K_1 + K_3 i^2, the cubic torquer.  A run knows more: its windows are fitted together
under an estimated noise model (precession.py).  Not modelled: heating by the current, drift that changes between the
two senses otherwise than as noise.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from scipy import special

from gyrobench import units
from gyrobench.reduction.diagnosis import handling_candidates
from gyrobench.reduction.diagnosis.examination import examined
from gyrobench.reduction.estimation import regression, uncertainty
from gyrobench.reduction.estimation.effects import correction_table, simulated_table, standard_changes
from gyrobench.reduction.estimation.fit_result import TYPE_A, budget_lines, changes_by_source
from gyrobench.reduction.estimation.truth_check import compared
from gyrobench.reduction.setup.sources import TIME_BASE
from gyrobench.reduction.toolkit import Account, Array, Location, Record, ReductionError, plain, told
from gyrobench.result import BudgetLine, Coefficient, DriftTestResult, Reason, Series, Table, Test
from gyrobench.system.families.servo_channel import OTHER, own_name

from . import marks, row_checks
from .budget import TorquerSetup
from .estimates import DPH, KU, UNIT, of_table, of_windows
from .precession import Precession, precession
from .row_checks import MA
from .sources import AMMETER, RANGES

RANDOM = "random drift, angle readings and current, with the linearity error"
COMPUTED = "Both senses have equal rates in every row: computed, not measured; the drift is then no finding."
NO_RANGES = "No angle ranges given: all currents weigh alike in the least squares."


class Reduction:
    """Scale factor, linearity and drift of a torquer from one row for each current (columns: row_checks.problems).

    found: of the windows of a run, whose estimates then take the place of those from the rows.
    """

    def __init__(self, rows: Mapping[str, Array], setup: TorquerSetup, found: Precession | None = None) -> None:
        self.rows, self.setup, self.fit = rows, setup, found
        self.i, self.plus, self.minus = (np.asarray(rows[n], float) for n in ("current", "rate_plus", "rate_minus"))
        self.marked, self.half = (self.plus + self.minus) / 2.0 / self.i, (self.plus - self.minus) / 2.0
        self.theta = np.asarray(rows["range_plus"], float) if "range_plus" in rows else np.ones_like(self.i)
        self.book = of_table(self.i, self.marked, self.half, self.theta)
        self.e = self.book if found is None else of_windows(self.i, found)
        self.K_n, self.full = self.marked if found is None else found.K, float(self.i.max())
        self.sources = found.effects if found else ()
        self.by_source = [standard_changes(self.e.reported, x) for x in self.sources] if self.e.reported else []

    @classmethod
    def reduce(
        cls, rows: Mapping[str, Array], setup: TorquerSetup | None = None, found: Precession | None = None
    ) -> DriftTestResult:
        """Return what rows say.  Raises ReductionError with everything that is wrong."""
        if wrong := row_checks.problems(rows):
            raise ReductionError(wrong)
        return cls(rows, setup or TorquerSetup(), found).result()

    @classmethod
    def of_record(cls, record: Record) -> DriftTestResult:
        """Return what a record says: of a run (windows of the servo phases), or of a measured table of rates."""
        run = record.run
        if run.measured:
            setup = TorquerSetup.of(run)
            if setup.corrections.strip():
                raise ReductionError(
                    "corrections: a table of rates has no angles to correct; correct its currents and rates"
                )
            return cls.reduce(record.windows, setup)
        rows, site = marks.rows(record.windows, run.plan), Location.of(run)
        if wrong := row_checks.problems(rows):
            raise ReductionError(wrong)
        currents = np.asarray(rows["current"])
        warm = float(np.mean(record.windows["temperature"])) if "temperature" in record.windows else 0.0
        truth = truth_of(run.parameters, currents, str(run.options.get("channel", "")), warm)
        setup = TorquerSetup.of(run, earth_rate=site.earth_rate, truth=truth, site=site.shown())
        return cls(rows, setup, precession(record.windows, marks.senses(run.plan), currents, setup)).result()

    @classmethod
    def from_record(cls, record: Record) -> DriftTestResult:
        """Return what a record says, a measured one examined for handling errors."""
        return examined(record, cls.of_record, handling_candidates.table_of_rates)

    def coefficients(self) -> list[Coefficient]:
        e, full = self.e, f"{self.full / MA:g} mA"
        cubic = f"relative change of the scale factor from 0 to {full}, as i²"
        worst = f"largest departure (K_n − K)/K, at {self.i[e.worst_at] / MA:g} mA"
        rows = (
            ("K", "scale factor, mean of the K_n of all currents", UNIT, 1.0 / KU),
            ("K_LS", "scale factor, weighted least squares", UNIT, 1.0 / KU),
            ("K_1", "scale factor at zero current of the cubic torquer", UNIT, 1.0 / KU),
            ("K_3/K_1", cubic, "%", 100.0),
            ("linearity", worst, "%", 100.0),
            ("drift", "drift along the torqued axis, half the difference of the two senses", "°/h", 1.0 / DPH),
        )
        return [self._coefficient(j, *row) for j, row in enumerate(rows)]

    def _coefficient(self, j: int, name: str, meaning: str, unit: str, size: float) -> Coefficient:
        """Return a coefficient in its printed unit, from its estimate (SI) and ``size``, the unit's inverse."""
        s, number = self.setup, self.e.numbers[j]
        value, u_a, dof = number[0] * size, number[1] * size, number[2]
        half_a = float(special.stdtrit(min(dof, 1e9), 0.975)) * u_a
        b = [abs(value) * AMMETER.size(s), abs(value) * TIME_BASE.size(s)] if unit == UNIT else []
        b = [*b, self.e.of_step[j] * size]
        if self.e.reported:
            b = (np.vstack([np.zeros((1, 6)), *self.by_source])[:, j] * size).tolist()
        u, U = uncertainty.combine_uncertainties(u_a, half_a, b)
        k, free = U / u if u > 0.0 else uncertainty.NORMAL, float(dof) if math.isfinite(dof) else None
        c = Coefficient(name, meaning, unit, value, u, k, (value - U, value + U), u_a=u_a, dof=free)
        if u_a > 0.0:
            t = value / u_a
            c = replace(c, t=t, p=float(2.0 * special.stdtr(min(dof, 1e9), -abs(t))))
        return compared(c, (s.truth or {}).get(name))

    def result(self) -> DriftTestResult:
        """Return the result, without the checks of the rows."""
        e, i, n, coefficients = self.e, self.i, self.i.size, self.coefficients()
        gain = np.vstack([e.gain, np.zeros(n)])
        covariance = gain @ e.cofactor @ gain.T
        covariance[5, 5] = 1.0
        curve = np.column_stack([np.ones(n), (i / self.full) ** 2]) * self.theta[:, None]
        F, p = e.test
        seen = p is not None and p < 0.05
        text = "the scale factor depends on the current" if seen else "no curvature beyond the scatter"
        noise = "Noise of K_n is proportional to 1/angle range (constant error of the angle marks)."
        account = Account(
            method="Servo-table rates with both senses of each current over the same angle range [TEST-TORQUER]",
            sources=["TEST-TORQUER, SF-APP1, LIN-TABLE; Hu 1981, eq. A3-1..A3-6, corrected by E48, E49"],
            equation="K_n = (dot(theta)_+ + dot(theta)_-) / (2 abs(i_n)), quad K = 1/N sum K_n",
            conventions=[
                "Positive current makes positive precession: K = ω/i (A3-5 of Hu 1981 prints a minus that its own "
                "table does not have).",
                *self._torquer(),
                "Currents and rates are magnitudes; the drift is positive when the positive sense is the faster one.",
                noise
                if self.fit is None
                else "Noise, white, Gauss-Markov and of the angle readings, estimated from all windows together.",
            ],
        )
        numbers: dict[str, Any] = {
            "series": [self._series()],
            "correlation": regression.correlation(covariance).tolist(),
            "condition": regression.examine(curve, ("K_1", "K_3")).condition,
            "rank": 2,
            "dof": float(n - 2 if self.fit is None else self.fit.est.mixture.dof),
            "noise": self._noise(),
            "tests": [Test("cubic", "cubic term", F, p, "curvature of the torquer", text)],
            "residual_std": e.scatter / KU,
            "residual_unit": UNIT,
        }
        return DriftTestResult(
            **account.statements(),
            **numbers,
            **self.setup.stated(),
            coefficients=coefficients,
            budget=self._budget(),
            type_b=changes_by_source(e.reported, self.sources, self.by_source) if e.reported else [],
            tables=self._tables(),
            reasons=self._reasons(),
            summary=told(
                coefficients,
                f"Scale factor K = {{K}} from {n} currents, {i.min() / MA:g} to {self.full / MA:g} mA.",
                f"Largest departure from it, at {i[e.worst_at] / MA:g} mA: {{linearity}}.",
                "Drift along the axis {drift}.",
            ),
            simulated=self.setup.truth is not None,
        )

    def _torquer(self) -> list[str]:
        """Return which torquer of a two-degree-of-freedom gyro was measured."""
        if not (c := self.setup.channel):
            return []
        other = OTHER[c]
        return [
            f"The torquer about {other}, which precesses the gyro about {c}, the table axis; the {other} axis is "
            f"locked by its rebalance loop through the torquer about {c}."
        ]

    def _series(self) -> Series:
        dense, e = np.linspace(0.0, 1.0, 101), self.e
        curve = np.linspace(0.0, self.full / MA, 101), (e.beta[0] + e.beta[1] * dense**2) / KU
        at, measured = (self.i / MA, "current", "mA"), (self.K_n / KU, "scale factor", UNIT)
        left = (self.K_n - e.fitted) / KU
        return Series.of(
            "scale factor of each current", at, measured, e.fitted / KU, left, np.arange(self.i.size), curve
        )

    def _noise(self) -> dict[str, Any]:
        if self.fit is None:
            scatter = self.e.scatter / KU
            return {"model": "white, K_n weighted by their range", "scatter of the best K_n / (°/h/mA)": scatter}
        est = self.fit.est.noise
        return {
            "model": "white, Gauss-Markov and reading errors, estimated from the windows",
            "white density / (°/h/√Hz)": est.density[0] / DPH,
            "Gauss-Markov rms / (°/h)": est.sigma[0] / DPH,
            "reading error, standard deviation / ″": est.sigma_reading[0] / units.factor("arcsec"),
        }

    def _budget(self) -> list[BudgetLine]:
        if self.e.reported:
            return budget_lines(self.e.reported, self.sources, RANDOM)
        a, size = self.e.numbers[0][1] / KU, self.e.numbers[0][0] / KU
        note = "type A, with the linearity error in it"
        scatter = BudgetLine(TYPE_A, "scatter of the K_n", a, UNIT, 1.0, "1", a, UNIT, "K", note)
        known = [(source, source.size(self.setup)) for source in (AMMETER, TIME_BASE)]
        step = self.e.of_step[0] / KU
        ranges = BudgetLine(RANGES.id, RANGES.name, step, UNIT, 1.0, "1", step, UNIT, "K", "half of it")
        return [scatter, *([ranges] if step > 0.0 else []), *(
            BudgetLine(source.id, source.name, u, "1", size, UNIT, size * u, UNIT, "K", source.note)
            for source, u in known if u > 0.0
        )]  # fmt: skip

    def _reasons(self) -> list[Reason]:
        found = []
        if np.all(self.half == 0.0):
            found.append(Reason("rows.computed", COMPUTED))
        if "range_plus" not in self.rows:
            found.append(Reason("rows.no_ranges", NO_RANGES))
        if self.fit is None:
            found += row_checks.between_ranges(self.e.step, self.theta, float(self.K_n.mean()))
            against, said = row_checks.contradictions(self.i, self.marked, self.half, self.theta)
            found += [Reason("torquer.asymmetry", text) for text in said]
            found += [Reason("rows.contradict", text, ("pass", "fail"), severity="doubt") for text in against]
        return found

    def _tables(self) -> list[Table]:
        i, mean, reported, fit = self.i, self.book.numbers[0][0], self.e.reported, self.fit
        printed = round(mean / KU, 3)
        off, off_printed = (self.marked - mean) / mean, (self.marked / KU - printed) / printed
        columns = (i / MA, self.plus / DPH, self.minus / DPH, self.marked / KU, off * 100.0, off_printed * 100.0,
                   self.half / DPH)  # fmt: skip
        caption = f"Linearity against K = {plain(mean / KU, 6)} and, as in Hu 1981, against {printed:.3f} °/h/mA"
        head = ["current / mA", "rate + / (°/h)", "rate − / (°/h)", "K_n / (°/h/mA)", "linearity / %",
                "linearity, K rounded / %", "drift / (°/h)"]  # fmt: skip
        rows = np.column_stack(columns).tolist()
        found = [Table("torquer.rows", "Scale factor and linearity", caption, head, rows)]
        if reported is not None:
            shifts = simulated_table(reported, self.sources, self.setup.errors)
            found = [*correction_table(reported), *shifts, *found]
        if fit is not None:
            u = fit.est.u[: 2 * i.size].reshape(2, -1)
            head = ["current / mA", "K_n / (°/h/mA)", "u / (°/h/mA)", "drift / (°/h)", "u / (°/h)"]
            caption = "Fit to all windows together; drift: at the middle of the angles of all currents"
            rows = np.column_stack([i / MA, fit.K / KU, u[0] / KU, fit.drift / DPH, u[1] / DPH]).tolist()
            found.append(Table("torquer.windows", "Scale factors from the windows", caption, head, rows))
        return found


def truth_of(
    parameters: Mapping[str, Any], currents: Array, channel: str = "", warm: float = 0.0
) -> dict[str, float] | None:
    """Return what a simulated torquer k (1 + k_T warm) i (1 + k2 i + k3 i2) makes of the reported values.

    warm: mean temperature above that of the coefficients, K.  k2 is even and goes into the half difference.  The drift
    has no one value: it changes with the range.
    """
    own = [f"gyro.{own_name(channel, n)}" for n in ("k", "k3", "k_T")]
    if own[0] not in parameters:
        return None
    k, k3, k_T, error = (float(parameters.get(n, 0.0)) for n in (*own, "source.error"))
    k, full = k * (1.0 + k_T * warm) / (1.0 + error), float(currents.max()) / (1.0 + error)
    cubic = k3 * full**2
    truth = {
        "K_1": k / KU,
        "K_3/K_1": cubic * 100.0,
        "K": k / KU * (1.0 + cubic * float(np.mean((currents / currents.max()) ** 2))),
    }
    return truth | ({"K_LS": k / KU} if k3 == 0.0 else {})
