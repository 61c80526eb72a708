"""Reduction of the single-axis tumble: nine drift coefficients of a floated gyro from averaged torquer currents.

    y = omega_IA - k i = D_F + D_I X + D_O Y + D_S Z + D_II X2 + D_SS Z2 + D_IO XY + D_OS YZ + D_IS XZ + noise

Every window is a row; regressors are averaged over the window as the current is, so no [AVG-SINC] damping is left.
The noise (white, Gauss-Markov or both) is estimated from the same record and weighs the rows.  The closed
formulas stand beside the estimates.  [TEST-TUMBLE1-SDF; Hu 1981, eq. 3-12..3-21]

Misalignment of the input axis, a trend in time, temperature, asymmetry of the torquer and constants that differ from
mount to mount or from turn-on to turn-on are weighed by the data (gyrobench.reduction.estimation.nuisances).

Not modelled: change of the drift with time other than linear, torquer nonlinearity (a line of the budget).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gyrobench import drift, frames
from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.reduction.diagnosis import handling_candidates, handling_errors
from gyrobench.reduction.drift import window_regressors
from gyrobench.reduction.drift.turns import Turns
from gyrobench.reduction.estimation import nuisances
from gyrobench.reduction.estimation.effects import remounts, with_set_up
from gyrobench.reduction.estimation.findings import Findings, Group
from gyrobench.reduction.estimation.fit_result import linear_result, plus_minus
from gyrobench.reduction.estimation.linear_fit import fit
from gyrobench.reduction.estimation.nuisances import Candidate
from gyrobench.reduction.estimation.quantity import Quantity
from gyrobench.reduction.setup import run_metadata
from gyrobench.reduction.setup.window_checks import ReductionError, window_problems
from gyrobench.result import Coefficient, DriftTestResult, Specification
from gyrobench.units import DPH

from . import budget, closed
from .refusals import plan_problems, refusals, setup_problems
from .setup import TumbleSetup, setup_of

__all__ = ["ReductionError", "TumbleSetup", "from_record", "reduce", "refusals", "setup_of"]

TILT_MEANING = "misalignment of the input axis towards the output axis"
FOLDED = {"D_F": "D_F + γ² D_OO", "D_II": "D_II − D_OO", "D_SS": "D_SS − D_OO"}


def reduce(windows: Mapping[str, Array], setup: TumbleSetup) -> DriftTestResult:
    """Coefficients with uncertainties from the windows of a record (columns of a record, SI; see checks).

    Raises ReductionError with everything that is wrong with setup or record.
    """
    problems = setup_problems(setup) + window_problems(windows)
    if not problems:
        problems = plan_problems(setup, windows)
    if problems:
        raise ReductionError(problems)
    phase = np.asarray(windows["phase"]).astype(int)
    column = {c: np.asarray(windows[c], dtype=float) for c in ("t_start", "t_end", "angle_start", "angle_end", "mean")}
    face = np.array([np.asarray(setup.faces[p], dtype=float) for p in phase.tolist()])
    turning = window_regressors.Turning(
        column["angle_start"], column["angle_end"], column["t_start"], column["t_end"], face
    )
    spread = np.asarray(windows.get("std", np.zeros(phase.size)), dtype=float)
    current = column["mean"] if setup.polarity == "project" else -column["mean"]
    rate = window_regressors.axis_rate(turning, setup.base, setup.latitude, setup.earth_rate)
    y = rate - setup.k * current
    names = drift.terms(9 if setup.terms == 10 else setup.terms)
    if setup.tilt:  # estimated whatever the data say of it
        names = (*names, budget.TILT)
    X = budget.design(setup, turning, names)
    book, fits, why = closed.reduce(
        phase, turning.angle_start, turning.angle_end, turning.t_end - turning.t_start, y, setup.faces, setup.latitude,
        setup.gravity,
    )  # fmt: skip
    quantities = [_quantity(setup, n, book) for n in names]
    groups = [_group(setup, turning, phase, X, names, p) for p in setup.faces]
    found = fit(
        quantities,
        X,
        y,
        turning.t_start,
        turning.t_end,
        groups,
        "drift rate",
        "°/h",
        DPH,
        candidates=_candidates(setup, turning, phase, windows, nuisances.fitted(rate, X, y)),
    )
    found = with_set_up(
        found, lambda f: budget.effects(setup, turning, current, spread, f), setup.corrections, remount=setup.remount
    )
    turning_phases = [(setup.label(p), phase == p) for p in setup.faces if setup.turns(p)]
    turns = Turns(found, turning_phases, -turning.angle_start, -turning.angle_end)
    turns.test()
    effects = budget.effects(setup, turning, current, spread, found)
    tilt_line = next(e for e in effects if e.source == budget.TOWARDS_OUTPUT)
    j = names.index("D_O") if "D_O" in names else 0
    dominant = abs(float(tilt_line.changes(found)[0, j])) * tilt_line.size > float(found.u[j])
    warnings = []
    if setup.fold:
        warnings.append(
            "D_OO is folded: at constant |g| only D_F + γ² D_OO, D_II − D_OO and D_SS − D_OO can be had (γ = g/g0 = "
            f"{setup.gravity / frames.G0:.6f}); separating them needs |f| ≠ 1 g, a centrifuge."
        )
    missing = [n for n in drift.NAMES if n not in names and n != "D_OO" and (setup.truth or {}).get(n, 0.0) != 0.0]
    if missing:
        warnings.append(
            f"{', '.join(missing)} is simulated but not in the {setup.terms}-term model: the others are biased."
        )
    result = linear_result(
        found,
        system="tumble_single_axis",
        title="Single-axis tumble test of a floated gyro",
        method="Torque-rebalance tumble about the polar axis in two mounts with two dwells; least squares over all "
        "windows under an estimated noise model [TEST-TUMBLE1-SDF]",
        sources=[
            "TEST-TUMBLE1-SDF, TUM1-REDUCE; Hu 1981, eq. 3-12..3-21, corrected by E20-E23",
            "GYRO-STATIC-9; Hu 1981, eq. 2-36, 2-47",
            "RED-GLS; Hu 1981, eq. 4-79..4-88, corrected by ER23",
        ],
        equation=_equation(names),
        conventions=_conventions(setup),
        effects=[*effects, *remounts(found, setup.remount)],
        **setup.reported(),
        no_closed=why,
        closed_caption="From the same windows; the formulas weigh all windows alike, D_F and D_O rest on the dwells",
        tables=turns.table("θ = −angle"),
        harmonics=turns.harmonics(fits),
        repeatability=turns.repeatability(),
        warnings=warnings,
    )
    first = []
    if dominant:
        first.append("The tilt of the input axis makes most of the uncertainty of D_O; tilt=yes estimates it.")
    result.warnings[:0] = first
    result.summary = _summary(result.coefficients, found)
    return result


def _candidates(
    s: TumbleSetup, turning: window_regressors.Turning, phase: Array, windows: Mapping[str, Array], torque: Array
) -> list[Candidate]:
    """Set-up effects that a tumble may have: misalignment, trend, temperature, torquer (its rate ``torque``, rad/s),
    constants from mount to mount and from turn-on to turn-on.
    """
    if not s.nuisances:
        return []
    along = window_regressors.axis_rate(turning, s.base, s.latitude, s.earth_rate, 1)
    found = [] if s.tilt is not None else [Candidate.of(budget.TILT, TILT_MEANING, "arcsec", -along)]
    mounts = nuisances.mounts(phase, s.faces)
    found += [*nuisances.common(windows), *nuisances.torquer(torque)]
    return [*found, nuisances.scatter("σ_mount", nuisances.MOUNTS, mounts)]


def _quantity(s: TumbleSetup, name: str, book: Mapping[str, float]) -> Quantity:
    if name == budget.TILT:
        return Quantity.of(name, TILT_MEANING, "arcsec")
    truth = None
    if s.truth is not None:
        oo = s.truth.get("D_OO", 0.0)
        extra = {"D_F": oo * (s.gravity / frames.G0) ** 2, "D_II": -oo, "D_SS": -oo}.get(name, 0.0)
        truth = s.truth.get(name, 0.0) + extra
    folded = FOLDED.get(name) if s.fold else None
    q = Quantity.drift(name, truth, book.get(name))
    return replace(q, meaning=f"{q.meaning}, with D_OO folded in", shown=folded) if folded else q


def _group(
    s: TumbleSetup,
    turning: window_regressors.Turning,
    phase: NDArray[np.int_],
    X: Array,
    names: tuple[str, ...],
    p: int,
) -> Group:
    """Drift against table angle where the table turns, against time in a dwell."""
    mine = phase == p
    if not s.turns(p):
        middle = (turning.t_start + turning.t_end) / 2.0
        return Group(s.label(p), mine, middle[mine] - turning.t_start[mine][0], "time in the dwell", "s")
    angle = np.degrees(np.mod(((turning.angle_start + turning.angle_end) / 2.0)[mine], 2.0 * math.pi))
    dense = np.radians(np.arange(0.0, 361.0, 3.0))
    face = np.broadcast_to(np.asarray(s.faces[p], dtype=float), (dense.size, 3, 3))
    still = window_regressors.Turning(dense, dense, np.zeros_like(dense), np.ones_like(dense), face)
    curve = budget.design(s, still, names)
    if budget.TILT in names:
        curve[:, -1] = float(np.mean(X[mine, -1]))  # the table turns, the plotted one does not
    return Group(s.label(p), mine, angle, "table angle", "°", (np.degrees(dense), curve))


def _equation(names: tuple[str, ...]) -> str:
    axis = {"I": "X", "O": "Y", "S": "Z"}
    parts = []
    for n in names:
        index = n[2:]
        if n == budget.TILT:
            continue
        if n == "D_F":
            parts.append("D_F")
        elif len(index) == 2 and index[0] == index[1]:
            parts.append(f'D_"{index}" {axis[index[0]]}^2')
        else:
            symbol = f"D_{index}" if len(index) == 1 else f'D_"{index}"'
            parts.append(f"{symbol} {' '.join(axis[a] for a in index)}")
    tilt = (
        'omega_"IA" - k i = omega_d - epsilon_"IO" omega_"OA", quad ' if budget.TILT in names else 'omega_"IA" - k i = '
    )
    return tilt + "omega_d = " + " + ".join(parts)


def _conventions(s: TumbleSetup) -> list[str]:
    return [
        *s.sign_conventions(s.k),
        "Gyro axes I, O, S right-handed; local frame east, north, up; table angle right-handed about the pole, so that "
        "turning against the Earth is negative; the θ of Hu 1981 is minus the table angle.",
        *([] if s.terms in (9, 10) else [f"{s.terms}-term model: the terms left out are taken as zero."]),
        *([] if s.fold else ["D_OO is taken as zero; if it is not, D_F holds γ² D_OO, D_II and D_SS hold −D_OO."]),
    ]


def _summary(coefficients: list[Coefficient], found: Findings) -> list[str]:
    first = coefficients[0]
    linear = max((c for c in coefficients if c.unit == "°/h/g"), key=lambda c: abs(c.estimate))
    return [
        f"Constant drift {first.name} = {plus_minus(first)}.",
        f"Largest drift per g: {linear.name} = {plus_minus(linear)}.",
        found.noise_sentence(),
        *found.nuisance_sentences(),
    ]


@handling_errors.examined(handling_candidates.tumble)
def from_record(record: Record, specification: Specification | None = None) -> DriftTestResult:
    """:func:`reduce` of a gyrobench.record.record.Record, with its run.json as provenance."""
    return run_metadata.finish(reduce(record.windows, setup_of(record.run, specification)), record)
