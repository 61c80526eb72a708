"""Record of the single-axis platform -> stiffness, margins, isolation, error in the ride, drift, estimator."""

from __future__ import annotations

import math

import numpy as np

from gyrobench.record.record import Record
from gyrobench.reduction.loops.estimator_metrics import rms
from gyrobench.reduction.loops.loop_measures import Gate, Point
from gyrobench.reduction.loops.loop_result import LoopFindings
from gyrobench.reduction.loops.loop_summary import DRIFTS, isolation, margins, told
from gyrobench.result import LoopResult, Specification
from gyrobench.units import ARCSEC

from .budget import ride_budget
from .measures import PURPOSES, bending, disturbed, effort, jitter, lag, level, period

MRAD = 1e-3
SLOW = 0.1  # Hz: a ride by a recorded profile has no frequency of its own
ANGLE, RATE = "platform.attitude", "platform.omega[1]"


def from_record(record: Record, specification: Specification | None = None) -> LoopResult:
    """Result of one run.  Raises ReductionError for a record without a whole phase."""
    found = LoopFindings(record)
    swings = _ride(found)
    _steps(found)
    found.open_loop("stabilizer", "stabilizer.e", "exciter.test[1]")
    lag(found, _estimator(found))
    bending(found)
    disturbed(found)
    if any(g.label.startswith("base") for g in found.gates):
        found.ratio(
            "attitude over base angle", "motion", 1, ANGLE, "exciter.motion_angle[1]",
            caption="Isolation: how much of the base's angle the platform takes over.",
        )  # fmt: skip
    _drift(found)
    _saturated(found)
    result = found.result(
        title="Stabilized platform on one axis",
        method="Disturbance step, command step, sine sweeps, ride and drift of a loop with a floated gyro in rebalance",
        sources=["PLATFORM-1AXIS, GYRO-REBALANCE; Xia 2008, section 4.1, fig. 4.1.1 (rebuilt), corrected by EX3"],
        equation="J dot(omega) = k_t i_m + M_d - H (omega_O + dot(beta)), quad "
        r'v = -G(s) (hat(i) + i_"test" - omega_c\/k)',
        conventions=[
            "Platform x is the gyro's input axis; angles and rates are positive about +x.",
            "i is the torquer current of the gyro: k i = omega_IA - omega_d. The stabilizer carries the minus.",
            "L is the loop opened at the input of the stabilizer: what comes back over what is put in, with minus.",
        ],
        summary=[
            *margins(found),
            *isolation(found, "attitude over base angle", ANGLE),
            *told(found.coefficients, swings, f"A load of {_load(found)} turns it by up to {{peak}}.", DRIFTS),
        ],
        ranked_by="platform error",
        specification=specification,
    )
    result.purposes = {name: purpose for name, purpose in PURPOSES.items() if name in result.names}
    return result


def _ride(found: LoopFindings) -> str:
    """Platform error, the measure that ranks estimators and loops; what the estimator makes of its reading."""
    ride = next((g for g in found.gates if g.label == "ride"), None)
    if ride is None:
        return ""
    two = round(2.0 / (ride.f or SLOW) / period(ride))
    size = level if ride.f else rms  # a recorded motion is random
    error, rate = size(jitter(ride[ANGLE], two)), size(ride[RATE] - ride[RATE].mean())
    meaning = "attitude in the ride, rms about its running mean over two periods or 20 s"
    found.measure("platform error", meaning, "″", error.value / ARCSEC, error.u / ARCSEC)
    found.measure("rate error", "rate in the ride, rms", "mrad/s", rate.value / MRAD, rate.u / MRAD)
    sources = ride_budget(found, ride, ANGLE, two)
    effort(found, ride)
    p = found.record.run.parameters
    k = p.get("gyro.k") or (1.0 / p["stabilizer.K_u"] if p.get("stabilizer.K_u") else None)  # or what the design took
    if k is not None:
        _reading(found, ride, float(k))
    base = f"swings {math.degrees(ride.amplitude):.3g}° at {ride.f:g} Hz" if ride.f else "moves as recorded"
    limit = max(sources, key=lambda name: sources[name], default="")
    by = f"; the largest part is {limit}, {sources[limit] / ARCSEC:.3g}″" if limit else ""
    return f"A base that {base} leaves {{platform error}} rms on the platform, and {{rate error}}{by}."


