"""Closed forms of a platform that follows the Earth open loop: its rate, what each error makes of it, where it leads.

    w = (-v_N/(M + h), W cos L + v_E/(N + h), W sin L + v_E tan L/(N + h))          x east, y north, z up
    R w_platform = (1 + e) w_believed + d          R: the rows of the gyros' axes that are used, d their drifts
    e' = delta - w x e                             e: platform against level and north, delta: w_platform - w

[PLATFORM-FOLLOWING; GSP ch. 5, section 5.2.1, which has no equations; own derivation]
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gyrobench.arrays import Array
from gyrobench.units import EARTH_RATE

A, E2 = 6378137.0, 0.00669437999014  # WGS84: semi-major axis, m; first eccentricity squared


@dataclass(frozen=True)
class MovingPlace:
    """Latitude (rad), height (m), velocity east and north (m/s)."""

    latitude: float
    height: float
    east: float
    north: float

    def radii(self) -> tuple[float, float]:
        """Return M + h and N + h, m."""
        w = 1.0 - E2 * math.sin(self.latitude) ** 2
        return A * (1.0 - E2) / w**1.5 + self.height, A / math.sqrt(w) + self.height

    def rate(self) -> Array:
        """Return the rate of level and north, rad/s, east, north, up."""
        m, n = self.radii()
        up = EARTH_RATE * math.sin(self.latitude) + self.east * math.tan(self.latitude) / n
        return np.array([-self.north / m, EARTH_RATE * math.cos(self.latitude) + self.east / n, up])

    def by_latitude(self) -> Array:
        """Return d rate/d latitude, 1/s, the radii taken as constant (their change is 1 % of it at most)."""
        _, n = self.radii()
        c = math.cos(self.latitude)
        return np.array([0.0, -EARTH_RATE * math.sin(self.latitude), EARTH_RATE * c + self.east / (n * c * c)])

    def by_velocity(self) -> tuple[Array, Array]:
        """Return d rate/d east and d rate/d north, rad/m."""
        m, n = self.radii()
        return np.array([0.0, 1.0 / n, math.tan(self.latitude) / n]), np.array([-1.0 / m, 0.0, 0.0])


@dataclass(frozen=True)
class SourceOfDrift:
    """A line of the budget: drift of the platform about x, y, z by one standard uncertainty, rad/s."""

    source: str
    size: float
    unit: str
    drift: Array


def budget(place: MovingPlace, u: dict[str, float], quantum: float) -> list[SourceOfDrift]:
    """Return what each source makes of the drift.

    u: mounting (rad), torquer (1), drift (rad/s), latitude (rad), velocity (m/s).  A gyro that is off by small turns of
    u about each of its axes takes sqrt(w_j2 + w_k2) u of the other two rates; the quantum is even, 1/sqrt 12.
    """
    w = place.rate()
    across = np.sqrt(np.array([w[1] ** 2 + w[2] ** 2, w[2] ** 2 + w[0] ** 2, w[0] ** 2 + w[1] ** 2]))
    east, north = place.by_velocity()
    return [
        SourceOfDrift("mounting of the gyros", u["mounting"], "rad", u["mounting"] * across),
        SourceOfDrift("scale factors of the torquers", u["torquer"], "1", u["torquer"] * np.abs(w)),
        SourceOfDrift("drift of the gyros", u["drift"], "rad/s", np.full(3, u["drift"])),
        SourceOfDrift("resolution of the command", quantum, "rad/s", np.full(3, quantum / math.sqrt(12.0))),
        SourceOfDrift("latitude", u["latitude"], "rad", u["latitude"] * np.abs(place.by_latitude())),
        SourceOfDrift("velocity", u["velocity"], "m/s", u["velocity"] * np.sqrt(east**2 + north**2)),
    ]


def led(delta: Array, rate: Array, time: float) -> Array:
    """Return e after a time under a constant delta, rad: the solution of e' = delta - rate x e from e = 0."""
    w = float(np.linalg.norm(rate))
    if w * time < 1e-9:
        return np.asarray(delta * time)
    axis = rate / w
    along = float(axis @ delta) * axis
    across = delta - along
    turn = w * time
    return np.asarray(along * time + across * math.sin(turn) / w - np.cross(axis, across) * (1.0 - math.cos(turn)) / w)
