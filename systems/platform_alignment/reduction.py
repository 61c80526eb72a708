"""Reduction of an alignment: heading with interval against time, tilt, time to be ready, budget of the heading.

Heading and its standard deviation are those of the controller; what they are worth is held against the true attitude
of a simulated run, against the error model of :mod:`plans`, and against the tilt that the accelerometers show.
[ALIGN-GYRO]

Not modelled: what a wrong statement of the sensors' errors does to the interval beyond those two checks.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from gyrobench import units
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.loops.loop_toolkit import ARCMIN, Account, MeasureReduction, told
from gyrobench.reduction.setup.run_metadata import Location

from . import planning, plans, shown
from .record import Alignment, AlignmentColumns

AT_LIMIT = 0.1  # share of the second half of the gyrocompass with a limit active
RESTLESS = 2.0  # rms of the tilt as measured over the one expected, beyond which the platform moves more than is stated
DOUBT = 4.0  # standard deviations by which a simulated heading may be off before the run says so
SETTLING = 0.5  # largest departure of the controller's standard deviation from that of the error model
WRONG_RATES = (
    "unsettled: the rates that the loops have found contradict the Earth rate of this latitude and the stated drift; "
    "latitude, drift, torquer or an axis is wrong"
)


class Reduction(MeasureReduction):
    """Heading, tilt and time to be ready of a platform that aligns itself."""

    ranked_by = "ready time"

    def measure(self) -> Account:
        """Measure heading, tilt and times.  Raises ReductionError for a record without the columns of an alignment."""
        found, self.a = self.found, Alignment(self.record)
        run, fine = self.a.run, self.a.fine
        channels = self.record.channels.items()
        self.limited = {n.partition(".")[0]: np.asarray(c) > 0.5 for n, c in channels if n.endswith(".saturated")}
        self.why = why = self._void()
        self.heading, self.final = run.first(plans.TO_NORTH), _final(run)
        at = self.final if self.final is not None else run.t.size - 1
        none = why if self.final is not None else "the platform never came to the gyrocompass"
        self.instant = "when it is ready" if run.ready[at] == 1.0 else "at the end, not ready"
        self._value("ψ", f"heading of the axis y {self.instant}", "deg", run.psi[at], run.sigma[at], run.true[at], none)
        if self.heading is not None:
            k, meaning = self.heading, "heading of the axis y by the coarse stage"
            self._value("ψ_coarse", meaning, "deg", run.psi[k], run.sigma[k], run.true[k], why)
        for k, axis in enumerate("xy"):
            meaning, u = f"tilt of the platform about {axis}", run.sigma_tilt[at, k]
            self._value(f"tilt_{axis}", meaning, "arcsec", 0.0, u, run.lean[at, k], none)
        self._ready()
        # u is the controller's, of all its sources: there is no type A of its own
        found.coefficients = [replace(c, u_a=None) for c in found.coefficients]
        if fine is not None:
            found.responses += shown.figures(run, fine)
            found.budget += shown.budget(self.a, at)
        found.tables += shown.tables(self.a)
        hit = ", ".join(slot for slot, limited in self.limited.items() if np.any(limited))
        found.warn("limit", f"At a limit during the run: {hit}. The alignment took longer for it." if hit else "")
        found.facts["site"] = Location.of(self.run).shown()
        return Account(
            method="Levelling, coarse heading and gyrocompass by the platform's own gyros and accelerometers; standard "
            "deviations of the linear error model in closed loop",
            sources=["ALIGN-GYRO; GSP ch. 5, section 5.3.2 (windows and positions), own derivation (loops and errors)"],
            equation="dot(phi)_x = u_x + d_x + U phi_y - N phi_z, quad dot(phi)_y = u_y + d_y - U phi_x, quad "
            'dot(phi)_z = u_z + d_z + N phi_x, quad psi - psi_"true" = phi_z',
            conventions=[
                "Headings ψ of the platform axis y are clockwise from north. Error: heading as computed less the true "
                "one.",
                "N, U: north and up component of the Earth rate. Tilt about x positive: y points up; about y: x down.",
                "Drift d in precession sign, what is left after the known drift; b: bias of an accelerometer.",
            ],
        )

    def summary(self) -> list[str]:
        found, run = self.found, self.a.run
        psi, ready = found["ψ"], found["ready time"]
        if psi.no_value:
            return [f"No heading: {psi.no_value}."]
        sentences = told(found.coefficients, f"Heading {{ψ}}, clockwise from north, {self.instant}.")
        not_ready = f"{ready.no_value[:1].upper()}{ready.no_value[1:]}."
        sentences.append(not_ready if ready.no_value else f"Ready {ready.estimate:.0f} s after switch-on.")
        if self.heading is not None and self.final is not None:
            k, n = self.heading, self.final
            sentences.append(
                f"Standard deviation: {plain(run.sigma[k] / ARCMIN, 3)}′ by the coarse stage after {run.t[k]:.0f} s, "
                f"{plain(run.sigma[n] / ARCMIN, 3)}′ by the gyrocompass after {run.t[n]:.0f} s."
            )
        if found.budget:
            first = found.budget[0]
            sentences.append(f"Largest contribution: {first.source}, {plain(60.0 * first.contribution)}′.")
        return sentences

    def _value(self, name: str, meaning: str, unit: str, value: float, u: float, true: float, why: str) -> None:
        """Measure an angle, SI, against the true one; void for a reason."""
        scale = units.factor(unit)
        estimate = value / scale
        truth = None if why else estimate + math.remainder(true - value, 2.0 * math.pi) / scale
        self.found.measure(name, meaning, units.display(unit), estimate, u / scale, truth=truth, unsettled=why)

    def _ready(self) -> None:
        """Measure the time to be ready; closed: by the error model.  No value where the heading was not held ready."""
        run, wanted = self.a.run, float(self.run.options["wanted"])
        meaning = f"from switch-on to a standard deviation of {plain(wanted / ARCMIN, 3)}′, held to the end"
        if why := self.why or ("" if run.ready[-1] == 1.0 else f"not ready: {_why_not(run, wanted)}"):
            self.found.measure("ready time", meaning, "s", None, unsettled=why)
            return
        t = float(np.asarray(self.record.channels["controller.ready_time"])[-1])
        expected = None if self.a.fine is None else planning.ready_after(self.a.history, self.a.sigma, wanted)
        self.found.measure("ready time", meaning, "s", t, 0.0, closed=expected)

    def _void(self) -> str:
        """Return why no figure has a value, "" where they have one; say each reason, and what withholds a verdict."""
        run, fine, why = self.a.run, self.a.fine, []
        if not np.all(np.isfinite(run.sigma)) or not np.all(np.isfinite(run.psi)):
            why = ["the controller's heading is not finite"]
        elif fine is None:
            why = [f"the run ended in the stage {plans.STAGES[int(run.mode[-1]) - 1]}, before the gyrocompass"]
        else:
            late = slice(max(fine, run.t.size - (run.t.size - fine) // 2), None)  # second half of the gyrocompass
            status = {2.0: [WRONG_RATES], 3.0: ["unsettled: the platform is not level at the end"]}
            shares = {slot: float(np.mean(limited[late])) for slot, limited in self.limited.items()}
            why = status.get(float(run.status[-1]), []) + [
                f"unsettled: {slot} is at its limit for {100.0 * share:.0f} % of the gyrocompass"
                for slot, share in shares.items()
                if share > AT_LIMIT
            ]
            self._doubts(late)
        for text in why:
            self.found.warn("alignment.void", f"{text[:1].upper()}{text[1:]}.")
        return why[0] if why else ""

    def _doubts(self, late: slice) -> None:
        """Say what withholds a verdict; late: the second half of the gyrocompass."""
        run, found = self.a.run, self.found
        ratio = _restless(self.a, late)
        text = (
            f"The specific force moves the gyrocompass {plain(ratio)} times as much as the stated noise of gyros and "
            "accelerometers does. The standard deviation of the heading may be too small; the base moves, or a sensor "
            "is noisier than stated."
        )
        doubts = {"alignment.restless": text if ratio > RESTLESS else ""}
        model = float(np.interp(run.t[-1], self.a.history.t, self.a.sigma))
        text = (
            f"The standard deviation of the controller, {plain(run.sigma[-1] / ARCMIN, 3)}′, is not that of the error "
            f"model, {plain(model / ARCMIN, 3)}′."
        )
        doubts["alignment.other_model"] = text if abs(run.sigma[-1] / model - 1.0) > SETTLING else ""
        z = float(abs(run.error[-1]) / max(run.sigma[-1], 1e-12))
        text = (
            f"Simulated: the heading is off by {z:.1f} standard deviations. An error is simulated that the controller "
            "is not told of."
        )
        doubts["alignment.not_told"] = text if z > DOUBT and not self.run.measured else ""
        for id, said in doubts.items():
            found.warn(id, said)
            found.doubt(id, said)


def _final(run: AlignmentColumns) -> int | None:
    """Return the row that the heading is stated for: where it became ready for good, else the last one."""
    if run.first(plans.FAST) is None:
        return None
    if run.ready[-1] == 1.0:
        return int(run.t.size - np.argmax(run.ready[::-1] == 0.0)) if not run.ready.all() else 0
    return int(run.t.size - 1)


def _why_not(run: AlignmentColumns, wanted: float) -> str:
    words = {2.0: "the rates contradict the Earth rate", 3.0: "the platform is not level"}
    if run.status[-1] in words:
        return words[float(run.status[-1])]
    if run.mode[-1] < plans.FAST:
        return f"the run ended in the stage {plans.STAGES[int(run.mode[-1]) - 1]}"
    return f"standard deviation {plain(run.sigma[-1] / ARCMIN, 3)}′ at the end, {plain(wanted / ARCMIN, 3)}′ wanted"


def _restless(a: Alignment, late: slice) -> float:
    """Return the rms of the tilt as measured, in the gyrocompass's band, over the one that the stated noise gives.

    Means over blocks of 0.5/w, of which neighbours are subtracted: what is slower than the loop is its own motion.
    Without noise, or with fewer than six blocks, 0.
    """
    gravity, sensors, period = a.settings.gravity, a.sensors, float(a.run.t[1] - a.run.t[0])
    size = max(int(0.5 / a.settings.slow_frequency / period), 5)
    tilt = a.run.tilt[late]
    n = tilt.shape[0] // size
    time = size * period
    lean = sensors.force / gravity / math.sqrt(time)
    moved = math.sqrt(3.0) * a.shaken / (gravity * time)  # difference of the velocities at the ends of blocks
    expected = math.sqrt(2.0) * math.hypot(lean, sensors.white * math.sqrt(time), sensors.markov * time, moved)
    if n < 6 or expected == 0.0:
        return 0.0
    means = tilt[: n * size].reshape(n, size, 2).mean(axis=1)
    return float(np.sqrt(np.mean(np.diff(means, axis=0) ** 2))) / expected
