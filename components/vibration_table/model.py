from __future__ import annotations

from gyrobench.component import IDENTITY, Component, Discrete, Input, Noise, Output, Parameter, sampled
from gyrobench.component.math import Vector, clip, cross, dot, exp, fabs, floor, log, pi, sin, sqrt, vector
from gyrobench.component.set_up import each

LINES = 12  # sines
LEANS = ("east", "north", "up")


class VibrationTable(Component):
    """Vibration table (shaker) with a vertical axis: one sine, or noise in a band, at levels.  [TEST-RECTIFICATION]

        s = sqrt(2/n) sum sin(2 pi f_k t + phi_k)                     rms 1; n: sines, 1 or 12
        f = face R(lean)' (f_local + (0, 0, level s)),   omega = face R(lean)' omega_local
        f_control = (1 + read_gain) level s + noise                   control accelerometer, for the rms of the level

    f_k: in equal ratios from `low` to `high`, each at the next odd multiple of 1/repeat; phases by the seed.  Over
    `repeat` the mean of s is 0 and that of s2 is 1, and no two lines add up to a third, so that the mean of s3 is 0,
    too.  level goes to the one asked for, in a straight line within `ramp`.  R(lean): the case is turned on its fixture
    against `face` about this vector by 2 atan |lean|/2, of its own with the axis along the vibration up and down.
    Not modelled: servo and resonances of the table, motion across and about the axis, distortion, limits of its travel.
    Source: IEEE 1293 (vibration rectification); own form.
    """

    version = "1.0.0"

    simulates = (
        each("read_gain", ("table.control.gain",)),
        lambda p: {
            "fixture.lean": {
                f"{way}, about {axis}": float(x)
                for way in ("up", "down") for axis, x in zip(LEANS, p[f"lean_{way}"], strict=True)
            },
            "fixture.cosine": {
                way: 2.0 * (x * x + y * y) / (4.0 + x * x + y * y + z * z)
                for way in ("up", "down") for x, y, z in [map(float, p[f"lean_{way}"])]
            },
        },
    )  # fmt: skip

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    lines = Parameter(LINES, int, "sines: 12, noise in a band; 1: a sine at low", min=1, max=LINES)
    low = Parameter(20.0, "Hz", "lowest frequency", above=0.0)
    high = Parameter(200.0, "Hz", "highest frequency", above=0.0)
    repeat = Parameter(2.0, "s", "time after which the vibration repeats itself", above=0.0)
    ramp = Parameter(0.5, "s", "time in which the level goes to another one", above=0.0)
    read_gain = Parameter(0.0, "1", "relative error of the control accelerometer", min=-0.5, max=0.5)
    lean_up = Parameter([0.0, 0.0, 0.0], "rad", "turn of the case about east, north, up, the axis up")
    lean_down = Parameter([0.0, 0.0, 0.0], "rad", "the same with the axis down")
    control = Noise(1e-3, "m/s2/sqrt(Hz)", "white noise of the control accelerometer (100 ug/sqrt(Hz))")
    phases = Noise(1.0, "1", "1: phases by the seed", per="start", samples=LINES)

    f_local = Input([0.0, 0.0, 9.80665], "m/s2", "specific force at the site, ENU")
    omega_local = Input([0.0, 0.0, 0.0], "rad/s", "Earth rate at the site, ENU")
    face = Input(IDENTITY, "1", "mount: rows are the axes x, y, z of the case in east, north, up")
    level_wanted = Input(0.0, "m/s2", "rms of the vibration asked for")

    omega = Output("rad/s", "inertial rate, axes of the case", shape=(3,))
    f = Output("m/s2", "specific force, axes of the case", shape=(3,))
    f_control = Output("m/s2", "vibration as the control accelerometer reads it")
    level = Output("m/s2", "rms of the vibration")
    angle = Output("rad", "angle of the table about its axis: none")
    in_position = Output("1", "1: there is nowhere to go to")

    w = Discrete([0.0] * LINES, "rad/s", "frequencies")
    phi = Discrete([0.0] * LINES, "rad", "phases")
    s = Discrete(0.0, "1", "vibration of the rms 1")
    now = Discrete(0.0, "m/s2", "level")
    slope = Discrete(0.0, "m/s3", "change of the level")
    goal = Discrete(0.0, "m/s2", "level that it goes to")

    def start(self) -> None:
        self.refuse(self.lines > 1.0 and self.high <= self.low, "high = {high} Hz must be above low = {low} Hz")
        before = -1.0
        for k in range(LINES):
            if k < self.lines:
                share = k / (self.lines - 1.0) if self.lines > 1.0 else 0.0
                f = self.low * exp(share * log(self.high / self.low))
                odd = 2.0 * floor(0.5 * f * self.repeat) + 1.0
                self.refuse(
                    odd <= before, "repeat = {repeat} s: too short to tell the frequencies of the vibration apart"
                )
                before = odd
                self.w[k] = 2.0 * pi * odd / self.repeat
                self.phi[k] = 2.0 * pi * self.noise.phases[k]

    @sampled(every=1)
    def tick(self) -> None:
        if self.level_wanted != self.goal:
            self.goal = self.level_wanted
            self.slope = fabs(self.goal - self.now) / self.ramp
        self.now = self.now + clip(self.goal - self.now, -self.slope * self.h, self.slope * self.h)
        total = 0.0
        if self.now > 0.0:
            for k in range(LINES):
                if k < self.lines:
                    total = total + sin(self.w[k] * self.t + self.phi[k])
        self.s = total * sqrt(2.0 / self.lines)

    def shaken(self) -> Vector:
        """Return the specific force in east, north, up."""
        return vector([self.f_local[0], self.f_local[1], self.f_local[2] + self.now * self.s])

    def seen(self, v: Vector) -> Vector:
        """Return a vector in east, north, up as the leaning case sees it, before `face`."""
        upward = self.face[0][2] + self.face[1][2] + self.face[2][2]
        turn = vector(self.lean_up)
        if upward < 0.0:
            turn = vector(self.lean_down)
        g = 0.5 * turn  # of Gibbs: rational, so that it has derivatives at no lean as well
        return vector(v + 2.0 / (1.0 + dot(g, g)) * cross(g, cross(g, v) - v))

    def outputs(self) -> None:
        self.f = self.face @ self.seen(self.shaken())
        self.omega = self.face @ self.seen(vector(self.omega_local))
        self.f_control = (1.0 + self.read_gain) * self.now * self.s + self.noise.control
        self.level = self.now
        self.angle = 0.0
        self.in_position = 1.0
