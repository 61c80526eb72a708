"""Reduction of the angle system test: one least-squares fit of all readings, weighted by the variances of counts.

Errors of the reader and of the reference by harmonics, lag of the reader against the reference, ripple of one-phase
excitation, clocks of the rate readouts; readings off by whole fine cycles are named and taken out.
[ANGLE-INDUCTOSYN, READOUT-RATE]

Not modelled: noise that is not white (thermal drift of the scale between the positions), rate errors of the table.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gyrobench import frames, units
from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.estimation import uncertainty
from gyrobench.reduction.estimation.effects import Effect
from gyrobench.reduction.estimation.fit_result import Findings, Group, Quantity, fit, linear_result, plus_minus
from gyrobench.reduction.setup import run_metadata
from gyrobench.reduction.setup.sources import Source
from gyrobench.reduction.setup.window_checks import ReductionError, window_problems
from gyrobench.result import DriftTestResult, Specification, Table

from . import harmonics
from .readings import (
    DEGREES,
    FIRST,
    GATES,
    MEANS,
    OTHER,
    POSITIONS,
    RATES,
    TURNED,
    Arrangement,
    Rows,
    Slips,
    assemble,
)

ARCSEC, ERU = units.factor("arcsec"), frames.EARTH_RATE
COLUMNS = (
    *("phase", "t_start", "t_end", "reading", "t_reading", "reading_2", "reference", "t_reference"),
    *(f"{of}_{n}" for of in ("gate", "inverse") for n in ("number", "rate", "start", "end")),
)
QUANTUM = 2.0 * math.pi / 7.2e6
LISTED = 8  # slips that are listed by angle


def arrangement(run: RunDocument) -> Arrangement:
    """Return what the run.json of a record says of the set-up.  Raises ReductionError."""
    p, head = run.parameters, float(run.options["head"])
    own = harmonics.meanings(p, "reader")
    separated = [k for k in own if harmonics.separation(k, head) >= harmonics.LEAST]
    reference = sorted({*harmonics.meanings(p, "reference"), *own})
    reversal = run.options.get("method") == "reversal"
    return Arrangement(
        target={row.phase: row.target for row in run.plan if row.mode == "index"},
        rate={row.phase: row.target if row.mode == "rate" else 0.0 for row in run.plan},
        turned=frozenset(row.phase for row in run.plan if row.label.startswith("turned")),
        head=head,
        pole_pairs=int(p.get("reader.pole_pairs", harmonics.POLE_PAIRS)),
        quanta=(float(p.get("reader.quantum", QUANTUM)), float(p.get("reference.quantum", QUANTUM))),
        lsb=float(p.get("inverse.lsb", 1e-4)),
        interval=float(p.get("inverse.interval", math.pi / 180.0)),
        causes=own,
        orders=separated,
        reference_orders=reference,
        reversal=reversal,
    )


def delay_of(p: Mapping[str, Any], slot: str) -> float | None:
    """Return the mean lag (s) of a simulated inductosyn, None where its parameters do not say it."""
    try:
        mode, f_0 = p[f"{slot}.mode"], float(p[f"{slot}.f_0"])
        lag = 1.0 / float(p[f"{slot}.loop_K_v"]) if mode == 1 and p[f"{slot}.loop_type"] == 1 else 0.0
        if p[f"{slot}.phases"] == 1:
            lag += float(p[f"{slot}.shifter_slope"]) / (4.0 * math.pi * f_0)
        late = mode == 2 or (mode == 0 and p[f"{slot}.stamp"] == 0)  # by an amount that changes with the angle
    except KeyError:
        return None
    return None if late else lag


def quantities(p: Mapping[str, Any], a: Arrangement) -> list[Quantity]:
    """Return what is estimated, in the order of the columns, with true values where a simulated part has them."""
    own, other = a.causes, harmonics.meanings(p, "reference")
    true, true_ref = harmonics.truth(p, "reader"), harmonics.truth(p, "reference")
    found = []
    for k in a.orders:
        for j, part in enumerate(("cos", "sin")):
            value = true.get(k, (0.0, 0.0))[j] if true else None
            found.append(Quantity.of(f"{part}_{k}", f"reader, {part} {k}θ: {own[k]}", "arcsec", value))
    for k in a.reference_orders:
        mixed = k in own and k not in a.orders
        for j, part in enumerate(("cos", "sin")):
            value = None
            if true and true_ref:
                value = true_ref.get(k, (0.0, 0.0))[j] - (true.get(k, (0.0, 0.0))[j] if mixed else 0.0)
            name = f"ref_{part}_{k}" + (f" - {part}_{k}" if mixed else "")
            meaning = f"reference, {part} {k}θ: {other.get(k, 'order of the reader')}"
            if mixed:
                meaning = f"reference minus reader, {part} {k}θ: both readings of the scale have the same"
            found.append(Quantity.of(name, meaning, "arcsec", value))
    lags = [delay_of(p, s) for s in ("reader", "reference")]
    ripple = None
    if lags[0] is not None:
        one = p["reader.phases"] == 1
        ripple = float(p["reader.shifter_slope"]) / (4.0 * math.pi * float(p["reader.f_0"])) if one else 0.0
    delay = None if lags[0] is None or lags[1] is None else lags[0] - lags[1]
    clocks = [p.get(f"{slot}.clock") for slot in ("gate", "inverse")]
    return [
        *found,
        Quantity.of("zero", "reader minus reference, constant", "arcsec"),
        Quantity.of("head", "angle of the second reading beyond its nominal one", "arcsec"),
        Quantity("delay", "lag of the reader behind the reference", "µs", 1e-6, delay),
        Quantity("ripple", "dynamic error over rate, cos 2pθ: one-phase excitation", "µs", 1e-6, ripple),
        Quantity("clock_gate", "relative error of the gate's time base", "1e-6", 1e-6, clocks[0]),
        Quantity("clock_inverse", "relative error of the inverse rate's clock", "1e-6", 1e-6, clocks[1]),
    ]


def reduce(
    windows: Mapping[str, Array], run: RunDocument, specification: Specification | None = None
) -> DriftTestResult:
    """Return the result of a record's windows.  Raises ReductionError with everything that is wrong."""
    lost = "flagged" in windows and bool(np.any(np.asarray(windows["flagged"]) > 0))
    needed = {k: v for k, v in windows.items() if not k.startswith("flagged")}
    if problems := window_problems(needed, COLUMNS):
        raise ReductionError(problems)
    a = arrangement(run)
    rows, slips = assemble(windows, a)
    known = quantities(run.parameters, a)
    X, y, variance, kind = np.vstack(rows.X), np.concatenate(rows.y), np.concatenate(rows.variance), np.array(rows.kind)
    seen = np.any(X != 0.0, axis=0)  # no gate, no degree: no clock
    found = fit(
        [q for q, s in zip(known, seen, strict=True) if s], X[:, seen], y, None, None, _groups(rows, kind, seen),
        "difference", "″", ARCSEC, noise="white", weights=1.0 / variance,
    )  # fmt: skip
    found.t_start = found.t_end = rows.at.t
    # rounding leaves bounded residuals: that they are not normal says nothing of outliers
    found.tests[:] = [t for t in found.tests if not t.name.startswith("Shapiro")]
    result = linear_result(
        found, system="angle_system_test", title="Test of an angle reading system",
        method="Weighted least squares over readings at rest and at constant rates; two readings of one scale separate "
        "its errors from those of the reference [ANGLE-INDUCTOSYN]",
        sources=["ANGLE-INDUCTOSYN; Hu 1981, eq. 5-38..5-58 with ET10..ET13, ET15",
                 "READOUT-RATE; Hu 1981, eq. 5-2..5-6 with ET4"],
        equation='r = theta + E(theta) - dot(theta) tau, quad E = sum_k a_k cos k theta + b_k sin k theta, '
        'quad r - r_2 = E(theta) - E(theta + delta)',
        conventions=_conventions(a), effects=_effects(found, X[:, seen], run), specification=specification,
        instrument=run.instrument, tables=[*_tables(found, a, slips), *_readouts(found, rows, kind)],
        random="counting and reading noise",
        warnings=_warnings(a, slips, lost),
    )  # fmt: skip
    result.allan, result.psd = {}, {}  # several rows to an instant, and long gaps: no time series
    result.summary = _summary(result, found, a, slips)
    if slips.cycles.size:
        count = slips.cycles.size
        uncertainty.withhold(result, [f"{count} readings are off by whole fine cycles: the angle is ambiguous."])
    return result


