"""Reduction of the eight-position test: scale factors, constant drifts and unbalances of both channels.

As in Hu 1981 the readings of a position are averaged to one datum of the cycle (with fewer than four cycles each
reading is a datum).  The data are rows of two fits, current about x and current about y, under a noise model estimated
from the same record; with six unknowns a channel the estimates are its closed formulas whenever all positions
weigh alike.  Repeats on several days are reduced day by day and then together.
[TEST-8POS, POS8-MODEL+REDUCE, POS8-LS; Hu 1981, eq. 3-1..3-11, Table 3-1, corrected by E17-E19]

Not modelled: products of two components of gravity (no position shows them), drift that changes over the cycles
otherwise than evenly or as noise, motion between the positions.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gyrobench import frames, units
from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.diagnosis import handling_candidates, handling_errors
from gyrobench.reduction.drift.pulses import Pulses, Windows
from gyrobench.reduction.estimation import nuisances, repeatability, residual_series
from gyrobench.reduction.estimation.effects import with_set_up
from gyrobench.reduction.estimation.findings import Group
from gyrobench.reduction.estimation.fit_result import linear_result, plus_minus
from gyrobench.reduction.estimation.linear_fit import fit
from gyrobench.reduction.estimation.merge_channels import merge
from gyrobench.reduction.estimation.nuisances import Candidate
from gyrobench.reduction.setup import run_metadata
from gyrobench.reduction.setup.window_checks import ReductionError, window_problems
from gyrobench.result import Coefficient, DriftTestResult, Specification
from gyrobench.units import DPH

from . import budget, model, positions, refusals, tables
from .model import Setup

__all__ = ["ReductionError", "Setup", "from_record", "reduce"]

AVERAGED = 4  # cycles from which on the readings of a position are averaged first
SOURCES = [
    "TEST-8POS, POS8-MODEL+REDUCE; Hu 1981, eq. 3-1..3-11, corrected by E17, E18",
    "POS8-LS, POS8-QUAD; GYRO-STATIC-2DOF; Hu 1981, eq. 2-29..2-46, corrected by E7-E9",
    "RED-GLS; Hu 1981, eq. 4-79..4-88, corrected by ER23",
]


def reduce(windows: Mapping[str, Array], setup: Setup) -> DriftTestResult:
    """Coefficients from one day's readings.

    windows: position (1..8), cycle, t_start, t_end (s), mean_x, mean_y (A; currents about x and y), flagged_x,
    flagged_y (optional), in the order of time.  Raises ReductionError with everything that is wrong.
    """
    problems = _problems(windows, setup)
    if problems:
        raise ReductionError(problems)
    position, cycle = (np.asarray(windows[n]).astype(int) for n in ("position", "cycle"))
    mean = {c: np.asarray(windows[f"mean_{c}"], dtype=float) for c in "xy"}
    t0, t1 = (np.asarray(windows[n], dtype=float) for n in ("t_start", "t_end"))
    by = {c: {n: float(np.mean(mean[c][position == n])) for n in positions.ATTITUDES} for c in "xy"}
    try:
        closed = positions.closed(by["x"], by["y"], setup.earth_rate, setup.latitude)
    except ZeroDivisionError:
        closed = {}  # the fit says why
    data = windows if np.unique(cycle).size < AVERAGED else averaged(windows)
    each = {c: _channel(c, data, setup, closed) for c in "xy"}
    for c, r in each.items():
        _short_term(r, c, mean[c], position, t0, t1, setup)
    found = merge(
        each,
        equation='k_x I_x = omega_y - R_x + u_"zx" gamma_y - u_y gamma_z - q_y gamma_y^2 - s_y gamma_x \\ '
        'k_y I_y = omega_x + R_y + u_"zy" gamma_x - u_x gamma_z - q_x gamma_x^2 - s_x gamma_y'
        if setup.terms == 6
        else 'k_x I_x = omega_y - R_x + u_"zx" gamma_y - u_y gamma_z \\ '
        'k_y I_y = omega_x + R_y + u_"zy" gamma_x - u_x gamma_z',
        tables=tables.all_of(position, cycle, mean, setup, each),
        warnings=refusals.near_pole(setup.latitude),
        summary=_summary(each),
    )
    found.repeatability = tables.repeatability(position, cycle, mean, setup)
    return found


def _problems(windows: Mapping[str, Array], setup: Setup) -> list[str]:
    found = refusals.latitude(setup.latitude) + frames.gravity_problems(setup.gravity)
    if setup.terms not in (4, 6):
        found.append(f"terms = {setup.terms}: no such model; a channel has 4 or 6 unknowns")
    missing = [n for n in ("position", "cycle", "t_start", "t_end", "mean_x", "mean_y") if n not in windows]
    if missing:
        return [*found, f"column {', '.join(missing)} is missing"]
    still = np.zeros(len(windows["position"]))
    for c in "xy":
        rows = {"phase": windows["position"], "t_start": windows["t_start"], "t_end": windows["t_end"],
                "angle_start": still, "angle_end": still, "mean": windows[f"mean_{c}"]}  # fmt: skip
        if f"flagged_{c}" in windows:
            rows["flagged"] = windows[f"flagged_{c}"]
        found += [p for p in (f"{c} current: {p}" for p in window_problems(rows)) if p not in found]
    if found:
        return found
    return refusals.record(
        np.asarray(windows["position"]).astype(int), np.asarray(windows["cycle"]).astype(int), setup.sigma
    )


def averaged(windows: Mapping[str, Array]) -> dict[str, Array]:
    """The readings of each position in each cycle as one, weighted by their length."""
    keys = np.stack([np.asarray(windows[n]).astype(int) for n in ("cycle", "position")], axis=1)
    _, first, group = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    t0, t1 = (np.asarray(windows[n], dtype=float) for n in ("t_start", "t_end"))
    means = ["mean_x", "mean_y", *(n for n in windows if n.startswith(("std_", "temperature", "turn_on")))]
    found: dict[str, list[float]] = {n: [] for n in ("cycle", "position", "t_start", "t_end", *means)}
    for k in np.argsort(first):
        mine = np.flatnonzero(group.ravel() == k)
        found["cycle"].append(int(keys[mine[0], 0]))
        found["position"].append(int(keys[mine[0], 1]))
        found["t_start"].append(float(t0[mine].min()))
        found["t_end"].append(float(t1[mine].max()))
        for n in means:
            found[n].append(float(np.average(windows[n][mine], weights=(t1 - t0)[mine])))
    return {n: np.array(v) for n, v in found.items()}


def _short_term(
    r: DriftTestResult, channel: str, current: Array, position: NDArray[np.int_], t0: Array, t1: Array, setup: Setup
) -> None:
    """Allan deviation and spectrum within the positions, from the single readings less their position's mean."""
    k = next(c.estimate for c in r.coefficients if c.name == f"k_{channel}") * units.factor("deg/h/mA")
    off = np.zeros_like(current)
    for n in positions.ATTITUDES:
        off[position == n] = -k * (current[position == n] - np.mean(current[position == n])) / DPH
    if float(np.max(np.abs(off))) < 1e-9:  # ideal data
        return
    parts = residual_series.stretches(t0, t1, off)
    allan, psd = residual_series.allan(parts), residual_series.spectrum(parts)
    r.allan = {**allan, "unit": "°/h"} if allan else {}
    r.psd = {**psd, "unit": "(°/h)²/Hz"} if psd else {}


