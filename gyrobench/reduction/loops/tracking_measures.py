"""What tests of tracking loops measure: error, lag, error constants, share inside an accuracy, steps, a lost target.

Channels of slots tracker, track_pitch and track_yaw, whose loops are "track pitch" and "track yaw".  [TRACK-LOOP]
"""

from __future__ import annotations

import math

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.sentences import plain, told
from gyrobench.reduction.loops.loop_curves import over_time
from gyrobench.reduction.loops.loop_measures import Gate
from gyrobench.reduction.loops.loop_reduction import LoopReduction
from gyrobench.reduction.loops.tracking_error import TrackingError, error_coefficients, lag
from gyrobench.result import Reason

TRACKER = ("exposure", "processing", "order")
SIGHT = {"pitch": 1, "yaw": 3}  # elements of the exciter
MISS = ("tracker.miss[1]", "tracker.miss[2]")
RATE = ("tracker.rate[1]", "tracker.rate[2]")
MICRO = 1e-6
FULL = 100.0  # %
LIFTED = 2.0  # rms of the noise: by so much it lifts a peak
NEAR = 0.1  # periods of the crossover about a time
UNSURE = 0.25  # of a settling time, its u: more says nothing
NOTHING = 1e-3  # of a period of the crossover over 2 pi: a c1 below is 0
LEAST = 5.0  # u of an error by a motion: less is not measured
STANDS_OUT = 10.0  # rms of the noise, or more: a step that stands above it
MEASURED = ("f_c", "PM", "GM", "GRM")


