"""Record of the three-gimbal platform -> stiffness, margins, coupling, drift, and what the flight did to it."""

from __future__ import annotations

import math

import numpy as np

from gyrobench.record.record import Record
from gyrobench.reduction.loops.gimbals import DEG, Flight, legs_table, lock_table, over_time, rate_servo_limits, spans
from gyrobench.reduction.loops.loop_limits import bandwidth
from gyrobench.reduction.loops.loop_measures import Gate, cross_axis, drift, response
from gyrobench.reduction.loops.loop_result import LoopFindings
from gyrobench.reduction.loops.loop_summary import margins, told
from gyrobench.result import LoopResult, Specification
from gyrobench.units import ARCSEC, DPH

AXES = ("pitch", "roll", "azimuth")
REST = "drift"  # label of the drift hold; the other phases without excitation are legs
COUPLING = 4.0  # Hz, where the coupling between the axes is shown
DRIFTS = ("gyro_b.drift_y", "gyro_a.drift_x", "gyro_a.drift_y")  # about x, y, z of the platform


def from_record(record: Record, specification: Specification | None = None) -> LoopResult:
    """Result of one run.  Raises ReductionError for a record without a whole phase."""
    found = LoopFindings(record)
    summary = _flight(found)
    _loads(found)
    for k, axis in enumerate(AXES, 1):
        found.open_loop(axis, f"{axis}.e", f"exciter.test[{k}]", k)
    lag = float(record.run.parameters.get("platform.lag", 0.0))
    _coupling(found)
    _command(found)
    _drift(found)
    return found.result(
        title="Three-gimbal platform with two gyros",
        method="A flight of the base; load steps, sine sweeps of the loops, commanded rate, drift hold",
        sources=["PLATFORM-3GIMBAL-2DOF; GSP ch. 5, section 5.2.1 (no equations there)"],
        equation="[bold(a)_o space bold(a)_m space bold(a)_i] (dot(o), dot(m), dot(i))^T = "
        "T_1 bold(s) - bold(omega)_b, quad det = cos m, quad bold(u)_A = R(i) bold(u)",
        conventions=[
            "o, m, i: outer, middle and azimuth gimbal. Joint angles: pitch about x, roll about y, azimuth about z.",
            "Platform error: size of the integral of the platform's rate in the flight, less its drift at rest.",
            "Gimbal lock is told within 5° of m = 90°; the largest gimbal rate for a unit rate of the base is 1/cos m.",
            "L: the loop opened at the input of a channel, the others closed; what comes back over what is put in.",
        ],
        summary=[
            *summary,
            *margins(found, *AXES),
            *bandwidth(found, {axis: {"servo": lag} for axis in AXES}),
            *told(found.coefficients, "At rest it drifts by {drift x}, {drift y} and {drift z} about x, y and z."),
        ],
        ranked_by="platform error",
        specification=specification,
    )  # fmt: skip


def _rest(found: LoopFindings) -> list[Gate]:
    return [g for g in found.of("hold") if g.label == REST]


def _loads(found: LoopFindings) -> None:
    """The servo yields by M / (drag feedback) when the channel has no integral; drag and lag are the platform's."""
    p = found.record.run.parameters
    drag, gain = p.get("platform.drag"), p.get("platform.rate_gain", 1.0)
    feedback = float(p["gyro_a.K_sg_x"]) * float(p["pitch.K"]) * gain if "pitch.K" in p else None
    for gate in found.of("torque", shape="step"):
        axis = AXES[gate.axis - 1]
        output = f"platform.theta[{gate.axis}]"
        own = next((drift(g.t, g[output]).rate for g in _rest(found)), 0.0)
        quiet = next(iter(_rest(found)), None)
        step = found.step(gate, output, scale=ARCSEC, unit="″", y_name=f"{axis} gimbal", drift=own, quiet=quiet)
        closed = drag * feedback if drag and feedback and not p.get("pitch.integral") else None
        if step.change and closed:
            stiffness, u = gate.amplitude / step.change, abs(gate.amplitude / step.change**2) * step.u_change
            meaning = "stiffness, torque over angle that it leaves"
            found.measure(f"S {axis}", meaning, "N·m/rad", stiffness, u, closed=closed, unsettled=step.unsettled)
        found.measure(f"t_5 {axis}", "settling to 5 % after the load step", "s", step.settled_5, step.u_settled,
                      unsettled=step.unsettled)  # fmt: skip


def _coupling(found: LoopFindings) -> None:
    points = {}
    for k in (1, 2, 3):
        for gate in found.of("test", k, "sine"):
            if math.isclose(gate.f, COUPLING):
                for j in (1, 2, 3):
                    name = f"platform.theta[{j}]"
                    points[(k, j)] = response(gate.t, gate[f"exciter.test[{k}]"], gate[name], gate.f).value
    if points:
        table = cross_axis(points, AXES, f"test signals at {COUPLING:g} Hz")
        table["caption"] = "Gimbal angles of the axes, in percent of the excited one's"
        found.tables.append(table)


