"""Record of a gyrocompass -> settling, periods, damping, latitude and speed errors, ballistic deflection, rolling."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.reduction.estimation.uncertainty import withhold
from gyrobench.reduction.loops.loop_measures import Gate
from gyrobench.reduction.loops.loop_summary import told
from gyrobench.result import LoopResult, Response, Specification

from .findings import KNOWN, CompassFindings, error, means, steaming, wrap, wrapped
from .linear import LinearCompass, Steaming
from .oscillation import Oscillation

DEG = math.pi / 180.0
SHOWN = 600  # points of a figure
SMALL = 4.0 * DEG  # swing that is fitted
LARGE = 30.0 * DEG  # azimuth at switch-on beyond which the settling is not that of a linear system
STRONG = 10.0 * DEG  # settled error, beyond which those of the periods fail
SPAN = 0.6  # periods that a fit of period and damping needs
STILL = 0.02 * DEG  # swing that does not count when a manoeuvre begins
POLAR = 75.0 * DEG  # latitude


def from_record(record: Record, specification: Specification | None = None) -> LoopResult:
    """Result of one run.  Raises ReductionError for a record without a whole phase."""
    found = CompassFindings(record)
    for gate in found.gates:
        if gate.label == "settling":
            _settling(found, gate)
        elif gate.label == "undamped":
            _undamped(found, gate)
        elif gate.label in ("damped again", "steaming", "after the turn", "rolling"):
            _settled(found, gate)
    _figures(found)
    _warn(found)
    result = found.result(
        title="Gyrocompass",
        method="Heading shown less the ship's: settling, free oscillation, change of speed, turn, rolling",
        sources=["GYROCOMPASS; GSP ch. 5, section 5.3.2, fig. 5-20 (text only)"],
        equation='dot("az") = omega_U - (m g l\\/H + omega_N) "el" + C\\/H x, quad '
        'dot("el") = V_N\\/R + omega_N "az" - D\\/H "el", quad T dot(x) = "el" - x',
        conventions=[
            "Headings are clockwise from north, azimuths of the rotor axis east, tilts up. Error: heading shown less "
            "the true one, so that an axis that points east of north shows a negative error.",
            "Closed forms are of small angles, of the compass and the ship as they are in the parts.",
        ],
        ranked_by="settling time",
        specification=specification,
    )
    at = record.run.options
    result.site = {"latitude / °": float(at["latitude"]) / DEG, "Earth rate / (rad/s)": float(at["earth_rate"])}
    if found.doubts:
        withhold(result, found.doubts)
    result.summary = result.summary or told(
        found.coefficients,
        "Settled after {settling time} with an error of {latitude error}; undamped period {period}.",
        "The speed changes the heading shown by {speed error}; then {ballistic error} is left to settle.",
        "After the turn {ballistic error in the turn} is left to settle.",
        "Rolling between the quarters moves it by {rolling error}.",
    )
    return result


def _settling(found: CompassFindings, gate: Gate) -> None:
    o, own, at = found.record.run.options, found.linear_compass, steaming(gate)
    dt, band = float(gate.t[1] - gate.t[0]), float(o["band"])
    y = np.unwrap(error(gate))
    block = found.block(dt, y.size)
    t, z = means(gate, y, block)
    end = float(z[-max(3, z.size // 20) :].mean())
    swing = np.flatnonzero(np.abs(z - end) > SMALL)
    after = float(t[swing[-1]] - gate.t[0]) if swing.size else 0.0
    damped = o["damping"] != "none"
    fitted = found.fitted(gate, "settling", free=not damped, after=after if damped else 0.0)
    if fitted is None:
        found.unsettled = f"the heading swings by more than {SMALL / DEG:.3g}° nearly to the end of its settling"
        found.note("settling time", "from switch-on to the band", "h", math.nan, math.nan)
        return
    swings = float(np.max(np.abs(z[t - gate.t[0] >= after] - fitted.settled)))
    bent = swings**2 / 16.0 / math.sqrt(3.0)  # relative, of the period of a pendulum with this swing
    period, u_period = fitted.damped_period
    ratio, u_ratio = fitted.damping_ratio
    model = found.guess(at, not damped) if own else None
    if damped:
        closed, span = _creep(model), float(t[-1] - gate.t[0]) - after
        short = (
            f"{span / 60.0:.3g} min of swing below {SMALL / DEG:.3g}° are too short"
            if span < SPAN * 2.0 * math.pi / fitted.omega
            else ""
        )
        if math.isfinite(period) or short:
            found.measure("damped period", "of the damped oscillation", "min", period / 60.0,
                          math.hypot(u_period, bent * period) / 60.0,
                          closed=None if closed is None else closed / 60.0, unsettled=short)  # fmt: skip
        found.measure("damping ratio", "of the damped oscillation", "1", ratio, math.hypot(u_ratio, bent * ratio),
                      closed=None if model is None else float(model[0] / model[1]), unsettled=short)  # fmt: skip
    else:
        if any(g.label == "undamped" for g in found.gates):
            return
        full, u_full = fitted.period
        swing_bent = min(0.5, (0.5 * float(np.ptp(z))) ** 2 / 16.0)
        found.measure("period", "without damping", "min", full / 60.0,
                      math.hypot(u_full, swing_bent / math.sqrt(3.0) * full) / 60.0,
                      closed=None if own is None else 2.0 * math.pi / own.omega(at) / 60.0)  # fmt: skip
        return
    covariance = np.diag(fitted.covariance)[: 3 if math.isfinite(fitted.third) else 2]
    values = np.array([fitted.decay, fitted.omega, *([fitted.third] if math.isfinite(fitted.third) else [])])
    found.poles = values, np.sqrt(covariance + (KNOWN * values) ** 2)
    outside = np.flatnonzero(np.abs(z - fitted.settled) > band)
    if fitted.left > band or (outside.size and outside[-1] >= z.size - 2):
        found.unsettled = f"not settled to {band / DEG:.3g}° when the phase of {gate.row.dwell / 3600.0:.3g} h ended"
    time = u_time = math.nan
    if outside.size and not found.unsettled:
        k = int(outside[-1])
        side = band if z[k] > fitted.settled else -band
        slope = (z[k + 1] - z[k]) / (t[k + 1] - t[k])
        time = float(t[k] + (fitted.settled + side - z[k]) / slope - gate.t[0])
        near = z[max(k - 1, 0) : k + 3]
        bend = float(np.max(np.abs(np.diff(near, 2)))) / 8.0 / math.sqrt(3.0) if near.size > 2 else 0.0
        off = math.hypot(fitted.noise, fitted.wander, fitted.u_settled, bend)
        u_time = off / abs(slope)
        # of a swing about as large as the band noise says whether it counts: the time is then that of one swing or two
        early, late = (np.flatnonzero(np.abs(z - fitted.settled) > max(band + d * off, 0.0)) for d in (3.0, -3.0))
        apart = float(t[late[-1]] - (t[early[-1]] if early.size else gate.t[0]))
        if apart > 0.5 * math.pi / fitted.omega:  # a quarter of a period
            u_time = 0.5 * apart
    elif not outside.size:
        time, u_time = 0.0, (t[1] - t[0]) / math.sqrt(12.0)
    closed = None
    if own is not None:
        closed = _closed_settling(own, gate, at, band, (float(o["offset"]), float(o["tilt"])))
    found.note("settling time", f"from switch-on until it stays within {band / DEG:.3g}° of the settled error", "h",
               time / 3600.0, u_time / 3600.0, None if closed is None else closed / 3600.0)  # fmt: skip
    found.note("latitude error", "heading error at rest when settled", "°", wrap(fitted.settled) / DEG,
               fitted.u_settled / DEG, None if own is None else own.settled_error(at) / DEG)  # fmt: skip
    found.before = fitted


def _creep(model: Array | None) -> float | None:
    """Return the damped period of poles; None where they only creep."""
    if model is None or model[1] <= model[0]:
        return None
    return 2.0 * math.pi / math.sqrt(float(model[1] ** 2 - model[0] ** 2))


def _closed_settling(
    own: LinearCompass, gate: Gate, at: Steaming, band: float, start: tuple[float, float]
) -> float | None:
    """Return the settling time by the equations of small tilts, s; None where they do not settle in time."""
    t = gate.t - gate.t[0]
    grid = np.linspace(0.0, float(t[-1]), 4000)
    way = own.response(grid, np.full(grid.size, at.course), np.full(grid.size, at.speed), at.latitude,
                       np.array([*start, start[1]]))[:, 0]  # fmt: skip
    off = np.abs(wrapped(own.shown(way, at) - own.settled_error(at)))
    k = int(np.flatnonzero(off > band)[-1]) if np.any(off > band) else -1
    if k < 0 or k + 1 >= grid.size:
        return 0.0 if k < 0 else None
    return float(grid[k] + (off[k] - band) / (off[k] - off[k + 1]) * (grid[k + 1] - grid[k]))


def _undamped(found: CompassFindings, gate: Gate) -> None:
    fitted, own, at = found.fitted(gate, "undamped", free=True), found.linear_compass, steaming(gate)
    if fitted is None:
        return
    period, u = fitted.period
    swing = 0.5 * float(np.ptp(means(gate, error(gate), 60)[1]))
    u = math.hypot(u, period * swing**2 / 16.0 / math.sqrt(3.0))
    closed = None if own is None else 2.0 * math.pi / own.omega(at)
    found.measure("period", "without damping", "min", period / 60.0, u / 60.0,
                  closed=None if closed is None else closed / 60.0)  # fmt: skip
    if own is not None:
        schuler = 2.0 * math.pi * math.sqrt(own.radius / own.gravity)
        found.measure("Schuler ratio", "square of the period without damping over Schuler's, 2π √(R/g)", "1",
                      (period / schuler) ** 2, 2.0 * period * u / schuler**2, closed=(closed / schuler) ** 2
                      if closed else None)  # fmt: skip


NAMES = {
    "steaming": ("speed error", "change of the settled error by the change of speed"),
    "after the turn": ("turn error", "change of the settled error by the turn"),
    "rolling": ("rolling error", "change of the settled error by rolling"),
}


def _settled(found: CompassFindings, gate: Gate) -> None:
    """Measure the settled error of a phase and what it has changed by."""
    if found.poles is None:
        return
    fitted, own, at = found.fitted(gate, gate.label), found.linear_compass, steaming(gate)
    last, found.before = found.before, None
    if fitted is None:
        return
    if fitted.left > float(found.record.run.options["band"]):
        found.unsettled = f"not settled when the phase {gate.label} ended"
    found.before = fitted
    if gate.label not in NAMES or last is None:
        return
    name, meaning = NAMES[gate.label]
    rolls = gate.label == "rolling"
    before = found.gates[found.gates.index(gate) - (1 if rolls else 2)]
    closed = None
    if own is not None:
        closed = _rolled(found, at) if rolls else own.settled_error(at) - own.settled_error(steaming(before))
    found.note(name, meaning, "°", wrap(fitted.settled - last.settled) / DEG,
               math.hypot(fitted.u_settled, last.u_settled) / DEG,
               None if closed is None else closed / DEG)  # fmt: skip
    if not rolls:
        _ballistic(found, gate, before, last, fitted)


def _rolled(found: CompassFindings, at: Steaming) -> float | None:
    """Return the closed form of the rolling error, of the fundamental of lever sin(roll)."""
    own, o, p = found.linear_compass, found.record.run.options, found.record.run.parameters
    if own is None or "ship.lever" not in p:
        return None
    w, r = 2.0 * math.pi / float(o["roll_period"]), float(o["roll"])
    across = float(p["ship.lever"]) * r * (1.0 - r * r / 8.0) * w * w
    rest, moved = own.settled(at)[0], own.rolling(at, across, w / (2.0 * math.pi))
    return None if abs(moved - rest) > STRONG else float(own.shown(moved, at) - own.shown(rest, at))


def _modelled(found: CompassFindings, gate: Gate, own: LinearCompass) -> tuple[Array, Array]:
    """Return time and error by the equations of small tilts, from the sample before a manoeuvre to its last one."""
    before = steaming(found.gates[found.gates.index(gate) - 1])
    az, el = own.settled(before)
    rows = slice(max(gate.inside.start - 1, 0), gate.inside.stop)
    t, course, speed = (gate.channels[n][rows] for n in ("time", "ship.heading", "ship.speed"))
    cut = bool(np.mean(gate["exciter.test[1]"]) > 0.5)
    way = own.response(t, np.unwrap(course), speed, before.latitude, np.array([az, el, el]), cut)[:, 0]
    error = [
        float(own.shown(a, Steaming(c, v, before.latitude))) for a, c, v in zip(way, course, speed, strict=True)
    ]  # fmt: skip
    return t, wrapped(np.array(error))


def _edge(gate: Gate) -> tuple[float, float]:
    """Return the heading error at the beginning of a phase, of a parabola through its first four minutes, and its u."""
    n = min(gate.t.size, 1 + round(240.0 / float(gate.t[1] - gate.t[0])))
    y, x = np.unwrap(error(gate))[:n], np.linspace(0.0, 1.0, n)
    columns = np.column_stack([np.ones(n), x, x * x])
    beta, *_ = np.linalg.lstsq(columns, y, rcond=None)
    rest = y - columns @ beta
    s2 = float(rest @ rest) / (n - 3)
    return float(beta[0]), math.sqrt(s2 * float(np.linalg.inv(columns.T @ columns)[0, 0]))


def _ballistic(found: CompassFindings, gate: Gate, before: Gate, last: Oscillation, now: Oscillation) -> None:
    """Measure what a manoeuvre has done when it ends, and what of it is left to settle."""
    own, key = found.linear_compass, "" if gate.label == "steaming" else " in the turn"
    start, u_start = _edge(gate)
    closed: tuple[float, float] | None = None
    if own is not None:
        end = float(_modelled(found, found.gates[found.gates.index(gate) - 1], own)[1][-1])
        closed = wrap(end - own.settled_error(steaming(before))), wrap(end - own.settled_error(steaming(gate)))
    rows = (
        ("ballistic deflection", "change of the heading shown while course or speed change", last),
        ("ballistic error", "error at the end of the manoeuvre less the settled one after it", now),
    )
    swings = ""
    if last.left > max(STILL, 2.0 * u_start):
        swings = f"the axis swung by {last.left / DEG:.2g}° when the manoeuvre began"
    for k, (name, meaning, rest) in enumerate(rows):  # u: noise, wander by drift, what is left of the swing before
        found.measure(name + key, meaning, "°", wrap(start - rest.settled) / DEG,
                      math.hypot(u_start, rest.u_settled, last.left, last.wander) / DEG,
                      closed=None if closed is None else closed[k] / DEG,
                      unsettled=found.unsettled or swings)  # fmt: skip


def _warn(found: CompassFindings) -> None:
    """Say where the formulas of small angles do not hold."""
    o, own = found.record.run.options, found.linear_compass
    if abs(float(o["offset"])) > LARGE:
        found.warnings.append(
            f"The axis starts {abs(float(o['offset'])) / DEG:.3g}° off: beyond {LARGE / DEG:.3g}° it does not swing "
            f"as a linear system. Period, damping ratio and settled error are of its swings below {SMALL / DEG:.3g}°."
        )
    latitude = max(abs(float(g["ship.latitude_now"].max())) for g in found.gates)
    if latitude > POLAR:
        found.warnings.append(
            f"At {latitude / DEG:.3g}° of latitude the horizontal Earth rate is {math.cos(latitude):.2g} of that at "
            "the equator: effects of drift, speed error and latitude error grow with its reciprocal."
        )
    if own is not None:
        rolled = abs(found.estimates.get("rolling error", 0.0)) * DEG
        worst = max(rolled, *(abs(own.settled(steaming(g))[0]) for g in found.gates))
        if worst > STRONG:
            found.warnings.append(
                f"The axis settles up to {worst / DEG:.3g}° off the meridian: the closed forms, of small angles, miss "
                "by more than 1 % there."
            )
            found.doubts.append(f"The axis settles {worst / DEG:.3g}° off the meridian, beyond small angles.")
    if found.unsettled:
        found.warnings.append(
            f"The compass has {found.unsettled}: errors that follow have no value. Give settle more time."
        )


def _figures(found: CompassFindings) -> None:
    """Add the heading error of each phase against time, with what is computed beside it."""
    own = found.linear_compass
    for gate in found.gates:
        if gate.label in ("slew", "damped again"):
            continue
        t, y = means(gate, np.unwrap(error(gate)), max(1, gate.t.size // SHOWN))
        unit, scale = ("h", 3600.0) if t[-1] - t[0] > 7200.0 else ("s", 1.0)
        caption = f"Heading shown less the true one, phase {gate.label}."
        curves = []
        if own is not None and gate.label in ("change of speed", "turn"):
            x, z = _modelled(found, gate, own)
            curves = [_curve("computed", (x - gate.t[0]) / scale, z)]
        elif own is not None and gate.label != "undamped":
            level = own.settled_error(steaming(gate))
            if gate.label == "rolling":
                level += _rolled(found, steaming(gate)) or math.nan
            if math.isfinite(level):
                curves = [_curve("at rest, computed", np.array([0.0, t[-1] - gate.t[0]]) / scale, np.full(2, level))]
        found.responses.append(
            Response(gate.label, "step", caption, ((t - gate.t[0]) / scale).tolist(), "time", unit, (y / DEG).tolist(),
                     "error", "°", curves=curves)
        )  # fmt: skip


def _curve(label: str, t: Array, y: Array) -> dict[str, Any]:
    return {"label": label, "x": t.tolist(), "y": (y / DEG).tolist(), "phase": []}
