"""Scale factor and linearity of a torquer from servo-table rates.  [TEST-TORQUER; eq. A3-1..A3-6 with E48, E49]

For each current i the table follows the gyro's precession over the same angle range with +i and with -i; r_plus and
r_minus are the magnitudes of its rate:

    omega = (r_plus + r_minus)/2      free of the constant drift  [SF-APP1]
    K_n = omega/i  (E48: no minus)    K = mean K_n      linearity_n = (K_n - K)/K
    drift_n = (r_plus - r_minus)/2

A table of rates: the angle marks have a constant error, so over an angle range Theta the rate has one proportional to
i/Theta and K_n one proportional to 1/Theta.  Least squares weighs K_n with Theta^2 (alike when no ranges are given),
first with one constant, then with K_1 + K_3 i^2, the cubic torquer.  A run knows more: its windows are fitted together
under an estimated noise model (precession.py).  Not modelled: heating by the current, drift that changes between the
two senses otherwise than as noise.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from scipy import special

from gyrobench import units
from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.reduction.diagnosis import handling_candidates, handling_errors
from gyrobench.reduction.estimation import regression, uncertainty
from gyrobench.reduction.estimation.effects import Effect, correction_table, simulated_table, standard_changes
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.estimation.fit_result import budget_lines, changes_by_source
from gyrobench.reduction.setup import run_metadata
from gyrobench.reduction.setup.simulated_errors import simulated_errors
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import BudgetLine, Coefficient, DriftTestResult, Series, Specification, Table, Test

from . import marks, row_checks
from .budget import AMMETER, Sizes
from .estimates import DPH, KU, UNIT, Estimates, Number, of_table, of_windows
from .precession import Precession, precession

MA = 1e-3
RANDOM = "random drift, angle readings and current, with the linearity error"


@dataclass(frozen=True)
class TorquerSetup:
    """u_current, u_time: relative standard uncertainties of ammeter and time base, for a table of rates (those of a run
    are in its Precession).  errors: of a simulated set-up.  limits: surface units.  truth: printed name -> value in the
    printed unit.
    """

    u_current: float = 0.0
    u_time: float = 0.0
    errors: Mapping[str, float] | None = None
    specification: Specification | None = None
    instrument: str = ""
    simulated: bool = False
    truth: Mapping[str, float] | None = None
    site: Mapping[str, Any] = field(default_factory=dict)


def problems(rows: Mapping[str, Array]) -> list[str]:
    """What is wrong with the rows current (A), rate_plus, rate_minus (rad/s), range_plus, range_minus (rad,
    optional).
    """
    need = ("current", "rate_plus", "rate_minus")
    missing = [n for n in need if n not in rows]
    if missing:
        text = f"column {', '.join(missing)} is missing; each current needs current, rate_plus and rate_minus"
        if {"rate_plus", "rate_minus"} & set(missing):
            text += ": one sense alone cannot tell scale factor from drift"
        return [text]
    found = []
    columns = [n for n in (*need, "range_plus", "range_minus") if n in rows]
    data = {n: np.asarray(rows[n], dtype=float) for n in columns}
    if len({v.size for v in data.values()}) > 1:
        return ["columns of different length"]
    for n, v in data.items():
        for k in np.flatnonzero(~np.isfinite(v)):
            found.append(f"row {k + 1}: {n} is no finite number" + (" (both senses are needed)" if "rate" in n else ""))
    if found:
        return found
    i = data["current"]
    for k in np.flatnonzero(i <= 0.0):
        found.append(f"row {k + 1}: current {i[k] / MA:g} mA: give the magnitude, larger than zero")
    for n in ("rate_plus", "rate_minus"):
        for k in np.flatnonzero(data[n] <= 0.0):
            found.append(
                f"row {k + 1}: {n} = {data[n][k] / DPH:g} °/h: give magnitudes; a rate of the wrong sense is a drift "
                "larger than the precession or crossed wires"
            )
    if ("range_plus" in data) != ("range_minus" in data):
        found.append("range_plus and range_minus belong together: the angle range of each sense")
    elif "range_plus" in data:
        a, b = data["range_plus"], data["range_minus"]
        for k in np.flatnonzero((np.abs(a - b) > 0.01 * np.maximum(np.abs(a), np.abs(b))) | (a <= 0.0) | (b <= 0.0)):
            found.append(
                f"row {k + 1}: ranges {math.degrees(a[k]):g}° and {math.degrees(b[k]):g}°: both senses need the same "
                "angle range, or the drift does not cancel"
            )
    if i.size < 3:
        found.append(f"{i.size} currents: at least 3 are needed for a linearity")
    elif np.unique(i).size < i.size:
        found.append("the same current twice: average repeated measurements first")
    return found


def reduce(
    rows: Mapping[str, Array], setup: TorquerSetup | None = None, found: Precession | None = None
) -> DriftTestResult:
    """Scale factor, linearity and drift of a torquer from one row for each current; found: of the windows of a run,
    whose estimates then take the place of those from the rows.  Raises ReductionError with everything that is wrong.
    """
    s = setup or TorquerSetup()
    wrong = problems(rows)
    if wrong:
        raise ReductionError(wrong)
    i, plus, minus = (np.asarray(rows[n], dtype=float) for n in ("current", "rate_plus", "rate_minus"))
    theta = np.asarray(rows["range_plus"], dtype=float) if "range_plus" in rows else np.ones_like(i)
    marked, half, n, full = (plus + minus) / 2.0 / i, (plus - minus) / 2.0, i.size, float(i.max())
    K_n = marked if found is None else found.K
    book = of_table(i, marked, half, theta)
    e = book if found is None else of_windows(i, found)
    mean, k, u_mean = e.mean[0], e.worst_at, e.mean[1]
    sources = found.effects if found else ()
    by_source = [standard_changes(e.reported, x) for x in sources] if e.reported else []
    make = _Maker(s, np.vstack([np.zeros((1, 6)), *by_source]) if e.reported else None)
    coefficients = [
        make("K", "scale factor, mean of the K_n of all currents", UNIT, e.mean, 1.0 / KU, True),
        make("K_LS", "scale factor, weighted least squares", UNIT, e.line, 1.0 / KU, True),
        make("K_1", "scale factor at zero current of the cubic torquer", UNIT, e.K_1, 1.0 / KU, True),
        make("K_3/K_1", f"relative change of the scale factor from 0 to {full / MA:g} mA, as i²", "%", e.cubic, 100.0),
        make("linearity", f"largest departure (K_n − K)/K, at {i[k] / MA:g} mA", "%", e.worst, 100.0),
        make("drift", "drift along the torqued axis, half the difference of the two senses", "°/h", e.drift, 1.0 / DPH),
    ]
    seen = e.p is not None and e.p < 0.05
    warnings = []
    if np.all(half == 0.0):
        warnings.append(
            "Both senses have equal rates in every row: computed, not measured; the drift is then no finding."
        )
    if "range_plus" not in rows:
        warnings.append("No angle ranges given: all currents weigh alike in the least squares.")
    against, said = row_checks.contradictions(i, marked, half, theta) if found is None else ([], [])
    warnings += said
    gain = np.vstack([e.gain, np.zeros(n)])
    covariance = gain @ e.cofactor @ gain.T
    covariance[5, 5] = 1.0
    result = DriftTestResult(
        system="torquer_scale_factor",
        title="Scale factor and linearity of a torquer",
        method="Servo-table rates with both senses of each current over the same angle range [TEST-TORQUER]",
        sources=["TEST-TORQUER, SF-APP1, LIN-TABLE; Hu 1981, eq. A3-1..A3-6, corrected by E48, E49"],
        equation='K_n = (dot(theta)_+ + dot(theta)_-) / (2 abs(i_n)), quad K = 1/N sum K_n',
        conventions=[
            "Positive current makes positive precession: K = ω/i (A3-5 of Hu 1981 prints a minus that its own table "
            "does not have).",
            "Currents and rates are magnitudes; the drift is positive when the positive sense is the faster one.",
            "Noise of K_n is proportional to 1/angle range (constant error of the angle marks)."
            if found is None
            else "Noise, white, Gauss-Markov and of the angle readings, estimated from all windows together.",
        ],
        coefficients=coefficients,
        series=[
            Series(
                label="scale factor of each current", x=(i / MA).tolist(), x_name="current", x_unit="mA",
                y=(K_n / KU).tolist(), fit=(e.fitted / KU).tolist(), residual=((K_n - e.fitted) / KU).tolist(),
                y_name="scale factor", y_unit=UNIT, t=np.arange(n, dtype=float).tolist(),
                shown_fit_x=np.linspace(0.0, full / MA, 101).tolist(),
                shown_fit_y=((e.beta[0] + e.beta[1] * np.linspace(0.0, 1.0, 101) ** 2) / KU).tolist(),
            )
        ],
        correlation=regression.correlation(covariance).tolist(),
        condition=regression.examine(np.column_stack([np.ones(n), (i / full) ** 2]) * theta[:, None],
                                     ("K_1", "K_3")).condition,
        rank=2,
        dof=float(n - 2 if found is None else found.est.mixture.dof),
        noise=_noise(e, found),
        tests=[
            Test("cubic_term", "cubic term", e.F, e.p, "curvature of the torquer",
                 "the scale factor depends on the current" if seen else "no curvature beyond the scatter")
        ],
        residual_std=e.scatter / KU,
        residual_unit=UNIT,
        budget=budget_lines(e.reported, sources, RANDOM) if e.reported else _budget(s, mean, u_mean),
        type_b=changes_by_source(e.reported, sources, by_source) if e.reported else [],
        tables=[*_set_up_tables(e.reported, sources, s.errors), _table(i, plus, minus, marked, half, book.mean[0]),
                *_windows_table(i, found)],
        warnings=warnings,
        summary=[
            f"Scale factor K = {mean / KU:.3f} °/h/mA from {n} currents, {i.min() / MA:g} to {full / MA:g} mA.",
            f"Linearity: within {abs(e.worst[0]) * 100:.3f} %, worst at {i[k] / MA:g} mA.",
            f"Drift along the axis {coefficients[-1].estimate:.3g} °/h.",
        ],
        decision_rule=uncertainty.DECISION_RULE,
        verdict=uncertainty.worst_verdict(c.verdict for c in coefficients),
        instrument=s.instrument,
        simulated=s.simulated,
        site=dict(s.site),
    )  # fmt: skip
    return uncertainty.withhold(result, against)


def _noise(e: Estimates, found: Precession | None) -> dict[str, Any]:
    if found is None:
        return {"model": "white, K_n weighted by their range", "scatter of the best K_n / (°/h/mA)": e.scatter / KU}
    est = found.est
    return {
        "model": "white, Gauss-Markov and reading errors, estimated from the windows",
        "white density / (°/h/√Hz)": est.density[0] / DPH,
        "Gauss-Markov rms / (°/h)": est.sigma[0] / DPH,
        "reading error, standard deviation / ″": est.sigma_reading[0] / units.factor("arcsec"),
    }


def _set_up_tables(
    reported: Findings | None, sources: Sequence[Effect], errors: Mapping[str, float] | None
) -> list[dict[str, Any]]:
    if reported is None:
        return []
    return [*correction_table(reported), *simulated_table(reported, sources, errors)]


def _windows_table(i: Array, found: Precession | None) -> list[Table]:
    if found is None:
        return []
    n = i.size
    rows: list[list[Any]] = [
        [float(i[k] / MA), float(found.K[k] / KU), float(found.est.u[k] / KU), float(found.drift[k] / DPH),
         float(found.est.u[n + k] / DPH)]
        for k in range(n)
    ]  # fmt: skip
    head = ["current / mA", "K_n / (°/h/mA)", "u / (°/h/mA)", "drift / (°/h)", "u / (°/h)"]
    caption = "Fit to all windows together; drift: at the middle of the angles of all currents"
    return [Table("scale_factors_from_the_windows", "Scale factors from the windows", caption, head, rows)]


class _Maker:
    """Coefficients in surface units from an estimate with its type A uncertainty and degrees of freedom.

    changes (m, 6): by the sources of type B of a run, SI, in the order in which the coefficients are made.
    """

    def __init__(self, setup: TorquerSetup, changes: Array | None) -> None:
        self.setup, self.changes, self.made = setup, changes, 0

    def __call__(
        self, name: str, meaning: str, unit: str, number: Number, size: float, scale: bool = False
    ) -> Coefficient:
        value, u_a, dof = number[0] * size, number[1] * size, number[2]
        half_a = float(special.stdtrit(min(dof, 1e9), 0.975)) * u_a
        b = [abs(value) * self.setup.u_current, abs(value) * self.setup.u_time] if scale else []
        if self.changes is not None:
            b = (self.changes[:, self.made] * size).tolist()
        self.made += 1
        u, U = uncertainty.combine_uncertainties(u_a, half_a, b)
        limit = (self.setup.specification or {}).get(name)
        t = value / u_a if u_a > 0.0 else None
        truth = (self.setup.truth or {}).get(name)
        return Coefficient(
            name=name, meaning=meaning, unit=unit, estimate=value, u=u, k=U / u if u > 0.0 else uncertainty.NORMAL,
            interval=(value - U, value + U), t=t,
            p=float(2.0 * special.stdtr(min(dof, 1e9), -abs(t))) if t is not None else None, u_a=u_a,
            dof=float(dof) if math.isfinite(dof) else None,
            truth=truth, z=(value - truth) / u if truth is not None and u > 0.0 else None, limit=limit,
            verdict=uncertainty.assess_conformity(value, U, limit),
        )  # fmt: skip


def _budget(s: TorquerSetup, mean: float, u_mean: float) -> list[BudgetLine]:
    a, size = u_mean / KU, mean / KU
    lines = [
        BudgetLine(
            "scatter_of_the_k_n",
            "scatter of the K_n",
            a,
            UNIT,
            1.0,
            "1",
            a,
            UNIT,
            "K",
            "type A, with the linearity error in it",
        )
    ]
    if s.u_current > 0.0:
        lines.append(BudgetLine(AMMETER, s.u_current, "1", size, UNIT, size * s.u_current, UNIT, "K", "relative"))
    if s.u_time > 0.0:
        lines.append(
            BudgetLine("time_base", "time base", s.u_time, "1", size, UNIT, size * s.u_time, UNIT, "K", "relative")
        )
    return lines


def _table(i: Array, plus: Array, minus: Array, K_n: Array, half: Array, mean: float) -> Table:
    printed = round(mean / KU, 3)
    rows = [
        [float(i[k] / MA), float(plus[k] / DPH), float(minus[k] / DPH), float(K_n[k] / KU),
         float((K_n[k] - mean) / mean * 100.0), float((K_n[k] / KU - printed) / printed * 100.0), float(half[k] / DPH)]
        for k in range(i.size)
    ]  # fmt: skip
    return Table(
        "scale_factor_and_linearity",
        "Scale factor and linearity",
        f"Linearity against K = {mean / KU:.6g} and, as in Hu 1981, against {printed:.3f} °/h/mA",
        [
            "current / mA",
            "rate + / (°/h)",
            "rate − / (°/h)",
            "K_n / (°/h/mA)",
            "linearity / %",
            "linearity, K rounded / %",
            "drift / (°/h)",
        ],
        rows,
    )


def truth_of(parameters: Mapping[str, Any], currents: Array) -> dict[str, float] | None:
    """What a simulated torquer k i (1 + k2 i + k3 i2) makes of the reported values; k2 is even and goes into the half
    difference.  The drift has no one value: it changes with the range.
    """
    if "gyro.k" not in parameters:
        return None
    k, k3, error = (float(parameters.get(n, 0.0)) for n in ("gyro.k", "gyro.k3", "source.error"))
    k, full = k / (1.0 + error), float(currents.max()) / (1.0 + error)
    cubic = k3 * full**2
    truth = {
        "K_1": k / KU,
        "K_3/K_1": cubic * 100.0,
        "K": k / KU * (1.0 + cubic * float(np.mean((currents / currents.max()) ** 2))),
    }
    return truth | ({"K_LS": k / KU} if k3 == 0.0 else {})


@handling_errors.examined(handling_candidates.table_of_rates)
def from_record(record: Record, specification: Specification | None = None) -> DriftTestResult:
    """:func:`reduce` of a record: of a run (windows of the servo phases), or of measured data (one row per current)."""
    options, measured = record.run.options, record.run.measured
    plan = record.run.plan
    rows = record.windows if measured else marks.rows(record.windows, plan)
    truth, found = None, None
    corrections = str(options.get("corrections", ""))
    if measured and corrections.strip():
        raise ReductionError("corrections: a table of rates has no angles to correct; correct its currents and rates")
    if not measured and not problems(rows):
        sizes = Sizes(**run_metadata.sizes(options, [f.name for f in fields(Sizes)]))
        site = run_metadata.Site.of(record.run)
        found = precession(
            record.windows, marks.senses(plan), np.asarray(rows["current"]), sizes, corrections, site.earth_rate
        )
        truth = truth_of(record.run.parameters, np.asarray(rows["current"]))
    setup = TorquerSetup(
        u_current=float(options.get("u_current", 0.0)),
        u_time=float(options.get("u_time", 0.0)),
        errors=simulated_errors(record.run),
        specification=specification,
        instrument=record.run.instrument,
        simulated=truth is not None,
        truth=truth,
        site={} if measured else run_metadata.Site.of(record.run).shown(),
    )
    return run_metadata.finish(reduce(rows, setup, found), record)