def _channel(channel: str, data: Mapping[str, Array], setup: Setup, closed: Mapping[str, float]) -> DriftTestResult:
    current, position = np.asarray(data[f"mean_{channel}"], dtype=float), np.asarray(data["position"]).astype(int)
    t0, t1 = (np.asarray(data[n], dtype=float) for n in ("t_start", "t_end"))
    readings = Windows(current, np.asarray(data.get(f"std_{channel}", np.zeros_like(current)), dtype=float), t1 - t0)
    d = model.directions(position, setup.latitude)
    lin = model.linear(channel, current, d, setup)
    wanted = model.quantities(channel, setup, closed)
    steps = ["k − k0", *(q.name for q in wanted[1:])]
    order = np.argsort(position, kind="stable")
    jitter = 0.4 * (np.arange(position.size) / max(position.size - 1, 1) - 0.5)  # side by side, by time
    shown = Group(f"current about {channel}", order, (position + jitter)[order], "position", "")
    weighed = _candidates(channel, data, setup, d, lin) if setup.nuisances else ()
    found = fit(steps, lin.X, lin.y, t0, t1, [shown], "drift rate", "°/h", DPH, candidates=weighed)
    other = budget.own_sources("y" if channel == "x" else "x")
    found = with_set_up(
        found, lambda f: budget.effects(channel, setup, f, lin, readings, position), setup.corrections, other
    )
    each = np.column_stack([(position == n).astype(float) for n in tables.left_over(channel, setup.terms)])
    found.f_test(
        "positions", "positions", each, "differences between positions that the model does not hold",
        "the positions differ by more than the model and the noise: attitude errors or terms left out",
        "the model explains all eight positions",
    )  # fmt: skip
    found = model.reported(found, wanted, setup, lin.k0)
    if abs(found.value[0]) < 3.0 * found.u[0]:
        a, b = ("1", "3") if channel == "x" else ("2", "4")
        raise ReductionError(
            f"I_{channel}{a} = I_{channel}{b} within the noise: no scale factor k_{channel} (relative uncertainty "
            f"{found.u[0] / abs(found.value[0]):.2g}); longer readings or a lower latitude are needed"
        )
    effects = budget.effects(channel, setup, found, lin, readings, position)
    return linear_result(
        found,
        system="eight_position",
        title="Eight-position test of a two-degree-of-freedom gyro",
        method="Torque rebalance of both channels in eight positions; least squares over all cycles under an "
        "estimated noise model [TEST-8POS]",
        sources=SOURCES,
        equation="",
        conventions=_conventions(setup),
        effects=effects,
        **setup.reported(),
        closed_caption="Mean of the readings of each position in the corrected formulas 3-10, 3-11",
        warnings=_warnings(channel, setup),
    )


