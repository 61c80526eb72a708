from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Output, Parameter, sampled
from gyrobench.component.blocks.recorded_path import parabola, quintic
from gyrobench.component.math import Number, Vector, cos, floor, index, log, pi, sin, sqrt, vector

DEG = pi / 180.0
LINES = 8  # sines of a preset, for each angle and for the heave
TURNS = 64.0  # steps in which they turn before they are made anew
GOLDEN = 0.6180339887498949
ZEROS = [0.0, 0.0, 0.0]
FOUR = [0.0] * 4
PROFILE = 9.0  # preset


def four(x: Vector) -> Number:
    """Return the sum of four numbers."""
    return (x[0] + x[2]) + (x[1] + x[3])


class BaseMotion(Component):
    """Rotation of a base: angles, inertial rate, angular acceleration and specific force that belong together.

    [DECOUPLE-BENCH-83MIL, PLATFORM-3AXIS-KIN]  Axes x right, y forward, z up; pitch p about x, roll r about y,
    heading h about z, counter-clockwise from above.  The base turns heading first, then pitch, then roll:

        v_base = R2(r) R1(p) R3(h) v_ENU          (passive rotations, CONV-GIMBALS)

        omega = ( cr p' - sr cp h',  r' + sp h',  sr p' + cr cp h' ) + C w_earth
        alpha = its derivative, exact          f = C (0, 0, g + heave)

    Each angle and the heave is a sum of: the input (the exciter's, one axis at a time), four sines of the user's own,
    and one preset.

    Presets 1 sea state 3, 2 sea state 5, 3 sea state 6, 4 aircraft in light turbulence, 5 in moderate turbulence: each
    angle is a sum of 8 sines of equal power, at the octiles' middles of the spectrum S(w) ~ w^-5 exp(-1.25 (wm/w)^4)
    (shape of Pierson and Moskowitz, w_k = wm (1.25 / -ln((k - 1/2)/8))^(1/4)), phases fixed, so that a run repeats.
    Its rms and modal periods are our own assumptions of a typical size (see the README), from no source.  These
    sines are pointers that turn by w h a step and are made anew every 64th, which keeps their rounding below 1e-13.

    Preset 9: a recorded profile, `points` instants with three angles.  Between them the quintic that has at each
    point the slope and curvature of the parabola through it and its neighbours: angle, rate and acceleration are
    continuous.  Before the first and after the last point the base rests; both ends have rate 0.

    Not modelled: lever arms, vibration, correlation between the axes, change of latitude.
    """

    version = "1.0.0"
    long_loops = True

    step = Parameter(1e9, "s", "largest internal step: one sample for each communication step", above=0.0)
    latitude = Parameter(0.7, "rad", "geographic latitude (for the Earth rate)", min=-1.5708, max=1.5708)
    earth_rate = Parameter(0.0, "rad/s", "Earth rate; 0: none, 7.2921159e-5: of the Earth", min=0.0)
    gravity = Parameter(9.80665, "m/s2", "local gravity", above=0.0)
    amplitude = Parameter([[0.0, 0.0, 0.0, 0.0]] * 3, "rad", "own sines of pitch, roll, heading: amplitudes")
    frequency = Parameter([[1.0, 1.0, 1.0, 1.0]] * 3, "Hz", "their frequencies", min=0.0)
    phase = Parameter([[0.0, 0.0, 0.0, 0.0]] * 3, "rad", "their phases at t = 0")
    preset = Parameter(0, int, "0 none, 1..3 sea, 4, 5 aircraft, 9 recorded profile", min=0, max=9)
    scale = Parameter(1.0, "1", "factor on the preset's angles and heave", min=0.0)
    points = Parameter(0, int, "number of points of the recorded profile", min=0, max=400)
    onset = Parameter(5.0, "s", "time in which the sines fade in, so that the base begins at rest", min=0.0)
    profile_t = Parameter([0.0] * 400, "s", "recorded profile: times, rising")
    profile = Parameter([ZEROS] * 400, "rad", "recorded profile: pitch, roll, heading")

    motion_angle = Input(ZEROS, "rad", "rotation to be added: pitch, roll, heading")
    motion_rate = Input(ZEROS, "rad/s", "its rate")
    motion_acceleration = Input(ZEROS, "rad/s2", "its acceleration")

    angle = Output("rad", "pitch about x, roll about y, heading about z", shape=(3,))
    omega = Output("rad/s", "inertial rate of the base, base axes", shape=(3,))
    alpha = Output("rad/s2", "angular acceleration of the base, base axes", shape=(3,))
    f = Output("m/s2", "specific force of the base, base axes", shape=(3,))

    line_a = Discrete([[0.0] * 8] * 4, "1", "sines of the preset: amplitudes")
    line_w = Discrete([[0.0] * 8] * 4, "rad/s", "sines of the preset: frequencies")
    line_p = Discrete([[0.0] * 8] * 4, "rad", "sines of the preset: phases")
    x = Discrete([[0.0] * 8] * 4, "1", "sines of the preset: their values")
    y = Discrete([[0.0] * 8] * 4, "1", "sines of the preset: a quarter of a period ahead")
    turn_c = Discrete([[0.0] * 8] * 4, "1", "sines of the preset: cosine of what they turn in a step")
    turn_s = Discrete([[0.0] * 8] * 4, "1", "sines of the preset: sine of it")
    h_turned = Discrete(0.0, "s", "step of turn_c and turn_s")
    turned = Discrete(0.0, "1", "steps since the sines were made anew")
    earth_north = Discrete(0.0, "rad/s", "Earth rate towards north")
    earth_up = Discrete(0.0, "rad/s", "Earth rate upwards")
    own = Discrete(0.0, "1", "1 while there are sines of the user's own")
    lines = Discrete(0.0, "1", "1 while there is a preset of sines")
    piece = Discrete(0.0, "1", "point of the profile that was passed last, from 0; -1 before the first")
    bad_point = Discrete(0.0, "1", "point under check")

    def start(self) -> None:
        # rms of pitch, roll, heading (deg) and heave (m/s2); modal periods of their spectra (s); see the README
        rms = [
            [0.5, 1.5, 0.3, 0.2],
            [1.0, 4.0, 0.8, 0.5],
            [1.8, 8.0, 1.5, 1.0],
            [0.3, 0.6, 0.3, 0.4],
            [1.0, 2.0, 1.0, 1.5],
        ]
        period = [
            [6.0, 9.0, 12.0, 6.0],
            [7.0, 10.0, 14.0, 7.0],
            [8.0, 11.0, 16.0, 8.0],
            [3.0, 5.0, 6.0, 1.5],
            [2.5, 4.0, 5.0, 1.0],
        ]
        known = self.preset <= 5.0 or self.preset == PROFILE
        self.refuse(not known, "preset = {preset}: presets are 0 none, 1..3 sea, 4, 5 aircraft, 9 recorded profile")
        self.own = 0.0
        for i in range(3):
            for k in range(4):
                if self.amplitude[i][k] != 0.0:
                    self.own = 1.0
        self.lines = 1.0 if self.preset > 0.0 and self.preset <= 5.0 else 0.0
        for i in range(4):
            for k in range(LINES):
                if self.lines > 0.0:
                    unit = 1.0 if i == 3 else DEG
                    power = (k + 0.5) / LINES
                    shift = GOLDEN * (LINES * i + k + 1.0)
                    self.line_a[i][k] = self.scale * unit * rms[index(self.preset - 1.0)][i] * sqrt(2.0 / LINES)
                    mode = 2.0 * pi / period[index(self.preset - 1.0)][i]
                    self.line_w[i][k] = mode * sqrt(sqrt(-1.25 / log(power)))
                    self.line_p[i][k] = 2.0 * pi * (shift - floor(shift))
        self.make()
        self.earth_north = self.earth_rate * cos(self.latitude)
        self.earth_up = self.earth_rate * sin(self.latitude)
        self.piece = -1.0
        if self.preset == PROFILE:
            self.refuse(self.points < 3.0, "a recorded profile needs 3 points or more, points = {points}")
            for k in range(index(self.points)):
                if k > 0:
                    self.bad_point = k + 1.0
                    self.refuse(
                        self.profile_t[k] <= self.profile_t[index(k - 1.0)],
                        "recorded profile: the time of point {bad_point} is not after that of the point before it",
                    )
                if self.profile_t[k] <= self.t:
                    self.piece = k

    def make(self) -> None:
        """Make the sines of the preset for the present instant."""
        self.turned = 0.0
        for i in range(4):
            for k in range(LINES):
                self.x[i][k] = sin(self.line_w[i][k] * self.t + self.line_p[i][k])
                self.y[i][k] = cos(self.line_w[i][k] * self.t + self.line_p[i][k])

    def turn(self) -> None:
        """Turn the sines of the preset by the step."""
        if self.h != self.h_turned:
            self.h_turned = self.h
            for i in range(4):
                for k in range(LINES):
                    self.turn_c[i][k] = cos(self.line_w[i][k] * self.h)
                    self.turn_s[i][k] = sin(self.line_w[i][k] * self.h)
        self.turned = self.turned + 1.0
        for i in range(4):
            for k in range(LINES):
                x = self.x[i][k]
                self.x[i][k] = x * self.turn_c[i][k] + self.y[i][k] * self.turn_s[i][k]
                self.y[i][k] = self.y[i][k] * self.turn_c[i][k] - x * self.turn_s[i][k]

    @sampled(every=1)
    def tick(self) -> None:
        if self.lines > 0.0:
            if self.turned < TURNS:
                self.turn()
            else:
                self.make()
        between = self.preset == PROFILE and self.piece < self.points - 1.0
        if between and self.t >= self.profile_t[index(self.piece + 1.0)]:
            for k in range(index(self.points)):
                if self.profile_t[k] <= self.t:
                    self.piece = k

    def bend(self, k: Number, i: Number) -> Vector:
        """Return slope and curvature of angle i at a point of the profile; 0 at both ends."""
        if k <= 0.0 or k >= self.points - 1.0:
            return vector([0.0, 0.0])
        before = self.profile_t[index(k)] - self.profile_t[index(k - 1.0)]
        after = self.profile_t[index(k + 1.0)] - self.profile_t[index(k)]
        p0 = self.profile[index(k - 1.0)][index(i)]
        p1 = self.profile[index(k)][index(i)]
        return parabola(before, after, p0, p1, self.profile[index(k + 1.0)][index(i)])

    def wave(self, amplitude: Number, rate: Number, phase: Number) -> Vector:
        """Return a sine at the present instant and its two derivatives."""
        s = amplitude * sin(rate * self.t + phase)
        return vector([s, rate * (amplitude * cos(rate * self.t + phase)), -(rate * rate * s)])

    def waves(self, i: Number) -> Vector:
        """Return the sum of the sines of the preset in one angle or the heave, and its two derivatives."""
        value = vector(FOUR)  # of two sines each
        slope = vector(FOUR)
        curve = vector(FOUR)
        for k in range(4):
            first = self.line_a[index(i)][k] * self.x[index(i)][k]
            last = self.line_a[index(i)][k + 4] * self.x[index(i)][k + 4]
            value[k] = first + last
            w1 = self.line_w[index(i)][k]
            w2 = self.line_w[index(i)][k + 4]
            rate = w1 * (self.line_a[index(i)][k] * self.y[index(i)][k])
            slope[k] = rate + w2 * (self.line_a[index(i)][k + 4] * self.y[index(i)][k + 4])
            curve[k] = -(w1 * (w1 * first) + w2 * (w2 * last))
        return vector([four(value), four(slope), four(curve)])

    def outputs(self) -> None:
        q = vector(ZEROS)  # pitch, roll, heading; rates; accelerations
        v = vector(ZEROS)
        a = vector(ZEROS)
        w = 1.0  # onset, and its derivatives
        wv = 0.0
        wa = 0.0
        if self.onset > 0.0 and self.t < self.onset:
            turn = pi / self.onset
            w = 0.5 - 0.5 * cos(turn * self.t)
            wv = 0.5 * turn * sin(turn * self.t)
            wa = 0.5 * turn * turn * cos(turn * self.t)
        heave = 0.0
        for i in range(3):
            y = vector(ZEROS)  # sum of the sines and its derivatives
            if self.own > 0.0:
                for k in range(4):
                    y = y + self.wave(self.amplitude[i][k], 2.0 * pi * self.frequency[i][k], self.phase[i][k])
            if self.lines > 0.0:
                y = y + self.waves(i)
            q[i] = self.motion_angle[i] + w * y[0]
            v[i] = self.motion_rate[i] + wv * y[0] + w * y[1]
            a[i] = self.motion_acceleration[i] + wa * y[0] + 2.0 * wv * y[1] + w * y[2]
        if self.lines > 0.0:
            swell = self.waves(3.0)
            heave = w * swell[0]
        if self.preset == PROFILE:
            if self.piece < 0.0 or self.piece >= self.points - 1.0:
                end = self.piece if self.piece >= 0.0 else 0.0
                q = q + self.scale * self.profile[index(end)]
            else:  # quintic between two points, of their slopes and curvatures
                d = self.profile_t[index(self.piece + 1.0)] - self.profile_t[index(self.piece)]
                x = (self.t - self.profile_t[index(self.piece)]) / d
                for i in range(3):
                    first = self.bend(self.piece, i)
                    last = self.bend(self.piece + 1.0, i)
                    p0 = self.profile[index(self.piece)][i]
                    end = self.profile[index(self.piece + 1.0)][i]
                    y = quintic(x, d, p0, end, first[0], first[1], last[0], last[1])
                    q[i] = q[i] + self.scale * y[0]
                    v[i] = v[i] + self.scale * y[1]
                    a[i] = a[i] + self.scale * y[2]
        sp = sin(q[0])
        cp = cos(q[0])
        sr = sin(q[1])
        cr = cos(q[1])
        sh = sin(q[2])
        ch = cos(q[2])
        g = self.gravity + heave
        north = self.earth_north
        up = self.earth_up
        # C = R2(roll) R1(pitch) R3(heading): its columns N and U
        east = (cr * sh + sr * sp * ch) * north - sr * cp * up
        earth = vector([east, cp * ch * north + sp * up, (sr * sh - cr * sp * ch) * north + cr * cp * up])
        rel = vector([cr * v[0] - sr * cp * v[2], v[1] + sp * v[2], sr * v[0] + cr * cp * v[2]])
        self.alpha[0] = cr * a[0] - sr * cp * a[2] - v[1] * rel[2] + sr * sp * v[0] * v[2]
        self.alpha[1] = a[1] + sp * a[2] + cp * v[0] * v[2]
        self.alpha[2] = sr * a[0] + cr * cp * a[2] + v[1] * rel[0] - cr * sp * v[0] * v[2]
        # the Earth rate turns against the base: -rel x earth
        self.alpha[0] = self.alpha[0] - rel[1] * earth[2] + rel[2] * earth[1]
        self.alpha[1] = self.alpha[1] - rel[2] * earth[0] + rel[0] * earth[2]
        self.alpha[2] = self.alpha[2] - rel[0] * earth[1] + rel[1] * earth[0]
        self.angle = q
        self.omega = rel + earth
        self.f = vector([-sr * cp * g, sp * g, cr * cp * g])
