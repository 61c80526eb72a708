"""Record of the three-axis platform -> margins, stiffness, coupling of the axes, isolation, drift."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gyrobench import drift as static
from gyrobench.frames import G0
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.loops.estimator_metrics import rms
from gyrobench.reduction.loops.loop_limits import bandwidth
from gyrobench.reduction.loops.loop_measures import cross_axis, response
from gyrobench.reduction.loops.loop_toolkit import (
    ARCSEC,
    Account,
    Gate,
    LoopReduction,
    LoopResult,
    Point,
    Record,
    margins,
    told,
)
from gyrobench.reduction.loops.platform_measures import peak_noise
from gyrobench.reduction.loops.rides import share, still

from .budget import budget
from .optical_reduction import HELD, OpticalReduction

AXES = ("pitch", "roll", "azimuth")
RATES = (
    "The gyros are rebalanced: their currents are the rates, 1 V is 1 rad/s; each axis has a current, a rate and a "
    "position loop, and the open loop is that of the rate."
)
XYZ = "xyz"
ANGLES = tuple(f"platform.attitude[{k}]" for k in (1, 2, 3))


class Reduction(LoopReduction):
    """Loads, commands, motion of the base, loops and drift of a platform of three gimbals."""

    @classmethod
    def from_record(cls, record: Record) -> LoopResult:
        """Return what a record says, of one with an optical loop what that does.  Raises ReductionError."""
        optical = "tracker.miss[1]" in record.channels
        return OpticalReduction.from_record(record) if optical else super().from_record(record)

    def measure(self) -> Account:
        found = self.found
        slowest = {g.axis: g for g in sorted(found.of("motion", shape="sine"), key=lambda g: -g.f)}
        self.slowest = [slowest[axis] for axis in sorted(slowest)]  # sine of the base about each axis
        budgeted = [*self.slowest, *found.of("command", shape="sine"), *found.of("hold")]
        self.shares = budget(found, {_motion(g): g for g in budgeted}, ANGLES)
        coupled, taken, ride = self._coupling(), self._isolation(), self._ride()
        self.sentences = (taken, coupled, ride)
        for gate in found.of("torque", shape="step"):
            self._load(gate)
        for gate in found.of("command", shape="step"):
            self._command(gate)
        for k, axis in enumerate(AXES, 1):
            found.open_loop(axis, f"{axis}.e", f"exciter.test[{k}]", k, held=HELD)
        if found.at_rest is not None:
            self._drift(found.at_rest)
        self._lock()
        rates = "rebalance_x.K_p" in self.run.parameters
        return Account(
            method="Load steps, commanded sines, sines of the base, test sines of each axis and drift of a platform of "
            "three gimbals",
            sources=[
                "PLATFORM-3AXIS-DYN, PLATFORM-3AXIS-KIN, DECOUPLE-T2, DECOUPLE-BENCH-83MIL; Xia 2008, "
                "ch. 5, eq. 5.1.1-5.2.8, corrected by EX24-EX28",
                *(["SERVO-3LOOP, GYRO-REBALANCE; Xia 2008, section 1.3.2, fig. 1.3, 5.2.4"] if rates else []),
            ],
            equation="M(q) dot.double(q) + b = M_m, quad u_A = T_2 u, quad T_2 = T_1^(-1)",
            conventions=[
                "Motor axes: pitch about x of the roll gimbal, roll about y of the base, azimuth about z of the pitch "
                "one.",
                "Platform axes x, y, z belong to the inner element; commands and attitudes are along them.",
                "Loop gains are those of one axis with the two others closed.",
                *([RATES] if rates else []),
            ],
        )

    def summary(self) -> list[str]:
        found, text = self.found, "At rest it drifts by {drift x}, {drift y} and {drift z}."
        return [
            *margins(found, *AXES),
            *bandwidth(found, self._lags()),
            *told(found.coefficients, *self.sentences, text),
        ]

    def _by(self, motion: str, before: str) -> str:
        """Return the largest source of a motion and its share: "by viscous friction (99 %)"; "" without a budget."""
        sources = self.shares.get(motion, {})
        most = max(sources, key=lambda n: sources[n], default="")
        size = f" ({100.0 * sources[most]:.0f} %)" if most and sources[most] < 0.995 else ""  # beyond: others cancel
        return f"{before}by {most}{size}" if most else ""

    def _coupling(self) -> str:
        """Measure cross over main angle of a commanded sine.  [DECOUPLE-BENCH-83MIL]"""
        found, gates = self.found, self.found.of("command", shape="sine")
        points: dict[tuple[int, int], complex] = {}
        sizes: dict[str, tuple[float, Gate]] = {}
        for gate in gates:
            main, name = gate[ANGLES[gate.axis - 1]], XYZ[gate.axis - 1]
            there = {j: response(gate.t, main, gate[angle], gate.f) for j, angle in enumerate(ANGLES, 1)}
            points |= {(gate.axis, j): p.value for j, p in there.items()}
            cross, u = _norm([p for j, p in there.items() if j != gate.axis])
            sizes[name] = cross, gate
            meaning = f"other axes over {name}, commanded sine of {gate.f:g} Hz"
            found.measure(f"cross {name}", meaning, "%", 100.0 * cross, 100.0 * u)
            rate = response(gate.t, gate[f"exciter.command[{gate.axis}]"], main, gate.f)
            reached = abs(rate.value) * 2.0 * math.pi * gate.f
            meaning = "amplitude of the angle reached over that commanded"
            found.measure(f"reached {name}", meaning, "1", reached, reached * (rate.u or 0.0))
        if not gates:
            return ""
        caption = "Angle about each platform axis over that about the commanded one"
        found.tables.append(cross_axis(points, tuple(XYZ), f"commanded sines of {gates[0].f:g} Hz", caption))
        axis = max(sizes, key=lambda n: sizes[n][0])
        cause = self._by(_motion(sizes[axis][1]), ", ")
        return f"A sine about {axis} moves the other axes by {{cross {axis}}} of its own angle, the most of all{cause}."

    def _isolation(self) -> str:
        """Measure what the platform takes over of the base: the whole angle, not only that about the base's axis."""
        found, taken_over = self.found, []
        for gate in self.slowest:
            axis, base = XYZ[gate.axis - 1], gate[f"motion.angle[{gate.axis}]"]
            taken, u = _norm([response(gate.t, base, gate[name], gate.f) for name in ANGLES])
            joints = ", ".join(f"{math.degrees(gate[f'platform.theta[{k}]'].mean()):.1f}°" for k in (1, 2, 3))
            size = f"{plain(math.degrees(gate.amplitude), 3)}° at {gate.f:g} Hz"
            meaning = f"platform over base, base about {axis}, {size}, joints about {joints}".replace("-", "−")
            if taken:
                level = 20.0 * math.log10(taken)
                found.measure(f"isolation {axis}", meaning, "dB", level, 20.0 / math.log(10.0) * u / taken)
                cause = self._by(_motion(gate), ", carried over ")
                taken_over.append(f"{{-isolation {axis}}} about {axis} ({gate.f:g} Hz{cause})")
        found.ratio(
            "attitude over base angle", "motion", 1, ANGLES[0], "exciter.motion_angle[1]",
            caption="Isolation: platform about x over base about x.",
        )  # fmt: skip
        return f"A swinging base reaches the platform smaller by {', '.join(taken_over)}." if taken_over else ""

    def _ride(self) -> str:
        """Measure the attitude while the base moves as recorded, less its mean and slope, each axis and all of them
        over the base.
        """
        found = self.found
        gate = next((g for g in found.of("hold") if g.label == "ride"), None)
        if gate is None:
            return ""
        left = [still(gate.t, gate[name]) for name in ANGLES]
        for axis, y in zip(XYZ, left, strict=True):
            meaning = "attitude in the ride, rms about mean and slope"
            found.measure(f"error {axis}", meaning, "″", *rms(y).pair, scale=ARCSEC)
        taken = share(left, [still(gate.t, gate[f"motion.angle[{k}]"]) for k in (1, 2, 3)])
        found.measure("ride", "platform over base, rms of all axes", "dB", *taken.pair)
        if not math.isfinite(taken.value):
            return ""
        cause = self._by(gate.label, ", carried over ")
        return f"In the ride the base's motion reaches the platform smaller by {{-ride}}{cause}."

    def _load(self, gate: Gate) -> None:
        found, quiet = self.found, next(iter(self.found.of("hold")), None)
        rest = [gate.rest(name) for name in ANGLES]
        moved = np.array([gate[n] - (float(r.mean()) if r.size else 0.0) for n, r in zip(ANGLES, rest, strict=True)])
        sizes, M = np.linalg.norm(moved, axis=0), gate.amplitude
        at = int(np.argmax(sizes))
        peak, along = float(sizes[at]), moved[:, at] / max(float(sizes[at]), 1e-300)
        at_rest = None if quiet is None else along @ np.array([quiet[n] for n in ANGLES])
        u = peak_noise(at_rest, rest[0].size, at, moved)
        axis = AXES[gate.axis - 1]
        found.measure(f"peak {axis}", f"largest attitude after {M:g} N·m about {axis}", "″", peak, u, scale=ARCSEC)
        if peak:
            meaning = "torque over that attitude"
            found.measure(f"load/peak {axis}", meaning, "N·m/rad", M / peak, M * u / peak**2)
        main = int(np.argmax(np.abs(moved).max(axis=1)))
        found.step(gate, ANGLES[main], scale=ARCSEC, unit="″", y_name=f"attitude about {XYZ[main]}", quiet=quiet)

    def _command(self, gate: Gate) -> None:
        """Measure by how much the slope of the angle, in the last half of the step, differs from that before."""
        half, angle = gate.t.size // 2, ANGLES[gate.axis - 1]
        t, before = gate.t[half:], gate.rest(angle)
        (slope, _), cov = np.polyfit(t - t[0], gate[angle][half:], 1, cov=True)
        (own, _), cov_own = np.polyfit(np.arange(before.size) * float(t[1] - t[0]), before, 1, cov=True)
        u = math.sqrt(cov[0, 0] + cov_own[0, 0]) / abs(gate.amplitude)
        meaning = "rate reached over rate commanded, command step"
        self.found.measure("rate gain", meaning, "1", (slope - own) / gate.amplitude, u, closed=1.0)

    def _drift(self, gate: Gate) -> None:
        """Measure each axis: it turns with the drift of its gyro, for the specific force of the element at rest."""
        up = _up([gate[f"platform.theta[{k}]"].mean() for k in (1, 2, 3)])  # the commands have turned it
        p = self.run.parameters
        for name, axis in zip(ANGLES, XYZ, strict=True):
            truth, slot = None, f"gyro_{axis}"
            named = {n: float(p[f"{slot}.{n}"]) for n in static.NAMES if p.get(f"{slot}.{n}") is not None}
            mount, gravity = p.get(f"{slot}.mount"), p.get("motion.gravity")
            if mount is not None and gravity is not None and len(named) == len(static.NAMES):
                truth = float(static.drift(-np.asarray(mount, float) @ up * float(gravity) / G0, named))
            self.found.drift(gate, name, key=f" {axis}", truth=truth, gyro=(slot, ""))

    def _lags(self) -> dict[str, dict[str, float]]:
        """Return for each loop the lags of its plant, s: gyro J/C, motor L/R, and the corner of its stabilizer."""
        p, lags = self.run.parameters, {}
        for k, (axis, gyro) in enumerate(zip(AXES, XYZ, strict=True)):
            J, C = (float(p.get(f"gyro_{gyro}.{n}", x)) for n, x in (("J", 0.0), ("C", 1.0)))
            L, R = (float(p.get(f"platform.{n}", x)[k]) for n, x in (("L", [0.0] * 3), ("R", [1.0] * 3)))
            corner = float(p.get(f"{axis}.T2", 0.0))
            lags[axis] = {"gyro": J / C, "motor": L / R, "corner of the stabilizer": corner}
            if current := float(p.get(f"{axis}.K_c", 0.0)):
                lags[axis]["motor"] = L / current  # of the current loop, which cancels L/R
            if loop := float(p.get(f"rebalance_{gyro}.K_p", 0.0)):
                gain = loop * float(p[f"gyro_{gyro}.k"]) * float(p[f"gyro_{gyro}.K_sg"])
                lags[axis]["rebalance"] = C / (gain * float(p[f"gyro_{gyro}.H"]))
        return lags

    def _lock(self) -> None:
        channels = self.record.channels
        if np.any(hit := channels["platform.lock"] > 0.5):
            first = int(np.argmax(hit))
            pitch = math.degrees(channels["platform.theta[1]"][first])
            text = (
                f"The gimbals were near their lock, first at t = {plain(channels['time'][first], 4)} s, pitch "
                f"{plain(pitch, 3)}°."
            )
            self.found.warn("platform.lock", text)


def _norm(points: list[Point]) -> tuple[float, float]:
    """Return the root of the sum of squares of the gains, and its standard uncertainty."""
    size = math.sqrt(sum(abs(p.value) ** 2 for p in points))
    return size, math.sqrt(sum((abs(p.value) ** 2 * (p.u or 0.0)) ** 2 for p in points)) / size if size else 0.0


def _motion(gate: Gate) -> str:
    """Return the name of a phase in the budget."""
    kind = {"motion": "base", "command": "command"}.get(gate.kind, gate.label)
    return f"{kind} about {XYZ[gate.axis - 1]}, {gate.f:g} Hz" if gate.f else kind


def _up(q: Any) -> Any:
    """Return up in platform axes for these joint angles (pitch, roll, azimuth), base level: third column of C_b^a."""
    f, r, a = (float(x) for x in q)
    x, y, z = -math.sin(r), math.sin(f) * math.cos(r), math.cos(f) * math.cos(r)
    return np.array([math.cos(a) * x + math.sin(a) * y, -math.sin(a) * x + math.cos(a) * y, z])
