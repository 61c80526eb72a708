"""Command of a table axis: sampling clock, cumulative command counts for synchronous rate and position."""

from __future__ import annotations

from gyrobench.component.composition import Block
from gyrobench.component.declarations import Discrete, Parameter
from gyrobench.component.math import Number, cos, fabs, floor, maximum, minimum, pi, sign, sin, sqrt

ARCSEC = pi / 648000.0
ERU = 7.2921159e-5  # rad/s, one Earth-rate unit
RATE_MAX = 1999.9 * ERU
COUNT = 274877906944.0  # phase units in one count, 2^38
TURN = 2.0 * pi
EDGE = 1e-5  # counts: a target this close below a count is that count (rounding of target / quantum)


class SampleClock(Block):
    """Sampling instants: every ``period``, a whole number of internal steps.  The part calls ``tick`` in each."""

    period = Parameter(5e-3, "s", "sampling period, a multiple of the internal step", min=1e-5, max=1.0)
    due = Discrete(0.0, "1", "1 at a sampling instant")
    waited = Discrete(0.0, "1", "internal steps since the last one")

    def steps(self, time: Number) -> Number:
        """Return a time in internal steps, -1 where it is not a whole number of them."""
        many = floor(time / self.h + 0.5)
        return many if fabs(many * self.h - time) <= 1e-6 * self.h * maximum(many, 1.0) else -1.0

    def tick(self) -> None:
        many = self.steps(self.period)
        self.refuse(many < 1.0, "{self}_period = {period} s is not a multiple of the internal step")
        self.waited = self.waited + 1.0
        self.due = 0.0
        if self.waited >= many:
            self.waited = 0.0
            self.due = 1.0


