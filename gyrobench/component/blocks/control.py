"""Control of a table axis: sampled controller, analogue networks, tachometer loop, in-position window."""

from __future__ import annotations

from gyrobench.component.blocks.command import ARCSEC
from gyrobench.component.composition import Block
from gyrobench.component.declarations import Discrete, Parameter, State
from gyrobench.component.math import Number, Vector, clip, exp, fabs, floor, index, pi, sqrt, vector

DEG = pi / 180.0


class SampledController(Block):
    """Sampled controller of a table axis: all closed-loop poles at p, two degrees of freedom.  [CTRL-SAMPLED]

        u_k = b u_k-1 + (2 J / T2) (g x_k - a x_k-1)        x = (command count - count) quantum, both cumulative
        b = (p3 + 3 p2 + 3 p - 3) / 4,   g = 2 + b - 3 p,   a = p3 - b
        demand = clip(u_k + J_ff acc, +-M_max)

    With `viscous` D > 0 the plant of the design is 1/(s (J s + D)): viscous friction and back EMF.  y = D T / J,
    d = e^-y, W(z) = (T2/2J)(n1 z + n0)/((z - 1)(z - d)), n1 = 2 (y - 1 + d)/y2, n0 = 2 (1 - d - y d)/y2, s = 1 + d:

        b = (3 p2 - d + p3 n1/n0 - (s - 3 p) n0/n1) / (n0/n1 + d n1/n0 + s)
        g = (s + b - 3 p)/n1,   a = (p3 - d b)/n0              D = 0: d = n1 = n0 = 1, the above

    p = 0 is the deadbeat design: no error of a constant rate after three samples (D > 0: of a step), no torque
    between samples.  The demand that was really made, less the feedforward, is the u_k-1 of the next sample: saturation
    is fed back into the history.  J_ff acc, from the acceleration of the reference over the coming period, moves the
    table by itself; the feedback is left with what differs.  Static stiffness: (2 J / T2) (g - a) / (1 - b) N.m/rad.

    `delay` is the time from the sample to the new torque; the gains are those for no delay, and the start refuses a
    delay with which a pole leaves the unit circle; with m = delay / T the plant is

        J z (z - 1)2 theta = (T2/2) ((1-m)2 z2 + (1 + 2m - 2m2) z + m2) u               (D = 0)

    Not modelled: word length of the processor beyond the counts, poles that differ from each other.
    Source: Hu 1981, eq. 6-10..6-19 with ET22; softer poles, delay and feedforward: own design.
    """

    period = Parameter(5e-3, "s", "sampling period T", min=1e-3, max=1e-2)
    quantum = Parameter(0.18 * ARCSEC, "rad", "angle of one count (0.18 arcsec)", above=0.0)
    J = Parameter(2.56, "kg.m2", "table inertia of the design", above=0.0)
    viscous = Parameter(0.0, "N.m.s/rad", "viscous friction and back EMF of the design", min=0.0)
    p = Parameter(0.0, "1", "closed-loop poles, all three; 0: deadbeat", min=0.0, below=1.0)
    J_ff = Parameter(0.0, "kg.m2", "inertia of the feedforward; 0: one degree of freedom", min=0.0)
    M_max = Parameter(9.80665, "N.m", "largest torque that is demanded (1 kg.m)", above=0.0)
    delay = Parameter(0.0, "s", "time from the sample to the torque, a multiple of the internal step", min=0.0)
    error_max = Parameter(2.0 * DEG, "rad", "largest error of a captured table (2 deg)", above=0.0)

    demand = Discrete(0.0, "N.m", "demanded torque")
    e = Discrete(0.0, "rad", "error at the last sample")
    saturated = Discrete(0.0, "1", "1 while the demand is limited")
    b = Discrete(0.0, "1", "pole of the controller")
    g = Discrete(0.0, "1", "gain of the present error")
    a = Discrete(0.0, "1", "gain of the last error")
    scale = Discrete(0.0, "N.m/rad", "2 J / T2")
    u_last = Discrete(0.0, "N.m", "feedback part of the demand of the last sample")
    made = Discrete(0.0, "N.m", "demand of the last sample, on its way")
    left = Discrete(0.0, "1", "internal steps until it acts")

    def start(self) -> None:
        p = self.p
        self.b = (p * p * p + 3.0 * p * p + 3.0 * p - 3.0) / 4.0
        self.g = 2.0 + self.b - 3.0 * p
        self.a = p * p * p - self.b
        if self.viscous > 0.0:
            self.design()
        self.scale = 2.0 * self.J / (self.period * self.period)
        self.refuse(
            self.scale * self.g * self.quantum > self.M_max,
            "one count = {quantum} rad demands more than M_max = {M_max} N.m: 2 J g quantum / T2 with T = {period} s; "
            "take a longer period or a finer quantum",
        )
        self.refuse(self.delay > self.period, "delay = {delay} s is longer than the period = {period} s")
        self.refuse(
            self.stable(self.delay / self.period) == 0.0,
            "the loop is unstable with a computation delay of {delay} s at p = {p}, T = {period} s: take a larger p or "
            "a shorter delay",
        )
        self.demand = 0.0
        self.made = 0.0
        self.left = 0.0
        self.u_last = 0.0
        self.e = 0.0
        self.saturated = 0.0

    def turned(self, y: Number) -> Number:
        """Return 2 (y - 1 + e^-y): the angle of a torque that acts for y J/D, times D2/J over half the torque."""
        if y < 1e-3:
            return y * y * (1.0 - y * (1.0 / 3.0 - y * (1.0 / 12.0 - y / 60.0)))
        return 2.0 * (y - 1.0 + exp(-y))

    def moving(self, y: Number) -> Number:
        """Return 1 - e^-y: the rate after it, times D over the torque."""
        if y < 1e-3:
            return y * (1.0 - y * (0.5 - y * (1.0 / 6.0 - y / 24.0)))
        return 1.0 - exp(-y)

    def design(self) -> None:
        """Set b, g, a of an inertia with viscous friction."""
        p = self.p
        y = self.viscous * self.period / self.J
        d = exp(-y)
        n1 = self.turned(y) / (y * y)
        n0 = 2.0 * self.moving(y) / y - n1  # n1 + n0 = 2 (1 - d)/y
        total = 1.0 + d
        free = 3.0 * p * p - d + p * p * p * n1 / n0 - (total - 3.0 * p) * n0 / n1
        self.b = free / (n0 / n1 + d * n1 / n0 + total)
        self.g = (total + self.b - 3.0 * p) / n1
        self.a = (p * p * p - d * self.b) / n0

    def stable(self, m: Number) -> Number:
        """Return 1 where all poles lie inside the unit circle (Schur-Cohn), with a delay of m periods."""
        b0 = (1.0 - m) * (1.0 - m)
        b1 = 1.0 + 2.0 * m - 2.0 * m * m
        b2 = m * m
        d = 1.0
        if self.viscous > 0.0:
            y = self.viscous * self.period / self.J
            d = exp(-y)
            new = (1.0 - m) * y
            q = 2.0 * self.moving(y) / (y * y)
            old = self.turned(m * y) + 2.0 * self.moving(new) * self.moving(m * y)
            b0 = self.turned(new) / (y * y)
            b1 = (old - d * self.turned(new)) / (y * y) + q * self.moving(new)
            b2 = q * exp(-new) * self.moving(m * y) - d * old / (y * y)
        total = 1.0 + d
        # z (z - 1)(z - d)(z - b) + (b0 z2 + b1 z + b2) (g z - a), highest power first
        c = [
            1.0,
            -total - self.b + b0 * self.g,
            d + total * self.b + b1 * self.g - b0 * self.a,
            -d * self.b + b2 * self.g - b1 * self.a,
            -b2 * self.a,
        ]
        r = [c[4], c[3], c[2], c[1], c[0]]
        for _n in range(4):
            if fabs(r[0]) >= fabs(c[0]):
                return 0.0
            q = r[0] / c[0]
            for i in range(4):
                before = c[i + 1]
                c[i] = c[i] - q * r[i]
                r[i] = r[i + 1] - q * before
        return 1.0

    def hold(self) -> None:
        """Demand nothing, and remember nothing."""
        self.demand = 0.0
        self.made = 0.0
        self.left = 0.0
        self.u_last = 0.0
        self.saturated = 0.0

    def wait(self) -> None:
        """Run in each internal step, before `sample`: a demand acts when its delay is over."""
        if self.left > 0.0:
            self.left = self.left - 1.0
            if self.left == 0.0:
                self.demand = self.made

    def sample(self, counts: Number, acc: Number) -> None:
        """Take a sample: command count minus count, and the acceleration of the reference over the coming period."""
        self.refuse(
            counts != floor(counts), "command count minus count is not a whole number: both must be cumulative counts"
        )
        x = counts * self.quantum
        self.refuse(
            fabs(x) > self.error_max,
            "command count and count differ by more than error_max = {error_max} rad: both must be cumulative, none "
            "counted per sample, and the table captured before the loop is closed",
        )
        ahead = self.J_ff * acc
        wanted = self.b * self.u_last + self.scale * (self.g * x - self.a * self.e) + ahead
        self.made = clip(wanted, -self.M_max, self.M_max)
        self.saturated = 1.0 if self.made != wanted else 0.0
        self.u_last = self.made - ahead
        self.e = x
        self.left = floor(self.delay / self.h + 0.5)
        self.refuse(
            fabs(self.left * self.h - self.delay) > 1e-6 * self.h,
            "delay = {delay} s is not a multiple of the internal step",
        )
        if self.left == 0.0:
            self.demand = self.made

    def preset(self, counts: Number) -> None:
        """Begin with the present error and no torque."""
        self.e = counts * self.quantum
        self.u_last = 0.0


