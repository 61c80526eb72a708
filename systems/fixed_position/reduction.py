"""Reduction of the fixed-position test: one composite drift, its noise, its stability over repeats.

    omega_d = omega_IA - k i,   omega_IA = W I . (0, cos phi, sin phi)

mean over the readings under a noise model estimated from them.  One attitude: no coefficient can be told from another.
Repeats on several days are reduced day by day and then together (gyrobench.reduction.estimation.repeatability).
[TEST-FIXED; Hu 1981, ch. 3 par. 2.2; RED-GLS]

Not modelled: drift slower than the record beyond a linear trend, change of the attitude under load.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from gyrobench import drift, frames, units
from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.diagnosis import handling_candidates, handling_errors
from gyrobench.reduction.estimation import nuisances, repeatability
from gyrobench.reduction.estimation.effects import Effect, with_set_up
from gyrobench.reduction.estimation.findings import Findings, Group
from gyrobench.reduction.estimation.fit_result import linear_result, plus_minus
from gyrobench.reduction.estimation.linear_fit import fit
from gyrobench.reduction.estimation.quantity import Quantity
from gyrobench.reduction.series.noise_coefficients_table import noise_coefficients_table
from gyrobench.reduction.setup import run_metadata
from gyrobench.reduction.setup.setups import SiteSetup, attitude_of, scale_factor_problems
from gyrobench.reduction.setup.sources import CURRENT_OFFSET, CURRENT_RESOLUTION, LATITUDE, TORQUER_SCALE, TURNED
from gyrobench.reduction.setup.window_checks import ReductionError, window_problems
from gyrobench.result import DriftTestResult, Specification, Table

__all__ = ["ReductionError", "Setup", "from_record", "reduce"]

DPH, DEG = units.factor("deg/h"), units.factor("deg")
LEAST = 8  # readings
STATED = "positive where the stated one is too large"


@dataclass(frozen=True, kw_only=True)
class Setup(SiteSetup):
    """attitude: rows I, O, S in (E, N, U).  k: torquer scale factor, rad/s/A.  quantum: resolution of the current
    reading.
    """

    k: float
    attitude: Array = field(default_factory=lambda: np.eye(3))
    u_attitude: float = 0.0
    u_latitude: float = 0.0
    u_scale_factor: float = 0.0
    u_current: float = 0.0
    quantum: float = 0.0

    @property
    def xyz(self) -> Array:
        """(X, Y, Z) = -f/g0 along I, O, S."""
        out: Array = self.attitude @ -frames.U * self.gravity / frames.G0
        return out

    @property
    def input_rate(self) -> float:
        """Earth rate along the input axis, rad/s."""
        return float(self.attitude[0] @ frames.earth_rate_local(self.latitude, self.earth_rate))


def reduce(windows: Mapping[str, Array], setup: Setup) -> DriftTestResult:
    """Composite drift of one day: t_start, t_end (s), mean (A) and, optional, flagged.

    Raises ReductionError with everything that is wrong with setup or record.
    """
    problems = frames.latitude_problems(setup.latitude) + frames.gravity_problems(setup.gravity)
    problems += scale_factor_problems(setup.k) + frames.rotation_problems({"attitude": setup.attitude})
    still = np.zeros(len(windows.get("mean", ())))
    problems += window_problems({"phase": still, "angle_start": still, "angle_end": still, **windows})
    if not problems and still.size < LEAST:
        problems.append(f"{still.size} readings: at least {LEAST} are needed to estimate the noise")
    if problems:
        raise ReductionError(problems)
    t0, t1, i = (np.asarray(windows[n], dtype=float) for n in ("t_start", "t_end", "mean"))
    y = setup.input_rate - setup.k * i
    true = None if setup.truth is None else float(drift.drift(setup.xyz, setup.truth))
    book = float(np.average(y, weights=t1 - t0))
    middle = (t0 + t1) / 2.0
    shown = Group("composite drift", np.arange(y.size), (middle - t0[0]) / 3600.0, "time", "h")
    wanted = Quantity.of("ω_d", "composite drift along the input axis in this attitude", "deg/h", true, book)
    names = drift.terms(9)
    share = drift.regressors(setup.xyz, names)
    wanted = replace(wanted, combination=dict(zip(names, share.tolist(), strict=True)))
    found = fit([wanted], np.ones((y.size, 1)), y, t0, t1, [shown], "drift rate", "°/h", DPH,
                candidates=nuisances.common(windows) if setup.nuisances else ())  # fmt: skip
    found = with_set_up(found, lambda f: _effects(setup, f, i), setup.corrections)
    trend = _trend(found, middle)
    result = linear_result(
        found,
        system="fixed_position",
        title="Fixed-position test of a floated gyro",
        method="Torque rebalance in one attitude; mean of the readings under an estimated noise model [TEST-FIXED]",
        sources=["TEST-FIXED; Hu 1981, ch. 3 par. 2.2",
                 "RED-GLS; Hu 1981, eq. 4-79..4-88, corrected by ER23"],
        equation='omega_d = omega_"IA" - k i, quad omega_"IA" = omega_E (I_N cos phi + I_U sin phi)',
        conventions=_conventions(setup),
        effects=_effects(setup, found, i),
        **setup.reported(),
        closed_caption="Least squares under the noise model; closed: ω_IA − k times the mean current",
        tables=[_table(setup, i, t0, t1, book)],
    )  # fmt: skip
    if trend is not None:
        result.repeatability = {"trend over the record / (°/h)": trend[0] / DPH, "u of it / (°/h)": trend[1] / DPH,
                                "record / s": float(np.ptp(middle))}  # fmt: skip
    c = result.coefficients[0]
    result.summary = [
        f"Composite drift ω_d = {plus_minus(c) if not found.ideal else f'{c.estimate:.6g} {c.unit}'} in one attitude.",
        "Constant drift, unbalance and compliance are in it together; other attitudes part them.",
        found.noise_sentence("readings"),
        *found.nuisance_sentences(),
    ]
    return result


def _trend(found: Findings, middle: Array) -> tuple[float, float] | None:
    """Return the change of the drift over the record and its u, rad/s: of the nuisance model where the trend is in it,
    else of an F test, which is added; None for ideal data.
    """
    span = max(float(np.ptp(middle)), 1e-9)
    names = [q.name for q in found.quantities]
    if "trend" in names:
        j, hours = names.index("trend"), span / 3600.0
        return float(found.value[j]) * hours, float(found.u[j]) * hours
    tested = found.f_test(
        "trend", "trend", ((middle - middle.mean()) / span)[:, None], "drift that changes with time",
        "the drift changes over the record; its mean holds for this record only", "no trend beyond the noise",
    )  # fmt: skip
    return None if tested is None else (float(tested[0][0]), float(tested[1][0]))


def _effects(s: Setup, found: Any, current: Array) -> list[Effect]:
    small = 1e-5
    by_latitude = s.earth_rate * float(
        s.attitude[0] @ (frames.pole(s.latitude + small) - frames.pole(s.latitude - small)) / (2.0 * small)
    )
    turned = []
    for axis, name in ((1, "output"), (2, "spin")):
        R = frames.rotation(np.eye(3)[axis], small).T @ s.attitude
        rate = float((R[0] - s.attitude[0]) @ frames.earth_rate_local(s.latitude, s.earth_rate)) / small
        text = "the Earth's rate only; the drift itself changes with the attitude by its g coefficients"
        turned.append(TURNED[name].effect(s, found.error(-rate), note=text))
    offset = found.error(-s.k)
    return [
        *turned,
        LATITUDE.effect(s, found.error(by_latitude)),
        TORQUER_SCALE.effect(s, found.error(-s.k * current), note=f"relative, {STATED}"),
        CURRENT_OFFSET.effect(s, offset),
        CURRENT_RESOLUTION.effect(s.quantum / 12.0**0.5, offset),
    ]


def _conventions(s: Setup) -> list[str]:
    axes = "; ".join(f"{n} = ({', '.join(f'{v:.6g}' for v in row)})" for n, row in zip("IOS", s.attitude, strict=True))
    return [
        "Drift ω_d in precession sign; k i = ω_IA − ω_d, positive current precesses positively.",
        f"Attitude, in east, north, up: {axes}.",
        f"k = {s.k * 1e-3 / DPH:.6g} °/h/mA.",
        "One attitude gives one number: no separation of constant, g and g² terms.",
    ]


def _table(s: Setup, i: Array, t0: Array, t1: Array, book: float) -> dict[str, Any]:
    X, Y, Z = s.xyz.tolist()
    return Table(
        "from_current_to_drift",
        "From current to drift",
        "Means over the record",
        ["quantity", "value", "unit"],
        [
            ["Earth rate along the input axis ω_IA", s.input_rate / DPH, "°/h"],
            ["mean current i", float(np.average(i, weights=t1 - t0)) * 1e3, "mA"],
            ["k i", s.k * float(np.average(i, weights=t1 - t0)) / DPH, "°/h"],
            ["ω_d = ω_IA − k i", book / DPH, "°/h"],
            ["X, Y, Z = −f/g0 along I, O, S", f"{X:.6f}, {Y:.6f}, {Z:.6f}", "1"],
            ["time of the readings", float(np.sum(t1 - t0)), "s"],
        ],
    )


def setup_of(run: RunDocument, specification: Specification | None = None) -> Setup:
    """Return the setup that a run.json describes."""
    return Setup.of(
        run,
        specification,
        attitude=attitude_of(run),
        k=run_metadata.number(run, "k", "gyro.k", "torquer scale factor"),
        truth=run_metadata.truth_of(run, drift.NAMES),
        quantum=float(run.parameters.get("rebalance.resolution", 0.0)),
    )


def from_record(record: Record, specification: Specification | None = None) -> DriftTestResult:
    """:func:`reduce` of a record, day by day where it holds several, with its run.json as provenance.

    A long record has a table of its noise coefficients.
    """
    result = _examined(record, specification)
    result.tables += noise_coefficients_table(result, record)
    return result


@handling_errors.examined(handling_candidates.at_rest)
def _examined(record: Record, specification: Specification | None = None) -> DriftTestResult:
    setup = setup_of(record.run, specification)
    day = {row.phase: row.day for row in record.run.plan}
    phases = np.asarray(record.windows["phase"]).astype(int).tolist()
    names = np.array([day.get(p, "") for p in phases])
    each = {}
    for name in dict.fromkeys(names.tolist()) or [""]:
        mine = {n: np.asarray(v)[names == name] for n, v in record.windows.items()}
        try:
            each[name] = reduce(mine, setup)
        except ReductionError as error:
            raise ReductionError([f"day {name}: {p}" if name else p for p in error.problems]) from None
    if len(each) == 1:
        return run_metadata.finish(next(iter(each.values())), record)
    return run_metadata.finish(repeatability.combine_days(each, specification=specification), record)
