"""Record of the three-axis platform -> margins, stiffness, coupling of the axes, isolation, drift."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from gyrobench import drift as static
from gyrobench.frames import G0
from gyrobench.record.record import Record
from gyrobench.reduction.loops.estimator_metrics import rms
from gyrobench.reduction.loops.loop_limits import bandwidth
from gyrobench.reduction.loops.loop_measures import Gate, Point, cross_axis, response
from gyrobench.reduction.loops.loop_result import LoopFindings
from gyrobench.reduction.loops.loop_summary import margins, told
from gyrobench.reduction.loops.rides import share, still
from gyrobench.result import LoopResult, Specification
from gyrobench.units import ARCSEC

from .budget import budget

AXES = ("pitch", "roll", "azimuth")
XYZ = "xyz"
Shares = Mapping[str, Mapping[str, float]]  # motion -> source -> share of the variance
ANGLES = tuple(f"platform.attitude[{k}]" for k in (1, 2, 3))


def from_record(record: Record, specification: Specification | None = None) -> LoopResult:
    """Result of one run.  Raises ReductionError for a record without a whole phase."""
    found = LoopFindings(record)
    shares = budget(found, _budgeted(found), ANGLES)
    coupled, taken, ride = _coupling(found, shares), _isolation(found, shares), _ride(found, shares)
    _loads(found)
    _command(found)
    for k, axis in enumerate(AXES, 1):
        found.open_loop(axis, f"{axis}.e", f"exciter.test[{k}]", k)
    _drift(found)
    _limits(found)
    return found.result(
        title="Three-axis stabilized platform",
        method="Load steps, commanded sines, sines of the base, test sines of each axis and drift of a platform of "
        "three gimbals",
        sources=[
            "PLATFORM-3AXIS-DYN, PLATFORM-3AXIS-KIN, DECOUPLE-T2, DECOUPLE-BENCH-83MIL; Xia 2008, "
            "ch. 5, eq. 5.1.1-5.2.8, corrected by EX24-EX28"
        ],
        equation="M(q) dot.double(q) + b = M_m, quad u_A = T_2 u, quad T_2 = T_1^(-1)",
        conventions=[
            "Motor axes: pitch about x of the roll gimbal, roll about y of the base, azimuth about z of the pitch one.",
            "Platform axes x, y, z belong to the inner element; commands and attitudes are along them.",
            "Loop gains are those of one axis with the two others closed.",
        ],
        summary=[
            *margins(found, *AXES),
            *bandwidth(found, _lags(found)),
            *told(found.coefficients, taken, coupled, ride, "At rest it drifts by {drift x}, {drift y} and {drift z}."),
        ],
        specification=specification,
    )


def _norm(points: list[Point]) -> tuple[float, float]:
    """Root of the sum of squares of the gains, and its standard uncertainty."""
    size = math.sqrt(sum(abs(p.value) ** 2 for p in points))
    return size, math.sqrt(sum((abs(p.value) ** 2 * (p.u or 0.0)) ** 2 for p in points)) / size if size else 0.0


def _slowest(found: LoopFindings) -> list[Gate]:
    """Return the slowest sine of the base about each axis."""
    slowest = {g.axis: g for g in sorted(found.of("motion", shape="sine"), key=lambda g: -g.f)}
    return [slowest[axis] for axis in sorted(slowest)]


def _budgeted(found: LoopFindings) -> dict[str, Gate]:
    """Return the phases that have an error budget, by their names in it."""
    gates = [*_slowest(found), *found.of("command", shape="sine"), *found.of("hold")]
    return {_motion(g): g for g in gates}


def _motion(gate: Gate) -> str:
    kind = {"motion": "base", "command": "command"}.get(gate.kind, gate.label)
    return f"{kind} about {XYZ[gate.axis - 1]}, {gate.f:g} Hz" if gate.f else kind


def _by(shares: Shares, motion: str) -> str:
    """Return the largest source of a motion and its share: "by viscous friction (99 %)"; "" without a budget."""
    sources = shares.get(motion, {})
    most = max(sources, key=lambda n: sources[n], default="")
    size = f" ({100.0 * sources[most]:.0f} %)" if most and sources[most] < 0.995 else ""  # beyond: others cancel
    return f"by {most}{size}" if most else ""


def _coupling(found: LoopFindings, shares: Shares) -> str:
    """Cross over main angle of a commanded sine.  [DECOUPLE-BENCH-83MIL]"""
    points: dict[tuple[int, int], complex] = {}
    gates = found.of("command", shape="sine")
    for gate in gates:
        main = gate[ANGLES[gate.axis - 1]]
        there = {j: response(gate.t, main, gate[name], gate.f) for j, name in enumerate(ANGLES, 1)}
        points |= {(gate.axis, j): p.value for j, p in there.items()}
        cross, u = _norm([p for j, p in there.items() if j != gate.axis])
        name = XYZ[gate.axis - 1]
        meaning = f"other axes over {name}, commanded sine of {gate.f:g} Hz"
        found.measure(f"cross {name}", meaning, "%", 100.0 * cross, 100.0 * u)
        rate = response(gate.t, gate[f"exciter.command[{gate.axis}]"], main, gate.f)
        reached = abs(rate.value) * 2.0 * math.pi * gate.f
        meaning = "amplitude of the angle reached over that commanded"
        found.measure(f"reached {name}", meaning, "1", reached, reached * (rate.u or 0.0))
    if not gates:
        return ""
    table = cross_axis(points, tuple(XYZ), f"commanded sines of {gates[0].f:g} Hz")
    table["caption"] = "Angle about each platform axis over that about the commanded one"
    found.tables.append(table)
    worst = max(range(len(gates)), key=lambda k: found.estimates[f"cross {XYZ[gates[k].axis - 1]}"])
    axis = XYZ[gates[worst].axis - 1]
    by = _by(shares, _motion(gates[worst]))
    cause = f", {by}" if by else ""
    return f"A sine about {axis} moves the other axes by {{cross {axis}}} of its own angle, the most of all{cause}."


def _isolation(found: LoopFindings, shares: Shares) -> str:
    """What the platform takes over of the base: the whole angle, not only that about the base's axis."""
    taken_over = []
    for gate in _slowest(found):
        base = gate[f"motion.angle[{gate.axis}]"]
        taken, u = _norm([response(gate.t, base, gate[name], gate.f) for name in ANGLES])
        meaning = f"platform over base, base about {XYZ[gate.axis - 1]} at {gate.f:g} Hz"
        if taken:
            size = 20.0 * math.log10(taken)
            found.measure(f"isolation {XYZ[gate.axis - 1]}", meaning, "dB", size, 20.0 / math.log(10.0) * u / taken)
            by = _by(shares, _motion(gate))
            cause = f", carried over {by}" if by else ""
            taken_over.append(f"{{-isolation {XYZ[gate.axis - 1]}}} about {XYZ[gate.axis - 1]} ({gate.f:g} Hz{cause})")
    found.ratio(
        "attitude over base angle", "motion", 1, ANGLES[0], "exciter.motion_angle[1]",
        caption="Isolation: platform about x over base about x.",
    )  # fmt: skip
    return f"A swinging base reaches the platform smaller by {', '.join(taken_over)}." if taken_over else ""


