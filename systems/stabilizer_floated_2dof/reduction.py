"""Record of an axis with a floated two-degree-of-freedom gyro -> its measures, beside the closed forms.

[STAB-FLOATED-2DOF; GSP ch. 5, eq. 5-24..5-26, corrected by EG7, EG8]
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from gyrobench.record.record import Record
from gyrobench.reduction.estimation import uncertainty
from gyrobench.reduction.loops import margins
from gyrobench.reduction.loops.loop_measures import Drift, Gate, Point, drift
from gyrobench.reduction.loops.loop_result import LoopFindings
from gyrobench.reduction.loops.loop_summary import DRIFTS, isolation, told
from gyrobench.reduction.loops.loop_summary import margins as margin_sentences
from gyrobench.result import LoopResult, Specification, Table
from gyrobench.units import ARCSEC

from .closed import Loop
from .system import loop_of

ANGLE, RATE = "platform.attitude", "platform.omega[1]"
MRAD = 1e-3
ENOUGH = 45.0  # degrees of phase margin that GSP ch. 5 asks for
CONVENTIONS = [
    "θ: inertial angle of the platform about x, positive like the torque M; K_x θ: the gyro's x pickoff.",
    "Loop gain L = −(signal that comes back) / (signal put in), opened at the input of the network.",
    "A lower gain limit below 1: the loop becomes unstable when its gain falls to this share.",
    "Drift: rate of the platform at rest, that of the gyro's x channel, in precession sign.",
]


def from_record(record: Record, specification: Specification | None = None) -> LoopResult:
    """The Result.  Raises ReductionError for a record without a whole phase."""
    found = LoopFindings(record)
    parameters = record.run.parameters
    loop = loop_of(parameters)
    if loop is None:
        found.warnings.append("The closed forms are those of the lag-lead network: the figures stand alone.")
    hold = next((g for g in found.of("hold") if g.label == "drift"), None)
    own = drift(hold.t, hold[ANGLE]) if hold is not None else None
    for gate in found.of("torque", 1, "step"):
        if gate.label == "load step":
            _load(found, gate, loop, own, hold)
    for gate in found.of("command", 1, "step"):
        _command(found, gate)
    points = found.open_loop("stabilizer", "stabilizer.e", "exciter.test[1]")
    if points:
        _margins(found, points, loop)
    base = found.ratio(
        "isolation", "motion", 1, ANGLE, "exciter.motion_angle[1]",
        caption="Isolation: inertial angle of the platform over that of the base. Points: measured; lines: linear.",
    )  # fmt: skip
    _isolation(found, base, loop, parameters)
    if hold is not None:
        _drift(found, hold, parameters)
    said = _blow(found)
    result = found.result(
        title="Stabilizer with a floated two-degree-of-freedom gyro",
        method="Load step, command by the gyro's torquer, sine sweeps of loop and base, and drift hold",
        sources=["STAB-FLOATED-2DOF; GSP ch. 5, eq. 5-24..5-26, corrected by EG7, EG8"],
        equation="J_x dot.double(theta) = M - K_m K_x G(s) theta, quad "
        "G(s) = K_G ((1 + tau_1 s)(1 + tau_2 s)) / ((1 + T_1 s)(1 + T_2 s))",
        conventions=CONVENTIONS,
        specification=specification,
    )
    sentences = [
        *margin_sentences(found),
        *isolation(found, "isolation", ANGLE),
        *told(
            found.coefficients, "The load leaves the platform {θ*} off and turns it by up to {θ_max}; stiffness {S}.",
            DRIFTS,
        ),
    ]  # fmt: skip
    result.summary = result.summary or [*sentences, *said]
    return result


def _truth(p: Mapping[str, Any], angle: float) -> float | None:
    """Static drift of the x channel, rad/s, on a platform turned by ``angle`` from level: Y = -sin, Z = -cos."""
    names = ("0", "y", "z", "yy", "zz", "yz")
    if any(f"gyro.Dx_{n}" not in p for n in names) or p.get("motion.preset"):
        return None
    constant, y, z, yy, zz, yz = (float(p[f"gyro.Dx_{n}"]) for n in names)
    Y, Z = -math.sin(angle), -math.cos(angle)
    return constant + y * Y + z * Z + yy * Y * Y + zz * Z * Z + yz * Y * Z


def _drift(found: LoopFindings, gate: Gate, p: Mapping[str, Any]) -> None:
    """Drift rate, and the random walk N beside the pickoff's noise, which the loop follows: dev2 tau = N2 + a/tau.

    The slope of -1/2 alone does not show N here: noise of the angle, a/tau2 in the variance of the rate, lies over it
    up to some seconds.  Weighted least squares over averaging times from 0.5 s on.
    """
    found.drift(gate, ANGLE, truth=_truth(p, float(np.mean(gate[ANGLE]))))  # the command has turned it
    found.coefficients = [c for c in found.coefficients if c.name != "N"]
    if not found.allan:
        return
    tau, dev, low, high = (np.array(found.allan[n], float) for n in ("tau", "dev", "lo", "hi"))
    wide = tau >= 0.5
    if np.count_nonzero(wide) < 3:
        return
    tau, dev, low, high = (x[wide] for x in (tau, dev, low, high))
    y, u = dev**2 * tau, dev * tau * (high - low) / uncertainty.NORMAL
    columns = np.column_stack([np.ones(tau.size), 1.0 / tau]) / u[:, None]
    cov = np.linalg.inv(columns.T @ columns)
    square = float((cov @ columns.T @ (y / u))[0])
    if square > 0.0:
        walk = math.sqrt(square) / 60.0  # °/h √s -> °/√h
        spread = math.sqrt(cov[0, 0]) / (2.0 * math.sqrt(square)) / 60.0
        true = math.degrees(float(p["gyro.white_x"])) * 60.0 if p.get("gyro.white_x") else None
        found.measure("N", "angle random walk", "°/√h", walk, spread, truth=true)


def _load(found: LoopFindings, gate: Gate, loop: Loop | None, own: Drift | None, quiet: Gate | None) -> None:
    """Compliance at rest and in the peak, with the platform's own drift taken off and its uncertainty added."""
    rate, u_rate = (own.rate, own.u) if own is not None else (0.0, 0.0)
    a = found.step(gate, ANGLE, scale=ARCSEC, unit="″", y_name="platform θ", drift=rate, quiet=quiet)
    a = replace(a, u_change=math.hypot(a.u_change, u_rate * float(gate.t[-1] - gate.t[0])))
    M = gate.amplitude
    closed = None if loop is None else M / loop.K / ARCSEC
    found.measure("θ*", "platform angle under the load, at rest", "″", a.change / ARCSEC, a.u_change / ARCSEC,
                  closed=closed, unsettled=a.unsettled)  # fmt: skip
    if a.change:
        found.measure("S", "stiffness at rest, M / θ*", "N·m/rad", M / a.change, abs(M / a.change**2) * a.u_change,
                      closed=None if loop is None else loop.K, unsettled=a.unsettled)  # fmt: skip
    y = gate[ANGLE] - a.initial
    noise = float(np.std(np.diff(y[-y.size // 10 :]))) / math.sqrt(2.0)
    peak = float(y[np.argmax(np.abs(y))])
    found.measure("θ_max", "largest platform angle after the load step", "″", peak / ARCSEC, noise / ARCSEC)
    found.measure("t_5", "settling to 5 % of θ*", "s", a.settled_5, a.u_settled, unsettled=a.unsettled)
    found.measure("t_2", "settling to 2 % of θ*", "s", a.settled_2, a.u_settled, unsettled=a.unsettled)


def _command(found: LoopFindings, gate: Gate) -> None:
    step = found.step(gate, RATE, scale=MRAD, unit="mrad/s", y_name="platform rate")
    size = abs(gate.amplitude)
    share, u = step.change / gate.amplitude, step.u_change / size
    found.measure("rate gain", "rate reached over rate commanded", "1", share, u, closed=1.0,
                  unsettled=step.unsettled)  # fmt: skip
    found.measure("overshoot", "of the rate after the command", "%", 100.0 * step.overshoot, 100.0 * u,
                  unsettled=step.unsettled)  # fmt: skip
    found.measure("t_5 rate", "settling of the rate to 5 %", "s", step.settled_5, step.u_settled,
                  unsettled=step.unsettled)  # fmt: skip


def _margins(found: LoopFindings, points: list[Point], loop: Loop | None) -> None:
    """Slope at the crossover, the lower gain limit, and the closed forms of the loop without step and delay."""
    values = margins.measured_values(points, found.excluded["stabilizer"])
    pm = values.get("phase")
    if pm is not None and pm[0] < ENOUGH and not found.unstable:
        found.warnings.append(f"The phase margin is {pm[0]:.3g}°; more than {ENOUGH:g}° is wanted [GSP ch. 5].")
    if "crossover" in values and max(p.f for p in points) > 1.25 * values["crossover"][0]:
        f = values["crossover"][0]
        pair = [
            margins.interpolate_response(points, np.array([f / 1.25, f * 1.25]), spline) for spline in (False, True)
        ]
        slopes = [20.0 * math.log10(abs(v[1] / v[0])) / math.log10(1.25**2) for v in pair]
        closed = None if loop is None else _secant(loop, 2.0 * math.pi * f)
        found.measure("slope", "of |L| at the crossover", "dB/dec", slopes[0], abs(slopes[1] - slopes[0]),
                      closed=closed)  # fmt: skip
    at = None if loop is None else loop.limit()
    if "lower" in values:
        found.measure("lower limit", "share of the gain at which the loop becomes unstable", "1", *values["lower"],
                      closed=None if at is None else at[1])  # fmt: skip
        found.measure("f_lower", "frequency at that limit", "Hz", *values["f_lower"],
                      closed=None if at is None else at[0] / (2.0 * math.pi))  # fmt: skip
    if loop is not None:
        found.tables.append(_forms(loop, values))


def _secant(loop: Loop, w: float) -> float:
    """Slope of |L| between w/1.25 and 1.25 w, dB per decade: what is measured."""
    ends = [abs(loop.gain(1j * w * x)) for x in (1.0 / 1.25, 1.25)]
    return 20.0 * math.log10(ends[1] / ends[0]) / math.log10(1.25**2)


def _forms(loop: Loop, values: Mapping[str, tuple[float, float]]) -> Table:
    w, pm = loop.margin()
    at = loop.limit()
    rows: list[list[Any]] = [
        ["crossover", w / (2.0 * math.pi), values.get("crossover", (None,))[0], "Hz"],
        ["phase margin", pm, values.get("phase", (None,))[0], "°"],
        ["slope at the crossover, tangent", loop.slope(w), None, "dB/dec"],
    ]
    if at is not None:
        rows.append(["gain limit, share of K", at[1], values.get("lower" if at[1] < 1.0 else "upper", (None,))[0], "1"])
    return Table(
        "closed_forms_of_the_loop",
        "Closed forms of the loop",
        "Of K_m K_x G/(J_x s²): a motor that is a torque at once, no friction, no step, no delay. The "
        "measured loop has them.",
        ["of the loop", "closed form", "measured", "unit"],
        rows,
    )


def _isolation(found: LoopFindings, points: list[Point], loop: Loop | None, p: Mapping[str, Any]) -> None:
    """The base turns the platform by friction, and by the back EMF of a motor that has one."""
    if not points:
        return
    at = min(points, key=lambda q: abs(q.f - 1.0))
    size = 20.0 * math.log10(abs(at.value)) if at.value else None
    closed = None
    names = ("platform.viscous", "platform.k_t", "platform.k_e", "platform.R")
    if loop is not None and all(n in p for n in names):
        viscous, k_t, k_e, r = (float(p[n]) for n in names)
        if drag := viscous + k_t * k_e / r:
            closed = 20.0 * math.log10(abs(loop.isolation(2j * math.pi * at.f, drag)))
    found.measure("isolation", f"platform over base at {at.f:g} Hz", "dB", size, 8.686 * (at.u or 0.0), closed=closed)


def _blow(found: LoopFindings) -> list[str]:
    """What the large disturbance did: whether the platform came back, and how long the motor was at its limit."""
    blows = [g for g in found.gates if g.label == "blow"]
    after = [g for g in found.gates if g.label == "after the blow"]
    if not blows or not after:
        return []
    blow, rest = blows[0], after[0]
    start = float(blow.rest(ANGLE).mean()) if blow.rest(ANGLE).size else 0.0
    y = np.concatenate([blow[ANGLE], rest[ANGLE]]) - start
    late = np.abs(rest[ANGLE][-rest.t.size // 3 :] - start)
    early = np.abs(y[: 2 * y.size // 3])
    busy = float(np.mean(np.concatenate([g["platform.saturated"] for g in (blow, rest)]) > 0.5))
    lost = bool(np.any(rest["gyro.saturated"] > 0.5))
    grows = bool(late.max() > 0.5 * early.max())
    found.step(rest, ANGLE, scale=math.radians(1.0), unit="°", y_name="platform θ")
    found.responses[-1] = replace(
        found.responses[-1], caption=f"After a blow of {blow.amplitude:g} N·m for {blow.row.dwell:g} s.", curves=[]
    )
    rows = [
        ["largest angle", math.degrees(float(np.abs(y).max())), "°"],
        ["largest angle in the last second", math.degrees(float(late.max())), "°"],
        ["share of the time with the motor at its limit", 100.0 * busy, "%"],
    ]
    found.tables.append(
        Table(
            "large_disturbance",
            "Large disturbance",
            f"{blow.amplitude:g} N·m for {blow.row.dwell:g} s and {rest.row.dwell:g} s after it.",
            ["of the platform", "value", "unit"],
            rows,
        )
    )
    if lost:
        found.warnings.append("After the blow the pickoff of the gyro was beyond its range.")
    if grows:
        found.warnings.append("After the blow the loop did not come to rest: the motor's limit made it unstable.")
        return [f"A blow of {blow.amplitude:g} N·m for {blow.row.dwell:g} s throws the loop into a growing swing."]
    return [f"After a blow of {blow.amplitude:g} N·m for {blow.row.dwell:g} s the loop comes back to rest."]
