from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Output, Parameter, State, sampled
from gyrobench.component.blocks.mems import butterworth, sample_number, word
from gyrobench.component.math import cross, vector

NONE = [0.0, 0.0, 0.0]


class AngleIncrements(Component):
    """Output of a strapdown unit: angle and velocity increments, at its output rate.  [TEST-CONING, TEST-SCULLING]

        y'' = wn2 (rate - y) - sqrt(2) wn y',   wn = 2 pi bandwidth         Butterworth, second order; 0 Hz: y = rate
        d_l = y_l h,   a_l = a_(l-1) + d_l,   b_l = b_(l-1) + 1/2 (a_(l-1) + d_(l-1)/6) x d_l
        e_l = z_l h,   u_l = u_(l-1) + e_l,   z as y, of f_read by acc_bandwidth
        s_l = s_(l-1) + 1/2 (a_(l-1) + d_(l-1)/6) x e_l + 1/2 (u_(l-1) + e_(l-1)/6) x d_l
        dtheta = a + b (coning = 1), a (coning = 0);   dvelocity = u + s (sculling = 1), u (sculling = 0)

    h: communication step, the internal sampling of the unit; a = b = u = s = 0 after each output; d_(l-1), e_(l-1) are
    those before the first one of the interval, too.  dtheta is given every `period` in whole steps of `resolution`;
    what is less is kept, no angle is lost.
    Not modelled: scale factors, axes and noise (see imu), different filters of the axes, time stamps, counts of the
    velocity, compensation of the size effect.
    Source: Savage 1998, 1998b (second-order coning and sculling algorithms); Bortz 1971.
    """

    version = "1.1.0"

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    bandwidth = Parameter(200.0, "Hz", "frequency at which the filter has 3 dB; 0: none", min=0.0)
    period = Parameter(0.01, "s", "time between two outputs; 0: every step", min=0.0)
    coning = Parameter(True, bool, "1: the increments are rotation vectors; 0: integrals of the rates")
    resolution = Parameter(0.0, "rad", "angle of a count; 0: none", min=0.0)
    acc_bandwidth = Parameter(200.0, "Hz", "3 dB of the filter of the accelerometers; 0: none", min=0.0)
    sculling = Parameter(False, bool, "1: the velocity increments have sculling; 0: integrals of the specific force")

    rate = Input(NONE, "rad/s", "rates that the gyros x, y, z read, means of the step")
    f_read = Input(NONE, "m/s2", "specific force that the accelerometers read, means of the step")

    dtheta = Output("rad", "angle increments of the last output", shape=(3,))
    dvelocity = Output("m/s", "velocity increments of the last output, axes of its begin but for dtheta", shape=(3,))
    number = Output("1", "outputs since the start")

    y = State(NONE, "rad/s", "filtered rates")
    v = State(NONE, "rad/s2", "their derivatives")
    z = State(NONE, "m/s2", "filtered specific force")
    w = State(NONE, "m/s3", "its derivative")
    a = Discrete(NONE, "rad", "angle since the last output")
    b = Discrete(NONE, "rad", "coning since then")
    d = Discrete(NONE, "rad", "angle of the step before")
    u = Discrete(NONE, "m/s", "velocity since the last output")
    s = Discrete(NONE, "m/s", "sculling since then")
    e = Discrete(NONE, "m/s", "velocity of the step before")
    remainder = Discrete(NONE, "rad", "angle not yet given")
    given = Discrete(NONE, "rad", "increments given last")
    given_velocity = Discrete(NONE, "m/s", "velocity increments given last")
    count = Discrete(0.0, "1", "outputs given")
    sample = Discrete(0.0, "1", "number of the output by the time")

    def start(self) -> None:
        self.y = self.rate
        self.z = self.f_read
        self.sample = sample_number(self.t, self.period) if self.period > 0.0 else 0.0

    def flow(self) -> None:
        for j in range(3):
            self.der.y[j] = self.v[j] if self.bandwidth > 0.0 else 0.0
            self.der.v[j] = 0.0
            if self.bandwidth > 0.0:
                self.der.v[j] = butterworth(self.rate[j], self.y[j], self.v[j], self.bandwidth)
            self.der.z[j] = self.w[j] if self.acc_bandwidth > 0.0 else 0.0
            self.der.w[j] = 0.0
            if self.acc_bandwidth > 0.0:
                self.der.w[j] = butterworth(self.f_read[j], self.z[j], self.w[j], self.acc_bandwidth)

    @sampled(every=1)
    def tick(self) -> None:
        rate = vector(self.y) if self.bandwidth > 0.0 else vector(self.rate)
        now = vector(self.h * rate)
        force = vector(self.z) if self.acc_bandwidth > 0.0 else vector(self.f_read)
        gain = vector(self.h * force)
        middle = vector(self.a) + (1.0 / 6.0) * vector(self.d)
        if self.sculling > 0.5:
            self.s = self.s + 0.5 * cross(middle, gain)
            self.s = self.s + 0.5 * cross(vector(self.u) + (1.0 / 6.0) * vector(self.e), now)
        self.u = self.u + gain
        self.e = gain
        if self.coning > 0.5:
            self.b = self.b + 0.5 * cross(middle, now)
        self.a = self.a + now
        self.d = now
        due = 1.0
        if self.period > 0.0:
            n = sample_number(self.t, self.period)
            due = 1.0 if n > self.sample else 0.0
            self.sample = n
        if due > 0.5:
            self.given = vector(self.a) + self.b
            self.given_velocity = vector(self.u) + self.s
            if self.resolution > 0.0:
                for j in range(3):
                    whole = word(self.given[j] + self.remainder[j], self.resolution)
                    self.remainder[j] = self.given[j] + self.remainder[j] - whole
                    self.given[j] = whole
            self.count = self.count + 1.0
            self.a = vector(NONE)
            self.b = vector(NONE)
            self.u = vector(NONE)
            self.s = vector(NONE)

    def outputs(self) -> None:
        self.dtheta = self.given
        self.dvelocity = self.given_velocity
        self.number = self.count
