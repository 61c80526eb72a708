from __future__ import annotations

from gyrobench.component import Discrete, Noise, Output, Parameter, sampled
from gyrobench.component.blocks.rate_gyro import AngleCounter, RateGyro, locked
from gyrobench.component.math import cos, exp, fabs, log, maximum, pi, sign, sin, sqrt

DEG = pi / 180.0


class GyroLaser(RateGyro):
    """Two-axis ring laser gyro, two rings of one make: lock-in, dither, counts.  Mean rates, not fringes.  [GYRO-LASER]

        psi' = k (w - lock_in sin psi),   k = 2 pi K,   K = 4 A / (lambda L)                           psi: beat phase
        no dither:   sign(w) sqrt(w2 - lock_in2), 0 within the band
        dither W cos(2 pi f t) of random amplitude, abs(w) < W:  white noise, N2 = lock_in2 / (k sqrt(W2 - w2))
                                                    abs(w) > W:  w - sign(w) lock_in2 / (2 sqrt(w2 - W2))
        w = scaled rate + drift + langmuir (current difference);   a count is an angle of 1 / (K counts)

    abs(W2 - w2) is not taken below W2 (2 pi f / (k W))^(2/3): where the turning points of the dither touch the band the
    two forms above are bounds, no model.
    Refused: area and perimeter of no ring; dither whose amplitude noise leaves the phases of the crossings regular (rms
    of the beat phase below pi).
    Not modelled: fringes (psi itself), dynamic lock-in without noise, mode pulling, the mirrors of the body, heating.
    Source: Aronowitz 1999; IEEE 647; derivation in GYRO-LOCK-IN.
    """

    version = "1.0.0"
    white_noise, without_own_noise = "quantum", {"lock_in": 0.0, "counting": 0.0}

    perimeter = Parameter(0.3, "m", "perimeter of the ring, L", above=0.0)
    area = Parameter(4.33e-3, "m2", "area of the ring, A (triangle of 0.1 m)", above=0.0)
    wavelength = Parameter(632.8e-9, "m", "wavelength", above=0.0)
    lock_in = Parameter(0.05 * DEG, "rad/s", "half width of the lock-in band (0.05 deg/s)", min=0.0)
    dither = Parameter(100.0 * DEG, "rad/s", "amplitude of the dither rate, W (100 deg/s); 0: no dither", min=0.0)
    dither_f = Parameter(400.0, "Hz", "frequency of the dither, f", above=0.0)
    dither_noise = Parameter(0.02, "1", "rms of the dither amplitude from cycle to cycle, relative", min=0.0)
    stripped = Parameter(1.0, "1", "1: the dither is removed from the output, 0: it is in it", min=0.0, max=1.0)
    langmuir = Parameter(0.0, "rad/s/A", "bias per difference of the discharge currents")
    current_difference = Parameter(0.0, "A", "difference of the currents of the two arms")
    quantum = Noise(0.0, "rad/s/sqrt(Hz)", "white noise beside that of lock-in (quantum limit)", samples=2)
    crossings = Noise(1.0, "1/sqrt(Hz)", "white noise of lock-in as computed: 1; 0: none", samples=2)
    counting = Parameter(0.0, "1", "counts a fringe: 1, 2 or 4; 0: not counted", min=0.0, max=4.0)
    range_max = Parameter(0.0, "rad/s", "largest rate; 0: no limit", min=0.0)

    density = Output("rad/s/sqrt(Hz)", "density N of the white noise at small rates (angle random walk)")

    k = Discrete(0.0, "1", "beat phase per angle")
    floor_2 = Discrete(0.0, "rad2/s2", "least abs(W2 - w2)")
    count = Discrete(0.0, "rad", "angle of a count")
    counter = AngleCounter(size="count", rate="measured")

    def start(self) -> None:
        self.refuse(
            4.0 * pi * self.area > self.perimeter * self.perimeter * (1.0 + 1e-9),
            "area = {area} m2: a ring of the perimeter {perimeter} m has less than perimeter2/(4 pi)",
        )
        self.k = 8.0 * pi * self.area / (self.wavelength * self.perimeter)
        self.count = 0.0
        if self.counting > 0.0:
            self.count = 2.0 * pi / (self.k * self.counting)
        self.floor_2 = 0.0
        if self.dither > 0.0 and self.lock_in > 0.0:
            swing = self.k * self.dither / (2.0 * pi * self.dither_f)
            self.refuse(
                swing * self.dither_noise < pi,
                "dither_noise = {dither_noise}: it moves the beat phase by less than pi, the crossings of the lock-in "
                "band are not random; at least pi 2 pi f / (k W) is needed",
            )
            self.floor_2 = self.dither * self.dither * exp(-2.0 / 3.0 * log(swing))

    @sampled(every=1)
    def tick(self) -> None:
        turned = self.scaled(self.mount @ self.omega, self.temperature)
        drift = self.drift_rates(self.temperature)
        shaken = 0.0
        if self.stripped < 0.5 and self.dither > 0.0:
            w_d = 2.0 * pi * self.dither_f
            half = 0.5 * w_d * self.h
            shaken = self.dither * cos(w_d * self.t - half) * sin(half) / half  # mean of the dither over the step
        for j in range(2):
            w = turned[j] + drift[j] + self.langmuir * self.current_difference
            if self.dither > 0.0:
                inside = self.dither * self.dither - w * w
                root = sqrt(maximum(fabs(inside), self.floor_2))
                if inside > 0.0:
                    w = w + self.lock_in / sqrt(self.k * root) * self.noise.crossings[j]
                elif self.lock_in > 0.0:
                    w = w - 0.5 * sign(w) * self.lock_in * self.lock_in / root
            else:
                w = locked(w, self.lock_in)
            self.measured[j] = w + self.noise.quantum[j] + shaken
        self.limit(self.range_max)
        self.counter.count()

    def outputs(self) -> None:
        crossing = 0.0
        if self.dither > 0.0:
            crossing = self.lock_in * self.lock_in / (self.k * self.dither)
        self.density = sqrt(crossing * self.crossings * self.crossings + self.quantum * self.quantum)
