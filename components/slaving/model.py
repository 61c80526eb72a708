from __future__ import annotations

from gyrobench.component import Component, Input, Output, Parameter
from gyrobench.component.math import Number, clip, fabs, floor, pi

DEG = pi / 180.0


class Slaving(Component):
    """Slaving of a directional gyro to a magnetic heading, cut off in turns.  [GYRO-MAGNETIC-COMPASS]

        e = psi_m + declination - psi, wrapped to -pi..pi        rate = k e, limited to +-limit; 0 while cut off
        cut off while |turn| > turn_cut

    With the gyro a' = ... + rate it is a complementary filter: errors of the magnetic heading pass k/(s + k), those of
    the gyro s/(s + k), a drift w leaves w/k at rest.  A latitude correction w sin(latitude) may be given as
    `correction`: it is not cut off.

    Not modelled: gear and motor of the slaving, its dead zone, a fast start.
    Source: GSP ch. 5, section 5.3.2, fig. 5-19 (no equations).
    """

    version = "1.0.0"

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    k = Parameter(1.0 / 60.0, "1/s", "slaving rate per error", above=0.0)
    limit = Parameter(2.0 * DEG / 60.0, "rad/s", "largest slaving rate (2 deg/min)", above=0.0)
    turn_cut = Parameter(0.2 * DEG, "rad/s", "turn rate that cuts the slaving off (0.2 deg/s)", above=0.0)
    cut_off = Parameter(True, bool, "1: cut off in turns")
    declination = Parameter(0.0, "rad", "declination added to the magnetic heading", min=-3.1416, max=3.1416)
    correction = Parameter(0.0, "rad/s", "rate against the known drift of the gyro, always there")

    psi = Input(0.0, "rad", "heading of the gyro, clockwise")
    psi_m = Input(0.0, "rad", "magnetic heading, clockwise")
    turn = Input(0.0, "rad/s", "turn rate of the vehicle about its vertical")

    rate = Output("rad/s", "precession asked for, clockwise")
    error = Output("rad", "magnetic heading and declination less heading, -pi to pi")
    cut = Output("1", "1 while the slaving is cut off")
    limited = Output("1", "1 while its rate is at the limit")

    def wrapped(self) -> Number:
        e = self.psi_m + self.declination - self.psi
        return e - 2.0 * pi * floor(e / (2.0 * pi) + 0.5)

    def outputs(self) -> None:
        self.error = self.wrapped()
        self.cut = 1.0 if self.cut_off and fabs(self.turn) > self.turn_cut else 0.0
        wanted = self.k * self.error
        self.limited = 1.0 if fabs(wanted) > self.limit else 0.0
        self.rate = self.correction
        if self.cut < 0.5:
            self.rate = self.correction + clip(wanted, -self.limit, self.limit)
