"""Angle reading of a table: errors of the scale, coarse-fine carry, multiplier loop, incremental count, rate readouts.

Angles are those of the axis, rad.  A scale of p pole pairs repeats every 2 pi/p, its electrical cycle.
"""

from __future__ import annotations

from gyrobench.component.component import Component
from gyrobench.component.composition import Block, sampled
from gyrobench.component.declarations import Discrete, Input, Noise, Output, Parameter
from gyrobench.component.math import TWO_PI, Number, cos, exp, floor, sin


def nearest(x: Number) -> Number:
    """Return the whole number nearest to x, halves upwards."""
    return floor(x + 0.5)


def wrapped(x: Number) -> Number:
    """Return an angle within -pi and pi."""
    return x - TWO_PI * floor((x + 0.5 * TWO_PI) / TWO_PI)


def carried(fine: Number, coarse: Number, step: Number, counts: Number, cycles: Number) -> Number:
    """Return the angle in fine counts, of one turn, from a fine count and a coarse one.

    fine: 0 .. counts - 1 within a cycle; coarse: in steps of ``step`` fine counts; cycles: fine cycles in a turn.
    Half a coarse step is added, so that the coarse channel may be wrong by the same amount on both sides:

        n = floor((step coarse + step/2 - fine + counts/2) / counts) mod cycles        angle = n counts + fine
    """
    n = floor((step * coarse + 0.5 * step - fine + 0.5 * counts) / counts)
    return (n - cycles * floor(n / cycles)) * counts + fine


class ScaleErrors(Block):
    """Static errors of a scale, what is read too much at the true angle a:

        eccentricity sin(a + ...) + tilt sin(2 a + ...) + pitch sin(pitch_order a + ...) + interpolation sin(p a + ...)
        + [d0 (1 - cos 2 p a) / 2 + de sin 2 p a / 2 + (e5 - e3) sin 4 p a] / p

    d0 error of quadrature, de of equal amplitudes, e3 and e5 harmonics of the windings (second order left out).
    [ANGLE-INDUCTOSYN; Hu 1981, eq. 5-51]
    """

    pole_pairs = Parameter(360, int, "pole pairs p: electrical cycles of the scale in a turn", min=1, max=100000)
    eccentricity = Parameter(0.0, "rad", "reading error of order 1 (eccentricity)")
    eccentricity_phase = Parameter(0.0, "rad", "its phase at angle 0")
    tilt = Parameter(0.0, "rad", "reading error of order 2 (tilt of the scale)")
    tilt_phase = Parameter(0.0, "rad", "its phase at angle 0")
    pitch = Parameter(0.0, "rad", "reading error of order pitch_order (pitch, sectors)")
    pitch_order = Parameter(12, int, "its cycles in a turn", min=3, max=100000)
    pitch_phase = Parameter(0.0, "rad", "its phase at angle 0")
    interpolation = Parameter(0.0, "rad", "reading error once in an electrical cycle (offsets of the channels)")
    interpolation_phase = Parameter(0.0, "rad", "its phase at angle 0")
    d0 = Parameter(0.0, "rad", "departure of the channels from quadrature, electrical", min=-0.1, max=0.1)
    de = Parameter(0.0, "1", "relative difference of the channels' amplitudes", min=-0.1, max=0.1)
    e3 = Parameter(0.0, "1", "third harmonic of the windings, relative", min=-0.1, max=0.1)
    e5 = Parameter(0.0, "1", "fifth harmonic of the windings, relative", min=-0.1, max=0.1)

    def error(self, angle: Number) -> Number:
        """Return reading minus angle."""
        x = 0.0
        if self.eccentricity != 0.0:
            x = self.eccentricity * sin(angle + self.eccentricity_phase)
        if self.tilt != 0.0:
            x = x + self.tilt * sin(2.0 * angle + self.tilt_phase)
        if self.pitch != 0.0:
            x = x + self.pitch * sin(self.pitch_order * angle + self.pitch_phase)
        if self.interpolation != 0.0:
            x = x + self.interpolation * sin(self.pole_pairs * angle + self.interpolation_phase)
        winding = self.e5 - self.e3
        if self.d0 != 0.0 or self.de != 0.0 or winding != 0.0:
            s = sin(2.0 * self.pole_pairs * angle)
            c = cos(2.0 * self.pole_pairs * angle)
            x = x + (0.5 * self.d0 * (1.0 - c) + 0.5 * self.de * s + 2.0 * winding * s * c) / self.pole_pairs
        return x


class IncrementalEncoder(ScaleErrors):
    """Counts of a scale: (angle + error + reading noise) / quantum, rounded, and the instant they belong to.

    A part calls latch() when it samples; count and t_read stay until the next time.  Counts are whole and cumulative.
    [ANGLE-INDUCTOSYN; Hu 1981, sections 5.4 (three-1), 5.5 (one-3)]
    """

    quantum = Parameter(TWO_PI / 7.2e6, "rad", "angle of a count (0.18 arcsec)", above=0.0)
    reading = Noise(0.0, "rad", "standard deviation of a reading", per="step")
    count = Discrete(0.0, "1", "cumulative count")
    t_read = Discrete(0.0, "s", "the instant it belongs to")

    def counted(self, angle: Number, lag: Number) -> Number:
        """Return the count of the scale at this angle (rad), read late by the angle ``lag``."""
        return nearest((angle - lag + self.error(angle) + self.noise.reading) / self.quantum)

    def latch(self, angle: Number) -> None:
        """Read the scale now, at this angle (rad)."""
        self.count = self.counted(angle, 0.0)
        self.t_read = self.t


