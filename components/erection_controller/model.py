from __future__ import annotations

from gyrobench.component import Component, Input, Output, Parameter, sampled
from gyrobench.component.math import Number, clip, fabs, pi, sign, sqrt

DEG = pi / 180.0


class ErectionController(Component):
    """Erection of a vertical gyro: level switches, cross torques, cut-off in manoeuvre, fast start.  [VERTICAL-GYRO]

        T_x = -law(e_y),   T_y = +law(e_x)          so that e' = -law(e) / H on both axes (cross erection)

        law 0, liquid switches: law = H rate sign(e) outside the dead zone, else 0
        law 1, linear:          law = H gain e, limited to +-H rate

    A torque about the same axis as the tilt (cross = 0) moves the rotor around a cone and never erects it.

    Cut-off: the switches follow the specific force and cannot distinguish acceleration from tilt.  Channel e_x opens
    while |f_y| > a_cut, that of e_y while |f_x| > a_cut, both while |turn| > turn_cut; then only free drift is left.
    Fast start: until t = fast_time the rate is `fast` times as large and nothing is cut off.

    Refused while it runs: |f| below 0.5 g0 (no apparent vertical), and a lean beyond 60 deg after the fast start.

    Not modelled: hysteresis and lag of the liquid, tilt of the switches on the element, cut-off by air data.
    Source: GSP ch. 5, section 5.3.1 (text; no equations); VERTICAL-GYRO.
    """

    version = "1.0.0"

    H = Parameter(0.5, "N.m.s", "spin angular momentum of the gyro", above=0.0)
    law = Parameter(0, int, "0 liquid switches (on-off), 1 linear", min=0, max=1)
    rate = Parameter(4.0 * DEG / 60.0, "rad/s", "erection rate (4 deg/min)", above=0.0)
    dead_zone = Parameter(DEG / 6.0, "rad", "dead zone of the switches (10 arcmin)", min=0.0)
    gain = Parameter(0.05, "1/s", "linear law: rate per lean", above=0.0)
    cross = Parameter(True, bool, "1: cross erection; 0: torque about the axis of the tilt (does not erect)")
    cut_off = Parameter(True, bool, "1: channels open in manoeuvre")
    a_cut = Parameter(0.980665, "m/s2", "specific force across that opens a channel (0.1 g)", above=0.0)
    turn_cut = Parameter(0.2 * DEG, "rad/s", "turn rate that opens both (0.2 deg/s)", above=0.0)
    fast = Parameter(10.0, "1", "factor of the rate during the fast start", min=1.0)
    fast_time = Parameter(0.0, "s", "end of the fast start; 0: none", min=0.0)

    e_x = Input(0.0, "rad", "lean against the apparent vertical about x")
    e_y = Input(0.0, "rad", "lean against the apparent vertical about y")
    f_inner = Input([0.0, 0.0, 9.80665], "m/s2", "specific force in axes of the inner element")
    turn = Input(0.0, "rad/s", "inertial rate of the vehicle along the rotor axis")

    T_x = Output("N.m", "torque about x of the inner element")
    T_y = Output("N.m", "torque about y of the inner element")
    switch_x = Output("1", "state of the switch of e_x: -1, 0, 1")
    switch_y = Output("1", "state of the switch of e_y: -1, 0, 1")
    cut = Output("1", "channels cut off: 0, 1, 2")
    starting = Output("1", "1 during the fast start")

    def torque(self, e: Number, factor: Number) -> Number:
        if self.law == 1.0:
            return self.H * factor * clip(self.gain * e, -self.rate, self.rate)
        return self.H * factor * self.rate * sign(e) if fabs(e) > self.dead_zone else 0.0

    @sampled(every=1)
    def tick(self) -> None:
        f2 = self.f_inner[0] * self.f_inner[0] + self.f_inner[1] * self.f_inner[1]
        size = sqrt(f2 + self.f_inner[2] * self.f_inner[2])
        self.refuse(
            size < 0.5 * 9.80665, "the specific force is below 0.5 g: there is no apparent vertical to erect to"
        )
        tilted = fabs(self.e_x) > 60.0 * DEG or fabs(self.e_y) > 60.0 * DEG
        self.refuse(
            tilted and self.t >= self.fast_time,
            "the rotor leans more than 60 deg (e_x = {e_x}, e_y = {e_y} rad): give a fast start, fast_time > 0 s",
        )

    def outputs(self) -> None:
        self.starting = 1.0 if self.t < self.fast_time else 0.0
        factor = self.fast if self.starting > 0.0 else 1.0
        open_x = 0.0
        open_y = 0.0
        if self.cut_off and self.starting == 0.0:
            turning = fabs(self.turn) > self.turn_cut
            open_x = 1.0 if turning or fabs(self.f_inner[1]) > self.a_cut else 0.0
            open_y = 1.0 if turning or fabs(self.f_inner[0]) > self.a_cut else 0.0
        by_x = 0.0 if open_x > 0.0 else self.torque(self.e_x, factor)
        by_y = 0.0 if open_y > 0.0 else self.torque(self.e_y, factor)
        self.switch_x = sign(by_x)
        self.switch_y = sign(by_y)
        self.cut = open_x + open_y
        if self.cross:
            self.T_x = -by_y
            self.T_y = by_x
        else:
            self.T_x = -by_x
            self.T_y = -by_y
