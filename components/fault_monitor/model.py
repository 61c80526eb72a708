from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Noise, Output, Parameter, sampled
from gyrobench.component.math import Number, fabs, floor, maximum, minimum

SCALARS = 8
ITEMS = 11  # the scalars; frequency, duty and amplitude of the pulse train
NONE = [0.0] * ITEMS


class FaultMonitor(Component):
    """Monitor of scalars and a pulse train: each in its range, or an alarm naming the first item.  [CTRL-SUPERVISION]

    Every `period` the first n of 8 scalars are read, one a communication step, and a burst of the pulse train is taken,
    one sample a step.  Features of the train y = (f, duty, amplitude): f from the first to the last rising edge of the
    burst, crossings of the middle between its levels interpolated; duty from the samples above it between them;
    amplitude from the means above and below.  An item with value v and range low to high is inside where

        g = |v - (low + high)/2| / ((high - low)/2) - 1 <= 0

    and the whole is normal where the largest g of all items is.  Only where it is not, the items are looked at one by
    one: `first` is the first one outside: 1 to 8 scalars, 9 frequency, 10 duty, 11 amplitude.  An item counts as
    outside after `hold_off` periods in a row.  The alarm is latched until `clear`.  A train with fewer than three
    edges in the burst, or with less than a fifth of its lower amplitude, has the frequency 0.

    Refused: inverted ranges, a burst with fewer than three edges at the lowest frequency, fewer than 20 samples a
    period at the highest, more scalars and burst than steps in a period.  Values that are not finite end the run.
    Not modelled: detection before a limit is reached (trends), correlation between items.
    Source: Hu 1981, section 6.1 (item 1); the inside of a region is g <= 0, not g = 0.
    """

    version = "1.0.0"

    step = Parameter(1e9, "s", "largest internal step: one sample for each communication step", above=0.0)
    period = Parameter(0.1, "s", "time between two looks at an item", above=0.0)
    hold_off = Parameter(2, int, "looks in a row outside before it counts", min=1, max=100)
    n = Parameter(8, int, "scalars in use", min=0, max=8)
    low = Parameter([0.0] * SCALARS, "1", "lower limits of the scalars, each in its own SI unit")
    high = Parameter([1.0] * SCALARS, "1", "upper limits")
    pulses = Parameter(False, bool, "1: there is a pulse train")
    burst = Parameter(0.06, "s", "time over which the train is sampled", above=0.0)
    frequency_low = Parameter(45.0, "Hz", "lower limit of its frequency", above=0.0)
    frequency_high = Parameter(55.0, "Hz", "upper limit", above=0.0)
    duty_low = Parameter(0.45, "1", "lower limit of its duty", min=0.0, max=1.0)
    duty_high = Parameter(0.55, "1", "upper limit", min=0.0, max=1.0)
    amplitude_low = Parameter(4.5, "V", "lower limit of its amplitude", above=0.0)
    amplitude_high = Parameter(5.5, "V", "upper limit", above=0.0)
    reading = Noise(0.0, "1", "noise of a scalar's reading, in half widths of its range, one sample", per="step")
    wave = Noise(0.0, "V", "noise of a sample of the pulse train", per="step")

    x = Input([0.0] * SCALARS, "1", "scalars, each in its own SI unit")
    pulse = Input(0.0, "V", "pulse train")
    clear = Input(0.0, "1", "other than 0: the alarm is taken back")

    alarm = Output("1", "1 from the first fault until it is cleared")
    first = Output("1", "item that raised the alarm: 1 to 8 scalar, 9 frequency, 10 duty, 11 amplitude; 0 none")
    t_alarm = Output("s", "time of the alarm; -1 without")
    outside = Output("1", "number of items that are outside now")
    excess = Output("1", "largest g of the last period: above 0 something was outside")
    frequency = Output("Hz", "frequency of the train in the last burst")
    duty = Output("1", "its duty")
    amplitude = Output("V", "its amplitude")

    count = Discrete(0.0, "1", "steps since the period began")
    steps = Discrete(1.0, "1", "steps of a period")
    samples = Discrete(1.0, "1", "steps of a burst")
    lo = Discrete(NONE, "1", "lower limits of all items")
    hi = Discrete(NONE, "1", "upper limits")
    fails = Discrete(NONE, "1", "looks in a row outside")
    g = Discrete(NONE, "1", "g of each item at its last look")
    top = Discrete(0.0, "V", "largest sample of the burst")
    bottom = Discrete(0.0, "V", "smallest sample of the burst")
    middle = Discrete(0.0, "V", "middle of the levels, from the burst before")
    last = Discrete(0.0, "V", "sample before")
    edges = Discrete(0.0, "1", "edges in the burst")
    rises = Discrete(0.0, "1", "rising edges in the burst")
    t_rise = Discrete(0.0, "s", "first rising edge")
    t_last = Discrete(0.0, "s", "last rising edge")
    count_rise = Discrete(0.0, "1", "samples before the first rising edge")
    count_last = Discrete(0.0, "1", "samples before the last rising edge")
    above_rise = Discrete(0.0, "1", "samples above the middle before the first rising edge")
    above_last = Discrete(0.0, "1", "samples above the middle before the last rising edge")
    above = Discrete(0.0, "1", "samples above the middle")
    sum_above = Discrete(0.0, "V", "their sum")
    sum_below = Discrete(0.0, "V", "sum of the others")
    f_now = Discrete(0.0, "Hz", "frequency")
    duty_now = Discrete(0.0, "1", "duty")
    amplitude_now = Discrete(0.0, "V", "amplitude")
    known = Discrete(0.0, "1", "bursts seen, up to 2")
    latched = Discrete(0.0, "1", "alarm")
    named = Discrete(0.0, "1", "item that raised it")
    when = Discrete(-1.0, "s", "time of the alarm")
    worst = Discrete(-1.0, "1", "largest g of the last period")
    many = Discrete(0.0, "1", "items outside")

    def start(self) -> None:
        for j in range(SCALARS):
            self.lo[j] = self.low[j]
            self.hi[j] = self.high[j]
            self.count = j + 1.0
            self.refuse(j < self.n and self.low[j] >= self.high[j], "low, high: range {count} is inverted or empty")
        self.refuse(self.frequency_low >= self.frequency_high, "frequency_low must be below frequency_high")
        self.refuse(self.duty_low >= self.duty_high, "duty_low must be below duty_high")
        self.refuse(self.amplitude_low >= self.amplitude_high, "amplitude_low must be below amplitude_high")
        self.refuse(
            self.pulses and self.burst * self.frequency_low < 2.0,
            "burst = {burst} s has fewer than three edges for sure at frequency_low = {frequency_low} Hz: two periods "
            "are needed",
        )
        self.lo[8] = self.frequency_low
        self.hi[8] = self.frequency_high
        self.lo[9] = self.duty_low
        self.hi[9] = self.duty_high
        self.lo[10] = self.amplitude_low
        self.hi[10] = self.amplitude_high
        self.middle = 0.25 * (self.amplitude_low + self.amplitude_high)
        self.count = 0.0
        self.steps = 0.0

    def look(self, j: Number, v: Number) -> None:
        """Judge item j by its value v."""
        for k in range(ITEMS):
            if k == j:
                half = 0.5 * (self.hi[k] - self.lo[k])
                self.g[k] = fabs(v - self.lo[k] - half) / half - 1.0
                self.fails[k] = 0.0 if self.g[k] <= 0.0 else self.fails[k] + 1.0

    def sample(self, v: Number) -> None:
        """Take one sample of the pulse train."""
        if self.count == 0.0:
            self.top = v
            self.bottom = v
            self.edges = 0.0
            self.rises = 0.0
            self.above = 0.0
            self.sum_above = 0.0
            self.sum_below = 0.0
        else:
            self.top = maximum(self.top, v)
            self.bottom = minimum(self.bottom, v)
            if (v >= self.middle) != (self.last >= self.middle):
                self.edges = self.edges + 1.0
                if v >= self.middle:
                    self.t_last = self.t - self.h * (v - self.middle) / (v - self.last)
                    if self.rises == 0.0:
                        self.t_rise = self.t_last
                        self.count_rise = self.count
                        self.above_rise = self.above
                    self.count_last = self.count
                    self.above_last = self.above
                    self.rises = self.rises + 1.0
        if v >= self.middle:
            self.above = self.above + 1.0
            self.sum_above = self.sum_above + v
        else:
            self.sum_below = self.sum_below + v
        self.last = v

    def features(self) -> None:
        """Compute frequency, duty and amplitude of the burst, and judge them from the second burst on."""
        self.f_now = 0.0
        self.duty_now = self.above / self.samples
        self.amplitude_now = self.top - self.bottom
        if self.above > 0.0 and self.above < self.samples:
            self.amplitude_now = self.sum_above / self.above - self.sum_below / (self.samples - self.above)
        if self.edges >= 3.0 and self.rises >= 2.0 and self.top - self.bottom > 0.2 * self.amplitude_low:
            self.f_now = (self.rises - 1.0) / (self.t_last - self.t_rise)
            self.duty_now = (self.above_last - self.above_rise) / (self.count_last - self.count_rise)
        if self.top - self.bottom > 0.2 * self.amplitude_low:
            self.middle = 0.5 * (self.top + self.bottom)
        if self.known >= 1.0:
            self.look(8.0, self.f_now)
            self.look(9.0, self.duty_now)
            self.look(10.0, self.amplitude_now)
        self.known = 1.0

    def conclude(self) -> None:
        """Check the whole; where it is not normal, find the first item."""
        self.worst = -1.0
        for k in range(ITEMS):
            self.worst = maximum(self.worst, self.g[k] if k < self.n or (k >= SCALARS and self.pulses) else -1.0)
        self.many = 0.0
        if self.worst > 0.0:
            found = 0.0
            for k in range(ITEMS):
                if self.fails[k] >= self.hold_off:
                    self.many = self.many + 1.0
                    if found == 0.0:
                        found = k + 1.0
            if found > 0.0 and self.latched == 0.0:
                self.latched = 1.0
                self.named = found
                self.when = self.t

    @sampled(every=1)
    def tick(self) -> None:
        if self.steps == 0.0:
            self.steps = floor(self.period / self.h + 0.5)
            self.samples = floor(self.burst / self.h + 0.5)
            self.refuse(
                self.pulses and self.h > 0.05001 / self.frequency_high,
                "the step is too long for frequency_high = {frequency_high} Hz: 20 samples a period are needed",
            )
            self.refuse(
                self.steps < self.n or (self.pulses and self.steps < self.samples),
                "period = {period} s has too few steps for {n} scalars and a burst of {burst} s",
            )
        if self.clear != 0.0:
            self.latched = 0.0
            self.named = 0.0
            self.when = -1.0
            for k in range(ITEMS):
                self.fails[k] = 0.0
        for j in range(SCALARS):
            if j == self.count and j < self.n:
                half = 0.5 * (self.high[j] - self.low[j])
                self.look(j, self.x[j] + half * self.noise.reading)
        if self.pulses and self.count < self.samples:
            self.sample(self.pulse + self.noise.wave)
            if self.count == self.samples - 1.0:
                self.features()
        self.count = self.count + 1.0
        if self.count >= self.steps:
            self.conclude()
            self.count = 0.0

    def outputs(self) -> None:
        self.alarm = self.latched
        self.first = self.named
        self.t_alarm = self.when
        self.outside = self.many
        self.excess = self.worst
        self.frequency = self.f_now
        self.duty = self.duty_now
        self.amplitude = self.amplitude_now
