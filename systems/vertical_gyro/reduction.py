"""Reduction of vertical_gyro: the vertical that the gyro shows against the true one, phase by phase."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.loops.loop_measures import Gate
from gyrobench.reduction.loops.loop_result import LoopFindings
from gyrobench.reduction.loops.loop_summary import told
from gyrobench.result import LoopResult, Response, Specification, Table

ARCMIN, DEG = math.pi / 10800.0, math.pi / 180.0
G0 = 9.80665
SHOWN, MARKED = 1500, 60  # points of a drawn line, and of its marks


def up(pitch: Array, roll: Array) -> Array:
    """The vertical in vehicle axes (n, 3) for a pitch and a roll: third column of R2(roll) R1(pitch)."""
    c = np.cos(pitch)
    return np.column_stack([-np.sin(roll) * c, np.sin(pitch), np.cos(roll) * c])


def lean(pitch: Array, roll: Array, shown_pitch: Array, shown_roll: Array, inner: Array | float = 0.0) -> Array:
    """Lean of the shown vertical to the right and forward (n, 2), rad, level axes along the heading.

    The shown angles say where the vertical is; it is turned back by the true roll and pitch.  With the angle ``inner``
    that the servo has left between ring and rotor it is the lean of the rotor axis.
    """
    n = up(shown_pitch, shown_roll) * np.cos(inner)[..., None] if np.ndim(inner) else up(shown_pitch, shown_roll)
    if np.ndim(inner):
        n += np.sin(inner)[:, None] * np.column_stack([np.cos(shown_roll), 0.0 * shown_roll, np.sin(shown_roll)])
    cr, sr, cp, sp = np.cos(roll), np.sin(roll), np.cos(pitch), np.sin(pitch)
    x, z = cr * n[:, 0] + sr * n[:, 2], -sr * n[:, 0] + cr * n[:, 2]  # R2(roll) transposed
    y, z = cp * n[:, 1] - sp * z, sp * n[:, 1] + cp * z  # R1(pitch) transposed
    return np.column_stack([np.arctan2(x, z), np.arctan2(y, z)])


def erection_time(tilt: float, zone: float, law: str, rate: float, gain: float) -> float | None:
    """s from ``tilt`` to ``zone`` without drift; linear: with ``rate`` down to rate/gain, from there exponentially."""
    if tilt <= zone or zone <= 0.0:
        return None
    if law == "switches":
        return (tilt - zone) / rate
    bend = max(zone, min(tilt, rate / gain))
    return (tilt - bend) / rate + math.log(bend / zone) / gain


def from_record(record: Record, specification: Specification | None = None) -> LoopResult:
    """The result of a record; raises ReductionError for a record without a whole phase."""
    found = LoopFindings(record)
    found.warnings.clear()  # there is no loop to be linearized here
    o = record.run.options
    for gate in found.gates:
        {
            "erection": _erection,
            "rest": _rest,
            "acceleration": _acceleration,
            "turn": _turn,
            "loop": _loop,
            "roll": _roll,
        }[gate.label](found, gate, o)
    whole = record.channels
    u = chatter(record.run) / ARCMIN
    tilt, shown = (np.hypot(*_lean(whole, s).T) / ARCMIN for s in (False, True))
    t, first = whole["time"], _erected(found)
    found.measure("max", "largest tilt of the rotor after the erection", "arcmin", float(tilt[first:].max(initial=0.0)),
                  u)  # fmt: skip
    found.measure("shown max", "largest error of the shown vertical after the erection: tilt, and lag of the ring",
                  "arcmin", float(shown[first:].max(initial=0.0)), u)  # fmt: skip
    if first:
        _figure(found, "erection", "tilt", "arcmin", t[: first + 1], tilt[: first + 1],
                "Angle between the rotor axis and the true vertical while it is erected.")  # fmt: skip
    when = f"from {t[first]:.4g} s on, after the erection" if 0 < first < t.size else "over the whole run"
    if first < t.size:
        _figure(found, "tilt", "tilt", "arcmin", t[first:], tilt[first:],
                f"Angle between the rotor axis and the true vertical, {when}.")  # fmt: skip
        _figure(found, "error", "error of the shown vertical", "arcmin", t[first:], shown[first:],
                f"Angle between the vertical that pitch and roll show and the true one, {when}: the tilt, and the lag "
                "of the ring.")  # fmt: skip
    found.tables.append(_phases(found, o))
    result = found.result(
        title="Vertical gyro",
        method="Pitch and roll of the gyro against those of the vehicle, in erection, rest and manoeuvre",
        sources=["VERTICAL-GYRO; GSP ch. 5, section 5.3.1 (text only)"],
        equation="dot(bold(n)) = bold(T)\\/H + bold(d) - bold(omega) times bold(n), quad "
        "T_x = -f(e_y), quad T_y = f(e_x)",
        conventions=[
            "Tilt: angle between the rotor axis and the true vertical. Lean: its components to the right and forward.",
            "The closed figures are those without Earth rate and drift, but where they say so.",
            "u: what the period of the record leaves of a time, and a step of the erection of an angle.",
        ],
        specification=specification,
    )
    result.ranked_by = "max"
    result.summary = result.summary or told(
        found.coefficients,
        "Erected to the dead zone in {t_zone}; at rest it then hangs off by {hang-off}.",
        "The acceleration leaned the rotor by {lean}.",
        "After the erection the rotor was never more than {max} from the vertical, and what pitch and roll show never "
        "more than {shown max}.",
    )
    return result


ANGLES = ("motion.angle[1]", "motion.angle[2]", "gyro.pitch", "gyro.roll")


def _lean(channels: Mapping[str, Array], shown: bool = False) -> Array:
    """Of the rotor, or of the vertical that is shown."""
    pitch, roll, shown_pitch, shown_roll = (channels[n] for n in ANGLES)
    return lean(pitch, roll, shown_pitch, shown_roll, 0.0 if shown else channels["gyro.inner"])


def _of(gate: Gate, shown: bool = False) -> Array:
    return _lean({n: gate[n] for n in (*ANGLES, "gyro.inner")}, shown)


def _erected(found: LoopFindings) -> int:
    """Return the row of the record at which the erection is over; 0 without one."""
    first = [g for g in found.gates if g.label == "erection"]
    return first[-1].inside.stop if first else 0


def _through(gate: Gate) -> slice:
    """Return the rows from the last one before the gate opened, when the vehicle rested, to the last one in it."""
    return slice(max(gate.inside.start - 1, 0), gate.inside.stop)


def _turned(angle: Array) -> float:
    """Return what an angle that is counted within a turn went through, rad."""
    way = np.unwrap(angle)
    return float(way[-1] - way[0])


def chatter(run: RunDocument) -> float:
    """Standard uncertainty of an angle, rad: what the erection moves the rotor in one step, rectangular."""
    return float(run.options["rate"]) * run.step / math.sqrt(3.0)


def _between(y: Array, k: int) -> float:
    """Standard uncertainty of an extreme at reading k: a parabola through it and its neighbours rises above it by an
    eighth of their second difference at most.
    """
    near = y[max(k - 1, 0) : k + 2]
    return float(abs(np.diff(near, 2)[0])) / 8.0 / math.sqrt(3.0) if near.size == 3 else 0.0


def _u_time(gate: Gate) -> float:
    return float(gate.t[1] - gate.t[0]) / math.sqrt(12.0)


def _erection(found: LoopFindings, gate: Gate, o: Mapping[str, Any]) -> None:
    tilt = np.maximum(np.abs(gate["gyro.e_x"]), np.abs(gate["gyro.e_y"]))
    zone = float(o["dead_zone"])
    outside = np.flatnonzero(tilt > 1.02 * zone)  # the switches chatter at the edge of their zone
    t = gate.t - gate.t[0]
    k = int(outside[-1]) if outside.size else -1
    inside = None if k == t.size - 1 else (0.0 if k < 0 else float(t[k + 1]))
    rate = float(o["rate"])
    closed = None
    if not o["fast_time"]:
        closed = erection_time(float(o["tilt"]), 1.02 * zone, str(o["law"]), rate, float(o["gain"]))
    found.measure(
        "t_zone",
        "time from the tilt at the start to the dead zone, both axes",
        "s",
        inside,
        _u_time(gate),
        closed=closed,
    )
    if inside is None:
        found.warnings.append(
            f"The rotor did not reach the dead zone in {t[-1]:.4g} s: at its end it leans by "
            f"{tilt[-1] / ARCMIN:.4g} arcmin."
        )


def _rest(found: LoopFindings, gate: Gate, o: Mapping[str, Any]) -> None:
    tilt = np.hypot(*_of(gate).T)
    half = tilt[tilt.size // 2 :]
    closed = None
    if o["law"] == "linear":
        closed = float(o["earth_rate"]) * math.cos(float(o["latitude"])) / float(o["gain"]) / ARCMIN
    u = float(np.std(half)) / math.sqrt(8.0) / ARCMIN
    found.measure("hang-off", "mean tilt at rest, second half", "arcmin", float(half.mean()) / ARCMIN, u, closed=closed)


def _acceleration(found: LoopFindings, gate: Gate, o: Mapping[str, Any]) -> None:
    rows = _through(gate)
    forward = _lean({n: gate.channels[n][rows] for n in (*ANGLES, "gyro.inner")})[:, 1]
    change = float(forward[-1] - forward[0])
    time = float(gate.channels["time"][rows][-1] - gate.channels["time"][rows][0])
    closed = 0.0
    if not o["cut_off"] and o["law"] == "switches":
        closed = min(float(o["rate"]) * time, math.atan(float(o["acceleration"]) / G0) - float(o["dead_zone"]))
    elif not o["cut_off"]:
        a, k = math.atan(float(o["acceleration"]) / G0), float(o["gain"])
        closed = min(float(o["rate"]) * time, a * (1.0 - math.exp(-k * time)))
    u = math.sqrt(2.0) * chatter(found.record.run) / DEG
    found.measure("lean", "lean forward through the acceleration (closed: without Earth rate)", "°", change / DEG, u,
                  closed=closed / DEG)  # fmt: skip


def _turn(found: LoopFindings, gate: Gate, o: Mapping[str, Any]) -> None:
    tilt = np.hypot(*_of(gate).T)
    u = chatter(found.record.run) / ARCMIN
    found.measure("turn", "largest tilt in the turn", "arcmin", float(tilt.max()) / ARCMIN, u)


def _loop(found: LoopFindings, gate: Gate, o: Mapping[str, Any]) -> None:
    tilt, rows, c = np.hypot(*_of(gate, shown=True).T), _through(gate), gate.channels
    found.measure("loop", "largest error of the shown vertical in the loop", "arcmin", float(tilt.max()) / ARCMIN,
                  chatter(found.record.run) / ARCMIN)  # fmt: skip
    rise, x = np.sin(c["motion.angle[1]"][rows]), c["motion.angle[2]"][rows]
    true = _turned(np.arctan2(rise, np.cos(c["motion.angle[1]"][rows]) * np.cos(x)))  # pitch counted on beyond 90 deg
    found.measure("pitch", "pitch shown through the loop (closed: of the vehicle)", "°",
                  _turned(c["gyro.pitch"][rows]) / DEG, math.sqrt(2.0) * chatter(found.record.run) / DEG,
                  closed=true / DEG)  # fmt: skip
    ring = np.unwrap(gate["gyro.ring_angle"])
    u = math.hypot(chatter(found.record.run), _between(ring, int(ring.argmax())), _between(ring, int(ring.argmin())))
    found.measure("ring", "travel of the ring in the loop", "°", float(np.ptp(ring)) / DEG, u / DEG)


def _roll(found: LoopFindings, gate: Gate, o: Mapping[str, Any]) -> None:
    rows, c = _through(gate), gate.channels
    lag = 60.0 / float(found.record.run.parameters.get("gyro.k_ring", math.inf))
    found.measure("roll", "roll shown at the end of the roll (closed: of the vehicle, less the lag of the ring)", "°",
                  _turned(c["gyro.roll"][rows]) / DEG, math.sqrt(2.0) * chatter(found.record.run) / DEG,
                  closed=_turned(c["motion.angle[2]"][rows]) / DEG - lag)  # fmt: skip
    found.measure("g2", "largest angle left to the ring's servo in the roll", "°",
                  float(np.abs(gate["gyro.inner"]).max()) / DEG, chatter(found.record.run) / DEG,
                  closed=lag)  # fmt: skip


def _phases(found: LoopFindings, o: Mapping[str, Any]) -> Table:
    rows: list[list[Any]] = []
    for gate in found.gates:
        tilt = np.hypot(*_of(gate).T) / ARCMIN
        cut = float(np.mean(gate["erection.cut"] > 0.0)) if "erection.cut" in gate.channels else None
        rows.append([gate.label, float(gate.t[-1] - gate.t[0]), tilt[0], tilt[-1], tilt.max(), cut])
    return Table(
        "tilt_by_phase",
        "Tilt by phase",
        "Cut off: share of the phase in which a channel of the erection was open.",
        [
            "phase",
            "length / s",
            "tilt at its start / arcmin",
            "at its end / arcmin",
            "largest / arcmin",
            "cut off",
        ],
        rows,
    )


def _figure(found: LoopFindings, name: str, what: str, unit: str, t: Array, y: Array, caption: str) -> None:
    pick = np.unique(np.linspace(0, t.size - 1, min(SHOWN, t.size)).astype(int))
    few = np.unique(np.linspace(0, t.size - 1, min(MARKED, t.size)).astype(int))
    line = {"label": "as recorded", "x": t[pick].tolist(), "y": y[pick].tolist(), "phase": []}
    found.responses.append(
        Response(name, "step", caption, t[few].tolist(), "time", "s", y[few].tolist(), what, unit, curves=[line])
    )