def _candidates(channel: str, data: Mapping[str, Array], s: Setup, d: Array, lin: model.Linear) -> list[Candidate]:
    """Set-up effects of a current: misalignment of its measuring axis towards the other one, trend, temperature,
    asymmetry of its torquer, constants of the turn-ons and, where the single readings are data, of the standings.

    Readings averaged by position and cycle hold one datum of each standing, whose scatter is in their white noise.
    """
    axes = "yx" if channel == "x" else "xy"  # the current about x measures the y channel
    across = s.earth_rate * d[:, 0, "xyz".index(axes[1])]
    text = f"misalignment of the {axes[0]} axis towards the {axes[1]} axis"
    found = [Candidate.of(f"ε_{axes}", text, "arcsec", -across), *nuisances.common(data, f",{channel}")]
    found.append(nuisances.torquer(lin.k0 * lin.X[:, 0], channel)[0])  # the scale factor is a result
    standing = list(zip(np.asarray(data["cycle"]).tolist(), np.asarray(data["position"]).tolist(), strict=True))
    if len(set(standing)) < len(standing):
        found.append(nuisances.scatter(f"σ_mount,{channel}", nuisances.MOUNTS, standing))
    return found


def _warnings(channel: str, s: Setup) -> list[str]:
    out = []
    true = model.truth(s)
    left = [n for n in model.EXTRA[channel] if s.terms == 4 and true.get(n, 0.0) != 0.0]
    if left:
        out.append(f"{', '.join(left)} simulated but not in the 4-term model: the others are biased; terms=6 has them.")
    return out


def _conventions(s: Setup) -> list[str]:
    folded = [
        "γ = (γ_x, γ_y, γ_z) is the unit vector of gravity (down) in gyro axes x (outer gimbal), y (inner gimbal), z "
        "(spin); coefficients u are at the local g.",
        "Currents: positive current precesses positively, k_x I_x = ω_y − ω_dy and k_y I_y = ω_x − ω_dx with the drift "
        "ω_d in precession sign; the current about x measures the y channel.",
        "R_x = M_x/H is the drift about y, R_y = M_y/H minus that about x.",
        "The scale factors come from the Earth's rate, W cos φ, and from nothing else.",
        "Compliance: k, R, u_zx and u_zy are free of it; u_x holds −K_xz g², u_y −K_yz g² (z is only "
        "seen with gravity along −z)."
        + (" Empirical Dx_yy and Dy_xx are folded into R, u and the g² differences." if s.terms == 6 else ""),
    ]
    if s.terms == 4:
        folded.append("4-term model: differences of g² terms and cross unbalances are taken as zero.")
    return folded