def _groups(rows: Rows, kind: NDArray[np.str_], seen: NDArray[np.bool_]) -> list[Group]:
    """Return what is drawn: readings at rest against the angle, at rates against the rate (the line: zero and lag)."""
    angle, rate = np.degrees(rows.at.angle) % 360.0, np.degrees(rows.at.rate)
    labels = {
        POSITIONS: "first minus second reading of the scale",
        MEANS: "mean of both readings minus reference",
        FIRST: "reader minus reference, first turn",
        TURNED: "reader minus reference, scale turned",
    }
    groups = [
        Group(label, np.flatnonzero(kind == name), angle[kind == name], "table angle", "°")
        for name, label in labels.items()
        if np.any(kind == name)
    ]
    turning = np.flatnonzero(kind == RATES)
    if turning.size:
        x = np.linspace(rate[turning].min(), rate[turning].max(), 21)
        line = np.zeros((x.size, seen.size))
        line[:, OTHER.index("c") - len(OTHER)] = 1.0
        line[:, OTHER.index("delay") - len(OTHER)] = -np.radians(x)
        groups.append(Group("reader minus reference", turning, rate[turning], "rate", "°/s", (x, line[:, seen])))
    return groups


def _readouts(found: Findings, rows: Rows, kind: NDArray[np.str_]) -> list[Table]:
    """Return the table of rates by gates and by degrees, less what the errors of the scale make of them."""
    names = {q.name: j for j, q in enumerate(found.linear)}
    weights = np.ones_like(found.y) if found.weights is None else found.weights
    rate, lines = rows.at.rate, []
    spread = math.sqrt(float(np.sum(weights * found.est.residual**2)) / found.dof)
    for name, clock in ((GATES, "clock_gate"), (DEGREES, "clock_inverse")):
        for r in sorted(set(rate[kind == name].tolist()), key=lambda v: (abs(v), -v)):
            use = (kind == name) & (rate == r)
            turned = found.X[use, names[clock]]  # -w T of gates, |w| T of degrees: both show rate / (1 + clock)
            weight = weights[use] * turned**2
            left = found.est.residual[use] + turned * found.est.beta[names[clock]]
            share = -float(np.sum(weight * left / turned) / np.sum(weight))
            u = spread / math.sqrt(float(np.sum(weight)))
            lines.append([name, round(r / ERU, 6), share * 1e6, u * 1e6, u * abs(r) / ERU])
    caption = "Errors of the scale taken out; u: counting, LSB and noise. Type A"
    head = ["readout", "rate of the table / ERU", "rate read, deviation / 1e-6", "u / 1e-6", "u / ERU"]
    return [Table("rate_readouts", "Rate readouts", caption, head, lines)] if lines else []


