from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Output, Parameter, sampled
from gyrobench.component.math import fabs, floor, index

IDENTITY = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
MOVE, SETTLE, OPEN, CLOSE, DONE = 0.0, 1.0, 2.0, 3.0, 4.0  # stages of a phase
GUARD = 3.0  # samples


class Sequencer(Component):
    """Runs the plan of a test: up to 99 labelled phases.  [TABLE-PROGRAM; Hu 1981, sections 5.4, 6.1]

    Each phase gives the table a mode, a target (and a second one, for a table with two axes) and a mount (face), and
    goes through

        move    until the table reports in_position (after at least GUARD = 3 samples: the report may be that
                of the phase before, one step old)
        settle  t - t_move >= settle
        open    the gate is open: 1 (hold, index and servo phases; windows by time) until t - t_open >= dwell
                and, in a servo phase, |angle - angle_open| >= travel too;
                2 (rate phases; windows by angle) until |angle - angle_open| >= travel + window / 100;
                rate phases without travel have windows by time, as a hold phase: a second axis may turn alone
        close   GUARD further samples with the gate open

    A step phase goes through all of them at every stop, k = 0, 1, ... : it commands the table to index to
    target + k step, until the stops have covered the travel; its windows are by time, its number stays.

    so that a sampler which receives gate or angle a sample late or early, or an encoder with a coarse quantum,
    still finds its last window complete: it counts windows from its own first open sample.  Times are
    differences of sample times t0 + k h, rounded to the nearest sample; nothing is accumulated.  A table that
    leaves its position while settling starts the settling anew.

    One sample is one communication step (`step` is large for that reason); windows must be longer than some
    four steps.  Whole numbers (phase, mode, gate, done) are Real signals.

    Not modelled: the time that a real change of mount takes, health interlocks, automatic repetition.
    """

    version = "1.1.0"

    step = Parameter(1e9, "s", "largest internal step: one sample for each communication step", above=0.0)
    phases = Parameter(1, int, "number of phases", min=1, max=99)
    modes = Parameter([0] * 99, int, "mode of each phase: 0 hold, 1 index, 2 rate, 3 servo, 4 step")
    targets = Parameter(
        [0.0] * 99, "1", "target of each phase: angle in rad (index; step: first), rate in rad/s (rate)"
    )
    targets_y = Parameter([0.0] * 99, "1", "target of each phase for a second axis, same mode: rad or rad/s")
    settle = Parameter([0.1] * 99, "s", "time between the end of the move and the gate", min=0.0)
    dwell = Parameter([1.0] * 99, "s", "time the gate is open (hold, index, servo, each stop; rate without travel)")
    travel = Parameter(
        [0.0] * 99, "rad", "angle turned while the gate is open (rate, 0: by dwell; servo: at least); all stops (step)"
    )
    steps = Parameter([0.0] * 99, "rad", "angle from stop to stop, with its sense (step)")
    windows = Parameter([0.5] * 99, "1", "length of one window: s (hold, index, servo, step) or rad (rate)")
    face_of = Parameter([1] * 99, int, "which of the faces each phase uses, from 1")
    faces = Parameter([IDENTITY] * 12, "1", "mounts: rows of the face matrix one after the other")

    angle = Input(0.0, "rad", "table angle, cumulative")
    in_position = Input(1.0, "1", "1 when the table has reached its target")

    phase = Output("1", "number of the running phase, from 1")
    mode = Output("1", "table mode")
    target = Output("1", "table target, rad or rad/s by mode")
    target_y = Output("1", "target of a second axis, rad or rad/s by mode")
    face = Output("1", "mount: rows are the gyro axes in table axes", shape=(3, 3))
    gate = Output("1", "0 closed, 1 windows by time, 2 windows by angle")
    window = Output("1", "window length, s or rad by gate")
    done = Output("1", "1 when the plan is finished")

    now = Discrete(1.0, "1", "running phase")
    stage = Discrete(0.0, "1", "0 move, 1 settle, 2 open, 3 close, 4 done")
    stop = Discrete(0.0, "1", "stops done in the running phase (step)")
    waited = Discrete(0.0, "1", "samples in this stage (move, close)")
    t_ref = Discrete(0.0, "s", "time at which settle or open began")
    angle_ref = Discrete(0.0, "rad", "angle at which the gate opened")
    bad_phase = Discrete(0.0, "1", "phase under check")
    bad_face = Discrete(0.0, "1", "face under check")

    def start(self) -> None:
        self.now = 1.0
        self.stage = MOVE
        self.stop = 0.0
        self.waited = 0.0
        for p in range(index(self.phases)):
            self.bad_phase = p + 1.0
            rate = self.modes[p] == 2.0
            self.refuse(
                not (
                    self.modes[p] == 0.0 or self.modes[p] == 1.0 or rate or self.modes[p] == 3.0 or self.modes[p] == 4.0
                ),
                "phase {bad_phase}: unknown mode; modes are 0 hold, 1 index, 2 rate, 3 servo, 4 step",
            )
            self.refuse(
                self.modes[p] == 4.0 and (self.steps[p] == 0.0 or self.travel[p] < 0.0),
                "phase {bad_phase}: a step phase needs a step other than 0 rad and a travel of 0 rad or more",
            )
            self.refuse(
                self.face_of[p] < 1.0 or self.face_of[p] > 12.0 or self.face_of[p] != floor(self.face_of[p]),
                "phase {bad_phase}: face_of must be 1 to 12",
            )
            by_angle = self.modes[p] == 2.0 and self.travel[p] > 0.0
            self.refuse(
                rate and self.targets[p] == 0.0 and (by_angle or self.targets_y[p] == 0.0),
                "phase {bad_phase}: the table does not turn: a rate phase needs a target other than 0",
            )
            self.refuse(
                rate and self.travel[p] < 0.0,
                "phase {bad_phase}: a rate phase needs a travel above 0 rad, or none and a dwell",
            )
            self.refuse(
                not by_angle and self.dwell[p] <= 0.0,
                "phase {bad_phase}: a hold, index, servo, step phase, or a rate phase without travel, needs a dwell",
            )
            self.refuse(self.windows[p] <= 0.0, "phase {bad_phase}: the window must be above 0")
            longest = (self.travel[p] if by_angle else self.dwell[p]) * (1.0 + 1e-9)
            self.refuse(
                self.windows[p] > longest,
                "phase {bad_phase}: the window is longer than the dwell (hold, index, servo) or travel (rate)",
            )
            self.bad_face = self.face_of[p]
            for i in range(3):
                for j in range(3):
                    dot = 0.0 if i != j else -1.0
                    for k in range(3):
                        a = self.faces[index(self.bad_face - 1.0)][3 * i + k]
                        dot = dot + a * self.faces[index(self.bad_face - 1.0)][3 * j + k]
                    self.refuse(
                        fabs(dot) > 1e-9,
                        "phase {bad_phase}: face {bad_face} is not a rotation matrix: its rows must be "
                        "orthonormal to 1e-9",
                    )
            m = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
            for k in range(9):
                m[k] = self.faces[index(self.bad_face - 1.0)][k]
            det = m[0] * (m[4] * m[8] - m[5] * m[7])
            det = det - m[1] * (m[3] * m[8] - m[5] * m[6])
            det = det + m[2] * (m[3] * m[7] - m[4] * m[6])
            self.refuse(
                det < 0.0, "phase {bad_phase}: face {bad_face} is left-handed (determinant -1): reverse one row"
            )

    @sampled(every=1)
    def tick(self) -> None:
        half = 0.5 * self.h
        if self.stage == SETTLE and self.in_position < 0.5:
            self.stage = MOVE
        if self.stage == MOVE:
            self.waited = self.waited + 1.0
            if self.waited >= GUARD and self.in_position > 0.5:
                self.stage = SETTLE
                self.t_ref = self.t
        if self.stage == SETTLE and self.t - self.t_ref > self.settle[index(self.now - 1.0)] - half:
            self.stage = OPEN
            self.t_ref = self.t
            self.angle_ref = self.angle
            self.waited = 0.0
        elif self.stage == OPEN:
            if self.modes[index(self.now - 1.0)] == 2.0 and self.travel[index(self.now - 1.0)] > 0.0:
                end = self.travel[index(self.now - 1.0)] + 0.01 * self.windows[index(self.now - 1.0)]
                if fabs(self.angle - self.angle_ref) >= end:
                    self.stage = CLOSE
            elif self.t - self.t_ref > self.dwell[index(self.now - 1.0)] - half:
                turned = fabs(self.angle - self.angle_ref) >= self.travel[index(self.now - 1.0)]
                if turned or self.modes[index(self.now - 1.0)] != 3.0:
                    self.stage = CLOSE
        elif self.stage == CLOSE:
            self.waited = self.waited + 1.0
            if self.waited >= GUARD:
                self.waited = 0.0
                step = fabs(self.steps[index(self.now - 1.0)])
                done = (self.stop + 0.5) * step >= self.travel[index(self.now - 1.0)]
                if self.modes[index(self.now - 1.0)] == 4.0 and not done:
                    self.stop = self.stop + 1.0
                    self.stage = MOVE
                elif self.now < self.phases:
                    self.now = self.now + 1.0
                    self.stop = 0.0
                    self.stage = MOVE
                else:
                    self.stage = DONE

    def outputs(self) -> None:
        self.phase = self.now
        self.mode = self.modes[index(self.now - 1.0)]
        self.target = self.targets[index(self.now - 1.0)]
        self.target_y = self.targets_y[index(self.now - 1.0)]
        if self.mode == 4.0:
            self.mode = 1.0
            self.target = self.target + self.stop * self.steps[index(self.now - 1.0)]
        self.window = self.windows[index(self.now - 1.0)]
        for i in range(3):
            for j in range(3):
                self.face[i][j] = self.faces[index(self.face_of[index(self.now - 1.0)] - 1.0)][3 * i + j]
        self.gate = 0.0
        self.done = 0.0
        if self.stage == OPEN or self.stage == CLOSE:
            self.gate = 2.0 if self.mode == 2.0 and self.travel[index(self.now - 1.0)] > 0.0 else 1.0
        if self.stage == DONE:
            self.mode = 0.0
            self.target = 0.0
            self.target_y = 0.0
            self.done = 1.0
