from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Output, Parameter, sampled
from gyrobench.component.blocks.angle import IncrementalEncoder, MultiplierLoop, carried, nearest
from gyrobench.component.math import TWO_PI, Number, clip, cos, fabs, floor, pi, sin

ABSOLUTE, INCREMENTAL, PULSE_WIDTH = 0.0, 1.0, 2.0
ARCSEC = pi / 648000.0


class Inductosyn(Component):
    """Angle reader of a table axis, an inductosyn of p pole pairs with a resolver.  [ANGLE-INDUCTOSYN]

    The fine cycle is a turn / 2p (two times the electrical angle is measured) or, with pulse widths, a turn / p; its
    N = f_T / f_0 clocks are the counts, quantum = cycle / N.

      mode 0 absolute     at each excitation period k the interval between the zero crossings of cos(wt + p a) and
                          cos(wt - p a), w = 2 pi f_0, gives the fine count F; the resolver gives C, n_c = f_c / f_0
                          to a turn.  With q = 2 p N / n_c:
                              n = floor((q C + q/2 - F + N/2) / N) mod 2p        count = n N + F
                          It is the angle in the middle of both crossings; the second comes up to 1 / (2 f_0) later.
      mode 1 incremental  set once at the start as in mode 0, then counted behind the multiplier loop; a lag beyond
                          half a cycle loses a cycle for good
      mode 2 pulse width  a counter follows p a by at most `slew` clocks in an excitation period

    With one-phase excitation the 90 deg shifter of the cosine channel, s its phase slope -d phase / d ln f, adds

        -s rate (1 - cos 2 p a) / (2 w)        in modes 0 and 1; none with two-phase excitation

    Counts are rounded, so that the mean error of the quantum is 0; turns are counted from one reading to the next.

    Not modelled: smoothing of the cyclic errors by the multiplier loop, jitter of the clocks, amplitude (5-55), which
    the zero crossings do not see, and second-order terms of the winding errors.
    Source: Hu 1981, sections 5.4 (three-1), 5.5 (one-3), eq. 5-38..5-58 with ET10..ET13, ET15.
    """

    version = "1.0.0"

    step = Parameter(1e9, "s", "largest internal step: one reading for each communication step", above=0.0)
    mode = Parameter(1, int, "0 absolute, 1 incremental, 2 pulse width", min=0, max=2)
    pole_pairs = Parameter(360, int, "pole pairs p: electrical cycles of the scale in a turn", min=1, max=100000)
    f_0 = Parameter(2400.0, "Hz", "excitation", above=0.0)
    f_T = Parameter(24e6, "Hz", "clock of the fine count", above=0.0)
    f_c = Parameter(8.64e6, "Hz", "clock of the coarse count", above=0.0)
    quantum = Parameter(TWO_PI / 7.2e6, "rad", "angle of a count, cycle f_0 / f_T (0.18 arcsec)", above=0.0)
    head = Parameter(0.0, "rad", "angle of the reading head: it sees the scale at angle + head")
    rate_max = Parameter(1.0, "rad/s", "largest rate of the axis", above=0.0)

    phases = Parameter(2, int, "phases of the excitation", min=1, max=2)
    shifter_slope = Parameter(1.0, "1", "phase slope of the shifter: 1 first order, 0 ideal", min=0.0, max=10.0)
    stamp = Parameter(1, int, "t_read in mode 0: 1 middle of the crossings, 0 second crossing", min=0, max=1)
    slew = Parameter(1, int, "clocks that the counter of mode 2 follows in a period", min=1, max=100000)

    coarse_zero = Parameter(0.0, "rad", "zero error of the resolver", min=-0.1, max=0.1)
    coarse_error = Parameter(0.0, "rad", "amplitude of its error of order 2", min=-0.1, max=0.1)
    coarse_phase = Parameter(0.0, "rad", "its phase at angle 0")
    coarse_limit = Parameter(pi / 900.0, "rad", "largest coarse error allowed; beyond it the angle is lost", above=0.0)

    encoder = IncrementalEncoder(
        quantum="quantum",
        pole_pairs="pole_pairs",
        eccentricity=0.3 * ARCSEC,
        tilt=0.15 * ARCSEC,
        pitch=0.05 * ARCSEC,
        d0=0.1 * ARCSEC * 360.0,
        de=0.1 * ARCSEC * 360.0,
        e3=0.05 * ARCSEC * 360.0,
    )
    loop = MultiplierLoop()

    angle = Input(0.0, "rad", "table angle")
    rate = Input(0.0, "rad/s", "table rate relative to its base")

    count = Output("1", "cumulative count")
    angle_read = Output("rad", "table angle as read, cumulative")
    t_read = Output("s", "instant to which the count belongs")
    lost = Output("1", "1 once the reader has lost the angle (mode 0: while the coarse channel is out of its limit)")
    coarse_off = Output("rad", "coarse minus fine reading (mode 1 and 2: at the start)")

    N = Discrete(1.0, "1", "counts of a fine cycle")
    turn = Discrete(1.0, "1", "counts of a turn")
    n_c = Discrete(1.0, "1", "coarse counts of a turn")
    head_count = Discrete(0.0, "1", "angle of the head in counts")
    offset = Discrete(0.0, "1", "count minus the count of the scale")
    off = Discrete(0.0, "1", "coarse minus fine reading in counts")
    gone = Discrete(0.0, "1", "the angle is lost")
    acc = Discrete(0.0, "rad/s2", "mean acceleration of the last step")
    periods = Discrete(0.0, "1", "excitation periods begun")

    def start(self) -> None:
        self.N = nearest(self.f_T / self.f_0)
        self.n_c = nearest(self.f_c / self.f_0)
        cycles = self.pole_pairs if self.mode == PULSE_WIDTH else 2.0 * self.pole_pairs
        cycle = TWO_PI / cycles
        self.turn = cycles * self.N
        self.refuse(
            fabs(self.f_T / self.f_0 - self.N) > 1e-9 * self.N or self.N < 1.0,
            "f_T / f_0 must be a whole number of counts; f_T = {f_T} Hz, f_0 = {f_0} Hz",
        )
        self.refuse(
            fabs(self.f_c / self.f_0 - self.n_c) > 1e-9 * self.n_c or self.n_c < 1.0,
            "f_c / f_0 must be a whole number of coarse counts; f_c = {f_c} Hz, f_0 = {f_0} Hz",
        )
        self.refuse(
            fabs(self.quantum * self.turn - TWO_PI) > 1e-9,
            "quantum = {quantum} rad must be the angle of a clock, 1 / {turn} of a turn (2 p f_T / f_0; p f_T / f_0 in "
            "mode 2)",
        )
        self.refuse(
            self.coarse_limit > 0.5 * cycle - 0.5 * TWO_PI / self.n_c + 1e-9,
            "coarse_limit = {coarse_limit} rad must be at most half a fine cycle less half a coarse count: the carry "
            "takes a neighbouring cycle beyond it",
        )
        self.refuse(
            self.rate_max > 0.5 * cycle * self.f_0,
            "rate_max = {rate_max} rad/s is more than half a fine cycle in an excitation period, 1 / f_0",
        )
        self.refuse(
            self.mode == INCREMENTAL and self.loop.type == 1.0 and self.rate_max > 0.5 * cycle * self.loop.K_v,
            "rate_max = {rate_max} rad/s is beyond the capture range of the multiplier loop, half a fine cycle times "
            "loop_K_v = {loop_K_v} 1/s",
        )
        self.refuse(
            self.mode == PULSE_WIDTH and self.rate_max > self.slew * self.quantum * self.f_0,
            "rate_max = {rate_max} rad/s is more than the counter follows, slew quantum f_0",
        )
        self.head_count = nearest(self.head / self.quantum)
        self.offset = -self.head_count
        self.acc = 0.0
        self.gone = 0.0
        self.periods = floor(self.t * self.f_0 + 1e-9)
        self.loop.rate_last = self.rate
        self.encoder.count = self.head_count
        self.encoder.t_read = self.t
        m = self.scale_count(0.0, 0.0)
        self.carry(m, 0.0)
        if self.mode != ABSOLUTE:
            self.offset = self.offset + self.encoder.count - m
            self.encoder.count = m

    def scale_count(self, ago: Number, lag: Number) -> Number:
        """Return what the scale counts ``ago`` seconds before now, late by the angle ``lag``."""
        seen = self.past(ago)
        if self.phases == 1.0 and self.mode != PULSE_WIDTH:
            ripple = 1.0 - cos(2.0 * self.pole_pairs * seen)
            lag = lag + self.shifter_slope * self.rate * ripple / (2.0 * TWO_PI * self.f_0)
        return self.encoder.counted(seen, lag)

    def past(self, ago: Number) -> Number:
        """Return the angle of the scale against the head ``ago`` seconds before now."""
        return self.angle + self.head - ago * (self.rate - 0.5 * ago * self.acc)

    def carry(self, m: Number, ago: Number) -> None:
        """Set the count from a count m of the scale, of which only the fine cycle is known, and the resolver."""
        seen = self.past(ago)
        seen = seen + self.coarse_zero + self.coarse_error * sin(2.0 * seen + self.coarse_phase)
        coarse = floor(seen / TWO_PI * self.n_c)
        coarse = coarse - self.n_c * floor(coarse / self.n_c)
        q = self.turn / self.n_c
        one_turn = carried(m - self.N * floor(m / self.N), coarse, q, self.N, self.turn / self.N)
        off = q * (coarse + 0.5) - one_turn
        self.off = off - self.turn * nearest(off / self.turn)
        self.encoder.count = one_turn + self.turn * nearest((self.encoder.count - one_turn) / self.turn)
        limit = self.coarse_limit / self.quantum + 0.5 * q + 1e-6
        self.gone = 1.0 if fabs(self.off) > limit else 0.0

    @sampled(every=1)
    def tick(self) -> None:
        periods = floor(self.t * self.f_0 + 1e-9)
        self.acc = (self.rate - self.loop.rate_last) / self.h
        self.loop.follow(self.rate, self.h)
        self.encoder.t_read = self.t
        if self.mode == ABSOLUTE:
            self.read_absolute(periods)
        elif self.mode == INCREMENTAL:
            cycle = self.N * self.quantum
            self.loop.slip(cycle)
            if self.loop.slipped != 0.0 or fabs(self.rate) > 0.5 * cycle * self.f_0:
                self.gone = 1.0
            self.encoder.count = self.scale_count(0.0, self.loop.lag + self.loop.slipped * cycle)
        else:
            most = self.slew * (periods - self.periods)
            way = self.scale_count(0.0, 0.0) - self.encoder.count
            if fabs(way) > 0.5 * self.N:  # the null that it follows is that of another cycle
                self.gone = 1.0
                way = way - self.N * nearest(way / self.N)
            self.encoder.count = self.encoder.count + clip(way, -most, most)
        self.periods = periods

    def read_absolute(self, k: Number) -> None:
        """Take the reading of excitation period k, or that of the one before while its second crossing is to come."""
        m = self.scale_count(self.t - k / self.f_0, 0.0)
        wait = 0.5 * (m / self.N - floor(m / self.N)) / self.f_0
        if k / self.f_0 + wait > self.t + 1e-12:
            k = k - 1.0
            m = self.scale_count(self.t - k / self.f_0, 0.0)
            wait = 0.5 * (m / self.N - floor(m / self.N)) / self.f_0
        self.carry(m, self.t - k / self.f_0)
        self.encoder.t_read = k / self.f_0 if self.stamp == 1.0 else k / self.f_0 + wait

    def outputs(self) -> None:
        self.count = self.encoder.count + self.offset
        self.angle_read = self.count * self.quantum
        self.t_read = self.encoder.t_read
        self.lost = self.gone
        self.coarse_off = self.off * self.quantum
