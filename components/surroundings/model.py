from __future__ import annotations

from gyrobench.component import IDENTITY, Component, Input, Output, Parameter, Rotation
from gyrobench.component.math import Number, Vector, atan, cos, exp, pi, sin, vector

NONE = [0.0, 0.0, 0.0]


class Surroundings(Component):
    """Temperature and magnetic field of the surroundings at the instrument.  [ENV-DISTURBANCE]

    The room is `offset` above the temperature that the instrument's coefficients belong to, drifts, and swings with the
    day; the instrument follows with one time constant tau (0: without delay) and starts `start` above the room:

        room = offset + ramp t + swing sin(w t + phase),   w = 2 pi / period
        tau T' = room - T,   T(0) = room(0) + start

    in closed form, so that neither step nor length of the run matters, with d = atan(w tau):

        T = p(t) + (T(0) - p(0)) e^(-t/tau),   p = offset + ramp (t - tau) + swing cos(d) sin(w t + phase - d)

    Between the ends of the instrument along its axes j there are temperature differences: lasting ones, growing ones,
    and a share of what room and instrument are apart, as heat flows in:

        dT_j = gradient_j + gradient_ramp_j t + share_j (room - T)

    The magnetic field is given in ENU, with differences over the length of the instrument along E, N, U (change of its
    size: a vector too), both turned into the axes of the instrument, on a table with one axis (inner = 0) or two:

        B = C (field + field_swing sin(w t + phase)),   dB = C field_difference
        C = face Rz(angle) base axes,   inner = 1: C = face Ry(angle_y) Rx(angle) base axes

    axes: of the stand that carries the table, in ENU.

    Not modelled: several time constants, air flow, heat of motor and gyro rotor, wobble, squareness and tilt of the
    table in C (of second order), direction of the field's change, shields (give the field inside).
    Source: Hu 1981, section 5.6, Tables 5-4..5-7.
    """

    version = "1.0.0"

    offset = Parameter(0.0, "K", "room at the start, above the temperature of the coefficients")
    ramp = Parameter(0.0, "K/s", "drift of the room")
    swing = Parameter(0.0, "K", "amplitude of the room's sine")
    period = Parameter(86400.0, "s", "period of the sines", above=0.0)
    phase = Parameter(0.0, "rad", "phase of the sines at t = 0")
    tau = Parameter(0.0, "s", "time constant of the instrument against the room; 0: it follows at once", min=0.0)
    start_above = Parameter(0.0, "K", "instrument above the room at t = 0")
    gradient = Parameter(NONE, "K", "lasting temperature differences along the instrument's axes")
    gradient_ramp = Parameter(NONE, "K/s", "their drift")
    share = Parameter(NONE, "1", "temperature differences per kelvin between room and instrument")
    field = Parameter(NONE, "T", "magnetic field, ENU")
    field_swing = Parameter(NONE, "T", "amplitude of its sine, ENU")
    field_difference = Parameter(NONE, "T", "differences of the field over the instrument along E, N, U")
    base = Rotation("rows: table axes in ENU at angle 0; the third is the axis, of two axes X outer, Y inner")
    inner = Parameter(0, int, "1: a table with two axes, X outer and Y inner", min=0, max=1)

    angle = Input(0.0, "rad", "table angle, of two axes the outer one")
    angle_y = Input(0.0, "rad", "angle of the inner axis")
    axes = Input(IDENTITY, "1", "rows: axes of the stand that carries the table, in ENU")
    face = Input(IDENTITY, "1", "mount: rows are the instrument's axes in table axes")

    temperature = Output("K", "mean temperature of the instrument above that of its coefficients")
    room = Output("K", "temperature of the room above that of the coefficients")
    dT = Output("K", "temperature differences along the instrument's axes", shape=(3,))
    B = Output("T", "magnetic field along the instrument's axes", shape=(3,))
    dB = Output("T", "differences of the magnetic field over the instrument, along its axes", shape=(3,))

    def start(self) -> None:
        self.refuse(
            self.tau == 0.0 and self.start_above != 0.0,
            "start_above = {start_above} K needs a time constant: tau must be above 0 s",
        )

    def following(self, t: Number) -> Number:
        """Return the temperature that the instrument settles to, at the time t."""
        lag = atan(2.0 * pi / self.period * self.tau)
        wave = self.swing * cos(lag) * sin(2.0 * pi / self.period * t + self.phase - lag)
        return self.offset + self.ramp * (t - self.tau) + wave

    def turned(self, v: Vector) -> Vector:
        """Return a vector in table axes at angle 0 in those at the present angles."""
        c = cos(self.angle)
        s = sin(self.angle)
        if self.inner == 0.0:
            return vector([c * v[0] + s * v[1], c * v[1] - s * v[0], v[2]])
        y = c * v[1] + s * v[2]
        z = c * v[2] - s * v[1]
        cy = cos(self.angle_y)
        sy = sin(self.angle_y)
        return vector([cy * v[0] - sy * z, y, cy * z + sy * v[0]])

    def outputs(self) -> None:
        wave = sin(2.0 * pi / self.period * self.t + self.phase)
        self.room = self.offset + self.ramp * self.t + self.swing * wave
        self.temperature = self.following(self.t)
        if self.tau > 0.0:
            begin = self.offset + self.swing * sin(self.phase) + self.start_above
            self.temperature = self.temperature + (begin - self.following(0.0)) * exp(-self.t / self.tau)
        apart = self.room - self.temperature
        for j in range(3):
            self.dT[j] = self.gradient[j] + self.gradient_ramp[j] * self.t + self.share[j] * apart
        b = self.turned(self.base @ (self.axes @ (vector(self.field) + wave * vector(self.field_swing))))
        d = self.turned(self.base @ (self.axes @ vector(self.field_difference)))
        self.B = self.face @ b
        self.dB = self.face @ d