class CountCommand(Block):
    """Cumulative command count of a table axis, computed once every ``period``.  [TABLE-RATE, TABLE-POSITION]

    The phase is `count` + `part` / 2^38 counts, the rate v an even number of 2^-38 counts a period: all of them whole
    numbers that a double holds exactly, so the phase is the exact sum of the rates however long the run,

        phase_k+1 = phase_k + (v_k + v_k+1) / 2          |v_k+1 - v_k| <= acceleration period2 / quantum

    and the reference turns with constant acceleration between two samples.  A set rate is met to 2^-38 counts a period
    (0.18 arcsec, 5 ms: 1.3e-10 arcsec/s).

      mode 0 hold    brake to rest, stay
      mode 1 index   brake to rest, then a trapezoid to the angle `target`, whose ramps and cruise are whole numbers of
                     periods n, m: peak = distance / (n + m), stay.  The last sample is the target itself (its
                     correction is below n (n + m) 2^-38 counts)
      mode 2 rate    accelerate to the rate `target`, rounded to rate_step; ERU sin and cos of the latitude are set
                     exactly

    Way to the target of an index move: 0 as the cumulative angle says, 1 the shorter way, 2 upwards, 3 downwards; the
    last three take the target modulo one turn.

    Not modelled: jitter and drift of the external time base.
    Source: Hu 1981, sections 5.4 (two-2), 6.1; accumulator and acceleration limit: own design.
    """

    quantum = Parameter(0.18 * ARCSEC, "rad", "angle of one count (0.18 arcsec)", above=0.0)
    period = Parameter(5e-3, "s", "period of the count", above=0.0)
    acceleration = Parameter(1.0, "rad/s2", "largest acceleration of the reference", above=0.0)
    index_rate = Parameter(100.0 * ERU, "rad/s", "largest rate of an index move (100 ERU)", above=0.0)
    rate_max = Parameter(RATE_MAX, "rad/s", "largest rate that may be commanded (1999.9 ERU)", above=0.0)
    rate_step = Parameter(0.0, "rad/s", "step of the rate; 0: as the accumulator resolves it", min=0.0)
    latitude = Parameter(0.0, "rad", "latitude, for the rates ERU sin and ERU cos", min=-0.5 * pi, max=0.5 * pi)
    clock = Parameter(0.0, "1", "relative error of the time base: rates are higher by it", min=-0.01, max=0.01)
    way = Parameter(0, int, "way of an index move: 0 cumulative, 1 shorter, 2 upwards, 3 downwards", min=0, max=3)
    limit = Parameter(0.0, "rad", "largest angle from 0 that the axis allows; 0: unlimited", min=0.0)

    count = Discrete(0.0, "1", "cumulative command count")
    part = Discrete(0.0, "1", "phase within the count, 2^-38 counts")
    v = Discrete(0.0, "1", "rate, 2^-38 counts a period")
    v_next = Discrete(0.0, "1", "rate one period later")
    v_goal = Discrete(0.0, "1", "rate that hold, rate or the braking leads to")
    arrived = Discrete(1.0, "1", "1 when the reference has reached its target")
    mode_last = Discrete(0.0, "1", "mode of the motion planned")
    target_last = Discrete(0.0, "1", "target of the motion planned")
    moving = Discrete(0.0, "1", "samples left of a trapezoid; 0: none")
    n_ramp = Discrete(0.0, "1", "periods of one of its ramps")
    n_all = Discrete(0.0, "1", "periods of all of it")
    dv = Discrete(0.0, "1", "change of v a period in its ramps")
    end_count = Discrete(0.0, "1", "count of the target")
    end_part = Discrete(0.0, "1", "phase of the target within it")
    dv_most = Discrete(0.0, "1", "largest change of v a period")
    unit_v = Discrete(0.0, "1", "rate in rad/s of v = 1, times period squared: rad a phase unit")

    def start(self) -> None:
        fast = self.rate_max * self.period / self.quantum
        self.refuse(
            fast > 8192.0 or self.index_rate > self.rate_max,
            "rate_max = {rate_max} rad/s must be at least index_rate = {index_rate} rad/s and at most 8192 counts a "
            "period of {period} s",
        )
        # one unit up: a rate of whole steps is reached in as many periods, whatever the rounding
        self.dv_most = self.even(self.acceleration * self.period * self.period / self.quantum) + 2.0
        self.refuse(
            self.dv_most < 4.0,
            "acceleration = {acceleration} rad/s2 is below the resolution, 2^-37 counts in {period} s squared",
        )
        self.unit_v = self.quantum / COUNT
        self.halt()

    def even(self, counts: Number) -> Number:
        """Return counts in phase units, rounded to an even number: half of it is whole."""
        return 2.0 * floor(counts * (0.5 * COUNT) + 0.5)

    def halt(self) -> None:
        """Forget the motion and its command."""
        self.moving = 0.0
        self.v = 0.0
        self.v_next = 0.0
        self.v_goal = 0.0
        self.arrived = 1.0
        self.mode_last = 0.0
        self.target_last = 0.0

    def rest(self, angle: Number) -> None:
        """Set the reference to rest at an angle."""
        self.halt()
        y = angle / self.quantum
        self.count = floor(y + EDGE)
        self.part = maximum(floor((y - self.count) * COUNT + 0.5), 0.0)

    def angle(self) -> Number:
        """Return the reference angle in rad at the last sample."""
        return (self.count + self.part / COUNT) * self.quantum

    def since(self, f: Number) -> Number:
        """Return the phase within the last sample's count, a share f of the period later, in phase units."""
        return self.part + f * (self.v + 0.5 * f * (self.v_next - self.v))

    def count_after(self, f: Number) -> Number:
        """Return the count a share f of the period after the last sample: pulses come between samples too."""
        return self.count + floor(self.since(f) / COUNT)

    def angle_after(self, f: Number) -> Number:
        """Return the reference angle there, rad."""
        return (self.count + self.since(f) / COUNT) * self.quantum

    def rate_after(self, f: Number) -> Number:
        """Return the reference rate there, rad/s."""
        return (self.v + f * (self.v_next - self.v)) * self.unit_v / self.period

    def acc(self) -> Number:
        """Return the reference acceleration in rad/s2 from the last sample to the next."""
        return (self.v_next - self.v) * self.unit_v / (self.period * self.period)

    def settable(self, rate: Number) -> Number:
        """Return the rate nearest to ``rate`` that can be set."""
        if self.rate_step == 0.0:
            return rate
        s = sin(self.latitude) * ERU
        c = cos(self.latitude) * ERU
        if fabs(fabs(rate) - fabs(s)) <= 1e-9 * ERU or fabs(fabs(rate) - fabs(c)) <= 1e-9 * ERU:
            return rate
        return sign(rate) * self.rate_step * floor(fabs(rate) / self.rate_step + 0.5)

    def plan_trapezoid(self, target: Number, way: Number, rate: Number) -> None:
        """Plan the move to an angle at a rate, from rest where the reference is."""
        ahead = target - self.angle()
        if way != 0.0:
            ahead = ahead - TURN * floor(ahead / TURN)  # [0, one turn)
            if TURN - ahead < 0.5 * self.quantum:
                ahead = ahead - TURN  # no turn for a rounding error
            if way == 3.0 and ahead > 0.5 * self.quantum:
                ahead = ahead - TURN
            if way == 1.0 and ahead > pi:
                ahead = ahead - TURN
        self.refuse(
            self.limit > 0.0 and fabs(self.angle() + ahead) > self.limit + 0.5 * self.quantum,
            "the target is outside the range of the axis, {limit} rad to either side",
        )
        y = self.part / COUNT + ahead / self.quantum
        self.end_count = self.count + floor(y + EDGE)
        self.end_part = maximum(floor((y - floor(y + EDGE)) * COUNT + 0.5), 0.0)
        way_counts = self.end_count - self.count + (self.end_part - self.part) / COUNT
        distance = fabs(way_counts)
        self.moving = 0.0
        if distance > 0.0:
            a = self.acceleration * self.period * self.period / self.quantum
            peak = minimum(rate * self.period / self.quantum, sqrt(distance * a))
            self.n_ramp = maximum(-floor(-(peak / a) + 1e-9), 1.0)
            cruise = maximum(-floor(-(distance / peak - self.n_ramp) + 1e-9), 0.0)
            self.n_all = 2.0 * self.n_ramp + cruise
            self.dv = sign(way_counts) * self.even(distance / (self.n_ramp + cruise) / self.n_ramp)
            self.moving = self.n_all

    def command(self, mode: Number, target: Number) -> None:
        """Take a new command; the one that is running already changes nothing."""
        if mode == self.mode_last and target == self.target_last:
            return
        self.refuse(not (mode == 0.0 or mode == 1.0 or mode == 2.0), "mode must be 0 hold, 1 index or 2 rate")
        self.refuse(
            mode == 2.0 and fabs(target) > self.rate_max * (1.0 + 1e-12),
            "the rate commanded exceeds {self}_rate_max = {rate_max} rad/s",
        )
        self.v_goal = 0.0
        if mode == 2.0:
            self.v_goal = self.even(self.settable(target) * (1.0 + self.clock) * self.period / self.quantum)
        self.moving = 0.0
        self.arrived = 0.0
        self.mode_last = mode
        self.target_last = target

    def advance(self, mode: Number, target: Number, way: Number, rate: Number) -> None:
        """Compute the next sample, one period later.  way, rate (rad/s): of an index move."""
        total = self.part + 0.5 * (self.v + self.v_next)
        carry = floor(total / COUNT)
        self.count = self.count + carry
        self.part = total - carry * COUNT
        self.v = self.v_next
        if self.moving > 0.0:
            self.moving = self.moving - 1.0
            if self.moving == 0.0:
                self.count = self.end_count
                self.part = self.end_part
                self.v = 0.0
                self.arrived = 1.0
        self.command(mode, target)
        if self.mode_last == 1.0 and self.arrived == 0.0 and self.moving == 0.0 and self.v == 0.0:
            self.plan_trapezoid(self.target_last, way, rate)
            if self.moving == 0.0:
                self.arrived = 1.0
        self.v_next = self.v + minimum(maximum(self.v_goal - self.v, -self.dv_most), self.dv_most)
        if self.moving > 0.0:
            done = self.n_all - self.moving
            self.v_next = self.v
            if done < self.n_ramp:
                self.v_next = self.v + self.dv
            elif self.moving <= self.n_ramp:
                self.v_next = self.v - self.dv
        if self.mode_last != 1.0:
            self.arrived = 1.0 if self.v == self.v_goal else 0.0
        self.refuse(
            self.limit > 0.0 and fabs(self.angle()) > self.limit + self.quantum,
            "the reference leaves the range of the axis, {limit} rad to either side",
        )
