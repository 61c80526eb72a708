"""Reduction of the two-channel tumble: drift coefficients of both channels from averaged torquer currents.

    x channel   omega_x - k_y i_y = omega_dx        y channel   omega_y - k_x i_x = omega_dy        [MEAS-REBALANCE]

Each channel is a least squares problem of its own: every window is a row, regressors are averaged over the window as
the current is, and the noise of each channel is estimated from the same record.  The closed formulas of Hu 1981 stand
beside the estimates.  [TEST-TUMBLE1-2DOF-A, -B; Hu 1981, eq. 3-22..3-37]

Not modelled: change of the drift with time, torquer nonlinearity (a line of the budget), noise common to both channels,
independent mount errors.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from gyrobench import drift, frames
from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.reduction.diagnosis import handling_candidates, handling_errors
from gyrobench.reduction.drift import window_regressors
from gyrobench.reduction.drift.pulses import Windows
from gyrobench.reduction.estimation import nuisances
from gyrobench.reduction.estimation.effects import remounts, with_set_up
from gyrobench.reduction.estimation.fit_result import linear_result, plus_minus
from gyrobench.reduction.estimation.linear_fit import fit
from gyrobench.reduction.estimation.merge_channels import merge
from gyrobench.reduction.estimation.nuisances import Candidate
from gyrobench.reduction.estimation.quantity import Quantity
from gyrobench.reduction.estimation.regression import Fit
from gyrobench.reduction.setup import run_metadata
from gyrobench.reduction.setup.window_checks import ReductionError, window_problems
from gyrobench.result import DriftTestResult, Specification, Table
from gyrobench.units import DPH

from . import closed, evidence, geometry
from .refusals import plan_problems, setup_problems
from .setup import OTHER, TwoChannelSetup, design, setup_of

__all__ = ["ReductionError", "TwoChannelSetup", "from_record", "reduce", "setup_of"]

COLUMNS = ("phase", "t_start", "t_end", "angle_start", "angle_end", "mean_x", "mean_y")


def reduce(windows: Mapping[str, Array], setup: TwoChannelSetup) -> DriftTestResult:
    """Coefficients of both channels with uncertainties from the windows of a record (SI).

    Columns phase, t_start, t_end, angle_start, angle_end, mean_x, mean_y (A; currents of the torquers about x and y).
    Raises ReductionError with everything that is wrong with setup or record.
    """
    s = setup
    problems = setup_problems(s) + window_problems(windows, COLUMNS)
    if not problems:
        problems = plan_problems(s, windows)
    if problems:
        raise ReductionError(problems)
    phase = np.asarray(windows["phase"]).astype(int)
    t0, t1, a0, a1 = (np.asarray(windows[c], dtype=float) for c in ("t_start", "t_end", "angle_start", "angle_end"))
    face = np.array([np.asarray(s.faces[p], dtype=float) for p in phase.tolist()])
    turning = window_regressors.Turning(a0, a1, t0, t1, face)
    sign = 1.0 if s.polarity == "project" else -1.0
    current = {a: sign * np.asarray(windows[f"mean_{a}"], dtype=float) for a in "xy"}
    y = {}
    for c, axis in geometry.AXIS.items():
        y[c] = (
            window_regressors.axis_rate(turning, s.base, s.latitude, s.earth_rate, axis)
            - s.k[OTHER[c]] * current[OTHER[c]]
        )
    book, fits, why = _closed(s, phase, turning, y)
    results = {}
    for c in "xy":
        results[f"{c} channel"] = _channel(s, c, phase, turning, y[c], current[OTHER[c]], book, fits.get(c, {}), why,
                                           windows)  # fmt: skip
    parts = list(results.values())
    coefficients = [c for r in parts for c in r.coefficients]
    linear = max((c for c in coefficients if c.unit == "°/h/g"), key=lambda c: abs(c.estimate))
    summary = [
        f"Constant drift {' and '.join(f'{r.coefficients[0].name} = {plus_minus(r.coefficients[0])}' for r in parts)}.",
        f"Largest drift per g: {linear.name} = {plus_minus(linear)}.",
        " ".join(f"{name}: {r.summary[0]}" for name, r in results.items()),
        *(f"{name}: {text}" for name, r in results.items() for text in r.summary[1:]),
    ]
    return merge(results, summary=summary, tables=_book_table(s, coefficients, book))


def _channel(
    s: TwoChannelSetup, c: str, phase: Array, turning: window_regressors.Turning, y: Array, current: Array,
    book: Mapping[str, float], fits: Mapping[str, Fit], why: str, windows: Mapping[str, Array],
) -> DriftTestResult:  # fmt: skip
    names = s.names(c)
    X = design(s, c, turning)
    found = fit(
        [_quantity(s, c, n, book) for n in names], X, y, turning.t_start, turning.t_end,
        evidence.groups(s, c, phase, turning, X), "drift rate", "°/h", DPH,
        candidates=_candidates(s, c, phase, turning, windows, nuisances.fitted(y + s.k[OTHER[c]] * current, X, y)),
    )  # fmt: skip
    spread = np.asarray(windows.get(f"std_{OTHER[c]}", np.zeros_like(current)), dtype=float)
    readings = Windows(current, spread, turning.t_end - turning.t_start)
    other = evidence.own_sources(OTHER[c])
    found = with_set_up(
        found, lambda f: evidence.effects(s, c, f, turning, readings), s.corrections, other, remount=s.remount
    )
    turns = evidence.turns(s, found, phase, turning)
    left_out, warnings = evidence.left_out(s, c, found, turning)
    if s.model == "nine" and s.fold:
        square, into = geometry.FOLD[c]
        warnings.append(
            f"{square} is folded: at constant |g| only {into[0]} + γ² {square}, {into[1]} − {square} and {into[2]} − "
            f"{square} can be had (γ = g/g0 = {s.gravity / frames.G0:.6f}); separating them needs a centrifuge."
        )
    simple = s.model == "simple"
    part = ("two mounts, simple model", "A") if simple else ("two mounts and two dwells, nine terms", "B")
    return linear_result(
        found,
        system="tumble_two_channel",
        title="Single-axis tumble test of a two-degree-of-freedom gyro",
        method=f"Torque-rebalance tumble of both channels about the polar axis, {part[0]}; least squares of each "
        f"channel over all windows under an estimated noise model [TEST-TUMBLE1-2DOF-{part[1]}]",
        sources=[
            "TEST-TUMBLE1-2DOF-A, TUM2A; Hu 1981, eq. 3-22..3-25, signs corrected by E24"
            if simple
            else "TEST-TUMBLE1-2DOF-B, TUM2B-REDUCE; Hu 1981, eq. 3-26..3-37, corrected by E25-E29",
            "GYRO-STATIC-2DOF; Hu 1981, eq. 2-29..2-46, corrected by E7-E9",
            "RED-GLS; Hu 1981, eq. 4-79..4-88, corrected by ER23",
        ],
        equation=_equation(c, names),
        conventions=_conventions(s),
        effects=[*evidence.effects(s, c, found, turning, readings), *remounts(found, s.remount)],
        **s.reported(),
        no_closed=why,
        closed_caption="From the same windows; the formulas weigh all windows of a mount alike",
        tables=[*turns.table("θ = −angle"), *left_out],
        harmonics=turns.harmonics(fits),
        repeatability=turns.repeatability(),
        warnings=[*warnings, *geometry.cautions(s.latitude)],
        summary=[found.noise_sentence()],
    )


def _candidates(
    s: TwoChannelSetup, c: str, phase: Array, turning: window_regressors.Turning, windows: Mapping[str, Array],
    torque: Array,
) -> list[Candidate]:  # fmt: skip
    """Set-up effects: tilt of the measuring axis, trend, temperature, torquer (its rate ``torque``, rad/s), constants
    from mount to mount and from turn-on to turn-on.
    """
    if not s.nuisances:
        return []
    along = window_regressors.axis_rate(turning, s.base, s.latitude, s.earth_rate, 2)
    tilt = Candidate.of(geometry.TILT[c], _tilt_meaning(c), "arcsec", -along)
    mounts = nuisances.scatter(f"σ_mount,{c}", nuisances.MOUNTS, nuisances.mounts(phase, s.faces))
    found = [*nuisances.common(windows, f",{c}"), *nuisances.torquer(torque, OTHER[c])]
    return [*([tilt] if s.tilt is None else []), *found, mounts]


def _tilt_meaning(c: str) -> str:
    return f"tilt of the {c} axis towards the spin axis"


def _quantity(s: TwoChannelSetup, c: str, name: str, book: Mapping[str, float]) -> Quantity:
    if name == geometry.TILT[c]:
        return Quantity.of(name, _tilt_meaning(c), "arcsec")
    truth = None
    square, into = geometry.FOLD[c]
    folded = s.model == "nine" and s.fold and name in into
    if s.truth is not None:
        gamma2 = (s.gravity / frames.G0) ** 2
        extra = s.truth.get(square, 0.0) * (gamma2 if name == into[0] else -1.0) if s.model == "nine" else 0.0
        truth = s.truth.get(name, 0.0) + (extra if name in into else 0.0)
    q = Quantity.drift(name, truth, book.get(name))
    if not folded:
        return q
    shown = f"{name} + γ² {square}" if name == into[0] else f"{name} − {square}"
    return replace(q, shown=shown, meaning=f"{q.meaning}, with {square} folded in")


# --------------------------------------------------------------------------------------------- closed formulas
def _closed(
    s: TwoChannelSetup, phase: Array, turning: window_regressors.Turning, y: Mapping[str, Array]
) -> tuple[dict[str, float], dict[str, dict[str, Fit]], str]:
    """Coefficients by the formulas of Hu 1981 (SI), the harmonic fits of each channel, and why not."""
    ideal = geometry.faces(s.model, s.latitude)
    roles: dict[int, str] = {}
    for p, face in s.faces.items():
        found = [n for n, f in ideal.items() if np.allclose(face, f, atol=1e-6)]
        if not found:
            return {}, {}, f"phase {p} is not one of the attitudes of Hu 1981; least squares only"
        roles[p] = found[0]
    fits: dict[str, dict[str, Fit]] = {}
    for c in "xy":
        fits[c], why = closed.amplitudes(phase, turning.angle_start, turning.angle_end, y[c], roles)
        if why:
            return {}, {}, why
    named = {c: {m: closed.named(f) for m, f in fits[c].items()} for c in "xy"}
    out: dict[str, float] = {}
    if s.model == "simple":
        rate = {c: {m: {n: -v for n, v in of.items()} for m, of in named[c].items()} for c in "xy"}
        by_x, by_y = rate["y"], rate["x"]  # k_x i_x is of the y channel
        one, two = "mount 1", "mount 2"
        symbols = closed.simple(by_x[one], by_x[two], by_y[one], by_y[two], s.latitude, s.gravity)
        out = {name: sign * symbols[b] for b, (name, sign) in closed.BOOK.items()}
        return out, fits, ""
    length = turning.t_end - turning.t_start
    for c in "xy":
        dwell = []
        for rest in ("static 3", "static 4"):
            rows = np.isin(phase, [p for p, r in roles.items() if r == rest])
            dwell.append(float(np.average(y[c][rows], weights=length[rows])))
        up, down = dwell
        out |= closed.nine(c, named[c]["mount 1"], named[c]["mount 2"], up, down, s.latitude, s.gravity)
    return out, fits, ""


def _book_table(s: TwoChannelSetup, coefficients: list[Any], book: Mapping[str, float]) -> list[Table]:
    """The simple model in the symbols of Hu 1981."""
    if s.model != "simple":
        return []
    by_name, rows = {c.name: c for c in coefficients}, []
    for symbol, (name, sign) in closed.BOOK.items():
        c = by_name[name]
        formula = sign * book[name] / DPH if name in book else None
        rows.append([symbol, f"{'−' if sign < 0 else ''}{name}", sign * c.estimate, c.u, formula, c.unit])
    caption = (
        "R = M/H (R_x, the torque about x, appears in the drift about y), u = m g0 l/H, Q = m² g0² ΔK/H; u_zx with "
        "and u_zy without the outer gimbal"
    )
    head = ["symbol", "is", "least squares", "u", "closed formula", "unit"]
    return [Table("quantities_of_hu_1981", "Quantities of Hu 1981", caption, head, rows)]


def _equation(c: str, names: tuple[str, ...]) -> str:
    terms = drift.typst_2dof(c, (n for n in names if n != geometry.TILT[c]))
    left = f"omega_{c} - k_{OTHER[c]} i_{OTHER[c]}"
    tilt = f' = omega_"d{c}" - epsilon_"{c}z" omega_z, quad' if geometry.TILT[c] in names else " ="
    return f'{left}{tilt} omega_"d{c}" = {terms}'


def _conventions(s: TwoChannelSetup) -> list[str]:
    sign = "k i = ω_IA − ω_d" if s.polarity == "project" else "k i = ω_d − ω_IA as in Hu 1981, sign inverted at entry"
    k = {a: f"{v * 1e-3 / DPH:.6g} °/h/mA" for a, v in s.k.items()}
    return [
        "Drift ω_d in precession sign; for the sign of an indicated rate turn all coefficients round.",
        "X, Y, Z = −f/g0 along x (outer gimbal), y (inner gimbal) and z (spin) axis (sign of Hu 1981: a body axis that "
        "points up reads −1); g0 = 9.80665 m/s². Against +f/g0 the linear coefficients change sign.",
        f"Torquer currents: {sign}; the current i_y measures the x channel and i_x the y channel. k_x = {k['x']}, "
        f"k_y = {k['y']}.",
        "Gyro axes right-handed; local frame east, north, up; table angle right-handed about the pole, so that turning "
        "against the Earth is negative; the θ of Hu 1981 is minus the table angle.",
        *(["Terms outside the simple model are taken as zero."] if s.model == "simple" else []),
        *(
            []
            if s.fold or s.model == "simple"
            else [
                "Dx_yy and Dy_xx are taken as zero; if not, Dx_0 holds γ² Dx_yy, Dx_xx and Dx_zz hold −Dx_yy; y alike."
            ]
        ),
    ]


@handling_errors.examined(handling_candidates.tumble)
def from_record(record: Record, specification: Specification | None = None) -> DriftTestResult:
    """:func:`reduce` of a gyrobench.record.record.Record, with its run.json as provenance."""
    result = reduce(record.windows, setup_of(record.run, specification))
    return run_metadata.finish(result, record)
