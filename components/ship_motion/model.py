from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Output, Parameter, State, sampled
from gyrobench.component.math import Number, Vector, clip, cos, fabs, floor, index, pi, sin, vector

NONE = [0.0] * 99
MOST = 85.0 * pi / 180.0  # latitude


class ShipMotion(Component):
    """Ship on a sphere: course, speed, latitude, roll and pitch, as a list of manoeuvres.  [GYROCOMPASS]

    One row for each phase of a plan; it acts while the gate is open, else course and speed stay as they are:

        V' = forward,  psi' = turn          forward along the keel, psi clockwise from north, V over the ground
        roll  r = A_r sin(2 pi f_r s),  pitch p = A_p sin(2 pi f_p s)      s since the gate opened; fading in over onset

    Rate of the level axes E, N, U, with V_N = V cos psi, V_E = V sin psi, latitude L:

        rate = (-V_N/R, w cos L + V_E/R, w sin L + V_E tan L/R),   L' = V_N/R with sailing = 1

    Specific force in them at a compass that stands `lever` above the axes of roll and pitch:

        f = V' + (0, 0, gravity) + (2 w + rate of transport) x V + second derivative of the lever's end

    which is lever sin r to starboard, -lever sin p forward, lever (cos r + cos p - 2) up.  With sailing = 0 the ship
    has the rates of its speed but stays at its latitude, as on a test stand.

    Not modelled: flattening of the Earth (up to 0.7 % of the rates of the speed), current and leeway, heave, drift in
    the turn, lever arms in the plane, the end of rolling (it stops at once with the gate).
    Source: own derivation.
    """

    version = "1.0.0"
    integrator = "rk4"
    rk4_substeps = 1

    step = Parameter(1.0, "s", "largest internal step", above=0.0)
    latitude = Parameter(0.6981317007977318, "rad", "geographic latitude at the start (40 deg)", min=-MOST, max=MOST)
    earth_rate = Parameter(7.2921159e-5, "rad/s", "Earth rate", min=0.0)
    radius = Parameter(6.371e6, "m", "radius of the Earth", above=1e6)
    gravity = Parameter(9.80665, "m/s2", "local gravity", above=0.0)
    sailing = Parameter(False, bool, "1: the latitude follows the way; 0: it stays")
    start_heading = Parameter(0.0, "rad", "heading at the start, clockwise")
    start_speed = Parameter(0.0, "m/s", "speed at the start")
    lever = Parameter(10.0, "m", "height of the compass above the axes of roll and pitch")
    onset = Parameter(60.0, "s", "time in which roll and pitch fade in", above=0.0)
    forward = Parameter(NONE, "m/s2", "of each phase: acceleration along the keel")
    turn = Parameter(NONE, "rad/s", "of each phase: turn rate, clockwise")
    roll = Parameter(NONE, "rad", "of each phase: amplitude of the roll", min=-1.0, max=1.0)
    roll_frequency = Parameter(NONE, "Hz", "of each phase: its frequency", min=0.0)
    pitch = Parameter(NONE, "rad", "of each phase: amplitude of the pitch", min=-1.0, max=1.0)
    pitch_frequency = Parameter(NONE, "Hz", "of each phase: its frequency", min=0.0)

    phase = Input(1.0, "1", "number of the running phase, from 1")
    gate = Input(0.0, "1", "1 while the manoeuvre acts")

    rate = Output("rad/s", "inertial rate of the level axes E, N, U", shape=(3,))
    f = Output("m/s2", "specific force at the compass, E, N, U", shape=(3,))
    heading = Output("rad", "true heading, clockwise, -pi to pi")
    speed = Output("m/s", "speed over the ground")
    latitude_now = Output("rad", "latitude")
    angle = Output("rad", "roll, starboard down; pitch, bow up", shape=(2,))

    psi = State(0.0, "rad", "heading, clockwise")
    V = State(0.0, "m/s", "speed")
    L = State(0.0, "rad", "latitude")

    opened = Discrete(0.0, "s", "when the gate opened")

    def start(self) -> None:
        self.psi = self.start_heading
        self.V = self.start_speed
        self.L = self.latitude

    def on(self) -> Number:
        return 1.0 if self.gate > 0.5 and self.phase > 0.5 and self.phase < 99.5 else 0.0

    def flow(self) -> None:
        k = clip(self.phase - 1.0, 0.0, 98.0)
        self.der.V = self.on() * self.forward[index(k)]
        self.der.psi = self.on() * self.turn[index(k)]
        self.der.L = self.V * cos(self.psi) / self.radius if self.sailing else 0.0

    @sampled(every=1)
    def tick(self) -> None:
        if self.gate <= 0.5:
            self.opened = self.t
        self.refuse(fabs(self.L) > MOST, "the ship has come beyond 85 deg of latitude: a gyrocompass ends there")

    def swing(self, size: Number, f: Number) -> Vector:
        """Return an angle of roll or pitch with its first and second derivative."""
        s = self.t - self.opened
        w = 2.0 * pi * f
        a = vector([sin(w * s), w * cos(w * s), -w * w * sin(w * s)])
        if s < self.onset:
            u = pi / self.onset
            b = vector([0.5 - 0.5 * cos(u * s), 0.5 * u * sin(u * s), 0.5 * u * u * cos(u * s)])
            a = vector([a[0] * b[0], a[1] * b[0] + a[0] * b[1], a[2] * b[0] + 2.0 * a[1] * b[1] + a[0] * b[2]])
        on = self.on() * size
        return vector([on * a[0], on * a[1], on * a[2]])

    def outputs(self) -> None:
        k = clip(self.phase - 1.0, 0.0, 98.0)
        s = sin(self.psi)
        c = cos(self.psi)
        north = self.V * c
        east = self.V * s
        w_n = self.earth_rate * cos(self.L)
        w_u = self.earth_rate * sin(self.L)
        over = east * sin(self.L) / cos(self.L) / self.radius
        self.rate[0] = -north / self.radius
        self.rate[1] = w_n + east / self.radius
        self.rate[2] = w_u + over
        r = self.swing(self.roll[index(k)], self.roll_frequency[index(k)])
        p = self.swing(self.pitch[index(k)], self.pitch_frequency[index(k)])
        # second derivatives of lever sin r, -lever sin p, lever (cos r + cos p)
        across = self.lever * (r[2] * cos(r[0]) - r[1] * r[1] * sin(r[0]))
        ahead = -self.lever * (p[2] * cos(p[0]) - p[1] * p[1] * sin(p[0]))
        rise = -self.lever * (r[2] * sin(r[0]) + r[1] * r[1] * cos(r[0]) + p[2] * sin(p[0]) + p[1] * p[1] * cos(p[0]))
        across = across + self.on() * self.turn[index(k)] * self.V
        ahead = ahead + self.on() * self.forward[index(k)]
        self.f[0] = ahead * s + across * c - (2.0 * w_u + over) * north
        self.f[1] = ahead * c - across * s + (2.0 * w_u + over) * east
        self.f[2] = self.gravity + rise - 2.0 * w_n * east - (east * east + north * north) / self.radius
        self.heading = self.psi - 2.0 * pi * floor(self.psi / (2.0 * pi) + 0.5)
        self.speed = self.V
        self.latitude_now = self.L
        self.angle[0] = r[0]
        self.angle[1] = p[0]
