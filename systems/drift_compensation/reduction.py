"""Reduction of drift_compensation: residual rate and angle over the records, consistency of the filter."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy import special

from gyrobench.reduction.estimation.sentences import p_text, plain
from gyrobench.reduction.loops.estimator_metrics import UncertainValue
from gyrobench.reduction.loops.estimator_result import consistency_test
from gyrobench.reduction.loops.loop_reduction import MeasureReduction
from gyrobench.reduction.loops.loop_toolkit import Account, Array, ReductionError, RunDocument, over_time
from gyrobench.units import ARCSEC, DPH

from .closed_form import CompensatedDrift, ExpectedErrors, expected

SHOWN = 400  # points of a drawn line
ENOUGH = 1e-3  # p below which a filter is called inconsistent


class Reduction(MeasureReduction):
    """Rms of residual rate and angle over records that each begin with the table at zero."""

    part = "compensator"
    said = (
        "The drift alone turns the table by {angle free} (rms) in a record, compensated it turns by {angle}.",
        "The drift rate of {rate free} is reduced to {rate}; the drift is known to {error}.",
    )
    ranked_by = "angle"

    def measure(self) -> Account:
        """Measure the records.  Raises ReductionError for fewer than three whole ones."""
        run, c, found = self.run, self.record.channels, self.found
        rows = whole_records(c, float(run.options["length"]), float(run.options["Ts"]))
        self.parts = parts = {n: np.asarray(x, dtype=float)[rows] for n, x in c.items()}  # (records, readings)
        count, n = rows.shape
        half = n // 2
        self.model = _expected(run, n) if _known(run) else None
        theta, free = parts["table.theta"], parts["table.theta_free"]
        rate = parts["table.M"] - parts["compensator.u"]
        error = parts["table.M"] - parts["compensator.estimate"]
        end, middle = "at the end of a record", "in the middle of a record"
        self._size("angle", f"rms table angle {end}", theta[:, -1:], self._at(-1, "angle"))
        self._size("angle half", f"rms table angle {middle}", theta[:, half - 1 : half], self._at(half - 1, "angle"))
        self._size("angle free", f"rms table angle {end}, without compensation", free[:, -1:], self._at(-1, "free"))
        self._size("rate", "rms drift rate that is left, second half of the records", rate[:, half:],
                   self._at(-1, "rate"), "°/h")  # fmt: skip
        self._size("error", "rms error of the estimated drift, second half (closed: as the filter states it)",
                   error[:, half:], self._at(-1, "stated"), "°/h")  # fmt: skip
        true = run.parameters.get("table.drift")
        self._size("rate free", "rms of the drift", parts["table.M"], None if true is None else float(true), "°/h")
        self._size("torquer", "rms rate by the torquer", parts["compensator.u"], None, "°/h")
        share = float(np.mean(parts["compensator.saturated"])) if "compensator.saturated" in parts else 0.0
        text = (
            f"The torquer is at its limit in {plain(100.0 * share, 3)} % of the readings. There the drift is not "
            "compensated and the closed forms do not apply. Raise u_max or trim the constant drift."
        )
        found.warn("torquer.limit", text if share > 0.0 else "")
        self._consistency(half)
        self._against_closed()
        found.facts |= {"dof": float(error.size), "residual_std": found["error"].estimate, "residual_unit": "°/h"}
        self._figures(n, float(run.options["Ts"]))
        return Account(
            method="Rms of residual rate and angle over records that each begin with the table at zero",
            sources=["COMP-RANDOM-DRIFT; Hu 1981, section 6.2, eq. 6-24..6-31, corrected by ER39, ER40"],
            equation="dot(M) = -M\\/tau + w, quad dot(alpha) = M - u, quad dot(theta) = (alpha - theta)\\/T, quad "
            "u = hat(M) + hat(alpha)\\/T_c",
            conventions=[
                "k i = ω_IA − ω_d: the current i = −u/k turns the gyro against its drift M.",
                "Angle: of the table, inertial; Earth rate is taken off.",
                f"{count} records of {n} readings; u from their number (angles at one time) or their scatter.",
                "Closed forms: covariance of table and filter together, torquer not limited.",
            ],
        )

    def _size(self, name: str, meaning: str, values: Array, closed: float | None, unit: str = "″") -> None:
        scale = ARCSEC if unit == "″" else DPH
        self.found.add(name, meaning, unit, rms_of_records(values), scale=scale, closed=closed)

    def _at(self, k: int, name: str) -> float | None:
        """Return a standard deviation after reading k by the closed form."""
        return None if self.model is None else float(getattr(self.model, name)[k])

    def _consistency(self, half: int) -> None:
        """Test NEES and NIS of the second half of the records, u from the scatter of the records."""
        parts, p = {n: x[:, half:] for n, x in self.parts.items()}, self.run.parameters
        if "compensator.covariance[1,1]" in parts and "compensator.rms" in p:
            squares = nees(parts, float(p["compensator.rms"]), float(p["compensator.sigma"]))
            self._mean_of_squares("NEES", "error of drift and angles", squares, 3.0)
        if "compensator.nis" in parts and np.any(self.parts["compensator.nis"] > 0.0):
            self._mean_of_squares("NIS", "innovation", parts["compensator.nis"], 1.0)

    def _mean_of_squares(self, name: str, what: str, squares: Array, wanted: float) -> None:
        each = squares.mean(axis=1)
        v = UncertainValue(float(each.mean()), float(np.std(each, ddof=1) / math.sqrt(each.size)), each.size - 1.0)
        self.found.add(name, f"mean squared {what} over its stated covariance", "1", v, truth=wanted)
        t = (v.value - wanted) / v.u if v.u > 0.0 else 0.0
        p = 2.0 * float(special.stdtr(v.dof, -abs(t)))
        seeks = f"mean {wanted:g} where the stated covariance is right"
        wrong = consistency_test(self.found, name, v.value, wanted, p, p >= ENOUGH, seeks, what)
        text = (
            f"{name} = {plain(v.value, 3)} instead of {wanted:g}, {p_text(p)}. {wrong.capitalize()}. Its model of "
            "drift, table or torquer is not the one of the table."
        )
        self.found.warn(f"estimator.consistency:{name}", text if wrong else "")

    def _against_closed(self) -> None:
        """Name the figures that lie more than four u from their closed form."""
        known = [c for c in self.found.coefficients if c.closed is not None and c.u > 0.0 and c.name != "error"]
        off = [c.name for c in known if abs(c.estimate - (c.closed or 0.0)) > 4.0 * c.u]
        text = (
            f"More than four u from the closed form: {', '.join(off)}. It holds for a torquer within its limit and "
            "independent records. Look at both."
        )
        self.found.warn("closed_form.missed", text if off else "")

    def _figures(self, n: int, step: float) -> None:
        parts, model = self.parts, self.model
        hours: Array = (np.arange(n, dtype=np.float64) + 1) * step / 3600.0
        lines = {
            "without": np.sqrt(np.mean(parts["table.theta_free"] ** 2, axis=0)),
            "with": np.sqrt(np.mean(parts["table.theta"] ** 2, axis=0)),
        }
        if model is not None:
            lines |= {"without, expected": model.free, "with, expected": model.angle}
        floor = 1e-3 * ARCSEC  # an angle of 0 has no place on a logarithmic axis
        lines = {k: np.log10(np.maximum(y, floor) / ARCSEC) for k, y in lines.items()}
        caption = (
            "Rms over all records of the table angle with and without compensation, by the time since the record "
            "began: logarithm to base 10 of the angle in ″; expected: closed form."
        )
        rates = {"drift": parts["table.M"], "estimate": parts["compensator.estimate"]}
        rates["left"] = parts["table.M"] - parts["compensator.u"]
        drawn = {k: rate[-1] / DPH for k, rate in rates.items()}
        said = "Last record: drift, its estimate, and the rate that is left (drift less u)."
        self.found.responses += [
            over_time("angle", hours, lines, unit="″", y_name="log₁₀ of the angle", caption=caption, shown=SHOWN,
                      envelope=False, x_unit="h", compared="with"),
            over_time("drift", hours, drawn, unit="°/h", y_name="rate", caption=said, shown=SHOWN, envelope=False,
                      x_unit="h", compared="left"),
        ]  # fmt: skip


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


def _known(run: RunDocument) -> bool:
    return all(f"table.{n}" in run.parameters for n in ("drift", "drift_tau", "lag", "reading", "k")) and all(
        f"compensator.{n}" in run.parameters for n in ("rms", "tau", "lag", "sigma", "k", "T_c")
    )


def _expected(run: RunDocument, n: int) -> ExpectedErrors:
    p = {k: float(v) for k, v in run.parameters.items() if isinstance(v, int | float)}
    gain = p["table.k"] * (1.0 + p.get("table.k_error", 0.0)) / p["compensator.k"]
    reading = math.hypot(p["table.reading"], p.get("table.quantum", 0.0) / math.sqrt(12.0))
    true = CompensatedDrift(
        p["table.drift"], p["table.drift_tau"], p["table.lag"], reading, p.get("table.white", 0.0), gain
    )  # fmt: skip
    believed = CompensatedDrift(
        p["compensator.rms"], p["compensator.tau"], p["compensator.lag"], p["compensator.sigma"],
        p.get("compensator.white", 0.0),
    )  # fmt: skip
    return expected(true, believed, float(run.options["Ts"]), n, p["compensator.T_c"])
