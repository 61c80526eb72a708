"""Record of the single-axis platform -> stiffness, margins, isolation, error in the ride, drift, estimator."""

from __future__ import annotations

import math

import numpy as np

from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.loops.estimator_metrics import rms
from gyrobench.reduction.loops.loop_toolkit import (
    ARCSEC,
    DRIFTS,
    Account,
    Gate,
    LoopReduction,
    isolation,
    margins,
    told,
)
from gyrobench.reduction.loops.platform_measures import command_step, level_drift, peak_noise

from .budget import ride_budget
from .measures import PURPOSES, bending, disturbed, effort, jitter, lag, level, period

SLOW = 0.1  # Hz: a ride by a recorded profile has no frequency of its own
ANGLE, RATE = "platform.attitude", "platform.omega[1]"
SETTLING = "settling", "time until the rate stays within 5 %"


class Reduction(LoopReduction):
    """Disturbance step, command step, sweeps, ride and drift of a loop with a floated gyro in rebalance."""

    ranked_by = "platform error"

    def measure(self) -> Account:
        found = self.found
        self.swings = self._ride()
        self.loads = found.of("torque", shape="step")
        for gate in self.loads:
            self._load(gate)
        quiet = next(iter(found.of("hold")), None)
        for gate in found.of("command", shape="step"):
            command_step(found, gate, RATE, SETTLING, y_name="rate", quiet=quiet, restless=True)
        found.open_loop("stabilizer", "stabilizer.e", "exciter.test[1]", held={"estimator": 0.0})
        # the closed loop leaves little of the rate in the ride: the estimator is asked at the test sines
        lag(found, found.ratio(
            "estimate over reading", "test", 1, "estimator.estimate", "rebalance.i_read",
            caption="What the estimator does to the signal of the loop: gain and phase at the test sines.",
        ))  # fmt: skip
        bending(found)
        disturbed(found)
        if any(g.label.startswith("base") for g in found.gates):
            found.ratio(
                "attitude over base angle", "motion", 1, ANGLE, "exciter.motion_angle[1]",
                caption="Isolation: how much of the base's angle the platform takes over.",
            )  # fmt: skip
        if holds := [g for g in found.of("hold") if g.label == "drift"]:
            found.drift(holds[-1], ANGLE, truth=level_drift(self.run.parameters), gyro=("gyro", ""))
        known = {c.name for c in found.coefficients}
        found.facts["purposes"] = {name: purpose for name, purpose in PURPOSES.items() if name in known}
        return Account(
            method="Disturbance step, command step, sine sweeps, ride and drift of a loop with a floated gyro in "
            "rebalance",
            sources=["PLATFORM-1AXIS, GYRO-REBALANCE; Xia 2008, section 4.1, fig. 4.1.1 (rebuilt), corrected by EX3"],
            equation="J dot(omega) = k_t i_m + M_d - H (omega_O + dot(beta)), quad "
            r'v = -G(s) (hat(i) + i_"test" - omega_c\/k)',
            conventions=[
                "Platform x is the gyro's input axis; angles and rates are positive about +x.",
                "i is the torquer current of the gyro: k i = omega_IA - omega_d. The stabilizer carries the minus.",
                "L is the loop opened at the input of the stabilizer: what comes back over what is put in, with minus.",
            ],
        )

    def summary(self) -> list[str]:
        found = self.found
        load = f"{abs(self.loads[0].amplitude):g} N·m" if self.loads else ""
        return [
            *margins(found),
            *isolation(found, "attitude over base angle", ANGLE),
            *told(found.coefficients, self.swings, f"A load of {load} turns it by up to {{peak}}.", DRIFTS),
        ]

    def _ride(self) -> str:
        """Measure the platform error, which ranks estimators and loops, and what the estimator makes of its reading."""
        found, p = self.found, self.run.parameters
        ride = next((g for g in found.gates if g.label == "ride"), None)
        if ride is None:
            return ""
        two = round(2.0 / (ride.f or SLOW) / period(ride))
        size = level if ride.f else rms  # a recorded motion is random
        error, rate = size(jitter(ride[ANGLE], two)), size(ride[RATE] - ride[RATE].mean())
        meaning = "attitude in the ride, rms about its running mean over two periods or 20 s"
        found.measure("platform error", meaning, "″", *error.pair, scale=ARCSEC)
        found.measure("rate error", "rate in the ride, rms", "mrad/s", *rate.pair, scale=1e-3)
        sources = ride_budget(found, ride, ANGLE, two)
        effort(found, ride)
        k = p.get("gyro.k") or (1.0 / p["stabilizer.K_u"] if p.get("stabilizer.K_u") else None)  # or what was designed
        if k is not None:
            self._reading(ride, float(k))
        base = f"swings {plain(math.degrees(ride.amplitude), 3)}° at {ride.f:g} Hz" if ride.f else "moves as recorded"
        limit = max(sources, key=lambda name: sources[name], default="")
        by = f"; the largest part is {limit}, {plain(sources[limit] / ARCSEC, 3)}″" if limit else ""
        return f"A base that {base} leaves {{platform error}} rms on the platform, and {{rate error}}{by}."

    def _reading(self, ride: Gate, k: float) -> None:
        """Measure the errors of reading and estimate against the true rate, in the ride."""
        found, truth = self.found, ride[RATE] / k
        raw, left = rms(ride["rebalance.i_read"] - truth), rms(ride["estimator.estimate"] - truth)
        meaning = "reading less true rate over k, rms in the ride"
        found.measure("reading error", meaning, "mA", 1e3 * raw.value, 1e3 * raw.u)
        found.measure("estimate error", "the same of the estimate", "mA", 1e3 * left.value, 1e3 * left.u)
        if "estimator.latency" in ride.channels:  # an estimator need not state it
            latency = 1e3 * float(ride["estimator.latency"][-1])
            found.measure("latency", "delay that the estimator states", "ms", latency)

    def _load(self, gate: Gate) -> None:
        found, rest = self.found, gate.rest(ANGLE)
        quiet = next(iter(found.of("hold")), None)
        found.step(gate, ANGLE, scale=ARCSEC, unit="″", y_name="attitude", quiet=quiet)
        y = gate[ANGLE] - (float(rest.mean()) if rest.size else 0.0)
        at = int(np.argmax(np.abs(y)))
        peak, noise = float(y[at]), peak_noise(quiet[ANGLE] if quiet else None, rest.size, at, y)
        found.measure("peak", "largest attitude after the load step", "″", peak, noise, scale=ARCSEC)
        stiff = abs(gate.amplitude / peak)
        found.measure("load/peak", "torque of the step over that attitude", "N·m/rad", stiff, stiff * noise / abs(peak))
