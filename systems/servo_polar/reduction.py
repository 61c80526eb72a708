"""Reduction of the polar servo test: drift coefficients, composite drift and its stability from table angles.

    theta' + omega_E,x = D_F + D_I X + D_O Y + D_S Z + D_II X2 + D_SS Z2 + D_IO XY + D_OS YZ + D_IS XZ + noise

Least squares over all windows, regressors averaged over each; noise white, Gauss-Markov and of the angle readings,
estimated from the same record.  The formulas of Hu 1981 stand beside.  [TEST-SERVO-POLAR, TEST-COMPOSITE]

Not modelled: change of the coefficients per g with time (turns compared show it); see
gyrobench.reduction.drift.servo_regression.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gyrobench import drift
from gyrobench.arrays import Array
from gyrobench.attitudes import POLAR, SERVO_ATTITUDES, on_servo_table
from gyrobench.record.record import Record
from gyrobench.reduction.diagnosis import handling_candidates, handling_errors
from gyrobench.reduction.drift import composite, harmonic, servo_regression
from gyrobench.reduction.drift.turns import Turns
from gyrobench.reduction.estimation.effects import Effect, remounts, with_set_up
from gyrobench.reduction.estimation.findings import Findings, Group
from gyrobench.reduction.estimation.fit_result import linear_result, plus_minus
from gyrobench.reduction.estimation.linear_fit import fit
from gyrobench.reduction.series.noise_coefficients_table import noise_coefficients_table
from gyrobench.reduction.setup import run_metadata, setups
from gyrobench.reduction.setup.simulated_errors import simulated_errors
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import DriftTestResult, Specification, Table
from gyrobench.units import DPH

from . import closed, live, refusals
from .model import Model

SIZES = ("u_axis", "u_mount", "u_wobble", "u_angle1", "u_angle2", "u_unbalance", "u_time")


def from_record(record: Record, specification: Specification | None = None) -> DriftTestResult:
    """Coefficients and composite drift of a record (gyrobench.record.record.Record).  Raises ReductionError.

    A long record has a table of its noise coefficients.
    """
    result = _examined(record, specification)
    result.tables += noise_coefficients_table(result, record, residual=True)
    result.tables += live.had_it_stopped(record, result, _examined)
    return result


@handling_errors.examined(handling_candidates.servo)
def _examined(record: Record, specification: Specification | None = None) -> DriftTestResult:
    run, windows = record.run, record.windows
    options = dict(run.options)
    site = run_metadata.Site.of(run)
    route, which = str(options.get("route", "dwells")), int(options.get("terms", 9))
    labels = {row.phase: row.label for row in run.plan if row.mode == "servo"}
    if route != "dwells" or len({n for n in labels.values() if n in POLAR}) == 1:
        labels = {p: n for p, n in labels.items() if n in POLAR or n not in SERVO_ATTITUDES}
    if wrong := refusals.latitude_problems(site.latitude):
        raise ReductionError(wrong)
    held, phase, rows = servo_regression.held_windows(windows, labels, SERVO_ATTITUDES, site.latitude)
    wrong = refusals.record_problems(held, phase, labels)
    limit = float(options.get("tracking", servo_regression.TRACKING))
    wrong += servo_regression.tracking_problems(windows, rows, run.parameters, limit)
    mounts = [n for n in labels.values() if n in POLAR]
    dwells = {n for n in labels.values() if n not in POLAR}
    if route == "dwells" and len(set(mounts)) > 1 and dwells != {"x east, y up", "x east, y down"}:
        wrong.append(
            "R and K_zx both asked for: two dwells 'x east, y up' and 'x east, y down' are needed (route dwells), or "
            "the assumption K_zx = K_xz (route equal); route combination gives R + K_zx γ² sin²φ"
        )
    if not mounts:
        wrong.append(f"no polar mount in the record; phases are {', '.join(labels.values())}")
    if wrong:
        raise ReductionError(wrong)
    start, end, t0, t1 = held.angle_start, held.angle_end, held.t_start, held.t_end
    model = Model.of(route, mounts, which)
    y, X = servo_regression.drift_rate(held, site), model.columns(held, site)
    groups = {n: np.isin(phase, [p for p, m in labels.items() if m == n]) for n in labels.values()}
    book, fits, why = closed.reduce(start, end, t1 - t0, groups, site.latitude, site.g, site.earth_rate, route)
    truth = run_metadata.truth_of(run, drift.NAMES)
    fitted, reported = model.quantities(site, truth, book)
    weighed = [] if not setups.weighed(run) else servo_regression.candidates(
        held, site, lambda h: model.columns(h, site), phase, {n: np.asarray(v)[rows] for n, v in windows.items()}
    )  # fmt: skip
    shown = [_group(labels, p, phase, held, site, model) for p in labels]
    try:
        found = fit(fitted, X, y, t0, t1, shown, "drift rate", "°/h", DPH, noise="readings", candidates=weighed)
    except ReductionError as error:
        raise ReductionError([*error.problems, refusals.turned_words(held, phase, labels)]) from None
    sizes = run_metadata.sizes(run.options, SIZES)

    def effects_of(found: Findings) -> list[Effect]:
        return servo_regression.effects(held, site, found, lambda h: model.columns(h, site), phase, sizes)

    found = with_set_up(found, effects_of, run.options.get("corrections", ""), remount=run_metadata.remount_of(run))
    turns = Turns(found, [(labels[p], phase == p) for p in labels if labels[p] in POLAR], start, end)
    turns.test()
    found = model.report(found, reported)
    live_tables = live.tables(windows, labels, run.parameters)
    statistics = _composite(found, labels, phase, held, site)
    together = {n: model.words(n, book=True) for n in model.fitted}
    warnings = refusals.unseen(route, mounts, which)
    missing = [n for n in drift.NAMES if n not in model.names and (truth or {}).get(n, 0.0) != 0.0]
    if missing and which != 4:
        warnings.append(f"{', '.join(missing)} is simulated but not in the {which}-term model: the others are biased.")
    result = linear_result(
        found,
        system="servo_polar",
        title="Polar servo test of a floated gyro",
        method="The gyro holds a table with its axis along the pole in two mounts; least squares over all windows "
        "under an estimated noise model with shared angle readings [TEST-SERVO-POLAR]",
        sources=[
            "TEST-SERVO-POLAR, SERVO-C3-REDUCE; Hu 1981, eq. 3-84..3-90, Tables 3-2, 3-3, corrected by "
            "E39, E40, E42-E44, E52, E53",
            "TEST-COMPOSITE; Hu 1981, eq. 3-91..3-93, corrected by E45, E46",
            "RED-RATE (shared readings), RED-GLS; Hu 1981, eq. 4-1..4-11, 4-79..4-88, corrected by ER1, ER23",
        ],
        equation=servo_regression.equation(model.names),
        conventions=(
            *servo_regression.CONVENTIONS,
            "Harmonics: a cosine, b sine of θ; Hu 1981 has them the other way.",
        ),
        effects=[*effects_of(found), *remounts(found, run_metadata.remount_of(run))],
        specification=specification,
        site=site.shown(),
        instrument=run.instrument,
        errors=simulated_errors(run),
        simulated=truth is not None,
        no_closed=why,
        closed_caption="From the same windows; the formulas: harmonics of each mount, means of the dwells",
        tables=[
            servo_regression.book_table(found, together),
            *turns.table(),
            *_turn_differences(found, turns, labels, phase),
            *composite.tables(statistics, DPH, "°/h"),
            *live_tables,
        ],
        harmonics=turns.harmonics(fits),
        repeatability=turns.repeatability(),
        warnings=warnings,
        robust=bool(options.get("robust", False)),
    )  # fmt: skip
    result.summary = [*_summary(result, statistics, found), *live.sentence(live_tables)]
    return run_metadata.finish(result, record)


def _group(
    labels: Mapping[int, str],
    p: int,
    phase: NDArray[np.int_],
    held: servo_regression.Held,
    site: run_metadata.Site,
    model: Model,
) -> Group:
    """Drift against table angle in the turns, against time in a dwell."""
    mine = phase == p
    if labels[p] not in POLAR:
        middle = (held.t_start + held.t_end) / 2.0
        return Group(labels[p], mine, middle[mine] - held.t_start[mine][0], "time in the dwell", "s")
    angle = np.degrees(np.mod(((held.angle_start + held.angle_end) / 2.0)[mine], 2.0 * math.pi))
    dense = np.radians(np.arange(0.0, 361.0, 3.0))
    axes = np.broadcast_to(on_servo_table(labels[p], site.latitude), (dense.size, 3, 3))
    zero = np.zeros_like(dense)
    curve = model.columns(servo_regression.Held(dense, dense, zero, zero + 1.0, axes), site)
    return Group(labels[p], mine, angle, "table angle", "°", (np.degrees(dense), curve))


def _composite(
    found: Findings,
    labels: Mapping[int, str],
    phase: NDArray[np.int_],
    held: servo_regression.Held,
    site: run_metadata.Site,
) -> dict[str, composite.Composite | str]:
    """Statistics of each phase: what the fit says to go with the angle is removed, in whole turns all but its constant,
    in part of one all but its mean.
    """
    fitted = found.y - found.est.residual
    out: dict[str, composite.Composite | str] = {}
    for p, label in labels.items():
        mine = phase == p
        constant = float(fitted[mine].mean())
        if label in POLAR and refusals.turned(held.angle_start[mine], held.angle_end[mine]) >= closed.WHOLE:
            constant = float(harmonic.fit(held.angle_start[mine], held.angle_end[mine], fitted[mine]).beta[0])
        d = found.est.residual[mine] + constant
        earth = float((held.axes[mine][0] @ (site.earth_rate * _pole(site)))[0])
        name = label if list(labels.values()).count(label) == 1 else f"{label} (phase {p})"
        t = held.t_start[mine], held.t_end[mine]
        wrong = composite.problems(d, *t, earth)
        out[name] = "; ".join(wrong) if wrong else composite.composite(d, *t, earth)
    return out


def _pole(site: run_metadata.Site) -> Array:
    return np.array([0.0, math.cos(site.latitude), math.sin(site.latitude)])


def _turn_differences(found: Findings, turns: Turns, labels: Mapping[int, str], phase: NDArray[np.int_]) -> list[Table]:
    """Later turns less the first, point by point at the same angle; the fit, common to all turns, drops out."""
    rows: list[list[Any]] = []
    middle = (turns.start + turns.end) / 2.0
    for p, label in labels.items():
        mine = phase == p
        if label not in POLAR or not turns.turn[mine].any():
            continue
        first = mine & (turns.turn == 0)
        x, r = np.mod(middle[first], 2.0 * math.pi), found.est.residual[first] / DPH
        order = np.argsort(x)
        for k in range(1, int(turns.turn[mine].max()) + 1):
            there = mine & (turns.turn == k)
            if np.count_nonzero(there) < 0.8 * x.size:
                continue
            at = np.mod(middle[there], 2.0 * math.pi)
            d = found.est.residual[there] / DPH - np.interp(at, x[order], r[order], period=2.0 * math.pi)
            rows.append([label, k + 1, d.size, float(d.mean()), float(d.std(ddof=1))])
    if not rows:
        return []
    head = ["series", "turn", "windows", "mean difference / (°/h)", "scatter / (°/h)"]
    return [Table("turns_less_the_first_turn", "Turns less the first turn", "At the same table angle", head, rows)]


def _summary(
    result: DriftTestResult, statistics: Mapping[str, composite.Composite | str], found: Findings
) -> list[str]:
    first = result.coefficients[0]
    out = [f"Constant drift {first.name} = {plus_minus(first)}."]
    whole = {n: c for n, c in statistics.items() if not isinstance(c, str) and n.startswith("polar")}
    if whole:
        name, worst = max(whole.items(), key=lambda item: item[1].sigma)
        time = f"below 1/e after {worst.time:g} s" if worst.time is not None else "not below 1/e within a quarter"
        out.append(
            f"Random drift σ = {worst.sigma / DPH:.3g} °/h over windows of {worst.dT:g} s ({name}), correlation {time}."
        )
    return [*out, found.noise_sentence(), *found.nuisance_sentences()]
