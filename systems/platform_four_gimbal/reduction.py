"""Record of the four-gimbal platform -> loops, drift, and where the flight left its inner element and its rings."""

from __future__ import annotations

import math

import numpy as np

from gyrobench.record.record import Record
from gyrobench.reduction.loops.gimbals import DEG, Flight, legs_table, lock_table, over_time, rate_servo_limits, spans
from gyrobench.reduction.loops.loop_limits import bandwidth
from gyrobench.reduction.loops.loop_measures import drift
from gyrobench.reduction.loops.loop_result import LoopFindings
from gyrobench.reduction.loops.loop_summary import margins, told
from gyrobench.result import LoopResult, Specification
from gyrobench.units import ARCSEC, DPH

AXES = ("pitch", "roll", "azimuth")
REST = "drift"  # label of the drift hold; the other phases without excitation are legs
STEEP = math.sin(5.0 * DEG)  # |cos(pitch)| below which the fourth gimbal has no authority
KEPT = 0.01  # deg: up to this the inner element counts as kept
PITCH, INNER, AZIMUTH, OUTER = "platform.theta[1]", "platform.theta[2]", "platform.theta[3]", "platform.theta_4"


def from_record(record: Record, specification: Specification | None = None) -> LoopResult:
    """Result of one run.  Raises ReductionError for a record without a whole phase."""
    found = LoopFindings(record)
    holds = [g for g in found.of("hold") if g.label == REST]
    legs = [g for g in found.of("hold") if g.label != REST]
    summary = _flight(found, Flight(legs, "platform.attitude", holds[0] if holds else None)) if legs else []
    _loads(found)
    for k, axis in enumerate(AXES, 1):
        found.open_loop(axis, f"{axis}.e", f"exciter.test[{k}]", k)
    lag = float(record.run.parameters.get("platform.lag", 0.0))
    for k, axis in enumerate("xyz", 1) if holds else ():
        got = drift(holds[0].t, holds[0][f"platform.attitude[{k}]"])
        found.measure(f"drift {axis}", f"of the platform about {axis}, at rest", "°/h", got.rate / DPH, got.u / DPH)
    return found.result(
        title="Four-gimbal platform",
        method="Load steps and sine sweeps of the loops, drift hold, and a flight of the base",
        sources=["PLATFORM-4GIMBAL; GSP ch. 5, section 5.2.2 (no equations there)"],
        equation='dot(g)_4 = k G(g_3) g_2, quad G = sec g_3 \\, "sign" cos g_3 \\, 1, '
        "quad dot(g)_2 = -dot(g)_4 cos g_3",
        conventions=[
            "Gimbals from outside: g4 outer roll about y, g3 pitch about x, g2 inner roll about y, g1 azimuth about z.",
            "Platform error: size of the integral of the platform's rate in the flight, less its drift at rest.",
            "The servo of the fourth gimbal nulls g2; within 5° of pitch 90° it has no authority (told as lock).",
        ],
        summary=[
            *summary,
            *margins(found, *AXES),
            *bandwidth(found, {axis: {"servo": lag} for axis in AXES}),
            *told(found.coefficients, "At rest it drifts by {drift x}, {drift y} and {drift z} about x, y and z."),
        ],
        ranked_by="platform error",
        specification=specification,
    )


