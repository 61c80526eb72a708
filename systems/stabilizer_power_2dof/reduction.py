"""From the record of a power gyro stabilizer to its measures, beside the closed forms.

[STAB-POWER-2DOF; GSP ch. 5, eq. 5-5..5-23, corrected by EG1-EG6]
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from gyrobench.reduction.loops.loop_drift import Drift, drift
from gyrobench.reduction.loops.loop_measures import Gate, Point
from gyrobench.reduction.loops.loop_toolkit import DRIFTS, Account, LoopReduction, isolation, margins, told
from gyrobench.reduction.loops.margins import measured_values
from gyrobench.reduction.loops.platform_measures import isolation_near, stiffness
from gyrobench.units import ARCSEC, DPH

ALPHA, BASE = "gyro.alpha", "motion.angle[1]"  # platform against the base, and the base, to be added


def k_m(p: Mapping[str, Any]) -> float:
    """Return the stiffness of the correction, N.m/rad: ratio k_u k_i k_m, the gyro's pickoff as potentiometer (5-5)."""
    return float(p["stabilizer.ratio"] * p["gyro.K_sg_y"] * p["stabilizer.k_i"] * p["stabilizer.k_m"])


def routh_limit(H: float, J_x: float, J_y: float, C_x: float, C_y: float) -> float:
    """Return the largest stable K_m, N.m/rad: (C_x/J_x + C_y/J_y)(H + C_x C_y/H).

    5-23 as printed drops C_x C_y/H; exact by the Routh table of (5-20).
    """
    return (C_x / J_x + C_y / J_y) * (H + C_x * C_y / H)


def nutation(H: float, J_x: float, J_y: float, C_x: float, C_y: float) -> float:
    """Return the undamped nutation frequency, Hz: sqrt((H^2 + C_x C_y)/(J_x J_y)) / 2 pi."""
    return math.sqrt((H * H + C_x * C_y) / (J_x * J_y)) / (2.0 * math.pi)


def lean(t: Any, M: float, K_m: float, H: float) -> Any:
    """Return the precession angle after a load step with the platform taken as held, rad: M/K_m (1 - exp(-K_m t/H)).

    (5-10)
    """
    return M / K_m * (1.0 - np.exp(-K_m * np.asarray(t) / H))


def transient(H: float, K_m: float) -> float:
    """Return t* = pi H / K_m, s: the lean is then within exp(-pi) = 4.3 % of its end (5-13)."""
    return math.pi * H / K_m


def steady(M: float, H: float, K_m: float, C_y: float) -> float:
    """Return the platform angle that a constant load leaves, rad: C_y M / (H K_m), 0 only if undamped.

    GSP ch. 5 says that it is always 0 (EG4).
    """
    return C_y * M / (H * K_m)


