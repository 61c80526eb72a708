"""Frequency responses of a loop's signals to its excitation, with covariance, by local polynomials.

About each frequency the spectra of r, u, y, of the whole record, are

    periodic r:     Z(k + d) = t0 + t1 d + t2 d2 + V(k + d)            between the lines;  Z(k) = G R(k) + t0 + V
    any other r:    Z(k + d) = (g0 + g1 d + g2 d2) R(k + d) + t0 + t1 d + t2 d2 + V(k + d)

The t are the transient and what leaks of slow drift, smooth in frequency where the signals are not.  V is the noise:
its covariance between u and y comes from the residuals, so that the ratio of two signals of one loop has the right
uncertainty although both hold the same noise.  Estimates at different frequencies share no bin of noise.

Not modelled: noise that changes along the record; a response with features narrower than some bins (lengthen the
record).  Source: Pintelon 2012, chapter 7 (local polynomial method) and 2.5 (excitation in feedback: the response to r
of u and of y, and their ratio, are without the bias of the noise that circulates).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.identification.loop_record import LoopRecord
from gyrobench.record.frequency_response import Complex

ORDER = 2  # of the local polynomials
BINS = 12  # at least, of noise at either side, of a periodic excitation
NARROW = 10  # bins at least to either side, of another
SHARE = (
    0.005  # of the frequency to either side, where that is more: less than half of what a mode damped by 1 % is wide
)
EXCITED = 1e-3  # of the largest amplitude of r: smaller ones are no excitation
INFLATED = 10.0  # times the variance of a mean of the band (2.3 is the least): r is nearly as smooth as a transient
ROUNDING = 1e-12
EDGE = 0.1  # of its rms in a band: where its median is less the excitation begins or ends there
ABOVE = 5.0  # times the noise of r
PERIODS = 3  # at least
TOP = 0.4  # of the sampling rate: no response is taken above it
REPEATS = 1e-3  # of the power of r: what a period may differ from the next


@dataclass(frozen=True)
class LineAmplitudes:
    """Amplitudes of r, u, y at frequencies, with the covariance of their noise.

    f: Hz, (n,).  z: (n, 3).  cov: of the noise of z, complex and circular, (n, 3, 3).  dof: complex degrees of freedom
    of cov, (n,).
    """

    f: Array
    z: Complex
    cov: Complex
    dof: Array

    def take(self, which: NDArray[np.intp] | NDArray[np.bool_]) -> LineAmplitudes:
        """Return some of them."""
        return LineAmplitudes(self.f[which], self.z[which], self.cov[which], self.dof[which])


def find_period(r: Array) -> int:
    """Return after how many samples r repeats, over the whole record; 0 where it does not.

    The mean square of r(t + m) - r(t) over that of r, for each lag m, from correlations; the first lag that brings it
    back below REPEATS after it had risen above 1.
    """
    x = r - r.mean()
    n = x.size
    if not np.any(x):
        return 0
    size = 1 << (2 * n - 1).bit_length()
    spectrum = np.fft.rfft(x, size)
    products = np.fft.irfft(np.abs(spectrum) ** 2, size)[: n // 2 + 1]
    before = np.concatenate([[0.0], np.cumsum(x**2)])
    lags = np.arange(products.size)
    squares = (before[n - lags] + before[n] - before[lags] - 2.0 * products) / (n - lags)
    change = squares / (before[n] / n)
    risen = np.flatnonzero(change > 1.0)
    low = np.flatnonzero(change[risen[0] :] < REPEATS) + risen[0] if risen.size else risen
    if not low.size:
        return 0
    run = low[: int(np.argmax(np.diff(low, append=n + 1) > 1)) + 1]  # beside the period it is low, too
    return int(run[np.argmin(change[run])])


def misfit(r: Array, period: int) -> float:
    """Return by what part of a sample a period differs from a whole number of them; 0 where it cannot be told.

    From the phase by which r of the last period lags that of the first, over all its frequencies.
    """
    count = r.size // period
    if count < 2:
        return 0.0
    first, last = (np.fft.rfft(x - x.mean()) for x in (r[:period], r[(count - 1) * period : count * period]))
    k = np.arange(first.size)
    cross = last * np.conj(first)
    turn, weight = np.angle(cross), np.abs(cross)
    few = k < period / 8.0  # later ones may have turned around
    power = np.sum(weight[few] * k[few] ** 2)
    if not power:
        return 0.0
    return float(-np.sum(weight[few] * k[few] * turn[few]) / power * period / (2.0 * np.pi) / (count - 1))


def periods_used(samples: int, period: int) -> int:
    """Return how many periods count: the last ones, of four and more all but the first, which holds the transient."""
    count = samples // period
    return count - 1 if count > PERIODS else count


def without_slope(signals: Array, period: int) -> Array:
    """Return signals (3, n) of whole periods without mean and slope, from the means of the periods."""
    count = signals.shape[1] // period
    means = signals.reshape(3, count, period).mean(axis=2)
    at = (np.arange(count) + 0.5) * period - 0.5
    slope = (means @ (at - at.mean())) / np.sum((at - at.mean()) ** 2)
    t = np.arange(signals.shape[1]) - at.mean()
    return np.asarray(signals - means.mean(axis=1)[:, None] - slope[:, None] * t)


def periodic_lines(record: LoopRecord, period: int) -> tuple[LineAmplitudes, LineAmplitudes]:
    """Return the lines of a periodic excitation, and those of its harmonics between them that it leaves out."""
    count = periods_used(record.r.size, period)
    start = record.r.size - count * period  # the transient is at the beginning
    signals = without_slope(np.stack([record.r, record.u, record.y])[:, start:], period)
    n = signals.shape[1]
    spectra = np.fft.rfft(signals).T * (2.0 / n)
    harmonics = np.arange(1, int(TOP * period) + 1)
    every = _at_harmonics(spectra, harmonics, count, 1.0 / (n * record.step))
    r, noise = np.abs(every.z[:, 0]), np.sqrt(every.cov[:, 0, 0].real)
    excited = (r > EXCITED * r.max()) & (r > ABOVE * noise)
    k = np.flatnonzero(excited)
    omitted = ~excited & (harmonics > harmonics[k[0]]) & (harmonics < harmonics[k[-1]]) if k.size else ~excited
    return every.take(excited), every.take(omitted)


def _at_harmonics(spectra: Complex, harmonics: NDArray[np.intp], count: int, bin_width: float) -> LineAmplitudes:
    """Return all harmonics of the period: bin ``count`` times the harmonic of spectra (bins, 3)."""
    far = np.arange(1, 4 * BINS * 2)
    side = far[far % count != 0][:BINS] if count > 1 else far[:0]
    inside = harmonics[(harmonics * count > side[-1]) & (harmonics * count + side[-1] < spectra.shape[0])]
    rest = np.setdiff1d(harmonics, inside)
    groups = [(inside, np.concatenate([-side[::-1], side]))]
    for h in rest:  # at either end of the spectrum the bins are not symmetrical
        d = np.arange(1 - h * count, spectra.shape[0] - h * count)
        d = d[(d + h * count) % count != 0]
        groups.append((np.array([h]), d[np.argsort(np.abs(d), kind="stable")[: 2 * BINS]]))
    found: list[LineAmplitudes] = []
    for h, d in groups:
        if not h.size or d.size <= ORDER + 2:
            continue
        x = np.vander(d / np.abs(d).max(), ORDER + 1, increasing=True)
        solve = np.linalg.pinv(x)
        around = spectra[h[:, None] * count + d]  # (lines, bins, signals)
        poly = solve @ around
        v = around - x @ poly
        dof = d.size - ORDER - 1
        cov = np.swapaxes(v, 1, 2) @ np.conj(v) / dof * (1.0 + float(solve[0] @ solve[0]))
        z = spectra[h * count] - poly[:, 0]
        found.append(LineAmplitudes(h * count * bin_width, z, cov, np.full(h.size, float(dof))))
    order = np.argsort(np.concatenate([p.f for p in found]))
    joined = [np.concatenate([getattr(p, n) for p in found])[order] for n in ("f", "z", "cov", "dof")]
    return LineAmplitudes(*joined)


def broadband_lines(record: LoopRecord, low: float = 0.0, high: float = np.inf) -> LineAmplitudes:
    """Return responses to an excitation of any kind, r = 1 at each frequency, between two frequencies, Hz.

    The bands of neighbouring frequencies do not overlap.
    """
    n = record.r.size
    t = np.linspace(-1.0, 1.0, n)
    signals = np.stack([record.r, record.u, record.y])
    signals = signals - signals.mean(axis=1)[:, None]
    signals = signals - ((signals @ t) / (t @ t))[:, None] * t
    spectra = np.fft.rfft(signals).T * (2.0 / n)
    width = 1.0 / (n * record.step)
    last = min(int(TOP * n), int(high / width) if np.isfinite(high) else n)
    found = []
    k = 1 + NARROW
    while k + (half := max(NARROW, int(SHARE * k))) <= last:
        if k * width >= low and (band := _band(spectra, k, half)) is not None:
            r = np.abs(spectra[k - half : k + half + 1, 0])
            found.append((k * width, *band, float(np.median(r)), float(np.sqrt(np.mean(r**2)))))
        k = max(k + 2 * half + 1, int((k + half + 1) / (1.0 - SHARE)))
    if not found:
        return LineAmplitudes(np.zeros(0), np.zeros((0, 3), complex), np.zeros((0, 3, 3), complex), np.zeros(0))
    f, z, cov, dof, middle, r = (np.array([p[i] for p in found]) for i in range(6))
    return LineAmplitudes(f, z, cov, dof).take((r > EXCITED * r.max()) & (middle > EDGE * r))


def _band(spectra: Complex, k: int, half: int) -> tuple[Complex, Complex, float] | None:
    """Return response (3,), covariance (3, 3) and degrees of freedom of the band of bins k - half to k + half.

    None where the spectrum of r is nearly as smooth as that of a transient, from which its response is told badly then:
    at the ends of a sweep.
    """
    d = np.arange(-half, half + 1)
    powers = np.vander(d / half, ORDER + 1, increasing=True)
    around = spectra[k + d]
    x = np.hstack([powers * around[:, :1], powers])
    size = np.linalg.norm(x, axis=0)
    if not np.all(size > 0.0):
        return None
    left, singular, right = np.linalg.svd(x / size, full_matrices=False)
    solve = np.conj(right.T) @ (np.conj(left.T) / np.maximum(singular, ROUNDING * singular[0])[:, None])
    inflation = float(np.sum(np.abs(solve[0]) ** 2))
    if inflation > INFLATED:
        return None
    found = solve @ around[:, 1:]
    v = around[:, 1:] - (x / size) @ found
    dof = float(d.size - 2 * (ORDER + 1))
    share = inflation / size[0] ** 2
    cov = np.zeros((3, 3), complex)
    cov[1:, 1:] = v.T @ np.conj(v) / dof * share
    return np.array([1.0, *(found[0] / size[0])]), cov, dof
