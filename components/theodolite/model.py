from __future__ import annotations

from gyrobench.component import Component, Input, Noise, Output, Parameter, sampled
from gyrobench.component.math import Number, atan2, cos, fabs, floor, pi, sin, sqrt, tan

ARCSEC = pi / 648000.0
STAR, MIRROR, AXIS, HEAD = 1.0, 2.0, 3.0, 4.0


class Theodolite(Component):
    """Autocollimating theodolite with a plate level before a test stand, and an inclinometer on the stand's axis.
    [STAND-ALIGNMENT]

    The target of the plan says what is sighted, its sign the face (+ left, - right, the inclinometer turned round):

        1  a star      hour angle H(t) = hour_angle + W t and declination of the date
        2  the mirror  on the stand: its normal has the azimuth `azimuth` of the stand's axis, at the horizon
        0  as 2, at the end of a plan
        3  the axis    by the inclinometer: latitude + elevation + face inclinometer_zero
        4  a mirror    on the head of a north finder: its normal has the azimuth `head`, at the horizon

    Azimuths A from north to east, h the altitude with refraction, all in radians:

        reading = A' - circle_zero + face (collimation/cos h + trunnion tan h) + eccentricity sin(reading) + noise
        level   = face v + level_zero + noise     v = lean_N cos A + lean_E sin A

    A', h are those against the vertical axis, which leans by the small rotation (lean_E, lean_N, 0), exactly to first
    order in the lean; v is its lean across the line of sight, to the right.  The star is moved by diurnal aberration,
    0.32 arcsec cos(latitude) to the east, and raised by refraction R = 1.02'/tan(h + 10.3/(h + 5.11)), h in degrees,
    times pressure/1010 hPa 283 K/temperature.

    Refused: a target that is none of these, a star below 5 degrees.
    Not modelled: refraction to the side, squareness of mirror and axis, circle errors of higher orders, squares of
    collimation and trunnion.
    Source: Hu 1981, section 5.7; Meeus 1998, chapters 13, 16, 23.
    """

    version = "1.1.0"

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    latitude = Parameter(45.75 * pi / 180.0, "rad", "latitude, north positive", min=-1.5533, max=1.5533)
    earth_rate = Parameter(7.2921159e-5, "rad/s", "rate at which the sky turns", above=0.0)
    hour_angle = Parameter(0.0, "rad", "hour angle of the star at t = 0, to the west")
    declination = Parameter(1.5590, "rad", "its declination", min=-1.5708, max=1.5708)
    pressure = Parameter(101325.0, "Pa", "pressure of the air, for the refraction", min=0.0)
    temperature = Parameter(283.15, "K", "temperature of the air", above=200.0)
    azimuth = Parameter(0.0, "rad", "azimuth of the stand's axis, from north to east", min=-0.1, max=0.1)
    elevation = Parameter(0.0, "rad", "elevation of the stand's axis above the latitude", min=-0.1, max=0.1)
    head = Parameter(0.0, "rad", "azimuth of the normal of the mirror on a north finder's head")
    circle_zero = Parameter(0.3, "rad", "azimuth of the zero of the circle")
    collimation = Parameter(0.0, "rad", "collimation error", min=-0.01, max=0.01)
    trunnion = Parameter(0.0, "rad", "tilt of the trunnion axis", min=-0.01, max=0.01)
    lean = Parameter([0.0, 0.0], "rad", "lean of the vertical axis about E and N", min=-0.01, max=0.01)
    level_zero = Parameter(0.0, "rad", "zero of the plate level")
    inclinometer_zero = Parameter(0.0, "rad", "zero of the inclinometer")
    eccentricity = Parameter(0.0, "rad", "error of the circle once a turn")
    pointing = Noise(4.8e-6, "rad/sqrt(Hz)", "noise density of a sight, and of the inclinometer")
    bubble = Noise(1e-6, "rad/sqrt(Hz)", "noise density of the plate level")

    target = Input(1.0, "1", "what is sighted: 1 star, 2 mirror, 3 axis, 4 head; negative: face right")

    reading = Output("rad", "horizontal circle, face right less half a turn; or the inclinometer")
    level = Output("rad", "plate level across the line of sight")
    angle_read = Output("rad", "the target, as an angle")
    in_position = Output("1", "1: sighted")
    altitude = Output("rad", "altitude of the line of sight, with refraction")

    def direction(self) -> Number:
        """Return azimuth times 1 of the star; see :meth:`height` for its altitude."""
        return atan2(self.east(), self.north())

    def east(self) -> Number:
        H = self.hour_angle + self.earth_rate * self.t
        return -cos(self.declination) * sin(H) + 0.32 * ARCSEC * cos(self.latitude)

    def north(self) -> Number:
        H = self.hour_angle + self.earth_rate * self.t
        return sin(self.declination) * cos(self.latitude) - cos(self.declination) * cos(H) * sin(self.latitude)

    def height(self) -> Number:
        """Return the altitude of the star with refraction."""
        H = self.hour_angle + self.earth_rate * self.t
        up = sin(self.declination) * sin(self.latitude) + cos(self.declination) * cos(H) * cos(self.latitude)
        h = atan2(up, sqrt(self.east() * self.east() + self.north() * self.north())) * 180.0 / pi
        bent = 1.02 / 60.0 / tan((h + 10.3 / (h + 5.11)) * pi / 180.0)
        return (h + bent * self.pressure / 101000.0 * 283.0 / self.temperature) * pi / 180.0

    @sampled(every=1)
    def tick(self) -> None:
        kind = fabs(self.target)
        whole = fabs(kind - floor(kind + 0.5)) < 1e-9
        self.refuse(
            not whole or kind > HEAD, "target = {target}: must be 1 star, 2 mirror, 3 axis, 4 head, or 0 at the end"
        )
        self.refuse(kind == STAR and self.height() < 0.0873, "the star is below 5 deg")

    def outputs(self) -> None:
        kind = fabs(self.target)
        face = 1.0 if self.target > 0.0 else -1.0
        A = self.azimuth
        h = 0.0
        if kind == STAR:
            A = self.direction()
            h = self.height()
        if kind == HEAD:
            A = self.head
        across = self.lean[1] * cos(A) + self.lean[0] * sin(A)
        # against the leaning axis: v - lean x v
        e = cos(h) * sin(A) - self.lean[1] * sin(h)
        n = cos(h) * cos(A) + self.lean[0] * sin(h)
        u = sin(h) + self.lean[1] * cos(h) * sin(A) - self.lean[0] * cos(h) * cos(A)
        seen = atan2(e, n)
        high = atan2(u, sqrt(e * e + n * n))
        circle = seen - self.circle_zero + face * (self.collimation / cos(high) + self.trunnion * tan(high))
        self.reading = circle + self.eccentricity * sin(circle) + self.noise.pointing
        if kind == AXIS:
            self.reading = self.latitude + self.elevation + face * self.inclinometer_zero + self.noise.pointing
        self.level = face * across + self.level_zero + self.noise.bubble
        self.altitude = h
        self.angle_read = self.target
        self.in_position = 1.0
