"""Record of a servo table -> stiffness, margins, compliance and torque of the slip rings.  [TABLE-SERVO]"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from gyrobench.record.record import Record
from gyrobench.reduction.loops import margins
from gyrobench.reduction.loops.loop_measures import Drift, Gate, Point, drift
from gyrobench.reduction.loops.loop_result import NAMES, LoopFindings
from gyrobench.reduction.loops.loop_summary import margins as margin_sentences
from gyrobench.reduction.loops.loop_summary import told
from gyrobench.result import LoopResult, Specification, Table
from gyrobench.units import ARCSEC

from .closed import ServoLoop, loop_of, sense_torque

ANGLE, TORQUE, COMMAND, RATE = "table.angle", "exciter.torque[1]", "exciter.command[1]", "table.omega[1]"
ERROR = "gyro.rate_error"  # rate that the float integrates: command less table rate
GCM = 9.80665e-5  # N.m
WIDE = 1e-4  # m: a gap above it is rather one given in another unit
BLOCKS = 20  # of a phase, for the uncertainty of a mean


def from_record(record: Record, specification: Specification | None = None) -> LoopResult:
    """The Result.  Raises ReductionError for a record without a complete phase."""
    if COMMAND in record.channels and RATE in record.channels:
        error = record.channels[COMMAND] - record.channels[RATE]
        record = replace(record, channels={**record.channels, ERROR: error})
    found = LoopFindings(record, by_neighbours=True)
    p, options = record.run.parameters, record.run.options
    loop, shaper = loop_of(p), bool(options.get("shaper", True))
    damped = int(options.get("network", 2)) in (1, 2)
    if loop is None:
        found.warnings.append("No closed forms: they are those of the networks 1 to 4 of table_servo.")
    if not shaper:
        found.warnings.append(
            "The motor has no root shaper: its gain vanishes at null, so the stiffness depends on the torque and the "
            "linear models do not hold. Set shaper=true."
        )
    hold = next((g for g in found.of("hold") if g.label == "drift"), None)
    own = drift(hold.t, hold[ANGLE]) if hold is not None else None
    if shaper:
        _hung(found, loop, own, hold, damped)
    else:
        _square_law(found, loop)
    if shaper:
        _limits(found, found.open_loop("stabilizer", ERROR, COMMAND, kind="command"), loop)
    _compliance(found, loop if shaper else None)
    wide = [n for n in ("gap", "thrust_gap") if float(p.get(f"bearing.air_{n}", 0.0)) > WIDE]
    if wide:
        found.warnings.append(
            f"bearing.air_{wide[0]} = {float(p[f'bearing.air_{wide[0]}']) * 1e6:g} µm is wide for an air bearing (10 "
            "to 25 µm). Check its unit."
        )
    _rings(found, loop, p, shaper)
    result = found.result(
        title="Servo loop of a turntable",
        method="Hung torques, sines of rate through the torquer of the gyro, sines of torque, turning both ways",
        sources=[
            "TABLE-SERVO, MOTOR-SQUARELAW, SLIPRING-FOLLOWER; Hu 1981, eq. 5-7..5-21, 5-35, corrected by ET1..ET6"
        ],
        equation='L(s) = (G K_g H C(s)) / (s [(J s + D)(J_g s + c) + H^2] (1 + "lag" s)), quad K_T = G K_g H / c',
        conventions=[
            "θ: inertial angle of the table, positive like the torque M that turns it by M/K_T. A constant torque "
            "gives no rate error, a change ΔM within T the error ΔM/(K_T T).",
            "Loop gain L = −(signal that comes back) / (signal put in): rate of the table over command less rate.",
            "A lower gain limit below 1: the loop becomes unstable when its gain falls to this share.",
        ],
        specification=specification,
    )
    undamped = "Under a constant torque the table returns to its angle; the float holds the torque with {b(M)}."
    sentences = told(
        found.coefficients,
        "Static stiffness {K_T}.",
        "The hung torque turns the table by {θ(M)}." if shaper else "The hung torque turns the float by {b(M)}.",
        "" if damped or not shaper else undamped,
        "Bearing and slip rings put {M_r} on the turning table.",
    )
    result.summary = result.summary or [*margin_sentences(found), *sentences]
    return result


def _hung(
    found: LoopFindings, loop: ServoLoop | None, own: Drift | None, hold: Gate | None, damped: bool
) -> None:  # fmt: skip
    """Angle under each hung torque, and the stiffness by least squares through all of them."""
    rate = own.rate if own is not None else 0.0
    rows: list[list[Any]] = []
    moved: list[tuple[float, float, float]] = []
    unsettled = ""
    for gate in found.of("torque", 1, "step"):
        step = found.step(gate, ANGLE, scale=ARCSEC, unit="″", y_name="table angle", drift=rate, quiet=hold)
        noise = own.u * gate.row.dwell if own is not None else 0.0  # of the rate taken off
        u = math.hypot(step.u_change, noise)
        closed: float | None = None if damped else 0.0
        if damped and loop is not None:
            closed = loop.at_rest(gate.amplitude)
        unsettled = unsettled or (step.unsettled if damped else "")
        moved.append((gate.amplitude, step.change, u))
        shown = None if closed is None else closed / ARCSEC
        rows.append([gate.amplitude / GCM, step.change / ARCSEC, u / ARCSEC, shown])
        if gate.label == "torque 1 M":
            found.measure("θ(M)", f"table angle under {gate.amplitude:.4g} N·m", "″", step.change / ARCSEC, u / ARCSEC,
                          closed=shown, unsettled=step.unsettled if damped else "")  # fmt: skip
            _float(found, gate, loop, hold)
    if not moved:
        return
    caption = "Change of the inertial table angle; u: noise of the loop and of the drift rate taken off."
    columns = ["torque / (g·cm)", "angle / ″", "u / ″", "closed form / ″"]
    found.tables.append(Table("hung_torques", "Hung torques", caption, columns, rows))
    if not damped:
        found.measure("K_T", "static stiffness", "N·m/rad", None,
                      no_value="an undamped gyro integrates: the static table angle is 0")  # fmt: skip
        return
    M, theta, sigma = (np.array(x) for x in zip(*moved, strict=True))
    weight = float(np.sum((M / sigma) ** 2)) if np.all(sigma > 0.0) else 0.0
    slope = float(np.sum(M * theta / sigma**2)) / weight if weight else float(np.sum(M * theta) / np.sum(M * M))
    chi = float(np.sum(((theta - slope * M) / sigma) ** 2)) / (M.size - 1) if weight and M.size > 1 else 1.0
    relative = math.sqrt(max(1.0, chi) / weight) / abs(slope) if weight else 0.0
    stiff = loop.stiffness if loop is not None else None
    found.measure("K_T", "static stiffness of the servo", "N·m/rad", 1.0 / slope, relative / abs(slope), closed=stiff,
                  unsettled=unsettled)  # fmt: skip


def _float(found: LoopFindings, gate: Gate, loop: ServoLoop | None, hold: Gate | None) -> None:
    step = found.step(gate, "gyro.b", scale=ARCSEC, unit="″", y_name="float angle", quiet=hold)
    closed = None
    if loop is not None:
        closed = gate.amplitude / (loop.gain * loop.K_g) / ARCSEC
    found.measure("b(M)", f"float angle under {gate.amplitude:.4g} N·m", "″", step.change / ARCSEC,
                  step.u_change / ARCSEC, closed=closed, unsettled=step.unsettled)  # fmt: skip


def _square_law(found: LoopFindings, loop: ServoLoop | None) -> None:
    """Float angle under the hung torque to either side: at null the motor has no gain, a rest there means nothing."""
    ends = {}
    for gate in found.of("torque", 1, "step"):
        late = gate["gyro.b"][-gate.t.size // 5 :]
        blocks = np.array([b.mean() for b in np.array_split(late, BLOCKS)])
        ends[gate.label] = gate.amplitude, float(late.mean()), float(np.std(blocks, ddof=1))
        found.step(gate, "gyro.b", scale=ARCSEC, unit="″", y_name="float angle")
    forth, back = ends.get("torque 1 M"), ends.get("torque −1 M")
    if forth is None or back is None:
        return
    closed = None
    if loop is not None:
        closed = math.sqrt(abs(forth[0]) * loop.torque_max) / (loop.gain * loop.K_g) / ARCSEC
    found.measure("b(M)", f"float angle under {forth[0]:.4g} N·m, without root shaper", "″",
                  0.5 * (forth[1] - back[1]) / ARCSEC, 0.5 * math.hypot(forth[2], back[2]) / ARCSEC,
                  closed=closed)  # fmt: skip


def _limits(found: LoopFindings, points: list[Point], loop: ServoLoop | None) -> None:
    """Lower gain limit as measured, and all limits of the closed form."""
    if loop is None:
        return
    limits = loop.limits()
    rows = [r for t in found.tables if t["title"].startswith("Stability margins") for r in t["rows"]]
    model = next((r for r in rows if r[0] == NAMES["discrete"] and r[5] is not None), None)
    values = margins.measured_values(points, found.excluded.get("stabilizer", [])) if points else {}
    if "lower" in values and model is not None:
        found.measure("lower limit", "share of the gain at which the loop becomes unstable", "1", *values["lower"],
                      closed=10.0 ** (model[5] / 20.0))  # fmt: skip
        found.measure("f_lower", "frequency at that limit", "Hz", *values["f_lower"], closed=model[6])
    rows = [
        [f, g, 20.0 * math.log10(g), "yes" if float(loop.poles(1.05 * g).real.max()) > 0.0 else "no"] for f, g in limits
    ]
    found.tables.append(
        Table(
            "gain_limits_of_the_closed",
            "Gain limits of the closed form",
            f"All phase crossovers of L (python-control); phase margin {loop.phase_margin():.3g}° at "
            f"{loop.w_c / (2.0 * math.pi):.4g} Hz. A loop with a factor below 1 is conditionally stable.",
            ["phase crossover / Hz", "factor on the gain", "factor / dB", "unstable 5 % above it"],
            rows,
        )
    )
    if loop.network in (3, 4) and loop.w_c < 2.0 * loop.H / math.sqrt(loop.J * loop.J_g):
        found.warnings.append(
            "The crossover is below twice the resonance of table and float, "
            f"{loop.H / math.sqrt(loop.J * loop.J_g) / (2.0 * math.pi):.3g} Hz: the loop is poorly damped. Raise the "
            "crossover."
        )


def _compliance(found: LoopFindings, loop: ServoLoop | None) -> None:
    """Table angle per torque over frequency."""
    points = found.ratio(
        "compliance", "torque", 1, ANGLE, TORQUE, scale=ARCSEC, unit="″/(N·m)",
        caption="Table angle over disturbance torque. Points: measured; line: linear model.",
    )  # fmt: skip
    if not points:
        return
    worst = max(points, key=lambda q: abs(q.value))
    model = found.excited("discrete", "torque", 1, ANGLE, [worst.f])  # with step, delays and the leads of the rings
    closed = None if loop is None else abs(loop.compliance(2j * math.pi * worst.f)) / ARCSEC
    closed = closed if model is None else abs(complex(model[0])) / ARCSEC
    size = abs(worst.value) / ARCSEC
    found.measure("compliance", f"table angle per torque at {worst.f:.4g} Hz, the largest measured", "″/(N·m)", size,
                  size * (worst.u or 0.0), closed=closed)  # fmt: skip


def _rings(found: LoopFindings, loop: ServoLoop | None, p: Mapping[str, Any], shaper: bool) -> None:
    """Torque of the slip rings: half the difference of what the motor gives while the table turns forth and back."""
    turns = found.of("command", 1, "step")
    if len(turns) != 2 or loop is None or not shaper:
        return
    K_s, k_w = float(p.get("rings.ring_K_s", math.inf)), float(p.get("rings.ring_k_w", 0.0))
    if p.get("rings.ring_follower") and K_s < 9.0 * k_w:
        found.warnings.append(
            f"The follower is soft: K_s = {K_s:g} N·m/rad is below 9 k_w = {9.0 * k_w:g}, so more than a tenth of the "
            "friction of the slip rings reaches the table. Raise rings.ring_K_s or take softer leads."
        )
    torques = [_motor(g, loop) for g in turns]
    value = 0.5 * (torques[1][0] - torques[0][0])
    u = 0.5 * math.hypot(torques[0][1], torques[1][1])
    closed = sense_torque(p, abs(turns[0].amplitude))
    found.measure("M_r", "torque on the table that changes with the sense of rotation", "N·m", value, u, closed=closed)


def _motor(gate: Gate, loop: ServoLoop) -> tuple[float, float]:
    """Return the mean load torque that the motor balances, G u, in the last three quarters of a phase, with its u."""
    u = loop.gain * gate["gyro.u"][gate.t.size // 4 :]
    blocks = np.array([b.mean() for b in np.array_split(u, BLOCKS)])
    return float(u.mean()), float(np.std(blocks, ddof=1) / math.sqrt(BLOCKS))
