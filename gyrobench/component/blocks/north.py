"""North finders: what all of them have, and the least squares over table angle that most of them solve.

Heading psi: of the gyro axis y at table angle 0, clockwise from north seen from above; the table angle counts
anticlockwise (about the axis, up), so that y points to psi - angle.  Level, with A = W cos(latitude):

    w_y = A cos(psi - angle) + bias = C cos(angle) + B sin(angle) + bias      C = A cos psi,  B = A sin psi

The source has alpha = -angle.  [NORTH-COMMON, NORTH-CONT; GSP ch. 5, eq. 5-44, 5-52..5-56]
"""

from __future__ import annotations

from gyrobench.component.blocks.gyro import DEG_H
from gyrobench.component.component import Component
from gyrobench.component.composition import Block, sampled
from gyrobench.component.declarations import Discrete, Input, Output, Parameter
from gyrobench.component.math import Number, atan2, cos, fabs, floor, pi, sin, sqrt

NONE, VALID, ILL, WRONG, MOVING = 0.0, 1.0, 2.0, 3.0, 4.0  # status
FOUR = [0.0, 0.0, 0.0, 0.0]
SIX = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
LARGEST = 85.0 * pi / 180.0  # latitude
NEAR = 0.2  # departure of the horizontal rate from that of the latitude, relative
STEADY = 0.005  # departure of the specific force from gravity, relative


class NorthFinder(Component):
    """Common part of the north finders: samples while the gate is open, an estimate every `every`.

    status: 0 no estimate yet, 1 valid, 2 ill-conditioned, 3 the horizontal rate departs from W cos(latitude) by more
    than 20 %, 4 the specific force departs from gravity by more than 5 mg: the base moves.  sigma is that of white gyro
    noise of the density given.  The parts have the procedures ``take`` (a sample, h long) and ``solve``.
    """

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    latitude = Parameter(40.0 * pi / 180.0, "rad", "latitude, north positive", min=-pi / 2, max=pi / 2)
    earth_rate = Parameter(7.2921159e-5, "rad/s", "Earth rate W", above=0.0)
    gravity = Parameter(9.80665, "m/s2", "gravity of the site", above=0.0)
    density = Parameter(0.3 * DEG_H, "rad/s/sqrt(Hz)", "white noise of the gyro (0.005 deg/sqrt(h))", above=0.0)
    every = Parameter(1.0, "s", "time between two estimates", above=0.0)
    hold = Parameter(1.0, "s", "time for which the last estimate stands before done", min=0.0)

    rate = Input([0.0, 0.0], "rad/s", "measured rate along the axes x and y of the head")
    f = Input([0.0, 0.0, 9.80665], "m/s2", "measured specific force along x, y, z of the head")
    angle = Input(0.0, "rad", "table angle, anticlockwise from above")
    gate = Input(0.0, "1", "0 closed; samples count while it is open")
    phase = Input(1.0, "1", "number of the running phase")
    finished = Input(0.0, "1", "1 when the plan is finished")

    heading = Output("rad", "heading of the axis y at table angle 0, -pi to pi, east positive")
    sigma = Output("rad", "its standard deviation by white gyro noise")
    bias = Output("rad/s", "bias of the gyro along y; 0 where the method does not give it")
    horizontal = Output("rad/s", "horizontal Earth rate as measured")
    status = Output("1", "0 no estimate, 1 valid, 2 ill-conditioned, 3 horizontal rate wrong, 4 base moves")
    done = Output("1", "1 from `hold` after the end of the plan")

    north = Discrete(0.0, "rad/s", "horizontal Earth rate of the latitude")
    up = Discrete(0.0, "rad/s", "vertical Earth rate of the latitude")
    time = Discrete(0.0, "s", "time of the samples")
    open = Discrete(0.0, "1", "phase being sampled; 0: none")
    next = Discrete(0.0, "s", "time of samples at which the next estimate is due")
    force = Discrete(0.0, "m/s", "integral of the size of the specific force")
    psi = Discrete(0.0, "rad", "heading")
    sd = Discrete(0.0, "rad", "its standard deviation")
    offset = Discrete(0.0, "rad/s", "bias")
    seen = Discrete(0.0, "rad/s", "horizontal Earth rate")
    state = Discrete(NONE, "1", "status")
    ended = Discrete(0.0, "1", "plan finished")
    end = Discrete(0.0, "s", "time at which it was")
    over = Discrete(0.0, "1", "done")

    def start(self) -> None:
        self.refuse(
            fabs(self.latitude) > LARGEST,
            "latitude = {latitude} rad: within 5 deg of a pole the horizontal Earth rate is below 9 % of that at the "
            "equator; no north finder by Earth rate",
        )
        self.north = self.earth_rate * cos(self.latitude)
        self.up = self.earth_rate * sin(self.latitude)
        self.next = self.every

    def take(self) -> None:
        """Take a sample."""

    def solve(self) -> None:
        """Set psi, sd, offset, seen and state."""

    @sampled(every=1)
    def count(self) -> None:
        if self.gate == 0.0:
            self.open = 0.0
        elif self.open != self.phase:
            self.open = self.phase  # the first sample: the mean of its step is of the time before
        else:
            self.time = self.time + self.h
            square = self.f[0] * self.f[0] + self.f[1] * self.f[1] + self.f[2] * self.f[2]
            self.force = self.force + self.h * sqrt(square)
            self.take()
        if self.time >= self.next or (self.finished > self.ended and self.time > 0.0):
            self.next = (floor(self.time / self.every) + 1.0) * self.every
            self.solve()
            if self.state == VALID and fabs(self.seen / self.north - 1.0) > NEAR:
                self.state = WRONG
            if self.state == VALID and fabs(self.force / self.time / self.gravity - 1.0) > STEADY:
                self.state = MOVING
        if self.finished > self.ended:
            self.end = self.t
        self.ended = self.finished
        self.over = 1.0 if self.ended > 0.5 and self.t - self.end >= self.hold else 0.0

    def outputs(self) -> None:
        self.heading = self.psi
        self.sigma = self.sd
        self.bias = self.offset
        self.horizontal = self.seen
        self.status = self.state
        self.done = self.over