def _flight(found: LoopFindings, flight: Flight) -> list[str]:
    error, travel = flight.error / DEG, float(np.ptp(flight[OUTER])) / DEG
    g2 = np.abs(flight[INNER]) / DEG
    u = flight.u(found.record.run.step) / DEG
    found.measure("platform error", "largest in the flight, drift taken off", "°", float(error.max()), u)
    found.measure("error at the end", "of the flight", "°", float(error[-1]), flight.noise / DEG)
    found.measure(
        "ring 4 travel",
        "largest less smallest angle of the fourth gimbal",
        "°",
        travel,
        _moved(found, flight["platform.theta_4_dot"]),
    )
    found.measure("g2 max", "largest inner roll", "°", float(g2.max()), _moved(found, flight["platform.theta_dot[2]"]))
    steep = np.abs(np.cos(flight[PITCH])) < STEEP
    held = _held(flight)
    kinds = {"fourth gimbal locked": held, "pitch within 5° of the vertical": steep & (held < 0.5)}
    found.tables += [lock_table(flight, kinds, flight[PITCH], "pitch gimbal"), _legs(flight)]
    rings = {"g4 outer roll": OUTER, "g3 pitch": PITCH, "g2 inner roll": INNER, "g1 azimuth": AZIMUTH}
    found.responses += [
        over_time(
            "platform error", flight.t, {"error": flight.error / ARCSEC}, unit="″",
            caption="Error of the inner element in the flight.",
        ),
        over_time(
            "ring angles", flight.t, {label: flight[name] / DEG for label, name in rings.items()},
            y_name="ring angle", caption="Angles of the four gimbals in the flight.",
        ),
        over_time("inner roll", flight.t, {"g2": flight[INNER] / DEG}, y_name="inner roll g2",
                  caption="The angle that the servo of the fourth gimbal keeps at zero."),
    ]  # fmt: skip
    if any(np.any(flight[f"{g}.saturated"] > 0.5) for g in ("gyro_a", "gyro_b")):
        found.warnings.append("A pickoff of the gyros was saturated in the flight: the platform has left them.")
    rates = [*(f"platform.theta_dot[{k}]" for k in (1, 2, 3)), "platform.theta_4_dot"]
    fast = max(float(np.abs(flight[name]).max()) for name in rates)
    top = found.record.run.parameters.get("platform.rate_max")
    if top and fast >= float(top) * (1.0 - 1e-9):
        found.warnings.append(f"A gimbal was at its largest rate, {float(top) / DEG:.4g}°/s, in the flight.")
    return [*_said(flight, error, travel, steep & (held < 0.5)), *rate_servo_limits(flight, rates, top)]


def _moved(found: LoopFindings, rate: np.ndarray) -> float:
    """Standard uncertainty of a ring's angle, deg: what it moves in a step at its fastest, rectangular."""
    return float(np.abs(rate).max()) * found.record.run.step / math.sqrt(12.0) / DEG


def _held(flight: Flight) -> np.ndarray:
    """1 while the fourth gimbal is locked: lock is told and its servo, which sees an inner roll, stands."""
    stands = (flight["platform.theta_4_dot"] == 0.0) & (flight[INNER] != 0.0)
    return np.asarray((flight["platform.lock"] > 0.5) & stands, float)


def _said(flight: Flight, error: np.ndarray, travel: float, steep: np.ndarray) -> list[str]:
    worst = int(np.argmax(error))
    if error[worst] <= KEPT:
        first = f"The inner element was kept within {error[worst]:.2g}° all through the flight."
    else:
        a, b = spans(error > KEPT)[0]
        first = (
            f"The inner element was not kept: from t = {flight.t[a]:.4g} s (leg “{flight.leg_at(a)}”, pitch gimbal "
            f"{flight[PITCH][a] / DEG:.4g}°) its error is above {KEPT:g}°, at most {error[worst]:.3g}° at "
            f"t = {flight.t[worst]:.4g} s"
            + (f"; from {flight.t[b]:.4g} s on it is below again." if b < error.size - 1 else ".")
        )
    said = [first]
    if travel > 150.0 and np.any(steep):
        said.append(f"The fourth gimbal turned over: it travelled {travel:.4g}°.")
    elif np.any(steep):
        said.append(f"The fourth gimbal travelled {travel:.4g}° in a flight that passed the vertical.")
    return said


def _legs(flight: Flight) -> dict[str, object]:
    columns = {
        "ring 4 travel / °": lambda s: float(np.ptp(flight[OUTER][s])) / DEG,
        "largest g2 / °": lambda s: float(np.abs(flight[INNER][s]).max()) / DEG,
    }
    return legs_table(flight, "What the rings did, and the error of the inner element", columns)


def _loads(found: LoopFindings) -> None:
    """The servo yields by M / (drag feedback), drag being the platform's; at rest both have the same axes."""
    p = found.record.run.parameters
    feedback = found.record.run.options.get("feedback")
    drag = p.get("platform.drag")
    holds = [g for g in found.of("hold") if g.label == REST]
    for gate in found.of("torque", shape="step"):
        axis, output = AXES[gate.axis - 1], f"platform.attitude[{gate.axis}]"
        own = drift(holds[0].t, holds[0][output]).rate if holds else 0.0
        step = found.step(
            gate, output, scale=ARCSEC, unit="″", y_name=f"platform about {'xyz'[gate.axis - 1]}", drift=own,
            quiet=next(iter(holds), None),
        )  # fmt: skip
        if step.change:
            stiffness, u = gate.amplitude / step.change, abs(gate.amplitude / step.change**2) * step.u_change
            meaning = "stiffness, torque over angle that it leaves"
            closed = drag * feedback if drag and feedback else None
            found.measure(f"S {axis}", meaning, "N·m/rad", stiffness, u, closed=closed, unsettled=step.unsettled)