class InPosition(Block):
    """In-position window: 1 once the error has stayed inside for a time.  [TABLE-POSITION]"""

    window = Parameter(ARCSEC, "rad", "largest error in position (1 arcsec)", above=0.0)
    hold = Parameter(0.1, "s", "time for which the error must stay inside", min=0.0)
    inside = Discrete(0.0, "1", "1 while in position")
    lasted = Discrete(0.0, "s", "time inside the window")

    def judge(self, e: Number, time: Number) -> None:
        """Take the error; time: since the last call, s."""
        self.lasted = self.lasted + time if fabs(e) < self.window else 0.0
        self.inside = 1.0 if fabs(e) < self.window and self.lasted >= self.hold else 0.0


class LeadLagBank(Block):
    """Analogue compensator: gain and three networks, error in, torque demand out.  [TABLE-SERVO]

        demand = gain (1 + s/z_1)(1 + s/z_2)(1 + s/z_3) / ((1 + s/p_1)(1 + s/p_2)(1 + s/p_3)) e, limited to +-M_max

    Sets, with w the crossover: lead (1 + sqrt(r) s/w) / (1 + s/(sqrt(r) w)), lag-lead (1 + s/w_l) / (1 + 5 s/w_l),
    w_l = w / 12.

      1  two leads r = 4, lag-lead: float gyro of 0.4 ms        2  two leads r = 5, lag-lead: float gyro of 1 ms
      3  two leads r = 28: undamped gyro                        4  three leads r = 6.5: undamped gyro
      5  one lead r = 14, lag-lead: error of counts             0  the parameters zeros and poles

    gain = 0: J w2 / |networks| at w, which puts the crossover of an inertia J at w.  `preset` sets the networks to what
    they settle at for the present error, so that a switch causes no jump.

    Not modelled: bandwidth, offset and noise of the amplifiers.
    Source: TABLE-SERVO; networks: own design.
    """

    network = Parameter(5, int, "set of networks, 0 to 5; 0: zeros and poles", min=0, max=5)
    crossover = Parameter(40.0 * pi, "rad/s", "crossover frequency w of the sets (20 Hz)", above=0.0)
    J = Parameter(2.56, "kg.m2", "table inertia of the design", above=0.0)
    gain = Parameter(0.0, "N.m/rad", "static gain; 0: from the crossover", min=0.0)
    zeros = Parameter([100.0, 100.0, 100.0], "rad/s", "zeros of set 0", above=0.0)
    poles = Parameter([1000.0, 1000.0, 1000.0], "rad/s", "poles of set 0", above=0.0)
    M_max = Parameter(9.80665, "N.m", "largest torque that is demanded (1 kg.m)", above=0.0)

    net = State([0.0, 0.0, 0.0], "rad", "state of each network")
    pole = Discrete([1.0, 1.0, 1.0], "rad/s", "pole of each network")
    ratio = Discrete([1.0, 1.0, 1.0], "1", "its gain at high frequency, pole / zero")
    K = Discrete(0.0, "N.m/rad", "static gain used")

    def start(self) -> None:
        w = self.crossover
        r = [4.0, 5.0, 28.0, 6.5, 14.0]
        zero = [w, w, w]
        for k in range(3):
            self.pole[k] = w  # no network: pole and zero alike
        if self.network > 0.0:
            spread = sqrt(r[index(self.network - 1.0)])
            for k in range(3):
                zero[k] = w / spread
                self.pole[k] = w * spread
            if self.network != 4.0:
                zero[2] = w / 12.0
                self.pole[2] = w / 60.0
            if self.network == 3.0:
                zero[2] = w
                self.pole[2] = w
            if self.network == 5.0:
                zero[1] = w
                self.pole[1] = w
        square = 1.0
        for k in range(3):
            if self.network == 0.0:
                zero[k] = self.zeros[k]
                self.pole[k] = self.poles[k]
            self.ratio[k] = self.pole[k] / zero[k]
            q = w / self.pole[k]
            z = w / zero[k]
            square = square * (1.0 + q * q) / (1.0 + z * z)
        self.K = self.gain if self.gain > 0.0 else self.J * w * w * sqrt(square)
        self.net = vector([0.0, 0.0, 0.0])

    def slope(self, e: Number) -> Vector:
        """Return the derivatives of net: the part's flow assigns them."""
        d = vector([0.0, 0.0, 0.0])
        y = e
        for k in range(3):
            d[k] = self.pole[k] * (y - self.net[k])
            y = self.net[k] + self.ratio[k] * (y - self.net[k])
        return vector(d)

    def unlimited(self, e: Number) -> Number:
        """Return the demand before its limit, N.m."""
        y = e
        for k in range(3):
            y = self.net[k] + self.ratio[k] * (y - self.net[k])
        return self.K * y

    def preset(self, e: Number) -> None:
        for k in range(3):
            self.net[k] = e


