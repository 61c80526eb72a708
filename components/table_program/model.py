from __future__ import annotations

from gyrobench.component import IDENTITY, Component, Discrete, Input, Output, Parameter, sampled
from gyrobench.component.math import TWO_PI, Number, fabs, floor, index, maximum, minimum, pi, sqrt

POSITIONS, COMMANDS = 0.0, 1.0
MOVE, SETTLE, MEASURE, CLOSE, DONE, STOPPED = 0.0, 1.0, 2.0, 3.0, 4.0, 5.0
GUARD = 3.0  # samples: the report of the table may be a step old; a sampler finds its last window complete
MINUTE = 60.0


class TableProgram(Component):
    """Program of a table: automatic positions, or commands by the clock; checked as a whole before motion.

    [TABLE-PROGRAM]

      kind 0 positions   up to 99 targets, each with its rate, way and dwell of 1 to 99 min.  The dwell begins when the
                         move has ended, the gate opens `settle` later
      kind 1 commands    up to 99 rates and targets, each with a step of 10 to 100 s.  The next command comes when the
                         step is over; the gate is open from `settle` after the arrival to the end of the step

    At the start the program is gone through with the acceleration and the rates of the moves: what does not end within
    its step, leaves the range of the axis or is beyond its limits is refused with the number of the entry.  health = 0
    refuses the start and stops a program that runs (mode hold, gate closed, state 5).

    Not modelled: printing and the operator; a move that is slower than planned ends the run.
    Source: Hu 1981, sections 5.4 (two-2), 6.1.
    """

    version = "1.0.0"

    step = Parameter(1e9, "s", "largest internal step: one sample for each communication step", above=0.0)
    kind = Parameter(0, int, "0 positions with dwell, 1 commands by the clock", min=0, max=1)
    entries = Parameter(1, int, "number of entries", min=1, max=99)
    modes = Parameter([1] * 99, int, "mode of each entry: 1 index, 2 rate (commands only)")
    targets = Parameter([0.0] * 99, "1", "target of each entry: angle in rad (index), rate in rad/s (rate)")
    rates = Parameter([0.0] * 99, "rad/s", "rate of each move; 0: move_rate_most", min=0.0)
    ways = Parameter([0] * 99, int, "way of each move: 0 cumulative, 1 shorter, 2 upwards, 3 downwards", min=0, max=3)
    times = Parameter([60.0] * 99, "s", "dwell (positions) or step (commands) of each entry", above=0.0)
    settle = Parameter(10.0, "s", "time between the end of a move and the gate", min=0.0)
    window_time = Parameter(10.0, "s", "length of one window", above=0.0)
    face_mount = Parameter(IDENTITY, "1", "mount: rows are the axes of the instrument in table axes")
    angle0 = Parameter(0.0, "rad", "angle at the start, for the check")
    acceleration = Parameter(1.0, "rad/s2", "acceleration of the moves, for the check", above=0.0)
    move_rate_most = Parameter(0.0072921159, "rad/s", "rate of a move that names none (100 ERU)", above=0.0)
    rate_max = Parameter(1999.9 * 7.2921159e-5, "rad/s", "largest rate of the table (1999.9 ERU)", above=0.0)
    limit = Parameter(0.0, "rad", "largest angle from 0 that the axis allows; 0: unlimited", min=0.0)
    dwell_least = Parameter(MINUTE, "s", "shortest dwell (1 min)", above=0.0)
    dwell_most = Parameter(99.0 * MINUTE, "s", "longest dwell (99 min)", above=0.0)
    step_least = Parameter(10.0, "s", "shortest step of a command", above=0.0)
    step_most = Parameter(100.0, "s", "longest step of a command", above=0.0)

    angle = Input(0.0, "rad", "table angle, cumulative")
    in_position = Input(1.0, "1", "1 when the table has reached its target")
    health = Input(1.0, "1", "1 while checks and interlocks allow motion")

    phase = Output("1", "number of the running entry, from 1")
    mode = Output("1", "table mode")
    target = Output("1", "table target, rad or rad/s by mode")
    way = Output("1", "way of the move")
    move_rate = Output("rad/s", "rate of the move")
    face = Output("1", "mount: rows are the axes of the instrument in table axes", shape=(3, 3))
    gate = Output("1", "0 closed, 1 windows by time")
    window = Output("1", "window length, s; 0 while the gate is closed")
    done = Output("1", "1 when the program is finished or stopped")
    state = Output("1", "0 move, 1 settle, 2 measure, 3 close, 4 done, 5 stopped")
    left = Output("s", "time left of the dwell or the step")

    now = Discrete(1.0, "1", "running entry")
    stage = Discrete(0.0, "1", "state")
    waited = Discrete(0.0, "1", "samples in this stage (move, close)")
    t_start = Discrete(0.0, "s", "start of the entry")
    t_arrived = Discrete(0.0, "s", "end of its move")
    bad = Discrete(0.0, "1", "entry under check")

    def ahead(self, way: Number, target: Number, angle: Number) -> Number:
        """Return the angle of a move from ``angle`` by its way, rad."""
        d = target - angle
        if way != 0.0:
            d = d - TWO_PI * floor(d / TWO_PI)
            if TWO_PI - d < 1e-9:
                d = 0.0
            if way == 3.0 and d > 0.0:
                d = d - TWO_PI
            if way == 1.0 and d > pi:
                d = d - TWO_PI
        return d

    def start(self) -> None:
        self.now = 1.0
        self.stage = MOVE
        self.waited = 0.0
        self.t_start = self.t
        self.refuse(self.health == 0.0, "health = 0: checks and interlocks do not allow motion")
        x = self.angle0
        v = 0.0
        for p in range(index(self.entries)):
            self.bad = p + 1.0
            rate = self.modes[p] == 2.0
            self.refuse(
                not (self.modes[p] == 1.0 or rate) or (rate and self.kind == POSITIONS),
                "entry {bad}: mode must be 1 index, or among commands 2 rate",
            )
            least = self.dwell_least if self.kind == POSITIONS else self.step_least
            most = self.dwell_most if self.kind == POSITIONS else self.step_most
            self.refuse(
                self.times[p] < least or self.times[p] > most,
                "entry {bad}: a dwell must be dwell_least = {dwell_least} s to dwell_most = {dwell_most} s, a step of "
                "a command step_least = {step_least} s to step_most = {step_most} s",
            )
            speed = self.rates[p] if self.rates[p] > 0.0 else self.move_rate_most
            fast = fabs(self.targets[p]) if rate else speed
            self.refuse(fast > self.rate_max, "entry {bad}: its rate is above rate_max = {rate_max} rad/s")
            # the way: brake or accelerate to the new rate, then the trapezoid of an index move
            goal = self.targets[p] if rate else 0.0
            time = fabs(goal - v) / self.acceleration
            x = x + 0.5 * (v + goal) * time
            v = goal
            if not rate:
                distance = self.ahead(self.ways[p], self.targets[p], x)
                peak = minimum(speed, sqrt(fabs(distance) * self.acceleration))
                if peak > 0.0:
                    time = time + fabs(distance) / peak + peak / self.acceleration
                x = x + distance
            if self.kind == COMMANDS:
                self.refuse(
                    time + self.settle + self.window_time > self.times[p],
                    "entry {bad}: move, settle = {settle} s and a window of {window_time} s are longer than the step",
                )
                x = x + v * (self.times[p] - time)
            else:
                self.refuse(
                    self.settle + self.window_time > self.times[p],
                    "entry {bad}: settle = {settle} s and a window of {window_time} s are longer than the dwell",
                )
            self.refuse(
                self.limit > 0.0 and fabs(x) > self.limit * (1.0 + 1e-12),
                "entry {bad}: leads outside the range of the axis, limit = {limit} rad to either side",
            )

    @sampled(every=1)
    def tick(self) -> None:
        half = 0.5 * self.h
        length = self.times[index(self.now - 1.0)]
        if self.health == 0.0 and self.stage < DONE:
            self.stage = STOPPED
        if self.stage == SETTLE and self.in_position < 0.5:
            self.stage = MOVE
        if self.stage == MOVE:
            self.waited = self.waited + 1.0
            if self.waited >= GUARD and self.in_position > 0.5:
                self.stage = SETTLE
                self.t_arrived = self.t
            self.refuse(
                self.kind == COMMANDS and self.t - self.t_start > length,
                "a move takes longer than its step: give a longer step or a higher rate",
            )
        if self.stage == SETTLE and self.t - self.t_arrived > self.settle - half:
            self.stage = MEASURE
        begun = self.t_start if self.kind == COMMANDS else self.t_arrived
        over = 0.0
        if self.stage == MEASURE and self.t - begun > length - half:
            if self.kind == COMMANDS:
                over = 1.0
                self.t_start = self.t_start + length  # by the clock: late samples do not add up
            else:
                self.stage = CLOSE
                self.waited = 0.0
        elif self.stage == CLOSE:
            self.waited = self.waited + 1.0
            if self.waited >= GUARD:
                over = 1.0
                self.t_start = self.t
        if over == 1.0:
            self.waited = 0.0
            self.stage = DONE
            if self.now < self.entries:
                self.now = self.now + 1.0
                self.stage = MOVE

    def outputs(self) -> None:
        self.phase = self.now
        self.mode = self.modes[index(self.now - 1.0)]
        self.target = self.targets[index(self.now - 1.0)]
        self.way = self.ways[index(self.now - 1.0)]
        self.move_rate = self.rates[index(self.now - 1.0)]
        if self.stage >= DONE:
            self.mode = 0.0
            self.target = 0.0
        self.face = self.face_mount
        self.gate = 1.0 if self.stage == MEASURE or self.stage == CLOSE else 0.0
        self.window = self.gate * self.window_time
        self.done = 1.0 if self.stage >= DONE else 0.0
        self.state = self.stage
        begun = self.t_start if self.kind == COMMANDS or self.stage == MOVE else self.t_arrived
        self.left = maximum(self.times[index(self.now - 1.0)] - (self.t - begun), 0.0) if self.stage < DONE else 0.0
