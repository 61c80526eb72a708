"""Record of a tracking gimbal -> tracking error with its lag, jitter by source, margins of all loops."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.record.run_document import LinearModel
from gyrobench.reduction.loops.jitter import Complex, segments
from gyrobench.reduction.loops.loop_toolkit import Account, Gate, Reason, margins, over_time, told
from gyrobench.reduction.loops.margins import excitation_response
from gyrobench.reduction.loops.sight_budget import EXCITED, LOS, MoreSources, Ride, closed_model
from gyrobench.reduction.loops.sight_reduction import AXES, MICRO, SightReduction

from .tracking_error import TrackingError, error_coefficients, lag

MISS = ("tracker.miss[1]", "tracker.miss[2]")
RATE = ("tracker.rate[1]", "tracker.rate[2]")
PAIR = (0, 1)
NEAR = 0.1  # periods of the crossover about a time
LIFTED = 2.0  # rms of the noise: by so much it lifts a peak
LEAST = 5.0  # u of an error by a motion: less is not measured
MEASURED = ("f_c", "PM", "GM", "GRM")
STANDS_OUT = 10.0  # u of the change, or more: a step that stands above the noise
TARGET = "motion of the target"


class Reduction(SightReduction):
    """Tracking error, lag and jitter of a line of sight that follows a target; its loops."""

    ranked_by = "error"
    sight = MISS
    what = "tracking error"

    def measure(self) -> Account:
        found = self.found
        for gate in found.of("torque", shape="step"):
            self.load(gate)
        for axis, k in AXES.items():
            found.open_loop(axis, f"{axis}.e", f"exciter.test[{k}]", k)
        for axis, k in AXES.items():
            name = f"track {axis}"
            found.open_loop(name, f"track_{axis}.e", f"exciter.command[{k}]", k, kind="command")
        for gate in found.of("command", shape="step"):
            self._acquire(gate)
        self.isolation()
        self.cause, ride = "", self.ride()
        self.gate = ride  # for the sources of the budget
        if ride is not None:
            self._error(ride)
            self.cause = self.jitter(ride)
            self._lost()
        self.keyhole()
        return Account(
            method="Load steps, test sines of rate and tracking loops, steps of the wanted direction, sines of the "
            "base and a ride in which the target moves and the base vibrates",
            sources=["TRACK-LOOP, TRACK-IMAGE, LOS-TARGET, GIMBAL-2AXIS, LOS-JITTER, BASE-PSD; Masten 2008; "
                     "Hilkert 2008; Franklin 2010; Welch 1967"],
            equation="e = c_1 omega_t + c_2 dot(omega)_t, quad 1/(1 + L) = c_1 s + c_2 s^2 + ..., quad "
            "S_e = sum_i abs(T_i (j omega))^2 S_i",
            conventions=[
                "The tracking error is the true direction of the target less that of the line of sight, about x (pitch)"
                " and z (yaw) of the inner gimbal.",
                "Its lag is what the linear model makes of the target's rate and acceleration; bias is its mean.",
                "Jitter is the root mean square of the error from the stated frequency on.",
                "L is the loop opened at the input of a controller: what comes back over what is put in, with minus.",
            ],
        )  # fmt: skip

    def summary(self) -> list[str]:
        found = self.found
        return [
            *told(found.coefficients, "The tracking error is {error} rms, both axes, {peak} at most; it is inside the "
                  "wanted accuracy for {inside} of the time."),
            *told(found.coefficients, "Its mean is {bias pitch} about pitch and {bias yaw} about yaw."),
            *told(found.coefficients, f"From the stated frequency on it is {{jitter}} rms{self.cause}."),
            *margins(found, *AXES, *(f"track {a}" for a in AXES)),
        ]  # fmt: skip

    def _acquire(self, gate: Gate) -> None:
        """Measure a step of the wanted direction, where it stands above the noise."""
        found = self.found
        k = 0 if gate.axis == 1 else 1
        axis = tuple(AXES)[k]
        step = found.step(gate, MISS[k], scale=MICRO, unit="µrad", y_name=f"tracking error, {axis}", quiet=self.ride())
        none = ""
        if step.u_change * STANDS_OUT > abs(step.change):
            none = f"the step is less than {STANDS_OUT:g} times its noise"
        size = abs(step.change) or math.inf
        noise = float(np.std(gate.rest(MISS[k])))
        u = math.hypot(step.u_change, LIFTED * noise)
        found.measure(f"overshoot {axis}", "of a step of the wanted direction", "%", 100.0 * step.overshoot,
                      100.0 * u / size, no_value=none)  # fmt: skip
        at = step.settled_5
        none = none or ("" if at is not None else "within 5 % it does not settle in the step")
        u_t = None if at is None else math.hypot(step.u_settled, self._crossing(gate, k, at))
        found.measure(f"t_5 {axis}", "settling of that step within 5 %", "s", at, u_t, no_value=none)

    def _crossing(self, gate: Gate, k: int, at: float) -> float:
        """Return by how much noise moves the time at which an error comes into its band: noise over slope, s."""
        t, half = gate.t - gate.t[0], NEAR / float(self.run.options["track"])
        near = np.abs(t - at) < half
        slope = float(np.polyfit(t[near], gate[MISS[k]][near], 1)[0]) if np.count_nonzero(near) > 2 else 0.0
        noise = float(np.std(gate.rest(MISS[k])))
        return min(noise / abs(slope), float(t[-1])) if slope else float(t[-1])

    # ------------------------------------------------------------------ ride
    def _error(self, gate: Gate) -> None:
        """Measure the error of the ride: mean, rms, peak, share inside the accuracy, lag against its closed form."""
        found, wanted = self.found, float(self.run.options["accuracy"])
        e = np.array([gate[n] for n in MISS])
        lags = [self._lag(gate, axis, k) for k, axis in enumerate(AXES)]
        error = TrackingError(e, np.array([np.zeros(gate.t.size) if x is None else x for x in lags]))
        for k, axis in enumerate(AXES):
            closed = None if lags[k] is None else float(error.lag[k].mean())
            found.add(f"bias {axis}", f"mean of the tracking error about {axis}", "µrad", error.mean(k), scale=MICRO,
                      closed=closed)  # fmt: skip
        for k, axis in enumerate(AXES):
            found.add(f"error {axis}", f"tracking error about {axis}, rms", "µrad", error.rms(k), scale=MICRO)
        found.add("error", "tracking error, rms, root of the sum of squares", "µrad", error.rms(), scale=MICRO)
        found.measure("peak", "largest tracking error in the ride, both axes", "µrad", error.peak, scale=MICRO)
        share, u, interval = error.inside(wanted)
        meaning = f"time with an error below {wanted / MICRO:g} µrad, both axes"
        found.measure("inside", meaning, "%", share, u, interval=interval)
        for k, axis in enumerate(AXES):
            self._constant(axis, error, k)
        lines = {axis: error.e[k] / MICRO for k, axis in enumerate(AXES)}
        lines |= {f"{axis}, lag": error.lag[k] / MICRO for k, axis in enumerate(AXES) if np.any(error.lag[k])}
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
        made = lag(pair.discrete, float(self.run.options["track"]), t - t[0], channels[RATE[k]][span])
        return made[gate.inside.start - first :]

    def _constant(self, axis: str, error: TrackingError, k: int) -> None:
        """Measure the error constant of a loop's type, that of the linear model over the share of its lag."""
        pair = self.found.linear.loops.get(f"track {axis}")
        share = error.share(k)
        if share is None or pair is None or pair.discrete is None:
            return
        c1, c2 = error_coefficients(pair.discrete, float(self.run.options["track"]))
        second = float(np.max(np.asarray(self.run.parameters.get(f"track_{axis}.integral", 0.0)))) > 0.0
        name, unit, what, c = ("K_a", "1/s2", "acceleration", c2) if second else ("K_v", "1/s", "rate", c1)
        meaning = f"{what} of a slow target over the error it makes about {axis}"
        if abs(share.value) < LEAST * share.u:
            none = f"the error by the {what} of the target does not stand above the noise"
            self.found.measure(f"{name} {axis}", meaning, unit, None, no_value=none)
            return
        value, u = 1.0 / (c * share.value), share.u / (abs(c) * share.value**2)
        self.found.measure(f"{name} {axis}", meaning, unit, value, u, dof=share.dof, closed=1.0 / c)

    def more_sources(self, ride: Ride, use: NDArray[np.bool_]) -> MoreSources | None:
        """Return the motion of the target and the noise of the images."""
        model = closed_model(self.found)
        f = ride.los[0].f[use]
        inside = self._ways(model, [f"track_{axis}.e" for axis in AXES], f)
        sight = self._ways(model, LOS, f)
        lowest = float(self.run.options["jitter_from"])
        assert self.gate is not None
        dt = float(self.gate.t[1] - self.gate.t[0])
        moved = np.zeros((), complex)
        for k in PAIR:
            rate = segments(dt, self.gate[RATE[k]], lowest)
            assert rate is not None
            way = inside[:, :, k] / (2j * np.pi * f[:, None])
            moved = moved - way.T[:, None, :] * rate[None, :, use]  # of the line of sight: the error with minus
        return MoreSources({TARGET: moved}, self._images(sight, f))

    @staticmethod
    def _ways(model: LinearModel, names: Sequence[str], f: Array) -> Complex:
        """Return (frequency, name, axis) of the responses to what is added to the error of the image."""
        rows = [[excitation_response(model, "command", k, name, f) for k in EXCITED] for name in names]
        return np.asarray(np.moveaxis(np.array(rows), 2, 0))

    def _images(self, sight: Complex, f: Array) -> dict[str, Array]:
        """Return the densities by noise and resolution of the images, held from frame to frame."""
        p = self.run.parameters
        period, noise, pixel = (float(p.get(f"tracker.{n}", 0.0)) for n in ("period", "image_noise", "pixel"))
        shape = np.sum(np.abs(sight) ** 2, axis=2).T * 2.0 * period * np.sinc(f * period) ** 2
        found = {"noise of the images": shape * noise**2}
        if noise > 0.3 * pixel > 0.0:  # the remainders are uniform, and independent of each other
            found["resolution of the images"] = shape * pixel**2 / 12.0
        return {name: y for name, y in found.items() if np.any(y)}

    def _lost(self) -> None:
        """Say where the target was lost, and where it is wider than the field that a limit was reached."""
        found = self.found
        lost = [g for g in found.gates if np.any(g["tracker.lost"] > 0.5)]
        if lost:
            share = {g.label: 100.0 * float(np.mean(g["tracker.lost"] > 0.5)) for g in lost}
            where = ", ".join(f"{label} ({s:.2g} % of it)" for label, s in share.items())
            text = (
                f"The target was lost in: {where}. The loop was open then, and the line of sight went on with the rate "
                "it had: errors, margins and the budget of these phases are not those of a tracker that sees."
            )
            names = tuple(c.name for c in found.coefficients if "ride" in share or c.name.startswith(MEASURED))
            found.reasons.append(Reason("target.lost", text, ("pass",), names))
