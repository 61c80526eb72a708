from __future__ import annotations

from gyrobench.component import Component, Input, Output, Parameter, State
from gyrobench.component.blocks.place import E2, A
from gyrobench.component.math import Number, Vector, cos, fabs, floor, pi, sin, sqrt, tan, vector


class EarthFollower(Component):
    """Rates that a platform is commanded so that it stays level and north on a moving base.  [PLATFORM-FOLLOWING]

        w = ( -v_N/(M + h),  W cos L + v_E/(N + h),  W sin L + v_E tan L/(N + h) )        x east, y north, z up
        L' = v_N/(M + h)        M, N: WGS84 radii of curvature along the meridian and across it

    `rate` is w at the true latitude and velocity, `turned` its integral; `command` is w at the believed ones, latitude
    + latitude_error and velocity + velocity_error, rounded to `quantum`, and what is commanded besides.

    Not modelled: velocity that changes, curvature of the track (a great circle wants v_E and v_N that turn), Coriolis.
    Source: GSP ch. 5, section 5.2.1, which has no equations; own derivation; radii: TR8350.2.
    """

    version = "1.0.0"
    integrator = "rk4"
    rk4_substeps = 1

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    latitude = Parameter(45.75 * pi / 180.0, "rad", "latitude at the start, north positive", min=-1.48, max=1.48)
    height = Parameter(0.0, "m", "height above the ellipsoid", min=-11e3, max=100e3)
    earth_rate = Parameter(7.2921159e-5, "rad/s", "Earth rate W", min=0.0)
    velocity = Parameter([0.0, 0.0], "m/s", "velocity over ground, east and north")
    latitude_error = Parameter(0.0, "rad", "latitude as believed less the true one", min=-0.1, max=0.1)
    velocity_error = Parameter([0.0, 0.0], "m/s", "velocity as believed less the true one, east and north")
    quantum = Parameter(0.0, "rad/s", "resolution of the commanded rate; 0: none", min=0.0)

    extra = Input([0.0, 0.0, 0.0], "rad/s", "rate commanded besides, platform axes")

    command = Output("rad/s", "commanded rate, platform axes", shape=(3,))
    rate = Output("rad/s", "inertial rate of the level, north-pointing axes", shape=(3,))
    turned = Output("rad", "integral of rate", shape=(3,))
    at = Output("rad", "latitude")

    L = State(0.0, "rad", "latitude")
    angle = State([0.0, 0.0, 0.0], "rad", "integral of the rate")

    def start(self) -> None:
        self.L = self.latitude

    def radii(self, latitude: Number) -> Vector:
        """Return M + h and N + h."""
        s = sin(latitude)
        w = 1.0 - E2 * s * s
        return vector([A * (1.0 - E2) / (w * sqrt(w)) + self.height, A / sqrt(w) + self.height])

    def level(self, latitude: Number, east: Number, north: Number) -> Vector:
        r = self.radii(latitude)
        return vector(
            [
                -north / r[0],
                self.earth_rate * cos(latitude) + east / r[1],
                self.earth_rate * sin(latitude) + east * tan(latitude) / r[1],
            ]
        )

    def flow(self) -> None:
        w = self.level(self.L, self.velocity[0], self.velocity[1])
        self.der.L = -w[0]
        self.der.angle = w

    def outputs(self) -> None:
        self.refuse(fabs(self.L) > 1.49, "latitude {L} rad: within 4.6 deg of a pole north has no direction to follow")
        self.rate = self.level(self.L, self.velocity[0], self.velocity[1])
        believed = self.level(
            self.L + self.latitude_error,
            self.velocity[0] + self.velocity_error[0],
            self.velocity[1] + self.velocity_error[1],
        )
        for k in range(3):
            w = believed[k]
            if self.quantum > 0.0:
                w = self.quantum * floor(w / self.quantum + 0.5)
            self.command[k] = w + self.extra[k]
        self.turned = vector(self.angle)
        self.at = self.L
