"""Reduction of the two-axis servo test: drift coefficients of both channels from the angles of both table axes.

    x channel   x' cos y + e . (A row 1) = omega_dx        y channel   y' + e . (A row 2) = omega_dy      [eq. 3-97]

Each channel is a least squares problem of its own over all windows; rates and regressors are averaged over the window
(windows.py), the noise (white, Gauss-Markov, errors of shared readings) is estimated from the same record.  The Hu 1981
route, its formulas at the middles of the windows, stands beside.  [TEST-SERVO2-2DOF]

Not modelled: change of the coefficients per g with time (mount against mount shows it), noise common to both channels.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gyrobench import drift
from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.diagnosis import handling_candidates, handling_errors
from gyrobench.reduction.drift import servo_regression
from gyrobench.reduction.estimation import nuisances, regression
from gyrobench.reduction.estimation.effects import Effect, remounts, with_set_up
from gyrobench.reduction.estimation.findings import Findings, Group
from gyrobench.reduction.estimation.fit_result import linear_result, plus_minus
from gyrobench.reduction.estimation.linear_fit import fit
from gyrobench.reduction.estimation.merge_channels import merge
from gyrobench.reduction.estimation.nuisances import Candidate
from gyrobench.reduction.estimation.quantity import Quantity
from gyrobench.reduction.setup import run_metadata, setups
from gyrobench.reduction.setup.simulated_errors import simulated_errors
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import DriftTestResult, Specification, Table
from gyrobench.units import DPH

from . import budget, closed, geometry, refusals
from .windows import ANGLES, Track, track

__all__ = ["ReductionError", "from_record"]

REQUIRED = ("phase", "t_start", "t_end", *ANGLES)


@handling_errors.examined(handling_candidates.two_axes)
def from_record(record: Record, specification: Specification | None = None) -> DriftTestResult:
    """Coefficients of both channels of a record (gyrobench.record.record.Record).  Raises ReductionError."""
    run = record.run
    options, site = dict(run.options), run_metadata.Site.of(run)
    terms = int(options.get("terms", 9))
    labels = {row.phase: row.label for row in run.plan if row.mode == "servo"}
    known = {f"mount {m}": m for m in geometry.MOUNTS}
    wrong = [f"phase {p}: '{n}' is none of the mounts {', '.join(known)}" for p, n in labels.items() if n not in known]
    wrong = wrong or servo_regression.window_problems(
        record.windows, {p: {"label": n} for p, n in labels.items()}, REQUIRED
    )
    if wrong:
        raise ReductionError(wrong)
    every = np.asarray(record.windows["phase"]).astype(int)
    held = np.isin(every, list(labels))
    w = {c: np.asarray(record.windows[c], dtype=float)[held] for c in REQUIRED}
    phase = every[held]
    mount = np.array([known[labels[p]] for p in phase.tolist()])
    base = {m: geometry.base(m, site.latitude) for m in set(mount.tolist())}
    seen = track(w, phase, np.array([base[m] for m in mount.tolist()]))
    X = {c: seen.design(site, drift.terms_2dof(c, terms)) for c in "xy"}
    wrong = _problems(record.windows, held, w, run, X, terms, sorted(set(mount.tolist())), site)
    if wrong:
        raise ReductionError(wrong)
    rates = seen.inertial(site)
    middle = seen.middle()
    book = closed.reduce(*middle, mount, site.latitude, site.g, site.earth_rate, terms)
    truth = run_metadata.truth_of(run, [n for c in "xy" for n in drift.NAMES_2DOF[c]])
    results: dict[str, DriftTestResult] = {}
    found: dict[str, Findings] = {}
    for j, c in enumerate("xy"):
        quantities = [Quantity.drift(n, (truth or {}).get(n), book[n]) for n in drift.terms_2dof(c, terms)]
        found[c] = fit(
            quantities, X[c], rates[:, j], seen.t_start, seen.t_end, _groups(phase, labels, seen), "drift rate", "°/h",
            DPH, noise="readings", limit=1e6, candidates=_candidates(run, record.windows, held, phase, c),
        )  # fmt: skip
        effects_of = functools.partial(_effects, j, seen, phase, site, run, drift.terms_2dof(c, terms))
        found[c] = with_set_up(
            found[c], effects_of, run.options.get("corrections", ""), remount=run_metadata.remount_of(run)
        )
        _mount_test(found[c], phase)
        results[f"{c} channel"] = _channel(c, j, found[c], seen, phase, site, run, terms, truth, specification)
    tables = [_mounts_table(phase, labels, seen, found, mount, site), _book_table(found), _shared_table(found)]
    k = refusals.condition(X)
    warnings = []
    if k > refusals.WARN:
        weak = [f"{regression.examine(v, drift.terms_2dof(c, terms)).weakest} ({c})" for c, v in X.items()]
        which = " ".join(str(m) for m in dict.fromkeys(mount.tolist()))
        warnings.append(f"Mounts {which}: condition {k:.3g} of the coefficients per g; hardly seen: {', '.join(weak)}.")
    result = merge(results, tables=[t for t in tables if t["rows"]], warnings=warnings)
    first = {c: results[f"{c} channel"].coefficients for c in "xy"}
    linear = max((q for q in result.coefficients if q.unit == "°/h/g"), key=lambda q: abs(q.estimate))
    result.summary = [
        f"Constant drift {' and '.join(f'{v[0].name} = {plus_minus(v[0])}' for v in first.values())}.",
        f"Largest drift per g: {linear.name} = {plus_minus(linear)}.",
        " ".join(f"{c} channel: {found[c].noise_sentence()}" for c in "xy"),
        *(f"{c} channel: {text}" for c in "xy" for text in found[c].nuisance_sentences()),
    ]
    return run_metadata.finish(result, record)


def _effects(
    channel: int, seen: Track, phase: NDArray[np.int_], site: run_metadata.Site, run: RunDocument,
    names: tuple[str, ...], found: Findings,
) -> list[Effect]:  # fmt: skip
    return budget.effects(channel, found, seen, phase, site, names, run_metadata.sizes(run.options, budget.SIZES))


def _candidates(
    run: RunDocument, windows: Mapping[str, Array], held: NDArray[np.bool_], phase: NDArray[np.int_], c: str
) -> list[Candidate]:
    """Set-up effects of a channel: trend, temperature, constants that differ from mount to mount.

    A misalignment of the gyro on the plate is none of them: z stays among the stars, and what x and y see of it is
    nearly what the coefficients of the other axis make (a line of the budget).
    """
    if not setups.weighed(run):
        return []
    rows = {n: np.asarray(v)[held] for n, v in windows.items()}
    return [*nuisances.common(rows, f",{c}"), nuisances.scatter(f"σ_mount,{c}", nuisances.MOUNTS, phase.tolist())]


def _problems(
    windows: Mapping[str, Array], held: NDArray[np.bool_], w: Mapping[str, Array], run: RunDocument,
    X: Mapping[str, Array], terms: int, mounts: list[int], site: run_metadata.Site,
) -> list[str]:  # fmt: skip
    """Why the rows cannot be reduced: gimbal lock, tracking, rank."""
    found = []
    inner = np.concatenate([w["inner_start"], w["inner_end"]])
    worst = float(inner[np.argmin(np.cos(inner))])
    if math.cos(worst) < geometry.LEAST:
        found.append(
            f"gimbal lock: the inner angle reaches {math.degrees(worst):.4g}°, "
            f"{math.degrees(math.acos(geometry.LEAST)):.3g}° is allowed; leave out the windows beyond"
        )
    limit = float(run.options.get("tracking", servo_regression.TRACKING))
    for a in "xy":
        gain = run.parameters.get(f"gyro.K_sg_{a}", 0.0)
        part = {k: windows[f"{k}_{a}"] for k in ("mean", "std") if f"{k}_{a}" in windows}
        if len(part) == 2:
            known = {"gyro.K_sg": gain, "gyro.H": 1.0, "gyro.C": 1.0}  # a pickoff reads the angle itself
            found += [f"{a} axis: {text}" for text in servo_regression.tracking_problems(part, held, known, limit)]
    for c, x in X.items():
        seen = regression.examine(x, drift.terms_2dof(c, terms))
        if seen.lost:
            found.append(
                f"{c} channel: rank {seen.rank} of {x.shape[1]}, the record does not see {'; '.join(seen.lost)}"
            )
    most = refusals.MOST_SINGLE if len(mounts) == 1 else refusals.MOST
    if not found and (k := refusals.condition(X)) > most:
        found.append(f"mounts {' '.join(map(str, mounts))}: condition {k:.3g}, {most:g} is allowed: add another mount")
    return found


def _channel(
    c: str, j: int, found: Findings, seen: Track, phase: NDArray[np.int_], site: run_metadata.Site,
    run: RunDocument, terms: int, truth: Mapping[str, float] | None, specification: Specification | None,
) -> DriftTestResult:  # fmt: skip
    names = drift.terms_2dof(c, terms)
    warnings = []
    missing = [n for n in drift.NAMES_2DOF[c] if n not in names and (truth or {}).get(n, 0.0)]
    if missing:
        warnings.append(f"{', '.join(missing)} is simulated but not in the {terms}-term model: the others are biased.")
    return linear_result(
        found,
        system="servo_two_axis",
        title="Two-axis servo test of a two-degree-of-freedom gyro",
        method="The gyro holds a two-axis table still among the stars; least squares of each channel over all windows "
        "under an estimated noise model with shared angle readings [TEST-SERVO2-2DOF]",
        sources=[
            "TEST-SERVO2-2DOF, SERVO2-A, SERVO2-KIN, APP2; Hu 1981, eq. 3-94..3-102 and appendix 2, "
            "corrected by E47, E50, E51",
            "GYRO-STATIC-2DOF; Hu 1981, eq. 2-29..2-46, corrected by E7-E9",
            "RED-RATE (shared readings), RED-GLS; Hu 1981, eq. 4-1..4-11, 4-79..4-88, corrected by ER1, ER23",
        ],
        equation=_equation(c, names),
        conventions=CONVENTIONS,
        effects=[
            *_effects(j, seen, phase, site, run, names, found),
            *remounts(found, run_metadata.remount_of(run)),
        ],
        specification=specification,
        site=site.shown(),
        instrument=run.instrument,
        errors=simulated_errors(run),
        simulated=truth is not None,
        robust=bool(run.options.get("robust", False)),
        closed_caption="The formulas of Hu 1981 at the middles of the same windows, ordinary least squares",
        warnings=warnings,
    )  # fmt: skip


CONVENTIONS = (
    "Drift ω_d in precession sign: inertial rate of the plate along the gyro's x and y axes; ω_M of Hu 1981 is −ω_dx.",
    "X, Y, Z = −f/g0 along x (outer gimbal), y (inner gimbal) and z (spin) axis (sign of Hu 1981: a body axis that "
    "points up reads −1); g0 = 9.80665 m/s². Against +f/g0 the linear coefficients change sign.",
    "Outer angle x right-handed about X, inner angle y about Y of the mount; gyro x along X, y along Y at 0, 0; ω_X, "
    "ω_Y, ω_Z: Earth rate along X, Y, Z = X × Y; local frame east, north, up. Torquers idle while the gyro holds the "
    "table; the turn about z is not controlled.",
)


def _groups(phase: NDArray[np.int_], labels: Mapping[int, str], seen: Track) -> list[Group]:
    """Drift against time in each mount."""
    middle, out = (seen.t_start + seen.t_end) / 2.0, []
    for p, label in labels.items():
        rows = phase == p
        name = label if list(labels.values()).count(label) == 1 else f"{label}, phase {p}"
        out.append(Group(name, rows, (middle[rows] - seen.t_start[rows][0]) / 3600.0, "time in the mount", "h"))
    return out


def _mount_test(found: Findings, phase: NDArray[np.int_]) -> None:
    """Is the constant drift that of the first mount in all others?"""
    others = np.unique(phase)[1:]
    if others.size and not any(c.scatter for c, _ in found.joined):
        columns = (phase[:, None] == others).astype(float)
        found.f_test(
            "mount_to_mount", "mount to mount", columns, "change of the constant drift between mounts",
            "the constant drift is not the same in all mounts: turn-on, warm-up, or a mount that is not true",
            "constant drift alike in all mounts",
        )  # fmt: skip


def _mounts_table(
    phase: NDArray[np.int_], labels: Mapping[int, str], seen: Track, found: Mapping[str, Findings],
    mount: NDArray[np.int_], site: run_metadata.Site,
) -> Table:  # fmt: skip
    rows: list[list[Any]] = []
    for p, label in labels.items():
        k = phase == p
        time = float(seen.t_end[k][-1] - seen.t_start[k][0])
        zero = refusals.locked(int(mount[k][0]), site.latitude, time, site.earth_rate)
        outer = seen.angle[k][..., 0]
        scatter = [float(np.std(found[c].est.residual[k])) / DPH for c in "xy"]
        rows.append([
            label, p, int(k.sum()), time / 3600.0, math.degrees(float(outer[-1, -1] - outer[0, 0])),
            math.degrees(float(np.max(np.abs(seen.angle[k][..., 1])))), math.degrees(zero), *scatter,
        ])  # fmt: skip
    return Table(
        "mounts",
        "Mounts",
        "Turn of the outer axis, largest inner angle and that of a gyro without drift; scatter of residuals",
        [
            "mount",
            "phase",
            "windows",
            "time / h",
            "outer / °",
            "inner / °",
            "no drift / °",
            "x / (°/h)",
            "y / (°/h)",
        ],
        rows,
    )


def _book_table(found: Mapping[str, Findings]) -> Table:
    """The estimates in the names of Hu 1981: torque sign in the first line of 3-95, precession sign in the second."""
    rows: list[list[Any]] = []
    for c in "xy":
        at = {q.name: k for k, q in enumerate(found[c].quantities)}
        for symbol, (ours, sign) in closed.BOOK[c].items():
            q, k = found[c].quantities[at[ours]], at[ours]
            value, u = float(found[c].value[k]) / q.scale, float(found[c].u[k]) / q.scale
            rows.append([f"{symbol}, {c}", sign * value, u, q.unit, ours, "+" if sign > 0 else "−"])
    return Table(
        "notation_of_hu_1981",
        "Notation of Hu 1981",
        "Of the lines −α̇ (x) and β̇ (y) of 3-95; last column: sign against this report",
        ["Hu 1981", "estimate", "u of type A", "unit", "this report", "sign"],
        rows,
    )


def _shared_table(found: Mapping[str, Findings]) -> Table:
    """K_zx and K_zy appear in both channels; they must agree where they have a rigid-body cause.  [STATIC-DRIFT]"""
    rows: list[list[Any]] = []
    for symbol in ("K_zx", "K_zy"):
        pair = []
        for c in "xy":
            ours, sign = closed.BOOK[c][symbol]
            k = [q.name for q in found[c].quantities].index(ours)
            pair.append((sign * float(found[c].value[k]) / DPH, float(found[c].u[k]) / DPH))
        (a, ua), (b, ub) = pair
        both = 2.0 * math.hypot(ua, ub)
        rows.append([symbol, a, b, a - b, (a - b) / both if both > 0.0 else 0.0])
    if any(f.ideal for f in found.values()):
        rows = [[*row[:4], "–"] for row in rows]
    return Table(
        "compliances_seen_by_both_channels",
        "Compliances seen by both channels",
        "E_n: difference over its expanded uncertainty (type A); below 1 in size they agree",
        ["Hu 1981", "x channel / (°/h/g²)", "y channel / (°/h/g²)", "difference", "E_n"],
        rows,
    )


def _equation(c: str, names: tuple[str, ...]) -> str:
    left = (
        "dot(x) cos y + omega_X cos y + omega_Y sin x sin y - omega_Z cos x sin y"
        if c == "x"
        else "dot(y) + omega_Y cos x + omega_Z sin x"
    )
    return f'{left} = omega_"d{c}" \\ omega_"d{c}" = {drift.typst_2dof(c, names)}'
