from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Output, Parameter, sampled
from gyrobench.component.math import fabs, maximum, sqrt


class Sampler(Component):
    """Averages a signal over windows of time or of angle.  [TABLE-PROGRAM; Hu 1981, section 6.1]

    The first sample with the gate open, at (t_a, angle_a), begins window 1.  Window k ends, and window k + 1
    begins, at the first sample at which

        gate 1    t - t_a >= k window                 (rounded to the nearest sample)
        gate 2    |angle - angle_a| >= k window       (less 1e-9 window, so that the last bit does not decide)

    Boundaries are counted from the gate, not from the window before: their errors do not add up.  Of the
    samples x_0 (at the start) ... x_n (at the end) of a window

        mean = sum of h_j (x_{j-1} + x_j) / 2, j = 1..n, divided by t_end - t_start     (trapezoid)
             = sum of h_j x_j, divided by t_end - t_start, where x is the mean over the step that ends (integrated = 1)
        std  = standard deviation (n - 1) of x_1 ... x_n about their arithmetic mean

    both summed as differences from x_0, so that millions of samples of a nearly constant signal lose nothing.
    n is the number of steps, `flagged` the number of samples 1..n with flag != 0, `count` the number of windows
    completed since the start.  A gate that closes, changes its kind or its phase drops the unfinished window.

    One sample is one communication step (`step` is large for that reason).  Whole numbers are Real signals.

    With integrated = 1 the mean of counts per step is the difference of the counts at the ends of the window, exactly.

    Not modelled: anti-alias filter, dead time and quantization of a real integrating meter.
    """

    version = "1.1.0"

    step = Parameter(1e9, "s", "largest internal step: one sample for each communication step", above=0.0)
    integrated = Parameter(False, bool, "1: the signal is its mean over the step that ends; 0: its value at the sample")

    x = Input(0.0, "1", "signal")
    angle = Input(0.0, "rad", "table angle, cumulative")
    gate = Input(0.0, "1", "0 closed, 1 windows by time, 2 windows by angle")
    window = Input(1.0, "1", "window length, s or rad by gate")
    phase = Input(0.0, "1", "running phase")
    flag = Input(0.0, "1", "other than 0: the sample is suspect")

    count = Output("1", "windows completed since the start")
    mean = Output("1", "mean of the last window")
    std = Output("1", "standard deviation of the samples of the last window")
    n = Output("1", "number of steps in the last window")
    angle_start = Output("rad", "angle at the start of the last window")
    angle_end = Output("rad", "angle at its end")
    t_start = Output("s", "time at the start of the last window")
    t_end = Output("s", "time at its end")
    window_phase = Output("1", "phase of the last window")
    flagged = Output("1", "flagged samples in the last window")

    # the window being filled
    kind = Discrete(0.0, "1", "gate of the windows being taken; 0: none")
    part = Discrete(0.0, "1", "phase of the windows being taken")
    number = Discrete(0.0, "1", "window since the gate opened, from 1")
    t_open = Discrete(0.0, "s", "time at which the gate opened")
    angle_open = Discrete(0.0, "rad", "angle at which the gate opened")
    t_0 = Discrete(0.0, "s", "start of the window")
    angle_0 = Discrete(0.0, "rad", "angle there")
    x_0 = Discrete(0.0, "1", "signal there")
    before = Discrete(0.0, "1", "x - x_0 of the sample before")
    area = Discrete(0.0, "1", "integral of x - x_0")
    total = Discrete(0.0, "1", "sum of x - x_0")
    squares = Discrete(0.0, "1", "sum of (x - x_0)2")
    steps = Discrete(0.0, "1", "steps so far")
    suspect = Discrete(0.0, "1", "flagged samples so far")
    # the last one completed
    r_count = Discrete(0.0, "1", "windows completed")
    r_mean = Discrete(0.0, "1", "mean")
    r_std = Discrete(0.0, "1", "standard deviation")
    r_n = Discrete(0.0, "1", "steps")
    r_angle_start = Discrete(0.0, "rad", "first angle")
    r_angle_end = Discrete(0.0, "rad", "last angle")
    r_t_start = Discrete(0.0, "s", "first time")
    r_t_end = Discrete(0.0, "s", "last time")
    r_phase = Discrete(0.0, "1", "phase")
    r_flagged = Discrete(0.0, "1", "flagged samples")

    def begin(self) -> None:
        """A window begins with this sample."""
        self.t_0 = self.t
        self.angle_0 = self.angle
        self.x_0 = self.x
        self.before = 0.0
        self.area = 0.0
        self.total = 0.0
        self.squares = 0.0
        self.steps = 0.0
        self.suspect = 0.0

    @sampled(every=1)
    def tick(self) -> None:
        if self.gate == 0.0:
            self.kind = 0.0
        elif self.gate != self.kind or self.phase != self.part:
            self.refuse(
                not (self.gate == 1.0 or self.gate == 2.0),
                "gate = {gate} must be 0 closed, 1 windows by time or 2 windows by angle",
            )
            self.refuse(self.window <= 0.0, "window = {window} must be above 0 (s for gate 1, rad for gate 2)")
            self.refuse(
                self.gate == 1.0 and self.window < 4.0 * self.h, "window = {window} s is shorter than four steps"
            )
            self.kind = self.gate
            self.part = self.phase
            self.number = 1.0
            self.t_open = self.t
            self.angle_open = self.angle
            self.begin()
        else:
            d = self.x - self.x_0
            self.area = self.area + (self.h * d if self.integrated else 0.5 * self.h * (self.before + d))
            self.before = d
            self.total = self.total + d
            self.squares = self.squares + d * d
            self.steps = self.steps + 1.0
            if self.flag != 0.0:
                self.suspect = self.suspect + 1.0
            if self.kind == 1.0:
                reached = self.t - self.t_open > self.number * self.window - 0.5 * self.h
            else:
                reached = fabs(self.angle - self.angle_open) >= (self.number - 1e-9) * self.window
            if reached:
                self.r_count = self.r_count + 1.0
                self.r_mean = self.x_0 + self.area / (self.t - self.t_0)
                self.r_std = 0.0
                if self.steps > 1.0:
                    spread = self.squares - self.total * self.total / self.steps
                    self.r_std = sqrt(maximum(spread, 0.0) / (self.steps - 1.0))
                self.r_n = self.steps
                self.r_angle_start = self.angle_0
                self.r_angle_end = self.angle
                self.r_t_start = self.t_0
                self.r_t_end = self.t
                self.r_phase = self.part
                self.r_flagged = self.suspect
                self.number = self.number + 1.0
                self.begin()

    def outputs(self) -> None:
        self.count = self.r_count
        self.mean = self.r_mean
        self.std = self.r_std
        self.n = self.r_n
        self.angle_start = self.r_angle_start
        self.angle_end = self.r_angle_end
        self.t_start = self.r_t_start
        self.t_end = self.r_t_end
        self.window_phase = self.r_phase
        self.flagged = self.r_flagged
