"""From the record of a power gyro stabilizer to its measures, beside the closed forms.

[STAB-POWER-2DOF; GSP ch. 5, eq. 5-5..5-23, corrected by EG1-EG6]
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from gyrobench.record.record import Record
from gyrobench.reduction.loops import margins
from gyrobench.reduction.loops.loop_measures import Drift, Gate, Point, drift
from gyrobench.reduction.loops.loop_result import LoopFindings
from gyrobench.reduction.loops.loop_summary import DRIFTS, isolation, told
from gyrobench.reduction.loops.loop_summary import margins as margin_sentences
from gyrobench.result import LoopResult, Specification
from gyrobench.units import ARCSEC, DPH

BASE = "motion.angle[1]"  # of the base, to be added to what the gyro reads against it
EQUATION = (
    "J_x dot.double(alpha) + C_x dot(alpha) + H dot(beta) = -K_m beta + M_x, quad "
    "J_y dot.double(beta) + C_y dot(beta) - H dot(alpha) = M_y, quad K_m = i k_u k_i k_m"
)
CONVENTIONS = [
    "α: platform, the outer gimbal with its load, about the stabilized axis x; β: precession about the inner axis y.",
    "Loop gain L = −(signal that comes back) / (signal put in), opened at the potentiometer.",
    "Drift: rate of α with the base at rest; a torque M_y on the precession axis turns the platform by −M_y/H.",
]
SOURCES = ["STAB-POWER-2DOF; GSP ch. 5, eq. 5-1..5-23, corrected by EG1-EG6"]


def k_m(parameters: Mapping[str, Any]) -> float:
    """Stiffness of the correction, N.m/rad: ratio k_u k_i k_m, with the gyro's pickoff as potentiometer (5-5)."""
    p = parameters
    return float(p["stabilizer.ratio"] * p["gyro.K_sg_y"] * p["stabilizer.k_i"] * p["stabilizer.k_m"])


def routh_limit(H: float, J_x: float, J_y: float, C_x: float, C_y: float) -> float:
    """Largest stable K_m, N.m/rad: (C_x/J_x + C_y/J_y)(H + C_x C_y/H).

    5-23 as printed drops C_x C_y/H; exact by the Routh table of (5-20).
    """
    return (C_x / J_x + C_y / J_y) * (H + C_x * C_y / H)


def nutation(H: float, J_x: float, J_y: float, C_x: float, C_y: float) -> float:
    """Undamped nutation frequency, Hz: sqrt((H^2 + C_x C_y)/(J_x J_y)) / 2 pi."""
    return math.sqrt((H * H + C_x * C_y) / (J_x * J_y)) / (2.0 * math.pi)


def lean(t: Any, M: float, K_m: float, H: float) -> Any:
    """Precession angle after a load step with the platform taken as held, rad: M/K_m (1 - exp(-K_m t/H))  (5-10)."""
    return M / K_m * (1.0 - np.exp(-K_m * np.asarray(t) / H))


def transient(H: float, K_m: float) -> float:
    """t* = pi H / K_m, s: the lean is then within exp(-pi) = 4.3 % of its end (5-13)."""
    return math.pi * H / K_m


def steady(M: float, H: float, K_m: float, C_y: float) -> float:
    """Platform angle that a constant load leaves, rad: C_y M / (H K_m), 0 only without damping of the precession.

    GSP ch. 5 says that it is always 0 (EG4).
    """
    return C_y * M / (H * K_m)


def from_record(record: Record, specification: Specification | None = None) -> LoopResult:
    """The Result.  Raises ReductionError for a record without a whole phase."""
    found = LoopFindings(record)
    p = record.run.parameters
    gyro = {n: float(p[f"gyro.{n}"]) for n in ("H", "J_x", "J_y", "C_x", "C_y")}
    K_m, H = k_m(p), gyro["H"]
    holds = found.of("hold")
    own = drift(holds[0].t, _platform(holds[0])) if holds else None
    for gate in found.of("torque", 1, "step"):
        _load(found, gate, K_m, gyro, own, holds[0] if holds else None)
    points = found.open_loop("stabilizer", "stabilizer.e", "exciter.test[1]")
    if points:
        _limits(found, points, K_m, gyro)
    transmitted = found.ratio(
        "isolation", "motion", 1, "gyro.alpha", BASE, plus=BASE,
        caption="Isolation: inertial angle of the platform over that of the base. Points: measured; lines: linear.",
    )  # fmt: skip
    _friction(found, transmitted)
    for gate in found.of("torque", 2):
        _servo(found, gate, H, own)
    for gate in holds:
        _drift(found, gate)
    result = found.result(
        title="Power gyro stabilizer with a two-degree-of-freedom gyro",
        method="Load step, sine sweeps of loop and base, servo torque and drift hold  [STAB-POWER-2DOF]",
        sources=SOURCES,
        equation=EQUATION,
        conventions=CONVENTIONS,
        specification=specification,
    )
    result.summary = result.summary or [
        *margin_sentences(found),
        *told(found.coefficients, "It is stable up to a correction of K_m = {K_m limit}; K_m is {K_m}."),
        *isolation(found, "isolation", "gyro.alpha", plus=BASE),
        *told(found.coefficients, "A load leaves the platform {α*} off and the gyro leaning by M/K_m.", DRIFTS),
    ]
    return result