def _command(found: LoopFindings) -> None:
    """Less the drift that the hold showed."""
    for gate in (g for g in found.of("command", shape="step") if g.amplitude):
        own = next((drift(g.t, g[f"platform.attitude[{gate.axis}]"]).rate for g in _rest(found)), 0.0)
        late = gate.t > gate.t[0] + 0.3 * (gate.t[-1] - gate.t[0])
        y = gate[f"platform.attitude[{gate.axis}]"][late]
        got = drift(gate.t[late], y)
        share, u = (got.rate - own) / gate.amplitude, got.u / abs(gate.amplitude)
        known = not any(".k_" in name for name in found.record.run.changed)  # a torquer set by hand is as it is
        truth = 1.0 + float(found.record.run.options.get("torquer", 0.0)) if known else 1.0
        found.measure("rate gain", "rate of the platform over rate commanded", "1", share, u, truth=truth)


def _drift(found: LoopFindings) -> None:
    for gate in _rest(found):
        for axis, k, name in zip("xyz", (1, 2, 3), DRIFTS, strict=True):
            got = drift(gate.t, gate[f"platform.attitude[{k}]"])
            truth = float(np.mean(gate[name])) / DPH if name in gate.channels else None
            rate, u = got.rate / DPH, got.u / DPH
            found.measure(f"drift {axis}", f"of the platform about {axis}", "°/h", rate, u, truth=truth)
            if axis == "x":
                kept = [k for k in ("dev", "lo", "hi") if k in got.allan]
                in_dph = {str(k): [v / DPH for v in got.allan[k]] for k in kept}
                found.allan = {**got.allan, **in_dph, "unit": "°/h"} if got.allan else {}
        scale = float(found.record.run.parameters.get("gyro_a.K_sg_y", 10.0))
        apart = drift(gate.t, (gate["gyro_b.u_x"] - gate["gyro_a.u_y"]) / scale)
        truth = float(np.mean(gate["gyro_a.drift_y"] - gate["gyro_b.drift_x"])) / DPH
        meaning = "the fourth axis against the third, both about z: difference of two drifts"
        found.measure("monitor", meaning, "°/h", apart.rate / DPH, apart.u / DPH, truth=truth)


def _flight(found: LoopFindings) -> list[str]:
    """What the flight did: errors, gimbal rates, lock."""
    legs = [g for g in found.of("hold") if g.label != REST]
    if not legs:
        return []
    flight = Flight(legs, "platform.attitude", next(iter(_rest(found)), None))
    mount = int(found.record.run.options.get("mount", 1))
    middle = flight[f"platform.theta[{2 if mount else 1}]"]
    end, most = float(flight.error[-1]), float(flight.error.max())
    u = flight.u(found.record.run.step)
    found.measure("platform error", "largest in the flight, drift taken off", "°", most / DEG, u / DEG)
    found.measure("error at the end", "of the flight", "°", end / DEG, flight.noise / DEG)
    found.tables.append(_legs(flight, middle))
    locked = spans(flight["platform.lock"])
    found.tables.append(lock_table(flight, {"lock": flight["platform.lock"]}, middle, "middle gimbal"))
    theta = {axis: flight[f"platform.theta[{k}]"] / DEG for k, axis in enumerate(AXES, 1)}
    found.responses += [
        over_time(
            "platform error", flight.t, {"error": flight.error / DEG},
            caption="Error of the platform in the flight: how far it has turned in space.",
        ),
        over_time("gimbal angles", flight.t, theta, y_name="joint angle", caption="Gimbal angles in the flight."),
    ]  # fmt: skip
    if any(np.any(flight[f"{g}.saturated"] > 0.5) for g in ("gyro_a", "gyro_b")):
        found.warnings.append(
            "A pickoff of the gyros was saturated in the flight: the platform had left them; real ones reach a stop."
        )
    rates = [f"platform.theta_dot[{k}]" for k in (1, 2, 3)]
    limits = rate_servo_limits(flight, rates, found.record.run.parameters.get("platform.rate_max"))
    if not locked:
        kept = f"The platform kept its attitude to {most / DEG:.3g}° in the flight; its gimbals did not lock."
        return [kept, *limits]
    a, b = locked[0]
    when, angle = float(flight.t[a]), float(middle[a]) / DEG
    text = f"Gimbal lock from t = {when:.4g} s (leg “{flight.leg_at(a)}”) at {angle:.4g}° of the middle gimbal"
    if b < flight.t.size - 1:
        text += f", to t = {flight.t[b]:.4g} s"
    found.warnings.insert(0, f"{text}.")
    before = float(flight.error[: a + 1].max()) / DEG
    return [
        f"{text}: the platform was dragged along by up to {most / DEG:.5g}°; until then it was kept to {before:.2g}°.",
        *limits,
    ]


def _legs(flight: Flight, middle: np.ndarray) -> dict[str, object]:
    def rings(s: slice) -> float:
        return max(float(np.abs(flight[f"platform.theta_dot[{k}]"][s]).max()) for k in (1, 2, 3)) / DEG

    def steepest(s: slice) -> float:
        return 1.0 / max(1e-3, float(np.min(np.abs(np.cos(middle[s])))))

    caption = "1/cos m: gimbal rate for a unit rate of the base along the normal of the ring plane, at most 1000"
    return legs_table(flight, caption, {"gimbal rate / (°/s)": rings, "largest 1/cos m": steepest})