class HeadingFit(Block):
    """Least squares of w = C cos(angle) + B sin(angle) + b (+ r t + r2 t2 + r3 t3) over time, by normal equations.

    sums: S = integral of phi phi' dt, s = integral of phi w dt.  White noise of density N leaves the covariance
    N2 S^-1.  The constant is always there: without it a bias leaks into a record that is no whole number of turns.
    [NORTH-CONT, NORTH-DRIFT]
    """

    nonlinear = True
    S = Discrete([SIX, SIX, SIX, SIX, SIX, SIX], "1", "normal matrix")
    s = Discrete(SIX, "1", "right-hand side")
    P = Discrete([SIX, SIX, SIX, SIX, SIX, SIX], "1", "its inverse")
    x = Discrete(SIX, "1", "C, B, b, r, r2, r3")
    ok = Discrete(0.0, "1", "1 where the angles determine the unknowns")

    def add(self, w: Number, angle: Number, t: Number, dt: Number) -> None:
        """Add a sample of the length dt."""
        phi = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
        phi[0] = cos(angle)
        phi[1] = sin(angle)
        phi[2] = 1.0
        phi[3] = t
        phi[4] = t * t
        phi[5] = t * t * t
        for i in range(6):
            self.s[i] = self.s[i] + dt * phi[i] * w
            for j in range(6):
                self.S[i][j] = self.S[i][j] + dt * phi[i] * phi[j]

    def solved(self, order: Number) -> None:
        """Solve for x and P; order: of the drift, higher powers of t are left out.  ok = 0 where a pivot falls below
        1e-6 of its diagonal.
        """
        a = [
            [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        ]
        self.ok = 1.0
        for i in range(6):
            for j in range(6):
                a[i][j] = self.S[i][j]
                self.P[i][j] = 1.0 if i == j else 0.0
                if i > 2.0 + order or j > 2.0 + order:
                    a[i][j] = 1.0 if i == j else 0.0
        for k in range(6):
            pivot = a[k][k]
            whole = self.S[k][k] if k < 3.0 + order else 1.0
            if pivot <= 1e-6 * whole:
                self.ok = 0.0
            if self.ok > 0.5:
                for j in range(6):
                    a[k][j] = a[k][j] / pivot
                    self.P[k][j] = self.P[k][j] / pivot
                for i in range(6):
                    if i != k:
                        factor = a[i][k]
                        for j in range(6):
                            a[i][j] = a[i][j] - factor * a[k][j]
                            self.P[i][j] = self.P[i][j] - factor * self.P[k][j]
        for i in range(6):
            self.x[i] = 0.0
            if i < 3.0 + order:
                for j in range(6):
                    if j < 3.0 + order:
                        self.x[i] = self.x[i] + self.P[i][j] * self.s[j]


class RotatingFinder(NorthFinder):
    """North finder whose head is turned to angles or at a rate: least squares of cos, sin, constant and, on request, a
    drift of the bias up to the third power of time.
    """

    ramp = Parameter(0, int, "highest power of time of a drift of the bias that is estimated too", min=0, max=3)
    fit = HeadingFit()

    def sample(self) -> Number:
        """Return the horizontal rate of a sample."""
        return self.rate[1]

    def take(self) -> None:
        self.fit.add(self.sample(), self.angle, self.t, self.h)

    def solve(self) -> None:
        self.fit.solved(self.ramp)
        self.state = ILL
        if self.fit_ok > 0.5:
            c = self.fit_x[0]
            b = self.fit_x[1]
            square = c * c + b * b
            self.seen = sqrt(square)
            self.psi = atan2(b, c)
            self.offset = self.fit_x[2]
            if self.ramp > 0.0:
                drift = self.fit_x[3] + self.t * (self.fit_x[4] + self.t * self.fit_x[5])
                self.offset = self.offset + self.t * drift
            along = b * b * self.fit_P[0][0] - 2.0 * b * c * self.fit_P[0][1] + c * c * self.fit_P[1][1]
            if square > 0.0:  # readings in steps may be alike at all angles
                self.sd = self.density * sqrt(along) / square
                self.state = VALID