def _platform(gate: Gate) -> Any:
    """Inertial angle of the platform, rad: against the base, and the base."""
    return gate["gyro.alpha"] + gate[BASE]


def _load(
    found: LoopFindings, gate: Gate, K_m: float, gyro: Mapping[str, float], own: Drift | None, quiet: Gate | None
) -> None:
    """Lean and platform after the load step, the platform's own drift taken off with its uncertainty."""
    M, H, C_y = gate.amplitude, gyro["H"], gyro["C_y"]
    rate, u_rate = (own.rate, own.u) if own is not None else (0.0, 0.0)
    b = found.step(gate, "gyro.beta", scale=ARCSEC, unit="″", y_name="precession β", quiet=quiet)
    a = found.step(gate, "gyro.alpha", scale=ARCSEC, unit="″", y_name="platform α", plus=BASE, drift=rate, quiet=quiet)
    a = replace(a, u_change=math.hypot(a.u_change, u_rate * float(gate.t[-1] - gate.t[0])))
    found.measure(
        "K_m",
        "stiffness of the correction, M / β*",
        "N·m/rad",
        *_inverse(M, b.change, b.u_change),
        closed=K_m,
        unsettled=b.unsettled,
    )
    t_star = transient(H, K_m)
    near = np.interp([t_star, t_star + b.u_settled], gate.t - gate.t[0], gate["gyro.beta"] - b.initial)
    left = 1.0 - float(near[0]) / b.change
    residual = 100.0 * math.hypot(b.u_change, near[1] - near[0]) / abs(b.change)
    found.measure(
        "β(t*)", "lean still missing at t* = πH/K_m", "%", 100.0 * left, residual, closed=100.0 * math.exp(-math.pi)
    )
    found.measure(
        "t_5 β", "settling of the lean to 5 %", "s", b.settled_5, b.u_settled, closed=H / K_m * math.log(20.0)
    )
    closed = steady(M, H, K_m, C_y)
    found.measure("α*", "steady platform angle", "″", a.change / ARCSEC, a.u_change / ARCSEC,
                  closed=closed / ARCSEC, unsettled=a.unsettled)  # fmt: skip
    if closed:
        stiffness = _inverse(M, a.change, a.u_change)
        found.measure(
            "S", "stiffness of the platform, M / α*", "N·m/rad", *stiffness, closed=M / closed, unsettled=a.unsettled
        )
    found.measure("overshoot α", "of the platform angle", "%", 100.0 * a.overshoot, 100.0 * a.u_change / abs(a.change))
    found.measure("t_5 α", "settling of the platform to 5 %", "s", a.settled_5, a.u_settled)
    found.measure("t_2 α", "settling of the platform to 2 %", "s", a.settled_2, a.u_settled)


def _inverse(M: float, change: float, u: float) -> tuple[float | None, float]:
    return (M / change, abs(M / change**2) * u) if change else (None, 0.0)


def _limits(found: LoopFindings, points: list[Point], K_m: float, gyro: Mapping[str, float]) -> None:
    """The phase of L passes -180 degrees at the undamped nutation frequency, where its gain tells the limit of K_m."""
    values = margins.measured_values(points, found.excluded["stabilizer"])
    if "upper" not in values:
        return
    factor, u = values["upper"]
    limit = routh_limit(**gyro)
    name = "K_m at which the loop is at its limit"
    found.measure("K_m limit", name, "N·m/rad", K_m * factor, K_m * u, closed=limit)
    found.measure("f_n", "undamped nutation frequency", "Hz", *values["f_upper"], closed=nutation(**gyro))


def _friction(found: LoopFindings, points: list[Point]) -> None:
    """The base turns the platform through the damping of the axis."""
    if points:
        at = min(points, key=lambda q: abs(q.f - 1.0))
        linear = found.excited("discrete", "motion", 1, "gyro.alpha", [at.f], plus=BASE)
        size = 20.0 * math.log10(abs(at.value))
        closed = None if linear is None else 20.0 * math.log10(abs(linear[0]))
        found.measure(
            "isolation", f"platform over base at {at.f:g} Hz", "dB", size, 8.686 * (at.u or 0.0), closed=closed
        )


def _servo(found: LoopFindings, gate: Gate, H: float, own: Drift | None) -> None:
    """What the torque adds to the platform's own drift."""
    d = drift(gate.t, _platform(gate))
    rate, u = (d.rate - own.rate, math.hypot(d.u, own.u)) if own is not None else (d.rate, d.u)
    closed = -gate.amplitude / H / DPH
    found.measure(
        "servo rate", "turned by M_y on the precession axis, −M_y/H", "°/h", rate / DPH, u / DPH, closed=closed
    )


def _drift(found: LoopFindings, gate: Gate) -> None:
    """Truth: the static drift of the gyro at rest, where f = (0, 0, g): X = Y = 0, Z = -1."""
    p = found.record.run.parameters
    truth = None
    if "gyro.Dx_zz" in p and not p.get("motion.preset"):
        truth = float(p["gyro.Dx_0"]) - float(p["gyro.Dx_z"]) + float(p["gyro.Dx_zz"])
    found.drift(gate, "gyro.alpha", truth=truth, walk=float(p.get("gyro.white_x", 0.0)))
