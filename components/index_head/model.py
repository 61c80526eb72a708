from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Noise, Output, Parameter, sampled
from gyrobench.component.math import cos, exp, fabs, floor, index, pi, sign, sin

IDENTITY = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]


class IndexHead(Component):
    """Indexing head: a table that stands in one of up to 24 positions only.  [TEST-ACC-MULTI, TEST-8POS, optical_index]

    Position k (from 0) of N stands at its nominal angle and a small error of its own,

        x = 2 pi k / N + error[k mod N] + repeat      k = round(target N / 2 pi), or the nearest of that number

    What table_rate does not have is this table of errors and the reading: angle_read is the nominal angle, for nobody
    knows the error.  A move (s from 0 to 1 as 3 s2 - 2 s3, peak rate index_rate) is always finished before the next
    begins, and ends `creep` short of the position; the rest dies away with the time constant `settling`:

        x = x_k - sign(move) creep exp(-(t - t_arrival) / settling)

    With B = tilted base (third row: the axis, ENU), Rz the passive rotation by x, rate and acc those of x:

        f = face Rz B f_local      w = Rz B omega_local      omega = face (w + (0, 0, rate))
        alpha = face (w_y rate, -w_x rate, acc)

    Not modelled: play and lifting of the head, errors of the move itself, wobble, acceleration of the instrument.
    Source: Hu 1981, sections 3.1, 3.4, 5.2; TEST-8POS, TEST-ACC-MULTI.
    """

    version = "1.0.0"

    base = Parameter(IDENTITY, "1", "rows: head axes in ENU at angle 0; the third is the axis")
    tilt = Parameter([0.0, 0.0], "rad", "axis tilt about the first and second head axis", min=-0.1, max=0.1)
    positions = Parameter(8, int, "number of positions N of a turn", min=2, max=24)
    error = Parameter([0.0] * 24, "rad", "error of each position", min=-0.1, max=0.1)
    repeat = Noise(0.0, "rad", "rms of the repeatability, drawn for each move", per="step")
    index_rate = Parameter(0.5, "rad/s", "peak rate of a move", above=0.0)
    creep = Parameter(0.0, "rad", "angle short of the position at the end of a move", min=0.0, max=0.1)
    settling = Parameter(1.0, "s", "time constant with which it dies away", above=0.0)
    tolerance = Parameter(1e-7, "rad", "in position when less than this is left", above=0.0)

    f_local = Input([0.0, 0.0, 9.80665], "m/s2", "specific force at the site, ENU")
    omega_local = Input([0.0, 0.0, 0.0], "rad/s", "Earth rate at the site, ENU")
    mode = Input(0.0, "1", "0 hold, 1 index")
    target = Input(0.0, "1", "angle of the position, rad")
    number = Input(0.0, "1", "number of the position, 1 to N; 0: by target")
    face = Input(IDENTITY, "1", "mount: rows are the instrument axes in head axes")

    angle = Output("rad", "head angle, cumulative")
    rate = Output("rad/s", "its rate")
    angle_read = Output("rad", "nominal angle")
    omega = Output("rad/s", "inertial rate, face axes", shape=(3,))
    alpha = Output("rad/s2", "derivative of the inertial rate, face axes", shape=(3,))
    f = Output("m/s2", "specific force, face axes", shape=(3,))
    position = Output("1", "number of the position, 1 to N, reached or gone to")
    in_position = Output("1", "1 when the head stands in its position")

    tilted = Discrete(IDENTITY, "1", "base with tilt")
    pitch = Discrete(0.0, "rad", "angle between positions")
    goal = Discrete(0.0, "1", "position gone to, counted from 0 over all turns")
    x = Discrete(0.0, "rad", "angle")
    v = Discrete(0.0, "rad/s", "rate")
    a = Discrete(0.0, "rad/s2", "acceleration")
    part = Discrete(1.0, "1", "share of the move that is done")
    arrived = Discrete(0.0, "1", "in position")
    t_from = Discrete(0.0, "s", "start of the move")
    t_move = Discrete(0.0, "s", "its duration")
    t_last = Discrete(0.0, "s", "time of x, v, a")
    x_from = Discrete(0.0, "rad", "angle at its start")
    x_to = Discrete(0.0, "rad", "angle of the position gone to")
    read_from = Discrete(0.0, "rad", "reading at its start")
    short = Discrete(0.0, "rad", "creep with the sign of the move")

    def start(self) -> None:
        for i in range(3):
            for j in range(3):
                dot = 0.0 if i != j else -1.0
                for k in range(3):
                    dot = dot + self.base[i][k] * self.base[j][k]
                self.refuse(
                    fabs(dot) > 1e-9,
                    "base is no rotation: its rows must be unit vectors at right angles, to 1e-9",
                )
        det = self.base[0][0] * (self.base[1][1] * self.base[2][2] - self.base[1][2] * self.base[2][1])
        det = det - self.base[0][1] * (self.base[1][0] * self.base[2][2] - self.base[1][2] * self.base[2][0])
        det = det + self.base[0][2] * (self.base[1][0] * self.base[2][1] - self.base[1][1] * self.base[2][0])
        self.refuse(det < 0.0, "base is left-handed (determinant -1): reverse one row")
        c1 = cos(self.tilt[0])
        s1 = sin(self.tilt[0])
        c2 = cos(self.tilt[1])
        s2 = sin(self.tilt[1])
        for k in range(3):
            first = self.base[0][k]
            second = c1 * self.base[1][k] + s1 * self.base[2][k]
            third = c1 * self.base[2][k] - s1 * self.base[1][k]
            self.tilted[0][k] = c2 * first - s2 * third
            self.tilted[1][k] = second
            self.tilted[2][k] = s2 * first + c2 * third
        self.pitch = 2.0 * pi / self.positions
        self.goal = 0.0
        self.x = self.error[0]
        self.x_from = self.x
        self.x_to = self.x
        self.read_from = 0.0
        self.v = 0.0
        self.a = 0.0
        self.part = 1.0
        self.short = 0.0
        self.arrived = 0.0
        self.t_from = self.t
        self.t_move = 0.0
        self.t_last = self.t

    @sampled(every=1)
    def tick(self) -> None:
        self.refuse(
            not (self.mode == 0.0 or self.mode == 1.0),
            "mode = {mode} must be 0 hold or 1 index: an indexing head does not turn at a rate",
        )
        if self.mode == 1.0 and self.part == 1.0:
            wish = floor(self.target / self.pitch + 0.5)
            if self.number == 0.0:
                self.refuse(
                    fabs(self.target - wish * self.pitch) > 1e-4,
                    "target {target} rad is none of the {positions} positions of the head: it must be a multiple of "
                    "{pitch} rad",
                )
            else:
                self.refuse(
                    self.number < 0.0 or self.number > self.positions or self.number != floor(self.number),
                    "number = {number} must be 1 to {positions}, or 0 for the position at the target",
                )
                turns = floor((self.goal - (self.number - 1.0)) / self.positions + 0.5)
                wish = self.number - 1.0 + turns * self.positions
            if wish != self.goal:
                self.read_from = self.goal * self.pitch
                self.goal = wish
                self.x_from = self.x
                self.x_to = wish * self.pitch + self.error[index(self.place())] + self.noise.repeat
                self.short = sign(self.x_to - self.x_from) * self.creep
                self.t_from = self.t_last
                self.t_move = 1.5 * fabs(self.x_to - self.x_from) / self.index_rate
        s = self.t - self.t_from
        self.arrived = 0.0
        if s < self.t_move:
            s = s / self.t_move
            way = self.x_to - self.short - self.x_from
            self.part = s * s * (3.0 - 2.0 * s)
            self.x = self.x_from + way * self.part
            self.v = way * 6.0 * s * (1.0 - s) / self.t_move
            self.a = way * (6.0 - 12.0 * s) / (self.t_move * self.t_move)
        else:
            self.part = 1.0
            rest = self.short * exp((self.t_move - s) / self.settling)
            self.x = self.x_to - rest
            self.v = rest / self.settling
            self.a = -self.v / self.settling
            self.arrived = 1.0 if fabs(rest) < self.tolerance else 0.0
        self.t_last = self.t

    def place(self):
        return self.goal - self.positions * floor(self.goal / self.positions)

    def outputs(self) -> None:
        c = cos(self.x)
        s = sin(self.x)
        e = [0.0, 0.0, 0.0]  # Earth rate and specific force in base axes, at angle 0
        g = [0.0, 0.0, 0.0]
        for i in range(3):
            row = self.tilted[i][0] * self.omega_local[0] + self.tilted[i][1] * self.omega_local[1]
            e[i] = row + self.tilted[i][2] * self.omega_local[2]
            row = self.tilted[i][0] * self.f_local[0] + self.tilted[i][1] * self.f_local[1]
            g[i] = row + self.tilted[i][2] * self.f_local[2]
        wx = c * e[0] + s * e[1]
        wy = c * e[1] - s * e[0]
        wz = e[2] + self.v
        fx = c * g[0] + s * g[1]
        fy = c * g[1] - s * g[0]
        for i in range(3):
            self.omega[i] = self.face[i][0] * wx + self.face[i][1] * wy + self.face[i][2] * wz
            self.alpha[i] = (self.face[i][0] * wy - self.face[i][1] * wx) * self.v + self.face[i][2] * self.a
            self.f[i] = self.face[i][0] * fx + self.face[i][1] * fy + self.face[i][2] * g[2]
        self.angle = self.x
        self.rate = self.v
        self.angle_read = self.read_from + (self.goal * self.pitch - self.read_from) * self.part
        self.position = self.place() + 1.0
        self.in_position = self.arrived
