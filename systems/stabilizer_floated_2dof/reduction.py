"""Record of an axis with a floated two-degree-of-freedom gyro -> its measures, beside the closed forms.

[STAB-FLOATED-2DOF; GSP ch. 5, eq. 5-24..5-26, corrected by EG7, EG8]
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from gyrobench.reduction.estimation import uncertainty
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.loops import platform_measures as common
from gyrobench.reduction.loops.loop_summary import DRIFTS, isolation, margins
from gyrobench.reduction.loops.loop_toolkit import Account, Gate, LoopReduction, Point, drift, told
from gyrobench.reduction.loops.margins import interpolate_response, measured_values
from gyrobench.result import Table
from gyrobench.units import ARCSEC

from .closed import DoubleLoop, LagLeadLoop, rc_values
from .system import loop_of

ANGLE, RATE = "platform.attitude", "platform.omega[1]"
ENOUGH = 45.0  # degrees of phase margin that GSP ch. 5 asks for
NO_CLOSED = "The closed forms are those of the lag-lead network and of the double loop: the figures stand alone."
C2 = 1e-5  # F, of the network that is printed


class Reduction(LoopReduction):
    """Load step, command, sine sweeps, drift hold and a blow of an axis with a floated gyro as sensor."""

    def measure(self) -> Account:
        found, p = self.found, self.run.parameters
        self.loop, self.hold = loop_of(p), found.at_rest
        found.warn("stabilizer_floated_2dof.no_closed", NO_CLOSED if self.loop is None else "")
        for gate in found.of("torque", 1, "step"):
            if gate.label == "load step":
                self._load(gate)
        for gate in found.of("command", 1, "step"):
            common.command_step(found, gate, RATE, ("t_5 rate", "settling of the rate to 5 %"), y_name="platform rate")
        self._margins(found.open_loop("stabilizer", "stabilizer.e", "exciter.test[1]"))
        base = found.ratio(
            "isolation", "motion", 1, ANGLE, "exciter.motion_angle[1]",
            caption="Isolation: inertial angle of the platform over that of the base. Points: measured; lines: linear.",
        )  # fmt: skip
        common.isolation_near(found, base, self._transmission)
        if self.hold is not None:
            self._drift(self.hold)
        self.after_blow = self._blow()
        return Account(
            method="Load step, command by the gyro's torquer, sine sweeps of loop and base, and drift hold",
            sources=["STAB-FLOATED-2DOF; GSP ch. 5, eq. 5-24..5-26, corrected by EG7, EG8"],
            equation="J_x dot.double(theta) = M - K_m K_x G(s) theta, quad "
            "G(s) = K_G ((1 + tau_1 s)(1 + tau_2 s)) / ((1 + T_1 s)(1 + T_2 s))",
            conventions=[
                "θ: inertial angle of the platform about x, positive like the torque M; K_x θ: the gyro's x pickoff.",
                "Loop gain L = −(signal that comes back) / (signal put in), opened at the input of the network.",
                "A lower gain limit below 1: the loop becomes unstable when its gain falls to this share.",
                "Drift: rate of the platform at rest, that of the gyro's x channel, in precession sign.",
            ],
        )

    def summary(self) -> list[str]:
        text = "The load leaves the platform {θ*} off and turns it by up to {θ_max}; stiffness {S}."
        found = self.found
        told_ = told(found.coefficients, text, DRIFTS)
        return [*margins(found), *isolation(found, "isolation", ANGLE), *told_, *self.after_blow]

    def _truth(self, angle: float) -> float | None:
        """Return the static drift of the x channel, rad/s, on a platform turned by ``angle`` from level: Y = -sin,
        Z = -cos.
        """
        p, names = self.run.parameters, ("0", "y", "z", "yy", "zz", "yz")
        if any(f"gyro.Dx_{n}" not in p for n in names) or p.get("motion.preset"):
            return None
        constant, y, z, yy, zz, yz = (float(p[f"gyro.Dx_{n}"]) for n in names)
        Y, Z = -math.sin(angle), -math.cos(angle)
        return constant + y * Y + z * Z + yy * Y * Y + zz * Z * Z + yz * Y * Z

    def _drift(self, gate: Gate) -> None:
        """Measure drift rate, and the random walk N beside the pickoff's noise, which the loop follows:
        dev2 tau = N2 + a/tau.

        The slope of -1/2 alone does not show N here: noise of the angle, a/tau2 in the variance of the rate, lies over
        it up to some seconds.  Weighted least squares over averaging times from 0.5 s on.
        """
        found, white = self.found, self.run.parameters.get("gyro.white_x")
        truth = self._truth(float(np.mean(gate[ANGLE])))  # the command has turned it
        found.drift(gate, ANGLE, truth=truth, gyro=("gyro", "_x"))
        found.coefficients = [c for c in found.coefficients if c.name != "N"]
        if (allan := found.allan) is None:
            return
        tau, dev, low, high = (np.asarray(x) for x in (allan.tau, allan.dev, allan.lo, allan.hi))
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
            true = math.degrees(float(white)) * 60.0 if white else None
            found.measure("N", "angle random walk", "°/√h", walk, spread, truth=true)

    def _load(self, gate: Gate) -> None:
        """Measure the compliance at rest and in the peak, less the platform's own drift."""
        found, hold = self.found, self.hold
        own = drift(hold.t, hold[ANGLE]) if hold is not None else None
        a = found.loaded(gate, ANGLE, own, scale=ARCSEC, unit="″", y_name="platform θ", quiet=hold)
        M, why = gate.amplitude, a.unsettled
        rest = None if self.loop is None else self.loop.rest
        found.measure("θ*", "platform angle under the load, at rest", "″", a.change, a.u_change, scale=ARCSEC,
                      closed=None if rest is None else M / rest, unsettled=why)  # fmt: skip
        if rest is not None or self.loop is None:  # an integral part leaves no angle
            common.stiffness(found, "S", "stiffness at rest, M / θ*", M, a, rest)
        time, before = gate.t - gate.t[0], gate.rest(ANGLE).size
        y = gate[ANGLE] - a.initial - (own.rate * time if own is not None else 0.0)
        at = int(np.argmax(np.abs(y)))
        u = common.peak_noise(None if hold is None else hold[ANGLE], before, at, y)
        if own is not None:
            u = math.hypot(u, own.u * float(time[at] + 0.5 * before * (time[1] - time[0])))
        meaning = "largest platform angle after the load step"
        found.measure("θ_max", meaning, "″", float(y[at]), u, scale=ARCSEC)
        common.settling(found, "", "to {band} of θ*", a, 5, 2)

    def _margins(self, points: list[Point]) -> None:
        """Measure the slope at the crossover and the lower gain limit, beside the closed forms of the loop without step
        and delay.
        """
        found, loop = self.found, self.loop
        values = measured_values(points, found.excluded["stabilizer"]) if points else {}
        pm = values.get("phase")
        if pm is not None and pm[0] < ENOUGH and not found.unstable:
            text = f"The phase margin is {plain(pm[0], 3)}°; more than {ENOUGH:g}° is wanted [GSP ch. 5]."
            found.warn("loop.phase_margin", text)
        if "crossover" in values and max(p.f for p in points) > 1.25 * values["crossover"][0]:
            f = values["crossover"][0]
            pair = [interpolate_response(points, np.array([f / 1.25, f * 1.25]), spline) for spline in (False, True)]
            slopes = [20.0 * math.log10(abs(v[1] / v[0])) / math.log10(1.25**2) for v in pair]
            closed = None if loop is None else _secant(loop, 2.0 * math.pi * f)
            u = abs(slopes[1] - slopes[0])
            found.measure("slope", "of |L| at the crossover", "dB/dec", slopes[0], u, closed=closed)
        at = None if loop is None else loop.limit()
        share, w = (None, None) if at is None else (at[1], at[0] / (2.0 * math.pi))
        common.lower_limit(found, values, share, w)
        if loop is not None and points:
            found.tables.append(_forms(loop, values))
        if isinstance(loop, LagLeadLoop):
            found.tables += _network(loop, float(self.run.options.get("C2") or C2))

    def _transmission(self, f: float) -> complex | None:
        """Return what friction carries over of the base, and the back EMF of a motor that has one."""
        p, names = self.run.parameters, ("viscous", "k_t", "k_e", "R")
        if self.loop is None or any(f"platform.{n}" not in p for n in names):
            return None
        viscous, k_t, k_e, r = (float(p[f"platform.{n}"]) for n in names)
        drag = viscous + k_t * k_e / r
        return complex(self.loop.isolation(2j * math.pi * f, drag)) if drag else None

    def _blow(self) -> list[str]:
        """Show what the large disturbance did: whether the platform came back, how long the motor was at its limit."""
        found = self.found
        gates = {g.label: g for g in found.gates}
        if "blow" not in gates or "after the blow" not in gates:
            return []
        blow, rest = gates["blow"], gates["after the blow"]
        start = float(blow.rest(ANGLE).mean()) if blow.rest(ANGLE).size else 0.0
        y = np.concatenate([blow[ANGLE], rest[ANGLE]]) - start
        late = np.abs(rest[ANGLE][-rest.t.size // 3 :] - start)
        early = np.abs(y[: 2 * y.size // 3])
        busy = float(np.mean(np.concatenate([g["platform.saturated"] for g in (blow, rest)]) > 0.5))
        size = f"{blow.amplitude:g} N·m for {blow.row.dwell:g} s"
        found.step(rest, ANGLE, scale=math.radians(1.0), unit="°", y_name="platform θ")
        found.responses[-1] = replace(found.responses[-1], caption=f"After a blow of {size}.", curves=[])
        rows = [
            ["largest angle", math.degrees(float(np.abs(y).max())), "°"],
            ["largest angle in the last second", math.degrees(float(late.max())), "°"],
            ["share of the time with the motor at its limit", 100.0 * busy, "%"],
        ]
        caption = f"{size} and {rest.row.dwell:g} s after it."
        found.tables.append(Table("blow", "Large disturbance", caption, ["of the platform", "value", "unit"], rows))
        if np.any(rest["gyro.saturated"] > 0.5):
            found.warn("blow.pickoff", "After the blow the pickoff of the gyro was beyond its range.")
        if late.max() > 0.5 * early.max():
            text = "After the blow the loop did not come to rest: the motor's limit made it unstable."
            found.warn("blow.unstable", text)
            return [f"A blow of {size} throws the loop into a growing swing."]
        return [f"After a blow of {size} the loop comes back to rest."]


def _secant(loop: LagLeadLoop | DoubleLoop, w: float) -> float:
    """Return the slope of |L| between w/1.25 and 1.25 w, dB per decade: what is measured."""
    ends = [abs(loop.gain(1j * w * x)) for x in (1.0 / 1.25, 1.25)]
    return 20.0 * math.log10(ends[1] / ends[0]) / math.log10(1.25**2)


def _forms(loop: LagLeadLoop | DoubleLoop, values: Mapping[str, tuple[float, float]]) -> Table:
    w, pm = loop.margin()
    at = loop.limit()
    rows: list[list[Any]] = [
        ["crossover", w / (2.0 * math.pi), values.get("crossover", (None,))[0], "Hz"],
        ["phase margin", pm, values.get("phase", (None,))[0], "°"],
        ["slope at the crossover, tangent", loop.slope(w), None, "dB/dec"],
    ]
    if at is not None:
        rows.append(["gain limit, share of K", at[1], values.get("lower" if at[1] < 1.0 else "upper", (None,))[0], "1"])
    caption = (
        "Of K(1 + ω_i/s)/(s(J_x s + D)), D the tachometer's: a motor that is a torque at once, no friction, no step, "
        "no delay. The measured loop has them."
        if isinstance(loop, DoubleLoop)
        else "Of K_m K_x G/(J_x s²): a motor that is a torque at once, no friction, no step, no delay. The "
        "measured loop has them."
    )
    columns = ["of the loop", "closed form", "measured", "unit"]
    return Table("loop.closed", "Closed forms of the loop", caption, columns, rows)


def _network(loop: LagLeadLoop, C2: float) -> list[Table]:
    """Return the passive RC network that has the time constants, with this capacitor to ground; none has others."""
    found = rc_values(loop.tau1, loop.T1, loop.tau2, loop.T2, C2)
    if found is None:
        return []
    R1, C1, R2 = found
    rows: list[list[Any]] = [
        ["R1", R1 * 1e-3, "kΩ"],
        ["C1", C1 * 1e6, "µF"],
        ["R2", R2 * 1e-3, "kΩ"],
        ["C2", C2 * 1e6, "µF"],
    ]
    caption = (
        "R1 beside C1 in series, R2 with C2 to ground, driven by a voltage and without load: its times are those of "
        "the loop, with T1 T2 = τ1 τ2."
    )
    return [Table("loop.rc", "RC network", caption, ["element", "value", "unit"], rows)]