class TrackingMeasures(LoopReduction):
    """Measures of tracking loops, see the module.  track: their crossover, Hz."""

    @property
    def track(self) -> float:
        """Return the crossover that was asked for, Hz."""
        return float(self.run.options["track"])

    def ride(self) -> Gate | None:
        """Return the ride, in which the target moves; None where it is not whole in the record."""
        return next((g for g in self.found.of("hold") if g.label == "ride"), None)

    def loops(self) -> None:
        """Measure the tracking loops and the steps of the wanted direction."""
        held, late = self.held()
        for axis, k in SIGHT.items():
            self.found.open_loop(
                f"track {axis}", f"track_{axis}.e", f"exciter.command[{k}]", k, kind="command", held=held, late=late
            )
        for gate in self.found.of("command", shape="step"):
            self.acquire(gate)

    def held(self) -> tuple[dict[str, float], float]:
        """Return when the first error of the tracker is there, and by how much the steps take from its delay, s.

        The linear model holds an error for half a period; in steps of h, from one to the next, the loop has h/2 less of
        it.  A prediction makes the error continuous.
        """
        p, h = self.run.parameters, self.run.step
        exposure, processing, order = (float(p.get(f"tracker.{n}") or 0.0) for n in TRACKER)
        return ({}, 0.0) if order else ({"tracker": max(exposure, h) + processing}, 0.5 * h)

    def inside(self) -> list[str]:
        """Return for which share of the time the error is inside the accuracy."""
        found = {c.name: c for c in self.found.coefficients}
        if "inside" not in found:
            return []
        low, high = found["inside"].interval
        if high == FULL:
            return [f"It is inside the wanted accuracy for {plain(low, 3)} % of the time or more (95 %)."]
        if low == 0.0:
            return [f"It is inside the wanted accuracy for {plain(high)} % of the time or less (95 %)."]
        return told(self.found.coefficients, "It is inside the wanted accuracy for {inside} of the time.")

    def acquire(self, gate: Gate) -> None:
        """Measure a step of the wanted direction, where it stands above the noise."""
        found = self.found
        k = 0 if gate.axis == 1 else 1
        axis = tuple(SIGHT)[k]
        step = found.step(gate, MISS[k], scale=MICRO, unit="µrad", y_name=f"tracking error, {axis}")
        none = ""
        noise = float(np.std(gate.rest(MISS[k])))
        if noise * STANDS_OUT > abs(step.change):
            none = f"the step is less than {STANDS_OUT:g} times its noise"
        size = abs(step.change) or math.inf
        u = math.hypot(step.u_change, LIFTED * noise)
        found.measure(f"overshoot {axis}", "of a step of the wanted direction", "%", 100.0 * step.overshoot,
                      100.0 * u / size, no_value=none)  # fmt: skip
        at = step.settled_5
        none = none or ("" if at is not None else "within 5 % it does not settle in the step")
        u_t = None if at is None else math.hypot(step.u_settled, self._crossing(gate, k, at))
        if at is not None and u_t is not None and u_t > UNSURE * at:
            none = none or f"noise moves the time at which it comes within 5 % by {plain(u_t)} s (rms)"
        found.measure(f"t_5 {axis}", "settling of that step within 5 %", "s", at, u_t, no_value=none)

    def _crossing(self, gate: Gate, k: int, at: float) -> float:
        """Return by how much noise moves the time at which an error comes into its band: noise over slope, s."""
        t, half = gate.t - gate.t[0], NEAR / self.track
        near = np.abs(t - at) < half
        slope = float(np.polyfit(t[near], gate[MISS[k]][near], 1)[0]) if np.count_nonzero(near) > 2 else 0.0
        noise = float(np.std(gate.rest(MISS[k])))
        return min(noise / abs(slope), float(t[-1])) if slope else float(t[-1])

    # ------------------------------------------------------------------ ride
    def error(self, gate: Gate) -> None:
        """Measure the error of the ride: mean, rms, peak, share inside the accuracy, lag against its closed form."""
        found, wanted = self.found, self.run.options.get("accuracy")
        e = np.array([gate[n] for n in MISS])
        lags = [self._lag(gate, axis, k) for k, axis in enumerate(SIGHT)]
        error = TrackingError(e, np.array([np.zeros(gate.t.size) if x is None else x for x in lags]))
        for k, axis in enumerate(SIGHT):
            closed = None if lags[k] is None else float(error.lag[k].mean())
            found.add(f"bias {axis}", f"mean of the tracking error about {axis}", "µrad", error.mean(k), scale=MICRO,
                      closed=closed)  # fmt: skip
        for k, axis in enumerate(SIGHT):
            found.add(f"error {axis}", f"tracking error about {axis}, rms", "µrad", error.rms(k), scale=MICRO)
        found.add("error", "tracking error, rms, root of the sum of squares", "µrad", error.rms(), scale=MICRO)
        found.measure("peak", "largest tracking error in the ride, both axes", "µrad", error.peak, scale=MICRO)
        if wanted is not None:
            share, u, interval = error.inside(float(wanted))
            meaning = f"time with an error below {float(wanted) / MICRO:g} µrad, both axes"
            found.measure("inside", meaning, "%", share, u, interval=interval)
        for k, axis in enumerate(SIGHT):
            self._constant(axis, error, k)
        lines = {axis: error.e[k] / MICRO for k, axis in enumerate(SIGHT)}
        lines |= {f"{axis}, lag": error.lag[k] / MICRO for k, axis in enumerate(SIGHT) if np.any(error.lag[k])}
        caption = "True tracking error in the ride, and the lag that the linear model makes of the target's motion."
        found.responses.append(over_time("tracking error", gate.t - gate.t[0], lines, unit="µrad", caption=caption))

    def _lag(self, gate: Gate, axis: str, k: int) -> Array | None:
        """Return the lag in the gate by the linear model, from rest at the start of the phase on."""
        pair = self.found.linear.loops.get(f"track {axis}")
        if pair is None or pair.discrete is None:
            return None
        channels = gate.channels
        first = int(np.argmax(channels["exciter.phase"] == gate.row.phase))
        span = slice(first, gate.inside.stop)
        t = channels["time"][span]
        made = lag(pair.discrete, self.track, t - t[0], channels[RATE[k]][span])
        return made[gate.inside.start - first :]

    def _constant(self, axis: str, error: TrackingError, k: int) -> None:
        """Measure the error constant of a loop's type, that of the linear model over the share of its lag."""
        pair = self.found.linear.loops.get(f"track {axis}")
        share = error.share(k)
        if share is None or pair is None or pair.discrete is None:
            return
        c1, c2 = error_coefficients(pair.discrete, self.track)
        second = abs(c1) * 2.0 * math.pi * self.track < NOTHING
        name, unit, what, c = ("K_a", "1/s2", "acceleration", c2) if second else ("K_v", "1/s", "rate", c1)
        meaning = f"{what} of a slow target over the error it makes about {axis}"
        if abs(share.value) < LEAST * share.u:
            none = f"the error by the {what} of the target does not stand above the noise"
            self.found.measure(f"{name} {axis}", meaning, unit, None, no_value=none)
            return
        value, u = 1.0 / (c * share.value), share.u / (abs(c) * share.value**2)
        self.found.measure(f"{name} {axis}", meaning, unit, value, u, dof=share.dof, closed=1.0 / c)

    def lost(self) -> None:
        """Say where the target was lost, and where it is wider than the field that a limit was reached."""
        found = self.found
        lost = [g for g in found.gates if np.any(g["tracker.lost"] > 0.5)]
        if lost:
            share = {g.label: 100.0 * float(np.mean(g["tracker.lost"] > 0.5)) for g in lost}
            where = ", ".join(f"{label} ({plain(s)} % of it)" for label, s in share.items())
            text = (
                f"The target was lost in: {where}. The loop was open then, and the line of sight went on with the rate "
                "it had: errors, margins and the budget of these phases are not those of a tracker that sees."
            )
            names = tuple(c.name for c in found.coefficients if "ride" in share or c.name.startswith(MEASURED))
            found.reasons.append(Reason("target.lost", text, ("pass",), names))
