from __future__ import annotations

from typing import ClassVar

from gyrobench.component import Discrete, Noise, Output, Parameter, State, sampled
from gyrobench.component.blocks.rate_gyro import AngleCounter, RateGyro, locked
from gyrobench.component.math import cos, fabs, pi, sin, sqrt

C = 299792458.0  # m/s
E_CHARGE = 1.602176634e-19  # C
BOLTZMANN = 1.380649e-23  # J/K


class GyroFog(RateGyro):
    """Two-axis interferometric fibre-optic gyro, closed or open loop, two coils of one make.  [GYRO-FOG]

        phi = S w,   S = 2 pi L D / (lambda c)                                  Sagnac phase, S follows the temperature
        closed loop: w (1 + S_T dT) / (1 - reset_error), then the dead band: sign sqrt(w2 - dead_band2)
        open loop:   (1 + power_error) sin(depth (1 + depth_error)) / sin(depth) sin(phi) / S_0
        white noise (two-sided density), s = R P sin(depth) / 2:
        N2 S_0 2 = [e R P (1 + cos depth)/2 + 2 k_B theta / load] / s2
                   + (1 + cos depth)/(1 - cos depth) lambda2/(c dlambda),   and `electronics` beside it
        Shupe: n index_T L / (6 D) gradient T',   T' = (temperature - T) / lag

    Open loop folds where abs(phi) is above pi/2, and says so (saturated).
    Not modelled: bandwidth of the loop, transit time, noise that carries a rate through the dead band, noise of the
    open loop at large phases, polarization, Kerr and Faraday effect beyond the linear `magnetic`, vibration.
    Source: Lefevre 2014; Shupe 1980; IEEE 952; derivation in GYRO-FOG.
    """

    version = "1.0.0"
    unrounded: ClassVar[dict[str, float]] = {"resolution": 0.0}
    white_noise, without_own_noise = "electronics", {"optical": 0.0}

    length = Parameter(1000.0, "m", "length of the fibre of a coil, L", above=0.0)
    diameter = Parameter(0.1, "m", "diameter of a coil, D", above=0.0)
    wavelength = Parameter(1.55e-6, "m", "mean wavelength, lambda", above=0.0)
    linewidth = Parameter(3e-8, "m", "width of the spectrum, lambda2/(c x coherence time)", above=0.0)
    wavelength_T = Parameter(0.0, "1/K", "change of the wavelength with temperature, relative")
    coil_T = Parameter(0.0, "1/K", "change of length times diameter with temperature, relative")
    closed = Parameter(1.0, "1", "1 closed loop, 0 open loop", min=0.0, max=1.0)
    depth = Parameter(0.5 * pi, "rad", "phase bias of the square-wave modulation", above=0.0, below=pi)
    depth_error = Parameter(0.0, "1", "open loop: relative error of the phase bias", min=-0.5, max=0.5)
    power_error = Parameter(0.0, "1", "open loop: relative error of the power", min=-0.9, max=9.0)
    reset_error = Parameter(0.0, "1", "closed loop: relative error of the 2 pi reset", min=-0.1, max=0.1)
    dead_band = Parameter(0.0, "rad/s", "closed loop: half width of the dead band", min=0.0)
    power = Parameter(2e-5, "W", "power at the detector without phase bias, P", above=0.0)
    responsivity = Parameter(1.0, "A/W", "responsivity of the detector, R", above=0.0)
    load = Parameter(1e5, "Ohm", "resistance of the detector load", above=0.0)
    load_temperature = Parameter(300.0, "K", "its absolute temperature, theta", above=0.0)
    optical = Noise(1.0, "1/sqrt(Hz)", "white noise of shot, load and excess as computed: 1; 0: none", samples=2)
    electronics = Noise(0.0, "rad/s/sqrt(Hz)", "white noise beside it", samples=2)
    index = Parameter(1.45, "1", "index of refraction of the fibre, n", min=1.0)
    index_T = Parameter(1e-5, "1/K", "change of index times length with temperature over the length, dn/dT + n alpha")
    gradient = Parameter(1e-3, "1", "difference of T' between the ends of the fibre, over T' (Shupe)")
    lag = Parameter(300.0, "s", "time constant of the coil against its surroundings", above=0.0)
    range_max = Parameter(0.0, "rad/s", "largest rate; 0: no limit", min=0.0)
    resolution = Parameter(0.0, "rad", "angle of an output count; 0: none", min=0.0)
    counter = AngleCounter(size="resolution", rate="measured")

    phase = Output("rad", "Sagnac phase of x and y", shape=(2,))
    density = Output("rad/s/sqrt(Hz)", "density N of the white noise (angle random walk)")

    T = State(0.0, "K", "temperature of the coil above that of the coefficients")
    sagnac = Discrete(0.0, "s", "Sagnac factor S_0 at the temperature of the coefficients")
    seen = Discrete([0.0, 0.0], "rad", "Sagnac phase")
    N = Discrete(0.0, "rad/s/sqrt(Hz)", "density of shot, load and excess noise")

    def start(self) -> None:
        self.T = self.temperature
        self.sagnac = 2.0 * pi * self.length * self.diameter / (self.wavelength * C)
        slope = 0.5 * self.responsivity * self.power * sin(self.depth)
        shot = E_CHARGE * 0.5 * self.responsivity * self.power * (1.0 + cos(self.depth)) / (slope * slope)
        thermal = 2.0 * BOLTZMANN * self.load_temperature / self.load / (slope * slope)
        coherence = self.wavelength * self.wavelength / (C * self.linewidth)
        excess = coherence * (1.0 + cos(self.depth)) / (1.0 - cos(self.depth))
        self.N = sqrt(shot + thermal + excess) / self.sagnac

    def flow(self) -> None:
        self.der.T = (self.temperature - self.T) / self.lag

    @sampled(every=1)
    def tick(self) -> None:
        w = self.mount @ self.omega
        factor = 1.0 + (self.coil_T - self.wavelength_T) * self.T
        shupe = self.index * self.index_T * self.length / (6.0 * self.diameter) * self.gradient
        turned = self.scaled(w, self.T)
        drift = self.drift_rates(self.T)
        fold = sin(self.depth * (1.0 + self.depth_error)) / sin(self.depth) * (1.0 + self.power_error)
        warming = shupe * (self.temperature - self.T) / self.lag
        folded = 0.0
        for j in range(2):
            rate = factor * turned[j]
            self.seen[j] = self.sagnac * rate
            if self.closed > 0.5:
                rate = locked(rate / (1.0 - self.reset_error), self.dead_band)
            else:
                rate = fold * sin(self.seen[j]) / self.sagnac
                if fabs(self.seen[j]) > 0.5 * pi:
                    folded = 1.0
            white = self.N * self.noise.optical[j] + self.noise.electronics[j]
            self.measured[j] = rate + drift[j] + warming + white
        self.limit(self.range_max)
        if folded > self.beyond:
            self.beyond = 1.0
        self.counter.count()

    def outputs(self) -> None:
        self.phase = self.seen
        self.density = sqrt(self.N * self.N * self.optical * self.optical + self.electronics * self.electronics)
