"""Place of a stand: specific force and Earth rate of a body at rest, noise of the ground."""

from __future__ import annotations

from gyrobench.component.component import Component
from gyrobench.component.composition import Block, sampled
from gyrobench.component.declarations import Discrete, Noise, Output, Parameter
from gyrobench.component.math import cos, exp, pi, sin, sqrt

A = 6378137.0  # WGS84 semi-major axis, m
F = 1.0 / 298.257223563  # flattening
E2 = F * (2.0 - F)  # first eccentricity squared
GAMMA_E = 9.7803253359  # normal gravity at the equator, m/s2
K = 1.931852652458e-3  # Somigliana's constant
M = 3.449786506841e-3  # omega2 a2 b / GM


class Place(Component):
    """Specific force (0, 0, g) and Earth rate W (0, cos L, sin L) of a body at rest, ENU.  [CONV-FRAMES; TR8350.2]

    g is the measured gravity or, where that is 0, WGS84 normal gravity at latitude and height.
    """

    latitude = Parameter(45.75 * pi / 180.0, "rad", "latitude, north positive", min=-pi / 2, max=pi / 2)
    height = Parameter(0.0, "m", "height above the ellipsoid", min=-11e3, max=100e3)
    gravity = Parameter(0.0, "m/s2", "measured gravity; 0: WGS84 normal gravity", min=0.0)
    earth_rate = Parameter(7.2921159e-5, "rad/s", "Earth rate W", min=0.0)

    f = Output("m/s2", "specific force of a body at rest, ENU", shape=(3,))
    omega = Output("rad/s", "Earth rate, ENU", shape=(3,))
    g = Output("m/s2", "local gravity")

    local_g = Discrete(9.80665, "m/s2", "gravity in use")
    north = Discrete(0.0, "rad/s", "Earth rate, north")
    up = Discrete(0.0, "rad/s", "Earth rate, up")

    def start(self) -> None:
        self.refuse(
            self.gravity != 0.0 and (self.gravity < 9.7 or self.gravity > 9.9),
            "gravity = {gravity} m/s2 must lie in 9.7 to 9.9, or be 0 for WGS84 normal gravity",
        )
        s = sin(self.latitude)
        s2 = s * s
        x = self.height / A
        surface = GAMMA_E * (1.0 + K * s2) / sqrt(1.0 - E2 * s2)
        normal = surface * (1.0 - 2.0 * (1.0 + F + M - 2.0 * F * s2) * x + 3.0 * x * x)
        self.local_g = self.gravity if self.gravity > 0.0 else normal
        self.north = self.earth_rate * cos(self.latitude)
        self.up = self.earth_rate * s

    def outputs(self) -> None:
        self.f[0] = 0.0
        self.f[1] = 0.0
        self.f[2] = self.local_g
        self.omega[0] = 0.0
        self.omega[1] = self.north
        self.omega[2] = self.up
        self.g = self.local_g


class NoisePeak(Block):
    """Noise with a peak in its spectrum: the velocity of an oscillator that white noise drives.  [ENV-DISTURBANCE]

        S(w) = 4 d w0 rms2 w2 / ((w0^2 - w2)^2 + (2 d w0 w)2),   w0 = 2 pi frequency

    two-sided, per rad/s over 2 pi; nothing at frequency 0, so that a mean over a long time is not moved.  The
    oscillator is exact from step to step, its force held over a step: the rms is right to (w0 h)2/12, h the step.  It
    starts with a drawn velocity from its middle.
    """

    suffixes = {"rms": ""}
    rms = Noise(0.0, "m/s2", "rms", per="step")
    frequency = Parameter(0.2, "Hz", "frequency of the peak", above=0.0)
    damping = Parameter(0.3, "1", "its relative width: damping ratio", min=0.01, max=0.9)
    value = Discrete(0.0, "m/s2", "noise")
    swing = Discrete(0.0, "m/s2", "angular frequency times the place of the oscillator")
    h_last = Discrete(0.0, "s", "internal step of the transition")
    keep = Discrete(0.0, "1", "transition of swing and of value: cosine part")
    turn = Discrete(0.0, "1", "sine part")
    lean = Discrete(0.0, "1", "share of the sine part by which the two cosine parts differ")
    push = Discrete(0.0, "1", "innovation of the value")
    shift = Discrete(0.0, "1", "innovation of the swing")

    def __init__(self, what: str, frequency: str, damping: str) -> None:
        """what: "seismic noise along east"; frequency, damping: names of parameters that are shared."""
        super().__init__(
            rms=Noise(0.0, "m/s2", f"rms of the {what}", per="step"), frequency=frequency, damping=damping,
            value=Discrete(0.0, "m/s2", what),
        )  # fmt: skip

    def start(self) -> None:
        self.value = self.noise.rms
        self.swing = 0.0
        self.h_last = 0.0

    @sampled(every=1)
    def tick(self) -> None:
        if self.h != self.h_last:
            w = 2.0 * pi * self.frequency
            self.refuse(
                self.rms > 0.0 and w * self.h > 0.5,
                "{self}: frequency = {frequency} Hz is too high for the step; 2 pi frequency h may be 0.5 at most",
            )
            root = sqrt(1.0 - self.damping * self.damping)
            e = exp(-self.damping * w * self.h)
            self.keep = e * cos(root * w * self.h)
            self.turn = e * sin(root * w * self.h) / root
            self.lean = self.damping * self.turn
            force = sqrt(4.0 * self.damping / (w * self.h))  # of size rms w: sqrt(intensity / h)
            self.push = self.turn * force
            self.shift = (1.0 - self.keep - self.lean) * force
            self.h_last = self.h
        swing = self.swing
        self.swing = (self.keep + self.lean) * swing + self.turn * self.value + self.shift * self.noise.rms
        self.value = (self.keep - self.lean) * self.value - self.turn * swing + self.push * self.noise.rms
