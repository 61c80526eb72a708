"""Where a stand is: specific force and Earth rate of a body at rest."""

from __future__ import annotations

from gyrobench.component.component import Component
from gyrobench.component.declarations import Discrete, Output, Parameter
from gyrobench.component.math import cos, pi, sin, sqrt

A = 6378137.0  # WGS84 semi-major axis, m
F = 1.0 / 298.257223563  # flattening
E2 = F * (2.0 - F)  # first eccentricity squared
GAMMA_E = 9.7803253359  # normal gravity at the equator, m/s2
K = 1.931852652458e-3  # Somigliana's constant
M = 3.449786506841e-3  # omega2 a2 b / GM


class Place(Component):
    """Specific force (0, 0, g) and Earth rate W (0, cos L, sin L) of a body at rest, ENU.  [CONV-FRAMES; TR8350.2]

    g is the measured gravity or, where that is 0, WGS84 normal gravity at latitude and height.
    """

    latitude = Parameter(45.75 * pi / 180.0, "rad", "latitude, north positive", min=-pi / 2, max=pi / 2)
    height = Parameter(0.0, "m", "height above the ellipsoid", min=-11e3, max=100e3)
    gravity = Parameter(0.0, "m/s2", "measured gravity; 0: WGS84 normal gravity", min=0.0)
    earth_rate = Parameter(7.2921159e-5, "rad/s", "Earth rate W", min=0.0)

    f = Output("m/s2", "specific force of a body at rest, ENU", shape=(3,))
    omega = Output("rad/s", "Earth rate, ENU", shape=(3,))
    g = Output("m/s2", "local gravity")

    local_g = Discrete(9.80665, "m/s2", "gravity in use")
    north = Discrete(0.0, "rad/s", "Earth rate, north")
    up = Discrete(0.0, "rad/s", "Earth rate, up")

    def start(self) -> None:
        self.refuse(
            self.gravity != 0.0 and (self.gravity < 9.7 or self.gravity > 9.9),
            "gravity = {gravity} m/s2 must lie in 9.7 to 9.9, or be 0 for WGS84 normal gravity",
        )
        s = sin(self.latitude)
        s2 = s * s
        x = self.height / A
        surface = GAMMA_E * (1.0 + K * s2) / sqrt(1.0 - E2 * s2)
        normal = surface * (1.0 - 2.0 * (1.0 + F + M - 2.0 * F * s2) * x + 3.0 * x * x)
        self.local_g = self.gravity if self.gravity > 0.0 else normal
        self.north = self.earth_rate * cos(self.latitude)
        self.up = self.earth_rate * s

    def outputs(self) -> None:
        self.f[0] = 0.0
        self.f[1] = 0.0
        self.f[2] = self.local_g
        self.omega[0] = 0.0
        self.omega[1] = self.north
        self.omega[2] = self.up
        self.g = self.local_g