def _summary(each: Mapping[str, DriftTestResult]) -> list[str]:
    c = {c.name: c for r in each.values() for c in r.coefficients}
    worst = max((c[n] for n in ("u_x", "u_y", "u_zx", "u_zy")), key=lambda v: abs(v.estimate))
    return [
        f"Scale factors k_x = {_shown(c['k_x'])}, k_y = {_shown(c['k_y'])}.",
        f"Constant terms R_x = {_shown(c['R_x'])}, R_y = {_shown(c['R_y'])}.",
        f"Largest unbalance {worst.name} = {_shown(worst)}.",
        *(f"{name}: {text}" for name, r in each.items() for text in r.summary),
    ]


def _shown(c: Coefficient) -> str:
    ideal = c.u < 1e-9 * abs(c.estimate)  # u is rounding
    return f"{c.estimate:.6g} {c.unit}" if ideal else plus_minus(c)


def setup_of(run: RunDocument, specification: Specification | None = None) -> Setup:
    """Return the setup that a run.json describes: options and the parameters of the parts (slot.name, SI)."""
    known = all(f"gyro.{n}" in run.parameters for n in ("Dx_0", "Dy_0"))
    return Setup.of(
        run,
        specification,
        terms=int(run.options.get("terms", 6)),
        sigma=bool(run.options.get("sigma", True)),
        truth=run_metadata.truth_of(run, model.TRUE) if known else None,
        quantum={c: float(run.parameters.get(f"rebalance_{c}.resolution", 0.0)) for c in "xy"},
        pulses={c: Pulses.of(run, f"rebalance_{c}") for c in "xy"},
    )


def days_of(record: Record) -> dict[str, dict[str, Array]]:
    """Readings of each day: day -> columns of :func:`reduce`; a plan row names the position as its face.

    Raises ReductionError for a face that is no position.
    """
    plan = run_metadata.phases(record.run, positions.NUMBERS)
    day, place, turn = {}, {}, {}
    seen: dict[tuple[str, int], int] = {}
    for phase, row in plan.items():
        number, name = positions.NUMBERS[row.face], row.day
        seen[name, number] = seen.get((name, number), 0) + 1
        day[phase], place[phase], turn[phase] = name, number, row.cycle or seen[name, number]
    phases = np.asarray(record.windows["phase"]).astype(int).tolist()
    stray = sorted(set(phases) - set(day))
    if stray:
        raise ReductionError(f"phase {', '.join(map(str, stray))} is in the record, but not in its plan")
    out = {}
    for name in dict.fromkeys(day[p] for p in phases):
        rows = np.array([day[p] == name for p in phases])
        out[name] = {n: np.asarray(v)[rows] for n, v in record.windows.items()}
        out[name]["position"] = np.array([place[p] for p in phases])[rows]
        out[name]["cycle"] = np.array([turn[p] for p in phases])[rows]
    return out


@handling_errors.examined(handling_candidates.positions)
def from_record(record: Record, specification: Specification | None = None) -> DriftTestResult:
    """:func:`reduce` of a record, day by day where it holds several, with its run.json as provenance."""
    setup = setup_of(record.run, specification)
    days = days_of(record)
    if not days:
        raise ReductionError("the record holds no windows")
    each = {}
    for name, windows in days.items():
        try:
            each[name] = reduce(windows, setup)
        except ReductionError as error:
            raise ReductionError([f"day {name}: {p}" if name else p for p in error.problems]) from None
    if len(each) == 1:
        return run_metadata.finish(next(iter(each.values())), record)
    return run_metadata.finish(repeatability.combine_days(each, specification=specification), record)
