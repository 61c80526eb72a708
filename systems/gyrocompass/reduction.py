"""Record of a gyrocompass -> settling, periods, damping, latitude and speed errors, ballistic deflection, rolling."""

from __future__ import annotations

import math

import numpy as np

from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.loops.loop_toolkit import DEG, Account, Array, Gate, LoopReduction, Response, line, wrapped

from .findings import KNOWN, CompassFindings, error, means, steaming, wrap
from .linear import LinearCompass, Steaming
from .oscillation import Oscillation

SHOWN = 600  # points of a figure
SMALL = 4.0 * DEG  # swing that is fitted
LARGE = 30.0 * DEG  # azimuth at switch-on beyond which the settling is not that of a linear system
STRONG = 10.0 * DEG  # settled error, beyond which those of the periods fail
SPAN = 0.6  # periods that a fit of period and damping needs
STILL = 0.02 * DEG  # swing that does not count when a manoeuvre begins
POLAR = 75.0 * DEG  # latitude
NAMES = {
    "steaming": ("speed error", "change of the settled error by the change of speed"),
    "after the turn": ("turn error", "change of the settled error by the turn"),
    "rolling": ("rolling error", "change of the settled error by rolling"),
}


class Reduction(LoopReduction):
    """Heading shown less the ship's: settling, free oscillation, change of speed, turn, rolling."""

    said = (
        "Settled after {settling time} with an error of {latitude error}; undamped period {period}.",
        "The speed changes the heading shown by {speed error}; then {ballistic error} is left to settle.",
        "After the turn {ballistic error in the turn} is left to settle.",
        "Rolling between the quarters moves it by {rolling error}.",
    )
    ranked_by = "settling time"
    found: CompassFindings

    def findings(self) -> CompassFindings:
        return CompassFindings(self.record)

    def measure(self) -> Account:
        self.own, o = self.found.linear_compass, self.run.options
        self.band, self.offset, self.tilt = (float(o[n]) for n in ("band", "offset", "tilt"))
        self.damped = o["damping"] != "none"
        for gate in self.found.gates:
            if gate.label == "settling":
                self._settling(gate)
            elif gate.label == "undamped":
                self._undamped(gate)
            elif gate.label in ("damped again", *NAMES):
                self._settled(gate)
        self._figures()
        self._warn()
        site = {"latitude / °": float(o["latitude"]) / DEG, "Earth rate / (rad/s)": float(o["earth_rate"])}
        self.found.facts["site"] = site
        return Account(
            method="Heading shown less the ship's: settling, free oscillation, change of speed, turn, rolling",
            sources=["GYROCOMPASS; GSP ch. 5, section 5.3.2, fig. 5-20 (text only)"],
            equation='dot("az") = omega_U - (m g l\\/H + omega_N) "el" + C\\/H x, quad '
            'dot("el") = V_N\\/R + omega_N "az" - D\\/H "el", quad T dot(x) = "el" - x',
            conventions=[
                "Headings are clockwise from north, azimuths of the rotor axis east, tilts up. Error: heading shown "
                "less the true one, so that an axis that points east of north shows a negative error.",
                "Closed forms are of small angles, of the compass and the ship as they are in the parts.",
            ],
        )

    def _settling(self, gate: Gate) -> None:
        """Measure the swing below SMALL, and where it has been damped the settling time and the settled error."""
        found, own, at, band = self.found, self.own, steaming(gate), self.band
        y = np.unwrap(error(gate))
        t, z = means(gate, y, found.block(float(gate.t[1] - gate.t[0]), y.size))
        end = float(z[-max(3, z.size // 20) :].mean())
        swing = np.flatnonzero(np.abs(z - end) > SMALL)
        after = float(t[swing[-1]] - gate.t[0]) if swing.size and self.damped else 0.0
        fitted = found.fitted(gate, "settling", free=not self.damped, after=after)
        if fitted is None:
            small = plain(SMALL / DEG, 3)
            found.unsettled = f"the heading swings by more than {small}° nearly to the end of its settling"
            found.note("settling time", "from switch-on to the band", "h", math.nan, math.nan)
            return
        if not self.damped:
            if not any(g.label == "undamped" for g in found.gates):
                self._free_period(at, fitted, min(0.5, (0.5 * float(np.ptp(z))) ** 2 / 16.0))
            return
        swings = float(np.max(np.abs(z[t - gate.t[0] >= after] - fitted.settled)))
        # bent: relative, of the period of a pendulum with this swing
        self._swing(at, fitted, float(t[-1] - gate.t[0]) - after, bent=swings**2 / 16.0 / math.sqrt(3.0))
        values = np.array([fitted.decay, fitted.omega, *([fitted.third] if math.isfinite(fitted.third) else [])])
        found.poles = values, np.sqrt(np.diag(fitted.covariance)[: values.size] + (KNOWN * values) ** 2)
        outside = np.flatnonzero(np.abs(z - fitted.settled) > band)
        if fitted.left > band or (outside.size and outside[-1] >= z.size - 2):
            hours = gate.row.dwell / 3600.0
            found.unsettled = f"not settled to {plain(band / DEG, 3)}° when the phase of {plain(hours, 3)} h ended"
        closed = None if own is None else _closed_settling(own, gate, at, band, (self.offset, self.tilt))
        meaning = f"from switch-on until it stays within {plain(band / DEG, 3)}° of the settled error"
        time, u_time = (math.nan, math.nan) if found.unsettled else _settled_after(t, z, gate.t[0], fitted, band)
        found.note("settling time", meaning, "h", time, u_time, closed)
        found.note("latitude error", "heading error at rest when settled", "°", wrap(fitted.settled), fitted.u_settled,
                   None if own is None else own.settled_error(at))  # fmt: skip
        found.before = fitted

    def _swing(self, at: Steaming, fitted: Oscillation, span: float, bent: float) -> None:
        """Measure period and ratio of the damped oscillation in its last ``span`` s; bent: relative, of both."""
        found, model = self.found, self.found.guess(at, False) if self.own else None
        short = ""
        if span < SPAN * 2.0 * math.pi / fitted.omega:
            short = f"{plain(span / 60.0, 3)} min of swing below {plain(SMALL / DEG, 3)}° are too short"
        (period, u), (ratio, u_ratio) = fitted.damped_period, fitted.damping_ratio
        if math.isfinite(period) or short:
            found.measure("damped period", "of the damped oscillation", "min", period, math.hypot(u, bent * period),
                          scale=60.0, closed=_creep(model), unsettled=short)  # fmt: skip
        closed = None if model is None else float(model[0] / model[1])
        u = math.hypot(u_ratio, bent * ratio)
        found.measure("damping ratio", "of the damped oscillation", "1", ratio, u, closed=closed, unsettled=short)

    def _free_period(self, at: Steaming, fitted: Oscillation, bent: float) -> tuple[float, float, float | None]:
        """Measure the period without damping; return it, its u and its closed form."""
        period, u = fitted.period
        u, closed = math.hypot(u, bent / math.sqrt(3.0) * period), None
        if self.own is not None:
            closed = 2.0 * math.pi / self.own.omega(at)
        self.found.measure("period", "without damping", "min", period, u, scale=60.0, closed=closed)
        return period, u, closed

    def _undamped(self, gate: Gate) -> None:
        fitted, own, at = self.found.fitted(gate, "undamped", free=True), self.own, steaming(gate)
        if fitted is None:
            return
        swing = 0.5 * float(np.ptp(means(gate, error(gate), 60)[1]))
        period, u, closed = self._free_period(at, fitted, swing**2 / 16.0)
        if own is not None and closed is not None:
            schuler = 2.0 * math.pi * math.sqrt(own.radius / own.gravity)
            meaning = "square of the period without damping over Schuler's, 2π √(R/g)"
            self.found.measure("Schuler ratio", meaning, "1", (period / schuler) ** 2, 2.0 * period * u / schuler**2,
                               closed=(closed / schuler) ** 2)  # fmt: skip

    def _settled(self, gate: Gate) -> None:
        """Measure the settled error of a phase and what it has changed by."""
        found, own, at = self.found, self.own, steaming(gate)
        if found.poles is None:
            return
        fitted = found.fitted(gate, gate.label)
        last, found.before = found.before, None
        if fitted is None:
            return
        if fitted.left > self.band:
            found.unsettled = f"not settled when the phase {gate.label} ended"
        found.before = fitted
        if gate.label not in NAMES or last is None:
            return
        rolls = gate.label == "rolling"
        before = found.gates[found.gates.index(gate) - (1 if rolls else 2)]
        closed = None
        if own is not None:
            closed = self._rolled(at) if rolls else own.settled_error(at) - own.settled_error(steaming(before))
        u = math.hypot(fitted.u_settled, last.u_settled)
        found.note(*NAMES[gate.label], "°", wrap(fitted.settled - last.settled), u, closed)
        if not rolls:
            self._ballistic(gate, before, last, fitted)

    def _rolled(self, at: Steaming) -> float | None:
        """Return the closed form of the rolling error, of the fundamental of lever sin(roll)."""
        own, o, p = self.own, self.run.options, self.run.parameters
        if own is None or "ship.lever" not in p:
            return None
        w, r = 2.0 * math.pi / float(o["roll_period"]), float(o["roll"])
        across = float(p["ship.lever"]) * r * (1.0 - r * r / 8.0) * w * w
        rest, moved = own.settled(at)[0], own.rolling(at, across, w / (2.0 * math.pi))
        return None if abs(moved - rest) > STRONG else float(own.shown(moved, at) - own.shown(rest, at))

    def _modelled(self, gate: Gate, own: LinearCompass) -> tuple[Array, Array]:
        """Return time and error by the equations of small tilts, from the sample before a manoeuvre to its last one."""
        before = steaming(self.found.gates[self.found.gates.index(gate) - 1])
        az, el = own.settled(before)
        rows = slice(max(gate.inside.start - 1, 0), gate.inside.stop)
        t, course, speed = (gate.channels[n][rows] for n in ("time", "ship.heading", "ship.speed"))
        cut = bool(np.mean(gate["exciter.test[1]"]) > 0.5)
        way = own.response(t, np.unwrap(course), speed, before.latitude, np.array([az, el, el]), cut)[:, 0]
        each = zip(way, course, speed, strict=True)
        return t, wrapped(np.array([float(own.shown(a, Steaming(c, v, before.latitude))) for a, c, v in each]))

    def _ballistic(self, gate: Gate, before: Gate, last: Oscillation, now: Oscillation) -> None:
        """Measure what a manoeuvre has done when it ends, and what of it is left to settle."""
        found, own = self.found, self.own
        key = "" if gate.label == "steaming" else " in the turn"
        start, u_start = _edge(gate)
        closed: list[float | None] = [None, None]
        if own is not None:
            end = float(self._modelled(found.gates[found.gates.index(gate) - 1], own)[1][-1])
            closed = [wrap(end - own.settled_error(steaming(g))) for g in (before, gate)]
        swings = ""
        if last.left > max(STILL, 2.0 * u_start):
            swings = f"the axis swung by {plain(last.left / DEG)}° when the manoeuvre began"
        rows = (
            ("ballistic deflection", "change of the heading shown while course or speed change", last, closed[0]),
            ("ballistic error", "error at the end of the manoeuvre less the settled one after it", now, closed[1]),
        )
        for name, meaning, rest, form in rows:  # u: noise, wander by drift, what is left of the swing before
            u = math.hypot(u_start, rest.u_settled, last.left, last.wander)
            found.note(name + key, meaning, "°", wrap(start - rest.settled), u, form, swings)

    def _warn(self) -> None:
        """Say where the formulas of small angles do not hold."""
        found, own = self.found, self.own
        if abs(self.offset) > LARGE:
            text = (
                f"The axis starts {plain(abs(self.offset) / DEG, 3)}° off: beyond {plain(LARGE / DEG, 3)}° it does not "
                "swing as a linear system. Period, damping ratio and settled error are of its swings below "
                f"{plain(SMALL / DEG, 3)}°."
            )
            found.warn("compass.large_angle", text)
        latitude = max(abs(float(g["ship.latitude_now"].max())) for g in found.gates)
        if latitude > POLAR:
            text = (
                f"At {plain(latitude / DEG, 3)}° of latitude the horizontal Earth rate is {plain(math.cos(latitude))} "
                "of that at the equator: effects of drift, speed error and latitude error grow with its reciprocal."
            )
            found.warn("compass.polar", text)
        if own is not None:
            rolled = abs(found.estimates.get("rolling error", 0.0)) * DEG
            worst = max(rolled, *(abs(own.settled(steaming(g))[0]) for g in found.gates))
            if worst > STRONG:
                text = (
                    f"The axis settles up to {plain(worst / DEG, 3)}° off the meridian: the closed forms, of small "
                    "angles, miss by more than 1 % there."
                )
                found.warn("compass.off_meridian", text)
                text = f"The axis settles {plain(worst / DEG, 3)}° off the meridian, beyond small angles."
                found.doubt("compass.small_angles", text)
        if found.unsettled:
            text = f"The compass has {found.unsettled}: errors that follow have no value. Give settle more time."
            found.warn("compass.unsettled", text)

    def _figures(self) -> None:
        """Draw the heading error of each phase against time, with what is computed beside it."""
        for gate in self.found.gates:
            if gate.label in ("slew", "damped again"):
                continue
            t, y = means(gate, np.unwrap(error(gate)), max(1, gate.t.size // SHOWN))
            unit, scale = ("h", 3600.0) if t[-1] - t[0] > 7200.0 else ("s", 1.0)
            x, way = self._computed(gate, float(t[-1]))
            label = "computed" if x.size > 2 else "at rest, computed"
            curves = [line(label, (x - gate.t[0]) / scale, way / DEG)] if x.size else []
            caption = f"Heading shown less the true one, phase {gate.label}."
            shown = ((t - gate.t[0]) / scale).tolist()
            self.found.responses.append(
                Response(gate.label, "step", caption, shown, "time", unit, (y / DEG).tolist(), "error", "°",
                         curves=curves)
            )  # fmt: skip

    def _computed(self, gate: Gate, end: float) -> tuple[Array, Array]:
        """Return time and computed error of a phase: of a manoeuvre its way, else the level; () where there is none."""
        own, at, none = self.own, steaming(gate), (np.zeros(0), np.zeros(0))
        if own is None or gate.label == "undamped":
            return none
        if gate.label in ("change of speed", "turn"):
            return self._modelled(gate, own)
        level = own.settled_error(at)
        if gate.label == "rolling":
            level += self._rolled(at) or math.nan
        return (np.array([gate.t[0], end]), np.full(2, level)) if math.isfinite(level) else none


def _settled_after(t: Array, z: Array, start: float, fitted: Oscillation, band: float) -> tuple[float, float]:
    """Return the time from the start until the means z stay within a band of the settled error, s, and its u."""
    outside = np.flatnonzero(np.abs(z - fitted.settled) > band)
    if not outside.size:
        return 0.0, float(t[1] - t[0]) / math.sqrt(12.0)
    k = int(outside[-1])
    side = band if z[k] > fitted.settled else -band
    slope = (z[k + 1] - z[k]) / (t[k + 1] - t[k])
    time = float(t[k] + (fitted.settled + side - z[k]) / slope - start)
    near = z[max(k - 1, 0) : k + 3]
    bend = float(np.max(np.abs(np.diff(near, 2)))) / 8.0 / math.sqrt(3.0) if near.size > 2 else 0.0
    off = math.hypot(fitted.noise, fitted.wander, fitted.u_settled, bend)
    # of a swing about as large as the band noise says whether it counts: the time is then that of one swing or two
    early, late = (np.flatnonzero(np.abs(z - fitted.settled) > max(band + d * off, 0.0)) for d in (3.0, -3.0))
    apart = float(t[late[-1]] - (t[early[-1]] if early.size else start))
    quarter = 0.5 * math.pi / fitted.omega  # of a period
    return time, 0.5 * apart if apart > quarter else float(off / abs(slope))


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


def _edge(gate: Gate) -> tuple[float, float]:
    """Return the heading error at the beginning of a phase, of a parabola through its first four minutes, and its u."""
    n = min(gate.t.size, 1 + round(240.0 / float(gate.t[1] - gate.t[0])))
    y, x = np.unwrap(error(gate))[:n], np.linspace(0.0, 1.0, n)
    columns = np.column_stack([np.ones(n), x, x * x])
    beta, *_ = np.linalg.lstsq(columns, y, rcond=None)
    rest = y - columns @ beta
    s2 = float(rest @ rest) / (n - 3)
    return float(beta[0]), math.sqrt(s2 * float(np.linalg.inv(columns.T @ columns)[0, 0]))
