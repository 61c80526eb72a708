"""Spectral lines: detection with a stated false-alarm probability over any smooth spectrum, least squares, removal.

    x_k = c + s t_k + sum A_i sin(2 pi f_i t_k + psi_i) + noise,   t_k = k dt,   A = hypot(a, b), psi = atan2(b, a)

Detection compares each value of the periodogram with the level around it, so the noise need not be white: the level is
the mean logarithm over up to 64 bins on either side (a straight line over log f below bin 128), which k degrees of
gamma type describe, trigamma(k) = its variance.  The ratio R then exceeds r by chance with the probability
(1 + r exp(-digamma k))^-k in one bin, and 1 - (1 - p)^M in any of M.  Not modelled: noise resonances narrower than
some 60 bins, which count as lines; lines of fewer than about 6 cycles in the record are not sought, slow noise looks
like them.  Of a line that wanders (a third significant value within 32 bins) two lines are removed, marked as not
steady; what is left of it stays.  Estimates are least squares of all lines together with level and slope, found by
Gauss-Newton steps on exact sums.
[DRIFT-PERIODIC; Xia 2008, eq. 3.4.2..3.4.5 with EX11]
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft, ndimage, special

from gyrobench.arrays import Array
from gyrobench.reduction.series.checks import SeriesError, checked, checked_step

LEVEL = 1e-3  # false-alarm probability of a whole record
HALF = 64  # bins of the level on either side
LEAST_NEIGHBOURS = 8
EULER = 0.5772156649015329  # E ln of a unit exponential is minus this
MOST = 20  # lines
SWEEPS = 20
CLUSTER = 32  # bins: two lines may be as near as that, of more it is one that wanders


@dataclass(frozen=True)
class SpectralLine:
    """One line with standard uncertainties; phase of the sine at the first sample."""

    frequency: float  # Hz
    u_frequency: float
    amplitude: float
    u_amplitude: float
    phase: float  # rad, -pi..pi; standard uncertainty 2 u_amplitude/amplitude
    false_alarm: float  # probability that a record without lines shows one as clear as this
    steady: bool = True  # False: power around it that is no third line, so its frequency or amplitude changes


@dataclass(frozen=True)
class Lines:
    """Lines of a record and what is left of it."""

    lines: tuple[SpectralLine, ...]
    residual: Array  # (n,) the series without the lines; level and slope stay in
    level: float  # asked-for false-alarm probability
    complete: bool  # False: the most lines were found, there may be more


@dataclass
class _Fitted:
    f: float
    density: float  # of the noise around it
    false_alarm: float
    steady: bool = True
    c: complex = 0j  # b - i a, about the middle of the record


class _Removal:
    """Least squares of lines, level and slope; ``padded`` holds the residual.

    The record is cut into blocks: the sums of a sine over it are products of two short tables.
    """

    def __init__(self, x: Array, dt: float) -> None:
        self.n, self.dt = x.size, dt
        self.block = max(1, math.isqrt(self.n))
        self.rows = -(-self.n // self.block)
        self.within = dt * np.arange(self.block)
        # from the middle of the record
        self.starts = dt * self.block * np.arange(self.rows) - dt * (self.n - 1) / 2.0
        self.padded = self.pad(x)
        self.time = (np.arange(self.n) - (self.n - 1) / 2.0) / self.n  # of the record, -1/2..1/2
        self.lines: list[_Fitted] = []

    def pad(self, x: Array) -> Array:
        return np.pad(x, (0, self.rows * self.block - self.n))

    def tables(self, f: float) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
        return np.exp(2j * math.pi * f * self.starts), np.exp(2j * math.pi * f * self.within)

    def sums(self, f: float) -> tuple[complex, complex]:
        """Return the sums of r exp(-i phi) and of t r exp(-i phi), t from the middle of the record."""
        phase, inner = self.tables(f)
        weights = np.column_stack([inner.real, inner.imag, self.within * inner.real, self.within * inner.imag])
        both = self.padded.reshape(self.rows, self.block) @ weights
        y0, y1 = both[:, 0] - 1j * both[:, 1], both[:, 2] - 1j * both[:, 3]
        turned = np.conj(phase)
        return complex(turned @ y0), complex(turned @ (self.starts * y0 + y1))

    def add(self, padded: Array, line: _Fitted, sign: float) -> None:
        """Add sign Re(c exp(i phi)) in place."""
        phase, inner = self.tables(line.f)
        turned = sign * line.c * phase
        X = padded.reshape(self.rows, self.block)
        X += np.column_stack([turned.real, -turned.imag]) @ np.stack([inner.real, inner.imag])
        padded[self.n :] = 0.0

    def fit(self) -> None:
        """Make Gauss-Newton steps, one line after the other, until no parameter moves by a thousandth of its u."""
        r, n, T = self.padded[: self.n], self.n, self.n * self.dt
        for sweep in range(SWEEPS):
            mean, slope = float(r.mean()), 12.0 * float(self.time @ r) / n
            r -= mean + slope * self.time
            moved = 0.0
            for line in self.lines:
                s0, s1 = self.sums(line.f)
                step = 2.0 * s0 / n
                df = 0.0
                if abs(line.c) > 0.0:
                    gradient = -2.0 * math.pi * (s1.conjugate() * line.c).imag
                    df = gradient / (n / 2.0 * (2.0 * math.pi * abs(line.c)) ** 2 * T * T / 12.0)
                    df = max(-0.3 / T, min(0.3 / T, df))
                self.add(self.padded, line, 1.0)
                line.f, line.c = line.f + df, line.c + step
                self.add(self.padded, line, -1.0)
                variance = max(line.density / T, 1e-300)  # of its amplitude
                moved = max(moved, abs(step) ** 2 / variance, (abs(line.c) * df * T) ** 2 / variance)
            if not self.lines or (sweep > 1 and moved < 1e-6):
                break


def _periodogram(r: Array, dt: float) -> Array:
    """Return the one-sided density at j/(n dt), j = 0..n/2."""
    power = np.abs(fft.rfft(r)) ** 2
    power *= 2.0 * dt / r.size
    return np.asarray(power)


def local_level(density: Array) -> tuple[Array, Array]:
    """Return density (of the noise) and gamma degrees k around each bin of a periodogram, k = 0 where too few bins.

    Bins 0 and the last are no ordinary ones and enter nothing.
    """
    last = density.size - 2
    log = np.log(np.maximum(density[1 : last + 1], 1e-300)) + EULER
    n = log.size
    mean, k = np.zeros(density.size), np.zeros(density.size)
    if n > 2 * HALF:
        # mirrored at the end: the spectrum of a sampled series is even about the highest frequency
        total = ndimage.uniform_filter1d(log, 2 * HALF + 1, mode="reflect") * (2 * HALF + 1)
        near = ndimage.uniform_filter1d(log, 3, mode="reflect") * 3.0
        mean[1 : last + 1] = (total - near) / (2 * HALF - 2)
        k[1 : last + 1] = _gamma_degrees(1.0 / (2 * HALF - 2))
    for j, rows, weight, degrees in _low_bins(min(n, 3 * HALF)):
        mean[j], k[j] = weight @ log[rows - 1], degrees
    return np.exp(mean), k


@functools.cache
def _low_bins(n: int) -> tuple[tuple[int, NDArray[np.int_], Array, float], ...]:
    """Return bin, neighbours, weights of the line over log f at the bin, degrees (0: too few neighbours)."""
    out = []
    for j in range(1, min(n, 2 * HALF) + 1):
        rows = np.arange(max(1, j // 2, j - HALF), min(n, 2 * j, j + HALF) + 1)
        rows = rows[np.abs(rows - j) > 1]
        if rows.size < LEAST_NEIGHBOURS:
            out.append((j, rows, np.zeros(rows.size), 0.0))
            continue
        d = np.log(rows / j)
        s0, s1, s2 = float(rows.size), float(d.sum()), float(d @ d)
        weight = (s2 - s1 * d) / (s0 * s2 - s1 * s1)
        out.append((j, rows, weight, _gamma_degrees(float(weight @ weight))))
    return tuple(out)


@functools.cache
def _gamma_degrees(share: float) -> float:
    """Return k with trigamma(k) = share pi^2/6."""
    target, k = share * math.pi**2 / 6.0, 1.0 / (share * math.pi**2 / 6.0) + 0.5
    for _ in range(20):
        k -= (float(special.polygamma(1, k)) - target) / float(special.polygamma(2, k))
    return k


def _one_bin(ratio: Array, k: Array) -> Array:
    return np.asarray(np.exp(-k * np.log1p(ratio * np.exp(-special.digamma(k)))))


def find_lines(x: Any, dt: float, level: float = LEVEL) -> Lines:
    """Find the lines of a record (n,) sampled every ``dt`` s, with the false-alarm probability ``level`` of the record.

    Raises SeriesError for fewer than 64 samples and a level outside 0..0.5.
    """
    x, dt = checked(x, 64), checked_step(dt)
    if not 0.0 < level < 0.5:
        raise SeriesError(f"false-alarm probability {level}: it must lie between 0 and 0.5")
    removal, n = _Removal(x, dt), x.size
    removal.fit()
    complete = False
    for _ in range(MOST):
        density = _periodogram(removal.padded[:n], dt)
        around, k = local_level(density)
        tested = np.flatnonzero(k > 0.0)
        ratio = density[tested] / around[tested]
        clear = ratio > 3.0  # chance has a twentieth beyond; nothing below is ever a line
        j = tested[clear]
        p = -np.expm1(tested.size * np.log1p(-np.minimum(_one_bin(ratio[clear], k[j]), 0.5)))
        found = [(int(a), float(b)) for a, b in zip(j, p, strict=True) if b < level]
        if not found:
            complete = True
            break
        taken: list[int] = []
        for bin_, chance in sorted(found, key=lambda item: -density[item[0]]):
            # of what a stronger line leaks into this bin nothing is left after the next pass
            if any(abs(bin_ - o) <= 2 or density[bin_] <= density[o] / (abs(bin_ - o) - 1.0) ** 2 for o in taken):
                continue
            beside = [line for line in removal.lines if abs(line.f * n * dt - bin_) < CLUSTER]
            if len(beside) >= 2:
                for line in beside:
                    line.steady = False
            elif len(removal.lines) < MOST:
                taken.append(bin_)
                f = _interpolated(removal, bin_)
                removal.lines.append(_Fitted(f, float(around[bin_]), chance))
        complete = not taken and len(removal.lines) < MOST
        removal.fit()
        if not taken or len(removal.lines) >= MOST:
            break
    return _finished(x, removal, level, complete)


def _interpolated(removal: _Removal, bin_: int) -> float:
    """Return the frequency between the bins: of three transforms about the peak, as of a single line."""
    T = removal.n * removal.dt
    sums = (removal.sums((bin_ + d) / T)[0] for d in (-1, 0, 1))
    # shifted by half a record from bin to bin: the sums are about the middle, where neighbours have opposite signs
    low, mid, high = (s * sign for s, sign in zip(sums, (-1.0, 1.0, -1.0), strict=True))
    bottom = 2.0 * mid - low - high
    shift = float(np.real((low - high) / bottom)) if abs(bottom) > 0.0 else 0.0
    return (bin_ + max(-0.6, min(0.6, shift))) / T


def _finished(x: Array, removal: _Removal, level: float, complete: bool) -> Lines:
    n, dt = removal.n, removal.dt
    T = n * dt
    around, _ = local_level(_periodogram(removal.padded[:n], dt))
    lines, residual = [], removal.pad(x)
    for line in removal.lines:
        removal.add(residual, line, -1.0)
        S = float(around[min(max(round(line.f * T), 1), around.size - 2)])
        A = abs(line.c)
        u = math.sqrt(S / T)
        b, a = line.c.real, -line.c.imag
        phase = math.atan2(b, a) - 2.0 * math.pi * line.f * dt * (n - 1) / 2.0
        phase = (phase + math.pi) % (2.0 * math.pi) - math.pi
        u_f = math.sqrt(3.0) * u / (math.pi * A * T)
        lines.append(SpectralLine(line.f, u_f, A, u, phase, line.false_alarm, line.steady))
    lines.sort(key=lambda line: -line.amplitude)
    return Lines(tuple(lines), residual[:n].copy(), level, complete)