class Reduction(LoopReduction):
    """Load step, sine sweeps of loop and base, servo torque and drift of a power gyro stabilizer."""

    def measure(self) -> Account:
        found, p = self.found, self.run.parameters
        self.gyro = {n: float(p[f"gyro.{n}"]) for n in ("H", "J_x", "J_y", "C_x", "C_y")}
        self.K_m = k_m(p)
        holds = found.of("hold")
        self.quiet = holds[0] if holds else None
        self.own = drift(holds[0].t, _platform(holds[0])) if holds else None
        for gate in found.of("torque", 1, "step"):
            self._load(gate)
        self._limits(found.open_loop("stabilizer", "stabilizer.e", "exciter.test[1]"))
        transmitted = found.ratio(
            "isolation", "motion", 1, ALPHA, BASE, plus=BASE,
            caption="Isolation: inertial angle of the platform over that of the base. Points: measured; lines: linear.",
        )  # fmt: skip
        isolation_near(found, transmitted, self._transmission)  # through the damping of the axis
        for gate in found.of("torque", 2):
            self._servo(gate)
        for gate in holds:
            walk = float(p.get("gyro.white_x", 0.0))
            found.drift(gate, ALPHA, truth=self._truth(), walk=walk, gyro=("gyro", "_x"))
        return Account(
            method="Load step, sine sweeps of loop and base, servo torque and drift hold  [STAB-POWER-2DOF]",
            sources=["STAB-POWER-2DOF; GSP ch. 5, eq. 5-1..5-23, corrected by EG1-EG6"],
            equation="J_x dot.double(alpha) + C_x dot(alpha) + H dot(beta) = -K_m beta + M_x, quad "
            "J_y dot.double(beta) + C_y dot(beta) - H dot(alpha) = M_y, quad K_m = i k_u k_i k_m",
            conventions=[
                "α: platform, the outer gimbal with its load, about the stabilized axis x; β: precession about the "
                "inner axis y.",
                "Loop gain L = −(signal that comes back) / (signal put in), opened at the potentiometer.",
                "Drift: rate of α with the base at rest; a torque M_y on the precession axis turns the platform by "
                "−M_y/H.",
            ],
        )

    def summary(self) -> list[str]:
        found, rows = self.found, self.found.coefficients
        return [
            *margins(found),
            *told(rows, "It is stable up to a correction of K_m = {K_m limit}; K_m is {K_m}."),
            *isolation(found, "isolation", ALPHA, plus=BASE),
            *told(rows, "A load leaves the platform {α*} off and the gyro leaning by M/K_m.", DRIFTS),
        ]

    def _load(self, gate: Gate) -> None:
        """Measure lean and platform after the load step, its own drift taken off with its uncertainty."""
        found, M, H, K_m = self.found, gate.amplitude, self.gyro["H"], self.K_m
        figure: dict[str, Any] = {"scale": ARCSEC, "unit": "″", "quiet": self.quiet}
        b = found.step(gate, "gyro.beta", y_name="precession β", **figure)
        a = found.loaded(gate, ALPHA, self.own, y_name="platform α", plus=BASE, **figure)
        stiffness(found, "K_m", "stiffness of the correction, M / β*", M, b, K_m)
        t_star = transient(H, K_m)
        near = np.interp([t_star, t_star + b.u_settled], gate.t - gate.t[0], gate["gyro.beta"] - b.initial)
        left = 1.0 - float(near[0]) / b.change
        residual = 100.0 * math.hypot(b.u_change, near[1] - near[0]) / abs(b.change)
        found.measure("β(t*)", "lean still missing at t* = πH/K_m", "%", 100.0 * left, residual,
                      closed=100.0 * math.exp(-math.pi))  # fmt: skip
        found.measure("t_5 β", "settling of the lean to 5 %", "s", b.settled_5, b.u_settled,
                      closed=H / K_m * math.log(20.0))  # fmt: skip
        closed = steady(M, H, K_m, self.gyro["C_y"])
        found.measure("α*", "steady platform angle", "″", a.change, a.u_change, scale=ARCSEC, closed=closed,
                      unsettled=a.unsettled)  # fmt: skip
        if closed:
            stiffness(found, "S", "stiffness of the platform, M / α*", M, a, M / closed)
        u = 100.0 * a.u_change / abs(a.change)
        found.measure("overshoot α", "of the platform angle", "%", 100.0 * a.overshoot, u)
        found.measure("t_5 α", "settling of the platform to 5 %", "s", a.settled_5, a.u_settled)
        found.measure("t_2 α", "settling of the platform to 2 %", "s", a.settled_2, a.u_settled)

    def _limits(self, points: list[Point]) -> None:
        """Measure the limit of K_m: the phase of L passes -180 degrees at the undamped nutation frequency."""
        values = measured_values(points, self.found.excluded["stabilizer"]) if points else {}
        if "upper" not in values:
            return
        factor, u = values["upper"]
        self.found.measure("K_m limit", "K_m at which the loop is at its limit", "N·m/rad", self.K_m * factor,
                           self.K_m * u, closed=routh_limit(**self.gyro))  # fmt: skip
        self.found.measure("f_n", "undamped nutation frequency", "Hz", *values["f_upper"], closed=nutation(**self.gyro))

    def _transmission(self, f: float) -> complex | None:
        linear = self.found.excited("discrete", "motion", 1, ALPHA, [f], plus=BASE)
        return None if linear is None else complex(linear[0])

    def _servo(self, gate: Gate) -> None:
        """Measure what the torque adds to the platform's own drift."""
        d, own = drift(gate.t, _platform(gate)), self.own or Drift(0.0, 0.0, None, None)
        self.found.measure("servo rate", "turned by M_y on the precession axis, −M_y/H", "°/h", d.rate - own.rate,
                           math.hypot(d.u, own.u), scale=DPH, closed=-gate.amplitude / self.gyro["H"])  # fmt: skip

    def _truth(self) -> float | None:
        """Return the static drift of the gyro at rest, where f = (0, 0, g): X = Y = 0, Z = -1."""
        p = self.run.parameters
        if "gyro.Dx_zz" not in p or p.get("motion.preset"):
            return None
        return float(p["gyro.Dx_0"]) - float(p["gyro.Dx_z"]) + float(p["gyro.Dx_zz"])


def _platform(gate: Gate) -> Any:
    """Return the inertial angle of the platform, rad: against the base, and the base."""
    return gate[ALPHA] + gate[BASE]
