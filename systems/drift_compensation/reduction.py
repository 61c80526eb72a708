"""Reduction of drift_compensation: residual rate and angle over the records, consistency of the filter."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy import special

from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.estimation import uncertainty
from gyrobench.reduction.loops.estimator_metrics import UncertainValue
from gyrobench.reduction.loops.estimator_result import Measures
from gyrobench.reduction.loops.loop_summary import told
from gyrobench.reduction.setup import run_metadata
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import LoopResult, Response, Specification, Test
from gyrobench.units import ARCSEC, DPH

from .closed_form import Expected, Model, expected

SHOWN = 400  # points of a drawn line
ENOUGH = 1e-3  # p below which a filter is called inconsistent


def from_record(record: Record, specification: Specification | None = None) -> LoopResult:
    """The result of a record; raises ReductionError where it holds fewer than three whole records."""
    c, run = record.channels, record.run
    rows = whole_records(c, float(run.options["length"]), float(run.options["Ts"]))
    limits = specification or {}
    parts = {n: np.asarray(x, dtype=float)[rows] for n, x in c.items()}  # (records, readings)
    count, n = rows.shape
    half = n // 2
    model = _expected(run, n) if _known(run) else None
    m = Measures()

    def size(name: str, meaning: str, values: Array, unit: str, scale: float, closed: float | None) -> None:
        v = rms_of_records(values)
        about = closed / scale if closed is not None else None
        m.add(name, meaning, unit, UncertainValue(v.value / scale, v.u / scale, v.dof), closed=about)

    def at(k: int, name: str) -> float | None:
        return None if model is None else float(getattr(model, name)[k])

    rate = parts["table.M"] - parts["compensator.u"]
    error = parts["table.M"] - parts["compensator.estimate"]
    size("angle", "rms table angle at the end of a record", parts["table.theta"][:, -1:], "″", ARCSEC, at(-1, "angle"))
    middle = parts["table.theta"][:, half - 1 : half]
    size("angle half", "rms table angle in the middle of a record", middle, "″", ARCSEC,
         at(half - 1, "angle"))  # fmt: skip
    size("angle free", "rms table angle at the end of a record, without compensation",
         parts["table.theta_free"][:, -1:], "″", ARCSEC, at(-1, "free"))  # fmt: skip
    size("rate", "rms drift rate that is left, second half of the records", rate[:, half:], "°/h", DPH, at(-1, "rate"))
    size("error", "rms error of the estimated drift, second half (closed: as the filter states it)", error[:, half:],
         "°/h", DPH, at(-1, "stated"))  # fmt: skip
    size("rate free", "rms of the drift", parts["table.M"], "°/h", DPH, _true(run, "drift"))
    size("torquer", "rms rate by the torquer", parts["compensator.u"], "°/h", DPH, None)
    share = float(np.mean(parts["compensator.saturated"])) if "compensator.saturated" in parts else 0.0
    if share > 0.0:
        m.warnings.append(
            f"The torquer is at its limit in {100.0 * share:.3g} % of the readings. There the drift is not compensated "
            "and the closed forms do not apply. Raise u_max or trim the constant drift."
        )
    _consistency(m, parts, run, half)
    for x in m.coefficients:
        x.limit = limits.get(x.name)
        x.verdict = uncertainty.assess_conformity(x.estimate, x.k * x.u, x.limit)
    m.warnings += _against_closed(m)
    name = run.parts["compensator"].name if "compensator" in run.parts else ""
    result = LoopResult(
        system="drift_compensation",
        title="Compensation of random drift",
        method="Rms of residual rate and angle over records that each begin with the table at zero",
        sources=["COMP-RANDOM-DRIFT; Hu 1981, section 6.2, eq. 6-24..6-31, corrected by ER39, ER40"],
        equation='dot(M) = -M\\/tau + w, quad dot(alpha) = M - u, quad dot(theta) = (alpha - theta)\\/T, quad '
        'u = hat(M) + hat(alpha)\\/T_c',
        conventions=[
            "k i = ω_IA − ω_d: the current i = −u/k turns the gyro against its drift M.",
            "Angle: of the table, inertial; Earth rate is taken off.",
            f"{count} records of {n} readings; u from their number (angles at one time) or their scatter.",
            "Closed forms: covariance of table and filter together, torquer not limited.",
        ],
        coefficients=m.coefficients,
        dof=float(error.size),
        residual_std=m.named("error").estimate,
        residual_unit="°/h",
        tests=m.tests,
        warnings=m.warnings,
        summary=told(
            m.coefficients,
            "The drift alone turns the table by {angle free} (rms) in a record, compensated it turns by {angle}.",
            "The drift rate of {rate free} is reduced to {rate}; the drift is known to {error}.",
        ),
        decision_rule=uncertainty.DECISION_RULE,
        verdict=uncertainty.worst_verdict(x.verdict for x in m.coefficients),
        instrument=name,
        ranked_by="angle",
        responses=_figures(parts, rows.shape[1], float(run.options["Ts"]), model),
    )  # fmt: skip
    return run_metadata.finish(result, record)


def whole_records(channels: dict[str, Array], length: float, step: float) -> NDArray[np.int_]:
    """Return the rows of each whole record (records, readings): from the first reading after a restart to the last
    before the next one.  Raises ReductionError."""
    missing = [n for n in ("time", "table.theta", "table.M", "compensator.u") if n not in channels]
    if missing:
        raise ReductionError([f"channel {n} is missing" for n in missing])
    time = np.asarray(channels["time"], dtype=float)
    n = round(length / step) - 1  # the reading at the end of a record is the zero of the next one
    first = np.searchsorted(time, np.arange(int((time[-1] + 0.5 * step) // length)) * length + 0.5 * step)
    if first.size < 3:
        raise ReductionError(f"{first.size} whole records of {length:g} s: at least 3 are needed")
    rows: NDArray[np.int_] = first[:, None] + np.arange(n)
    return rows


def rms_of_records(values: Array) -> UncertainValue:
    """Return the rms of values (records, readings) and its u from the scatter of the records' mean squares.

    One reading each: u = rms/sqrt(2 n), Gaussian.
    """
    squares = np.mean(values * values, axis=1)
    n, value = squares.size, math.sqrt(float(np.mean(squares)))
    if value == 0.0:
        return UncertainValue(0.0, 0.0, n - 1.0)
    spread = math.sqrt(2.0) * value * value if values.shape[1] == 1 else float(np.std(squares, ddof=1))
    return UncertainValue(value, spread / math.sqrt(n) / (2.0 * value), n - 1.0)


def nees(parts: dict[str, Array], rms: float, sigma: float) -> Array:
    """Return error' P^-1 error of drift, alpha, theta (records, readings), all in the filter's units."""
    e = np.stack(
        [
            (parts["table.M"] - parts["compensator.estimate"]) / rms,
            (parts["table.alpha"] - parts["compensator.alpha"]) / sigma,
            (parts["table.theta"] - parts["compensator.theta"]) / sigma,
        ],
        axis=-1,
    )
    P = np.empty((*e.shape, 3))
    for i in range(3):
        for j in range(3):
            a, b = min(i, j) + 1, max(i, j) + 1
            P[..., i, j] = parts[f"compensator.covariance[{a},{b}]"]
    return np.asarray(np.einsum("...i,...i->...", e, np.linalg.solve(P, e[..., None])[..., 0]))


def _consistency(m: Measures, parts: dict[str, Array], run: RunDocument, half: int) -> None:
    """NEES and NIS of the second half of the records, u from the scatter of the records."""
    if "compensator.covariance[1,1]" in parts and "compensator.rms" in run.parameters:
        squares = nees(
            {n: x[:, half:] for n, x in parts.items()},
            float(run.parameters["compensator.rms"]),
            float(run.parameters["compensator.sigma"]),
        )
        _mean_of_squares(m, "NEES", "error of drift and angles", squares, 3.0)
    if "compensator.nis" in parts and np.any(parts["compensator.nis"] > 0.0):
        _mean_of_squares(m, "NIS", "innovation", parts["compensator.nis"][:, half:], 1.0)


def _mean_of_squares(m: Measures, name: str, what: str, squares: Array, wanted: float) -> None:
    per_record = squares.mean(axis=1)
    v = UncertainValue(
        float(per_record.mean()), float(np.std(per_record, ddof=1) / math.sqrt(per_record.size)), per_record.size - 1.0
    )
    m.add(name, f"mean squared {what} over its stated covariance", "1", v, truth=wanted)
    t = (v.value - wanted) / v.u if v.u > 0.0 else 0.0
    p = 2.0 * float(special.stdtr(v.dof, -abs(t)))
    if p >= ENOUGH:
        finding = "consistent with the stated covariance"
    else:
        finding = f"inconsistent: the filter {'understates' if t > 0.0 else 'overstates'} its {what}"
        m.warnings.append(
            f"{name} = {v.value:.3g} instead of {wanted:g}, {uncertainty.p_text(p)}. {finding.capitalize()}. Its "
            "model of drift, table or torquer is not the one of the table."
        )
    m.tests.append(Test(name, v.value, p, f"mean {wanted:g} where the stated covariance is right", finding))


def _known(run: RunDocument) -> bool:
    return all(f"table.{n}" in run.parameters for n in ("drift", "drift_tau", "lag", "reading", "k")) and all(
        f"compensator.{n}" in run.parameters for n in ("rms", "tau", "lag", "sigma", "k", "T_c")
    )


def _true(run: RunDocument, name: str) -> float | None:
    value = run.parameters.get(f"table.{name}")
    return None if value is None else float(value)


def _expected(run: RunDocument, n: int) -> Expected:
    p = {k: float(v) for k, v in run.parameters.items() if isinstance(v, int | float)}
    gain = p["table.k"] * (1.0 + p.get("table.k_error", 0.0)) / p["compensator.k"]
    reading = math.hypot(p["table.reading"], p.get("table.quantum", 0.0) / math.sqrt(12.0))
    true = Model(
        p["table.drift"], p["table.drift_tau"], p["table.lag"], reading, p.get("table.white", 0.0), gain
    )  # fmt: skip
    believed = Model(
        p["compensator.rms"], p["compensator.tau"], p["compensator.lag"], p["compensator.sigma"],
        p.get("compensator.white", 0.0),
    )  # fmt: skip
    return expected(true, believed, float(run.options["Ts"]), n, p["compensator.T_c"])


def _against_closed(m: Measures) -> list[str]:
    """Name the figures that lie more than four u from their closed form."""
    off = [
        c.name
        for c in m.coefficients
        if c.closed is not None and c.u > 0.0 and c.name != "error" and abs(c.estimate - c.closed) > 4.0 * c.u
    ]
    if not off:
        return []
    return [
        f"More than four u from the closed form: {', '.join(off)}. It holds for a torquer within its limit and "
        "independent records. Look at both."
    ]


def _figures(parts: dict[str, Array], n: int, step: float, model: Expected | None) -> list[Response]:
    pick = np.unique(np.linspace(0, n - 1, min(SHOWN, n)).astype(int))
    hours = ((pick + 1) * step / 3600.0).tolist()
    lines = {
        "without": np.sqrt(np.mean(parts["table.theta_free"] ** 2, axis=0)),
        "with": np.sqrt(np.mean(parts["table.theta"] ** 2, axis=0)),
    }
    if model is not None:
        lines |= {"without, expected": model.free, "with, expected": model.angle}
    floor = 1e-3 * ARCSEC  # an angle of 0 has no place on a logarithmic axis
    curves = [
        {"label": k, "x": hours, "y": np.log10(np.maximum(y[pick], floor) / ARCSEC).tolist(), "phase": []}
        for k, y in lines.items()
    ]
    last = (pick.size and parts["table.M"].shape[0]) - 1
    drift = {
        "drift": parts["table.M"][last],
        "estimate": parts["compensator.estimate"][last],
        "left": parts["table.M"][last] - parts["compensator.u"][last],
    }
    return [
        Response(
            "angle", "time",
            "Rms over all records of the table angle with and without compensation, by the time since the record "
            "began: logarithm to base 10 of the angle in ″; expected: closed form.",
            hours, "time", "h", curves[1]["y"], "log₁₀ of the angle", "″", curves=curves,
        ),
        Response(
            "drift", "time", "Last record: drift, its estimate, and the rate that is left (drift less u).",
            hours, "time", "h",
            (drift["left"][pick] / DPH).tolist(), "rate", "°/h",
            curves=[{"label": k, "x": hours, "y": (y[pick] / DPH).tolist(), "phase": []} for k, y in drift.items()],
        ),
    ]  # fmt: skip
