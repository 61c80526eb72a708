from __future__ import annotations

from gyrobench.component import Parameter
from gyrobench.component.blocks.surroundings import RoomAndField
from gyrobench.component.math import Number, atan, cos, exp, pi, sin


class Surroundings(RoomAndField):
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

    tau = Parameter(0.0, "s", "time constant of the instrument against the room; 0: it follows at once", min=0.0)
    start_above = Parameter(0.0, "K", "instrument above the room at t = 0")

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

    def inside(self) -> Number:
        temperature = self.following(self.t)
        if self.tau > 0.0:
            begin = self.offset + self.swing * sin(self.phase) + self.start_above
            temperature = temperature + (begin - self.following(0.0)) * exp(-self.t / self.tau)
        return temperature
