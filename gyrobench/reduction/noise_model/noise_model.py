"""What a noise model says: coefficients, Gauss-Markov processes, minimum of the deviation, deviation and spectrum."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.noise_model.agreement import DeviationAgreement
from gyrobench.reduction.noise_model.constancy import TermOverTime, over_time
from gyrobench.reduction.noise_model.ordinates import Model, allan, size_of, spectrum, split
from gyrobench.reduction.noise_model.sensor_filters import ALL, MEANS, Grid, filter_of, passes_slow, samples_of
from gyrobench.reduction.noise_model.slow_changes import Settling, Swing
from gyrobench.reduction.noise_model.steps import LevelStep
from gyrobench.reduction.noise_model.terms import PEAKS, SLOW
from gyrobench.reduction.noise_model.treatment import Treated
from gyrobench.reduction.series.lines import SpectralLine
from gyrobench.reduction.series.noise_coefficients import Estimate
from gyrobench.reduction.series.row_pattern import rows_of_a_slower_record

CALLED = {"N": "white", "B": "flicker", "K": "walk", "Q": "quantization"}
ABSENT = 0.025  # probability of its absence below which a term is determined
ALIKE = 0.9  # share of samples equal to the one before, from which on the others are told by the place of the step


@dataclass(frozen=True)
class Process:
    """Gauss-Markov process x' = -x/tau + w as a Kalman filter takes it: rms sigma in the unit of the rate, tau in s.

    It may stand for several: then tau is of any of them with a quarter of their variance, sigma of all within the
    interval of tau together.  present: probability that the record has such a process, by the evidence of the models
    with one near this tau.
    """

    sigma: Estimate
    tau: Estimate
    present: float

    @property
    def density(self) -> float:
        """Return the density of w, two-sided: sigma sqrt(2/tau), unit/sqrt(s)."""
        return self.sigma.value * math.sqrt(2.0 / self.tau.value)

    def discrete(self, step: float) -> tuple[float, float]:
        """Return phi and the standard deviation of w_k in x_k+1 = phi x_k + w_k every ``step`` s."""
        phi = math.exp(-step / self.tau.value)
        return phi, self.sigma.value * math.sqrt(-math.expm1(-2.0 * step / self.tau.value))


@dataclass(frozen=True)
class Minimum:
    """Least Allan deviation of the model and its averaging time, s; reached: False where it falls to the end."""

    deviation: Estimate
    tau: Estimate
    reached: bool


@dataclass(frozen=True)
class Scale:
    """Units of a fit: interval tau0 of a sample, s, size and level of the rate; means: samples are means over tau0."""

    tau0: float
    size: float
    level: float
    means: bool

    @property
    def units(self) -> dict[str, float]:
        """Return the units of N, B, K, R, Q."""
        root = math.sqrt(self.tau0)
        return {"N": self.size * root, "B": self.size, "K": self.size / root, "R": self.size / self.tau0,
                "Q": self.size * self.tau0}  # fmt: skip


def scale_of(rate: Array, tau0: float, means: bool) -> Scale:
    """Return the units in which a rate (n,) is fitted: its level, and the rms of its differences over sqrt 2."""
    level = float(np.nanmean(rate)) if np.isfinite(rate).any() else 0.0
    difference = np.diff(rate)
    size = math.sqrt(0.5 * float(np.nanmean(difference**2))) if np.isfinite(difference).any() else 1.0
    return Scale(tau0, size or 1.0, level, means)


def times(e: Estimate, unit: float) -> Estimate:
    """Return an estimate in another unit."""
    return Estimate(e.value * unit, e.low * unit, e.high * unit, e.determined)


@dataclass(frozen=True, kw_only=True)
class NoiseModel:
    """Noise model of a rate record; see :func:`gyrobench.reduction.noise_model.fit.fit_noise`.

    coefficients: N [unit sqrt(s)], B [unit], K [unit/sqrt(s)], R [unit/s, signed], Q [unit s].  shape: terms and their
    parameters in units of ``scale``, as the treatment is.  agreements: with the record as it was, and without what was
    taken out.  with_wild: coefficients with the wild samples left in.  models: how many were compared.
    chances: filtered, that the white noise has passed a filter; steep, of so steep a fall of the slow drift, weak, of
    so little of the slowest noise by chance, see :mod:`gyrobench.reduction.noise_model.one_curve`.
    """

    scale: Scale
    shape: tuple[Model, Array]
    coefficients: dict[str, Estimate]
    processes: tuple[Process, ...]
    minimum: Minimum
    treatment: Treated
    agreements: tuple[DeviationAgreement, DeviationAgreement]
    with_wild: dict[str, float]
    models: int
    chances: dict[str, float]

    def __getitem__(self, name: str) -> Estimate:
        """Return a coefficient."""
        return self.coefficients[name]

    @property
    def terms(self) -> dict[str, float]:
        """Return N, B, K, R, Q of the model as a whole, 0 where it has none.

        With its processes and bands they make the record's deviation: also those that are not determined alone, which
        stand for what the record does not tell them from.
        """
        found = {"R": self["R"].value if self["R"].determined else 0.0}
        for name, term in CALLED.items():
            v = size_of(term)(*self.shape)
            found[name] = 0.0 if v is None else math.exp(0.5 * float(v)) * self.scale.units[name]
        return found

    @property
    def agreement(self) -> DeviationAgreement:
        return self.agreements[0]

    @property
    def agrees(self) -> bool:
        """Return whether the deviation that the model implies is the record's, as it was and as it was cleaned, what
        stands for missing and wild samples came to an end, no rows are those of a slower record, the noise is more than
        a rare change between two values, and it was at rest.
        """
        settled = self.treatment.settled and not (self.slower or self.rounded_away or self.treatment.restless)
        return settled and all(a.holds for a in self.agreements)

    @property
    def rounded_away(self) -> bool:
        return self.treatment.alike > ALIKE

    @cached_property
    def over_time(self) -> tuple[TermOverTime, ...]:
        """Return the terms in the quarters of the record."""
        return over_time(self.treatment, self.shape, self.scale.means)

    @cached_property
    def slower(self) -> float:
        """Return the rows after which changes vanish and come back: those of a slower record, held or interpolated; 0
        of none.
        """
        return rows_of_a_slower_record(self.treatment.cleaned())

    @property
    def cleaned(self) -> Array:
        """Return the record (n,) without lines, steps and wild samples, NaN where nothing is or was taken out."""
        return self.scale.size * self.treatment.cleaned() + self.scale.level

    @property
    def longest(self) -> tuple[int, Array]:
        """Return the first index and the samples of the longest stretch, cleaned and without a gap: what was missing or
        wild is drawn from the noise around.
        """
        s = max(self.treatment.stretches, key=lambda s: s.own.size)
        return s.start, self.scale.size * s.done.drawn + self.scale.level

    @property
    def lines(self) -> list[SpectralLine]:
        """Return the lines that were taken out, frequencies in Hz, amplitudes in the unit of the rate."""
        return [
            replace(x, frequency=x.frequency / self.scale.tau0, u_frequency=x.u_frequency / self.scale.tau0,
                    amplitude=x.amplitude * self.scale.size, u_amplitude=x.u_amplitude * self.scale.size)
            for x in self.treatment.lines
        ]  # fmt: skip

    @property
    def steps(self) -> list[LevelStep]:
        """Return the steps of the level that were taken out, in the unit of the rate."""
        return [replace(s, size=s.size * self.scale.size, u=s.u * self.scale.size) for s in self.treatment.steps]

    @property
    def pulses(self) -> list[tuple[int, float, float, float]]:
        """Return index, length (s), integral and its u (unit s) of each pulse of the rate that was taken out."""
        tau0 = self.scale.tau0
        each = [(p.at, p.width * tau0, p.size * self.scale.size, p.u * self.scale.size) for p in self.treatment.pulses]
        return [(at, length, size * length, u * length) for at, length, size, u in each]

    @property
    def settling(self) -> Settling | None:
        """Return the drift that settles, which was taken out, in the unit of the rate and s."""
        s = self.treatment.settling
        size, tau0 = self.scale.size, self.scale.tau0
        return s and Settling(s.tau * tau0, s.u_tau * tau0, s.size * size, s.u * size)

    @property
    def swings(self) -> list[Swing]:
        """Return the swings of few cycles that were taken out, in the unit of the rate and s."""
        size, tau0 = self.scale.size, self.scale.tau0
        return [
            Swing(s.period * tau0, s.u_period * tau0, s.size * size, s.u * size, s.phase) for s in self.treatment.swings
        ]

    def allan(self, tau: Array) -> Array:
        """Return the Allan deviation (k,) of the whole model over tau (s), multiples of tau0, without lines."""
        m = np.maximum(np.rint(tau / self.scale.tau0), 1.0)
        ramp = self["R"].value * tau if self["R"].determined else np.zeros_like(tau)
        out: Array = np.sqrt(self.scale.size**2 * allan(*self.shape, m, self.scale.means) + 0.5 * ramp**2)
        return out

    def spectrum(self, f: Array) -> Array:
        """Return the two-sided spectrum (k,) of the samples, 0 < f <= 1/(2 tau0) in Hz, aliasing included."""
        omega = 2.0 * math.pi * f * self.scale.tau0
        out: Array = self.scale.size**2 * self.scale.tau0 * spectrum(*self.shape, Grid(omega, self.scale.means))
        return out

    def filter_words(self) -> str:
        """Return what the sensor's filter is, in words; "" where the record does not show that there is one."""
        if self.chances["filtered"] < 1.0 - ABSENT:
            return ""
        found = next(((t, q) for t, q in split(*self.shape) if t.name == "white" and t.filter != "none"), None)
        if found is None:
            return ""
        t, q = found
        words, at = list[str](), 1
        for part in t.filter.removesuffix(ALL).split("+"):
            size = filter_of(part)[1]
            words.append(_filter_words(part, q[at : at + size], self.scale.tau0))
            at += size
        return ", after a ".join(words)

    @property
    def slow_filtered(self) -> bool:
        """Return whether there is slow noise and has passed the sensor's filter too."""
        return any(t.name in SLOW for t in self.shape[0]) and any(passes_slow(t.filter) for t in self.shape[0])

    def peaks(self) -> list[tuple[float, float, float]]:
        """Return frequency (Hz), bandwidth (Hz, full at half power) and rms (unit) of every resonance."""
        out, tau0 = [], self.scale.tau0
        for t, q in split(*self.shape):
            if t.name in PEAKS:
                width = 1.0 / math.pi if t.name == "resonance" else math.sqrt(2.0 * math.log(2.0)) / math.pi
                frequency = math.exp(q[2]) / (2.0 * math.pi * tau0)
                wide = width / (math.exp(q[1]) * tau0)
                out.append((frequency, wide, self.scale.size * math.exp(0.5 * q[0])))
        return out


