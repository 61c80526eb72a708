"""The linear sampled loop without counts: stability, tracking error and torque of a change of rate.  [CTRL-SAMPLED]"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gyrobench.arrays import Array

X, W, M, LAG, LAG_RATE, W_LAST, U_LAST, E_LAST, DEMAND = range(9)
NEEDED = ("body.axis_J", "controller.law_J", "controller.period", "controller.law_p", "controller.law_J_ff",
          "controller.law_M_max", "controller.law_delay")  # fmt: skip


@dataclass(frozen=True)
class SampledLoop:
    """Inertia J (kg.m2) under a sampled controller, with the lags of its drive and its reader.

    design, T, p, J_ff, M_max, delay: of the controller.  h: communication step, s.  lag: of the drive, s, a linear one.
    K_v: of the reader's multiplier loop of type 2 (critically damped), 1/s; 0: none.
    """

    J: float
    design: float
    T: float
    p: float
    J_ff: float
    M_max: float
    delay: float
    h: float
    lag: float = 0.0
    K_v: float = 0.0

    @classmethod
    def of(cls, p: Mapping[str, Any], step: float) -> SampledLoop | None:
        """From the parameters of a run; None where the controller is another one."""
        if any(n not in p for n in NEEDED):
            return None
        reader = float(p.get("reader.loop_K_v", 0.0)) if p.get("reader.loop_type") == 2.0 else 0.0
        J, design, T, pole, ff, M_max, delay = (float(p[n]) for n in NEEDED)
        return cls(J, design, T, pole, ff, M_max, delay, step, float(p.get("drive.motor_lag", 0.0)), reader)

    def gains(self) -> tuple[float, float, float, float]:
        """Return b, g, a and 2 J / T2 of the controller."""
        b = (self.p**3 + 3 * self.p**2 + 3 * self.p - 3) / 4
        return b, 2 + b - 3 * self.p, self.p**3 - b, 2 * self.design / self.T**2

    def stiffness(self) -> float:
        """Return the static stiffness, N.m/rad."""
        b, g, a, scale = self.gains()
        return scale * (g - a) / (1 - b)

    def count_torque(self, quantum: float) -> float:
        """Return the torque that one count of the reader demands, N.m."""
        _, g, _, scale = self.gains()
        return scale * g * quantum

    def period(self, s: Array, reference: float, acc: float) -> Array:
        """Return the state one period after a sample with this reference, rad, and its acceleration over the period."""
        s = s.copy()
        b, g, a, scale = self.gains()
        e = reference - (s[X] - s[LAG])
        wanted = b * s[U_LAST] + scale * (g * e - a * s[E_LAST]) + self.J_ff * acc
        made = float(np.clip(wanted, -self.M_max, self.M_max))
        s[U_LAST], s[E_LAST] = made - self.J_ff * acc, e
        stay = math.exp(-self.h / self.lag) if self.lag > 0.0 else 0.0
        for k in range(round(self.T / self.h)):
            if k == round(self.delay / self.h):
                s[DEMAND] = made
            s[M] = s[DEMAND] + (s[M] - s[DEMAND]) * stay  # the drive's torque at the end of its step acts in the next
            s[X] += s[W] * self.h + s[M] / self.J * self.h**2 / 2
            s[W] += s[M] / self.J * self.h
            if self.K_v > 0.0:
                half, slope = 0.5 * self.K_v, (s[W] - s[W_LAST]) / self.h
                d, fade = s[LAG] - slope / half**2, math.exp(-half * self.h)
                v = s[LAG_RATE] + half * d
                s[LAG] = slope / half**2 + (d + v * self.h) * fade
                s[LAG_RATE] = (v - half * (d + v * self.h)) * fade
                s[W_LAST] = s[W]
        if self.K_v == 0.0:
            s[LAG] = s[LAG_RATE] = s[W_LAST] = 0.0
        return s

    def radius(self) -> float:
        """Return the largest modulus of a pole of the loop, per period; the loop is unstable from 1 on."""
        tiny = 1e-12 * np.eye(9)  # far from the limit of the torque
        return float(np.abs(np.linalg.eigvals(np.array([self.period(row, 0.0, 0.0) for row in tiny]).T / 1e-12)).max())

    def ramp(self, change: float, acceleration: float, time: float) -> tuple[Array, Array, Array]:
        """Return time (s), error (rad) and torque (N.m) of a change of rate (rad/s) with an acceleration (rad/s2)."""
        rate = reference = 0.0
        s, rows = np.zeros(9), []
        for k in range(round(time / self.T)):
            step = float(np.clip(change - rate, -acceleration * self.T, acceleration * self.T))
            s = self.period(s, reference, step / self.T)
            rows.append((k * self.T, s[E_LAST], s[U_LAST] + self.J_ff * step / self.T))
            reference += (rate + step / 2) * self.T
            rate += step
        out = np.array(rows)
        return out[:, 0], out[:, 1], out[:, 2]