def _ride(found: LoopFindings, shares: Shares) -> str:
    """Attitude while the base moves as recorded, less its mean and slope, each axis and all of them over the base."""
    gate = next((g for g in found.of("hold") if g.label == "ride"), None)
    if gate is None:
        return ""
    left = [still(gate.t, gate[name]) for name in ANGLES]
    for axis, y in zip(XYZ, left, strict=True):
        error = rms(y)
        meaning = "attitude in the ride, rms about mean and slope"
        found.measure(f"error {axis}", meaning, "″", error.value / ARCSEC, error.u / ARCSEC)
    taken = share(left, [still(gate.t, gate[f"motion.angle[{k}]"]) for k in (1, 2, 3)])
    found.measure("ride", "platform over base, rms of all axes", "dB", taken.value, taken.u)
    if not math.isfinite(taken.value):
        return ""
    by = _by(shares, gate.label)
    cause = f", carried over {by}" if by else ""
    return f"In the ride the base's motion reaches the platform smaller by {{-ride}}{cause}."


def _loads(found: LoopFindings) -> None:
    quiet = next(iter(found.of("hold")), None)
    for gate in found.of("torque", shape="step"):
        rest = [gate.rest(name) for name in ANGLES]
        moved = np.array([gate[n] - (float(r.mean()) if r.size else 0.0) for n, r in zip(ANGLES, rest, strict=True)])
        angle = np.linalg.norm(moved, axis=0)
        peak = float(angle.max())
        u = float(np.std(np.diff(moved[:, -angle.size // 10 :]))) / math.sqrt(2.0)
        axis = AXES[gate.axis - 1]
        found.measure(
            f"peak {axis}",
            f"largest attitude after {gate.amplitude:g} N·m about {axis}",
            "″",
            peak / ARCSEC,
            u / ARCSEC,
        )
        if peak:
            found.measure(
                f"load/peak {axis}",
                "torque over that attitude",
                "N·m/rad",
                gate.amplitude / peak,
                gate.amplitude * u / peak**2,
            )
        main = int(np.argmax(np.abs(moved).max(axis=1)))
        found.step(gate, ANGLES[main], scale=ARCSEC, unit="″", y_name=f"attitude about {XYZ[main]}", quiet=quiet)


def _command(found: LoopFindings) -> None:
    """A commanded rate: by how much the slope of the angle, in the last half of the step, differs from that before."""
    for gate in found.of("command", shape="step"):
        half = gate.t.size // 2
        t, y = gate.t[half:], gate[ANGLES[gate.axis - 1]][half:]
        (slope, _), cov = np.polyfit(t - t[0], y, 1, cov=True)
        before = gate.rest(ANGLES[gate.axis - 1])
        (own, _), cov_own = np.polyfit(np.arange(before.size) * float(t[1] - t[0]), before, 1, cov=True)
        share, u = (slope - own) / gate.amplitude, math.sqrt(cov[0, 0] + cov_own[0, 0]) / abs(gate.amplitude)
        found.measure("rate gain", "rate reached over rate commanded, command step", "1", share, u, closed=1.0)


def _drift(found: LoopFindings) -> None:
    """Each axis turns with the drift of its gyro, for the specific force that the element sees at rest."""
    for gate in (g for g in found.of("hold") if g.label == "drift"):
        up = _up([gate[f"platform.theta[{k}]"].mean() for k in (1, 2, 3)])  # the commands have turned it
        parameters = found.record.run.parameters
        for name, axis in zip(ANGLES, XYZ, strict=True):
            truth, slot = None, f"gyro_{axis}"
            named = {n: parameters.get(f"{slot}.{n}") for n in static.NAMES}
            mount, gravity = parameters.get(f"{slot}.mount"), parameters.get("motion.gravity")
            if mount is not None and gravity is not None and all(v is not None for v in named.values()):
                xyz = -np.asarray(mount, float) @ up * float(gravity) / G0
                truth = float(static.drift(xyz, {n: float(v) for n, v in named.items() if v is not None}))
            found.drift(gate, name, key=f" {axis}", truth=truth)


def _up(q: Any) -> Any:
    """Up in platform axes for these joint angles (pitch, roll, azimuth), base level: third column of C_b^a."""
    f, r, a = (float(x) for x in q)
    x, y, z = -math.sin(r), math.sin(f) * math.cos(r), math.cos(f) * math.cos(r)
    return np.array([math.cos(a) * x + math.sin(a) * y, -math.sin(a) * x + math.cos(a) * y, z])


def _lags(found: LoopFindings) -> dict[str, dict[str, float]]:
    """Return for each loop the lags of its plant, s: gyro J/C, motor L/R, and the corner of its stabilizer."""
    p, lags = found.record.run.parameters, {}
    for k, (axis, gyro) in enumerate(zip(AXES, XYZ, strict=True)):
        J, C = (float(p.get(f"gyro_{gyro}.{n}", x)) for n, x in (("J", 0.0), ("C", 1.0)))
        motor = [p.get(f"platform.{n}", x)[k] for n, x in (("L", [0.0] * 3), ("R", [1.0] * 3))]
        lags[axis] = {
            "gyro": J / C,
            "motor": float(motor[0]) / float(motor[1]),
            "corner of the stabilizer": float(p.get(f"{axis}.T2", 0.0)),
        }
    return lags


def _limits(found: LoopFindings) -> None:
    for name, text in (
        ("platform.saturated", "A motor was at its limit"),
        ("decoupler.saturated", "The secant of the decoupler was at its limit"),
        ("platform.lock", "The gimbals were near their lock"),
    ):
        if name not in found.gates[0].channels:
            continue
        values = found.gates[0].channels[name]
        if np.any(values > 0.5):
            first = int(np.argmax(values > 0.5))
            time = found.gates[0].channels["time"][first]
            pitch = math.degrees(found.gates[0].channels["platform.theta[1]"][first])
            found.warnings.append(f"{text}, first at t = {time:.4g} s, pitch {pitch:.3g}°.")
