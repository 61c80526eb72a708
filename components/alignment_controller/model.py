from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Output, Parameter, sampled
from gyrobench.component.blocks.alignment import AlignmentCovariance, SensorErrors
from gyrobench.component.blocks.angle import wrapped
from gyrobench.component.blocks.command import SampleClock
from gyrobench.component.math import Number, Vector, atan2, clip, cos, exp, fabs, maximum, pi, sin, sqrt, vector

LEVEL, COARSE, TURN, SECOND, TO_NORTH, FAST, SLOW = 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0  # mode
NONE, VALID, WRONG, TILTED = 0.0, 1.0, 2.0, 3.0  # status
DEG = pi / 180.0
MOST = 85.0 * DEG  # latitude
ZEROS = [0.0, 0.0, 0.0]
FALL = 0.25  # 1/frequency rises by this times the time: near the gains of least squares, 4/time
DOUBT = 4.5  # standard deviations of a rate that contradicts what is known,
LAG, RISE = 0.1, 0.3  # lag of y, and rise of the azimuth's gains, times the frequency
NEAR = 0.002  # and share of the horizontal Earth rate


class AlignmentController(Component):
    """Levels a gyro platform and turns it to north by its own gyros and accelerometers.  [ALIGN-GYRO]

    Commands rates to the torquers of the gyros.  psi: heading of the platform axis y as computed, clockwise; W_p: the
    Earth rate in platform axes as computed, (-N sin psi, N cos psi, U), N = W cos L, U = W sin L;  t = (atan(f_y/f_z),
    -atan(f_x/f_z)): tilt about x and y as measured, mean over a period; w, z: frequency and damping of the stage.

        1 levelling       c = J - k t,  J' = -w2 t,  k = 2 z w: second order; no Earth rate yet, J takes it up
        2 coarse heading  the same; psi = atan2(-c_x, c_y) of the mean command c, J = c - W_p(psi)
        3 turn            c = W_p + J - k t and a turn by 180 deg                       (positions = 2)
        4 second window   psi and J by half of what the mean command has changed: drifts of x and y are in J
        5 to north        turn to psi = 0, then 1/(z w) with the k of the next stage
        6, 7 gyrocompass  c_x = J_x - k1 t_x          c_z = U + k2/N y + k3/N (integral of t_x),  y' = 10 w (t_x - y)
                          c_y = N + J_y - k t_y,  J_y' = -w2 t_y
            order 3: s3 + k1 s2 + k2 s + k3 = (s + w)(s2 + 2 z w s + w2);  order 2: k3 = 0, s2 + 2 z w s + w2;
            y, and k2, k3 that rise over the first 0.3/w, keep vibration out of the azimuth
            w: fast_frequency for fast_time, then 1/w rises by a quarter of the time until w is slow_frequency

    Steady error of order 3: heading (psi less true) d_E/N + tan(L) b_E/g, tilt about east -b_N/g, about north b_E/g;
    order 2 adds 2 z d_z/w to the heading.  d: residual drift of a gyro, b: bias of an accelerometer.

    sigma: of the heading, by the linear error model with what the part is told of its sensors (errors_...), in closed
    loop from the first window on.  ready: sigma <= wanted, status 1, from the end of the turn to north on.  status: 0
    no heading, 1 valid, 2 a rate contradicts the Earth's (window, azimuth or north channel) by more than 4.5 standard
    deviations and 0.2 % of N, 3 tilt beyond level_limit.

    Not modelled: lag of the platform, cross-coupling by the tilt itself (second order), transport rate.
    Source: GSP ch. 5, section 5.3.2 (heading by strapdown gyros, two positions); loops and error model: own derivation.
    """

    version = "1.0.0"

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    latitude = Parameter(40.0 * DEG, "rad", "latitude, north positive", min=-pi / 2, max=pi / 2)
    earth_rate = Parameter(7.2921159e-5, "rad/s", "Earth rate W", above=0.0)
    gravity = Parameter(9.80665, "m/s2", "gravity of the site", above=0.0)
    period = Parameter(0.2, "s", "period of the law, a multiple of the communication step", above=0.0, max=1.0)
    damping = Parameter(0.70710678, "1", "damping ratio z of all stages", min=0.3, max=2.0)
    level_frequency = Parameter(0.3, "rad/s", "levelling: natural frequency", above=0.0)
    level_limit = Parameter(5e-4, "rad", "tilt below which the platform is level", above=0.0)
    level_time = Parameter(40.0, "s", "time for which it must stay there", above=0.0)
    rate_max = Parameter(1.0 * DEG, "rad/s", "largest rate asked for (1 deg/s)", above=0.0)
    positions = Parameter(1, int, "windows of the coarse heading: 1, or 2 half a turn apart", min=1, max=2)
    coarse_time = Parameter(60.0, "s", "length of such a window", above=0.0)
    order = Parameter(3, int, "order of the gyrocompass loop", min=2, max=3)
    fast_frequency = Parameter(0.03, "rad/s", "gyrocompass: natural frequency at first", above=0.0)
    fast_time = Parameter(200.0, "s", "time for which it stays there", min=0.0)
    slow_frequency = Parameter(0.01, "rad/s", "gyrocompass, to which it falls afterwards", above=0.0)
    wanted = Parameter(1e-3, "rad", "standard deviation of the heading that is ready for use", min=0.0)
    hold = Parameter(60.0, "s", "time for which it is held ready before done", min=0.0)
    time_limit = Parameter(3600.0, "s", "time after which it is done, ready or not", above=0.0)
    drift = Parameter(ZEROS, "rad/s", "known drift of the level gyros along x, y, z, precession sign")

    errors = SensorErrors()
    clock = SampleClock(period="period")
    model = AlignmentCovariance()

    f = Input([0.0, 0.0, 9.80665], "m/s2", "measured specific force, platform axes")

    command = Output("rad/s", "rate asked for, platform axes", shape=(3,))
    heading = Output("rad", "heading of the platform axis y as computed, clockwise, -pi to pi")
    sigma = Output("rad", "its standard deviation; pi before there is a heading")
    tilt = Output("rad", "tilt about x and y as measured, smoothed", shape=(2,))
    sigma_tilt = Output("rad", "standard deviation of the true tilt about x and y", shape=(2,))
    correction = Output("rad/s", "rates beside those of the Earth: J along x and y, integral along z", shape=(3,))
    mode = Output("1", "1 levelling, 2 coarse, 3 turn, 4 second window, 5 to north, 6 fast, 7 slow gyrocompass")
    status = Output("1", "0 no heading, 1 valid, 2 rates contradict, 3 not level")
    ready = Output("1", "1 while the heading is ready for use")
    ready_time = Output("s", "since when; -1: it is not")
    done = Output("1", "1 at the end: held ready, or time_limit")

    north = Discrete(0.0, "rad/s", "N")
    up = Discrete(0.0, "rad/s", "U")
    sum = Discrete(ZEROS, "m/s2", "specific force since the last period")
    t_x = Discrete(0.0, "rad", "tilt about x, mean of the period")
    t_y = Discrete(0.0, "rad", "tilt about y")
    smooth = Discrete([0.0, 0.0], "rad", "tilt, smoothed over the levelling's time constant")
    level = Discrete(0.0, "s", "time for which the platform has been level")
    stage = Discrete(LEVEL, "1", "mode")
    left = Discrete(0.0, "s", "time left in a window or a stage; slow: less the time it has lasted")
    angle = Discrete(0.0, "rad", "angle left to turn, clockwise")
    psi = Discrete(0.0, "rad", "heading as computed")
    turning = Discrete(0.0, "rad/s", "rate of psi")
    J = Discrete([0.0, 0.0], "rad/s", "rates along x and y beside those of the Earth")
    azimuth = Discrete(0.0, "rad/s", "integral of the azimuth channel")
    y = Discrete(0.0, "rad", "tilt about x as the azimuth channel takes it")
    asked = Discrete(ZEROS, "rad/s", "rate asked for")
    window = Discrete([0.0, 0.0], "rad/s", "mean of the command in the window: J - k t, later -k t")
    state = Discrete(NONE, "1", "status")
    doubt = Discrete(0.0, "1", "1: the first window contradicts the Earth rate")
    good = Discrete(0.0, "1", "ready")
    since = Discrete(-1.0, "s", "since when")
    over = Discrete(0.0, "1", "done")

    def start(self) -> None:
        self.refuse(
            fabs(self.latitude) > MOST,
            "latitude = {latitude} rad: within 5 deg of a pole the horizontal Earth rate is below 9 % of that at the "
            "equator; no gyrocompass",
        )
        fastest = self.damping * self.period
        self.refuse(
            fastest * self.level_frequency > 0.15,
            "level_frequency = {level_frequency} rad/s is too high for period = {period} s: damping times frequency "
            "times period must be 0.15 at most",
        )
        self.refuse(
            self.fast_frequency > self.level_frequency or self.slow_frequency > self.fast_frequency,
            "slow_frequency = {slow_frequency}, fast_frequency = {fast_frequency}, level_frequency = {level_frequency} "
            "rad/s: each must be the next one's at most",
        )
        self.refuse(self.coarse_time < 20.0 * self.period, "coarse_time = {coarse_time} s must be 20 periods at least")
        self.north = self.earth_rate * cos(self.latitude)
        self.up = self.earth_rate * sin(self.latitude)
        turned = self.north * self.errors.latitude
        azimuth = sqrt(self.errors.bias * self.errors.bias + turned * turned)
        self.model.begin(
            0.1,
            self.north,
            vector([self.errors.bias, self.errors.bias, azimuth]),
            self.errors.markov,
            self.errors.accelerometer / self.gravity,
            self.errors.scale,
        )

    def frequency(self) -> Number:
        """Return the natural frequency of the stage."""
        if self.stage == FAST or self.calming() == 1.0:
            return self.fast_frequency
        if self.stage == SLOW:
            since = maximum(-self.left, 0.0)
            return maximum(self.slow_frequency, 1.0 / (1.0 / self.fast_frequency + FALL * since))
        return self.level_frequency

    def calming(self) -> Number:
        """Return 1 after the turn to north, before the gyrocompass."""
        return 1.0 if self.stage == TO_NORTH and self.turning == 0.0 else 0.0

    def lag(self) -> Number:
        """Return the time constant of y."""
        return maximum(LAG / self.frequency(), self.period)

    def known(self) -> Number:
        """Return 1 once there is a heading."""
        return 1.0 if self.stage >= TURN else 0.0

    def fine(self) -> Number:
        """Return 1 in the gyrocompass stages."""
        return 1.0 if self.stage >= FAST else 0.0

    def gains(self) -> Vector:
        """Return k of x, of y, of J_x, J_y, k2/N and k3/N of the azimuth."""
        w = self.frequency()
        z = 2.0 * self.damping
        first = z if self.order == 2.0 else 1.0 + z
        if self.calming() == 1.0:
            return vector([first * w, z * w, 0.0, 0.0, 0.0, 0.0])
        if self.fine() == 0.0:
            j = w * w if self.stage <= COARSE else 0.0
            return vector([z * w, z * w, j, j, 0.0, 0.0])
        rise = clip((self.fast_time - self.left) * self.fast_frequency / RISE, 0.0, 1.0) / self.north
        if self.order == 2.0:
            return vector([z * w, z * w, 0.0, w * w, rise * w * w, 0.0])
        return vector([first * w, z * w, 0.0, w * w, rise * first * w * w, rise * w * w * w])

    def earth(self, psi: Number) -> Vector:
        """Return the horizontal Earth rate along x and y at a heading."""
        return vector([-self.north * sin(psi), self.north * cos(psi)])

    @sampled(every=1)
    def tick(self) -> None:
        self.clock.tick()
        self.sum = self.sum + self.f
        if self.clock_due == 1.0:
            self.carry()
            self.measure()
            self.switch()
            self.judge()
            self.control()

    def carry(self) -> None:
        """Carry heading and covariance over the period that has passed, with the law that was in force."""
        k = self.gains()
        turned = self.turning * self.period
        earth = self.earth(self.psi + 0.5 * turned)
        self.psi = wrapped(self.psi + turned)
        known = self.known()
        omega = vector([known * earth[0], known * earth[1], self.up - self.turning])
        kept = 1.0 if self.stage == COARSE else 0.0
        weight = self.weight() if self.stage == COARSE or self.stage == SECOND else 0.0
        lag = self.lag()
        gains = vector([k[0], k[1]])
        self.model.law(omega, gains, vector([k[2], k[3]]), k[4], k[5], lag, kept, weight, self.asked[2])
        lean = self.errors.force / self.gravity
        shake = self.errors.vibration / self.gravity
        self.model.carry(self.period, self.errors.white, lean, self.errors.markov, self.errors.tau, shake)

    def measure(self) -> None:
        self.t_x = atan2(self.sum[1], self.sum[2])
        self.t_y = atan2(-self.sum[0], self.sum[2])
        self.sum = vector(ZEROS)
        keep = exp(-self.period * self.level_frequency)
        self.smooth[0] = self.t_x + keep * (self.smooth[0] - self.t_x)
        self.smooth[1] = self.t_y + keep * (self.smooth[1] - self.t_y)
        within = fabs(self.smooth[0]) < self.level_limit and fabs(self.smooth[1]) < self.level_limit
        self.level = self.level + self.period if within else 0.0

    def switch(self) -> None:
        """Go on to the next stage where this one is finished."""
        self.left = self.left - self.period
        over = self.left < 0.5 * self.period
        if self.stage == LEVEL:
            if self.level > self.level_time - 0.5 * self.period:
                self.stage = COARSE
                self.open_window()
        elif self.stage == COARSE:
            if over:
                self.first()
                if self.positions == 2.0:
                    self.angle = pi
                    self.left = pi / self.rate_max + 3.0 / (self.damping * self.level_frequency)  # and comes to rest
                    self.stage = TURN
                else:
                    self.go_north()
        elif self.stage == TURN:
            if over and self.angle == 0.0:
                self.stage = SECOND
                self.open_window()
        elif self.stage == SECOND:
            if over:
                self.second()
                self.go_north()
        elif self.stage == TO_NORTH:
            if self.turning != 0.0:
                self.left = 1.0 / (self.damping * self.fast_frequency)
            elif over:
                self.psi = 0.0
                self.left = self.fast_time
                if self.positions == 1.0:
                    self.J[0] = 0.0
                    self.model.forget()
                self.stage = FAST
        elif self.stage == FAST and over:
            self.stage = SLOW

    def go_north(self) -> None:
        self.angle = -self.psi
        self.stage = TO_NORTH
        self.left = 1.0 / (self.damping * self.fast_frequency)

    def open_window(self) -> None:
        self.left = self.coarse_time
        self.window = vector([0.0, 0.0])

    def weight(self) -> Number:
        """Return the weight of the coming, or of the running, period in the mean of a window, 6 x (1 - x)/T.

        The mean of a rate is then the least-squares slope of its angle, which white noise of the tilt moves least.
        """
        x = clip((self.left - 0.5 * self.period) / self.coarse_time, 0.0, 1.0)
        return 6.0 * x * (1.0 - x) / self.coarse_time

    def first(self) -> None:
        """Take psi and J from the mean command of the first window."""
        mean = vector(self.window)
        self.psi = atan2(-mean[0], mean[1])
        size = sqrt(mean @ mean)
        excess = size - self.north
        self.J = mean - self.earth(self.psi)
        self.model.first_heading(self.psi, self.north)
        stated = self.up * self.errors.latitude
        variance = (
            self.model.sigma(3) * self.model.sigma(3) + self.model.sigma(4) * self.model.sigma(4) + stated * stated
        )
        self.doubt = 1.0 if fabs(excess) > DOUBT * sqrt(variance) + NEAR * self.north else 0.0

    def second(self) -> None:
        """Take half of what the mean command has changed into psi and J.  [NORTH-2POS; half differences, half sums]"""
        mean = vector(self.window)
        half = self.earth(self.psi) + 0.5 * mean  # of the second position: its Earth rate, by the half difference
        before = self.psi
        self.psi = atan2(-half[0], half[1])
        self.J = self.J + 0.5 * mean
        self.model.second_heading(before, self.north)

    def control(self) -> None:
        top = self.rate_max
        way = clip(self.angle, -top * self.period, top * self.period)
        self.turning = way / self.period
        self.angle = 0.0 if way == self.angle else self.angle - way
        k = self.gains()
        feed = vector([clip(-k[0] * self.t_x, -top, top), clip(-k[1] * self.t_y, -top, top)])
        if fabs(k[0] * self.t_x) < top and fabs(k[1] * self.t_y) < top:
            self.J[0] = self.J[0] - k[2] * self.period * self.t_x
            self.J[1] = self.J[1] - k[3] * self.period * self.t_y
        self.azimuth = self.azimuth + k[5] * self.period * self.t_x
        keep = exp(-self.period / self.lag())
        self.y = self.t_x + keep * (self.y - self.t_x)
        mean = vector(self.J) + feed
        earth = self.known() * self.earth(self.psi + 0.5 * way)
        self.asked[0] = earth[0] + mean[0] - self.drift[0]
        self.asked[1] = earth[1] + mean[1] - self.drift[1]
        self.asked[2] = self.up - self.turning + self.azimuth + k[4] * self.y - self.drift[2]
        if self.stage == COARSE:
            self.window = vector(self.window) + (self.weight() * self.period) * mean
        elif self.stage == SECOND:
            self.window = vector(self.window) + (self.weight() * self.period) * feed

    def judge(self) -> None:
        """Set status, ready and done."""
        self.state = NONE
        if self.known() == 1.0:
            self.state = VALID
            tilted = maximum(fabs(self.smooth[0]), fabs(self.smooth[1])) > self.level_limit
            if self.fine() == 1.0 and tilted:
                self.state = TILTED
            if self.doubt == 1.0 or (self.fine() == 1.0 and self.contradicted() == 1.0):
                self.state = WRONG
        usable = (self.fine() == 1.0 or self.calming() == 1.0) and self.state == VALID
        if usable and self.model.sigma(2) <= self.wanted:
            self.since = self.t if self.good == 0.0 else self.since
            self.good = 1.0
        else:
            self.since = -1.0
            self.good = 0.0
        self.over = 1.0 if self.t > self.time_limit - 0.5 * self.period else 0.0
        if self.good == 1.0 and self.t - self.since > self.hold - 0.5 * self.period:
            self.over = 1.0

    def contradicted(self) -> Number:
        """Return 1 where a rate that the loops have found is beyond what the errors of the sensors allow."""
        stated = self.up * self.errors.latitude
        near = NEAR * self.north
        along = fabs(self.J[1]) > DOUBT * sqrt(self.model.sigma(4) * self.model.sigma(4) + stated * stated) + near
        about = fabs(self.azimuth) > DOUBT * self.model.sigma(5) + near
        return 1.0 if along or about else 0.0

    def outputs(self) -> None:
        self.command = self.asked
        self.heading = self.psi
        self.sigma = self.model.sigma(2) if self.known() == 1.0 else pi
        self.tilt = self.smooth
        for i in range(2):
            self.sigma_tilt[i] = self.model.sigma(i)
            self.correction[i] = self.J[i]
        self.correction[2] = self.azimuth
        self.mode = self.stage
        self.status = self.state
        self.ready = self.good
        self.ready_time = self.since
        self.done = self.over
