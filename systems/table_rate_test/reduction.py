"""Reduction of the rate test: rates from counts, gates and inverse rate, tracking, ripple, torque of the changes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import special

from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.record.run_document import PlanRow, RunDocument
from gyrobench.reduction.estimation import uncertainty
from gyrobench.reduction.estimation.fit_result import plus_minus
from gyrobench.reduction.setup import run_metadata
from gyrobench.reduction.setup.window_checks import ReductionError, window_problems
from gyrobench.result import BudgetLine, Coefficient, LoopResult, Response, Specification, Table
from gyrobench.units import ARCSEC

from .closed_form import SampledLoop

ERU = 7.2921159e-5
PPM = 1e-6
SHOWN = 1500  # points of a drawn line
RAMP = 0.6  # s of a change of rate that is drawn


@dataclass(frozen=True)
class AtRate:
    """What was read at one rate, one sense: all in SI, errors relative to the rate commanded."""

    row: PlanRow
    rate: float  # commanded
    error: float  # by counts, relative
    angle: float  # over which, rad
    scatter: tuple[float, int]  # of the angles at the ends of windows about a line: sum of squares, rad2, and dof
    true: float | None  # relative error of the true mean rate
    mean: float  # of the tracking error, rad
    ripple: float  # its standard deviation, rad
    u_ripple: float  # from what it differs between the windows
    jitter: float | None  # standard deviation of the true rate, rad/s
    gate: float | None  # relative error of the last gate
    inverse: float | None  # of the last interval


@dataclass(frozen=True)
class Scale:
    """Errors of the angle reader by cycles a turn: order -> standard uncertainty of the amplitude, rad."""

    amplitudes: Mapping[str, tuple[float, float]]  # source -> (cycles a turn, u)

    @classmethod
    def of(cls, run: RunDocument) -> Scale:
        p, o = run.parameters, run.options
        cycle = 2.0 * float(p.get("reader.pole_pairs", 360.0))
        return cls(
            {
                "readings, once a turn": (1.0, float(o.get("u_angle1", 0.0))),
                "readings, twice a turn": (2.0, float(o.get("u_angle2", 0.0))),
                "readings, within a cycle of the scale": (cycle, float(o.get("u_cycle", 0.0))),
            }
        )

    def parts(self, angle: float) -> list[tuple[str, float, float]]:
        """Return source, u of the amplitude and the share of it in the difference of two readings this angle apart.

        An amplitude A with any phase errs by A sqrt(1 - cos n angle) rms; whole turns cancel.
        """
        return [(n, u, math.sqrt(max(0.0, 1.0 - math.cos(k * angle)))) for n, (k, u) in self.amplitudes.items() if u]


def from_record(record: Record, specification: Specification | None = None) -> LoopResult:
    """The result of a record; raises ReductionError where it cannot be reduced."""
    run, w = record.run, record.windows
    if problems := window_problems(w):
        raise ReductionError(problems)
    quantum = run.parameters.get("reader.quantum")
    if not quantum:
        raise ReductionError("quantum of the angle reader unknown: reader.quantum is not in the record")
    readings = [r for r in (_at_rate(w, row) for row in run.plan) if r is not None]
    if not readings:
        raise ReductionError("no phase has three windows: nothing to reduce")
    return run_metadata.finish(_result(record, readings, float(quantum), specification or {}), record)


def _at_rate(w: Mapping[str, Array], row: PlanRow) -> AtRate | None:
    """Return the readings of one phase, from the end of its first window to the end of its last.

    There both ends are found alike, at the sample in which the count of a window's end appears.
    """
    pick = np.flatnonzero(w["phase"] == row.phase)
    if pick.size < 3:
        return None
    first, last = pick[0], pick[-1]
    angle, time = w["angle_end"][last] - w["angle_end"][first], w["t_end"][last] - w["t_end"][first]
    rate = float(row.target)

    def true() -> float | None:
        if "angle_true" not in w:
            return None
        return float((w["angle_true"][last] - w["angle_true"][first]) / time / rate - 1.0)

    def shown(name: str) -> float | None:
        """Return the error of the last reading of a readout that lies in this phase."""
        if name not in w or w[f"{name}_valid"][last] != 1.0 or w[f"{name}_start"][last] < w["t_start"][first]:
            return None
        return float(w[name][last] / rate - 1.0)

    used = pick[1:]
    ripples = np.asarray(w["std"][used], dtype=float)
    return AtRate(
        row, rate, float(angle / time / rate - 1.0), float(abs(angle)), _scatter(w, pick), true(),
        float(np.mean(w["mean"][used])),
        float(np.sqrt(np.mean(ripples**2))), float(np.std(ripples, ddof=1) / math.sqrt(used.size)),
        float(np.sqrt(np.mean(w["jitter"][used] ** 2))) if "jitter" in w else None, shown("gate"), shown("inverse"),
    )  # fmt: skip


def _scatter(w: Mapping[str, Array], pick: Any) -> tuple[float, int]:
    """Return sum of squares and degrees of freedom of the angles at the ends of windows about their line."""
    t, angle = w["t_end"][pick] - w["t_end"][pick[0]], w["angle_end"][pick] - w["angle_end"][pick[0]]
    line = np.column_stack([np.ones_like(t), t])
    rest = angle - line @ np.linalg.lstsq(line, angle)[0]
    return float(rest @ rest), len(t) - 2


def time_base(readings: Sequence[AtRate], quantum: float) -> tuple[float, float, float]:
    """Return the relative error that all rates have in common, its u and the coverage factor of 95 %.

    A reading errs by its rounding and by the motion of the table: the scatter of the angles at the ends of windows says
    by how much, at each rate, and not less than by rounding.  The tracking error does not say it: the roundings of
    command and reading go together where the table follows well.
    """
    weight, error, doubt = 0.0, 0.0, 0.0
    for rate in {abs(r.rate) for r in readings}:
        both = [r for r in readings if abs(r.rate) == rate]
        dof = sum(r.scatter[1] for r in both)
        one = max(sum(r.scatter[0] for r in both) / dof, quantum**2 / 12.0)
        w = np.array([r.angle**2 / (2.0 * one) for r in both])
        weight, error = weight + float(w.sum()), error + float(w @ [r.error for r in both])
        doubt += float(w.sum()) ** 2 / dof
    return error / weight, 1.0 / math.sqrt(weight), float(special.stdtrit(weight**2 / doubt, 0.975))


def _result(record: Record, readings: list[AtRate], quantum: float, limits: Specification) -> LoopResult:
    run = record.run
    scale = Scale.of(run)
    found: list[Coefficient] = []
    budget: list[BudgetLine] = []

    def add(name: str, meaning: str, unit: str, estimate: float, u: float, **more: Any) -> None:
        k, truth = more.get("k", uncertainty.NORMAL), more.get("truth")
        half = k * u
        limit = limits.get(name)
        found.append(
            Coefficient(
                name, meaning, unit, estimate, u, k, (estimate - half, estimate + half), u_a=u,
                closed=more.get("closed"), truth=truth, z=(estimate - truth) / u if truth is not None and u else None,
                limit=limit, verdict=uncertainty.assess_conformity(estimate, half, limit),
            )
        )  # fmt: skip

    clock, u_clock, k_clock = time_base(readings, quantum)
    true_clock = run.parameters.get("command.reference_clock")
    add("time base", "relative error of the command's time base, all rates", "1e-6", clock / PPM, u_clock / PPM,
        k=k_clock, truth=None if true_clock is None else float(true_clock) / PPM)  # fmt: skip
    for rate in sorted({abs(r.rate) for r in readings}):
        both = [r for r in readings if abs(r.rate) == rate]
        angle = min(r.angle for r in both)
        # the counts err at each reading anew, the scale errs alike over the same angles
        parts = {"quantization of the counts": (quantum / math.sqrt(12.0), math.sqrt(2.0 / len(both)) / angle / PPM)}
        parts |= {n: (s, f / angle / PPM) for n, s, f in scale.parts(angle)}
        name = f"error {rate / ERU:.6g} ERU"
        u = math.hypot(*(s * f for s, f in parts.values()))
        known = [r.true for r in both if r.true is not None]
        add(name, "relative error of the mean rate, by counts, both senses", "1e-6",
            float(np.mean([r.error for r in both])) / PPM, u,
            truth=float(np.mean(known)) / PPM if len(known) == len(both) else None)  # fmt: skip
        budget += [
            BudgetLine(n, s / ARCSEC, "arcsec", f * ARCSEC, "1e-6/arcsec", s * f, "1e-6", name)
            for n, (s, f) in parts.items() if s * f > 0.0
        ]  # fmt: skip
    for rate in sorted({abs(r.rate) for r in readings}):
        both = [r for r in readings if abs(r.rate) == rate]
        ripple = math.sqrt(float(np.mean([r.ripple**2 for r in both]))) / ARCSEC
        add(f"ripple {rate / ERU:.6g} ERU", "standard deviation of the tracking error", "arcsec",
            ripple, math.hypot(*(r.u_ripple for r in both)) / len(both) / ARCSEC)  # fmt: skip
    tables = [_readouts(readings, quantum, scale)]
    responses, warnings = [], _warnings(record)
    loop = SampledLoop.of(run.parameters, run.step)
    peak = _largest_change(record)
    if peak is not None:
        t, e, torque, change = peak
        curves: list[dict[str, Any]] = []
        if loop is not None:
            exact = loop.ramp(change, float(run.parameters["command.reference_acceleration"]), RAMP)
            add("peak torque", f"largest torque demanded at the change of rate by {abs(change) / ERU:.6g} ERU", "N.m",
                float(np.max(np.abs(torque))), _count_torque(run), closed=float(np.max(np.abs(exact[2]))))  # fmt: skip
            curves = [
                {
                    "label": "linear loop without counts",
                    "x": exact[0].tolist(),
                    "y": (exact[1] / ARCSEC).tolist(),
                    "phase": [],
                }
            ]
        responses.append(
            Response(
                f"change of rate by {change / ERU:+.6g} ERU", "step",
                "Tracking error (command less reading) at the largest change of rate; line: linear loop, no counts.",
                t.tolist(), "time", "s", (e / ARCSEC).tolist(), "tracking error", "arcsec", curves=curves,
            )
        )  # fmt: skip
    elif not run.measured:
        warnings.append(
            "The channels are further apart than a sample of the controller: the torque at the changes of rate is not "
            "evaluated."
        )
    if "controller.e" in record.channels:
        responses.insert(0, _tracking(record))
    worst = max(readings, key=lambda r: abs(r.mean) + 2.0 * r.ripple)
    at_worst = f"{worst.rate / ERU:+.6g}".replace("-", "−")
    name = run.parts["controller"].name if "controller" in run.parts else run.instrument
    return LoopResult(
        system=run.system,
        title="Rate test of a table",
        method="Mean rate from cumulative counts at each commanded rate, both senses; gates and inverse rate beside it",
        sources=["TABLE-RATE, READOUT-RATE, CTRL-SAMPLED; Hu 1981, sections 5.4, 5.5, 6.1, corrected by ET4, ET22"],
        equation="r = q (n_2 - n_1)\\/(t_2 - t_1), quad u^2(r) (t_2 - t_1)^2 = q^2\\/6 + sum u_n^2 (1 - cos n theta)",
        conventions=[
            "Relative errors: rate read over rate commanded, less 1. 1 ERU = 7.2921159e-5 rad/s.",
            "Tracking error: command count less count, times the quantum; it holds no error of the scale, which the "
            "servo follows.",
            "The true rate ripple (table of the readouts) is that of the simulated body; no instrument of the test "
            "reads it.",
        ],
        coefficients=found,
        budget=budget,
        warnings=warnings,
        tables=tables,
        summary=[
            f"Time base of the command: {plus_minus(found[0]).removesuffix(' 1e−6 (95 %)')} ppm (95 %) from "
            f"{len(readings)} runs at {min(abs(r.rate) for r in readings) / ERU:.4g} to "
            f"{max(abs(r.rate) for r in readings) / ERU:.6g} ERU.",
            f"Largest tracking error (mean and two standard deviations) "
            f"{(abs(worst.mean) + 2.0 * worst.ripple) / ARCSEC:.2g}″, at {at_worst} ERU (1.5″ allowed).",
        ],
        decision_rule=uncertainty.DECISION_RULE,
        verdict=uncertainty.worst_verdict(c.verdict for c in found),
        instrument=name,
        ranked_by=f"ripple {max(abs(r.rate) for r in readings) / ERU:.6g} ERU",
        responses=responses,
        simulated=not run.measured,
    )


def _readouts(readings: list[AtRate], quantum: float, scale: Scale) -> Table:
    """Return the table of the rates by counts, gate and inverse rate, with the tracking and the true ripple."""
    rows: list[list[Any]] = []
    for r in readings:
        u = math.hypot(quantum / math.sqrt(6.0), *(s * f for _, s, f in scale.parts(r.angle))) / r.angle
        rows.append(
            [
                r.rate / ERU,
                r.error / PPM,
                u / PPM,
                *(None if x is None else x / PPM for x in (r.gate, r.inverse)),
                r.mean / ARCSEC,
                r.ripple / ARCSEC,
                None if r.jitter is None else r.jitter / ERU,
            ]
        )
    columns = [
        "rate / ERU",
        "by counts / 1e-6",
        "u / 1e-6",
        "last gate / 1e-6",
        "last interval / 1e-6",
        "mean error / ″",
        "std of error / ″",
        "true rate ripple / ERU",
    ]
    return Table(
        "rates_by_the_three_readouts",
        "Rates by the three readouts",
        "Relative errors of the rate by counts over the whole phase, by the last gate and by the last interval of "
        "the inverse rate; tracking error and standard deviation of the true rate",
        columns,
        rows,
    )


def _count_torque(run: RunDocument) -> float:
    """Return the torque that one count demands, N.m: what the counts leave of a peak."""
    p = run.parameters
    pole = float(p["controller.law_p"])
    g = 2.0 + (pole**3 + 3 * pole**2 + 3 * pole - 3) / 4 - 3 * pole
    return 2.0 * float(p["controller.law_J"]) / float(p["controller.period"]) ** 2 * g * float(p["reader.quantum"])


def _largest_change(record: Record) -> tuple[Array, Array, Array, float] | None:
    """Return time, tracking error and torque of the largest change of rate, and the change; None for coarse channels.

    The time counts from the last sample before the command changes.
    """
    c, p = record.channels, record.run.parameters
    names = ("time", "command.rate", "controller.e", "controller.demand")
    if any(n not in c for n in names) or c["time"].size < 3:
        return None
    t, rate, e, torque = (np.asarray(c[n], dtype=float) for n in names)
    if t[1] - t[0] > 1.001 * float(p.get("controller.period", 5e-3)):
        return None
    targets = np.array([0.0, *(row.target for row in record.run.plan)])
    k = int(np.argmax(np.abs(np.diff(targets))))
    change = float(targets[k + 1] - targets[k])
    acceleration = float(p.get("command.reference_acceleration", 0.0))
    if acceleration == 0.0:
        return None
    reached = np.flatnonzero(np.abs(rate - targets[k]) < 1e-3 * abs(change))[:1]
    leaves = np.flatnonzero((rate - targets[k]) * np.sign(change) > 1e-3 * abs(change))
    leaves = leaves[leaves > reached[0]] if reached.size else leaves[:0]
    if leaves.size == 0:
        return None
    first = int(leaves[0]) - 1
    pick = slice(first, first + round(RAMP / (t[1] - t[0])))
    return t[pick] - t[pick][0], e[pick], torque[pick], change


def _tracking(record: Record) -> Response:
    """Return the figure of the tracking error over the run: least and largest of each of SHOWN intervals."""
    t, e = (np.asarray(record.channels[n], dtype=float) for n in ("time", "controller.e"))
    parts = np.array_split(np.arange(t.size), min(SHOWN, t.size))
    ends = np.unique([k for part in parts for k in (part[np.argmin(e[part])], part[np.argmax(e[part])])])
    x, y = (t[ends] / 3600.0).tolist(), (e[ends] / ARCSEC).tolist()
    curve = {"label": "tracking error", "x": (t[ends]).tolist(), "y": y, "phase": []}
    return Response(
        "tracking error", "time", "Tracking error over the run, least and largest value of each interval.",
        [h * 3600.0 for h in x], "time", "s", y, "tracking error", "arcsec", curves=[curve],
    )  # fmt: skip


def _warnings(record: Record) -> list[str]:
    found = []
    flagged = record.windows.get("flagged")
    if flagged is not None and np.any(flagged > 0.0):
        rows = int(np.sum(flagged > 0.0))
        found.append(
            f"The controller demanded its limit in {rows} windows. The mean rates there are those of a saturated loop. "
            "Reduce the load or the jitter of the counts."
        )
    return found
