"""Reduction of the vertical and level servo tests: drift coefficients and composite drift from table angles.

    theta' + omega_E,x = D_F + D_I X + D_O Y + D_S Z + D_II X2 + D_SS Z2 + noise,   as many as the attitudes tell apart

Least squares over all windows, regressors averaged over each; noise white, Gauss-Markov and of the angle readings,
estimated from the same record.  The formulas of Hu 1981 stand beside.  [TEST-SERVO-VERT, TEST-SERVO-LEVEL]

Not modelled: D_IO, D_OS, D_IS, which a level attitude sees by the sine of its angle (at most 1 degree); see
gyrobench.reduction.drift.servo_regression.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gyrobench import drift, frames
from gyrobench.arrays import Array
from gyrobench.attitudes import LEVEL, VERTICAL
from gyrobench.record.record import Record
from gyrobench.reduction.diagnosis import handling_candidates, handling_errors
from gyrobench.reduction.drift import composite, servo_regression
from gyrobench.reduction.estimation.effects import Effect, remounts, with_set_up
from gyrobench.reduction.estimation.findings import Findings, Group
from gyrobench.reduction.estimation.fit_result import linear_result, plus_minus
from gyrobench.reduction.estimation.linear_fit import fit
from gyrobench.reduction.estimation.quantity import Quantity
from gyrobench.reduction.series.noise_coefficients_table import noise_coefficients_table
from gyrobench.reduction.setup import run_metadata, setups
from gyrobench.reduction.setup.simulated_errors import simulated_errors
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import DriftTestResult, Specification, Table
from gyrobench.units import DPH

from . import closed, refusals

SIZES = ("u_axis", "u_mount", "u_wobble", "u_angle1", "u_angle2", "u_unbalance", "u_time")


def from_record(record: Record, specification: Specification | None = None) -> DriftTestResult:
    """Coefficients and composite drift of a record (gyrobench.record.record.Record).  Raises ReductionError.

    A long record has a table of its noise coefficients.
    """
    result = _examined(record, specification)
    result.tables += noise_coefficients_table(result, record, residual=True)
    return result


@handling_errors.examined(handling_candidates.servo)
def _examined(record: Record, specification: Specification | None = None) -> DriftTestResult:
    run, windows = record.run, record.windows
    options = dict(run.options)
    site = run_metadata.Site.of(run)
    labels = {row.phase: row.label for row in run.plan if row.mode == "servo"}
    held, phase, rows = servo_regression.held_windows(windows, labels, (*VERTICAL, *LEVEL), site.latitude)
    t0, t1 = held.t_start, held.t_end
    limit = float(options.get("tracking", servo_regression.TRACKING))
    wrong = refusals.record_problems(held, phase, labels)
    wrong += servo_regression.tracking_problems(windows, rows, run.parameters, limit)
    if wrong:
        raise ReductionError(wrong)
    seen = refusals.seen(list(labels.values()))

    def columns(h: servo_regression.Held) -> Array:
        return servo_regression.design(h, site, seen.names)

    y, X = servo_regression.drift_rate(held, site), columns(held)
    means = _class_means(y, t1 - t0, phase, labels)
    book = closed.formulas(means, site.g)
    truth = run_metadata.truth_of(run, drift.NAMES)
    quantities = [_quantity(n, seen, book, truth, site.g) for n in seen.names]
    weighed = [] if not setups.weighed(run) else servo_regression.candidates(
        held, site, columns, phase, {n: np.asarray(v)[rows] for n, v in windows.items()}
    )  # fmt: skip
    found = fit(quantities, X, y, t0, t1, _groups(labels, phase, held), "drift rate", "°/h", DPH, noise="readings",
                candidates=weighed)  # fmt: skip
    sizes = run_metadata.sizes(run.options, SIZES)

    def effects_of(found: Findings) -> list[Effect]:
        return servo_regression.effects(held, site, found, columns, phase, sizes)

    found = with_set_up(found, effects_of, run.options.get("corrections", ""), remount=run_metadata.remount_of(run))
    statistics: dict[str, composite.Composite | str] = {}
    for p, label in labels.items():
        rows = phase == p
        earth = float((held.axes[rows][0] @ (site.earth_rate * frames.pole(site.latitude)))[0])
        name = label if list(labels.values()).count(label) == 1 else f"{label}, phase {p}"
        bad = composite.problems(y[rows], t0[rows], t1[rows], earth)
        statistics[name] = "; ".join(bad) if bad else composite.composite(y[rows], t0[rows], t1[rows], earth)
    warnings = refusals.unseen(list(labels.values()))
    both = [n for n in seen.lost if (truth or {}).get(n, 0.0)]
    worst = float(
        np.max(
            np.abs(np.concatenate([held.angle_start, held.angle_end])[np.tile(_level(labels, phase), 2)]), initial=0.0
        )
    )
    if both and worst > 0.0:
        size = max(abs((truth or {})[n]) for n in both) * worst / DPH
        warnings.append(f"Of {', '.join(both)} angles up to {np.degrees(worst):.2g}° let {size:.1g} °/h in.")
    result = linear_result(
        found,
        system="servo_vertical_level",
        title="Vertical and level servo test of a floated gyro",
        method="The gyro holds a table with its axis vertical or level; least squares over all windows under an "
        "estimated noise model with shared angle readings [TEST-SERVO-VERT, TEST-SERVO-LEVEL]",
        sources=[
            "TEST-SERVO-VERT, TEST-SERVO-LEVEL, SERVO-C1, SERVO-C2; Hu 1981, eq. 3-60..3-83, corrected "
            "by E36-E38, E41",
            "TEST-COMPOSITE; Hu 1981, eq. 3-91..3-93, corrected by E45, E46",
            "RED-RATE (shared readings), RED-GLS; Hu 1981, eq. 4-1..4-11, 4-79..4-88, corrected by ER1, ER23",
        ],
        equation=servo_regression.equation(seen.names),
        conventions=servo_regression.CONVENTIONS,
        effects=[*effects_of(found), *remounts(found, run_metadata.remount_of(run))],
        specification=specification,
        site=site.shown(),
        instrument=run.instrument,
        errors=simulated_errors(run),
        simulated=truth is not None,
        no_closed="" if book else "Hu 1981 has formulas for class 1, for the three-term route and for complete pairs",
        closed_caption="From the same windows; the formulas take every attitude as at angle 0",
        tables=[
            _attitudes_table(means, found.est.residual, y, phase, labels),
            servo_regression.book_table(found, _book_words(seen)),
            *composite.tables(statistics, DPH, "°/h"),
        ],
        warnings=warnings,
        robust=bool(options.get("robust", False)),
    )  # fmt: skip
    result.summary = [
        *(f"{c.meaning[:1].upper()}{c.meaning[1:]} {c.name} = {plus_minus(c)}." for c in result.coefficients[:2]),
        found.noise_sentence(),
        *found.nuisance_sentences(),
    ]
    return run_metadata.finish(result, record)


def _class(name: str) -> str:
    """x down, x up, y down ...: which axis is vertical."""
    return name.rpartition(", ")[2]


def _class_means(y: Array, length: Array, phase: NDArray[np.int_], labels: Mapping[int, str]) -> dict[str, float]:
    """Mean drift of the attitudes with the same vertical axis, rad/s, each phase alike (end to end: (5.0))."""
    each: dict[str, list[float]] = {}
    for p, label in labels.items():
        rows = phase == p
        each.setdefault(_class(label), []).append(float(np.sum((y * length)[rows]) / np.sum(length[rows])))
    return {n: float(np.mean(v)) for n, v in each.items()}


def _level(labels: Mapping[int, str], phase: NDArray[np.int_]) -> NDArray[np.bool_]:
    return np.isin(phase, [p for p, n in labels.items() if not n.startswith(("x down", "x up"))])


def _quantity(
    name: str, seen: refusals.Seen, book: Mapping[str, float], truth: Mapping[str, float] | None, g: float
) -> Quantity:
    true = None if truth is None else seen.truth(name, truth, g)
    q = replace(Quantity.drift(name, true, book.get(name)), combination=seen.combination(name, g))
    shown = seen.shown(name)
    return replace(q, meaning=f"{q.meaning}, with compliance in it", shown=shown) if shown else q


def _book_words(seen: refusals.Seen) -> dict[str, str]:
    """Combinations in the notation of Hu 1981: R + γ² K_zx."""
    out = {}
    for name in seen.names:
        symbol, sign = servo_regression.BOOK[name]
        words = [symbol]
        for other, s, k in seen.mixed[name]:
            its, way = servo_regression.BOOK[other]
            words.append(f"{'+' if s * way * sign > 0 else '−'} {('', 'γ ', 'γ² ')[k]}{its}")
        out[name] = " ".join(words)
    return out


def _groups(labels: Mapping[int, str], phase: NDArray[np.int_], held: servo_regression.Held) -> list[Group]:
    """Drift against time, cycles of the same attitude together."""
    middle, out = (held.t_start + held.t_end) / 2.0, []
    for label in dict.fromkeys(labels.values()):
        rows = np.isin(phase, [p for p, n in labels.items() if n == label])
        first = np.array([held.t_start[phase == p][0] for p in phase[rows].tolist()])
        out.append(Group(label, rows, middle[rows] - first, "time in the dwell", "s"))
    return out


def _attitudes_table(
    means: Mapping[str, float], residual: Array, y: Array, phase: NDArray[np.int_], labels: Mapping[int, str]
) -> Table:
    rows: list[list[Any]] = []
    for p, label in labels.items():
        mine = phase == p
        rows.append([label, p, int(mine.sum()), float(y[mine].mean()) / DPH, float(residual[mine].mean()) / DPH])
    return Table(
        "drift_in_each_attitude",
        "Drift in each attitude",
        "Mean of the windows of a phase; residual: less the fitted model",
        ["attitude", "phase", "windows", "drift / (°/h)", "residual / (°/h)"],
        rows,
    )
