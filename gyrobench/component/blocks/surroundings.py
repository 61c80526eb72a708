"""Surroundings of an instrument on a table: room, temperature differences, magnetic field."""

from __future__ import annotations

from gyrobench.component.component import Component
from gyrobench.component.declarations import Input, Output, Parameter
from gyrobench.component.math import Number, Vector, cos, pi, sin, vector
from gyrobench.component.rotation import IDENTITY, Rotation

NONE = [0.0, 0.0, 0.0]


class RoomAndField(Component):
    """Common part of the surroundings of an instrument: the room, heat that flows in, the magnetic field at its axes.

        room = offset + ramp t + swing sin(w t + phase),   w = 2 pi / period
        dT_j = gradient_j + gradient_ramp_j t + share_j (what surrounds the instrument, less the instrument)
        B = C (field + field_swing sin(w t + phase)),   dB = C field_difference

    A part gives the temperature: `around` (what surrounds the instrument) and `inside` (the instrument).
    [ENV-DISTURBANCE]
    """

    offset = Parameter(0.0, "K", "room at the start, above the temperature of the coefficients")
    ramp = Parameter(0.0, "K/s", "drift of the room")
    swing = Parameter(0.0, "K", "amplitude of the room's sine")
    period = Parameter(86400.0, "s", "period of the sines", above=0.0)
    phase = Parameter(0.0, "rad", "phase of the sines at t = 0")
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

    def wave(self) -> Number:
        """Return the sine of the room and of the field."""
        return sin(2.0 * pi / self.period * self.t + self.phase)

    def room_now(self) -> Number:
        """Return the temperature of the room."""
        return self.offset + self.ramp * self.t + self.swing * self.wave()

    def around(self) -> Number:
        """Return the temperature of what surrounds the instrument."""
        return self.room_now()

    def inside(self) -> Number:
        """Return the temperature of the instrument."""
        return self.around()

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
        wave = self.wave()
        self.room = self.room_now()
        self.temperature = self.inside()
        apart = self.around() - self.temperature
        for j in range(3):
            self.dT[j] = self.gradient[j] + self.gradient_ramp[j] * self.t + self.share[j] * apart
        b = self.turned(self.base @ (self.axes @ (vector(self.field) + wave * vector(self.field_swing))))
        d = self.turned(self.base @ (self.axes @ vector(self.field_difference)))
        self.B = self.face @ b
        self.dB = self.face @ d
