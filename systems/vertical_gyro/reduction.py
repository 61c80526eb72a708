"""Reduction of vertical_gyro: the vertical that the gyro shows against the true one, phase by phase."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from gyrobench.record.record import Record
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.loops.loop_toolkit import ARCMIN, DEG, Account, Array, Gate, LoopReduction, Table, trace
from gyrobench.units import G0

SHOWN, MARKED = 1500, 60  # points of a drawn line, and of its marks
FITTED = 20  # readings at least from which a settled tilt is taken
SETTLED = "tilt at rest that the erection settles to"
ANGLES = ("motion.angle[1]", "motion.angle[2]", "gyro.pitch", "gyro.roll")


def up(pitch: Array, roll: Array) -> Array:
    """Return the vertical in vehicle axes (n, 3) for a pitch and a roll: third column of R2(roll) R1(pitch)."""
    c = np.cos(pitch)
    return np.column_stack([-np.sin(roll) * c, np.sin(pitch), np.cos(roll) * c])


def lean(pitch: Array, roll: Array, shown_pitch: Array, shown_roll: Array, inner: Array | float = 0.0) -> Array:
    """Return the lean of the shown vertical to the right and forward (n, 2), rad, level axes along the heading.

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
    """Return the time (s) from ``tilt`` to ``zone`` without drift; linear: with ``rate`` down to rate/gain, from there
    exponentially.
    """
    if tilt <= zone or zone <= 0.0:
        return None
    if law == "switches":
        return (tilt - zone) / rate
    bend = max(zone, min(tilt, rate / gain))
    return (tilt - bend) / rate + math.log(bend / zone) / gain


