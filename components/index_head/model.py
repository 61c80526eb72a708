from __future__ import annotations

from gyrobench.component import IDENTITY, Discrete, Input, Noise, Output, Parameter, sampled
from gyrobench.component.blocks.table import AxisTable
from gyrobench.component.math import Number, cos, exp, fabs, floor, index, pi, sign, sin
from gyrobench.component.set_up import places


class IndexHead(AxisTable):
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

    simulates = (places,)

    positions = Parameter(8, int, "number of positions N of a turn", min=2, max=24)
    error = Parameter([0.0] * 24, "rad", "error of each position", min=-0.1, max=0.1)
    repeat = Noise(0.0, "rad", "rms of the repeatability, drawn for each move", per="step")
    index_rate = Parameter(0.5, "rad/s", "peak rate of a move", above=0.0)
    creep = Parameter(0.0, "rad", "angle short of the position at the end of a move", min=0.0, max=0.1)
    settling = Parameter(1.0, "s", "time constant with which it dies away", above=0.0)
    tolerance = Parameter(1e-7, "rad", "in position when less than this is left", above=0.0)

    mode = Input(0.0, "1", "0 hold, 1 index")
    target = Input(0.0, "1", "angle of the position, rad")
    number = Input(0.0, "1", "number of the position, 1 to N; 0: by target")
    face = Input(IDENTITY, "1", "mount: rows are the instrument axes in head axes")

    position = Output("1", "number of the position, 1 to N, reached or gone to")
    in_position = Output("1", "1 when the head stands in its position")

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
            position = floor(self.target / self.pitch + 0.5)
            if self.number == 0.0:
                self.refuse(
                    fabs(self.target - position * self.pitch) > 1e-4,
                    "target {target} rad is not one of the {positions} positions of the head: it must be a multiple of "
                    "{pitch} rad",
                )
            else:
                self.refuse(
                    self.number < 0.0 or self.number > self.positions or self.number != floor(self.number),
                    "number = {number} must be 1 to {positions}, or 0 for the position at the target",
                )
                turns = floor((self.goal - (self.number - 1.0)) / self.positions + 0.5)
                position = self.number - 1.0 + turns * self.positions
            if position != self.goal:
                self.read_from = self.goal * self.pitch
                self.goal = position
                self.x_from = self.x
                self.x_to = position * self.pitch + self.error[index(self.place())] + self.noise.repeat
                self.short = sign(self.x_to - self.x_from) * self.creep
                self.t_from = self.t_last
                self.t_move = 1.5 * fabs(self.x_to - self.x_from) / self.index_rate
        s = self.t - self.t_from
        self.arrived = 0.0
        if s < self.t_move:
            s = s / self.t_move
            distance = self.x_to - self.short - self.x_from
            self.part = s * s * (3.0 - 2.0 * s)
            self.x = self.x_from + distance * self.part
            self.v = distance * 6.0 * s * (1.0 - s) / self.t_move
            self.a = distance * (6.0 - 12.0 * s) / (self.t_move * self.t_move)
        else:
            self.part = 1.0
            residual = self.short * exp((self.t_move - s) / self.settling)
            self.x = self.x_to - residual
            self.v = residual / self.settling
            self.a = -self.v / self.settling
            self.arrived = 1.0 if fabs(residual) < self.tolerance else 0.0
        self.t_last = self.t

    def place(self) -> Number:
        return self.goal - self.positions * floor(self.goal / self.positions)

    def outputs(self) -> None:
        self.feel(cos(self.x), sin(self.x), self.tilted[2] @ self.omega_local + self.v, self.v, self.a)
        self.angle = self.x
        self.rate = self.v
        self.angle_read = self.read_from + (self.goal * self.pitch - self.read_from) * self.part
        self.position = self.place() + 1.0
        self.in_position = self.arrived