def _filter_words(name: str, p: Array, tau0: float) -> str:
    """Return what a filter of parameters p (k,) is, in words."""
    if name == "first":
        return f"low-pass of first order, time constant {_seconds(tau0 * math.exp(p[0]))}"
    if name in ("second", "recursive"):
        kind = "low-pass" if name == "second" else "recursive digital low-pass"
        at, damping = plain(math.exp(p[0]) / (2.0 * math.pi * tau0), 3), plain(math.exp(p[1]))
        return f"{kind} of second order, {at} Hz, damping {damping}"
    if name == "butterworth":
        return f"digital low-pass, {plain(_cutoff(p[0], tau0), 3)} Hz, order {plain(math.exp(p[1]))}"
    if name == "cascade":
        return f"{plain(math.exp(p[1]))} digital low-passes in a row of {plain(_cutoff(p[0], tau0), 3)} Hz each"
    if name == "average":
        return f"mean over {_seconds(tau0 * math.exp(p[0]))}"
    if name.startswith(tuple(MEANS)):
        return f"{'two means' if name.startswith('bartlett') else 'mean'} over {samples_of(name)} samples"
    level = float(np.exp(-2.0 * np.sum(p[::2])))
    return f"smooth shape of {name[5:]} terms, {plain(10.0 * math.log10(level))} dB at half the sampling rate"


def _cutoff(log_t: float, tau0: float) -> float:
    """Return the frequency, Hz, at which tan(omega/2) is t."""
    return math.atan(math.exp(log_t)) / (math.pi * tau0)


def _seconds(t: float) -> str:
    return f"{plain(t, 3)} s" if t >= 1.0 else f"{plain(1e3 * t, 3)} ms"