def _load(found: LoopFindings) -> str:
    return next((f"{abs(g.amplitude):g} N·m" for g in found.of("torque", shape="step")), "")


def _reading(found: LoopFindings, ride: Gate, k: float) -> None:
    """Add the errors of reading and estimate against the true rate, in the ride."""
    truth = ride[RATE] / k
    raw, left = rms(ride["rebalance.i_read"] - truth), rms(ride["estimator.estimate"] - truth)
    unit = "mA"
    found.measure("reading error", "reading less true rate over k, rms in the ride", unit, 1e3 * raw.value, 1e3 * raw.u)
    found.measure("estimate error", "the same of the estimate", unit, 1e3 * left.value, 1e3 * left.u)
    if "estimator.latency" in ride.channels:  # an estimator need not state it
        latency = float(ride["estimator.latency"][-1])
        found.measure("latency", "delay that the estimator states", "ms", 1e3 * latency)


def _estimator(found: LoopFindings) -> list[Point]:
    """Add the response of the estimator at the test sines; the closed loop leaves little of the rate in the ride."""
    return found.ratio(
        "estimate over reading", "test", 1, "estimator.estimate", "rebalance.i_read",
        caption="What the estimator does to the signal of the loop: gain and phase at the test sines.",
    )  # fmt: skip


def _steps(found: LoopFindings) -> None:
    quiet = next(iter(found.of("hold")), None)
    for gate in found.of("torque", shape="step"):
        found.step(gate, ANGLE, scale=ARCSEC, unit="″", y_name="attitude", quiet=quiet)
        rest = gate.rest(ANGLE)
        y = gate[ANGLE] - (float(rest.mean()) if rest.size else 0.0)
        peak = int(np.argmax(np.abs(y)))
        noise = float(np.std(np.diff(y[-y.size // 10 :]))) / math.sqrt(2.0)
        found.measure("peak", "largest attitude after the load step", "″", y[peak] / ARCSEC, noise / ARCSEC)
        stiffness = abs(gate.amplitude / y[peak])
        u = stiffness * noise / abs(y[peak])
        found.measure("load/peak", "torque of the step over that attitude", "N·m/rad", stiffness, u)
    for gate in found.of("command", shape="step"):
        step = found.step(gate, RATE, scale=MRAD, unit="mrad/s", y_name="rate", quiet=quiet)
        share, u = step.change / gate.amplitude, step.u_change / abs(gate.amplitude)
        found.measure("rate gain", "rate reached over rate commanded", "1", share, u, closed=1.0,
                      unsettled=step.unsettled)  # fmt: skip
        found.measure("overshoot", "of the rate after the command", "%", 100.0 * step.overshoot, 100.0 * u,
                      unsettled=step.unsettled)  # fmt: skip
        found.measure("settling", "time until the rate stays within 5 %", "s", step.settled_5, step.u_settled,
                      unsettled=step.unsettled, no_value=step.restless)  # fmt: skip


def _drift(found: LoopFindings) -> None:
    hold = [g for g in found.of("hold") if g.label == "drift"]
    if not hold:
        return
    parameters = found.record.run.parameters
    names = ("gyro.D_F", "gyro.D_S", "gyro.D_SS")
    truth = None
    if all(n in parameters for n in names):  # x level, z up: (X, Y, Z) = (0, 0, -1) at standard gravity
        fixed, along, squared = (float(parameters[n]) for n in names)
        truth = fixed - along + squared
    found.drift(hold[-1], ANGLE, truth=truth)


def _saturated(found: LoopFindings) -> None:
    for name, text in (("platform.saturated", "the motor"), ("rebalance.saturated", "the torquer of the gyro")):
        labels = [g.label for g in found.gates if name in g.channels and np.any(g[name] > 0.5)]
        if labels:
            found.warnings.append(
                f"At its limit was {text} in: {', '.join(labels)}. What was measured there is not linear."
            )