class Reduction(LoopReduction):
    """Pitch and roll of the gyro against those of the vehicle, in erection, rest and manoeuvre."""

    said = (
        "Erected to the dead zone in {t_zone}; at rest it then hangs off by {hang-off}.",
        "The acceleration leaned the rotor by {lean}.",
        "After the erection the rotor was never more than {max} from the vertical, and what pitch and roll show "
        "never more than {shown max}.",
    )
    ranked_by = "max"
    linearized = False

    def __init__(self, record: Record) -> None:
        super().__init__(record)
        o = self.run.options
        self.rate, self.zone, self.gain = (float(o[n]) for n in ("rate", "dead_zone", "gain"))
        self.linear = o["law"] == "linear"
        #: standard uncertainty of an angle, rad: what the erection moves the rotor in one step, rectangular
        self.u = self.rate * self.run.step / math.sqrt(3.0)

    def measure(self) -> Account:
        found, c, u = self.found, self.record.channels, self.u
        phases = {
            "erection": self._erection, "rest": self._rest, "acceleration": self._acceleration, "turn": self._turn,
            "loop": self._loop, "roll": self._roll,
        }  # fmt: skip
        for gate in found.gates:
            phases[gate.label](gate)
        tilt, shown = (np.hypot(*_lean(c, s).T) for s in (False, True))
        first = max((g.inside.stop for g in found.gates if g.label == "erection"), default=0)  # row after the erection
        tilt_after, shown_after = (float(x[first:].max(initial=0.0)) for x in (tilt, shown))
        found.measure("max", "largest tilt of the rotor after the erection", "arcmin", tilt_after, u, scale=ARCMIN)
        meaning = "largest error of the shown vertical after the erection: tilt, and lag of the ring"
        found.measure("shown max", meaning, "arcmin", shown_after, u, scale=ARCMIN)
        self._figures(c["time"], tilt, shown, first)
        found.tables.append(self._phases())
        return Account(
            method="Pitch and roll of the gyro against those of the vehicle, in erection, rest and manoeuvre",
            sources=["VERTICAL-GYRO; GSP ch. 5, section 5.3.1 (text only)"],
            equation="dot(bold(n)) = bold(T)\\/H + bold(d) - bold(omega) times bold(n), quad "
            "T_x = -f(e_y), quad T_y = f(e_x)",
            conventions=[
                "Tilt: angle between the rotor axis and the true vertical. Lean: its components to the right and "
                "forward.",
                "The closed figures are those without Earth rate and drift, but where they say so.",
                "u: what the period of the record leaves of a time, and a step of the erection of an angle.",
            ],
        )

    def _figures(self, t: Array, tilt: Array, shown: Array, first: int) -> None:
        when = f"from {plain(t[first], 4)} s on, after the erection" if 0 < first < t.size else "over the whole run"
        axis = "Angle between the rotor axis and the true vertical"
        drawn = [("erection", "tilt", slice(first + 1), tilt, f"{axis} while it is erected.")] if first else []
        if first < t.size:
            late = slice(first, None)
            drawn.append(("tilt", "tilt", late, tilt, f"{axis}, {when}."))
            caption = "Angle between the vertical that pitch and roll show and the true one"
            caption = f"{caption}, {when}: the tilt, and the lag of the ring."
            drawn.append(("error", "error of the shown vertical", late, shown, caption))
        for name, what, rows, angle, caption in drawn:
            y = angle[rows] / ARCMIN
            lines = {"as recorded": y}
            self.found.responses.append(trace(name, caption, t[rows], y, what, "arcmin", lines, SHOWN, MARKED))

    def _erection(self, gate: Gate) -> None:
        found, o, zone = self.found, self.run.options, self.zone
        tilt = np.maximum(np.abs(gate["gyro.e_x"]), np.abs(gate["gyro.e_y"]))
        outside = np.flatnonzero(tilt > 1.02 * zone)  # the switches chatter at the edge of their zone
        t = gate.t - gate.t[0]
        k = int(outside[-1]) if outside.size else -1
        inside = None if k == t.size - 1 else (0.0 if k < 0 else float(t[k + 1]))
        closed = None
        if not o["fast_time"]:
            closed = erection_time(float(o["tilt"]), 1.02 * zone, str(o["law"]), self.rate, self.gain)
        meaning = "time from the tilt at the start to the dead zone, both axes"
        found.measure("t_zone", meaning, "s", inside, float(t[1] - t[0]) / math.sqrt(12.0), closed=closed)
        if inside is None:
            text = (
                f"The rotor did not reach the dead zone in {plain(t[-1], 4)} s: at its end it leans by "
                f"{plain(tilt[-1] / ARCMIN, 4)} arcmin."
            )
            found.warn("erection.not_erected", text)

    def _rest(self, gate: Gate) -> None:
        """Measure the tilt at rest: of switches the mean of the second half, chattering in the dead zone; of the linear
        law what it settles to, A + (B + C t) exp(-gain t) of either lean: the rest of the erection decays by the gain,
        which step and Earth rate change a little (C), once the law is not at its largest rate.
        """
        leans, o = _of(gate), self.run.options
        if not self.linear:
            half = np.hypot(*leans.T)[len(leans) // 2 :]
            u, meaning = float(np.std(half)) / math.sqrt(8.0), "mean tilt at rest, second half"
            self.found.measure("hang-off", meaning, "arcmin", float(half.mean()), u, scale=ARCMIN)
            return
        limited = np.flatnonzero(np.abs(leans).max(axis=1) > self.rate / self.gain)
        free = int(limited[-1]) + 1 if limited.size else 0
        if free > len(leans) - FITTED:
            end = plain(gate.t[min(free, len(leans) - 1)], 4)
            why = f"the law is at its largest rate up to {end} s: take a longer time"
            self.found.measure("hang-off", SETTLED, "arcmin", None, scale=ARCMIN, unsettled=why)
            return
        t, leans = gate.t[free:] - gate.t[free], leans[free:]
        decay = np.exp(-self.gain * t)
        X = np.column_stack([np.ones_like(t), decay, t * decay])
        settled, *_ = np.linalg.lstsq(X, leans, rcond=None)
        size, left = float(np.hypot(*settled[0])), float(np.std(leans - X @ settled))
        left *= math.sqrt(
            t.size * float(np.linalg.pinv(X.T @ X)[0, 0])
        )  # what is left changes slowly: it does not average
        earth, step = float(o["earth_rate"]) / self.gain, self.gain * self.run.step
        neglected = (size**2 + earth**2) / 2.0 + step**2  # second order; at rest a step moves nothing in first order
        u = math.hypot(size * neglected / math.sqrt(3.0), left)
        closed = earth * math.cos(float(o["latitude"]))
        self.found.measure("hang-off", SETTLED, "arcmin", size, u, scale=ARCMIN, closed=closed)

    def _acceleration(self, gate: Gate) -> None:
        rows, o, c = _through(gate), self.run.options, gate.channels
        forward = _lean({n: c[n][rows] for n in (*ANGLES, "gyro.inner")})[:, 1]
        time = float(c["time"][rows][-1] - c["time"][rows][0])
        apparent, closed = math.atan(float(o["acceleration"]) / G0), 0.0
        if not o["cut_off"]:
            end = apparent * (1.0 - math.exp(-self.gain * time)) if self.linear else apparent - self.zone
            closed = min(self.rate * time, end)
        meaning = "lean forward through the acceleration (closed: without Earth rate)"
        self.found.measure("lean", meaning, "°", float(forward[-1] - forward[0]), math.sqrt(2.0) * self.u, scale=DEG,
                           closed=closed)  # fmt: skip

    def _turn(self, gate: Gate) -> None:
        largest = float(np.hypot(*_of(gate).T).max())
        self.found.measure("turn", "largest tilt in the turn", "arcmin", largest, self.u, scale=ARCMIN)

    def _loop(self, gate: Gate) -> None:
        found, rows, c = self.found, _through(gate), gate.channels
        largest = float(np.hypot(*_of(gate, shown=True).T).max())
        found.measure("loop", "largest error of the shown vertical in the loop", "arcmin", largest, self.u,
                      scale=ARCMIN)  # fmt: skip
        pitch, roll = c["motion.angle[1]"][rows], c["motion.angle[2]"][rows]
        true = _turned(np.arctan2(np.sin(pitch), np.cos(pitch) * np.cos(roll)))  # counted on beyond 90 deg
        found.measure("pitch", "pitch shown through the loop (closed: of the vehicle)", "°",
                      _turned(c["gyro.pitch"][rows]), math.sqrt(2.0) * self.u, scale=DEG, closed=true)  # fmt: skip
        ring = np.unwrap(gate["gyro.ring_angle"])
        u = math.hypot(self.u, _between(ring, int(ring.argmax())), _between(ring, int(ring.argmin())))
        found.measure("ring", "travel of the ring in the loop", "°", float(np.ptp(ring)), u, scale=DEG)

    def _roll(self, gate: Gate) -> None:
        found, rows, c = self.found, _through(gate), gate.channels
        lag = 60.0 / float(self.run.parameters.get("gyro.k_ring", math.inf))
        found.measure("roll", "roll shown at the end of the roll (closed: of the vehicle, less the lag of the ring)",
                      "°", _turned(c["gyro.roll"][rows]) / DEG, math.sqrt(2.0) * self.u / DEG,
                      closed=_turned(c["motion.angle[2]"][rows]) / DEG - lag)  # fmt: skip
        largest = float(np.abs(gate["gyro.inner"]).max()) / DEG
        found.measure("g2", "largest angle left to the ring's servo in the roll", "°", largest, self.u / DEG,
                      closed=lag)  # fmt: skip

    def _phases(self) -> Table:
        rows = []
        for gate in self.found.gates:
            tilt = np.hypot(*_of(gate).T) / ARCMIN
            cut = float(np.mean(gate["erection.cut"] > 0.0)) if "erection.cut" in gate.channels else None
            rows.append([gate.label, float(gate.t[-1] - gate.t[0]), tilt[0], tilt[-1], tilt.max(), cut])
        caption = "Cut off: share of the phase in which a channel of the erection was open."
        tilts = ["tilt at its start / arcmin", "at its end / arcmin", "largest / arcmin"]
        return Table("phases", "Tilt by phase", caption, ["phase", "length / s", *tilts, "cut off"], rows)


def _lean(channels: Mapping[str, Array], shown: bool = False) -> Array:
    """Return the lean of the rotor, or of the vertical that is shown."""
    pitch, roll, shown_pitch, shown_roll = (channels[n] for n in ANGLES)
    return lean(pitch, roll, shown_pitch, shown_roll, 0.0 if shown else channels["gyro.inner"])


def _of(gate: Gate, shown: bool = False) -> Array:
    return _lean({n: gate[n] for n in (*ANGLES, "gyro.inner")}, shown)


def _through(gate: Gate) -> slice:
    """Return the rows from the last one before the gate opened, when the vehicle rested, to the last one in it."""
    return slice(max(gate.inside.start - 1, 0), gate.inside.stop)


def _turned(angle: Array) -> float:
    """Return what an angle that is counted within a turn went through, rad."""
    way = np.unwrap(angle)
    return float(way[-1] - way[0])


def _between(y: Array, k: int) -> float:
    """Return the standard uncertainty of an extreme at reading k: a parabola through it and its neighbours rises above
    it by an eighth of their second difference at most.
    """
    near = y[max(k - 1, 0) : k + 2]
    return float(abs(np.diff(near, 2)[0])) / 8.0 / math.sqrt(3.0) if near.size == 3 else 0.0
