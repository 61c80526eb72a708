from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Output, Parameter, sampled
from gyrobench.component.math import Number, clip, fabs

# steps
HEAT, WHEEL, REFERENCE, NULL, RANGE, TORQUER, CLOSE, STEP, TABLE, TEST, OPEN, BRAKE, OFF, DONE = (
    1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0,
)  # fmt: skip
# reasons
TEMPERATURE, ASYNCHRONOUS, WRONG_REFERENCE, WRONG_NULL, BEYOND, POLARITY = 1.0, 2.0, 3.0, 4.0, 5.0, 6.0
SCALE, HUNTING, NOT_CLOSED, WRONG_STEP, ANGLE = 7.0, 8.0, 9.0, 10.0, 11.0
RUNS_ON = 12.0
SETTLE = 0.02  # s: a float has its rate, some 1 ms each
TURNS = 20.0  # swings of the current from limit to limit that are a hunting loop


class TestProgram(Component):
    """Program of a gyro test: start, self-test, test, shutdown; stops at the first thing that is wrong, and names it.

    The steps, each with what ends it and, in brackets, the reason that breaks the start off:       [TEST-START-UP]

         1 heater on          |temperature| < band for `hold`, within t_heat                        (1 temperature)
         2 wheel on           current above current_run once, then within current_low..high for `hold`, within t_wheel
                                                                                                    (2 not synchronous)
         3 reference          mean of readings within reference_low..high                           (3 reference)
         4 pickoff null       mean of readings without excitation within +-null_most                (4 pickoff null)
         5 excitation on      |u| < u_range                                                         (5 beyond range)
         6 torquer            loop open, +i_test then -i_test, slopes of u by least squares:
                              r = (u'(+) - u'(-)) / (-2 i_test gain), gain = K_sg H k / C           (6 polarity: r < 0,
                              within 1 +- scale_tolerance                                            7 scale)
         7 loop closed        |u| < u_close and |current| < i_close for `hold`, within t_close      (8 hunting: the
                              current swings 20 times past +-i_close / 2; 9 not captured)
         8 step               i_step, then -i_step added to the torquer: the loop gives the contrary,
                              r = -(i(+) - i(-)) / (2 i_step) within 1 +- step_tolerance            (10 step)
         9 table              index moves of angle_step: |angle read - target| < angle_most         (11 table angle)
        10 test               the gate is open for `dwell`, windows of `window`
        11 loop opened        current off, then the float is caged by i = K_c u, limited to i_cage
        12 wheel braked       until its speed is below speed_rest, within t_brake                   (12 runs on)
        13 all off            excitation, torquer, heater; done

    Where a start is broken off, 11 to 13 follow at once, without those of what was never on.  From 3 to 10 a current of
    the wheel outside its range for `confirm` is reason 2, from 6 to 10 |u| > u_range for `confirm` reason 5.  3, 4, 6,
    8, 9 are done `repeats` times and judged by the mean.  Each end of a repeat or of a step is a row: `count` rises.

    Not modelled: the operator, printing, mechanical locks, a second try.
    Source: Hu 1981, section 6.1 (items 4 to 6), which names the steps; order, conditions and sizes are our own.
    """

    version = "1.0.0"

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    repeats = Parameter(5, int, "repeats of each self-test", min=2, max=20)
    band = Parameter(0.2, "K", "temperature is reached within it", above=0.0)
    t_heat = Parameter(600.0, "s", "longest time until temperature is reached", above=0.0)
    hold = Parameter(2.0, "s", "time for which a condition must hold", above=0.0)
    confirm = Parameter(0.1, "s", "time for which a watched quantity must be outside", above=0.0)
    t_wheel = Parameter(60.0, "s", "longest time until the wheel is synchronous", above=0.0)
    current_run = Parameter(0.25, "A", "current of the wheel that runs up is above it", above=0.0)
    current_low = Parameter(0.115, "A", "lowest current of a synchronous wheel", min=0.0)
    current_high = Parameter(0.14, "A", "its highest current", above=0.0)
    reading = Parameter(0.2, "s", "length of a reading of reference and null", above=0.0)
    reference_low = Parameter(4.995, "V", "lowest voltage of the reference")
    reference_high = Parameter(5.005, "V", "its highest voltage")
    null_most = Parameter(5e-5, "V", "largest voltage of the pickoff without excitation", above=0.0)
    u_range = Parameter(0.08, "V", "range of the pickoff", above=0.0)
    i_test = Parameter(5e-3, "A", "known current of the torquer", above=0.0)
    pulse = Parameter(0.5, "s", "time of each sense of it", above=0.05)
    gain = Parameter(0.83387953, "V/(s.A)", "what the pickoff changes per current and time: K_sg H k / C", above=0.0)
    scale_tolerance = Parameter(0.05, "1", "tolerance of the torquer's scale factor", above=0.0)
    t_close = Parameter(30.0, "s", "longest time until the float is captured", above=0.0)
    u_close = Parameter(1e-3, "V", "pickoff of a captured float is within it", above=0.0)
    i_close = Parameter(0.04, "A", "current of a captured float is within it", above=0.0)
    i_step = Parameter(1e-3, "A", "step of current against the closed loop", above=0.0)
    step_time = Parameter(2.0, "s", "time of each sense of it; the second half is read", above=0.0)
    step_tolerance = Parameter(0.05, "1", "tolerance of the loop's answer", above=0.0)
    angle_step = Parameter(0.1745329252, "rad", "index move from one self-test of the table to the next")
    table_settle = Parameter(0.5, "s", "wait after a move", min=0.0)
    angle_most = Parameter(1.454441e-5, "rad", "largest error of the angle as read (3 arcsec)", above=0.0)
    dwell = Parameter(60.0, "s", "length of the test", above=0.0)
    window = Parameter(10.0, "s", "windows of the test", above=0.0)
    K_c = Parameter(10.0, "A/V", "gain of the cage", min=0.0)
    i_cage = Parameter(0.02, "A", "its largest current", min=0.0)
    t_open = Parameter(2.0, "s", "time caged before the wheel is braked", min=0.0)
    speed_rest = Parameter(10.0, "rad/s", "a wheel at rest is below it", above=0.0)
    t_brake = Parameter(120.0, "s", "longest time until the wheel is at rest", above=0.0)

    temperature = Input(0.0, "K", "temperature of the gyro, above that of its coefficients")
    wheel_current = Input(0.0, "A", "current of the wheel")
    wheel_speed = Input(0.0, "rad/s", "speed of the wheel")
    reference = Input(0.0, "V", "voltage of the reference")
    u = Input(0.0, "V", "pickoff voltage as read")
    i_loop = Input(0.0, "A", "current that the rebalance loop wants")
    i_read = Input(0.0, "A", "current of the loop as measured")
    angle_read = Input(0.0, "rad", "table angle as read")
    in_position = Input(1.0, "1", "1 when the table has reached its target")

    heater = Output("1", "1: heater on")
    wheel = Output("1", "1: wheel supplied")
    brake = Output("1", "1: wheel braked")
    excitation = Output("1", "1: pickoff excited")
    closed = Output("1", "1: rebalance loop closed")
    caged = Output("1", "1: float caged by the torquer")
    gate = Output("1", "1: test runs")
    i = Output("A", "current of the torquer")
    mode = Output("1", "mode of the table: 0 hold, 1 index")
    target = Output("rad", "target of the table")
    state = Output("1", "running step, 1 to 13; 14 done")
    reason = Output("1", "why the start was broken off, 1 to 12; 0: it was not")
    count = Output("1", "rows: repeats and steps that have ended")
    row_step = Output("1", "step of the row")
    row_value = Output("1", "what it found, in the SI unit of the step")
    row_begun = Output("s", "begin of the repeat or step")
    row_ended = Output("s", "its end")
    row_last = Output("1", "1: the row ends the step")
    done = Output("1", "1 at the end")

    now = Discrete(HEAT, "1", "running step")
    why = Discrete(0.0, "1", "reason")
    begun = Discrete(0.0, "s", "begin of the repeat or step")
    opened = Discrete(0.0, "s", "begin of the step")
    held = Discrete(0.0, "s", "time for which the condition has held")
    out = Discrete(0.0, "s", "time for which the wheel's current was outside")
    far = Discrete(0.0, "s", "time for which the pickoff was outside")
    alarm = Discrete(0.0, "1", "reason of what is watched")
    ran = Discrete(0.0, "1", "1: the wheel was seen to run up")
    started = Discrete(0.0, "1", "1: the wheel was started")
    excited = Discrete(0.0, "1", "1: the pickoff was excited")
    sense = Discrete(1.0, "1", "sense of the current")
    before = Discrete(0.0, "1", "slope or current of the positive sense")
    n = Discrete(0.0, "1", "samples of this reading")
    sum_0 = Discrete(0.0, "1", "their sum")
    sum_1 = Discrete(0.0, "1", "their sum times their number")
    repeat = Discrete(0.0, "1", "repeats done")
    total = Discrete(0.0, "1", "sum of the repeats")
    swings = Discrete(0.0, "1", "swings of the current")
    side = Discrete(0.0, "1", "side of its last swing")
    goal = Discrete(0.0, "rad", "target of the table")
    waited = Discrete(0.0, "1", "samples since the move was commanded")
    rows = Discrete(0.0, "1", "rows")
    r_step = Discrete(0.0, "1", "step of the last row")
    r_value = Discrete(0.0, "1", "its value")
    r_begun = Discrete(0.0, "s", "its begin")
    r_ended = Discrete(0.0, "s", "its end")
    r_last = Discrete(0.0, "1", "1: it ends the step")

    def start(self) -> None:
        self.now = HEAT
        self.sense = 1.0
        self.refuse(self.current_low >= self.current_high, "current_low must be below current_high")
        self.refuse(self.current_high >= self.current_run, "current_high must be below current_run")
        self.refuse(self.reference_low >= self.reference_high, "reference_low must be below reference_high")
        self.refuse(self.window > self.dwell, "window = {window} s is longer than dwell = {dwell} s")

    def row(self, value: Number, last: Number) -> None:
        """Write a row, and begin the next repeat."""
        self.rows = self.rows + 1.0
        self.r_step = self.now
        self.r_value = value
        self.r_begun = self.begun
        self.r_ended = self.t
        self.r_last = last
        self.begun = self.t
        self.sense = 1.0
        self.n = 0.0
        self.sum_0 = 0.0
        self.sum_1 = 0.0

    def leave(self, value: Number, why: Number) -> None:
        """End the step with a row; go on, or with a reason to the shutdown."""
        self.row(value, 1.0)
        if why > 0.0 and self.why == 0.0:
            self.why = why
        if self.why > 0.0 and self.now < OPEN:
            self.now = OPEN if self.started > 0.0 else OFF
        else:
            self.now = self.now + 1.0
        self.opened = self.t
        self.held = 0.0
        self.repeat = 0.0
        self.total = 0.0
        self.swings = 0.0
        self.side = 0.0
        self.waited = 0.0

    def judged(self, value: Number, low: Number, high: Number, why: Number) -> None:
        """End a repeat; after the last one judge the mean."""
        self.repeat = self.repeat + 1.0
        self.total = self.total + value
        if self.repeat < self.repeats:
            self.row(value, 0.0)
        else:
            mean = self.total / self.repeats
            reason = why if mean < low or mean > high else 0.0
            if self.now == TORQUER and mean < 0.0:
                reason = POLARITY
            self.leave(value, reason)

    def take(self, x: Number) -> None:
        """Take a sample of the reading."""
        self.sum_1 = self.sum_1 + self.n * x
        self.sum_0 = self.sum_0 + x
        self.n = self.n + 1.0

    def turned(self) -> None:
        """Change the sense of the current, and begin a reading."""
        self.sense = -1.0
        self.n = 0.0
        self.sum_0 = 0.0
        self.sum_1 = 0.0

    def slope(self) -> Number:
        """Return the slope of the samples, per second, by least squares."""
        n = self.n
        return 12.0 * (self.sum_1 - 0.5 * (n - 1.0) * self.sum_0) / (n * (n * n - 1.0) * self.h)

    def watch(self) -> None:
        """Look at what is watched all the time; `alarm` is its reason, 0: none."""
        current = self.wheel_current
        self.out = self.out + self.h if current < self.current_low or current > self.current_high else 0.0
        self.far = self.far + self.h if fabs(self.u) > self.u_range else 0.0
        self.alarm = 0.0
        if self.now >= REFERENCE and self.now <= TEST and self.out > self.confirm:
            self.alarm = ASYNCHRONOUS
        elif self.now >= TORQUER and self.now <= TEST and self.far > self.confirm:
            self.alarm = BEYOND

    def start_up(self) -> None:
        """Take a sample of the steps that switch on."""
        past = self.t - self.opened
        if self.now == HEAT:
            self.held = self.held + self.h if fabs(self.temperature) < self.band else 0.0
            if self.held >= self.hold:
                self.leave(self.temperature, 0.0)
                self.started = 1.0
                self.out = 0.0
            elif past > self.t_heat:
                self.leave(self.temperature, TEMPERATURE)
        elif self.now == WHEEL:
            if self.wheel_current > self.current_run:
                self.ran = 1.0
            self.held = self.held + self.h if self.ran > 0.0 and self.out == 0.0 else 0.0
            if self.held >= self.hold:
                self.leave(self.wheel_current, 0.0)
            elif past > self.t_wheel:
                self.leave(self.wheel_current, ASYNCHRONOUS)
        elif self.now == REFERENCE or self.now == NULL:
            self.take(self.reference if self.now == REFERENCE else self.u)
            if self.t - self.begun > self.reading - 0.5 * self.h:
                mean = self.sum_0 / self.n
                if self.now == REFERENCE:
                    self.judged(mean, self.reference_low, self.reference_high, WRONG_REFERENCE)
                else:
                    self.judged(mean, -self.null_most, self.null_most, WRONG_NULL)
        elif self.now == RANGE:
            self.excited = 1.0
            if past > self.reading:
                self.leave(self.u, BEYOND if fabs(self.u) > self.u_range else 0.0)
                self.far = 0.0

    def test_torquer(self) -> None:
        """Take a sample of the torquer's test."""
        length = self.pulse if self.sense > 0.0 else 2.0 * self.pulse
        if self.t - self.begun > length - self.pulse + SETTLE:
            self.take(self.u)
        if self.t - self.begun > length - 0.5 * self.h:
            rate = self.slope()
            if self.sense > 0.0:
                self.before = rate
                self.turned()
            else:
                ratio = (self.before - rate) / (-2.0 * self.i_test * self.gain)
                self.judged(ratio, 1.0 - self.scale_tolerance, 1.0 + self.scale_tolerance, SCALE)

    def close_loop(self) -> None:
        """Take a sample of the loop that is being closed."""
        quiet = fabs(self.u) < self.u_close and fabs(self.i_loop) < self.i_close
        self.held = self.held + self.h if quiet else 0.0
        if fabs(self.i_loop) > 0.5 * self.i_close:
            side = 1.0 if self.i_loop > 0.0 else -1.0
            if side != self.side:
                self.swings = self.swings + 1.0
            self.side = side
        if self.swings >= TURNS:
            self.leave(self.u, HUNTING)
        elif self.held >= self.hold:
            self.leave(self.u, 0.0)
        elif self.t - self.opened > self.t_close:
            self.leave(self.u, NOT_CLOSED)

    def test_loop(self) -> None:
        """Take a sample of the step against the closed loop."""
        length = self.step_time if self.sense > 0.0 else 2.0 * self.step_time
        if self.t - self.begun > length - 0.5 * self.step_time:
            self.take(self.i_read)
        if self.t - self.begun > length - 0.5 * self.h:
            current = self.sum_0 / self.n
            if self.sense > 0.0:
                self.before = current
                self.turned()
            else:
                ratio = -(self.before - current) / (2.0 * self.i_step)
                self.judged(ratio, 1.0 - self.step_tolerance, 1.0 + self.step_tolerance, WRONG_STEP)

    def test_table(self) -> None:
        """Take a sample of the table's test."""
        self.goal = self.angle_step * (self.repeat + 1.0)
        self.waited = self.waited + 1.0
        self.held = self.held + self.h if self.waited > 3.0 and self.in_position > 0.5 else 0.0
        if self.held > self.table_settle:
            self.held = 0.0
            self.waited = 0.0
            self.judged(self.angle_read - self.goal, -self.angle_most, self.angle_most, ANGLE)

    def shut_down(self) -> None:
        """Take a sample of the steps that switch off."""
        past = self.t - self.opened
        if self.now == OPEN and past > self.t_open:
            self.leave(self.u, 0.0)
        elif self.now == BRAKE:
            if self.wheel_speed < self.speed_rest:
                self.leave(self.wheel_speed, 0.0)
            elif past > self.t_brake:
                self.leave(self.wheel_speed, RUNS_ON)
        elif self.now == OFF:
            self.leave(0.0, 0.0)

    @sampled(every=1)
    def tick(self) -> None:
        self.watch()
        if self.alarm > 0.0:
            self.leave(self.wheel_current if self.alarm == ASYNCHRONOUS else self.u, self.alarm)
        elif self.now <= RANGE:
            self.start_up()
        elif self.now == TORQUER:
            self.test_torquer()
        elif self.now == CLOSE:
            self.close_loop()
        elif self.now == STEP:
            self.test_loop()
        elif self.now == TABLE:
            self.test_table()
        elif self.now == TEST:
            self.take(self.i_read)
            if self.t - self.opened > self.dwell - 0.5 * self.h:
                self.leave(self.sum_0 / self.n, 0.0)
            elif self.t - self.begun > self.window - 0.5 * self.h:
                self.row(self.sum_0 / self.n, 0.0)
        else:
            self.shut_down()

    def outputs(self) -> None:
        s = self.now
        self.heater = 1.0 if s < OFF else 0.0
        self.wheel = 1.0 if s >= WHEEL and s <= OPEN else 0.0
        self.brake = 1.0 if s == BRAKE else 0.0
        self.excitation = 1.0 if s < OFF and (s == RANGE or self.excited > 0.0) else 0.0
        self.closed = 1.0 if s >= CLOSE and s <= TEST else 0.0
        self.caged = 1.0 if s >= OPEN and s <= BRAKE and self.excited > 0.0 else 0.0
        self.gate = 1.0 if s == TEST else 0.0
        self.i = 0.0
        if s == TORQUER:
            self.i = self.sense * self.i_test
        elif self.closed > 0.0:
            self.i = self.i_loop + (self.sense * self.i_step if s == STEP else 0.0)
        elif self.caged > 0.0:
            self.i = clip(self.K_c * self.u, -self.i_cage, self.i_cage)
        self.mode = 1.0 if s == TABLE else 0.0
        self.target = self.goal if s == TABLE else 0.0
        self.state = s
        self.reason = self.why
        self.count = self.rows
        self.row_step = self.r_step
        self.row_value = self.r_value
        self.row_begun = self.r_begun
        self.row_ended = self.r_ended
        self.row_last = self.r_last
        self.done = 1.0 if s >= DONE else 0.0
