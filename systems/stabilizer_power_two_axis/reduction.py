"""Record of a two-axis stabilizer with two power gyros -> its measures, beside the closed forms.

[STAB-POWER-TWO-AXIS; GSP ch. 5, eq. 5-7, 5-8]
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.loops.loop_drift import Drift, drift
from gyrobench.reduction.loops.loop_measures import Gate
from gyrobench.reduction.loops.loop_toolkit import DRIFTS, Account, LoopReduction, Table, isolation, margins, told
from gyrobench.reduction.loops.platform_measures import peak_noise, stiffness
from gyrobench.units import ARCSEC, DPH

from .closed import TwoAxes, one_axis_limit
from .system import GYRO

AXES = ("x", "y")
TWO = (
    "The corrections of the two axes differ (stabilizer_x.k_m, stabilizer_y.k_m): the closed forms of the limit and of "
    "the angle about the other axis, which take one for both, are left out."
)


def stiffness_of(p: Mapping[str, Any], axis: str, asked: float) -> float:
    """Return ratio k_u k_i k_m of an axis, N.m/rad; what was asked for where a part does not have them."""
    names = ("platform.k_u", *(f"stabilizer_{axis}.{n}" for n in ("ratio", "k_i", "k_m")))
    return float(np.prod([float(p[n]) for n in names])) if all(n in p for n in names) else asked


class Reduction(LoopReduction):
    """Load steps, servo torque, sine sweeps of a loop and of the base, drift of a two-axis power gyro stabilizer."""

    def measure(self) -> Account:
        found, o = self.found, self.run.options
        self.gyro = {n: float(o[n]) for n in GYRO}
        self.K_m = [stiffness_of(self.run.parameters, name, float(o["K_m"])) for name in AXES]
        self.axes = TwoAxes(**self.gyro, K_m=self.K_m[0])
        self.alike = math.isclose(*self.K_m, rel_tol=1e-6)
        found.warn("power.two_corrections", "" if self.alike else TWO)
        holds = found.of("hold")
        self.quiet = holds[0] if holds else None
        self.own = [drift(self.quiet.t, self.quiet[_angle(k)]) if self.quiet else None for k in (1, 2)]
        for axis in (1, 2):
            for gate in found.of("torque", axis, "step"):
                self._load(gate, axis)
        for gate in found.of("torque", 3):
            self._servo(gate)
        found.open_loop("x", "stabilizer_x.e", "exciter.test[1]")
        found.ratio(
            "isolation", "motion", 1, _angle(1), "exciter.motion_angle[1]",
            caption="Isolation: inertial angle of the platform over that of the base. Points: measured; lines: linear.",
        )  # fmt: skip
        for gate in holds:
            self._drift(gate)
        if self.alike:
            found.tables.append(self._limits())
        return Account(
            method="Load steps about both axes, servo torque, sine sweeps of a loop and of the base, drift hold",
            sources=["STAB-POWER-TWO-AXIS; GSP ch. 5, section 5.1.1, eq. 5-7, 5-8 for each axis"],
            equation="J_x dot.double(theta) + C_x dot(theta) + H dot(beta) - i C_y dot(c) = -K_m c + M, quad "
            "J_y dot.double(beta) + C_y dot(c) - H dot(theta) = S, quad c = beta + i theta",
            conventions=[
                "θ = α_x + iα_y: platform; β = β_1 + iβ_2: precession of gyro 1 about y, of gyro 2 about −x; c: "
                "against the platform, what the potentiometers read.",
                "Loop gain L = −(signal that comes back) / (signal put in), opened at the potentiometer of x, the loop "
                "of y closed.",
                "Drift: rate of the platform with the base at rest.",
            ],
        )

    def summary(self) -> list[str]:
        found, rows = self.found, self.found.coefficients
        return [
            *margins(found),
            *([self._stable()] if self.alike else []),
            *isolation(found, "isolation", _angle(1)),
            *told(
                rows, "A load about x leaves the platform {α* x} off and moves it about y by up to {cross x}.", DRIFTS
            ),
        ]

    def _stable(self) -> str:
        return (
            f"Both loops together are stable up to a correction of {plain(self.axes.limit(), 4)} N·m/rad, one axis "
            f"alone up to {plain(one_axis_limit(**self.gyro), 4)}."
        )

    def _load(self, gate: Gate, axis: int) -> None:
        """Measure lean of the gyro, platform about the own axis and how far it moves about the other one."""
        found, name, M = self.found, AXES[axis - 1], gate.amplitude
        figure: dict[str, Any] = {"scale": ARCSEC, "unit": "″", "quiet": self.quiet}
        b = found.step(gate, f"platform.precession[{axis}]", y_name=f"precession {name}", **figure)
        a = found.loaded(gate, _angle(axis), self.own[axis - 1], y_name=f"platform α_{name}", **figure)
        stiffness(found, f"K_m {name}", "stiffness of the correction, M / β*", M, b, self.K_m[axis - 1])
        found.measure(f"α* {name}", "steady platform angle", "″", a.change, a.u_change, scale=ARCSEC,
                      closed=replace(self.axes, K_m=self.K_m[axis - 1]).steady() * M,
                      unsettled=a.unsettled)  # fmt: skip
        other = gate[_angle(3 - axis)]
        rest = self.own[2 - axis]
        moved = other - other[0] - (rest.rate * (gate.t - gate.t[0]) if rest else 0.0)
        meaning = f"largest angle about {AXES[2 - axis]} by a load about {name}"
        at = int(np.argmax(np.abs(moved)))
        noise = peak_noise(self.quiet[_angle(3 - axis)] if self.quiet else None, 1, at, moved)
        u = math.hypot(noise, (rest.u if rest else 0.0) * float(gate.t[at] - gate.t[0]))
        closed = self._cross(M, gate.t[-1] - gate.t[0]) if self.alike else None
        found.measure(f"cross {name}", meaning, "″", float(np.abs(moved[at])), u, scale=ARCSEC, closed=closed)

    def _cross(self, M: float, time: float) -> float:
        """Return the largest angle about the other axis, by the residues of M compliance(s)/s."""
        poles = np.roots(self.axes.polynomial())
        lead = self.axes.J_x * self.axes.J_y
        t = np.linspace(0.0, time, 20001)
        y = np.full(t.size, self.axes.steady(), complex)
        for k, p in enumerate(poles):
            others = np.prod([p - q for j, q in enumerate(poles) if j != k])
            y += (self.axes.J_y * p + self.axes.C_y) / (lead * p * others) * np.exp(p * t)
        return float(np.max(np.abs(y.imag))) * abs(M)

    def _servo(self, gate: Gate) -> None:
        """Measure what the torque adds to the platform's own drift, about its axis and about the other one."""
        for k, closed in ((1, -gate.amplitude / self.axes.H), (2, 0.0)):
            d, own = drift(gate.t, gate[_angle(k)]), self.own[k - 1] or Drift(0.0, 0.0, None, None)
            text = "turned by S_1 on the precession axis of gyro 1, −S_1/H" if k == 1 else "the same about y"
            found = f"servo rate {AXES[k - 1]}"
            self.found.measure(found, text, "°/h", d.rate - own.rate, math.hypot(d.u, own.u), scale=DPH, closed=closed)

    def _drift(self, gate: Gate) -> None:
        p = self.run.parameters
        given = p.get("platform.drift") if not p.get("motion.preset") else None
        for k, name in enumerate(AXES):
            got = drift(gate.t, gate[_angle(k + 1)])
            truth = None if given is None else float(np.asarray(given, float)[k])
            self.found.measure(
                f"drift {name}", f"of the platform about {name}", "°/h", got.rate, got.u, scale=DPH, truth=truth
            )

    def _limits(self) -> Table:
        axes = self.axes
        slow = np.roots(axes.polynomial())
        worst = slow[np.argmax(slow.real)]
        rows: list[list[Any]] = [
            ["largest K_m, both axes", axes.limit(), "N·m/rad"],
            ["largest K_m, one axis alone", one_axis_limit(**self.gyro), "N·m/rad"],
            ["nutation", axes.nutation() / (2.0 * math.pi), "Hz"],
            ["slowest pole, real part", float(worst.real), "1/s"],
            ["its frequency", abs(float(worst.imag)) / (2.0 * math.pi), "Hz"],
        ]
        caption = "Roots of the polynomial of both axes, whose coefficients are complex."
        return Table("power.limits", "Limits of the correction", caption, ["of the loops", "closed form", "unit"], rows)


def _angle(axis: int) -> str:
    return f"platform.attitude[{axis}]"
