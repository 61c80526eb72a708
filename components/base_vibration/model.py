from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Noise, Output, Parameter, sampled
from gyrobench.component.math import (
    Number,
    Vector,
    atan2,
    cos,
    exp,
    floor,
    index,
    log,
    maximum,
    minimum,
    pi,
    sin,
    sqrt,
    vector,
)

LINES = 48  # sines of each axis
POINTS = 24  # of a spectrum
PARTS = 8  # of a band
PEAKED = 2.0  # times the mean power of a part is in one: the sine stands where the power is
HALVES = 30  # of a band, for its place
GOLDEN = 0.6180339887498949
REST = [0.0] * (POINTS - 2)
NONE = [0.0, 0.0, 0.0]
HALF = [0.0] * 24


class BaseVibration(Component):
    """Vibration of a base by power spectral densities, added to it: angular rate and acceleration.  [BASE-PSD]

    omega = omega_b + w n(t),  alpha = alpha_b + d/dt w n(t),  f = f_b + w a(t)          w rises from 0 to 1 in onset

    Each of the three components of n and of a is a sum of 48 sines.  The band from the first to the last frequency is
    cut into 48 of equal ratio; each has one sine of the power of its band, int S df, at a place within it that does not
    repeat, with a phase by the seed of the run; in a band with a peak, a place in its power: the sine is in the peak.
    Between its points S goes straight in logarithms.  So the mean square is the spectrum's in every band, and over a
    long time the same for every seed.

    It begins where the number of the running phase is `first`, and lasts to the end.

    Not modelled: correlation between axes, peaks in time other than a Gaussian process has, lines of a rotor (give a
    narrow band), the small angle of the vibration in f.
    Source: Shinozuka 1991 (sum of cosines with random phases).
    """

    version = "1.1.0"
    long_loops = True

    step = Parameter(1e9, "s", "largest internal step: one sample for each communication step", above=0.0)
    points = Parameter(2, int, "points of the spectra; 0: no vibration", min=0, max=POINTS)
    frequency = Parameter([1.0, 100.0, *REST], "Hz", "their frequencies, rising", min=0.0)
    rate_psd = Parameter(
        [[1e-6, 1e-6, *REST]] * 3, "rad2/s2/Hz", "one-sided density of the angular rate about x, y, z", min=0.0
    )
    acceleration_psd = Parameter(
        [[0.0] * POINTS] * 3, "m2/s4/Hz", "one-sided density of the acceleration along x, y, z", min=0.0
    )
    scale = Parameter(1.0, "1", "factor on rates and accelerations", min=0.0)
    first = Parameter(0, int, "number of the phase in which it begins; 0: at the start", min=0)
    onset = Parameter(1.0, "s", "time in which it fades in", min=0.0)
    phases = Noise(1.0, "1", "1: phases by the seed", per="start", samples=12 * LINES)

    phase = Input(0.0, "1", "number of the running phase")
    omega_b = Input(NONE, "rad/s", "inertial rate of the base without vibration, base axes")
    alpha_b = Input(NONE, "rad/s2", "its derivative")
    f_b = Input([0.0, 0.0, 9.80665], "m/s2", "specific force without vibration, base axes")

    omega = Output("rad/s", "inertial rate of the base, base axes", shape=(3,))
    alpha = Output("rad/s2", "its derivative", shape=(3,))
    f = Output("m/s2", "specific force of the base, base axes", shape=(3,))

    x = Discrete([[0.0] * LINES] * 6, "1", "sines: their values, rates of x, y, z, then accelerations")
    y = Discrete([[0.0] * LINES] * 6, "1", "sines: a quarter of a period ahead")
    w = Discrete([[0.0] * LINES] * 6, "rad/s", "sines: frequencies")
    turn_c = Discrete([[0.0] * LINES] * 6, "1", "sines: cosine of what they turn in a step")
    turn_s = Discrete([[0.0] * LINES] * 6, "1", "sines: sine of it")
    active = Discrete([0.0] * 6, "1", "1: the spectrum is not 0")
    h_turned = Discrete(0.0, "s", "step of turn_c and turn_s")
    since = Discrete(-1.0, "s", "time at which it began; -1: not yet")
    sums = Discrete([0.0] * 6, "1", "sums of the sines")
    slopes = Discrete([0.0] * 6, "1/s", "their derivatives")
    bad_point = Discrete(0.0, "1", "point under check")

    def start(self) -> None:
        self.refuse(self.points == 1.0, "a spectrum needs 2 points or more, points = {points}")
        for k in range(index(self.points)):
            self.bad_point = k + 1.0
            low = self.frequency[index(k - 1.0)] if k > 0 else 0.0
            self.refuse(
                self.frequency[k] <= low, "frequency of point {bad_point} must be above that of the one before, and 0"
            )
        if self.points > 0.0:
            for n in range(6):
                self.draw(n)
        if self.first == 0.0:
            self.since = self.t
        self.add()

    def draw(self, n: Number) -> None:
        """Choose the sines of one spectrum: 0 to 2 rates, 3 to 5 accelerations."""
        top = log(self.frequency[index(self.points - 1.0)] / self.frequency[0])
        for k in range(LINES):
            low = self.frequency[0] * exp(top * k / LINES)
            high = self.frequency[0] * exp(top * (k + 1.0) / LINES)
            power = self.between(n, low, high)
            place = GOLDEN * (LINES * n + k + 1.0)
            share = place - floor(place)
            f = self.frequency[0] * exp(top * (k + share) / LINES)
            peaked = 0.0
            for j in range(PARTS):
                begin = low + (high - low) * j / PARTS
                if self.between(n, begin, begin + (high - low) / PARTS) > PEAKED * power / PARTS:
                    peaked = 1.0
            if peaked > 0.0:
                below = low
                above = high
                for _ in range(HALVES):
                    f = 0.5 * (below + above)
                    if self.between(n, low, f) < share * power:
                        below = f
                    else:
                        above = f
            size = self.scale * sqrt(2.0 * power)
            number = 2.0 * (LINES * n + k)
            angle = atan2(self.noise.phases[index(number)], self.noise.phases[index(number + 1.0)])
            self.w[index(n)][k] = 2.0 * pi * f
            self.x[index(n)][k] = size * cos(angle)
            self.y[index(n)][k] = size * sin(angle)
            if power > 0.0:
                self.active[index(n)] = 1.0

    def at(self, n: Number, k: Number) -> Number:
        """Return the density of a point."""
        return self.rate_psd[index(n)][index(k)] if n < 3.0 else self.acceleration_psd[index(n - 3.0)][index(k)]

    def between(self, n: Number, low: Number, high: Number) -> Number:
        """Return the power from low to high: S = a (f / f_k)^p, or straight in log f next to a 0, in closed form."""
        found = 0.0
        for k in range(POINTS - 1):
            if k + 1 < self.points and high > self.frequency[k] and low < self.frequency[k + 1]:
                a = self.at(n, 1.0 * k)
                b = self.at(n, k + 1.0)
                x = maximum(low, self.frequency[k])
                y = minimum(high, self.frequency[k + 1])
                whole = log(self.frequency[k + 1] / self.frequency[k])
                ahead = log(x / self.frequency[k])
                wide = log(y / x)
                if a > 0.0 and b > 0.0:
                    p = log(b / a) / whole
                    turn = (p + 1.0) * wide
                    mean = 1.0 + 0.5 * turn
                    if turn * turn > 1e-10:
                        mean = (exp(turn) - 1.0) / turn
                    found = found + a * exp(p * ahead) * x * wide * mean
                else:
                    slope = (b - a) / whole
                    found = found + y * (a + slope * (ahead + wide - 1.0)) - x * (a + slope * (ahead - 1.0))
        return found

    def add(self) -> None:
        """Sum the sines at the present instant: both halves together, then the halves of that, then four."""
        value = vector(HALF)
        slope = vector(HALF)
        for n in range(6):
            self.sums[n] = 0.0
            self.slopes[n] = 0.0
            if self.active[n] > 0.0:
                for k in range(24):
                    value[k] = self.x[n][k] + self.x[n][k + 24]
                    slope[k] = self.w[n][k] * self.y[n][k] + self.w[n][k + 24] * self.y[n][k + 24]
                for k in range(12):
                    value[k] = value[k] + value[k + 12]
                    slope[k] = slope[k] + slope[k + 12]
                for k in range(4):
                    value[k] = value[k] + value[k + 4] + value[k + 8]
                    slope[k] = slope[k] + slope[k + 4] + slope[k + 8]
                self.sums[n] = (value[0] + value[2]) + (value[1] + value[3])
                self.slopes[n] = -((slope[0] + slope[2]) + (slope[1] + slope[3]))

    @sampled(every=1)
    def tick(self) -> None:
        if self.since < 0.0:
            if self.phase >= self.first:
                self.since = self.t
        elif self.points > 0.0:
            if self.h != self.h_turned:
                self.h_turned = self.h
                for n in range(6):
                    for k in range(LINES):
                        self.turn_c[n][k] = cos(self.w[n][k] * self.h)
                        self.turn_s[n][k] = sin(self.w[n][k] * self.h)
            for n in range(6):
                if self.active[n] > 0.0:
                    for k in range(LINES):
                        x = self.x[n][k]
                        self.x[n][k] = x * self.turn_c[n][k] - self.y[n][k] * self.turn_s[n][k]
                        self.y[n][k] = self.y[n][k] * self.turn_c[n][k] + x * self.turn_s[n][k]
            self.add()

    def weight(self) -> Vector:
        """Return how far the vibration has faded in, and the derivative of it."""
        if self.since < 0.0:
            return vector([0.0, 0.0])
        if self.t - self.since >= self.onset:
            return vector([1.0, 0.0])
        turn = pi / self.onset
        at = turn * (self.t - self.since)
        return vector([0.5 - 0.5 * cos(at), 0.5 * turn * sin(at)])

    def outputs(self) -> None:
        w = self.weight()
        for n in range(3):
            self.omega[n] = self.omega_b[n] + w[0] * self.sums[n]
            self.alpha[n] = self.alpha_b[n] + w[0] * self.slopes[n] + w[1] * self.sums[n]
            self.f[n] = self.f_b[n] + w[0] * self.sums[index(n + 3.0)]