def _effects(found: Findings, X: Array, run: RunDocument) -> list[Effect]:
    """The rate of the table, which gates and degrees are compared with: faster than known, they show more."""
    clocks = [j for j, q in enumerate(found.linear) if q.name.startswith("clock")]
    u = float(run.options.get("u_rate", 0.0))
    return [Source("rate_of_the_table", "rate of the table", "1").effect(u, -X[:, clocks].sum(axis=1), note="relative")]


def _conventions(a: Arrangement) -> list[str]:
    second = "after the scale has been turned on its shaft" if a.reversal else "by a second head"
    return [
        f"The scale is read a second time {second}, at θ + {math.degrees(a.head):.6g}°.",
        "Errors are reading minus angle; constants cannot be told from the zeros and are left out.",
        "Each reading counts at the instant that its time stamp states.",
    ]


def _tables(found: Findings, a: Arrangement, slips: Slips) -> list[Table]:
    value = {q.name: float(v) for q, v in zip(found.quantities, found.value, strict=True)}
    own = [
        [k, math.hypot(value[f"cos_{k}"], value[f"sin_{k}"]) / ARCSEC,
         math.degrees(math.atan2(value[f"cos_{k}"], value[f"sin_{k}"])), harmonics.separation(k, a.head)]
        for k in a.orders
    ]  # fmt: skip
    angle = np.linspace(0.0, 2.0 * math.pi, 7201)
    waves = harmonics.waves(a.orders, angle)
    error = waves @ np.array([value[f"{f}_{k}"] for k in a.orders for f in ("cos", "sin")]) if a.orders else 0.0 * angle
    tables: list[dict[str, Any]] = [
        Table(
            "harmonics_of_the_reader",
            "Harmonics of the reader",
            "Amplitude and phase of a sin(kθ + φ). Separation: share of an order by which the two readings "
            "differ, of 2",
            ["order", "amplitude / ″", "phase / °", "separation"],
            own,
        )
    ]
    p = a.pole_pairs
    if 2 * p in a.orders and 4 * p in a.orders:
        electrical = [
            ["δ_0, quadrature", -2.0 * p * value[f"cos_{2 * p}"] * 1e3, "mrad electrical"],
            ["δ_e, amplitudes", 2.0 * p * value[f"sin_{2 * p}"] * 1e3, "1e-3"],
            ["e5 − e3, windings", p * value[f"sin_{4 * p}"] * 1e3, "1e-3"],
        ]
        tables.append(
            Table(
                "electrical_errors_of_the_reader",
                "Electrical errors of the reader",
                "By eq. 5-51, from orders 2p and 4p",
                ["error", "value", "unit"],
                electrical,
            )
        )
    local = np.array([np.ptp(error[k : k + 21]) for k in range(0, 7180, 20)])
    tables.append(
        Table(
            "error_of_the_reader_around",
            "Error of the reader around a turn",
            "By the harmonics above, constant left out",
            ["quantity", "value / ″"],
            [
                ["largest", float(error.max()) / ARCSEC],
                ["smallest", float(error.min()) / ARCSEC],
                ["largest range within 1°", float(local.max()) / ARCSEC],
            ],
        )
    )
    if slips.cycles.size:
        tables.append(
            Table(
                "readings_off_by_whole_fine",
                "Readings off by whole fine cycles",
                "Carry of the coarse channel, or a lost angle",
                ["table angle / °", "cycles", "at"],
                [
                    [float(np.degrees(x)), int(n), "a rate" if t else "rest"]
                    for x, n, t in zip(slips.angle, slips.cycles, slips.turning, strict=True)
                ][:99],
            )
        )
    return tables