class MultiplierLoop(Block):
    """Phase multiplier that makes counts of an electrical cycle: what its output lags behind the angle x, e = x - y.

        type 0   e = 0                                          ideal
        type 1   e' = x' - K_v e                                lags x'/K_v at constant rate
        type 2   e'' = x'' - K_v e' - K_v^2 e / 4               no lag at constant rate, 4 x''/K_v^2 at acceleration

    exact for a rate that is linear in time within a step (type 2: critically damped, charge pump).
    [ANGLE-INDUCTOSYN]
    """

    type = Parameter(2, int, "multiplier loop: 0 ideal, 1 lags rate/K_v, 2 without lag at constant rate", min=0, max=2)
    K_v = Parameter(100.0 * TWO_PI, "1/s", "gain of the multiplier loop", above=0.0)
    lag = Discrete(0.0, "rad", "angle minus output of the loop")
    lag_rate = Discrete(0.0, "rad/s", "its derivative")
    rate_last = Discrete(0.0, "rad/s", "rate at the end of the last step")
    slipped = Discrete(0.0, "1", "cycles lost since the start")

    def follow(self, rate: Number, h: Number) -> None:
        """Advance by a step h (s) that ends with this rate (rad/s)."""
        slope = (rate - self.rate_last) / h
        if self.type == 1.0:
            # e = (x' - x''/K) / K on the ramp, and the rest of the old departure from it
            k = self.K_v
            before = (self.rate_last - slope / k) / k
            self.lag = (rate - slope / k) / k + (self.lag - before) * exp(-k * h)
        if self.type == 2.0:
            a = 0.5 * self.K_v
            rest = slope / (a * a)
            d = self.lag - rest
            v = self.lag_rate + a * d
            fade = exp(-a * h)
            self.lag = rest + (d + v * h) * fade
            self.lag_rate = (v - a * (d + v * h)) * fade
        self.rate_last = rate

    def slip(self, cycle: Number) -> None:
        """Count the whole cycles by which the loop has lost the angle; it is locked again to another one.

        Its phase detector sees the lag modulo a cycle (rad of the axis): beyond half of one it pulls to the next.
        """
        n = nearest(self.lag / cycle)
        self.lag = self.lag - n * cycle
        self.slipped = self.slipped + n


class RateReadout(Component):
    """Common part of the readouts of a rate from counts with time stamps.  [READOUT-RATE]

    A reading is what a sample of one communication step shows; one that repeats the stamp before is the same reading.
    The parts write r_time, the time (s) of the last interval by their own clock, r_angle (rad) and the interval's ends.
    """

    step = Parameter(1e9, "s", "largest internal step: one reading for each communication step", above=0.0)
    quantum = Parameter(TWO_PI / 7.2e6, "rad", "angle of a count (0.18 arcsec)", above=0.0)
    clock = Parameter(0.0, "1", "relative error of the time base: it runs fast", min=-0.01, max=0.01)

    count = Input(0.0, "1", "cumulative count")
    t_read = Input(0.0, "s", "instant to which the count belongs")

    rate = Output("rad/s", "rate of the last interval")
    valid = Output("1", "1 when there is one")
    overflow = Output("1", "1 while the interval is beyond the display")
    number = Output("1", "intervals read since the start")
    t_start = Output("s", "start of the last interval")
    t_end = Output("s", "its end")

    count_last = Discrete(0.0, "1", "count of the reading before")
    t_last = Discrete(0.0, "s", "its stamp")
    started = Discrete(0.0, "1", "1 after the first reading")
    over = Discrete(0.0, "1", "the running interval is beyond the display")
    r_number = Discrete(0.0, "1", "intervals read")
    r_angle = Discrete(0.0, "rad", "angle of the last interval")
    r_time = Discrete(0.0, "s", "its time by the readout's clock; 0: none")
    r_start = Discrete(0.0, "s", "its start")
    r_end = Discrete(0.0, "s", "its end")

    @sampled(every=1)
    def check_time(self) -> None:
        self.refuse(
            self.started == 1.0 and self.t_read < self.t_last,
            "t_read = {t_read} s is before that of the last reading, {t_last} s: stamps must not go back",
        )

    def note(self) -> None:
        """Keep the reading for the next one."""
        self.count_last = self.count
        self.t_last = self.t_read
        self.started = 1.0

    def outputs(self) -> None:
        self.valid = 1.0 if self.r_time > 0.0 and self.over == 0.0 else 0.0
        self.rate = 0.0
        if self.valid == 1.0:
            self.rate = self.r_angle / self.r_time
        self.overflow = self.over
        self.number = self.r_number
        self.t_start = self.r_start
        self.t_end = self.r_end
