"""Closed forms of a platform that two power gyros hold about two axes, the second turned by 90 degrees.

    J_x th'' + C_x (th' - th_b') + H be' - i C_y c' = -K_m c + M          th = a_x + i a_y,  be = b_1 + i b_2
    J_y be'' + C_y c' - H th' = S                                         c = be + i th

[STAB-POWER-TWO-AXIS; GSP ch. 5, eq. 5-7, 5-8 for each axis; own derivation]
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class TwoAxes:
    """H: N.m.s; J_x, J_y: kg.m2; C_x, C_y: N.m.s/rad; K_m: N.m/rad."""

    H: float
    J_x: float
    J_y: float
    C_x: float
    C_y: float
    K_m: float

    def polynomial(self) -> list[complex]:
        """Return the characteristic polynomial in s, the highest power first; its coefficients are complex.

        J_x J_y s3 + (J_x C_y + J_y C_x + J_y C_y) s2 + (H2 + C_x C_y + i (K_m J_y - 2 H C_y)) s + K_m H
        """
        square = self.J_x * self.C_y + self.J_y * (self.C_x + self.C_y)
        first = self.H**2 + self.C_x * self.C_y + 1j * (self.K_m * self.J_y - 2.0 * self.H * self.C_y)
        return [self.J_x * self.J_y, square, first, self.K_m * self.H]

    def stable(self) -> bool:
        """Return whether all roots lie to the left."""
        return bool(np.max(np.roots(self.polynomial()).real) < 0.0)

    def nutation(self) -> float:
        """Return the frequency of the limit, rad/s: sqrt((H2 + C_x C_y)/(J_x J_y)), that of one axis."""
        return math.sqrt((self.H**2 + self.C_x * self.C_y) / (self.J_x * self.J_y))

    def limit(self) -> float:
        """Return the largest stable K_m, N.m/rad.

        On the axis s = i w the polynomial vanishes at w = +-n, n the nutation: K_m (H -+ J_y n) = B n2 -+ 2 H C_y n, B
        the coefficient of s2.  The smaller positive one of both is the limit.
        """
        n = self.nutation()
        b = float(self.polynomial()[1].real)
        found = []
        for sense in (1.0, -1.0):
            below = self.H - sense * self.J_y * n
            if below != 0.0:
                found.append((b * n * n - sense * 2.0 * self.H * self.C_y * n) / below)
        return min((k for k in found if k > 0.0), default=math.inf)

    def compliance(self, s: Any) -> Any:
        """Return th/M at s, rad/(N.m): its real part is the own axis, its imaginary part the other one."""
        p = np.polyval(self.polynomial(), s)
        return (self.J_y * s + self.C_y) / p

    def isolation(self, s: Any) -> Any:
        """Return th/th_b at s: own axis and other axis as in compliance."""
        return self.C_x * s * self.compliance(s)

    def steady(self) -> float:
        """Return th/M at rest, C_y/(H K_m): as of one axis, and none of it about the other."""
        return self.C_y / (self.H * self.K_m)


def one_axis_limit(H: float, J_x: float, J_y: float, C_x: float, C_y: float) -> float:
    """Return the largest stable K_m of one axis alone, N.m/rad: (C_x/J_x + C_y/J_y)(H + C_x C_y/H)."""
    return (C_x / J_x + C_y / J_y) * (H + C_x * C_y / H)