def _warnings(a: Arrangement, slips: Slips, lost: bool) -> list[str]:
    out = []
    if slips.cycles.size:
        at = ", ".join(f"{math.degrees(x):.2f}°" for x in slips.angle[:LISTED])
        more = f" and {slips.angle.size - LISTED} more" if slips.angle.size > LISTED else ""
        out.append(
            f"{slips.angle.size} readings are off by whole fine cycles of {180.0 / a.pole_pairs:g}°: at {at}{more}. "
            "The cycles are taken out before the fit, and rate readouts are not evaluated; the angle read there is "
            "wrong by them. Reduce the error of the coarse channel, or the rate."
        )
    if lost:
        out.append("The reader reported a lost angle. Readings after that may be off by whole fine cycles.")
    mixed = [k for k in a.causes if k not in a.orders]
    if mixed:
        orders = ", ".join(str(k) for k in mixed)
        out.append(
            f"Not estimable for the reader: order {orders}. Two readings {math.degrees(a.head):.6g}° apart have nearly "
            "the same error there; only the difference to the reference is estimated, and rate readouts are not "
            "evaluated. Take another head angle."
        )
    return out


def _summary(result: DriftTestResult, found: Findings, a: Arrangement, slips: Slips) -> list[str]:
    names = result.names
    largest = next(t for t in result.tables if t["title"] == "Error of the reader around a turn")["rows"]
    lines = [
        f"The error of the reader is {largest[1][1]:+.3f}″ to {largest[0][1]:+.3f}″ around a turn and varies by up to "
        f"{largest[2][1]:.3f}″ within 1°.".replace("-", "−")
    ]
    if "delay" in names:
        lines.append(f"Its lag behind the reference is {plus_minus(result['delay'])}.")
    clocks = [f"{n.replace('clock_', '')} {plus_minus(result[n])}" for n in names if n.startswith("clock")]
    if clocks:
        lines.append(f"Relative errors of the rate readouts' time bases: {', '.join(clocks)}.")
    n = slips.cycles.size
    return [*lines, f"{n} readings are off by whole fine cycles." if n else "No reading is off by a fine cycle."]


def from_record(record: Record, specification: Specification | None = None) -> DriftTestResult:
    """Return :func:`reduce` of a record, with its run.json as provenance."""
    return run_metadata.finish(reduce(record.windows, record.run, specification), record)
