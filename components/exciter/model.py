from __future__ import annotations

from gyrobench.component import Component, Discrete, Output, Parameter, sampled
from gyrobench.component.math import clip, cos, floor, index, pi, sin

HOLD, TORQUE, COMMAND, TEST, MOTION = 0.0, 1.0, 2.0, 3.0, 4.0  # kinds
CONSTANT, STEP, SINE = 0.0, 1.0, 2.0  # shapes
SETTLE, OPEN, FADE, DONE = 0.0, 1.0, 2.0, 3.0  # stages of a phase


class Exciter(Component):
    """Runs the plan of a loop test: up to 99 phases, each one signal on one axis.  [STAB-POWER-2DOF, PLATFORM-1AXIS]

    kind    0 hold (no signal), 1 disturbance torque, 2 rate command, 3 test voltage, 4 rotation of the base
    shape   0 constant: there from the start of the phase; 1 step: there while the gate is open; 2 sine
    stages  settle (gate 0), open (gate 1, for `dwell`), a sine then fades (gate 0, for half of settle)

    s = time since the phase began:

        constant   A                                   step       A while the gate is open, else 0
        sine       A w(s) sin(2 pi f s): w rises by (1 - cos)/2 in the first half of settle, is 1 in the second and
                   while the gate is open, and falls by the same law in the fading, which takes half of settle

    A rotation of the base is given as angle, rate and acceleration, exact derivatives of each other.  Its step turns to
    A within 1/f after the gate has opened, by A (x - sin(2 pi x) / 2 pi), x = 0..1, and back before the gate closes; a
    constant rotation is refused (the base would have to jump).

    Times are differences of sample times t0 + k h, rounded to the nearest sample; the sine itself is evaluated at the
    sample times.  One sample is one communication step (`step` is large for that reason).

    Not modelled: more than one signal at a time, rotation about two axes at a time, random test signals.
    Source: our own; the phases are those that STAB-POWER-2DOF and PLATFORM-1AXIS ask for.
    """

    version = "1.0.0"

    step = Parameter(1e9, "s", "largest internal step: one sample for each communication step", above=0.0)
    phases = Parameter(1, int, "number of phases", min=1, max=99)
    kinds = Parameter([0] * 99, int, "kind of each phase: 0 hold, 1 torque, 2 command, 3 test, 4 motion")
    shapes = Parameter([0] * 99, int, "shape of each phase: 0 constant, 1 step, 2 sine")
    axes = Parameter([1] * 99, int, "axis of each phase: 1 x_f pitch, 2 y_r roll, 3 z_a azimuth")
    amplitudes = Parameter([0.0] * 99, "1", "amplitude of each phase: N.m, rad/s, V or rad by kind")
    frequencies = Parameter([0.0] * 99, "Hz", "frequency of a sine; 1 / time of the turn of a motion step", min=0.0)
    settle = Parameter([0.0] * 99, "s", "time before the gate opens", min=0.0)
    dwell = Parameter([1.0] * 99, "s", "time the gate is open")

    torque = Output("N.m", "disturbance torque, A order", shape=(3,))
    command = Output("rad/s", "rate commanded to the platform, A order", shape=(3,))
    test = Output("V", "test signal, A order", shape=(3,))
    motion_angle = Output("rad", "rotation of the base", shape=(3,))
    motion_rate = Output("rad/s", "its rate", shape=(3,))
    motion_acceleration = Output("rad/s2", "its acceleration", shape=(3,))
    phase = Output("1", "number of the running phase, from 1")
    gate = Output("1", "1 while the phase is measured")
    done = Output("1", "1 when the plan is finished")

    now = Discrete(1.0, "1", "running phase")
    stage = Discrete(0.0, "1", "0 settle, 1 open, 2 fade, 3 done")
    t_begin = Discrete(0.0, "s", "begin of the phase")
    t_ref = Discrete(0.0, "s", "begin of the stage")
    bad_phase = Discrete(0.0, "1", "phase under check")

    def start(self) -> None:
        self.now = 1.0
        self.stage = SETTLE
        self.t_begin = self.t
        self.t_ref = self.t
        for p in range(index(self.phases)):
            self.bad_phase = p + 1.0
            kind = self.kinds[p]
            shape = self.shapes[p]
            self.refuse(
                kind < 0.0 or kind > 4.0 or kind != floor(kind),
                "phase {bad_phase}: unknown kind; kinds are 0 hold, 1 torque, 2 command, 3 test, 4 motion",
            )
            self.refuse(
                shape < 0.0 or shape > 2.0 or shape != floor(shape),
                "phase {bad_phase}: unknown shape; shapes are 0 constant, 1 step, 2 sine",
            )
            axis = self.axes[p]
            self.refuse(axis < 1.0 or axis > 3.0 or axis != floor(axis), "phase {bad_phase}: axis must be 1, 2 or 3")
            self.refuse(self.dwell[p] <= 0.0, "phase {bad_phase}: needs a dwell above 0 s")
            f = self.frequencies[p]
            self.refuse(shape == SINE and f <= 0.0, "phase {bad_phase}: a sine needs a frequency above 0 Hz")
            moving = kind == MOTION
            self.refuse(
                moving and shape == CONSTANT,
                "phase {bad_phase}: a constant rotation would be a jump of the base: take shape 1 (step) or 2 (sine)",
            )
            self.refuse(
                moving and shape == SINE and self.settle[p] <= 0.0,
                "phase {bad_phase}: a sine of the base needs a settling time to begin without a jump of its rate",
            )
            self.refuse(
                moving and shape == STEP and f * self.dwell[p] < 2.0 - 1e-9,
                "phase {bad_phase}: a turn of the base takes 1 / frequency forth and as long back: the dwell must be "
                "at least 2 / frequency",
            )

    @sampled(every=1)
    def tick(self) -> None:
        since = self.t - self.t_ref + 0.5 * self.h
        over = 0.0
        if self.stage == SETTLE and since > self.settle[index(self.now - 1.0)]:
            self.stage = OPEN
            self.t_ref = self.t
        elif self.stage == OPEN and since > self.dwell[index(self.now - 1.0)]:
            over = 1.0
            if (
                self.shapes[index(self.now - 1.0)] == SINE
                and self.kinds[index(self.now - 1.0)] != HOLD
                and self.settle[index(self.now - 1.0)] > 0.0
            ):
                self.stage = FADE
                self.t_ref = self.t
                over = 0.0
        elif self.stage == FADE and since > 0.5 * self.settle[index(self.now - 1.0)]:
            over = 1.0
        if over > 0.0:
            self.t_begin = self.t
            self.t_ref = self.t
            if self.now < self.phases:
                self.now = self.now + 1.0
                self.stage = SETTLE if self.settle[index(self.now - 1.0)] > 0.5 * self.h else OPEN
            else:
                self.stage = DONE

    def outputs(self) -> None:
        self.phase = self.now
        self.gate = 1.0 if self.stage == OPEN else 0.0
        self.done = 1.0 if self.stage == DONE else 0.0
        kind = self.kinds[index(self.now - 1.0)]
        shape = self.shapes[index(self.now - 1.0)]
        y = 0.0  # signal of unit amplitude, its first and second derivative
        v = 0.0
        a = 0.0
        if shape == CONSTANT or self.stage == OPEN:
            y = 1.0
        if shape == SINE:
            w = 1.0
            wv = 0.0
            wa = 0.0
            if self.stage != OPEN and self.settle[index(self.now - 1.0)] > 0.0:
                turn = 2.0 * pi / self.settle[index(self.now - 1.0)]
                x = clip(turn * (self.t - self.t_ref), 0.0, pi)
                up = 1.0 if self.stage == SETTLE else -1.0
                w = 0.5 - 0.5 * up * cos(x)
                wv = 0.5 * up * turn * sin(x)
                wa = 0.5 * up * turn * turn * cos(x) if x < pi else 0.0
            omega = 2.0 * pi * self.frequencies[index(self.now - 1.0)]
            s = sin(omega * (self.t - self.t_begin))
            c = cos(omega * (self.t - self.t_begin))
            y = w * s
            v = wv * s + w * omega * c
            a = wa * s + 2.0 * wv * omega * c - w * omega * omega * s
        if shape == STEP and kind == MOTION:
            y = 0.0
            f = self.frequencies[index(self.now - 1.0)]
            if self.stage == OPEN:
                x = f * (self.t - self.t_ref)
                back = f * (self.dwell[index(self.now - 1.0)] - (self.t - self.t_ref))
                sense = 1.0
                if back < 1.0:
                    x = back
                    sense = -1.0
                x = clip(x, 0.0, 1.0)
                y = x - sin(2.0 * pi * x) / (2.0 * pi)
                v = sense * f * (1.0 - cos(2.0 * pi * x))
                a = 2.0 * pi * f * f * sin(2.0 * pi * x)
        size = self.amplitudes[index(self.now - 1.0)]
        if self.stage == DONE:
            size = 0.0
        axis = self.axes[index(self.now - 1.0)] - 1.0
        for k in range(3):
            moved = kind == MOTION and k == axis
            self.torque[k] = size * y if kind == TORQUE and k == axis else 0.0
            self.command[k] = size * y if kind == COMMAND and k == axis else 0.0
            self.test[k] = size * y if kind == TEST and k == axis else 0.0
            self.motion_angle[k] = size * y if moved else 0.0
            self.motion_rate[k] = size * v if moved else 0.0
            self.motion_acceleration[k] = size * a if moved else 0.0
