"""Closed forms of a stabilized axis with a gyro of one degree of freedom, for a torque M from t = 0 on, at rest before.

    J0 a'' + H c b' = M,     J b'' + C b' + K b - H c a' = 0          a platform, b gyro angle, c = cos(b) held

[STAB-SDF-INT, -RATEINT, -RATE; GSP ch. 5, eq. 5-27..5-43, corrected]
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass

import numpy as np

from gyrobench.arrays import Array


@dataclass(frozen=True)
class StabilizedAxis:
    """J0 platform, J gyro about its output axis (kg.m2), H N.m.s, C N.m.s/rad, K N.m/rad, M N.m.  H stands for H c."""

    J0: float
    J: float
    H: float
    C: float
    K: float
    M: float

    @property
    def n(self) -> float:
        """Return the nutation without damping, rad/s: sqrt(H2/(J J0) + K/J)  [5-39]."""
        return math.sqrt(self.H**2 / (self.J * self.J0) + self.K / self.J)

    @property
    def zeta(self) -> float:
        """Return the damping of the nutation; 1: aperiodic, C = 2 sqrt(J/J0) H with K = 0  [5-35]."""
        return self.C / (2.0 * self.J * self.n)

    @property
    def stiffness(self) -> float:
        """Return the quasi-spring of the integrating gyro, H2/J, N.m/rad."""
        return self.H**2 / self.J

    @property
    def inertia(self) -> float:
        """Return the apparent inertia of the axis with a rate gyro, J0 + H²/K, kg.m2  [5-40]."""
        return self.J0 + self.H**2 / self.K

    def transient(self, t: Array) -> Array:
        """Return exp(-q t) cos(n1 t) and exp(-q t) sin(n1 t) / n1 as columns, at any damping (n1 may be imaginary)."""
        q = self.C / (2.0 * self.J)
        n1 = cmath.sqrt(complex(self.n**2 - q**2))
        root = n1 if abs(n1) > 1e-9 * self.n else 1e-9 * self.n
        slow = np.exp(-(q + 1j * root) * t), np.exp(-(q - 1j * root) * t)
        return np.column_stack([(0.5 * (slow[0] + slow[1])).real, ((slow[1] - slow[0]) / (2j * root)).real])


def integrating(p: StabilizedAxis, t: Array) -> tuple[Array, Array]:
    """Return a, b for C = K = 0  [5-29]: exact for held c."""
    n, lean = p.n, p.M / p.stiffness
    return lean * (1.0 - np.cos(n * t)), p.M * t / p.H - lean * math.sqrt(p.J0 / p.J) * np.sin(n * t)


def line(p: StabilizedAxis) -> tuple[float, float]:
    """Return offset and slope of the platform's limit line, rate-integrating: o (1 - 4 zeta2 J M / H2) and C M / H2."""
    return p.J * p.M / p.H**2 * (1.0 - 4.0 * p.zeta**2), p.C * p.M / p.H**2


def rate_integrating(p: StabilizedAxis, t: Array) -> tuple[Array, Array]:
    """Return a, b for K = 0, C > 0, at any damping: the exact solution behind 5-34."""
    o, r = line(p)
    q = p.C / (2.0 * p.J)
    cosine, sine = p.transient(t).T
    slope = -r - q * o  # a' = 0 at the start
    a = o + r * t - o * cosine + slope * sine
    rate = r + o * (q * cosine + p.n**2 * sine - q**2 * sine) + slope * (cosine - q * sine)
    return a, (p.M * t - p.J0 * rate) / p.H


def light(p: StabilizedAxis, t: Array) -> tuple[Array, Array]:
    """Return a, b by 5-34 for light damping (zeta < 0.3), with J0 for the printed J in the third term of b (EG9)."""
    q = p.C / (2.0 * p.J)
    n1 = math.sqrt(p.n**2 - q**2)
    fall = np.exp(-q * t)
    a = p.J * p.M / p.H**2 * (1.0 - fall * np.cos(n1 * t)) + p.C * p.M / p.H**2 * t
    b = p.M * t / p.H - p.M * p.J / p.H**2 * math.sqrt(p.J0 / p.J) * fall * np.sin(n1 * t)
    return a, b - p.J0 * p.C * p.M / p.H**3 * (1.0 - fall * np.cos(n1 * t))


def rate(p: StabilizedAxis, t: Array) -> tuple[Array, Array]:
    """Return a, b for K > 0: parabola, line, constant of 5-42 completed, and the transient of a start at rest."""
    total = p.K * p.J0 + p.H**2
    acceleration, slope = p.M * p.K / total, p.C * p.H**2 * p.M / total**2
    # behind the transient b = b1 t + b0, from J0 a' + H b = M t with a' = acceleration t + slope
    b1, b0 = (p.M - p.J0 * acceleration) / p.H, -p.J0 * slope / p.H
    q, n2 = p.C / (2.0 * p.J), p.n**2
    cosine, sine = p.transient(t).T
    s = -b1 - q * b0  # b = b' = 0 at the start
    b = b1 * t + b0 - b0 * cosine + s * sine
    # a is the integral of (M t - H b) / J0; those of the transient by parts
    ic = (q - q * cosine + (n2 - q**2) * sine) / n2
    i_s = (1.0 - cosine - q * sine) / n2
    whole = b1 * t**2 / 2.0 + b0 * t - b0 * ic + s * i_s
    return (p.M * t**2 / 2.0 - p.H * whole) / p.J0, b


FORMS = {"integrating": integrating, "rate-integrating": rate_integrating, "rate": rate}
