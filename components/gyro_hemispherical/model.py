from __future__ import annotations

from typing import ClassVar

from gyrobench.component import Discrete, Noise, Output, Parameter, sampled
from gyrobench.component.blocks.rate_gyro import AngleCounter, RateGyro
from gyrobench.component.math import Number, cos, exp, pi, sin, tan, vector


class GyroHemispherical(RateGyro):
    """Two-axis hemispherical resonator gyro in whole-angle mode: two resonators of one make, their slow variables.

        pattern angle theta (of order 2, alpha = 2 theta), quadrature q over the amplitude, which is held at 1
        alpha' = -2 k w + D/2 sin 2(alpha - alpha_d) (1 + q2)/(1 - q2) + F cos 2(alpha - alpha_f) q/(1 - q2)
                 + tan(drive_angle) G + quadrature_gain sin(quadrature_phase) q
        q'     = -(1/tau + quadrature_gain cos(quadrature_phase)) q + D/2 cos 2(alpha - alpha_d) q
                 - F/2 sin 2(alpha - alpha_f)
        G      = 1/tau + D/2 cos 2(alpha - alpha_d) - F/2 sin 2(alpha - alpha_f) q
        k: gain (Bryan factor), D: damping_difference, F: 2 pi frequency_difference, w: scaled rate + drift + white
        alpha_read = alpha - readout_mismatch/2 sin 2 alpha;   rate = -(change of alpha_read) / (2 k h)

    [GYRO-WHOLE-ANGLE].  Below threshold = D/(4 k) a rate that nothing compensates is caught: the pattern rests at an
    axis of damping, as a ring laser locks; above it the mean rate is sign(w) sqrt(w2 - threshold2).
    Refused: a quadrature of half the amplitude or more, that is a frequency difference that the loop does not hold.
    Not modelled: the carrier, amplitude and phase loops (ideal), virtual rotation and self-calibration, saturation of
    the forces, elastic nonlinearity, support losses by vibration.
    Source: Lynch 1995; IEEE 1431; derivation in GYRO-WHOLE-ANGLE.
    """

    version = "1.0.0"
    unrounded: ClassVar[dict[str, float]] = {"resolution": 0.0}
    white_noise = "white"

    gain = Parameter(0.277, "1", "Bryan factor k: turn of the pattern over that of the body", above=0.0, max=1.0)
    tau = Parameter(400.0, "s", "time constant of the vibration, mean of the axes of damping", above=0.0)
    damping_difference = Parameter(1e-5, "1/s", "difference of 1/tau of the axes of damping, D", min=0.0)
    damping_axis = Parameter([0.1, 0.2], "rad", "pattern angle of the axis of larger damping, of x and y")
    frequency_difference = Parameter(1e-3, "Hz", "difference of the frequencies of the axes of stiffness", min=0.0)
    frequency_axis = Parameter([0.3, 0.4], "rad", "pattern angle of the axis of larger frequency, of x and y")
    quadrature_gain = Parameter(1.0, "1/s", "gain of the quadrature loop", min=0.0)
    quadrature_phase = Parameter(0.0, "rad", "phase error of the force of the quadrature loop", min=-1.0, max=1.0)
    drive_angle = Parameter(0.0, "rad", "angle of the drive force from the pattern, of alpha", min=-0.5, max=0.5)
    readout_mismatch = Parameter(0.0, "1", "relative difference of the gains of the two readouts", min=-0.1, max=0.1)
    angle = Parameter([0.0, 0.0], "rad", "pattern angle at the start, of x and y")
    white = Noise(1e-7, "rad/s/sqrt(Hz)", "white noise density N", samples=2)
    range_max = Parameter(0.0, "rad/s", "largest rate; 0: no limit", min=0.0)
    resolution = Parameter(0.0, "rad", "angle of an output count; 0: none", min=0.0)
    counter = AngleCounter(size="resolution", rate="measured")

    pattern = Output("rad", "pattern angle theta of x and y", shape=(2,))
    threshold = Output("rad/s", "rate below which the pattern is caught without compensation")
    density = Output("rad/s/sqrt(Hz)", "density N of the white noise (angle random walk)")

    alpha = Discrete([0.0, 0.0], "rad", "twice the pattern angle")
    q = Discrete([0.0, 0.0], "1", "quadrature over the amplitude")
    damping = Discrete([[1.0, 0.0], [1.0, 0.0]], "1", "rows: cosine and sine of 2 alpha_d, of x and y")
    stiffness = Discrete([[1.0, 0.0], [1.0, 0.0]], "1", "rows: cosine and sine of 2 alpha_f, of x and y")
    misread = Discrete([0.0, 0.0], "rad", "what the mismatch takes off the reading of alpha")
    length = Discrete(0.0, "s", "internal step of the decay")
    decay = Discrete(1.0, "1", "decay of the quadrature in an internal step")

    def start(self) -> None:
        for j in range(2):
            self.alpha[j] = 2.0 * self.angle[j]
            self.damping[j] = vector([cos(4.0 * self.damping_axis[j]), sin(4.0 * self.damping_axis[j])])
            self.stiffness[j] = vector([cos(4.0 * self.frequency_axis[j]), sin(4.0 * self.frequency_axis[j])])
            beta = 4.0 * (self.angle[j] - self.frequency_axis[j])
            self.q[j] = -pi * self.frequency_difference * sin(beta) / self.held()
            self.misread[j] = 0.5 * self.readout_mismatch * sin(2.0 * self.alpha[j])

    def held(self) -> Number:
        """Return the rate at which the quadrature decays in its loop."""
        return 1.0 / self.tau + self.quadrature_gain * cos(self.quadrature_phase)

    @sampled(every=1)
    def tick(self) -> None:
        if self.h != self.length:
            self.length = self.h
            self.decay = exp(-self.h * self.held())
        turned = self.scaled(self.mount @ self.omega, self.temperature)
        drift = self.drift_rates(self.temperature)
        rate = self.held()
        pull = tan(self.drive_angle)
        push = self.quadrature_gain * sin(self.quadrature_phase)
        for j in range(2):
            w = turned[j] + drift[j] + self.noise.white[j]
            before = self.alpha[j]
            middle = before - self.gain * w * self.h
            c = cos(2.0 * middle)
            s = sin(2.0 * middle)
            split = pi * self.frequency_difference * (s * self.stiffness[j][0] - c * self.stiffness[j][1])
            along = c * self.stiffness[j][0] + s * self.stiffness[j][1]
            more = 0.5 * self.damping_difference * (c * self.damping[j][0] + s * self.damping[j][1])
            across = s * self.damping[j][0] - c * self.damping[j][1]
            source = more * self.q[j] - split
            later = self.decay * self.q[j] + (1.0 - self.decay) / rate * source
            q = 0.5 * (self.q[j] + later)
            self.q[j] = later
            self.refuse(
                later * later > 0.25,
                "quadrature of half the amplitude: frequency_difference = {frequency_difference} Hz is more than the "
                "quadrature loop holds, quadrature_gain = {quadrature_gain} 1/s",
            )
            drifting = 0.5 * self.damping_difference * across * (1.0 + q * q)
            drifting = drifting + 2.0 * pi * self.frequency_difference * along * q
            force = 1.0 / self.tau + more - split * q
            speed = drifting / (1.0 - q * q) - 2.0 * self.gain * w + pull * force + push * q
            self.alpha[j] = before + self.h * speed
            self.measured[j] = -speed / (2.0 * self.gain)
            if self.readout_mismatch != 0.0:
                misread = 0.5 * self.readout_mismatch * sin(2.0 * self.alpha[j])
                self.measured[j] = self.measured[j] + (misread - self.misread[j]) / (2.0 * self.gain * self.h)
                self.misread[j] = misread
        self.limit(self.range_max)
        self.counter.count()

    def outputs(self) -> None:
        self.pattern = 0.5 * self.alpha
        self.threshold = 0.25 * self.damping_difference / self.gain
        self.density = self.white