class TachoLoop(Block):
    """Rate loop on a tachometer: proportional and integral, with limit.  [TABLE-TACHO]

        demand = clip(K_p e + q, +-M_max),   q' = K_i e, 0 while the demand is limited and e pushes further

    Defaults: 5 Hz at J = 2.56 kg.m2, K_p = J w, K_i = J w2 / 4.
    Source: Hu 1981, sections 5.4 (two-3), 5.5 (two-1); gains: own design.
    """

    K_p = Parameter(2.56 * 10.0 * pi, "N.m.s/rad", "proportional gain", above=0.0)
    K_i = Parameter(2.56 * 25.0 * pi * pi, "N.m/rad", "integral gain", min=0.0)
    M_max = Parameter(9.80665, "N.m", "largest torque that is demanded (1 kg.m)", above=0.0)
    rate_least = Parameter(0.1 * DEG, "rad/s", "smallest rate that may be set (0.1 deg/s)", min=0.0)
    rate_most = Parameter(999.9 * DEG, "rad/s", "largest rate that may be set (999.9 deg/s)", above=0.0)
    q = State(0.0, "N.m", "integral part")
    rate_last = Discrete(0.0, "rad/s", "rate at the last check")

    def unlimited(self, e: Number) -> Number:
        """Return the demand before its limit for the rate error e, N.m."""
        return self.K_p * e + self.q

    def slope(self, e: Number) -> Number:
        """Return the derivative of q."""
        y = self.unlimited(e)
        if (y > self.M_max and e > 0.0) or (y < -self.M_max and e < 0.0):
            return 0.0
        return self.K_i * e

    def check(self, rate: Number) -> None:
        """Refuse a set rate outside the range of four digits; 0 is rest, and a rate that still changes is none."""
        self.refuse(
            fabs(rate) > self.rate_most * (1.0 + 1e-12), "the rate set is above {self}_rate_most = {rate_most} rad/s"
        )
        self.refuse(
            rate == self.rate_last and rate != 0.0 and fabs(rate) < self.rate_least * (1.0 - 1e-12),
            "the rate set is below {self}_rate_least = {rate_least} rad/s: use the synchronous rate (count loop)",
        )
        self.rate_last = rate
