"""Quality of an estimator where the truth is known: error, delay, noise against distortion, consistency.

Less noise alone proves nothing (an estimate that is always 0 has none): every measure of noise has one of distortion
beside it, the gain and phase with which a known signal comes through.  [EST-KF-AR, BENCH-DYN-SINE]

All functions are pure.  Series are arrays (n,) sampled evenly at ``time`` (s); numbers come back as
:class:`UncertainValue` with a standard uncertainty.  Errors are correlated in time: where a mean of squares is taken,
n squares count as

    n / (1 + 2 sum rho_k^2)                      (Gaussian: the squares of a series correlate as rho_k^2)

independent ones.  Values that are no mean of squares get theirs from the scatter of ten stretches of the record.

Not modelled: signals that are not Gaussian about their deterministic part, records shorter than some ten correlation
times of the error.  Source: EST-KF-GEN, EST-SAGE-HUSA, EST-WAVELET-ONLINE; own derivations, proved by tests.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy import special

from gyrobench.arrays import Array
from gyrobench.reduction.estimation import residual_series
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.result import Autocorrelation

STRETCHES = 10
DECIBEL = 20.0 / math.log(10.0)


@dataclass(frozen=True)
class UncertainValue:
    """An estimate with its standard uncertainty and the degrees of freedom of that."""

    value: float
    u: float
    dof: float = math.inf

    @property
    def k(self) -> float:
        """Return the coverage factor of the 95 % interval."""
        return float(special.stdtrit(self.dof, 0.975)) if math.isfinite(self.dof) else NORMAL

    @property
    def pair(self) -> tuple[float, float]:
        """Return value and u, for an interval of normal size."""
        return self.value, self.u

    @property
    def interval(self) -> tuple[float, float]:
        half = self.k * self.u
        return self.value - half, self.value + half


@dataclass(frozen=True)
class Consistency:
    """Mean of squared errors over their stated variances: 1 if the filter knows itself.

    low, high: bounds at ``level`` of chi-square with ``dof`` degrees of freedom, over dof.  p: two-sided.
    """

    mean: float
    low: float
    high: float
    dof: float
    p: float

    @property
    def holds(self) -> bool:
        return self.low <= self.mean <= self.high

    @property
    def value(self) -> UncertainValue:
        """Return the mean with the scatter it has if the filter is consistent."""
        return UncertainValue(self.mean, math.sqrt(2.0 / self.dof))


# ------------------------------------------------------------------------------------ mean squares
def independent_squares(x: Array) -> float:
    """Return the number of independent ones among the n squares of a series about zero, n/(1 + 2 sum rho_k^2).

    Lags up to n/20; each squared correlation is taken less 1/n, which is what white noise leaves of it.
    """
    n = x.size
    power = float(x @ x)
    if n < 40 or power == 0.0:
        return float(max(n, 1))
    rho = _products(x)[1 : n // 20 + 1] / power
    return float(n / max(1.0, 1.0 + 2.0 * float(np.sum(rho * rho - 1.0 / n))))


def lasting_squares(x: Array) -> float:
    """Return :func:`independent_squares` of a series whose errors stay over much of it: a constant counts once.

    n/(1 + 2 sum (1 - k/n) rho_k^2), all lags, rho_k of the n - k products there are.
    """
    n = x.size
    power = float(x @ x) / n
    if n < 40 or power == 0.0:
        return 1.0
    lags = np.arange(1, n)
    rho = _products(x)[lags] / (n - lags) / power
    return float(n / max(1.0, 1.0 + 2.0 * float(np.sum((1.0 - lags / n) * (rho * rho - 1.0 / (n - lags))))))


def _products(x: Array) -> Array:
    """Return the sums of x_j x_(j+k) over all j, k = 0, 1, ... (n - 1 at least)."""
    size = 1 << (2 * x.size - 1).bit_length()
    spectrum = np.fft.rfft(x, size)
    return np.asarray(np.fft.irfft(spectrum * spectrum.conj(), size))


def rms(x: Array) -> UncertainValue:
    """Return the root mean square; u = rms/sqrt(2 nu) of nu independent squares."""
    value = math.sqrt(float(np.mean(x * x)))
    return UncertainValue(value, value / math.sqrt(2.0 * independent_squares(x)))


def decibels(a: UncertainValue, b: UncertainValue) -> UncertainValue:
    """Return 20 log10 of a over b; u as of independent ones (too large for an error and the noise behind it)."""
    if a.value == 0.0 or b.value == 0.0:
        return UncertainValue(-math.inf if b.value > 0.0 else math.nan, math.nan)
    return UncertainValue(DECIBEL * math.log(a.value / b.value), DECIBEL * math.hypot(a.u / a.value, b.u / b.value))


# --------------------------------------------------------------------------------- delay and distortion
def delay_signal(time: Array, x: Array, delay: float) -> Array:
    """Return x of ``delay`` s ago, linear between samples; before the record its first value."""
    return np.interp(time - delay, time, x)


def delay(time: Array, estimate: Array, truth: Array, most: float) -> UncertainValue:
    """Return the delay at which the truth fits the estimate best (least mean square difference), 0 to ``most`` s.

    Whole samples first, then the parabola through the three least; u from ten stretches.  Both about their means.
    Raises ValueError when a stretch is not longer than twice ``most``.
    """
    step = float(time[1] - time[0])
    lags = max(2, math.ceil(most / step)) + 1
    if time.size // STRETCHES < 2 * lags:
        raise ValueError(f"the record is too short for a delay of up to {most:g} s: {20 * most:g} s are needed")
    whole = _delay(estimate, truth, lags) * step
    parts = zip(np.array_split(estimate, STRETCHES), np.array_split(truth, STRETCHES), strict=True)
    return UncertainValue(whole, _scatter([_delay(e, t, lags) * step for e, t in parts]), STRETCHES - 1)


def _delay(estimate: Array, truth: Array, lags: int) -> float:
    e, t = estimate - estimate.mean(), truth - truth.mean()
    end = t.size - 1
    cost = np.array([float(np.mean((e[lags:end] - t[lags - k : end - k]) ** 2)) for k in range(-1, lags + 1)])
    best = int(np.argmin(cost[1:-1])) + 1
    a, b, c = cost[best - 1 : best + 2]
    bend = a - 2.0 * b + c
    return best - 1 + (0.5 * (a - c) / bend if bend > 0.0 else 0.0)


def _scatter(values: list[float]) -> float:
    """Return the standard error of the mean of the stretches."""
    return float(np.std(values, ddof=1) / math.sqrt(len(values)))


@dataclass(frozen=True)
class SignalResponse:
    """Response to a known signal: gain, phase (rad, negative: late), and what else the estimate holds."""

    gain: UncertainValue
    phase: UncertainValue | None
    rest: Array  # estimate less the signal as it came through


@dataclass(frozen=True)
class Sine:
    """A sine and a constant fitted by least squares over whole periods: sine part + j cosine part, in all of the record
    and in ten stretches of it, and what is left.
    """

    whole: complex
    parts: Array
    rest: Array

    @property
    def u(self) -> float:
        """Return the standard uncertainty of either part."""
        return float(np.sqrt(np.mean(np.abs(self.parts - self.whole) ** 2) / 2.0 / (STRETCHES - 1)))


def sine(time: Array, x: Array, frequency: float) -> Sine:
    """Fit a sine of ``frequency`` Hz.  Raises ValueError below ten periods."""
    step = float(time[1] - time[0])
    periods = math.floor((time.size * step) * frequency + 1e-9)
    if periods < STRETCHES:
        raise ValueError(f"{periods} periods of {frequency:g} Hz are recorded: {STRETCHES} are needed")
    phase = 2.0 * math.pi * frequency * time
    basis = np.column_stack([np.sin(phase), np.cos(phase), np.ones(time.size)])

    def fit(rows: slice) -> Array:
        return np.asarray(np.linalg.lstsq(basis[rows], x[rows], rcond=None)[0])

    whole = fit(slice(round(periods / frequency / step)))
    samples = periods // STRETCHES / frequency / step
    parts = [fit(slice(round(k * samples), round((k + 1) * samples))) for k in range(STRETCHES)]
    return Sine(complex(whole[0], whole[1]), np.array([complex(p[0], p[1]) for p in parts]), x - basis @ whole)


def rms_of_sine(time: Array, x: Array, frequency: float) -> UncertainValue:
    """Return the root mean square of a sine under noise, such as the error of an estimate that is late.

    u^2(mean square) = (A u(A))^2 + (2 rest u(rest))^2: the sine, always there, scatters by its amplitude A only.
    """
    s = sine(time, x, frequency)
    value = math.sqrt(float(np.mean(x * x)))
    rest = rms(s.rest)
    if value == 0.0:
        return UncertainValue(0.0, 0.0)
    return UncertainValue(value, math.hypot(abs(s.whole) * s.u, 2.0 * rest.value * rest.u) / (2.0 * value))


def response_to_sine(time: Array, estimate: Array, truth: Array, frequency: float) -> SignalResponse:
    """Return the gain and phase at ``frequency`` (Hz): sines fitted to estimate and truth.

    u from the scatter of ten stretches.  Raises ValueError below ten periods.
    """
    e, x = sine(time, estimate, frequency), sine(time, truth, frequency)
    whole = e.whole / x.whole
    parts = e.parts / x.parts / whole
    gain = UncertainValue(abs(whole), abs(whole) * _scatter(np.abs(parts).tolist()), STRETCHES - 1)
    phase = UncertainValue(math.atan2(whole.imag, whole.real), _scatter(np.angle(parts).tolist()), STRETCHES - 1)
    return SignalResponse(gain, phase, e.rest)


def response_to_truth(estimate: Array, truth: Array) -> SignalResponse:
    """Return gain of a random truth: regression of the estimate on it (align them first), both about their means."""
    e, x = estimate - estimate.mean(), truth - truth.mean()

    def slope(rows: slice) -> float:
        return float(e[rows] @ x[rows] / (x[rows] @ x[rows]))

    gain = slope(slice(None))
    stretches = [slice(a, b) for a, b in pairwise(np.linspace(0, x.size, STRETCHES + 1).astype(int))]
    parts = [slope(s) for s in stretches]
    weights = [float(x[s] @ x[s]) for s in stretches]
    share = np.array(weights) / sum(weights)
    u = math.sqrt(float(np.sum((share * (np.array(parts) - gain)) ** 2)) * STRETCHES / (STRETCHES - 1))
    return SignalResponse(UncertainValue(gain, u, STRETCHES - 1), None, e - gain * x)


# ------------------------------------------------------------------------------------- consistency
def _consistency(mean: float, dof: float, level: float) -> Consistency:
    half = 0.5 * (1.0 - level)
    below = float(special.chdtr(dof, mean * dof))
    low, high = (float(special.chdtri(dof, 1.0 - q)) / dof for q in (half, 1.0 - half))
    return Consistency(mean, low, high, dof, 2.0 * min(below, 1.0 - below))


def nees(error: Array, variance: Array, level: float = 0.999) -> Consistency:
    """Return the normalized estimation error squared of one state: mean of error2/variance against chi-square.

    Errors follow one another slowly, so the degrees of freedom are the independent squares among them.
    """
    x = error / np.sqrt(variance)
    return _consistency(float(np.mean(x * x)), independent_squares(x), level)


def nis(values: Array, level: float = 0.999) -> Consistency:
    """Return the normalized innovation squared of scalar readings; white innovations of a right filter: dof = n."""
    return _consistency(float(np.mean(values)), float(values.size), level)


def whiteness(innovation: Array, lags: int = 20) -> tuple[Autocorrelation, float, float]:
    """Return autocorrelation (see :func:`gyrobench.reduction.estimation.residual_series.autocorrelation`), Ljung-Box Q,
    probability.

    [DRIFT-WHITENESS-LB]  No degrees of freedom are taken off: the model was given, not fitted to this record.
    """
    acf = residual_series.autocorrelation([innovation], lags)
    return acf, *residual_series.ljung_box(acf, innovation.size, lags)


def variance_ratio(estimated: Array, true: float) -> UncertainValue:
    """Return the mean of an estimated variance over the true one, u from ten stretches."""
    parts = [float(np.mean(p)) / true for p in np.array_split(estimated, STRETCHES)]
    return UncertainValue(float(np.mean(estimated)) / true, _scatter(parts), STRETCHES - 1)
