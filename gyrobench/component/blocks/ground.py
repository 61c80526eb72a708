"""Motion of the ground that a stand rests on."""

from __future__ import annotations

from gyrobench.component.composition import Block, sampled
from gyrobench.component.declarations import Discrete, Noise, Parameter
from gyrobench.component.math import cos, exp, pi, sin, sqrt


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
