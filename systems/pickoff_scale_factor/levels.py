"""The readings themselves against the line: zero, departures, what the report draws.

The scale factor and the drift come from the differences of the readings; zero and straightness from the line of least
squares through the readings with that drift taken away.  The scatter of the readings about a cubic through them (a
bent pickoff does not scatter) is the standard uncertainty of each: not less for the zero, as the float's random drift
is in all of them.  The largest departure is the largest of as many as there are readings: its interval holds for all of
them at once (Bonferroni).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import special

from gyrobench import units
from gyrobench.reduction.toolkit import Array, plain
from gyrobench.result import Coefficient, Series, Table

ARCMIN = units.factor("arcmin")


@dataclass(frozen=True)
class Levels:
    """angle (n,) of the table, rad; t (n,) of the readings, s; u (n,) and the departures from the line, V."""

    angle: Array
    t: Array
    u: Array
    zero: float
    departure: Array
    slope: float
    scatter: float  # of the readings about a cubic, V
    dof: int

    @classmethod
    def of(cls, angle: Array, seen: Array, t: Array, u: Array, moved: Array, fitted: int) -> Levels:
        """Return the levels.  seen: what the float sees of the angle.  moved: what the drift changed of the voltage, V,
        by ``fitted`` coefficients.
        """
        steady = u - moved
        slope, zero = (float(v) for v in np.polyfit(seen, steady, 1))
        cubic = steady - np.polyval(np.polyfit(seen, steady, 3), seen)
        dof = u.size - 4 - fitted
        scatter = math.sqrt(float(np.sum(cubic**2)) / dof)
        return cls(angle, t, u, zero, steady - zero - slope * seen, slope, scatter, dof)

    @property
    def span(self) -> float:
        """V"""
        return self.slope * float(np.ptp(self.angle))

    def coefficients(self) -> list[Coefficient]:
        """Return the zero and the largest departure from the line."""
        k = int(np.argmax(np.abs(self.departure)))
        where = f"at {plain(self.angle[k] / ARCMIN, 4)}′"
        zero = ("u_0", "voltage at table angle 0 in the middle of the test", "mV")
        straight = ("linearity", f"largest departure from the line, {where}, of the span", "%")
        return [
            self._one(*zero, self.zero * 1e3, self.scatter * 1e3),
            self._one(
                *straight, float(self.departure[k]) / self.span * 100.0, self.scatter / self.span * 100.0, self.u.size
            ),
        ]

    def _one(self, name: str, meaning: str, unit: str, value: float, u: float, of: int = 1) -> Coefficient:
        """of: among how many residuals it was chosen, which are in the scatter themselves (Thompson's distribution)."""
        k = float(special.stdtrit(self.dof, 0.975))
        if of > 1:
            t = float(special.stdtrit(self.dof - 1, 1.0 - 0.025 / of))
            k = t * math.sqrt(self.dof / (self.dof - 1 + t * t))
        interval = (value - k * u, value + k * u)
        return Coefficient(name, meaning, unit, value, u, k, interval, u_a=u, dof=float(self.dof))

    def series(self, dense: Array, seen: Array) -> Series:
        """Return the voltage over angle; dense, seen: of the drawn line."""
        order = np.argsort(self.angle, kind="stable")
        u, fit, residual = (v[order] * 1e3 for v in (self.u, self.u - self.departure, self.departure))
        at, curve = (self.angle[order] / ARCMIN, "table angle", "′"), (self.zero + self.slope * seen) * 1e3
        measured = (u, "pickoff voltage", "mV")
        return Series.of("pickoff voltage", at, measured, fit, residual, self.t[order], (dense / ARCMIN, curve))

    def table(self) -> Table:
        rows = [
            [k + 1, float(a / ARCMIN), float(v * 1e3), float(d * 1e6)]
            for k, (a, v, d) in enumerate(zip(self.angle, self.u, self.departure, strict=True))
        ]
        head = ["reading", "angle / ′", "u / mV", "departure from the line / µV"]
        return Table("readings", "Readings", "In the order taken", head, rows)
